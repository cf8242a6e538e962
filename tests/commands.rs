//! The program as scripts see it: arguments in; JSON, messages and exit codes out.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

const PAPER: &str = "presets/paper.toml";

fn flqr(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the program was built with its tests")
}

/// Runs a command that must succeed and print one JSON object and nothing else.
fn json(arguments: &[&str]) -> Value {
    let output = flqr(&[arguments, &["--json"]].concat());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Runs a command that must fail with `code`; gives its message, which is one line.
fn refusal(arguments: &[&str], code: i32) -> String {
    let output = flqr(arguments);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed a result beside its refusal");
    assert!(code == 2 || message.trim_end().lines().count() == 1, "{arguments:?}: {message}");
    message
}

/// A file of this text in the tests' own folder.
fn file(name: &str, text: &str) -> String {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        leaf => vec![leaf.as_f64().unwrap()],
    }
}

const DEMO_KEYS: [&str; 9] = [
    "verdict",
    "effects",
    "before",
    "after",
    "unexplained",
    "candidates",
    "closed_loop",
    "next_experiment",
    "data_health",
];

/// The whole loop, twice: what scripts read, the report, and the same bytes for the same seed.
#[test]
fn demo_finds_what_was_hidden_and_says_the_same_again() {
    let [report, model] = ["demo.html", "demo.toml"].map(|name| file(name, ""));
    let arguments = ["demo", "--report", &report, "--out", &model, "--json"];
    let first = flqr(&arguments);
    assert_eq!(first.status.code(), Some(0), "{}", String::from_utf8_lossy(&first.stderr));
    let (html, toml) = (std::fs::read(&report).unwrap(), std::fs::read_to_string(&model).unwrap());
    let second = flqr(&arguments);
    assert_eq!(first.stdout, second.stdout);
    assert_eq!(html, std::fs::read(&report).unwrap());
    let found: Value = serde_json::from_slice(&first.stdout).unwrap();
    for key in DEMO_KEYS {
        assert!(found.get(key).is_some(), "{key}");
    }
    assert_eq!(found["verdict"], "effects_found");
    assert_eq!(found["truth"]["named"], true, "{found:#}");
    let [before, after] =
        ["before", "after"].map(|key| found[key]["rmse"]["combined"]["value"].as_f64().unwrap());
    assert!(after < 0.7 * before, "{before} {after}");
    assert_eq!(found["before"]["prediction"].as_array().unwrap().len(), 9);
    assert!(found["closed_loop"]["scenarios"][0]["after"]["x_m"]["std"].is_f64());
    assert!(toml.contains("[[effects]]"));
    json(&["gains", &model]);
}

/// A run that is offered is one that can be started.
#[test]
fn experiments_that_are_offered_parse_and_run() {
    let log = file("offered.csv", "");
    for flags in [
        "--scenario cruise --slope -0.05",
        "--scenario multisine --torque-scale 2",
        "--scenario multisine --payload 2",
        "--scenario speed-tracking --controller pi --target-speed -1",
    ] {
        let words: Vec<&str> = flags.split(' ').collect();
        let run = [&["simulate", PAPER, "--seconds", "2", "--log", &log][..], &words].concat();
        assert_eq!(json(&run)["fell"], false, "{flags}");
    }
    refusal(&["simulate", PAPER, "--scenario", "cruise", "--torque-scale", "2"], 2);
    refusal(&["simulate", PAPER, "--scenario", "friction-sweep", "--controller", "pi", "--slope", "0.1"], 2);
}

/// What `refine` offers runs as it is printed, and its recording tells apart what the first log could not.
#[test]
fn the_next_experiment_tells_apart_what_the_log_could_not() {
    let shaft = "name = \"shaft\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.005\n[friction]\ncoulomb_nm = 0.03\n\
                 viscous_nm_s_rad = 0.0005\n";
    let cogging = "[[effects]]\nid = \"cogging\"\norder_1 = 14.0\ncos_1_nm = 0.006\nsin_1_nm = 0.004\n";
    let [declared, truth] = [("even.toml", shaft), ("even_truth.toml", &format!("{shaft}{cogging}"))]
        .map(|(name, text)| file(name, text));
    let [log, refined, next] = ["even.csv", "even_refined.toml", "even_next.csv"].map(|name| file(name, ""));
    let even = "--scenario speed-tracking --controller pi --target-speed 2 --seconds 20";
    let even: Vec<&str> = even.split(' ').collect();
    json(&[&["simulate", &declared, "--robot", &truth, "--log", &log][..], &even].concat());
    let found = json(&["refine", &declared, &log, "--out", &refined]);
    let rivals = |found: &Value| {
        let effects = found["effects"].as_array().unwrap();
        let cogging = effects.iter().find(|effect| effect["id"] == "cogging").unwrap();
        cogging["ambiguous_with"].as_array().unwrap().len()
    };
    assert!(rivals(&found) > 0, "{found:#}");
    let command = found["next_experiment"]["command"].as_str().unwrap();
    let words: Vec<&str> =
        command.split(' ').map(|word| if word == "next.csv" { &next } else { word }).collect();
    assert_eq!((words[0], words[2]), ("flqr", refined.as_str()), "{command}");
    json(&[&words[1..], &["--robot", &truth]].concat());
    assert_eq!(rivals(&json(&["refine", &declared, &log, &next])), 0, "{command}");
}

/// A log that cannot answer is told so before any effect, and what is no log of the machine is refused.
#[test]
fn refine_and_residual_of_logs_that_cannot_answer() {
    let log = file("short.csv", "");
    json(&["simulate", PAPER, "--scenario", "cruise", "--seconds", "4", "--log", &log]);
    let found = json(&["refine", PAPER, &log]);
    assert_eq!(found["verdict"], "data_unfit");
    assert_eq!(found["effects"].as_array().unwrap().len(), 0);
    assert!(found["next_experiment"]["summary"].is_string());
    assert!(json(&["residual", PAPER, &log])["data_health"].is_array());
    let pairs = file("pairs_of_refine.csv", "speed_rad_s,torque_nm\n1,0.1\n2,0.2\n");
    assert!(refusal(&["refine", PAPER, &pairs], 1).contains("pairs"));
    assert!(refusal(&["refine", PAPER, "absent.csv"], 1).contains("absent.csv"));
    refusal(&["refine", PAPER], 2);
}

#[test]
fn gains_of_the_papers_preset() {
    let gains = json(&["gains", PAPER]);
    let shapes = [("a", 16), ("b", 8), ("k", 8), ("p", 16), ("poles", 8)];
    for (key, count) in shapes {
        assert_eq!(numbers(&gains[key]).len(), count, "{key}");
    }
    assert!(gains["riccati_residual"].as_f64().unwrap() <= 1e-13);
    // R = ρ·1, so both motors get the same gain.
    assert_eq!(gains["k"][0], gains["k"][1]);
    // K = R⁻¹BᵀP (Eq. 24), recomputed from the printed matrices.
    let (b, p) = (numbers(&gains["b"]), numbers(&gains["p"]));
    let weight = weight_of_torque();
    for state in 0..4 {
        let expected = (0..4).map(|i| b[2 * i] * p[4 * i + state]).sum::<f64>() / weight;
        let found = numbers(&gains["k"])[state];
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} for {expected}");
    }
    assert!(numbers(&gains["poles"]).iter().step_by(2).all(|&real| real < 0.0));
}

fn weight_of_torque() -> f64 {
    let text = std::fs::read_to_string(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(PAPER)).unwrap();
    let model = flqr_core::model::Model::from_toml(&text, PAPER).unwrap();
    model.robot().unwrap().weights.unwrap().r[(0, 0)]
}

#[test]
fn riccati_of_a_double_integrator_has_its_closed_form() {
    let weighted =
        file("care.json", r#"{"a": [[0, 1], [0, 0]], "b": [[0], [1]], "q": [[1, 0], [0, 1]], "r": [[1]]}"#);
    let quadratic =
        file("care_g.json", r#"{"a": [[0, 1], [0, 0]], "g": [[0, 0], [0, 1]], "q": [[1, 0], [0, 1]]}"#);
    let root = 3f64.sqrt();
    for (path, has_gain) in [(weighted, true), (quadratic, false)] {
        let solution = json(&["riccati", &path]);
        for (found, expected) in numbers(&solution["p"]).into_iter().zip([root, 1.0, 1.0, root]) {
            assert!((found - expected).abs() <= 2.0 * f64::EPSILON * root, "{found} for {expected}");
        }
        assert_eq!(solution.get("k").is_some(), has_gain);
        assert!(solution["riccati_residual"].as_f64().unwrap() < 1e-15);
        assert_eq!(solution["warnings"], Value::Array(vec![]));
    }
}

#[test]
fn riccati_warns_of_keys_that_it_does_not_know() {
    let path = file("cross.json", r#"{"a": [[0]], "b": [[1]], "q": [[1]], "r": [[1]], "s": [[1]]}"#);
    assert_eq!(json(&["riccati", &path])["warnings"][0], "key `s` is unknown and was ignored");
}

#[test]
fn riccati_refuses_what_has_no_answer() {
    for (name, text, part) in [
        (
            "unstabilisable",
            r#"{"a": [[1, 0], [0, 2]], "b": [[1], [0]], "q": [[1, 0], [0, 1]], "r": [[1]]}"#,
            "stabilis",
        ),
        ("singular_r", r#"{"a": [[1]], "b": [[1]], "q": [[1]], "r": [[0]]}"#, "positive definite"),
        ("ragged", r#"{"a": [[1, 2], [3]], "b": [[1]], "q": [[1]], "r": [[1]]}"#, "row 2"),
        ("shape", r#"{"a": [[1]], "b": [[1], [2]], "q": [[1]], "r": [[1]]}"#, "b"),
        ("text", r#"{"a": [["one"]], "b": [[1]], "q": [[1]], "r": [[1]]}"#, "line 1"),
        ("both", r#"{"a": [[1]], "b": [[1]], "g": [[1]], "q": [[1]], "r": [[1]]}"#, "either"),
        ("cut", r#"{"a": [[1]], "b": "#, "EOF"),
    ] {
        let message = refusal(&["riccati", &file(&format!("{name}.json"), text)], 1);
        assert!(message.contains(part) && message.contains(name), "{message}");
    }
}

#[test]
fn fit_finds_the_curve_behind_pairs() {
    let curve = flqr_core::friction::Stribeck::new(flqr_core::friction::StribeckParameters {
        coulomb_nm: 0.0338,
        static_nm: 0.0761,
        viscous_nm_s_rad: 4.9e-4,
        stribeck_speed_rad_s: 1.612,
        stribeck_exponent: 0.2310,
        offset_nm: -0.0016,
    })
    .unwrap();
    let speeds = (0..260).map(|i| -50.0 + 100.0 * f64::from(i) / 259.0);
    let rows: String = speeds.map(|speed| format!("{speed},{}\n", curve.torque_nm(speed))).collect();
    let path = file("pairs.csv", &format!("speed_rad_s,torque_nm\n{rows}"));
    let fit = json(&["fit", &path]);
    assert!(fit["rmse"]["value"].as_f64().unwrap() < 1e-6, "{}", fit["rmse"]);
    assert_eq!(fit["rmse"]["unit"], "N m");
    assert_eq!(fit["pairs"].as_array().unwrap().len(), 260);
    assert_eq!(fit["history"].as_array().unwrap().len() as u64, fit["iterations"].as_u64().unwrap());
    assert!(fit["parameters"]["viscous_nm_s_rad"]["ci95"].is_array());
    assert_eq!(json(&["fit", &path]), fit, "the same seed gave another answer");
}

#[test]
fn bad_logs_are_refused_in_one_sentence() {
    for (name, text, part) in [
        ("empty.csv", "", "empty"),
        ("missing.csv", "time_s,motor_angle_rad,current_a\n0,0,0\n1,1,1\n", "torque_nm"),
        ("words.csv", "time_s,motor_angle_rad,torque_nm\n0,zero,0\n1,one,1\n2,two,1\n", "motor_angle_rad"),
        ("nan.csv", "speed_rad_s,torque_nm\n1,nan\n2,nan\n", "torque_nm"),
        ("back.csv", "time_s,motor_angle_rad,torque_nm\n3,0,0\n2,0,0\n1,0,0\n0,0,0\n", "time"),
    ] {
        let message = refusal(&["fit", &file(name, text)], 1);
        assert!(message.contains(part) && message.contains(name), "{message}");
    }
    assert!(refusal(&["fit", "no_such.csv"], 1).contains("no_such.csv: there is no such file"));
    assert!(refusal(&["fit", "presets"], 1).contains("presets: this is a folder"));
    assert!(refusal(&["fit", "x.csv", "--map", "torque_nm"], 2).contains("torque_nm"));
}

#[test]
fn friction_feedforward_ends_the_hunting() {
    let run = |controller: &str| {
        json(&["simulate", PAPER, "--scenario", "flat", "--controller", controller, "--seconds", "60"])
    };
    let (lqr, flqr) = (run("lqr"), run("flqr"));
    let range = |run: &Value| {
        run["statistics"]["x_m"]["max"].as_f64().unwrap() - run["statistics"]["x_m"]["min"].as_f64().unwrap()
    };
    assert_eq!((&lqr["settled"], &flqr["settled"]), (&Value::Bool(false), &Value::Bool(true)));
    assert_eq!((&lqr["fell"], &flqr["fell"]), (&Value::Bool(false), &Value::Bool(false)));
    assert!(range(&lqr) >= 3.0 * range(&flqr), "{} against {}", range(&lqr), range(&flqr));
    assert_eq!(run("lqr"), lqr, "the same seed gave another run");
}

#[test]
fn a_simulated_run_is_a_robot_log() {
    let path = file("run.csv", "");
    json(&["simulate", PAPER, "--seconds", "2", "--log", &path]);
    let text = std::fs::read_to_string(&path).unwrap();
    let header = text.lines().next().unwrap();
    assert!(header.starts_with("time_s,x_m,x_dot_m_s,pitch_rad,pitch_rate_rad_s"), "{header}");
    assert_eq!(text.lines().count(), 2001);
}

/// A model file: the paper's preset with some of its text replaced.
fn paper_with(name: &str, changes: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(PAPER)).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    file(name, &text)
}

#[test]
fn every_scenario_runs_and_has_its_keys() {
    for (scenario, controller, seconds) in [
        ("flat", "lqr", "1"),
        ("bridge", "flqr", "12"),
        ("kick", "flqr", "1"),
        ("cruise", "lqr", "1"),
        ("station", "flqr", "1"),
        ("multisine", "flqr", "1"),
        ("multisine", "pi", "1"),
        ("speed-tracking", "pi", "1"),
        ("friction-sweep", "lqr", "30"),
    ] {
        let path = file(&format!("{scenario}_{controller}.csv"), "");
        let run = json(&[
            "simulate",
            PAPER,
            "--scenario",
            scenario,
            "--controller",
            controller,
            "--seconds",
            seconds,
            "--log",
            &path,
        ]);
        let in_the_air = controller == "pi" || scenario == "friction-sweep";
        let quantities: &[&str] =
            if in_the_air { &["motor_speed_rad_s", "torque_nm"] } else { &["x_m", "x_dot_m_s", "pitch_rad"] };
        for quantity in quantities {
            for key in ["min", "max", "mean", "std"] {
                assert!(run["statistics"][quantity][key].is_f64(), "{scenario} {controller}: {run}");
            }
        }
        assert_eq!(run["fell"], false);
        assert_eq!(run["settled"].is_null(), in_the_air);
        assert_eq!(run["warnings"], Value::Array(vec![]));
        assert_eq!(run.get("tracking").is_some(), scenario == "speed-tracking");
        assert_eq!(
            run.get("target_x_m").and_then(Value::as_f64),
            match (in_the_air, scenario) {
                (true, _) => None,
                (false, "bridge") => Some(1.0),
                (false, _) => Some(0.0),
            }
        );
        let text = std::fs::read_to_string(&path).unwrap();
        let expected = if in_the_air {
            "time_s,motor_angle_rad,torque_nm,motor_speed_rad_s,target_speed_rad_s"
        } else {
            "time_s,x_m,x_dot_m_s,pitch_rad,pitch_rate_rad_s,motor_angle_left_rad"
        };
        assert!(text.starts_with(expected), "{scenario} {controller}");
        assert_eq!(text.lines().count(), 1 + 1000 * seconds.parse::<usize>().unwrap());
    }
}

#[test]
fn a_sweep_of_either_motor_fits_to_its_curve() {
    for (motor, key, value) in [("left", "static_nm", 0.0761), ("right", "static_nm", 0.0617)] {
        let path = file(&format!("sweep_{motor}.csv"), "");
        let arguments = ["simulate", PAPER, "--scenario", "friction-sweep", "--controller", "pi"];
        json(
            &[&arguments[..], &["--seed", "5", "--motor", motor, "--seconds", "60", "--log", &path]].concat(),
        );
        let fit = json(&["fit", &path]);
        assert_eq!(fit["pairs"].as_array().unwrap().len(), 264);
        let bounds = numbers(&fit["parameters"][key]["ci95"]);
        assert!(bounds[0] < value && value < bounds[1], "{motor}: {}", fit["parameters"]);
    }
}

#[test]
fn tracking_gains_are_the_users() {
    let rise = |kp: &str, ki: &str| {
        let arguments = ["simulate", PAPER, "--scenario", "speed-tracking", "--controller", "pi"];
        let run = json(&[&arguments[..], &["--seconds", "20", "--kp", kp, "--ki", ki]].concat());
        ["left", "right"].map(|motor| run["tracking"][motor]["rise_time_s"].as_f64().unwrap())
    };
    let (fast, slow) = (rise("0.1", "0.05"), rise("0.05", "0.01"));
    assert!(fast[0] < slow[0] && fast[1] < slow[1], "{fast:?} {slow:?}");
}

#[test]
fn a_robot_that_falls_is_told_with_time_and_state_and_its_log_ends_there() {
    let path = file("fall.csv", "");
    let output = flqr(&["simulate", PAPER, "--gain", "0,0,0,0", "--log", &path, "--json"]);
    assert_eq!(output.status.code(), Some(0));
    let run: Value = serde_json::from_slice(&output.stdout).unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(run["warnings"][0].as_str().unwrap().contains("unstable"), "{run}");
    assert!(message.lines().next().unwrap().contains("unstable"), "told after the run: {message}");
    assert_eq!((&run["fell"], &run["settled"]), (&Value::Bool(true), &Value::Bool(false)));
    let time_s = run["fall"]["time_s"].as_f64().unwrap();
    assert!(run["fall"]["state"]["pitch_rad"].as_f64().unwrap().abs() > 0.8);
    assert!(message.contains(&format!("fell at {time_s:.3} s")), "{message}");
    let rows = std::fs::read_to_string(&path).unwrap().lines().count() - 1;
    assert_eq!(rows, (1000.0 * time_s).round() as usize);
}

#[test]
fn another_robot_than_the_model_can_be_simulated() {
    let slope = paper_with("slope.toml", &[("[limits]", "[surroundings]\nslope_rad = 0.03\n[limits]")]);
    let lean = |arguments: &[&str]| {
        let run =
            json(&[&["simulate", PAPER, "--scenario", "station", "--seconds", "30"], arguments].concat());
        run["statistics"]["pitch_rad"]["mean"].as_f64().unwrap()
    };
    // Uphill it leans forward, by (13 + 2) kg · sin(0.03) · 0.055 m / (13 kg · 0.16 m).
    let leans = lean(&["--robot", &slope]) - lean(&[]);
    assert!((leans - 0.0119).abs() < 0.003, "{leans} rad");
    let high = lean(&["--leg-height", "0.42"]);
    assert!(high.abs() < 0.01 && high != lean(&[]), "{high} rad");
    let rigid = file("rigid.toml", "name = \"a\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.01\n");
    assert!(refusal(&["simulate", PAPER, "--robot", &rigid], 1).contains("[robot]"));
    assert!(refusal(&["simulate", PAPER, "--robot", "none.toml"], 1).contains("none.toml"));
}

#[test]
fn one_shaft_is_swept_whatever_the_motor() {
    let axis = "name = \"spindle\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.01\n[friction]\ncoulomb_nm = 0.1\n\
                viscous_nm_s_rad = 0.002\noffset_nm = 0.0\n";
    let axis = file("spindle.toml", axis);
    let run = |motor: &str| {
        json(&[
            "simulate",
            &axis,
            "--scenario",
            "friction-sweep",
            "--controller",
            "pi",
            "--seconds",
            "30",
            "--motor",
            motor,
        ])
    };
    assert_eq!(run("left"), run("right"));
}

#[test]
fn a_motion_that_is_not_finite_ends_with_its_step_and_keeps_its_log() {
    let tether = "[surroundings]\ntether = { stiffness_n_m = 1e308, anchor_m = -100.0 }\n[limits]";
    let broken = paper_with("tether.toml", &[("[limits]", tether)]);
    let path = file("broken.csv", "");
    let message = refusal(&["simulate", PAPER, "--robot", &broken, "--log", &path], 1);
    assert!(message.contains("not finite from step 1 (0.001 s)"), "{message}");
    assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 2);
}

#[test]
fn a_log_that_cannot_be_written_leaves_nothing_behind() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("unwritable");
    std::fs::create_dir_all(folder.join("run.csv")).unwrap();
    let path = folder.join("run.csv").display().to_string();
    let message = refusal(&["simulate", PAPER, "--seconds", "1", "--log", &path], 1);
    assert!(message.contains("run.csv") && message.contains("check the folder"), "{message}");
    let left: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["run.csv"]);
}

#[test]
fn gains_have_the_margins_of_the_loop_as_it_runs() {
    let gains = json(&["gains", PAPER]);
    let margins = &gains["margins"];
    let value = |key: &str| margins[key].as_f64().unwrap();
    assert_eq!(margins["stable"], true);
    assert_eq!(gains["warnings"], serde_json::json!([]));
    assert!(value("gain_up") > 1.0 && value("gain_down") < 1.0, "{margins}");
    // What the phase margin leaves is used up by a delay of that phase at the crossover, to the hold's share.
    let delay_s = value("phase_rad") / value("crossover_rad_s");
    assert!((delay_s / value("delay_s") - 1.0).abs() < 0.01, "{margins}");
}

#[test]
fn gains_follow_the_legs() {
    let model = "name = \"legs\"\n[robot]\nbody_mass_kg = 12.5\nwheel_mass_kg = 1.25\n\
         wheel_inertia_kg_m2 = 0.0025\nwheel_radius_m = 0.063\nleg_height_m = 0.35\n\
         com_height_m = { leg_height_m = [0.32, 0.42], com_height_m = [0.12, 0.19] }\n\
         body_inertia_kg_m2 = 0.1\n[lqr]\nq_diagonal = [1.0, 0.01, 0.01, 0.001]\nr_diagonal = [1.25, 1.25]\n";
    let legged = file("legged.toml", model);
    let slow = file("slow.toml", &format!("{model}[actuation]\ndelay_s = 0.3\n"));
    let schedule = json(&["gains", &legged, "--schedule", "3"])["schedule"].clone();
    let heights: Vec<f64> =
        schedule.as_array().unwrap().iter().map(|node| node["leg_height_m"].as_f64().unwrap()).collect();
    assert_eq!(heights, [0.32, 0.37, 0.42]);
    for (node, height) in schedule.as_array().unwrap().iter().zip(["0.32", "0.37", "0.42"]) {
        let one = json(&["gains", &legged, "--leg-height", height]);
        for (found, expected) in numbers(&node["k"]).into_iter().zip(numbers(&one["k"])) {
            assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} for {expected}");
        }
        assert_eq!(node["margins"]["stable"], true);
    }
    assert!(refusal(&["gains", &legged, "--leg-height", "0.5"], 1).contains("leg_height_m = 0.5"));
    assert!(refusal(&["gains", &legged, "--schedule", "1"], 1).contains("from 2 to 1000 heights"));
    let late = json(&["gains", &slow]);
    assert_eq!(late["margins"]["stable"], false);
    assert!(
        String::from_utf8(flqr(&["gains", &slow]).stderr)
            .unwrap()
            .contains("flqr: warning: the sampled closed loop")
    );
    assert!(late["warnings"][0].as_str().unwrap().contains("delay 300 ms"), "{late}");
}

#[test]
fn exports_carry_the_gain() {
    let gain = numbers(&json(&["gains", PAPER])["k"]);
    for form in ["c-header", "json", "yaml", "csv"] {
        let output = flqr(&["export", PAPER, "--to", form]);
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0));
        assert!(gain.iter().all(|entry| text.contains(&entry.to_string())), "{form}: {text}");
    }
}

#[test]
fn wrong_models_are_refused_with_file_and_line() {
    let paper = std::fs::read_to_string(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(PAPER)).unwrap();
    let key = file("key.toml", &paper.replace("wheel_radius_m", "wheel_radus_m"));
    let line = 1 + paper.lines().position(|line| line.starts_with("wheel_radius_m")).unwrap();
    let message = refusal(&["gains", &key], 1);
    assert!(message.contains(&format!("key.toml:{line}:")) && message.contains("wheel_radus_m"), "{message}");
    let axis = file("axis.toml", "name = \"a\"\n[axis]\nkind = \"linear\"\nmass_kg = 1.0\n");
    assert!(refusal(&["gains", &axis], 1).contains("[robot]"));
    assert!(refusal(&["simulate", &axis], 1).contains("[robot]"));
    let bare = file("bare.toml", paper.split("[lqr]").next().unwrap());
    assert!(refusal(&["gains", &bare], 1).contains("[lqr]"));
    let message = refusal(&["simulate", &bare, "--controller", "lqr"], 1);
    assert!(message.contains("bare.toml") && message.contains("[lqr]"), "{message}");
    assert!(refusal(&["simulate", PAPER, "--seconds", "1e9"], 2).contains("3600"));
    assert!(refusal(&["simulate", PAPER, "--leg-height", "0.9"], 1).contains("leg_height_m = 0.9"));
    let short = ["simulate", PAPER, "--scenario", "friction-sweep", "--controller", "pi", "--seconds", "5"];
    assert!(refusal(&short, 1).contains("give at least"));
}

#[test]
fn a_unit_slip_in_a_model_is_a_warning_of_every_command_and_a_key_of_its_result() {
    let model = paper_with("slip.toml", &[("wheel_radius_m = 0.055", "wheel_radius_m = 55.0")]);
    let warning = "robot.wheel_radius_m: 55 looks like millimetres";
    for command in [
        &["gains", &model][..],
        &["export", &model, "--to", "json"],
        &["simulate", &model, "--seconds", "0.01"],
    ] {
        let message = String::from_utf8(flqr(command).stderr).unwrap();
        assert!(message.contains(&format!("slip.toml: {warning}")), "{command:?}: {message}");
    }
    for command in [&["gains", &model][..], &["simulate", &model, "--seconds", "0.01"]] {
        let result = json(command);
        let warnings = result["warnings"].as_array().unwrap();
        assert!(
            warnings.iter().any(|text| text.as_str().is_some_and(|text| text.starts_with(warning))),
            "{command:?}: {warnings:?}"
        );
    }
}

#[test]
fn a_safety_limit_that_switches_its_check_off_is_refused_before_a_robot_is_driven() {
    let degrees = paper_with("degrees.toml", &[("[limits]", "[safety]\ntilt_rad = 30\n[limits]")]);
    let message = refusal(&["drive", "emulated", &degrees], 1);
    assert!(message.contains("30 looks like degrees: 30° is 0.524 rad"), "{message}");
    let lazy = paper_with("unstable.toml", &[("delay_s = 0.004", "delay_s = 0.06")]);
    let message = refusal(&["drive", "emulated", &lazy], 1);
    assert!(message.contains("the loop is unstable with its sampling and 60.0 ms of delay"), "{message}");
}

#[test]
fn flags_stand_anywhere() {
    let behind = flqr(&["gains", PAPER, "--json"]);
    assert_eq!(flqr(&["--json", "gains", PAPER]), behind);
    assert_eq!(flqr(&["gains", "--json", PAPER]), behind);
}

#[test]
fn wrong_usage_ends_with_2() {
    for arguments in [
        &["gains"][..],
        &["no-such-command"],
        &["simulate", PAPER, "--seconds", "-1"],
        &["simulate", PAPER, "--scenario", "moon"],
        &["simulate", PAPER, "--controller", "pi"],
        &["simulate", PAPER, "--kp", "0.5"],
        &["simulate", PAPER, "--kp", "-0.5", "--ki", "0"],
        &["simulate", PAPER, "--gain", "1,2,3"],
        &["simulate", PAPER, "--gain", "1,2,3,inf"],
        &["--paused", "gains", PAPER],
    ] {
        refusal(arguments, 2);
    }
    let message = refusal(&["simulate", PAPER, "--scenario", "kick", "--controller", "pi"], 2);
    assert!(message.contains("use lqr or flqr"), "{message}");
}

/// Other systems have a display even where these variables are not set.
#[cfg(all(unix, not(target_os = "macos")))]
#[test]
fn without_a_display_a_sentence_names_the_commands() {
    let message = refusal(&[], 1);
    assert!(message.contains("display") && message.contains("flqr simulate"), "{message}");
}

/// Robot log in, MCAP file out; same input, same bytes.
#[test]
fn a_log_becomes_an_mcap_file() {
    let log = file("convert.csv", "");
    json(&["simulate", PAPER, "--seconds", "1", "--log", &log]);
    let out = file("convert.mcap", "");
    let done = json(&["convert", &log, &out]);
    assert_eq!(done["topics"]["/state"], 1000, "{done}");
    assert_eq!((&done["topics"]["/motors/left"], &done["dropped"]), (&1000.into(), &0.into()));
    let file = std::fs::read(&out).unwrap();
    assert!(file.starts_with(b"\x89MCAP0\r\n") && file.ends_with(b"\x89MCAP0\r\n"));
    assert!(file.windows(5).any(|window| window == b"x_dot"));
    json(&["convert", &log, &out]);
    assert_eq!(std::fs::read(&out).unwrap(), file);

    let message = refusal(&["convert", &log, "run.csv"], 1);
    assert!(message.contains("run.csv: the last file is the output"), "{message}");
    let frames = file_of_frames();
    let message = refusal(&["convert", &frames, "no such folder/run.mcap"], 1);
    assert!(message.contains("no such folder/run.mcap: cannot write the MCAP file"), "{message}");
    let nonsense = self::file("nonsense.log", "(1.0) what?\n");
    let message = refusal(&["convert", &nonsense, &out], 1);
    assert!(message.contains("nonsense.log: 1 of 1 rows cannot be used, the first at line 1"), "{message}");
    assert_eq!(std::fs::read(&out).unwrap(), file, "a failure leaves what was there");
    refusal(&["convert", &log], 2);
}

fn file_of_frames() -> String {
    file("frames.log", "(1700000000.001000) can0 141#A100000084010000 T\n")
}
