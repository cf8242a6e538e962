//! `flqr drive`: whoever reads its lines, or does not, the robot is stopped when that is asked for.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
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
    let patience = "[safety]\nlate_s = 1.0\nmotor_timeout_s = 1.0\nimu_timeout_s = 1.0\nimu_frozen_s = 1.0\n";
    fs::write(&model, format!("{paper}\n{patience}")).unwrap();
    model
}

fn drive(csv: &Path, more: &[&str], out: Stdio) -> Child {
    Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(["drive", "emulated"])
        .arg(patient_model(csv))
        .args(["--arm", "--yes", "--json", "--record"])
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

#[test]
fn a_reader_that_takes_no_line_does_not_keep_the_robot_from_being_stopped() {
    let (_reader, mut writer) = io::pipe().unwrap();
    writer.write_all(&[b'\n'; PIPE_BYTES]).unwrap();
    let csv = recording("drive-stalled.csv");
    let program = drive(&csv, &[], writer.into());
    wait_for(" 141#A1", &csv);
    let stop = Command::new("kill").args(["-INT", &program.id().to_string()]).status().unwrap();
    assert!(stop.success());
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
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && message.is_empty(), "{message}");
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
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
