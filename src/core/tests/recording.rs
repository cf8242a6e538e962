//! Recordings on a real disk: whole when they are ended, and nearly whole when the program is killed.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::disallowed_methods, reason = "these tests start programs and look at files")]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use flqr_core::device::{Event, EventKind, Recorder, RecorderError};
use flqr_core::link::jy901::{Kind, Packet};
use flqr_core::link::{Direction, Frame, FrameId, StampedFrame};
use flqr_core::record::recording::{About, Row};
use flqr_core::record::{BenchSample, ColumnMap, Log, LogKind, ReadOptions, Sample, read_log};
use rand::{Rng, SeedableRng};

/// Frames for each row: a bus at 1 Mbit/s that is full.
const FRAMES_A_ROW: u32 = 8;
const PACKET: Packet = Packet { kind: Kind::Angle, data: [0xFD, 0xFF, 1, 0, 0, 0xC0, 0x10, 0x2F] };

fn about() -> About {
    let start = Duration::from_secs(1_700_000_000);
    About { source: "can:can0".into(), interface: "can0".into(), start }
}

fn row(time: Duration) -> Row {
    let t = time.as_secs_f64();
    Row::from(Sample {
        time_s: t,
        x_m: t.sin(),
        x_dot_m_s: t.cos(),
        pitch_rad: t / 3.0,
        pitch_rate_rad_s: t / 7.0,
        motor_angle_left_rad: -t,
        motor_angle_right_rad: t,
        motor_speed_left_rad_s: 1.0 / 3.0,
        motor_speed_right_rad_s: -1.0 / 3.0,
        torque_left_nm: 0.1,
        torque_right_nm: 0.2,
    })
}

fn frame(time: Duration, number: u32) -> StampedFrame {
    let [a, b, c, d] = number.to_be_bytes();
    let frame = Frame::full(FrameId::Standard(0x141), [0xA1, 0, 0, 0, a, b, c, d]);
    StampedFrame { time, direction: Direction::Received, frame }
}

/// A folder of the test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _absent = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn read(file: &Path) -> Log {
    let map = ColumnMap::default();
    let text = fs::read(file).unwrap();
    let go_on = &mut |_| ControlFlow::Continue(());
    read_log(text.as_slice(), &file.display().to_string(), &ReadOptions::new(&map), go_on).unwrap()
}

/// Numbers of the frames in the file, those of torn lines left out.
fn frame_numbers(file: &Path) -> Vec<u32> {
    let text = fs::read_to_string(file).unwrap();
    let lines = text.split_inclusive('\n').filter(|line| line.ends_with(" R\n") && line.contains(" can0 "));
    lines
        .map(|line| {
            let data = line.split_once("141#A1000000").unwrap().1;
            u32::from_str_radix(&data[..8], 16).unwrap()
        })
        .collect()
}

#[test]
fn all_that_is_handed_over_is_in_the_files() {
    let name = folder("whole").join("run");
    let recorder = Recorder::start(&name, &about(), true).unwrap();
    let input = recorder.input();
    for number in 0..100 {
        let time = Duration::from_millis(u64::from(number));
        input.row(&row(time));
        input.frame(&frame(time, number));
        input.bench(&BenchSample {
            time_s: time.as_secs_f64(),
            motor_angle_rad: [1.0, 2.0],
            motor_speed_rad_s: [3.0, 4.0],
            torque_nm: [5.0, 6.0],
            target_speed_rad_s: 7.0,
        });
    }
    input.imu_packet(Duration::from_millis(50), &PACKET);
    let text = "imu_silent: the IMU has been silent for 0.1 s".to_owned();
    input.event(&Event { time: Duration::from_millis(99), kind: EventKind::Stop, text });
    assert_eq!(recorder.lost(), 0);
    let status = recorder.finish();
    assert_eq!((status.rows, status.frames, status.problem), (100, 101, None));
    let sizes = ["csv", "log", "left.csv", "right.csv"]
        .map(|ending| fs::metadata(name.with_extension(ending)).unwrap().len());
    assert_eq!(status.bytes, sizes.iter().sum::<u64>());

    let log = read(&status.file);
    assert_eq!((log.kind(), log.rows(), log.problem_count), (Ok(LogKind::Robot), 100, 0));
    assert_eq!(frame_numbers(&name.with_extension("log")), (0..100).collect::<Vec<_>>());
    let frames = fs::read_to_string(name.with_extension("log")).unwrap();
    assert!(frames.contains("(1700000000.050000) imu 053#FDFF010000C0102F R\n"), "{frames}");
    let text = fs::read_to_string(&status.file).unwrap();
    assert!(text.ends_with("\n# 0.099 s stop: imu_silent: the IMU has been silent for 0.1 s\n"), "{text}");
    for (ending, torque) in [("left.csv", 5.0), ("right.csv", 6.0)] {
        let bench = read(&name.with_extension(ending));
        assert_eq!((bench.kind(), bench.rows()), (Ok(LogKind::Bench), 100));
        assert_eq!(bench.column("torque_nm").unwrap()[99], torque);
    }
}

#[test]
fn nothing_is_overwritten_and_nothing_half_made_is_left() {
    let folder = folder("kept");
    let (name, taken) = (folder.join("run"), folder.join("run.right.csv"));
    fs::write(&taken, "mine").unwrap();
    let message = Recorder::start(&name, &about(), true).unwrap_err().to_string();
    assert_eq!(
        message,
        format!("{} exists and is not overwritten: give another name or move it away", taken.display())
    );
    assert_eq!(fs::read_to_string(&taken).unwrap(), "mine");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    let error = Recorder::start(&folder.join("none/run"), &about(), false).unwrap_err();
    assert!(matches!(error, RecorderError::NoFolder { .. }), "{error}");
    assert!(error.to_string().contains("/none does not exist: create it or give another name"), "{error}");
}

/// Name of the recording that the child makes.
const CHILD: &str = "FLQR_TEST_RECORDING";

/// The program that is killed: records for ever and says of every row when it was handed over. Does nothing
/// unless it was started by the test below.
#[test]
fn child_that_records_until_it_is_killed() {
    let Some(name) = std::env::var_os(CHILD) else { return };
    let recorder = Recorder::start(Path::new(&name), &about(), false).unwrap();
    let input = recorder.input();
    let (start, mut out) = (Instant::now(), std::io::stdout());
    for number in 0.. {
        let time = start.elapsed();
        (0..FRAMES_A_ROW).for_each(|of_row| input.frame(&frame(time, number * FRAMES_A_ROW + of_row)));
        input.row(&row(time));
        assert_eq!(recorder.lost(), 0);
        writeln!(out, "\nrow {} {}", number, time.as_nanos()).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_killed_program_loses_at_most_half_a_second() {
    const TRIES: u64 = 20;
    const AT_ONCE: u64 = 5;
    let folder = folder("killed");
    for first in (0..TRIES).step_by(AT_ONCE as usize) {
        std::thread::scope(|scope| {
            for try_number in first..first + AT_ONCE {
                let name = folder.join(format!("run{try_number}"));
                scope.spawn(move || record_and_kill(&name, try_number));
            }
        });
    }
}

fn record_and_kill(name: &Path, seed: u64) {
    let rows = 50 + rand_chacha::ChaCha8Rng::seed_from_u64(seed).next_u32() % 400;
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "child_that_records_until_it_is_killed", "--nocapture"])
        .env(CHILD, name)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let out = BufReader::new(child.stdout.take().unwrap());
    let mut last = (0, Duration::ZERO);
    for line in out.lines().map_while(Result::ok) {
        let Some(report) = line.strip_prefix("row ").and_then(|rest| rest.split_once(' ')) else { continue };
        let Ok(nanos) = report.1.parse() else { continue };
        last = (report.0.parse().unwrap(), Duration::from_nanos(nanos));
        if last.0 == rows {
            child.kill().unwrap();
        }
    }
    child.wait().unwrap();
    assert!(last.0 >= rows, "the child ended by itself after row {}", last.0);

    let log = read(&name.with_extension("csv"));
    assert!(log.dropped_rows <= 1, "{:?}", log.problems);
    let written = log.column("time_s").unwrap();
    let lost_s = last.1.as_secs_f64() - written.last().unwrap();
    assert!(lost_s <= 0.5, "{lost_s} s of rows are lost");
    let frames = frame_numbers(&name.with_extension("log"));
    assert!(frames.iter().enumerate().all(|(index, number)| index as u32 == *number));
    // The frames of a row are handed over before it, and so are written by then.
    assert!(frames.len() as u32 / FRAMES_A_ROW >= log.rows() as u32);
}
