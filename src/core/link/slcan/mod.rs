//! SLCAN (Lawicel): CAN adapters on a serial port, as lines of text that end in a carriage return.
//!
//! [`Command`] is what a computer sends and [`Answer`] what an adapter sends; each is written and read, so that
//! both ends of the line are here. Sources: Linux (`drivers/net/can/slcan/slcan-core.c`) for frames, status and
//! error lines; the commands as `slcand` and adapters use them. What adapters do differently is tolerated where
//! it cannot be mistaken: small hexadecimal letters, line feeds, timestamps that were not requested.

mod answer;
mod command;
mod line;
#[cfg(test)]
mod tests;
mod text;

pub use answer::{Answer, AnswerDecoder, BusErrors, BusState, Status};
pub use command::{Command, CommandDecoder, bit_rate_of_code, opening};
pub use line::{Line, Text};
