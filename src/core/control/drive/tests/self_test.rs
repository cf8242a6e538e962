//! What small torques after arming show of motors and robot.

use super::rig::{Fault, Rig, controller, paper};
use crate::control::{
    ControllerKind,
    drive::{Drive, DriveSettings, Excitation, StopReason},
};
use crate::model::{Motor, Payload, RobotModel};

/// Name of the stop of a robot that is armed with these faults, and ticks since it was armed.
fn stop_of(edit: impl FnOnce(&mut Rig), kind: ControllerKind, seed: u64) -> Option<(&'static str, u64)> {
    let mut rig = Rig::balancing(&paper(), kind, DriveSettings::default(), seed);
    edit(&mut rig);
    let armed = rig.arm();
    let (time, reason) = rig.run(4.0)?;
    Some((reason.name(), time.as_millis() as u64 - armed))
}

#[test]
fn reversed_and_swapped_torques_stop_the_robot_within_a_tenth_of_a_second() {
    let hands: [fn(f64) -> f64; 3] = [super::rig::rock, super::rig::leans_far, super::rig::leans_back];
    for (faults, name) in [
        (&[Fault::TorqueReversed(Motor::Left)][..], "torque_reversed"),
        (&[Fault::TorqueReversed(Motor::Right)], "torque_reversed"),
        (&[Fault::TorqueReversed(Motor::Left), Fault::TorqueReversed(Motor::Right)], "torque_reversed"),
        (&[Fault::TorquesSwapped], "torques_swapped"),
    ] {
        for (seed, hand) in (1..).zip(hands.into_iter().cycle().take(12)) {
            for kind in [ControllerKind::Lqr, ControllerKind::Flqr] {
                let found = stop_of(
                    |rig| {
                        rig.faults.extend(faults.iter().map(|fault| (0, *fault)));
                        rig.hand = hand;
                    },
                    kind,
                    seed,
                );
                assert!(
                    found.is_some_and(|(found, after)| found == name && after <= 100),
                    "{faults:?} {kind:?}: {found:?}"
                );
            }
        }
    }
}

#[test]
fn a_robot_that_is_held_is_named_as_such() {
    for seed in 1..4 {
        let found = stop_of(|rig| rig.faults.push((0, Fault::Held)), ControllerKind::Flqr, seed);
        assert!(matches!(found, Some(("held", 1000..2200))), "{found:?}");
    }
}

#[test]
fn an_air_run_on_the_ground_is_named_as_such() {
    for seed in 1..4 {
        let robot = paper();
        let control = controller(&robot, ControllerKind::Lqr);
        let excitation = Excitation::SpeedSweep { seconds: 40.0 };
        let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
        let mut rig = Rig::new(&robot, drive, false, true, seed);
        rig.arm();
        let stop = rig.run(3.0).map(|(_, reason)| reason);
        assert!(matches!(stop, Some(StopReason::WheelsOnGround { .. })), "{stop:?}");
    }
}

/// Commands that take longer than the model's delay: named by their latency in the checks, or by the nudge where the
/// limit of the checks is higher; never as a wrong scale.
#[test]
fn a_late_link_is_named_as_such() {
    for latency in [11, 15, 25] {
        let mut robot = paper();
        let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 1);
        rig.latency = latency;
        rig.step(&[crate::control::drive::DriveOrder::Check]);
        rig.run(4.1);
        let open = rig.drive.checks().iter().find(|check| check.name == "round trip").unwrap();
        assert!(
            open.result == crate::control::drive::CheckResult::Failed && open.text.contains("above 10 ms"),
            "{open:?}"
        );
        robot.safety.round_trip_s = 0.2;
        let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 1);
        rig.latency = latency;
        rig.arm();
        let stop = rig.run(3.0).map(|(_, reason)| reason);
        let named = match stop {
            None => true,
            Some(StopReason::TorqueScale { .. }) => false,
            Some(StopReason::TorqueDelay { delay_s }) => (delay_s - 1e-3 * latency as f64).abs() < 0.004,
            Some(_) => true,
        };
        assert!(named, "{latency} ms: {stop:?}");
    }
}

/// The torque limit rises from 0 within 0.2 s, whatever the controller wants.
#[test]
fn the_torque_ramps_in() {
    let mut rig = Rig::balancing(&paper(), ControllerKind::Flqr, DriveSettings::default(), 1);
    rig.hand = super::rig::leans_far;
    let armed = rig.arm();
    rig.run(0.5);
    let mut most = 0.0_f64;
    for (time, output) in &rig.outputs {
        let since_s = time.as_secs_f64() - 1e-3 * armed as f64;
        let Some(sample) = output.sample.filter(|_| since_s >= 0.0) else { continue };
        let torque = sample.torque_left_nm.abs().max(sample.torque_right_nm.abs());
        // The pulses stand on top of it.
        let limit = (2.42 * (since_s + 0.001) / 0.2 + 0.23).min(2.42);
        assert!(torque <= limit + 1e-12, "{torque} N m at {since_s} s");
        most = most.max(torque);
    }
    assert!(most > 1.0, "{most}");
}

/// Neither payloads nor friction that the model lacks pass for a reversed torque.
#[test]
fn a_right_robot_passes_whatever_it_carries() {
    let payload = |mass_kg, height_m| Some(Payload { mass_kg, height_m, forward_m: 0.0 });
    let edits: [&dyn Fn(&mut RobotModel); 4] = [
        &|robot| robot.surroundings.payload = payload(3.9, 0.1),
        &|robot| robot.surroundings.payload = payload(3.9, 0.3),
        &|robot| robot.surroundings.slope_rad = 0.05,
        &|robot| robot.friction = [None; 2],
    ];
    for (seed, edit) in (1..).zip(edits) {
        let robot = paper();
        let mut actual = robot.clone();
        edit(&mut actual);
        let control = controller(&robot, ControllerKind::Flqr);
        let drive = Drive::new(&robot, control, Excitation::Balance, DriveSettings::default()).unwrap();
        let mut rig = Rig::new(&actual, drive, false, true, seed);
        rig.arm();
        assert_eq!(rig.run(3.0).map(|(_, reason)| reason), None, "{seed}");
    }
}
