//! The closed loop as a whole, on the paper's preset.

use std::ops::ControlFlow;

use nalgebra::Matrix2x4;

use super::*;
use crate::control::{BalanceController, ControllerKind};
use crate::lqr;
use crate::model::{Actuation, Model, Motor, RobotModel, SensorSettings, State, YawHold};
use crate::model_file::presets;
use crate::record::Sample;

fn paper() -> RobotModel {
    presets::paper().robot().unwrap().clone()
}

fn gain(robot: &RobotModel) -> Matrix2x4<f64> {
    lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap().gain
}

fn controller(kind: ControllerKind) -> BalanceController {
    BalanceController::new(kind, &paper(), gain(&paper())).unwrap()
}

/// A run on the paper's robot.
fn ground(experiment: &Experiment) -> Run {
    on_ground(experiment, &presets::paper(), &presets::paper())
}

fn on_ground(experiment: &Experiment, declared: &Model, actual: &Model) -> Run {
    match run(experiment, declared, actual, &mut |_| ControlFlow::Continue(())).unwrap() {
        Outcome::Ground(run) => run,
        Outcome::Bench(_) => panic!("{experiment:?} ran in the air"),
    }
}

fn settings(scenario: Scenario, controller: ControllerChoice, seed: u64, seconds: f64) -> Experiment {
    Experiment { seed, seconds, ..Experiment::new(scenario, controller) }
}

/// The robot without noise, sensor steps and delay.
fn ideal(robot: RobotModel) -> RobotModel {
    let sensors = SensorSettings { imu_rate_hz: 1000.0, ..SensorSettings::default().exact() };
    let actuation = Actuation { delay_s: 0.0, torque_noise_nm: 0.0, torque_step_nm: 0.0 };
    RobotModel { sensors, actuation, ..robot }
}

fn without_friction() -> RobotModel {
    RobotModel { friction: [None; 2], ..ideal(paper()) }
}

fn simulation(robot: &RobotModel, initial: State) -> Simulation {
    let settings = SimulationSettings { initial, ..SimulationSettings::default() };
    Simulation::new(robot, controller(ControllerKind::Lqr), settings).unwrap()
}

fn motors_off() -> BalanceController {
    let yaw_hold = YawHold { stiffness_nm_rad: 0.0, damping_nm_s_rad: 0.0 };
    BalanceController { gain: Matrix2x4::zeros(), yaw_hold, ..controller(ControllerKind::Lqr) }
}

const PITCHED: State = State { x_m: 0.0, x_dot_m_s: 0.0, pitch_rad: 0.05, pitch_rate_rad_s: 0.0 };

fn range(of: &Summary) -> f64 {
    of.max - of.min
}

#[test]
fn lqr_hunts_without_end_and_flqr_settles_within_a_third_of_its_range() {
    for seed in 1..=10 {
        let statistics = |controller| ground(&settings(Scenario::Flat, controller, seed, 40.0)).statistics;
        let [lqr, flqr] = [ControllerChoice::Lqr, ControllerChoice::Flqr].map(statistics);
        assert!(!lqr.settled && !lqr.fell && flqr.settled && !flqr.fell, "seed {seed}");
        assert!(range(&lqr.x_m) > 3.0 * range(&flqr.x_m), "seed {seed}: {lqr:?} {flqr:?}");
    }
}

/// Table 5, flat ground, LQR: x from −0.07 to 0.12 m with a standard deviation of 0.0645 m.
#[test]
fn lqr_of_the_papers_preset_hunts_over_the_papers_displacement() {
    let lqr = ground(&Experiment::new(Scenario::Flat, ControllerChoice::Lqr)).statistics.x_m;
    for (found, published) in [(range(&lqr), 0.19), (lqr.std, 0.0645)] {
        assert!((found / published).ln().abs() < 1.5_f64.ln(), "{found} m for {published} m");
    }
}

#[test]
fn every_preset_survives_a_kick_and_settles_under_flqr() {
    for (name, text) in presets::ALL {
        let model = Model::from_toml(text, name).unwrap();
        let kick = settings(Scenario::Kick, ControllerChoice::Flqr, 1, 30.0);
        let run = on_ground(&kick, &model, &model);
        assert!(run.statistics.settled && run.fall.is_none(), "{name}: {:?}", run.statistics);
        assert_eq!(run.warnings, Vec::<String>::new());
    }
}

#[test]
fn a_gain_that_is_not_a_number_switches_the_motors_off() {
    let mut broken = simulation(&ideal(paper()), State::default());
    broken.set_controller(BalanceController {
        gain: Matrix2x4::from_element(f64::NAN),
        ..controller(ControllerKind::Lqr)
    });
    let sample = broken.step();
    assert_eq!((sample.torque_left_nm, sample.torque_right_nm), (0.0, 0.0));
    assert!(broken.state().to_vector().iter().all(|entry| entry.is_finite()));
}

#[test]
fn same_seed_gives_the_same_bytes_and_another_seed_others() {
    let bytes = |seed| -> Vec<u64> {
        let run = ground(&settings(Scenario::Flat, ControllerChoice::Flqr, seed, 3.0));
        run.samples.iter().flat_map(Sample::to_row).map(f64::to_bits).collect()
    };
    assert_eq!(bytes(5), bytes(5));
    assert_ne!(bytes(5), bytes(6));
}

#[test]
fn recorded_x_is_what_encoders_and_held_imu_give() {
    let radius = paper().parameters.wheel_radius_m;
    let samples = ground(&settings(Scenario::Flat, ControllerChoice::Lqr, 1, 2.0)).samples;
    for (tick, sample) in samples.iter().enumerate() {
        let angle = f64::midpoint(sample.motor_angle_left_rad, sample.motor_angle_right_rad);
        let speed = f64::midpoint(sample.motor_speed_left_rad_s, sample.motor_speed_right_rad_s);
        assert_eq!(sample.x_m, radius * (angle + sample.pitch_rad));
        assert_eq!(sample.x_dot_m_s, radius * (speed + sample.pitch_rate_rad_s));
        let held = &samples[tick - tick % 10];
        assert_eq!((sample.pitch_rad, sample.pitch_rate_rad_s), (held.pitch_rad, held.pitch_rate_rad_s));
        let encoder = sample.motor_angle_left_rad;
        for (value, step_deg) in [(sample.pitch_rad, 0.01), (speed * 2.0, 1.0), (encoder, 360.0 / 65536.0)] {
            let steps = value.to_degrees() / step_deg;
            assert!((steps - steps.round()).abs() < 1e-6, "{value} rad is {steps} steps");
        }
    }
}

#[test]
fn torque_takes_effect_after_the_delay() {
    for delay_ticks in [0, 1, 7] {
        let actuation = Actuation { delay_s: 1e-3 * f64::from(delay_ticks), ..without_friction().actuation };
        let robot = RobotModel { actuation, ..without_friction() };
        let mut driven = simulation(&robot, PITCHED);
        let mut coasting = driven.clone();
        coasting.set_controller(motors_off());
        let first_difference = (0..20).find(|_| {
            driven.step();
            coasting.step();
            driven.state() != coasting.state()
        });
        assert_eq!(first_difference, Some(delay_ticks));
    }
}

#[test]
fn new_controller_answers_the_next_measurement() {
    let mut live = simulation(&ideal(paper()), PITCHED);
    assert_ne!(live.step().torque_left_nm, 0.0);
    live.set_controller(motors_off());
    assert_eq!(live.step().torque_left_nm, 0.0);
}

#[test]
fn push_gives_the_robot_its_impulse_at_its_height() {
    let robot = without_friction();
    let p = robot.parameters;
    let c = p.coefficients();
    for height_m in [None, Some(0.0), Some(0.3)] {
        // Motors off; for a moment this short gravity has no say yet.
        let mut pushed = simulation(&robot, State::default());
        pushed.set_controller(motors_off());
        pushed.push(30.0, 0.003, height_m);
        for _ in 0..10 {
            pushed.step();
        }
        let state = pushed.state();
        // Momenta along x and about the axle: M(v) q̇ = ∫ (F, F h) dt, Eqs. 4 and 5 at θ = 0.
        let along = (c.c1 * state.x_dot_m_s + c.c2 * state.pitch_rate_rad_s) / p.wheel_radius_m;
        let about = c.c5 * state.x_dot_m_s + c.c3 * state.pitch_rate_rad_s;
        assert!((along / 0.09 - 1.0).abs() < 0.01, "{along} N s");
        let moment = 0.09 * height_m.unwrap_or(p.com_height_m);
        assert!((about - moment).abs() < 0.01 * (0.09 * p.com_height_m), "{about} N m s at {height_m:?}");
    }
}

#[test]
fn a_robot_without_control_falls_and_stays_down_with_its_clock() {
    let mut falling = simulation(&paper(), PITCHED);
    falling.set_controller(motors_off());
    let ticks = (0..5000).take_while(|_| falling.step().time_s >= 0.0 && falling.fall().is_none()).count();
    let fall = *falling.fall().unwrap();
    assert!(ticks < 5000 && fall.state.pitch_rad > FALL_PITCH_RAD);
    let after = falling.step();
    assert_eq!((after.time_s, after.torque_left_nm), (fall.time_s, 0.0));
    assert_eq!((falling.state(), falling.time_s()), (fall.state, fall.time_s));
}

#[test]
fn a_gain_that_cannot_balance_is_told_before_the_run_that_falls_and_ends_there() {
    let design = gain(&paper());
    // None at all, and the wrong sign.
    for gain in [Matrix2x4::zeros(), -design] {
        let experiment =
            Experiment { gain: Some(gain), ..Experiment::new(Scenario::Flat, ControllerChoice::Lqr) };
        let told = experiment.check(&presets::paper(), &presets::paper()).unwrap();
        assert!(told[0].contains("unstable"), "{told:?}");
        let run = ground(&experiment);
        assert_eq!(run.warnings, told);
        let fall = run.fall.unwrap();
        assert!(fall.state.pitch_rad.abs() > FALL_PITCH_RAD);
        assert!(run.statistics.fell && !run.statistics.settled);
        assert!((run.samples.last().unwrap().time_s - fall.time_s).abs() < 0.0015 && fall.time_s < 10.0);
    }
}

#[test]
fn the_watcher_can_stop_a_run() {
    for (scenario, controller) in
        [(Scenario::Flat, ControllerChoice::Lqr), (Scenario::FrictionSweep, ControllerChoice::Pi)]
    {
        let paper = presets::paper();
        let experiment = Experiment::new(scenario, controller);
        let mut heard = Vec::new();
        let outcome = run(&experiment, &paper, &paper, &mut |share| {
            heard.push(share);
            if share * experiment.seconds < 0.1 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        assert_eq!(outcome.unwrap().log(Motor::Left).rows(), 100);
        assert!(heard[0] == 0.0 && heard.windows(2).all(|pair| pair[0] < pair[1]) && heard.len() == 11);
    }
}

#[test]
fn kick_moves_the_robot_at_its_time() {
    let samples = |scenario| ground(&settings(scenario, ControllerChoice::Flqr, 1, 12.0)).samples;
    let [calm, kicked] = [Scenario::Flat, Scenario::Kick].map(samples);
    assert_eq!(calm[..=8500], kicked[..=8500]);
    let fastest = kicked[8500..].iter().map(|sample| sample.x_dot_m_s.abs()).fold(0.0, f64::max);
    assert!(fastest > 0.1, "{fastest} m/s");
}

#[test]
fn statistics_are_those_of_the_samples_after_15_s() {
    let any = ground(&settings(Scenario::Flat, ControllerChoice::Lqr, 1, 0.001)).samples[0];
    let sample = |tick: i32| Sample {
        // Far out before 15 s, then between 0.01 and 0.03.
        x_m: if tick < 15_000 { 5.0 } else { 0.02 + 0.01 * f64::from((tick % 2) * 2 - 1) },
        x_dot_m_s: 0.5,
        pitch_rad: -0.1,
        time_s: f64::from(tick) / 1000.0,
        ..any
    };
    let samples: Vec<Sample> = (0..25_001).map(sample).collect();
    let found = Statistics::of(&samples).unwrap();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert!(close(found.x_m.min, 0.01) && close(found.x_m.max, 0.03));
    assert!((found.x_m.mean - 0.02).abs() < 1e-5 && (found.x_m.std - 0.01).abs() < 1e-6);
    assert!(close(found.x_dot_m_s.mean, 0.5) && close(found.x_dot_m_s.std, 0.0));
    assert!(found.settled && !found.fell);
    assert!(!Statistics::of(&samples[..20_000]).unwrap().settled, "5 m and 0.02 m in the last 10 s");
    assert!(!Statistics::of(&samples[16_000..20_000]).unwrap().settled, "4 s show nothing about 10 s");
    assert_eq!(Statistics::of(&[]), None);
    let early = Statistics::between(&samples, [1.0, 2.0]).unwrap();
    assert_eq!((early.from_s, early.x_m.min, early.x_m.max, early.settled), (1.0, 5.0, 5.0, true));
    let last = Statistics::between(&samples, [14.999, 15.0]).unwrap();
    assert_eq!((last.x_m.max, last.x_m.mean), (5.0, 2.505), "both ends count");
    for outside in [[30.0, 40.0], [2.0, 1.0], [f64::NAN, 1.0]] {
        assert_eq!(Statistics::between(&samples, outside), None, "{outside:?}");
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let default = SimulationSettings::default();
    let pitched = State { pitch_rad: 0.9, ..State::default() };
    for (settings, key) in [
        (SimulationSettings { initial: pitched, ..default }, "pitch_rad"),
        (SimulationSettings { substeps: 0, ..default }, "substeps"),
    ] {
        let refused = Simulation::new(&paper(), controller(ControllerKind::Lqr), settings).unwrap_err();
        assert!(refused.to_string().contains(key), "{refused}");
    }
    let mut robot = paper();
    robot.actuation.torque_noise_nm = f64::NAN;
    let refused = Simulation::new(&robot, controller(ControllerKind::Lqr), default).unwrap_err();
    assert!(refused.to_string().contains("torque_noise_nm"), "{refused}");
}

#[test]
fn small_motions_without_friction_follow_the_linear_closed_loop() {
    let robot = without_friction();
    let initial = State { x_m: 1e-4, pitch_rad: 1e-4, ..State::default() };
    let mut simulation = simulation(&robot, initial);
    let model = robot.parameters.linear_model();
    let transition = ((model.a - model.b * gain(&robot)) * 1e-3).exp();
    let mut predicted = initial.to_vector();
    for tick in 0..=3000 {
        assert!((simulation.time_s() - f64::from(tick) * 1e-3).abs() < 1e-12);
        // The controller samples at 1 kHz, the prediction is continuous.
        let difference = (simulation.state().to_vector() - predicted).amax();
        assert!(difference < 2e-5, "{difference} at tick {tick}");
        simulation.step();
        predicted = transition * predicted;
    }
}
