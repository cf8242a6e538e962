//! What is around the pages: commands, palette, tiles, messages.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use common::{SIZE, TempFile, Window, click, command, enter, open, options, state, until};
use egui::{Event, Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;
use flqr_gui::{Tab, WindowOptions};
use serde_json::json;

fn message(window: &Window) -> String {
    state(window)["message"].as_str().unwrap().to_owned()
}

#[test]
fn the_palette_filters_moves_takes_and_closes() {
    let mut window = open(options(Tab::Tune), SIZE);
    command(&mut window, "Experiments");
    assert_eq!(state(&window)["tab"], "experiments");
    assert!(window.query_by_label("command").is_none(), "it closes by itself");
    command(&mut window, "use lqr");
    assert_eq!(state(&window)["controller"], "lqr");

    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(3);
    window.event(Event::Text("size".to_owned()));
    window.step();
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert!(window.query_by_label("command").is_none(), "Esc closes it");
    assert_eq!(state(&window)["tab"], "experiments");

    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(3);
    let first = ["Open…", "Open a model…", "Open a log…"].map(|name| window.query_by_label(name).is_some());
    assert_eq!(first, [true; 3], "all commands, in the order of the menus");
    window.event(Event::Text("source:".to_owned()));
    window.step();
    for key in [Key::ArrowDown, Key::ArrowDown, Key::ArrowUp, Key::Enter] {
        window.key_press(key);
        window.run_steps(2);
    }
    assert_eq!(state(&window)["source"], "emulated", "the second of the sources");
}

#[test]
fn a_command_that_cannot_be_given_says_why() {
    let mut window = open(options(Tab::Tune), SIZE);
    command(&mut window, "start or cancel the fit");
    window.get_by_label("Start or cancel the fit: there is no log");
    window.key_press(Key::Escape);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    assert_eq!(message(&window), "Start or cancel: nothing to start on this page.");
}

#[test]
fn pages_are_shown_beside_each_other_and_put_back() {
    let mut window = open(WindowOptions { paused: false, ..options(Tab::Tune) }, SIZE);
    assert_eq!(state(&window)["shown"], json!(["tune"]));
    command(&mut window, "Friction to the right");
    assert_eq!(state(&window)["shown"], json!(["tune", "friction"]));
    assert_eq!(state(&window)["tab"], "friction", "it is the page that keys are about");
    click(&mut window, "Weights and gains");
    window.get_by_label("pitch weight slider");
    click(&mut window, "Log and fit");
    window.get_by_label("log path");
    command(&mut window, "Experiments to the bottom");
    let shown = state(&window);
    assert_eq!(shown["shown"].as_array().map(Vec::len), Some(3), "{shown:#}");

    // A press in a tile turns keys to its page.
    window.get_by_label("displacement").click();
    window.run_steps(2);
    assert_eq!(state(&window)["tab"], "tune");
    command(&mut window, "Robot");
    let shown = &state(&window)["shown"];
    assert!(!shown.as_array().unwrap().contains(&"tune".into()), "Robot is in front of it: {shown}");

    command(&mut window, "reset the layout");
    assert_eq!(state(&window)["shown"], json!(["robot"]));
    command(&mut window, "reset the layout");
    window.get_by_label("Reset the layout: already the default layout");
}

#[test]
fn messages_are_kept_filtered_and_copied() {
    let mut window = open(options(Tab::Tune), SIZE);
    click(&mut window, "Log");
    let shown = window.get_all_by_label_contains("is loaded.").count();
    assert_eq!(shown, 2, "in the list and in the status line");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.run_steps(3);
    window.get_by_label("2 of 2 messages");
    window.get_by_label("message filter").click();
    window.step();
    window.event(Event::Text("loaded".to_owned()));
    window.run_steps(3);
    window.get_by_label("1 of 2 messages");
    click(&mut window, "Copy messages");
    click(&mut window, "Clear");
    window.get_by_label("No message.");
}

#[test]
fn of_a_long_list_of_messages_what_is_in_view_is_drawn_with_the_newest() {
    let mut window = open(options(Tab::Log), SIZE);
    for number in 0..120 {
        let key = if number % 2 == 0 { Key::Enter } else { Key::Z };
        window.key_press_modifiers(Modifiers::COMMAND, key);
        window.step();
    }
    window.run_steps(3);
    window.get_by_label("121 of 121 messages");
    let drawn = window.get_all_by_label_contains("nothing to start").count();
    assert!((8..40).contains(&drawn), "{drawn} of 60");
    let newest = window.get_all_by_label("Undo: there is nothing to undo.").map(|node| node.rect().bottom());
    let lowest = newest.fold(0.0, f32::max);
    assert!(lowest > SIZE.y - 80.0, "the list ends at {lowest}");
    window.get_by_label("message filter").click();
    window.step();
    window.event(Event::Text("loaded".to_owned()));
    window.run_steps(3);
    window.get_by_label("1 of 121 messages");
    assert_eq!(window.get_all_by_label_contains("is loaded.").count(), 1);
}

#[test]
fn theme_and_size_are_commands_too() {
    let mut window = open(options(Tab::Tune), SIZE);
    let dark = window.ctx.global_style().visuals.dark_mode;
    window.key_press_modifiers(Modifiers::COMMAND, Key::D);
    window.run_steps(2);
    assert_ne!(window.ctx.global_style().visuals.dark_mode, dark);
    for (key, zoom) in [(Key::Plus, 1.1), (Key::Minus, 1.0), (Key::Minus, 1.0 / 1.1), (Key::Num0, 1.0)] {
        window.key_press_modifiers(Modifiers::COMMAND, key);
        window.run_steps(3);
        assert!((window.ctx.zoom_factor() - zoom).abs() < 1e-5, "{key:?}: {}", window.ctx.zoom_factor());
    }
}

#[test]
fn the_menus_and_the_list_of_keys_are_made_of_the_commands() {
    let mut window = open(options(Tab::Tune), SIZE);
    click(&mut window, "Menu");
    for menu in ["View", "Tiles"] {
        window.get_by_label(menu).click();
        window.run_steps(4);
    }
    click(&mut window, "Friction to the right");
    assert_eq!(state(&window)["shown"], json!(["tune", "friction"]));
    click(&mut window, "Keys");
    window.get_by_label("STOP the robot: no torque, motors off");
}

#[test]
fn in_a_narrow_window_the_panes_of_a_page_are_behind_their_names() {
    let mut window = open(options(Tab::Tune), egui::vec2(640.0, 760.0));
    assert!(window.query_by_label("body mass").is_none(), "the plots are in front");
    click(&mut window, "Model");
    window.get_by_label("body mass");
    assert!(window.query_by_label("Predicted").is_none());
    click(&mut window, "Robot and prediction");
    window.get_by_label("Predicted");
    let wide = open(options(Tab::Tune), SIZE);
    wide.get_by_label("body mass");
    wide.get_by_label("Predicted");
    assert!(
        wide.query_by_label("Robot and prediction").is_none(),
        "where all have room, no names are needed"
    );
}

/// At 1280 by 800 pixels on a screen of scale 1, and of scale 2 with 1920 by 1080.
#[test]
fn what_runs_and_what_it_needs_stay_in_view_beside_another_design() {
    for size in [SIZE, vec2(960.0, 540.0)] {
        let mut window = open(options(Tab::Tune), size);
        enter(&mut window, "pitch weight", "250");
        until(&mut window, "the trials", |s| s["tune_tab"]["trials"]["largest_pitch_rad"].is_number());
        window.run_steps(3);
        let bottom = window.get_by_label_contains("simulated: paused").rect().top();
        let seen = |label: &str| {
            let rect = window.get_by_label(label).rect();
            assert!(rect.top() >= 0.0 && rect.bottom() <= bottom, "{label} at {rect:?} of {size}");
        };
        ["design A", "design B", "LQR", "FLQR", "compensation ratio"].into_iter().for_each(seen);
        if size == SIZE {
            ["step size", "show step"].into_iter().for_each(seen);
            window.get_by_label_contains("Recovers from an initial tilt");
        }
    }
}

#[test]
fn a_low_window_shows_the_robot_and_the_prediction_one_at_a_time() {
    // Screens of scale 2 with 1920 by 1080 and 1280 by 800 pixels.
    for size in [vec2(960.0, 520.0), vec2(640.0, 376.0)] {
        let mut window = open(options(Tab::Tune), size);
        assert!(window.query_by_label("Predicted").is_none(), "{size}");
        click(&mut window, "Prediction");
        window.get_by_label("Predicted");
        let bottom = window.get_by_label_contains("simulated: paused").rect().top();
        let plane = window.get_by_label("pole map").rect();
        assert!(plane.bottom() <= bottom && plane.height() > 80.0, "{plane:?} of {size}");
        assert!(plane.right() <= size.x && plane.width() > 60.0, "{plane:?} of {size}");
    }
}

#[test]
fn nothing_of_a_page_lies_beyond_the_window() {
    use egui_kittest::kittest::NodeT;
    for tab in Tab::ALL {
        for width in [640.0, 900.0, SIZE.x] {
            let window = open(options(tab), egui::vec2(width, 760.0));
            let beyond: Vec<_> = window
                .root()
                .children_recursive()
                .filter(|node| {
                    node.accesskit_node()
                        .raw_bounds()
                        .is_some_and(|bounds| bounds.x1 > f64::from(width) + 1.0)
                })
                .map(|node| format!("{:?}", node.accesskit_node().label()))
                .collect();
            assert!(beyond.is_empty(), "{} at {width}: {beyond:?}", tab.title());
        }
    }
}

/// A screen of 1280 by 800 pixels at scale 2, and less.
#[test]
fn a_small_window_keeps_every_page_and_source_within_reach() {
    for (size, has_tabs) in [(vec2(640.0, 376.0), true), (vec2(480.0, 320.0), false)] {
        let mut window = open(options(Tab::Tune), size);
        for (key, title) in [("friction", "Friction"), ("experiments", "Experiments"), ("runs", "Runs")] {
            if !has_tabs {
                let front = Tab::from_key(state(&window)["tab"].as_str().unwrap()).unwrap();
                click(&mut window, front.title());
            }
            click(&mut window, title);
            assert_eq!(state(&window)["tab"], key, "{size}");
        }
        assert!(window.get_by_label("simulated").rect().right() <= size.x, "{size}");
        click(&mut window, "simulated");
        click(&mut window, "replay");
        assert_eq!(state(&window)["source"], "replay", "{size}");
    }
}

#[test]
fn the_actions_of_a_page_are_commands() {
    let mut window = open(options(Tab::Tune), SIZE);
    command(&mut window, "export");
    window.get_by_label("figure path");
    command(&mut window, "refine");
    assert_eq!(state(&window)["tab"], "refine");
    command(&mut window, "compute residual");
    let said = state(&window)["message"].as_str().unwrap().to_owned();
    assert!(said.contains("Needs a log"), "{said}");
}

#[test]
fn the_status_says_what_is_wrong_with_a_log() {
    let rows: String = (0..400)
        .map(|row| {
            let speed = (0.05 * f64::from(row)).sin();
            format!("{},{speed},0\n", f64::from(row) * 0.01)
        })
        .collect();
    let file = TempFile::new("dead.csv", &format!("time_s,speed_rad_s,torque_nm\n{rows}"));
    let mut window = open(WindowOptions { log: Some(file.0.clone()), ..options(Tab::Experiments) }, SIZE);
    let found = until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 400);
    let health = found["friction_tab"]["log"]["health"].as_array().unwrap();
    let bad = health.iter().filter(|finding| finding["severity"] != "info").count();
    assert!(bad > 0, "{found:#}");
    let said = found["message"].as_str().unwrap();
    let count = format!("with {bad} data-health finding");
    assert!(
        said.starts_with("400 rows loaded from ")
            && said.contains(&count)
            && said.contains("“Data health” on the Friction page"),
        "{said}"
    );
}
