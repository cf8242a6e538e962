//! The loop when sampled against polynomials worked out by hand, the design without a tick, the margins, and the
//! simulator.

use nalgebra::{Complex, Matrix2x4, Matrix4, Matrix4x2};

use crate::control::{BalanceController, ControllerKind};
use crate::lqr::{Disturbance, SampledLoop, damping, design, margins, sampled_poles, sampled_response};
use crate::model::{Actuation, LinearModel, RobotModel, State, Weights, YawHold};
use crate::model_file::presets;
use crate::simulate::{Simulation, SimulationSettings};

const TICK_S: f64 = 0.01;
const STIFFNESS: f64 = 30.0;
const DAMPING: f64 = 12.0;

/// A mass of 1 kg on wheels without a body: ẍ = u, each motor half of the gain.
fn mass() -> (LinearModel, Matrix2x4<f64>) {
    let mut a = Matrix4::zeros();
    (a[(0, 1)], a[(2, 3)]) = (1.0, 1.0);
    let mut b = Matrix4x2::zeros();
    (b[(1, 0)], b[(1, 1)]) = (1.0, 1.0);
    let gain = Matrix2x4::from_fn(|_, state| [0.5 * STIFFNESS, 0.5 * DAMPING, 0.0, 0.0][state]);
    (LinearModel { a, b }, gain)
}

fn timing(delay_s: f64, tick_s: f64, imu_period_s: f64) -> SampledLoop {
    SampledLoop { tick_s, delay_s, imu_period_s, imu_latency_s: 0.0, wheel_radius_m: 0.055 }
}

fn value_at(polynomial: &[f64], z: Complex<f64>) -> f64 {
    polynomial.iter().fold(Complex::default(), |sum: Complex<f64>, c| sum * z + c).norm()
}

/// With ZOH, x⁺ = x + T ẋ + ½T² u and ẋ⁺ = ẋ + T u; u is the command of now, or of a tick ago.
#[test]
fn poles_of_a_sampled_mass_are_the_roots_of_its_polynomial() {
    let (half, whole) = (0.5 * STIFFNESS * TICK_S * TICK_S, DAMPING * TICK_S);
    let (model, gain) = mass();
    for (delay_s, polynomial) in [
        (0.0, vec![1.0, half + whole - 2.0, 1.0 + half - whole]),
        (TICK_S, vec![1.0, -2.0, 1.0 + half + whole, half - whole]),
    ] {
        let poles = sampled_poles(&model, &gain, &timing(delay_s, TICK_S, TICK_S));
        // Two more are those of the body that nothing moves, at 1.
        let body = poles.iter().filter(|pole| (pole.z - 1.0).norm() < 1e-6).count();
        assert_eq!((body, poles.len()), (2, polynomial.len() + 1), "{poles:?}");
        for pole in poles.iter().filter(|pole| (pole.z - 1.0).norm() > 1e-6) {
            assert!(value_at(&polynomial, pole.z) < 1e-12, "{pole:?}");
            assert!(((pole.s * TICK_S).exp() - pole.z).norm() < 1e-12);
        }
    }
}

fn robot() -> RobotModel {
    presets::paper().robot().unwrap().clone()
}

fn gain_of(robot: &RobotModel, weights: &Weights) -> Matrix2x4<f64> {
    design(&robot.parameters.linear_model(), weights).unwrap().gain
}

#[test]
fn poles_are_those_of_the_design_as_tick_and_delay_go_to_0() {
    let robot = robot();
    let model = robot.parameters.linear_model();
    let mut expected = design(&model, &Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0; 2])).unwrap().poles;
    expected.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let gain = gain_of(&robot, &Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0; 2]));
    let mut found = sampled_poles(&model, &gain, &timing(0.0, 1e-5, 1e-5));
    found.sort_by(|a, b| b.s.re.total_cmp(&a.s.re).then(b.s.im.total_cmp(&a.s.im)));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found.s - expected).norm() < 1e-3 * expected.norm(), "{found:?} {expected}");
        assert!((found.damping() - damping(expected)).abs() < 1e-3);
    }
}

#[test]
fn a_pole_reaches_the_unit_circle_at_the_delay_margin() {
    let robot = robot();
    let model = robot.parameters.linear_model();
    for q in [[2.0, 0.01, 58.5, 0.01], [60.0, 30.0, 100.0, 5.0]] {
        let gain = gain_of(&robot, &Weights::diagonal(q, [5.0; 2]));
        for (imu_period_s, imu_latency_s) in [(0.001, 0.0), (0.01, 0.0), (0.005, 0.003)] {
            let timing = SampledLoop { imu_latency_s, ..timing(0.0035, 0.001, imu_period_s) };
            let margin = margins(&model, &gain, &timing);
            let slowest = |extra_s: f64| {
                let later = SampledLoop { delay_s: timing.delay_s + extra_s, ..timing };
                sampled_poles(&model, &gain, &later)[0].z.norm()
            };
            assert!(slowest(0.0) < 1.0 && margin.stable);
            assert!((slowest(margin.delay_s) - 1.0).abs() < 1e-8, "{margin:?}");
        }
    }
}

/// The robot without noise, steps, friction and limits, whose motion the linear loop describes.
fn ideal() -> RobotModel {
    let robot = robot();
    let sensors = robot.sensors.exact();
    let actuation = Actuation { delay_s: 0.004, torque_noise_nm: 0.0, torque_step_nm: 0.0 };
    RobotModel { friction: [None; 2], limits: Default::default(), sensors, actuation, ..robot }
}

fn simulation(robot: &RobotModel, gain: Matrix2x4<f64>, initial: State) -> Simulation {
    let settings = SimulationSettings { initial, ..SimulationSettings::default() };
    let yaw_hold = YawHold { stiffness_nm_rad: 0.0, damping_nm_s_rad: 0.0 };
    let controller = BalanceController::new(ControllerKind::Lqr, robot, gain).unwrap();
    Simulation::new(robot, BalanceController { yaw_hold, ..controller }, settings).unwrap()
}

/// Disturbances so small that sines are their angles.
#[test]
fn responses_and_peak_torques_are_the_simulators() {
    let mut robot = ideal();
    for (imu_latency_s, r) in [(0.0, [1.0, 1.0]), (0.003, [1.0, 3.0])] {
        robot.sensors.imu_latency_s = imu_latency_s;
        let gain = gain_of(&robot, &Weights::diagonal([4.0, 1.0, 4.0, 0.2], r));
        for disturbance in [Disturbance::Kick(1e-3), Disturbance::Pitch(1e-4), Disturbance::Step(1e-3)] {
            let initial = disturbance.state(&robot.parameters);
            let model = robot.parameters.linear_model();
            let found = sampled_response(&model, &gain, &SampledLoop::of(&robot), &initial, 2.0);
            assert_eq!(found.states.len(), 2001);
            let mut simulation = simulation(&robot, gain, initial);
            let mut peak = 0.0_f64;
            for (tick, (state, torque)) in found.states.iter().zip(&found.torque_nm).enumerate() {
                let size = found.states[..=tick].iter().map(|s| s.pitch_rad.abs()).fold(0.0, f64::max);
                let expected = simulation.state();
                assert!(
                    (state.x_m - expected.x_m).abs()
                        <= 2e-3 * found.states[..=tick].iter().map(|s| s.x_m.abs()).fold(1e-9, f64::max)
                );
                assert!((state.pitch_rad - expected.pitch_rad).abs() <= 2e-3 * size.max(1e-9), "{tick}");
                let sample = simulation.step();
                peak = peak.max(sample.torque_left_nm.abs()).max(sample.torque_right_nm.abs());
                assert!((sample.torque_left_nm - torque[0]).abs() <= 2e-3 * found.peak_torque_nm());
                assert!((sample.torque_right_nm - torque[1]).abs() <= 2e-3 * found.peak_torque_nm());
            }
            assert!((found.peak_torque_nm() / peak - 1.0).abs() < 2e-3, "{disturbance:?}");
        }
    }
}

/// A force of 1 ms moves the simulated robot as the blow of its impulse says.
#[test]
fn a_kick_is_a_short_push() {
    let robot = ideal();
    let mut simulation = simulation(&robot, Matrix2x4::zeros(), State::default());
    let impulse_n_s = 0.5;
    simulation.push(impulse_n_s / 1e-3, 1e-3, None);
    simulation.step();
    let (found, expected) = (simulation.state(), Disturbance::Kick(impulse_n_s).state(&robot.parameters));
    assert!((found.x_dot_m_s / expected.x_dot_m_s - 1.0).abs() < 1e-3, "{found:?} {expected:?}");
    assert!((found.pitch_rate_rad_s / expected.pitch_rate_rad_s - 1.0).abs() < 1e-3);
    assert_eq!(Disturbance::Step(1.0).of_size(0.2).state(&robot.parameters).x_m, -0.2);
}

#[test]
fn a_loop_that_cannot_be_analysed_has_neither_poles_nor_response() {
    let (model, gain) = mass();
    for bad in [timing(1.0, 0.001, 0.01), timing(f64::NAN, 0.001, 0.01), timing(0.0, 0.0, 0.01)] {
        assert!(sampled_poles(&model, &gain, &bad).is_empty());
        assert!(sampled_response(&model, &gain, &bad, &State::default(), 1.0).states.is_empty());
    }
    let good = timing(0.0, 0.001, 0.01);
    assert!(sampled_response(&model, &gain, &good, &State::default(), f64::NAN).states.is_empty());
    let unstable =
        sampled_response(&model, &-gain, &good, &Disturbance::Step(1.0).state(&robot().parameters), 60.0);
    assert!(unstable.states.len() < 60_000);
}
