//! The threads of a real link: frames in, bytes of the IMU in, frames out. The control loop never waits for
//! any of them.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crate::device::{BusHealth, BusPair, BusState, Clock, ImuPort};
use crate::link::{Bus, Frame, StampedFrame};

/// Longest time that a thread waits before it looks whether it is to end.
const WAIT: Duration = Duration::from_millis(50);
/// Pause after an error of the bus.
const AFTER_ERROR: Duration = Duration::from_millis(100);
/// Frames that wait for the control loop at most; beyond it has stopped taking them.
const INBOX_FRAMES: usize = 200_000;
/// Frames that wait for being sent: 10 ms of a driven robot.
const OUTBOX_FRAMES: usize = 64;
/// After this time without a frame to send, a driven robot's control loop is taken as dead.
const CONTROL_TIMEOUT: Duration = Duration::from_millis(100);
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
    ends: AtomicBool,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A thread that panicked has left data that are whole: each is changed by a single call.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What goes to the thread that sends.
enum Outgoing {
    Frame(Frame),
    /// From here on the motors have torque, or not any more.
    Driving(bool),
}

/// A real link in operation.
pub(super) struct Wire {
    shared: Arc<Shared>,
    health: Arc<BusHealth>,
    outbox: Option<SyncSender<Outgoing>>,
    threads: Vec<JoinHandle<()>>,
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
        let mut wire = Self { shared: Arc::clone(&shared), health, outbox: None, threads: Vec::new() };
        let of_reader = Arc::clone(&shared);
        wire.spawn("can-in", move || read_bus(reader, &clock, &of_reader))?;
        if let Some(port) = imu {
            let of_imu = Arc::clone(&shared);
            wire.spawn("imu-in", move || read_imu(port, &clock, &of_imu))?;
        }
        if let Some(writer) = writer {
            let (outbox, frames) = sync_channel(OUTBOX_FRAMES);
            let sender = Sender { writer, clock, shared, farewell };
            wire.spawn("can-out", move || sender.work(&frames))?;
            wire.outbox = Some(outbox);
        }
        Ok(wire)
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
        self.threads.push(Builder::new().name(name.to_owned()).spawn(work)?);
        Ok(())
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
        self.hand_over(Outgoing::Frame(frame))
    }

    /// Tells the sending thread whether the motors have torque.
    pub(super) fn note_driving(&self, driving: bool) -> bool {
        self.hand_over(Outgoing::Driving(driving))
    }

    fn hand_over(&self, outgoing: Outgoing) -> bool {
        let taken = self.outbox.as_ref().is_some_and(|outbox| outbox.try_send(outgoing).is_ok());
        if !taken {
            self.shared.refused.fetch_add(1, Ordering::Relaxed);
        }
        taken
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
        // The sending thread ends once it has sent what is left.
        self.outbox = None;
        self.shared.ends.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // One that panicked has ended as well.
            thread.join().unwrap_or(());
        }
    }
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
                    locked(&shared.inbox).imu.push((clock.now(), bytes[..count].to_vec()));
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
        let mut driving = false;
        loop {
            match outgoing.recv_timeout(CONTROL_TIMEOUT) {
                Ok(Outgoing::Frame(frame)) => self.send(&frame),
                Ok(Outgoing::Driving(now)) => driving = now,
                Err(RecvTimeoutError::Timeout) => {
                    if std::mem::take(&mut driving) {
                        self.switch_off();
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    if driving {
                        self.switch_off();
                    }
                    return;
                }
            }
        }
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
