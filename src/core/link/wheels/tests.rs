use super::*;
use crate::link::lk::ReplyId;
use crate::link::{FrameId, MotorErrors};
use crate::robot::{StateLayout, Turn};

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
        voltage_v: 24.01,
        supply_current_a: Some(-0.35),
        on: Some(true),
        errors: MotorErrors(8),
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
    assert_eq!((health.voltage_v, health.errors, unknown), (24.0, MotorErrors(1), (None, None)));
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
        let dps = (speed_rad_s(time_s) / RAD_S_PER_DPS).round() as i16;
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
    State(i16),
    Health,
    Acknowledged(u8),
    Nothing,
}

fn told(wheels: &mut Wheels, frame: &StampedFrame, settings: &LinkSettings) -> Told {
    let mut events: Vec<_> = wheels.receive(frame).collect();
    let raw = |current_a: f64| (current_a * settings.current_steps_per_a).round() as i16;
    match events.pop() {
        None => Told::Nothing,
        Some(MotorEvent::Asked { current_a, .. }) => Told::Asked(raw(current_a)),
        Some(MotorEvent::State(_, state)) => Told::State(raw(state.current_a)),
        Some(MotorEvent::Health(..)) => Told::Health,
        Some(MotorEvent::Acknowledged { command, .. }) => Told::Acknowledged(command),
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
            (0x141, ON, Nothing),
            (back, ON, Acknowledged(0x88)),
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
    assert_eq!(told(&mut own, &received(1.3, 0x141, ON), &settings), Acknowledged(0x88));
    assert_eq!(told(&mut own, &received(1.6, 0x141, torque(50)), &settings), Asked(50), "another controller");
}

#[test]
fn what_is_asked_of_both_at_once_is_two_events() {
    let mut wheels = Wheels::new(&sixteen_turns());
    let frame = [0x84, 0x01, 0x7C, 0xFE, 0, 0, 0, 0];
    let events: Vec<_> = wheels.receive(&received(5.0, 0x280, frame)).collect();
    let asked = |motor| MotorEvent::Asked { motor, time: at_ms(5.0), current_a: 388.0 * 33.0 / 4096.0 };
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
        let [MotorEvent::Acknowledged { motor: Motor::Left, command, .. }] = events[..] else {
            panic!("{events:?}")
        };
        assert_eq!(command, echo[0]);
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
    let MotorEvent::Asked { motor: Motor::Left, current_a, .. } = event else { panic!("{event:?}") };
    assert!((current_a - 200.0 * 33.0 / 4096.0).abs() < 1e-12, "{current_a} A");
    assert_eq!(asked(&mut replayed, &together), 2);
    // What follows is its reply, and no command of somebody else.
    let reply = reply(0xA1, state(30, 200, 10, 77));
    let told: Vec<_> = replayed.receive(&received(2.2, 0x141, reply)).collect();
    assert!(matches!(told[..], [MotorEvent::State(Motor::Left, _)]), "{told:?}");
}
