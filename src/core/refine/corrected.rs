//! A declared number as a log has it: its value, how sure it is, and whether the log determines it at all.

use super::verdict::Corrected;

/// A number is determined by a log if the standard error by the rows alone is below this fraction of its tolerance.
const DETERMINED: f64 = 0.5;

/// The coefficient of a declared number in a fit.
pub(super) struct Coefficient {
    /// Within its bounds.
    pub(super) value: f64,
    /// Without bounds, with its standard error.
    pub(super) estimate: f64,
    pub(super) error: f64,
    /// Standard error by the rows alone.
    pub(super) alone: f64,
    /// How far the number may be off; infinite if it is free.
    pub(super) tolerance: f64,
    /// Quantile of a 95 % interval, in standard errors.
    pub(super) quantile: f64,
}

impl Coefficient {
    /// The number for this coefficient; `number` turns a coefficient into the declared number with it.
    pub(super) fn corrected(
        &self,
        key: &'static str,
        declared: f64,
        number: impl Fn(f64) -> f64,
    ) -> Corrected {
        let free = self.tolerance.is_infinite();
        // What stays as declared beside an effect that stands for it is no estimate.
        let is_fixed = self.error == 0.0;
        let determined = !is_fixed && (free || self.alone < DETERMINED * self.tolerance);
        let at_bound = !free && self.value.abs() >= (1.0 - 1e-9) * self.tolerance;
        let width = self.quantile * self.error;
        let (low, high) = (self.estimate - width, self.estimate + width);
        // At a bound, the interval goes inward from there alone.
        let (low, high) = match at_bound {
            true if self.value > 0.0 => (low.min(self.value - width), self.value),
            true => (self.value, high.max(self.value + width)),
            false => (low.min(self.value), high.max(self.value)),
        };
        Corrected {
            key,
            declared,
            value: number(self.value),
            ci95: determined.then(|| [number(low), number(high)]),
            tolerance: (!free).then(|| (number(self.tolerance) - number(0.0)).abs()),
            determined,
            at_bound,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coefficient(value: f64, estimate: f64, alone: f64) -> Coefficient {
        Coefficient { value, estimate, error: 0.1, alone, tolerance: 0.5, quantile: 2.0 }
    }

    #[test]
    fn a_number_is_determined_or_told_with_its_tolerance() {
        let found = coefficient(0.2, 0.2, 0.1).corrected("x", 10.0, |change| 10.0 + change);
        assert!(found.determined && !found.at_bound);
        let [low, high] = found.ci95.unwrap();
        assert!((low - 10.0).abs() < 1e-12 && (high - 10.4).abs() < 1e-12);
        let found = coefficient(0.2, 0.2, 0.3).corrected("x", 10.0, |change| 10.0 + change);
        assert_eq!((found.determined, found.ci95, found.tolerance), (false, None, Some(0.5)));
    }

    #[test]
    fn at_a_bound_the_interval_goes_inward_alone() {
        for side in [1.0, -1.0] {
            let found = coefficient(0.5 * side, 0.9 * side, 0.1).corrected("x", 10.0, |change| 10.0 + change);
            let [low, high] = found.ci95.unwrap();
            assert!(found.at_bound && high - low > 0.1, "{low} {high}");
            assert!((if side > 0.0 { high } else { low } - found.value).abs() < 1e-12);
        }
    }
}
