//! From the torque that a controller asks for to the torque on the motor shaft.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, not_negative, positive, within};

/// Longest transport delay, s.
pub const LONGEST_DELAY_S: f64 = 1.0;

/// Motor limits, keys of the `[limits]` table of the model file; `None` means unlimited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotorLimits {
    /// Largest torque of one motor, N m.
    pub torque_nm: Option<f64>,
    /// Fastest change of that torque, N m/s.
    pub torque_slew_nm_s: Option<f64>,
    /// Speed up to which the whole torque is there, rad/s.
    pub rated_speed_rad_s: Option<f64>,
    /// Speed at which the supply's voltage is used up and no driving torque is left, rad/s. Between both
    /// speeds the torque falls linearly.
    pub no_load_speed_rad_s: Option<f64>,
}

impl MotorLimits {
    /// Refuses limits that are not finite and above zero, and a no-load speed not above the rated one.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let limits = [
            ("torque_nm", self.torque_nm),
            ("torque_slew_nm_s", self.torque_slew_nm_s),
            ("rated_speed_rad_s", self.rated_speed_rad_s),
            ("no_load_speed_rad_s", self.no_load_speed_rad_s),
        ];
        for (name, limit) in limits {
            limit.map_or(Ok(()), |limit| positive(name, limit))?;
        }
        match (self.rated_speed_rad_s, self.no_load_speed_rad_s) {
            (Some(rated), Some(no_load)) if no_load <= rated => Err(ParameterError {
                name: "no_load_speed_rad_s",
                value: no_load,
                allowed: "above rated_speed_rad_s".into(),
            }),
            _ => Ok(()),
        }
    }
}

/// The way from the controller to the shaft, keys of the model file's `[actuation]` table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Actuation {
    /// From a measurement to the torque that answers it, s; a whole number of milliseconds is simulated.
    /// Default: 0.004 (assumed: IMU parsing, two passes over CAN and the threads between, which the paper
    /// describes but does not time).
    pub delay_s: f64,
    /// Standard deviation of each motor's torque about the asked one, new every millisecond, N m. Default:
    /// 0.02 (assumed: ripple and current control, under 1 % of the paper's motors' rated 2.42 N m).
    pub torque_noise_nm: f64,
    /// Step of the torque that can be requested, N m: the resolution of the current command. Default: 0,
    /// no steps.
    pub torque_step_nm: f64,
}

impl Default for Actuation {
    fn default() -> Self {
        Self { delay_s: 0.004, torque_noise_nm: 0.02, torque_step_nm: 0.0 }
    }
}

impl Actuation {
    /// Refuses times, noises and steps that are not finite or below zero, and delays above a second.
    pub fn validate(&self) -> Result<(), ParameterError> {
        within("delay_s", self.delay_s, 0.0..=LONGEST_DELAY_S, "from 0 to 1")?;
        not_negative("torque_noise_nm", self.torque_noise_nm)?;
        not_negative("torque_step_nm", self.torque_step_nm)
    }
}
