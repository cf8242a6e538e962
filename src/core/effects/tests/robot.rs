//! The robot under one effect each, against Eqs. 4 and 5 and against the same physics said otherwise.

use crate::model::{Effect, MachineKind, Motor, RobotModel, State, Surroundings, Tether};
use crate::model_file::presets;
use crate::simulate::{Forcing, Plant, Simulation, SimulationSettings};

fn robot() -> RobotModel {
    let paper = presets::paper();
    RobotModel { friction: [None; 2], ..RobotModel::new(paper.robot().unwrap().parameters) }
}

fn with(robot: RobotModel, id: &str, parameters: &[(&str, f64)]) -> RobotModel {
    let effect = Effect::new(id, MachineKind::Robot, None, parameters.iter().copied()).unwrap();
    RobotModel { effects: vec![effect], ..robot }.with_effects_declared()
}

const START: State = State { x_m: 0.3, x_dot_m_s: 0.8, pitch_rad: 0.12, pitch_rate_rad_s: -0.4 };
const TORQUE: [f64; 2] = [0.31, 0.31];

fn moved(robot: &RobotModel, start: &State, seconds: f64) -> State {
    let mut plant = Plant::new(robot, start);
    let forcing = Forcing { torque_nm: TORQUE, ..Forcing::default() };
    for _ in 0..(seconds * 1e3).round() as u32 {
        plant.advance(&forcing, 1e-3, 4);
    }
    plant.state()
}

/// Largest difference of two states in SI units.
fn difference(a: &State, b: &State) -> f64 {
    (a.to_vector() - b.to_vector()).amax()
}

#[test]
fn accelerations_are_those_of_the_equations_with_the_effect_on_their_right_sides() {
    let p = robot().parameters;
    let (m, l, r, g) = (p.body_mass_kg, p.com_height_m, p.wheel_radius_m, p.gravity_m_s2);
    let weight = (m + 2.0 * p.wheel_mass_kg) * g;
    let State { x_m: x, x_dot_m_s: v, pitch_rad: pitch, pitch_rate_rad_s: rate } = START;
    let cos = pitch.cos();
    let motor_angle = x / r - pitch;
    let motor_speed = v / r - rate;
    // Torque in each motor, force at the axle, torque on the body.
    for (id, parameters, motor, axle, body) in [
        ("tether_spring", vec![("stiffness_n_m", 12.0), ("pull_n", 0.6)], 0.0, -12.0 * x + 0.6, 0.0),
        ("ground_slope", vec![("slope_rad", 0.03)], 0.0, -weight * 0.03, 0.0),
        ("aero_drag", vec![("drag_n_s2_m2", 2.0)], 0.0, -2.0 * v * v, 0.0),
        (
            "aero_drag",
            vec![("drag_n_s2_m2", 2.0), ("height_m", 0.2)],
            0.0,
            -2.0 * v * v,
            -2.0 * v * v * 0.2 * cos,
        ),
        ("rolling_resistance", vec![("coefficient", 0.02)], 0.0, -0.02 * weight, 0.0),
        (
            "wheel_eccentricity",
            vec![("cos_m", 1e-3), ("sin_m", 0.0)],
            0.0,
            weight / r * 1e-3 * (x / r).cos(),
            0.0,
        ),
        ("pitch_offset", vec![("angle_rad", 0.02)], 0.0, 0.0, m * g * l * 0.02 * cos),
        (
            "external_push",
            vec![("start_s", 0.0), ("duration_s", 1.0), ("force_n", 3.0), ("height_m", 0.1)],
            0.0,
            3.0,
            0.3 * cos,
        ),
        (
            "terrain",
            vec![("at_m", 0.5), ("width_m", 0.2), ("height_m", 0.01)],
            0.0,
            -weight * 0.01 * (-0.5_f64).exp() / 0.2,
            0.0,
        ),
        ("quadratic_drag", vec![("drag_nm_s2_rad2", 1e-3)], -1e-3 * motor_speed * motor_speed, 0.0, 0.0),
        (
            "cogging",
            vec![("order_1", 7.0), ("cos_1_nm", 0.0), ("sin_1_nm", 0.02)],
            0.02 * (7.0 * motor_angle).sin(),
            0.0,
            0.0,
        ),
        ("torque_gain", vec![("gain", 0.1)], 0.031, 0.0, 0.0),
        ("coulomb_error", vec![("coulomb_nm", 0.05)], -0.05, 0.0, 0.0),
    ] {
        let h = 1e-5;
        let mut plant = Plant::new(&with(robot(), id, &parameters), &START);
        plant.advance(&Forcing { torque_nm: TORQUE, ..Forcing::default() }, h, 1);
        let after = plant.state();
        let (x_accel, pitch_accel) = ((after.x_dot_m_s - v) / h, (after.pitch_rate_rad_s - rate) / h);
        let translating = m + 2.0 * p.wheel_mass_kg + 2.0 * p.wheel_inertia_kg_m2 / (r * r);
        let torque = TORQUE[0] + TORQUE[1];
        let translation =
            translating * x_accel + m * l * (cos * pitch_accel - pitch.sin() * rate * rate) - torque / r;
        let turning = (p.body_inertia_kg_m2 + m * l * l) * pitch_accel + m * l * cos * x_accel
            - m * g * l * pitch.sin()
            + torque;
        let (force, moment) = (2.0 * motor / r + axle, -2.0 * motor + body);
        let scale = 2e-3 * (force.abs() + moment.abs()) + 3e-3;
        assert!((translation - force).abs() < scale, "{id}: {translation} N for {force} N");
        assert!((turning - moment).abs() < scale, "{id}: {turning} N m for {moment} N m");
    }
}

#[test]
fn forces_agree_with_the_surroundings_own() {
    let tether = Tether { stiffness_n_m: 12.0, anchor_m: 0.05, slack_m: 0.0, height_m: 0.0 };
    let cabled = RobotModel {
        surroundings: Surroundings { tether: Some(tether), ..Surroundings::default() },
        ..robot()
    };
    let law = with(robot(), "tether_spring", &[("stiffness_n_m", 12.0), ("pull_n", 0.6)]);
    let far = difference(&moved(&cabled, &START, 0.5), &moved(&law, &START, 0.5));
    assert!(far < 1e-5, "{far}");
    let sloped =
        RobotModel { surroundings: Surroundings { slope_rad: 0.002, ..Surroundings::default() }, ..robot() };
    let law = with(robot(), "ground_slope", &[("slope_rad", 0.002)]);
    let level = difference(&moved(&robot(), &START, 0.5), &moved(&law, &START, 0.5));
    let far = difference(&moved(&sloped, &START, 0.5), &moved(&law, &START, 0.5));
    // The law leaves out that the path is tilted against the body.
    assert!(far < 0.1 * level, "{far} of {level}");
}

#[test]
fn errors_of_declared_numbers_are_in_the_numbers_and_their_columns_are_their_derivatives() {
    for (id, key, small) in [
        ("mass_error", "mass_kg", 1e-3),
        ("com_height_error", "height_m", 1e-5),
        ("body_inertia_error", "inertia_kg_m2", 1e-5),
        ("inertia_error", "inertia_kg_m2", 1e-7),
        ("viscous_error", "viscous_nm_s_rad", 1e-6),
    ] {
        let corrected = with(robot(), id, &[(key, small)]);
        assert!(corrected.effects.is_empty() && corrected != robot(), "{id}");
        // The law as a force on the old robot moves it as the new numbers do.
        let effect = Effect::new(id, MachineKind::Robot, None, [(key, small)]).unwrap();
        let forced = RobotModel { effects: vec![effect], ..robot() };
        let [plain, numbers, law] = [robot(), corrected, forced].map(|robot| moved(&robot, &START, 0.2));
        let (whole, wrong) = (difference(&plain, &numbers), difference(&numbers, &law));
        assert!(wrong < 0.02 * whole && whole > 0.0, "{id}: {wrong} of {whole}");
    }
}

#[test]
fn an_effect_in_one_motor_turns_the_robot() {
    let effect =
        |motor| Effect::new("torque_gain", MachineKind::Robot, Some(motor), [("gain", 0.2)]).unwrap();
    for (motor, side) in [(Motor::Left, -1.0), (Motor::Right, 1.0)] {
        let mut plant =
            Plant::new(&RobotModel { effects: vec![effect(motor)], ..robot() }, &State::default());
        for _ in 0..100 {
            plant.advance(&Forcing { torque_nm: TORQUE, ..Forcing::default() }, 1e-3, 4);
        }
        assert!(side * plant.pose().yaw_rate_rad_s > 0.01, "{motor}: {:?}", plant.pose());
    }
}

#[test]
fn slosh_keeps_its_energy_at_most() {
    // A part that is left alone swings at its own frequency, shifted by the ratio of the masses, and dies away.
    let sloshing = with(
        robot(),
        "slosh",
        &[("frequency_hz", 2.0), ("damping_ratio", 0.05), ("height_m", 0.1), ("mass_kg", 0.5)],
    );
    let pushed = State { x_dot_m_s: 0.0, ..State::default() };
    let mut plant = Plant::new(&sloshing, &pushed);
    let kick = Forcing { torque_nm: [0.05; 2], ..Forcing::default() };
    (0..20).for_each(|_| plant.advance(&kick, 1e-3, 4));
    assert!(plant.is_finite() && plant.state().pitch_rad.abs() < 0.05);
    let still = moved(
        &with(robot(), "slosh", &[("frequency_hz", 50.0), ("damping_ratio", 0.9), ("mass_kg", 0.5)]),
        &START,
        0.1,
    );
    // So stiff a spring is no spring.
    let far = difference(&still, &moved(&robot(), &START, 0.1));
    assert!(far < 0.05, "{far}");
}

#[test]
fn delays_that_are_effects_count_in_the_margins() {
    let paper = presets::paper();
    let paper = paper.robot().unwrap();
    let gain = crate::lqr::design(&paper.parameters.linear_model(), &paper.weights.unwrap()).unwrap().gain;
    let margins = |robot: &RobotModel| {
        let timing = crate::lqr::SampledLoop::of(robot);
        crate::lqr::margins(&robot.parameters.linear_model(), &gain, &timing)
    };
    let mut declared = paper.clone();
    declared.actuation.delay_s += 0.003;
    for (id, key) in [("command_delay", "delay_s"), ("actuator_lag", "time_constant_s")] {
        let effect = Effect::new(id, MachineKind::Robot, None, [(key, 0.003)]).unwrap();
        let found = RobotModel { effects: vec![effect], ..paper.clone() };
        assert!((found.torque_delay_s() - declared.actuation.delay_s).abs() < 1e-15, "{id}");
        assert_eq!(margins(&found), margins(&declared), "{id}");
        assert_ne!(margins(&found), margins(paper), "{id}");
        let left = Effect::new(id, MachineKind::Robot, Some(Motor::Left), [(key, 0.003)]).unwrap();
        let one = RobotModel { effects: vec![left], ..paper.clone() };
        assert!((one.torque_delay_s() - paper.actuation.delay_s - 0.0015).abs() < 1e-15, "{id}");
    }
}

#[test]
fn the_sensors_effects_are_in_the_readings() {
    let paper = presets::paper();
    let paper = paper.robot().unwrap();
    for (id, key, value) in [("gyro_bias", "rate_rad_s", 0.05), ("imu_delay", "delay_s", 0.004)] {
        let model = with(paper.clone(), id, &[(key, value)]);
        assert!(model.effects.is_empty(), "{id}");
        let declared = [model.sensors.gyro_bias_rad_s, model.sensors.imu_latency_s];
        assert!(declared.contains(&value), "{id}: {declared:?}");
    }
}

#[test]
fn a_balancing_robot_under_every_effect_stays_finite_and_the_same_from_seed_to_seed() {
    let paper = presets::paper();
    let paper = paper.robot().unwrap();
    let gain = crate::lqr::design(&paper.parameters.linear_model(), &paper.weights.unwrap()).unwrap().gain;
    let kind = crate::control::ControllerKind::Flqr;
    let effects: Vec<Effect> = [
        ("cogging", vec![("order_1", 14.0), ("cos_1_nm", 0.01), ("sin_1_nm", 0.0)]),
        ("torque_ripple", vec![("order_1", 7.0), ("cos_1", 0.05), ("sin_1", 0.0)]),
        ("position_dependent_friction", vec![("order_1", 2.0), ("cos_1_nm", 0.01), ("sin_1_nm", 0.0)]),
        ("low_speed_friction", vec![("speed_rad_s", 0.5), ("amplitude_nm", -0.02)]),
        ("load_dependent_friction", vec![("coefficient", 0.05)]),
        ("presliding", vec![("breakaway_displacement_rad", 0.01), ("amplitude_nm", 0.02)]),
        ("thermal_friction", vec![("time_constant_s", 60.0), ("fall_nm", 0.01)]),
        ("backlash", vec![("gap_rad", 0.002), ("rotor_inertia_kg_m2", 1e-4)]),
        ("command_delay", vec![("delay_s", 0.002)]),
        ("actuator_lag", vec![("time_constant_s", 0.002)]),
        ("torque_deadzone", vec![("width_nm", 0.005)]),
        ("structural_mode", vec![("frequency_hz", 30.0), ("damping_ratio", 0.05), ("fraction", 0.1)]),
        ("slosh", vec![("frequency_hz", 2.0), ("damping_ratio", 0.1), ("mass_kg", 0.5)]),
        ("wheel_slip", vec![("relaxation_s", 0.02), ("slip_m_s_n", 1e-3)]),
        ("aero_drag", vec![("drag_n_s2_m2", 1.0)]),
    ]
    .map(|(id, parameters)| Effect::new(id, MachineKind::Robot, None, parameters).unwrap())
    .into();
    let run = || {
        let model = RobotModel { effects: effects.clone(), ..paper.clone() };
        let controller = crate::control::BalanceController::new(kind, paper, gain).unwrap();
        let mut simulation = Simulation::new(&model, controller, SimulationSettings::default()).unwrap();
        (0..3000).map(|_| simulation.step()).collect::<Vec<_>>()
    };
    let samples = run();
    assert!(samples.iter().all(|sample| sample.pitch_rad.abs() < 0.3), "{:?}", samples.last());
    assert_eq!(samples, run());
}
