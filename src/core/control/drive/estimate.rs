//! X from encoders and IMU, brought to the time at which the torque that answers it will act.
//!
//! Readings are old when the controller gets them, and its torque acts later still:
//! - The IMU speaks every 5 or 10 ms. From its reading to that of the motors its pitch is carried on by the law of
//!   momentum: without ΣT, which enters Eqs. 4 and 5 with opposite signs, and with ẍ = r (q̈ + θ̈), their sum is
//!   (c₂ + c₃ + r (c₁ + c₅)) θ̈ = c₄ θ − r (c₁ + c₅) q̈. The motor speeds stand for the torque, so that neither the
//!   friction nor the scale of the torque matters.
//! - From the motors' reading to the new torque, which the model says is `actuation.delay_s` later, the linear model
//!   (Eq. 11) moves on under the torques that have been asked for already and have not acted yet, less the friction of
//!   the model; the turning robot goes on turning at its rate.

use std::collections::VecDeque;
use std::time::Duration;

use crate::control::{Measurement, Odometry, Readings};
use crate::friction::{Compensation, Feedforward};
use crate::link::{ImuReading, MotorState};
use crate::model_file::RobotModel;
use crate::robot::{Coefficients, TICK_S};

/// Torques and speeds that are remembered: more ticks than any delay that is bridged.
const REMEMBERED: usize = 128;
/// The longest way that is bridged, s; the linear model's fastest pole is not to take an error along by more than
/// a half.
const LONGEST_BRIDGE_S: f64 = 0.05;
/// Speed over which friction turns over, rad/s: a shaft at rest is then held as by a viscous damper, which is stable
/// in steps of 1 ms.
const FRICTION_TURNS_RAD_S: f64 = 0.05;

/// What the sensors said last, and what has been asked of the motors.
#[derive(Clone, Debug)]
pub(super) struct Estimator {
    odometry: Odometry,
    laws: Coefficients,
    friction: [Option<Feedforward>; 2],
    delay_s: f64,
    imu_latency_s: f64,
    motors: [Option<MotorState>; 2],
    imu: Option<ImuReading>,
    /// Angles of the motors at which the robot is where it counts from, rad.
    origin_rad: Option<[f64; 2]>,
    /// Mean of the motor speeds over time, oldest first.
    speeds: VecDeque<(Duration, f64)>,
    /// Torques and when they were asked for, oldest first.
    asked: VecDeque<(Duration, [f64; 2])>,
}

/// Pitch and its rate.
#[derive(Clone, Copy)]
struct Pitch {
    rad: f64,
    rate_rad_s: f64,
}

impl Estimator {
    pub(super) fn new(robot: &RobotModel) -> Self {
        let compensation = Compensation { ratio: 1.0, smoothing_speed_rad_s: FRICTION_TURNS_RAD_S };
        let friction = robot.friction.map(|curve| curve.and_then(|c| Feedforward::new(c, compensation).ok()));
        Self {
            odometry: Odometry::new(robot),
            laws: robot.parameters.coefficients(),
            friction,
            delay_s: robot.actuation.delay_s,
            imu_latency_s: robot.sensors.imu_latency_s,
            motors: [None; 2],
            imu: None,
            origin_rad: None,
            speeds: VecDeque::with_capacity(REMEMBERED),
            asked: VecDeque::with_capacity(REMEMBERED),
        }
    }

    /// Takes the newest reading of each sensor.
    pub(super) fn hear(&mut self, motors: [Option<MotorState>; 2], imu: Option<ImuReading>) {
        (self.motors, self.imu) = (motors, imu);
        let Some((time, [left, right])) = self.heard() else { return };
        if self.speeds.back().is_none_or(|&(last, _)| last < time) {
            remember(&mut self.speeds, (time, f64::midpoint(left.speed_rad_s, right.speed_rad_s)));
        }
        if self.origin_rad.is_none() {
            self.count_from_here();
        }
    }

    /// Remembers what has been asked of the motors.
    pub(super) fn remember_asked(&mut self, now: Duration, torque_nm: [f64; 2]) {
        remember(&mut self.asked, (now, torque_nm));
    }

    /// Way, heading and motor angles count from here on.
    pub(super) fn count_from_here(&mut self) {
        if let (Some((_, motors)), Some(imu)) = (self.heard(), self.imu) {
            // Motor angles are 0 upright at x = 0, where x = r (q + θ).
            self.origin_rad = Some(motors.map(|motor| motor.angle_rad + imu.pitch_rad));
        }
    }

    /// The newest reading of each sensor as it is; none before each has been heard.
    pub(super) fn readings(&self) -> Option<Readings> {
        let (_, motors) = self.heard()?;
        let (imu, [left, right]) = (self.imu?, self.origin_rad?);
        let [left_motor, right_motor] = motors;
        Some(Readings {
            motor_angle_rad: [left_motor.angle_rad - left, right_motor.angle_rad - right],
            motor_speed_rad_s: motors.map(|motor| motor.speed_rad_s),
            pitch_rad: imu.pitch_rad,
            pitch_rate_rad_s: imu.pitch_rate_rad_s,
        })
    }

    /// What those readings say (x = r (q + θ)).
    pub(super) fn held(&self, readings: &Readings) -> Measurement {
        self.odometry.measurement(readings)
    }

    /// What the readings will say when a torque that is asked for `now` acts.
    pub(super) fn at_action(&self, now: Duration, readings: &Readings) -> Measurement {
        let Some(((heard, _), imu)) = self.heard().zip(self.imu) else { return self.held(readings) };
        let pitch = self.pitch_with_motors(&imu, heard, readings);
        // A reading that is at most a tick old is what the delay is counted from; an older one waits for one that
        // was lost.
        let lost_s = (now.saturating_sub(heard).as_secs_f64() - TICK_S).max(0.0);
        self.moved_on(now, (self.delay_s + lost_s).min(LONGEST_BRIDGE_S), readings, pitch)
    }

    /// The newest readings of both motors, and the time of the later one.
    fn heard(&self) -> Option<(Duration, [MotorState; 2])> {
        let (left, right) = self.motors[0].zip(self.motors[1])?;
        Some((left.time.max(right.time), [left, right]))
    }

    /// The IMU's pitch, carried on to the time of the motors' reading.
    fn pitch_with_motors(&self, imu: &ImuReading, heard: Duration, readings: &Readings) -> Pitch {
        let start = imu.time.saturating_sub(Duration::from_secs_f64(self.imu_latency_s));
        let mut pitch = Pitch { rad: readings.pitch_rad, rate_rad_s: readings.pitch_rate_rad_s };
        let way = heard.saturating_sub(start).as_secs_f64();
        if way == 0.0 || way > LONGEST_BRIDGE_S {
            return pitch;
        }
        let Coefficients { c1, c2, c3, c4, c5, .. } = self.laws;
        let rolling = self.odometry.wheel_radius_m * (c1 + c5);
        let inertia = c2 + c3 + rolling;
        let (mut time, mut speed) = (start, self.speed_at(start));
        for &(next_time, next_speed) in self.speeds.iter().filter(|&&(next, _)| next > start) {
            let dt_s = (next_time - time).as_secs_f64();
            let rate = pitch.rate_rad_s + (c4 * pitch.rad * dt_s - rolling * (next_speed - speed)) / inertia;
            pitch.rad += 0.5 * (pitch.rate_rad_s + rate) * dt_s;
            pitch.rate_rad_s = rate;
            (time, speed) = (next_time, next_speed);
        }
        pitch
    }

    /// Mean motor speed at a time: that of the nearest readings, by a straight line between them.
    fn speed_at(&self, time: Duration) -> f64 {
        let next = self.speeds.partition_point(|&(t, _)| t < time);
        match (next.checked_sub(1).and_then(|i| self.speeds.get(i)), self.speeds.get(next)) {
            (Some(&(before, low)), Some(&(after, high))) => {
                let share = (time - before).as_secs_f64() / (after - before).as_secs_f64();
                low + share * (high - low)
            }
            (Some(&(_, speed)), None) | (None, Some(&(_, speed))) => speed,
            (None, None) => 0.0,
        }
    }

    /// The linear model from the motors' reading on for `way_s`, up to where a torque that is asked for `now` acts.
    fn moved_on(&self, now: Duration, way_s: f64, readings: &Readings, mut pitch: Pitch) -> Measurement {
        let Coefficients { c1, c2, c3, c4, c5, determinant } = self.laws;
        let radius = self.odometry.wheel_radius_m;
        let mut readings = *readings;
        let steps = (way_s / TICK_S).round() as u32;
        for step in 0..steps {
            let left_s = way_s - f64::from(step) * TICK_S;
            let [left, right] = self.acting(now, left_s, &readings.motor_speed_rad_s);
            let torque = left + right;
            let x_ddot = ((c2 + c3) * torque - c2 * c4 * pitch.rad) / determinant;
            let pitch_accel = (c1 * c4 * pitch.rad - (c1 + c5) * torque) / determinant;
            let motor_accel = x_ddot / radius - pitch_accel;
            for (angle, speed) in readings.motor_angle_rad.iter_mut().zip(&mut readings.motor_speed_rad_s) {
                *angle += TICK_S * (*speed + 0.5 * TICK_S * motor_accel);
                *speed += TICK_S * motor_accel;
            }
            pitch.rad += TICK_S * (pitch.rate_rad_s + 0.5 * TICK_S * pitch_accel);
            pitch.rate_rad_s += TICK_S * pitch_accel;
        }
        (readings.pitch_rad, readings.pitch_rate_rad_s) = (pitch.rad, pitch.rate_rad_s);
        self.held(&readings)
    }

    /// Torques on the shafts `left_s` before one that is asked for `now` acts, less friction, N m.
    fn acting(&self, now: Duration, left_s: f64, speeds: &[f64; 2]) -> [f64; 2] {
        // Half a tick of room for ticks that come a little early or late.
        let before = now.saturating_sub(Duration::from_secs_f64((left_s - 0.5 * TICK_S).max(0.0)));
        let asked = self.asked.iter().rev().find(|&&(time, _)| time <= before);
        let torque = asked.map_or([0.0; 2], |&(_, torque)| torque);
        [0, 1].map(|motor: usize| {
            torque[motor] - self.friction[motor].map_or(0.0, |friction| friction.torque_nm(speeds[motor]))
        })
    }
}

fn remember<T>(memory: &mut VecDeque<T>, news: T) {
    if memory.len() == REMEMBERED {
        memory.pop_front();
    }
    memory.push_back(news);
}
