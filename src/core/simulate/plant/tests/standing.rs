//! Where the robot stands: roll, heights and equilibria on slopes, bridges and under payload.

use super::*;

#[test]
fn wheel_on_the_deck_of_a_bridge_rolls_the_robot() {
    let robot = RobotModel::new(ROBOT);
    for (x_m, height) in [(0.0, 0.0), (0.25, 0.02), (0.6, 0.04), (0.95, 0.02), (2.0, 0.0)] {
        let start = State { x_m, ..pitched(0.01) };
        let [flat, bridge] = single_sided();
        let right = Plant::on_ground(&robot, &[flat.clone(), bridge.clone()], &start).pose();
        let left = Plant::on_ground(&robot, &[bridge, flat], &start).pose();
        let roll = f64::asin(height / robot.chassis.track_width_m);
        assert!((right.roll_rad - roll).abs() < 1e-12 && (left.roll_rad + roll).abs() < 1e-12, "{x_m} m");
        assert!((right.ground_height_m[1] - height).abs() < 1e-12 && right.ground_height_m[0] == 0.0);
        assert_eq!(right.state, start);
    }
}

#[test]
fn wheel_that_climbs_falls_behind() {
    let start = State { x_m: 0.15, x_dot_m_s: 0.5, ..State::default() };
    let mut plant = Plant::on_ground(&RobotModel::new(ROBOT), &single_sided(), &start);
    plant.advance(&torque(0.0, 0.0), 0.02, 200);
    let pose = plant.pose();
    assert!(pose.yaw_rate_rad_s < -0.01 && pose.state.x_dot_m_s < 0.5, "{pose:?}");
}

#[test]
fn heading_on_a_slope_turns_its_pitch_into_roll() {
    let slope = 0.2;
    let mut plant = Plant::new(&surrounded(sloped(slope)), &pitched(0.1));
    assert!((plant.state().to_vector() - pitched(0.1).to_vector()).amax() < 1e-15);
    let gear = 0.5 * 0.4 / ROBOT.wheel_radius_m;
    let start = plant.motion.angle;
    for yaw in [0.0_f64, 0.6, 1.5, 3.0, -2.0] {
        plant.motion.angle = [start[0] - gear * yaw, start[1] + gear * yaw];
        let pose = plant.pose();
        assert!((pose.yaw_rad - yaw).abs() < 1e-12);
        // Vertical in the frame of the plane, and the body's axes.
        let up = nalgebra::Vector3::new(f64::sin(slope), 0.0, f64::cos(slope));
        let (sin, cos) = yaw.sin_cos();
        let ahead = nalgebra::Vector3::new(cos, sin, 0.0);
        let axis = ahead * plant.motion.lean.sin() + nalgebra::Vector3::z() * plant.motion.lean.cos();
        let fore = ahead * plant.motion.lean.cos() - nalgebra::Vector3::z() * plant.motion.lean.sin();
        let pitch = f64::atan2(-up.dot(&fore), up.dot(&axis));
        assert!((pose.state.pitch_rad - pitch).abs() < 1e-12, "{} for {pitch}", pose.state.pitch_rad);
        // The axle points to the left; the right wheel is higher where that falls.
        let roll = -up.dot(&nalgebra::Vector3::new(-sin, cos, 0.0)).asin();
        assert!((pose.roll_rad - roll).abs() < 1e-12, "{} for {roll}", pose.roll_rad);
        let [left, right] = pose.ground_height_m;
        assert!((right - left - 0.4 * roll.sin()).abs() < 1e-12);
    }
}

#[test]
fn payload_in_front_is_balanced_by_leaning_back() {
    let payload = Payload { mass_kg: 2.0, height_m: 0.25, forward_m: 0.06 };
    let robot = surrounded(Surroundings { payload: Some(payload), ..Surroundings::default() });
    // Moments about the axle: M l sin θ + m (h sin θ + f cos θ) = 0.
    let balance = -f64::atan(2.0 * 0.06 / (12.6 * 0.12 + 2.0 * 0.25));
    let mut plant = Plant::new(&robot, &pitched(balance));
    plant.advance(&torque(0.0, 0.0), 0.2, 200);
    let moved = plant.state().to_vector() - pitched(balance).to_vector();
    assert!(moved.amax() < 1e-12, "{moved}");
    let mut upright = Plant::new(&robot, &State::default());
    upright.advance(&torque(0.0, 0.0), 0.2, 200);
    assert!(upright.state().pitch_rad > 0.01 && upright.state().x_dot_m_s < 0.0);
}

#[test]
fn tether_pulls_towards_its_anchor_beyond_its_slack() {
    let tether = Tether { stiffness_n_m: 20.0, anchor_m: 0.5, slack_m: 0.1, height_m: 0.0 };
    let robot = surrounded(Surroundings { tether: Some(tether), ..Surroundings::default() });
    for (x_m, force) in [(0.2, 4.0), (0.45, 0.0), (0.55, 0.0), (0.7, -2.0)] {
        let start = State { x_m, ..State::default() };
        let mut plant = Plant::new(&robot, &start);
        plant.advance(&torque(0.0, 0.0), 1e-4, 1);
        // From rest at the axle: ẍ = F c₃/(r d) of Eq. 8.
        let c = ROBOT.coefficients();
        let expected = force * ROBOT.wheel_radius_m * c.c3 / c.determinant * 1e-4;
        assert!((plant.state().x_dot_m_s - expected).abs() < 1e-6 * expected.abs() + 1e-15, "{x_m} m");
    }
}

#[test]
fn model_brings_its_ground_along() {
    let robot = surrounded(Surroundings { ground: single_sided(), ..Surroundings::default() });
    let start = State { x_m: 0.6, ..State::default() };
    let pose = Plant::new(&robot, &start).pose();
    assert_eq!(pose, Plant::on_ground(&RobotModel::new(ROBOT), &single_sided(), &start).pose());
    assert!((pose.ground_height_m[1] - 0.04).abs() < 1e-15);
}
