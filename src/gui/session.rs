//! The session document: all that a model file keeps and that undo would restore.

use std::sync::LazyLock;

use flqr_core::control::{BalanceController, ControlError, ControllerKind, DEFAULT_COMPENSATION};
use flqr_core::friction::{Compensation, Stribeck};
use flqr_core::model::{AxisParameters, Model, Rig, RobotModel, Tolerances, Weights};
use flqr_core::model_file::presets;
use nalgebra::Matrix2x4;

/// Weights of a robot whose file has none: those of the paper's preset, without the entry off Q's diagonal, which
/// suits that robot alone.
static FILLED_IN: LazyLock<Weights> = LazyLock::new(|| {
    let weights = presets::paper().robot().and_then(|robot| robot.weights);
    let weights = weights.expect("a test of the core finds them in every preset");
    Weights::diagonal(weights.q.diagonal().into(), weights.r.diagonal().into())
});

/// Edited document.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Session {
    /// Name of the model.
    pub(crate) name: String,
    /// Robot or axis, as in the file and as edited; what is filled in for use is not here, so it is not saved.
    pub(crate) rig: Rig,
    /// Tolerances of the model's parameters.
    pub(crate) tolerance: Tolerances,
    /// True if friction is fed forward.
    pub(crate) controller: ControllerKind,
}

impl Session {
    /// Opens a model.
    pub(crate) fn new(model: Model, controller: ControllerKind) -> Self {
        Self { name: model.name, rig: model.rig, tolerance: model.tolerance, controller }
    }

    /// Describes the defaults used for missing parts of the model.
    pub(crate) fn filled_in(&self) -> Option<String> {
        let robot = self.robot()?;
        let weights = "the weights of the paper's preset";
        let Compensation { ratio, smoothing_speed_rad_s } = DEFAULT_COMPENSATION;
        let usual = format!("{ratio} of the friction, over {smoothing_speed_rad_s} rad/s,");
        let (tables, used) = match (robot.weights, robot.compensation) {
            (Some(_), Some(_)) => return None,
            (None, Some(_)) => ("[lqr]", format!("{weights} fill in")),
            (Some(_), None) => ("[compensation]", format!("{usual} fills in")),
            (None, None) => ("[lqr] and no [compensation]", format!("{weights} and {usual} fill in")),
        };
        Some(format!("It has no {tables}: {used}. They are saved only if edited."))
    }

    /// The model as it would be saved.
    pub(crate) fn model(&self) -> Model {
        Model { name: self.name.clone(), rig: self.rig.clone(), tolerance: self.tolerance.clone() }
    }

    /// The model as it is used, with what is filled in.
    pub(crate) fn model_in_use(&self) -> Model {
        let mut model = self.model();
        if let Rig::Robot(robot) = &mut model.rig {
            robot.weights = Some(self.weights());
            robot.compensation = Some(self.compensation());
        }
        model
    }

    /// Name of the controller, for people.
    pub(crate) fn controller_name(&self) -> &'static str {
        match self.controller {
            ControllerKind::Lqr => "LQR",
            ControllerKind::Flqr => "FLQR",
        }
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
        self.robot().and_then(|robot| robot.weights).unwrap_or(*FILLED_IN)
    }

    /// Friction feedforward of the robot.
    pub(crate) fn compensation(&self) -> Compensation {
        self.robot().and_then(|robot| robot.compensation).unwrap_or(DEFAULT_COMPENSATION)
    }

    /// Friction curve of one motor (0 left, 1 right), or of the axis.
    pub(crate) fn friction(&self, motor: usize) -> Option<Stribeck> {
        match &self.rig {
            Rig::Robot(robot) => robot.friction[motor],
            Rig::Axis(axis) => match axis.parameters {
                AxisParameters::Rotary { friction, .. } | AxisParameters::Linear { friction, .. } => friction,
            },
        }
    }

    /// The controller that these settings and a gain make; none without a robot. FLQR without any friction
    /// is LQR, as [`Session::feedforward_problem`] says.
    pub(crate) fn balance_controller(&self, gain: Matrix2x4<f64>) -> Option<BalanceController> {
        let robot = RobotModel { compensation: Some(self.compensation()), ..self.robot()?.clone() };
        BalanceController::new(self.controller, &robot, gain)
            .or_else(|_| BalanceController::new(ControllerKind::Lqr, &robot, gain))
            .ok()
    }

    /// Reason why FLQR equals LQR, if it does.
    pub(crate) fn feedforward_problem(&self) -> Option<&'static str> {
        let robot = self.robot()?;
        let has_friction = robot.friction.iter().any(Option::is_some);
        // An effect inside the motors is fed forward too.
        let is_lqr = || {
            let flqr = BalanceController::new(ControllerKind::Flqr, robot, Matrix2x4::zeros());
            matches!(flqr, Err(ControlError::NoFriction))
        };
        (!has_friction && is_lqr()).then_some(
            "The model has no friction, so FLQR equals LQR. Fit a log on the Friction tab, or enable a motor under “Friction of the motors”.",
        )
    }
}

#[cfg(test)]
mod tests {
    use flqr_core::model::{Effect, MachineKind};

    use super::*;

    #[test]
    fn flqr_is_lqr_only_where_nothing_is_fed_forward() {
        let (mut model, cogging) =
            (presets::paper(), [("order_1", 14.0), ("cos_1_nm", 0.01), ("sin_1_nm", 0.0)]);
        let cogging = Effect::new("cogging", MachineKind::Robot, None, cogging).unwrap();
        for (friction, effects, is_lqr) in
            [(true, false, false), (false, false, true), (false, true, false), (true, true, false)]
        {
            if let Rig::Robot(robot) = &mut model.rig {
                let curves = presets::paper().robot().unwrap().friction;
                robot.friction = if friction { curves } else { [None; 2] };
                robot.effects = if effects { vec![cogging.clone()] } else { Vec::new() };
            }
            let session = Session::new(model.clone(), ControllerKind::Flqr);
            assert_eq!(session.feedforward_problem().is_some(), is_lqr, "{friction} {effects}");
            let controller = session.balance_controller(Matrix2x4::zeros()).unwrap();
            let feeds = controller.feedforward.iter().any(Option::is_some) || controller.effects.is_some();
            assert_eq!(feeds, !is_lqr, "{friction} {effects}");
        }
    }
}
