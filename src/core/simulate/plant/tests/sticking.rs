//! Friction that holds: to the last bit within its range, and not beyond.

use super::*;

/// f_p − f_s and f_p + f_s of both motors of Table 4.
const RANGES: [[f64; 2]; 2] = [[-0.0016 - 0.0761, -0.0016 + 0.0761], [0.0014 - 0.0617, 0.0014 + 0.0617]];

#[test]
fn rest_is_kept_to_the_last_bit_inside_both_ranges() {
    let inside = 1.0 - 1e-9;
    let [[low_left, high_left], [low_right, high_right]] = RANGES;
    for (left, right) in [
        (0.0, 0.0),
        (inside * low_left, inside * high_right),
        (inside * high_left, inside * low_right),
        (inside * high_left, inside * high_right),
        (inside * low_left, inside * low_right),
        (0.03, -0.05),
    ] {
        let start = State { x_m: 0.123, ..State::default() };
        let mut plant = Plant::new(&with_friction(table_4()), &start);
        let angles = plant.motor_angle_rad();
        for _ in 0..10_000 {
            plant.advance(&torque(left, right), 1e-3, 10);
        }
        assert_eq!(plant.stuck(), [true; 2], "{left} {right} N m");
        assert_eq!(plant.motor_angle_rad(), angles, "{left} {right} N m");
        assert_eq!(plant.pose(), Pose { state: start, ..Pose::default() }, "{left} {right} N m");
    }
}

#[test]
fn just_outside_of_its_range_one_motor_breaks_away_alone() {
    for motor in 0..2 {
        for end in RANGES[motor] {
            let mut nm = [0.0; 2];
            nm[motor] = end * (1.0 + 1e-9);
            let mut plant = Plant::new(&with_friction(table_4()), &State::default());
            plant.advance(&torque(nm[0], nm[1]), 1e-3, 10);
            let speed = plant.motor_speed_rad_s();
            assert_eq!(plant.stuck(), [motor != 0, motor != 1], "{nm:?} N m");
            assert_eq!(speed[motor].signum(), end.signum(), "{nm:?} N m");
            assert_eq!(speed[1 - motor], 0.0, "{nm:?} N m");
            // The right wheel forward or the left backward turns to the left.
            let to_left = if motor == 1 { end } else { -end };
            assert_eq!(plant.pose().yaw_rate_rad_s.signum(), to_left.signum(), "{nm:?} N m");
        }
    }
}

/// At the pitch at which its weight balances the slope, a robot without torque stays where it is as long as
/// friction bears r (M + 2m) g sin α: up to 0.0144 rad with Table 4.
#[test]
fn robot_on_a_slope_does_not_creep() {
    let slope: f64 = 0.01;
    let mass = ROBOT.body_mass_kg + 2.0 * ROBOT.wheel_mass_kg;
    let lever = ROBOT.wheel_radius_m * mass * slope.sin() / (ROBOT.body_mass_kg * ROBOT.com_height_m);
    let start = pitched(lever.asin());
    let robot = RobotModel { friction: table_4(), ..surrounded(sloped(slope)) };
    let mut plant = Plant::new(&robot, &start);
    let angles = plant.motor_angle_rad();
    for _ in 0..2000 {
        plant.advance(&torque(0.0, 0.0), 1e-3, 10);
        assert_eq!(plant.motor_angle_rad(), angles);
        // The balance itself is unstable: rounding grows.
        let pitch = plant.state().pitch_rad;
        assert!((pitch - start.pitch_rad).abs() < 1e-9 && plant.state().x_m.abs() < 1e-9, "{pitch} rad");
    }
    // On a slope too steep for friction the shafts let go at once.
    let steep = RobotModel { friction: table_4(), ..surrounded(sloped(0.05)) };
    let mut plant = Plant::new(&steep, &pitched((lever * 0.05_f64.sin() / slope.sin()).asin()));
    plant.advance(&torque(0.0, 0.0), 1e-3, 10);
    assert_eq!(plant.stuck(), [false; 2]);
    assert!(plant.state().x_dot_m_s < 0.0);
}

#[test]
fn unequal_friction_turns_the_robot() {
    let turned = |friction| {
        let mut plant = Plant::new(&with_friction(friction), &State::default());
        for _ in 0..1000 {
            let state = plant.state();
            let nm = 0.6 * (state.x_dot_m_s - 0.3) + 8.5 * state.pitch_rad + state.pitch_rate_rad_s;
            plant.advance(&torque(nm, nm), 1e-3, 10);
        }
        plant.pose().yaw_rad
    };
    let [left, right] = table_4();
    let [one, other] = [turned([left, right]), turned([right, left])];
    // Beyond a few rad/s the left motor of Table 4 brakes less: its wheel leads, the robot turns right.
    assert!(one < -0.002 && (one + other).abs() < 1e-9, "{one} {other} rad");
    assert_eq!(turned([left, left]), 0.0);
}
