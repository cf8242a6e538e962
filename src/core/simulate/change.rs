//! The instant inside a step at which a phase of motion ends.

/// Changes of phase within one substep after which resting shafts are taken as stuck for the rest of it.
pub(super) const MAX_CHANGES: usize = 8;
/// Fraction of a step to which the instant is located.
const TOLERANCE: f64 = 1e-9;

/// Fraction of a step at which `margin_at` has just fallen below 0, for a margin of at least 0 at share 0 and
/// below 0 at share 1: by secants, with a bisection after each that was slow. A margin that is not a
/// number counts as below 0.
pub(super) fn first_below_zero(start: f64, end: f64, margin_at: impl Fn(f64) -> f64) -> f64 {
    let mut holds = (0.0, start);
    let mut ended = (1.0, end);
    let mut bisect = false;
    while ended.0 - holds.0 > TOLERANCE {
        let width = ended.0 - holds.0;
        let share = if bisect || !ended.1.is_finite() {
            holds.0 + 0.5 * width
        } else {
            // A little beyond the secant, so that both ends close in.
            let secant = holds.0 + width * holds.1 / (holds.1 - ended.1);
            (secant + 0.4 * TOLERANCE).clamp(holds.0, ended.0)
        };
        let margin = margin_at(share);
        if margin >= 0.0 {
            holds = (share, margin);
        } else {
            ended = (share, margin);
        }
        bisect = ended.0 - holds.0 > 0.5 * width;
    }
    ended.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossing_is_found_from_above_whatever_the_shape() {
        let shapes: [(&dyn Fn(f64) -> f64, f64); 4] = [
            (&|t| 0.3 - t, 0.3),
            (&|t| 1e-9 - t * t * t, 1e-3),
            (&|t| if t < 0.77 { 1e6 } else { -1e-6 }, 0.77),
            (&|t| f64::min(0.5 - t, 0.2 - t * t), 0.2_f64.sqrt()),
        ];
        for (margin, exact) in shapes {
            let found = first_below_zero(margin(0.0), margin(1.0), margin);
            assert!(margin(found) < 0.0 && found - exact < 1.1e-9, "{found} for {exact}");
        }
    }

    #[test]
    fn margin_that_is_not_finite_ends_the_search_as_well() {
        for broken in [f64::NAN, f64::NEG_INFINITY] {
            let margin = |t: f64| if t < 0.4 { 1.0 - t } else { broken };
            let found = first_below_zero(1.0, broken, margin);
            assert!((found - 0.4).abs() < 1.1e-9, "{found}");
        }
    }
}
