//! Experiments on the ground, and experiments that are refused.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use nalgebra::Matrix2x4;

use super::*;
use crate::model::{Actuation, Model, Motor, Payload, Rig, RobotModel, Surroundings, Tether};
use crate::model_file::presets;

fn ground(experiment: &Experiment, actual: &Model) -> Run {
    match run(experiment, &presets::paper(), actual, &mut |_| ControlFlow::Continue(())).unwrap() {
        Outcome::Ground(run) => run,
        Outcome::Bench(_) => panic!("{experiment:?} ran in the air"),
    }
}

/// The paper's robot with something that its controller does not know of.
fn changed(change: impl FnOnce(&mut RobotModel)) -> Model {
    let mut model = presets::paper();
    if let Rig::Robot(robot) = &mut model.rig {
        change(robot);
    }
    model
}

fn surrounded(surroundings: Surroundings) -> Model {
    changed(|robot| robot.surroundings = surroundings)
}

#[test]
fn every_scenario_runs_under_its_controllers_with_the_same_bytes_for_the_same_seed() {
    let paper = presets::paper();
    for scenario in Scenario::ALL {
        assert_eq!(scenario.name().parse(), Ok(scenario));
        for controller in ControllerChoice::ALL {
            let seconds = if scenario == Scenario::FrictionSweep { 30.0 } else { 1.0 };
            let bytes = |seed| -> Option<Vec<u64>> {
                let experiment = Experiment { seed, seconds, ..Experiment::new(scenario, controller) };
                let outcome = run(&experiment, &paper, &paper, &mut |_| ControlFlow::Continue(())).ok()?;
                assert_eq!(outcome.warnings(), &[] as &[String]);
                assert_eq!(matches!(outcome, Outcome::Ground(_)), experiment.on_ground());
                let log = outcome.log(Motor::Right);
                assert_eq!(log.rows(), (1000.0 * seconds) as usize);
                Some(log.columns.iter().flat_map(|column| &column.values).map(|v| v.to_bits()).collect())
            };
            let first = bytes(7);
            let refused = controller == ControllerChoice::Pi
                && !matches!(
                    scenario,
                    Scenario::SpeedTracking | Scenario::FrictionSweep | Scenario::Multisine
                );
            assert_eq!(first.is_none(), refused, "{scenario} {controller:?}");
            assert_eq!(first, bytes(7));
            assert!(first.is_none() || first != bytes(8), "{scenario} {controller:?}");
        }
    }
}

#[test]
fn on_the_bridge_the_robot_stands_rolled_at_its_target() {
    let run = ground(&Experiment::new(Scenario::Bridge, ControllerChoice::Flqr), &presets::paper());
    assert!(run.fall.is_none() && run.statistics.settled, "{:?}", run.statistics);
    assert_eq!(run.target_x_m, 1.0);
    assert!((run.statistics.x_m.mean - 1.0).abs() < 0.03, "{:?}", run.statistics.x_m);
    let track = presets::paper().robot().unwrap().chassis.track_width_m;
    for TimedPose { time_s, pose } in &run.poses {
        let [left, right] = pose.ground_height_m;
        assert!(right == 0.0 && (0.0..=0.040_001).contains(&left), "{left} m, {right} m at {time_s} s");
        if *time_s > 12.0 {
            assert!((left - 0.04).abs() < 1e-9 && (pose.roll_rad - (-0.04_f64 / track).asin()).abs() < 2e-3);
        }
    }
    let rolled = run.poses.iter().map(|pose| pose.pose.roll_rad.abs()).fold(0.0, f64::max);
    assert!(rolled > 0.09 && run.poses[0].pose.roll_rad == 0.0, "{rolled} rad");
    assert_eq!(run.poses.len(), 6000);
}

#[test]
fn cruise_goes_out_and_comes_back() {
    let run = ground(&Experiment::new(Scenario::Cruise, ControllerChoice::Flqr), &presets::paper());
    let furthest = run.samples.iter().map(|sample| sample.x_m).fold(0.0, f64::max);
    let fastest = run.samples.iter().map(|sample| sample.x_dot_m_s).fold(0.0, f64::max);
    assert!((1.1..1.9).contains(&furthest) && (0.3..0.7).contains(&fastest), "{furthest} m, {fastest} m/s");
    assert!(run.samples.last().unwrap().x_m.abs() < 0.25, "{:?}", run.samples.last());
}

/// On a robot that answers linearly (no friction, small motions) every line of the answer is one of the
/// excitation.
#[test]
fn multisine_moves_a_smooth_robot_at_its_lines_alone() {
    let smooth = changed(|robot| {
        robot.friction = [None; 2];
        robot.actuation = Actuation { torque_noise_nm: 0.0, torque_step_nm: 0.0, ..robot.actuation };
        robot.sensors = robot.sensors.exact();
    });
    let experiment =
        Experiment { seconds: 40.0, ..Experiment::new(Scenario::Multisine, ControllerChoice::Lqr) };
    let run = ground(&experiment, &smooth);
    let period: Vec<f64> = run.poses[3000..].iter().map(|pose| pose.pose.state.pitch_rad).collect();
    assert_eq!(period.len(), 1000);
    let line = |harmonic: u32| {
        let at = |shift: f64| {
            let wave = |(index, value): (usize, &f64)| {
                value * (TAU * (f64::from(harmonic) * index as f64 / 1000.0 + shift)).sin()
            };
            period.iter().enumerate().map(wave).sum::<f64>() / 500.0
        };
        at(0.0).hypot(at(0.25))
    };
    let excited: Vec<u32> = (3..=47).step_by(2).collect();
    let weakest = excited.iter().map(|&harmonic| line(harmonic)).fold(f64::INFINITY, f64::min);
    let silent = (2..=60).filter(|harmonic| !excited.contains(harmonic)).map(line).fold(0.0, f64::max);
    assert!(silent < 0.1 * weakest, "{silent} rad beside lines of {weakest} rad and more");
    let turned = run.poses.iter().map(|pose| pose.pose.yaw_rad.abs()).fold(0.0, f64::max);
    assert!(turned > 1e-3, "both motors do the same: {turned} rad");
}

/// Balance of forces and of moments about the axle at standstill, whatever the controller.
#[test]
fn undeclared_surroundings_lean_the_robot_as_statics_say() {
    let robot = presets::paper().robot().unwrap().clone();
    let p = robot.parameters;
    let (radius, gravity) = (p.wheel_radius_m, p.gravity_m_s2);
    let weight_nm = p.body_mass_kg * gravity * p.com_height_m;
    let whole_mass = p.body_mass_kg + 2.0 * p.wheel_mass_kg;
    let slope_rad = 0.04_f64;
    let tether = Tether { stiffness_n_m: 10.0, anchor_m: -0.5, slack_m: 0.0, height_m: 0.1 };
    let payload = Payload { mass_kg: 0.8, height_m: 0.2, forward_m: 0.05 };
    let nothing = Surroundings::default();
    let uphill_nm = whole_mass * gravity * slope_rad.sin() * radius;
    let forward_nm = 0.8 * 0.05 / (p.body_mass_kg * p.com_height_m + 0.8 * 0.2) * weight_nm;
    // Torques about the axle as functions of where the robot stands: uphill torque reacts on the body, a
    // tether pulls at its height against the torque that holds the wheels, a payload in front weighs.
    let cases: [(Surroundings, &dyn Fn(f64) -> f64); 4] = [
        (nothing.clone(), &|_| 0.0),
        (Surroundings { slope_rad, ..nothing.clone() }, &|_| uphill_nm),
        (Surroundings { tether: Some(tether), ..nothing.clone() }, &|x_m| {
            10.0 * (x_m + 0.5) * (radius + 0.1)
        }),
        (Surroundings { payload: Some(payload), ..nothing }, &|_| -forward_nm),
    ];
    for (surroundings, moment_nm) in cases {
        let run = ground(
            &Experiment::new(Scenario::Station, ControllerChoice::Flqr),
            &surrounded(surroundings.clone()),
        );
        let found = run.statistics.pitch_rad.mean;
        let pitch_rad = moment_nm(run.statistics.x_m.mean) / weight_nm;
        assert!(run.fall.is_none(), "{surroundings:?}: {:?}", run.fall);
        assert!(
            (found - pitch_rad).abs() < 0.05 * pitch_rad.abs() + 5e-4,
            "{found} rad for {pitch_rad}: {surroundings:?}"
        );
    }
}

#[test]
fn unequal_friction_turns_the_robot_and_the_yaw_hold_keeps_it_in_bounds() {
    let run = ground(&Experiment::new(Scenario::Flat, ControllerChoice::Lqr), &presets::paper());
    let turned = run.poses.iter().map(|pose| pose.pose.yaw_rad.abs()).fold(0.0, f64::max);
    assert!(turned > 1e-5 && turned < 0.1, "{turned} rad");
}

#[test]
fn a_motion_that_is_not_finite_ends_with_its_step_and_keeps_its_log() {
    let tether = Tether { stiffness_n_m: 1e308, anchor_m: -100.0, slack_m: 0.0, height_m: 0.0 };
    let broken = surrounded(Surroundings { tether: Some(tether), ..Surroundings::default() });
    let experiment = Experiment::new(Scenario::Flat, ControllerChoice::Lqr);
    let ended = run(&experiment, &presets::paper(), &broken, &mut |_| ControlFlow::Continue(()));
    let Err(ExperimentError::NotFinite { problem, kept }) = ended else { panic!("the run went on") };
    assert_eq!(kept.log(Motor::Left).rows() as u64, problem.step);
    let text = ExperimentError::NotFinite { problem, kept }.to_string();
    assert!(text.contains(&format!("step {} ({} s)", problem.step, problem.time_s)), "{text}");
}

#[test]
fn a_gain_that_only_the_declared_robot_bears_is_told() {
    let experiment = Experiment::new(Scenario::Flat, ControllerChoice::Lqr);
    let slow = changed(|robot| robot.actuation.delay_s = 0.2);
    let told = experiment.check(&presets::paper(), &slow).unwrap();
    assert!(told.len() == 1 && told[0].contains("unstable on the simulated robot"), "{told:?}");
    let told = experiment.check(&slow, &slow).unwrap();
    assert!(told.len() == 1 && told[0].contains("unstable on the model, including its delay"), "{told:?}");
}

#[test]
fn a_height_of_the_legs_changes_robot_and_gain() {
    let legs = presets::paper();
    let stand = |leg_height_m| {
        let experiment =
            Experiment { leg_height_m, ..Experiment::new(Scenario::Flat, ControllerChoice::Flqr) };
        run(&Experiment { seconds: 20.0, ..experiment }, &legs, &legs, &mut |_| ControlFlow::Continue(()))
    };
    let [low, high] = [Some(0.32), Some(0.42)].map(|height| stand(height).unwrap().log(Motor::Left));
    assert_ne!(low.column("torque_left_nm").unwrap()[0], high.column("torque_left_nm").unwrap()[0]);
    let refused = stand(Some(0.7)).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("leg_height_m = 0.7"), "{refused}");
}

#[test]
fn what_cannot_run_is_refused_with_its_mend() {
    let paper = presets::paper();
    let rotary = "name = \"spindle\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.02\n";
    let linear = "name = \"slide\"\n[axis]\nkind = \"linear\"\nmass_kg = 2.0\n";
    let axis = |text: &str| Model::from_toml(text, "axis.toml").unwrap();
    let weightless = changed(|robot| robot.weights = None);
    let smooth = changed(|robot| robot.friction = [None; 2]);
    let legless = changed(|robot| robot.legs = None);
    let flat = Experiment::new(Scenario::Flat, ControllerChoice::Lqr);
    let sweep = Experiment::new(Scenario::FrictionSweep, ControllerChoice::Pi);
    let step = Experiment::new(Scenario::SpeedTracking, ControllerChoice::Pi);
    let nothing = Some(Matrix2x4::from_element(f64::NAN));
    let kick = |kick: Push| Experiment { kick, ..Experiment::new(Scenario::Kick, ControllerChoice::Lqr) };
    for (experiment, model, part) in [
        (Experiment { controller: ControllerChoice::Pi, ..flat.clone() }, &paper, "use lqr or flqr"),
        (flat.clone(), &axis(rotary), "give a model with a [robot] table"),
        (sweep.clone(), &axis(linear), "kind = \"rotary\""),
        (flat.clone(), &weightless, "[lqr]"),
        (Experiment { controller: ControllerChoice::Flqr, ..flat.clone() }, &smooth, "[friction.left]"),
        (Experiment { controller: ControllerChoice::Flqr, ..sweep.clone() }, &axis(rotary), "friction"),
        (Experiment { gain: nothing, ..flat.clone() }, &paper, "must be a finite number"),
        (Experiment { seconds: 10.0, ..sweep.clone() }, &paper, "10 s are too short"),
        (Experiment { seconds: f64::NAN, ..sweep.clone() }, &paper, "seconds = NaN"),
        (Experiment { seconds: 1e9, ..flat.clone() }, &paper, "seconds = 1000000000"),
        (Experiment { seconds: 0.0, ..flat.clone() }, &paper, "seconds = 0"),
        (Experiment { leg_height_m: Some(0.4), ..flat.clone() }, &legless, "leg_height_m = 0.4"),
        (
            Experiment { speed_gains: Some(SpeedGains { kp: -1.0, ki: 0.0 }), ..sweep.clone() },
            &paper,
            "kp = -1",
        ),
        (
            Experiment { target_speed_rad_s: f64::INFINITY, ..step.clone() },
            &paper,
            "target_speed_rad_s = inf",
        ),
        (Experiment { target_speed_rad_s: 0.0, ..step.clone() }, &paper, "other than 0"),
        (Experiment { target_speed_rad_s: 3.0, ..sweep }, &paper, "a target speed has no effect"),
        (Experiment { leg_height_m: Some(0.4), ..step.clone() }, &paper, "a leg height has no effect"),
        (Experiment { gain: nothing, ..step }, &paper, "a gain has no effect"),
        (
            Experiment { speed_gains: Some(SpeedGains::PAPER), ..flat.clone() },
            &paper,
            "a pair of kp and ki has no effect",
        ),
        (
            Experiment { kick: Push { force_n: 3.0, ..Push::KICK }, ..flat.clone() },
            &paper,
            "a kick has no effect",
        ),
        (kick(Push { start_s: -1.0, ..Push::KICK }), &paper, "start_s = -1"),
        (kick(Push { force_n: f64::NAN, ..Push::KICK }), &paper, "force_n = NaN"),
        (kick(Push { height_m: Some(f64::NAN), ..Push::KICK }), &paper, "height_m = NaN"),
    ] {
        let outcome = run(&experiment, model, model, &mut |_| ControlFlow::Continue(()));
        let Err(refused) = outcome else { panic!("{experiment:?} ran") };
        assert_eq!(experiment.check(model, model).unwrap_err().to_string(), refused.to_string());
        assert!(refused.to_string().contains(part), "{refused}");
    }
    // What the simulated robot lacks is said of it, not of the model that makes the controller.
    let raised = Experiment { leg_height_m: Some(0.4), ..flat.clone() };
    let refused = raised.check(&paper, &legless).unwrap_err();
    assert!(matches!(refused, ExperimentError::Actual(_)), "{refused}");
    // A gain of one's own needs no weights.
    let own = Experiment { gain: Some(Matrix2x4::from_element(-1.0)), seconds: 0.1, ..flat };
    assert!(run(&own, &weightless, &weightless, &mut |_| ControlFlow::Continue(())).is_ok());
}
