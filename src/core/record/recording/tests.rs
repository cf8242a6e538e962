use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use super::*;
use crate::model::Motor;
use crate::record::{BenchSample, ColumnMap, Log, LogKind, ReadOptions, Sample, read_log};

fn about() -> About {
    let start = Duration::new(1_763_726_400, 123_456_789);
    About { source: "slcan:/dev/tty\nACM0".into(), interface: "ttyACM0".into(), start }
}

fn sample(row: u32) -> Sample {
    let value = |column: u32| (f64::from(row) * 0.1 + f64::from(column)).sin();
    Sample {
        time_s: f64::from(row) * 1e-3,
        x_m: value(1),
        x_dot_m_s: value(2),
        pitch_rad: value(3) * 1e-9,
        pitch_rate_rad_s: value(4),
        motor_angle_left_rad: value(5),
        motor_angle_right_rad: value(6),
        motor_speed_left_rad_s: value(7),
        motor_speed_right_rad_s: value(8),
        torque_left_nm: value(9),
        torque_right_nm: value(10),
    }
}

fn row(number: u32) -> Row {
    let warm = (number >= 2).then_some(35.0);
    let bus_voltage_v = number.is_multiple_of(2).then_some(24.01);
    let round_trip_s = number.is_multiple_of(5).then_some(0.000_25);
    Row::new(sample(number), [warm, None, bus_voltage_v, round_trip_s])
}

fn robot_log(rows: u32) -> String {
    let mut text = robot_header(&about());
    for number in 0..rows {
        push_row(&mut text, &row(number));
        if number == 3 {
            push_event(&mut text, Duration::from_micros(3_500), "stop: the \"left\" motor,\n\nis off");
        }
    }
    text
}

fn read(text: impl AsRef<[u8]>) -> Result<Log, crate::record::LogError> {
    let map = ColumnMap::default();
    read_log(text.as_ref(), "run.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()))
}

#[test]
fn recorded_rows_read_back_to_the_same_bits() {
    let text = robot_log(6);
    assert!(
        text.starts_with(
            "# flqr recording: robot log of slcan:/dev/tty; ACM0\n\
             # time_s counts from 1763726400.123456 s after 1970\n\
             time_s,x_m,"
        ),
        "{text}"
    );
    assert!(text.contains("\n# 0.004 s stop: the \"left\" motor,; is off\n0.004,"), "{text}");
    let log = read(&text).unwrap();
    assert_eq!((log.kind(), log.rows(), log.problem_count), (Ok(LogKind::Robot), 6, 0));
    for number in 0..6 {
        let written = row(number);
        let cells = written.sample.to_row().map(Some).into_iter().chain(written.optional());
        for (name, cell) in Row::columns().zip(cells) {
            let found = log.column(name).unwrap()[number as usize];
            assert!(cell.map_or(found.is_nan(), |value| value.to_bits() == found.to_bits()), "{name}");
        }
    }
}

#[test]
fn recorded_bench_logs_are_bench_logs_of_their_motor() {
    let sample = BenchSample {
        time_s: 0.5,
        motor_angle_rad: [1.0, 2.0],
        motor_speed_rad_s: [3.0, 4.0],
        torque_nm: [5.0, 6.0],
        target_speed_rad_s: 7.0,
    };
    let mut text = bench_header(&about(), Motor::Right);
    push_bench_row(&mut text, &sample, Motor::Right);
    let log = read(text).unwrap();
    assert_eq!(log.kind(), Ok(LogKind::Bench));
    for (name, value) in BenchSample::COLUMNS.iter().zip([0.5, 2.0, 6.0, 4.0, 7.0]) {
        assert_eq!(log.column(name), Some(&[value][..]), "{name}");
    }
}

/// Wherever the program was killed: every whole row is there with its numbers, and nothing else.
#[test]
fn a_recording_cut_anywhere_loses_its_torn_line_only() {
    let whole = robot_log(6);
    let all = read(&whole).unwrap();
    let header = whole.find("torque_right_nm").unwrap();
    let first_row = header + whole[header..].find('\n').unwrap() + 1;
    for end in first_row..=whole.len() {
        let text = &whole[..end];
        let lines = text[first_row..].split_inclusive('\n');
        let rows = lines.filter(|line| line.ends_with('\n') && !line.starts_with('#')).count();
        let found = read(text);
        if rows == 0 {
            let message = found.unwrap_err().to_string();
            assert!(message.contains("no row of numbers") || message.contains("in the middle"), "{message}");
            continue;
        }
        let log = found.unwrap();
        assert_eq!(log.rows(), rows, "cut at {end}");
        assert!(log.dropped_rows <= 1);
        for (column, full) in log.columns.iter().zip(&all.columns) {
            assert!(column.values.iter().zip(&full.values).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
    let torn = read(&whole[..whole.len() - 1]).unwrap();
    assert_eq!(
        torn.problems[0].to_string(),
        "line 10: the recording ends in the middle of this row, which was skipped"
    );
}

#[test]
fn comments_of_a_recording_are_understood() {
    let text = robot_log(6);
    let comments: Vec<&str> = text.lines().filter(|line| line.starts_with('#')).collect();
    let start = Duration::new(1_763_726_400, 123_456_000);
    assert_eq!(comments.iter().find_map(|comment| parse_start(comment)), Some(start));
    let event = comments.iter().find_map(|comment| parse_event(comment));
    assert_eq!(event, Some((Duration::from_millis(4), "stop: the \"left\" motor,; is off")));
    for foreign in
        ["# 12 volts s", "# a s b", "# -1.0 s b", "# 1e400 s b", "#", "# time_s counts from 1.5 s after 1970"]
    {
        assert_eq!((parse_event(foreign), parse_start(foreign)), (None, None), "{foreign}");
    }
}

#[test]
fn a_recording_may_be_named_by_any_of_its_files() {
    for name in ["runs/a", "runs/a.csv", "runs/a.log", "runs/a.CSV", "runs/a/"] {
        let names = Names::new(Path::new(name));
        let expected = ["runs/a.csv", "runs/a.log", "runs/a.left.csv", "runs/a.right.csv"].map(Path::new);
        let found = [&names.robot_log, &names.frames, &names.bench[0], &names.bench[1]];
        assert_eq!(found.map(|path| path.as_path()), expected, "{name}");
    }
    assert_eq!(Names::new(Path::new("run.2")).robot_log, Path::new("run.2.csv"));
}
