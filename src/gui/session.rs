//! The session document: all that a model file keeps and that undo would restore.

use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::friction::{Compensation, Feedforward, Stribeck};
use flqr_core::lqr::Weights;
use flqr_core::model_file::{AxisModel, Model, Rig, RobotModel};
use nalgebra::Matrix2x4;

/// Weights of a robot whose file has none: those of the paper's preset.
pub(crate) fn default_weights() -> Weights {
    Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0, 20.0])
}

/// Compensation of a robot whose file has none.
pub(crate) const DEFAULT_COMPENSATION: Compensation =
    Compensation { ratio: 0.95, smoothing_speed_rad_s: 0.02 };

/// What the user edits.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Session {
    /// Name of the model.
    pub(crate) name: String,
    /// Robot or axis. A robot's weights and compensation are always present here.
    pub(crate) rig: Rig,
    /// Whether friction is fed forward.
    pub(crate) controller: ControllerKind,
}

impl Session {
    /// Opens a model; what its file leaves out is filled in.
    pub(crate) fn new(model: Model, controller: ControllerKind) -> Self {
        let rig = match model.rig {
            Rig::Robot(mut robot) => {
                robot.weights.get_or_insert_with(default_weights);
                robot.compensation.get_or_insert(DEFAULT_COMPENSATION);
                Rig::Robot(robot)
            }
            axis @ Rig::Axis(_) => axis,
        };
        Self { name: model.name, rig, controller }
    }

    /// The model as it would be saved.
    pub(crate) fn model(&self) -> Model {
        Model { name: self.name.clone(), rig: self.rig.clone() }
    }

    /// The robot, where the model is one.
    pub(crate) fn robot(&self) -> Option<&RobotModel> {
        match &self.rig {
            Rig::Robot(robot) => Some(robot),
            Rig::Axis(_) => None,
        }
    }

    /// The robot to change, where the model is one.
    pub(crate) fn robot_mut(&mut self) -> Option<&mut RobotModel> {
        match &mut self.rig {
            Rig::Robot(robot) => Some(robot),
            Rig::Axis(_) => None,
        }
    }

    /// Weights of the robot.
    pub(crate) fn weights(&self) -> Weights {
        self.robot().and_then(|robot| robot.weights).unwrap_or_else(default_weights)
    }

    /// Friction feedforward of the robot.
    pub(crate) fn compensation(&self) -> Compensation {
        self.robot().and_then(|robot| robot.compensation).unwrap_or(DEFAULT_COMPENSATION)
    }

    /// Friction curve of one motor (0 left, 1 right), or of the axis.
    pub(crate) fn friction(&self, motor: usize) -> Option<Stribeck> {
        match &self.rig {
            Rig::Robot(robot) => robot.friction[motor],
            Rig::Axis(AxisModel::Rotary { friction, .. } | AxisModel::Linear { friction, .. }) => *friction,
        }
    }

    /// The controller that these settings and a gain make; none without a robot.
    pub(crate) fn balance_controller(&self, gain: Matrix2x4<f64>) -> Option<BalanceController> {
        let robot = self.robot()?;
        Some(BalanceController {
            gain,
            feedforward: match self.controller {
                ControllerKind::Lqr => None,
                ControllerKind::Flqr => self.feedforward(robot),
            },
            torque_limit_nm: robot.torque_limit_nm.unwrap_or(f64::INFINITY),
        })
    }

    /// Why FLQR would do nothing more than LQR, if it would.
    pub(crate) fn feedforward_problem(&self) -> Option<&'static str> {
        let robot = self.robot()?;
        robot.friction.iter().all(Option::is_none).then_some(
            "The model has no friction: FLQR equals LQR. Fit a log on the friction tab, or enter the curve under “Friction of the motors”.",
        )
    }

    fn feedforward(&self, robot: &RobotModel) -> Option<[Feedforward; 2]> {
        let of_motor = |curve: Option<Stribeck>| {
            Feedforward::new(curve.unwrap_or_else(frictionless), self.compensation()).ok()
        };
        Some([of_motor(robot.friction[0])?, of_motor(robot.friction[1])?])
    }
}

/// A curve that is zero everywhere, for a motor without friction beside one that has some.
fn frictionless() -> Stribeck {
    Stribeck::new(flqr_core::friction::StribeckParameters {
        coulomb_nm: 0.0,
        static_nm: 0.0,
        viscous_nm_s_rad: 0.0,
        stribeck_speed_rad_s: 1.0,
        stribeck_exponent: 1.0,
        offset_nm: 0.0,
    })
    .expect("zero levels with a positive speed and exponent are allowed")
}
