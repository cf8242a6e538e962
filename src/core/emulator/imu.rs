//! The IMU, from its side: packets out, register writes in.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use crate::link::jy901::{Content, Kind, Packet, RegisterWrite, RegisterWriteDecoder, UNLOCK, line_bit_s};
use crate::model::{LinkSettings, PitchAxis, SensorSettings, TICK_S};

/// From a reading until its last byte is received.
const ON_THE_LINE: Duration = Duration::from_micros(500);
/// Unlock time of registers, ticks.
const UNLOCKED_TICKS: u64 = 10_000;
/// Tells it to send nothing.
const STOP: RegisterWrite = RegisterWrite { register: 0x03, value: 0x0D };
const TEMPERATURE_C: f64 = 31.0;
const VERSION: u16 = 0x2F10;
/// Baud rate that it starts with: the slowest of its line that carries 200 Hz.
const BAUD: u32 = 115_200;
/// Most cycles that wait to be read.
const WAITING: usize = 256;

/// Motion measured by the IMU, forward positive.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Attitude {
    pub(super) pitch_rad: f64,
    pub(super) pitch_rate_rad_s: f64,
    pub(super) yaw_rad: f64,
    pub(super) yaw_rate_rad_s: f64,
    /// Acceleration less that of gravity, along the body's forward and up axes, in units of gravity.
    pub(super) forward_g: f64,
    pub(super) up_g: f64,
}

/// Current settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Health {
    Well,
    Silent,
    Frozen,
    AngleFrozen,
    RateZero,
    AngleOff(f64),
}

/// A JY901 on the body.
#[derive(Clone, Debug)]
pub(super) struct EmulatedImu {
    axis: PitchAxis,
    sign: f64,
    latency_ticks: u64,
    /// `None` if output is disabled.
    period_ticks: Option<u64>,
    content: Content,
    baud: u32,
    line_free_tick: u64,
    unlocked_until: u64,
    registers: BTreeMap<u8, u16>,
    writes: RegisterWriteDecoder,
    health: Health,
    /// Pitch when its health changed, rad.
    last_pitch_rad: f64,
    packets: Vec<Packet>,
    outgoing: VecDeque<(Duration, Vec<u8>)>,
}

impl EmulatedImu {
    pub(super) fn new(wiring: &LinkSettings, sensors: &SensorSettings) -> Self {
        Self {
            axis: wiring.pitch_axis,
            sign: wiring.pitch_direction.sign(),
            latency_ticks: (sensors.imu_latency_s / TICK_S).round() as u64,
            period_ticks: Some(u64::from(sensors.imu_period_ticks())),
            content: Content::BALANCE,
            baud: BAUD,
            line_free_tick: 0,
            unlocked_until: 0,
            registers: BTreeMap::new(),
            writes: RegisterWriteDecoder::default(),
            health: Health::Well,
            last_pitch_rad: 0.0,
            packets: Vec::new(),
            outgoing: VecDeque::new(),
        }
    }

    pub(super) fn set_health(&mut self, health: Health, pitch_rad: f64) {
        (self.health, self.last_pitch_rad) = (health, pitch_rad);
    }

    /// Sends what is due at a tick.
    pub(super) fn tick(&mut self, tick: u64, attitude: &Attitude) {
        let Some(period) = self.period_ticks else { return };
        // The first reading is at hand at once, as that of the simulated sensors.
        let due = tick == 0 || tick.checked_sub(self.latency_ticks).is_some_and(|age| age % period == 0);
        if !due || self.health == Health::Silent {
            return;
        }
        if self.health != Health::Frozen || self.packets.is_empty() {
            self.packets = self.cycle(&self.felt(attitude));
        }
        // A line that is too slow loses cycles.
        if tick >= self.line_free_tick {
            let bits = line_bit_s(self.packets.len() as u32, 1.0);
            self.line_free_tick = tick + (bits / f64::from(self.baud) / TICK_S) as u64;
            let bytes = self.packets.iter().flat_map(Packet::encode).collect();
            self.send(tick, bytes);
        }
    }

    fn send(&mut self, tick: u64, bytes: Vec<u8>) {
        if self.outgoing.len() == WAITING {
            self.outgoing.pop_front();
        }
        self.outgoing.push_back((Duration::from_millis(tick) + ON_THE_LINE, bytes));
    }

    /// The bytes that have gone over the line by `now`.
    pub(super) fn bytes(&mut self, now: Duration) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some((_, cycle)) = self.outgoing.pop_front_if(|(due, _)| *due <= now) {
            bytes.extend(cycle);
        }
        bytes
    }

    /// Takes in bytes; gives the rate that it is set to from now on, Hz, if that changes.
    pub(super) fn receive(&mut self, tick: u64, mut bytes: &[u8]) -> Option<f64> {
        let mut rate_hz = None;
        while let Some(write) = self.writes.next(&mut bytes) {
            rate_hz = self.obey(tick, write).or(rate_hz);
        }
        rate_hz
    }

    fn obey(&mut self, tick: u64, write: RegisterWrite) -> Option<f64> {
        if let Some(first) = write.asks_for() {
            let register = |offset: u8| self.registers.get(&first.wrapping_add(offset)).copied().unwrap_or(0);
            let words = [0, 1, 2, 3].map(|offset| register(offset).cast_signed());
            self.send(tick, Packet::new(Kind::Registers, words).encode().to_vec());
            return None;
        }
        if write == UNLOCK {
            self.unlocked_until = tick + UNLOCKED_TICKS;
            return None;
        }
        if tick >= self.unlocked_until {
            return None;
        }
        self.registers.insert(write.register, write.value);
        self.content = write.content().unwrap_or(self.content);
        self.baud = write.baud().unwrap_or(self.baud);
        if write == STOP {
            self.period_ticks = None;
        }
        let rate_hz = write.rate_hz()?;
        self.period_ticks = Some((1.0 / (rate_hz * TICK_S)).round() as u64);
        Some(rate_hz)
    }

    /// Values reported instead of the true ones.
    fn felt(&self, attitude: &Attitude) -> Attitude {
        match self.health {
            Health::AngleFrozen => Attitude { pitch_rad: self.last_pitch_rad, ..*attitude },
            Health::RateZero => Attitude { pitch_rate_rad_s: 0.0, yaw_rate_rad_s: 0.0, ..*attitude },
            Health::AngleOff(off_rad) => Attitude { pitch_rad: attitude.pitch_rad + off_rad, ..*attitude },
            Health::Well | Health::Silent | Health::Frozen => *attitude,
        }
    }

    fn cycle(&self, attitude: &Attitude) -> Vec<Packet> {
        let Attitude { pitch_rad, pitch_rate_rad_s, yaw_rad, yaw_rate_rad_s, forward_g, up_g } = *attitude;
        let (angle, rate, along) =
            (self.sign * pitch_rad, self.sign * pitch_rate_rad_s, self.sign * forward_g);
        let yaw = yaw_rad.sin().atan2(yaw_rad.cos());
        // At rest the acceleration points up: y is up for a positive roll, x down for a positive pitch.
        let [acceleration, rates, angles] = match self.axis {
            PitchAxis::Roll => [[0.0, -along, up_g], [rate, 0.0, yaw_rate_rad_s], [angle, 0.0, yaw]],
            PitchAxis::Pitch => [[along, 0.0, up_g], [0.0, rate, yaw_rate_rad_s], [0.0, angle, yaw]],
        };
        [
            (1, Packet::acceleration(acceleration, TEMPERATURE_C)),
            (2, Packet::rate(rates, TEMPERATURE_C)),
            (3, Packet::angle(angles, VERSION)),
        ]
        .into_iter()
        .filter_map(|(bit, packet)| (self.content.0 >> bit & 1 == 1).then_some(packet))
        .collect()
    }
}
