//! The clock of a log: usual time between rows, rows whose time does not follow.

/// Usual time between the rows of a log, s: the mean of the steps that are no gaps (at most 2.5 times the
/// median). Nothing where time does not rise.
pub fn row_time_s(time_s: &[f64]) -> Option<f64> {
    let steps = time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = steps.filter(|step| step.is_finite() && *step > 0.0).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return None;
    }
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    steps.retain(|&step| step <= 2.5 * median);
    Some(steps.iter().sum::<f64>() / steps.len() as f64)
}

/// Rows that have to go so that time rises strictly.
#[derive(Debug, PartialEq)]
pub(super) struct Misfits {
    /// The rows, rising; as few as possible.
    pub(super) rows: Vec<usize>,
    /// First row that does not follow the one before.
    pub(super) first: usize,
    /// Time of the row before it, s.
    pub(super) from_s: f64,
    /// Time of that row, s.
    pub(super) to_s: f64,
}

/// The fewest rows without which time rises strictly, or nothing where it does so already.
pub(super) fn misfits(time_s: &[f64]) -> Option<Misfits> {
    let before = time_s.windows(2).position(|pair| pair[1] <= pair[0])?;
    let mut keep = longest_rising(time_s).into_iter().peekable();
    let rows = (0..time_s.len()).filter(|row| keep.next_if_eq(row).is_none()).collect();
    Some(Misfits { rows, first: before + 1, from_s: time_s[before], to_s: time_s[before + 1] })
}

/// Rows of the longest strictly rising subsequence (patience sorting).
fn longest_rising(values: &[f64]) -> Vec<usize> {
    // ends[k]: the row with the smallest value that ends a rising sequence of k + 1 rows.
    let mut ends: Vec<usize> = Vec::new();
    let mut before = vec![usize::MAX; values.len()];
    for (row, &value) in values.iter().enumerate() {
        let length = ends.partition_point(|&end| values[end] < value);
        if length > 0 {
            before[row] = ends[length - 1];
        }
        if length == ends.len() {
            ends.push(row);
        } else {
            ends[length] = row;
        }
    }
    let last = ends.last().copied();
    let step = |&row: &usize| Some(before[row]).filter(|&row| row != usize::MAX);
    let mut rows: Vec<usize> = std::iter::successors(last, step).collect();
    rows.reverse();
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_jitter_leave_the_usual_time_between_rows() {
        let alternating: Vec<f64> = (0..100).map(|row| f64::from(row) + 0.4 * f64::from(row % 2)).collect();
        let found = row_time_s(&alternating).unwrap();
        assert!((found - 1.0).abs() < 0.01, "{found}");
        assert_eq!(row_time_s(&[0.0, 1.0, 2.0, 50.0, 51.0, f64::NAN]), Some(1.0));
        assert_eq!(row_time_s(&[1.0, 1.0]), None);
        assert_eq!(row_time_s(&[]), None);
    }

    #[test]
    fn as_few_rows_as_possible_go() {
        for (times, expected) in [
            (vec![0.0, 1.0, 2.0], vec![]),
            (vec![0.0, 1.0, 1.0, 2.0], vec![1]),
            (vec![0.0, 1.0, 0.5, 2.0], vec![1]),
            // A spike forward goes, not the rest of the log.
            (vec![0.0, 1.0, 999.0, 2.0, 3.0], vec![2]),
            (vec![0.0, 5.0, 6.0, 1.0, 2.0, 3.0, 4.0], vec![1, 2]),
        ] {
            let rows = misfits(&times).map(|found| found.rows).unwrap_or_default();
            assert_eq!(rows, expected, "{times:?}");
        }
    }
}
