use std::f64::consts::TAU;

use super::*;
use crate::link::lk::{Command, Reply, ReplyId, State2};
use crate::link::protocol::{Frames, MOST_FRAMES, MOST_REPORTS, Reports, TorqueRange};
use crate::link::{FrameId, MotorErrors, MotorHealth};
use crate::model::{StateLayout, TorqueCommand, Turn};

fn sixteen_turns() -> LinkSettings {
    LinkSettings { torque_constant_nm_a: Some(0.32), ..LinkSettings::default() }
}

fn bytes_of(settings: &LinkSettings, order: MotorOrder) -> Vec<(u32, Vec<u8>)> {
    Wheels::new(settings).frames(&order).map(|frame| (frame.id().raw(), frame.bytes().to_vec())).collect()
}

fn at_ms(ms: f64) -> Duration {
    Duration::from_secs_f64(ms / 1000.0)
}

fn stamped(ms: f64, direction: Direction, id: u16, bytes: [u8; 8]) -> StampedFrame {
    StampedFrame { time: at_ms(ms), direction, frame: Frame::full(FrameId::Standard(id), bytes) }
}

fn received(ms: f64, id: u16, bytes: [u8; 8]) -> StampedFrame {
    stamped(ms, Direction::Received, id, bytes)
}

fn state(temperature_c: i8, iq: i16, speed_dps: i16, encoder: u16) -> State2 {
    State2 { temperature_c, iq, speed_dps, encoder }
}

fn reply(command: u8, state: State2) -> [u8; 8] {
    Reply::State2 { command, state }.encode()
}

const ON: [u8; 8] = [0x88, 0, 0, 0, 0, 0, 0, 0];

#[test]
fn torques_are_currents_in_each_motors_own_sense() {
    let (left, right) = (0x141, 0x142);
    let turns = |constant, steps| LinkSettings {
        torque_constant_nm_a: Some(constant),
        current_steps_per_a: steps,
        ..LinkSettings::default()
    };
    let iq = |settings: &LinkSettings, torques_nm| {
        bytes_of(settings, MotorOrder::Torque(torques_nm))
            .into_iter()
            .map(|(id, bytes)| (id, i16::from_le_bytes([bytes[4], bytes[5]])))
            .collect::<Vec<_>>()
    };
    // Worked by hand: torque / constant × steps per ampere; the right motor is mounted the other way round.
    let newest = turns(0.32, 4096.0 / 33.0);
    assert_eq!(iq(&newest, [1.0, 1.0]), [(left, 388), (right, -388)]);
    assert_eq!(iq(&newest, [-0.5, 0.5]), [(left, -194), (right, -194)]);
    assert_eq!(iq(&turns(0.81, 4096.0 / 33.0), [2.42, 0.0]), [(left, 371), (right, 0)]);
    assert_eq!(iq(&turns(0.32, 62.5), [2.42, -2.42]), [(left, 473), (right, 473)]);
    assert_eq!(iq(&newest, [100.0, 100.0]), [(left, 2048), (right, -2048)]);
    assert_eq!(iq(&newest, [f64::NAN, f64::INFINITY]), [(left, 0), (right, -2048)]);
    assert_eq!(iq(&LinkSettings::default(), [1.0, 1.0]), []);
    let worked = bytes_of(&newest, MotorOrder::Torque([1.0, 0.5]));
    assert_eq!(worked[0], (0x141, vec![0xA1, 0, 0, 0, 0x84, 0x01, 0, 0]));
    assert_eq!(worked[1], (0x142, vec![0xA1, 0, 0, 0, 0x3E, 0xFF, 0, 0]));
}

#[test]
fn torques_together_are_one_frame() {
    let settings = LinkSettings { torque_command: TorqueCommand::Together, ..sixteen_turns() };
    let worked = vec![0x84, 0x01, 0x7C, 0xFE, 0, 0, 0, 0];
    assert_eq!(bytes_of(&settings, MotorOrder::Torque([1.0, 1.0])), [(0x280, worked)]);
    let others = LinkSettings { left_motor_id: 4, right_motor_id: 1, ..settings };
    let swapped = vec![0x7C, 0xFE, 0, 0, 0, 0, 0x84, 0x01];
    assert_eq!(bytes_of(&others, MotorOrder::Torque([1.0, 1.0])), [(0x280, swapped)]);
    let unknown = LinkSettings { torque_constant_nm_a: None, ..settings };
    assert_eq!(bytes_of(&unknown, MotorOrder::Torque([1.0, 1.0])), []);
}

#[test]
fn other_orders_go_to_each_motor() {
    let settings = LinkSettings { left_motor_id: 7, right_motor_id: 32, ..LinkSettings::default() };
    for (order, code) in [
        (MotorOrder::On, 0x88),
        (MotorOrder::Off, 0x80),
        (MotorOrder::ReadState, 0x9C),
        (MotorOrder::ReadHealth, 0x9A),
        (MotorOrder::ClearErrors, 0x9B),
    ] {
        let bytes = vec![code, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(bytes_of(&settings, order), [(0x147, bytes.clone()), (0x160, bytes)], "{order:?}");
    }
}

#[test]
fn a_reply_is_forward_positive_on_either_identifier() {
    // Protocol 2.36, section 3, as worked in its notes: 35 °C, 310 = 2.498 A, −287 °/s = −5.009 rad/s.
    let bytes = [0xA1, 0x23, 0x36, 0x01, 0xE1, 0xFE, 0x00, 0xC0];
    for (id, sign) in [(0x141, 1.0), (0x181, 1.0), (0x142, -1.0), (0x182, -1.0)] {
        let mut wheels = Wheels::new(&sixteen_turns());
        let events: Vec<_> = wheels.receive(&received(3.0, id, bytes)).collect();
        let [MotorEvent::State(motor, state)] = events[..] else { panic!("{events:?}") };
        assert_eq!(motor, if sign > 0.0 { Motor::Left } else { Motor::Right });
        assert_eq!(state.time, at_ms(3.0));
        assert!((state.current_a - sign * 310.0 * 33.0 / 4096.0).abs() < 1e-12);
        assert!((state.speed_rad_s - sign * -5.009).abs() < 1e-3);
        assert_eq!(state.temperature_c, 35.0);
        assert_eq!(state.angle_rad, 0.0, "angles count from the first reading");
    }
}

#[test]
fn health_follows_the_layout_of_the_firmware() {
    let mut current = Wheels::new(&LinkSettings::default());
    let bytes = [0x9A, 0x23, 0x61, 0x09, 0xDD, 0xFF, 0x00, 0x08];
    let events: Vec<_> = current.receive(&received(1.0, 0x182, bytes)).collect();
    let [MotorEvent::Health(Motor::Right, health)] = events[..] else { panic!("{events:?}") };
    let expected = MotorHealth {
        time: at_ms(1.0),
        temperature_c: 35.0,
        voltage_v: Some(24.01),
        supply_current_a: Some(-0.35),
        on: Some(true),
        errors: MotorErrors(8),
        round_trip: None,
    };
    assert_eq!(health, expected);
    assert_eq!(health.errors.to_string(), "motor too hot");

    let settings = LinkSettings { state_layout: StateLayout::Older, ..LinkSettings::default() };
    let mut older = Wheels::new(&settings);
    // 240 × 0.1 V at bytes 3 and 4.
    let bytes = [0x9A, 0x23, 0x00, 0xF0, 0x00, 0x00, 0x00, 0x01];
    let events: Vec<_> = older.receive(&received(1.0, 0x141, bytes)).collect();
    let [MotorEvent::Health(Motor::Left, health)] = events[..] else { panic!("{events:?}") };
    let unknown = (health.supply_current_a, health.on);
    assert_eq!((health.voltage_v, health.errors, unknown), (Some(24.0), MotorErrors(1), (None, None)));
}

/// Readings of a shaft that turns as `angle_rad` and `speed_rad_s` say, in the left motor's own sense, one at each
/// of the times; largest error of the angle that comes out, and the silences that were too long.
fn follow(
    settings: &LinkSettings,
    times_s: impl Iterator<Item = f64>,
    angle_rad: impl Fn(f64) -> f64,
    speed_rad_s: impl Fn(f64) -> f64,
) -> (f64, usize) {
    let mut wheels = Wheels::new(settings);
    let (mut worst, mut lost) = (0.0_f64, 0);
    let steps = f64::from(settings.encoder_steps);
    let sign = settings.left_direction.sign();
    for time_s in times_s {
        let encoder = (angle_rad(time_s) / TAU * steps).floor().rem_euclid(steps) as u16;
        let dps = (speed_rad_s(time_s) / 1_f64.to_radians()).round() as i16;
        for event in wheels.receive(&received(time_s * 1e3, 0x181, reply(0xA1, state(25, 0, dps, encoder)))) {
            match event {
                MotorEvent::State(_, state) => {
                    worst = worst.max((sign * state.angle_rad - (angle_rad(time_s) - angle_rad(0.0))).abs());
                }
                MotorEvent::TurnsLost { .. } => lost += 1,
                other => panic!("{other:?}"),
            }
        }
    }
    (worst, lost)
}

#[test]
fn the_angle_goes_on_over_turns_and_lost_replies() {
    let every = |ms: usize| (0..10_000).step_by(ms).map(|ms| ms as f64 * 1e-3);
    for (encoder_steps, left_direction) in [(65_536, Turn::Forward), (16_384, Turn::Backward)] {
        let settings = LinkSettings { encoder_steps, left_direction, ..LinkSettings::default() };
        let step = TAU / f64::from(encoder_steps);
        // 55 rad/s forth and back within 4 s: 87 turns are gone over, 2.7 rad between readings in the worst case.
        let angle = |t: f64| 35.0 * (TAU * t / 4.0).sin();
        let speed = |t: f64| 35.0 * TAU / 4.0 * (TAU * t / 4.0).cos();
        for silence_ms in [1, 7, 50] {
            let (worst, lost) = follow(&settings, every(silence_ms), angle, speed);
            assert!(worst <= step && lost == 0, "{encoder_steps} {silence_ms} ms: {worst} {lost}");
        }
    }
}

#[test]
fn a_stop_and_start_within_a_silence_does_not_cost_a_turn() {
    // Full speed, unseen standstill and full speed again: the worst that a motor of 51.3 rad/s can do.
    let (top, gap) = (51.3, 0.0599);
    let angle = move |t: f64| if t < 1.0 { top * t } else { top * (t - gap).max(1.0) };
    let times = (0..2000).map(|ms| f64::from(ms) * 1e-3).filter(move |t| *t <= 1.0 || *t >= 1.0 + gap);
    let (worst, lost) = follow(&LinkSettings::default(), times, angle, |_| top);
    assert!(worst < 1e-3 && lost == 0, "{worst} {lost}");
}

#[test]
fn after_a_long_silence_the_angle_goes_on_from_the_last_one() {
    let mut wheels = Wheels::new(&LinkSettings::default());
    let mut hear = |ms: f64, encoder: u16| {
        wheels.receive(&received(ms, 0x181, reply(0x9C, state(25, 0, 0, encoder)))).collect::<Vec<_>>()
    };
    hear(0.0, 65_000);
    let before = hear(1.0, 100);
    let [MotorEvent::State(_, before)] = before[..] else { panic!("{before:?}") };
    assert!((before.angle_rad - 636.0 * TAU / 65_536.0).abs() < 1e-12);
    let after = hear(62.0, 30_000);
    let [lost, MotorEvent::State(_, after)] = after[..] else { panic!("{after:?}") };
    let silent = at_ms(61.0);
    assert_eq!(lost, MotorEvent::TurnsLost { motor: Motor::Left, time: at_ms(62.0), silent });
    assert_eq!(after.angle_rad, before.angle_rad);
    let on = hear(63.0, 30_001);
    let [MotorEvent::State(_, on)] = on[..] else { panic!("{on:?}") };
    assert!((on.angle_rad - before.angle_rad - TAU / 65_536.0).abs() < 1e-12);
}

/// What a watcher should make of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    Asked(i16),
    Commanded(u32),
    State(i16),
    Health,
    Switched(bool),
    Nothing,
}

fn told(wheels: &mut Wheels, frame: &StampedFrame, settings: &LinkSettings) -> Told {
    let mut events: Vec<_> = wheels.receive(frame).collect();
    let raw = |current_a: f64| (current_a * settings.current_steps_per_a).round() as i16;
    match events.pop() {
        None => Told::Nothing,
        Some(MotorEvent::Commanded { current_a: Some(current_a), .. }) => Told::Asked(raw(current_a)),
        Some(MotorEvent::Commanded { command, .. }) => Told::Commanded(command),
        Some(MotorEvent::State(_, state)) => Told::State(raw(state.current_a)),
        Some(MotorEvent::Health(..)) => Told::Health,
        Some(MotorEvent::Switched { on, .. }) => Told::Switched(on),
        Some(other) => panic!("{other:?}"),
    }
}

const QUERY: [u8; 8] = [0x9C, 0, 0, 0, 0, 0, 0, 0];
const HEALTH: [u8; 8] = [0x9A, 0, 0, 0, 0, 0, 0, 0];

fn torque(iq: i16) -> [u8; 8] {
    Command::TorqueCurrent { iq }.encode()
}

#[test]
fn a_watcher_tells_commands_from_replies() {
    use Told::*;
    let warm = state(31, -7, 250, 0x1234);
    let health = [0x9A, 31, 0x61, 0x09, 0, 0, 0, 0];
    for reply_id in [ReplyId::Shared, ReplyId::Apart] {
        let back = if reply_id == ReplyId::Shared { 0x141 } else { 0x181 };
        // The sequence of a controller that switches on, asks and drives; a lost reply, then a lost command.
        let sequence = [
            (0x141, ON, Commanded(0x88)),
            (back, ON, Switched(true)),
            (0x141, HEALTH, Nothing),
            (back, health, Health),
            (0x141, QUERY, Nothing),
            (back, reply(0x9C, warm), State(-7)),
            (0x141, torque(0), Asked(0)),
            (back, reply(0xA1, warm), State(-7)),
            (0x141, torque(300), Asked(300)),
            (0x141, torque(0), Asked(0)),
            (0x141, torque(-5), Asked(-5)),
            (back, reply(0xA1, warm), State(-7)),
            (back, reply(0xA1, warm), State(-7)),
            (0x141, HEALTH, Nothing),
            (0x141, HEALTH, Nothing),
            (back, health, Health),
            (0x141, torque(12), Asked(12)),
        ];
        let settings = LinkSettings::default();
        let mut wheels = Wheels::new(&settings);
        for (at, (id, bytes, expected)) in sequence.into_iter().enumerate() {
            let frame = received(at as f64, id, bytes);
            assert_eq!(told(&mut wheels, &frame, &settings), expected, "{reply_id:?} frame {at}");
        }
    }
}

#[test]
fn a_cold_motor_at_rest_is_told_from_its_commands() {
    use Told::*;
    let settings = LinkSettings::default();
    let all_zero = reply(0xA1, state(0, 0, 0, 0));
    assert_eq!(all_zero, torque(0), "the case that bytes alone cannot decide");
    let cold = reply(0xA1, state(1, 4, 0, 9));
    let mut watched = Wheels::new(&settings);
    let sequence = [
        (torque(9), Asked(9)),
        (cold, State(4)),
        (torque(0), Asked(0)),
        (all_zero, State(0)),
        (torque(7), Asked(7)),
    ];
    for (at, (bytes, expected)) in sequence.into_iter().enumerate() {
        assert_eq!(told(&mut watched, &received(at as f64, 0x141, bytes), &settings), expected, "frame {at}");
    }

    // Of our own commands the direction is known, so that even the first reply may be all zeros.
    let mut own = Wheels::new(&settings);
    assert_eq!(told(&mut own, &stamped(0.0, Direction::Sent, 0x141, torque(0)), &settings), Nothing);
    assert_eq!(told(&mut own, &received(0.3, 0x141, all_zero), &settings), State(0));
    assert_eq!(told(&mut own, &stamped(1.0, Direction::Sent, 0x141, ON), &settings), Nothing);
    assert_eq!(told(&mut own, &received(1.3, 0x141, ON), &settings), Switched(true));
    assert_eq!(told(&mut own, &received(1.6, 0x141, torque(50)), &settings), Asked(50), "another controller");
}

#[test]
fn what_is_asked_of_both_at_once_is_two_events() {
    let mut wheels = Wheels::new(&sixteen_turns());
    let frame = [0x84, 0x01, 0x7C, 0xFE, 0, 0, 0, 0];
    let events: Vec<_> = wheels.receive(&received(5.0, 0x280, frame)).collect();
    let current_a = Some(388.0 * 33.0 / 4096.0);
    let asked = |motor| MotorEvent::Commanded { motor, time: at_ms(5.0), command: 0x280, current_a };
    assert_eq!(events, Motor::BOTH.map(asked));
    assert_eq!(wheels.receive(&stamped(5.0, Direction::Sent, 0x280, frame)).count(), 0);
    // The replies are those to 0xA1, even all zeros of a motor that we have asked.
    assert_eq!(wheels.receive(&received(5.3, 0x141, torque(0))).count(), 1);
}

#[test]
fn other_frames_tell_nothing() {
    let mut wheels = Wheels::new(&sixteen_turns());
    let bytes = reply(0xA1, state(30, 1, 2, 3));
    for id in [0x140, 0x143, 0x161, 0x180, 0x183, 0x281, 0x7FF] {
        assert_eq!(wheels.receive(&received(1.0, id, bytes)).count(), 0, "{id:03X}");
    }
    let short = Frame::data(FrameId::Standard(0x141), &bytes[..7]).unwrap();
    let wide = Frame::full(FrameId::Extended(0x141), bytes);
    let remote = Frame::remote(FrameId::Standard(0x141), 8).unwrap();
    for frame in [short, wide, remote] {
        let frame = StampedFrame { time: at_ms(1.0), direction: Direction::Received, frame };
        assert_eq!(wheels.receive(&frame).count(), 0);
    }
}

/// The reply to each of two commands in one millisecond is told, whichever comes first.
#[test]
fn commands_of_two_kinds_are_answered_apart() {
    let settings = LinkSettings { torque_constant_nm_a: Some(0.32), ..LinkSettings::default() };
    for first in [MotorOrder::On, MotorOrder::Off] {
        let mut wheels = Wheels::new(&settings);
        let orders = [first, MotorOrder::Torque([0.0; 2])];
        let frames: Vec<Frame> = orders.iter().flat_map(|order| wheels.frames(order)).collect();
        for frame in &frames {
            let sent = StampedFrame { time: Duration::ZERO, direction: Direction::Sent, frame: *frame };
            assert_eq!(wheels.receive(&sent).count(), 0);
        }
        let echo: [u8; 8] = frames[0].bytes().try_into().unwrap();
        let events: Vec<_> = wheels.receive(&received(0.25, 0x141, echo)).collect();
        let [MotorEvent::Switched { motor: Motor::Left, on, .. }] = events[..] else { panic!("{events:?}") };
        assert_eq!(on, echo[0] == 0x88);
    }
}

#[test]
fn of_a_recording_torques_that_were_sent_are_told_too() {
    let sent = stamped(1.0, Direction::Sent, 0x141, torque(200));
    let together = stamped(2.0, Direction::Sent, 0x280, [100, 0, 100, 0, 0, 0, 0, 0]);
    let asked = |wheels: &mut Wheels, frame: &StampedFrame| wheels.receive(frame).count();
    let mut live = Wheels::new(&sixteen_turns());
    let mut replayed = Wheels::new(&sixteen_turns()).telling_sent();
    assert_eq!([asked(&mut live, &sent), asked(&mut live, &together)], [0, 0]);
    let [event] = replayed.receive(&sent).collect::<Vec<_>>()[..] else { panic!("one event") };
    let MotorEvent::Commanded { motor: Motor::Left, current_a: Some(current_a), .. } = event else {
        panic!("{event:?}")
    };
    assert!((current_a - 200.0 * 33.0 / 4096.0).abs() < 1e-12, "{current_a} A");
    assert_eq!(asked(&mut replayed, &together), 2);
    // What follows is its reply, and no command of somebody else.
    let reply = reply(0xA1, state(30, 200, 10, 77));
    let told: Vec<_> = replayed.receive(&received(2.2, 0x141, reply)).collect();
    assert!(matches!(told[..], [MotorEvent::State(Motor::Left, _)]), "{told:?}");
}

/// A robot that is driven at 1 kHz, all that its left motor answers, and one frame of somebody else: it is reported
/// once, whatever it is and wherever it comes in between.
#[test]
fn one_command_of_another_controller_is_reported_whenever_it_comes() {
    let settings = sixteen_turns();
    let stop = [0x81, 0, 0, 0, 0, 0, 0, 0];
    let limited = [0xA6, 1, 0xF4, 0x01, 0x64, 0, 0, 0];
    let brake = [0x8C, 0, 0, 0, 0, 0, 0, 0];
    let off = [0x80, 0, 0, 0, 0, 0, 0, 0];
    let others: [(u16, [u8; 8], u32); 9] = [
        (0x141, torque(0), 0xA1),
        (0x141, torque(300), 0xA1),
        (0x141, Command::Speed { speed_cdps: 0, iq_limit: 0 }.encode(), 0xA2),
        (0x141, limited, 0xA6),
        (0x141, stop, 0x81),
        (0x141, off, 0x80),
        (0x141, ON, 0x88),
        (0x141, brake, 0x8C),
        (0x280, [1, 0, 0, 0, 0, 0, 0, 0], 0x280),
    ];
    for ((id, bytes, command), apart) in others.into_iter().flat_map(|other| [(other, false), (other, true)])
    {
        // After our command, after its reply, before the next command.
        for place in [0.1, 0.3, 0.9] {
            let mut wheels = Wheels::new(&settings);
            let back = if apart { 0x181 } else { 0x141 };
            let mut heard = Vec::new();
            for tick in 0..200_u16 {
                let start = f64::from(tick);
                let iq = 3 * (tick % 7) as i16 - 9;
                let code = if tick < 50 { QUERY } else { torque(iq) };
                assert_eq!(wheels.receive(&stamped(start, Direction::Sent, 0x141, code)).count(), 0);
                let warm = reply(code[0], state(31, iq, 40, 0x1200 + tick));
                let mut frames = vec![(0.25_f64, back, warm)];
                if tick == 150 {
                    frames.push((place, id, bytes));
                    // A motor answers 0.25 ms later.
                    let answer = if bytes[0] == 0x81 || bytes[0] < 0x90 {
                        bytes
                    } else {
                        reply(bytes[0], state(31, 0, 40, 0x1296))
                    };
                    frames.push((place + 0.25, back, answer));
                }
                frames.sort_by(|a, b| a.0.total_cmp(&b.0));
                for (after, id, bytes) in frames {
                    heard.extend(wheels.receive(&received(start + after, id, bytes)));
                }
            }
            let found: Vec<_> = heard
                .iter()
                .filter_map(|event| match event {
                    MotorEvent::Commanded { motor: Motor::Left, command, .. } => Some(*command),
                    _ => None,
                })
                .collect();
            assert_eq!(found, [command], "{id:X} {bytes:02X?} at {place}, replies apart: {apart}");
        }
    }
}

/// Queries of a second computer move nothing.
#[test]
fn queries_of_somebody_else_are_no_commands() {
    let mut wheels = Wheels::new(&sixteen_turns());
    for code in [0x9A, 0x9C, 0x9D, 0x90, 0x92, 0x94, 0xC0, 0xB0, 0x30, 0x33] {
        let query = [code, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(wheels.receive(&received(f64::from(code), 0x141, query)).count(), 0, "{code:X}");
    }
}

/// An adapter that returns what it sends, some milliseconds later: every reply is received as without it, and a foreign
/// command is still one.
#[test]
fn echoes_of_an_adapter_are_neither_commands_nor_replies() {
    let settings = sixteen_turns();
    for late_ms in [0.05, 0.6, 3.4] {
        let mut wheels = Wheels::new(&settings);
        let mut frames = Vec::new();
        let mut send = |at: f64, bytes: [u8; 8], answer: [u8; 8]| {
            frames.push(stamped(at, Direction::Sent, 0x141, bytes));
            frames.push(received(at + late_ms, 0x141, bytes));
            frames.push(received(at + late_ms + 0.25, 0x141, answer));
        };
        for tick in 0..100_u16 {
            let at = f64::from(tick);
            let warm = |code| reply(code, state(31, 5, 40, 0x1200 + tick));
            match tick {
                0..50 => send(at, QUERY, warm(0x9C)),
                50 => send(at, ON, ON),
                _ => send(at, torque((tick % 3) as i16 - 1), warm(0xA1)),
            }
        }
        frames.push(received(99.95 + late_ms, 0x141, [0x81, 0, 0, 0, 0, 0, 0, 0]));
        frames.sort_by_key(|frame| frame.time);
        let events: Vec<_> =
            frames.iter().flat_map(|frame| wheels.receive(frame).collect::<Vec<_>>()).collect();
        let count = |wanted: fn(&MotorEvent) -> bool| events.iter().filter(|event| wanted(event)).count();
        let states = count(|event| matches!(event, MotorEvent::State(..)));
        let on = count(|event| matches!(event, MotorEvent::Switched { on: true, .. }));
        let foreign = count(|event| matches!(event, MotorEvent::Commanded { .. }));
        assert_eq!((states, on, foreign), (99, 1, 1), "{late_ms} ms");
    }
}

/// A frame is ordered, then written: behind an adapter that returns it, the reply of the motor is a reply.
#[test]
fn a_frame_that_was_ordered_and_written_has_one_echo() {
    let off = [0x80, 0, 0, 0, 0, 0, 0, 0];
    for (command, on) in [(ON, true), (off, false)] {
        let mut wheels = Wheels::new(&sixteen_turns());
        let warm = reply(0x9C, state(31, 5, 40, 0x1200));
        for at in [0.0, 1.0, 2.0] {
            let query = stamped(at, Direction::Sent, 0x141, QUERY);
            assert_eq!(wheels.receive(&query).count(), 0);
            wheels.written(&StampedFrame { time: at_ms(at + 0.1), ..query });
            wheels.receive(&received(at + 0.2, 0x141, QUERY)).for_each(drop);
            wheels.receive(&received(at + 0.3, 0x141, warm)).for_each(drop);
        }
        let ordered = stamped(3.0, Direction::Sent, 0x141, command);
        assert_eq!(wheels.receive(&ordered).count(), 0);
        wheels.written(&StampedFrame { time: at_ms(3.1), ..ordered });
        assert_eq!(wheels.receive(&received(3.2, 0x141, command)).count(), 0, "the echo");
        let events: Vec<_> = wheels.receive(&received(3.4, 0x141, command)).collect();
        let [MotorEvent::Switched { motor: Motor::Left, on: said, .. }] = events[..] else {
            panic!("{events:?}")
        };
        assert_eq!(said, on);
    }
}

/// Damaged replies of a serial line: each bit of each reply of a driven robot, one at a time.
#[test]
fn a_reply_with_a_wrong_bit_is_no_command() {
    let warm = state(31, -7, 250, 0x1234);
    let health = [0x9A, 31, 0x61, 0x09, 0, 0, 0, 0];
    let off = [0x80, 0, 0, 0, 0, 0, 0, 0];
    let exchange =
        [(QUERY, reply(0x9C, warm)), (HEALTH, health), (torque(0), reply(0xA1, warm)), (ON, ON), (off, off)];
    for (command, answer) in exchange {
        for bit in 0..64 {
            let mut wheels = Wheels::new(&sixteen_turns());
            wheels.receive(&received(0.0, 0x141, reply(0x9C, warm))).for_each(drop);
            wheels.receive(&stamped(1.0, Direction::Sent, 0x141, command)).for_each(drop);
            let mut damaged = answer;
            damaged[bit / 8] ^= 1 << (bit % 8);
            let events: Vec<_> = wheels.receive(&received(1.25, 0x141, damaged)).collect();
            let commanded = events.iter().any(|event| matches!(event, MotorEvent::Commanded { .. }));
            assert!(!commanded, "{damaged:02X?}: {events:?}");
        }
    }
}

#[test]
fn the_round_trip_of_a_health_query_is_measured() {
    let health = [0x9A, 31, 0x61, 0x09, 0, 0, 0, 0];
    let mut wheels = Wheels::new(&sixteen_turns());
    let mut trip = |sent: Option<f64>, heard: f64| {
        if let Some(ms) = sent {
            wheels.receive(&stamped(ms, Direction::Sent, 0x141, HEALTH)).for_each(drop);
        }
        match wheels.receive(&received(heard, 0x141, health)).next() {
            Some(MotorEvent::Health(Motor::Left, health)) => health.round_trip,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(trip(Some(10.0), 11.5), Some(at_ms(11.5) - at_ms(10.0)));
    assert_eq!(trip(Some(50.0), 65.0), Some(at_ms(65.0) - at_ms(50.0)));
    assert_eq!(trip(None, 70.0), None, "the query of somebody else");
}

/// Drives behind a gear that take the currents of both motors in one frame, have no command to switch on, and report
/// unprompted.
#[derive(Debug, Default)]
struct GroupFrames {
    switched: [Option<bool>; 2],
}

const GEAR: f64 = 3591.0 / 187.0;

impl MotorProtocol for GroupFrames {
    fn encode(&mut self, order: &MotorOrder) -> Frames {
        let mut frames = [None; MOST_FRAMES];
        match *order {
            MotorOrder::On | MotorOrder::Off => self.switched = [Some(*order == MotorOrder::On); 2],
            MotorOrder::Torque(torques_nm) => {
                let [[a, b], [c, d]] = torques_nm.map(|nm| ((nm * 1000.0) as i16).to_be_bytes());
                frames[0] = Some(Frame::full(FrameId::Standard(0x200), [a, b, c, d, 0, 0, 0, 0]));
            }
            MotorOrder::ReadState | MotorOrder::ReadHealth | MotorOrder::ClearErrors => {}
        }
        frames
    }

    fn decode(&mut self, frame: &StampedFrame) -> Reports {
        let mut reports = [None; MOST_REPORTS];
        let motor = match frame.frame.id().raw() {
            0x201 => Motor::Left,
            0x202 => Motor::Right,
            _ => return reports,
        };
        let &[angle_high, angle_low, rpm_high, rpm_low, ..] = frame.frame.bytes() else { return reports };
        let steps = u32::from(u16::from_be_bytes([angle_high, angle_low]));
        let rotor_rad_s = f64::from(i16::from_be_bytes([rpm_high, rpm_low])) * TAU / 60.0;
        reports[0] = Some(Report::Motion {
            motor,
            angle: ShaftAngle::WithinTurn { steps, turn_steps: 8192, turn_rad: TAU / GEAR },
            speed_rad_s: rotor_rad_s / GEAR,
            current_a: 0.0,
            temperature_c: 25.0,
        });
        reports[1] = self.switched[motor as usize].take().map(|on| Report::Switched { motor, on });
        reports
    }

    fn torque_range(&self) -> Result<TorqueRange, &'static str> {
        Ok(TorqueRange { max_nm: 32.767, step_nm: 0.001 })
    }

    fn longest_silence(&self) -> Duration {
        Duration::from_millis(5)
    }
}

#[test]
fn group_frames_and_geared_drives_that_report_unprompted_fit() {
    let settings = LinkSettings::default();
    let mut wheels = Wheels::with_protocol(Box::<GroupFrames>::default(), &settings);
    let frames: Vec<Frame> = wheels.frames(&MotorOrder::Torque([0.5, 0.5])).collect();
    let [both] = frames[..] else { panic!("{frames:?}") };
    assert_eq!(both.bytes()[..4], [0x01, 0xF4, 0xFE, 0x0C], "0.5 N m forward in each motor's own sense");
    assert_eq!(wheels.frames(&MotorOrder::On).count() + wheels.frames(&MotorOrder::ReadState).count(), 0);

    // 8000 rpm of the rotor for 30 ms: 4 turns of it, 4/19.2 of a turn at the wheel.
    let rpm = 8000_i16;
    let mut last = None;
    for tick in 0..=30_u32 {
        let steps = (f64::from(tick) * 8192.0 * 8000.0 / 60_000.0).round() as u32 % 8192;
        let [a, b] = (steps as u16).to_be_bytes();
        let [c, d] = rpm.to_be_bytes();
        let frame = received(f64::from(tick), 0x202, [a, b, c, d, 0, 0, 25, 0]);
        let events: Vec<MotorEvent> = wheels.receive(&frame).collect();
        assert_eq!(events.len(), if tick == 0 { 2 } else { 1 }, "{events:?}");
        assert!(events[1..].iter().all(|event| matches!(event, MotorEvent::Switched { on: true, .. })));
        if let MotorEvent::State(motor, state) = events[0] {
            last = Some((motor, state.angle_rad, state.speed_rad_s));
        }
    }
    let (motor, angle_rad, speed_rad_s) = last.unwrap();
    assert_eq!(motor, Motor::Right);
    assert!((angle_rad + 4.0 * TAU / GEAR).abs() < 1e-4, "{angle_rad}");
    assert!((speed_rad_s + 8000.0 * TAU / 60.0 / GEAR).abs() < 1e-9, "{speed_rad_s}");
    // 6 ms of silence are more than half a turn of the rotor.
    let late = wheels.receive(&received(36.0, 0x202, [0; 8]));
    assert!(late.into_iter().any(|event| matches!(event, MotorEvent::TurnsLost { .. })));
}

#[test]
fn angles_that_a_drive_counts_itself_start_at_zero() {
    let settings = LinkSettings::default();
    let mut wheels = Wheels::new(&settings);
    let angles = [7.5, 8.0, -20.0].map(|rad| {
        let angle = ShaftAngle::Continuous(rad);
        wheels.count(Motor::Left, angle, Duration::ZERO, 0.0)
    });
    assert_eq!(angles, [(0.0, None), (0.5, None), (-27.5, None)]);
}

#[test]
fn the_range_of_torques_is_that_of_the_command() {
    let range = |settings: &LinkSettings| (protocol(settings.protocol).host)(settings).torque_range();
    let TorqueRange { max_nm, step_nm } = range(&sixteen_turns()).unwrap();
    assert!((max_nm - 5.28).abs() < 1e-9 && (step_nm - 0.002_578).abs() < 1e-6, "{max_nm} {step_nm}");
    assert!(range(&LinkSettings::default()).unwrap_err().contains("torque_constant_nm_a"));
}
