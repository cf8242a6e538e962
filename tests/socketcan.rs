//! Real CAN interfaces. Without them the tests are skipped and reported, and fail if `FLQR_REQUIRE_CAN` is set.
//! They need `vcan0` and `vcan1`, up, and nobody else on them.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "../src/core/tests/shared/skip.rs"]
mod skip;

use std::env;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use flqr_core::device::{self, BusHealth, BusPair, Clock, OpenError, SocketCan, Source, open_bus};
use flqr_core::link::{Bus, BusError, Direction, Frame, FrameId, StampedFrame};

/// One test at a time on the wire.
static WIRE: Mutex<()> = Mutex::new(());

/// The wire, if this machine has one.
fn wire() -> Option<MutexGuard<'static, ()>> {
    let found = device::interfaces().can;
    if found.iter().filter(|can| can.up && ["vcan0", "vcan1"].contains(&can.name.as_str())).count() < 2 {
        assert!(env::var_os("FLQR_REQUIRE_CAN").is_none(), "vcan0 and vcan1 are not up: {found:?}");
        skip::report_skipped("set up vcan0 and vcan1: ip link add vcan0 type vcan && ip link set vcan0 up");
        return None;
    }
    Some(WIRE.lock().unwrap_or_else(PoisonError::into_inner))
}

fn open(interface: &str, listen_only: bool, clock: &Clock) -> Result<BusPair, OpenError> {
    open_bus(&Source::Can { interface: interface.to_owned() }, listen_only, clock)
}

fn frames(count: u32) -> Vec<Frame> {
    let numbered = |number: u32| {
        let bytes = number.to_le_bytes();
        let standard = FrameId::standard((number % 0x800) as u16).unwrap();
        let extended = FrameId::extended(0x1FFF_FFFF - number).unwrap();
        match number % 5 {
            0 => Frame::data(standard, &bytes[..(number / 5 % 5) as usize]),
            1 => Frame::data(extended, &bytes),
            2 => Frame::remote(standard, (number % 9) as u8),
            3 => Frame::remote(extended, 8),
            _ => Some(Frame::full(standard, number.to_le_bytes().repeat(2).try_into().unwrap())),
        }
    };
    (0..count).map(|number| numbered(number).unwrap()).collect()
}

/// All that comes until nothing has come for a while.
fn drain(bus: &mut dyn Bus, clock: &Clock, quiet: Duration) -> Vec<StampedFrame> {
    let mut found = Vec::new();
    let mut newest = clock.now();
    while clock.now() < newest + quiet {
        bus.wait(Duration::from_millis(10)).unwrap();
        while let Some(frame) = bus.receive(clock.now()).unwrap() {
            found.push(frame);
            newest = clock.now();
        }
    }
    found
}

fn send_all(bus: &mut dyn Bus, clock: &Clock, frames: &[Frame]) {
    for frame in frames {
        while let Err(error) = bus.send(clock.now(), frame) {
            assert!(matches!(error, BusError::Full { .. }), "{error}");
            clock.sleep_until(clock.now() + Duration::from_millis(1));
        }
    }
}

const QUIET: Duration = Duration::from_millis(300);

#[test]
fn frames_of_every_sort_pass_both_ways_in_order_and_stamped() {
    let Some(_wire) = wire() else { return };
    let clock = Clock::start();
    let mut near = open("vcan0", false, &clock).unwrap();
    let mut far = open("vcan0", false, &clock).unwrap();
    let frames = frames(200);
    for _ in 0..2 {
        let began = clock.now();
        send_all(near.writer.as_mut().unwrap().as_mut(), &clock, &frames);
        let found = drain(far.reader.as_mut(), &clock, QUIET);
        assert_eq!(found.iter().map(|stamped| stamped.frame).collect::<Vec<_>>(), frames);
        assert!(found.is_sorted_by_key(|stamped| stamped.time));
        assert!(found.iter().all(|stamped| stamped.direction == Direction::Received));
        assert!(
            found[0].time >= began.saturating_sub(Duration::from_millis(20)) && found[0].time <= clock.now()
        );
        // The sender's own reading half hears nothing of it.
        assert_eq!(drain(near.reader.as_mut(), &clock, QUIET), []);
        std::mem::swap(&mut near, &mut far);
    }
    assert_eq!((near.health.dropped(), far.health.dropped()), (0, 0));
}

#[test]
fn a_listening_bus_has_no_sending_half_and_its_reading_half_refuses() {
    let Some(_wire) = wire() else { return };
    let clock = Clock::start();
    let mut witness = open("vcan1", true, &clock).unwrap();
    let mut listening = open("vcan1", true, &clock).unwrap();
    assert!(listening.writer.is_none());
    let refused = listening.reader.send(clock.now(), &frames(1)[0]);
    assert_eq!(refused, Err(BusError::ListensOnly { name: "vcan1".to_owned() }));
    assert_eq!(drain(witness.reader.as_mut(), &clock, QUIET), []);
}

#[test]
fn every_frame_that_the_kernel_drops_is_counted() {
    let Some(_wire) = wire() else { return };
    let clock = Clock::start();
    let health = Arc::new(BusHealth::default());
    let mut small = SocketCan::open("vcan0", true, Arc::clone(&health)).unwrap();
    small.set_receive_buffer(4096).unwrap();
    let mut sender = open("vcan0", false, &clock).unwrap();
    let mut seen = 0;
    for _ in 0..5 {
        send_all(sender.writer.as_mut().unwrap().as_mut(), &clock, &frames(1000));
        seen += drain(&mut small, &clock, QUIET).len() as u64;
    }
    assert!(health.dropped() > 0 && seen > 0, "{} dropped, {seen} seen", health.dropped());
    assert_eq!(seen + health.dropped(), 5000);
}

#[test]
fn what_cannot_be_opened_is_named_with_its_mend() {
    let Some(_wire) = wire() else { return };
    let clock = Clock::start();
    let missing = open("can77", true, &clock).err().unwrap();
    assert!(
        matches!(&missing, OpenError::NoInterface { present, .. } if present.contains("vcan0")),
        "{missing}"
    );
    let other = open("lo", true, &clock).err().unwrap();
    assert!(matches!(&other, OpenError::NotCan { .. }), "{other}");
}

#[test]
fn interfaces_are_listed_with_their_counts() {
    let Some(_wire) = wire() else { return };
    let clock = Clock::start();
    let count = |name: &str| {
        let can = device::interfaces().can.into_iter().find(|can| can.name == name).unwrap();
        assert!(can.up && can.is_virtual && can.command.is_none());
        can.sent
    };
    let before = count("vcan1");
    let mut bus = open("vcan1", false, &clock).unwrap();
    send_all(bus.writer.as_mut().unwrap().as_mut(), &clock, &frames(10));
    assert_eq!(count("vcan1"), before + 10);
}

/// Needs leave to take an interface down, which the guest's root has.
#[test]
fn an_interface_that_goes_down_and_up_again_resumes_by_itself() {
    let Some(_wire) = wire() else { return };
    let set = |state: &str| {
        let done = std::process::Command::new("ip").args(["link", "set", "vcan1", state]).status();
        done.is_ok_and(|status| status.success())
    };
    let clock = Clock::start();
    let mut bus = open("vcan1", false, &clock).unwrap();
    if !set("down") {
        assert!(env::var_os("FLQR_REQUIRE_CAN").is_none(), "vcan1 cannot be taken down");
        skip::report_skipped("run it as root, which may set vcan1 down");
        return;
    }
    let down = open("vcan1", true, &clock).err().unwrap();
    assert!(
        matches!(&down, OpenError::Down { command, .. } if command == "sudo ip link set vcan1 up"),
        "{down}"
    );
    bus.reader.wait(Duration::from_secs(1)).unwrap();
    let lost = bus.reader.receive(clock.now());
    assert!(matches!(lost, Err(BusError::Gone { .. })), "{lost:?}");
    assert!(bus.health.lost().is_some());
    let unsent = bus.writer.as_mut().unwrap().send(clock.now(), &frames(1)[0]);
    assert!(matches!(unsent, Err(BusError::Gone { .. })), "{unsent:?}");
    assert!(set("up"));
    while bus.health.lost().is_some() && clock.now() < Duration::from_secs(60) {
        bus.reader.wait(Duration::from_millis(50)).unwrap();
        assert_eq!(bus.reader.receive(clock.now()), Ok(None));
    }
    assert_eq!((bus.health.lost(), bus.health.reconnects()), (None, 1));
    let mut far = open("vcan1", false, &clock).unwrap();
    send_all(far.writer.as_mut().unwrap().as_mut(), &clock, &frames(3));
    assert_eq!(drain(bus.reader.as_mut(), &clock, QUIET).len(), 3);
    send_all(bus.writer.as_mut().unwrap().as_mut(), &clock, &frames(3));
    assert_eq!(drain(far.reader.as_mut(), &clock, QUIET).len(), 3);
}
