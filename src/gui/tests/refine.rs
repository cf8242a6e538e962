//! The Refine page: logs, the search, what was found and its way into the model; driven by the names of its controls.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use std::ops::ControlFlow;

use common::{SIZE, TempFile, Window, click, command, enter, open, options, random_input, state, until};
use egui::{Key, Modifiers, Vec2, vec2};
use egui_kittest::kittest::Queryable;
use flqr_core::model::{Model, Motor};
use flqr_core::record::write_log;
use flqr_core::simulate::{ControllerChoice, Experiment, Scenario, run};
use flqr_gui::{Tab, WindowOptions};
use serde_json::Value;

const SHAFT: &str = r#"
name = "Shaft"
[axis]
kind = "rotary"
inertia_kg_m2 = 0.005
[friction]
coulomb_nm = 0.03
viscous_nm_s_rad = 0.0005
"#;

/// What the declared shaft lacks.
const COGGING: &str = "\n[[effects]]\nid = \"cogging\"\norder_1 = 14\nsin_1_nm = 0.01\ncos_1_nm = 0.0\n";

/// A log of the shaft with what `hidden` adds to its model, as CSV.
fn log_csv(hidden: &str, seed: u64) -> String {
    let model = |text: &str| Model::from_toml(text, "shaft.toml").unwrap();
    let declared = model(SHAFT);
    let experiment =
        Experiment { seconds: 12.0, seed, ..Experiment::new(Scenario::Multisine, ControllerChoice::Pi) };
    let actual = model(&format!("{SHAFT}{hidden}"));
    let outcome = run(&experiment, &declared, &actual, &mut |_| ControlFlow::Continue(())).unwrap();
    let mut text = Vec::new();
    write_log(&outcome.log(Motor::Left), &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

fn page() -> Window {
    let model = Model::from_toml(SHAFT, "shaft.toml").unwrap();
    open(WindowOptions { model, ..options(Tab::Refine) }, SIZE)
}

fn add(window: &mut Window, log: &TempFile) {
    let logs = |s: &Value| s["refine_tab"]["logs"].as_array().map_or(0, Vec::len);
    let before = logs(&state(window));
    enter(window, "path of a log", log.name());
    until(window, "loading", |s| logs(s) > before && s["refine_tab"]["logs"][before]["loading"] == false);
}

fn search(window: &mut Window) -> Value {
    click(window, "Find missing effects");
    until(window, "the search", |s| s["refine_tab"]["running"].is_null())
}

#[test]
fn what_a_log_shows_is_found_and_goes_into_the_model() {
    let log = TempFile::new("cogging.csv", &log_csv(COGGING, 1));
    let mut window = page();
    window.get_by_label("No log yet.");
    add(&mut window, &log);
    let found = search(&mut window);
    let tab = &found["refine_tab"];
    assert_eq!(tab["refinement"]["verdict"], "effects_found", "{tab:#}");
    let effects = tab["refinement"]["effects"].as_array().unwrap();
    assert!(effects.iter().any(|effect| effect["id"] == "cogging"), "{tab:#}");
    assert_eq!((&tab["step"], &tab["standing"]), (&"add".into(), &"fresh".into()));
    assert_eq!(tab["command"], format!("flqr refine MODEL.toml {} --seed 1", log.name()));
    command(&mut window, "plots of this page as csv");
    assert_eq!(state(&window)["refine_tab"]["step"], "residual");
    window.get_by_label("figure path");
    show(&mut window, "add");
    click(&mut window, "Use in the model");
    let used = state(&window);
    assert_eq!(used["unsaved_changes"], true);
    assert_eq!(used["refine_tab"]["standing"], "in_model");
    // The model of this page is that of the session: saved here, it is in a file.
    let model = TempFile::new("used.toml", "");
    std::fs::remove_file(&model.0).unwrap();
    enter(&mut window, "path to save the results to", model.name());
    let saved = until(&mut window, "saving", |s| s["unsaved_changes"] == false);
    assert!(saved["message"].as_str().unwrap().contains(model.name()), "{saved:#}");
    assert!(std::fs::read_to_string(&model.0).unwrap().contains("cogging"));
}

#[test]
fn a_search_is_cancelled_with_the_keyboard() {
    let log = TempFile::new("cancelled.csv", &log_csv("", 2));
    let mut window = page();
    add(&mut window, &log);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.step();
    assert_eq!(state(&window)["refine_tab"]["running"], "refine");
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    let ended = until(&mut window, "the end", |s| s["refine_tab"]["running"].is_null());
    assert!(ended["refine_tab"]["refinement"].is_null(), "{ended:#}");
    assert!(ended["message"].as_str().unwrap().starts_with("Cancelled"), "{ended:#}");
}

#[test]
fn a_file_that_is_not_there_is_said_in_its_place() {
    let log = TempFile::new("vanished.csv", "");
    std::fs::remove_file(&log.0).unwrap();
    let mut window = page();
    add(&mut window, &log);
    window.query_all_by_label_contains("could not be opened").next().unwrap();
    window.get_by_label("step health: 1 error");
    window.get_by_label("Needs a log that is not held out.");
}

/// Shows a step of the loop.
fn show(window: &mut Window, step: &str) {
    window.get_by_label_contains(&format!("step {step}:")).click();
    window.run_steps(3);
    assert_eq!(state(window)["refine_tab"]["step"], step);
}

#[test]
fn an_effect_that_is_not_ticked_stays_out_of_what_is_saved_and_used() {
    let (log, held_out) = (
        TempFile::new("ticks.csv", &log_csv(COGGING, 4)),
        TempFile::new("ticks-held-out.csv", &log_csv(COGGING, 5)),
    );
    let mut window = page();
    add(&mut window, &log);
    add(&mut window, &held_out);
    let name = held_out.0.file_name().unwrap().to_str().unwrap().to_owned();
    click(&mut window, &format!("{name} held out"));
    let found = search(&mut window);
    let command = found["refine_tab"]["command"].as_str().unwrap();
    assert!(command.contains(&format!(" --heldout {}", held_out.name())), "{command}");

    let model = TempFile::new("ticked.toml", "");
    std::fs::remove_file(&model.0).unwrap();
    let save = |window: &mut Window, said: &str| {
        enter(window, "path to save the results to", model.name());
        until(window, said, |s| s["message"].as_str().is_some_and(|m| m.contains(said)));
        std::fs::read_to_string(&model.0).unwrap()
    };
    assert!(save(&mut window, "Saved").contains("cogging"));

    // What is there is replaced only after a question.
    click(&mut window, "add cogging");
    assert!(save(&mut window, "was not overwritten").contains("cogging"));
    click(&mut window, "Replace");
    until(&mut window, "saving", |s| s["message"].as_str().is_some_and(|m| m.starts_with("Saved")));
    let text = std::fs::read_to_string(&model.0).unwrap();
    assert!(!text.contains("cogging"), "{text}");
    Model::from_toml(&text, "saved").unwrap();
}

#[test]
fn an_outdated_result_is_marked_on_the_page_and_in_the_file() {
    let log = TempFile::new("stale.csv", &log_csv(COGGING, 6));
    let report = TempFile::new("stale.html", "");
    std::fs::remove_file(&report.0).unwrap();
    let mut window = page();
    add(&mut window, &log);
    search(&mut window);
    enter(&mut window, "seed of the search", "7");
    assert_eq!(state(&window)["refine_tab"]["standing"], "stale");
    window.get_by_label_contains("Out of date. This result was computed with other settings");
    enter(&mut window, "path to save the results to", report.name());
    let saved = until(&mut window, "saving", |s| s["message"].as_str().is_some_and(|m| m.contains(".html")));
    assert!(saved["message"].as_str().unwrap().contains("Out of date when saved"), "{saved:#}");
    let html = std::fs::read_to_string(&report.0).unwrap();
    assert!(html.contains("Out of date when saved") && html.contains("<svg"));
    enter(&mut window, "seed of the search", "1");
    assert_eq!(state(&window)["refine_tab"]["standing"], "fresh");
}

#[test]
fn a_log_that_cannot_answer_gives_reasons_and_no_effect() {
    let text = log_csv(COGGING, 7);
    let mut lines = text.lines();
    let head = lines.next().unwrap();
    let torque = head.split(',').position(|name| name == "torque_nm").unwrap();
    let dead = lines.map(|line| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells[torque] = "0.1";
        cells.join(",")
    });
    let log = TempFile::new("dead.csv", &format!("{head}\n{}\n", dead.collect::<Vec<_>>().join("\n")));
    let mut window = page();
    add(&mut window, &log);
    let found = search(&mut window);
    let tab = &found["refine_tab"];
    assert_eq!(tab["refinement"]["verdict"], "data_unfit", "{tab:#}");
    assert_eq!(tab["refinement"]["effects"].as_array().map(Vec::len), Some(0));
    assert_eq!(tab["step"], "health");
    assert!(window.query_all_by_label("error").next().is_some());
    show(&mut window, "add");
    assert!(window.query_all_by_label_contains("Log not suitable for identification").next().is_some());
    assert!(window.query_by_label("Use in the model").is_none());
}

#[test]
fn every_step_shows_what_there_is() {
    let log = TempFile::new("steps.csv", &log_csv(COGGING, 8));
    let mut window = page();
    for step in ["residual", "candidates", "add", "compare"] {
        show(&mut window, step);
        window.get_by_label("No search yet.");
    }
    add(&mut window, &log);
    click(&mut window, "Compute residual");
    let answered = until(&mut window, "the residual", |s| s["refine_tab"]["residual"].is_object());
    assert_eq!(answered["refine_tab"]["step"], "residual");
    window.get_by_label("Residual");
    search(&mut window);
    for (step, text) in [
        ("residual", "peak-to-peak of the means"),
        ("residual", "strongest: order"),
        ("candidates", "Candidates"),
        ("add", "add cogging"),
        ("compare", "On held-out rows"),
    ] {
        show(&mut window, step);
        assert!(window.query_all_by_label_contains(text).next().is_some(), "{step}: {text}");
    }
}

#[test]
fn the_page_survives_any_size_and_any_input() {
    let log = TempFile::new("sizes.csv", &log_csv(COGGING, 3));
    let mut window = page();
    add(&mut window, &log);
    search(&mut window);
    for size in [Vec2::ZERO, vec2(1.0, 1.0), vec2(300.0, 200.0), vec2(1920.0, 1080.0), SIZE] {
        window.set_size(size);
        window.run_steps(3);
    }
    random_input(&mut window, 11);
}
