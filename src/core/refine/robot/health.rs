//! What makes a robot's log unfit, said before any effect is named.

use crate::effects::Machine;
use crate::model::RobotModel;
use crate::record::{self, HealthFinding, Log, Severity, runs::longest_run};
use crate::refine::{is_unfit, rates};

use super::candidates::quantile;
use super::motion::Readings;
use super::trace::Trace;

/// Changes within 0.1 s, root mean square, below which a robot stands: one that only hunts about its place shows a tenth
/// of those of a driven one, among friction that sticks.
const STILL_MOTOR_RAD: f64 = 0.1;
const STILL_PITCH_RAD: f64 = 0.005;

/// Share by which the way may be off from what the wheels say: beyond it the radius is another.
const OTHER_RADIUS: f64 = 0.05;

/// Shortest log that can answer, s, and longest time between its rows, s.
const SHORTEST_S: f64 = 8.0;
const SLOWEST_S: f64 = 0.0101;

/// A wheel that stands so long while the other one turns so far has no sensor.
const DEAD_S: f64 = 0.5;
const DEAD_RAD: f64 = 0.1;
/// Of the range of the other motor's torque, what it goes through meanwhile.
const DEAD_TORQUE: f64 = 0.25;
/// Correlation of both torques from which on one must not be the other turned round, or many times it.
const ALIKE: f64 = 0.7;
const MANY: f64 = 5.0;
/// Half of the time in which a difference of the torques speeds one wheel up, s; the correlation, and its standard errors
/// below 0, from which on it speeds the other one up.
const CROSS_S: f64 = 0.02;
const CROSSED: f64 = 0.15;
const CROSSED_Z: f64 = 4.0;

/// Findings about logs as they are, those that are held out among them.
pub(super) fn check<'a>(
    logs: impl IntoIterator<Item = (&'a Log, &'a Readings)>,
    robot: &RobotModel,
) -> Vec<HealthFinding> {
    let (logs, readings): (Vec<&Log>, Vec<&Readings>) = logs.into_iter().unzip();
    let mut found: Vec<HealthFinding> = logs.iter().flat_map(|log| record::data_health(log)).collect();
    found.extend(rates::check(&logs));
    for (log, readings) in logs.iter().zip(readings) {
        found.extend(of_log(log, readings, robot));
    }
    found
}

/// The finding that the motion does not tell the declared numbers and the effects apart.
pub(super) fn inseparable() -> HealthFinding {
    finding(
        Severity::Error,
        "torque_left_nm",
        "the log does not tell declared numbers and effects apart".to_owned(),
        "drive to and fro, with tones of torque on top",
    )
}

fn finding(severity: Severity, column: &str, problem: String, remedy: &str) -> HealthFinding {
    HealthFinding::new(severity, column, problem, remedy)
}

fn of_log(log: &Log, readings: &Readings, robot: &RobotModel) -> Vec<HealthFinding> {
    let mut found = Vec::new();
    let error =
        |column: &str, problem: String, remedy: &str| finding(Severity::Error, column, problem, remedy);
    let seconds = readings.rows() as f64 * readings.dt_s;
    if seconds < SHORTEST_S {
        found.push(error(
            "time_s",
            format!("the log is {seconds:.1} s long, too short to tell effects apart"),
            "record 30 seconds and more",
        ));
    }
    if readings.dt_s > SLOWEST_S {
        let problem = format!("{:.0} rows a second are too few for a balancing loop", 1.0 / readings.dt_s);
        found.push(error("time_s", problem, "record every tick of the controller"));
    }
    for name in super::motion::COLUMNS {
        if let Some(values) = log.column(name)
            && values.iter().all(|value| *value == values[0])
        {
            found.push(error(name, "never changes".to_owned(), "check the sensor and its wire"));
        }
    }
    if !is_unfit(&found) {
        found.extend(of_signals(log, readings, robot));
    }
    found
}

/// Slope of b over a, through the origin, and their correlation.
fn relation(a: &[f64], b: &[f64]) -> (f64, f64) {
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (aa, ab, bb) = (sum(a, a), sum(a, b), sum(b, b));
    (ab / aa.max(1e-300), ab / (aa * bb).sqrt().max(1e-300))
}

/// Changes over a tenth of a second.
fn changes(column: &[f64], lag: usize) -> Vec<f64> {
    (lag..column.len()).step_by(lag.div_ceil(2)).map(|i| column[i] - column[i - lag]).collect()
}

/// Integrals over a tenth of a second.
fn sums(column: &[f64], lag: usize, dt_s: f64) -> Vec<f64> {
    let mut total = 0.0;
    let running: Vec<f64> = std::iter::once(0.0)
        .chain(column.iter().map(|value| {
            total += value * dt_s;
            total
        }))
        .collect();
    (lag..column.len()).step_by(lag.div_ceil(2)).map(|i| running[i] - running[i - lag]).collect()
}

/// A column that has another slope over what it ought to follow, or does not follow it.
fn compared(column: &str, (slope, correlation): (f64, f64), of: &str) -> Option<HealthFinding> {
    let problem = if correlation < -0.7 {
        format!("runs against {of}: its sign is wrong")
    } else if correlation.abs() < 0.5 {
        let problem =
            format!("does not follow {of} (correlation {correlation:.2}): a dead or mistaken sensor");
        let remedy = "check both sensors and their columns, and record anew";
        return Some(finding(Severity::Error, column, problem, remedy));
    } else if slope.abs() > 1.33 || slope.abs() / correlation.powi(2) < 0.75 {
        // Noise of the other column flattens the slope, by no more than the correlation says.
        format!("is {slope:.3} times what {of} says: its unit is wrong")
    } else {
        return None;
    };
    let remedy = "map the column with the right factor, --map COLUMN=COLUMN*FACTOR";
    Some(finding(Severity::Error, column, problem, remedy))
}

/// A way that the declared wheels cannot have rolled; `rolled` is what they say.
fn other_wheels(way: &[f64], rolled: &[f64], radius_m: f64) -> Option<HealthFinding> {
    let (slope, correlation) = relation(rolled, way);
    let least = slope / correlation.powi(2);
    if correlation < 0.9 || slope < 1.0 + OTHER_RADIUS && least > 1.0 - OTHER_RADIUS {
        return None;
    }
    let problem = format!(
        "is {slope:.3} times what wheel_radius_m = {radius_m} of the model makes of the motors' angles and the pitch: \
         the log is of other wheels"
    );
    let remedy = format!(
        "put wheel_radius_m = {:.4} into the model, or map the column, --map x_m=x_m*{:.4}",
        slope * radius_m,
        1.0 / slope
    );
    Some(finding(Severity::Error, "x_m", problem, &remedy))
}

fn of_signals(log: &Log, readings: &Readings, robot: &RobotModel) -> Vec<HealthFinding> {
    let mut found = Vec::new();
    let lag = ((0.1 / readings.dt_s) as usize).max(2);
    let dt_s = readings.dt_s;
    let pitch = changes(&readings.pitch_rad, lag);
    let moved = changes(&readings.angle_rad[0], lag);
    if is_still(readings) {
        let problem = "the robot hardly moves, so that few effects can be identified".to_owned();
        let remedy = "drive back and forth, with a multisine of torque on top, to have more of it identified";
        found.push(finding(Severity::Warning, "motor_angle_left_rad", problem, remedy));
        return found;
    }
    let turned = relation(&pitch, &sums(&readings.rate_rad_s, lag, dt_s));
    found.extend(compared("pitch_rate_rad_s", turned, "the change of pitch_rad"));
    let names = [
        ["motor_angle_left_rad", "motor_speed_left_rad_s"],
        ["motor_angle_right_rad", "motor_speed_right_rad_s"],
    ];
    let angles = [moved, changes(&readings.angle_rad[1], lag)];
    let speeds = names.map(|[_, name]| log.column(name).map(|speed| sums(speed, lag, dt_s)));
    for ([angle, name], (turned, speed)) in names.into_iter().zip(angles.iter().zip(&speeds)) {
        if let Some(speed) = speed.as_ref().filter(|speed| speed.len() == turned.len()) {
            found.extend(compared(name, relation(turned, speed), &format!("the change of {angle}")));
        }
    }
    let radius = robot.parameters.wheel_radius_m;
    let rolled: Vec<f64> =
        (0..pitch.len()).map(|i| radius * (0.5 * (angles[0][i] + angles[1][i]) + pitch[i])).collect();
    let way = changes(&readings.x_m, lag);
    let of_way = compared("x_m", relation(&rolled, &way), "wheel_radius_m × (motor angle + pitch)");
    found.extend(of_way.or_else(|| other_wheels(&way, &rolled, radius)));
    found.extend(compared(
        "motor_angle_right_rad",
        relation(&angles[0], &angles[1]),
        "the left motor's angle",
    ));
    if let [Some(left), Some(right)] = &speeds
        && left.len() == angles[0].len()
        && right.len() == angles[1].len()
    {
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let own = apart(left, &angles[0]) + apart(right, &angles[1]);
        let crossed = apart(left, &angles[1]) + apart(right, &angles[0]);
        if crossed < 0.2 * own {
            let problem = "follows the other motor's angle: left and right are swapped".to_owned();
            found.push(finding(
                Severity::Error,
                "motor_speed_left_rad_s",
                problem,
                "map both columns crosswise",
            ));
        }
    }
    found.extend(died(readings));
    found.extend(one_torque_off(readings));
    let most = most_torque_nm(robot);
    for (motor, name) in ["torque_left_nm", "torque_right_nm"].into_iter().enumerate() {
        let torque = &readings.torque_nm[motor];
        let peak = torque.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        if peak > most {
            let problem =
                format!("goes up to {peak:.0} N m, which no motor of this robot gives: its unit is wrong");
            found.push(finding(Severity::Error, name, problem, "map the column with the right factor"));
        }
        let clipped =
            torque.iter().filter(|value| value.abs() > 0.9999 * peak).count() as f64 / torque.len() as f64;
        if clipped > 0.01 {
            let problem = format!("{:.1} % of the rows are at the limit of {peak:.3} N m", 100.0 * clipped);
            let severity = if clipped > 0.1 { Severity::Error } else { Severity::Warning };
            found.push(finding(severity, name, problem, "record with less demand, or the torque that acts"));
        }
    }
    found
}

/// More than a motor gives: some times its limit, or what holds the robot's whole weight at the length of its body.
fn most_torque_nm(robot: &RobotModel) -> f64 {
    let p = &robot.parameters;
    let toppled_nm = Machine::robot(robot).weight_n() * (p.com_height_m + p.wheel_radius_m);
    robot.limits.torque_nm.map_or(toppled_nm, |limit| MANY * limit)
}

/// A wheel's angle, or a motor's torque, that stays where it is for long while the other one goes on.
fn died(readings: &Readings) -> Option<HealthFinding> {
    let travel = |column: &[f64]| {
        let [low, high] = column
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &q| [low.min(q), high.max(q)]);
        high - low
    };
    let stays = |own: &[f64], other: &[f64], least: f64| {
        let longest = longest_run(own)?;
        let seconds = longest.len() as f64 * readings.dt_s;
        (seconds > DEAD_S && travel(&other[longest.clone()]) > least)
            .then_some([seconds, longest.start as f64 * readings.dt_s])
    };
    let told = |name: &str, [seconds, start_s]: [f64; 2], other: &str| {
        let problem = format!(
            "stays the same for {seconds:.1} s from {start_s:.1} s on while the other {other} goes on: the sensor is dead \
             there"
        );
        let remedy = "check the sensor and its cable, or cut the log to the part before";
        finding(Severity::Error, name, problem, remedy)
    };
    let of = |motor: usize| {
        let side = ["left", "right"][motor];
        let [angles, torques] = [&readings.angle_rad, &readings.torque_nm]
            .map(|both| [both[motor].as_slice(), both[1 - motor].as_slice()]);
        let wheel = stays(angles[0], angles[1], DEAD_RAD);
        let torque = || stays(torques[0], torques[1], DEAD_TORQUE * travel(torques[1]));
        wheel
            .map(|rows| told(&format!("motor_angle_{side}_rad"), rows, "wheel"))
            .or_else(|| torque().map(|rows| told(&format!("torque_{side}_nm"), rows, "torque")))
    };
    (0..2).find_map(of)
}

/// One torque that runs against the other, or is many times larger.
fn one_torque_off(readings: &Readings) -> Option<HealthFinding> {
    let [left, right] = &readings.torque_nm;
    let (slope, correlation) = relation(left, right);
    let problem = if correlation < -ALIKE {
        "runs against torque_left_nm: the sign of one of them is wrong".to_owned()
    } else if correlation > ALIKE && !(1.0 / MANY..MANY).contains(&slope) {
        format!("is {slope:.3} times torque_left_nm: the unit of one of them is wrong")
    } else {
        return None;
    };
    let remedy = "map the one that is off, --map torque_left_nm=torque_left_nm*FACTOR \
                or --map torque_right_nm=torque_right_nm*FACTOR";
    Some(finding(Severity::Error, "torque_right_nm", problem, remedy))
}

/// Wheels of which each follows the other one's torque. A turn of the robot tells: what one torque is more than the other
/// speeds its own wheel up. Wheels that always turn alike tell nothing, and then it does not matter.
fn crosswise(readings: &Readings) -> Option<HealthFinding> {
    let half = ((CROSS_S / readings.dt_s).round() as usize).max(2);
    let [angles, torques] = [&readings.angle_rad, &readings.torque_nm];
    let apart: Vec<f64> = angles[0].iter().zip(&angles[1]).map(|(left, right)| left - right).collect();
    // Twice summed up, a torque is an angle.
    let (mut speed, mut angle) = (0.0, 0.0);
    let pushed: Vec<f64> = torques[0]
        .iter()
        .zip(&torques[1])
        .map(|(left, right)| {
            angle += speed;
            speed += left - right;
            angle
        })
        .collect();
    let bends = |column: &[f64]| -> Vec<f64> {
        let bent = |i: usize| column[i + 2 * half] - 2.0 * column[i + half] + column[i];
        let bends: Vec<f64> =
            (0..column.len().saturating_sub(2 * half)).step_by(2 * half).map(bent).collect();
        let mean = bends.iter().sum::<f64>() / bends.len().max(1) as f64;
        bends.into_iter().map(|bend| bend - mean).collect()
    };
    let (pushed, apart) = (bends(&pushed), bends(&apart));
    let (_, correlation) = relation(&pushed, &apart);
    let z = correlation * (pushed.len() as f64).sqrt();
    if !(correlation < -CROSSED && z < -CROSSED_Z) {
        return None;
    }
    let problem = format!(
        "turns the right wheel, and the right motor's torque the left one (correlation {correlation:.2}): left and right of \
         the torques or of the wheels' sensors are swapped"
    );
    let remedy =
        "map them crosswise, --map torque_left_nm=torque_right_nm --map torque_right_nm=torque_left_nm";
    Some(finding(Severity::Error, "torque_left_nm", problem, remedy))
}

/// Whether a robot stands: one that only hunts about its place, among friction that sticks.
pub(super) fn is_still(readings: &Readings) -> bool {
    let lag = ((0.1 / readings.dt_s) as usize).max(2);
    let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    rms(&changes(&readings.angle_rad[0], lag)) < STILL_MOTOR_RAD
        && rms(&changes(&readings.pitch_rad, lag)) < STILL_PITCH_RAD
}

/// Findings about the equations: a torque that cannot be what moves this robot.
pub(super) fn check_motion(trace: &Trace<'_>) -> Vec<HealthFinding> {
    // Of a robot that stands, friction takes most of the torque.
    if !trace.moves() {
        return Vec::new();
    }
    let residual = trace.residual();
    let torque = trace.torque_nm();
    // r2 = (what the motion asks for) + T: of the right unit and sign the motion asks for −T.
    let asked: Vec<f64> = residual[1].iter().zip(&torque).map(|(r2, torque)| torque - r2).collect();
    // A constant is an offset of the pitch, and no matter of unit or sign.
    let varying = |column: &[f64]| -> Vec<f64> {
        let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
        column.iter().map(|value| value - mean).collect()
    };
    let spread = quantile(&torque.iter().map(|t| t.abs()).collect::<Vec<_>>(), 0.9);
    let (slope, correlation) = relation(&varying(&torque), &varying(&asked));
    let problem = if spread < 0.02 {
        "the motors hardly push, so that effects cannot be told apart".to_owned()
    } else if correlation < -0.5 {
        "pushes against the motion: its sign is wrong".to_owned()
    } else if correlation > 0.5 && !(0.5..2.0).contains(&slope) {
        format!("is {:.3} times the torque that the motion needs: its unit is wrong", 1.0 / slope)
    } else if correlation.abs() < 0.5 {
        format!("does not go with the motion (correlation {correlation:.2}): another column, model or pitch")
    } else {
        // Torques that are turned round turn the robot the other way too.
        return trace.readings().find_map(crosswise).into_iter().collect();
    };
    let remedy =
        "map the column with the right factor, --map torque_left_nm=COLUMN*FACTOR, or correct the model";
    vec![finding(Severity::Error, "torque_left_nm", problem, remedy)]
}

#[cfg(test)]
#[path = "health_tests.rs"]
mod tests;
