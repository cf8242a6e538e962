//! Stretches of rows over which a column keeps its value.

use std::ops::Range;

fn runs(values: &[f64]) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    values.chunk_by(|a, b| a == b).map(move |run| {
        start += run.len();
        start - run.len()..start
    })
}

/// The longest of them, the last of those that are as long.
pub(crate) fn longest_run(values: &[f64]) -> Option<Range<usize>> {
    runs(values).max_by_key(ExactSizeIterator::len)
}

/// Rows for which a value usually stays before it changes: the median over the runs of equal values.
pub(crate) fn usual_run(values: &[f64]) -> usize {
    let mut lengths: Vec<usize> = runs(values).map(|run| run.len()).collect();
    // A rest or a saturated stretch is one long run; the runs of a slow sensor are many.
    if lengths.len() < 10 {
        return 1;
    }
    let middle = lengths.len() / 2;
    *lengths.select_nth_unstable(middle).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_of_equal_values() {
        assert_eq!(longest_run(&[1.0, 2.0, 2.0, 3.0, 3.0]), Some(3..5));
        assert_eq!(longest_run(&[f64::NAN, f64::NAN]), Some(1..2), "no number equals no other");
        assert_eq!(longest_run(&[]), None);
        let held: Vec<f64> = (0..60).map(|row| f64::from(row / 4)).collect();
        assert_eq!(usual_run(&held), 4);
        assert_eq!(usual_run(&[0.0; 100]), 1, "a rest is no slow sensor");
    }
}
