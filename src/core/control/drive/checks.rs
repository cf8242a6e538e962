//! What has to be right before a robot is armed.

use std::time::Duration;

use super::imu_watch::near_zero;
use super::sign::{Rocking, Slope};
use super::stage::{Check, CheckResult};
use super::watch::Watch;
use crate::link::MotorHealth;
use crate::link::protocol::protocol;
use crate::model::{Motor, RobotModel};

/// A motor or an IMU answers if it was received within this time, s.
const FRESH_S: f64 = 0.5;
/// Time after which a command of another controller is forgotten, s: the longest time between two commands of one that
/// does not drive the robot just now.
const COMMANDED_S: f64 = 5.0;
/// Time in which everybody is received for the first time.
const FIRST_ANSWERS: Duration = Duration::from_millis(300);
/// Fraction of the IMU's rate that has to be there.
const RATE_SHARE: f64 = 0.9;
/// Largest pitch, rad, and pitch rate, rad/s, at which a robot is let go.
const UPRIGHT_RAD: f64 = 0.15;
const CALM_RAD_S: f64 = 0.5;
/// Greatest difference of pitch and tilt from acceleration, rad, and time constant of its mean, s: a body that is
/// rocked by hand is accelerated as well.
const TILT_APART_RAD: f64 = 0.1;
const TILT_MEMORY_S: f64 = 1.0;

/// The checks, and what they remember of the readings.
#[derive(Clone, Debug)]
pub(super) struct Checks {
    balancing: bool,
    list: Vec<Check>,
    rocking: Rocking,
    /// What rocking has told so far; later rocking may tell otherwise.
    slopes: [Slope; 2],
    /// Mean of tilt less pitch, rad.
    tilt_apart_rad: Option<f64>,
    last_imu: Option<Duration>,
    /// When checking began.
    began: Duration,
}

impl Checks {
    pub(super) fn new(balancing: bool, began: Duration) -> Self {
        Self {
            balancing,
            began,
            list: Vec::new(),
            rocking: Rocking::default(),
            slopes: [Slope::Unknown; 2],
            tilt_apart_rad: None,
            last_imu: None,
        }
    }

    pub(super) fn list(&self) -> &[Check] {
        &self.list
    }

    /// The first one that has failed, or else is waited for.
    pub(super) fn open(&self) -> Option<&Check> {
        let failed = self.list.iter().find(|check| check.result == CheckResult::Failed);
        failed.or_else(|| self.list.iter().find(|check| check.result == CheckResult::Waiting))
    }

    /// Takes a new reading of the IMU, with the motor angles then.
    pub(super) fn observe(&mut self, watch: &Watch) {
        let Some(imu) = watch.imu.last else { return };
        let [Some(left), Some(right)] = watch.motors.map(|motor| motor.state) else { return };
        if self.last_imu.is_some_and(|last| last >= imu.time) {
            return;
        }
        let dt_s = self.last_imu.map_or(0.0, |last| (imu.time - last).as_secs_f64());
        self.last_imu = Some(imu.time);
        self.rocking.add(dt_s, imu.pitch_rad, [left.angle_rad, right.angle_rad]);
        for (known, found) in self.slopes.iter_mut().zip(self.rocking.slopes()) {
            if found != Slope::Unknown {
                *known = found;
            }
        }
        if let Some(tilt_rad) = imu.tilt_rad {
            let apart = near_zero(tilt_rad - imu.pitch_rad);
            let mean = self.tilt_apart_rad.get_or_insert(apart);
            *mean += near_zero(apart - *mean) * (1.0 - libm::exp(-dt_s / TILT_MEMORY_S));
        }
    }

    /// How everything stands now.
    pub(super) fn judge(&mut self, now: Duration, watch: &Watch, robot: &RobotModel) {
        let mut list = std::mem::take(&mut self.list);
        list.clear();
        let ids = robot.link.motor_ids();
        let asked = now > self.began + FIRST_ANSWERS;
        list.extend([Motor::Left, Motor::Right].map(|motor| match answers(now, watch, motor, ids) {
            Check { name, result: CheckResult::Failed, .. } if !asked => waiting(name, "is asked".to_owned()),
            check => check,
        }));
        list.push(nobody_else(now, watch));
        list.push(round_trip(watch, robot));
        list.extend(of_health(watch, robot));
        list.push(self.imu_rate(now, watch, robot));
        list.push(self.imu_alive(now, watch, robot));
        list.push(self.gravity());
        if self.balancing {
            list.push(upright(watch, robot));
            list.push(self.directions());
        }
        self.list = list;
    }

    fn imu_rate(&self, now: Duration, watch: &Watch, robot: &RobotModel) -> Check {
        const NAME: &str = "IMU rate";
        let set_hz = f64::from(robot.link.imu_rate_hz);
        let fresh = watch.imu.last.is_some_and(|last| is_fresh(now, last.time));
        match watch.imu.rate_hz() {
            _ if !fresh && now < self.began + FIRST_ANSWERS => waiting(NAME, "listening".to_owned()),
            _ if !fresh => failed(
                NAME,
                "the IMU is silent: check its cable, port and baud rate (115200 for 200 Hz)".to_owned(),
            ),
            None => waiting(NAME, "counting".to_owned()),
            Some(rate_hz) if rate_hz < RATE_SHARE * set_hz => failed(
                NAME,
                format!(
                    "{rate_hz:.0} Hz instead of {set_hz} Hz: set the rate and baud rate of \
                     the IMU, or imu_rate_hz in [link]"
                ),
            ),
            Some(rate_hz) => passed(NAME, format!("{rate_hz:.0} Hz")),
        }
    }

    fn imu_alive(&self, now: Duration, watch: &Watch, robot: &RobotModel) -> Check {
        const NAME: &str = "IMU moves";
        let Some(last) = watch.imu.last else { return waiting(NAME, "no data yet".to_owned()) };
        let frozen = watch.imu.frozen(now, &robot.safety, self.balancing);
        match frozen {
            Some(problem) if last.tilt_rad.is_some() => failed(NAME, problem.to_string()),
            // Without acceleration a quiet IMU may say the same again and again.
            Some(problem) => waiting(NAME, format!("{problem}, or move the robot")),
            None => watch.imu.inconsistent(&robot.safety).map_or_else(
                || passed(NAME, "its measurements change".to_owned()),
                |problem| failed(NAME, problem.to_string()),
            ),
        }
    }

    fn gravity(&self) -> Check {
        const NAME: &str = "IMU and gravity";
        let Some(apart) = self.tilt_apart_rad else {
            let nothing = "the IMU sends no acceleration to compare its pitch with".to_owned();
            return if self.last_imu.is_some() { passed(NAME, nothing) } else { waiting(NAME, nothing) };
        };
        if apart.abs() <= TILT_APART_RAD {
            return passed(
                NAME,
                format!("pitch and the direction of gravity agree within {:.3} rad", apart.abs()),
            );
        }
        let found = format!("gravity and pitch differ by {apart:.2} rad");
        let remedy = if apart.abs() > 2.0 {
            "check whether the IMU is mounted upside down, and calibrate its horizontal"
        } else {
            "choose the other pitch_axis in [link] if the IMU is mounted rotated, or calibrate its horizontal"
        };
        failed(NAME, format!("{found}: {remedy}"))
    }

    /// Whether encoders and IMU count forward as the robot does.
    fn directions(&self) -> Check {
        const NAME: &str = "directions";
        use Slope::{EncoderScale, Reversed, Right, Unclear, Unknown};
        match self.slopes {
            [Right, Right] => passed(NAME, "both motor angles decrease as the pitch increases".to_owned()),
            [Reversed, Reversed] => failed(
                NAME,
                "the IMU is mounted in reverse: reverse pitch_direction in [link] (or left_direction and \
                 right_direction, if the displayed pitch increases as the body leans forward)"
                    .to_owned(),
            ),
            [Reversed, _] => failed(NAME, reversed(Motor::Left)),
            [_, Reversed] => failed(NAME, reversed(Motor::Right)),
            [EncoderScale(times), _] => failed(NAME, wrong_steps(Motor::Left, times)),
            [_, EncoderScale(times)] => failed(NAME, wrong_steps(Motor::Right, times)),
            [Unclear, _] | [_, Unclear] => waiting(
                NAME,
                "motors and body do not turn by the same angle: keep the wheels on the ground \
                 without rolling, and rock the body slowly by 0.1 rad"
                    .to_owned(),
            ),
            [Unknown, _] | [_, Unknown] => waiting(
                NAME,
                "rock the body slowly by 0.1 rad, with the wheels on the ground and not rolling".to_owned(),
            ),
        }
    }
}

fn answers(now: Duration, watch: &Watch, motor: Motor, ids: [u8; 2]) -> Check {
    let name = ["left motor", "right motor"][motor as usize];
    let heard = |motor: Motor| {
        let watch = &watch.motors[motor as usize];
        [watch.state.map(|state| state.time), watch.health.map(|health| health.time)]
            .map(|time| time.is_some_and(|time| is_fresh(now, time)))
    };
    let id = ids[motor as usize];
    let key = ["left_motor_id", "right_motor_id"][motor as usize];
    let other = Motor::BOTH[1 - motor as usize];
    match heard(motor) {
        [true, true] => passed(name, format!("id {id} answers")),
        [false, false] if heard(other) == [false, false] => failed(
            name,
            format!("id {id} is silent, and so is the other motor: check supply, wiring and bit rate"),
        ),
        [false, false] => failed(
            name,
            format!(
                "id {id} is silent while id {} answers: check its cable, and {key} in [link] \
                 (its LED blinks the id)",
                ids[other as usize]
            ),
        ),
        [true, false] => waiting(name, format!("id {id} has not reported voltage and errors yet")),
        [false, true] => waiting(name, format!("id {id} has not reported angle and speed yet")),
    }
}

/// Nobody else commands the motors while they are only queried.
fn nobody_else(now: Duration, watch: &Watch) -> Check {
    const NAME: &str = "no other controller";
    let heard = watch.motors.iter().filter_map(|motor| motor.commanded).max();
    match heard.map(|(time, command)| (now.saturating_sub(time).as_secs_f64(), command)) {
        Some((age_s, command)) if age_s <= COMMANDED_S => failed(
            NAME,
            format!(
                "another controller on the bus commanded the motors {age_s:.1} s ago (0x{command:02X}): switch it off"
            ),
        ),
        _ => passed(NAME, "no other controller commands the motors".to_owned()),
    }
}

/// Replies come soon enough.
fn round_trip(watch: &Watch, robot: &RobotModel) -> Check {
    const NAME: &str = "round trip";
    if protocol(robot.link.protocol).reports_unprompted {
        return passed(NAME, "the motors report unprompted".to_owned());
    }
    let [Some(left), Some(right)] = watch.motors.map(|motor| motor.round_trips.upper_quartile_s()) else {
        return waiting(NAME, "is measured".to_owned());
    };
    let (slowest_ms, limit_s) = (1e3 * left.max(right), robot.safety.round_trip_s);
    let found = format!("75 % of the replies of the motors take at most {slowest_ms:.1} ms");
    if left.max(right) <= limit_s {
        return passed(NAME, found);
    }
    failed(
        NAME,
        format!(
            "{found}, above {} ms: use a faster CAN adapter or a higher baud rate, close other programs, or raise \
             round_trip_s in [safety] and delay_s in [actuation]",
            1e3 * limit_s
        ),
    )
}

fn of_health(watch: &Watch, robot: &RobotModel) -> [Check; 3] {
    const NAMES: [&str; 3] = ["temperature", "voltage", "motor errors"];
    let [Some(left), Some(right)] = watch.motors.map(|motor| motor.health) else {
        return NAMES.map(|name| waiting(name, "not reported yet".to_owned()));
    };
    let both = [left, right];
    let limits = &robot.safety;
    let temperatures = watch.motors.map(|motor| motor.temperature_c().unwrap_or(0.0));
    let hottest = temperatures.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let temperature = if hottest > limits.temperature_c {
        failed(NAMES[0], format!("{hottest} °C, above {} °C: let the motors cool down", limits.temperature_c))
    } else {
        passed(NAMES[0], format!("{} and {} °C", temperatures[0], temperatures[1]))
    };
    [temperature, voltage(NAMES[1], &both, robot), errors(NAMES[2], &both)]
}

fn voltage(name: &'static str, both: &[MotorHealth; 2], robot: &RobotModel) -> Check {
    let [least, greatest] = [robot.safety.least_voltage_v, robot.safety.greatest_voltage_v];
    let [Some(left), Some(right)] = both.map(|health| health.voltage_v) else {
        return passed(name, "not reported by the motors".to_owned());
    };
    match [left, right].into_iter().find(|v| !(least..=greatest).contains(v)) {
        None => passed(name, format!("{left:.1} and {right:.1} V")),
        Some(found) => failed(
            name,
            format!(
                "{found:.1} V, outside {least} to {greatest} V: charge or check the battery; if the voltage is right, \
                 set state_layout in [link] or the limits in [safety]"
            ),
        ),
    }
}

fn errors(name: &'static str, both: &[MotorHealth; 2]) -> Check {
    let wrong = Motor::BOTH.into_iter().zip(both).find(|(_, health)| !health.errors.is_none());
    match wrong {
        None => passed(name, "none".to_owned()),
        Some((motor, health)) => failed(
            name,
            format!(
                "the {motor} motor reports {}: remove the cause, then power-cycle the motor",
                health.errors
            ),
        ),
    }
}

fn upright(watch: &Watch, robot: &RobotModel) -> Check {
    const NAME: &str = "upright";
    let Some(imu) = watch.imu.last else { return waiting(NAME, "pitch not available yet".to_owned()) };
    let allowed = UPRIGHT_RAD.min(0.5 * robot.safety.tilt_rad);
    if imu.pitch_rad.abs() > allowed || imu.pitch_rate_rad_s.abs() > CALM_RAD_S {
        let found = format!(
            "pitch {:.3} rad at {:.2} rad/s: hold the robot upright within {allowed} rad and still",
            imu.pitch_rad, imu.pitch_rate_rad_s
        );
        return waiting(NAME, found);
    }
    passed(NAME, format!("pitch {:.3} rad", imu.pitch_rad))
}

fn reversed(motor: Motor) -> String {
    format!("the {motor} motor counts backward: reverse {motor}_direction in [link]")
}

fn wrong_steps(motor: Motor, times: f64) -> String {
    format!(
        "the {motor} motor turns {times:.2} times as far as the body: set encoder_steps in [link], 65536 or 16384"
    )
}

fn is_fresh(now: Duration, time: Duration) -> bool {
    now.saturating_sub(time).as_secs_f64() <= FRESH_S
}

fn passed(name: &'static str, text: String) -> Check {
    Check { name, result: CheckResult::Passed, text }
}

fn waiting(name: &'static str, text: String) -> Check {
    Check { name, result: CheckResult::Waiting, text }
}

fn failed(name: &'static str, text: String) -> Check {
    Check { name, result: CheckResult::Failed, text }
}
