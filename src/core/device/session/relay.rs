//! From the control loop to whoever takes the updates, without the loop ever allocating memory or waiting for a thread
//! that is less urgent: it fills one parcel, which comes back empty.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, Builder, JoinHandle};

use super::publisher::Waker;
use super::types::{Event, Status, Update};
use crate::device::RecorderInput;
use crate::link::StampedFrame;
use crate::record::Sample;

/// Samples that a parcel has room for: some seconds without anybody to take it.
pub(super) const MOST_SAMPLES: usize = 4096;
/// Events that a parcel has room for before it needs more memory.
const EVENTS: usize = 64;

/// What one update is made of.
pub(super) struct Parcel {
    pub(super) samples: Vec<Sample>,
    pub(super) frames: VecDeque<StampedFrame>,
    pub(super) events: Vec<Event>,
    pub(super) status: Status,
    /// The recording whose status belongs to it.
    pub(super) recorder: Option<RecorderInput>,
}

impl Parcel {
    fn empty() -> Box<Self> {
        Box::new(Self {
            samples: Vec::with_capacity(MOST_SAMPLES),
            frames: VecDeque::with_capacity(Update::FRAMES),
            events: Vec::with_capacity(EVENTS),
            status: Status::default(),
            recorder: None,
        })
    }

    /// The update; samples and events are taken out, but the memory stays.
    fn unpack(&mut self) -> Update {
        let mut status = self.status.clone();
        status.recording = self.recorder.take().map(|recorder| recorder.status());
        Update {
            samples: self.samples.drain(..).collect(),
            frames: self.frames.drain(..).collect(),
            events: self.events.drain(..).collect(),
            status,
        }
    }
}

/// Where the parcel is, if it is not with either thread.
#[derive(Default)]
struct Shelf {
    full: Option<Box<Parcel>>,
    empty: Option<Box<Parcel>>,
}

#[derive(Default)]
struct Shared {
    shelf: Mutex<Shelf>,
    /// Samples that nobody has taken in time.
    lost: AtomicU64,
    ends: AtomicBool,
}

impl Shared {
    fn shelf(&self) -> MutexGuard<'_, Shelf> {
        // A panic leaves the shelf whole: each change is a single move.
        self.shelf.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn try_shelf(&self) -> Option<MutexGuard<'_, Shelf>> {
        match self.shelf.try_lock() {
            Ok(shelf) => Some(shelf),
            Err(TryLockError::Poisoned(shelf)) => Some(shelf.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

/// The control loop's end.
pub(super) struct Relay {
    shared: Arc<Shared>,
    /// The parcel, while the control loop has it.
    parcel: Option<Box<Parcel>>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    /// Starts the thread that unpacks.
    pub(super) fn start(updates: SyncSender<Update>, wake: Waker) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let work = move || unpack_all(&of_thread, &updates, &wake);
        let thread = Builder::new().name("updates".to_owned()).spawn(work)?;
        Ok(Self { shared, parcel: Some(Parcel::empty()), thread: Some(thread) })
    }

    /// The parcel, if it has come back.
    pub(super) fn take(&mut self) -> Option<Box<Parcel>> {
        if self.parcel.is_none() {
            self.parcel = self.shared.try_shelf()?.empty.take();
        }
        self.parcel.take()
    }

    /// Sends the parcel off; where the other thread is just at the shelf, it goes with the next call.
    pub(super) fn hand_over(&mut self, parcel: Box<Parcel>) {
        match self.shared.try_shelf() {
            Some(mut shelf) => shelf.full = Some(parcel),
            None => return self.parcel = Some(parcel),
        }
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }

    /// Samples that nobody has taken in time, since the last call.
    pub(super) fn lost(&self) -> u64 {
        self.shared.lost.swap(0, Ordering::Relaxed)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // One that panicked has ended as well.
            thread.join().unwrap_or(());
        }
    }
}

fn unpack_all(shared: &Shared, updates: &SyncSender<Update>, wake: &Waker) {
    // Events that nobody has taken yet wait for the next update.
    let mut waiting = Vec::new();
    loop {
        let ends = shared.ends.load(Ordering::Acquire);
        let full = shared.shelf().full.take();
        if let Some(mut parcel) = full {
            let mut update = parcel.unpack();
            shared.shelf().empty = Some(parcel);
            waiting.append(&mut update.events);
            update.events = std::mem::take(&mut waiting);
            match updates.try_send(update) {
                Ok(()) => wake(),
                Err(TrySendError::Full(update) | TrySendError::Disconnected(update)) => {
                    waiting = update.events;
                    shared.lost.fetch_add(update.samples.len() as u64, Ordering::Relaxed);
                }
            }
        } else if ends {
            return;
        } else {
            thread::park();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;
    use std::time::Duration;

    use super::*;
    use crate::device::session::types::EventKind;

    fn event(number: u64) -> Event {
        Event { time: Duration::from_millis(number), kind: EventKind::Note, text: String::new() }
    }

    fn parcel(relay: &mut Relay) -> Box<Parcel> {
        loop {
            match relay.take() {
                Some(parcel) => return parcel,
                None => thread::yield_now(),
            }
        }
    }

    #[test]
    fn every_event_arrives_once_and_in_order_and_the_memory_stays_the_same() {
        let (sender, updates) = sync_channel(2);
        let mut relay = Relay::start(sender, Arc::new(|| {})).unwrap();
        let memory = parcel(&mut relay);
        let first = memory.samples.as_ptr();
        relay.hand_over(memory);
        for number in 0..10 {
            let mut parcel = parcel(&mut relay);
            parcel.events.push(event(number));
            relay.hand_over(parcel);
        }
        let mut events: Vec<Event> = Vec::new();
        while events.len() < 10 {
            // Events that nobody took wait for the next update.
            match updates.try_recv() {
                Ok(update) => events.extend(update.events),
                Err(_) => {
                    let parcel = parcel(&mut relay);
                    relay.hand_over(parcel);
                }
            }
        }
        assert_eq!(events, (0..10).map(event).collect::<Vec<_>>());
        assert_eq!(parcel(&mut relay).samples.as_ptr(), first);
    }
}
