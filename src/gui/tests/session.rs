//! The session document: undo, what is asked before something is lost, and what is kept.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{ROBOT, SIZE, TempFile, Window, click, closes, command, enter, open, options, state, until};
use egui::{Event, Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;
use flqr_core::model::Model;
use flqr_gui::{Tab, WindowOptions};
use serde_json::{Value, json};

/// A folder that is removed with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("flqr-session-{name}-{}", std::process::id()));
        std::fs::remove_dir_all(&path).ok();
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn options(&self) -> WindowOptions {
        WindowOptions { state_folder: Some(self.0.clone()), ..options(Tab::Tune) }
    }

    fn running(&self) -> PathBuf {
        self.0.join("running-0.flqr-session")
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

/// Frames until the file at `path` holds `text`.
fn until_kept(window: &mut Window, path: &Path, text: &str) {
    let start = Instant::now();
    while !std::fs::read_to_string(path).is_ok_and(|kept| kept.contains(text)) {
        assert!(start.elapsed() < Duration::from_secs(120), "{} has no {text}", path.display());
        window.step();
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn keys(window: &mut Window, modifiers: Modifiers, key: Key) {
    window.key_press_modifiers(modifiers, key);
    window.run_steps(3);
}

fn pitch_weight(window: &Window) -> f64 {
    state(window)["q_diagonal"][2].as_f64().unwrap()
}

#[test]
fn a_drag_a_typed_value_and_a_choice_are_one_step_each() {
    let mut window = open(options(Tab::Tune), SIZE);
    let start = state(&window);
    let slider = window.get_by_label("pitch weight slider").rect();
    window.drag_at(slider.center());
    window.step();
    for distance in [8.0, 16.0, 24.0, 32.0] {
        window.hover_at(slider.center() + vec2(distance, 0.0));
        window.step();
        assert_eq!(state(&window)["undo"], json!([]), "the button is still down");
    }
    window.drop_at(slider.center() + vec2(32.0, 0.0));
    window.run_steps(2);
    let dragged = pitch_weight(&window);
    enter(&mut window, "velocity weight", "77");
    click(&mut window, "LQR");
    enter(&mut window, "left torque weight", "25");
    let undo = state(&window)["undo"].clone();
    let names: Vec<_> = undo.as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    assert_eq!(names[..3], ["torque weights 20 → 25", "controller LQR", "velocity weight 30 → 77"]);
    assert!(names[3].starts_with("pitch weight 100 → ") && names.len() == 4, "{names:?}");

    let gain_of_all = state(&window)["gain"].clone();
    for left in (0..4).rev() {
        keys(&mut window, Modifiers::COMMAND, Key::Z);
        assert_eq!(state(&window)["undo"].as_array().map(Vec::len), Some(left));
    }
    let back = state(&window);
    for part in ["q_diagonal", "r_diagonal", "controller", "gain", "unsaved_changes"] {
        assert_eq!(back[part], start[part], "{part}");
    }
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(state(&window)["message"], "Undo: there is nothing to undo.");
    keys(&mut window, Modifiers::COMMAND, Key::Y);
    assert_eq!(pitch_weight(&window), dragged);
    for _ in 0..3 {
        keys(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    }
    assert_eq!(state(&window)["gain"], gain_of_all);

    command(&mut window, "steps");
    click(&mut window, "velocity weight 30 → 77");
    assert_eq!(state(&window)["undo"].as_array().map(Vec::len), Some(1), "before that step");
    assert_eq!(state(&window)["q_diagonal"][1], 30.0);
}

#[test]
fn a_preset_says_what_changes_and_can_be_taken_back() {
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "pitch weight", "250");
    let before = state(&window);
    command(&mut window, "load the preset");
    assert_eq!(state(&window)["question"], "preset");
    window.get_by_label("name");
    click(&mut window, "Keep the model");
    assert_eq!(state(&window)["model"], before["model"]);
    command(&mut window, "load the preset");
    click(&mut window, "Load the preset");
    let loaded = state(&window);
    assert_ne!(loaded["model"], before["model"]);
    assert_eq!(loaded["unsaved_changes"], false);
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    let back = state(&window);
    for part in ["model", "q_diagonal", "gain", "unsaved_changes"] {
        assert_eq!(back[part], before[part], "{part}");
    }
    keys(&mut window, Modifiers::COMMAND, Key::Y);
    assert_eq!(state(&window)["model"], loaded["model"]);
}

#[test]
fn a_window_that_was_not_closed_is_offered_again_with_its_changes() {
    let folder = Folder::new("crash");
    {
        let mut window = open(folder.options(), SIZE);
        enter(&mut window, "pitch weight", "321");
        command(&mut window, "Friction to the right");
        until_kept(&mut window, &folder.running(), "321.0");
        until_kept(&mut window, &folder.running(), "beside");
    }
    let mut window = open(folder.options(), SIZE);
    until(&mut window, "the question", |s| s["question"] == "restore");
    window.run_steps(2);
    window.get_by_label("321");
    assert_eq!(pitch_weight(&window), 100.0);
    click(&mut window, "Restore it");
    let restored = state(&window);
    assert_eq!(restored["q_diagonal"][2], 321.0, "{restored:#}");
    assert_eq!(restored["unsaved_changes"], true);
    assert_eq!(restored["shown"].as_array().map(Vec::len), Some(2));
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(pitch_weight(&window), 100.0, "it is a step like any other");
}

#[test]
fn starting_afresh_leaves_the_kept_session_in_its_file() {
    let folder = Folder::new("afresh");
    {
        let mut window = open(folder.options(), SIZE);
        enter(&mut window, "pitch weight", "322");
        until_kept(&mut window, &folder.running(), "322.0");
    }
    let mut window = open(folder.options(), SIZE);
    until(&mut window, "the question", |s| s["question"] == "restore");
    window.run_steps(2);
    click(&mut window, "Start new");
    assert_eq!(pitch_weight(&window), 100.0);
    let message = state(&window)["message"].as_str().unwrap().to_owned();
    let kept = folder.0.join("left-0.flqr-session");
    assert!(message.contains(kept.to_str().unwrap()), "{message}");
    enter(&mut window, "pitch weight", "5");
    command(&mut window, "open a session");
    enter(&mut window, "path of the file", kept.to_str().unwrap());
    until(&mut window, "the question", |s| s["question"] == "replace");
    assert_eq!(pitch_weight(&window), 5.0);
    window.run_steps(2);
    click(&mut window, "Replace it");
    until(&mut window, "opening", |s| s["q_diagonal"][2] == 322.0);
}

#[test]
fn runs_are_replaced_by_those_of_a_file_after_a_question_and_come_back_by_undo() {
    let folder = Folder::new("runs");
    let row = |number: u64, title: &str| {
        json!({
            "number": number, "unix_s": 7, "kind": "fit", "title": title, "seed": 1, "sources": "0",
            "made_with": {}, "result": "", "note": "",
        })
    };
    let file = |name: &str, rows: Value| {
        let value = json!({
            "format": "flqr-session", "version": 1, "runs": { "last": u64::MAX, "rows": rows },
        });
        std::fs::write(folder.0.join(name), value.to_string()).unwrap();
    };
    file("last.flqr-session", json!([row(1, "first"), row(2, "second")]));
    file("other.flqr-session", json!([row(1, "other")]));
    let titles = |window: &Window| {
        let rows = state(window)["runs_tab"]["rows"].as_array().unwrap().clone();
        rows.iter().map(|row| row["title"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let mut window = open(folder.options(), SIZE);
    until(&mut window, "the rows of before", |s| s["runs_tab"]["rows"].as_array().unwrap().len() == 2);
    for (answer, expected) in [(Key::K, ["first", "second"].as_slice()), (Key::R, &["other"])] {
        command(&mut window, "open a session");
        enter(&mut window, "path of the file", folder.0.join("other.flqr-session").to_str().unwrap());
        until(&mut window, "the question", |s| s["question"] == "replace");
        window.run_steps(2);
        window.get_by_label_contains("2 rows of the Runs page");
        keys(&mut window, Modifiers::NONE, answer);
        assert_eq!(titles(&window), expected);
    }
    keys(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(titles(&window), ["first", "second"]);
    keys(&mut window, Modifiers::COMMAND, Key::Y);
    assert_eq!(titles(&window), ["other"]);
}

#[cfg(unix)]
#[test]
fn what_was_changed_while_the_last_session_was_read_stays() {
    let folder = Folder::new("late");
    let pipe = folder.0.join("last.flqr-session");
    common::make_pipe(&pipe);
    let mut window = open(folder.options(), SIZE);
    command(&mut window, "Robot to the bottom");
    let row = json!({
        "number": 1, "unix_s": 7, "kind": "fit", "title": "before", "seed": 1, "sources": "0", "made_with": {},
        "result": "", "note": "",
    });
    let text = json!({
        "format": "flqr-session", "version": 1, "layout": { "tabs": ["tune"] }, "zoom": 1.25,
        "runs": { "last": 1, "rows": [row] },
    });
    std::fs::write(&pipe, text.to_string()).unwrap();
    let found = until(&mut window, "the session", |s| s["runs_tab"]["rows"].as_array().unwrap().len() == 1);
    assert_eq!(found["shown"], json!(["tune", "robot"]), "the user's own");
    window.run_steps(2);
    assert_eq!(window.ctx.zoom_factor(), 1.25, "which nobody had changed");
}

#[cfg(unix)]
#[test]
fn a_question_waits_for_the_one_that_is_open() {
    let folder = Folder::new("queue");
    let pipe = folder.0.join("pipe.toml");
    common::make_pipe(&pipe);
    let mut window = open(folder.options(), SIZE);
    enter(&mut window, "pitch weight", "5");
    enter(&mut window, "model path", pipe.to_str().unwrap());
    command(&mut window, "steps");
    assert_eq!(state(&window)["question"], "steps");
    std::fs::write(&pipe, ROBOT.replace("Test robot", "From the pipe")).unwrap();
    let found = until(&mut window, "the other question", |s| s["questions_waiting"] == 1);
    assert_eq!(found["question"], "steps", "what is open stays");
    assert!(!closes(&mut window), "the model has changes");
    assert_eq!(state(&window)["question"], "leave", "the window's end comes first");
    for (answer, next) in [("Cancel", json!("steps")), ("Close", json!("replace")), ("Keep it", Value::Null)]
    {
        click(&mut window, answer);
        assert_eq!(state(&window)["question"], next, "after {answer}");
    }
    assert_eq!(pitch_weight(&window), 5.0);
}

#[test]
fn a_session_brings_the_logs_of_the_refine_page_back() {
    let folder = Folder::new("logs");
    let [run, held] = ["run.csv", "held.csv"].map(|name| {
        let path = folder.0.join(name);
        std::fs::write(&path, "speed_rad_s,torque_nm\n-2,-0.1\n-1,-0.1\n1,0.1\n2,0.1\n").unwrap();
        path
    });
    let missing = folder.0.join("gone.csv");
    let logs = json!([
        { "path": run, "held_out": false }, { "path": held, "held_out": true }, { "path": missing, "held_out": false },
    ]);
    let file = folder.0.join("with-logs.flqr-session");
    let text = json!({ "format": "flqr-session", "version": 1, "refine_logs": logs });
    std::fs::write(&file, text.to_string()).unwrap();
    let mut window = open(WindowOptions { session: Some(file), ..folder.options() }, SIZE);
    let found = until(&mut window, "the logs", |s| {
        s["refine_tab"]["logs"].as_array().is_some_and(|logs| logs.len() == 3 && logs[1]["rows"] == 4)
    });
    let logs = found["refine_tab"]["logs"].as_array().unwrap();
    let held_out: Vec<_> = logs.iter().map(|log| log["held_out"].clone()).collect();
    assert_eq!(held_out, [json!(false), json!(true), json!(false)], "{found:#}");
    // What is kept of it has them again.
    until_kept(&mut window, &folder.running(), "gone.csv");
}

#[test]
fn effects_of_the_model_are_seen_switched_and_taken_out_with_undo() {
    let effects = "[[effects]]\nid = \"cogging\"\nmotor = \"left\"\norder_1 = 14\ncos_1_nm = 0.002\nsin_1_nm = -0.008\n";
    let model = Model::from_toml(&format!("{ROBOT}{effects}"), "effects").unwrap();
    let mut window = open(WindowOptions { model, ..options(Tab::Tune) }, vec2(1280.0, 1600.0));
    window.get_by_label("Effects").scroll_to_me();
    window.run_steps(3);
    window.get_by_label("cogging of the left motor");
    window.get_by_label_contains("0.008");
    click(&mut window, "cancel cogging of the left motor");
    assert_eq!(state(&window)["undo"], json!(["effects"]));
    click(&mut window, "remove cogging of the left motor");
    assert_eq!(state(&window)["undo"], json!(["effects", "effects"]));
    assert!(window.query_by_label("cogging of the left motor").is_none());
    for _ in 0..2 {
        keys(&mut window, Modifiers::COMMAND, Key::Z);
    }
    window.get_by_label("cogging of the left motor");
    assert_eq!(state(&window)["unsaved_changes"], false);
}

#[test]
fn one_choice_of_degrees_or_radians_is_for_all_pages_and_the_session_keeps_it() {
    let folder = Folder::new("angles");
    let mut window = open(folder.options(), SIZE);
    window.get_by_label_contains("plot of pitch [°]");
    click(&mut window, "rad");
    window.get_by_label_contains("plot of pitch [rad]");
    let weight = pitch_weight(&window);
    enter(&mut window, "pitch deviation", "0.05");
    assert!((pitch_weight(&window) - 400.0).abs() < 1e-9, "{weight} to {}", pitch_weight(&window));
    click(&mut window, "Experiments");
    enter(&mut window, "duration of the runs", "1");
    keys(&mut window, Modifiers::COMMAND, Key::Enter);
    until(&mut window, "the runs", |s| s["experiments_tab"]["runs"].as_array().map(Vec::len) == Some(2));
    window.run_steps(2);
    window.get_by_label_contains("plot of pitch [rad]");
    click(&mut window, "deg");
    window.get_by_label_contains("plot of pitch [°]");
    click(&mut window, "Tune");
    window.get_by_label_contains("plot of pitch [°]");
    click(&mut window, "rad");
    until_kept(&mut window, &folder.running(), "\"angles\": \"rad\"");
}

#[test]
fn a_closed_window_leaves_its_layout_and_asks_nothing() {
    let folder = Folder::new("closed");
    {
        let mut window = open(folder.options(), SIZE);
        command(&mut window, "Robot to the bottom");
        until_kept(&mut window, &folder.running(), "below");
        window.state_mut().as_mut().unwrap().end();
        assert!(!folder.running().exists());
    }
    let mut window = open(folder.options(), SIZE);
    until(&mut window, "the layout", |s| s["shown"] == json!(["tune", "robot"]));
    assert!(state(&window)["question"].is_null());
    assert_eq!(state(&window)["undo"], json!([]), "a start is nothing to undo");
}

#[test]
fn a_broken_session_file_never_stops_the_start() {
    let folder = Folder::new("broken");
    let whole = {
        let mut window = open(folder.options(), SIZE);
        enter(&mut window, "pitch weight", "323");
        until_kept(&mut window, &folder.running(), "323.0");
        std::fs::read_to_string(folder.running()).unwrap()
    };
    let newer = whole.replacen("\"version\": 1", "\"version\": 9", 1);
    let not_a_number = whole.replacen("\"zoom\": 1.0", "\"zoom\": NaN", 1);
    assert!(newer != whole && not_a_number != whole);
    for (number, (text, said, asks)) in [
        (&whole[..whole.len() / 2], "is truncated", true),
        (&newer, "newer version of flqr (format 9", true),
        (&not_a_number, "“zoom” cannot be read", true),
        ("{\"format", "not a session file", false),
    ]
    .into_iter()
    .enumerate()
    {
        std::fs::write(folder.running(), text).unwrap();
        let mut window = open(folder.options(), SIZE);
        let expected = |s: &Value| s["message"].as_str().is_some_and(|message| message.contains(said));
        let found = until(&mut window, said, expected);
        let kept = folder.0.join(format!("left-{number}.flqr-session"));
        let named = if asks { folder.running() } else { kept.clone() };
        assert!(found["message"].as_str().unwrap().contains(named.to_str().unwrap()), "{found:#}");
        assert_eq!(std::fs::read_to_string(&named).unwrap(), text, "the file is as it was");
        assert_eq!(found["question"] == "restore", asks, "{said}: {found:#}");
        if asks {
            window.run_steps(2);
            click(&mut window, "Restore it");
            assert_eq!(pitch_weight(&window), 323.0, "{said}");
            assert_eq!(std::fs::read_to_string(&kept).unwrap(), text, "put aside as it was");
        }
        // The slot is free for the next one.
        window.state_mut().as_mut().unwrap().end();
    }
}

/// Opens a session by its path.
fn open_session(window: &mut Window, path: &Path) {
    command(window, "open a session");
    enter(window, "path of the file", path.to_str().unwrap());
}

#[test]
fn what_a_session_has_lost_stays_in_view_until_the_user_does_something() {
    let folder = Folder::new("lost");
    let mut window = open(folder.options(), SIZE);
    enter(&mut window, "pitch weight", "324");
    until_kept(&mut window, &folder.running(), "324.0");
    let whole = std::fs::read_to_string(folder.running()).unwrap();
    let cut = folder.0.join("cut.flqr-session");
    std::fs::write(&cut, &whole[..whole.find("\"theme\"").unwrap() + 11]).unwrap();
    let other = whole.replace("324.0", "5.0");
    let [lost, garbage] = ["lost.flqr-session", "garbage.flqr-session"].map(|name| folder.0.join(name));
    std::fs::write(&lost, &other[..other.find("\"theme\"").unwrap() + 11]).unwrap();
    std::fs::write(&garbage, "\u{1}no session").unwrap();
    // With a model as it is there already, nothing is asked; with another one, the answer does not take it away.
    for (path, asks) in [(&cut, false), (&lost, true)] {
        open_session(&mut window, path);
        if asks {
            until(&mut window, "the question", |s| s["question"] == "replace");
            window.run_steps(2);
            click(&mut window, "Replace it");
        }
        let file = path.to_str().unwrap();
        let log = |s: &Value| s["message"].as_str().is_some_and(|message| message.contains(file));
        until(&mut window, "the warning", log);
        window.run_steps(5);
        let now = state(&window);
        assert!(now["question"].is_null(), "{now:#}");
        assert_eq!(now["message_severity"], "warning");
        let said = now["message"].as_str().unwrap();
        for part in ["“theme” cannot be read", "is truncated, without “zoom”, “angles”, “runs”"]
        {
            assert!(said.contains(part), "{part}: {said}");
        }
        window.get_by_label_contains("The session was read in part");
        keys(&mut window, Modifiers::NONE, Key::F1);
        assert_ne!(state(&window)["message"], said);
        assert_eq!(state(&window)["message_severity"], "note");
    }
    assert_eq!(pitch_weight(&window), 5.0);
    open_session(&mut window, &garbage);
    let named = garbage.to_str().unwrap();
    let found = until(&mut window, "the refusal", |s| s["message"].as_str().unwrap().contains(named));
    assert_eq!(found["message"], format!("{named} is not a session file of flqr. It is left unchanged."));
}

#[test]
fn a_question_without_changes_has_no_table() {
    let folder = Folder::new("same");
    let mut window = open(folder.options(), SIZE);
    enter(&mut window, "pitch weight", "325");
    let kept = folder.0.join("kept.flqr-session");
    until_kept(&mut window, &folder.running(), "325.0");
    std::fs::copy(folder.running(), &kept).unwrap();
    open_session(&mut window, &kept);
    let named = kept.to_str().unwrap();
    let found = until(&mut window, "opening", |s| s["message"].as_str().unwrap().contains(named));
    assert!(found["question"].is_null(), "the very model is in the file: {found:#}");
    // A controller is in no model file.
    command(&mut window, "use lqr");
    assert_eq!(state(&window)["unsaved_changes"], true);
    assert!(!closes(&mut window));
    assert!(window.query_by_label("saved").is_some(), "a change of the weight");
    keys(&mut window, Modifiers::NONE, Key::C);
    enter(&mut window, "pitch weight", "100");
    assert!(!closes(&mut window));
    assert!(window.query_by_label("saved").is_none(), "nothing to list");
    keys(&mut window, Modifiers::NONE, Key::C);
}

#[test]
fn closing_asks_only_where_changes_would_be_lost() {
    let file = TempFile::new("closing.toml", ROBOT);
    let model_path = Some(file.0.clone());
    let mut window = open(WindowOptions { model_path, ..options(Tab::Tune) }, SIZE);
    assert!(closes(&mut window), "nothing is lost");
    enter(&mut window, "pitch weight", "250");
    assert!(!closes(&mut window));
    assert_eq!(state(&window)["question"], "leave");
    click(&mut window, "Cancel");
    assert!(state(&window)["question"].is_null());
    assert_eq!(pitch_weight(&window), 250.0);
    assert!(!closes(&mut window));
    click(&mut window, "Save and close");
    until(&mut window, "saving", |s| s["leaving"] == true);
    assert!(std::fs::read_to_string(&file.0).unwrap().contains("250"));
    assert!(closes(&mut window));

    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "pitch weight", "250");
    assert!(!closes(&mut window));
    click(&mut window, "Discard and close");
    assert_eq!(state(&window)["leaving"], true);
    assert!(closes(&mut window));
}

#[test]
fn a_letter_answers_a_question_and_the_focused_answer_is_reported() {
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "pitch weight", "250");
    let ask = |window: &mut Window| {
        assert!(!closes(window));
        assert_eq!(state(window)["question"], "leave");
        assert!(state(window)["question_focus"].is_null());
    };
    ask(&mut window);
    for name in ["Save and close", "Discard and close", "Cancel"] {
        keys(&mut window, Modifiers::NONE, Key::Tab);
        assert_eq!(state(&window)["question_focus"], name);
    }
    keys(&mut window, Modifiers::NONE, Key::C);
    assert!(state(&window)["question"].is_null() && state(&window)["question_focus"].is_null());
    assert_eq!(pitch_weight(&window), 250.0);

    // A field behind the question must not hold the letters back.
    window.get_by_label("pitch weight").click();
    window.run_steps(2);
    ask(&mut window);
    keys(&mut window, Modifiers::NONE, Key::S);
    assert_eq!(state(&window)["question"], "path", "the model has no file yet");
    window.event(Event::Text("close".to_owned()));
    keys(&mut window, Modifiers::NONE, Key::C);
    assert_eq!(state(&window)["question"], "path", "letters of a path are no answers");
    keys(&mut window, Modifiers::NONE, Key::Escape);
    assert!(state(&window)["question"].is_null());

    ask(&mut window);
    keys(&mut window, Modifiers::NONE, Key::D);
    assert_eq!(state(&window)["leaving"], true);
    assert!(closes(&mut window));
}

#[test]
fn saving_keeps_the_comments_of_the_file() {
    let written = format!("# weighed on 3 May\n{}", ROBOT.replace("[lqr]", "[lqr] # tuned by hand"));
    let file = TempFile::new("comments.toml", &written);
    let model = Model::from_toml(&written, "m").unwrap();
    let mut window =
        open(WindowOptions { model, model_path: Some(file.0.clone()), ..options(Tab::Tune) }, SIZE);
    enter(&mut window, "pitch weight", "250");
    keys(&mut window, Modifiers::COMMAND, Key::S);
    until(&mut window, "saving", |s| s["unsaved_changes"] == false);
    let saved = std::fs::read_to_string(&file.0).unwrap();
    for part in ["# weighed on 3 May", "[lqr] # tuned by hand", "q_diagonal = [60.0, 30.0, 250.0, 5.0]"] {
        assert!(saved.contains(part), "{part}: {saved}");
    }
}

#[test]
fn what_cannot_be_written_is_said_and_nothing_is_lost() {
    let folder = Folder::new("full");
    std::fs::write(folder.0.join("file"), "").unwrap();
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "pitch weight", "250");
    for (name, text) in [("save the session as", "a.flqr-session"), ("save the model as", "a.toml")] {
        command(&mut window, name);
        let path = folder.0.join("file").join(text);
        enter(&mut window, "path of the file", path.to_str().unwrap());
        let said = until(&mut window, "the refusal", |s| {
            s["message"].as_str().is_some_and(|message| message.contains(text))
        });
        assert!(said["message"].as_str().unwrap().contains("could not be saved"), "{said:#}");
        assert_eq!((pitch_weight(&window), &said["unsaved_changes"]), (250.0, &json!(true)));
    }
}

#[test]
fn the_tour_is_shown_once_and_on_request() {
    let file = TempFile::new("tour.json", "{\"version\": 1}");
    let recent_file = Some(file.0.clone());
    let begin = WindowOptions { tour: true, recent_file, ..options(Tab::Tune) };
    let mut window = open(begin.clone(), SIZE);
    until(&mut window, "the tour", |s| s["tour"] == 1);
    window.run_steps(2);
    for (step, tab) in [(2, "experiments"), (3, "friction"), (4, "robot"), (5, "tune")] {
        click(&mut window, "Next step");
        assert_eq!((&state(&window)["tour"], &state(&window)["tab"]), (&json!(step), &json!(tab)));
    }
    click(&mut window, "End the tour");
    assert!(state(&window)["tour"].is_null());
    until_kept(&mut window, &file.0, "\"tour_done\": true");
    let mut window = open(begin, SIZE);
    for _ in 0..50 {
        window.step();
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(state(&window)["tour"].is_null(), "never again");
    command(&mut window, "tour");
    assert_eq!(state(&window)["tour"], 1);
    click(&mut window, "Skip the tour");
    assert!(state(&window)["tour"].is_null());
}
