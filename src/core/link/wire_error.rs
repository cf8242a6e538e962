//! Bytes that are not what they should be.

/// Reason why bytes are no message of a protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// A message that ends early.
    #[error("{got} of {needed} bytes")]
    Truncated {
        /// Length of the message.
        needed: usize,
        /// Bytes that are there.
        got: usize,
    },
    /// A command code that the protocol does not define.
    #[error("unknown command 0x{0:02X}")]
    UnknownCommand(u8),
    /// A known command with a value that one of its bytes cannot have.
    #[error("command 0x{command:02X} with a value it cannot have")]
    InvalidField {
        /// Command code.
        command: u8,
    },
}
