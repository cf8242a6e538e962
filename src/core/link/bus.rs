//! What every way to a CAN bus has in common.

use std::time::Duration;

use super::frame::{Frame, StampedFrame};

/// A way to a CAN bus: an interface, an adapter, a loopback, a recording, or one of these with faults or a
/// recorder around it. Time is that of the session, handed in by the caller.
pub trait Bus: Send {
    /// Hands a frame over for sending. Never waits.
    ///
    /// # Errors
    /// [`BusError`]; a frame that could not be handed over was not sent.
    fn send(&mut self, now: Duration, frame: &Frame) -> Result<(), BusError>;

    /// The next frame that has come by `now`, stamped. Never waits.
    ///
    /// # Errors
    /// [`BusError`]; the bus may work again later.
    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError>;

    /// Waits until a frame may be there, at most for `timeout`. A bus without a wire returns at once.
    ///
    /// # Errors
    /// [`BusError`].
    fn wait(&mut self, timeout: Duration) -> Result<(), BusError>;
}

/// Why a bus does not work just now.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusError {
    /// The other side is gone: adapter unplugged, interface taken down.
    #[error("{name} is gone: {reason}")]
    Gone {
        /// Interface or port.
        name: String,
        /// What the system said.
        reason: String,
    },
    /// Frames are handed over faster than they leave.
    #[error(
        "{name} accepts no more frames: its queue is full; check that a node on the bus acknowledges them"
    )]
    Full {
        /// Interface or port.
        name: String,
    },
    /// A bus that only listens.
    #[error("{name} is listen-only: it was opened without permission to send")]
    ListensOnly {
        /// Interface or port.
        name: String,
    },
    /// Anything else that the system says.
    #[error("{name}: {reason}")]
    Failed {
        /// Interface or port.
        name: String,
        /// What the system said.
        reason: String,
    },
}
