//! What goes out of the control loop's thread, now and then.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::Duration;

use super::relay::{MOST_SAMPLES, Relay};
use super::types::{Event, Status, Update};
use crate::device::RecorderInput;
use crate::link::StampedFrame;
use crate::record::Sample;

/// Wakes whoever shows the updates.
pub type Waker = Arc<dyn Fn() + Send + Sync>;

/// Who hands updates over.
enum Outlet {
    /// The thread that gathers them: that of a recording.
    Direct(SyncSender<Update>, Waker),
    /// A separate thread, so that a control loop is never held up.
    Relay(Relay),
}

/// Gathers what has happened since the last update.
pub(super) struct Publisher {
    outlet: Outlet,
    pub(super) interval: Duration,
    next: Duration,
    pub(super) samples: Vec<Sample>,
    frames: VecDeque<StampedFrame>,
    pub(super) events: Vec<Event>,
    /// Whether the last update could not be offered.
    held: bool,
}

impl Publisher {
    /// For a thread that may wait.
    pub(super) fn direct(updates: SyncSender<Update>, wake: Waker) -> Self {
        Self::new(Outlet::Direct(updates, wake))
    }

    /// For a control loop: neither gathering nor [`Publisher::publish`] allocates memory or waits.
    pub(super) fn relayed(updates: SyncSender<Update>, wake: Waker) -> std::io::Result<Self> {
        Ok(Self::new(Outlet::Relay(Relay::start(updates, wake)?)))
    }

    fn new(outlet: Outlet) -> Self {
        Self {
            outlet,
            interval: Duration::from_millis(33),
            next: Duration::ZERO,
            samples: Vec::with_capacity(MOST_SAMPLES),
            frames: VecDeque::with_capacity(Update::FRAMES),
            events: Vec::new(),
            held: false,
        }
    }

    /// Keeps a frame if it is one of the newest.
    pub(super) fn frame(&mut self, frame: StampedFrame) {
        if self.frames.len() == Update::FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back(frame);
    }

    /// Whether an update is due; the next one is an interval later.
    pub(super) fn is_due(&mut self, now: Duration) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + self.interval;
        }
        due
    }

    /// Sends an update off, whose status `fill` writes and whose recording is that of `recorder`; gives the number of
    /// samples that did not get through because nobody takes them. Where the last update is still being sent, all waits
    /// for the next call.
    pub(super) fn publish(&mut self, recorder: Option<RecorderInput>, fill: impl FnOnce(&mut Status)) -> u64 {
        let Outlet::Relay(relay) = &mut self.outlet else { return 0 };
        if let Some(mut parcel) = relay.take() {
            parcel.samples.append(&mut self.samples);
            parcel.frames.clear();
            parcel.frames.extend(self.frames.drain(..));
            parcel.events.append(&mut self.events);
            parcel.recorder = recorder;
            fill(&mut parcel.status);
            relay.hand_over(parcel);
        }
        let too_many = self.samples.len().saturating_sub(MOST_SAMPLES / 2);
        self.samples.drain(..too_many);
        relay.lost() + too_many as u64
    }

    /// Sends an update; where nobody takes it, all of it waits for the next one.
    pub(super) fn offer(&mut self, status: Status) {
        let refused = self.send(status);
        self.held = refused.is_some();
        if let Some(update) = refused {
            (self.samples, self.frames, self.events) = (update.samples, update.frames.into(), update.events);
        }
    }

    /// Whether what was offered waits.
    pub(super) fn is_held(&self) -> bool {
        self.held
    }

    /// Sends an update; gives it back where nobody takes it.
    fn send(&mut self, status: Status) -> Option<Update> {
        let update = Update {
            samples: std::mem::take(&mut self.samples),
            frames: std::mem::take(&mut self.frames).into(),
            events: std::mem::take(&mut self.events),
            status,
        };
        let Outlet::Direct(updates, wake) = &self.outlet else { return Some(update) };
        match updates.try_send(update) {
            Ok(()) => {
                wake();
                None
            }
            Err(TrySendError::Full(update) | TrySendError::Disconnected(update)) => Some(update),
        }
    }
}
