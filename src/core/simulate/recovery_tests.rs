//! What a robot gets over, against longer runs and against what no controller can do.

use std::ops::ControlFlow;

use super::*;
use crate::control::{BalanceController, ControllerKind};
use crate::lqr::{self, Disturbance};
use crate::model::{LinearModel, RobotModel, State, Weights};
use crate::model_file::presets;

fn robot(torque_nm: f64) -> RobotModel {
    let mut robot = presets::paper().robot().unwrap().clone();
    robot.limits.torque_nm = Some(torque_nm);
    robot
}

fn controller(robot: &RobotModel) -> BalanceController {
    let weights = Weights::diagonal([1.0, 1.0, 20.0, 1.0], [1.0; 2]);
    let gain = lqr::design(&robot.parameters.linear_model(), &weights).unwrap().gain;
    BalanceController::new(ControllerKind::Flqr, robot, gain).unwrap()
}

fn go_on() -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Pitch of rest from which torques of ±`torque_nm` at both motors can still bring the linear robot back: its
/// unstable mode w with wᵀA = λ wᵀ obeys d/dt wᵀX = λ wᵀX + wᵀB u.
fn linear_bound_rad(LinearModel { a, b }: &LinearModel, torque_nm: f64) -> f64 {
    // θ̈ = a₃₂ θ + b₃ u, so w = [0, 0, λ, 1] with λ² = a₃₂.
    let rate = a[(3, 2)].sqrt();
    (b[(3, 0)] + b[(3, 1)]).abs() * torque_nm / (rate * rate)
}

#[test]
fn the_largest_pitch_is_where_longer_and_finer_runs_begin_to_fall() {
    for torque_nm in [1.2, 2.42] {
        let robot = robot(torque_nm);
        let controller = controller(&robot);
        let largest = largest_pitch(&robot, &controller, &mut go_on).unwrap().unwrap();
        let falls = |pitch_rad: f64| {
            let initial = State { pitch_rad, ..State::default() };
            let settings = SimulationSettings { initial, ..SimulationSettings::default() };
            let mut simulation = Simulation::new(&robot, controller.clone(), settings).unwrap();
            (0..10_000).any(|_| {
                simulation.step();
                simulation.fall().is_some()
            })
        };
        assert!(!falls(0.97 * largest) && falls(1.03 * largest), "{largest}");
    }
}

#[test]
fn no_pitch_is_recovered_that_the_torque_cannot_hold() {
    let mut before = 0.0;
    for torque_nm in [0.6, 1.2, 2.4] {
        let robot = robot(torque_nm);
        let bound = linear_bound_rad(&robot.parameters.linear_model(), torque_nm);
        let largest = largest_pitch(&robot, &controller(&robot), &mut go_on).unwrap().unwrap();
        // Gravity grows with the sine, so the bound is a little low.
        assert!((0.5 * bound..1.03 * bound).contains(&largest), "{largest} of {bound} with {torque_nm}");
        assert!(largest > 1.5 * before, "{largest} after {before}");
        before = largest;
    }
}

#[test]
fn a_recovery_tells_peak_torque_and_time_at_the_limit() {
    let robot = robot(1.2);
    let controller = controller(&robot);
    let small = recovery(&robot, &controller, Disturbance::Pitch(0.01), &mut go_on).unwrap().unwrap();
    assert!(small.upright && small.peak_torque_nm < 1.2 && small.at_limit_s == 0.0, "{small:?}");
    let large = recovery(&robot, &controller, Disturbance::Pitch(0.5), &mut go_on).unwrap().unwrap();
    assert!(!large.upright && large.peak_torque_nm == 1.2 && large.at_limit_s > 0.05, "{large:?}");
    assert!(large.peak_pitch_rad > 0.8);
}

#[test]
fn a_search_ends_when_it_is_no_longer_wanted_and_refuses_nonsense() {
    let robot = robot(2.42);
    let controller = controller(&robot);
    assert_eq!(largest_pitch(&robot, &controller, &mut || ControlFlow::Break(())), Ok(None));
    assert!(recovery(&robot, &controller, Disturbance::Pitch(2.0), &mut go_on).is_err());
    assert!(recovery(&robot, &controller, Disturbance::Step(f64::NAN), &mut go_on).is_err());
}
