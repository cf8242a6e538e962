//! Orders to the two wheel motors and events from them, in SI units, forward positive.

use std::fmt;
use std::time::Duration;

use crate::model::Motor;

/// Order to both motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorOrder {
    /// Put power on.
    On,
    /// Take power off; the motors still answer.
    Off,
    /// Torques of the left and the right motor, N m.
    Torque([f64; 2]),
    /// Read temperature, current, speed and encoder.
    ReadState,
    /// Read temperature, voltage and errors.
    ReadHealth,
    /// Forget errors whose cause is gone.
    ClearErrors,
}

/// What a motor says of its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorState {
    /// When it was received.
    pub time: Duration,
    /// Angle since the first reading, turns counted, rad.
    pub angle_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_s: f64,
    /// Torque current, A.
    pub current_a: f64,
    /// Temperature, °C.
    pub temperature_c: f64,
}

/// What a motor says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorHealth {
    /// When it was received.
    pub time: Duration,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Voltage of the supply, V, if the drive reports it.
    pub voltage_v: Option<f64>,
    /// Current from the supply, A; not known of older firmware.
    pub supply_current_a: Option<f64>,
    /// Whether it is switched on; not known of older firmware.
    pub on: Option<bool>,
    /// What is wrong with it.
    pub errors: MotorErrors,
    /// Time from the query, if this program sent it, to this reply.
    pub round_trip: Option<Duration>,
}

/// Errors of a motor, one bit each; protocols with other codes translate them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MotorErrors(pub u32);

impl MotorErrors {
    const NAMES: [&'static str; 8] = [
        "undervoltage",
        "overvoltage",
        "driver too hot",
        "motor too hot",
        "overcurrent",
        "short circuit",
        "stall",
        "input signal lost",
    ];

    /// Whether nothing is wrong.
    pub fn is_none(self) -> bool {
        self.0 == 0
    }

    /// What is wrong, in words.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES
            .into_iter()
            .enumerate()
            .filter(move |(bit, _)| self.0 >> bit & 1 == 1)
            .map(|(_, name)| name)
    }
}

impl fmt::Display for MotorErrors {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.is_none() {
            return f.write_str("no error");
        }
        f.write_str(&self.names().collect::<Vec<_>>().join(", "))
    }
}

/// What was received on the bus about a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorEvent {
    /// A reading of its motion.
    State(Motor, MotorState),
    /// A reading of its health.
    Health(Motor, MotorHealth),
    /// The motor acknowledges that it is switched on or off.
    Switched {
        /// Which.
        motor: Motor,
        /// When.
        time: Duration,
        /// Whether it is on.
        on: bool,
    },
    /// A command to it that is no query and that this program did not send: another controller is on the bus.
    Commanded {
        /// Which.
        motor: Motor,
        /// When.
        time: Duration,
        /// Code by which the protocol names the command.
        command: u32,
        /// Torque current of a torque command, A, forward positive.
        current_a: Option<f64>,
    },
    /// It was silent for so long that its turns in between are not known: the angle of the reading that follows
    /// starts from the last one that was known.
    TurnsLost {
        /// Which.
        motor: Motor,
        /// When it was received again.
        time: Duration,
        /// For how long it was not received.
        silent: Duration,
    },
}
