//! Single positions far off the motion around them, as a lost bit or a glitch of a counter leaves them.

use super::Findings;
use crate::record::Log;

/// A spike is farther off the rows around it than this, in robust standard deviations or smallest steps of
/// the column, whichever is larger.
const SIGMAS: f64 = 20.0;
/// And than this, in the largest such deviation nearby: a hard stop or a reversal shakes several rows.
const BEYOND_NEIGHBOURS: f64 = 5.0;
/// Rows on either side that count as nearby.
const NEIGHBOURS: usize = 12;

/// Reports on the spikes of a measured position.
pub(super) fn check(log: &Log, name: &str, row_s: f64, findings: &mut Findings) {
    let (Some(time), Some(values)) = (log.column("time_s"), log.column(name)) else { return };
    let found = spikes(time, values, row_s);
    let Some(&(first, off)) = found.first() else { return };
    let place = match log.line(first) {
        Some(line) => format!("{} s, line {line}", time[first]),
        None => format!("{} s", time[first]),
    };
    let (problem, remedy) = match found.len() {
        1 => {
            (format!("one value differs by {off:.4e} from the rows around it, at {place}"), "remove the row")
        }
        count => (
            format!(
                "{count} single values differ widely from the rows around them, the first by {off:.4e} at {place}"
            ),
            "remove these rows",
        ),
    };
    findings.warn(name, problem, remedy);
}

/// Rows that are far off the rows around them, and how far.
pub(super) fn spikes(time: &[f64], values: &[f64], row_s: f64) -> Vec<(usize, f64)> {
    let off: Vec<f64> = time.windows(3).zip(values.windows(3)).map(|(t, v)| deviation(t, v)).collect();
    let floor = SIGMAS * spread(&off).max(smallest_step(values));
    // A row that is stamped late looks off too where the motion is fast.
    let uneven = |pair: &[f64]| (pair[1] - pair[0] - row_s).abs() > 0.5 * row_s;
    let spike = |&index: &usize| {
        let size = off[index].abs();
        // A row that returns pulls both neighbours half as far the other way, a step does not. Row 1 and the
        // last but one have one such neighbour.
        let returns = |other: Option<&f64>| other.is_none_or(|other| (other / off[index] + 0.5).abs() < 0.25);
        size > floor
            && returns(index.checked_sub(1).and_then(|before| off.get(before)))
            && returns(off.get(index + 1))
            && size > BEYOND_NEIGHBOURS * nearby(&off, index)
            && !time[index.saturating_sub(1)..time.len().min(index + 4)].windows(2).any(uneven)
    };
    (0..off.len()).filter(spike).map(|index| (index + 1, off[index])).collect()
}

/// Deviation of the middle one of three rows from the line through the others; 0 if undefined.
fn deviation(time: &[f64], values: &[f64]) -> f64 {
    let share = (time[1] - time[0]) / (time[2] - time[0]);
    let off = values[1] - values[0] - share * (values[2] - values[0]);
    if off.is_finite() { off } else { 0.0 }
}

/// Robust standard deviation about zero.
fn spread(off: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = off.iter().map(|off| off.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() { 0.0 } else { 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The smallest change between two rows, or nothing where none changes.
fn smallest_step(values: &[f64]) -> f64 {
    let size =
        values.iter().filter(|value| value.is_finite()).fold(0.0, |size: f64, value| size.max(value.abs()));
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 1e-9 * size);
    let step = steps.fold(f64::INFINITY, f64::min);
    if step.is_finite() { step } else { 0.0 }
}

/// The largest deviation near a row, those left out that a spike in this row makes itself.
fn nearby(off: &[f64], index: usize) -> f64 {
    let before = &off[index.saturating_sub(NEIGHBOURS)..index.saturating_sub(1)];
    let after = &off[(index + 2).min(off.len())..(index + NEIGHBOURS + 1).min(off.len())];
    before.iter().chain(after).fold(0.0, |largest, off| largest.max(off.abs()))
}
