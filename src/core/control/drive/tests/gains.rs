//! New gains while a robot is driven: what must not reach it, and how the rest does.

use nalgebra::{Complex, Matrix2x4};

use super::rig::{Rig, controller, paper};
use crate::control::{
    BalanceController, ControllerKind,
    drive::{Drive, DriveError, DriveEvent, DriveOrder, DriveSettings, Excitation, Stage, StopReason},
    gate::{self, Refusal, Verdict},
};
use crate::friction::{Compensation, Stribeck, StribeckParameters};
use crate::lqr::{self, SampledLoop, sampled_poles, weights_for_pole};
use crate::model::{Effect, MachineKind, Model, RobotModel, RobotParameters, Weights, YawHold};
use crate::model_file::presets;

/// The controller that a window makes of an edited model: `None` if there is no design.
fn designed(robot: &RobotModel) -> Option<BalanceController> {
    let gain = lqr::design(&robot.parameters.linear_model(), &robot.weights?).ok()?.gain;
    BalanceController::new(ControllerKind::Flqr, robot, gain).ok()
}

fn weights(edit: impl FnOnce(&mut Weights)) -> Option<BalanceController> {
    let mut robot = paper();
    edit(robot.weights.as_mut()?);
    designed(&robot)
}

fn model(edit: impl FnOnce(&mut RobotModel)) -> Option<BalanceController> {
    let mut robot = paper();
    edit(&mut robot);
    designed(&robot)
}

fn preset(number: usize) -> Option<BalanceController> {
    let (name, text) = presets::ALL[number];
    designed(Model::from_toml(text, name).unwrap().robot().unwrap())
}

fn scaled(factor: f64) -> Option<BalanceController> {
    model(|_| {}).map(|good| BalanceController { gain: good.gain * factor, ..good })
}

fn friction(coulomb_nm: f64) -> [Option<Stribeck>; 2] {
    let curve = StribeckParameters {
        coulomb_nm,
        static_nm: coulomb_nm,
        viscous_nm_s_rad: 0.0,
        stribeck_speed_rad_s: 1.0,
        stribeck_exponent: 1.0,
        offset_nm: 0.0,
    };
    [Some(Stribeck::new(curve).unwrap()); 2]
}

/// The slowest pole dragged to the right half plane.
fn dragged() -> Option<BalanceController> {
    let robot = paper();
    let (linear, timing) = (robot.parameters.linear_model(), SampledLoop::of(&robot));
    let gain = controller(&robot, ControllerKind::Lqr).gain;
    let from = sampled_poles(&linear, &gain, &timing)[0].s;
    let to = Complex::new(2.0, from.im);
    let placed = weights_for_pole(&linear, &timing, &robot.weights?, from, to);
    weights(|weights| *weights = placed.weights)
}

/// Gain margin of the good controller.
fn gain_up() -> f64 {
    let robot = paper();
    let gain = controller(&robot, ControllerKind::Lqr).gain;
    lqr::margins(&robot.parameters.linear_model(), &gain, &SampledLoop::of(&robot)).gain_up
}

type Edit = (&'static str, fn() -> Option<BalanceController>);

/// Slips and extremes of every number that reaches the controller.
const BAD_EDITS: [Edit; 32] = [
    ("Q of x is 1e30", || weights(|w| w.set_state_weight(0, 1e30))),
    ("Q of pitch is 1e30", || weights(|w| w.set_state_weight(2, 1e30))),
    ("Q of the pitch rate is 1e9", || weights(|w| w.set_state_weight(3, 1e9))),
    ("Q of x is 0", || weights(|w| w.set_state_weight(0, 0.0))),
    ("Q is 0", || weights(|w| w.q.fill(0.0))),
    ("Q of x is negative", || weights(|w| w.q[(0, 0)] = -5.0)),
    ("Q of pitch is NaN", || weights(|w| w.q[(2, 2)] = f64::NAN)),
    ("R is 1e-30", || weights(|w| w.r *= 1e-30)),
    ("R is 1e-6", || weights(|w| w.r *= 1e-6)),
    ("R is 1e9", || weights(|w| w.r *= 1e9)),
    ("R is 0", || weights(|w| w.r.fill(0.0))),
    ("R is negative", || weights(|w| w.r *= -1.0)),
    ("R of one motor is 1e6", || weights(|w| w.r[(0, 0)] = 1e6)),
    ("the light preset", || preset(1)),
    ("the tall preset", || preset(2)),
    ("a pole in the right half plane", dragged),
    ("K with the wrong sign", || scaled(-1.0)),
    ("K times 10", || scaled(10.0)),
    ("K times 0.2", || scaled(0.2)),
    ("K of zeros", || scaled(0.0)),
    ("K of NaN", || scaled(f64::NAN)),
    ("a mass in grams", || model(|r| r.parameters.body_mass_kg = 13_000.0)),
    ("a radius in centimetres", || model(|r| r.parameters.wheel_radius_m = 5.5)),
    ("a height in millimetres", || {
        model(|r| r.set_parameters(RobotParameters { com_height_m: 160.0, ..r.parameters }))
    }),
    ("friction of 30 N m", || model(|r| r.friction = friction(30.0))),
    ("friction of 0.5 N m", || model(|r| r.friction = friction(0.5))),
    ("half as much friction again, as a relay", || {
        model(|r| r.compensation = Some(Compensation { ratio: 1.5, smoothing_speed_rad_s: 1e-9 }))
    }),
    // As much as the gate allows.
    ("friction of 0.3 N m", || model(|r| r.friction = friction(0.3))),
    ("a gain margin of 3 dB", || scaled(gain_up() / (1.01 * gate::LEAST_GAIN_MARGIN))),
    ("a torque limit of 1e-6 N m", || model(|r| r.limits.torque_nm = Some(1e-6))),
    ("a yaw hold of 1e6 N m/rad", || {
        model(|r| r.yaw_hold = Some(YawHold { stiffness_nm_rad: 1e6, damping_nm_s_rad: 0.0 }))
    }),
    ("a torque gain of 20 %", || {
        let effect = Effect::new("torque_gain", MachineKind::Robot, None, [("gain", -0.8)]).unwrap();
        model(|r| r.effects = vec![effect])
    }),
];

/// Every bad edit in a row, each for 3 s: what comes through is gentle enough that the robot stands.
#[test]
fn a_driven_robot_stands_through_every_bad_edit() {
    for kind in [ControllerKind::Lqr, ControllerKind::Flqr] {
        let mut rig = Rig::balancing(&paper(), kind, DriveSettings::default(), 7);
        rig.arm();
        assert_eq!(rig.run(3.0), None);
        let (mut applied, mut refused) = (0, 0);
        for (name, edit) in BAD_EDITS {
            let Some(new) = edit() else { continue };
            let events = rig.step(&[DriveOrder::Controller(Box::new(new))]).events.clone();
            match &events[..] {
                [DriveEvent::Note("new gains applied")] => applied += 1,
                [DriveEvent::Warning(text)] if text.contains("the previous ones remain active") => {
                    refused += 1
                }
                other => panic!("{name}: {other:?}"),
            }
            let mut largest_rad: f64 = 0.0;
            for _ in 0..3000 {
                rig.step(&[]);
                largest_rad = largest_rad.max(rig.robot.state().pitch_rad.abs());
            }
            assert_eq!(rig.drive.stage(), Stage::Driving, "{name}");
            assert!(largest_rad < 0.25, "{name}: {largest_rad} rad");
        }
        assert!(refused >= 15 && applied >= 2, "{refused} refused, {applied} applied");
    }
}

#[test]
fn the_gate_names_what_is_wrong() {
    let robot = paper();
    let good = controller(&robot, ControllerKind::Flqr);
    let judged = |new: &BalanceController| gate::judge(&robot, &good.gain, new);
    assert_eq!(judged(&good), Verdict::Accept);
    let slower = BalanceController { gain: good.gain * 0.9, ..good.clone() };
    assert_eq!(judged(&slower), Verdict::Accept);
    let refusal = |edit: fn() -> Option<BalanceController>| match judged(&edit().unwrap()) {
        Verdict::Refuse(refusal) => refusal,
        other => panic!("{other:?}"),
    };
    assert!(matches!(refusal(|| scaled(-1.0)), Refusal::Unstable { .. }));
    assert!(matches!(refusal(|| scaled(f64::INFINITY)), Refusal::NotFinite { motor: "left", state: "x" }));
    let friction = refusal(|| model(|r| r.friction = friction(0.5)));
    assert!(
        matches!(friction, Refusal::Feedforward { excess_nm, .. } if (0.3..0.5).contains(&excess_nm)),
        "{friction}"
    );
    for (stiffness_nm_rad, damping_nm_s_rad) in [(1e6, 0.0), (1e4, 10.0), (0.0, 1e3), (f64::INFINITY, 0.0)] {
        let hold =
            BalanceController { yaw_hold: YawHold { stiffness_nm_rad, damping_nm_s_rad }, ..good.clone() };
        assert!(matches!(judged(&hold), Verdict::Refuse(Refusal::YawHold { .. })), "{hold:?}");
    }
    let free = YawHold { stiffness_nm_rad: 0.0, damping_nm_s_rad: 0.0 };
    assert_eq!(judged(&BalanceController { yaw_hold: free, ..good.clone() }), Verdict::Accept);
    let text = refusal(|| weights(|w| w.set_state_weight(0, 1e30))).to_string();
    assert!(text.starts_with("the loop is unstable with its sampling and 4.0 ms of delay"), "{text}");
}

#[test]
fn a_gain_that_changes_by_more_than_a_factor_of_2_is_asked_about() {
    let robot = paper();
    let good = controller(&robot, ControllerKind::Lqr);
    // The pole pair of x is moved alone: the loop stays well damped.
    let mut current = good.gain;
    for (factor, is_asked) in [(1.9, false), (2.1, true), (0.55, false), (0.45, true), (-1.0, true)] {
        current.copy_from(&good.gain);
        current[(1, 0)] = good.gain[(1, 0)] / factor;
        match gate::judge(&robot, &current, &good) {
            Verdict::Accept => assert!(!is_asked, "{factor}"),
            Verdict::Ask(changes) => {
                assert!(
                    is_asked && matches!(&changes[..], [only] if (only.motor, only.state) == ("right", "x"))
                );
            }
            Verdict::Refuse(refusal) => panic!("{refusal}"),
        }
    }
    let zeros = Matrix2x4::zeros();
    assert!(matches!(gate::judge(&robot, &zeros, &good), Verdict::Ask(changes) if changes.len() == 8));
}

/// The presets meet the least margins; with more delay than the loop tolerates the same robot is not driven at all.
#[test]
fn a_delay_that_the_loop_does_not_tolerate_is_refused_before_anything_is_sent() {
    for (name, text) in presets::ALL {
        let robot = Model::from_toml(text, name).unwrap().robot().unwrap().clone();
        assert_eq!(gate::check(&robot, &designed(&robot).unwrap()), Ok(()), "{name}");
    }
    let mut robot = paper();
    robot.actuation.delay_s = 0.060;
    let drive = Drive::new(&robot, designed(&robot).unwrap(), Excitation::Balance, DriveSettings::default());
    assert!(matches!(drive, Err(DriveError::Gains(Refusal::Unstable { .. }))), "{:?}", drive.err());
}

#[test]
fn a_stop_by_the_operator_and_new_gains_are_worded_as_such() {
    let mut rig = Rig::balancing(&paper(), ControllerKind::Lqr, DriveSettings::default(), 3);
    rig.arm();
    let events = rig.step(&[DriveOrder::Controller(Box::new(scaled(0.95).unwrap()))]).events.clone();
    assert_eq!(events.iter().map(ToString::to_string).collect::<Vec<_>>(), ["new gains applied"]);
    rig.step(&[DriveOrder::Stop]);
    assert_eq!(rig.drive.stage(), Stage::Stopped(StopReason::Requested));
    assert_eq!(StopReason::Requested.to_string(), "stop command from the operator");
}

#[test]
fn limits_that_are_switched_off_are_listed_as_checking_begins() {
    let mut robot = paper();
    robot.safety.tilt_rad = 3.0;
    robot.safety.allow_unsafe = true;
    let mut rig = Rig::balancing(&robot, ControllerKind::Lqr, DriveSettings::default(), 3);
    let events = rig.step(&[DriveOrder::Check]).events.clone();
    let warns = |event: &DriveEvent| matches!(event, DriveEvent::Warning(text) if text.starts_with("tilt_rad = 3 in [safety]"));
    assert_eq!(events.iter().filter(|event| warns(event)).count(), 1, "{events:?}");
}
