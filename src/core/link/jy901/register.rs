//! Settings of the IMU.

/// Unlocks the registers for 10 s.
pub const UNLOCK: RegisterWrite = RegisterWrite { register: 0x69, value: 0xB588 };
/// Keeps the settings permanently.
pub const SAVE: RegisterWrite = RegisterWrite { register: 0x00, value: 0 };

const CONTENT: u8 = 0x02;
const RATE: u8 = 0x03;
const BAUD: u8 = 0x04;
const READ: u8 = 0x27;
const PREFIX: [u8; 2] = [0xFF, 0xAA];

/// Rates in Hz from code 1 on.
const RATES_HZ: [f64; 11] = [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 125.0, 200.0];
/// Baud rates from code 1 on.
const BAUDS: [u32; 9] = [4800, 9600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 921_600];

/// A register and what is written to it; on the line `FF AA`, register, low byte, high byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegisterWrite {
    /// Which.
    pub register: u8,
    /// What.
    pub value: u16,
}

impl RegisterWrite {
    /// The bytes on the line.
    pub fn encode(&self) -> [u8; 5] {
        let ([first, second], [low, high]) = (PREFIX, self.value.to_le_bytes());
        [first, second, self.register, low, high]
    }

    /// Baud rate that this write sets, if it sets one.
    pub fn baud(&self) -> Option<u32> {
        (self.register == BAUD).then(|| baud_of_code(self.value)).flatten()
    }

    /// Rate in Hz that this write sets, if it sets one.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.register == RATE).then(|| rate_of_code(self.value)).flatten()
    }

    /// Content that this write sets, if it sets one.
    pub fn content(&self) -> Option<Content> {
        (self.register == CONTENT).then_some(Content(self.value))
    }

    /// Register that this write asks for, if it is such a request.
    pub fn asks_for(&self) -> Option<u8> {
        (self.register == READ).then_some(self.value as u8)
    }
}

/// Asks for a register and the three after it; the answer is a packet of [`super::Kind::Registers`].
pub fn read_registers(register: u8) -> RegisterWrite {
    RegisterWrite { register: READ, value: u16::from(register) }
}

/// Packets that are sent in each cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Content(pub u16);

impl Content {
    /// Acceleration, rate and angle: what balancing needs.
    pub const BALANCE: Self = Self(0b1110);

    /// Number of packets in a cycle.
    pub fn packets(self) -> u32 {
        (self.0 & 0x7FF).count_ones()
    }
}

/// Bits a second on the line, 10 a byte, of this many packets at this rate.
pub fn line_bit_s(packets: u32, rate_hz: f64) -> f64 {
    f64::from(packets) * 110.0 * rate_hz
}

/// A configuration that the IMU does not have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ConfigureError {
    /// No such rate.
    #[error("the IMU does not support {rate_hz} Hz: use 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 125 and 200")]
    NoSuchRate {
        /// Asked for, Hz.
        rate_hz: f64,
    },
    /// No such baud rate.
    #[error("the IMU does not support {baud} baud: use 4800 to 921600, in powers of two (57600 after 38400)")]
    NoSuchBaud {
        /// Asked for.
        baud: u32,
    },
    /// More bits than the line carries.
    #[error("{needed_bit_s} bit/s exceed the line rate of {baud}: raise the baud rate, or lower the rate")]
    LineTooSlow {
        /// Needed.
        needed_bit_s: f64,
        /// Of the line.
        baud: u32,
    },
}

/// What to send, one after the other, so that the IMU sends this content at this rate: unlock, content, rate,
/// baud rate, save. After the write of the baud rate the line has to be set to it, before saving.
///
/// # Errors
/// [`ConfigureError`].
///
/// ```
/// use flqr_core::link::jy901::{Content, configure};
///
/// let commands = configure(200.0, 115_200, Content::BALANCE)?;
/// assert_eq!(commands[0], [0xFF, 0xAA, 0x69, 0x88, 0xB5]); // unlock
/// assert!(configure(200.0, 9600, Content::BALANCE).is_err()); // too many bits for the line
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn configure(rate_hz: f64, baud: u32, content: Content) -> Result<Vec<[u8; 5]>, ConfigureError> {
    let rate = code_of(&RATES_HZ, |rate| (rate - rate_hz).abs() < 1e-9);
    let rate = rate.ok_or(ConfigureError::NoSuchRate { rate_hz })?;
    let baud_code = code_of(&BAUDS, |known| *known == baud).ok_or(ConfigureError::NoSuchBaud { baud })?;
    let needed_bit_s = line_bit_s(content.packets(), rate_hz);
    if needed_bit_s > f64::from(baud) {
        return Err(ConfigureError::LineTooSlow { needed_bit_s, baud });
    }
    let write = |register, value| RegisterWrite { register, value };
    let writes = [UNLOCK, write(CONTENT, content.0), write(RATE, rate), write(BAUD, baud_code), SAVE];
    Ok(writes.iter().map(RegisterWrite::encode).collect())
}

fn code_of<T>(known: &[T], is_it: impl Fn(&T) -> bool) -> Option<u16> {
    known.iter().position(is_it).map(|at| at as u16 + 1)
}

/// Rate in Hz of a code of the rate register; none of 0x0C (single) and 0x0D (none).
pub fn rate_of_code(code: u16) -> Option<f64> {
    RATES_HZ.get(usize::from(code).checked_sub(1)?).copied()
}

/// Baud rate of a code of the baud register.
pub fn baud_of_code(code: u16) -> Option<u32> {
    BAUDS.get(usize::from(code).checked_sub(1)?).copied()
}

/// Finds register writes in what is sent to an IMU: the side of an emulated one.
#[derive(Clone, Debug, Default)]
pub struct RegisterWriteDecoder {
    window: [u8; 5],
    filled: usize,
}

impl RegisterWriteDecoder {
    /// The next write in `input`, which loses the bytes that were read; none once all are read.
    pub fn next(&mut self, input: &mut &[u8]) -> Option<RegisterWrite> {
        while let Some((byte, rest)) = input.split_first() {
            *input = rest;
            self.window[self.filled] = *byte;
            self.filled += 1;
            while self.filled > 0 && self.window[..self.filled.min(2)] != PREFIX[..self.filled.min(2)] {
                self.window.copy_within(1..self.filled, 0);
                self.filled -= 1;
            }
            if let (5, [_, _, register, low, high]) = (self.filled, self.window) {
                self.filled = 0;
                return Some(RegisterWrite { register, value: u16::from_le_bytes([low, high]) });
            }
        }
        None
    }
}
