//! Which part of a log is held out where no other logs are.

/// Fraction of a log that is fitted.
const FITTED: f64 = 2.0 / 3.0;
/// Between the part that is fitted and the part that is held out, s.
const GAP_S: f64 = 0.5;

/// End of the fitted part of a log and start of the held-out part, from its start and for its length in s.
pub(super) fn split_s(length_s: f64) -> [f64; 2] {
    [FITTED * length_s, FITTED * length_s + GAP_S]
}
