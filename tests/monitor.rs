//! `flqr monitor` on recordings: lines, speeds, the end, and robots that a DBC file describes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

fn monitor(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flqr")).arg("monitor").args(arguments).output().unwrap()
}

/// The lines of JSON of a run that succeeds.
fn lines(arguments: &[&str]) -> Vec<Value> {
    let output = monitor(&[arguments, &["--json"]].concat());
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && message.is_empty(), "{arguments:?}: {message}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The message of a run that fails, which prints nothing else.
fn refusal(arguments: &[&str], code: i32) -> String {
    let output = monitor(arguments);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(code), 0), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn file(name: &str, text: &str) -> String {
    std::fs::write(path(name), text).unwrap();
    path(name).display().to_string()
}

fn of_type<'a>(lines: &'a [Value], name: &str) -> Vec<&'a Value> {
    lines.iter().filter(|line| line["type"] == name).collect()
}

#[test]
fn a_recorded_run_is_replayed_at_any_speed_and_ends_by_itself() {
    for ending in ["csv", "log"] {
        let _absent = std::fs::remove_file(path("monitor-run").with_extension(ending));
    }
    let csv = path("monitor-run.csv").display().to_string();
    let live = lines(&["emulated", "--seconds", "1.2", "--record", &csv]);
    let late = of_type(&live, "status").last().unwrap()["bus"]["late"].as_u64();
    assert!(late.is_some(), "{live:?}");
    let source = format!("replay:{csv}");
    for speed in ["1", "7.5", "0"] {
        let lines = lines(&[&source, "--speed", speed]);
        let (status, events) = (of_type(&lines, "status"), of_type(&lines, "event"));
        let last = status.last().unwrap();
        assert_eq!(last["connection"], "ended", "{last}");
        assert!(last["state"]["pitch_rad"].is_f64() && last["time_s"].as_f64().unwrap() > 1.0, "{last}");
        assert!(last["bus"]["received"].as_u64().unwrap() > 1000, "{last}");
        assert_eq!((&last["bus"]["lost"], &last["loop"]["ticks"]), (&Value::from(0), &Value::from(0)));
        assert!(events.last().unwrap()["text"].as_str().unwrap().starts_with("end of the recording: "));
        let end = lines.last().unwrap();
        assert_eq!((&end["type"], &end["text"]), (&"end".into(), &"end of recording".into()));
    }
    let text = String::from_utf8(monitor(&[&source, "--speed", "0"]).stdout).unwrap();
    assert!(text.ends_with("end: end of recording\n"), "{text}");
}

#[test]
fn recordings_and_speeds_that_do_not_serve_are_refused_in_a_sentence() {
    let none = format!("replay:{}", path("monitor-none.csv").display());
    assert!(refusal(&[&none], 1).ends_with("there is no such file: check the path\n"));
    let empty = file("monitor-empty.log", "");
    let message = refusal(&[&format!("replay:{empty}")], 1);
    assert!(
        message
            .ends_with("monitor-empty.log contains neither rows nor frames: give a recording of a robot\n"),
        "{message}"
    );
    for speed in ["-1", "x", "1e9", "nan"] {
        assert!(refusal(&[&none, &format!("--speed={speed}")], 2).contains("0.01 to 1000, or 0"));
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_takes_no_line_does_not_keep_the_monitor_from_ending() {
    use std::io::Write;
    use std::process::Stdio;
    const PIPE_BYTES: usize = 65_536;
    let (_reader, mut writer) = std::io::pipe().unwrap();
    writer.write_all(&[b'\n'; PIPE_BYTES]).unwrap();
    for ending in ["csv", "log"] {
        let _absent = std::fs::remove_file(path("monitor-stalled").with_extension(ending));
    }
    let csv = path("monitor-stalled.csv");
    let program = Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(["monitor", "emulated", "--json", "--record"])
        .arg(&csv)
        .stdout(writer)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !std::fs::metadata(&csv).is_ok_and(|about| about.len() > 1000) {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let interrupted = Command::new("kill").args(["-INT", &program.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    let output = program.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && message.contains("lines were not printed"), "{message}");
}

#[cfg(unix)]
#[test]
fn a_recording_that_the_end_of_its_reader_cuts_is_a_problem_of_the_run() {
    for ending in ["csv", "log"] {
        let _absent = std::fs::remove_file(path("monitor-closed").with_extension(ending));
    }
    let run = |record: &[&str]| {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let program = Command::new(env!("CARGO_BIN_EXE_flqr"))
            .args(["monitor", "emulated", "--json", "--seconds", "5"])
            .args(record)
            .stdout(writer)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let output = program.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(run(&[]), (Some(0), String::new()));
    let (code, message) = run(&["--record", &path("monitor-closed.csv").display().to_string()]);
    let told =
        message.contains("monitor-closed.csv: standard output was closed, which ended the recording at ");
    assert!(code == Some(1) && told, "{code:?}: {message}");
}

#[cfg(unix)]
#[test]
fn a_recording_that_ends_early_is_a_problem_of_the_run() {
    for ending in ["csv", "log"] {
        let _absent = std::fs::remove_file(path("monitor-cut").with_extension(ending));
    }
    // Files may grow to 64 blocks of 512 or 1024 bytes.
    let script = "ulimit -f 64; exec \"$0\" monitor emulated --json --record \"$1\" --seconds 2";
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_flqr")])
        .arg(path("monitor-cut.csv"))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Value> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let [end] = of_type(&lines, "end")[..] else { panic!("{text}") };
    assert!(end["problem"].as_str().unwrap().contains("were lost"), "{end}");
    assert!(end["recording"]["rows_lost"].as_u64().unwrap() > 0, "{end}");
}

const DBC: &str = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: ECU\n\nBO_ 256 Body: 8 ECU\n \
                   SG_ Lean : 0|16@1- (0.01,0) [0|0] \"deg\" ECU\n \
                   SG_ Left : 16|16@1- (0.1,0) [0|0] \"rpm\" ECU\n \
                   SG_ Right : 32|16@1- (0.1,0) [0|0] \"rpm\" ECU\n";

#[test]
fn another_robot_is_watched_through_a_dbc_file() {
    let frames: String = (0..200).map(|ms| format!("(5.{ms:03}000) can1 100#2C0158025802\n")).collect();
    let source = format!("replay:{}", file("monitor-other.log", &frames));
    let dbc = file("monitor-other.dbc", DBC);
    let signals = ["--signal", "pitch=Lean", "--signal", "motor_speed_left=Left"];
    let right = ["--signal", "motor_speed_right=Body.Right*-1"];
    let described = [&source, "--speed", "0", "--dbc", &dbc];
    let lines = lines(&[&described[..], &signals, &right].concat());
    let last = *of_type(&lines, "status").last().unwrap();
    let pitch_rad = last["state"]["pitch_rad"].as_f64().unwrap();
    assert!((pitch_rad - 3_f64.to_radians()).abs() < 1e-9, "{last}");
    assert_eq!(last["motors"]["left"]["current_a"], Value::Null, "no signal tells it");

    let message = refusal(&[&described[..], &signals].concat(), 1);
    assert!(
        message.contains("monitor-other.dbc: no signal is selected for the motion of the right motor"),
        "{message}"
    );
    let wrong = refusal(&[&described[..], &signals, &["--signal", "motor_speed_right=Rigth"]].concat(), 1);
    assert!(wrong.contains("the file has no signal Rigth for motor_speed_right_rad_s"), "{wrong}");
    assert!(
        refusal(&[&described[..], &["--signal", "lean=Lean"]].concat(), 2).contains("unknown column `lean`")
    );
    assert!(refusal(&described, 2).contains("--signal"), "a file alone says nothing");
    assert!(refusal(&[&source, "--signal", "pitch=Lean"], 2).contains("--dbc"));
}
