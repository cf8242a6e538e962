//! From the name of a source to an open bus.

use std::sync::Arc;

use super::bus_health::BusHealth;
use super::clock::Clock;
use super::interfaces;
use super::open_error::OpenError;
use super::reconnect::{self, Halves, Opener};
use super::session::Source;
use crate::link::Bus;

/// An open bus for two threads. It comes back by itself after a loss.
pub struct BusPair {
    /// For the thread that reads.
    pub reader: Box<dyn Bus>,
    /// For the thread that sends; none of a bus that only listens.
    pub writer: Option<Box<dyn Bus>>,
    /// How it stands, for any thread.
    pub health: Arc<BusHealth>,
}

/// Opens a source with a wire. With `listen_only` not one frame can be sent, by either half.
///
/// # Errors
/// [`OpenError`]: what is missing, and the remedy. Emulated and replayed sources have no wire.
pub fn open_bus(source: &Source, listen_only: bool, clock: &Clock) -> Result<BusPair, OpenError> {
    let health = Arc::new(BusHealth::default());
    let (name, open) = match source {
        Source::Can { interface } => (interface, can(interface, listen_only, &health)),
        Source::Slcan { port, bit_rate } => (port, slcan(port, *bit_rate, listen_only, &health)),
        Source::Emulated | Source::Replay { .. } => {
            return Err(OpenError::NoBus { source_name: source.to_string() });
        }
    };
    let Halves { reader, writer } = reconnect::keep_open(name, *clock, Arc::clone(&health), open)?;
    Ok(BusPair { reader, writer, health })
}

#[cfg(target_os = "linux")]
fn can(interface: &str, listen_only: bool, health: &Arc<BusHealth>) -> Opener {
    let (interface, health) = (interface.to_owned(), Arc::clone(health));
    Box::new(move || {
        let reader = super::can::SocketCan::open(&interface, listen_only, Arc::clone(&health))?;
        let writer = if listen_only { None } else { Some(Box::new(reader.try_clone()?) as Box<dyn Bus>) };
        Ok(Halves { reader: Box::new(reader), writer })
    })
}

fn slcan(port: &str, bit_rate: u32, listen_only: bool, health: &Arc<BusHealth>) -> Opener {
    let (mut port, health) = (port.to_owned(), Arc::clone(health));
    Box::new(move || {
        let (reader, writer) = super::slcan::open(&port, bit_rate, listen_only, &health)?;
        // Where it is plugged in elsewhere it may get another number, but keeps this name.
        port = interfaces::stable_name(&port).unwrap_or_else(|| port.clone());
        Ok(Halves { reader: Box::new(reader), writer: writer.map(|bus| Box::new(bus) as Box<dyn Bus>) })
    })
}

#[cfg(not(target_os = "linux"))]
fn can(interface: &str, _: bool, _: &Arc<BusHealth>) -> Opener {
    let interface = interface.to_owned();
    Box::new(move || Err(OpenError::NoCan { interface: interface.clone() }))
}
