//! What is fed forward cancels what it is for.

use super::{drawn, everywhere, machine, moments};
use crate::control::{BalanceController, ControlError, ControllerKind};
use crate::effects::{Declared, EffectFeedforward, Feedforward, KINDS, Law, MotionSample};
use crate::friction::Compensation;
use crate::model::{AxisModel, AxisParameters, Effect, MachineKind, Model, Motor, Rig, RobotModel};
use crate::model_file::presets;
use crate::simulate::{ControllerChoice, Experiment, Outcome, Scenario, Simulation, SimulationSettings, run};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::ops::ControlFlow;

/// All of the friction, with a direction that turns over at once.
const WHOLE: Compensation = Compensation { ratio: 1.0, smoothing_speed_rad_s: 1e-6 };

#[test]
fn what_is_causal_needs_no_memory_and_what_is_declared_can_be_declared() {
    let rng = &mut ChaCha8Rng::seed_from_u64(4);
    for (kind, on) in everywhere() {
        let (shape, sizes) = drawn(kind, on, 1, rng);
        let effect = Effect::estimated(kind, on, None, &shape, &sizes).unwrap();
        if kind.feedforward == Feedforward::Causal {
            assert!(kind.per_motor(), "{}", kind.id);
            assert!(effect.law(&machine(on)).at(&MotionSample::default()).is_some(), "{}", kind.id);
        }
        if kind.feedforward == Feedforward::Declared && on == MachineKind::Robot {
            let small: Vec<f64> = sizes.iter().map(|size| 1e-6 * size.abs()).collect();
            let effect = Effect::estimated(kind, on, None, &shape, &small).unwrap();
            let mut robot = presets::paper().robot().unwrap().clone();
            assert!(effect.declare_in(Declared::Robot(&mut robot)), "{}", kind.id);
            assert_ne!(&robot, presets::paper().robot().unwrap(), "{}", kind.id);
        }
    }
}

#[test]
fn the_torque_that_comes_out_is_the_one_that_was_wanted() {
    let rng = &mut ChaCha8Rng::seed_from_u64(5);
    let on = MachineKind::Robot;
    let causal = KINDS.iter().filter(|kind| kind.feedforward == Feedforward::Causal);
    let mut checked = 0;
    for kind in causal {
        let (shape, sizes) = drawn(kind, on, 2, rng);
        // Fractions of the torque that can be made up for.
        let small: Vec<f64> = sizes.iter().map(|size| 0.2 * size).collect();
        let effect = Effect::estimated(kind, on, Some(Motor::Right), &shape, &small).unwrap();
        let fed = EffectFeedforward::new(&machine(on), std::slice::from_ref(&effect), WHOLE).unwrap();
        let law = effect.law(&machine(on));
        for moment in moments(50, rng) {
            let wanted = moment.torque_nm;
            let asked = fed.asked_nm(Motor::Right, &moment, wanted);
            let action = law.at(&MotionSample { torque_nm: asked, ..moment }).unwrap();
            let found = asked + action.on_motor_nm(moment.direction());
            assert!(
                (found - wanted).abs() < 1e-9 * (1.0 + asked.abs()),
                "{}: {found} N m for {wanted}",
                kind.id
            );
            assert_eq!(fed.asked_nm(Motor::Left, &moment, wanted), wanted, "{}", kind.id);
            checked += 1;
        }
    }
    assert!(checked >= 400, "{checked}");
}

#[test]
fn flqr_that_knows_the_cogging_balances_more_quietly_and_lqr_feeds_nothing_forward() {
    let paper = presets::paper();
    let paper = paper.robot().unwrap();
    let cogging = [("order_1", 7.0), ("cos_1_nm", 0.05), ("sin_1_nm", 0.1)];
    let effect = Effect::new("cogging", MachineKind::Robot, None, cogging).unwrap();
    let cogged = RobotModel { effects: vec![effect], ..paper.clone() };
    let gain = crate::lqr::design(&paper.parameters.linear_model(), &paper.weights.unwrap()).unwrap().gain;
    let spread = |declared: &RobotModel, kind| {
        let controller = BalanceController::new(kind, declared, gain).unwrap();
        let mut simulation = Simulation::new(&cogged, controller, SimulationSettings::default()).unwrap();
        let ways: Vec<f64> = (0..20_000).map(|_| simulation.step().x_m).skip(5000).collect();
        let mean = ways.iter().sum::<f64>() / ways.len() as f64;
        (ways.iter().map(|way| (way - mean).powi(2)).sum::<f64>() / ways.len() as f64).sqrt()
    };
    let [knows, ignores] = [&cogged, paper].map(|declared| spread(declared, ControllerKind::Flqr));
    assert!(knows < 0.7 * ignores, "{knows} m against {ignores} m");
    let lqr = BalanceController::new(ControllerKind::Lqr, &cogged, gain).unwrap();
    assert!(lqr.effects.is_none() && !lqr.needs_rotor_angle());
    let flqr = BalanceController::new(ControllerKind::Flqr, &cogged, gain).unwrap();
    assert!(flqr.needs_rotor_angle() && flqr.without_rotor_angle().effects.is_none());
    // Effects alone are enough to feed forward.
    let bare = RobotModel { friction: [None; 2], effects: Vec::new(), ..paper.clone() };
    let refused = BalanceController::new(ControllerKind::Flqr, &bare, gain).unwrap_err();
    assert!(matches!(refused, ControlError::NoFriction));
    let alone = RobotModel { friction: [None; 2], ..cogged.clone() };
    assert!(BalanceController::new(ControllerKind::Flqr, &alone, gain).is_ok());
}

#[test]
fn a_shaft_whose_cogging_is_known_turns_more_evenly() {
    let axis = |effects| AxisModel {
        effects,
        ..AxisModel::new(AxisParameters::Rotary {
            inertia_kg_m2: 0.005,
            gravity_torque_nm: 0.0,
            friction: presets::paper().robot().unwrap().friction[0],
        })
    };
    let cogging = [("order_1", 7.0), ("cos_1_nm", 0.02), ("sin_1_nm", 0.03)];
    let cogging = Effect::new("cogging", MachineKind::Rotary, None, cogging).unwrap();
    let model = |effects| Model {
        name: "shaft".to_owned(),
        rig: Rig::Axis(axis(effects)),
        tolerance: Default::default(),
    };
    let [bare, cogged] = [model(Vec::new()), model(vec![cogging])];
    let spread = |declared: &Model, controller| {
        let experiment = Experiment { seconds: 10.0, ..Experiment::new(Scenario::SpeedTracking, controller) };
        let watch = &mut |_| ControlFlow::Continue(());
        let Outcome::Bench(run) = run(&experiment, declared, &cogged, watch).unwrap() else { unreachable!() };
        run.statistics_between(Motor::Left, [5.0, 10.0]).unwrap()[0].std
    };
    let [knows, ignores] = [&cogged, &bare].map(|declared| spread(declared, ControllerChoice::Flqr));
    assert!(knows < 0.5 * ignores, "{knows} rad/s against {ignores} rad/s");
    // Without feedforward it makes no difference what is known.
    assert_eq!(spread(&cogged, ControllerChoice::Pi), spread(&bare, ControllerChoice::Pi));
}
