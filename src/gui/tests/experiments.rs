//! The Experiments page: runs, their statistics, the cursor, saving; driven by the names of its controls.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use std::ops::ControlFlow;

use common::{ROBOT, SIZE, TempFile, Window, click, enter, open, options, random_input, state, until};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, Pos2, Vec2, vec2};
use egui_kittest::kittest::Queryable;
use flqr_core::model::Model;
use flqr_core::model_file::presets;
use flqr_core::record::{ColumnMap, ReadOptions, read_log};
use flqr_core::simulate::{ControllerChoice, Experiment, Outcome, Run, Scenario, Statistics, run};
use flqr_gui::{Tab, WindowOptions};
use serde_json::{Value, json};

/// A window on the paper's robot, whose file has all that a run needs.
fn page() -> Window {
    page_of(presets::paper())
}

fn page_of(model: Model) -> Window {
    open(WindowOptions { model, ..options(Tab::Experiments) }, SIZE)
}

/// Both runs of `seconds`.
fn run_both(window: &mut Window, seconds: &str) -> Value {
    enter(window, "duration of the runs", seconds);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.step();
    let shown = until(window, "both runs", |s| {
        let tab = &s["experiments_tab"];
        tab["running"] == false && tab["runs"].as_array().is_some_and(|runs| runs.len() == 2)
    });
    rest(window);
    shown
}

/// Longer than the 0.3 s within which a second click makes a double click of the first; the layout settles too.
fn rest(window: &mut Window) {
    window.run_steps(20);
}

/// A drag along a way.
fn drag(window: &mut Window, way: &[Pos2]) {
    window.drag_at(way[0]);
    window.step();
    for place in &way[1..] {
        window.hover_at(*place);
        window.step();
    }
    window.drop_at(way[way.len() - 1]);
    window.run_steps(2);
}

fn ground_run(scenario: Scenario, controller: ControllerChoice, seconds: f64) -> Run {
    let model = presets::paper();
    let experiment = Experiment { seconds, ..Experiment::new(scenario, controller) };
    let outcome = run(&experiment, &model, &model, &mut |_| ControlFlow::Continue(())).unwrap();
    let Outcome::Ground(run) = outcome else { panic!("{scenario} is on the ground") };
    run
}

fn as_shown(found: &Statistics) -> Value {
    json!({ "x_m": found.x_m, "x_dot_m_s": found.x_dot_m_s, "pitch_rad": found.pitch_rad })
}

fn cursor(window: &Window) -> f64 {
    state(window)["experiments_tab"]["cursor_s"].as_f64().unwrap()
}

#[test]
fn both_runs_appear_with_the_statistics_of_the_core() {
    let mut window = page();
    window.get_by_label("No run yet.");
    let shown = run_both(&mut window, "2");
    for (index, controller) in [ControllerChoice::Lqr, ControllerChoice::Flqr].into_iter().enumerate() {
        let of_core = ground_run(Scenario::Flat, controller, 2.0);
        let run = &shown["experiments_tab"]["runs"][index];
        assert_eq!(run["controller"], controller.name());
        assert_eq!(run["statistics"], as_shown(&of_core.statistics), "{run:#}");
        assert_eq!(run["settled"], of_core.statistics.settled);
    }
    for name in ["side view of LQR", "side view of FLQR", "displacement [m]", "Statistics"] {
        assert!(window.query_all_by_label(name).next().is_some(), "{name}");
    }
}

#[test]
fn the_last_row_of_the_statistics_is_in_view_and_numbers_beside_the_plots_say_of_when_they_are() {
    for size in [SIZE, egui::vec2(1920.0, 1080.0)] {
        let mut window = open(options(Tab::Experiments), size);
        run_both(&mut window, "2");
        window.run_steps(3);
        let status = window.get_by_label_contains("simulated: paused").rect().top();
        let last = window.get_all_by_label("std").map(|row| row.rect().bottom()).fold(0.0, f32::max);
        assert!(last > 0.0 && last <= status, "{last} of {status} in {size}");
        assert_eq!(window.get_all_by_label("at 0.00 s").count(), 3, "one for each plot");
    }
}

#[test]
fn a_chosen_range_gives_the_statistics_of_that_range() {
    let mut window = page();
    run_both(&mut window, "2");
    enter(&mut window, "statistics from", "0.5");
    rest(&mut window);
    enter(&mut window, "statistics to", "1.25");
    let of_core = ground_run(Scenario::Flat, ControllerChoice::Lqr, 2.0);
    let expected = as_shown(&Statistics::between(&of_core.samples, [0.5, 1.25]).unwrap());
    assert_eq!(state(&window)["experiments_tab"]["runs"][0]["statistics"], expected);

    // A plain drag moves what is visible.
    let visible = |window: &Window| state(window)["experiments_tab"]["range_s"].clone();
    rest(&mut window);
    click(&mut window, "visible");
    let before = visible(&window);
    drag(&mut window, &[Pos2::new(600.0, 300.0), Pos2::new(540.0, 300.0), Pos2::new(480.0, 300.0)]);
    let after = visible(&window);
    assert!(after[0].as_f64() > before[0].as_f64(), "{before} {after}");

    // A drag with Shift over the first plot chooses another one.
    window.event(Event::ModifiersChanged(Modifiers::SHIFT));
    window.step();
    drag(&mut window, &[Pos2::new(450.0, 200.0), Pos2::new(500.0, 205.0), Pos2::new(600.0, 210.0)]);
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    window.step();
    let range = visible(&window);
    let [low, high] = [0, 1].map(|end: usize| range[end].as_f64().unwrap());
    assert!(low > 0.0 && low < high && high < 2.0 && (low, high) != (0.5, 1.25), "{range}");
}

#[test]
fn the_cursor_moves_by_keys_by_a_click_and_while_it_plays() {
    let mut window = page();
    run_both(&mut window, "5");
    assert_eq!(cursor(&window), 0.0);
    for (modifiers, key, expected) in [
        (Modifiers::NONE, Key::ArrowRight, 0.1),
        (Modifiers::SHIFT, Key::ArrowRight, 1.1),
        (Modifiers::ALT, Key::ArrowLeft, 1.099),
        (Modifiers::NONE, Key::End, 4.999),
        (Modifiers::NONE, Key::Home, 0.0),
    ] {
        window.key_press_modifiers(modifiers, key);
        window.run_steps(2);
        assert!((cursor(&window) - expected).abs() < 1e-9, "{key:?}: {}", cursor(&window));
    }
    window.key_press(Key::Space);
    until(&mut window, "the time", |s| s["experiments_tab"]["cursor_s"].as_f64() > Some(0.2));
    window.key_press(Key::Space);
    window.run_steps(3);
    let held = state(&window)["experiments_tab"].clone();
    assert_eq!(held["playing"], false, "{held:#}");
    window.run_steps(5);
    assert_eq!(cursor(&window), held["cursor_s"].as_f64().unwrap(), "the time is held");

    let place = Pos2::new(550.0, 200.0);
    window.hover_at(place);
    window.step();
    window.drag_at(place);
    window.step();
    window.drop_at(place);
    window.run_steps(2);
    let clicked = cursor(&window);
    assert!(clicked > 1.0 && clicked < 4.0, "{clicked}");
    // The press that begins on the cursor takes it along.
    drag(&mut window, &[place, Pos2::new(600.0, 210.0), Pos2::new(640.0, 210.0)]);
    assert!(cursor(&window) > clicked + 0.3, "{} after {clicked}", cursor(&window));
}

#[test]
fn runs_are_cancelled_and_results_of_before_stay() {
    let mut window = page();
    let cancel = |window: &mut Window| {
        enter(window, "duration of the runs", "600");
        click(window, "Run LQR and FLQR");
        assert_eq!(state(window)["experiments_tab"]["running"], true);
        click(window, "Cancel runs");
        until(window, "the end", |s| s["experiments_tab"]["running"] == false)
    };
    let ended = cancel(&mut window);
    assert_eq!(ended["experiments_tab"]["runs"], json!([]));
    assert!(ended["message"].as_str().unwrap().starts_with("Cancelled"), "{ended:#}");
    let before = run_both(&mut window, "1");
    let after = cancel(&mut window);
    assert_eq!(after["experiments_tab"]["runs"], before["experiments_tab"]["runs"]);
}

#[test]
fn every_scenario_runs_and_the_air_has_its_own_numbers() {
    let mut window = page();
    for scenario in Scenario::ALL {
        window.get_by_role_and_label(Role::Button, scenario.title()).click();
        window.run_steps(2);
        // The sweep needs time for its 33 speeds.
        let seconds = if scenario == Scenario::FrictionSweep { "60" } else { "1" };
        let shown = run_both(&mut window, seconds);
        let tab = &shown["experiments_tab"];
        assert_eq!(tab["scenario"], scenario.name());
        for run in tab["runs"].as_array().unwrap() {
            assert!(run["problem"].is_null() && run["statistics"].is_object(), "{scenario}: {run:#}");
            assert_eq!(run["tracking"].is_array(), scenario == Scenario::SpeedTracking, "{run:#}");
            assert_eq!(run["statistics"]["x_m"].is_object(), scenario.on_ground(), "{run:#}");
        }
    }
}

#[test]
fn a_fall_is_said_with_time_and_state() {
    let slow = format!("{ROBOT}\n[actuation]\ndelay_s = 0.2\n");
    let mut window = page_of(Model::from_toml(&slow, "slow.toml").unwrap());
    assert!(window.query_all_by_label_contains("unstable").next().is_some(), "told before the run");
    let shown = run_both(&mut window, "20");
    let run = &shown["experiments_tab"]["runs"][0];
    let fell = run["fell_s"].as_f64().unwrap();
    assert!(fell > 0.0 && fell < 20.0 && run["warnings"][0].is_string(), "{run:#}");
    window.get_by_label_contains(&format!("LQR: fell at {fell:.3} s, at x "));
    assert!(window.query_all_by_label("no, fell").next().is_some(), "in the statistics too");
}

#[test]
fn a_model_without_a_robot_is_refused_in_a_sentence() {
    let rail =
        Model::from_toml("name = \"Rail\"\n[axis]\nkind = \"linear\"\nmass_kg = 9.0\n", "rail").unwrap();
    let mut window = page_of(rail);
    let shown = run_both(&mut window, "1");
    for run in shown["experiments_tab"]["runs"].as_array().unwrap() {
        assert!(run["problem"].as_str().unwrap().contains("needs a robot"), "{run:#}");
    }
    window.set_size(vec2(900.0, 600.0));
    window.run_steps(2);
}

/// The result of saving as `choice` to `path`, as the status line says it.
fn save(window: &mut Window, choice: &str, path: &str) -> String {
    let before = state(window)["message"].clone();
    click(window, choice);
    enter(window, "path to save to", path);
    let done = until(window, "saving", |s| s["message"] != before);
    done["message"].as_str().unwrap().to_owned()
}

#[test]
fn runs_are_saved_as_logs_plots_and_report() {
    let folder = std::env::temp_dir().join(format!("flqr-experiments-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let mut window = page();
    run_both(&mut window, "1");

    assert!(save(&mut window, "Logs", &path("run")).starts_with("Saved"));
    let map = ColumnMap::default();
    for name in ["run-lqr.csv", "run-flqr.csv"] {
        let text = std::fs::read_to_string(path(name)).unwrap();
        let options = ReadOptions::new(&map);
        let log = read_log(text.as_bytes(), name, &options, &mut |_| ControlFlow::Continue(())).unwrap();
        let run = if name.contains("flqr") { ControllerChoice::Flqr } else { ControllerChoice::Lqr };
        let of_core = ground_run(Scenario::Flat, run, 1.0);
        let x_m: Vec<f64> = of_core.samples.iter().map(|sample| sample.x_m).collect();
        assert_eq!(log.column("x_m").unwrap(), x_m, "{name}");
    }

    // A name with a point keeps both logs apart, and the question names what is there.
    std::fs::write(path("run.txt-flqr.csv"), "precious").unwrap();
    let refused = save(&mut window, "Logs", &path("run.txt"));
    assert_eq!(refused, format!("{} exists and was not overwritten.", path("run.txt-flqr.csv")));
    assert!(!folder.join("run.txt-lqr.csv").exists());
    window.step();
    window.get_by_label(&format!("Replace {}?", path("run.txt-flqr.csv")));
    click(&mut window, "Replace");
    until(&mut window, "replacing", |s| s["message"].as_str().is_some_and(|m| m.starts_with("Saved")));
    for name in ["lqr", "flqr"] {
        let [plain, pointed] = ["run", "run.txt"].map(|stem| path(&format!("{stem}-{name}.csv")));
        assert!(std::fs::read(plain).unwrap() == std::fs::read(pointed).unwrap(), "{name}");
    }

    assert!(save(&mut window, "Plots", &path("plots.svg")).starts_with("Saved"));
    assert!(std::fs::read_to_string(path("plots.svg")).unwrap().contains("<svg"));
    assert!(save(&mut window, "Report", &path("report.html")).starts_with("Saved"));
    let report = std::fs::read_to_string(path("report.html")).unwrap();
    for part in
        ["Flat ground", "Statistics from 0 to 0.999", "--controller flqr --seconds 1 --seed 1", "[robot]"]
    {
        assert!(report.contains(part), "{part}");
    }

    std::fs::write(path("report.html"), "precious").unwrap();
    assert!(save(&mut window, "Report", &path("report.html")).contains("was not overwritten"));
    assert_eq!(std::fs::read_to_string(path("report.html")).unwrap(), "precious");
    window.step();
    click(&mut window, "Replace");
    until(&mut window, "replacing", |s| s["message"].as_str().is_some_and(|m| m.starts_with("Saved")));
    assert!(std::fs::read_to_string(path("report.html")).unwrap().len() > 1000);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_new_run_forgets_what_belonged_to_the_last() {
    let mut window = page();
    run_both(&mut window, "2");
    let range = |window: &Window| state(window)["experiments_tab"]["range_s"].clone();
    let usual = range(&window);
    click(&mut window, "visible");
    drag(&mut window, &[Pos2::new(600.0, 300.0), Pos2::new(540.0, 300.0), Pos2::new(480.0, 300.0)]);
    assert_ne!(range(&window), usual);
    // A file is no folder.
    let file = TempFile::new("no-folder", "");
    let said = save(&mut window, "Logs", &format!("{}/run.csv", file.name()));
    assert!(said.contains("could not be saved"), "{said}");
    rest(&mut window);
    let problems = |window: &Window| window.query_all_by_label_contains("could not be saved").count();
    let shown = problems(&window);
    click(&mut window, "Run LQR and FLQR");
    let runs = |s: &Value| s["experiments_tab"]["running"] == false;
    until(&mut window, "other runs", runs);
    rest(&mut window);
    assert!(shown > problems(&window), "{shown}");
    assert_eq!(range(&window), usual);

    enter(&mut window, "statistics from", "0.5");
    rest(&mut window);
    let chosen = range(&window);
    run_both(&mut window, "1.99");
    assert_ne!(range(&window), chosen, "it would not fit into the run");
    enter(&mut window, "statistics to", "1.25");
    rest(&mut window);
    let chosen = range(&window);
    run_both(&mut window, "2");
    assert_eq!(range(&window), chosen);
}

#[test]
fn an_entry_beyond_the_limits_is_reported() {
    let mut window = page();
    let hints = |window: &Window| window.query_all_by_label_contains("was limited").count();
    for (field, key, typed, taken, limited) in [
        ("duration of the runs", "seconds", "9000", 600.0, 1),
        ("duration of the runs", "seconds", "30", 30.0, 0),
        ("duration of the runs", "seconds", "0", 0.1, 1),
        ("duration of the runs", "seconds", "600", 600.0, 0),
        ("experiment seed", "seed", "-3", 0.0, 1),
        ("experiment seed", "seed", "7", 7.0, 0),
    ] {
        enter(&mut window, field, typed);
        rest(&mut window);
        assert_eq!(state(&window)["experiments_tab"][key].as_f64(), Some(taken), "{typed}");
        assert_eq!(hints(&window), limited, "{typed}");
    }
}

#[test]
fn the_statistics_say_whether_each_run_settled() {
    let mut window = page();
    let shown = run_both(&mut window, "30");
    let settled = |index: usize| shown["experiments_tab"]["runs"][index]["settled"].as_bool().unwrap();
    window.get_by_label("settled");
    for (text, value) in [("yes", true), ("no", false)] {
        let expected = [0, 1].into_iter().filter(|index| settled(*index) == value).count();
        assert_eq!(window.query_all_by_label(text).count(), expected, "{text}");
    }
}

#[test]
fn the_command_names_the_file_only_while_it_holds_the_model() {
    let file = TempFile::new("command.toml", &presets::paper().to_toml());
    let model = Model::from_toml(&std::fs::read_to_string(&file.0).unwrap(), "command").unwrap();
    let model_path = Some(file.0.clone());
    let mut window = open(WindowOptions { model, model_path, ..options(Tab::Experiments) }, SIZE);
    let command = |s: &Value| s["experiments_tab"]["runs"][0]["command"].as_str().unwrap().to_owned();
    let shown = run_both(&mut window, "1");
    let expected =
        format!("flqr simulate {} --scenario flat --controller lqr --seconds 1 --seed 1", file.name());
    assert_eq!(command(&shown), expected);
    click(&mut window, "Tune");
    enter(&mut window, "pitch weight", "3");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    window.run_steps(2);
    assert_eq!(state(&window)["tab"], "experiments");
    window.get_by_label_contains("The model has changed since these runs");
    click(&mut window, "Run LQR and FLQR");
    until(&mut window, "other runs", |s| command(s).starts_with("flqr simulate MODEL.toml"));
}

#[test]
fn results_survive_any_size_and_any_input() {
    let mut window = page();
    run_both(&mut window, "1");
    for size in [Vec2::ZERO, vec2(1.0, 1.0), vec2(300.0, 200.0), vec2(1920.0, 1080.0), SIZE] {
        window.set_size(size);
        window.run_steps(3);
    }
    random_input(&mut window, 3);
}

#[test]
fn a_run_that_goes_astray_leaves_the_page_readable() {
    let slow = format!("{ROBOT}\n[actuation]\ndelay_s = 0.08\n");
    let mut window = page_of(Model::from_toml(&slow, "slow.toml").unwrap());
    window.get_by_role_and_label(Role::Button, Scenario::SpeedTracking.title()).click();
    window.run_steps(2);
    let shown = run_both(&mut window, "60");
    assert!(shown["experiments_tab"]["runs"][0]["end_s"].as_f64().unwrap() < 59.0, "{shown:#}");
    window.get_by_label_contains("PI: the motion is not finite from step");
    let statistics = window.get_by_label("Statistics").rect();
    assert!(statistics.left() > 700.0 && statistics.right() < SIZE.x, "{statistics:?}");
}
