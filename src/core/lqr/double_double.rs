//! Numbers of 106 bits as unevaluated sums of two doubles, by error-free transforms (Dekker, Numer. Math.
//! 18, 1971; Knuth, TAOCP 2, 4.2.2). Products are split rather than fused: without the instruction in the
//! target's base set `f64::mul_add` is a call into a library.

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use super::real::Real;

/// high + low with |low| ≤ half a unit in the last place of high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DoubleDouble {
    high: f64,
    low: f64,
}

/// a + b = sum + error, exactly.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    let part = high - a;
    DoubleDouble { high, low: (a - (high - part)) + (b - part) }
}

/// As [`two_sum`] for |a| ≥ |b|.
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    DoubleDouble { high, low: b - (high - a) }
}

/// The upper and the lower 26 bits.
#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    const SPLITTER: f64 = 134_217_729.0; // 2²⁷ + 1
    let scaled = SPLITTER * a;
    let upper = scaled - (scaled - a);
    (upper, a - upper)
}

/// a · b = product + error, exactly.
#[inline(always)]
fn two_product(a: f64, b: f64) -> DoubleDouble {
    let high = a * b;
    let ((a_upper, a_lower), (b_upper, b_lower)) = (split(a), split(b));
    let low = ((a_upper * b_upper - high) + a_upper * b_lower + a_lower * b_upper) + a_lower * b_lower;
    DoubleDouble { high, low }
}

impl From<f64> for DoubleDouble {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl From<DoubleDouble> for f64 {
    fn from(value: DoubleDouble) -> Self {
        value.high
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let high = two_sum(self.high, other.high);
        let low = two_sum(self.low, other.low);
        let sum = quick_two_sum(high.high, high.low + low.high);
        quick_two_sum(sum.high, sum.low + low.low)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.high, other.high);
        quick_two_sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for DoubleDouble {
    type Output = Self;

    /// Long division, three digits of one double each.
    #[expect(clippy::suspicious_arithmetic_impl, reason = "that is how long division goes")]
    fn div(self, other: Self) -> Self {
        let mut remainder = self;
        let mut digit = || {
            let quotient = remainder.high / other.high;
            remainder -= other * Self::from_f64(quotient);
            quotient
        };
        let (first, second, third) = (digit(), digit(), digit());
        quick_two_sum(first, second) + Self::from_f64(third)
    }
}

impl AddAssign for DoubleDouble {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for DoubleDouble {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl PartialOrd for DoubleDouble {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.high.partial_cmp(&other.high) {
            Some(Ordering::Equal) => self.low.partial_cmp(&other.low),
            order => order,
        }
    }
}

impl Real for DoubleDouble {
    const ZERO: Self = Self { high: 0.0, low: 0.0 };
    const ONE: Self = Self { high: 1.0, low: 0.0 };
    const EPSILON: f64 = f64::EPSILON * f64::EPSILON;
    const SQUARINGS: usize = 50;

    fn from_f64(value: f64) -> Self {
        value.into()
    }

    fn to_f64(self) -> f64 {
        self.into()
    }

    /// One Newton step from the double's root (Karp).
    fn sqrt(self) -> Self {
        if self.high <= 0.0 {
            return Self::from_f64(self.high.sqrt());
        }
        let root = self.high.sqrt();
        let remainder = self - two_product(root, root);
        quick_two_sum(root, remainder.high / (2.0 * root))
    }

    fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self { high: self.high * factor, low: self.low * factor }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64) -> DoubleDouble {
        DoubleDouble::from_f64(value)
    }

    /// |found − expected| in units of 2⁻¹⁰⁴ of `expected`.
    fn error(found: DoubleDouble, expected: DoubleDouble) -> f64 {
        ((found - expected) / expected).abs().to_f64() / DoubleDouble::EPSILON
    }

    #[test]
    fn keeps_what_a_double_rounds_away() {
        let tiny = 2.0_f64.powi(-80);
        assert_eq!((number(1.0) + number(tiny) - number(1.0)).to_f64(), tiny);
        // (2²⁷ + 1)² needs 55 bits
        let square = number(134_217_729.0) * number(134_217_729.0);
        assert_eq!((square - number(2.0_f64.powi(54)) - number(2.0_f64.powi(28))).to_f64(), 1.0);
    }

    #[test]
    fn quotient_and_root_invert_product_and_square() {
        for value in [2.0, 0.1, 3e-40, 7.7e50] {
            let root = number(value).sqrt();
            assert!(error(root * root, number(value)) < 4.0, "{value}");
            let third = number(value) / number(3.0);
            assert!(error(third * number(3.0), number(value)) < 4.0, "{value}");
        }
    }

    /// √2 to 32 digits: high and low parts from the published decimal expansion.
    #[test]
    fn root_of_two_has_the_published_digits() {
        let expected = DoubleDouble { high: std::f64::consts::SQRT_2, low: -9.667_293_313_452_913e-17 };
        assert!(error(number(2.0).sqrt(), expected) < 2.0);
    }

    #[test]
    fn order_looks_at_both_parts() {
        let above = number(1.0) + number(1e-25);
        assert!(above > number(1.0) && number(-1.0) < above && (-above).abs() == above);
        assert!(number(f64::NAN).partial_cmp(&above).is_none());
    }
}
