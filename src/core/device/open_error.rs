//! Why a bus or a port cannot be opened, each with its mend.

/// Why a bus or a port cannot be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The system has no CAN interfaces.
    #[error(
        "{interface} cannot be opened because this system has no SocketCAN: load it with `sudo modprobe can-raw`, or \
         use an SLCAN adapter with slcan:PORT"
    )]
    NoCan {
        /// What was asked for.
        interface: String,
    },
    /// No interface of that name.
    #[error(
        "there is no CAN interface {interface}; there {present}: plug the adapter in, or make one by \
         `sudo ip link add dev vcan0 type vcan` and `sudo ip link set vcan0 up`"
    )]
    NoInterface {
        /// What was asked for.
        interface: String,
        /// Those that exist, in words.
        present: String,
    },
    /// A network interface of another sort.
    #[error("{interface} is no CAN interface; there {present}")]
    NotCan {
        /// What was asked for.
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
        /// What was asked for.
        port: String,
        /// Those that exist, in words.
        present: String,
    },
    /// The user may not.
    #[error("{name} may not be opened: {mend}")]
    NoPermission {
        /// Interface or port.
        name: String,
        /// What would allow it.
        mend: String,
    },
    /// Another program has it.
    #[error(
        "{port} is in use: close the other program (slcand, ModemManager, a terminal; `fuser -v {port}` tells)"
    )]
    InUse {
        /// The port.
        port: String,
    },
    /// A bit rate that the adapter's protocol has not.
    #[error(
        "SLCAN has no bit rate of {bit_rate} bit/s: it has 10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000 \
         and 1000000"
    )]
    BitRate {
        /// What was asked for.
        bit_rate: u32,
    },
    /// An adapter that does not do what it is told.
    #[error(
        "{port} refuses the command {command}: is it an adapter that speaks SLCAN, and does it know this bit rate and \
         (to listen) the command L?"
    )]
    Refused {
        /// The port.
        port: String,
        /// The command.
        command: String,
    },
    /// A source that is no bus.
    #[error("{source_name} is no bus that can be opened")]
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
