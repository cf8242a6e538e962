//! Watches, limits and what a stop does.

use std::time::Duration;

use super::rig::{Fault, Rig, controller, paper};
use crate::control::{
    ControllerKind,
    drive::{
        Drive, DriveError, DriveEvent, DriveOrder, DriveSettings, Excitation, Inputs, Stage, StopReason,
    },
};
use crate::link::{MotorErrors, MotorOrder};
use crate::model::{Motor, SafetyLimits};

fn armed(seed: u64) -> (Rig, u64) {
    let mut rig = Rig::balancing(&paper(), ControllerKind::Flqr, DriveSettings::default(), seed);
    let armed = rig.arm();
    (rig, armed)
}

/// Orders of the steps from a time on.
fn orders_from(rig: &Rig, time: Duration) -> Vec<(Duration, Vec<MotorOrder>)> {
    let later = rig.outputs.iter().filter(|(at, _)| *at >= time);
    later.map(|(at, output)| (*at, output.orders.to_vec())).collect()
}

/// Each fault begins at its tick; its stop comes within its time and one tick, and not before that time.
#[test]
fn each_watch_fires_within_its_time_and_a_tick() {
    let limits = SafetyLimits::default();
    let (imu, frozen, motor) = (limits.imu_timeout_s, limits.imu_frozen_s, limits.motor_timeout_s);
    // The last reading before the fault is up to a period older than the fault; health is requested every 30
    // and 60 ms in turn, and its answer is a tick under way.
    for (fault, name, least_s, most_s) in [
        (Fault::MotorVanishes(Motor::Left), "motor_silent", motor - 0.002, motor + 0.001),
        (Fault::MotorVanishes(Motor::Right), "motor_silent", motor - 0.002, motor + 0.001),
        (Fault::ImuSilent, "imu_silent", imu - 0.010, imu + 0.001),
        (Fault::ImuFrozen, "imu_frozen", frozen - 0.010, frozen + 0.001),
        (Fault::Errors(Motor::Right, MotorErrors(0b1000)), "motor_error", 0.0, 0.062),
        (Fault::Off(Motor::Left), "motor_off", 0.0, 0.062),
        (Fault::Temperature(Motor::Left, 80.5), "motor_hot", 0.0, 0.002),
        (Fault::Voltage(19.9), "voltage", 0.0, 0.062),
        (Fault::Voltage(30.1), "voltage", 0.0, 0.062),
        (Fault::NotFinite, "not_finite", 0.0, 0.002),
        (Fault::BusDown, "bus_down", 0.0, 0.0),
        (Fault::Late(0.0201), "late", 0.0, 0.0),
        (Fault::HealthSilent(Motor::Left), "health_silent", 0.3 - 0.062, 0.302),
        (Fault::TurnsLost(Motor::Right), "turns_lost", 0.0, 0.001),
        (Fault::Commanded(Motor::Left), "other_controller", 0.0, 0.0),
    ] {
        for offset in [0, 3, 7, 9] {
            let (mut rig, armed) = armed(1);
            let begin = armed + 1000 + offset;
            rig.faults.push((begin, fault));
            let (time, reason) = rig.run(2.0).unwrap_or_else(|| panic!("{fault:?} did not stop the robot"));
            assert_eq!(reason.name(), name, "{fault:?}: {reason}");
            let after_s = time.as_secs_f64() - begin as f64 / 1000.0;
            assert!((least_s - 1e-9..=most_s + 1e-9).contains(&after_s), "{fault:?} after {after_s} s");
            let orders = &rig.outputs.last().unwrap().1.orders;
            assert_eq!(orders[..], [MotorOrder::Torque([0.0; 2]), MotorOrder::Off], "{fault:?}");
        }
    }
}

#[test]
fn values_at_their_limits_and_quiet_sensors_do_not_stop_the_robot() {
    for fault in
        [Fault::Temperature(Motor::Left, 80.0), Fault::Voltage(20.0), Fault::Voltage(30.0), Fault::Late(0.02)]
    {
        let (mut rig, armed) = armed(2);
        rig.faults.push((armed, fault));
        assert_eq!(rig.run(1.0), None, "{fault:?}");
    }
    // An IMU in steps, without any noise but that of its acceleration, above wheels that hold still.
    let mut robot = paper();
    (robot.sensors.pitch_noise_rad, robot.sensors.pitch_rate_noise_rad_s) = (0.0, 0.0);
    let excitation = Excitation::Multisine { seconds: 3.0 };
    let control = controller(&robot, ControllerKind::Lqr);
    let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&robot, drive, true, true, 1);
    rig.arm();
    assert_eq!(rig.run(4.0).map(|(_, reason)| reason), Some(StopReason::Done));
}

#[test]
fn a_second_stop_switches_motors_off_that_still_roll_out() {
    let mut robot = paper();
    robot.safety.stop = crate::model::StopAction::ZeroThenOff;
    let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 5);
    rig.arm();
    rig.run(1.0);
    rig.robot.push(60.0, 0.2, None);
    rig.run(0.3);
    let first = rig.step(&[DriveOrder::Stop]).orders.to_vec();
    let second = rig.step(&[DriveOrder::Stop]).orders.to_vec();
    assert!(!first.contains(&MotorOrder::Off), "the motors did not roll: {first:?}");
    assert!(second.contains(&MotorOrder::Off), "{second:?}");
}

#[test]
fn limits_stop_the_robot_where_they_are_passed() {
    let (mut rig, _) = armed(3);
    rig.robot.push(300.0, 0.1, None);
    let (_, reason) = rig.run(2.0).unwrap();
    assert!(matches!(reason, StopReason::Tilt { .. } | StopReason::Speed { .. }), "{reason}");

    let mut robot = paper();
    robot.safety.distance_m = 0.2;
    let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 3);
    rig.arm();
    rig.robot.push(30.0, 0.2, None);
    let (_, reason) = rig.run(5.0).unwrap();
    let StopReason::Distance { x_m } = reason else { panic!("{reason}") };
    assert!((0.2..0.203).contains(&x_m.abs()), "{x_m}");

    let excitation = Excitation::SpeedSweep { seconds: 30.0 };
    robot.safety.motor_speed_rad_s = 30.0;
    let control = controller(&robot, ControllerKind::Lqr);
    let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&robot, drive, true, true, 1);
    rig.arm();
    let (_, reason) = rig.run(5.0).unwrap();
    let StopReason::MotorSpeed { speed_rad_s, .. } = reason else { panic!("{reason}") };
    assert!((30.0..31.0).contains(&speed_rad_s), "{speed_rad_s}");
}

#[test]
fn a_stop_is_repeated_until_it_is_acknowledged_and_nothing_follows() {
    let (mut rig, _) = armed(4);
    rig.run(0.5);
    let stop = rig.tick;
    rig.faults.push((stop, Fault::Deaf));
    rig.step(&[DriveOrder::Stop]);
    assert_eq!(rig.drive.stage(), Stage::Stopped(StopReason::Requested));
    for _ in 0..99 {
        rig.step(&[]);
    }
    rig.faults.clear();
    for _ in 0..500 {
        rig.step(&[]);
    }
    let off = vec![MotorOrder::Torque([0.0; 2]), MotorOrder::Off];
    for (time, orders) in orders_from(&rig, Duration::from_millis(stop)) {
        let after = time.as_millis() as u64 - stop;
        // Every 5 ms while the motors are deaf; the one at 100 ms is received and acknowledged.
        let expected = if after <= 100 && after.is_multiple_of(5) { off.clone() } else { vec![] };
        assert_eq!(orders, expected, "{after} ms after the stop");
    }
    assert_eq!(rig.on, [false; 2]);
    assert!(
        rig.events().any(|(_, event)| *event == DriveEvent::Stage(Stage::Stopped(StopReason::Requested)))
    );
    rig.step(&[DriveOrder::Arm]);
    rig.step(&[DriveOrder::Check]);
    assert_eq!(rig.drive.stage(), Stage::Stopped(StopReason::Requested));
    rig.step(&[DriveOrder::Release]);
    assert_eq!(rig.drive.stage(), Stage::Listening);
    assert!(rig.outputs.iter().rev().take(4).all(|(_, output)| output.orders.is_empty()));
}

#[test]
fn stop_comes_first_whatever_else_is_asked_for() {
    let (mut rig, _) = armed(5);
    let asked = &rig.step(&[DriveOrder::Stop, DriveOrder::Arm, DriveOrder::Check]).orders;
    assert_eq!(asked[..], [MotorOrder::Torque([0.0; 2]), MotorOrder::Off]);
}

/// A robot that balances under its own controller would fall.
#[test]
fn motors_that_were_not_switched_on_here_are_not_switched_off() {
    for checked in [false, true] {
        let mut rig = Rig::balancing(&paper(), ControllerKind::Lqr, DriveSettings::default(), 1);
        if checked {
            rig.step(&[DriveOrder::Check]);
        }
        assert_eq!(rig.step(&[DriveOrder::Stop]).orders[..], []);
        assert_eq!(rig.drive.stage(), Stage::Stopped(StopReason::Requested));
        assert!(rig.drive.has_ended());
        (0..100).for_each(|_| drop(rig.step(&[]).clone()));
        let sent = rig.outputs.iter().flat_map(|(_, output)| output.orders.iter());
        assert!(sent.clone().all(|order| matches!(order, MotorOrder::ReadState | MotorOrder::ReadHealth)));
        rig.step(&[DriveOrder::Release]);
        assert_eq!(rig.drive.stage(), Stage::Listening);
    }
}

#[test]
fn motors_that_never_say_that_they_are_on_are_not_driven_on() {
    let mut rig = Rig::balancing(&paper(), ControllerKind::Lqr, DriveSettings::default(), 1);
    rig.step(&[DriveOrder::Check]);
    while rig.tick < 4100 {
        rig.step(&[]);
    }
    let mut drive = rig.drive.clone();
    let stop = (0..400_u64).find_map(|tick| {
        let now = Duration::from_millis(4100 + tick);
        let states: Vec<_> = [Motor::Left, Motor::Right]
            .map(|motor| {
                let state = drive.watch.motors[motor as usize].state.unwrap();
                crate::link::MotorEvent::State(motor, crate::link::MotorState { time: now, ..state })
            })
            .into();
        let imu = drive.watch.imu.last.map(|imu| crate::link::ImuReading {
            time: now,
            pitch_rad: 1e-5 * tick as f64,
            ..imu
        });
        let orders: &[_] = if tick == 0 { &[DriveOrder::Arm] } else { &[] };
        let inputs = Inputs { motors: &states, imu: imu.as_slice(), orders, ..Inputs::default() };
        let output = drive.step(now, &inputs);
        let on = output.orders.contains(&MotorOrder::On);
        assert_eq!(on, tick <= 200 && tick.is_multiple_of(5), "at {tick}");
        matches!(drive.stage(), Stage::Stopped(_)).then_some((tick, drive.stage()))
    });
    let expected = Stage::Stopped(StopReason::MotorOff { motor: Motor::Left });
    assert_eq!(stop, Some((201, expected)));
}

#[test]
fn torques_stay_within_limit_and_slew() {
    let mut robot = paper();
    (robot.limits.torque_nm, robot.limits.torque_slew_nm_s) = (Some(0.8), Some(40.0));
    let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 6);
    rig.arm();
    rig.robot.push(60.0, 0.1, None);
    rig.run(2.0);
    let torques: Vec<[f64; 2]> = rig
        .outputs
        .iter()
        .flat_map(|(_, output)| output.orders.iter())
        .filter_map(|order| if let MotorOrder::Torque(nm) = order { Some(*nm) } else { None })
        .collect();
    let (mut most, mut fastest) = (0.0_f64, 0.0_f64);
    for pair in torques.windows(2) {
        for motor in [0, 1] {
            most = most.max(pair[1][motor].abs());
            // A stop takes all away at once.
            if pair[1] != [0.0; 2] {
                fastest = fastest.max((pair[1][motor] - pair[0][motor]).abs());
            }
        }
    }
    assert!(most <= 0.8 && most > 0.5, "{most}");
    assert!((0.0399..=0.04 + 1e-12).contains(&fastest), "{fastest}");
}

#[test]
fn what_cannot_be_driven_is_refused_with_its_mend() {
    let refused = |edit: fn(&mut crate::model::RobotModel), excitation| {
        let mut robot = paper();
        let control = controller(&robot, ControllerKind::Lqr);
        edit(&mut robot);
        Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap_err()
    };
    let balance = Excitation::Balance;
    let found = refused(|robot| robot.link.torque_constant_nm_a = None, balance);
    assert!(matches!(found, DriveError::NoTorqueRange(_)) && found.to_string().contains("0.32"), "{found}");
    assert_eq!(refused(|robot| robot.limits.torque_nm = None, balance), DriveError::NoTorqueLimit);
    let found = refused(|robot| robot.limits.torque_nm = Some(5.3), balance);
    assert!(found.to_string().contains("above 5.28 N m"), "{found}");
    let found = refused(|_| {}, Excitation::SpeedSweep { seconds: 10.0 });
    assert!(matches!(found, DriveError::SweepTooShort { .. }), "{found}");
    let found = refused(|robot| robot.safety.late_s = -1.0, balance);
    assert!(matches!(found, DriveError::Parameter(_)), "{found}");
}

/// Whatever comes in, a drive that was never queried says nothing.
#[test]
fn listening_gives_no_order() {
    let (rig, _) = armed(7);
    let mut listening = Rig::balancing(&paper(), ControllerKind::Lqr, DriveSettings::default(), 1);
    let state = rig.drive.watch.motors[0].state.unwrap();
    for tick in 0..2000 {
        let now = Duration::from_millis(tick);
        let motors = [
            crate::link::MotorEvent::State(Motor::Left, crate::link::MotorState { time: now, ..state }),
            crate::link::MotorEvent::Commanded {
                motor: Motor::Right,
                time: now,
                command: 0xA1,
                current_a: Some(1.0),
            },
        ];
        let bus_down = tick % 7 == 0;
        let inputs = Inputs { motors: &motors, bus_down, ..Inputs::default() };
        let output = listening.drive.step(now, &inputs);
        assert!(output.orders.is_empty() && output.events.is_empty());
    }
}

/// Motors that roll out get torques of zero, and are switched off once they are slow, silent, or a second has passed.
#[test]
fn motors_roll_out_before_they_are_switched_off_where_that_is_chosen() {
    let mut robot = paper();
    robot.safety.stop = crate::model::StopAction::ZeroThenOff;
    for (push_n, vanishes, least_ms, most_ms) in
        [(0.0, false, 0, 0), (60.0, false, 50, 1000), (60.0, true, 20, 25)]
    {
        let mut rig = Rig::balancing(&robot, ControllerKind::Flqr, DriveSettings::default(), 4);
        rig.arm();
        rig.run(2.0);
        rig.robot.push(push_n, 0.2, None);
        rig.run(0.15);
        let stop = rig.tick;
        rig.step(&[DriveOrder::Stop]);
        if vanishes {
            rig.faults.push((stop, Fault::MotorVanishes(Motor::Left)));
        }
        let first = rig.outputs.last().unwrap().1.orders;
        assert_eq!(first[0], MotorOrder::Torque([0.0; 2]));
        for _ in 0..1100 {
            rig.step(&[]);
        }
        let orders = orders_from(&rig, Duration::from_millis(stop));
        let off = orders.iter().find(|(_, orders)| orders.contains(&MotorOrder::Off)).unwrap().0;
        let after = off.as_millis() as u64 - stop;
        assert!((least_ms..=most_ms).contains(&after), "{push_n} N: off {after} ms after the stop");
        let zero = |order: &MotorOrder| [MotorOrder::Torque([0.0; 2]), MotorOrder::Off].contains(order);
        assert!(orders.iter().flat_map(|(_, orders)| orders).all(zero));
        assert!(vanishes || rig.drive.has_ended());
    }
}

/// Errors and voltage are read more than 20 times a second, while checking and while driving.
#[test]
fn health_is_read_twenty_times_a_second() {
    let (mut rig, armed) = armed(8);
    rig.run(4.0);
    let queries = |from: u64, to: u64| {
        let within = rig.outputs.iter().filter(|(time, _)| (from..to).contains(&(time.as_millis() as u64)));
        within.filter(|(_, output)| output.orders.contains(&MotorOrder::ReadHealth)).count()
    };
    assert!(queries(0, 4000) >= 4 * 20 && queries(armed, armed + 4000) >= 4 * 20);
}

/// What the protocol cannot tell is said before the robot is armed.
#[test]
fn the_missing_time_out_of_the_motors_is_said_before_arming() {
    let mut rig = Rig::balancing(&paper(), ControllerKind::Lqr, DriveSettings::default(), 1);
    let checking = rig.step(&[DriveOrder::Check]);
    let said = checking.events.iter().any(|event| {
        matches!(event, DriveEvent::Warning(text) if text.contains("timeout") && text.contains("hold their last torque"))
    });
    assert!(said, "{:?}", checking.events);
}
