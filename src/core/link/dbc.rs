//! Any other robot, described by a DBC file: which frames have which signals, and which of these are pitch,
//! speeds, angles and torques.
//!
//! [`Dbc`] reads the file, [`Choice`] says what a signal is, and [`SignalMap`] makes readings of frames. Such a
//! robot can be watched and recorded; to be driven it has to speak a protocol of [`super::protocol`].

use super::{Frame, FrameId};

mod choice;
mod map;
mod signal;
#[cfg(test)]
mod tests;

pub use choice::{Choice, ChoiceSyntaxError, Quantity};
pub use map::{ChoiceError, Heard, SignalMap};
pub use signal::Signal;

/// Largest file that is read, bytes.
pub const LARGEST_FILE_BYTES: usize = 16 << 20;

/// A name that tools give to signals of no message.
const INDEPENDENT: &str = "VECTOR__INDEPENDENT_SIG_MSG";

/// Messages and their signals.
#[derive(Clone, Debug, PartialEq)]
pub struct Dbc {
    messages: Vec<Message>,
}

/// A frame that is described.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Name.
    pub name: String,
    /// Identifier of its frames.
    pub id: FrameId,
    /// Its signals.
    pub signals: Vec<Signal>,
}

/// A file that is no DBC.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DbcError {
    /// Not understood.
    #[error("this is not a DBC file: {reason}")]
    Syntax {
        /// What was expected, and where.
        reason: String,
    },
    /// Too large.
    #[error("the file has {bytes} bytes; DBC files up to {LARGEST_FILE_BYTES} are read")]
    TooLarge {
        /// Its size.
        bytes: usize,
    },
}

impl Dbc {
    /// Reads the text of a DBC file. Messages on identifiers that CAN has not are left out.
    ///
    /// # Errors
    /// [`DbcError`].
    ///
    /// ```
    /// use flqr_core::link::Frame;
    /// use flqr_core::link::dbc::Dbc;
    ///
    /// let text = "VERSION \"\"\nNS_ :\nBS_:\nBU_:\nBO_ 256 Body: 8 Vector__XXX\n SG_ Pitch : 0|16@1- (0.01,0) [0|0] \"deg\" Vector__XXX\n";
    /// let dbc = Dbc::parse(text)?;
    /// let [message] = dbc.messages() else { return Err("not one message".into()) };
    /// let frame = Frame::full(message.id, [100, 0, 0, 0, 0, 0, 0, 0]);
    /// assert_eq!(message.values(&frame).map(|(_, value)| value).collect::<Vec<_>>(), [1.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, DbcError> {
        if text.len() > LARGEST_FILE_BYTES {
            return Err(DbcError::TooLarge { bytes: text.len() });
        }
        let file = can_dbc::Dbc::try_from(text)
            .map_err(|error| DbcError::Syntax { reason: error.to_string().trim().to_owned() })?;
        Ok(Self {
            messages: file.messages.iter().filter_map(|message| Message::of(message, &file)).collect(),
        })
    }

    /// What is described, in the order of the file.
    pub fn messages(&self) -> &[Message] {
        &self.messages
    }

    /// All signals with their messages, in the order of the file.
    pub fn signals(&self) -> impl Iterator<Item = (&Message, &Signal)> {
        self.messages.iter().flat_map(|message| message.signals.iter().map(move |signal| (message, signal)))
    }
}

impl Message {
    fn of(message: &can_dbc::Message, file: &can_dbc::Dbc) -> Option<Self> {
        let id = match message.id {
            can_dbc::MessageId::Standard(id) => FrameId::standard(id)?,
            can_dbc::MessageId::Extended(id) => FrameId::extended(id)?,
        };
        let signals = message.signals.iter().map(|signal| Signal::of(signal, message, file)).collect();
        (message.name != INDEPENDENT).then(|| Self { name: message.name.clone(), id, signals })
    }

    /// Values of all signals that a frame of this message has, in their units.
    pub fn values(&self, frame: &Frame) -> impl Iterator<Item = (&Signal, f64)> {
        self.signals.iter().filter_map(|signal| Some((signal, signal.value(frame)?)))
    }
}
