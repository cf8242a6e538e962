//! The threads of a real link: frames in, bytes of the IMU in, frames out. The control loop never waits for
//! any of them.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crate::device::stop::StopLine;
use crate::device::{BusHealth, BusPair, BusState, Clock, ImuPort, hurry};
use crate::link::{Bus, Direction, Frame, StampedFrame};

/// Longest time that a thread waits before it looks whether it is to end.
const WAIT: Duration = Duration::from_millis(50);
/// Pause after an error of the bus.
const AFTER_ERROR: Duration = Duration::from_millis(100);
/// Frames that wait for the control loop at most; beyond it has stopped taking them.
const INBOX_FRAMES: usize = 200_000;
/// Bytes of the IMU that wait for it at most: a minute.
const INBOX_BYTES: usize = 1 << 19;
/// Frames that wait for being sent: some 20 ms of a driven robot.
const OUTBOX_FRAMES: usize = 64;
/// Time without a frame to send after which the sending thread looks whether a requested stop was obeyed.
const HEARTBEAT: Duration = Duration::from_millis(10);
/// After so many heartbeats without a frame to send, the control loop of motors with torque is taken as dead, and the
/// motors are switched off; again after as long, until it says that they are off.
const DEAD_AFTER: u32 = 10;
/// Times that the motors are switched off where the control loop has ended without doing so, and the pause between.
const LAST_TRIES: u32 = 5;
const LAST_PAUSE: Duration = Duration::from_millis(5);
/// Frames in a row that were not sent, from which on the bus counts as down: 10 ms of a driven robot.
const REFUSED_IN_A_ROW: u64 = 20;

/// What has come since it was last taken.
#[derive(Default)]
pub(super) struct Inbox {
    /// Frames that were written to the bus, with the time of it.
    pub(super) sent: Vec<StampedFrame>,
    pub(super) frames: Vec<StampedFrame>,
    pub(super) imu: ImuChunks,
    /// Frames that did not fit.
    pub(super) lost: u64,
}

impl Inbox {
    pub(super) fn clear(&mut self) {
        self.sent.clear();
        self.frames.clear();
        self.imu.clear();
        self.lost = 0;
    }
}

/// Bytes of the IMU with the times at which they were read, in one piece of memory that is kept.
#[derive(Default)]
pub(super) struct ImuChunks {
    bytes: Vec<u8>,
    /// When each chunk was read, and where it ends.
    ends: Vec<(Duration, usize)>,
}

impl ImuChunks {
    pub(super) fn push(&mut self, time: Duration, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
        self.ends.push((time, self.bytes.len()));
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (Duration, &[u8])> {
        let mut start = 0;
        self.ends.iter().map(move |&(time, end)| (time, &self.bytes[std::mem::replace(&mut start, end)..end]))
    }

    fn clear(&mut self) {
        self.bytes.clear();
        self.ends.clear();
    }
}

/// What the threads share.
#[derive(Default)]
struct Shared {
    inbox: Mutex<Inbox>,
    /// Frames that were written to the bus since they were last taken.
    sent: Mutex<Vec<StampedFrame>>,
    imu_problem: Mutex<Option<String>>,
    /// Frames that the sending thread has taken from its queue, sent or not.
    handled: AtomicU64,
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

/// Frames that were handed to the sending thread, and since when the oldest one waits.
#[derive(Default)]
struct Backlog {
    handed: u64,
    newest_at: Duration,
    /// Number of a frame that had not been sent when it was looked at, and when it was handed over.
    waiting: (u64, Duration),
}

impl Backlog {
    fn hand_over(&mut self, now: Duration, handled: u64) {
        if handled == self.handed {
            self.waiting = (self.handed + 1, now);
        }
        self.handed += 1;
        self.newest_at = now;
    }

    /// For how long a frame has been waiting for the sending thread.
    fn age(&mut self, now: Duration, handled: u64) -> Duration {
        if handled >= self.handed {
            return Duration::ZERO;
        }
        if handled >= self.waiting.0 {
            self.waiting = (self.handed, self.newest_at);
        }
        now.saturating_sub(self.waiting.1)
    }
}

/// A real link in operation.
pub(super) struct Wire {
    shared: Arc<Shared>,
    health: Arc<BusHealth>,
    outbox: Option<SyncSender<Outgoing>>,
    backlog: Backlog,
    sender: Option<JoinHandle<()>>,
    readers: Vec<JoinHandle<()>>,
}

impl Wire {
    /// Starts the threads. Without a writer nothing can ever be sent. `farewell` switches the motors off; the
    /// sending thread does so by itself where the control loop no longer hands it anything, or does not obey a request
    /// on `stop_line`.
    pub(super) fn start(
        clock: Clock,
        bus: BusPair,
        imu: Option<ImuPort>,
        farewell: Vec<Frame>,
        stop_line: Arc<StopLine>,
    ) -> std::io::Result<Self> {
        let BusPair { reader, writer, health } = bus;
        let shared = Arc::new(Shared::default());
        let mut wire = Self {
            shared: Arc::clone(&shared),
            health,
            outbox: None,
            backlog: Backlog::default(),
            sender: None,
            readers: Vec::new(),
        };
        let of_reader = Arc::clone(&shared);
        wire.readers.push(spawn("can-in", move || read_bus(reader, &clock, &of_reader))?);
        if let Some(port) = imu {
            let of_imu = Arc::clone(&shared);
            wire.readers.push(spawn("imu-in", move || read_imu(port, &clock, &of_imu))?);
        }
        if let Some(writer) = writer {
            let (outbox, frames) = sync_channel(OUTBOX_FRAMES);
            let sender = Sender { writer, clock, shared, farewell, stop_line };
            wire.sender = Some(spawn("can-out", move || sender.work(&frames))?);
            wire.outbox = Some(outbox);
        }
        Ok(wire)
    }

    /// Takes what has come and what was sent; `into` is emptied first.
    pub(super) fn collect(&self, into: &mut Inbox) {
        into.clear();
        std::mem::swap(into, &mut locked(&self.shared.inbox));
        // After the replies, so that the command of each of them is among these or was taken before.
        std::mem::swap(&mut into.sent, &mut locked(&self.shared.sent));
    }

    /// Hands a frame to the sending thread; `false` where its queue is full.
    pub(super) fn send(&mut self, now: Duration, frame: Frame) -> bool {
        let outgoing = Outgoing { stops: self.shared.stops.load(Ordering::Acquire), frame };
        let handled = self.shared.handled.load(Ordering::Acquire);
        let taken = self.outbox.as_ref().is_some_and(|outbox| outbox.try_send(outgoing).is_ok());
        if taken {
            self.backlog.hand_over(now, handled);
        } else {
            self.shared.refused.fetch_add(1, Ordering::Relaxed);
        }
        taken
    }

    /// For how long a frame has been waiting to be sent, because the sending thread comes late.
    pub(super) fn backlog(&mut self, now: Duration) -> Duration {
        self.backlog.age(now, self.shared.handled.load(Ordering::Acquire))
    }

    /// Tells the sending thread whether the motors may have torque.
    pub(super) fn set_hot(&self, hot: bool) {
        self.shared.hot.store(hot, Ordering::Release);
    }

    /// Frames that still wait are not sent any more: the robot is stopped.
    pub(super) fn forget_waiting(&self) {
        self.shared.stops.fetch_add(1, Ordering::AcqRel);
    }

    /// Sends what waits, and nothing from then on. [`Wire::collect`] then gives the last frames.
    pub(super) fn finish_sending(&mut self) {
        self.outbox = None;
        if let Some(sender) = self.sender.take() {
            join(sender);
        }
    }

    /// Why the bus does not work just now.
    pub(super) fn problem(&self) -> Option<String> {
        self.health.lost().or_else(|| match self.health.state() {
            BusState::BusOff => Some("bus off: check wiring, termination and bit rate".to_owned()),
            _ if self.shared.refused.load(Ordering::Relaxed) < REFUSED_IN_A_ROW => None,
            _ => Some("the bus accepts no more frames: no node acknowledges them".to_owned()),
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
        // Only once the sending thread has ended is the bus closed.
        self.finish_sending();
        self.shared.ends.store(true, Ordering::Relaxed);
        self.readers.drain(..).for_each(join);
    }
}

fn join(thread: JoinHandle<()>) {
    // One that panicked has ended as well.
    thread.join().unwrap_or(());
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
                    if inbox.imu.bytes.len() < INBOX_BYTES {
                        inbox.imu.push(clock.now(), &bytes[..count]);
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

/// Whether a control loop that has handed over nothing for so many heartbeats is to be taken as hanging just now.
fn hangs(stop_is_pending: bool, heartbeats: u32) -> bool {
    stop_is_pending || heartbeats.is_multiple_of(DEAD_AFTER)
}

/// The sending thread: the only one that ever writes to the bus.
struct Sender {
    writer: Box<dyn Bus>,
    clock: Clock,
    shared: Arc<Shared>,
    farewell: Vec<Frame>,
    stop_line: Arc<StopLine>,
}

impl Sender {
    fn work(mut self, outgoing: &Receiver<Outgoing>) {
        let mut heartbeats = 0;
        loop {
            match outgoing.recv_timeout(HEARTBEAT) {
                Ok(Outgoing { stops, frame }) => {
                    heartbeats = 0;
                    // Frames from before a stop are dropped.
                    if stops == self.shared.stops.load(Ordering::Acquire) {
                        self.send(&frame);
                    }
                    self.shared.handled.fetch_add(1, Ordering::AcqRel);
                }
                Err(RecvTimeoutError::Timeout) => {
                    heartbeats += 1;
                    if self.is_hot() && hangs(self.stop_line.pending().is_some(), heartbeats) {
                        self.switch_off();
                    }
                }
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
        let time = self.clock.now();
        match self.writer.send(time, frame) {
            Ok(()) => {
                self.shared.refused.store(0, Ordering::Relaxed);
                let mut sent = locked(&self.shared.sent);
                if sent.len() < INBOX_FRAMES {
                    sent.push(StampedFrame { time, direction: Direction::Sent, frame: *frame });
                }
            }
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
mod tests;
