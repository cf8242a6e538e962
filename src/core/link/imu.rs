//! What the IMU says, in SI units, in the robot's axes.

use std::time::Duration;

/// One reading of the IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// When its last byte was heard.
    pub time: Duration,
    /// Pitch, forward positive, rad.
    pub pitch_rad: f64,
    /// Pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
    /// Pitch that the direction of the measured acceleration gives, rad; none of an IMU that sends no
    /// acceleration.
    pub tilt_rad: Option<f64>,
    /// Temperature, °C, if it is sent.
    pub temperature_c: Option<f64>,
}
