//! X from encoders and IMU, brought to the time at which the torque that answers it will act.
//!
//! Readings are old when the controller gets them, and its torque acts later still:
//! - The IMU speaks every 5 or 10 ms. From its reading to that of the motors its pitch is carried on by the law of
//!   momentum: without ΣT, which enters Eqs. 4 and 5 with opposite signs, and with ẍ = r (q̈ + θ̈), their sum is
//!   (c₂ + c₃ + r (c₁ + c₅)) θ̈ = c₄ θ − r (c₁ + c₅) q̈. The motor speeds stand for the torque, so that neither the
//!   friction nor the scale of the torque matters.
//! - From the motors' reading to the new torque, which the model says is `torque_delay_s` later, the linear model
//!   (Eq. 11) moves on under the torques that have been requested already and have not acted yet, less the friction of
//!   the model, which holds a shaft that it can stop within a step; the turning robot goes on turning at its rate.
//! - The mean of the motor speeds, read in steps of 1 deg/s, is smoothed by the same model: each tick it moves on under
//!   the torques that act, and takes three tenths of what the reading says otherwise.

use std::collections::VecDeque;
use std::time::Duration;

use crate::control::{Measurement, Odometry};
use crate::friction::Stribeck;
use crate::link::{ImuReading, MotorState};
use crate::model::{Coefficients, RobotModel, TICK_S};
use crate::record::Readings;

/// Torques and speeds that are remembered: more ticks than any delay that is bridged.
const REMEMBERED: usize = 128;
/// The longest way that is bridged, s; the linear model's fastest pole is not to take an error along by more than
/// a half.
const LONGEST_BRIDGE_S: f64 = 0.05;
/// Fraction of a reading's surprise that the smoothed motor speed takes each tick.
const SMOOTHING: f64 = 0.3;
/// Time after which it begins anew, s.
const LONGEST_GAP_S: f64 = 0.02;
/// Opposite speeds of the motors beyond which the robot turns on the spot and friction has no common direction, rad/s.
const TURNING_RAD_S: f64 = 0.05;

/// What the sensors said last, and what has been asked of the motors.
#[derive(Clone, Debug)]
pub(super) struct Estimator {
    odometry: Odometry,
    laws: Coefficients,
    friction: [Option<Stribeck>; 2],
    delay_s: f64,
    imu_latency_s: f64,
    motors: [Option<MotorState>; 2],
    imu: Option<ImuReading>,
    /// Angles of the motors at which the robot is where it counts from, rad.
    origin_rad: Option<[f64; 2]>,
    /// Smoothed mean of the motor speeds over time, oldest first.
    speeds: VecDeque<(Duration, f64)>,
    /// Torques and when they were requested, oldest first.
    asked: VecDeque<(Duration, [f64; 2])>,
}

/// Pitch and its rate.
#[derive(Clone, Copy)]
struct Pitch {
    rad: f64,
    rate_rad_s: f64,
}

/// What the model makes of a step.
struct Motion {
    speed_rad_s: f64,
    pitch_accel_rad_s2: f64,
}

impl Estimator {
    pub(super) fn new(robot: &RobotModel) -> Self {
        Self {
            odometry: Odometry::new(robot),
            laws: robot.parameters.coefficients(),
            friction: robot.friction,
            delay_s: robot.torque_delay_s(),
            imu_latency_s: robot.with_effects_declared().sensors.imu_latency_s,
            motors: [None; 2],
            imu: None,
            origin_rad: None,
            speeds: VecDeque::with_capacity(REMEMBERED),
            asked: VecDeque::with_capacity(REMEMBERED),
        }
    }

    /// Takes the newest reading of each sensor.
    pub(super) fn hear(&mut self, now: Duration, motors: [Option<MotorState>; 2], imu: Option<ImuReading>) {
        (self.motors, self.imu) = (motors, imu);
        let Some((time, [left, right])) = self.heard() else { return };
        if self.speeds.back().is_none_or(|&(last, _)| last < time) {
            let read = f64::midpoint(left.speed_rad_s, right.speed_rad_s);
            let speed = self.smoothed(now, time, read, [left.speed_rad_s, right.speed_rad_s]);
            remember(&mut self.speeds, (time, speed));
        }
        if self.origin_rad.is_none() {
            self.count_from_here();
        }
    }

    /// The mean motor speed at a reading: what the model made of the one before, and a fraction of what was read.
    fn smoothed(&self, now: Duration, time: Duration, read: f64, speeds: [f64; 2]) -> f64 {
        let Some(&(last, before)) = self.speeds.back() else { return read };
        let dt_s = (time - last).as_secs_f64();
        if dt_s > LONGEST_GAP_S {
            return read;
        }
        let pitch = self.imu.map_or(0.0, |imu| imu.pitch_rad);
        let expected =
            self.motion(pitch, before, self.acting(now, self.delay_s + dt_s), speeds, dt_s).speed_rad_s;
        let share = 1.0 - libm::pow(1.0 - SMOOTHING, dt_s / TICK_S);
        expected + share * (read - expected)
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

    /// The newest reading of each sensor as it is; none before each has been received.
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

    /// What the readings will say when a torque that is requested `now` acts.
    pub(super) fn at_action(&self, now: Duration, readings: &Readings) -> Measurement {
        let Some(((heard, _), imu)) = self.heard().zip(self.imu) else { return self.held(readings) };
        let pitch = self.pitch_with_motors(&imu, heard, readings);
        let mut readings = *readings;
        let [left, right] = readings.motor_speed_rad_s;
        if let Some(&(_, smoothed)) = self.speeds.back() {
            readings.motor_speed_rad_s =
                [left, right].map(|speed| speed - f64::midpoint(left, right) + smoothed);
        }
        // A reading that is at most a tick old is what the delay is counted from; an older one waits for one that
        // was lost.
        let lost_s = (now.saturating_sub(heard).as_secs_f64() - TICK_S).max(0.0);
        self.moved_on(now, (self.delay_s + lost_s).min(LONGEST_BRIDGE_S), &readings, pitch)
    }

    /// Age of the motors' newest reading, s.
    pub(super) fn age_s(&self, now: Duration) -> f64 {
        self.heard().map_or(f64::INFINITY, |(heard, _)| now.saturating_sub(heard).as_secs_f64())
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

    /// Smoothed mean motor speed at a time, by a straight line between readings.
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

    /// The linear model from the motors' reading on for `way_s`, up to where a torque that is requested `now` acts.
    fn moved_on(&self, now: Duration, way_s: f64, readings: &Readings, mut pitch: Pitch) -> Measurement {
        let mut readings = *readings;
        for step in 0..(way_s / TICK_S).round() as u32 {
            let asked_nm = self.acting(now, way_s - f64::from(step) * TICK_S);
            let [left, right] = readings.motor_speed_rad_s;
            let mean = f64::midpoint(left, right);
            let next = self.motion(pitch.rad, mean, asked_nm, [left, right], TICK_S);
            let change = next.speed_rad_s - mean;
            for (angle, speed) in readings.motor_angle_rad.iter_mut().zip(&mut readings.motor_speed_rad_s) {
                *angle += TICK_S * (*speed + 0.5 * change);
                *speed += change;
            }
            pitch.rad += TICK_S * (pitch.rate_rad_s + 0.5 * TICK_S * next.pitch_accel_rad_s2);
            pitch.rate_rad_s += TICK_S * next.pitch_accel_rad_s2;
        }
        (readings.pitch_rad, readings.pitch_rate_rad_s) = (pitch.rad, pitch.rate_rad_s);
        self.held(&readings)
    }

    /// Mean motor speed after `dt_s` and the pitch's acceleration until then, from pitch, mean speed, torques and the
    /// speed of each motor.
    fn motion(&self, pitch_rad: f64, mean: f64, asked_nm: [f64; 2], speeds: [f64; 2], dt_s: f64) -> Motion {
        let Coefficients { c1, c2, c3, c4, c5, determinant } = self.laws;
        let radius = self.odometry.wheel_radius_m;
        let x_ddot = |torque: f64| ((c2 + c3) * torque - c2 * c4 * pitch_rad) / determinant;
        let pitch_accel = |torque: f64| (c1 * c4 * pitch_rad - (c1 + c5) * torque) / determinant;
        let asked = asked_nm[0] + asked_nm[1];
        let free = mean + dt_s * (x_ddot(asked) / radius - pitch_accel(asked));
        let speed_per_nm = dt_s * ((c2 + c3) / radius + c1 + c5) / determinant;
        let friction = self.friction_nm(speeds, free / speed_per_nm);
        Motion {
            speed_rad_s: free - speed_per_nm * friction,
            pitch_accel_rad_s2: pitch_accel(asked - friction),
        }
    }

    /// Friction of both motors, N m: at most the torque that stops them within the step.
    fn friction_nm(&self, speeds: [f64; 2], stopping_nm: f64) -> f64 {
        let of_motor = |motor: usize, speed: f64| {
            self.friction[motor].map_or([0.0; 2], |curve| {
                let p = curve.parameters();
                let smooth = p.offset_nm + p.viscous_nm_s_rad * speed;
                [curve.amplitude_nm(speed), smooth]
            })
        };
        let [left, right] = speeds;
        let turning = left * right < 0.0 && left.abs().min(right.abs()) > TURNING_RAD_S;
        let [of_left, of_right] = [of_motor(0, left), of_motor(1, right)];
        let smooth = of_left[1] + of_right[1];
        if turning {
            return smooth + left.signum() * of_left[0] + right.signum() * of_right[0];
        }
        let most = of_left[0] + of_right[0];
        if most == 0.0 {
            return smooth;
        }
        (stopping_nm - smooth).clamp(-most, most) + smooth
    }

    /// Torques that act `left_s` before one that is requested `now` does, N m.
    fn acting(&self, now: Duration, left_s: f64) -> [f64; 2] {
        // Half a tick of room for ticks that come a little early or late.
        let before = now.saturating_sub(Duration::from_secs_f64((left_s - 0.5 * TICK_S).max(0.0)));
        let asked = self.asked.iter().rev().find(|&&(time, _)| time <= before);
        asked.map_or([0.0; 2], |&(_, torque)| torque)
    }

    /// Torques that acted when the motors were read, N m.
    pub(super) fn acting_when_read(&self, now: Duration) -> [f64; 2] {
        self.acting(now, self.delay_s)
    }
}

fn remember<T>(memory: &mut VecDeque<T>, news: T) {
    if memory.len() == REMEMBERED {
        memory.pop_front();
    }
    memory.push_back(news);
}
