//! The threads of a real link: frames in, bytes of the IMU in, frames out. The control loop never waits for
//! any of them.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crate::device::{BusHealth, BusPair, BusState, Clock, ImuPort, hurry};
use crate::link::{Bus, Frame, StampedFrame};

/// Longest time that a thread waits before it looks whether it is to end.
const WAIT: Duration = Duration::from_millis(50);
/// Pause after an error of the bus.
const AFTER_ERROR: Duration = Duration::from_millis(100);
/// Frames that wait for the control loop at most; beyond it has stopped taking them.
const INBOX_FRAMES: usize = 200_000;
/// Chunks of the IMU's bytes that wait for it at most.
const INBOX_CHUNKS: usize = 20_000;
/// Frames that wait for being sent: some 20 ms of a driven robot.
const OUTBOX_FRAMES: usize = 64;
/// After this time without a frame to send, the control loop of motors with torque is taken as dead, and the motors
/// are switched off; again after as long, until it says that they are off.
const CONTROL_TIMEOUT: Duration = Duration::from_millis(100);
/// Times that the motors are switched off where the control loop has ended without doing so, and the pause between.
const LAST_TRIES: u32 = 5;
const LAST_PAUSE: Duration = Duration::from_millis(5);
/// Frames in a row that were not sent, from which on the bus counts as down: 10 ms of a driven robot.
const REFUSED_IN_A_ROW: u64 = 20;

/// What has come since it was last taken.
#[derive(Default)]
pub(super) struct Inbox {
    pub(super) frames: Vec<StampedFrame>,
    /// Bytes of the IMU with the time at which they were read.
    pub(super) imu: Vec<(Duration, Vec<u8>)>,
    /// Frames that did not fit.
    pub(super) lost: u64,
}

/// What the threads share.
#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    imu_problem: Mutex<Option<String>>,
    /// Frames in a row that were not sent.
    refused: AtomicU64,
    /// Whether the motors may have torque.
    hot: AtomicBool,
    /// Stops so far: frames from before the last one are not sent any more.
    stops: AtomicU64,
    ends: AtomicBool,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A thread that panicked has left data that are whole: each is changed by a single call.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A frame for the thread that sends, and the stops before it.
struct Outgoing {
    stops: u64,
    frame: Frame,
}

/// A real link in operation.
pub(super) struct Wire {
    shared: Arc<Shared>,
    health: Arc<BusHealth>,
    outbox: Option<SyncSender<Outgoing>>,
    sender: Option<JoinHandle<()>>,
    readers: Vec<JoinHandle<()>>,
}

impl Wire {
    /// Starts the threads. Without a writer nothing can ever be sent. `farewell` switches the motors off; the
    /// sending thread does so by itself where the control loop no longer hands it anything.
    pub(super) fn start(
        clock: Clock,
        bus: BusPair,
        imu: Option<ImuPort>,
        farewell: Vec<Frame>,
    ) -> std::io::Result<Self> {
        let BusPair { reader, writer, health } = bus;
        let shared = Arc::new(Shared::default());
        let mut wire =
            Self { shared: Arc::clone(&shared), health, outbox: None, sender: None, readers: Vec::new() };
        let of_reader = Arc::clone(&shared);
        wire.readers.push(spawn("can-in", move || read_bus(reader, &clock, &of_reader))?);
        if let Some(port) = imu {
            let of_imu = Arc::clone(&shared);
            wire.readers.push(spawn("imu-in", move || read_imu(port, &clock, &of_imu))?);
        }
        if let Some(writer) = writer {
            let (outbox, frames) = sync_channel(OUTBOX_FRAMES);
            let sender = Sender { writer, clock, shared, farewell };
            wire.sender = Some(spawn("can-out", move || sender.work(&frames))?);
            wire.outbox = Some(outbox);
        }
        Ok(wire)
    }

    /// Takes what has come; `into` is emptied first.
    pub(super) fn collect(&self, into: &mut Inbox) {
        into.frames.clear();
        into.imu.clear();
        into.lost = 0;
        std::mem::swap(into, &mut locked(&self.shared.inbox));
    }

    /// Hands a frame to the sending thread; `false` where its queue is full.
    pub(super) fn send(&self, frame: Frame) -> bool {
        let outgoing = Outgoing { stops: self.shared.stops.load(Ordering::Acquire), frame };
        let taken = self.outbox.as_ref().is_some_and(|outbox| outbox.try_send(outgoing).is_ok());
        if !taken {
            self.shared.refused.fetch_add(1, Ordering::Relaxed);
        }
        taken
    }

    /// Tells the sending thread whether the motors may have torque.
    pub(super) fn set_hot(&self, hot: bool) {
        self.shared.hot.store(hot, Ordering::Release);
    }

    /// Frames that still wait are not sent any more: the robot is stopped.
    pub(super) fn forget_waiting(&self) {
        self.shared.stops.fetch_add(1, Ordering::AcqRel);
    }

    /// Why the bus does not work just now.
    pub(super) fn problem(&self) -> Option<String> {
        self.health.lost().or_else(|| match self.health.state() {
            BusState::BusOff => Some("bus off: look at wiring, termination and bit rate".to_owned()),
            _ if self.shared.refused.load(Ordering::Relaxed) < REFUSED_IN_A_ROW => None,
            _ => Some("the bus takes no more frames: nobody on it acknowledges them".to_owned()),
        })
    }

    /// Why the IMU's port does not work just now.
    pub(super) fn imu_problem(&self) -> Option<String> {
        locked(&self.shared.imu_problem).clone()
    }

    /// How the bus stands.
    pub(super) fn health(&self) -> &BusHealth {
        &self.health
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        // The sending thread ends once it has sent what is left; only then is the bus closed.
        self.outbox = None;
        let join = |thread: JoinHandle<()>| {
            // One that panicked has ended as well.
            thread.join().unwrap_or(());
        };
        self.sender.take().map(join);
        self.shared.ends.store(true, Ordering::Relaxed);
        self.readers.drain(..).for_each(join);
    }
}

/// A thread that is as urgent as the control loop's.
fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<JoinHandle<()>> {
    Builder::new().name(name.to_owned()).spawn(move || {
        // What the system allows the control loop is told of that one.
        hurry();
        work();
    })
}

fn read_bus(mut bus: Box<dyn Bus>, clock: &Clock, shared: &Shared) {
    let mut frames = Vec::new();
    while !shared.ends.load(Ordering::Relaxed) {
        let read = bus.wait(WAIT).and_then(|()| {
            while let Some(frame) = bus.receive(clock.now())? {
                frames.push(frame);
            }
            Ok(())
        });
        if !frames.is_empty() {
            let mut inbox = locked(&shared.inbox);
            let room = INBOX_FRAMES.saturating_sub(inbox.frames.len());
            inbox.lost += frames.len().saturating_sub(room) as u64;
            frames.truncate(room);
            inbox.frames.append(&mut frames);
        }
        // Why is in the bus's health; it comes back by itself.
        if read.is_err() {
            std::thread::sleep(AFTER_ERROR);
        }
    }
}

fn read_imu(mut port: ImuPort, clock: &Clock, shared: &Shared) {
    let mut bytes = [0; 1024];
    while !shared.ends.load(Ordering::Relaxed) {
        match port.read(&mut bytes) {
            Ok(count) => {
                if count > 0 {
                    let mut inbox = locked(&shared.inbox);
                    if inbox.imu.len() < INBOX_CHUNKS {
                        inbox.imu.push((clock.now(), bytes[..count].to_vec()));
                    } else {
                        inbox.lost += 1;
                    }
                }
                locked(&shared.imu_problem).take();
            }
            Err(error) => {
                *locked(&shared.imu_problem) = Some(error.to_string());
                std::thread::sleep(AFTER_ERROR);
            }
        }
    }
}

/// The sending thread: the only one that ever writes to the bus.
struct Sender {
    writer: Box<dyn Bus>,
    clock: Clock,
    shared: Arc<Shared>,
    farewell: Vec<Frame>,
}

impl Sender {
    fn work(mut self, outgoing: &Receiver<Outgoing>) {
        loop {
            match outgoing.recv_timeout(CONTROL_TIMEOUT) {
                Ok(Outgoing { stops, frame }) if stops == self.shared.stops.load(Ordering::Acquire) => {
                    self.send(&frame);
                }
                // From before a stop.
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout) if self.is_hot() => self.switch_off(),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        for _ in 0..if self.is_hot() { LAST_TRIES } else { 0 } {
            self.switch_off();
            std::thread::sleep(LAST_PAUSE);
        }
    }

    fn is_hot(&self) -> bool {
        self.shared.hot.load(Ordering::Acquire)
    }

    fn send(&mut self, frame: &Frame) {
        match self.writer.send(self.clock.now(), frame) {
            Ok(()) => self.shared.refused.store(0, Ordering::Relaxed),
            Err(_) => {
                self.shared.refused.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    fn switch_off(&mut self) {
        for frame in std::mem::take(&mut self.farewell) {
            self.send(&frame);
            self.farewell.push(frame);
        }
    }
}

#[cfg(test)]
mod tests {
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
        let health = Arc::new(BusHealth::default());
        let pair = BusPair { reader: Box::new(bus.clone()), writer: Some(Box::new(bus.clone())), health };
        Wire::start(Clock::start(), pair, None, vec![frame(0x80)]).unwrap()
    }

    #[test]
    fn torques_from_before_a_stop_are_not_sent_after_it() {
        let bus = Held::default();
        let gate = locked(&bus.gate);
        let wire = wire(&bus);
        for torque in 1..=5 {
            assert!(wire.send(frame(torque)));
        }
        while locked(&bus.sent).is_empty() {
            std::thread::yield_now();
        }
        wire.forget_waiting();
        assert!(wire.send(frame(0x81)));
        drop(gate);
        drop(wire);
        assert_eq!(*locked(&bus.sent), [1, 0x81]);
    }

    #[test]
    fn motors_with_torque_are_switched_off_at_the_end_and_others_are_left_alone() {
        for (hot, expected) in [(true, vec![0x80; LAST_TRIES as usize]), (false, vec![])] {
            let bus = Held::default();
            let wire = wire(&bus);
            wire.set_hot(hot);
            drop(wire);
            assert_eq!(*locked(&bus.sent), expected);
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
}
