//! Gains on their way to a driven robot: what is asked, what is refused, and what reaches it.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use std::sync::Arc;

use common::script::{GOOD, Script, arm, at_stage, connecting_window, drive_window, tell};
use common::{SIZE, TempFile, Window, click, closes, enter, open, options, state, until};
use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use flqr_core::control::{
    BalanceController,
    drive::{DriveOrder, Stage, StopReason},
    gate,
};
use flqr_core::model::{Model, RobotModel};
use flqr_gui::{Tab, WindowOptions};
use serde_json::Value;

/// The controllers that were sent since the last call.
fn controllers(script: &Script) -> Vec<BalanceController> {
    let controller = |order| match order {
        DriveOrder::Controller(controller) => Some(*controller),
        _ => None,
    };
    script.drive_orders().into_iter().filter_map(controller).collect()
}

fn gains(window: &Window) -> Value {
    state(window)["robot_tab"]["gains"].clone()
}

/// Driving, on the page of the weights.
fn driven(script: &Script) -> Window {
    let mut window = drive_window(script);
    arm(&mut window, script);
    click(&mut window, "Tune");
    window
}

fn robot() -> RobotModel {
    Model::from_toml(common::ROBOT, "test.toml").unwrap().robot().unwrap().clone()
}

#[test]
fn a_driven_robot_gets_new_gains_on_request() {
    let script = Script::default();
    let mut window = driven(&script);
    enter(&mut window, "pitch weight", "150");
    assert_eq!(controllers(&script), [], "nothing is sent by itself");
    assert_eq!(gains(&window)["pending"], "accept");
    window.get_by_label("The robot uses other gains");
    click(&mut window, "Apply to robot");
    let sent = controllers(&script);
    let [controller] = &sent[..] else { panic!("{sent:?}") };
    assert_eq!(state(&window)["gain"][0][2].as_f64(), Some(controller.gain[(0, 2)]));
    assert_eq!(gains(&window)["pending"], Value::Null);
    assert!(window.query_by_label("Apply to robot").is_none(), "there is nothing left to apply");
    assert!(state(&window)["message"].as_str().unwrap().starts_with("New gains applied"));
    // Without friction feedforward: the same way.
    click(&mut window, "LQR");
    assert_eq!(controllers(&script), []);
    window.get_by_label("The friction feedforward also changes.");
    click(&mut window, "Apply to robot");
    assert_eq!(controllers(&script)[0].feedforward, [None; 2]);
}

#[test]
fn a_large_change_needs_a_confirmation_and_an_unstable_one_is_refused() {
    let script = Script::default();
    let mut window = driven(&script);
    enter(&mut window, "displacement weight", "600");
    assert_eq!(gains(&window)["pending"], "ask");
    click(&mut window, "Apply to robot");
    assert_eq!(state(&window)["question"], "gains");
    click(&mut window, "Keep the gains");
    assert_eq!((controllers(&script), gains(&window)["pending"].as_str()), (Vec::new(), Some("ask")));
    click(&mut window, "Apply to robot");
    click(&mut window, "Apply them");
    assert_eq!(controllers(&script).len(), 1);

    enter(&mut window, "pitch weight", "1e30");
    assert_eq!(gains(&window)["pending"], "refuse");
    window.get_by_label_contains("Not applied, the previous gains remain active. The loop is unstable");
    click(&mut window, "Apply to robot");
    assert_eq!(controllers(&script), []);
}

#[test]
fn live_gains_follow_up_to_a_factor_of_2_from_those_that_were_agreed_to() {
    let script = Script::default();
    let mut window = drive_window(&script);
    click(&mut window, "live");
    arm(&mut window, &script);
    click(&mut window, "Tune");
    let start = gains(&window)["gain"][0].as_f64().unwrap();
    let mut last = start;
    // In steps of which each is small, the gain of x is let go only to twice its value.
    for step in 1..=12 {
        enter(&mut window, "displacement weight", &format!("{}", 60.0 * 1.3_f64.powi(step)));
        for controller in controllers(&script) {
            last = controller.gain[(0, 0)];
        }
    }
    assert!((1.7..=2.0).contains(&(last / start)), "{}", last / start);
    assert_eq!(gains(&window)["pending"], "ask");
    // The question compares with the gains at arming, which are no longer those of the robot.
    click(&mut window, "Apply to robot");
    window.get_by_label("confirmed");
    window.get_by_label_contains("from the last confirmed gains");
}

#[test]
fn a_robot_that_is_not_driven_has_the_gains_of_the_design_unless_they_are_refused() {
    let script = Script::default();
    let mut window = drive_window(&script);
    click(&mut window, "Tune");
    script.drive_orders();
    enter(&mut window, "displacement weight", "600");
    assert_eq!(controllers(&script).len(), 1);
    enter(&mut window, "pitch weight", "1e30");
    assert_eq!((controllers(&script), gains(&window)["pending"].as_str()), (Vec::new(), Some("refuse")));
    enter(&mut window, "pitch weight", "100");
    assert_eq!(gains(&window)["pending"], Value::Null, "the robot has these");
    // What waited while the robot was driven is there once it is not.
    tell(&mut window, &script, at_stage(1.0, Stage::Driving, GOOD));
    enter(&mut window, "pitch weight", "130");
    assert_eq!(controllers(&script), []);
    tell(&mut window, &script, at_stage(2.0, Stage::Stopped(StopReason::Requested), &[]));
    assert_eq!(controllers(&script).len(), 1);
    assert_eq!(gains(&window)["pending"], Value::Null);
}

#[test]
fn a_design_that_is_edited_while_the_window_connects_reaches_the_robot() {
    let script = Script::default();
    script.with(|shared| shared.holds_opening = true);
    let mut window = connecting_window(&script);
    until(&mut window, "opening", |_| script.with(|shared| shared.opened.len() == 1));
    click(&mut window, "Tune");
    let start = gains(&window)["gain"][2].clone();
    enter(&mut window, "pitch weight", "150");
    assert_eq!(gains(&window)["gain"][2], start, "nothing has been sent");
    script.with(|shared| shared.holds_opening = false);
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    let sent = controllers(&script);
    let [controller] = &sent[..] else { panic!("{sent:?}") };
    let now = state(&window);
    assert_eq!(now["gain"][0][2].as_f64(), Some(controller.gain[(0, 2)]));
    assert_eq!(now["robot_tab"]["gains"]["gain"][2], now["gain"][0][2]);
    assert_ne!(now["gain"][0][2], start);
}

/// Whatever is typed, manually or live, only gains that the gate lets through are sent.
#[test]
fn no_bad_edit_reaches_a_driven_robot() {
    let edits = [
        ("displacement weight", "1e30"),
        ("displacement weight", "0"),
        ("displacement weight", "-5"),
        ("pitch weight", "NaN"),
        ("pitch weight", "1e30"),
        ("pitch rate weight", "1e12"),
        ("velocity weight", "-1e300"),
        ("left torque weight", "1e-30"),
        ("left torque weight", "0"),
        ("left torque weight", "-1"),
        ("left torque weight", "1e30"),
        ("pitch deviation", "1e-9"),
        ("displacement deviation", "0"),
        ("body mass value", "13000"),
        ("wheel radius value", "10"),
        ("centre of mass value", "250"),
        ("gravity value", "1e-6"),
        ("torque limit value", "1e-9"),
        ("Coulomb friction left", "30"),
        ("static friction left", "1e30"),
        ("compensation ratio", "99"),
        ("smoothing speed", "1e-12"),
    ];
    for live in [false, true] {
        let script = Script::default();
        let mut window = drive_window(&script);
        if live {
            click(&mut window, "live");
        }
        arm(&mut window, &script);
        click(&mut window, "Tune");
        let (robot, mut sent) = (robot(), 0);
        for (label, text) in edits {
            if window.query_by_label(label).is_none() {
                assert_eq!(label, "torque limit value", "a field is missing");
                click(&mut window, "torque limit");
            }
            enter(&mut window, label, text);
            if window.query_by_label("Apply to robot").is_some() {
                click(&mut window, "Apply to robot");
            }
            if state(&window)["question"] == "gains" {
                click(&mut window, "Apply them");
            }
            for controller in controllers(&script) {
                assert_eq!(gate::check(&robot, &controller), Ok(()), "{label} = {text}");
                sent += 1;
            }
            window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
            window.run_steps(3);
        }
        assert!(sent > 0, "some of them are harmless");
    }
}

#[test]
fn escape_stops_the_robot_and_discards_what_was_typed() {
    let script = Script::default();
    let mut window = driven(&script);
    let before = state(&window)["q_diagonal"].clone();
    window.get_by_label("pitch weight").click();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.event(Event::Text("1e30".to_owned()));
    window.run_steps(2);
    window.key_press(Key::Escape);
    window.run_steps(4);
    assert_eq!(script.drive_orders(), [DriveOrder::Stop]);
    assert_eq!(state(&window)["q_diagonal"], before);
}

#[test]
fn closing_the_window_asks_while_the_robot_is_driven() {
    let script = Script::default();
    let mut window = driven(&script);
    assert!(!closes(&mut window));
    assert_eq!(state(&window)["question"], "leave-driven");
    click(&mut window, "Cancel");
    assert_eq!(script.drive_orders(), []);
    assert!(!closes(&mut window));
    click(&mut window, "Stop and close");
    assert_eq!(script.drive_orders().first(), Some(&DriveOrder::Stop));
    until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
    assert!(closes(&mut window), "nothing is driven or unsaved");
}

#[test]
fn disconnecting_sends_a_stop_only_to_a_robot_that_is_driven() {
    for (stage, orders) in [
        (Stage::Listening, &[][..]),
        (Stage::Checking, &[]),
        (Stage::Driving, &[DriveOrder::Stop]),
        (Stage::Stopped(StopReason::Requested), &[]),
    ] {
        let script = Script::default();
        let mut window = drive_window(&script);
        tell(&mut window, &script, at_stage(0.5, stage, GOOD));
        script.drive_orders();
        click(&mut window, "Disconnect");
        until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
        assert_eq!(script.drive_orders(), orders, "{stage:?}");
    }
}

#[test]
fn another_model_is_not_taken_while_the_robot_is_driven() {
    let script = Script::default();
    let mut window = driven(&script);
    let file = TempFile::new("other.toml", &common::ROBOT.replace("Test robot", "Other"));
    enter(&mut window, "model path", file.name());
    let refused = until(&mut window, "refusal", |s| {
        s["message"].as_str().is_some_and(|message| message.contains("Stop it before you load another model"))
    });
    assert_eq!((&refused["model"], &refused["robot_tab"]["session"]), (&"Test robot".into(), &"open".into()));
    click(&mut window, "simulated");
    let refused = state(&window);
    assert!(refused["message"].as_str().unwrap().contains("Stop it before you change the source"));
    assert_eq!(refused["source"], "emulated");
    assert!(script.drive_orders().is_empty());
}

#[test]
fn limits_that_are_switched_off_are_shown_by_the_arm_button_and_unit_slips_by_the_model() {
    let text = format!("{}[safety]\ntilt_rad = 3.0\nallow_unsafe = true\n", common::ROBOT)
        .replace("wheel_radius_m = 0.1", "wheel_radius_m = 100.0");
    let script = Script::default();
    let model = Model::from_toml(&text, "test.toml").unwrap();
    let window_options = WindowOptions { model, devices: Arc::new(script.clone()), ..options(Tab::Robot) };
    let mut window = open(window_options, SIZE);
    let message = state(&window)["message"].as_str().unwrap().to_owned();
    assert!(
        message.starts_with("robot.wheel_radius_m: 100 looks like millimetres: 100 mm is 0.1 m"),
        "{message}"
    );
    click(&mut window, "emulated");
    click(&mut window, "May drive");
    click(&mut window, "Connect");
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    window.get_by_label_contains("Tilt_rad = 3 in [safety] disables this check");
    click(&mut window, "Tune");
    window.get_by_label_contains("robot.wheel_radius_m: 100 looks like millimetres");
}
