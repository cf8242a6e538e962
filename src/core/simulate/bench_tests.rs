//! Experiments with the wheels in the air, from settings to what is learned from them.

use std::ops::ControlFlow;

use super::*;
use crate::friction::Stribeck;
use crate::identify::{self, FitOptions};
use crate::model::{Model, Motor};
use crate::model_file::presets;
use crate::record::Log;

const MOTORS: [Motor; 2] = [Motor::Left, Motor::Right];

fn bench(experiment: &Experiment, model: &Model) -> BenchRun {
    match run(experiment, model, model, &mut |_| ControlFlow::Continue(())).unwrap() {
        Outcome::Bench(run) => run,
        Outcome::Ground(_) => panic!("{experiment:?} ran on the ground"),
    }
}

fn curves() -> [Stribeck; 2] {
    presets::paper().robot().unwrap().friction.map(Option::unwrap)
}

fn axis(keys: &str) -> Model {
    let friction = "coulomb_nm = 0.2\nstatic_nm = 0.3\nviscous_nm_s_rad = 0.004\nstribeck_speed_rad_s = 1.0\n\
                    stribeck_exponent = 1.0\noffset_nm = 0.01\n";
    let text = format!(
        "name = \"spindle\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.02\n{keys}[friction]\n{friction}"
    );
    Model::from_toml(&text, "spindle.toml").unwrap()
}

/// Table 4 from the simulated sweep: section 3 as a whole, sensor noise included.
#[test]
fn sweep_gives_264_pairs_and_the_curve_of_both_motors_within_2_percent() {
    let paper = presets::paper();
    for seed in 1..=3 {
        let sweep = Experiment { seed, ..Experiment::new(Scenario::FrictionSweep, ControllerChoice::Pi) };
        let outcome = run(&sweep, &paper, &paper, &mut |_| ControlFlow::Continue(())).unwrap();
        for (motor, truth) in MOTORS.into_iter().zip(curves()) {
            let log = outcome.log(motor);
            let quiet = &mut |_: &_| ControlFlow::Continue(());
            let report = identify::fit(&[log], None, motor, &FitOptions::default(), quiet).unwrap();
            assert_eq!(report.pairs.len(), 264, "{:?}", report.warnings);
            let fastest = report.pairs.iter().map(|pair| pair.speed_rad_s.abs()).fold(0.0, f64::max);
            assert!((fastest - 50.0).abs() < 0.1, "{fastest} rad/s");
            let found = Stribeck::new(report.stribeck().unwrap()).unwrap();
            for pair in &report.pairs {
                let [found, truth] = [found, truth].map(|curve| curve.torque_nm(pair.speed_rad_s));
                let error = found / truth - 1.0;
                assert!(error.abs() < 0.02, "seed {seed}, {motor:?}: {error} at {} rad/s", pair.speed_rad_s);
            }
        }
    }
}

/// The same stretches are found from the measured speed alone.
#[test]
fn sweep_without_its_target_column_gives_the_same_pairs() {
    let sweep =
        Experiment { seconds: 60.0, ..Experiment::new(Scenario::FrictionSweep, ControllerChoice::Pi) };
    let paper = presets::paper();
    let log = run(&sweep, &paper, &paper, &mut |_| ControlFlow::Continue(())).unwrap().log(Motor::Left);
    let kept = ["time_s", "motor_angle_rad", "torque_nm", "motor_speed_rad_s"];
    let without = Log::from_columns("log", kept.map(|name| (name, log.column(name).unwrap().to_vec())));
    let set = identify::pairs_from_log(&without, Motor::Left).unwrap();
    assert_eq!(set.dwells.len(), 33, "{:?}", set.warnings);
}

#[test]
fn tracking_with_compensation_is_never_slower_at_the_papers_gains() {
    for (kp, ki) in [(0.5, 0.05), (0.05, 0.05), (0.05, 0.01)] {
        for seed in 1..=3 {
            let rise = |controller| {
                let speed_gains = Some(SpeedGains { kp, ki });
                let tracking = Experiment::new(Scenario::SpeedTracking, controller);
                let tracking = Experiment { speed_gains, seed, seconds: 20.0, ..tracking };
                let run = bench(&tracking, &presets::paper());
                run.tracking.unwrap().map(|response| response.rise_time_s.unwrap())
            };
            let [plain, lqr, compensated] =
                [ControllerChoice::Pi, ControllerChoice::Lqr, ControllerChoice::Flqr].map(rise);
            assert_eq!(plain, lqr);
            for motor in [0, 1] {
                let (plain, compensated) = (plain[motor], compensated[motor]);
                assert!(compensated <= plain, "kp {kp}, ki {ki}: {compensated} s for {plain} s");
                // The large gain asks for more than the motor's torque either way.
                assert!(
                    kp == 0.5 || compensated < 0.5 * plain,
                    "kp {kp}, ki {ki}: {compensated} s for {plain} s"
                );
            }
        }
    }
}

/// Proportional control alone stops where kp e = τ_f(target − e); the integral makes up for the rest.
#[test]
fn steady_error_is_that_of_the_control_law() {
    let kp = 0.05;
    for (ki, proportional) in [(0.0, true), (0.05, false)] {
        let speed_gains = Some(SpeedGains { kp, ki });
        let tracking = Experiment::new(Scenario::SpeedTracking, ControllerChoice::Pi);
        let run = bench(&Experiment { speed_gains, ..tracking }, &presets::paper());
        for (response, curve) in run.tracking.unwrap().into_iter().zip(curves()) {
            let mut error = 0.0;
            for _ in 0..100 {
                error = if proportional { curve.torque_nm(5.0 - error) / kp } else { 0.0 };
            }
            let found = response.steady_error_rad_s;
            assert!((found - error).abs() < 0.03, "ki {ki}: {found} rad/s for {error}");
        }
    }
}

#[test]
fn multisine_in_the_air_turns_both_shafts_their_own_way_and_gives_the_inertia() {
    let paper = presets::paper();
    let experiment = Experiment::new(Scenario::Multisine, ControllerChoice::Pi);
    let outcome = run(&experiment, &paper, &paper, &mut |_| ControlFlow::Continue(())).unwrap();
    let logs = MOTORS.map(|motor| outcome.log(motor));
    assert_ne!(logs[0].column("torque_nm"), logs[1].column("torque_nm"));
    for (log, motor) in logs.into_iter().zip(MOTORS) {
        let options = FitOptions { estimate: vec!["inertia_kg_m2".to_owned()], ..FitOptions::default() };
        let quiet = &mut |_: &_| ControlFlow::Continue(());
        let report = identify::fit(&[log], None, motor, &options, quiet).unwrap();
        let inertia = report.parameters["inertia_kg_m2"].value;
        let truth = paper.robot().unwrap().parameters.wheel_inertia_kg_m2;
        assert!((inertia / truth - 1.0).abs() < 0.1, "{motor:?}: {inertia} kg m²");
    }
}

#[test]
fn one_shaft_runs_every_experiment_in_the_air_and_has_one_log() {
    for (scenario, controller) in [
        (Scenario::SpeedTracking, ControllerChoice::Flqr),
        (Scenario::FrictionSweep, ControllerChoice::Pi),
        (Scenario::Multisine, ControllerChoice::Pi),
    ] {
        for keys in ["", "gravity_torque_nm = 0.1\n"] {
            let axis = axis(keys);
            let experiment = Experiment { seconds: 30.0, ..Experiment::new(scenario, controller) };
            let outcome = run(&experiment, &axis, &axis, &mut |_| ControlFlow::Continue(())).unwrap();
            assert_eq!(outcome.log(Motor::Left), outcome.log(Motor::Right));
            let log = outcome.log(Motor::Left);
            assert_eq!(log.kind().unwrap(), crate::record::LogKind::Bench);
            let angle = log.column("motor_angle_rad").unwrap();
            let travel = angle.iter().fold(0.0, |most: f64, angle| most.max(angle.abs()));
            assert!(log.rows() == 30_000 && travel > 0.3, "{scenario} {keys}: {travel} rad");
        }
    }
}

#[test]
fn speed_control_too_fast_for_its_delay_is_told_before_the_run() {
    let tracking = Experiment::new(Scenario::SpeedTracking, ControllerChoice::Pi);
    let paper = presets::paper();
    for (kp, ki, unstable) in [(0.5, 0.05, false), (2.0, 0.05, true), (0.05, 20.0, true), (0.0, 0.0, false)] {
        let experiment = Experiment { speed_gains: Some(SpeedGains { kp, ki }), ..tracking.clone() };
        let told = experiment.check(&paper, &paper).unwrap();
        assert_eq!(told.len(), usize::from(unstable), "{kp}, {ki}: {told:?}");
        let run = bench(&experiment, &paper);
        assert_eq!(run.warnings, told);
        let end = &run.samples[run.samples.len() - 1000..];
        let swing = end.iter().map(|sample| (sample.motor_speed_rad_s[0] - 5.0).abs()).fold(0.0, f64::max);
        assert!(kp == 0.0 || (swing > 2.0) == unstable, "{kp}, {ki}: {swing} rad/s");
    }
}
