//! Logs as they are used: bad cells replaced by what is around them, logs that were given twice left out, and what is
//! said of either.

use crate::record::{HealthFinding, Log, Severity, schema, single_outliers};

/// Fraction of the rows of a column up to which outliers are single ones; beyond it they are how the sensor works.
const MOST_OUTLIERS: f64 = 0.001;

/// Fraction of a column's usual range that an outlier must be off by: a controller's answer to one reading is smaller.
const BEYOND_RANGE: f64 = 0.5;

/// Range of all values of a column but one in a hundred at either end.
fn usual_range(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    if sorted.is_empty() { 0.0 } else { sorted[last - last / 100] - sorted[last / 100] }
}

/// Logs without bad cells.
pub(super) fn repaired(logs: &[Log]) -> (Vec<Log>, Vec<HealthFinding>) {
    let mut findings = Vec::new();
    let repaired = |log: &Log| {
        let mut log = log.clone();
        let Some(time) = log.column("time_s").map(<[f64]>::to_vec) else { return log };
        for place in 0..log.columns.len() {
            let name = log.columns[place].name.clone();
            if name == "time_s" || !schema::is_known(&name) {
                continue;
            }
            let values = &log.columns[place].values;
            let least = BEYOND_RANGE * usual_range(values);
            let mut rows = single_outliers(&time, values);
            rows.retain(|&row| (values[row] - 0.5 * (values[row - 1] + values[row + 1])).abs() > least);
            let Some(&first) = rows.first() else { continue };
            if rows.len() as f64 > (MOST_OUTLIERS * time.len() as f64).max(1.0) {
                continue;
            }
            let at = match log.line(first) {
                Some(line) => format!("{} s, line {line}", time[first]),
                None => format!("{} s", time[first]),
            };
            let value = log.columns[place].values[first];
            let what = match rows.len() {
                1 => format!("the value {value:.4} at {at} is far off the rows around it"),
                count => format!(
                    "{count} single values are far off the rows around them, the first ({value:.4}) at {at}"
                ),
            };
            let values = &mut log.columns[place].values;
            for row in rows {
                values[row] = 0.5 * (values[row - 1] + values[row + 1]);
            }
            findings.push(HealthFinding {
                severity: Severity::Warning,
                column: name,
                problem: format!("{what}: the mean of its neighbours is used"),
                remedy: "check the cable and the recorder if it happens again".to_owned(),
            });
        }
        log
    };
    let logs = logs.iter().map(repaired).collect();
    (logs, findings)
}

/// Takes out logs that are another one over again.
pub(super) fn without_duplicates(logs: &mut Vec<Log>) -> Vec<HealthFinding> {
    let mut findings = Vec::new();
    let mut place = 0;
    while place < logs.len() {
        let same = |other: &Log| other.columns == logs[place].columns;
        match logs[..place].iter().find(|other| same(other)) {
            None => place += 1,
            Some(other) => {
                findings.push(HealthFinding {
                    severity: Severity::Warning,
                    column: String::new(),
                    problem: format!("{} holds the same rows as {}", logs[place].source, other.source),
                    remedy: "it is used once; give each log once".to_owned(),
                });
                logs.remove(place);
            }
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(source: &str, torque: &[f64]) -> Log {
        let time = (0..torque.len()).map(|row| 0.001 * row as f64).collect();
        Log::from_columns(source, [("time_s", time), ("torque_nm", torque.to_vec())])
    }

    #[test]
    fn one_bad_cell_is_replaced_and_named_and_steps_stay() {
        let wave: Vec<f64> = (0..4000).map(|row| (0.01 * f64::from(row)).sin()).collect();
        let mut bad = wave.clone();
        bad[2000] = 5.0;
        let (repaired, findings) = repaired(&[log("a", &bad)]);
        assert!((repaired[0].columns[1].values[2000] - wave[2000]).abs() < 1e-3);
        assert_eq!(findings.len(), 1);
        assert!(findings[0].problem.contains("5.0000 at 2 s"), "{}", findings[0].problem);
        let steps: Vec<f64> = (0..4000).map(|row| f64::from(row / 500 % 2)).collect();
        let (same, findings) = super::repaired(&[log("a", &steps)]);
        assert_eq!((same[0].columns[1].values.as_slice(), findings.len()), (steps.as_slice(), 0));
    }

    #[test]
    fn a_log_that_is_given_twice_counts_once() {
        let wave: Vec<f64> = (0..100).map(|row| (0.1 * f64::from(row)).sin()).collect();
        let mut logs = vec![log("a", &wave), log("b", &wave), log("c", &wave[..50])];
        let findings = without_duplicates(&mut logs);
        assert_eq!(logs.iter().map(|log| log.source.as_str()).collect::<Vec<_>>(), ["a", "c"]);
        assert_eq!(findings.len(), 1);
    }
}
