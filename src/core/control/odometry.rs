//! From what the sensors read to what the controller knows.

use crate::model_file::RobotModel;
use crate::robot::State;

/// What the robot's sensors give at one tick.
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

/// What a controller knows at one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurement {
    /// X as the robot estimates it from encoders and IMU.
    pub state: State,
    /// Motor angles q, left and right, rad.
    pub motor_angle_rad: [f64; 2],
    /// Motor speeds q̇, left and right, rad/s.
    pub motor_speed_rad_s: [f64; 2],
    /// Heading ψ since the start, left positive, rad.
    pub yaw_rad: f64,
    /// ψ̇, rad/s.
    pub yaw_rate_rad_s: f64,
}

/// Wheels as measures of the way and of the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Odometry {
    /// r: wheel radius, m.
    pub wheel_radius_m: f64,
    /// Distance between the wheels, m.
    pub track_width_m: f64,
}

impl Odometry {
    /// The measures of a robot.
    pub fn new(robot: &RobotModel) -> Self {
        Self { wheel_radius_m: robot.parameters.wheel_radius_m, track_width_m: robot.chassis.track_width_m }
    }

    /// Heading of the motor angles, or yaw rate of the motor speeds.
    pub fn yaw(&self, [left, right]: [f64; 2]) -> f64 {
        self.wheel_radius_m * (right - left) / self.track_width_m
    }

    /// x = r (q + θ) of the wheels' mean q, ψ = r (q_r − q_l)/track of their difference, and the same of
    /// the speeds.
    pub fn measurement(&self, readings: &Readings) -> Measurement {
        let &Readings { motor_angle_rad, motor_speed_rad_s, pitch_rad, pitch_rate_rad_s } = readings;
        let radius = self.wheel_radius_m;
        let mean = |[left, right]: [f64; 2]| f64::midpoint(left, right);
        let state = State {
            x_m: radius * (mean(motor_angle_rad) + pitch_rad),
            x_dot_m_s: radius * (mean(motor_speed_rad_s) + pitch_rate_rad_s),
            pitch_rad,
            pitch_rate_rad_s,
        };
        Measurement {
            state,
            motor_angle_rad,
            motor_speed_rad_s,
            yaw_rad: self.yaw(motor_angle_rad),
            yaw_rate_rad_s: self.yaw(motor_speed_rad_s),
        }
    }
}
