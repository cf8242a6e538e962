//! Values that look like another unit than the name says.

use std::f64::consts::{PI, TAU};

use super::clock::{GAP_ROWS, likely_unit};
use super::{Findings, finite, range};
use crate::record::Log;

/// Positions and the speeds that must be their derivatives.
const PAIRS: [(&str, &str); 6] = [
    ("motor_angle_rad", "motor_speed_rad_s"),
    ("motor_angle_left_rad", "motor_speed_left_rad_s"),
    ("motor_angle_right_rad", "motor_speed_right_rad_s"),
    ("position_m", "velocity_m_s"),
    ("x_m", "x_dot_m_s"),
    ("pitch_rad", "pitch_rate_rad_s"),
];

/// Largest magnitude that is believed, and what a larger one looks like.
const MAGNITUDES: [(&str, f64, &str, f64); 8] = [
    ("pitch_rad", 1.6, "degrees", DEGREE),
    ("pitch_rate_rad_s", 60.0, "degrees per second", DEGREE),
    ("torque_nm", 100.0, "milliamperes or raw counts", 0.001),
    ("torque_left_nm", 100.0, "milliamperes or raw counts", 0.001),
    ("torque_right_nm", 100.0, "milliamperes or raw counts", 0.001),
    ("x_m", 200.0, "millimetres", 0.001),
    ("position_m", 20.0, "millimetres", 0.001),
    ("motor_speed_rad_s", 3000.0, "degrees per second or revolutions per minute", 0.1),
];

/// A unit in which a position, a speed or both are off.
struct Scale {
    /// Ratio of the speed to the derivative of the position.
    factor: f64,
    meaning: &'static str,
    /// Factor that corrects the position.
    position: f64,
    /// Factor that corrects the speed.
    speed: f64,
    /// True if gears of about this ratio are common too.
    or_gear: bool,
}

const fn scale(meaning: &'static str, position: f64, speed: f64, or_gear: bool) -> Scale {
    Scale { factor: position / speed, meaning, position, speed, or_gear }
}

const DEGREE: f64 = PI / 180.0;
const RPM: f64 = PI / 30.0;

/// Units that angles and their speeds are mistaken for.
const ANGULAR: [Scale; 10] = [
    scale("degrees per second", 1.0, DEGREE, false),
    scale("revolutions per minute", 1.0, RPM, false),
    scale("revolutions per second", 1.0, TAU, true),
    scale("thousandths", 1.0, 0.001, false),
    scale("the position in degrees", DEGREE, 1.0, false),
    scale("the position in revolutions", TAU, 1.0, true),
    scale("revolutions per minute against a position in degrees", DEGREE, RPM, true),
    scale("revolutions per minute against a position in revolutions", TAU, RPM, false),
    scale("degrees per second against a position in revolutions", TAU, DEGREE, false),
    scale("revolutions per second against a position in degrees", DEGREE, TAU, false),
];
/// Units that lengths and their speeds are mistaken for.
const LINEAR: [Scale; 2] = [
    scale("millimetres per second", 1.0, 0.001, false),
    scale("the position in millimetres", 0.001, 1.0, false),
];

/// Reports on the units of a log.
pub(super) fn check(log: &Log, row_s: Option<f64>, findings: &mut Findings) {
    let mut told = Vec::new();
    if let (Some(time), Some(row_s)) = (log.column("time_s"), row_s) {
        for (position, speed) in PAIRS {
            if let (Some(positions), Some(speeds)) = (log.column(position), log.column(speed))
                && derivative(time, (position, positions), (speed, speeds), row_s, findings)
            {
                told.extend([position, speed]);
            }
        }
    }
    // What the comparison of two columns found is more certain than one column's size.
    for (name, largest, looks_like, factor) in
        MAGNITUDES.into_iter().filter(|(name, ..)| !told.contains(name))
    {
        let magnitude = log.column(name).and_then(range).map_or(0.0, |[low, high]| high.abs().max(low.abs()));
        if magnitude > largest {
            let problem = format!("values up to {magnitude:.4} look like {looks_like}");
            let remedy = format!("if so, read it with --map {name}={name}*{factor:.7}");
            findings.warn(name, problem, remedy);
        }
    }
    for name in ["torque_nm", "torque_left_nm", "torque_right_nm"] {
        whole_numbers(log, name, findings);
    }
}

fn whole_numbers(log: &Log, name: &str, findings: &mut Findings) {
    let Some(values) = log.column(name) else { return };
    let large = finite(values).any(|value| value.abs() >= 10.0);
    if large && values.len() > 20 && finite(values).all(|value| value.fract() == 0.0) {
        let remedy = format!("if so, read it with --map {name}={name}*FACTOR, FACTOR in N m per count");
        findings.warn(name, "every value is an integer, like raw counts or milliamperes", remedy);
    }
}

/// Compares the speed, integrated over stretches of rows, with the change of the position over them; true where
/// they do not agree.
fn derivative(
    time: &[f64],
    (position, positions): (&str, &[f64]),
    (speed, speeds): (&str, &[f64]),
    row_s: f64,
    out: &mut Findings,
) -> bool {
    let second = time_unit(row_s);
    let Some(measured) = speed_factor(time, positions, speeds, row_s) else { return false };
    // A time in milliseconds makes every speed look too large; the clock's own finding tells of it.
    let factor = if agrees(measured) { measured } else { measured * second };
    if agrees(factor) {
        return false;
    }
    let map = |name: &str, factor: f64| format!("--map {name}={name}*{factor:.7}");
    let scales = if position.ends_with("_rad") { &ANGULAR[..] } else { &LINEAR[..] };
    let off = |scale: &Scale| (factor / scale.factor - 1.0).abs();
    let close = scales.iter().filter(|scale| off(scale) < 0.06).min_by(|a, b| off(a).total_cmp(&off(b)));
    let (looks_like, remedy) = match close {
        Some(scale) => {
            let maps = [(position, scale.position), (speed, scale.speed)];
            let maps = maps.into_iter().filter(|(_, factor)| *factor != 1.0);
            let maps = maps.map(|(name, factor)| map(name, factor)).collect::<Vec<_>>().join(" ");
            let gear = format!("; with a gear between them, {}", map(speed, 1.0 / factor));
            let (or_gear, gear) = if scale.or_gear { (" or a gear", gear.as_str()) } else { ("", "") };
            (format!("it looks like {}{or_gear}", scale.meaning), format!("if so, read it with {maps}{gear}"))
        }
        None => {
            let what = if (factor + 1.0).abs() < 0.1 {
                "it looks like the opposite sign"
            } else {
                "one of them has another scale, such as a gear ratio"
            };
            let (of_speed, of_position) = (map(speed, 1.0 / factor), map(position, factor));
            let remedy =
                format!("if the position is right, {of_speed}; if the speed is right, {of_position}");
            (what.to_owned(), remedy)
        }
    };
    let problem = format!("the speed is {factor:.4} times the derivative of `{position}`: {looks_like}");
    out.warn(speed, problem, remedy);
    true
}

fn agrees(factor: f64) -> bool {
    (factor - 1.0).abs() < 0.1
}

/// The unit, s, that a time probably has which rises by so much a row.
fn time_unit(row_s: f64) -> f64 {
    likely_unit(row_s).map_or(1.0, |(_, unit)| unit)
}

/// By how much the speed is larger than the derivative of the position, where the two go together.
fn speed_factor(time: &[f64], position: &[f64], speed: &[f64], row_s: f64) -> Option<f64> {
    // A tenth of a second evens out noise, steps and held samples.
    let rows = ((0.1 / (row_s * time_unit(row_s))) as usize).clamp(4, 1000);
    let (mut both, mut moved, mut swept) = (0.0, 0.0, 0.0);
    for start in (0..time.len().saturating_sub(rows)).step_by(rows) {
        let end = start + rows;
        // Over a gap the motion went on unseen.
        if time[start..=end].windows(2).any(|pair| pair[1] - pair[0] > GAP_ROWS * row_s) {
            continue;
        }
        let change = position[end] - position[start];
        let step = |row: usize| 0.5 * (speed[row] + speed[row + 1]) * (time[row + 1] - time[row]);
        let integral: f64 = (start..end).map(step).sum();
        if change.is_finite() && integral.is_finite() {
            both += change * integral;
            moved += change * change;
            swept += integral * integral;
        }
    }
    let together = both * both > 0.9 * moved * swept;
    (moved > 0.0 && together).then(|| both / moved)
}
