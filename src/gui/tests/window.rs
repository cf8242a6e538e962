//! The window without a window: every page driven by the names that a screen reader would use.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use std::time::Duration;

use common::{ROBOT, SIZE, TempFile, Window, click, enter, open, options, random_input, state, until, wheel};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, Pos2, Vec2, vec2};
use egui_kittest::kittest::Queryable;
use flqr_core::model::{AxisParameters, Model, Rig};
use flqr_core::model_file::presets;
use flqr_gui::{Tab, WindowOptions};
use serde_json::Value;

/// Pairs on a curve that is quick to fit, with a small, regular deviation.
fn pairs_csv() -> String {
    let mut text = String::from("speed_rad_s,torque_nm\n");
    for index in 0..80 {
        let speed = -39.5 + f64::from(index);
        let level = 0.04 + 0.03 * (-speed.abs() / 4.0).exp();
        let torque = level * speed.signum() + 5e-4 * speed + 0.001 * (f64::from(index) * 2.4).sin();
        text += &format!("{speed},{torque}\n");
    }
    text
}

#[test]
fn a_new_weight_gives_new_gains_in_the_same_frame() {
    let mut window = open(options(Tab::Tune), SIZE);
    let before = state(&window);
    enter(&mut window, "pitch weight", "250");
    let after = state(&window);
    assert_eq!(after["q_diagonal"][2], 250.0);
    assert!(after["gain"][0][2].as_f64() < before["gain"][0][2].as_f64(), "{after:#}");
    assert_eq!(after["unsaved_changes"], true);

    click(&mut window, "Reset weights");
    assert_eq!(state(&window)["gain"], before["gain"]);
}

#[test]
fn a_drag_of_a_slider_changes_the_gains_while_it_lasts() {
    let mut window = open(options(Tab::Tune), SIZE);
    let before = state(&window);
    let slider = window.get_by_label("pitch weight slider").rect();
    let (from, to) = (slider.center(), slider.center() + vec2(35.0, 0.0));
    window.drag_at(from);
    window.step();
    window.hover_at(to);
    window.step();
    assert_ne!(state(&window)["gain"], before["gain"], "while the button is still down");
    window.drop_at(to);
    window.run_steps(2);
    click(&mut window, "Revert to A");
    assert_eq!(state(&window)["gain"], before["gain"], "A is the design of the loaded model");
}

#[test]
fn a_point_of_a_drag_and_an_arrow_are_a_percent_or_two_and_a_tenth_of_that_with_shift() {
    let mut window = open(options(Tab::Tune), SIZE);
    let weight = |window: &Window| state(window)["q_diagonal"][2].as_f64().unwrap();
    let percent =
        |before: f64, after: f64, points: f64| 100.0 * ((after / before).powf(points.recip()) - 1.0);
    let slider = window.get_by_label("pitch weight slider").rect();
    let before = weight(&window);
    // The way to the slider is no part of the drag, though a slow frame brings it with the press.
    window.hover_at(Pos2::new(700.0, 600.0));
    window.step();
    window.drag_at(slider.center());
    window.step();
    assert_eq!(weight(&window), before);
    // Far beyond the rail, so that all magnitudes are in reach of one drag.
    window.hover_at(slider.center() + vec2(300.0, 0.0));
    window.step();
    window.drop_at(slider.center() + vec2(300.0, 0.0));
    window.run_steps(2);
    let dragged = weight(&window);
    assert!((1.0..=2.0).contains(&percent(before, dragged, 300.0)), "{before} to {dragged}");
    assert_eq!(state(&window)["undo"], serde_json::json!(["pitch weight 100 → 9001.7"]), "one step");

    // The drag has given it the keyboard.
    window.key_press(Key::ArrowLeft);
    window.run_steps(2);
    let stepped = weight(&window);
    assert!((-2.0..=-1.0).contains(&percent(dragged, stepped, 1.0)), "{dragged} to {stepped}");
    window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowLeft);
    window.run_steps(2);
    assert!((-0.2..=-0.1).contains(&percent(stepped, weight(&window), 1.0)), "{stepped}");
}

#[test]
fn a_deviation_that_counts_as_1_sets_its_weight() {
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "displacement deviation", "0.05");
    let weight = state(&window)["q_diagonal"][0].as_f64().unwrap();
    assert!((weight - 400.0).abs() < 1e-9, "{weight}");
    enter(&mut window, "pitch deviation", "2");
    let weight = state(&window)["q_diagonal"][2].as_f64().unwrap();
    assert!((weight / (90.0 / std::f64::consts::PI).powi(2) - 1.0).abs() < 1e-12, "{weight}");
    enter(&mut window, "pitch deviation", "0");
    assert_eq!(state(&window)["q_diagonal"][2], weight, "no weight makes that count as 1");
}

#[test]
fn steps_in_percent_undo_each_other_and_each_weight_has_its_reset() {
    let mut window = open(options(Tab::Tune), SIZE);
    let weight = |window: &common::Window| state(window)["q_diagonal"][2].as_f64().unwrap();
    click(&mut window, "more pitch weight");
    assert!((weight(&window) - 110.0).abs() < 1e-9, "10 % at first");
    click(&mut window, "less pitch weight");
    assert!((weight(&window) - 100.0).abs() < 1e-9);
    click(&mut window, "25 %");
    click(&mut window, "more left torque weight");
    assert_eq!(state(&window)["r_diagonal"], serde_json::json!([25.0, 25.0]), "both motors");
    click(&mut window, "more pitch weight");
    click(&mut window, "reset pitch weight");
    let after = state(&window);
    assert_eq!((&after["q_diagonal"][2], &after["r_diagonal"][0]), (&100.0.into(), &25.0.into()));
}

#[test]
fn a_and_b_change_places_and_differences_are_listed() {
    let mut window = open(options(Tab::Tune), SIZE);
    let loaded = state(&window);
    assert_eq!(loaded["tune_tab"]["design"], "B");
    enter(&mut window, "pitch weight", "250");
    let b = state(&window);
    click(&mut window, "design A");
    let a = state(&window);
    assert_eq!((&a["gain"], &a["tune_tab"]["design"]), (&loaded["gain"], &"A".into()));
    click(&mut window, "design B");
    assert_eq!(state(&window)["gain"], b["gain"]);
    window.get_by_label_contains("A → B:").click();
    window.run_steps(3);
    window.get_by_label("Q pitch");
    window.get_by_label("+150 %");
    click(&mut window, "Copy to A");
    assert!(window.query_by_label_contains("A → B:").is_none(), "both are the same");
    enter(&mut window, "pitch weight", "300");
    click(&mut window, "Revert to A");
    assert_eq!(state(&window)["gain"], b["gain"]);
}

#[test]
fn peak_torques_follow_in_the_same_frame_and_the_simulated_robot_has_the_last_word() {
    let model = presets::paper();
    let mut window = open(WindowOptions { model, ..options(Tab::Tune) }, SIZE);
    let peaks = |s: &Value| {
        let peaks = s["tune_tab"]["trials"]["peak_torque_nm"].as_array().unwrap().clone();
        peaks.iter().map(|peak| peak.as_f64().unwrap()).collect::<Vec<_>>()
    };
    let known = |s: &Value| s["tune_tab"]["trials"]["largest_pitch_rad"].is_number();
    let first = until(&mut window, "the trials", known);
    assert_eq!(first["tune_tab"]["trials"]["upright"], serde_json::json!([true, true, true]), "{first:#}");
    let largest = first["tune_tab"]["trials"]["largest_pitch_rad"].as_f64().unwrap();
    assert!((0.1..0.8).contains(&largest), "{largest}");
    window.get_by_label("lean: good");

    enter(&mut window, "lean size", "40");
    let after = state(&window);
    let ratio = peaks(&after)[1] / peaks(&first)[1];
    assert!((ratio - 8.0).abs() < 1e-9, "linear, from 5° to 40°: {ratio}");
    let fallen = until(&mut window, "the fall", |s| s["tune_tab"]["trials"]["upright"][1] == false);
    assert_eq!(fallen["tune_tab"]["trials"]["upright"][0], true);
    window.get_by_label("lean: bad");
    window.get_by_label_contains("lean: the simulated robot falls");
    click(&mut window, "torque limit");
    window.get_by_label_contains("Enable “torque limit”");
}

#[test]
fn margins_have_a_verdict_and_a_sentence_and_poles_a_list() {
    let mut window = open(options(Tab::Tune), SIZE);
    let good = state(&window)["tune_tab"]["margins"].clone();
    assert_eq!(good["stable"], true, "{good:#}");
    window.get_by_label(&format!("delay: {}", good["verdicts"]["delay"].as_str().unwrap()));
    click(&mut window, "Poles");
    window.get_by_label("damping");
    enter(&mut window, "left torque weight", "1e-5");
    let bad = state(&window)["tune_tab"]["margins"].clone();
    assert!(bad["delay_s"].as_f64() < good["delay_s"].as_f64(), "{bad:#}");
    let told = ["Unstable when sampled", "Barely stable", "Tight"];
    assert!(told.iter().any(|text| window.query_by_label_contains(text).is_some()));
}

#[test]
fn weights_without_a_design_leave_the_last_gains_active_and_are_reported() {
    let mut window = open(options(Tab::Tune), SIZE);
    let before = state(&window);
    enter(&mut window, "left torque weight", "-1");
    let after = state(&window);
    assert!(after["design_problem"].is_string(), "{after:#}");
    assert_eq!(after["gain"], before["gain"]);
    window.get_by_label("The last valid gains remain active and are shown here.");
}

#[test]
fn one_weight_of_the_motors_moves_the_other_unless_unlinked() {
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "right torque weight", "40");
    assert_eq!(state(&window)["r_diagonal"], serde_json::json!([40.0, 40.0]));
    click(&mut window, "Same weight for both motors");
    enter(&mut window, "right torque weight", "10");
    let after = state(&window);
    assert_eq!(after["r_diagonal"], serde_json::json!([40.0, 10.0]));
    assert_ne!(after["gain"][0], after["gain"][1]);
}

#[test]
fn full_matrices_stay_symmetric_and_reach_the_design() {
    let mut window = open(options(Tab::Tune), SIZE);
    let before = state(&window);
    click(&mut window, "Full matrices");
    enter(&mut window, "Q displacement, velocity", "5");
    let after = state(&window);
    assert!(after["design_problem"].is_null(), "{after:#}");
    assert_ne!(after["gain"], before["gain"]);
}

#[test]
fn a_negative_mass_is_refused_where_it_was_typed() {
    let mut window = open(options(Tab::Tune), SIZE);
    let before = state(&window);
    enter(&mut window, "body mass value", "-3");
    window.get_by_label_contains("must be a finite number above 0");
    assert_eq!(state(&window)["gain"], before["gain"]);
    enter(&mut window, "body mass value", "15");
    assert_ne!(state(&window)["gain"], before["gain"]);
}

#[test]
fn friction_and_limit_begin_with_those_of_the_papers_preset() {
    let file = TempFile::new("begin.toml", "");
    let model_path = Some(file.0.clone());
    let mut window = open(WindowOptions { model_path, ..options(Tab::Tune) }, SIZE);
    click(&mut window, "torque limit");
    window.get_by_role_and_label(Role::CheckBox, "right").click();
    window.run_steps(3);
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    until(&mut window, "saving", |s| s["message"].as_str().is_some_and(|m| m.starts_with("Saved")));
    let saved = Model::from_toml(&std::fs::read_to_string(&file.0).unwrap(), "saved").unwrap();
    let (saved, paper) = (saved.robot().unwrap(), presets::paper());
    let paper = paper.robot().unwrap();
    assert_eq!(saved.limits.torque_nm, paper.limits.torque_nm);
    assert!(saved.limits.torque_nm.is_some());
    assert_eq!(saved.friction[1], paper.friction[0]);
}

#[test]
fn can_is_honest_about_being_not_connected() {
    let mut window = open(WindowOptions { paused: false, ..options(Tab::Tune) }, SIZE);
    click(&mut window, "CAN");
    window.get_by_label("CAN: not connected");
    window.get_by_label_contains("Connect a robot on the Robot tab");
    let state = state(&window);
    assert_eq!((&state["source"], &state["simulation"]["paused"]), (&"can".into(), &true.into()));
    assert!(window.query_by_label("Push").is_none(), "no controls of the simulated robot");
    click(&mut window, "Back to the simulated robot");
    window.get_by_label("Push");
    until(&mut window, "running on", |s| s["simulation"]["paused"] == false);
}

#[test]
fn the_simulated_robot_runs_is_pushed_paused_and_reset() {
    let mut window = open(WindowOptions { paused: false, ..options(Tab::Tune) }, SIZE);
    until(&mut window, "one second of simulation", |s| s["simulation"]["seconds"].as_f64() >= Some(1.0));
    let x_mm = |s: &Value| s["simulation"]["displacement_mm"].as_f64().unwrap_or(0.0);
    let before = state(&window);
    assert!(x_mm(&before).abs() < 100.0, "it stands: {before:#}");
    enter(&mut window, "push force", "200");
    click(&mut window, "Push");
    until(&mut window, "the push", |s| x_mm(s) > 300.0);
    click(&mut window, "LQR");
    assert_eq!(state(&window)["controller"], "lqr");
    click(&mut window, "Pause");
    until(&mut window, "the pause", |s| s["simulation"]["paused"] == true);
    click(&mut window, "Reset");
    let reset = state(&window);
    assert_eq!(reset["simulation"]["seconds"], 0.0, "{reset:#}");
    assert!(reset["simulation"]["displacement_mm"].is_null(), "the plots are empty: {reset:#}");
    click(&mut window, "Run");
    let again = until(&mut window, "a sample", |s| s["simulation"]["displacement_mm"].is_number());
    assert!(again["simulation"]["seconds"] == 0.0 && x_mm(&again).abs() < 100.0, "{again:#}");
}

#[test]
fn without_a_design_nothing_runs_until_there_is_one() {
    let bad = ROBOT.replace("[60.0, 30.0", "[-1.0, 30.0").replace("Test robot", "No design");
    for (name, text, shown) in [("undesigned.toml", &*bad, "no design"), ("no-robot.toml", RAIL, "no robot")]
    {
        let file = TempFile::new(name, text);
        let mut window = open(WindowOptions { paused: false, ..options(Tab::Tune) }, SIZE);
        until(&mut window, "a sample", |s| s["simulation"]["displacement_mm"].is_number());
        enter(&mut window, "model path", file.name());
        let loaded = until(&mut window, "loading", |s| s["model"] != "Test robot");
        assert!(loaded["gain"].is_null() && loaded["simulation"]["displacement_mm"].is_null(), "{loaded:#}");
        assert!(window.get_all_by_label(shown).count() > 0);
        // The robot of before would bring samples several times in this while.
        for _ in 0..60 {
            window.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        let later = state(&window);
        assert!(later["simulation"]["displacement_mm"].is_null(), "the robot of before: {later:#}");
        if name == "undesigned.toml" {
            enter(&mut window, "displacement weight", "60");
            until(&mut window, "the start", |s| s["simulation"]["displacement_mm"].is_number());
        }
    }
}

#[test]
fn a_log_is_loaded_by_path_fitted_and_used() {
    let log = TempFile::new("pairs.csv", &pairs_csv());
    let mut window = open(options(Tab::Friction), SIZE);
    enter(&mut window, "log path", log.name());
    let loaded = until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 80);
    assert_eq!(loaded["friction_tab"]["log"]["kind"], "friction_pairs");
    click(&mut window, "Start fit");
    let fitted = until(&mut window, "the fit", |s| s["friction_tab"]["fit"]["parameters"].is_object());
    let coulomb = fitted["friction_tab"]["fit"]["parameters"]["coulomb_nm"]["value"].as_f64().unwrap();
    assert!(fitted["friction_tab"]["fit"]["rmse"].as_f64().unwrap() < 0.001, "{fitted:#}");
    click(&mut window, "Right motor");
    let used = state(&window);
    assert_eq!(used["friction"][1]["coulomb_nm"].as_f64(), Some(coulomb));
    assert_eq!(used["friction"][0], loaded["friction"][0], "the left motor is as before");
    assert_eq!(used["undo"], serde_json::json!(["use fit in model"]));
    click(&mut window, "Rows");
    window.get_by_label("speed_rad_s");
}

/// A carriage of 20 kg with 50 N s/m, 5 N of Coulomb friction and an offset of 1 N.
fn carriage_csv(columns: &str) -> String {
    let mut csv = format!("{columns}\n");
    for index in 0..6000 {
        let time = f64::from(index) * 1e-3;
        let (mut position, mut velocity, mut acceleration) = (0.0, 0.0, 0.0);
        for (amplitude, rate) in [(0.1_f64, 3.0_f64), (0.03, 7.3)] {
            position += amplitude * (rate * time).sin();
            velocity += amplitude * rate * (rate * time).cos();
            acceleration -= amplitude * rate * rate * (rate * time).sin();
        }
        let force = 20.0 * acceleration + 50.0 * velocity + 5.0 * velocity.signum() + 1.0;
        csv += &format!("{time:.3},{position:.9},{force:.6}\n");
    }
    csv
}

#[test]
fn a_log_of_a_linear_axis_is_fitted_although_the_model_is_a_robot() {
    let log = TempFile::new("axis.csv", &carriage_csv("time_s,position_m,force_n"));
    let mut window = open(WindowOptions { log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    open(options(Tab::Friction), SIZE).get_by_label("motor");
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["kind"] == "linear_axis");
    window.run_steps(2);
    window.get_by_label_contains("plot of force [N]");
    assert!(window.query_by_label("motor").is_none(), "one carriage has no left and right");
    click(&mut window, "Start fit");
    let ended = until(&mut window, "the fit", |s| s["friction_tab"]["fit"]["running"] == false);
    let mass = ended["friction_tab"]["fit"]["parameters"]["mass_kg"]["value"].as_f64();
    assert!(mass.is_some_and(|mass| (mass - 20.0).abs() < 0.4), "{ended:#}");
    window.get_by_label_contains("Open the model of a linear axis");
    window.get_by_label_contains("peak-to-peak of the means");
    assert!(window.query_by_label("Both motors").is_none(), "a carriage is no motor");
    click(&mut window, "Axis");
    assert_eq!(state(&window)["friction"], ended["friction"], "newtons are no torque");
}

const RAIL: &str = "name = \"Rail\"\n[axis]\nkind = \"linear\"\nmass_kg = 9.0\n";
const SHAFT: &str = "name = \"Shaft\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 9.0\n";

#[test]
fn a_fit_of_a_motion_goes_into_the_axis_with_inertia_or_mass() {
    for (name, text, columns) in
        [("rail", RAIL, "time_s,position_m,force_n"), ("shaft", SHAFT, "time_s,motor_angle_rad,torque_nm")]
    {
        let log = TempFile::new(&format!("{name}.csv"), &carriage_csv(columns));
        let file = TempFile::new(&format!("{name}.toml"), text);
        let model = Model::from_toml(text, name).unwrap();
        let (log_path, model_path) = (Some(log.0.clone()), Some(file.0.clone()));
        let mut window =
            open(WindowOptions { model, model_path, log: log_path, ..options(Tab::Friction) }, SIZE);
        until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 6000);
        click(&mut window, "Start fit");
        until(&mut window, "the fit", |s| s["friction_tab"]["fit"]["running"] == false);
        click(&mut window, "Axis");
        assert_eq!(state(&window)["unsaved_changes"], true, "{:#}", state(&window));
        window.key_press_modifiers(Modifiers::COMMAND, Key::S);
        until(&mut window, "saving", |s| s["unsaved_changes"] == false);
        let saved = Model::from_toml(&std::fs::read_to_string(&file.0).unwrap(), "saved").unwrap();
        let Rig::Axis(axis) = &saved.rig else { panic!("{saved:?}") };
        let (AxisParameters::Linear { mass_kg: inertia, friction }
        | AxisParameters::Rotary { inertia_kg_m2: inertia, friction, .. }) = axis.parameters;
        let curve = *friction.unwrap().parameters();
        for (found, true_value, tolerance) in [
            (inertia, 20.0, 0.4),
            (curve.viscous_nm_s_rad, 50.0, 1.0),
            (curve.coulomb_nm, 5.0, 0.2),
            (curve.offset_nm, 1.0, 0.1),
        ] {
            assert!((found - true_value).abs() < tolerance, "{name}: {saved:?}");
        }
        assert_eq!(curve.static_nm, curve.coulomb_nm, "no Stribeck part");
    }
}

#[test]
fn a_fit_of_a_motor_is_refused_by_a_linear_axis() {
    let log = TempFile::new("motor.csv", &pairs_csv());
    let model = Model::from_toml(RAIL, "rail").unwrap();
    let mut window = open(WindowOptions { model, log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 80);
    click(&mut window, "Start fit");
    until(&mut window, "the fit", |s| s["friction_tab"]["fit"]["parameters"].is_object());
    window.get_by_label_contains("the model is a linear axis");
    click(&mut window, "Axis");
    let after = state(&window);
    assert!(after["friction"][0].is_null(), "{after:#}");
    assert_eq!(after["unsaved_changes"], false);
}

#[test]
fn a_fit_of_a_torque_that_never_changes_is_refused_in_one_sentence() {
    let dead: String = pairs_csv()
        .lines()
        .map(|line| match line.split_once(',') {
            Some((speed, "torque_nm")) => format!("{speed},torque_nm\n"),
            Some((speed, _)) => format!("{speed},0.25\n"),
            None => panic!("{line}"),
        })
        .collect();
    let log = TempFile::new("dead.csv", &dead);
    let mut window = open(WindowOptions { log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 80);
    click(&mut window, "Start fit");
    let refused = until(&mut window, "the refusal", |s| s["friction_tab"]["fit"]["problem"].is_string());
    let problem = refused["friction_tab"]["fit"]["problem"].as_str().unwrap();
    assert!(problem.contains(log.name()) && problem.contains("0.25 N m"), "{problem}");
    assert!(!problem.contains("inf") && !problem.contains("NaN"), "{problem}");
    assert_eq!(refused["message"], problem);
    assert!(refused["friction_tab"]["fit"]["parameters"].is_null(), "{refused:#}");
    assert_eq!(window.get_all_by_label(problem).count(), 2, "on the page, and in the status line");
    assert_eq!(refused["friction"], state(&window)["friction"]);
}

#[test]
fn a_refused_fit_names_the_cells_that_were_not_read() {
    let rows: String = (0..4).map(|row| format!("{row},{}\n", f64::from(row) * 0.1)).collect();
    let log = TempFile::new("cells.csv", &format!("speed_rad_s,torque_nm\n{rows}5,high\n6,?\n"));
    let mut window = open(WindowOptions { log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 4);
    click(&mut window, "Start fit");
    let refused = until(&mut window, "the refusal", |s| s["friction_tab"]["fit"]["problem"].is_string());
    let problem = refused["friction_tab"]["fit"]["problem"].as_str().unwrap();
    let said = format!("; 2 cells or rows of {} could not be read, `torque_nm` at lines 6, 7; ", log.name());
    assert_eq!(problem.matches(&said).count(), 1, "{problem}");
    assert_eq!(problem.matches("lines 6, 7").count(), 1, "once: {problem}");
}

#[test]
fn a_fit_can_be_cancelled() {
    // So many pairs that the fit would last far longer than the frame until it is cancelled.
    let pairs = pairs_csv();
    let (head, rows) = pairs.split_once('\n').unwrap();
    let log = TempFile::new("cancel.csv", &format!("{head}\n{}", rows.repeat(500)));
    let mut window = open(WindowOptions { log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 40_000);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    window.step();
    assert_eq!(state(&window)["friction_tab"]["fit"]["running"], true);
    window.key_press_modifiers(Modifiers::COMMAND, Key::Enter);
    let ended = until(&mut window, "the end", |s| s["friction_tab"]["fit"]["running"] == false);
    let fit = &ended["friction_tab"]["fit"];
    assert!(fit["problem"].as_str().is_some_and(|problem| problem.contains("cancelled")), "{fit}");
    assert!(fit["parameters"].is_null(), "{fit}");
}

#[test]
fn bad_logs_and_models_are_refused_in_one_sentence_and_nothing_is_lost() {
    let good = TempFile::new("good.csv", &pairs_csv());
    let text = TempFile::new("text.csv", "speed_rad_s,torque_nm\n1,zero\n");
    let model = TempFile::new("bad.toml", "name = \"x\"\n[robot]\nbody_mas_kg = 1\n");
    let mut window = open(WindowOptions { log: Some(good.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 80);
    for path in ["/no/such/folder/log.csv", env!("CARGO_MANIFEST_DIR"), ""] {
        enter(&mut window, "log path", path);
        let state = until(&mut window, "refusal", |s| s["friction_tab"]["log"]["loading"] == false);
        assert_eq!(state["friction_tab"]["log"]["rows"], 80, "the log of before stays");
    }
    enter(&mut window, "log path", text.name());
    let refused = until(&mut window, "an answer", |s| {
        let log = &s["friction_tab"]["log"];
        log["loading"] == false
            && log["problem"].as_str().is_some_and(|problem| problem.contains(text.name()))
    });
    let problem = refused["friction_tab"]["log"]["problem"].as_str().unwrap();
    assert!(problem.contains("line 2, column `torque_nm`: `zero` is not a number"), "{problem}");
    assert_eq!(refused["message"], problem);
    enter(&mut window, "column map", "torque_nm");
    window.get_by_label_contains("column map:");

    let before = state(&window);
    click(&mut window, "Tune");
    enter(&mut window, "model path", model.name());
    let refused = until(&mut window, "refusal", |s| {
        s["message"].as_str().is_some_and(|message| message.contains("body_mas_kg"))
    });
    assert!(refused["message"].as_str().unwrap().contains(":3"), "the line: {}", refused["message"]);
    assert_eq!(refused["gain"], before["gain"]);
}

#[test]
fn a_fit_survives_a_log_that_cannot_be_read_but_not_another_log() {
    let good = TempFile::new("fitted.csv", &pairs_csv());
    let other = TempFile::new("other.csv", &pairs_csv());
    let bad = TempFile::new("unread.csv", "speed_rad_s,torque_nm\n");
    let text = "Notes, of the day\nThe robot fell, twice, at 3 pm.\nThen it did not.\n12, 13\n";
    let text = TempFile::new("notes.txt", text);
    let mut window = open(WindowOptions { log: Some(good.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"] == 80);
    click(&mut window, "Start fit");
    let fitted = until(&mut window, "the fit", |s| s["friction_tab"]["fit"]["parameters"].is_object());
    for path in ["/no/such/folder/log.csv", bad.name(), text.name()] {
        enter(&mut window, "log path", path);
        let refused = until(&mut window, "refusal", |s| {
            s["friction_tab"]["log"]["problem"].as_str().is_some_and(|problem| problem.contains(path))
        });
        assert_eq!(refused["friction_tab"]["fit"], fitted["friction_tab"]["fit"], "after {path}");
    }
    enter(&mut window, "log path", other.name());
    let loaded = until(&mut window, "loading", |s| s["friction_tab"]["log"]["path"] == other.name());
    assert!(loaded["friction_tab"]["fit"]["parameters"].is_null(), "{loaded:#}");
}

#[test]
fn a_model_is_saved_and_loaded_back() {
    let file = TempFile::new("model.toml", "");
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "velocity weight", "77");
    window.get_by_label("model path").click();
    window.run_steps(2);
    window.event(Event::Text(file.name().to_owned()));
    window.run_steps(2);
    click(&mut window, "Save");
    until(&mut window, "the question", |s| s["question"] == "overwrite");
    window.run_steps(2);
    click(&mut window, "Replace it");
    until(&mut window, "saving", |s| s["unsaved_changes"] == false);
    enter(&mut window, "velocity weight", "5");
    click(&mut window, "Load");
    until(&mut window, "the question", |s| s["question"] == "replace");
    window.run_steps(2);
    click(&mut window, "Keep it");
    assert_eq!(state(&window)["q_diagonal"][1], 5.0);
    click(&mut window, "Load");
    until(&mut window, "the question", |s| s["question"] == "replace");
    window.run_steps(2);
    click(&mut window, "Replace it");
    until(&mut window, "loading", |s| s["q_diagonal"][1] == 77.0);
}

#[test]
fn a_file_that_was_not_loaded_is_kept_unless_the_user_says_overwrite() {
    let precious = "precious = words\n";
    let file = TempFile::new("precious.toml", precious);
    let content = || std::fs::read_to_string(&file.0).unwrap();
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "model path", file.name());
    until(&mut window, "refusal", |s| s["message"].as_str().is_some_and(|m| m.contains(file.name())));
    let ask = |window: &mut Window| {
        click(window, "Save");
        until(window, "the question", |s| s["question"] == "overwrite");
        window.run_steps(2);
        window.get_by_label(&format!("The file {} exists.", file.name()));
    };
    ask(&mut window);
    click(&mut window, "Cancel");
    assert!(window.query_by_label("Replace it").is_none());
    assert_eq!(content(), precious);
    click(&mut window, "Reset weights");
    ask(&mut window);
    assert_eq!(content(), precious);
    click(&mut window, "Replace it");
    until(&mut window, "saving", |s| s["message"].as_str().is_some_and(|m| m.starts_with("Saved")));
    assert_eq!(Model::from_toml(&content(), "saved").unwrap().name, "Test robot");
    enter(&mut window, "velocity weight", "3");
    click(&mut window, "Save");
    until(&mut window, "saving without a question", |s| s["unsaved_changes"] == false);
}

#[cfg(unix)]
#[test]
fn a_second_model_file_waits_for_the_end_of_the_first() {
    let pipe = TempFile::new("pipe.toml", "");
    std::fs::remove_file(&pipe.0).unwrap();
    common::make_pipe(&pipe.0);
    let other = TempFile::new("beside.toml", "as before");
    let model_path = Some(other.0.clone());
    let mut window = open(WindowOptions { model_path, ..options(Tab::Tune) }, SIZE);
    enter(&mut window, "model path", pipe.name());
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(3);
    let busy = state(&window);
    assert!(busy["message"].as_str().unwrap().contains("still being read"), "{busy:#}");
    std::fs::write(&pipe.0, ROBOT.replace("Test robot", "From the pipe")).unwrap();
    until(&mut window, "loading", |s| s["model"] == "From the pipe");
    assert_eq!(std::fs::read_to_string(&other.0).unwrap(), "as before", "nothing was saved");
}

#[test]
fn settings_that_the_file_lacks_are_the_presets_said_and_not_saved() {
    let (bare, _) = ROBOT.split_once("[lqr]").unwrap();
    let file = TempFile::new("bare.toml", bare);
    let mut window = open(options(Tab::Tune), SIZE);
    enter(&mut window, "model path", file.name());
    let loaded = until(&mut window, "loading", |s| {
        s["message"].as_str().is_some_and(|message| message.contains("no [lqr] and no [compensation]"))
    });
    let paper = presets::paper().robot().unwrap().weights.unwrap();
    assert_eq!(loaded["q_diagonal"], serde_json::json!(paper.q.diagonal().as_slice()));
    assert_eq!(loaded["r_diagonal"], serde_json::json!(paper.r.diagonal().as_slice()));
    assert!(loaded["gain"].is_array(), "{loaded:#}");
    assert_eq!(loaded["unsaved_changes"], false);

    let saved = |window: &mut Window| {
        click(window, "Save");
        until(window, "saving", |s| s["message"].as_str().is_some_and(|m| m.starts_with("Saved")));
        Model::from_toml(&std::fs::read_to_string(&file.0).unwrap(), "saved")
            .unwrap()
            .robot()
            .unwrap()
            .clone()
    };
    let unedited = saved(&mut window);
    assert_eq!((unedited.weights, unedited.compensation), (None, None));
    enter(&mut window, "velocity weight", "3");
    click(&mut window, "Reset weights");
    assert_eq!(state(&window)["unsaved_changes"], false, "there is nothing to save again");
    enter(&mut window, "velocity weight", "3");
    let edited = saved(&mut window);
    assert_eq!(edited.weights.unwrap().q[(1, 1)], 3.0);
    assert_eq!(edited.compensation, None);
}

#[test]
fn gaps_are_drawn_zoomed_out_and_in() {
    let mut csv = String::from("time_s,motor_angle_rad,torque_nm\n");
    for index in 0..3000 {
        let time = f64::from(index) * 1e-3 + if index < 1500 { 0.0 } else { 4.0 };
        let torque = if index % 700 == 3 { String::new() } else { format!("{}", (time * 9.0).sin()) };
        csv += &format!("{time},{},{torque}\n", time * 3.0);
    }
    let log = TempFile::new("gap.csv", &csv);
    let mut window = open(WindowOptions { log: Some(log.0.clone()), ..options(Tab::Friction) }, SIZE);
    until(&mut window, "loading", |s| s["friction_tab"]["log"]["rows"].as_u64() > Some(2900));
    let middle = Pos2::new(650.0, 230.0);
    for delta in [400.0, 400.0, 2000.0, -300.0, -5000.0] {
        window.hover_at(middle);
        wheel(&window, delta);
        window.run_steps(8);
    }
}

#[test]
fn every_page_survives_any_size() {
    for tab in Tab::ALL {
        for size in [Vec2::ZERO, vec2(1.0, 1.0), vec2(300.0, 200.0), vec2(1920.0, 1080.0)] {
            open(options(tab), size).run_steps(3);
        }
    }
}

#[test]
fn a_hundred_frames_of_random_input_do_no_harm() {
    for (tab, seed) in Tab::ALL.into_iter().zip(1..) {
        random_input(&mut open(WindowOptions { paused: false, ..options(tab) }, SIZE), seed);
    }
}

#[test]
fn margins_are_those_of_the_delay_of_the_model() {
    let of = |delay_s: f64| {
        let text = format!("{ROBOT}[actuation]\ndelay_s = {delay_s}\n");
        let model = Model::from_toml(&text, "test.toml").unwrap();
        open(WindowOptions { model, ..options(Tab::Tune) }, SIZE)
    };
    // 6.43, 0.461 and 45.3 ms by scipy's eigenvalues over one IMU period, brought to 0 by bisection.
    let window = of(0.004);
    for text in ["×6.43", "×0.461", "+45.3 ms"] {
        assert!(window.query_by_label_contains(text).is_some(), "{text}");
    }
    let window = of(0.06);
    assert!(window.query_by_label("gain up").is_none());
    assert!(window.query_by_label_contains("Unstable when sampled (1 kHz, 60 ms of delay").is_some());
}

#[test]
fn a_dragged_pole_takes_the_weights_with_it_in_one_step() {
    let mut window = open(options(Tab::Tune), SIZE);
    let weights = |window: &Window| state(window)["q_diagonal"].clone();
    let before = weights(&window);
    let plane = window.get_by_label("pole map").rect();
    // Where the poles are, the plane alone knows: the pointer looks for one, a reach at a time.
    let places = (0..12).flat_map(|row| (0..10).map(move |column| (row, column)));
    let moved = places.into_iter().any(|(row, column)| {
        let from = plane.min + egui::vec2(5.0 + 15.0 * column as f32, 5.0 + 12.0 * row as f32);
        window.hover_at(from);
        window.step();
        window.drag_at(from);
        window.step();
        for way in [3.0, 6.0, 9.0] {
            window.hover_at(from - egui::vec2(way, 0.0));
            window.run_steps(2);
        }
        window.drop_at(from - egui::vec2(9.0, 0.0));
        window.run_steps(3);
        weights(&window) != before
    });
    assert!(moved, "no pole was found in {plane:?}");
    let after = state(&window);
    assert_eq!(after["undo"], serde_json::json!(["weights"]), "one drag is one step");
    assert_eq!(after["tune_tab"]["margins"]["stable"], true);
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    window.run_steps(3);
    assert_eq!(weights(&window), before);
}
