//! The ledger: everything that ends becomes a row, rows are compared, and exports say which row they are of.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use common::{SIZE, TempFile, Window, click, command, enter, open, options, state, until};
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use flqr_core::record::{ColumnMap, ReadOptions, read_log};
use flqr_gui::{Tab, WindowOptions};
use serde_json::Value;

fn rows(window: &Window) -> Vec<Value> {
    state(window)["runs_tab"]["rows"].as_array().unwrap().clone()
}

/// Runs both controllers for a few seconds.
fn experiment(window: &mut Window, seed: &str) {
    click(window, "Experiments");
    enter(window, "duration of the runs", "4");
    enter(window, "experiment seed", seed);
    let before = rows(window).len();
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    until(window, "the runs", |s| s["runs_tab"]["rows"].as_array().unwrap().len() == before + 2);
}

fn to_runs(window: &mut Window) {
    click(window, "Runs");
}

#[test]
fn experiments_are_rows_that_are_compared_shifted_noted_and_deleted_with_undo() {
    let mut window = open(options(Tab::Runs), SIZE);
    window.get_by_label("No run yet.");
    experiment(&mut window, "1");
    click(&mut window, "Tune");
    enter(&mut window, "pitch weight", "250");
    experiment(&mut window, "2");
    to_runs(&mut window);
    let all = rows(&window);
    let of = |key: &str| all.iter().map(|row| row[key].clone()).collect::<Vec<_>>();
    assert_eq!(of("number"), [1, 2, 3, 4].map(Value::from));
    assert_eq!(of("title"), ["flat, LQR", "flat, FLQR", "flat, LQR", "flat, FLQR"].map(Value::from));
    assert_eq!(of("seed"), [1, 1, 2, 2].map(Value::from));
    assert_eq!(all[0]["weights"], "60 30 100 5 | 20 20");
    assert_eq!(all[2]["weights"], "60 30 250 5 | 20 20");
    assert_eq!(all[0]["sources"], all[1]["sources"], "one model");
    assert_ne!(all[0]["sources"], all[2]["sources"], "another weight is another model");

    click(&mut window, "show run 1");
    click(&mut window, "show run 3");
    assert_eq!(state(&window)["runs_tab"]["shown"], serde_json::json!([1, 3]));
    enter(&mut window, "shift of run 3", "0.5");
    assert_eq!(state(&window)["runs_tab"]["shifts_s"]["3"], 0.5);
    click(&mut window, "By shape");
    let aligned = until(&mut window, "the alignment", |s| s["runs_tab"]["shifts_s"]["3"] != 0.5);
    assert!(aligned["runs_tab"]["shifts_s"]["3"].as_f64().is_some_and(|shift| shift.abs() < 4.0));
    click(&mut window, "No shift");
    assert_eq!(state(&window)["runs_tab"]["shifts_s"], serde_json::json!({}));

    // From the one ticked row to the other at first; from row 2 it is the controller too.
    window.get_by_label_contains("lqr.q");
    window.get_by_label("+150 %");
    assert!(window.query_by_label("setting.controller").is_none());
    window.get_by_label("from run").click();
    window.run_steps(3);
    click(&mut window, "2  flat, FLQR");
    window.get_by_label("setting.controller");

    enter(&mut window, "note of run 2", "quiet");
    assert_eq!(rows(&window)[1]["note"], "quiet");
    enter(&mut window, "filter of runs", "quiet");
    assert!(window.query_by_label("show run 1").is_none());
    click(&mut window, "delete run 2");
    assert_eq!(rows(&window).len(), 3);
    click(&mut window, "Undo delete");
    assert_eq!(rows(&window), {
        let mut expected = all;
        expected[1]["note"] = "quiet".into();
        expected
    });
}

#[test]
fn the_last_two_runs_of_one_kind_are_drawn_by_a_command_and_any_row_by_the_keyboard() {
    let mut window = open(options(Tab::Experiments), SIZE);
    command(&mut window, "overlay the last two runs");
    let said = state(&window)["message"].as_str().unwrap().to_owned();
    assert!(said.contains("no two runs of one kind"), "{said}");
    experiment(&mut window, "1");
    experiment(&mut window, "2");
    command(&mut window, "overlay the last two runs");
    assert_eq!(state(&window)["tab"], "runs");
    assert_eq!(state(&window)["runs_tab"]["shown"], serde_json::json!([3, 4]));
    command(&mut window, "deselect all runs");
    assert_eq!(state(&window)["runs_tab"]["shown"], serde_json::json!([]));

    // The newest row is the first; the arrows go from box to box.
    command(&mut window, "go to the runs");
    window.key_press(Key::Space);
    window.run_steps(2);
    window.key_press(Key::ArrowDown);
    window.run_steps(2);
    window.key_press(Key::ArrowDown);
    window.run_steps(2);
    window.key_press(Key::Space);
    window.run_steps(2);
    assert_eq!(state(&window)["runs_tab"]["shown"], serde_json::json!([2, 4]));
}

#[test]
fn what_is_saved_of_a_run_names_its_row_and_can_be_read_back() {
    let mut window = open(options(Tab::Experiments), SIZE);
    experiment(&mut window, "7");
    let provenance = state(&window)["experiments_tab"]["runs"][1]["run"].as_str().unwrap().to_owned();
    assert!(provenance.starts_with("run 2: flat, FLQR, seed 7, sources "), "{provenance}");
    for name in ["ledger.csv", "ledger.html", "ledger.svg"] {
        let file = TempFile::new(name, "");
        std::fs::remove_file(&file.0).unwrap();
        let written = if name.ends_with(".csv") {
            TempFile(file.0.with_file_name(format!("{}-flqr.csv", file.0.file_stem().unwrap().display())))
        } else {
            file
        };
        enter(&mut window, "path to save to", &written.name().replace("-flqr.csv", ".csv"));
        let saved = |m: &str| m.starts_with("Saved") && m.contains(written.name());
        until(&mut window, "saving", |s| s["message"].as_str().is_some_and(saved));
        let text = std::fs::read_to_string(&written.0).unwrap();
        assert!(text.contains(&provenance), "{name} does not name its row");
        if name.ends_with(".csv") {
            let map = ColumnMap::default();
            let options = ReadOptions::new(&map);
            let log = read_log(text.as_bytes(), name, &options, &mut |_| std::ops::ControlFlow::Continue(()));
            assert_eq!(log.unwrap().rows(), 4000);
            std::fs::remove_file(written.0.to_str().unwrap().replace("-flqr.csv", "-lqr.csv")).unwrap();
        }
    }
}

#[test]
fn a_fit_is_a_row_with_its_log_in_the_hash() {
    let pairs: String = (0..40).map(|i| format!("{},{}\n", i - 20, 0.01 * f64::from(i - 20))).collect();
    let log = TempFile::new("ledger-pairs.csv", &format!("speed_rad_s,torque_nm\n{pairs}"));
    let mut window = open(WindowOptions { log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 40);
    click(&mut window, "Start fit");
    until(&mut window, "the fit", |s| s["friction_tab"]["fit"]["running"] == false);
    let row = rows(&window)[0].clone();
    assert_eq!((&row["kind"], &row["seed"]), (&"fit".into(), &1.into()));
    assert!(row["result"].as_str().unwrap().contains("viscous_nm_s_rad 0.01"), "{row:#}");
    assert_eq!(row["command"], format!("flqr fit {} --seed 1", log.name()));

    to_runs(&mut window);
    assert!(window.get_by_label("show run 1").accesskit_node().is_disabled(), "it has no curves");
    command(&mut window, "copy as a command");
    let said = state(&window)["message"].as_str().unwrap().to_owned();
    assert_eq!(said, format!("Copied: {}", row["command"].as_str().unwrap()));
}

#[test]
fn a_recording_is_drawn_from_its_file_and_a_missing_one_is_said() {
    let rows: String = (0..50).map(|i| format!("{},{}\n", 0.01 * f64::from(i), f64::from(i % 7))).collect();
    let recording = TempFile::new("drawn.csv", &format!("time_s,x_m\n{rows}"));
    let row = |number: u64, file: &str| {
        serde_json::json!({
            "number": number, "unix_s": 7, "kind": "recording", "title": "CAN", "seed": null, "sources": "0",
            "made_with": { "recording.file": file }, "result": "", "note": "",
        })
    };
    let rows = serde_json::json!([row(1, recording.name()), row(2, "/nowhere/at.csv")]);
    let text =
        serde_json::json!({ "format": "flqr-session", "version": 1, "runs": { "last": 2, "rows": rows } });
    let session = TempFile::new("drawn.flqr-session", &text.to_string());
    let mut window = open(WindowOptions { session: Some(session.0.clone()), ..options(Tab::Runs) }, SIZE);
    until(&mut window, "the rows", |s| s["runs_tab"]["rows"].as_array().unwrap().len() == 2);
    window.run_steps(2);
    click(&mut window, "show run 1");
    until(&mut window, "its curves", |s| s["runs_tab"]["rows"][0]["values"] == 100);
    window.run_steps(2);
    window.get_by_label("curve to compare");
    window.get_by_label("shift of run 1");
    click(&mut window, "show run 2");
    let said = until(&mut window, "the refusal", |s| {
        s["message"].as_str().is_some_and(|message| message.contains("Run 2 cannot be drawn"))
    });
    assert!(said["message"].as_str().unwrap().contains("/nowhere/at.csv could not be opened"), "{said:#}");
    assert_eq!(said["runs_tab"]["shown"], serde_json::json!([1]));
}
