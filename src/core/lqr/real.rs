//! The scalars of the Riccati solvers: `f64`, and [`DoubleDouble`](super::double_double::DoubleDouble)
//! where a double cannot hold the answer.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number type over which doubling, Newton's method and the QR algorithm are written once.
pub(super) trait Real:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    const ZERO: Self;
    const ONE: Self;
    /// Spacing of the numbers next to 1.
    const EPSILON: f64;
    /// Squarings after which a matrix whose powers have not died out counts as not stable: its spectral
    /// radius is then nearer to 1 than rounding lets us tell.
    const SQUARINGS: usize;

    fn from_f64(value: f64) -> Self;
    /// The nearest double.
    fn to_f64(self) -> f64;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;

    /// `self · factor` for a power of two, without rounding.
    fn scaled(self, factor: f64) -> Self;

    fn is_finite(self) -> bool {
        self.to_f64().is_finite()
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: f64 = f64::EPSILON;
    const SQUARINGS: usize = 30;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
}
