use nalgebra::Matrix2x4;

use super::*;
use crate::friction::{Compensation, Feedforward, Stribeck, StribeckParameters};
use crate::lqr::design;
use crate::model::{
    Chassis, HeightNode, Legs, Model, MotorLimits, OverHeight, RobotModel, State, Weights, YawHold,
};
use crate::record::Readings;

const MODEL: &str = r#"
name = "bench robot"
[robot]
body_mass_kg = 13.0
wheel_mass_kg = 1.0
wheel_inertia_kg_m2 = 0.005
wheel_radius_m = 0.1
com_height_m = 0.25
body_inertia_kg_m2 = 0.25
[friction.left]
coulomb_nm = 0.03
static_nm = 0.05
viscous_nm_s_rad = 0.001
stribeck_speed_rad_s = 1.0
stribeck_exponent = 1.0
offset_nm = 0.002
"#;

/// Height of the legs, of the centre of mass (m), inertia (kg m²).
const LEGS: [(f64, f64, f64); 3] = [(0.32, 0.12, 0.10), (0.37, 0.15, 0.13), (0.42, 0.19, 0.17)];

/// Neither moved nor turned.
const HERE: Reference = Reference {
    state: State { x_m: 0.0, x_dot_m_s: 0.0, pitch_rad: 0.0, pitch_rate_rad_s: 0.0 },
    yaw_rad: 0.0,
};

fn robot() -> RobotModel {
    Model::from_toml(MODEL, "test").unwrap().robot().unwrap().clone()
}

fn gain() -> Matrix2x4<f64> {
    Matrix2x4::new(-1.0, -2.0, -10.0, -3.0, -1.5, -2.0, -10.0, -3.0)
}

fn measurement() -> Measurement {
    let state = State { x_m: 0.1, x_dot_m_s: -0.2, pitch_rad: 0.03, pitch_rate_rad_s: 0.01 };
    Measurement { state, motor_speed_rad_s: [2.0, -2.0], ..Measurement::default() }
}

#[test]
fn lqr_is_minus_gain_times_state() {
    let found = BalanceController::new(ControllerKind::Lqr, &robot(), gain()).unwrap();
    let found = found.step(&measurement(), &HERE);
    // 1.0·0.1 − 2·0.2 + 10·0.03 + 3·0.01 and the same with 1.5·0.1
    assert!((found[0] - 0.03).abs() < 1e-15 && (found[1] - 0.08).abs() < 1e-15, "{found:?}");
}

#[test]
fn flqr_adds_the_friction_of_motors_that_have_one() {
    let found = BalanceController::new(ControllerKind::Flqr, &robot(), gain()).unwrap();
    let found = found.step(&measurement(), &HERE);
    // 0.9 · (0.03 + 0.02 e⁻² + 0.001·2 + 0.002) by default; the right motor has no friction in the model.
    let left = 0.03 + 0.9 * (0.034 + 0.02 * (-2.0_f64).exp());
    assert!((found[0] - left).abs() < 1e-15 && (found[1] - 0.08).abs() < 1e-15, "{found:?}");
}

#[test]
fn torque_stays_within_the_limit_of_the_model() {
    let limited =
        RobotModel { limits: MotorLimits { torque_nm: Some(0.05), ..MotorLimits::default() }, ..robot() };
    let controller = BalanceController::new(ControllerKind::Lqr, &limited, gain()).unwrap();
    assert_eq!(controller.step(&measurement(), &HERE)[1], 0.05);
    let mut fallen = measurement();
    fallen.state.pitch_rad = -1.0;
    assert_eq!(controller.step(&fallen, &HERE), [-0.05, -0.05]);
    for broken in [-1.0, f64::NAN] {
        let off = BalanceController { torque_limit_nm: broken, ..controller.clone() };
        assert_eq!(off.step(&fallen, &HERE).map(f64::abs), [0.0, 0.0]);
    }
}

#[test]
fn flqr_without_friction_and_gains_that_are_no_numbers_are_refused() {
    let smooth = RobotModel { friction: [None; 2], ..robot() };
    let refused = BalanceController::new(ControllerKind::Flqr, &smooth, gain()).unwrap_err();
    assert_eq!(refused, ControlError::NoFriction);
    let mut broken = gain();
    broken[(1, 2)] = f64::NAN;
    let refused = BalanceController::new(ControllerKind::Lqr, &robot(), broken).unwrap_err();
    assert_eq!(refused.to_string(), "gain of motor right, state pitch is NaN: it must be a finite number");
}

#[test]
fn tracking_asks_for_what_is_missing_to_the_reference() {
    let controller = BalanceController::new(ControllerKind::Lqr, &robot(), gain()).unwrap();
    let measured = measurement();
    let there = Reference { state: measured.state, yaw_rad: measured.yaw_rad };
    assert_eq!(controller.step(&measured, &there), [0.0, 0.0]);
    let mut ahead = there;
    ahead.state.x_m += 0.2;
    let found = controller.step(&measured, &ahead);
    assert!((found[0] + 0.2).abs() < 1e-15 && (found[1] + 0.3).abs() < 1e-15, "{found:?}");
}

#[test]
fn odometry_takes_the_way_from_the_mean_and_the_heading_from_the_difference() {
    let odometry = Odometry { wheel_radius_m: 0.25, track_width_m: 0.5 };
    let readings = Readings {
        motor_angle_rad: [1.0, 3.0],
        motor_speed_rad_s: [-4.0, 2.0],
        pitch_rad: 0.5,
        pitch_rate_rad_s: -1.0,
    };
    let found = odometry.measurement(&readings);
    let state = State { x_m: 0.625, x_dot_m_s: -0.5, pitch_rad: 0.5, pitch_rate_rad_s: -1.0 };
    assert_eq!(
        found,
        Measurement {
            state,
            motor_angle_rad: [1.0, 3.0],
            motor_speed_rad_s: [-4.0, 2.0],
            yaw_rad: 1.0,
            yaw_rate_rad_s: 3.0,
        }
    );
}

#[test]
fn yaw_hold_turns_back_at_any_speed_and_leaves_the_balance_alone() {
    let yaw_hold = Some(YawHold { stiffness_nm_rad: 2.0, damping_nm_s_rad: 0.5 });
    let chassis = Chassis { track_width_m: 0.5, ..Chassis::default() };
    let model = RobotModel { yaw_hold, chassis, ..robot() };
    let even = Matrix2x4::from_rows(&[gain().row(0).into_owned(), gain().row(0).into_owned()]);
    let controller = BalanceController::new(ControllerKind::Lqr, &model, even).unwrap();
    for (speed, yaw_rad, yaw_rate_rad_s, wanted) in
        [(0.0, 0.1, 0.0, 0.0), (20.0, 0.1, 0.0, 0.0), (-3.0, -0.2, 0.4, 0.1), (0.0, 0.0, 0.0, 0.3)]
    {
        // Angles and speeds of wheels that turn the robot so: half the track's way each.
        let apart = |turn: f64| [-1.0, 1.0].map(|side| side * 0.25 * turn / 0.1);
        let readings = Readings {
            motor_angle_rad: apart(yaw_rad),
            motor_speed_rad_s: apart(yaw_rate_rad_s).map(|motor| motor + speed),
            pitch_rad: 0.02,
            pitch_rate_rad_s: 0.1,
        };
        let measured = controller.odometry.measurement(&readings);
        let [left, right] = controller.step(&measured, &Reference { yaw_rad: wanted, ..HERE });
        let expected = 2.0 * (wanted - yaw_rad) - 0.5 * yaw_rate_rad_s;
        assert!((0.5 * (right - left) - expected).abs() < 1e-12, "{left} {right} for {expected}");
        let straight = Measurement { yaw_rad: 0.0, yaw_rate_rad_s: 0.0, ..measured };
        let mean = controller.step(&straight, &HERE)[0];
        assert!((0.5 * (right + left) - mean).abs() < 1e-12, "{left} {right} for {mean}");
    }
}

/// I ψ̈ = (track/r)(T − friction) under the default hold: critically damped at 10 rad/s, (1 + 10 t) e^{−10 t}.
#[test]
fn default_yaw_hold_brings_the_heading_back_without_swinging() {
    let model = robot();
    let (radius, track) = (model.parameters.wheel_radius_m, model.chassis.track_width_m);
    // Kinetic energy of turning: the body, and both wheels rolling half the track from the middle.
    let wheel = model.parameters.wheel_mass_kg * (0.5 * track).powi(2)
        + model.parameters.wheel_inertia_kg_m2 * (0.5 * track / radius).powi(2);
    let inertia = model.chassis.yaw_inertia_kg_m2 + 2.0 * wheel;
    let controller = BalanceController::new(ControllerKind::Lqr, &model, Matrix2x4::zeros()).unwrap();
    let (mut yaw_rad, mut yaw_rate_rad_s) = (0.1, 0.0);
    let dt = 1e-5;
    for step in 0..100_000 {
        let time = f64::from(step) * dt;
        let exact = 0.1 * (1.0 + 10.0 * time) * (-10.0 * time).exp();
        assert!((yaw_rad - exact).abs() < 1e-5, "{yaw_rad} for {exact} at {time}");
        let [left, right] =
            controller.step(&Measurement { yaw_rad, yaw_rate_rad_s, ..Measurement::default() }, &HERE);
        yaw_rate_rad_s += dt * (right - left) / radius * 0.5 * track / inertia;
        yaw_rad += dt * yaw_rate_rad_s;
    }
}

#[test]
fn a_failed_sensor_switches_the_motors_off() {
    let controller = BalanceController::new(ControllerKind::Lqr, &robot(), gain()).unwrap();
    for broken in [f64::NAN, f64::INFINITY] {
        for edit in [
            (|m, value| m.state.pitch_rad = value) as fn(&mut Measurement, f64),
            |m, value| m.yaw_rad = value,
            |m, value| m.yaw_rate_rad_s = value,
        ] {
            let mut measured = measurement();
            edit(&mut measured, broken);
            assert_eq!(controller.step(&measured, &HERE), [0.0, 0.0]);
        }
    }
}

fn legged() -> RobotModel {
    let table = |name, value: fn(&(f64, f64, f64)) -> f64| {
        let node = |row: &(f64, f64, f64)| HeightNode { leg_height_m: row.0, value: value(row) };
        OverHeight::new(name, LEGS.iter().map(node).collect()).unwrap()
    };
    let legs = Legs {
        leg_height_m: 0.32,
        com_height_m: table("com_height_m", |row| row.1),
        body_inertia_kg_m2: Some(table("body_inertia_kg_m2", |row| row.2)),
    };
    let weights = Some(Weights::diagonal([1.0, 0.01, 0.01, 0.001], [1.25; 2]));
    let model = RobotModel { legs: Some(legs), weights, ..robot() };
    model.at_leg_height(0.32).unwrap()
}

/// Between nodes the schedule is off by less than the square of their distance says, and less with more.
#[test]
fn schedule_is_near_the_exact_design_at_every_height() {
    let model = legged();
    let worst = |nodes: usize| {
        let schedule = GainSchedule::design(&model, nodes).unwrap();
        (0..=200).fold(0.0_f64, |worst, step| {
            let height = 0.32 + 0.1 * f64::from(step) / 200.0;
            let raised = model.at_leg_height(height.min(0.42)).unwrap();
            let exact = design(&raised.parameters.linear_model(), &model.weights.unwrap()).unwrap().gain;
            worst.max((schedule.at(height) - exact).amax() / exact.amax())
        })
    };
    let errors = [2, 3, 5, 11, 21].map(worst);
    for (found, bound) in errors.into_iter().zip([2e-2, 5e-3, 2e-3, 4e-4, 1e-4]) {
        assert!(found < bound, "{errors:?}");
    }
}

#[test]
fn schedule_is_exact_at_its_nodes_and_ends_at_its_ends() {
    let schedule = GainSchedule::design(&legged(), 3).unwrap();
    for (height, node) in [(0.1, 0), (0.32, 0), (0.37, 1), (0.42, 2), (9.0, 2)] {
        assert!((schedule.at(height) - schedule.nodes()[node].gain).amax() < 1e-12, "{height}");
    }
    let refused = |robot: &RobotModel, nodes| GainSchedule::design(robot, nodes).unwrap_err();
    assert_eq!(refused(&robot(), 3), ScheduleError::NoLegs);
    assert_eq!(refused(&RobotModel { weights: None, ..legged() }, 3), ScheduleError::NoWeights);
    assert_eq!(refused(&legged(), 1), ScheduleError::Nodes { nodes: 1 });
}

/// A free wheel of 0.0025 kg m² with Coulomb friction of 0.03 N m; torque acts at once.
fn spin(pi: &SpeedPi, target: impl Fn(f64) -> f64, seconds: f64) -> (f64, f64) {
    let (mut state, mut speed, mut highest) = (SpeedPiState::default(), 0.0_f64, 0.0_f64);
    for tick in 0..(seconds / 0.001) as u32 {
        let torque = pi.step(&mut state, target(f64::from(tick) * 0.001), speed, 0.001);
        let friction = 0.03 * if speed == 0.0 { torque.signum() } else { speed.signum() };
        let moved = speed + 0.001 * (torque - friction) / 0.0025;
        speed = if speed == 0.0 && torque.abs() < 0.03 { 0.0 } else { moved };
        highest = highest.max(speed);
    }
    (speed, highest)
}

#[test]
fn speed_control_reaches_its_target_and_feeds_friction_forward() {
    let plain = SpeedPi {
        proportional_nm_s_rad: 0.05,
        integral_nm_rad: 0.05,
        feedforward: None,
        torque_limit_nm: 2.42,
    };
    let curve = Stribeck::new(StribeckParameters {
        coulomb_nm: 0.03,
        static_nm: 0.03,
        viscous_nm_s_rad: 0.0,
        stribeck_speed_rad_s: 1.0,
        stribeck_exponent: 1.0,
        offset_nm: 0.0,
    })
    .unwrap();
    let compensation = Compensation { ratio: 1.0, smoothing_speed_rad_s: 0.01 };
    let fed = SpeedPi { feedforward: Some(Feedforward::new(curve, compensation).unwrap()), ..plain };
    let speed = |pi: &SpeedPi, seconds| spin(pi, |_| 5.0, seconds).0;
    // kp alone ends 0.03/0.05 = 0.6 rad/s short, which the integral makes up for within seconds and the
    // feedforward at once: 5 (1 − e⁻⁴) = 4.9.
    assert!(speed(&plain, 0.2) < 4.6 && (speed(&plain, 10.0) - 5.0).abs() < 1e-3);
    assert!(speed(&fed, 0.2) > 4.9 && (speed(&fed, 10.0) - 5.0).abs() < 1e-3);
}

#[test]
fn speed_control_does_not_wind_up_at_its_limit() {
    let pi = SpeedPi {
        proportional_nm_s_rad: 0.01,
        integral_nm_rad: 0.5,
        feedforward: None,
        torque_limit_nm: 0.04,
    };
    // The limit accelerates by 4 rad/s² only; with all of the error in the integral it would overshoot by far.
    let (end, highest) = spin(&pi, |_| 20.0, 30.0);
    assert!(highest < 21.0 && (end - 20.0).abs() < 0.5, "{end} {highest}");
    let mut state = SpeedPiState { integral_rad: 0.01 };
    for (target, measured) in [(f64::NAN, 0.0), (1.0, f64::INFINITY)] {
        assert_eq!(pi.step(&mut state, target, measured, 0.001), 0.0);
    }
    assert_eq!(state.integral_rad, 0.01);
}
