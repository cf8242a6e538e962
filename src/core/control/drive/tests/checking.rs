//! What is checked before arming, and what is said where something is wrong.

use super::rig::{Fault, Rig, controller, paper};
use crate::control::{
    ControllerKind,
    drive::{CheckResult, Drive, DriveEvent, DriveOrder, DriveSettings, Excitation, Inputs, Stage},
};
use crate::link::{MotorErrors, MotorEvent, MotorOrder};
use crate::model::{Motor, RobotModel};

/// A robot that has been checked for 4.1 s.
fn checked(edit: impl FnOnce(&mut Rig)) -> Rig {
    checked_as(&paper(), edit)
}

fn checked_as(robot: &RobotModel, edit: impl FnOnce(&mut Rig)) -> Rig {
    let mut rig = Rig::balancing(robot, ControllerKind::Lqr, DriveSettings::default(), 1);
    edit(&mut rig);
    rig.step(&[DriveOrder::Check]);
    while rig.tick < 4100 {
        rig.step(&[]);
    }
    rig
}

#[test]
fn every_check_of_a_right_robot_passes_and_it_is_armed() {
    let mut rig = checked(|_| {});
    assert!(
        rig.drive.checks().iter().all(|check| check.result == CheckResult::Passed),
        "{:#?}",
        rig.drive.checks()
    );
    for (_, output) in &rig.outputs {
        let queries = [MotorOrder::ReadState, MotorOrder::ReadHealth];
        assert!(output.orders.iter().all(|order| queries.contains(order)), "{:?}", output.orders);
    }
    let armed = rig.step(&[DriveOrder::Arm]).clone();
    assert_eq!(rig.drive.stage(), Stage::Driving);
    assert_eq!(armed.orders[0], MotorOrder::On);
    let sample = armed.sample.unwrap();
    assert_eq!((sample.x_m, sample.motor_angle_left_rad), (0.0, -sample.pitch_rad));
    assert_eq!(armed.events, [DriveEvent::Stage(Stage::Driving)]);
}

/// What is wrong with the robot.
type Edit = Box<dyn FnOnce(&mut Rig)>;

#[test]
fn each_defect_is_named_with_its_mend_and_keeps_the_robot_from_being_armed() {
    use CheckResult::{Failed, Waiting};
    let fault = |fault: Fault| move |rig: &mut Rig| rig.faults.push((0, fault));
    let cases: Vec<(&str, CheckResult, &str, Edit)> = vec![
        (
            "right motor",
            Failed,
            "id 2 is silent while id 1 answers",
            Box::new(fault(Fault::MotorVanishes(Motor::Right))),
        ),
        ("left motor", Failed, "so is the other motor: check supply", Box::new(fault(Fault::Deaf))),
        (
            "temperature",
            Failed,
            "let the motors cool",
            Box::new(fault(Fault::Temperature(Motor::Left, 81.0))),
        ),
        ("voltage", Failed, "19.0 V, outside 20 to 30 V", Box::new(fault(Fault::Voltage(19.0)))),
        (
            "motor errors",
            Failed,
            "right motor reports stall",
            Box::new(fault(Fault::Errors(Motor::Right, MotorErrors(64)))),
        ),
        ("IMU rate", Failed, "the IMU is silent", Box::new(fault(Fault::ImuSilent))),
        ("IMU moves", Failed, "same measurement", Box::new(|rig| rig.faults.push((3000, Fault::ImuFrozen)))),
        // The body is upright again, so that pitch and integrated rate agree in the end.
        ("IMU moves", Failed, "pitch rate", Box::new(fault(Fault::RateZero))),
        ("IMU moves", Failed, "pitch", Box::new(fault(Fault::PitchFrozen))),
        ("directions", Failed, "reverse pitch_direction in [link]", Box::new(|rig| rig.signs[0] = -1.0)),
        ("directions", Failed, "reverse left_direction in [link]", Box::new(|rig| rig.signs[1] = -1.0)),
        ("directions", Failed, "reverse right_direction in [link]", Box::new(|rig| rig.signs[2] = -1.0)),
        ("directions", Failed, "set encoder_steps in [link]", Box::new(|rig| rig.signs = [1.0, 0.25, 0.25])),
        ("directions", Waiting, "rock the body slowly", Box::new(|rig| rig.hand = |_| 0.0)),
        ("directions", Waiting, "wheels on the ground", Box::new(|rig| rig.signs = [1.0, 0.01, 0.01])),
        (
            "upright",
            Waiting,
            "hold the robot upright",
            Box::new(|rig| rig.hand = |time| 0.2 + super::rig::rock(time)),
        ),
        ("IMU and gravity", Failed, "upside down", Box::new(|rig| rig.tilt_off_rad = 3.1)),
        ("IMU and gravity", Failed, "choose the other pitch_axis", Box::new(|rig| rig.tilt_off_rad = -0.5)),
    ];
    for (name, result, text, edit) in cases {
        let mut rig = checked(edit);
        let check = rig.drive.checks().iter().find(|check| check.name == name).unwrap();
        assert!(check.result == result && check.text.contains(text), "{check:?} for {text}");
        let refused = rig.step(&[DriveOrder::Arm]).clone();
        assert_eq!(rig.drive.stage(), Stage::Checking, "{name}");
        let [DriveEvent::Warning(warning)] = &refused.events[..] else { panic!("{:?}", refused.events) };
        assert!(warning.starts_with("not armed, because of "), "{warning}");
        assert!(!refused.orders.contains(&MotorOrder::On));
    }
}

#[test]
fn an_imu_slower_than_set_is_named() {
    let mut robot = paper();
    robot.link.imu_rate_hz = 200;
    let rig = checked_as(&robot, |_| {});
    let check = rig.drive.checks().iter().find(|check| check.name == "IMU rate").unwrap();
    assert!(check.result == CheckResult::Failed && check.text.contains("100 Hz instead of 200 Hz"));
}

#[test]
fn another_controller_on_the_bus_is_named() {
    let mut rig = checked(|_| {});
    let (time, current_a) = (rig.now(), None);
    let asked = MotorEvent::Commanded { motor: Motor::Left, time, command: 0x81, current_a };
    let inputs = Inputs { motors: &[asked], orders: &[DriveOrder::Arm], ..Inputs::default() };
    let output = rig.drive.step(rig.now(), &inputs);
    assert!(format!("{:?}", output.events).contains("another controller on the bus"), "{:?}", output.events);
}

#[test]
fn wheels_in_the_air_are_armed_without_rocking() {
    let robot = paper();
    let control = controller(&robot, ControllerKind::Lqr);
    let excitation = Excitation::SpeedSweep { seconds: 30.0 };
    let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&robot, drive, true, true, 1);
    rig.arm();
    assert!(rig.drive.checks().iter().all(|check| !["directions", "upright"].contains(&check.name)));
}

#[test]
fn stages_are_reached_in_their_order_only() {
    let mut rig = Rig::balancing(&paper(), ControllerKind::Lqr, DriveSettings::default(), 1);
    let refused = rig.step(&[DriveOrder::Arm]);
    assert!(matches!(refused.events[..], [DriveEvent::Warning(_)]));
    assert_eq!(rig.drive.stage(), Stage::Listening);
    rig.step(&[DriveOrder::Check]);
    assert_eq!(rig.drive.stage(), Stage::Checking);
    rig.step(&[DriveOrder::Release]);
    assert_eq!(rig.drive.stage(), Stage::Listening);
    rig.arm();
    let refused = rig.step(&[DriveOrder::Release]);
    assert!(matches!(refused.events[..], [DriveEvent::Warning(_)]));
    assert_eq!(rig.drive.stage(), Stage::Driving);
}
