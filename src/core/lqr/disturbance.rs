//! Disturbances of a robot, as the state that they cause.

use crate::model::{RobotParameters, State};

/// Something sudden that happens to a robot that stands upright at standstill at its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Disturbance {
    /// A horizontal blow to the body's centre of mass, forward positive, N s.
    Kick(f64),
    /// The body is let go at this pitch, rad.
    Pitch(f64),
    /// The place to stand at jumps this far ahead, m.
    Step(f64),
}

impl Disturbance {
    /// The state right after it, x counted from where the robot is to stand. A kick sets wheels and body in
    /// motion at once, without slip and without time for the motors to answer.
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// use flqr_core::lqr::Disturbance;
    ///
    /// let kick = Disturbance::Kick(3.0).state(&robot.parameters);
    /// assert!(kick.x_dot_m_s > 0.0 && kick.x_m == 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn state(&self, robot: &RobotParameters) -> State {
        match *self {
            Self::Kick(impulse_n_s) => {
                let (radius, height) = (robot.wheel_radius_m, robot.com_height_m);
                let change = robot.coefficients().accelerations(
                    (0.0, 1.0),
                    0.0,
                    radius * impulse_n_s,
                    height * impulse_n_s,
                );
                State {
                    x_dot_m_s: change.x_ddot_m_s2,
                    pitch_rate_rad_s: change.pitch_accel_rad_s2,
                    ..State::default()
                }
            }
            Self::Pitch(pitch_rad) => State { pitch_rad, ..State::default() },
            Self::Step(ahead_m) => State { x_m: -ahead_m, ..State::default() },
        }
    }

    /// Returns the disturbance with another size.
    pub fn of_size(&self, size: f64) -> Self {
        match self {
            Self::Kick(_) => Self::Kick(size),
            Self::Pitch(_) => Self::Pitch(size),
            Self::Step(_) => Self::Step(size),
        }
    }

    /// Its size, in N s, rad or m.
    pub fn size(&self) -> f64 {
        let (Self::Kick(size) | Self::Pitch(size) | Self::Step(size)) = *self;
        size
    }
}
