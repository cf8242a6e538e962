//! One tick of 1 ms: plants alone, and the whole closed loop with sensors and noise.
//!
//! `cargo bench -p flqr-core --bench simulate`; 1 ms divided by the time of a tick is the speed relative
//! to real time. `peers.py` next to this file runs it together with numba, MuJoCo and SciPy on the same
//! robot and prints the ratios.

use std::num::NonZeroUsize;

use divan::Bencher;
use divan::counter::ItemsCount;
use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::lqr;
use flqr_core::model::{Model, RobotModel, RobotParameters, State};
use flqr_core::simulate::{
    Forcing, PlanarPlant, Plant, Simulation, SimulationSettings, Trial, advance_batch, monte_carlo,
};

fn main() {
    divan::main();
}

/// Ticks in one measurement.
const TICKS: usize = 1000;

fn paper() -> RobotModel {
    let text = include_str!("../../../presets/paper.toml");
    Model::from_toml(text, "paper.toml").expect("the preset loads").robot().expect("it is a robot").clone()
}

/// Ticks in one measurement of many robots.
const BATCH_TICKS: usize = 100;

/// The robot of the peers, with the friction of Table 4.
const PEERS_ROBOT: RobotParameters = RobotParameters {
    body_mass_kg: 13.0,
    wheel_mass_kg: 1.0,
    wheel_inertia_kg_m2: 0.005,
    wheel_radius_m: 0.1,
    com_height_m: 0.25,
    body_inertia_kg_m2: 0.25,
    gravity_m_s2: 9.81,
};

/// The peers' weights: Q = diag(10, 1, 100, 1), R = 1.
fn peers_gain() -> nalgebra::Matrix2x4<f64> {
    let weights = flqr_core::model::Weights::diagonal([10.0, 1.0, 100.0, 1.0], [1.0; 2]);
    lqr::design(&PEERS_ROBOT.linear_model(), &weights).expect("the peers' robot has a design").gain
}

/// 1000 ticks of the planar plant under state feedback, by substeps: what the peers do.
#[divan::bench(args = [4, 10])]
fn planar_plant(bencher: Bencher, substeps: u32) {
    let gain = peers_gain();
    let start = PlanarPlant::new(&PEERS_ROBOT, paper().friction, &pitched());
    bencher.counter(ItemsCount::new(TICKS)).with_inputs(|| start.clone()).bench_values(|mut plant| {
        for _ in 0..TICKS {
            let torque = -(gain * plant.state().to_vector());
            let forcing = Forcing { torque_nm: torque.into(), ..Forcing::default() };
            plant.advance(&forcing, 1e-3, substeps);
        }
        plant.state()
    });
}

/// 100 ticks of so many planar plants under state feedback, ten substeps each; an item is one tick of one.
#[divan::bench(args = [8, 256])]
fn planar_batch(bencher: Bencher, robots: usize) {
    let gain = peers_gain();
    let start: Vec<PlanarPlant> = (0..robots)
        .map(|robot| {
            let body_mass_kg = PEERS_ROBOT.body_mass_kg * (1.0 + 0.04 * robot as f64 / robots as f64);
            let parameters = RobotParameters { body_mass_kg, ..PEERS_ROBOT };
            PlanarPlant::new(&parameters, paper().friction, &pitched())
        })
        .collect();
    let mut forcings = vec![Forcing::default(); robots];
    bencher.counter(ItemsCount::new(BATCH_TICKS * robots)).with_inputs(|| start.clone()).bench_local_values(
        |mut plants| {
            for _ in 0..BATCH_TICKS {
                for (forcing, plant) in forcings.iter_mut().zip(&plants) {
                    forcing.torque_nm = (-(gain * plant.state().to_vector())).into();
                }
                advance_batch(&mut plants, &forcings, 1e-3, 10);
            }
            plants
        },
    );
}

/// 5 s of 64 closed loops on one thread, friction tables and all; an item is one tick of one robot.
#[divan::bench(args = [ControllerKind::Lqr, ControllerKind::Flqr], sample_count = 5)]
fn monte_carlo_loops(bencher: Bencher, kind: ControllerKind) {
    let robot = paper();
    let controller = BalanceController::new(kind, &robot, gain(&robot)).expect("the preset has friction");
    let trial = Trial { robot, controller, initial: pitched(), seed: 0 };
    let trials: Vec<Trial> = (0..64).map(|seed| Trial { seed, ..trial.clone() }).collect();
    let seconds = 5.0;
    let items = (seconds * 1000.0) as usize * trials.len();
    bencher
        .counter(ItemsCount::new(items))
        .bench_local(|| monte_carlo(&trials, seconds, NonZeroUsize::MIN).expect("the preset is in range"));
}

/// 1000 ticks of the whole robot with yaw under the same feedback, by substeps; the robot turns, so that
/// its wheels differ.
#[divan::bench(args = [4, 10])]
fn whole_plant(bencher: Bencher, substeps: u32) {
    let robot = paper();
    let gain = gain(&robot);
    let start = Plant::new(&robot, &pitched());
    bencher.counter(ItemsCount::new(TICKS)).with_inputs(|| start.clone()).bench_values(|mut plant| {
        for _ in 0..TICKS {
            let pose = plant.pose();
            let torque = -(gain * pose.state.to_vector());
            let turn = 0.5 * (1.0 - pose.yaw_rate_rad_s);
            let forcing = Forcing { torque_nm: [torque[0] - turn, torque[1] + turn], ..Forcing::default() };
            plant.advance(&forcing, 1e-3, substeps);
        }
        plant.state()
    });
}

/// 1000 ticks of the closed loop.
#[divan::bench(args = [ControllerKind::Lqr, ControllerKind::Flqr])]
fn closed_loop(bencher: Bencher, kind: ControllerKind) {
    let robot = paper();
    let controller = BalanceController::new(kind, &robot, gain(&robot)).expect("the preset has friction");
    let settings = SimulationSettings { initial: pitched(), ..SimulationSettings::default() };
    let start = Simulation::new(&robot, controller, settings).expect("the preset is in range");
    bencher.counter(ItemsCount::new(TICKS)).with_inputs(|| start.clone()).bench_values(|mut simulation| {
        for _ in 0..TICKS {
            divan::black_box(simulation.step());
        }
        simulation
    });
}

fn gain(robot: &RobotModel) -> nalgebra::Matrix2x4<f64> {
    let weights = robot.weights.expect("the preset has weights");
    lqr::design(&robot.parameters.linear_model(), &weights).expect("the preset has a design").gain
}

fn pitched() -> State {
    State { pitch_rad: 0.05, ..State::default() }
}
