//! Numbers of several robots side by side, one in each lane of a vector register.

use std::ops::{Add, Div, Mul, Sub};

use pulp::Simd;

use super::number::Number;

/// Lanes of the widest registers.
pub(super) const MAX_LANES: usize = 8;

/// One number for each robot.
#[derive(Clone, Copy)]
pub(super) struct Lanes<S: Simd> {
    simd: S,
    values: S::f64s,
}

/// A yes or no for each robot.
#[derive(Clone, Copy)]
pub(super) struct Mask<S: Simd> {
    simd: S,
    values: S::m64s,
}

impl<S: Simd> Lanes<S> {
    /// One number of each item, as many items as there are lanes.
    #[inline(always)]
    pub(super) fn of<T>(simd: S, items: &[T], number: impl Fn(&T) -> f64) -> Self {
        let mut array = [0.0; MAX_LANES];
        for (lane, item) in array[..S::F64_LANES].iter_mut().zip(items) {
            *lane = number(item);
        }
        Self::from_array(simd, &array)
    }

    /// The first numbers of an array.
    #[inline(always)]
    pub(super) fn from_array(simd: S, array: &[f64; MAX_LANES]) -> Self {
        Self { simd, values: S::as_simd_f64s(array).0[0] }
    }

    #[inline(always)]
    pub(super) fn to_array(self) -> [f64; MAX_LANES] {
        let mut array = [0.0; MAX_LANES];
        S::as_mut_simd_f64s(&mut array).0[0] = self.values;
        array
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        Self { values: self.simd.abs_f64s(self.values), ..self }
    }

    /// 1 or −1, with the sign of each number, zeros included.
    #[inline(always)]
    pub(super) fn signum(self) -> Self {
        let one = self.simd.splat_f64s(1.0);
        Self { values: self.simd.or_f64s(one, self.masked((-0.0_f64).to_bits()).values), ..self }
    }

    /// The bits that are set in `mask`.
    #[inline(always)]
    pub(super) fn masked(self, mask: u64) -> Self {
        let mask = self.simd.splat_f64s(f64::from_bits(mask));
        Self { values: self.simd.and_f64s(self.values, mask), ..self }
    }

    #[inline(always)]
    pub(super) fn at_least(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.greater_than_or_equal_f64s(self.values, other.values) }
    }

    #[inline(always)]
    pub(super) fn equals(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, values: self.simd.equal_f64s(self.values, other.values) }
    }
}

impl<S: Simd> Mask<S> {
    #[inline(always)]
    pub(super) fn and(self, other: Self) -> Self {
        Self { values: self.simd.and_m64s(self.values, other.values), ..self }
    }

    #[inline(always)]
    pub(super) fn or(self, other: Self) -> Self {
        Self { values: self.simd.or_m64s(self.values, other.values), ..self }
    }

    #[inline(always)]
    pub(super) fn select(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes { simd: self.simd, values: self.simd.select_f64s(self.values, yes.values, no.values) }
    }

    #[inline(always)]
    pub(super) fn select_mask(self, yes: Self, no: Self) -> Self {
        let not = self.simd.not_m64s(self.values);
        let yes = self.simd.and_m64s(self.values, yes.values);
        Self { values: self.simd.or_m64s(yes, self.simd.and_m64s(not, no.values)), ..self }
    }

    #[inline(always)]
    pub(super) fn all(self) -> bool {
        self.simd.reduce_min_f64s(self.ones()) == 1.0
    }

    #[inline(always)]
    pub(super) fn any(self) -> bool {
        self.simd.reduce_max_f64s(self.ones()) == 1.0
    }

    #[inline(always)]
    pub(super) fn to_array(self) -> [bool; MAX_LANES] {
        Lanes { simd: self.simd, values: self.ones() }.to_array().map(|one| one == 1.0)
    }

    #[inline(always)]
    fn ones(self) -> S::f64s {
        self.simd.select_f64s(self.values, self.simd.splat_f64s(1.0), self.simd.splat_f64s(0.0))
    }
}

macro_rules! lanewise {
    ($($operator:ident, $method:ident, $simd_method:ident;)*) => {$(
        impl<S: Simd> $operator for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { values: self.simd.$simd_method(self.values, other.values), ..self }
            }
        }
    )*};
}

lanewise! {
    Add, add, add_f64s;
    Sub, sub, sub_f64s;
    Mul, mul, mul_f64s;
    Div, div, div_f64s;
}

impl<S: Simd> Number for Lanes<S> {
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self { values: self.simd.splat_f64s(value), ..self }
    }
}
