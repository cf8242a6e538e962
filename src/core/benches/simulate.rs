//! One tick of 1 ms: the plant alone, and the whole closed loop with sensors and noise.
//!
//! `cargo bench -p flqr-core --bench simulate`; 1 ms divided by the time of a tick is the speed relative
//! to real time.

use divan::Bencher;
use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::lqr;
use flqr_core::model_file::{Model, RobotModel};
use flqr_core::robot::State;
use flqr_core::simulate::{Forcing, PlanarPlant, Plant, Simulation, SimulationSettings};

fn main() {
    divan::main();
}

/// Ticks in one measurement.
const TICKS: usize = 1000;

fn paper() -> RobotModel {
    let text = include_str!("../../../presets/paper.toml");
    Model::from_toml(text, "paper.toml").expect("the preset loads").robot().expect("it is a robot").clone()
}

/// 1000 ticks of the plant under state feedback, by substeps.
#[divan::bench(args = [4, 10])]
fn plant(bencher: Bencher, substeps: u32) {
    let robot = paper();
    let gain = gain(&robot);
    let start = PlanarPlant::new(&robot.parameters, robot.friction, &pitched());
    bencher.counter(divan::counter::ItemsCount::new(TICKS)).with_inputs(|| start.clone()).bench_values(
        |mut plant| {
            for _ in 0..TICKS {
                let torque = -(gain * plant.state().to_vector());
                let forcing = Forcing { torque_nm: torque.into(), ..Forcing::default() };
                plant.advance(&forcing, 1e-3, substeps);
            }
            plant.state()
        },
    );
}

/// 1000 ticks of the whole robot with yaw under the same feedback, by substeps; the robot turns, so that
/// its wheels differ.
#[divan::bench(args = [4, 10])]
fn whole_plant(bencher: Bencher, substeps: u32) {
    let robot = paper();
    let gain = gain(&robot);
    let start = Plant::new(&robot, &pitched());
    bencher.counter(divan::counter::ItemsCount::new(TICKS)).with_inputs(|| start.clone()).bench_values(
        |mut plant| {
            for _ in 0..TICKS {
                let pose = plant.pose();
                let torque = -(gain * pose.state.to_vector());
                let turn = 0.5 * (1.0 - pose.yaw_rate_rad_s);
                let forcing =
                    Forcing { torque_nm: [torque[0] - turn, torque[1] + turn], ..Forcing::default() };
                plant.advance(&forcing, 1e-3, substeps);
            }
            plant.state()
        },
    );
}

/// 1000 ticks of the closed loop.
#[divan::bench(args = [ControllerKind::Lqr, ControllerKind::Flqr])]
fn closed_loop(bencher: Bencher, kind: ControllerKind) {
    let robot = paper();
    let controller = BalanceController::new(kind, &robot, gain(&robot)).expect("the preset has friction");
    let settings = SimulationSettings { initial: pitched(), ..SimulationSettings::default() };
    let start = Simulation::new(&robot, controller, settings).expect("the preset is in range");
    bencher.counter(divan::counter::ItemsCount::new(TICKS)).with_inputs(|| start.clone()).bench_values(
        |mut simulation| {
            for _ in 0..TICKS {
                divan::black_box(simulation.step());
            }
            simulation
        },
    );
}

fn gain(robot: &RobotModel) -> nalgebra::Matrix2x4<f64> {
    let weights = robot.weights.expect("the preset has weights");
    lqr::design(&robot.parameters.linear_model(), &weights).expect("the preset has a design").gain
}

fn pitched() -> State {
    State { pitch_rad: 0.05, ..State::default() }
}
