//! One packet and what its words mean.

use std::f64::consts::PI;

use super::PACKET_BYTES;

const HEADER: u8 = 0x55;
const FULL_SCALE: f64 = 32_768.0;
const ACCELERATION_G: f64 = 16.0;
const RATE_RAD_S: f64 = 2000.0 / 180.0 * PI;

/// What a packet is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Kind {
    /// Date and time.
    Time = 0x50,
    /// Acceleration and temperature.
    Acceleration = 0x51,
    /// Angular rate and temperature.
    Rate = 0x52,
    /// Roll, pitch and yaw.
    Angle = 0x53,
    /// Magnetic field and temperature.
    MagneticField = 0x54,
    /// Ports.
    Ports = 0x55,
    /// Pressure and height.
    Pressure = 0x56,
    /// Position (GPS).
    Position = 0x57,
    /// Speed (GPS).
    Speed = 0x58,
    /// Quaternion.
    Quaternion = 0x59,
    /// Accuracy (GPS).
    Accuracy = 0x5A,
    /// Answer to a request for registers.
    Registers = 0x5F,
}

impl Kind {
    /// The kind with this code; none of codes that are not packets.
    pub fn of(code: u8) -> Option<Self> {
        Some(match code {
            0x50 => Self::Time,
            0x51 => Self::Acceleration,
            0x52 => Self::Rate,
            0x53 => Self::Angle,
            0x54 => Self::MagneticField,
            0x55 => Self::Ports,
            0x56 => Self::Pressure,
            0x57 => Self::Position,
            0x58 => Self::Speed,
            0x59 => Self::Quaternion,
            0x5A => Self::Accuracy,
            0x5F => Self::Registers,
            _ => return None,
        })
    }

    /// Its code, the second byte of a packet.
    pub fn code(self) -> u8 {
        self as u8
    }
}

/// An intact packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet {
    /// What it is about.
    pub kind: Kind,
    /// Its 8 bytes of data.
    pub data: [u8; 8],
}

/// What a packet says. Axes are those of the IMU: x right, y forward, z up; angles in the order z-y-x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Date and time, as the IMU believes them: how years and months count differs between sources.
    Time {
        /// Year, month, day, hour, minute, second.
        fields: [u8; 6],
        /// Milliseconds.
        milliseconds: u16,
    },
    /// Acceleration; at standstill, it points up.
    Acceleration {
        /// Along x, y, z, in units of g.
        acceleration_g: [f64; 3],
        /// °C.
        temperature_c: f64,
    },
    /// Angular rate.
    Rate {
        /// About x, y, z, rad/s.
        rate_rad_s: [f64; 3],
        /// °C; some firmwares put the voltage or 0 here.
        temperature_c: f64,
    },
    /// Angles.
    Angle {
        /// Roll, pitch, yaw, rad.
        angle_rad: [f64; 3],
        /// Version of the firmware; older ones put the temperature here.
        version: u16,
    },
    /// Magnetic field.
    MagneticField {
        /// Along x, y, z, raw.
        field: [i16; 3],
        /// °C.
        temperature_c: f64,
    },
    /// Attitude.
    Quaternion([f64; 4]),
    /// Four registers from the one that was requested on.
    Registers([u16; 4]),
    /// A packet whose words are not interpreted: ports, pressure and GPS.
    Words {
        /// What it is about.
        kind: Kind,
        /// The words.
        words: [i16; 4],
    },
}

impl Packet {
    /// A packet of four words.
    pub fn new(kind: Kind, words: [i16; 4]) -> Self {
        let [[a, b], [c, d], [e, f], [g, h]] = words.map(i16::to_le_bytes);
        Self { kind, data: [a, b, c, d, e, f, g, h] }
    }

    /// What the IMU sends at these accelerations in units of g, at most ±16, and this temperature, °C.
    pub fn acceleration(acceleration_g: [f64; 3], temperature_c: f64) -> Self {
        let [x, y, z] = acceleration_g.map(|g| count(g / ACCELERATION_G));
        Self::new(Kind::Acceleration, [x, y, z, hundredths(temperature_c)])
    }

    /// What the IMU sends at these rates, rad/s, at most ±2000 °/s, and this temperature, °C.
    pub fn rate(rate_rad_s: [f64; 3], temperature_c: f64) -> Self {
        let [x, y, z] = rate_rad_s.map(|rate| count(rate / RATE_RAD_S));
        Self::new(Kind::Rate, [x, y, z, hundredths(temperature_c)])
    }

    /// What the IMU sends at these angles, rad, within ±π, with the version of its firmware.
    pub fn angle(roll_pitch_yaw_rad: [f64; 3], version: u16) -> Self {
        let [x, y, z] = roll_pitch_yaw_rad.map(|angle| count(angle / PI));
        Self::new(Kind::Angle, [x, y, z, version.cast_signed()])
    }

    /// The packet of these 11 bytes, if they are one: header, kind and sum are right.
    pub fn decode(bytes: &[u8; PACKET_BYTES]) -> Option<Self> {
        let [HEADER, code, data @ .., sum] = *bytes else { return None };
        (sum_of(code, data) == sum).then_some(Self { kind: Kind::of(code)?, data })
    }

    /// Whether a packet can begin with these bytes, 2 or more.
    pub(super) fn may_begin(bytes: &[u8]) -> bool {
        bytes[0] == HEADER && bytes.get(1).is_none_or(|code| Kind::of(*code).is_some())
    }

    /// The 11 bytes on the line.
    pub fn encode(&self) -> [u8; PACKET_BYTES] {
        let (code, [a, b, c, d, e, f, g, h]) = (self.kind.code(), self.data);
        [HEADER, code, a, b, c, d, e, f, g, h, sum_of(code, self.data)]
    }

    fn words(&self) -> [i16; 4] {
        let [a, b, c, d, e, f, g, h] = self.data;
        [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes)
    }

    /// What it says.
    ///
    /// ```
    /// use flqr_core::link::jy901::{Packet, Reading};
    ///
    /// let bytes = Packet::angle([0.1, 0.0, 0.0], 0).encode();
    /// let packet = Packet::decode(&bytes).ok_or("wrong checksum")?;
    /// let Reading::Angle { angle_rad: [roll_rad, ..], .. } = packet.reading() else {
    ///     return Err("not an angle".into());
    /// };
    /// assert!((roll_rad - 0.1).abs() < 1e-4);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn reading(&self) -> Reading {
        let [x, y, z, last] = self.words();
        let scaled = |full: f64| [x, y, z].map(|word| f64::from(word) / FULL_SCALE * full);
        let temperature_c = f64::from(last) / 100.0;
        match self.kind {
            Kind::Time => {
                let [fields @ .., low, high] = self.data;
                Reading::Time { fields, milliseconds: u16::from_le_bytes([low, high]) }
            }
            Kind::Acceleration => {
                Reading::Acceleration { acceleration_g: scaled(ACCELERATION_G), temperature_c }
            }
            Kind::Rate => Reading::Rate { rate_rad_s: scaled(RATE_RAD_S), temperature_c },
            Kind::Angle => Reading::Angle { angle_rad: scaled(PI), version: last.cast_unsigned() },
            Kind::MagneticField => Reading::MagneticField { field: [x, y, z], temperature_c },
            Kind::Quaternion => Reading::Quaternion([x, y, z, last].map(|word| f64::from(word) / FULL_SCALE)),
            Kind::Registers => Reading::Registers([x, y, z, last].map(i16::cast_unsigned)),
            kind => Reading::Words { kind, words: [x, y, z, last] },
        }
    }
}

fn sum_of(code: u8, data: [u8; 8]) -> u8 {
    data.iter().fold(HEADER.wrapping_add(code), |sum, byte| sum.wrapping_add(*byte))
}

/// Nearest count of a fraction of the full scale; what is beyond it stops at its end.
fn count(share: f64) -> i16 {
    (share * FULL_SCALE).round() as i16
}

fn hundredths(value: f64) -> i16 {
    (value * 100.0).round() as i16
}
