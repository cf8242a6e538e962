//! The robot page and the strip under the tabs, driven with a robot that follows a script.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use std::sync::Arc;
use std::time::Duration;

use common::script::*;
use common::{
    SIZE, TempFile, Window, click, closes, command, enter, next, open, options, random_input, state, until,
};
use egui::accesskit::Role;
use egui::{Event as Input, Key, Modifiers, Vec2, vec2};
use egui_kittest::{Node, kittest::Queryable};
use flqr_core::control::drive::{CheckResult, DriveOrder, Excitation, Stage, StopReason};
use flqr_core::device::{
    Advice, Connection, DriveStatus, Event, EventKind, RecordingStatus, SessionMode, SessionOrder, Source,
    Update,
};
use flqr_core::link::{Direction, Frame, FrameId, StampedFrame};
use flqr_core::model::Motor;
use flqr_core::record::Sample;
use flqr_gui::{Tab, WindowOptions};
use serde_json::Value;

#[test]
fn a_robot_is_listened_to_from_the_command_line_and_nothing_is_sent() {
    let script = Script::default();
    let mut window = script_window(Tab::Robot, &script, "can:can0");
    let opened = script.with(|shared| shared.opened.clone());
    assert_eq!(opened.len(), 1);
    assert_eq!(opened[0].source, Source::Can { interface: "can0".to_owned() });
    assert_eq!(opened[0].mode, SessionMode::Listen);
    let mut first = update(0.2);
    first.samples = rows(0.0, 200);
    first.frames = vec![frame(0.1, 0x141, 0x9C)];
    tell(&mut window, &script, first);
    let now = state(&window);
    assert_eq!((&now["source"], &now["tab"]), (&"can".into(), &"robot".into()));
    let robot = &now["robot_tab"];
    assert_eq!((&robot["stage"], &robot["connection"]), (&"listening".into(), &"connected".into()));
    assert_eq!((&robot["rows"], &robot["frames_shown"]), (&200.into(), &1.into()));
    window.get_by_label("Listening only: nothing is sent.");
    assert!(window.query_by_label("STOP").is_none(), "there is nothing to stop");
    assert!(window.query_by_label("2  Arm").is_none());
    for key in [Key::Space, Key::Escape] {
        window.key_press(key);
        window.step();
    }
    assert_eq!(script.drive_orders(), []);
}

#[test]
fn a_refused_connection_is_reported_with_its_remedy() {
    let script = Script::default();
    let problem = "can7 does not exist: make it with `ip link add can7 type vcan`";
    script.with(|shared| shared.refuse = Some(problem.to_owned()));
    let window_options = WindowOptions {
        devices: Arc::new(script.clone()),
        source: Some("can:can7".parse().unwrap()),
        ..options(Tab::Robot)
    };
    let mut window = open(window_options, SIZE);
    let refused = until(&mut window, "refusal", |s| s["robot_tab"]["message"].is_string());
    assert!(refused["message"].as_str().unwrap().contains("ip link add can7"), "{refused:#}");
    assert_eq!(refused["robot_tab"]["session"], "closed");
    script.with(|shared| shared.refuse = None);
    click(&mut window, "Connect");
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    assert!(state(&window)["robot_tab"]["message"].is_null());
}

#[test]
fn interfaces_are_listed_and_chosen_and_without_any_the_commands_are_shown() {
    let script = Script::default();
    let command = "sudo ip link set can0 up type can bitrate 1000000";
    let advice =
        |command: &str| Advice { purpose: "an adapter".to_owned(), commands: vec![command.to_owned()] };
    script.with(|shared| shared.advice = vec![advice(command), advice("flqr monitor emulated")]);
    let window_options = WindowOptions { devices: Arc::new(script.clone()), ..options(Tab::Robot) };
    let mut window = open(window_options, SIZE);
    click(&mut window, "CAN");
    until(&mut window, "the list", |s| s["robot_tab"]["interfaces"].is_object());
    window.run_steps(2);
    window.get_by_label(command);
    assert!(window.query_by_label("flqr monitor emulated").is_none(), "the window does that by itself");
    window.get_by_label("Copy").click();
    let mut copied = Vec::new();
    for _ in 0..3 {
        window.step();
        copied.extend(window.output().platform_output.commands.clone());
    }
    assert!(
        copied.iter().any(|output| matches!(output, egui::OutputCommand::CopyText(text) if text == command)),
        "{copied:?}"
    );

    script.with(|shared| {
        shared.can = vec![can("can0", Some("sudo ip link set can0 up")), can("vcan0", None)];
        shared.serial = vec![usb("/dev/ttyUSB0")];
    });
    click(&mut window, "Refresh");
    until(&mut window, "the list", |s| s["robot_tab"]["interfaces"]["can"][1]["name"] == "vcan0");
    window.run_steps(2);
    window.get_by_label("up, 500 kbit/s, 0 errors");
    window.get_by_label("sudo ip link set can0 up");
    click(&mut window, "vcan0");
    assert!(window.query_by_label("sudo ip link set can0 up").is_none(), "the chosen one is up");
    click(&mut window, "/dev/ttyUSB0");
    enter(&mut window, "baud rate of the IMU", "921600");
    click(&mut window, "Connect");
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    let opened = script.with(|shared| shared.opened[0].clone());
    assert_eq!(opened.source, Source::Can { interface: "vcan0".to_owned() });
    let imu = opened.imu.unwrap();
    assert_eq!((&*imu.port, imu.baud), ("/dev/ttyUSB0", 921_600));
}

#[test]
fn an_incomplete_form_is_reported_and_does_not_connect() {
    let script = Script::default();
    let window_options = WindowOptions { devices: Arc::new(script.clone()), ..options(Tab::Robot) };
    let mut window = open(window_options, SIZE);
    click(&mut window, "SLCAN");
    window.get_by_label_contains("The adapter's port is empty");
    enter(&mut window, "port of the adapter", "/dev/ttyACM0");
    enter(&mut window, "bit rate of the CAN bus", "fast");
    window.get_by_label_contains("The bit rate must be a whole number above 0");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    assert_eq!(script.with(|shared| shared.opened.len()), 0);
    enter(&mut window, "bit rate of the CAN bus", "500 000");
    click(&mut window, "Connect");
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    let source = script.with(|shared| shared.opened[0].source.clone());
    assert_eq!(source, Source::Slcan { port: "/dev/ttyACM0".to_owned(), bit_rate: 500_000 });
}

#[test]
fn arming_takes_two_steps_and_all_checks() {
    let script = Script::default();
    let mut window = drive_window(&script);
    let options = script.with(|shared| shared.opened[0].clone());
    assert!(matches!(options.mode, SessionMode::Drive { excitation: Excitation::Balance, .. }));
    script.drive_orders();
    click(&mut window, "2  Arm");
    assert_eq!(script.drive_orders(), [], "not from listening");
    click(&mut window, "1  Check");
    assert_eq!(script.drive_orders(), [DriveOrder::Check]);
    for result in [CheckResult::Waiting, CheckResult::Failed] {
        let checks = [GOOD[0], ("IMU", result, "mounted the other way round: set pitch_direction")];
        tell(&mut window, &script, at_stage(0.3, Stage::Checking, &checks));
        window.get_by_label_contains("set pitch_direction");
        click(&mut window, "2  Arm");
        assert_eq!(script.drive_orders(), [], "{result:?}");
        assert_eq!(state(&window)["robot_tab"]["may_arm"], false);
    }
    assert_eq!(state(&window)["message"], "Checking: querying the motors, without torque.");
    tell(&mut window, &script, at_stage(0.4, Stage::Checking, &[]));
    assert_eq!(state(&window)["robot_tab"]["may_arm"], false, "nothing has been checked");
    tell(&mut window, &script, at_stage(0.5, Stage::Checking, GOOD));
    click(&mut window, "2  Arm");
    assert_eq!(script.drive_orders(), [DriveOrder::Arm]);
    tell(&mut window, &script, at_stage(1.0, Stage::Driving, GOOD));
    assert_eq!(window.get_all_by_label("Driving").count(), 2, "strip and page");
    assert_eq!(state(&window)["robot_tab"]["stage"], "driving");
}

#[test]
fn stop_is_in_reach_on_every_tab_and_its_reason_is_shown() {
    let script = Script::default();
    let mut window = drive_window(&script);
    for tab in ["Tune", "Friction", "Experiments", "Robot"] {
        click(&mut window, tab);
        arm_by_orders(&mut window, &script);
        window.get_all_by_label("STOP").next().unwrap().click();
        window.run_steps(3);
        assert_eq!(script.drive_orders(), [DriveOrder::Stop], "{tab}");
    }
    let reason = StopReason::MotorSilent { motor: Motor::Left, silent_s: 0.02 };
    tell(&mut window, &script, at_stage(2.0, Stage::Stopped(reason), &[]));
    let now = state(&window);
    assert_eq!(now["robot_tab"]["stage"], "stopped");
    assert_eq!(now["robot_tab"]["stop_reason"], "motor_silent");
    assert!(window.get_all_by_label_contains("check its cable").count() >= 2, "strip and page");
    click(&mut window, "Release the stop");
    assert_eq!(script.drive_orders(), [DriveOrder::Release]);
}

#[test]
fn stop_is_in_reach_of_the_mouse_behind_the_palette_and_a_question() {
    for steps in [false, true] {
        let script = Script::default();
        let mut window = drive_window(&script);
        window.key_press_modifiers(Modifiers::COMMAND, Key::K);
        window.run_steps(3);
        arm_by_orders(&mut window, &script);
        window.run_steps(2);
        assert!(window.query_by_label("command").is_none(), "the palette closes by itself");
        if steps {
            command(&mut window, "steps");
            assert_eq!(state(&window)["question"], "steps");
        } else {
            window.key_press_modifiers(Modifiers::COMMAND, Key::K);
            window.run_steps(3);
        }
        // The one in the middle of the window; the strip's is behind the palette or the question.
        let from_middle = |stop: &Node<'_>| (stop.rect().center().x - 0.5 * SIZE.x).abs();
        let nearest = |a: &Node<'_>, b: &Node<'_>| from_middle(a).total_cmp(&from_middle(b));
        window.get_all_by_label("STOP").min_by(nearest).unwrap().click();
        window.run_steps(3);
        assert_eq!(script.drive_orders(), [DriveOrder::Stop], "a question: {steps}");
    }
}

/// Driving, whatever the tab.
fn arm_by_orders(window: &mut Window, script: &Script) {
    tell(window, script, at_stage(1.0, Stage::Driving, GOOD));
    script.drive_orders();
}

#[test]
fn space_and_escape_stop_whatever_has_the_focus() {
    let script = Script::default();
    let mut window = drive_window(&script);
    arm(&mut window, &script);
    for key in [Key::Space, Key::Escape] {
        window.get_by_label("recording to write").click();
        window.run_steps(2);
        let field = |window: &Window| window.get_by_label("recording to write").value().unwrap();
        let before = field(&window);
        window.key_press(key);
        if key == Key::Space {
            window.event(Input::Text(" ".to_owned()));
        }
        window.run_steps(2);
        let orders = script.drive_orders();
        assert!(
            !orders.is_empty() && orders.iter().all(|order| *order == DriveOrder::Stop),
            "{key:?}: {orders:?}"
        );
        assert_eq!(field(&window), before, "{key:?} was typed");
    }
}

#[test]
fn space_does_not_press_the_focused_button_while_it_stops() {
    let script = Script::default();
    let mut window = drive_window(&script);
    arm(&mut window, &script);
    window.get_by_label("Disconnect").focus();
    window.run_steps(2);
    window.key_press(Key::Space);
    window.run_steps(3);
    assert_eq!(script.drive_orders(), [DriveOrder::Stop]);
    assert_eq!(state(&window)["robot_tab"]["session"], "open");
    // Stopped, the key belongs to the button again.
    tell(&mut window, &script, at_stage(2.0, Stage::Stopped(StopReason::Requested), &[]));
    std::thread::sleep(Duration::from_millis(350));
    tell(&mut window, &script, at_stage(2.1, Stage::Stopped(StopReason::Requested), &[]));
    window.key_press(Key::Space);
    window.run_steps(3);
    until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
}

#[test]
fn keys_stop_as_soon_as_arming_is_commanded() {
    let script = Script::default();
    let mut window = drive_window(&script);
    script.drive_orders();
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(script.drive_orders(), [], "listening: Esc has its usual meaning");
    click(&mut window, "1  Check");
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(script.drive_orders(), [DriveOrder::Check, DriveOrder::Stop], "no update has come yet");
}

#[test]
fn closing_a_session_stops_the_robot() {
    let script = Script::default();
    let mut window = drive_window(&script);
    arm(&mut window, &script);
    click(&mut window, "Disconnect");
    until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
    assert_eq!(script.drive_orders(), [DriveOrder::Stop]);
    assert!(script.with(|shared| shared.closed));

    let other = Script::default();
    drop(drive_window(&other));
    assert!(other.with(|shared| shared.closed), "with the window");
}

#[test]
fn a_session_that_ends_unexpectedly_is_reported() {
    let script = Script::default();
    let mut window = drive_window(&script);
    arm(&mut window, &script);
    script.with(|shared| shared.died = true);
    let ended = until(&mut window, "the end", |s| s["robot_tab"]["session"] == "closed");
    assert!(ended["message"].as_str().unwrap().contains("Switch the robot off manually"), "{ended:#}");
    assert_eq!(ended["robot_tab"]["stage"], "disconnected");
    assert!(end(&mut window).unwrap().contains("internal error"));
}

/// Ends the window as its library does; returns the problem for the exit code.
fn end(window: &mut Window) -> Option<String> {
    window.state_mut().as_mut().unwrap().end()
}

#[test]
fn a_stopped_robot_is_not_left_before_its_motors_have_confirmed_that_they_are_off() {
    let script = Script::default();
    let mut window = drive_window(&script);
    arm_by_orders(&mut window, &script);
    let reason = StopReason::Tilt { pitch_rad: 0.6 };
    tell(&mut window, &script, not_off(2.0, reason));
    assert_eq!(state(&window)["robot_tab"]["motors_off"], false);
    assert_eq!(window.get_all_by_label("Motors not confirmed off").count(), 3, "strip, drive and page");
    assert!(window.get_all_by_label_contains("switch off their supply").count() >= 2);
    assert!(window.query_by_label("Release the stop").is_none(), "it would be refused");
    click(&mut window, "simulated");
    let refused = state(&window);
    assert!(refused["message"].as_str().unwrap().contains("have not confirmed that they are off"));
    assert_eq!(refused["source"], "emulated");
    assert!(!closes(&mut window));
    assert_eq!(state(&window)["question"], "leave-driven");
    click(&mut window, "Cancel");
    window.key_press(Key::Space);
    window.run_steps(2);
    assert_eq!(script.drive_orders(), [DriveOrder::Stop]);
    tell(&mut window, &script, at_stage(2.1, Stage::Stopped(reason), &[]));
    assert!(window.query_by_label("Motors not confirmed off").is_none());
    window.get_by_label("Release the stop");
    assert!(closes(&mut window));
    assert_eq!(end(&mut window), None);
}

#[test]
fn motors_that_are_not_confirmed_off_at_the_end_of_a_session_are_reported_and_fail_the_program() {
    for disconnects in [true, false] {
        let script = Script::default();
        script.with(|shared| shared.motors_stay_on = true);
        let mut window = drive_window(&script);
        arm(&mut window, &script);
        if disconnects {
            click(&mut window, "Disconnect");
            let ended = until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
            window.run_steps(2);
            assert!(ended["message"].as_str().unwrap().contains("switch off their supply"), "{ended:#}");
            assert!(
                window.get_all_by_label_contains("switch off their supply").count() >= 2,
                "strip and page"
            );
        }
        let problem = end(&mut window).unwrap();
        assert_eq!(problem, "the motors have not confirmed that they are off: switch off their supply");
        assert!(script.with(|shared| shared.closed));
    }
    // The next session ends well.
    let script = Script::default();
    script.with(|shared| shared.motors_stay_on = true);
    let mut window = drive_window(&script);
    click(&mut window, "Disconnect");
    until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
    script.with(|shared| shared.motors_stay_on = false);
    window.run_steps(2);
    click(&mut window, "Connect");
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    assert_eq!(end(&mut window), None);
}

#[test]
fn a_recording_that_fails_at_the_end_of_its_session_is_reported() {
    let script = Script::default();
    let mut window = drive_window(&script);
    let problem = Some("7 rows were not recorded: use a faster disk".to_owned());
    script.with(|shared| shared.recording = Some(RecordingStatus { problem, ..recording() }));
    click(&mut window, "Disconnect");
    let ended = until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
    assert_eq!(ended["message"], "7 rows were not recorded: use a faster disk.");
}

#[test]
fn a_cancelled_connection_holds_its_port_until_it_is_closed_and_the_next_one_waits_for_it() {
    let script = Script::default();
    script.with(|shared| shared.holds_opening = true);
    let mut window = connecting_window(&script);
    until(&mut window, "opening", |_| script.with(|shared| shared.opened.len() == 1));
    click(&mut window, "Cancel");
    assert_eq!(state(&window)["robot_tab"]["session"], "closing");
    window.get_by_label("Disconnecting…");
    // The shortcut goes past the button.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    assert_eq!(state(&window)["robot_tab"]["session"], "opening");
    assert_eq!(script.with(|shared| shared.opened.len()), 1, "the port is still in use");
    script.with(|shared| shared.holds_opening = false);
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    assert!(script.with(|shared| shared.closed && shared.opened.len() == 2));
}

#[test]
fn the_live_plots_are_fed_from_the_robot_with_gaps_where_nothing_came() {
    let script = Script::default();
    let mut window = script_window(Tab::Tune, &script, "emulated");
    let mut first = update(1.0);
    first.samples = rows(0.0, 1000);
    // Half a second is missing; then rows without a number, and times that run back or are none.
    first.samples.extend(rows(1.5, 1000));
    first.samples.extend((0..300).map(|index| sample(2.5 + f64::from(index) * 1e-3, f64::NAN)));
    first.samples.extend([sample(1.0, 0.0), sample(f64::NAN, 0.0), sample(f64::INFINITY, 0.0)]);
    first.samples.extend(rows(2.8, 500));
    tell(&mut window, &script, first);
    let now = state(&window);
    assert_eq!(now["robot_tab"]["skipped_rows"], 3);
    assert!((now["robot_tab"]["end_s"].as_f64().unwrap() - 3.299).abs() < 1e-9, "{now:#}");
    assert_eq!(now["simulation"]["paused"], true);
    // Zoomed in and out, each piece is drawn for itself: a debug build panics at what is not finite.
    for delta in [400.0, 2000.0, -300.0, -5000.0] {
        window.hover_at(egui::Pos2::new(640.0, 260.0));
        common::wheel(&window, delta);
        window.run_steps(6);
    }
    click(&mut window, "Push");
    let pushed = script.with(|shared| shared.orders.clone());
    assert!(
        pushed.iter().any(|order| matches!(order, SessionOrder::Push { force_n: 20.0, .. })),
        "{pushed:?}"
    );
    click(&mut window, "rad");
    click(&mut window, "simulated");
    assert_eq!(state(&window)["source"], "simulated");
    assert!(script.with(|shared| shared.closed) || state(&window)["robot_tab"]["session"] != "open");
}

#[test]
fn everything_that_is_counted_is_shown() {
    let script = Script::default();
    let mut window = script_window(Tab::Robot, &script, "can:can0");
    let mut full = update(5.0);
    full.status.motors[1].health = Some(health(19.2, 0b1000_0101));
    full.events = vec![
        Event { time: Duration::from_secs(1), kind: EventKind::Note, text: "connected".to_owned() },
        Event { time: Duration::from_secs(2), kind: EventKind::Warning, text: "2 frames dropped".to_owned() },
        Event { time: Duration::from_secs(3), kind: EventKind::Stop, text: "the robot tilts".to_owned() },
    ];
    tell(&mut window, &script, full);
    for text in
        ["24.1 V", "19.2 V", "7", "19", "11", "12", "13", "14", "15", "123456", "8 µs / 60 µs", "1.3 ms"]
    {
        assert!(window.query_all_by_label(text).next().is_some(), "{text}");
    }
    window.get_by_label_contains("undervoltage, driver too hot, input signal lost");
    for text in
        ["2 frames dropped", "the robot tilts", "Left motor", "Right motor", "IMU", "Bus", "Loop jitter"]
    {
        assert!(window.query_all_by_label(text).next().is_some(), "{text}");
    }
    let robot = &state(&window)["robot_tab"];
    assert_eq!(robot["status"]["counters"]["dropped"], 11);
    assert_eq!(robot["last_event"], "the robot tilts");
    assert_eq!(state(&window)["message"], "2 frames dropped.");
}

#[test]
fn a_silent_and_a_lost_bus_are_said_with_the_hint() {
    let script = Script::default();
    let mut window = script_window(Tab::Robot, &script, "slcan:/dev/ttyACM0@1000000");
    for (connection, name, text) in [
        (Connection::Silent { hint: "is the bit rate right".to_owned() }, "silent", "is the bit rate right"),
        (Connection::Lost { reason: "unplugged".to_owned() }, "lost", "Reconnecting automatically"),
    ] {
        let mut told = update(1.0);
        told.status.connection = connection;
        tell(&mut window, &script, told);
        assert!(window.query_all_by_label_contains(text).next().is_some(), "{text}");
        assert_eq!(state(&window)["robot_tab"]["connection"], name);
    }
}

#[test]
fn frames_are_filtered_by_id_bytes_and_direction_and_held() {
    let script = Script::default();
    let mut window = script_window(Tab::Robot, &script, "can:can0");
    let mut told = update(1.0);
    told.frames =
        (0..90).map(|n| frame(f64::from(n) * 1e-3, 0x141 + (n % 3) as u16, 0x9A + (n % 2) as u8)).collect();
    tell(&mut window, &script, told.clone());
    let shown = |window: &Window| state(window)["robot_tab"]["frames_shown"].clone();
    assert_eq!(shown(&window), 90);
    enter(&mut window, "identifiers to show", "141 0x143");
    assert_eq!(shown(&window), 60);
    enter(&mut window, "bytes or text to show", "9b 20");
    assert_eq!(shown(&window), 30);
    click(&mut window, "tx");
    assert_eq!(shown(&window), 15);
    enter(&mut window, "identifiers to show", "left wheel");
    window.get_by_label_contains("is not an identifier");
    enter(&mut window, "identifiers to show", " ");
    click(&mut window, "Hold");
    let before = shown(&window);
    tell(&mut window, &script, told);
    assert_eq!(shown(&window), before);
}

fn recording() -> RecordingStatus {
    RecordingStatus {
        file: "/data/run7.csv".into(),
        rows: 1900,
        rows_lost: 0,
        frames: 7600,
        bytes: 1_250_000,
        problem: None,
    }
}

#[test]
fn a_recording_is_started_shown_and_ended() {
    let script = Script::default();
    let mut window = script_window(Tab::Robot, &script, "can:can0");
    tell(&mut window, &script, update(0.1));
    let suggested = window.get_by_label("recording to write").value().unwrap();
    assert!(suggested.starts_with("robot-20") && suggested.ends_with(".csv"), "{suggested}");
    enter(&mut window, "recording to write", "/data/run7");
    click(&mut window, "Record");
    let orders = script.with(|shared| std::mem::take(&mut shared.orders));
    assert!(orders.contains(&SessionOrder::Record(Some("/data/run7.csv".into()))), "{orders:?}");
    let mut told = update(2.0);
    told.status.recording = Some(recording());
    tell(&mut window, &script, told.clone());
    for text in ["REC", "1900", "7600", "1.25 MB"] {
        window.get_by_label(text);
    }
    click(&mut window, "Stop recording");
    let orders = script.with(|shared| std::mem::take(&mut shared.orders));
    assert!(orders.contains(&SessionOrder::Record(None)), "{orders:?}");
    let problem = Some("the disk is full: make room".to_owned());
    told.status.recording = Some(RecordingStatus { problem, ..recording() });
    tell(&mut window, &script, told);
    window.get_by_label("Recording stopped: the disk is full: make room");
    window.get_by_label("Record");
}

#[test]
fn a_replay_is_held_and_its_speed_set() {
    let script = Script::default();
    let mut window = script_window(Tab::Robot, &script, "replay:/data/run7.csv");
    tell(&mut window, &script, update(0.1));
    assert!(window.query_by_label("1  Check").is_none(), "there is nothing to drive");
    click(&mut window, "Pause");
    click(&mut window, "Run");
    window.key_press_modifiers(Modifiers::COMMAND, Key::P);
    window.run_steps(3);
    let orders = script.with(|shared| std::mem::take(&mut shared.orders));
    let pauses: Vec<_> = orders.iter().filter(|order| matches!(order, SessionOrder::Pause(_))).collect();
    assert_eq!(pauses, [&SessionOrder::Pause(true), &SessionOrder::Pause(false), &SessionOrder::Pause(true)]);
    window.get_by_role_and_label(Role::Slider, "replay speed").focus();
    window.run_steps(2);
    window.key_press(Key::ArrowRight);
    window.run_steps(3);
    let orders = script.with(|shared| std::mem::take(&mut shared.orders));
    assert!(
        orders.iter().any(|order| matches!(order, SessionOrder::ReplaySpeed(speed) if *speed > 1.0)),
        "{orders:?}"
    );
}

#[test]
fn a_recording_is_replayed_to_its_end() {
    let times = (0..300).map(|ms| format!("{:.3},0.1,0.2,0.03,0,1,2,3,4,5,6\n", f64::from(ms) * 1e-3));
    let text = format!("{}\n{}", Sample::COLUMNS.join(","), times.collect::<String>());
    let recording = TempFile::new("replay.csv", &text);
    let source = Some(format!("replay:{}", recording.name()).parse().unwrap());
    let mut window = open(WindowOptions { source, ..options(Tab::Robot) }, SIZE);
    let ended = until(&mut window, "the end", |s| s["robot_tab"]["connection"] == "ended");
    assert_eq!((&ended["robot_tab"]["rows"], &ended["robot_tab"]["skipped_rows"]), (&300.into(), &0.into()));
    assert!((ended["robot_tab"]["end_s"].as_f64().unwrap() - 0.299).abs() < 1e-9, "{ended:#}");
    assert_eq!(ended["robot_tab"]["last_event"], "end of the recording: 300 rows and 0 frames");
    window.get_by_label("end of the recording");
    // Once more from the form.
    click(&mut window, "Close");
    until(&mut window, "closing", |s| s["robot_tab"]["session"] == "closed");
    window.run_steps(2);
    click(&mut window, "Replay");
    until(&mut window, "the end", |s| s["robot_tab"]["connection"] == "ended");
    window.get_by_label("Close");
}

#[test]
fn another_robot_is_described_by_a_dbc_file() {
    let script = Script::default();
    let window_options = WindowOptions { devices: Arc::new(script.clone()), ..options(Tab::Robot) };
    let mut window = open(window_options, SIZE);
    click(&mut window, "CAN");
    click(&mut window, "Another robot (DBC file)");
    // The header opens over some frames.
    window.run_steps(20);
    enter(&mut window, "DBC file", "/data/other.dbc");
    window.get_by_label_contains("No signal of the DBC file is selected");
    enter(&mut window, "signals of the DBC file", "lean=Lean");
    window.get_by_label_contains("nknown column `lean`");
    enter(&mut window, "signals of the DBC file", "pitch=Body.Lean\nmotor_speed_left=Left*-1, torque_left=T");
    click(&mut window, "May drive");
    window.get_by_label_contains("can only be monitored");
    click(&mut window, "Listen only");
    click(&mut window, "Connect");
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    let opened = script.with(|shared| shared.opened.pop()).unwrap();
    let described = opened.dbc.unwrap();
    let signals = ["pitch_rad=Body.Lean", "motor_speed_left_rad_s=Left*-1", "torque_left_nm=T"];
    assert_eq!(described.file.to_str(), Some("/data/other.dbc"));
    assert_eq!(described.signals, signals.map(|text| text.parse().unwrap()));
}

#[test]
fn the_page_survives_any_size_and_any_stage() {
    for size in [Vec2::ZERO, vec2(1.0, 1.0), vec2(300.0, 200.0), vec2(1000.0, 640.0), vec2(1920.0, 1080.0)] {
        let script = Script::default();
        let window_options = WindowOptions {
            devices: Arc::new(script.clone()),
            source: Some(Source::Emulated),
            ..options(Tab::Robot)
        };
        let mut window = open(window_options, size);
        until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
        for stage in [Stage::Listening, Stage::Checking, Stage::Driving, Stage::Stopped(StopReason::BusDown)]
        {
            let mut told = at_stage(1.0, stage, GOOD);
            told.frames = (0..500).map(|n| frame(f64::from(n) * 1e-3, 0x141, 0x9C)).collect();
            told.samples = rows(0.0, 100);
            tell(&mut window, &script, told);
        }
    }
}

/// Anything may stand in what a robot tells.
fn random_update(seed: &mut u64, time_s: f64) -> Update {
    let mut number = |below: u64| next(seed) % below;
    let strange = [0.0, -1.0, 1e300, -1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-300];
    let mut told = update(time_s);
    let samples = number(300) as usize;
    told.samples = rows(time_s, samples);
    for _ in 0..number(4) {
        let (row, value) = (number(300) as usize, strange[number(8) as usize]);
        if let Some(row) = told.samples.get_mut(row) {
            (row.x_m, row.x_dot_m_s, row.pitch_rad) = (value, -value, value);
        }
    }
    if number(10) == 0 {
        told.samples.reverse();
    }
    told.frames = (0..number(Update::FRAMES as u64))
        .map(|n| {
            let frame = match n % 4 {
                0 => Frame::remote(FrameId::Extended(0x1FFF_FFFF), 8).unwrap(),
                1 => Frame::error(4, [0, 4, 0, 0, 0, 0, 96, 0]).unwrap(),
                2 => Frame::data(FrameId::Standard(0), &[]).unwrap(),
                _ => Frame::full(FrameId::Standard(0x7FF), [255; 8]),
            };
            StampedFrame { time: Duration::MAX, direction: Direction::Sent, frame }
        })
        .collect();
    let value = strange[number(8) as usize];
    told.status.counters.bus_load = Some(value);
    told.status.counters.received_hz = value;
    told.status.timing.p99_s = value;
    told.status.timing.histogram = (0..number(40)).map(|n| if n % 3 == 0 { u64::MAX } else { n }).collect();
    told.status.motors[0].current_a = Some(value);
    told.status.motors[0].health = Some(health(value, number(256) as u8));
    told.status.imu.age = Some(Duration::MAX);
    let stage = match number(4) {
        0 => Stage::Listening,
        1 => Stage::Checking,
        2 => Stage::Driving,
        _ => Stage::Stopped(StopReason::Tilt { pitch_rad: value }),
    };
    told.status.drive = Some(DriveStatus { stage, motors_off: false, checks: Vec::new() });
    told.events = (0..number(5))
        .map(|n| Event { time: Duration::MAX, kind: EventKind::Warning, text: "ä".repeat(n as usize * 200) })
        .collect();
    told
}

#[test]
fn a_hundred_frames_of_random_news_do_no_harm() {
    for (tab, mut seed) in [(Tab::Robot, 5), (Tab::Tune, 6)] {
        let script = Script::default();
        let mut window = script_window(tab, &script, "emulated");
        for frame in 0..100 {
            script.tell(random_update(&mut seed, f64::from(frame) * 0.05));
            window.step();
        }
        random_input(&mut window, seed);
    }
}

#[test]
fn keys_choose_the_tab_and_the_strip_leads_to_it() {
    let script = Script::default();
    let window_options = WindowOptions { devices: Arc::new(script), ..options(Tab::Tune) };
    let mut window = open(window_options, SIZE);
    let tab = |window: &Window| -> Value { state(window)["tab"].clone() };
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num5);
    window.run_steps(3);
    assert_eq!(tab(&window), "robot");
    window.get_by_label("No robot is connected");
    click(&mut window, "Try the emulated robot");
    assert_eq!(state(&window)["source"], "emulated");
    window.get_by_label("Disconnected");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num1);
    window.run_steps(3);
    click(&mut window, "Go to connection");
    assert_eq!(tab(&window), "robot");
}
