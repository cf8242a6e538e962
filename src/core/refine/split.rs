//! Which part of a log is held out where no other logs are.

/// Fraction of a log that is fitted.
const FITTED: f64 = 2.0 / 3.0;
/// Between the part that is fitted and the part that is held out, s.
const GAP_S: f64 = 0.5;

/// Least fraction of the rows in motion that a part that is held out by time must have.
const LEAST_MOTION: f64 = 1.0 / 6.0;

/// Where the fitted part of a log ends and where the held-out part begins, from the times of its rows in motion, s: by time,
/// unless the end of the log has little motion.
pub(super) fn split_rows_s(times_s: &[f64], length_s: f64) -> [f64; 2] {
    let by_time = split_s(length_s);
    let held_out = times_s.iter().filter(|time| **time >= by_time[1]).count();
    if held_out as f64 >= LEAST_MOTION * times_s.len() as f64 {
        return by_time;
    }
    let end = (FITTED * times_s.len() as f64) as usize;
    let end_s = times_s.get(end).copied().unwrap_or(f64::INFINITY);
    [end_s, end_s + GAP_S]
}

/// End of the fitted part of a log and start of the held-out part, from its start and for its length in s.
pub(super) fn split_s(length_s: f64) -> [f64; 2] {
    [FITTED * length_s, FITTED * length_s + GAP_S]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standing still at the end of a log changes nothing.
    #[test]
    fn the_last_third_of_the_motion_is_held_out() {
        let moving: Vec<f64> = (0..900).map(|row| 0.1 * f64::from(row)).collect();
        for length_s in [90.0, 300.0] {
            let [end_s, begin_s] = split_rows_s(&moving, length_s);
            assert!((end_s - 60.0).abs() < 1e-9 && (begin_s - 60.5).abs() < 1e-9);
        }
    }
}
