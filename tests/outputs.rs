//! What commands write, what they never write over, and how they end when something goes wrong.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// An empty folder of a test, with a model and a log in it.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("outputs").join(name);
        fs::remove_dir_all(&folder).unwrap_or(());
        fs::create_dir_all(&folder).unwrap();
        fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("presets/paper.toml"), folder.join("model.toml"))
            .unwrap();
        let rows = |row: u32| format!("{:.2},{0:.2},0.1\n", f64::from(row) * 0.01);
        let rows: String = (0..200).map(rows).collect();
        fs::write(folder.join("log.csv"), format!("time_s,motor_angle_rad,torque_nm\n{rows}")).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn names(&self) -> Vec<String> {
        let names =
            fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = names.collect();
        names.sort();
        names
    }

    /// Runs a command line in the folder.
    fn run(&self, line: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_flqr"))
            .args(line.split(' '))
            .current_dir(&self.0)
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("RUST_BACKTRACE")
            .output()
            .unwrap()
    }

    fn done(&self, line: &str) {
        let output = self.run(line);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// Runs a command line that must fail with one sentence; gives the sentence.
    fn refusal(&self, line: &str) -> String {
        let output = self.run(line);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{line}: {message}");
        assert_eq!(message.trim_end().lines().count(), 1, "{line}: {message}");
        message
    }

    /// Runs a command line that must fail; gives the error object.
    fn error(&self, line: &str, code: i32) -> Value {
        let output = self.run(line);
        assert_eq!(output.status.code(), Some(code), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        let object: Value = serde_json::from_slice(&output.stdout).unwrap();
        object["error"].clone()
    }
}

const SIMULATE: &str = "simulate model.toml --seconds 0.1";

#[test]
fn an_output_is_never_an_input() {
    let folder = Folder::new("inputs");
    folder.done(&format!("{SIMULATE} --log run.csv"));
    folder.done("convert run.csv run.mcap");
    fs::write(folder.path("run.log"), "(1.000000) can0 141#A1\n").unwrap();
    fs::write(folder.path("frames.mcap"), "(1.000000) can0 141#A1\n").unwrap();
    fs::hard_link(folder.path("log.csv"), folder.path("hard.csv")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("log.csv", folder.path("soft.csv")).unwrap();
    #[cfg(not(unix))]
    fs::hard_link(folder.path("log.csv"), folder.path("soft.csv")).unwrap();
    let before: Vec<_> = folder.names().iter().map(|name| fs::read(folder.path(name)).unwrap()).collect();
    for line in [
        "simulate model.toml --log model.toml",
        "simulate model.toml --log ./model.toml --force",
        "simulate model.toml --robot log.csv --log log.csv --force",
        "refine model.toml log.csv --report log.csv",
        "refine model.toml log.csv --report soft.csv --force",
        "refine model.toml log.csv --report hard.csv --force",
        "refine model.toml soft.csv --out log.csv --force",
        "refine model.toml log.csv --out model.toml --force",
        "refine model.toml log.csv --heldout run.csv --out run.csv",
        "reproduce model.toml --report model.toml --force",
        "convert frames.mcap frames.mcap --force",
        "convert run.csv run.mcap run.mcap --force",
    ] {
        let message = folder.refusal(line);
        assert!(message.contains("would overwrite an input file"), "{line}: {message}");
    }
    for line in ["refine model.toml log.csv --out new --report ./new", "demo --out new --report new"] {
        assert!(folder.refusal(line).contains("have the same name"), "{line}");
    }
    let after: Vec<_> = folder.names().iter().map(|name| fs::read(folder.path(name)).unwrap()).collect();
    assert!(before == after, "a file has changed or was made");
}

#[test]
fn only_earlier_results_are_replaced_without_force() {
    let folder = Folder::new("replaced");
    let recording = "# flqr recording: robot log of can:can0\ntime_s,x_m\n0,0\n";
    fs::write(folder.path("recorded.csv"), recording).unwrap();
    fs::write(folder.path("other.mcap"), b"\x89MCAP0\r\nof another program").unwrap();
    fs::write(folder.path("empty.csv"), "").unwrap();
    folder.done(&format!("{SIMULATE} --log empty.csv"));
    // A measured log of the columns that a simulated one has.
    let simulated = folder.text("empty.csv");
    fs::write(folder.path("measured.csv"), simulated.replace('\r', "")).unwrap();
    for (line, why) in [
        (format!("{SIMULATE} --log recorded.csv"), "this is a recording"),
        (format!("{SIMULATE} --log measured.csv"), "was not written by flqr"),
        (format!("{SIMULATE} --log log.csv"), "was not written by flqr"),
        ("convert empty.csv other.mcap".to_owned(), "was not written by flqr"),
        ("reproduce --report log.csv".to_owned(), "was not written by flqr"),
    ] {
        let message = folder.refusal(&line);
        assert!(message.contains(why) && message.contains("--force"), "{line}: {message}");
    }
    assert_eq!(folder.text("recorded.csv"), recording);
    for name in
        ["empty.csv", "recorded.csv --force", "recorded.csv", "measured.csv --force", "new.csv", "new.csv"]
    {
        folder.done(&format!("{SIMULATE} --log {name}"));
    }
    for out in ["run.mcap", "run.mcap", "other.mcap --force", "other.mcap"] {
        folder.done(&format!("convert empty.csv {out}"));
    }
    for _ in 0..2 {
        folder.done("refine model.toml log.csv --report report.html --motor left");
    }
    assert!(folder.refusal(&format!("{SIMULATE} --log model.csv/x")).contains("check the folder"));
}

/// No model comes of a log that cannot answer: the exit code says so, the answer is still there, and the model of an
/// earlier run is not taken for one of this run.
#[test]
fn a_model_that_is_not_written_is_a_failure_and_leaves_none_at_its_place() {
    let folder = Folder::new("no-model");
    fs::write(folder.path("new.toml"), "# Written by flqr\nname = \"of before\"\n").unwrap();
    for old in ["new.toml.old", "new.toml.old2"] {
        let output = folder.run("refine model.toml log.csv --out new.toml --report new.html --json");
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(answer["verdict"], "data_unfit");
        assert!(message.contains("no model is written") && message.contains(old), "{message}");
        assert!(!folder.path("new.toml").exists() && folder.path("new.html").exists());
        assert!(folder.text(old).contains("of before"));
        fs::copy(folder.path(old), folder.path("new.toml")).unwrap();
    }
    folder.done("refine model.toml log.csv --json");
}

/// Before the work begins: these would take seconds.
#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let folder = Folder::new("before");
    fs::create_dir(folder.path("folder")).unwrap();
    let mut mode = fs::metadata(folder.path("log.csv")).unwrap().permissions();
    fs::write(folder.path("locked.html"), "").unwrap();
    mode.set_readonly(true);
    fs::set_permissions(folder.path("locked.html"), mode).unwrap();
    let before = folder.names();
    for line in [
        "demo --out absent/new.toml",
        "demo --report absent/new.html",
        "reproduce --report folder",
        "reproduce --report locked.html",
        "simulate model.toml --seconds 3600 --log absent/run.csv",
        "refine model.toml no_such_log.csv --out absent/new.toml",
    ] {
        let message = folder.refusal(line);
        assert!(
            message.contains("cannot write the") && !message.contains("no_such_log"),
            "{line}: {message}"
        );
    }
    assert_eq!(folder.names(), before);
}

#[test]
fn errors_are_json_objects_too() {
    let folder = Folder::new("errors");
    let broken = folder.text("model.toml").replace("wheel_radius_m", "wheel_radus_m");
    let line = 1 + broken.lines().position(|line| line.starts_with("wheel_radus_m")).unwrap();
    fs::write(folder.path("broken.toml"), broken).unwrap();
    let error = folder.error("gains broken.toml --json", 1);
    assert_eq!((&error["code"], &error["file"]), (&"input_file".into(), &"broken.toml".into()), "{error}");
    assert_eq!((&error["line"], &error["column"]), (&line.into(), &1.into()), "{error}");
    assert!(error["message"].as_str().unwrap().contains("wheel_radus_m"), "{error}");
    assert!(error["remedy"].is_string(), "{error}");

    let error = folder.error("fit absent.csv --json", 1);
    assert_eq!(
        (&error["file"], &error["remedy"]),
        (&"absent.csv".into(), &"check the path".into()),
        "{error}"
    );
    let keys: Vec<_> = error.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["code", "message", "file", "line", "column", "remedy"]);
    assert!(error["line"].is_null() && error["column"].is_null(), "{error}");

    let error = folder.error("--json simulate model.toml --log model.toml", 1);
    assert_eq!((&error["code"], &error["file"]), (&"output_file".into(), &"model.toml".into()), "{error}");
    for line in [
        "gains --json",
        "gains model.toml --jsn --json",
        "no-such-command --json",
        "--json --paused gains model.toml",
        "simulate model.toml --scenario kick --controller pi --json",
    ] {
        let error = folder.error(line, 2);
        assert!(error["code"] == "usage" && error["message"].is_string(), "{line}: {error}");
    }
    assert!(folder.run("gains --help --json").status.success());
    assert!(folder.refusal("fit absent.csv").contains("absent.csv"));
}

#[test]
fn names_from_files_cannot_act_on_the_terminal_nor_on_a_spreadsheet() {
    let folder = Folder::new("names");
    let named =
        folder.text("model.toml").replacen("name = \"Robot of the paper\"", "name = \"=1+1\\u001b[2J\"", 1);
    fs::write(folder.path("named.toml"), named).unwrap();
    for line in ["gains named.toml", "simulate named.toml --seconds 0.1", "export named.toml --to c-header"] {
        let output = folder.run(line);
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success() && !text.contains('\u{1b}'), "{line}: {text:?}");
    }
    let csv = String::from_utf8(folder.run("export named.toml --to csv").stdout).unwrap();
    assert!(csv.contains("\nname,\"'=1+1"), "{csv}");

    let long = "x".repeat(3000);
    fs::write(folder.path("keys.toml"), format!("name = \"a\"\n\"{long}\\u0007\\u001b[31m\" = 1\n[robot]\n"))
        .unwrap();
    fs::write(folder.path("cells.csv"), "time_s,motor_angle_rad,torque_nm\n0,\u{1b}]0;x\u{7},0\n").unwrap();
    for line in ["gains keys.toml", "fit cells.csv"] {
        let message = folder.refusal(line);
        assert!(!message.trim_end().contains(char::is_control), "{message:?}");
        assert!(message.chars().count() <= "flqr: \n".len() + 500, "{}", message.len());
    }
}

/// Found by chance mutations: both ended in a panic.
#[test]
fn what_used_to_panic_is_refused_with_its_cause() {
    let folder = Folder::new("panics");
    let care = |b: &str| format!(r#"{{"a":[[0,1],[0,0]],"b":[[0],[{b}]],"q":[[1,0],[0,1]],"r":[[1]]}}"#);
    for b in ["1e155", "1e150", "1e300", "1e-200"] {
        fs::write(folder.path("care.json"), care(b)).unwrap();
        let message = folder.refusal("riccati care.json");
        assert!(
            message.contains("matrix b has an entry of 1e") && message.contains("choose other units"),
            "{message}"
        );
    }
    let weights = "[lqr]\nq_diagonal = [1e300, 1e300, 1e300, 1e300]\nr_diagonal = [1.0, 1.0]\n";
    let (head, rest) = (folder.text("model.toml"), "[limits]");
    let (before, after) = (head.split("[lqr]").next().unwrap(), head.split(rest).nth(1).unwrap());
    fs::write(folder.path("heavy.toml"), format!("{before}{weights}{rest}{after}")).unwrap();
    let message = folder.refusal("gains heavy.toml");
    assert!(message.contains("matrix q has an entry of 1e300"), "{message}");

    folder.done("residual model.toml log.csv --map time_s=time_s*1e-25");
    folder.done("simulate model.toml --seconds 3 --scenario cruise --log robot.csv");
    for line in [
        "refine model.toml log.csv --heldout robot.csv",
        "refine model.toml log.csv --heldout log.csv --heldout robot.csv",
    ] {
        let message = folder.refusal(line);
        assert!(
            message.contains("robot.csv") && message.contains("refine with them separately"),
            "{message}"
        );
    }
}

/// Other systems have a display, or a home, whatever these variables say.
#[cfg(all(unix, not(target_os = "macos")))]
#[test]
fn an_empty_home_is_reported() {
    let output = Command::new(env!("CARGO_BIN_EXE_flqr"))
        .env_clear()
        .env("HOME", "")
        .current_dir(env!("CARGO_TARGET_TMPDIR"))
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("HOME is empty or not set: set it to a folder"), "{message}");
}

/// The window would replace the file again and again: it refuses to open.
#[test]
fn the_state_of_the_window_replaces_neither_inputs_nor_other_files() {
    let folder = Folder::new("state-out");
    folder.done(&format!("{SIMULATE} --log run.csv"));
    fs::write(folder.path("notes.json"), "{\n  \"about\": \"my notes\"\n}\n").unwrap();
    fs::write(
        folder.path("earlier.json"),
        "{\n  \"about\": \"flqr window state\",\n  \"tab\": \"tune\"\n}\n",
    )
    .unwrap();
    fs::write(folder.path("session.json"), "{}").unwrap();
    let before: Vec<_> = folder.names().iter().map(|name| fs::read(folder.path(name)).unwrap()).collect();
    for (line, problem) in [
        ("--model model.toml --state-out model.toml --force", "would overwrite an input file"),
        ("--log run.csv --state-out ./run.csv --force", "would overwrite an input file"),
        ("--session session.json --state-out session.json --force", "would overwrite an input file"),
        ("--source replay:run.csv --state-out run.csv --force", "would overwrite an input file"),
        ("--state-out notes.json", "not written by flqr"),
        ("--state-out absent/state.json", "cannot write the window state"),
        // Nothing is wrong but that there is no display.
        ("--state-out notes.json --force", "needs a display"),
        ("--state-out earlier.json", "needs a display"),
        ("--state-out new.json", "needs a display"),
    ] {
        let message = folder.refusal(line);
        assert!(message.contains(problem), "{line}: {message}");
    }
    let after: Vec<_> = folder.names().iter().map(|name| fs::read(folder.path(name)).unwrap()).collect();
    assert_eq!(after, before);
}

/// The log comes through a pipe that stays open, so that the program is in the middle of writing when it is ended.
#[cfg(unix)]
#[test]
fn an_end_in_the_middle_leaves_no_temporary_file() {
    use std::io::Write;
    for signal in ["TERM", "INT"] {
        let folder = Folder::new(&format!("signal-{signal}"));
        let pipe = folder.path("pipe.csv");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let before = folder.names();
        let mut child = Command::new(env!("CARGO_BIN_EXE_flqr"))
            .args(["convert", "pipe.csv", "run.mcap"])
            .current_dir(&folder.0)
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let mut rows = fs::OpenOptions::new().write(true).open(&pipe).unwrap();
        writeln!(rows, "time_s,motor_angle_rad,torque_nm\n0,0,0\n1,0,0\n2,0,0").unwrap();
        while !folder.names().iter().any(|name| name.ends_with(".new")) {
            assert!(child.try_wait().unwrap().is_none(), "it has ended by itself");
            std::thread::yield_now();
        }
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-s", signal, &id]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
        assert_eq!(folder.names(), before, "{signal}");
    }
}
