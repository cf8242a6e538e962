//! `flqr drive`: whoever reads its lines, or does not, the robot is stopped when that is asked for.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use serde_json::Value;

/// What an empty pipe takes.
const PIPE_BYTES: usize = 65_536;

fn recording(name: &str) -> PathBuf {
    let csv = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    for ending in ["csv", "log"] {
        let _absent = fs::remove_file(csv.with_extension(ending));
    }
    csv
}

/// The paper's robot on a machine that may be busy.
fn patient_model(csv: &Path) -> PathBuf {
    let model = csv.with_extension("toml");
    let paper = fs::read_to_string("presets/paper.toml").unwrap();
    let patience = "[safety]\nlate_s = 1.0\nmotor_timeout_s = 1.0\nimu_timeout_s = 1.0\nimu_frozen_s = 1.0\nround_trip_s = 1.0\n";
    fs::write(&model, format!("{paper}\n{patience}")).unwrap();
    model
}

fn drive(csv: &Path, more: &[&str], out: Stdio) -> Child {
    start(csv, &[&["--arm", "--yes"], more].concat(), out)
}

fn start(csv: &Path, more: &[&str], out: Stdio) -> Child {
    Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(["drive", "emulated"])
        .arg(patient_model(csv))
        .args(["--json", "--record"])
        .arg(csv)
        .args(more)
        .stdin(Stdio::null())
        .stdout(out)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn wait_for(frame: &str, csv: &Path) {
    let log = csv.with_extension("log");
    while !fs::read_to_string(&log).is_ok_and(|text| text.contains(frame)) {
        sleep(Duration::from_millis(50));
    }
}

fn signal(program: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &program.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

fn lines(output: &Output) -> Vec<Value> {
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// The object that every run ends with.
fn end(output: &Output) -> Value {
    let ends: Vec<Value> = lines(output).into_iter().filter(|line| line["type"] == "end").collect();
    let [end] = &ends[..] else { panic!("{ends:?}") };
    end.clone()
}

/// Command bytes of the frames that were sent, in turn.
fn sent(csv: &Path) -> Vec<String> {
    let frames = fs::read_to_string(csv.with_extension("log")).unwrap();
    let sent = frames.lines().filter(|frame| frame.ends_with(" T"));
    sent.map(|frame| frame.split_once('#').unwrap().1[..2].to_owned()).collect()
}

#[test]
fn without_arm_nothing_is_sent_but_queries() {
    let csv = recording("drive-checked.csv");
    let output = start(&csv, &[], Stdio::piped()).wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let end = end(&output);
    assert!(end["problem"].is_null() && end["motors_off"] == true, "{end}");
    let sent = sent(&csv);
    assert!(
        sent.len() > 100 && sent.iter().all(|command| ["9A", "9C"].contains(&command.as_str())),
        "{sent:?}"
    );
}

#[test]
fn every_signal_stops_the_robot_before_it_ends_or_suspends_the_program() {
    let usual = ["INT", "TERM"];
    let others = ["HUP", "QUIT", "USR1", "USR2", "XFSZ", "TSTP"];
    std::thread::scope(|scope| {
        for name in usual.into_iter().chain(others) {
            scope.spawn(move || {
                let csv = recording(&format!("drive-{name}.csv"));
                let program = drive(&csv, &[], Stdio::piped());
                wait_for(" 141#A1", &csv);
                signal(&program, name);
                if name == "TSTP" {
                    let state = format!("/proc/{}/stat", program.id());
                    while !fs::read_to_string(&state).unwrap().contains(") T ") {
                        sleep(Duration::from_millis(10));
                    }
                    assert_eq!(sent(&csv).last().unwrap(), "80", "the motors are off while it is suspended");
                    signal(&program, "CONT");
                }
                let output = program.wait_with_output().unwrap();
                let end = end(&output);
                assert_eq!(
                    (&end["stopped_by"], &end["signal"], &end["motors_off"]),
                    (&"requested".into(), &format!("SIG{name}").into(), &true.into())
                );
                assert_eq!(output.status.code(), Some(i32::from(!usual.contains(&name))), "{end}");
                assert_eq!(end["problem"].is_null(), usual.contains(&name), "{end}");
                let sent = sent(&csv);
                let torques_nm = fs::read_to_string(csv.with_extension("csv")).unwrap();
                assert!(torques_nm.contains("stop: stopped"), "the stop is in the recording");
                assert_eq!(&sent[sent.len() - 2..], ["80", "80"], "{name}");
                assert!(
                    sent.iter().rev().nth(2).is_some_and(|command| command == "A1"),
                    "torque zero before"
                );
            });
        }
    });
}

#[test]
fn a_run_that_fails_has_its_end_line_too() {
    let csv = recording("drive-unarmed.csv");
    let output = start(&csv, &["--arm"], Stdio::piped()).wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let end = end(&output);
    assert!(end["problem"].as_str().unwrap().contains("there is no terminal for the confirmation"), "{end}");
    assert!(end["recording"]["rows"].as_u64().unwrap() > 0 && end["motors_off"] == true, "{end}");
}

#[test]
fn a_run_that_is_refused_leaves_no_recording() {
    let csv = recording("drive-refused.csv");
    let model = csv.with_extension("toml");
    let paper = fs::read_to_string("presets/paper.toml").unwrap();
    let without: String =
        paper.lines().filter(|line| !line.starts_with("torque_nm")).map(|line| format!("{line}\n")).collect();
    assert_ne!(without.len(), paper.len());
    fs::write(&model, without).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(["drive", "emulated"])
        .args([&model, Path::new("--record"), &csv])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    for ending in ["csv", "log"] {
        assert!(!csv.with_extension(ending).exists(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn a_recording_that_ends_early_is_a_problem_of_the_run() {
    let csv = recording("drive-cut.csv");
    let model = patient_model(&csv);
    // Files may grow to 64 blocks of 512 or 1024 bytes, then the system sends SIGXFSZ.
    let script =
        "ulimit -f 64; exec \"$0\" drive emulated \"$1\" --arm --yes --json --record \"$2\" --seconds 60";
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_flqr")])
        .args([&model, &csv])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let end = end(&output);
    let problem = end["problem"].as_str().unwrap();
    assert!(problem.contains("the recording has stopped") && problem.contains("were lost"), "{end}");
    assert!(end["recording"]["rows_lost"].as_u64().unwrap() > 0 && end["motors_off"] == true, "{end}");
    assert_eq!(String::from_utf8(output.stderr).unwrap(), format!("flqr: {problem}\n"));
}

#[test]
fn a_reader_that_takes_no_line_does_not_keep_the_robot_from_being_stopped() {
    let (_reader, mut writer) = io::pipe().unwrap();
    writer.write_all(&[b'\n'; PIPE_BYTES]).unwrap();
    let csv = recording("drive-stalled.csv");
    let program = drive(&csv, &[], writer.into());
    wait_for(" 141#A1", &csv);
    signal(&program, "INT");
    let output = program.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && message.contains("lines were not printed"), "{message}");
    let frames = fs::read_to_string(csv.with_extension("log")).unwrap();
    assert!(
        frames.lines().rev().take(100).any(|frame| frame.contains(" 141#8000000000000000")),
        "motors off"
    );
}

#[test]
fn a_reader_that_lives_gets_every_line_in_order_down_to_the_end() {
    let csv = recording("drive-read.csv");
    let output = drive(&csv, &["--seconds", "1"], Stdio::piped()).wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && message.is_empty(), "{message}");
    let lines = lines(&output);
    let times: Vec<f64> = lines
        .iter()
        .filter(|line| line["type"] == "status")
        .map(|line| line["time_s"].as_f64().unwrap())
        .collect();
    assert!(times.len() > 10 && times.is_sorted(), "{times:?}");
    assert!(lines.iter().any(|line| line["stage"] == "driving"));
    let end = lines.last().unwrap();
    assert_eq!(
        (&end["type"], &end["stopped_by"], &end["lines_dropped"]),
        (&"end".into(), &"time_over".into(), &0.into())
    );
}
