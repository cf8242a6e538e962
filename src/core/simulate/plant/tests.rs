use super::*;
use crate::friction::{Stribeck, StribeckParameters};
use crate::robot::RobotParameters;
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

/// The robot on level ground with nothing around it.
fn plain(friction: [Option<Stribeck>; 2], start: &State) -> Plant {
    Plant::new(&RobotModel { friction, ..RobotModel::new(ROBOT) }, start)
}

fn motor(parameters: [f64; 6]) -> Option<Stribeck> {
    let [coulomb_nm, static_nm, viscous_nm_s_rad, stribeck_speed_rad_s, stribeck_exponent, offset_nm] =
        parameters;
    Stribeck::new(StribeckParameters {
        coulomb_nm,
        static_nm,
        viscous_nm_s_rad,
        stribeck_speed_rad_s,
        stribeck_exponent,
        offset_nm,
    })
    .ok()
}

const LEFT: [f64; 6] = [0.0338, 0.0761, 4.9e-4, 1.612, 0.2310, -0.0016];
const RIGHT: [f64; 6] = [0.0406, 0.0617, 4.3e-4, 2.253, 0.2772, 0.0014];

fn table_4() -> [Option<Stribeck>; 2] {
    [motor(LEFT), motor(RIGHT)]
}

fn torque(left: f64, right: f64) -> Forcing {
    Forcing { torque_nm: [left, right], ..Forcing::default() }
}

fn pitched(pitch_rad: f64) -> State {
    State { pitch_rad, ..State::default() }
}

#[test]
fn without_friction_and_torque_energy_is_kept_while_spinning() {
    let mut plant = plain([None; 2], &pitched(0.3));
    plant.advance(&torque(-2.0, 2.0), 0.2, 2000);
    let energy = plant.energy_j();
    let mut fastest: f64 = 0.0;
    for _ in 0..10_000 {
        plant.advance(&torque(0.0, 0.0), 1e-3, 10);
        let change = (plant.energy_j() / energy - 1.0).abs();
        assert!(change < 1e-6, "{change}");
        fastest = fastest.max(plant.pose().yaw_rate_rad_s.abs());
    }
    assert!(fastest > 3.0, "{fastest} rad/s");
}

/// Feedback that keeps the robot up while it is driven through many stops.
fn feedback(state: &State, tick: i32) -> f64 {
    let drive = 0.25 * (9e-3 * f64::from(tick)).sin();
    0.65 * state.x_m + 1.1 * state.x_dot_m_s + 8.5 * state.pitch_rad + state.pitch_rate_rad_s + 0.5 * drive
}

#[test]
fn equal_motors_without_yaw_move_as_the_planar_robot() {
    for friction in [None, motor(LEFT)] {
        let start = State { x_dot_m_s: 0.1, ..pitched(0.05) };
        let mut whole = plain([friction; 2], &start);
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
fn unequal_friction_turns_the_robot() {
    let mut plant = plain(table_4(), &pitched(0.0));
    for _ in 0..1000 {
        let state = plant.state();
        let nm = 0.6 * (state.x_dot_m_s - 0.3) + 8.5 * state.pitch_rad + state.pitch_rate_rad_s;
        plant.advance(&torque(nm, nm), 1e-3, 10);
    }
    // Beyond a few rad/s the left motor of Table 4 brakes less: its wheel leads, the robot turns right.
    assert!(plant.pose().yaw_rad < -0.002, "{:?}", plant.pose());
}
