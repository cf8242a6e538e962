//! Sensors that lie while the robot balances: the robot is stopped before it has gone far.

use super::rig::{Fault, Rig, controller, paper};
use crate::control::{
    ControllerKind, Reference,
    drive::{Drive, DriveOrder, DriveSettings, Excitation, Stage, StopReason},
};
use crate::model::Motor;

/// What the robot did from the fault to the stop, truly: name of the stop, displacement, m, greatest pitch and
/// heading, rad.
#[derive(Debug)]
struct Outcome {
    name: &'static str,
    moved_m: f64,
    pitch_rad: f64,
    yaw_rad: f64,
}

fn outcome(fault: Fault, kind: ControllerKind, imu_rate_hz: f64, seed: u64) -> Outcome {
    let mut robot = paper();
    (robot.sensors.imu_rate_hz, robot.link.imu_rate_hz) = (imu_rate_hz, imu_rate_hz as u32);
    let mut rig = Rig::balancing(&robot, kind, DriveSettings::default(), seed);
    let armed = rig.arm();
    rig.run(3.0);
    assert_eq!(rig.drive.stage(), Stage::Driving, "{fault:?}");
    let begin = armed + 3000;
    rig.faults.push((begin, fault));
    let start = rig.robot.pose();
    let (mut moved_m, mut pitch_rad, mut yaw_rad) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..60_000 {
        rig.step(&[]);
        let pose = rig.robot.pose();
        moved_m = moved_m.max((pose.state.x_m - start.state.x_m).abs());
        pitch_rad = pitch_rad.max(pose.state.pitch_rad.abs());
        yaw_rad = yaw_rad.max((pose.yaw_rad - start.yaw_rad).abs());
        if let Stage::Stopped(reason) = rig.drive.stage() {
            return Outcome { name: reason.name(), moved_m, pitch_rad, yaw_rad };
        }
    }
    Outcome { name: "none", moved_m, pitch_rad, yaw_rad }
}

#[test]
fn sensors_that_contradict_each_other_stop_the_robot_before_it_has_gone_far() {
    let mut wrong = vec![];
    for (fault, names) in [
        (Fault::EncoderFrozen(Motor::Left), &["encoder_frozen", "yaw_mismatch"][..]),
        (Fault::EncoderFrozen(Motor::Right), &["encoder_frozen", "yaw_mismatch"]),
        (Fault::BothEncodersFrozen, &["encoder_frozen"]),
        (Fault::AngleFrozen(Motor::Left), &["encoder_mismatch"]),
        (Fault::PitchFrozen, &["imu_stuck"]),
        (Fault::RateZero, &["imu_stuck"]),
        (Fault::PitchOff(0.25), &["pitch_mismatch"]),
        (Fault::PitchOff(-0.25), &["pitch_mismatch"]),
        (Fault::PitchDrift(0.05), &["gravity_mismatch"]),
    ] {
        for (kind, imu_rate_hz, seed) in [
            (ControllerKind::Lqr, 100.0, 1),
            (ControllerKind::Flqr, 100.0, 2),
            (ControllerKind::Flqr, 200.0, 3),
            (ControllerKind::Lqr, 50.0, 4),
        ] {
            let found = outcome(fault, kind, imu_rate_hz, seed);
            let expected = names.contains(&found.name);
            // A drift is seen by gravity alone, which pushes and accelerations hide.
            let most_m = if matches!(fault, Fault::PitchDrift(_)) { 2.0 } else { 0.3 };
            if !expected || found.moved_m > most_m || found.pitch_rad > 0.3 || found.yaw_rad > 0.5 {
                wrong.push((fault, kind, imu_rate_hz, found));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#.3?}");
}

#[test]
fn wheels_and_robots_that_turn_too_fast_are_stopped() {
    let mut robot = paper();
    robot.safety.wheel_speed_rad_s = 4.0;
    let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 1);
    rig.arm();
    rig.run(2.0);
    rig.robot.push(60.0, 0.2, None);
    let (_, reason) = rig.run(2.0).unwrap();
    assert!(
        matches!(reason, StopReason::WheelSpeed { speed_rad_s, .. } if speed_rad_s.abs() < 4.5),
        "{reason}"
    );

    let mut robot = paper();
    robot.safety.yaw_rate_rad_s = 0.5;
    let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 1);
    rig.arm();
    rig.run(2.0);
    rig.step(&[DriveOrder::Reference(Reference { yaw_rad: 0.5, ..Reference::default() })]);
    let (_, reason) = rig.run(2.0).unwrap();
    assert!(matches!(reason, StopReason::YawRate { yaw_rate_rad_s } if yaw_rate_rad_s < 0.8), "{reason}");
}

/// Nothing else shows how fast a wheel in the air turns.
#[test]
fn a_frozen_encoder_of_a_wheel_in_the_air_stops_the_motors() {
    for (fault, excitation) in [
        (Fault::EncoderFrozen(Motor::Left), Excitation::SpeedSweep { seconds: 30.0 }),
        (Fault::EncoderFrozen(Motor::Right), Excitation::Multisine { seconds: 30.0 }),
        (Fault::BothEncodersFrozen, Excitation::SpeedSweep { seconds: 30.0 }),
    ] {
        let robot = paper();
        let control = controller(&robot, ControllerKind::Lqr);
        let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
        let mut rig = Rig::new(&robot, drive, true, true, 1);
        let armed = rig.arm();
        rig.faults.push((armed + 4000, fault));
        let (time, reason) = rig.run(20.0).unwrap_or_else(|| panic!("{fault:?} goes unnoticed"));
        let after_s = time.as_secs_f64() - 1e-3 * (armed + 4000) as f64;
        assert!(reason.name() == "encoder_frozen" && after_s < 3.0, "{fault:?}: {reason} after {after_s} s");
    }
}

/// A stand that tips over with the robot.
#[test]
fn a_robot_that_tips_with_its_wheels_in_the_air_is_stopped() {
    let robot = paper();
    let excitation = Excitation::Multisine { seconds: 10.0 };
    let control = controller(&robot, ControllerKind::Lqr);
    let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&robot, drive, true, true, 1);
    rig.hand = |time| 1.2 + 0.3 * (time - 6.0).max(0.0);
    rig.arm();
    let (time, reason) = rig.run(8.0).unwrap();
    let StopReason::Tilt { pitch_rad } = reason else { panic!("{reason}") };
    assert!(
        (0.5..0.51).contains(&pitch_rad) && (7.6..7.8).contains(&time.as_secs_f64()),
        "{pitch_rad} {time:?}"
    );
}
