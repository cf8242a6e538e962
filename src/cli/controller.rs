//! Balance controller of a model.

use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::lqr;
use flqr_core::model::RobotModel;

/// Designs the controller of a model; by default FLQR if friction is declared. The error says
/// what the model lacks, without its name.
pub(super) fn design(robot: &RobotModel, kind: Option<ControllerKind>) -> Result<BalanceController, String> {
    let weights = robot.weights.ok_or("it has no [lqr] table: add q_diagonal and r_diagonal")?;
    let design =
        lqr::design(&robot.parameters.linear_model(), &weights).map_err(|error| error.to_string())?;
    let known = robot.friction.iter().any(Option::is_some);
    let kind = kind.unwrap_or(if known { ControllerKind::Flqr } else { ControllerKind::Lqr });
    BalanceController::new(kind, robot, design.gain).map_err(|error| error.to_string())
}
