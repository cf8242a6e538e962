//! Warnings about fits that look better than they are.

use super::intervals::Confidence;
use super::parameters::{KEYS, OFFSET, Point, STATIC};
use super::search_box::one_direction;
use super::{Bounds, FrictionPair, SearchBox};

/// Above this condition number of scaled JᵀJ parameters trade off against each other; a well-posed curve has 20.
const ILL_CONDITIONED: f64 = 1e3;
/// Distinct speeds below which six parameters are hardly more than an interpolation.
const FEW_SPEEDS: usize = 7;
/// The Stribeck effect shows below this speed, rad/s.
const SLOW_RAD_S: f64 = 0.2;

/// Limitations of the pairs, independent of the fit.
pub(super) fn pair_warnings(pairs: &[FrictionPair], range: &SearchBox) -> Vec<String> {
    let mut warnings = Vec::new();
    let magnitudes = distinct_speeds(pairs.iter().map(|p| p.speed_rad_s.abs()));
    if magnitudes < FEW_SPEEDS {
        warnings.push(format!(
            "the pairs have only {magnitudes} distinct speeds: six parameters need at least {FEW_SPEEDS}, record more speeds"
        ));
    }
    let slowest = pairs.iter().map(|p| p.speed_rad_s.abs()).fold(f64::INFINITY, f64::min);
    if slowest >= SLOW_RAD_S {
        warnings.push(format!(
            "the slowest pair is at {slowest:.3} rad/s, none is below {SLOW_RAD_S} rad/s: `static_nm`, \
             `stribeck_speed_rad_s` and `stribeck_exponent` are extrapolated, record slower speeds"
        ));
    }
    if one_direction(pairs) {
        let done = if range.width(OFFSET) > 0.0 { "only their sum is identified" } else { "is set to 0" };
        warnings.push(format!(
            "all speeds have the same direction: `offset_nm` cannot be separated from `coulomb_nm` and {done}, \
             record the other direction too"
        ));
    }
    warnings
}

/// Limitations of the fit.
pub(super) fn fit_warnings(
    point: &Point,
    range: &SearchBox,
    bounds: Bounds,
    confidence: Option<&Confidence>,
) -> Vec<String> {
    let mut warnings: Vec<String> = bound_warnings(point, range, bounds).collect();
    let Some(confidence) = confidence else { return warnings };
    let loose: Vec<&str> = (0..6).filter(|&d| is_loose(point, confidence, d)).map(|d| KEYS[d]).collect();
    if !loose.is_empty() {
        warnings.push(format!(
            "the data do not determine `{}`: the 95 % interval is wider than the value or unbounded within the \
             search range; assess the fit by its curve over the measured speeds",
            loose.join("`, `")
        ));
    }
    if confidence.condition > ILL_CONDITIONED {
        warnings.push(format!(
            "the parameters trade off against each other (condition number {:.1e}): other values fit equally well",
            confidence.condition
        ));
    }
    warnings
}

fn bound_warnings(point: &Point, range: &SearchBox, bounds: Bounds) -> impl Iterator<Item = String> {
    (0..6).filter(|&d| range.width(d) > 0.0).filter_map(move |d| {
        let tolerance = 1e-9 * range.width(d);
        let side = if point[d] - range.lower[d] <= tolerance {
            "lower"
        } else if range.upper[d] - point[d] <= tolerance {
            "upper"
        } else {
            return None;
        };
        let cause = match bounds {
            Bounds::Paper => "the paper's bound excludes the optimum, fit with bounds from the data",
            Bounds::Data => "the data do not determine it, or the model lacks an effect",
        };
        Some(format!("`{}` = {:.3e} is at the {side} end of its search range: {cause}", KEYS[d], point[d]))
    })
}

/// The offset may well be zero, so its interval is held against the friction level.
fn is_loose(point: &Point, confidence: &Confidence, d: usize) -> bool {
    let size = if d == OFFSET { point[STATIC] } else { point[d].abs() };
    confidence.intervals[d].is_some_and(|[low, high]| confidence.open[d] || high - low > size)
}

/// Number of speeds that differ from the next slower one by more than 5 % and 0.01 rad/s.
pub(super) fn distinct_speeds(speeds: impl Iterator<Item = f64>) -> usize {
    let mut sorted: Vec<f64> = speeds.collect();
    sorted.sort_by(f64::total_cmp);
    let mut last = f64::NEG_INFINITY;
    let mut count = 0;
    for speed in sorted {
        if speed - last > 0.05 * speed.abs() + 0.01 {
            count += 1;
            last = speed;
        }
    }
    count
}
