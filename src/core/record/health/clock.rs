//! The clock of a log.

use super::{Findings, Severity, rows};
use crate::record::{Log, row_time_s};

/// A step of time longer than so many usual ones is a gap.
pub(super) const GAP_ROWS: f64 = 5.5;

/// Reports on `time_s` and returns the usual time between rows, s, where there is one.
pub(super) fn check(log: &Log, findings: &mut Findings) -> Option<f64> {
    let time = log.column("time_s")?;
    let steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).filter(|s| s.is_finite()).collect();
    let mut sorted: Vec<f64> = steps.iter().copied().filter(|&step| step > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    order(&steps, findings);
    let row_s = row_time_s(time)?;
    let seconds = sorted.iter().sum::<f64>();
    let rate_hz = Number(1.0 / row_s).to_string();
    let unit = if rate_hz == "1" { "row" } else { "rows" };
    findings.info("time_s", format!("{rate_hz} {unit} a second over {seconds:.3} s"));
    rate(row_s, findings);
    jitter(row_s, &sorted, findings);
    gaps(row_s, time, findings);
    Some(row_s)
}

/// A number with four significant digits.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let digits = 3 - self.0.abs().max(1e-9).log10().floor() as i32;
        let scale = 10_f64.powi(digits);
        write!(f, "{}", (self.0 * scale).round() / scale)
    }
}

fn order(steps: &[f64], findings: &mut Findings) {
    let wrong = steps.iter().filter(|&&step| step <= 0.0).count();
    if wrong > 0 {
        let problem = format!("time repeats or decreases in {}", rows(wrong));
        findings.add(Severity::Error, "time_s", problem, "sort the rows by time and keep one for each time");
    }
}

/// Unit that a time which rises by so much a row probably has in place of seconds, and what it is in seconds; logs
/// have 10 to 10,000 rows a second.
pub(super) fn likely_unit(row_s: f64) -> Option<(&'static str, f64)> {
    match row_s {
        ..0.5 => None,
        0.5..100.0 => Some(("milliseconds", 1e-3)),
        100.0..1e5 => Some(("microseconds", 1e-6)),
        _ => Some(("nanoseconds", 1e-9)),
    }
}

fn rate(row_s: f64, findings: &mut Findings) {
    let hz = 1.0 / row_s;
    if let Some((unit, factor)) = likely_unit(row_s) {
        let problem = format!("time increases by {row_s} s per row, as if it were in {unit}");
        findings.warn("time_s", problem, format!("if so, read it with --map time_s=time_s*{factor}"));
    } else if hz < 45.0 {
        let problem = format!("{:.1} Hz is too slow to resolve friction", hz);
        findings.warn("time_s", problem, "record at 50 Hz or more");
    } else if hz > 11_000.0 {
        let problem = format!("{:.0} Hz is faster than a motor controller runs", hz);
        findings.warn("time_s", problem, "check the unit of the time");
    }
}

fn jitter(row_s: f64, sorted: &[f64], findings: &mut Findings) {
    let share = |quantile: f64| sorted[(quantile * (sorted.len() - 1) as f64) as usize] / row_s;
    let (low, high) = (share(0.01), share(0.99));
    let problem = format!(
        "jitter: the time between rows is {:.0} % to {:.0} % of its mean in 98 % of the rows",
        100.0 * low,
        100.0 * high
    );
    if high - low > 0.4 {
        findings.warn("time_s", problem, "time-stamp the rows at the measurement, not when they are written");
    } else if high - low > 0.05 {
        findings.info("time_s", problem);
    }
}

fn gaps(row_s: f64, time: &[f64], findings: &mut Findings) {
    let is_gap = |pair: &&[f64]| pair[1] - pair[0] > GAP_ROWS * row_s;
    let gaps: Vec<&[f64]> = time.windows(2).filter(is_gap).collect();
    let longest = gaps.iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
    if let Some(longest) = longest {
        let problem = format!(
            "gaps of more than five rows: {}, the longest of {} s at {} s",
            gaps.len(),
            Number(longest[1] - longest[0]),
            Number(longest[0])
        );
        findings.warn(
            "time_s",
            problem,
            "the log is split there; check for lost messages or an overloaded recorder",
        );
    }
}
