//! The whole plant against laws of nature, other methods and the planar plant.

mod energy;
mod newton;
mod standing;
mod sticking;

use super::*;
use crate::friction::{Stribeck, StribeckParameters};
use crate::model::{Payload, RobotParameters, Surroundings, Tether};
use crate::simulate::PlanarPlant;

const ROBOT: RobotParameters = RobotParameters {
    body_mass_kg: 12.6,
    wheel_mass_kg: 1.2,
    wheel_inertia_kg_m2: 0.0025,
    wheel_radius_m: 0.065,
    com_height_m: 0.12,
    body_inertia_kg_m2: 0.12,
    gravity_m_s2: 9.81,
};

/// Table 4.
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

fn with_friction(friction: [Option<Stribeck>; 2]) -> RobotModel {
    RobotModel { friction, ..RobotModel::new(ROBOT) }
}

/// The frictionless robot in surroundings.
fn surrounded(surroundings: Surroundings) -> RobotModel {
    RobotModel { surroundings, ..RobotModel::new(ROBOT) }
}

fn sloped(slope_rad: f64) -> Surroundings {
    Surroundings { slope_rad, ..Surroundings::default() }
}

/// A bridge under the right wheel only.
fn single_sided() -> [Ground; 2] {
    [Ground::flat(), Ground::bridge(0.1, 0.3, 0.4, 0.04)]
}

fn torque(left: f64, right: f64) -> Forcing {
    Forcing { torque_nm: [left, right], ..Forcing::default() }
}

fn pitched(pitch_rad: f64) -> State {
    State { pitch_rad, ..State::default() }
}

/// Torque of each motor that keeps the robot up while it is driven through many stops.
fn feedback(state: &State, tick: i32) -> f64 {
    let drive = 0.125 * (9e-3 * f64::from(tick)).sin();
    0.65 * state.x_m + 1.1 * state.x_dot_m_s + 8.5 * state.pitch_rad + state.pitch_rate_rad_s + drive
}

#[test]
fn equal_motors_without_yaw_move_as_the_planar_robot() {
    let [left, _] = table_4();
    for friction in [None, left] {
        let start = State { x_dot_m_s: 0.1, ..pitched(0.05) };
        let mut whole = Plant::new(&with_friction([friction; 2]), &start);
        let mut planar = PlanarPlant::new(&ROBOT, [friction; 2], &start);
        let mut stops = 0;
        for tick in 0..5000 {
            let before = planar.stuck();
            let push_n = if tick % 1000 < 100 { 12.0 } else { 0.0 };
            // Each under its own feedback: without, an unstable robot would amplify the last bit.
            let forcing = |state: &State| {
                let nm = feedback(state, tick);
                Forcing { push_n, push_height_m: 0.15, ..torque(nm, nm) }
            };
            whole.advance(&forcing(&whole.state()), 1e-3, 10);
            planar.advance(&forcing(&planar.state()), 1e-3, 10);
            stops += usize::from(planar.stuck() && !before);
            let difference = (whole.state().to_vector() - planar.state().to_vector()).amax();
            assert!(difference < 1e-9, "{difference} at {tick}");
            assert_eq!(whole.pose().yaw_rad, 0.0);
        }
        assert!(friction.is_none() || stops > 3, "{stops} stops");
    }
}

#[test]
fn values_that_are_not_finite_show_and_end() {
    let grounds = [[Ground::flat(), Ground::flat()], single_sided()];
    for (grounds, nm, speed) in grounds.iter().flat_map(|grounds| {
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300]
            .into_iter()
            .flat_map(move |nm| [0.0, 0.3, f64::NAN, f64::INFINITY].map(|speed| (grounds, nm, speed)))
    }) {
        let start = State { x_dot_m_s: speed, ..State::default() };
        let mut plant = Plant::on_ground(&with_friction(table_4()), grounds, &start);
        plant.advance(&torque(nm, 0.1), 1e-3, 10);
        plant.advance(&torque(0.0, 0.0), 1e-3, 10);
        assert!(!plant.is_finite(), "{nm} N m at {speed} m/s: {:?}", plant.pose());
    }
}
