//! Resolution, rate and errors of the robot's sensors.

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, finite, not_negative, within};

/// Time from one tick of the control loop to the next, s; the paper's 1000 Hz.
pub const TICK_S: f64 = 0.001;
/// Ticks of the control loop in a second.
const TICKS_PER_S: f64 = 1000.0;

/// Keys of the model file's `[sensors]` table. Defaults: the paper's (section 4.1) where it states them,
/// otherwise as noted. A step of 0 means a reading without steps, a noise of 0 none. Rates divide 1000 Hz,
/// the rate of the control loop; between its samples a sensor's last reading is held.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorSettings {
    /// Bits of an encoder for each turn; 0 for a reading without steps. Default: 16 (LK motors' protocol).
    pub encoder_bits: u32,
    /// Readings of encoders and motor speeds in a second. Default: 1000.
    pub motor_rate_hz: f64,
    /// Step of the motor speeds, rad/s. Default: 1 deg/s (LK motors' protocol).
    pub motor_speed_step_rad_s: f64,
    /// Standard deviation of the motor speeds before rounding, rad/s. Default: 0.5 deg/s (assumed).
    pub motor_speed_noise_rad_s: f64,
    /// Readings of the IMU in a second. Default: 100.
    pub imu_rate_hz: f64,
    /// Age of an IMU reading when it arrives, s. Default: 0.
    pub imu_latency_s: f64,
    /// Step of the pitch, rad. Default: 0.01°.
    pub pitch_step_rad: f64,
    /// Standard deviation of the pitch before rounding, rad. Default: 0.01° (assumed: one step).
    pub pitch_noise_rad: f64,
    /// Step of the pitch rate, rad/s. Default: 0.061 deg/s (JY901 data sheet: ±2000 deg/s in 16 bit).
    pub pitch_rate_step_rad_s: f64,
    /// Standard deviation of the pitch rate before rounding, rad/s. Default: 0.05 deg/s (JY901 data
    /// sheet).
    pub pitch_rate_noise_rad_s: f64,
    /// Pitch that the mounted IMU reads when the body is upright, rad. Default: 0.
    pub imu_mount_angle_rad: f64,
    /// Pitch rate that it reads at standstill, rad/s. Default: 0.
    pub gyro_bias_rad_s: f64,
    /// Standard deviation of the recorder's time stamps about the loop's ticks, s. Default: 0.
    pub time_stamp_noise_s: f64,
}

impl Default for SensorSettings {
    fn default() -> Self {
        Self {
            encoder_bits: 16,
            motor_rate_hz: 1000.0,
            motor_speed_step_rad_s: 1.0_f64.to_radians(),
            motor_speed_noise_rad_s: 0.5_f64.to_radians(),
            imu_rate_hz: 100.0,
            imu_latency_s: 0.0,
            pitch_step_rad: 0.01_f64.to_radians(),
            pitch_noise_rad: 0.01_f64.to_radians(),
            pitch_rate_step_rad_s: 0.061_f64.to_radians(),
            pitch_rate_noise_rad_s: 0.05_f64.to_radians(),
            imu_mount_angle_rad: 0.0,
            gyro_bias_rad_s: 0.0,
            time_stamp_noise_s: 0.0,
        }
    }
}

impl SensorSettings {
    /// These sensors without noise and without steps, as often, as late and as far off as they are.
    #[must_use]
    pub fn exact(self) -> Self {
        // A whole literal, so that an imperfection that is added later cannot be forgotten here.
        Self {
            encoder_bits: 0,
            motor_rate_hz: self.motor_rate_hz,
            motor_speed_step_rad_s: 0.0,
            motor_speed_noise_rad_s: 0.0,
            imu_rate_hz: self.imu_rate_hz,
            imu_latency_s: self.imu_latency_s,
            pitch_step_rad: 0.0,
            pitch_noise_rad: 0.0,
            pitch_rate_step_rad_s: 0.0,
            pitch_rate_noise_rad_s: 0.0,
            imu_mount_angle_rad: self.imu_mount_angle_rad,
            gyro_bias_rad_s: self.gyro_bias_rad_s,
            time_stamp_noise_s: 0.0,
        }
    }

    /// Step of the motor angles, rad.
    pub fn encoder_step_rad(&self) -> f64 {
        if self.encoder_bits == 0 {
            return 0.0;
        }
        std::f64::consts::TAU / f64::from(self.encoder_bits).exp2()
    }

    /// Ticks of 1 ms from one IMU reading to the next.
    pub fn imu_period_ticks(&self) -> u32 {
        period_ticks(self.imu_rate_hz)
    }

    /// Ticks of 1 ms from one reading of the motors to the next.
    pub fn motor_period_ticks(&self) -> u32 {
        period_ticks(self.motor_rate_hz)
    }

    /// Mean age of an encoder or motor speed reading that is held until the next, s.
    pub fn mean_motor_age_s(&self) -> f64 {
        0.5 * f64::from(self.motor_period_ticks() - 1) / TICKS_PER_S
    }

    /// Refuses steps and noises below zero, rates that do not divide 1000 Hz, and more than 32 bits.
    pub fn validate(&self) -> Result<(), ParameterError> {
        within("encoder_bits", f64::from(self.encoder_bits), 0.0..=32.0, "from 0 to 32")?;
        for (name, value) in [
            ("motor_speed_step_rad_s", self.motor_speed_step_rad_s),
            ("motor_speed_noise_rad_s", self.motor_speed_noise_rad_s),
            ("pitch_step_rad", self.pitch_step_rad),
            ("pitch_noise_rad", self.pitch_noise_rad),
            ("pitch_rate_step_rad_s", self.pitch_rate_step_rad_s),
            ("pitch_rate_noise_rad_s", self.pitch_rate_noise_rad_s),
        ] {
            not_negative(name, value)?;
        }
        rate("motor_rate_hz", self.motor_rate_hz)?;
        rate("imu_rate_hz", self.imu_rate_hz)?;
        within("imu_latency_s", self.imu_latency_s, 0.0..=1.0, "from 0 to 1")?;
        within("time_stamp_noise_s", self.time_stamp_noise_s, 0.0..=1e-3, "from 0 to 0.001")?;
        finite("imu_mount_angle_rad", self.imu_mount_angle_rad)?;
        finite("gyro_bias_rad_s", self.gyro_bias_rad_s)
    }
}

fn period_ticks(rate_hz: f64) -> u32 {
    (TICKS_PER_S / rate_hz).round() as u32
}

fn rate(name: &'static str, value: f64) -> Result<(), ParameterError> {
    let period = TICKS_PER_S / value;
    let divides = (1.0..=TICKS_PER_S).contains(&period) && (period - period.round()).abs() < 1e-9 * period;
    let allowed = "a rate from 1 to 1000 that divides 1000, such as 50, 100, 200, 500";
    if divides { Ok(()) } else { Err(ParameterError { name, value, allowed: allowed.into() }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rates_that_divide_the_loops_are_taken() {
        for (imu_rate_hz, ticks) in [(1000.0, 1), (200.0, 5), (100.0, 10), (8.0, 125), (1.0, 1000)] {
            let sensors = SensorSettings { imu_rate_hz, ..SensorSettings::default() };
            assert_eq!(sensors.validate(), Ok(()));
            assert_eq!(sensors.imu_period_ticks(), ticks);
        }
        for imu_rate_hz in [0.0, -100.0, 300.0, 2000.0, f64::NAN, f64::INFINITY] {
            let sensors = SensorSettings { imu_rate_hz, ..SensorSettings::default() };
            assert_eq!(sensors.validate().unwrap_err().name, "imu_rate_hz");
        }
    }

    #[test]
    fn bits_make_steps() {
        let step =
            |encoder_bits| SensorSettings { encoder_bits, ..SensorSettings::default() }.encoder_step_rad();
        assert_eq!(step(16), std::f64::consts::TAU / 65536.0);
        assert_eq!(step(0), 0.0);
    }
}
