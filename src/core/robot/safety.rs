//! When a driven robot is stopped.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, positive};

/// Keys of the model file's `[safety]` table: a robot that goes beyond one of these is stopped, with no torque
/// and its motors off. Torque and its slew are bound by `[limits]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SafetyLimits {
    /// Largest pitch, rad. Default: 0.5.
    pub tilt_rad: f64,
    /// Fastest drive on the ground, m/s. Default: 1.5.
    pub speed_m_s: f64,
    /// Largest way from where the robot was armed, m. Default: 2.
    pub distance_m: f64,
    /// Fastest turn of a motor with its wheel in the air, rad/s. Default: 60.
    pub motor_speed_rad_s: f64,
    /// Longest time without a reading of the IMU, s. Default: 0.05.
    pub imu_timeout_s: f64,
    /// Longest time for which the IMU may give the very same bytes, s. Default: 0.2.
    pub imu_frozen_s: f64,
    /// Longest time without a reply of a motor, s. Default: 0.02.
    pub motor_timeout_s: f64,
    /// Hottest motor, °C. Default: 80.
    pub temperature_c: f64,
    /// Lowest voltage of the supply, V. Default: 20.
    pub least_voltage_v: f64,
    /// Highest voltage of the supply, V. Default: 30.
    pub greatest_voltage_v: f64,
    /// Longest delay of a tick of the control loop, s. Default: 0.02.
    pub late_s: f64,
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self {
            tilt_rad: 0.5,
            speed_m_s: 1.5,
            distance_m: 2.0,
            motor_speed_rad_s: 60.0,
            imu_timeout_s: 0.05,
            imu_frozen_s: 0.2,
            motor_timeout_s: 0.02,
            temperature_c: 80.0,
            least_voltage_v: 20.0,
            greatest_voltage_v: 30.0,
            late_s: 0.02,
        }
    }
}

impl SafetyLimits {
    /// Refuses limits that are not finite and above zero, and voltages that exclude each other.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (name, value) in [
            ("tilt_rad", self.tilt_rad),
            ("speed_m_s", self.speed_m_s),
            ("distance_m", self.distance_m),
            ("motor_speed_rad_s", self.motor_speed_rad_s),
            ("imu_timeout_s", self.imu_timeout_s),
            ("imu_frozen_s", self.imu_frozen_s),
            ("motor_timeout_s", self.motor_timeout_s),
            ("temperature_c", self.temperature_c),
            ("least_voltage_v", self.least_voltage_v),
            ("greatest_voltage_v", self.greatest_voltage_v),
            ("late_s", self.late_s),
        ] {
            positive(name, value)?;
        }
        if self.greatest_voltage_v <= self.least_voltage_v {
            let value = self.greatest_voltage_v;
            let allowed = "above least_voltage_v";
            return Err(ParameterError { name: "greatest_voltage_v", value, allowed });
        }
        Ok(())
    }
}
