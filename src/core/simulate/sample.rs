//! One row of the simulated robot's recorder.

use crate::record::schema;

/// What the robot's recorder writes at one tick: measured values, and the torque that was asked of the
/// motors. The columns are those of a robot log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time since the start, s.
    pub time_s: f64,
    /// Displacement from encoders and IMU, m.
    pub x_m: f64,
    /// Speed from motor speeds and IMU, m/s.
    pub x_dot_m_s: f64,
    /// Pitch, held between IMU samples, rad.
    pub pitch_rad: f64,
    /// Pitch rate, held between IMU samples, rad/s.
    pub pitch_rate_rad_s: f64,
    /// Left encoder, rad.
    pub motor_angle_left_rad: f64,
    /// Right encoder, rad.
    pub motor_angle_right_rad: f64,
    /// Left motor's speed, rad/s.
    pub motor_speed_left_rad_s: f64,
    /// Right motor's speed, rad/s.
    pub motor_speed_right_rad_s: f64,
    /// Torque asked of the left motor, N m.
    pub torque_left_nm: f64,
    /// Torque asked of the right motor, N m.
    pub torque_right_nm: f64,
}

impl Sample {
    /// Names of the columns of a robot log, in the order of [`Sample::to_row`].
    pub const COLUMNS: [&'static str; 11] = schema::ROBOT;

    /// The values in the order of [`Sample::COLUMNS`].
    pub fn to_row(&self) -> [f64; 11] {
        [
            self.time_s,
            self.x_m,
            self.x_dot_m_s,
            self.pitch_rad,
            self.pitch_rate_rad_s,
            self.motor_angle_left_rad,
            self.motor_angle_right_rad,
            self.motor_speed_left_rad_s,
            self.motor_speed_right_rad_s,
            self.torque_left_nm,
            self.torque_right_nm,
        ]
    }
}
