//! What a bus says of itself, seen from any thread.

use std::fmt;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::Serialize;

/// State of a CAN controller by its error counters (ISO 11898-1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BusState {
    /// Takes part.
    #[default]
    ErrorActive,
    /// An error counter has reached 96.
    ErrorWarning,
    /// An error counter has reached 128.
    ErrorPassive,
    /// The send error counter has reached 256: it takes no part any more.
    BusOff,
}

impl BusState {
    const ALL: [Self; 4] = [Self::ErrorActive, Self::ErrorWarning, Self::ErrorPassive, Self::BusOff];
}

impl fmt::Display for BusState {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::ErrorActive => "ERROR-ACTIVE",
            Self::ErrorWarning => "ERROR-WARNING",
            Self::ErrorPassive => "ERROR-PASSIVE",
            Self::BusOff => "BUS-OFF",
        })
    }
}

/// Counts and state of an open bus; the bus writes them, anybody reads them.
#[derive(Debug, Default)]
pub struct BusHealth {
    dropped: AtomicU64,
    errors: AtomicU64,
    reconnects: AtomicU64,
    state: AtomicU8,
    lost: Mutex<Option<String>>,
    hint: Mutex<Option<String>>,
}

impl BusHealth {
    /// Frames that the system or the adapter dropped before they were read.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Error frames, damaged lines and refused commands.
    pub fn errors(&self) -> u64 {
        self.errors.load(Ordering::Relaxed)
    }

    /// Times the bus was lost and came back.
    pub fn reconnects(&self) -> u64 {
        self.reconnects.load(Ordering::Relaxed)
    }

    /// State of the controller, as far as it has told.
    pub fn state(&self) -> BusState {
        BusState::ALL[usize::from(self.state.load(Ordering::Relaxed))]
    }

    /// Why the bus is lost just now; none while it is open.
    pub fn lost(&self) -> Option<String> {
        guard(&self.lost).clone()
    }

    /// What may be wrong where nothing is received, and the remedy.
    pub fn hint(&self) -> Option<String> {
        guard(&self.hint).clone()
    }

    pub(super) fn add_dropped(&self, frames: u64) {
        self.dropped.fetch_add(frames, Ordering::Relaxed);
    }

    pub(super) fn add_error(&self) {
        self.errors.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn set_state(&self, state: BusState) {
        self.state.store(state as u8, Ordering::Relaxed);
    }

    pub(super) fn set_hint(&self, hint: String) {
        *guard(&self.hint) = Some(hint);
    }

    pub(super) fn set_lost(&self, reason: String) {
        *guard(&self.lost) = Some(reason);
    }

    pub(super) fn set_found(&self) {
        *guard(&self.lost) = None;
        self.set_state(BusState::ErrorActive);
        self.reconnects.fetch_add(1, Ordering::Relaxed);
    }
}

/// A panic of another thread leaves these texts whole.
fn guard(text: &Mutex<Option<String>>) -> MutexGuard<'_, Option<String>> {
    text.lock().unwrap_or_else(PoisonError::into_inner)
}
