//! Recordings of the emulated robot, played again.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::disallowed_methods, reason = "these tests look at files")]

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use flqr_core::control::{BalanceController, ControllerKind, drive::Excitation};
use flqr_core::device::{
    Connection, Described, EventKind, SerialAddress, Session, SessionMode, SessionOptions, SessionOrder,
    Source, Update,
};
use flqr_core::model::RobotModel;
use flqr_core::model_file::presets;
use flqr_core::record::{ColumnMap, ReadOptions, Sample, read_log};

/// How much is recorded.
const LENGTH: Duration = Duration::from_millis(1500);

fn paper() -> RobotModel {
    presets::paper().robot().unwrap().clone()
}

fn options(source: Source, replay_speed: f64) -> SessionOptions {
    SessionOptions {
        source,
        imu: None,
        dbc: None,
        robot: paper(),
        mode: SessionMode::Listen,
        record: None,
        seed: 1,
        replay_speed,
    }
}

fn replay(file: &Path, speed: f64) -> SessionOptions {
    options(Source::Replay { file: file.to_owned() }, speed)
}

/// A folder of the test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _absent = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// One recording for all tests, and the samples that were shown while it was made.
static RECORDED: LazyLock<(PathBuf, Vec<Sample>)> = LazyLock::new(|| {
    let name = folder("replay").join("run");
    let recorded = SessionOptions { record: Some(name.clone()), ..options(Source::Emulated, 1.0) };
    let mut session = Session::open(recorded, Arc::new(|| {})).unwrap();
    let mut samples = Vec::new();
    while let Some(update) = session.wait(Duration::from_secs(10)) {
        samples.extend(update.samples);
        if update.status.time > LENGTH {
            return (name, samples);
        }
    }
    panic!("the session has ended");
});

fn csv() -> PathBuf {
    RECORDED.0.with_extension("csv")
}

/// The raw frames, without a robot log next to them.
fn frames_alone(name: &str) -> PathBuf {
    let alone = folder(name).join("alone.log");
    fs::copy(RECORDED.0.with_extension("log"), &alone).unwrap();
    alone
}

fn rows(file: &Path) -> Vec<Sample> {
    let (map, text) = (ColumnMap::default(), fs::read(file).unwrap());
    let log =
        read_log(text.as_slice(), "run.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()));
    let log = log.unwrap();
    let columns = Sample::COLUMNS.map(|name| log.column(name).unwrap());
    (0..log.rows()).map(|row| Sample::from_row(columns.map(|column| column[row]))).collect()
}

/// Everything until the end.
fn play(options: SessionOptions) -> Vec<Update> {
    play_on(&mut Session::open(options, Arc::new(|| {})).unwrap())
}

fn play_on(session: &mut Session) -> Vec<Update> {
    let mut updates = Vec::new();
    while let Some(update) = session.wait(Duration::from_secs(10)) {
        let ended = update.status.connection == Connection::Ended;
        updates.push(update);
        if ended {
            return updates;
        }
    }
    panic!("the replay has not come to its end");
}

fn samples(updates: &[Update]) -> Vec<Sample> {
    updates.iter().flat_map(|update| update.samples.iter().copied()).collect()
}

fn texts(updates: &[Update], kind: EventKind) -> Vec<&str> {
    let events = updates.iter().flat_map(|update| &update.events).filter(|event| event.kind == kind);
    events.map(|event| event.text.as_str()).collect()
}

#[test]
fn a_replay_gives_the_samples_that_were_recorded_and_shown_at_any_speed() {
    let recorded = rows(&csv());
    let shown = &RECORDED.1;
    assert!(shown.len() > 500 && recorded.starts_with(shown), "{} {}", shown.len(), recorded.len());
    for speed in [1.0, f64::INFINITY] {
        let updates = play(replay(&csv(), speed));
        assert_eq!(samples(&updates), recorded, "speed {speed}");
        let last = updates.last().unwrap();
        // The frames come along, for the table, the rates and the cards.
        let frames = fs::read_to_string(csv().with_extension("log")).unwrap();
        let of_bus = frames.lines().filter(|line| line.contains(" can0 ")).count() as u64;
        assert_eq!((last.status.counters.received, last.status.counters.lost), (of_bus, 0));
        assert!(updates.iter().any(|update| !update.frames.is_empty()));
        assert!(last.status.motors.iter().all(|motor| motor.rate_hz > 500.0), "{:?}", last.status);
        assert!(last.status.imu.rate_hz > 50.0, "{:?}", last.status);
        let end =
            format!("end of the recording: {} rows and {} frames", recorded.len(), frames.lines().count());
        assert_eq!(texts(&updates, EventKind::Note).last(), Some(&end.as_str()));
        assert!(texts(&updates, EventKind::Warning).is_empty());
    }
}

/// The runs of equal values.
fn readings(samples: &[Sample]) -> Vec<f64> {
    let mut values: Vec<f64> = samples.iter().map(|sample| sample.pitch_rad).collect();
    values.dedup();
    values
}

#[test]
fn frames_alone_are_decoded_as_live_ones_were_and_alike_at_any_speed() {
    let alone = frames_alone("replay-alone");
    let decoded = [1.0, f64::INFINITY].map(|speed| samples(&play(replay(&alone, speed))));
    let differs = decoded[0].iter().zip(&decoded[1]).find(|(a, b)| a != b);
    assert_eq!((differs, decoded[0].len()), (None, decoded[1].len()));
    let recorded = rows(&csv());
    let (live, again) = (readings(&recorded), readings(&decoded[0]));
    // The first and the last reading may have made no row of their own.
    let middle = &live[1..live.len() - 1];
    assert!(middle.len() > 50, "{}", middle.len());
    assert!(again.windows(middle.len()).any(|part| part == middle), "{live:?}\n{again:?}");
    let last = |samples: &[Sample]| samples.last().map(|sample| (sample.x_m, sample.torque_left_nm)).unwrap();
    let ((x_m, torque_nm), (x_again_m, torque_again_nm)) = (last(&recorded), last(&decoded[0]));
    assert!((x_m - x_again_m).abs() < 1e-3, "{x_m} m {x_again_m} m");
    assert!((torque_nm - torque_again_nm).abs() < 0.5, "{torque_nm} N m {torque_again_nm} N m");
    let beside = samples(&play(replay(&csv().with_extension("log"), f64::INFINITY)));
    // With the robot log next to them, they have its times.
    assert!((beside[0].time_s - recorded[0].time_s).abs() < 0.005, "{} s", beside[0].time_s);
    assert_eq!(readings(&beside), again);
}

#[test]
fn a_torn_last_row_is_told_and_all_before_it_are_played() {
    let torn = folder("replay-torn").join("torn.csv");
    let mut text = fs::read(csv()).unwrap();
    text.truncate(text.len() - 3);
    fs::write(&torn, text).unwrap();
    let updates = play(replay(&torn, f64::INFINITY));
    let recorded = rows(&csv());
    assert_eq!(samples(&updates), &recorded[..recorded.len() - 1]);
    let [warning] = texts(&updates, EventKind::Warning)[..] else { panic!("one warning") };
    assert!(
        warning.contains("torn.csv: line ") && warning.contains("ends in the middle of this row"),
        "{warning}"
    );
    assert_eq!(updates.last().unwrap().status.counters.errors, 1);
}

#[test]
fn a_replay_is_held_and_goes_on() {
    let mut session = Session::open(replay(&csv(), 0.01), Arc::new(|| {})).unwrap();
    session.send(SessionOrder::Pause(true));
    let next = |session: &mut Session| session.wait(Duration::from_secs(10)).unwrap();
    let (mut before, mut played) = (next(&mut session), Vec::new());
    loop {
        let update = next(&mut session);
        played.extend(before.samples);
        if update.status.time == before.status.time && update.samples.is_empty() {
            break;
        }
        before = update;
    }
    session.send(SessionOrder::ReplaySpeed(f64::INFINITY));
    assert_eq!(next(&mut session).status.connection, Connection::Connected);
    session.send(SessionOrder::Pause(false));
    played.extend(samples(&play_on(&mut session)));
    assert_eq!(played, rows(&csv()));
}

#[test]
fn a_gap_stays_one_and_is_told() {
    let file = folder("replay-gap").join("gap.csv");
    let rows = ["0", "0.001", "3600.0"].map(|time| format!("{time},0,0,0,0,0,0,0,0,0,0\n"));
    fs::write(&file, format!("{}\n{}", Sample::COLUMNS.join(","), rows.concat())).unwrap();
    let mut session = Session::open(replay(&file, 100.0), Arc::new(|| {})).unwrap();
    let hint = loop {
        let update = session.wait(Duration::from_secs(10)).unwrap();
        if let Connection::Silent { hint } = update.status.connection {
            break hint;
        }
    };
    assert_eq!(hint, "nothing was recorded from 0.0 s to 3600.0 s");
    session.send(SessionOrder::ReplaySpeed(f64::INFINITY));
    let updates = play_on(&mut session);
    assert_eq!(updates.last().unwrap().status.time, Duration::from_secs(3600));
    assert_eq!(samples(&updates).len(), 1);
}

#[test]
fn a_replay_can_be_recorded_again_to_the_same_rows() {
    let again = folder("replay-again").join("again.csv");
    let options = SessionOptions { record: Some(again.clone()), ..replay(&csv(), f64::INFINITY) };
    let updates = play(options);
    assert_eq!(updates.last().unwrap().status.counters.lost, 0);
    assert_eq!(rows(&again), rows(&csv()));
    let frames = |file: &Path| fs::read_to_string(file.with_extension("log")).unwrap().lines().count();
    assert_eq!(frames(&again), frames(&csv()));
}

#[test]
fn what_cannot_be_replayed_is_named_with_the_mend() {
    let folder = folder("replay-refused");
    let bench = folder.join("bench.csv");
    fs::write(&bench, "time_s,motor_angle_rad,torque_nm\n0,1,2\n").unwrap();
    for (file, expected) in [
        (folder.join("none.csv"), "none.csv: there is no such file: check the path"),
        (folder.clone(), "replay-refused: this is a folder: give a file"),
        (bench, "bench.csv is not a robot log, because it has no `x_m`"),
    ] {
        let error = Session::open(replay(&file, 1.0), Arc::new(|| {})).err().unwrap().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let robot = paper();
    let gain =
        flqr_core::lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap().gain;
    let controller = BalanceController::new(ControllerKind::Lqr, &robot, gain).unwrap();
    let mode = SessionMode::Drive { controller: Box::new(controller), excitation: Excitation::Balance };
    let driven = SessionOptions { mode, ..replay(&csv(), 1.0) };
    let error = Session::open(driven, Arc::new(|| {})).err().unwrap().to_string();
    assert!(error.starts_with("a recording can be monitored but not driven: give can:INTERFACE"), "{error}");
}

/// Its degrees are written in Latin-1, as tools of Windows do.
const DBC: &[u8] = b"VERSION \"1\"\n\nNS_ :\n\nBS_:\n\nBU_: ECU\n\n\
    BO_ 256 Body: 8 ECU\n \
    SG_ Lean : 0|16@1- (0.01,0) [0|0] \"\xB0\" ECU\n \
    SG_ LeanRate : 16|16@1- (0.1,0) [0|0] \"\xB0/s\" ECU\n\n\
    BO_ 257 Wheels: 8 ECU\n \
    SG_ SpeedLeft : 0|16@1- (0.1,0) [0|0] \"rpm\" ECU\n \
    SG_ SpeedRight : 16|16@1- (0.1,0) [0|0] \"rpm\" ECU\n \
    SG_ TorqueLeft : 32|16@1- (1,0) [0|0] \"mNm\" ECU\n";

/// 0.1 s at 1 kHz: pitch 3 deg at 10 deg/s, the left wheel at 60 rpm with 640 mN m, the right one at -30 rpm.
fn other_robot(name: &str) -> (PathBuf, PathBuf) {
    let folder = folder(name);
    let (frames, dbc) = (folder.join("other.log"), folder.join("other.dbc"));
    let lines = (0..100)
        .map(|ms| format!("(7.{ms:03}000) can1 100#2C016400\n(7.{ms:03}200) can1 101#5802D4FE8002\n"));
    fs::write(&frames, lines.collect::<String>()).unwrap();
    fs::write(&dbc, DBC).unwrap();
    (frames, dbc)
}

fn described(frames: &Path, dbc: &Path, signals: &[&str]) -> SessionOptions {
    let signals = signals.iter().map(|text| text.parse().unwrap()).collect();
    let mut options = replay(frames, f64::INFINITY);
    options.robot.link.torque_constant_nm_a = None;
    SessionOptions { dbc: Some(Described { file: dbc.to_owned(), signals }), ..options }
}

const SIGNALS: [&str; 5] = [
    "pitch=Lean",
    "pitch_rate=Body.LeanRate",
    "motor_speed_left=SpeedLeft",
    "motor_speed_right_rad_s=SpeedRight",
    "torque_left=TorqueLeft",
];

#[test]
fn a_robot_that_a_dbc_file_describes_has_rows() {
    let (frames, dbc) = other_robot("replay-dbc");
    let updates = play(described(&frames, &dbc, &SIGNALS));
    let samples = samples(&updates);
    assert!((90..=100).contains(&samples.len()), "{}", samples.len());
    let turn = std::f64::consts::TAU;
    let last = samples.last().unwrap();
    for (found, expected) in [
        (last.pitch_rad, 3_f64.to_radians()),
        (last.pitch_rate_rad_s, 10_f64.to_radians()),
        (last.motor_speed_left_rad_s, turn),
        (last.motor_speed_right_rad_s, -turn / 2.0),
        (
            last.motor_angle_left_rad - samples[0].motor_angle_left_rad,
            turn * (last.time_s - samples[0].time_s),
        ),
        // There is no torque constant, and none is needed.
        (last.torque_left_nm, 0.64),
        (last.torque_right_nm, 0.0),
    ] {
        assert!((found - expected).abs() < 1e-9 + 1e-2 * expected.abs(), "{found} {expected} {last:?}");
    }
    let [left, _] = updates.last().unwrap().status.motors;
    assert_eq!((left.current_a, left.temperature_c), (None, None), "neither is known");
}

#[test]
fn what_a_dbc_file_cannot_serve_for_is_named_with_the_mend() {
    let (frames, dbc) = other_robot("replay-dbc-refused");
    let refused = |options| Session::open(options, Arc::new(|| {})).err().unwrap().to_string();
    for (signals, expected) in [
        (
            &SIGNALS[..3],
            "no signal is selected for the motion of the right motor: add motor_speed_right_rad_s=SIGNAL",
        ),
        (
            &["pitch=Nothing"][..],
            "other.dbc: the file has no signal Nothing for pitch_rad: choose one of its signals",
        ),
    ] {
        let message = refused(described(&frames, &dbc, signals));
        assert!(message.contains(expected), "{message}");
    }
    let imu = Some(SerialAddress { port: "/dev/null".to_owned(), baud: 9600 });
    let twice = refused(SessionOptions { imu, ..described(&frames, &dbc, &SIGNALS) });
    assert!(twice.ends_with("leave one of the two out"), "{twice}");
    let none = refused(described(&frames, &dbc.with_extension("none"), &SIGNALS));
    assert!(none.ends_with("other.none: there is no such file: check the path"), "{none}");
    let noise = refused(described(&frames, &frames, &SIGNALS));
    assert!(noise.contains("other.log: this is not a DBC file: "), "{noise}");
}
