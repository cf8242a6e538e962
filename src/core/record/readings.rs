//! Readings of a robot's sensors.

/// Sensor readings of the robot at one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Encoders q, left and right, rad.
    pub motor_angle_rad: [f64; 2],
    /// Motor speeds q̇, left and right, rad/s.
    pub motor_speed_rad_s: [f64; 2],
    /// Pitch θ of the IMU, rad.
    pub pitch_rad: f64,
    /// Pitch rate θ̇ of the IMU, rad/s.
    pub pitch_rate_rad_s: f64,
}
