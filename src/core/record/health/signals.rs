//! Each column on its own: missing values, held samples, steps, saturation, standstill, wraps.

use std::f64::consts::TAU;

use super::{Findings, finite, range, rows};
use crate::record::Log;
use crate::record::runs::usual_run;

/// Reports on one column of the schema.
pub(super) fn check(log: &Log, name: &str, values: &[f64], row_s: Option<f64>, findings: &mut Findings) {
    missing(log, name, values, findings);
    if name == "time_s" || row_s.is_none() {
        return;
    }
    let Some([low, high]) = range(values) else { return };
    let measured = !name.starts_with("target") && !name.contains("temperature") && !name.contains("voltage");
    if low == high {
        if measured {
            findings.warn(
                name,
                format!("the value is {low} throughout"),
                "check that the sensor is connected",
            );
        }
        return;
    }
    let held = usual_run(values);
    if let (2.., Some(row_s)) = (held, row_s) {
        let hz = 1.0 / (held as f64 * row_s);
        findings.info(
            name,
            format!("each value is held for {held} rows; the sensor updates at about {hz:.0} Hz"),
        );
    }
    if measured {
        steps(name, values, high - low, findings);
    }
    if name.starts_with("torque") || name.starts_with("force") {
        saturation(name, values, [low, high], held, findings);
    }
    if name.starts_with("motor_angle") {
        wraps(name, values, findings);
    }
}

fn missing(log: &Log, name: &str, values: &[f64], findings: &mut Findings) {
    let absent = values.iter().filter(|value| !value.is_finite()).count();
    if absent == values.len() {
        findings.warn(name, "there is no number in this column", "remove the column or record it again");
    } else if absent > 0 {
        let first = values.iter().position(|value| !value.is_finite()).and_then(|row| log.line(row));
        let place = first.map_or(String::new(), |line| match absent {
            1 => format!(", at line {line}"),
            _ => format!(", the first at line {line}"),
        });
        let have = if absent == 1 { "has" } else { "have" };
        findings.info(name, format!("{absent} of {} {have} no value{place}", rows(values.len())));
    }
}

/// Values that are multiples of a step that is coarse against the range.
fn steps(name: &str, values: &[f64], range: f64, findings: &mut Findings) {
    let differences =
        || values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|&d| d > 1e-9 * range);
    let step = differences().fold(f64::INFINITY, f64::min);
    let count = range / step;
    if !step.is_finite() || count > 20_000.0 {
        return;
    }
    let whole = |difference: &f64| {
        let steps = difference / step;
        (steps - steps.round()).abs() < 0.1
    };
    let all = differences().count();
    if differences().filter(whole).count() * 10 < all * 9 {
        return;
    }
    let text = format!("the resolution is about {step:.3e}, {count:.0} steps over the range");
    if count < 20.0 && all > 100 {
        findings.warn(name, text, "use a finer sensor or a larger motion");
    } else {
        findings.info(name, text);
    }
}

/// Flat tops: rows in runs at the largest or smallest value of a column that otherwise varies.
fn saturation(name: &str, values: &[f64], [low, high]: [f64; 2], held: usize, findings: &mut Findings) {
    let at = |limit: f64| {
        let flat =
            values.chunk_by(|a, b| a == b).filter(|run| run[0] == limit && run.len() >= 3.max(3 * held));
        flat.map(<[f64]>::len).sum::<usize>()
    };
    let flat = at(high) + at(low);
    let changes = values.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let varies = changes * 10 > values.len() / held;
    if varies && flat * 200 > values.len() {
        let problem = format!(
            "{:.1} % of the rows are at the limits {low} and {high}: the value is saturated",
            100.0 * flat as f64 / values.len() as f64
        );
        findings.warn(name, problem, "record the actual torque, or record with less torque");
    }
}

/// Jumps of whole turns: an encoder that starts again after each turn.
fn wraps(name: &str, values: &[f64], findings: &mut Findings) {
    let jump = |pair: &&[f64]| {
        let turns = (pair[1] - pair[0]) / TAU;
        turns.abs() > 0.9 && (turns - turns.round()).abs() < 0.1
    };
    // A value that comes back at once is a spike.
    let returns = |rows: &[f64]| (rows[2] - rows[0]).abs() < 0.5 * (rows[1] - rows[0]).abs();
    let spike = |row: usize| {
        values.get(row..row + 3).is_some_and(returns)
            || row.checked_sub(1).and_then(|before| values.get(before..before + 3)).is_some_and(returns)
    };
    let pairs = values.windows(2).enumerate();
    let wrapped = pairs.filter(|(row, pair)| jump(pair) && !spike(*row)).count();
    let inside = finite(values).all(|angle| angle.abs() < 1.1 * TAU);
    if wrapped > 0 && inside {
        let times = if wrapped == 1 { "once".to_owned() } else { format!("{wrapped} times") };
        let problem = format!("the angle jumps by a whole turn {times}: it wraps within one turn");
        findings.warn(name, problem, "record the unwrapped angle");
    }
}
