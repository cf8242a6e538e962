//! Samples of a robot that somebody else drives.

use std::time::Duration;

use super::estimate::Estimator;
use super::exchange::Inputs;
use super::watch::Watch;
use crate::link::{ImuReading, MotorEvent};
use crate::model::{RobotModel, SafetyLimits};
use crate::record::Sample;

/// Time after which a sensor that was received is silent and samples are left out.
const SILENT: Duration = Duration::from_millis(50);

/// Makes samples of what is received, at most one a millisecond, from when both motors have been received.
///
/// - Sensors are held between readings. While no reading of an IMU has ever come, pitch and its rate are taken as 0.
/// - Nothing is given while a sensor that was received has been silent for 0.05 s.
/// - The torque is the one that another controller last requested, if that was received within 0.05 s, otherwise that of
///   the measured current; both by the torque constant of `[link]`, and 0 without one.
/// - Way, heading and motor angles count from the first sample.
#[derive(Clone, Debug)]
pub struct Listener {
    torque_constant_nm_a: f64,
    limits: SafetyLimits,
    watch: Watch,
    estimator: Estimator,
    /// When and for what current each motor was last asked by another controller.
    asked: [Option<(Duration, f64)>; 2],
    last_sample: Option<Duration>,
}

impl Listener {
    /// Before anything is received.
    pub fn new(robot: &RobotModel) -> Self {
        Self {
            torque_constant_nm_a: robot.link.torque_constant_nm_a.unwrap_or(0.0),
            limits: robot.safety,
            watch: Watch::new(),
            estimator: Estimator::new(robot),
            asked: [None; 2],
            last_sample: None,
        }
    }

    /// Takes what was received since the last call, and gives a sample where something new is there in a
    /// millisecond that has none yet.
    pub fn hear(&mut self, now: Duration, motors: &[MotorEvent], imu: &[ImuReading]) -> Option<Sample> {
        self.watch.hear(&Inputs { motors, imu, ..Inputs::default() }, &self.limits);
        for event in motors {
            if let MotorEvent::Commanded { motor, time, current_a: Some(current_a), .. } = *event
                && current_a.is_finite()
            {
                self.asked[motor as usize] = Some((time, current_a));
            }
        }
        let pitch = self.watch.imu.last.unwrap_or(ImuReading {
            time: now,
            pitch_rad: 0.0,
            pitch_rate_rad_s: 0.0,
            tilt_rad: None,
            yaw_rate_rad_s: None,
            temperature_c: None,
        });
        self.estimator.hear(now, self.watch.states(), Some(pitch));
        let news = motors.iter().any(|event| matches!(event, MotorEvent::State(..))) || !imu.is_empty();
        // Whole milliseconds, so that a tick that comes early after a late one still counts.
        let soon = self.last_sample.is_some_and(|last| now.as_millis() <= last.as_millis());
        if !news || soon || self.is_silent(now) {
            return None;
        }
        let readings = self.estimator.readings()?;
        self.last_sample = Some(now);
        let torque = [0, 1].map(|motor| self.torque_nm(now, motor));
        Some(Sample::new(now.as_secs_f64(), &readings, &self.estimator.held(&readings).state, torque))
    }

    fn is_silent(&self, now: Duration) -> bool {
        let motors = self.watch.motors.map(|motor| motor.state.map(|state| state.time));
        let imu = self.watch.imu.last.map(|last| last.time);
        motors.into_iter().chain([imu]).flatten().any(|time| now > time + SILENT)
    }

    fn torque_nm(&self, now: Duration, motor: usize) -> f64 {
        let asked = self.asked[motor].filter(|&(time, _)| now <= time + SILENT).map(|(_, current)| current);
        let measured = || self.watch.motors[motor].state.map(|state| state.current_a);
        self.torque_constant_nm_a * asked.or_else(measured).unwrap_or(0.0)
    }
}
