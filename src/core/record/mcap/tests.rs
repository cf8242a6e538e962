use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

use ::mcap::records::Record;
use ::mcap::{MessageStream, Summary};

use super::*;
use crate::record::ColumnMap;

const LOG: &str = "# flqr recording: robot log of can:can0\n# time_s counts from 1700000000.000500 s after 1970\n\
    time_s,x_m,x_dot_m_s,pitch_rad,pitch_rate_rad_s,motor_angle_left_rad,motor_angle_right_rad,\
    motor_speed_left_rad_s,motor_speed_right_rad_s,torque_left_nm,torque_right_nm,bus_voltage_v\n\
    0,1,2,3,4,5,6,7,8,9,10,\n# 0.001 s stop: asked\n0.002,1.5,2,3,4,5,6,7,8,9,-10,24.5\n";
const FRAMES: &str = "(1700000000.001000) can0 141#A100000084010000 T\n\
    (1700000000.001250) can0 12ABCDEF#AA R\n(1700000000.001500) imu 053#FDFF010000C0102F R\n";
const BENCH: &str = "time_s,motor_angle_rad,torque_nm,my col\n-1,1,2,x\n0,3,4,5\n";

fn input<'a>(source: &'a str, topic: &'a str, text: &'a str) -> Input<'a, &'a [u8]> {
    Input { source, topic, reader: text.as_bytes() }
}

fn converted(inputs: Vec<Input<&[u8]>>) -> (Vec<u8>, Conversion) {
    let mut out = Vec::new();
    let done = convert(inputs, &ColumnMap::default(), &mut out, &mut |_| ControlFlow::Continue(()));
    let done = done.unwrap();
    (out, done)
}

/// Fields of a message, by number; doubles and lengths read as the reader of the wire format has to.
fn fields(mut bytes: &[u8]) -> Vec<(u64, Vec<u8>)> {
    fn varint(bytes: &mut &[u8]) -> u64 {
        let mut value = 0;
        for shift in (0..).step_by(7) {
            let byte = bytes[0];
            *bytes = &bytes[1..];
            value |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                break;
            }
        }
        value
    }
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        let length = match key & 7 {
            0 => {
                found.push((key >> 3, varint(&mut bytes).to_le_bytes().to_vec()));
                continue;
            }
            1 => 8,
            2 => varint(&mut bytes) as usize,
            wire => panic!("wire type {wire}"),
        };
        found.push((key >> 3, bytes[..length].to_vec()));
        bytes = &bytes[length..];
    }
    found
}

fn doubles(bytes: &[u8]) -> Vec<f64> {
    fields(bytes).into_iter().map(|(_, value)| f64::from_le_bytes(value.try_into().unwrap())).collect()
}

#[test]
fn a_recording_becomes_messages_in_the_order_of_time() {
    let (file, done) = converted(vec![input("run.csv", "/log", LOG), input("run.log", "", FRAMES)]);
    let messages: Vec<_> = MessageStream::new(&file).unwrap().map(Result::unwrap).collect();
    assert!(messages.windows(2).all(|pair| pair[0].log_time <= pair[1].log_time));
    assert!(messages.iter().all(|message| message.channel.message_encoding == "protobuf"));
    let of = |topic: &str| -> Vec<_> {
        messages.iter().filter(|message| message.channel.topic == topic).collect()
    };
    let state = of("/state");
    assert_eq!(state[0].log_time, 1_700_000_000_000_500_000);
    assert_eq!(state[1].log_time, 1_700_000_000_002_500_000);
    assert_eq!(doubles(&state[1].data), [1.5, 2.0, 3.0, 4.0]);
    assert_eq!(doubles(&of("/motors/left")[0].data), [5.0, 7.0, 9.0]);
    assert_eq!(doubles(&of("/motors/right")[1].data), [6.0, 8.0, -10.0]);
    let voltages: Vec<f64> = of("/supply").iter().map(|message| doubles(&message.data)[0]).collect();
    assert!(voltages[0].is_nan() && voltages[1] == 24.5);
    let angle = doubles(&of("/imu/angle")[0].data);
    for (found, degrees) in angle.iter().zip([-0.01648, 0.00549, -90.0]) {
        assert!((found.to_degrees() - degrees).abs() < 1e-5, "{found}");
    }
    let frames = of("/can/can0");
    assert_eq!(frames[0].log_time, 1_700_000_000_001_000_000);
    let sent = fields(&frames[0].data);
    let number = |field: usize| u64::from_le_bytes(sent[field].1.clone().try_into().unwrap());
    assert_eq!([0, 1, 2, 3, 4, 5].map(number), [0x141, 0, 0, 0, 1, 8]);
    assert_eq!(sent[6], (7, vec![0xA1, 0, 0, 0, 0x84, 1, 0, 0]));
    let event = of("/events");
    assert_eq!(event[0].channel.schema.as_ref().unwrap().name, "foxglove.Log");
    let text = fields(&event[0].data);
    assert_eq!((text[1].1[0], text[2].1.as_slice()), (4, &b"stop: asked"[..]));
    let counts = [
        ("/can/can0", 2),
        ("/events", 1),
        ("/imu/angle", 1),
        ("/motors/left", 2),
        ("/motors/right", 2),
        ("/state", 2),
        ("/supply", 2),
    ];
    assert_eq!(done.topics, BTreeMap::from(counts.map(|(topic, count)| (topic.to_owned(), count))));
    assert_eq!((done.dropped, done.problems.len()), (0, 0));
}

#[test]
fn other_logs_keep_their_columns_under_the_given_topic() {
    let (file, done) = converted(vec![input("run.left.csv", "/bench/left", BENCH)]);
    assert_eq!(done.topics, BTreeMap::from([("/bench/left".to_owned(), 2)]));
    let messages: Vec<_> = MessageStream::new(&file).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.iter().map(|message| message.log_time).collect::<Vec<_>>(), [0, 1_000_000_000]);
    assert_eq!(doubles(&messages[1].data), [3.0, 4.0, 5.0]);
    let schema = messages[0].channel.schema.as_ref().unwrap();
    assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("flqr.BenchLeft", "protobuf"));
    assert!(schema.data.windows(6).any(|window| window == b"my_col"));
}

#[test]
fn the_same_input_gives_the_same_bytes_with_an_index_and_without_compression() {
    let both = || converted(vec![input("run.csv", "/log", LOG), input("run.log", "", FRAMES)]).0;
    let file = both();
    assert_eq!(file, both());
    let summary = Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 12);
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.compression.is_empty()));
    let records = ::mcap::read::LinearReader::new(&file).unwrap().map(Result::unwrap);
    assert!(records.into_iter().any(|record| matches!(record, Record::Footer(_))));
}

#[test]
fn files_that_cannot_be_one_are_refused() {
    let go_on = &mut |_| ControlFlow::Continue(());
    let twice = vec![input("a.csv", "/log", LOG), input("b.csv", "/log", LOG)];
    let error = convert(twice, &ColumnMap::default(), Vec::new(), go_on).unwrap_err();
    assert_eq!(error.to_string(), "a.csv and b.csv both have `/state`: convert them separately");
    let nonsense = vec![input("run.log", "", "(no frames here\n(nor here\n")];
    let error = convert(nonsense, &ColumnMap::default(), Vec::new(), go_on).unwrap_err();
    assert!(
        error.to_string().starts_with("run.log: 2 of 2 rows cannot be used, the first at line 1: "),
        "{error}"
    );
    let stop = &mut |_| ControlFlow::Break(());
    let error = convert(vec![input("a.csv", "/log", LOG)], &ColumnMap::default(), Vec::new(), stop);
    assert_eq!(error.unwrap_err().to_string(), "the conversion was cancelled");
}

#[test]
fn frames_that_run_back_in_time_are_a_problem_of_the_file() {
    let frames = "(10.0) can0 141#A1\n(9.0) can0 141#A1\n(11.0) can0 141#A1\n";
    let (_, conversion) = converted(vec![input("run.log", "/log", frames)]);
    assert_eq!((conversion.topics["/can/can0"], conversion.dropped), (3, 0));
    assert!(
        conversion.problems[0].starts_with("run.log: line 2: time decreases by 1.000 s"),
        "{conversion:?}"
    );
}

#[test]
fn damage_is_counted_and_its_first_place_named() {
    let text = FRAMES.to_owned() + "(170";
    let (_, done) = converted(vec![input("run.log", "", &text)]);
    let problem = "run.log: line 4: the recording ends in the middle of this line, which was skipped";
    assert_eq!((done.dropped, done.problems), (1, vec![problem.to_owned()]));
}

/// Times that no clock shows: no panic, and the file is whole.
/// As many names as there are columns, each once, however often one occurs.
#[test]
fn fields_have_names_of_their_own() {
    let names = |columns: &[&str]| super::topics::field_names(columns.iter().copied());
    assert_eq!(names(&["a b", "a_b", "1", "a_b", "a_b_2"]), ["a_b", "a_b_2", "column_1", "a_b_3", "a_b_2_2"]);
    let many = names(&vec!["x"; 20_000]);
    assert_eq!(many.iter().collect::<std::collections::BTreeSet<_>>().len(), 20_000);
}

#[test]
fn times_beyond_all_bounds_are_held_there() {
    let text = "time_s,motor_angle_rad,torque_nm\n0,1,2\n1e300,1,2\n# 1e18 s stop: asked\n";
    let (file, _) = converted(vec![input("run.csv", "/bench", text)]);
    let last = MessageStream::new(&file).unwrap().map(|message| message.unwrap().log_time).max();
    assert_eq!(last, Some(u64::MAX));
    let start = Duration::from_secs(u64::from(u32::MAX));
    assert_eq!(
        crate::record::recording::parse_start("# time_s counts from 4294967295.000000 s after 1970"),
        Some(start)
    );
}
