//! Step-response characteristics of a curve between two cursors.
//!
//! The curve goes from its value at the first cursor to its final value, the mean of the last tenth between the
//! cursors. Overshoot is how far it goes beyond the final value, in percent of that change. Settling time is how
//! long after the first cursor it stays within 2 % of that change about the final value, up to the second cursor.

use std::ops::Range;

use super::decimate::Indexed;

/// Half of the band in which a curve counts as settled, of the change.
const SETTLED: f64 = 0.02;
/// Fewer samples have no shape.
const FEWEST: usize = 10;

/// Overshoot and settling time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct StepResponse {
    /// Beyond the final value, percent of the change; `None` if there is no change.
    pub(super) overshoot_percent: Option<f64>,
    /// After the first cursor, s; `None` if the curve leaves the band up to the end.
    pub(super) settling_s: Option<f64>,
}

/// Of the samples of a range.
pub(super) fn step_response(curve: &Indexed<'_>, range: Range<usize>) -> StepResponse {
    let none = StepResponse::default();
    if range.len() < FEWEST || !curve.y(range.start).is_finite() {
        return none;
    }
    let tail = range.end - range.len().div_ceil(10)..range.end;
    let (Some(all), Some(tail)) = (curve.statistics(range.clone()), curve.statistics(tail)) else {
        return none;
    };
    let (start, end) = (curve.y(range.start), tail.mean);
    let change = end - start;
    // A signal that changes less than it moves at the end has no step.
    if change == 0.0 || change.abs() <= tail.std {
        return none;
    }
    let beyond = if change > 0.0 { all.max - end } else { end - all.min };
    let band = SETTLED * change.abs();
    let last = curve.last_outside(range.clone(), [end - band, end + band]);
    let settled = last.map_or(range.start, |last| last + 1);
    StepResponse {
        overshoot_percent: Some(100.0 * (beyond / change.abs()).max(0.0)),
        settling_s: (settled < range.end).then(|| curve.x(settled) - curve.x(range.start)),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::decimate::{Data, DecimationCache};
    use super::*;

    /// A second-order step response at 1 kHz from `from` by `change`, angular frequency 1 rad/s.
    fn respond(damping: f64, from: f64, change: f64) -> StepResponse {
        let x: Vec<f64> = (0..100_000).map(|index| f64::from(index) * 1e-3).collect();
        let respond = |t: f64| {
            if damping == 1.0 {
                return 1.0 - (1.0 + t) * (-t).exp();
            }
            let root = (1.0 - damping * damping).sqrt();
            1.0 - (-damping * t).exp() * ((root * t).cos() + damping / root * (root * t).sin())
        };
        let y: Vec<f64> = x.iter().map(|t| from + change * respond(*t)).collect();
        let mut cache = DecimationCache::default();
        step_response(&cache.indexed(Data::Fixed(&x, &y), [1.0, 1.0], 1), 0..x.len())
    }

    #[test]
    fn second_order_responses_have_the_overshoot_and_settling_time_of_the_textbook() {
        // Settling within 2 % at a natural frequency of 1 rad/s; 5.834 solves (1 + t)·exp(−t) = 0.02.
        for (damping, settling_s) in [(1.0, 5.834), (0.7, 5.979), (0.5, 8.076)] {
            for (from, change) in [(0.0, 1.0), (3.0, -0.25)] {
                let found = respond(damping, from, change);
                let overshoot = if damping < 1.0 {
                    100.0 * (-PI * damping / (1.0 - damping * damping).sqrt()).exp()
                } else {
                    0.0
                };
                let found_overshoot = found.overshoot_percent.unwrap();
                assert!(
                    (found_overshoot - overshoot).abs() < 1e-3,
                    "{damping}: {found_overshoot} {overshoot}"
                );
                assert!((found.settling_s.unwrap() - settling_s).abs() < 2e-3, "{damping}: {found:?}");
            }
        }
    }

    #[test]
    fn a_curve_that_does_not_settle_or_change_is_reported() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let swing: Vec<f64> = x.iter().map(|x| if x % 2.0 < 1.0 { 1.0 } else { -1.0 }).collect();
        let ramp = x.clone();
        for (y, settles) in [(&vec![2.0; 1000], false), (&swing, false), (&ramp, false)] {
            let mut cache = DecimationCache::default();
            let curve = cache.indexed(Data::Fixed(&x, y), [1.0, 2.0], 1);
            let found = step_response(&curve, 0..1000);
            assert_eq!(found.settling_s.is_some(), settles, "{found:?}");
            assert_eq!(step_response(&curve, 5..9), StepResponse::default(), "too few samples");
        }
    }
}
