//! Logs with gaps: what the robot did meanwhile nobody knows, so each stretch between them is a run of its own.

use std::ops::Range;

use crate::record::{HealthFinding, Log, Severity};

/// Longest time between rows, s, over which the motion is still known.
const LONGEST_S: f64 = 0.1;
/// Shortest stretch that is worth a run, s.
const SHORTEST_S: f64 = 8.0;

/// The stretches of logs that are long enough; of a log that has none, the longest.
pub(super) fn pieces(logs: &[Log]) -> Vec<Log> {
    logs.iter().flat_map(of_log).collect()
}

/// What is to be said of the gaps.
pub(super) fn findings(logs: &[Log]) -> Vec<HealthFinding> {
    let of_log = |log: &Log| -> Option<HealthFinding> {
        let time = log.column("time_s")?;
        let stretches = stretches(time)?;
        let first = breaks(time).next()?;
        let more = match breaks(time).count() - 1 {
            0 => String::new(),
            1 => ", and one more gap".to_owned(),
            more => format!(", and {more} more gaps"),
        };
        let kept: usize = stretches.iter().map(Range::len).sum();
        let left = match time.len() - kept {
            0 => String::new(),
            rows => format!(", {rows} rows of shorter ones are left out"),
        };
        let problem = format!(
            "no rows for {:.2} s from {:.2} s on{more}: runs of their own are {}{left}",
            time[first] - time[first - 1],
            time[first - 1],
            stretches.len(),
        );
        Some(HealthFinding::new(Severity::Warning, "time_s", problem, "record without a break"))
    };
    logs.iter().filter_map(of_log).collect()
}

/// Rows before which there is a gap.
fn breaks(time: &[f64]) -> impl Iterator<Item = usize> {
    (1..time.len()).filter(|&row| time[row] - time[row - 1] > LONGEST_S)
}

/// Rows between gaps that are worth a run; none of a log without gaps, or whose rows are all far apart: those are slow,
/// which is another finding.
fn stretches(time: &[f64]) -> Option<Vec<Range<usize>>> {
    let gaps = breaks(time).count();
    if gaps == 0 || gaps > time.len() / 10 {
        return None;
    }
    let ends: Vec<usize> = std::iter::once(0).chain(breaks(time)).chain([time.len()]).collect();
    let seconds = |rows: &Range<usize>| time[rows.end - 1] - time[rows.start];
    let all: Vec<_> = ends.windows(2).map(|pair| pair[0]..pair[1]).collect();
    let longest = all.iter().cloned().max_by(|a, b| seconds(a).total_cmp(&seconds(b)));
    let mut kept: Vec<_> = all.into_iter().filter(|rows| seconds(rows) >= SHORTEST_S).collect();
    if kept.is_empty() {
        kept.extend(longest);
    }
    Some(kept)
}

fn of_log(log: &Log) -> Vec<Log> {
    let Some(stretches) = log.column("time_s").and_then(stretches) else { return vec![log.clone()] };
    let cut = |rows: Range<usize>| {
        let columns = log.columns.iter().map(|column| (&*column.name, column.values[rows.clone()].to_vec()));
        Log::from_columns(log.source.clone(), columns)
    };
    stretches.into_iter().map(cut).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(time: &[f64]) -> Log {
        let rows = (0..time.len()).map(|row| row as f64).collect();
        Log::from_columns("test", [("time_s", time.to_vec()), ("x_m", rows)])
    }

    fn even(from_s: f64, seconds: f64) -> impl Iterator<Item = f64> {
        (0..(100.0 * seconds) as usize).map(move |row| from_s + 0.01 * row as f64)
    }

    #[test]
    fn a_log_with_a_gap_is_two_runs_and_is_told() {
        let time: Vec<f64> = even(0.0, 20.0).chain(even(22.0, 18.0)).chain(even(41.0, 2.0)).collect();
        let log = log(&time);
        let pieces = pieces(std::slice::from_ref(&log));
        assert_eq!(
            pieces.iter().map(|piece| piece.columns[0].values.len()).collect::<Vec<_>>(),
            [2000, 1800]
        );
        assert_eq!(pieces[1].column("x_m").unwrap()[0], 2000.0);
        let told = findings(&[log]);
        let problem = "no rows for 2.01 s from 19.99 s on, and one more gap: runs of their own are 2, 200 rows of \
                       shorter ones are left out";
        assert_eq!(told.iter().map(|told| told.problem.as_str()).collect::<Vec<_>>(), [problem]);
    }

    #[test]
    fn whole_and_slow_logs_stay_as_they_are() {
        for time in [even(0.0, 20.0).collect::<Vec<_>>(), (0..50).map(f64::from).collect()] {
            let log = log(&time);
            assert_eq!(pieces(std::slice::from_ref(&log)), std::slice::from_ref(&log));
            assert_eq!(findings(&[log]), []);
        }
    }
}
