//! The session document: all that a model file keeps and that undo would restore.

use flqr_core::control::{BalanceController, ControllerKind, DEFAULT_COMPENSATION};
use flqr_core::friction::{Compensation, Stribeck};
use flqr_core::lqr::Weights;
use flqr_core::model_file::{AxisModel, Model, Rig, RobotModel};
use nalgebra::Matrix2x4;

/// Weights of a robot whose file has none: those of the paper's preset.
pub(crate) fn default_weights() -> Weights {
    Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0, 20.0])
}

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

    /// The controller that these settings and a gain make; none without a robot. FLQR without any friction
    /// is LQR, as [`Session::feedforward_problem`] says.
    pub(crate) fn balance_controller(&self, gain: Matrix2x4<f64>) -> Option<BalanceController> {
        let robot = self.robot()?;
        BalanceController::new(self.controller, robot, gain)
            .or_else(|_| BalanceController::new(ControllerKind::Lqr, robot, gain))
            .ok()
    }

    /// Why FLQR would do nothing more than LQR, if it would.
    pub(crate) fn feedforward_problem(&self) -> Option<&'static str> {
        let robot = self.robot()?;
        robot.friction.iter().all(Option::is_none).then_some(
            "The model has no friction, so FLQR equals LQR: fit a log on the friction tab, or tick a motor under “Friction of the motors”.",
        )
    }
}
