//! What goes out of the control loop's thread, now and then.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::Duration;

use super::types::{Event, Status, Update};
use crate::link::StampedFrame;
use crate::record::Sample;

/// Wakes whoever shows the updates.
pub type Waker = Arc<dyn Fn() + Send + Sync>;

/// Gathers what has happened since the last update.
pub(super) struct Publisher {
    updates: SyncSender<Update>,
    wake: Waker,
    pub(super) interval: Duration,
    next: Duration,
    pub(super) samples: Vec<Sample>,
    frames: VecDeque<StampedFrame>,
    pub(super) events: Vec<Event>,
    /// Whether the last update could not be offered.
    held: bool,
}

impl Publisher {
    pub(super) fn new(updates: SyncSender<Update>, wake: Waker) -> Self {
        Self {
            updates,
            wake,
            interval: Duration::from_millis(33),
            next: Duration::ZERO,
            samples: Vec::new(),
            frames: VecDeque::new(),
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

    /// Sends an update; gives the number of samples that did not get through because nobody takes them.
    /// Events wait for the next one.
    pub(super) fn publish(&mut self, status: Status) -> u64 {
        self.send(status).map_or(0, |update| {
            self.events = update.events;
            update.samples.len() as u64
        })
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
        match self.updates.try_send(update) {
            Ok(()) => {
                (self.wake)();
                None
            }
            Err(TrySendError::Full(update) | TrySendError::Disconnected(update)) => Some(update),
        }
    }
}
