//! Values that look like another unit than the name says.

use super::{Findings, clock::GAP_ROWS, finite, range};
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
    ("pitch_rad", 1.6, "degrees", std::f64::consts::PI / 180.0),
    ("pitch_rate_rad_s", 60.0, "degrees per second", std::f64::consts::PI / 180.0),
    ("torque_nm", 100.0, "milliamperes or raw counts", 0.001),
    ("torque_left_nm", 100.0, "milliamperes or raw counts", 0.001),
    ("torque_right_nm", 100.0, "milliamperes or raw counts", 0.001),
    ("x_m", 200.0, "millimetres", 0.001),
    ("position_m", 20.0, "millimetres", 0.001),
    ("motor_speed_rad_s", 3000.0, "degrees per second or revolutions per minute", 0.1),
];

/// Factors by which a speed is off, and what they mean.
const FACTORS: [(f64, &str); 6] = [
    (180.0 / std::f64::consts::PI, "degrees per second"),
    (30.0 / std::f64::consts::PI, "revolutions per minute"),
    (0.5 / std::f64::consts::PI, "revolutions per second"),
    (1000.0, "thousandths"),
    (std::f64::consts::PI / 180.0, "the position in degrees"),
    (-1.0, "the opposite sign"),
];

/// Reports on the units of a log.
pub(super) fn check(log: &Log, row_s: Option<f64>, findings: &mut Findings) {
    for (name, largest, looks_like, factor) in MAGNITUDES {
        let magnitude = log.column(name).and_then(range).map_or(0.0, |[low, high]| high.abs().max(low.abs()));
        if magnitude > largest {
            let problem = format!("values up to {magnitude:.4} look like {looks_like}");
            let mend = format!("if so, read it with --map {name}={name}*{factor:.7}");
            findings.warn(name, problem, mend);
        }
    }
    for name in ["torque_nm", "torque_left_nm", "torque_right_nm"] {
        whole_numbers(log, name, findings);
    }
    if let (Some(time), Some(row_s)) = (log.column("time_s"), row_s) {
        for (position, speed) in PAIRS {
            if let (Some(positions), Some(speeds)) = (log.column(position), log.column(speed)) {
                derivative(time, (position, positions), (speed, speeds), row_s, findings);
            }
        }
    }
}

fn whole_numbers(log: &Log, name: &str, findings: &mut Findings) {
    let Some(values) = log.column(name) else { return };
    let large = finite(values).any(|value| value.abs() >= 10.0);
    if large && values.len() > 20 && finite(values).all(|value| value.fract() == 0.0) {
        let mend = format!("if so, read it with --map {name}={name}*FACTOR, FACTOR in N m a count");
        findings.warn(name, "every value is a whole number, as raw counts or milliamperes are", mend);
    }
}

/// Compares the speed, integrated over stretches of rows, with the change of the position over them.
fn derivative(time: &[f64], position: (&str, &[f64]), speed: (&str, &[f64]), row_s: f64, out: &mut Findings) {
    let Some(factor) = speed_factor(time, position.1, speed.1, row_s) else { return };
    if (factor - 1.0).abs() < 0.1 {
        return;
    }
    let close = FACTORS.iter().find(|(known, _)| (factor / known - 1.0).abs() < 0.06);
    let looks_like = close.map_or_else(
        || "one of them has another scale, such as a gear ratio".to_owned(),
        |(_, meaning)| format!("it looks like {meaning}"),
    );
    let (position, speed) = (position.0, speed.0);
    let problem = format!("the speed is {factor:.4} times the change of `{position}`: {looks_like}");
    let mend =
        format!("check both units; if the position is right, --map {speed}={speed}*{:.7}", 1.0 / factor);
    out.warn(speed, problem, mend);
}

/// By how much the speed is larger than the derivative of the position, where the two go together.
fn speed_factor(time: &[f64], position: &[f64], speed: &[f64], row_s: f64) -> Option<f64> {
    // A tenth of a second evens out noise, steps and held samples.
    let rows = ((0.1 / row_s) as usize).clamp(4, 1000);
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
