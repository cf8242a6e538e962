//! Replies of a motor.

use super::{MotorId, field, i16_at, u16_at, u32_at};
use crate::link::{Frame, MotorErrors, WireError};
use crate::model::StateLayout;

/// One reply of one motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Temperature, voltage and errors: to 0x9A and 0x9B.
    State1 {
        /// Command that it answers.
        command: u8,
        /// What it says.
        state: State1,
    },
    /// Motion: to 0x9C and to all commands that move the motor.
    State2 {
        /// Command that it answers; 0xA1 also where torques were required of all motors at once.
        command: u8,
        /// What it says.
        state: State2,
    },
    /// 0x9D: phase currents.
    State3(PhaseCurrents),
    /// 0x8C: brake.
    Brake {
        /// 0 engaged, 1 released.
        state: u8,
    },
    /// 0x90: encoder.
    Encoder(Encoder),
    /// 0x92: angle over many turns, 0.01°, clockwise positive; 56 bits.
    Angle {
        /// 0.01°.
        angle_cdeg: i64,
    },
    /// 0x94: angle within a turn, 0.01°.
    TurnAngle {
        /// 0.01°.
        angle_cdeg: u32,
    },
    /// 0x19, 0x91: the zero that was written.
    Offset {
        /// Command that it answers.
        command: u8,
        /// Raw.
        offset: u16,
    },
    /// A command that was done, repeated: 0x80, 0x81, 0x88, 0x95 and those for parameters.
    Echo {
        /// All bytes.
        bytes: [u8; 8],
    },
}

/// Temperature, voltage and errors, in the layout of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State1 {
    /// Protocol 2.35 and 2.36.
    Current {
        /// °C.
        temperature_c: i8,
        /// 0.01 V.
        voltage_cv: i16,
        /// 0.01 A.
        current_ca: i16,
        /// 0x00 on, 0x10 off.
        power: u8,
        /// What is wrong.
        errors: MotorErrors,
    },
    /// Older firmware.
    Older {
        /// °C.
        temperature_c: i8,
        /// 0.1 V.
        voltage_dv: u16,
        /// What is wrong.
        errors: MotorErrors,
    },
}

/// Motion of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State2 {
    /// °C.
    pub temperature_c: i8,
    /// Torque current, raw; of the MS series the power.
    pub iq: i16,
    /// °/s.
    pub speed_dps: i16,
    /// Encoder, raw.
    pub encoder: u16,
}

/// Currents of the three phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhaseCurrents {
    /// °C.
    pub temperature_c: i8,
    /// Raw; 33/4096 A of the MF series, 1/64 A of older firmware.
    pub currents: [i16; 3],
}

/// Encoder of a motor, raw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoder {
    /// Reading less the offset.
    pub position: u16,
    /// Reading.
    pub raw: u16,
    /// Offset.
    pub offset: u16,
}

/// Identifier that a motor answers on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReplyId {
    /// That of its commands, 0x140 + number: protocol 2.35 and most drivers.
    #[default]
    Shared,
    /// Its own, 0x180 + number: protocol 2.36.
    Apart,
}

impl Reply {
    /// The frame of this motor.
    pub fn frame(&self, motor: MotorId, reply_id: ReplyId) -> Frame {
        let id = match reply_id {
            ReplyId::Shared => motor.command_id(),
            ReplyId::Apart => motor.reply_id(),
        };
        Frame::full(id, self.encode())
    }

    /// The reply that these bytes are.
    ///
    /// # Errors
    /// [`WireError::UnknownCommand`].
    pub fn decode(bytes: [u8; 8], layout: StateLayout) -> Result<Self, WireError> {
        let command = bytes[field::COMMAND];
        Ok(match command {
            0x9A | 0x9B => Self::State1 { command, state: State1::decode(&bytes, layout) },
            0x9C | 0xA0..=0xA8 | 0xAD => Self::State2 { command, state: State2::decode(&bytes) },
            0x9D => Self::State3(PhaseCurrents {
                temperature_c: bytes[field::TEMPERATURE].cast_signed(),
                currents: field::PHASES.map(|at| i16_at(&bytes, at)),
            }),
            0x8C => Self::Brake { state: bytes[field::BRAKE] },
            0x90 => Self::Encoder(Encoder {
                position: u16_at(&bytes, field::POSITION),
                raw: u16_at(&bytes, field::RAW),
                offset: u16_at(&bytes, field::OFFSET),
            }),
            // Bytes 1 to 7 are the low 56 bits: shifted out and back, the sign comes along.
            0x92 => Self::Angle { angle_cdeg: i64::from_le_bytes(bytes) >> 8 },
            0x94 => Self::TurnAngle { angle_cdeg: u32_at(&bytes, field::TURN_ANGLE) },
            0x19 | 0x91 => Self::Offset { command, offset: u16_at(&bytes, field::OFFSET) },
            0x80 | 0x81 | 0x88 | 0x95 | 0xB0 | 0xB1 | 0xC0 | 0xC1 | 0x30..=0x34 => Self::Echo { bytes },
            _ => return Err(WireError::UnknownCommand(command)),
        })
    }

    /// The 8 bytes; those that the reply does not use are 0.
    pub fn encode(&self) -> [u8; 8] {
        match *self {
            Self::State1 { command, state } => state.encode(command),
            Self::State2 { command, state } => state.encode(command),
            Self::State3(PhaseCurrents { temperature_c, currents }) => {
                packed(0x9D, temperature_c.cast_unsigned(), currents.map(i16::cast_unsigned))
            }
            Self::Brake { state } => packed(0x8C, state, [0; 3]),
            Self::Encoder(Encoder { position, raw, offset }) => packed(0x90, 0, [position, raw, offset]),
            Self::Angle { angle_cdeg } => ((angle_cdeg << 8) | 0x92).to_le_bytes(),
            Self::TurnAngle { angle_cdeg } => {
                packed(0x94, 0, [0, angle_cdeg as u16, (angle_cdeg >> 16) as u16])
            }
            Self::Offset { command, offset } => packed(command, 0, [0, 0, offset]),
            Self::Echo { bytes } => bytes,
        }
    }
}

fn packed(command: u8, one: u8, rest: [u16; 3]) -> [u8; 8] {
    let [[a, b], [c, d], [e, f]] = rest.map(u16::to_le_bytes);
    [command, one, a, b, c, d, e, f]
}

impl State1 {
    fn decode(bytes: &[u8; 8], layout: StateLayout) -> Self {
        let temperature_c = bytes[field::TEMPERATURE].cast_signed();
        let errors = MotorErrors(u32::from(bytes[field::ERRORS]));
        match layout {
            StateLayout::Current => Self::Current {
                temperature_c,
                voltage_cv: i16_at(bytes, field::VOLTAGE),
                current_ca: i16_at(bytes, field::SUPPLY_CURRENT),
                power: bytes[field::POWER],
                errors,
            },
            StateLayout::Older => {
                Self::Older { temperature_c, voltage_dv: u16_at(bytes, field::OLDER_VOLTAGE), errors }
            }
        }
    }

    fn encode(self, command: u8) -> [u8; 8] {
        match self {
            Self::Current { temperature_c, voltage_cv, current_ca, power, errors } => packed(
                command,
                temperature_c.cast_unsigned(),
                [
                    voltage_cv.cast_unsigned(),
                    current_ca.cast_unsigned(),
                    u16::from_le_bytes([power, errors.0 as u8]),
                ],
            ),
            Self::Older { temperature_c, voltage_dv, errors } => {
                let [low, high] = voltage_dv.to_le_bytes();
                [command, temperature_c.cast_unsigned(), 0, low, high, 0, 0, errors.0 as u8]
            }
        }
    }

    /// °C.
    pub fn temperature_c(&self) -> f64 {
        let (Self::Current { temperature_c, .. } | Self::Older { temperature_c, .. }) = *self;
        f64::from(temperature_c)
    }

    /// Voltage of the supply, V.
    pub fn voltage_v(&self) -> f64 {
        match *self {
            Self::Current { voltage_cv, .. } => f64::from(voltage_cv) / 100.0,
            Self::Older { voltage_dv, .. } => f64::from(voltage_dv) / 10.0,
        }
    }

    /// Current from the supply, A.
    pub fn supply_current_a(&self) -> Option<f64> {
        match *self {
            Self::Current { current_ca, .. } => Some(f64::from(current_ca) / 100.0),
            Self::Older { .. } => None,
        }
    }

    /// Whether it is switched on; `None` if it says neither.
    pub fn on(&self) -> Option<bool> {
        match *self {
            Self::Current { power: 0x00, .. } => Some(true),
            Self::Current { power: 0x10, .. } => Some(false),
            Self::Current { .. } | Self::Older { .. } => None,
        }
    }

    /// What is wrong.
    pub fn errors(&self) -> MotorErrors {
        let (Self::Current { errors, .. } | Self::Older { errors, .. }) = *self;
        errors
    }
}

impl State2 {
    fn decode(bytes: &[u8; 8]) -> Self {
        Self {
            temperature_c: bytes[field::TEMPERATURE].cast_signed(),
            iq: i16_at(bytes, field::IQ),
            speed_dps: i16_at(bytes, field::SPEED),
            encoder: u16_at(bytes, field::ENCODER),
        }
    }

    fn encode(self, command: u8) -> [u8; 8] {
        let rest = [self.iq.cast_unsigned(), self.speed_dps.cast_unsigned(), self.encoder];
        packed(command, self.temperature_c.cast_unsigned(), rest)
    }
}
