use super::*;
use crate::link::jy901::{Kind, Packet};
use crate::link::{Direction, Frame, FrameId};
use crate::record::Sample;
use crate::record::recording::{self, About};

const START: Duration = Duration::new(1_763_726_400, 500_000_000);
const PACKET: Packet = Packet { kind: Kind::Angle, data: [0xFD, 0xFF, 1, 0, 0, 0xC0, 0x10, 0x2F] };

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn row(at_ms: u64) -> Row {
    let time_s = ms(at_ms).as_secs_f64();
    let mut values = [0.0; 11].map(|_| (time_s * 7.0).sin());
    values[0] = time_s;
    let sample = Sample::from_row(values);
    Row { sample, motor_temperature_c: [Some(35.0), None], bus_voltage_v: None, round_trip_s: None }
}

fn frame(at_ms: u64, direction: Direction) -> StampedFrame {
    let frame = Frame::full(FrameId::Standard(0x141), [0xA1, 0, 0, 0, at_ms as u8, 1, 0, 0]);
    StampedFrame { time: ms(at_ms), direction, frame }
}

/// Rows at 10, 11, 3000 and 3001 ms, an event at 2999.
fn robot_log() -> String {
    let about = About { source: "can:can0".into(), interface: "can0".into(), start: START };
    let mut text = recording::robot_header(&about);
    for at_ms in [10, 11, 3000, 3001] {
        if at_ms == 3000 {
            recording::push_event(&mut text, ms(2999), "stop: asked for");
        }
        recording::push_row(&mut text, &row(at_ms));
    }
    text
}

/// A sent frame, a received one that was stamped before, a packet and, after a gap, another frame.
fn frames() -> String {
    let mut text = String::new();
    recording::push_frame(&mut text, START, "can0", &frame(9, Direction::Sent));
    recording::push_frame(&mut text, START, "can0", &frame(8, Direction::Received));
    recording::push_imu_packet(&mut text, START, ms(10), &PACKET);
    recording::push_frame(&mut text, START, "can0", &frame(3000, Direction::Received));
    text
}

fn file<'a>(name: &str, text: &'a str) -> Option<ReplayFile<&'a [u8]>> {
    Some(ReplayFile { name: name.to_owned(), reader: text.as_bytes() })
}

fn all(mut replay: Replay<&[u8]>) -> (Vec<(Duration, ReplayItem)>, ReplayCounts, Vec<String>) {
    let mut items = Vec::new();
    loop {
        let at = replay.next_at();
        let Some(item) = replay.next_item().unwrap() else { break };
        assert_eq!(Some(item.0), at);
        items.push(item);
    }
    let problems = replay.problems().collect();
    (items, replay.counts(), problems)
}

#[test]
fn both_files_are_merged_by_time_and_gaps_stay() {
    let (log, frames) = (robot_log(), frames());
    let replay = Replay::new(file("run.csv", &log), file("run.log", &frames), None).unwrap();
    assert!(replay.has_rows());
    let (items, counts, problems) = all(replay);
    let expected = [
        (ms(9), ReplayItem::Frame(frame(9, Direction::Sent))),
        // In the order in which it was received.
        (ms(9), ReplayItem::Frame(frame(8, Direction::Received))),
        (ms(10), ReplayItem::ImuPacket(PACKET)),
        (ms(10), ReplayItem::Row(row(10))),
        (ms(11), ReplayItem::Row(row(11))),
        (ms(2999), ReplayItem::Event("stop: asked for".to_owned())),
        (ms(3000), ReplayItem::Frame(frame(3000, Direction::Received))),
        (ms(3000), ReplayItem::Row(row(3000))),
        (ms(3001), ReplayItem::Row(row(3001))),
    ];
    assert_eq!(items, expected);
    assert_eq!(counts, ReplayCounts { rows: 4, frames: 4, damaged: 0 });
    assert!(problems.is_empty(), "{problems:?}");
}

#[test]
fn frames_alone_count_from_the_first_or_from_a_start_that_is_known() {
    let text = frames();
    for (start, expected) in [(None, [0, 0, 1, 2991]), (Some(START), [9, 9, 10, 3000])] {
        let replay = Replay::new(None, file("run.log", &text), start).unwrap();
        assert!(!replay.has_rows());
        let times: Vec<Duration> = all(replay).0.into_iter().map(|(time, _)| time).collect();
        assert_eq!(times, expected.map(ms), "{start:?}");
    }
}

#[test]
fn a_recording_cut_anywhere_loses_its_torn_line_only() {
    let (log, frames) = (robot_log(), frames());
    let whole = all(Replay::new(file("run.csv", &log), None, None).unwrap()).0;
    let rows_begin = log.find("\n0.01,").unwrap() + 1;
    for end in rows_begin..log.len() {
        let replay = Replay::new(file("run.csv", &log[..end]), None, None);
        let whole_lines = &log[rows_begin..=log[..end].rfind('\n').unwrap()];
        let lines = whole_lines.lines().filter(|line| !line.starts_with('#')).count();
        let torn = log[..end].lines().last().filter(|_| !log[..end].ends_with('\n'));
        if lines == 0 {
            assert!(matches!(replay.err(), Some(ReplayError::Empty { .. })));
            continue;
        }
        let (items, counts, problems) = all(replay.unwrap());
        let rows = |items: &[(Duration, ReplayItem)]| {
            items.iter().filter(|(_, item)| matches!(item, ReplayItem::Row(_))).cloned().collect::<Vec<_>>()
        };
        assert_eq!(rows(&items), rows(&whole)[..lines]);
        let damaged = u64::from(torn.is_some_and(|line| !line.starts_with('#')));
        assert_eq!((counts.damaged, problems.len() as u64), (damaged, damaged), "{}", &log[..end]);
    }
    let whole = all(Replay::new(None, file("run.log", &frames), None).unwrap()).0;
    let torn = all(Replay::new(None, file("run.log", &frames[..frames.len() - 1]), None).unwrap());
    assert_eq!((torn.0.as_slice(), torn.1.damaged), (&whole[..3], 1));
    assert_eq!(torn.2, ["run.log: line 4: the recording ends in the middle of this line, which was skipped"]);
}

#[test]
fn a_clock_that_was_set_back_goes_on_from_there() {
    let text = "(100.0) can0 141#01 R\n(105.0) can0 141#02 R\n(2.0) can0 141#03 R\n(2.5) can0 141#04 R\n";
    let (items, ..) = all(Replay::new(None, file("run.log", text), None).unwrap());
    let times: Vec<f64> = items.iter().map(|(time, _)| time.as_secs_f64()).collect();
    assert_eq!(times, [0.0, 5.0, 5.0, 5.5]);
}

#[test]
fn times_of_other_loggers_and_absurd_ones_do_no_harm() {
    let header = Sample::COLUMNS.join(",");
    let rows = |times: &[&str]| {
        let lines = times.iter().map(|time| format!("{time},1,2,3,4,5,6,7,8,9,10\n"));
        format!("{header}\n{}", lines.collect::<String>())
    };
    for (times, expected) in [
        (&["-2", "-1", "0.5"][..], &[0.0, 1.0, 2.5][..]),
        (&["1700000000", "1700000001"], &[1.7e9, 1.700000001e9]),
        // A time beyond all measurements is no time.
        (&["5", "1e300"], &[5.0]),
    ] {
        let text = rows(times);
        let (items, ..) = all(Replay::new(file("run.csv", &text), None, None).unwrap());
        let found: Vec<f64> = items.iter().map(|(time, _)| time.as_secs_f64()).collect();
        assert_eq!(found, expected, "{times:?}");
        // What a row says stays what it says.
        let [(_, ReplayItem::Row(first)), ..] = &items[..] else { panic!("a row") };
        assert_eq!(first.sample.time_s, times[0].parse::<f64>().unwrap());
    }
    let text =
        "(18446744073709551615.9) can0 141#01\n(1.0) can0 141#02\n(18446744073709551615.9) imu 053#03\n";
    let (items, ..) = all(Replay::new(None, file("run.log", text), None).unwrap());
    assert_eq!(items.len(), 3);
    assert!(items.iter().all(|(time, _)| *time <= LATEST));
}

#[test]
fn what_is_no_recording_is_refused_with_the_mend() {
    for (csv, log, text) in [
        (
            Some("speed_rad_s,torque_nm\n1,2\n"),
            None,
            "run.csv is not a robot log, because it has no `time_s`: give",
        ),
        (
            Some("time_s,motor_angle_rad,torque_nm\n0,1,2\n"),
            None,
            "run.csv is not a robot log, because it has no `x_m`, `x_dot_m_s`",
        ),
        (Some(""), None, "run.csv is empty"),
        (None, Some("hello\n"), "run.log: 1 of 1 rows cannot be used, the first at line 1"),
        (None, Some(""), "run.log contains neither rows nor frames: give a recording of a robot"),
    ] {
        let (csv, log) =
            (csv.and_then(|text| file("run.csv", text)), log.and_then(|text| file("run.log", text)));
        let error = Replay::new(csv, log, None).err().unwrap().to_string();
        assert!(error.starts_with(text), "{error}");
    }
}

/// Gives some text and then fails.
struct BadDisk<'a>(&'a [u8]);

impl std::io::Read for BadDisk<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let count = self.0.read(into)?;
        if count == 0 { Err(std::io::Error::other("bad sector")) } else { Ok(count) }
    }
}

#[test]
fn a_disk_that_fails_is_told_once_what_was_read_is_played() {
    let text = frames();
    let reader = std::io::BufReader::with_capacity(16, BadDisk(text.as_bytes()));
    let mut replay =
        Replay::new(None, Some(ReplayFile { name: "run.log".to_owned(), reader }), None).unwrap();
    for _ in 0..4 {
        assert!(replay.next_item().unwrap().is_some());
    }
    let error = replay.next_item().unwrap_err().to_string();
    assert!(error.starts_with("run.log: reading stopped after line 4 (bad sector)"), "{error}");
    assert_eq!(replay.next_item(), Ok(None));
}
