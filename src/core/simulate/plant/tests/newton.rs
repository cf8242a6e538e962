//! The same robot by other means: Newton's and Euler's laws in three dimensions, and time stepping.

use nalgebra::{Matrix3, Vector3};

use super::*;

/// Speeds of the robot on a plane, or on a path that curves without yaw.
#[derive(Clone, Copy)]
struct Moving {
    yaw: f64,
    /// From the normal of the plane, which slopes up along x.
    lean: f64,
    forward: f64,
    yaw_rate: f64,
    lean_rate: f64,
    slope: f64,
    /// Slope of the path against the plane, and its rate.
    tilt: f64,
    tilt_rate: f64,
}

/// What is left of the three laws for the accelerations of speed, yaw and lean: forces along the path,
/// moments about the axle, moments about the normal. Linear in accelerations and torques.
fn residual(at: &Moving, accel: &Vector3<f64>, shaft_nm: [f64; 2], push: (f64, f64)) -> Vector3<f64> {
    let (r, l, gravity) = (ROBOT.wheel_radius_m, ROBOT.com_height_m, ROBOT.gravity_m_s2);
    let chassis = crate::model::Chassis::default();
    let half = 0.5 * chassis.track_width_m;
    let up = Vector3::z();
    let (sin, cos) = at.yaw.sin_cos();
    let (ahead, left) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
    let path = ahead * at.tilt.cos() + up * at.tilt.sin();
    let off_path = up * at.tilt.cos() - ahead * at.tilt.sin();
    let weight = Vector3::new(-at.slope.sin(), 0.0, -at.slope.cos()) * gravity;

    // The body: a separate frame axes, its turning and the way of its centre of mass.
    let (fore, axis) =
        (ahead * at.lean.cos() - up * at.lean.sin(), ahead * at.lean.sin() + up * at.lean.cos());
    let spin = up * at.yaw_rate + left * at.lean_rate;
    let spin_rate = up * accel[1] + left * accel[2] + (up * at.yaw_rate).cross(&(left * at.lean_rate));
    let axle = path * accel[0] + left * (at.forward * at.yaw_rate) + off_path * (at.forward * at.tilt_rate);
    let centre = axis * l;
    let accelerated = axle + spin_rate.cross(&centre) + spin.cross(&spin.cross(&centre));
    let frame = Matrix3::from_columns(&[fore, left, axis]);
    let yaw_inertia = chassis.yaw_inertia_kg_m2;
    let principal = Vector3::new(yaw_inertia, ROBOT.body_inertia_kg_m2, yaw_inertia);
    let inertia = frame * Matrix3::from_diagonal(&principal) * frame.transpose();
    let turning = inertia * spin_rate + spin.cross(&(inertia * spin));
    let force = (accelerated - weight) * ROBOT.body_mass_kg - path * push.0;
    let moment = centre.cross(&((accelerated - weight) * ROBOT.body_mass_kg)) + turning
        - (axis * push.1).cross(&(path * push.0));

    // The wheels: what the ground gives each, less what it takes to move it, goes to the body.
    let passed_on = |i: usize, side: f64| {
        let wheel = accel[0] + side * half * accel[1];
        let ground = (shaft_nm[i] - ROBOT.wheel_inertia_kg_m2 * wheel / r) / r;
        ground - ROBOT.wheel_mass_kg * (wheel - weight.dot(&path))
    };
    let [to_left, to_right] = [passed_on(0, -1.0), passed_on(1, 1.0)];
    Vector3::new(
        force.dot(&path) - to_left - to_right,
        moment.dot(&left) + shaft_nm[0] + shaft_nm[1],
        moment.dot(&up) + ROBOT.wheel_inertia_kg_m2 * accel[1] - half * (to_right - to_left),
    )
}

/// Accelerations without torques, and what 1 N m on the left and on the right shaft adds.
fn solved(at: &Moving, push: (f64, f64)) -> [Vector3<f64>; 3] {
    let none = residual(at, &Vector3::zeros(), [0.0; 2], push);
    let column = |i: usize| residual(at, &Vector3::ith(i, 1.0), [0.0; 2], push) - none;
    let inverse = Matrix3::from_columns(&[column(0), column(1), column(2)]).try_inverse().unwrap();
    let torque = |nm: [f64; 2]| residual(at, &Vector3::zeros(), nm, push) - none;
    [none, torque([1.0, 0.0]), torque([0.0, 1.0])].map(|right_side| -(inverse * right_side))
}

/// Speeds or accelerations of forward, yaw and lean as those of the motors.
fn of_motors(of: &Vector3<f64>) -> [f64; 2] {
    let half = 0.5 * crate::model::Chassis::default().track_width_m;
    [-1.0, 1.0].map(|side| (of[0] + side * half * of[1]) / ROBOT.wheel_radius_m - of[2])
}

#[test]
fn accelerations_are_newtons_and_eulers() {
    let ramp = Ground::ramp(0.0, 1.0, 0.3);
    let grounds = [ramp.clone(), ramp];
    let flat = [Ground::flat(), Ground::flat()];
    for (yaw, slope, x) in [
        (0.0, 0.0, None),
        (0.7, 0.0, None),
        (-1.3, 0.12, None),
        (2.9, -0.4, None),
        (0.0, 0.0, Some(0.002)),
        (0.0, 0.0, Some(0.5)),
    ] {
        let robot = surrounded(sloped(slope));
        let grounds = if x.is_some() { &grounds } else { &flat };
        for (lean, forward, yaw_rate, lean_rate) in
            [(0.0, 0.0, 0.0, 0.0), (0.3, 0.8, 1.7, -2.0), (-1.1, -0.5, 4.0, 3.0), (2.0, 1.0, -2.5, 5.0)]
        {
            let yaw_rate = if x.is_some() { 0.0 } else { yaw_rate };
            let (push_n, push_height_m) = (5.0, 0.2);
            let mut plant =
                Plant::on_ground(&robot, grounds, &State { x_m: x.unwrap_or_default(), ..State::default() });
            let gear = 0.5 * robot.chassis.track_width_m / ROBOT.wheel_radius_m;
            // The lean moves both motors back, so that the wheels stay where they are.
            let back = lean - slope;
            let was = plant.motion.angle[0];
            plant.motion.angle = [was - back - gear * yaw, was - back + gear * yaw];
            plant.motion.lean = lean;
            plant.motion.lean_rate = lean_rate;
            plant.motion.speed = of_motors(&Vector3::new(forward, yaw_rate, lean_rate));

            let tilt_at = |moved: f64| {
                let turned = plant.motion.angle.map(|angle| angle + moved / ROBOT.wheel_radius_m);
                plant.laws.tilt(&Motion { angle: turned, ..plant.motion }).0.asin()
            };
            let tilt = tilt_at(0.0);
            let tilt_rate = forward * (tilt_at(1e-6) - tilt_at(-1e-6)) / 2e-6;
            assert_eq!(x.is_some(), tilt > 0.01, "{x:?} {tilt}");
            let at = Moving { yaw, lean, forward, yaw_rate, lean_rate, slope, tilt, tilt_rate };
            // The oracle yaws about the vertical only, not about a tilted path's normal.
            let shaft_nm = if x.is_some() { [0.7; 2] } else { [0.7, -0.4] };
            let [free, by_left, by_right] = solved(&at, (push_n, push_height_m));
            let accel = free + by_left * shaft_nm[0] + by_right * shaft_nm[1];

            let loads =
                plant.laws.loads(&Forcing { push_n, push_height_m, ..torque(0.0, 0.0) }, &plant.motion);
            let response = plant.laws.response::<true>(&loads, &plant.motion);
            let motors = response.motor_accelerations(shaft_nm);
            let expected = of_motors(&accel);
            let errors = [
                motors[0] - expected[0],
                motors[1] - expected[1],
                response.lean_acceleration(shaft_nm) - accel[2],
            ];
            // The rate of the tilt is a difference.
            let digits = if x.is_some() { 1e-9 } else { 1e-12 };
            let allowed = digits * (1.0 + accel.amax() / ROBOT.wheel_radius_m);
            assert!(errors.iter().all(|e| e.abs() < allowed), "{errors:?} at {yaw} {slope} {x:?} {lean}");
            // Both held.
            let held = response.motor_accelerations(response.holding_both());
            assert!(held.iter().all(|a| a.abs() < 1e-9), "{held:?}");
        }
    }
}

/// Torques of both motors on a robot that is driven and turned through many stops.
fn driven(state: &State, tick: i32) -> [f64; 2] {
    let turn = 0.03 * (7e-3 * f64::from(tick)).sin();
    let nm = feedback(state, tick);
    [nm - turn, nm + turn]
}

/// Steps of first order in which the impulse of friction is the one that stops a shaft, cut to what
/// friction can give, found by turns for one shaft and the other.
#[test]
fn a_time_stepping_scheme_agrees_through_stops_and_starts_of_each_wheel() {
    let dt = 5e-6;
    let friction = table_4().map(Option::unwrap);
    let mut plant = Plant::new(&with_friction(table_4()), &pitched(0.02));
    let mut place = Vector3::new(0.0, 0.0, 0.02);
    let mut speed = Vector3::zeros();
    let mut phases_seen = std::collections::BTreeMap::new();
    for tick in 0..2000 {
        let other =
            State { x_m: place[0], x_dot_m_s: speed[0], pitch_rad: place[2], pitch_rate_rad_s: speed[2] };
        let nm = driven(&other, tick);
        for _ in 0..200 {
            let at = Moving {
                yaw: place[1],
                lean: place[2],
                forward: speed[0],
                yaw_rate: speed[1],
                lean_rate: speed[2],
                slope: 0.0,
                tilt: 0.0,
                tilt_rate: 0.0,
            };
            let [free, by_left, by_right] = solved(&at, (0.0, 0.0));
            let by = [by_left, by_right];
            let motors = of_motors(&speed);
            let boxes = [0, 1].map(|i: usize| {
                let p = friction[i].parameters();
                let middle = p.offset_nm + p.viscous_nm_s_rad * motors[i];
                (middle, friction[i].amplitude_nm(motors[i]))
            });
            let mut brake = [0.0; 2];
            for _ in 0..60 {
                for i in 0..2 {
                    let torques = [nm[0] - brake[0], nm[1] - brake[1]];
                    let next = speed + (free + by_left * torques[0] + by_right * torques[1]) * dt;
                    let stopping = of_motors(&next)[i] / (of_motors(&by[i])[i] * dt);
                    let (middle, level) = boxes[i];
                    brake[i] = (brake[i] + stopping).clamp(middle - level, middle + level);
                }
            }
            speed += (free + by_left * (nm[0] - brake[0]) + by_right * (nm[1] - brake[1])) * dt;
            place += speed * dt;
        }
        plant.advance(&torque_of(driven(&plant.state(), tick)), 1e-3, 10);
        *phases_seen.entry(plant.stuck()).or_insert(0) += 1;
        let pose = plant.pose();
        let errors = [
            pose.state.x_m - place[0],
            0.5 * 0.4 * (pose.yaw_rad - place[1]),
            0.1 * (pose.state.pitch_rad - place[2]),
        ];
        assert!(errors.iter().all(|e| e.abs() < 1e-5), "{errors:?} m at {tick}");
    }
    assert!(phases_seen.len() == 4 && phases_seen.values().all(|&ticks| ticks > 10), "{phases_seen:?}");
}

fn torque_of([left, right]: [f64; 2]) -> Forcing {
    torque(left, right)
}

#[test]
fn step_sizes_agree_through_stops_and_starts_of_each_wheel() {
    let run = |substeps: u32| {
        let mut plant = Plant::on_ground(&with_friction(table_4()), &single_sided(), &pitched(0.02));
        (0..2000)
            .map(|tick| {
                plant.advance(&torque_of(driven(&plant.state(), tick)), 1e-3, substeps);
                plant.pose()
            })
            .collect::<Vec<Pose>>()
    };
    let (coarse, fine) = (run(10), run(80));
    let error =
        |a: &Pose, b: &Pose| (a.state.x_m - b.state.x_m).abs().max(0.2 * (a.yaw_rad - b.yaw_rad).abs());
    let worst = coarse.iter().zip(&fine).map(|(a, b)| error(a, b)).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst} m");
}
