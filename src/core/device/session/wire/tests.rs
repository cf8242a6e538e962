use super::*;
use crate::link::{BusError, FrameId};

/// Lets the test hold the sending thread in the middle of a frame.
#[derive(Clone, Default)]
struct Held {
    gate: Arc<Mutex<()>>,
    sent: Arc<Mutex<Vec<u8>>>,
}

impl Bus for Held {
    fn send(&mut self, _: Duration, frame: &Frame) -> Result<(), BusError> {
        locked(&self.sent).push(frame.bytes()[0]);
        drop(locked(&self.gate));
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> Result<Option<StampedFrame>, BusError> {
        Ok(None)
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        std::thread::sleep(Duration::from_millis(1));
        Ok(())
    }
}

fn frame(first: u8) -> Frame {
    Frame::full(FrameId::Standard(0x141), [first, 0, 0, 0, 0, 0, 0, 0])
}

fn wire(bus: &Held) -> Wire {
    wire_and_stop_line(bus).0
}

fn wire_and_stop_line(bus: &Held) -> (Wire, Arc<StopLine>) {
    let health = Arc::new(BusHealth::default());
    let pair = BusPair { reader: Box::new(bus.clone()), writer: Some(Box::new(bus.clone())), health };
    let line = StopLine::register();
    (Wire::start(Clock::start(), pair, None, vec![frame(0x80)], Arc::clone(&line)).unwrap(), line)
}

/// What the wire has given out as sent, first bytes.
fn reported(wire: &Wire) -> Vec<u8> {
    let mut inbox = Inbox::default();
    wire.collect(&mut inbox);
    assert!(inbox.sent.iter().all(|sent| sent.direction == Direction::Sent));
    inbox.sent.iter().map(|sent| sent.frame.bytes()[0]).collect()
}

#[test]
fn torques_from_before_a_stop_are_not_sent_after_it() {
    let bus = Held::default();
    let gate = locked(&bus.gate);
    let mut wire = wire(&bus);
    for torque in 1..=5 {
        assert!(wire.send(Duration::ZERO, frame(torque)));
    }
    while locked(&bus.sent).is_empty() {
        std::thread::yield_now();
    }
    wire.forget_waiting();
    assert!(wire.send(Duration::ZERO, frame(0x81)));
    assert!(wire.backlog(Duration::from_millis(7)) == Duration::from_millis(7));
    assert_eq!(reported(&wire), [0; 0], "a frame in the middle of its write has not been sent");
    drop(gate);
    wire.finish_sending();
    assert_eq!(*locked(&bus.sent), [1, 0x81]);
    assert_eq!(reported(&wire), [1, 0x81]);
    assert_eq!(wire.backlog(Duration::from_millis(7)), Duration::ZERO);
}

#[test]
fn motors_with_torque_are_switched_off_at_the_end_and_others_are_left_alone() {
    for (hot, expected) in [(true, vec![0x80; LAST_TRIES as usize]), (false, vec![])] {
        let bus = Held::default();
        let mut wire = wire(&bus);
        wire.set_hot(hot);
        wire.finish_sending();
        assert_eq!(*locked(&bus.sent), expected);
        assert_eq!(reported(&wire), expected, "the last frames are reported too");
    }
}

#[test]
fn where_the_control_loop_hangs_motors_with_torque_are_switched_off_again_and_again() {
    let bus = Held::default();
    let wire = wire(&bus);
    wire.set_hot(true);
    while locked(&bus.sent).len() < 2 {
        std::thread::yield_now();
    }
    wire.set_hot(false);
    drop(wire);
    assert!(locked(&bus.sent).iter().all(|first| *first == 0x80));
}

#[test]
fn a_requested_stop_is_not_left_to_a_control_loop_that_hangs() {
    let bus = Held::default();
    let (wire, line) = wire_and_stop_line(&bus);
    wire.set_hot(true);
    line.request();
    while locked(&bus.sent).is_empty() {
        std::thread::yield_now();
    }
    wire.set_hot(false);
    // One heartbeat without a frame, where a loop that nobody stops has ten.
    let switched_off = [1, 2, 9, 10, 11, 20].map(|heartbeats| [true, false].map(|p| hangs(p, heartbeats)));
    let [stopped, alone] = [0, 1].map(|pending| switched_off.map(|pair| pair[pending]));
    assert_eq!(stopped, [true; 6]);
    assert_eq!(alone, [false, false, false, true, false, true]);
}

#[test]
fn a_frame_that_was_not_written_is_not_reported_as_sent() {
    /// Takes every second frame.
    struct Lossy(Held, bool);
    impl Bus for Lossy {
        fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError> {
            self.1 = !self.1;
            if self.1 { self.0.send(now, frame) } else { Err(BusError::Full { name: "cut".to_owned() }) }
        }

        fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
            self.0.receive(now)
        }

        fn wait(&mut self, timeout: Duration) -> Result<(), BusError> {
            self.0.wait(timeout)
        }
    }
    let bus = Held::default();
    let pair = BusPair {
        reader: Box::new(bus.clone()),
        writer: Some(Box::new(Lossy(bus.clone(), false))),
        health: Arc::default(),
    };
    let mut wire = Wire::start(Clock::start(), pair, None, Vec::new(), StopLine::register()).unwrap();
    for number in 0..10 {
        assert!(wire.send(Duration::ZERO, frame(number)));
    }
    wire.finish_sending();
    assert_eq!(*locked(&bus.sent), [0, 2, 4, 6, 8]);
    assert_eq!(reported(&wire), [0, 2, 4, 6, 8]);
}

#[test]
fn a_backlog_is_as_old_as_its_oldest_frame_within_one_look() {
    let ms = Duration::from_millis;
    let mut backlog = Backlog::default();
    assert_eq!(backlog.age(ms(5), 0), ms(0));
    for time in 10..=20 {
        backlog.hand_over(ms(time), 0);
    }
    assert_eq!(backlog.age(ms(25), 0), ms(15));
    // The oldest one was sent: all that is known of the others is that the newest one waits.
    assert_eq!(backlog.age(ms(25), 1), ms(5));
    assert_eq!(backlog.age(ms(26), 11), ms(0));
    backlog.hand_over(ms(30), 11);
    assert_eq!(backlog.age(ms(31), 11), ms(1));
}
