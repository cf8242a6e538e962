//! From what the sensors read to what the controller knows.

use crate::model::{RobotModel, State};
use crate::record::Readings;

/// Measurement of a controller at one sample.
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
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// use flqr_core::control::Odometry;
    /// use flqr_core::record::Readings;
    ///
    /// // One turn of both wheels forward, with the body upright.
    /// let readings = Readings { motor_angle_rad: [std::f64::consts::TAU; 2], ..Readings::default() };
    /// let measurement = Odometry::new(robot).measurement(&readings);
    /// let circumference_m = std::f64::consts::TAU * robot.parameters.wheel_radius_m;
    /// assert!((measurement.state.x_m - circumference_m).abs() < 1e-12 && measurement.yaw_rad == 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
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
