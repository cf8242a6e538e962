//! What the IMU says, in SI units, in the robot's axes.

use std::time::Duration;

use super::jy901::{Kind, Packet, Reading};
use crate::model::{LinkSettings, PitchAxis};

/// One reading of the IMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// When its last byte was received.
    pub time: Duration,
    /// Pitch, forward positive, rad.
    pub pitch_rad: f64,
    /// Pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
    /// Pitch that the direction of the measured acceleration gives, rad; none of an IMU that sends no
    /// acceleration.
    pub tilt_rad: Option<f64>,
    /// Yaw rate, left positive, rad/s; none of a robot whose pitch is described by a DBC file.
    pub yaw_rate_rad_s: Option<f64>,
    /// Temperature, °C, if it is sent.
    pub temperature_c: Option<f64>,
}

/// Makes readings of the packets of a JY901, by how it is mounted.
///
/// In each cycle the IMU sends its packets in the order of their codes. A reading is made of an angle and the
/// rate before it in the same cycle; a cycle that has lost one of the two gives none.
#[derive(Clone, Debug)]
pub struct ImuAssembler {
    axis: PitchAxis,
    sign: f64,
    cycle_s: f64,
    last: Option<Kind>,
    rate: Option<Rate>,
    tilt_rad: Option<f64>,
    temperature_c: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Rate {
    time: Duration,
    pitch_rate_rad_s: f64,
    yaw_rate_rad_s: f64,
}

impl ImuAssembler {
    /// For an IMU that is mounted and set as these settings say.
    pub fn new(settings: &LinkSettings) -> Self {
        Self {
            axis: settings.pitch_axis,
            sign: settings.pitch_direction.sign(),
            cycle_s: 1.0 / f64::from(settings.imu_rate_hz),
            last: None,
            rate: None,
            tilt_rad: None,
            temperature_c: None,
        }
    }

    /// Takes in a packet and when its last byte was received; gives a reading where it completes one.
    pub fn push(&mut self, time: Duration, packet: &Packet) -> Option<ImuReading> {
        if !matches!(packet.kind, Kind::Acceleration | Kind::Rate | Kind::Angle) {
            return None;
        }
        if self.last.replace(packet.kind).is_none_or(|last| packet.kind <= last) {
            self.begin_cycle();
        }
        match packet.reading() {
            Reading::Acceleration { acceleration_g, temperature_c } => {
                self.tilt_rad = Some(self.sign * self.tilt_rad(acceleration_g));
                self.temperature_c = Some(temperature_c);
                None
            }
            Reading::Rate { rate_rad_s, .. } => {
                let pitch_rate_rad_s = self.sign * self.about_axis(rate_rad_s);
                // The IMU's z axis points up.
                self.rate = Some(Rate { time, pitch_rate_rad_s, yaw_rate_rad_s: rate_rad_s[2] });
                None
            }
            Reading::Angle { angle_rad, .. } => self.complete(time, self.sign * self.about_axis(angle_rad)),
            _ => None,
        }
    }

    fn begin_cycle(&mut self) {
        (self.rate, self.tilt_rad, self.temperature_c) = (None, None, None);
    }

    fn complete(&mut self, time: Duration, pitch_rad: f64) -> Option<ImuReading> {
        let rate = self.rate.take()?;
        // Where no acceleration is sent, two losses in a row can leave a rate of the cycle before.
        if time.saturating_sub(rate.time).as_secs_f64() >= self.cycle_s && self.tilt_rad.is_none() {
            return None;
        }
        Some(ImuReading {
            time,
            pitch_rad,
            pitch_rate_rad_s: rate.pitch_rate_rad_s,
            tilt_rad: self.tilt_rad,
            yaw_rate_rad_s: Some(rate.yaw_rate_rad_s),
            temperature_c: self.temperature_c,
        })
    }

    fn about_axis(&self, [roll, pitch, _]: [f64; 3]) -> f64 {
        match self.axis {
            PitchAxis::Roll => roll,
            PitchAxis::Pitch => pitch,
        }
    }

    /// Roll or pitch of an IMU at standstill, whose acceleration points up (angles in the order z-y-x).
    fn tilt_rad(&self, [x, y, z]: [f64; 3]) -> f64 {
        match self.axis {
            PitchAxis::Roll => y.atan2(z),
            PitchAxis::Pitch => (-x).atan2(y.hypot(z)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Turn;

    const ACCELERATION: [f64; 3] = [0.0, 0.0, 1.0];

    fn packets(roll: f64, pitch: f64, rates: [f64; 3]) -> [Packet; 3] {
        let up = [-pitch.sin(), roll.sin() * pitch.cos(), roll.cos() * pitch.cos()];
        [Packet::acceleration(up, 31.5), Packet::rate(rates, 0.0), Packet::angle([roll, pitch, 1.0], 1)]
    }

    fn readings(settings: &LinkSettings, packets: &[(f64, Packet)]) -> Vec<ImuReading> {
        let mut assembler = ImuAssembler::new(settings);
        packets.iter().filter_map(|(s, packet)| assembler.push(Duration::from_secs_f64(*s), packet)).collect()
    }

    #[test]
    fn a_cycle_is_a_reading_in_the_robots_axes() {
        use {PitchAxis::*, Turn::*};
        let cycle = packets(0.2, -0.1, [1.0, 2.0, 3.0]);
        for (pitch_axis, pitch_direction, expected) in [
            (Roll, Forward, (0.2, 1.0)),
            (Roll, Backward, (-0.2, -1.0)),
            (Pitch, Forward, (-0.1, 2.0)),
            (Pitch, Backward, (0.1, -2.0)),
        ] {
            let settings = LinkSettings { pitch_axis, pitch_direction, ..LinkSettings::default() };
            let timed: Vec<_> = [0.001, 0.002, 0.003].into_iter().zip(cycle).collect();
            let [reading] = readings(&settings, &timed)[..] else { panic!("one reading of a cycle") };
            assert_eq!(reading.time, Duration::from_millis(3));
            assert_eq!(reading.temperature_c, Some(31.5));
            assert!((reading.pitch_rad - expected.0).abs() < 5e-5, "{reading:?}");
            assert!((reading.pitch_rate_rad_s - expected.1).abs() < 6e-4, "{reading:?}");
            assert!((reading.tilt_rad.unwrap() - expected.0).abs() < 5e-4, "{reading:?}");
            assert!((reading.yaw_rate_rad_s.unwrap() - 3.0).abs() < 6e-4, "{reading:?}");
        }
    }

    #[test]
    fn an_angle_never_goes_with_the_rate_of_another_cycle() {
        let [acceleration, rate, angle] = packets(0.1, 0.0, [1.0, 0.0, 0.0]);
        let [_, next_rate, next_angle] = packets(0.3, 0.0, [5.0, 0.0, 0.0]);
        let settings = LinkSettings::default();
        let of = |packets: &[(f64, Packet)]| {
            let pairs = readings(&settings, packets);
            pairs
                .iter()
                .map(|r| (r.pitch_rad * 10.0).round() + r.pitch_rate_rad_s.round())
                .collect::<Vec<_>>()
        };
        let (a, b) = (0.0, 0.005);
        assert_eq!(
            of(&[(a, acceleration), (a, rate), (a, angle), (b, next_rate), (b, next_angle)]),
            [2.0, 8.0]
        );
        assert_eq!(of(&[(a, acceleration), (a, rate), (b, acceleration), (b, next_angle)]), [0.0; 0]);
        assert_eq!(
            of(&[(a, acceleration), (a, angle), (b, acceleration), (b, next_rate), (b, next_angle)]),
            [8.0]
        );
        assert_eq!(of(&[(a, rate), (b, next_angle)]), [0.0; 0], "too late to be of the same cycle");
        assert_eq!(of(&[(a, rate), (b, next_rate), (b, next_angle)]), [8.0]);
        assert_eq!(of(&[(a, rate), (a, angle), (a, angle)]), [2.0]);
    }

    #[test]
    fn an_imu_without_acceleration_has_no_tilt() {
        let [_, rate, angle] = packets(0.1, 0.0, [0.0; 3]);
        let quaternion = Packet::new(Kind::Quaternion, [0; 4]);
        let sent = [(0.0, rate), (0.001, quaternion), (0.002, angle)];
        let [reading] = readings(&LinkSettings::default(), &sent)[..] else { panic!("one reading") };
        assert_eq!((reading.tilt_rad, reading.temperature_c), (None, None));
    }

    #[test]
    fn an_imu_that_lies_level_has_no_tilt_either_way() {
        for pitch_axis in [PitchAxis::Roll, PitchAxis::Pitch] {
            let assembler = ImuAssembler::new(&LinkSettings { pitch_axis, ..LinkSettings::default() });
            assert_eq!(assembler.tilt_rad(ACCELERATION), 0.0);
        }
    }
}
