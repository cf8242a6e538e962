//! Commands to a motor.

use super::{MotorId, field, i16_at, u16_at, u32_at};
use crate::link::{Frame, WireError};

/// One command to one motor.
///
/// Angles are in 0.01°, speeds in 0.01 °/s, speed limits in 1 °/s, all of the output shaft; currents are raw.
/// [`Command::TorqueCurrent`] is not limited by the drive's own greatest torque current: the sender limits it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// 0x80: power off; turn count and last command are cleared, the motor still answers.
    Off,
    /// 0x88: power on, as it is after power-up.
    On,
    /// 0x81: stop; the state is kept.
    Stop,
    /// 0x8C: holding brake.
    Brake(Brake),
    /// 0x9A: temperature, voltage, errors.
    ReadState1,
    /// 0x9B: forget errors whose cause is gone.
    ClearErrors,
    /// 0x9C: temperature, current, speed, encoder.
    ReadState2,
    /// 0x9D: phase currents.
    ReadState3,
    /// 0xA0: voltage without any loop, −850 to 850; MS series only.
    OpenLoop {
        /// Raw.
        power: i16,
    },
    /// 0xA1: torque current, −2048 to 2048.
    TorqueCurrent {
        /// Raw.
        iq: i16,
    },
    /// 0xA2: speed; protocol 2.36 has a limit of the current, which is 0 in 2.35.
    Speed {
        /// 0.01 °/s.
        speed_cdps: i32,
        /// Raw.
        iq_limit: i16,
    },
    /// 0xAD: speed with a limit of the current, as protocol 2.35 has it.
    SpeedLimited {
        /// 0.01 °/s.
        speed_cdps: i32,
        /// Raw.
        iq_limit: i16,
    },
    /// 0xA3: angle over many turns.
    Angle {
        /// 0.01°.
        angle_cdeg: i32,
    },
    /// 0xA4: the same with a limit of the speed.
    AngleLimited {
        /// 0.01°.
        angle_cdeg: i32,
        /// °/s.
        max_speed_dps: u16,
    },
    /// 0xA5: angle within a turn.
    TurnAngle {
        /// Way to go there.
        sense: SenseOfRotation,
        /// 0.01°.
        angle_cdeg: u32,
    },
    /// 0xA6: the same with a limit of the speed.
    TurnAngleLimited {
        /// Way to go there.
        sense: SenseOfRotation,
        /// 0.01°.
        angle_cdeg: u32,
        /// °/s.
        max_speed_dps: u16,
    },
    /// 0xA7: turn on by an angle.
    Step {
        /// 0.01°.
        angle_cdeg: i32,
    },
    /// 0xA8: the same with a limit of the speed.
    StepLimited {
        /// 0.01°.
        angle_cdeg: i32,
        /// °/s.
        max_speed_dps: u16,
    },
    /// 0x90: encoder and its offset.
    ReadEncoder,
    /// 0x92: angle over many turns.
    ReadAngle,
    /// 0x94: angle within a turn.
    ReadTurnAngle,
    /// 0x95: call the present angle this, until power is taken off.
    SetAngle {
        /// 0.01°.
        angle_cdeg: i32,
    },
    /// 0x19: make the present angle zero permanently; wears the memory.
    WriteZero,
    /// 0x91: make this encoder reading zero permanently (protocol 2.35); wears the memory.
    WriteOffset {
        /// Raw.
        offset: u16,
    },
    /// Parameters of the drive's own loops; their layout differs from version to version and is left as it is.
    Parameters {
        /// Which version, to read or to write.
        access: ParameterAccess,
        /// Bytes 1 to 7.
        bytes: [u8; 7],
    },
}

/// What the holding brake is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brake {
    /// Hold.
    Engage = 0x00,
    /// Let go.
    Release = 0x01,
    /// Say how it stands.
    Read = 0x10,
}

/// Sense in which an angle within a turn is approached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SenseOfRotation {
    /// Clockwise.
    Clockwise = 0,
    /// Counter-clockwise.
    Counterclockwise = 1,
}

/// Commands that read and write parameters, by version of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterAccess {
    /// 2.36; byte 1 is the parameter.
    Read236 = 0xC0,
    /// 2.36; byte 1 is the parameter.
    Write236 = 0xC1,
    /// 2.35.
    Read235 = 0xB0,
    /// 2.35.
    Write235 = 0xB1,
    /// Older: gains.
    ReadGains = 0x30,
    /// Older: gains, until power is taken off.
    WriteGains = 0x31,
    /// Older: gains, permanently.
    StoreGains = 0x32,
    /// Older: acceleration.
    ReadAcceleration = 0x33,
    /// Older: acceleration.
    WriteAcceleration = 0x34,
}

impl ParameterAccess {
    const ALL: [Self; 9] = [
        Self::Read236,
        Self::Write236,
        Self::Read235,
        Self::Write235,
        Self::ReadGains,
        Self::WriteGains,
        Self::StoreGains,
        Self::ReadAcceleration,
        Self::WriteAcceleration,
    ];

    fn of(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|access| *access as u8 == code)
    }
}

impl Command {
    /// The frame to this motor.
    ///
    /// ```
    /// use flqr_core::link::lk::{Command, MotorId};
    ///
    /// let motor = MotorId::new(1).ok_or("not a motor id")?;
    /// let frame = Command::TorqueCurrent { iq: 100 }.frame(motor);
    /// assert_eq!((frame.id().raw(), frame.bytes()), (0x141, &[0xA1, 0, 0, 0, 100, 0, 0, 0][..]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn frame(&self, motor: MotorId) -> Frame {
        Frame::full(motor.command_id(), self.encode())
    }

    /// Byte 0.
    pub fn code(&self) -> u8 {
        match self {
            Self::Off => 0x80,
            Self::On => 0x88,
            Self::Stop => 0x81,
            Self::Brake(_) => 0x8C,
            Self::ReadState1 => 0x9A,
            Self::ClearErrors => 0x9B,
            Self::ReadState2 => 0x9C,
            Self::ReadState3 => 0x9D,
            Self::OpenLoop { .. } => 0xA0,
            Self::TorqueCurrent { .. } => 0xA1,
            Self::Speed { .. } => 0xA2,
            Self::SpeedLimited { .. } => 0xAD,
            Self::Angle { .. } => 0xA3,
            Self::AngleLimited { .. } => 0xA4,
            Self::TurnAngle { .. } => 0xA5,
            Self::TurnAngleLimited { .. } => 0xA6,
            Self::Step { .. } => 0xA7,
            Self::StepLimited { .. } => 0xA8,
            Self::ReadEncoder => 0x90,
            Self::ReadAngle => 0x92,
            Self::ReadTurnAngle => 0x94,
            Self::SetAngle { .. } => 0x95,
            Self::WriteZero => 0x19,
            Self::WriteOffset { .. } => 0x91,
            Self::Parameters { access, .. } => *access as u8,
        }
    }

    /// Returns whether the motor only answers it and does nothing else.
    pub fn is_query(&self) -> bool {
        use ParameterAccess::{Read235, Read236, ReadAcceleration, ReadGains};
        match self {
            Self::ReadState1
            | Self::ReadState2
            | Self::ReadState3
            | Self::Brake(Brake::Read)
            | Self::ReadEncoder
            | Self::ReadAngle
            | Self::ReadTurnAngle => true,
            Self::Parameters { access, .. } => {
                matches!(access, Read236 | Read235 | ReadGains | ReadAcceleration)
            }
            _ => false,
        }
    }

    /// The 8 bytes.
    pub fn encode(&self) -> [u8; 8] {
        let (one, two, four) = self.fields();
        let [two_low, two_high] = two.to_le_bytes();
        let [a, b, c, d] = four.to_le_bytes();
        match *self {
            Self::Parameters { access, bytes: [a, b, c, d, e, f, g] } => [access as u8, a, b, c, d, e, f, g],
            _ => [self.code(), one, two_low, two_high, a, b, c, d],
        }
    }

    /// Byte 1, bytes 2 and 3, bytes 4 to 7: of these every command is made.
    fn fields(&self) -> (u8, u16, u32) {
        match *self {
            Self::Brake(action) => (action as u8, 0, 0),
            Self::OpenLoop { power: value } | Self::TorqueCurrent { iq: value } => {
                (0, 0, u32::from(value.cast_unsigned()))
            }
            Self::Speed { speed_cdps, iq_limit } | Self::SpeedLimited { speed_cdps, iq_limit } => {
                (0, iq_limit.cast_unsigned(), speed_cdps.cast_unsigned())
            }
            Self::Angle { angle_cdeg } | Self::Step { angle_cdeg } | Self::SetAngle { angle_cdeg } => {
                (0, 0, angle_cdeg.cast_unsigned())
            }
            Self::AngleLimited { angle_cdeg, max_speed_dps }
            | Self::StepLimited { angle_cdeg, max_speed_dps } => {
                (0, max_speed_dps, angle_cdeg.cast_unsigned())
            }
            Self::TurnAngle { sense, angle_cdeg } => (sense as u8, 0, angle_cdeg),
            Self::TurnAngleLimited { sense, angle_cdeg, max_speed_dps } => {
                (sense as u8, max_speed_dps, angle_cdeg)
            }
            Self::WriteOffset { offset } => (0, 0, u32::from(offset) << 16),
            _ => (0, 0, 0),
        }
    }

    /// The command that has exactly these bytes.
    ///
    /// # Errors
    /// [`WireError::UnknownCommand`], and [`WireError::InvalidField`] if a byte that should be 0 is not or a field has
    /// no such value.
    pub fn decode(bytes: [u8; 8]) -> Result<Self, WireError> {
        let command = Self::read(&bytes).ok_or(WireError::UnknownCommand(bytes[field::COMMAND]))?;
        match command.encode() == bytes {
            true => Ok(command),
            false => Err(WireError::InvalidField { command: bytes[field::COMMAND] }),
        }
    }

    fn read(bytes: &[u8; 8]) -> Option<Self> {
        let sense = match bytes[field::OPTION] {
            1 => SenseOfRotation::Counterclockwise,
            _ => SenseOfRotation::Clockwise,
        };
        let (value, limit) = (u32_at(bytes, field::VALUE), u16_at(bytes, field::LIMIT));
        let current = i16_at(bytes, field::CURRENT);
        Some(match bytes[field::COMMAND] {
            0x80 => Self::Off,
            0x88 => Self::On,
            0x81 => Self::Stop,
            0x8C => Self::Brake(match bytes[field::OPTION] {
                0x00 => Brake::Engage,
                0x01 => Brake::Release,
                _ => Brake::Read,
            }),
            0x9A => Self::ReadState1,
            0x9B => Self::ClearErrors,
            0x9C => Self::ReadState2,
            0x9D => Self::ReadState3,
            0xA0 => Self::OpenLoop { power: current },
            0xA1 => Self::TorqueCurrent { iq: current },
            0xA2 => Self::Speed { speed_cdps: value.cast_signed(), iq_limit: limit.cast_signed() },
            0xAD => Self::SpeedLimited { speed_cdps: value.cast_signed(), iq_limit: limit.cast_signed() },
            0xA3 => Self::Angle { angle_cdeg: value.cast_signed() },
            0xA4 => Self::AngleLimited { angle_cdeg: value.cast_signed(), max_speed_dps: limit },
            0xA5 => Self::TurnAngle { sense, angle_cdeg: value },
            0xA6 => Self::TurnAngleLimited { sense, angle_cdeg: value, max_speed_dps: limit },
            0xA7 => Self::Step { angle_cdeg: value.cast_signed() },
            0xA8 => Self::StepLimited { angle_cdeg: value.cast_signed(), max_speed_dps: limit },
            0x90 => Self::ReadEncoder,
            0x92 => Self::ReadAngle,
            0x94 => Self::ReadTurnAngle,
            0x95 => Self::SetAngle { angle_cdeg: value.cast_signed() },
            0x19 => Self::WriteZero,
            0x91 => Self::WriteOffset { offset: u16_at(bytes, field::OFFSET) },
            code => {
                let [_, rest @ ..] = *bytes;
                Self::Parameters { access: ParameterAccess::of(code)?, bytes: rest }
            }
        })
    }
}
