//! Whether a robot gets over a disturbance, limits, friction and sensors included, and how large a one.

use std::ops::ControlFlow;

use super::simulation::{FALL_PITCH_RAD, Simulation, SimulationError, SimulationSettings, TICK_S};
use crate::control::BalanceController;
use crate::lqr::Disturbance;
use crate::model::RobotModel;

/// A robot that has not fallen after this time gets over it, s.
const LONGEST_S: f64 = 4.0;
/// So does one that has been this upright,
const UPRIGHT_RAD: f64 = 0.05;
/// this calm,
const CALM_RAD_S: f64 = 0.3;
/// for this long.
const CALM_S: f64 = 0.5;
/// Integration steps a tick: half of a run's, for a yes or no.
const SUBSTEPS: u32 = 2;
/// Between two questions whether to go on, ticks.
const WATCHED_TICKS: u64 = 50;
/// Halvings of the range that is searched.
const BISECTIONS: usize = 10;

/// Outcome of a disturbance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recovery {
    /// True if the robot is still upright at the end.
    pub upright: bool,
    /// Largest torque that was required of either motor, N m, within the controller's limit.
    pub peak_torque_nm: f64,
    /// Longest time without a break at that limit, s.
    pub at_limit_s: f64,
    /// Largest pitch on the way, rad.
    pub peak_pitch_rad: f64,
}

/// Lets the simulated robot with its controller, seed 1, get over a disturbance, for 4 s at most. `None` where
/// `watch` breaks.
///
/// # Errors
/// The robot is out of range, or the disturbance is.
pub fn recovery(
    robot: &RobotModel,
    controller: &BalanceController,
    disturbance: Disturbance,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<Recovery>, SimulationError> {
    let initial = disturbance.state(&robot.parameters);
    let settings = SimulationSettings { initial, substeps: SUBSTEPS, ..SimulationSettings::default() };
    let mut simulation = Simulation::new(robot, controller.clone(), settings)?;
    let mut found = Recovery {
        upright: true,
        peak_torque_nm: 0.0,
        at_limit_s: 0.0,
        peak_pitch_rad: initial.pitch_rad.abs(),
    };
    let limit_nm = controller.torque_limit_nm;
    let (mut at_limit_s, mut calm_s) = (0.0_f64, 0.0);
    for tick in 0..(LONGEST_S / TICK_S) as u64 {
        if tick % WATCHED_TICKS == 0 && watch().is_break() {
            return Ok(None);
        }
        let sample = simulation.step();
        let torque_nm = sample.torque_left_nm.abs().max(sample.torque_right_nm.abs());
        found.peak_torque_nm = found.peak_torque_nm.max(torque_nm);
        at_limit_s = if torque_nm >= limit_nm { at_limit_s + TICK_S } else { 0.0 };
        found.at_limit_s = found.at_limit_s.max(at_limit_s);
        let state = simulation.state();
        found.peak_pitch_rad = found.peak_pitch_rad.max(state.pitch_rad.abs());
        if simulation.has_ended() {
            return Ok(Some(Recovery { upright: false, ..found }));
        }
        let calm = state.pitch_rad.abs() < UPRIGHT_RAD && state.pitch_rate_rad_s.abs() < CALM_RAD_S;
        calm_s = if calm { calm_s + TICK_S } else { 0.0 };
        if calm_s >= CALM_S {
            break;
        }
    }
    Ok(Some(found))
}

/// Largest forward pitch that the robot with its controller gets up from, rad, to a thousandth of the pitch that
/// counts as fallen; 0 where it falls from less than that. By bisection, as if it got up from all less than a
/// pitch that it gets up from. `None` where `watch` breaks.
///
/// # Errors
/// The robot is out of range.
///
/// ```
/// # let model = flqr_core::model_file::presets::paper();
/// # let robot = model.robot().ok_or("no robot")?;
/// # let linear = robot.parameters.linear_model();
/// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
/// # use flqr_core::control::{BalanceController, ControllerKind};
/// use std::ops::ControlFlow;
///
/// use flqr_core::simulate::largest_pitch;
///
/// let controller = BalanceController::new(ControllerKind::Flqr, robot, gain)?;
/// let pitch_rad = largest_pitch(robot, &controller, &mut || ControlFlow::Continue(()))?.ok_or("cancelled")?;
/// assert!((0.1..0.8).contains(&pitch_rad));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn largest_pitch(
    robot: &RobotModel,
    controller: &BalanceController,
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<f64>, SimulationError> {
    let mut gets_up = |pitch_rad: f64| {
        let found = recovery(robot, controller, Disturbance::Pitch(pitch_rad), watch)?;
        Ok::<_, SimulationError>(found.map(|found| found.upright))
    };
    let (mut low, mut high) = (0.0, FALL_PITCH_RAD);
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        match gets_up(middle)? {
            None => return Ok(None),
            Some(true) => low = middle,
            Some(false) => high = middle,
        }
    }
    Ok(Some(low))
}
