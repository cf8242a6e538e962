//! Number types of the laws of motion: one robot's number, or those of several robots side by side.

use std::ops::{Add, Div, Mul, Sub};

/// A number of one robot, or lane by lane of several. Every operation rounds as on doubles, none is
/// contracted, so that a lane takes the same path to the last bit as a robot alone.
pub(in crate::simulate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A constant, as wide as this number.
    fn constant(self, value: f64) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }
}
