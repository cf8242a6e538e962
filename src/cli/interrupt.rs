//! Ctrl+C, or the end that the system asks for: the robot has to be switched off before the program ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::output::Failure;

/// Whether the program is to end.
#[derive(Default)]
pub(super) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// From now on an interrupt is noted and no longer ends the program.
    pub(super) fn watch() -> Result<Self, Failure> {
        let interrupt = Self::default();
        let noted = Self(Arc::clone(&interrupt.0));
        ctrlc::set_handler(move || noted.raise())
            .map_err(|error| Failure::Message(format!("cannot watch for Ctrl+C: {error}")))?;
        Ok(interrupt)
    }

    /// Notes that it came.
    pub(super) fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it came.
    pub(super) fn came(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
