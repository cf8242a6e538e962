//! Speed of the protocols, in frames or packets a second: motors' frames to events, an adapter's text to events,
//! an IMU's bytes to readings, and a log's lines both ways.

use std::time::Duration;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use flqr_core::link::{
    Direction, Frame, ImuAssembler, StampedFrame, Wheels, bus_load,
    candump::{Entry, parse_line, write_line},
    jy901::{Decoder, Packet},
    lk::{Command, MotorId, Reply, ReplyId, State2},
    slcan::{Answer, AnswerDecoder},
};
use flqr_core::model::{LinkSettings, StateLayout};

const FRAMES: u32 = 10_000;

fn main() {
    divan::main();
}

/// Replies of both motors in turn, 0.25 ms apart, wheels turning; every fourth frame is a command of another
/// controller.
fn frames() -> Vec<StampedFrame> {
    let motor = |at: u32| MotorId::new(1 + (at / 2 % 2) as u8).expect("1 or 2");
    (0..FRAMES)
        .map(|at| {
            let state =
                State2 { temperature_c: 30, iq: at as i16 % 500, speed_dps: 900, encoder: (at * 41) as u16 };
            let frame = match at % 4 {
                0 => Command::TorqueCurrent { iq: at as i16 % 500 }.frame(motor(at)),
                _ => Reply::State2 { command: 0xA1, state }.frame(motor(at), ReplyId::Shared),
            };
            let time = Duration::from_micros(250) * at;
            StampedFrame { time, direction: Direction::Received, frame }
        })
        .collect()
}

/// Counts what comes, each item of which has to be made.
fn count<T>(items: impl Iterator<Item = T>) -> u32 {
    items.fold(0, |count, item| {
        black_box(item);
        count + 1
    })
}

#[divan::bench]
fn lk_replies_decoded(bencher: Bencher) {
    let frames = frames();
    let bytes: Vec<[u8; 8]> = frames.iter().map(|f| f.frame.bytes().try_into().expect("8 bytes")).collect();
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        let replies =
            black_box(&bytes).iter().filter_map(|bytes| Reply::decode(*bytes, StateLayout::Current).ok());
        count(replies)
    });
}

#[divan::bench]
fn lk_frames_to_events(bencher: Bencher) {
    let frames = frames();
    let mut wheels = Wheels::new(&LinkSettings::default());
    bencher
        .counter(ItemsCount::new(FRAMES))
        .bench_local(|| black_box(&frames).iter().map(|frame| count(wheels.receive(frame))).sum::<u32>());
}

fn slcan_text() -> Vec<u8> {
    let line = |frame: Frame| Answer::Frame { frame, stamp_ms: None }.encode().to_vec();
    frames().iter().flat_map(|stamped| line(stamped.frame)).collect()
}

/// In pieces of 512 bytes, as a USB adapter delivers them.
#[divan::bench]
fn slcan_text_to_frames(bencher: Bencher) {
    let text = slcan_text();
    let mut decoder = AnswerDecoder::default();
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        let mut frames = 0;
        for mut piece in black_box(&text).chunks(512) {
            while let Some(answer) = decoder.next(&mut piece) {
                black_box(answer);
                frames += 1;
            }
        }
        assert_eq!(frames, FRAMES);
    });
}

#[divan::bench]
fn slcan_text_to_events(bencher: Bencher) {
    let text = slcan_text();
    let mut decoder = AnswerDecoder::default();
    let mut wheels = Wheels::new(&LinkSettings::default());
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        let (mut time, mut events) = (Duration::ZERO, 0);
        for mut piece in black_box(&text).chunks(512) {
            while let Some(Answer::Frame { frame, .. }) = decoder.next(&mut piece) {
                let stamped = StampedFrame { time, direction: Direction::Received, frame };
                events += count(wheels.receive(&stamped));
                time += Duration::from_micros(250);
            }
        }
        assert!(events >= FRAMES);
    });
}

#[divan::bench]
fn bits_on_the_bus(bencher: Bencher) {
    let frames = frames();
    bencher
        .counter(ItemsCount::new(FRAMES))
        .bench_local(|| black_box(&frames).iter().map(|stamped| bus_load::bits(&stamped.frame)).sum::<u32>());
}

#[divan::bench]
fn jy901_bytes_to_readings(bencher: Bencher) {
    let cycle = |at: u32| {
        let small = f64::from(at % 100) * 1e-3;
        [
            Packet::acceleration([0.0, small, 1.0], 25.0),
            Packet::rate([small; 3], 25.0),
            Packet::angle([small; 3], 1),
        ]
    };
    let bytes: Vec<u8> = (0..FRAMES / 3).flat_map(cycle).flat_map(|packet| packet.encode()).collect();
    let mut decoder = Decoder::new();
    let mut assembler = ImuAssembler::new(&LinkSettings::default());
    bencher.counter(ItemsCount::new(FRAMES / 3 * 3)).bench_local(|| {
        let mut readings = 0;
        for piece in black_box(&bytes).chunks(64) {
            decoder.push(Duration::ZERO, piece);
            while let Some((time, packet)) = decoder.next() {
                readings += u32::from(black_box(assembler.push(time, &packet)).is_some());
            }
        }
        assert_eq!(readings, FRAMES / 3);
    });
}

fn log() -> String {
    let mut log = String::new();
    for StampedFrame { time, frame, .. } in frames() {
        let direction = Some(Direction::Received);
        write_line(&mut log, &Entry { time, interface: "can0", frame: frame.into(), direction });
    }
    log
}

#[divan::bench]
fn candump_lines_read(bencher: Bencher) {
    let log = log();
    bencher
        .counter(ItemsCount::new(FRAMES))
        .bench_local(|| black_box(&log).lines().filter(|line| black_box(parse_line(line)).is_ok()).count());
}

#[divan::bench]
fn candump_lines_written(bencher: Bencher) {
    let log = log();
    let entries: Vec<Entry> = log.lines().filter_map(|line| parse_line(line).ok().flatten()).collect();
    let mut out = String::with_capacity(log.len());
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        out.clear();
        black_box(&entries).iter().for_each(|entry| write_line(&mut out, entry));
        black_box(&out).len()
    });
}
