//! Logs that go together must have one rate: one kernel serves them all.

use crate::record::{HealthFinding, Log, Severity, row_time_s};

/// Share by which the rate of a log may differ from that of the first.
const SAME: f64 = 0.01;

/// An error for each log whose rate differs from that of the first.
pub(super) fn check(logs: &[&Log]) -> Vec<HealthFinding> {
    let rate = |log: &Log| Some(1.0 / row_time_s(log.column("time_s")?)?);
    let Some((first, wanted)) = logs.iter().find_map(|log| Some((log, rate(log)?))) else {
        return Vec::new();
    };
    let finding = |log: &&Log| {
        let own = rate(log).filter(|own| (own / wanted - 1.0).abs() > SAME)?;
        let problem = format!(
            "{} has {own:.1} Hz and {} has {wanted:.1} Hz, but one filter is used for all logs",
            log.source, first.source
        );
        let remedy = format!("record at one rate, or resample every log to {:.1} Hz", own.min(wanted));
        Some(HealthFinding::new(Severity::Error, "time_s", problem, remedy))
    };
    logs.iter().filter_map(finding).collect()
}
