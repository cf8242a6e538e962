use nalgebra::{Matrix2, Vector2};

use super::*;
use crate::friction::StribeckParameters;
use crate::model::Coefficients;

const ROBOT: RobotParameters = RobotParameters {
    body_mass_kg: 12.6,
    wheel_mass_kg: 1.2,
    wheel_inertia_kg_m2: 0.0025,
    wheel_radius_m: 0.065,
    com_height_m: 0.12,
    body_inertia_kg_m2: 0.12,
    gravity_m_s2: 9.81,
};

/// Table 4: sum of f_s is 0.1378 N m, sum of f_p is −0.0002 N m.
fn table_4() -> [Option<Stribeck>; 2] {
    let motor = |coulomb_nm, static_nm, viscous_nm_s_rad, speed, stribeck_exponent, offset_nm| {
        let stribeck_speed_rad_s = speed;
        Stribeck::new(StribeckParameters {
            coulomb_nm,
            static_nm,
            viscous_nm_s_rad,
            stribeck_speed_rad_s,
            stribeck_exponent,
            offset_nm,
        })
        .ok()
    };
    [
        motor(0.0338, 0.0761, 4.9e-4, 1.612, 0.2310, -0.0016),
        motor(0.0406, 0.0617, 4.3e-4, 2.253, 0.2772, 0.0014),
    ]
}

fn torque(sum_nm: f64) -> Forcing {
    Forcing { torque_nm: [0.5 * sum_nm; 2], ..Forcing::default() }
}

fn pitched(pitch_rad: f64) -> State {
    State { pitch_rad, ..State::default() }
}

#[test]
fn without_friction_and_torque_energy_is_kept() {
    // Far enough to swing through below the axle: every term of Eqs. 4 and 5 takes part.
    let mut plant = PlanarPlant::new(&ROBOT, [None; 2], &pitched(0.3));
    let energy = ROBOT.energy_j(&plant.state());
    let mut fastest: f64 = 0.0;
    for _ in 0..10_000 {
        plant.advance(&torque(0.0), 1e-3, 10);
        let change = (ROBOT.energy_j(&plant.state()) / energy - 1.0).abs();
        assert!(change < 1e-6, "{change}");
        fastest = fastest.max(plant.state().pitch_rate_rad_s.abs());
    }
    assert!(fastest > 5.0, "{fastest} rad/s");
}

#[test]
fn push_does_the_work_of_its_force_along_its_path() {
    let mut plant = PlanarPlant::new(&ROBOT, [None; 2], &pitched(0.1));
    let forcing = Forcing { push_n: 7.0, push_height_m: 0.2, ..Forcing::default() };
    let power =
        |state: &State| 7.0 * (state.x_dot_m_s + 0.2 * state.pitch_rad.cos() * state.pitch_rate_rad_s);
    let energy = ROBOT.energy_j(&plant.state());
    let mut work = 0.0;
    for _ in 0..3000 {
        let before = power(&plant.state());
        plant.advance(&forcing, 1e-4, 1);
        work += 0.5e-4 * (before + power(&plant.state()));
    }
    let change = ROBOT.energy_j(&plant.state()) - energy;
    assert!((change / work - 1.0).abs() < 1e-6, "{change} J for {work} J");
}

#[test]
fn small_angles_follow_the_exact_solution_of_the_linear_model() {
    let model = ROBOT.linear_model();
    let (start, torque_nm, seconds) = (pitched(1e-5), 2e-5, 0.3);
    let mut plant = PlanarPlant::new(&ROBOT, [None; 2], &start);
    for _ in 0..300 {
        plant.advance(&torque(torque_nm), 1e-3, 10);
    }
    // [X; u] with u constant: the exponential of the model with one more row and column.
    let mut augmented = nalgebra::Matrix5::zeros();
    augmented.fixed_view_mut::<4, 4>(0, 0).copy_from(&(model.a * seconds));
    augmented.fixed_view_mut::<4, 1>(0, 4).copy_from(&(model.b.column(0) * seconds));
    let x0 = start.to_vector();
    let exact = augmented.exp() * nalgebra::Vector5::new(x0[0], x0[1], x0[2], x0[3], torque_nm);
    let found = plant.state().to_vector();
    for row in 0..4 {
        assert!((found[row] / exact[row] - 1.0).abs() < 1e-8, "row {row}: {} {}", found[row], exact[row]);
    }
}

#[test]
fn rest_is_kept_to_the_last_bit_inside_the_range_and_left_just_outside() {
    let [low, high] = [-0.1378 - 0.0002, 0.1378 - 0.0002];
    let state = State { x_m: 0.123, ..State::default() };
    for inside in [low * (1.0 - 1e-9), 0.7 * low, 0.0, 0.9 * high, high * (1.0 - 1e-9)] {
        let mut plant = PlanarPlant::new(&ROBOT, table_4(), &state);
        let angle = plant.motor_angle_rad();
        for _ in 0..10_000 {
            plant.advance(&torque(inside), 1e-3, 10);
        }
        assert!(plant.stuck(), "{inside} N m");
        assert_eq!(plant.motor_angle_rad(), angle, "{inside} N m");
        assert_eq!(plant.state().pitch_rad, 0.0, "{inside} N m");
    }
    for outside in [low * (1.0 + 1e-9), high * (1.0 + 1e-9), 2.0 * high] {
        let mut plant = PlanarPlant::new(&ROBOT, table_4(), &state);
        plant.advance(&torque(outside), 1e-3, 10);
        assert!(!plant.stuck(), "{outside} N m");
        assert_eq!(plant.motor_speed_rad_s().signum(), outside.signum());
    }
}

#[test]
fn torque_ramp_breaks_away_at_the_first_step_beyond_the_range() {
    let mut plant = PlanarPlant::new(&ROBOT, table_4(), &State::default());
    let moved = (0..).find(|&tick| {
        plant.advance(&torque(f64::from(tick) * 1e-4), 1e-3, 10);
        plant.motor_speed_rad_s() != 0.0
    });
    // Σ(f_p + f_s) = 0.1376 N m; at 0.1376 itself friction still holds, up to rounding.
    assert!(matches!(moved, Some(1376 | 1377)), "{moved:?}");
}

/// Locked wheels leave one degree of freedom: (c₁ r + 2c₂ + c₃) θ̈ = c₄ θ, so θ = θ₀ cosh λt; the shaft
/// needs (c₁ r + c₂) θ̈, which friction holds until it reaches Σ(f_s − f_p).
#[test]
fn stuck_robot_tips_rigidly_and_breaks_away_when_theory_says() {
    let Coefficients { c1, c2, c3, c4, .. } = ROBOT.coefficients();
    let locked_inertia = c1 * ROBOT.wheel_radius_m + 2.0 * c2 + c3;
    let rate = (c4 / locked_inertia).sqrt();
    let start = 1e-4;
    let holding_per_rad = (c1 * ROBOT.wheel_radius_m + c2) * c4 / locked_inertia;
    let break_pitch = (0.1378 + 0.0002) / holding_per_rad;
    let break_s = (break_pitch / start).acosh() / rate;
    let mut plant = PlanarPlant::new(&ROBOT, table_4(), &pitched(start));
    let angle = plant.motor_angle_rad();
    let last_stuck = (break_s / 1e-3).floor() as usize;
    for tick in 1..=last_stuck {
        plant.advance(&torque(0.0), 1e-3, 10);
        assert!(plant.stuck() && plant.motor_angle_rad() == angle, "tick {tick}");
        let theory = start * (rate * 1e-3 * tick as f64).cosh();
        // sin θ ≠ θ costs θ²/6.
        assert!((plant.state().pitch_rad / theory - 1.0).abs() < 1e-4, "tick {tick}");
    }
    plant.advance(&torque(0.0), 1e-3, 10);
    plant.advance(&torque(0.0), 1e-3, 10);
    // The body falls forward and drags the shafts backward relative to itself.
    assert!(!plant.stuck() && plant.motor_speed_rad_s() < 0.0);
}

/// A robot that is driven back and forth through many stops, by `step`, for 3 s; states every 0.1 s.
fn driven(mut step: impl FnMut(f64) -> State) -> Vec<State> {
    let mut states = vec![pitched(0.02)];
    let mut state = states[0];
    for tick in 0..3000 {
        let t = f64::from(tick) * 1e-3;
        let feedback =
            1.3 * state.x_m + 2.2 * state.x_dot_m_s + 17.0 * state.pitch_rad + 2.0 * state.pitch_rate_rad_s;
        state = step(feedback + 0.25 * (9.0 * t).sin());
        if tick % 100 == 99 {
            states.push(state);
        }
    }
    states
}

fn driven_plant(substeps: u32) -> (Vec<State>, usize) {
    let mut plant = PlanarPlant::new(&ROBOT, table_4(), &pitched(0.02));
    let mut stops = 0;
    let states = driven(|torque_nm| {
        let before = plant.stuck();
        plant.advance(&torque(torque_nm), 1e-3, substeps);
        stops += usize::from(plant.stuck() && !before);
        plant.state()
    });
    (states, stops)
}

fn largest_difference(one: &[State], other: &[State]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a.to_vector() - b.to_vector()).amax()).fold(0.0, f64::max)
}

#[test]
fn step_sizes_agree_through_stops_and_starts() {
    let (coarse, stops) = driven_plant(4);
    assert!(stops > 5, "{stops} stops");
    let difference = largest_difference(&coarse, &driven_plant(16).0);
    assert!(difference < 5e-6, "{difference}");
}

/// Another method for the same robot: Lagrange's mass matrix in q and θ with semi-implicit steps of
/// 2 µs, in which the friction impulse is the one that stops the shafts, cut to what friction can give.
#[test]
fn a_time_stepping_scheme_agrees_through_stops_and_starts() {
    let Coefficients { c1, c2, c3, c4, .. } = ROBOT.coefficients();
    let c1r = c1 * ROBOT.wheel_radius_m;
    let friction = table_4();
    let dt = 2e-6;
    let (mut place, mut speed) = (Vector2::new(-0.02, 0.02), Vector2::zeros());
    let other = driven(|torque_nm| {
        for _ in 0..500 {
            let (sin, cos) = f64::sin_cos(place[1]);
            let mass = Matrix2::new(c1r, c1r + c2 * cos, c1r + c2 * cos, c1r + 2.0 * c2 * cos + c3);
            let spin = c2 * speed[1] * speed[1] * sin;
            let force = Vector2::new(torque_nm + spin, c4 * sin + spin);
            let inverse = mass.try_inverse().unwrap();
            let free = speed + inverse * force * dt;
            let curves = || friction.iter().flatten();
            let level: f64 = curves().map(|curve| curve.amplitude_nm(speed[0])).sum();
            let offset: f64 =
                curves().map(|c| c.torque_nm(0.0) + c.parameters().viscous_nm_s_rad * speed[0]).sum();
            let stopping = free[0] / (inverse[(0, 0)] * dt);
            let torque = stopping.clamp(offset - level, offset + level);
            speed = free - inverse.column(0) * torque * dt;
            place += speed * dt;
        }
        let r = ROBOT.wheel_radius_m;
        State {
            x_m: r * (place[0] + place[1]),
            x_dot_m_s: r * (speed[0] + speed[1]),
            pitch_rad: place[1],
            pitch_rate_rad_s: speed[1],
        }
    });
    let difference = largest_difference(&driven_plant(4).0, &other);
    assert!(difference < 1e-5, "{difference}");
}

#[test]
fn every_instruction_set_gives_the_same_bytes() {
    let path = |arch: pulp::Arch| {
        let mut plant = PlanarPlant::new(&ROBOT, table_4(), &pitched(0.02));
        driven(|torque_nm| {
            plant.advance_on(arch, &torque(torque_nm), 1e-3, 10);
            plant.state()
        })
    };
    assert_eq!(path(pulp::Arch::Scalar), path(pulp::Arch::new()));
}

/// Far beyond the reach of the series around one angle.
#[test]
fn fast_turns_keep_their_energy() {
    let start = State { pitch_rate_rad_s: 30.0, ..State::default() };
    let mut plant = PlanarPlant::new(&ROBOT, [None; 2], &start);
    let energy = ROBOT.energy_j(&plant.state());
    for _ in 0..3000 {
        plant.advance(&torque(0.0), 1e-3, 10);
    }
    assert!(plant.state().pitch_rad > 30.0);
    let change = (ROBOT.energy_j(&plant.state()) / energy - 1.0).abs();
    assert!(change < 1e-6, "{change}");
}
