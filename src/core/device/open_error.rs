//! Why a bus or a port cannot be opened, each with its remedy.

/// Why a bus or a port cannot be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The system has no CAN interfaces.
    #[error(
        "{interface} cannot be opened because this system has no SocketCAN: load it with `sudo modprobe can-raw`, or \
         use an SLCAN adapter with slcan:PORT"
    )]
    NoCan {
        /// What was requested.
        interface: String,
    },
    /// No interface of that name.
    #[error(
        "there is no CAN interface {interface}; there {present}: plug the adapter in, or create one with \
         `sudo ip link add dev vcan0 type vcan` and `sudo ip link set vcan0 up`"
    )]
    NoInterface {
        /// What was requested.
        interface: String,
        /// Those that exist, in words.
        present: String,
    },
    /// A network interface of another sort.
    #[error("{interface} is not a CAN interface; there {present}")]
    NotCan {
        /// What was requested.
        interface: String,
        /// Those that exist, in words.
        present: String,
    },
    /// Not switched on.
    #[error("{interface} is down: bring it up with `{command}`")]
    Down {
        /// The interface.
        interface: String,
        /// What brings it up.
        command: String,
    },
    /// No serial port of that name.
    #[error("there is no serial port {port}; there {present}: plug the adapter in")]
    NoPort {
        /// What was requested.
        port: String,
        /// Those that exist, in words.
        present: String,
    },
    /// The user may not.
    #[error("permission denied for {name}: {remedy}")]
    NoPermission {
        /// Interface or port.
        name: String,
        /// What would allow it.
        remedy: String,
    },
    /// Another program has it.
    #[error(
        "{port} is in use: close the other program (slcand, ModemManager, a terminal; `fuser -v {port}` shows it)"
    )]
    InUse {
        /// The port.
        port: String,
    },
    /// A bit rate that the adapter's protocol has not.
    #[error(
        "SLCAN does not support {bit_rate} bit/s: use 10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000 \
         and 1000000"
    )]
    BitRate {
        /// What was requested.
        bit_rate: u32,
    },
    /// An adapter that does not do what it is told.
    #[error(
        "{port} rejects the command {command}: check that it is an SLCAN adapter that supports this bit rate and, \
         for listen-only, the command L"
    )]
    Refused {
        /// The port.
        port: String,
        /// The command.
        command: String,
    },
    /// A source that is no bus.
    #[error("{source_name} is not a bus that can be opened")]
    NoBus {
        /// The source.
        source_name: String,
    },
    /// Anything else that the system says.
    #[error("{name} cannot be opened: {reason}")]
    Failed {
        /// Interface or port.
        name: String,
        /// What the system said.
        reason: String,
    },
}
