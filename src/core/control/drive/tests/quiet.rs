//! Robots with nothing wrong are not stopped, whatever they carry, stand on, or are pushed by.

use super::rig::{Rig, controller};
use crate::control::{
    ControllerKind, Reference,
    drive::{Drive, DriveOrder, DriveSettings, Excitation, StopReason},
};
use crate::model::{Ground, Payload, RobotModel, State};
use crate::model_file::presets;

/// What a robot meets while it is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    Quiet,
    Pushes,
    Payload,
    Slope,
    Bridge,
    Bump,
    Multisine,
    References,
    OtherFriction,
    OtherSensors,
    /// Encoders of 14 bits, and nothing that makes their readings dither.
    SteadyEncoders,
}

const COURSES: [Course; 11] = [
    Course::Quiet,
    Course::Pushes,
    Course::Payload,
    Course::Slope,
    Course::Bridge,
    Course::Bump,
    Course::Multisine,
    Course::References,
    Course::OtherFriction,
    Course::OtherSensors,
    Course::SteadyEncoders,
];
const SEEDS: u64 = 3;
const SECONDS: u64 = 8;

/// The preset with the wiring of the paper's robot where it gives none.
fn preset(index: usize, imu_rate_hz: f64) -> RobotModel {
    let (_, text) = presets::ALL[index];
    let mut robot = crate::model::Model::from_toml(text, "preset").unwrap().robot().unwrap().clone();
    let constant = if robot.limits.torque_nm.unwrap() > 5.0 { 0.81 } else { 0.32 };
    robot.link.torque_constant_nm_a.get_or_insert(constant);
    (robot.sensors.imu_rate_hz, robot.link.imu_rate_hz) = (imu_rate_hz, imu_rate_hz as u32);
    robot
}

/// The robot as it is, where that is not what its model says.
fn actual(robot: &RobotModel, course: Course, sign: f64) -> RobotModel {
    let mut actual = robot.clone();
    let mass_kg = 0.2 * robot.parameters.body_mass_kg;
    match course {
        Course::Payload => {
            let height_m = robot.parameters.com_height_m * (1.0 + 0.3 * sign);
            actual.surroundings.payload = Some(Payload { mass_kg, height_m, forward_m: 0.005 });
        }
        Course::Slope => actual.surroundings.slope_rad = 0.05 * sign,
        Course::Bridge => {
            actual.surroundings.ground[usize::from(sign > 0.0)] = Ground::bridge(0.1, 0.1, 0.2, 0.02);
        }
        Course::Bump => {
            let radius = robot.parameters.wheel_radius_m;
            actual.surroundings.ground[usize::from(sign > 0.0)] = Ground::step(0.15, 0.005, radius);
        }
        Course::OtherFriction if sign > 0.0 => actual.friction = [None; 2],
        Course::OtherFriction => {
            actual.friction = actual.friction.map(|curve| {
                let mut parameters = *curve?.parameters();
                parameters.coulomb_nm *= 1.4;
                parameters.static_nm *= 1.4;
                crate::friction::Stribeck::new(parameters).ok()
            })
        }
        Course::OtherSensors => {
            actual.sensors.gyro_bias_rad_s = 0.01 * sign;
            actual.sensors.imu_mount_angle_rad = 0.02 * sign;
            actual.sensors.imu_latency_s = 0.01;
        }
        Course::SteadyEncoders => {
            actual.sensors.encoder_bits = 14;
            actual.sensors.motor_speed_noise_rad_s = 0.0;
            actual.actuation.torque_noise_nm = 0.0;
        }
        Course::Quiet | Course::Pushes | Course::Multisine | Course::References => {}
    }
    actual
}

fn stop(preset_index: usize, course: Course, seed: u64) -> Option<StopReason> {
    let imu_rate_hz = [50.0, 100.0, 200.0][seed as usize % 3];
    let kind = [ControllerKind::Flqr, ControllerKind::Lqr][(seed / 3) as usize % 2];
    let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
    let robot = preset(preset_index, imu_rate_hz);
    let excitation =
        if course == Course::Multisine { Excitation::BalanceMultisine } else { Excitation::Balance };
    let drive = Drive::new(&robot, controller(&robot, kind), excitation, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&actual(&robot, course, sign), drive, false, true, seed);
    rig.arm();
    let weight_n = 9.81 * robot.parameters.body_mass_kg;
    for second in 0..SECONDS {
        for tenth in 0..10 {
            let time_s = second as f64 + 0.1 * f64::from(tenth);
            let mut orders = vec![];
            match course {
                Course::Pushes if tenth == 5 => {
                    // From a tenth of the weight on, until a limit of speed or tilt is passed.
                    let force_n = weight_n * 0.2 * (1 + second) as f64;
                    rig.robot.push(if second % 2 == 0 { sign } else { -sign } * force_n, 0.1, None);
                }
                Course::References | Course::Bridge | Course::Bump => {
                    let x_m = 0.25
                        * (time_s - 2.0).clamp(0.0, 4.0)
                        * if course == Course::References { sign } else { 1.0 };
                    let moving = (2.0..6.0).contains(&time_s);
                    let yaw_rad = if course == Course::References && second >= 4 { 0.3 * sign } else { 0.0 };
                    let x_dot_m_s = if moving { 0.25 } else { 0.0 };
                    let state = State { x_m, x_dot_m_s, ..State::default() };
                    orders.push(DriveOrder::Reference(Reference { state, yaw_rad }));
                }
                _ => {}
            }
            rig.step(&orders);
            if let Some((_, reason)) = rig.run(0.099) {
                return Some(reason);
            }
        }
    }
    None
}

#[test]
fn robots_with_nothing_wrong_are_not_stopped() {
    let mut wrong = vec![];
    for index in 0..presets::ALL.len() {
        for course in COURSES {
            for seed in 1..=SEEDS {
                let found = stop(index, course, seed);
                let allowed = match found {
                    None => true,
                    Some(
                        StopReason::Tilt { .. } | StopReason::Speed { .. } | StopReason::Distance { .. },
                    ) => course != Course::Quiet,
                    Some(_) => false,
                };
                if !allowed {
                    wrong.push((presets::ALL[index].0, course, seed, found));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
