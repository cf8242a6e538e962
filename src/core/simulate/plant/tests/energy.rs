//! Energy: kept without friction and torque, and changed by just the work of what acts.

use super::*;

#[test]
fn without_friction_and_torque_energy_is_kept_wherever_the_robot_is() {
    let payload = Payload { mass_kg: 2.0, height_m: 0.25, forward_m: 0.06 };
    let tether = Tether { stiffness_n_m: 40.0, anchor_m: -0.3, slack_m: 0.2, height_m: 0.1 };
    let all = Surroundings { payload: Some(payload), tether: Some(tether), ..sloped(-0.05) };
    let level = [Ground::flat(), Ground::flat()];
    let step =
        [Ground::step(0.05, 0.012, ROBOT.wheel_radius_m), Ground::step(-0.1, -0.01, ROBOT.wheel_radius_m)];
    for (name, surroundings, grounds) in [
        ("level", Surroundings::default(), &level),
        ("slope", sloped(0.1), &level),
        ("payload", Surroundings { payload: Some(payload), ..Surroundings::default() }, &level),
        ("tether", Surroundings { tether: Some(tether), ..Surroundings::default() }, &level),
        ("bridge", Surroundings::default(), &single_sided()),
        ("steps", Surroundings::default(), &step),
        ("all", all, &single_sided()),
    ] {
        let robot = surrounded(surroundings);
        let mut plant = Plant::on_ground(&robot, grounds, &State { x_dot_m_s: 0.3, ..pitched(0.3) });
        // Spun up, so that every term with yaw takes part.
        plant.advance(&torque(-2.0, 2.0), 0.2, 2000);
        let energy = plant.energy_j();
        let (mut fastest, mut highest): (f64, f64) = (0.0, 0.0);
        for _ in 0..10_000 {
            plant.advance(&torque(0.0, 0.0), 1e-3, 10);
            let change = (plant.energy_j() / energy - 1.0).abs();
            assert!(change < 1e-6, "{name}: {change} of {energy} J");
            let pose = plant.pose();
            fastest = fastest.max(pose.yaw_rate_rad_s.abs());
            highest = highest.max(pose.ground_height_m[1].abs());
        }
        assert!(fastest > 3.0, "{name}: {fastest} rad/s");
        assert_eq!(highest > 0.005, !matches!(name, "level" | "payload" | "tether"), "{name}: {highest} m");
    }
}

#[test]
fn energy_changes_by_the_work_of_motors_push_and_friction() {
    let friction = table_4();
    let mut plant = Plant::on_ground(&with_friction(friction), &single_sided(), &pitched(0.02));
    let (push_n, push_height_m) = (6.0, 0.2);
    let start = plant.energy_j();
    let (mut work, mut lost, mut held) = (0.0, 0.0, 0);
    for tick in 0..2000 {
        let nm = feedback(&plant.state(), tick);
        let forcing = Forcing { push_n, push_height_m, ..torque(nm - 0.1, nm + 0.1) };
        for _ in 0..20 {
            let powers = |plant: &Plant| {
                let speed = plant.motor_speed_rad_s();
                let friction = [0, 1].map(|i: usize| friction[i].unwrap().torque_nm(speed[i]) * speed[i]);
                let state = plant.state();
                // The push acts along the path, which the bridge tilts.
                let lean = state.pitch_rad + plant.laws.tilt(&plant.motion).0.asin();
                let push = push_n * (state.x_dot_m_s + push_height_m * lean.cos() * state.pitch_rate_rad_s);
                let motors = forcing.torque_nm[0] * speed[0] + forcing.torque_nm[1] * speed[1];
                (motors + push, friction[0] + friction[1])
            };
            let before = powers(&plant);
            plant.advance(&forcing, 5e-5, 1);
            let after = powers(&plant);
            work += 0.5 * 5e-5 * (before.0 + after.0);
            lost += 0.5 * 5e-5 * (before.1 + after.1);
        }
        held += usize::from(plant.stuck() != [false; 2]);
    }
    let change = plant.energy_j() - start;
    assert!(held > 5 && lost > 0.05, "{held} ticks held, {lost} J lost");
    assert!(
        (change - work + lost).abs() < 1e-6 * work.abs().max(1.0),
        "{change} J of {work} J less {lost} J"
    );
}
