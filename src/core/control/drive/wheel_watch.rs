//! Whether the encoders can be believed: against the motors' own speeds, their torques, and the IMU's yaw rate.

use std::time::Duration;

use super::stage::StopReason;
use super::watch::age_s;
use crate::control::{Odometry, yaw_inertia_kg_m2};
use crate::friction::Stribeck;
use crate::link::{ImuReading, MotorState};
use crate::model::{Motor, RobotModel, SafetyLimits};

/// Time constants over which an angle and the integrated speed, and the heading by wheels and by gyro are compared, s.
const ANGLE_MEMORY_S: f64 = 1.0;
const YAW_MEMORY_S: f64 = 5.0;
/// Longest time between two readings over which a speed is integrated, s.
const LONGEST_GAP_S: f64 = 0.1;
/// Torque up to which a motor may stand still, in multiples of the model's static friction and beyond that, N m.
const HELD_FACTOR: f64 = 2.0;
const HELD_NM: f64 = 0.02;
/// Static friction of models that give none, N m.
const STATIC_NM: f64 = 0.1;
/// Readings in a row that have to disagree: a single one may be damaged.
const DISAGREEING: u32 = 3;
/// Pitch rate that counts as one way, rad/s: ten times the noise of a gyroscope; and changes of its sign that prove
/// that the motors turn.
const SWING_RAD_S: f64 = 0.01;
const SWINGS: u32 = 3;
/// Least motion of the body that tells a frozen encoder from a robot that is held, rad: several times the noise of a
/// pitch.
const BODY_RAD: f64 = 0.015;

/// Acceleration of a motor under a separate torque and of the other motor, rad/s² per N m, at standstill.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    pub(super) own: f64,
    pub(super) other: f64,
}

impl Response {
    /// Of a robot on the ground: both wheels together move and pitch the body, their difference turns it.
    pub(super) fn on_ground(robot: &RobotModel) -> Self {
        let b = robot.parameters.linear_model().b;
        let (radius, track) = (robot.parameters.wheel_radius_m, robot.chassis.track_width_m);
        let together = b[(1, 0)] / radius - b[(3, 0)];
        let apart =
            0.25 * track * track / (radius * radius) / yaw_inertia_kg_m2(&robot.parameters, &robot.chassis);
        Self { own: together + apart, other: together - apart }
    }

    /// Of wheels in the air.
    pub(super) fn in_air(robot: &RobotModel) -> Self {
        Self { own: 1.0 / robot.parameters.wheel_inertia_kg_m2, other: 0.0 }
    }
}

/// Both encoders.
///
/// - The change of an angle less the integrated speed, forgotten with a time constant of 1 s, stays within the lag of
///   the speed times its change.
/// - The change of the wheels' heading r (q_r − q_l)/track less the IMU's integrated yaw rate, forgotten with a time
///   constant of 5 s, stays within slip and bias × 5 s.
/// - An encoder whose reading, angle and speed, stands still to the last bit is that of a shaft that friction holds,
///   or frozen. A torque above twice the static friction moves a shaft that is free. By how much it must have moved
///   since the reading changed last is integrated; while the body does not move either, the robot is held.
/// - A robot whose motors both stand still tips over about its wheels' contact and does not come back. If its pitch rate
///   changes its sign again and again, its motors have turned.
#[derive(Clone, Debug)]
pub(super) struct WheelWatch {
    odometry: Odometry,
    shafts: [Shaft; 2],
    swings: Swings,
    yaw: Yaw,
}

/// Changes of the sign of the pitch rate while neither encoder changes.
#[derive(Clone, Copy, Debug, Default)]
struct Swings {
    forward: Option<bool>,
    count: u32,
}

#[derive(Clone, Copy, Debug)]
struct Shaft {
    response: f64,
    held_nm: f64,
    last: Option<MotorState>,
    mismatch_rad: f64,
    /// Readings for which that has been too large.
    disagreeing: u32,
    /// Whether the last reading was the one before.
    stands: bool,
    /// Change of speed that the torque must have caused since the reading changed last, rad/s.
    missed_rad_s: f64,
    /// Least and greatest pitch since then, rad, and how far they must be apart.
    pitch_rad: [f64; 2],
    body_rad: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Yaw {
    /// Newest reading of the IMU, and the heading of the wheels then.
    last: Option<(Duration, f64)>,
    mismatch_rad: f64,
    gyro_rad_s: f64,
}

impl WheelWatch {
    /// Watches a robot that balances, or wheels in the air, where the body shows nothing of a motor that is held.
    pub(super) fn new(robot: &RobotModel, balancing: bool) -> Self {
        let (response, body_rad) = if balancing {
            (Response::on_ground(robot).own, BODY_RAD)
        } else {
            (Response::in_air(robot).own, 0.0)
        };
        let shaft = |curve: Option<Stribeck>| {
            let static_nm = curve
                .map_or(STATIC_NM, |curve| curve.parameters().static_nm.max(curve.parameters().coulomb_nm));
            Shaft {
                response,
                held_nm: HELD_FACTOR * static_nm + HELD_NM,
                last: None,
                mismatch_rad: 0.0,
                disagreeing: 0,
                stands: false,
                missed_rad_s: 0.0,
                pitch_rad: [f64::INFINITY, f64::NEG_INFINITY],
                body_rad,
            }
        };
        Self {
            odometry: Odometry::new(robot),
            shafts: robot.friction.map(shaft),
            swings: Swings::default(),
            yaw: Yaw::default(),
        }
    }

    /// Begins anew with the next readings.
    pub(super) fn restart(&mut self) {
        (self.swings, self.yaw) = (Swings::default(), Yaw::default());
        for shaft in &mut self.shafts {
            (shaft.last, shaft.mismatch_rad, shaft.disagreeing) = (None, 0.0, 0);
            shaft.stands_anew();
        }
    }

    /// Takes the newest readings of motors that turn in the air, and the torques that acted when they were read.
    pub(super) fn hear_in_air(
        &mut self,
        motors: &[MotorState; 2],
        acted_nm: [f64; 2],
        limits: &SafetyLimits,
    ) {
        self.hear_shafts(motors, 0.0, acted_nm, limits);
    }

    fn hear_shafts(
        &mut self,
        motors: &[MotorState; 2],
        pitch_rad: f64,
        acted_nm: [f64; 2],
        limits: &SafetyLimits,
    ) {
        for ((shaft, state), torque_nm) in self.shafts.iter_mut().zip(motors).zip(acted_nm) {
            shaft.hear(state, pitch_rad, torque_nm, limits);
        }
    }

    /// Takes the newest readings, and the torques that acted when the motors were read.
    pub(super) fn hear(
        &mut self,
        motors: &[MotorState; 2],
        imu: &ImuReading,
        acted_nm: [f64; 2],
        limits: &SafetyLimits,
    ) {
        self.hear_shafts(motors, imu.pitch_rad, acted_nm, limits);
        if self.shafts.iter().any(|shaft| !shaft.stands) {
            self.swings = Swings::default();
        }
        self.swings.hear(imu.pitch_rate_rad_s);
        let heading_rad = self.odometry.yaw(motors.map(|motor| motor.angle_rad));
        self.yaw.hear(imu, heading_rad);
    }

    pub(super) fn problem(&self, limits: &SafetyLimits) -> Option<StopReason> {
        let of_motors = Motor::BOTH.into_iter().zip(&self.shafts);
        let of_both = (self.swings.count >= SWINGS).then_some(StopReason::EncodersFrozen);
        of_both.or_else(|| of_motors.clone().find_map(|(motor, shaft)| shaft.problem(motor, limits))).or_else(
            || {
                let Yaw { mismatch_rad, .. } = self.yaw;
                (mismatch_rad.abs() > limits.yaw_mismatch_rad)
                    .then_some(StopReason::YawMismatch { mismatch_rad })
            },
        )
    }

    /// Motors and a robot that turn too fast.
    pub(super) fn too_fast(&self, limits: &SafetyLimits) -> Option<StopReason> {
        let speed_rad_s = |motor: usize| self.shafts[motor].last.map_or(0.0, |state| state.speed_rad_s);
        let of_wheels = self.odometry.yaw([speed_rad_s(0), speed_rad_s(1)]);
        let yaw_rate_rad_s = if self.yaw.last.is_some() { self.yaw.gyro_rad_s } else { of_wheels };
        let wheel = Motor::BOTH.into_iter().find_map(|motor| {
            let speed_rad_s = speed_rad_s(motor as usize);
            (speed_rad_s.abs() > limits.wheel_speed_rad_s)
                .then_some(StopReason::WheelSpeed { motor, speed_rad_s })
        });
        wheel.or_else(|| {
            (yaw_rate_rad_s.abs() > limits.yaw_rate_rad_s).then_some(StopReason::YawRate { yaw_rate_rad_s })
        })
    }
}

impl Swings {
    fn hear(&mut self, pitch_rate_rad_s: f64) {
        if pitch_rate_rad_s.abs() > SWING_RAD_S {
            let forward = pitch_rate_rad_s > 0.0;
            let before = self.forward.replace(forward);
            self.count += u32::from(before.is_some_and(|before| before != forward));
        }
    }
}

impl Yaw {
    fn hear(&mut self, imu: &ImuReading, heading_rad: f64) {
        let Some(gyro_rad_s) = imu.yaw_rate_rad_s else { return };
        if let Some((last, heading_then_rad)) = self.last {
            if last >= imu.time {
                return;
            }
            let dt_s = age_s(imu.time, last);
            let turned = f64::midpoint(self.gyro_rad_s, gyro_rad_s) * dt_s;
            let change = heading_rad - heading_then_rad - turned;
            self.mismatch_rad = libm::exp(-dt_s / YAW_MEMORY_S) * (self.mismatch_rad + change);
        }
        (self.last, self.gyro_rad_s) = (Some((imu.time, heading_rad)), gyro_rad_s);
    }
}

impl Shaft {
    fn hear(&mut self, state: &MotorState, pitch_rad: f64, torque_nm: f64, limits: &SafetyLimits) {
        let Some(last) = self.last else {
            self.last = Some(*state);
            return;
        };
        if state.time <= last.time {
            return;
        }
        self.last = Some(*state);
        let dt_s = age_s(state.time, last.time);
        if dt_s > LONGEST_GAP_S {
            (self.mismatch_rad, self.disagreeing) = (0.0, 0);
            return self.stands_anew();
        }
        let change = state.angle_rad - last.angle_rad;
        let turned = f64::midpoint(last.speed_rad_s, state.speed_rad_s) * dt_s;
        self.mismatch_rad = libm::exp(-dt_s / ANGLE_MEMORY_S) * (self.mismatch_rad + change - turned);
        let disagrees = self.mismatch_rad.abs() > limits.encoder_mismatch_rad;
        self.disagreeing = if disagrees { self.disagreeing + 1 } else { 0 };
        self.stands = (state.angle_rad, state.speed_rad_s) == (last.angle_rad, last.speed_rad_s);
        if !self.stands {
            self.stands_anew();
        }
        let [least, greatest] = self.pitch_rad;
        self.pitch_rad = [least.min(pitch_rad), greatest.max(pitch_rad)];
        self.missed_rad_s += self.response * (torque_nm.abs() - self.held_nm).max(0.0) * dt_s;
    }

    fn stands_anew(&mut self) {
        self.stands = false;
        (self.missed_rad_s, self.pitch_rad) = (0.0, [f64::INFINITY, f64::NEG_INFINITY]);
    }

    fn problem(&self, motor: Motor, limits: &SafetyLimits) -> Option<StopReason> {
        let Self { mismatch_rad, missed_rad_s, pitch_rad: [least, greatest], body_rad, .. } = *self;
        if missed_rad_s > limits.motion_mismatch_rad_s && greatest - least >= body_rad {
            return Some(StopReason::EncoderFrozen { motor, missed_rad_s });
        }
        (self.disagreeing >= DISAGREEING).then_some(StopReason::EncoderMismatch { motor, mismatch_rad })
    }
}
