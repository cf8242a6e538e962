//! A bus that vanishes is looked for until it is back.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use super::bus_health::BusHealth;
use super::clock::Clock;
use super::open_error::OpenError;
use super::retry::Retry;
use crate::link::{Bus, BusError, Frame, StampedFrame};

/// A bus just opened: one half for the thread that reads, and one for the thread that sends, if any may.
pub(super) struct Halves {
    pub(super) reader: Box<dyn Bus>,
    pub(super) writer: Option<Box<dyn Bus>>,
}

/// Opens the bus, again and again.
pub(super) type Opener = Box<dyn FnMut() -> Result<Halves, OpenError> + Send>;

/// The reading half. A loss is told once, as an error; from then on nothing is received until the bus is back, and
/// every [`Bus::wait`] looks for it when it is time.
pub(super) struct Reconnecting {
    name: String,
    clock: Clock,
    open: Opener,
    reader: Option<Box<dyn Bus>>,
    writer: Arc<Slot>,
    health: Arc<BusHealth>,
    retry: Retry,
}

/// Where the reading half puts the sending half of the bus that is open just now.
#[derive(Default)]
struct Slot {
    bus: Mutex<Option<Box<dyn Bus>>>,
    /// The sending half has found the bus gone: the system may tell only one of the two.
    broken: AtomicBool,
}

impl Slot {
    /// A panic in the middle of a send leaves a bus that can still be dropped or used.
    fn bus(&self) -> MutexGuard<'_, Option<Box<dyn Bus>>> {
        self.bus.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The sending half.
struct Sender {
    name: String,
    slot: Arc<Slot>,
}

/// Opens a bus for the first time, which has to succeed, and keeps it open: its reading half, and its sending half
/// if it has one.
pub(super) fn keep_open(
    name: &str,
    clock: Clock,
    health: Arc<BusHealth>,
    mut open: Opener,
) -> Result<Halves, OpenError> {
    let halves = open()?;
    let writer = Arc::new(Slot::default());
    let sender = halves.writer.map(|bus| {
        *writer.bus() = Some(bus);
        Box::new(Sender { name: name.to_owned(), slot: Arc::clone(&writer) }) as Box<dyn Bus>
    });
    let reader = Reconnecting {
        name: name.to_owned(),
        clock,
        open,
        reader: Some(halves.reader),
        writer,
        health,
        retry: Retry::default(),
    };
    Ok(Halves { reader: Box::new(reader), writer: sender })
}

impl Reconnecting {
    /// Lets go of a bus that does not work, so that it can be opened anew.
    fn lose(&mut self, error: BusError) -> BusError {
        self.reader = None;
        *self.writer.bus() = None;
        self.retry.after_loss(self.clock.now());
        self.health.set_lost(error.to_string());
        error
    }

    fn look(&mut self, timeout: Duration) {
        thread::sleep(timeout.min(self.retry.time_left(self.clock.now())));
        if !self.retry.is_due(self.clock.now()) {
            return;
        }
        match (self.open)() {
            Ok(halves) => {
                self.reader = Some(halves.reader);
                *self.writer.bus() = halves.writer;
                self.writer.broken.store(false, Ordering::Relaxed);
                self.health.set_found();
            }
            Err(error) => {
                self.health.set_lost(error.to_string());
                self.retry.after_failure(self.clock.now());
            }
        }
    }

    fn gone(&self) -> BusError {
        BusError::Gone { name: self.name.clone(), reason: "reconnecting".to_owned() }
    }
}

impl Bus for Reconnecting {
    fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError> {
        match &mut self.reader {
            Some(bus) => bus.send(now, frame),
            None => Err(self.gone()),
        }
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        let Some(bus) = &mut self.reader else { return Ok(None) };
        match bus.receive(now) {
            Ok(Some(frame)) => {
                self.retry.settle();
                Ok(Some(frame))
            }
            Ok(None) if self.writer.broken.load(Ordering::Relaxed) => {
                let reason = "sending is no longer possible".to_owned();
                Err(self.lose(BusError::Gone { name: self.name.clone(), reason }))
            }
            Ok(None) => Ok(None),
            Err(error) => Err(self.lose(error)),
        }
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), BusError> {
        match &mut self.reader {
            Some(bus) => bus.wait(timeout).map_err(|error| self.lose(error)),
            None => {
                self.look(timeout);
                Ok(())
            }
        }
    }
}

impl Bus for Sender {
    fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError> {
        let mut slot = self.slot.bus();
        let Some(bus) = slot.as_mut() else {
            let reason = "reconnecting".to_owned();
            return Err(BusError::Gone { name: self.name.clone(), reason });
        };
        let sent = bus.send(now, frame);
        if matches!(sent, Err(BusError::Gone { .. })) {
            self.slot.broken.store(true, Ordering::Relaxed);
        }
        sent
    }

    /// What comes is the other half's.
    fn receive(&mut self, _: Duration) -> Result<Option<StampedFrame>, BusError> {
        Ok(None)
    }

    fn wait(&mut self, _: Duration) -> Result<(), BusError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::link::{Direction, FrameId};

    /// A bus that gives the frames of a list and then is gone.
    struct Mortal(VecDeque<StampedFrame>);

    impl Mortal {
        fn gone() -> BusError {
            BusError::Gone { name: "test".to_owned(), reason: "unplugged".to_owned() }
        }
    }

    impl Bus for Mortal {
        fn send(&mut self, _: Duration, _: &Frame) -> Result<(), BusError> {
            Err(Self::gone())
        }

        fn receive(&mut self, _: Duration) -> Result<Option<StampedFrame>, BusError> {
            self.0.pop_front().map(Some).ok_or_else(Self::gone)
        }

        fn wait(&mut self, _: Duration) -> Result<(), BusError> {
            Ok(())
        }
    }

    fn frame(byte: u8) -> StampedFrame {
        let frame = Frame::full(FrameId::Standard(0x141), [byte; 8]);
        StampedFrame { time: Duration::ZERO, direction: Direction::Received, frame }
    }

    #[test]
    fn a_loss_is_told_once_and_what_comes_after_it_follows() {
        let health = Arc::new(BusHealth::default());
        let mut lives = VecDeque::from([Some(vec![frame(1)]), None, Some(vec![frame(2), frame(3)])]);
        let open: Opener = Box::new(move || match lives.pop_front() {
            Some(Some(frames)) => Ok(Halves {
                reader: Box::new(Mortal(frames.into())),
                writer: Some(Box::new(Mortal(VecDeque::new()))),
            }),
            _ => Err(OpenError::Failed { name: "test".to_owned(), reason: "not there".to_owned() }),
        });
        let clock = Clock::start();
        let mut bus = keep_open("test", clock, Arc::clone(&health), open).unwrap();
        let reader = &mut bus.reader;
        assert_eq!(reader.receive(clock.now()), Ok(Some(frame(1))));
        assert_eq!(reader.receive(clock.now()), Err(Mortal::gone()));
        assert_eq!(health.lost().as_deref(), Some("test is gone: unplugged"));
        assert!(matches!(bus.writer.unwrap().send(clock.now(), &frame(9).frame), Err(BusError::Gone { .. })));
        let mut found = Vec::new();
        while found.len() < 2 && clock.now() < Duration::from_secs(30) {
            reader.wait(Duration::from_millis(50)).unwrap();
            found.extend(reader.receive(clock.now()).unwrap());
        }
        assert_eq!(found, [frame(2), frame(3)]);
        assert_eq!((health.lost(), health.reconnects()), (None, 1));
    }
}
