//! Sensors of the robot: encoders, motor speeds and IMU, each at its own rate.

use std::collections::VecDeque;

use super::noise::Noise;
use super::simulation::TICK_S;
use crate::model::SensorSettings;
use crate::record::Readings;

/// Step of a recorder's time stamps, s.
const STAMP_STEP_S: f64 = 1e-6;

/// The sensors with their noise and what they hold between readings.
#[derive(Clone, Debug)]
pub(super) struct Sensors {
    settings: SensorSettings,
    speed_noise: [Noise; 2],
    imu_noise: Noise,
    stamp_noise: Noise,
    held: Readings,
    /// IMU readings that have not arrived: tick of arrival, pitch, pitch rate.
    under_way: VecDeque<(u64, f64, f64)>,
    last_stamp_s: f64,
}

impl Sensors {
    /// Noise takes the streams `first_stream` to `first_stream + 3` of the seed.
    pub(super) fn new(settings: SensorSettings, seed: u64, first_stream: u64) -> Self {
        Self {
            settings,
            speed_noise: [0, 1].map(|motor| Noise::new(seed, first_stream + motor)),
            imu_noise: Noise::new(seed, first_stream + 2),
            stamp_noise: Noise::new(seed, first_stream + 3),
            held: Readings::default(),
            under_way: VecDeque::new(),
            last_stamp_s: f64::NEG_INFINITY,
        }
    }

    /// Readings at a tick, from the truth of that tick; ticks count up from 0, where the first reading of
    /// each sensor is at hand at once.
    pub(super) fn read(&mut self, truth: &Readings, tick: u64) -> Readings {
        if tick.is_multiple_of(u64::from(self.settings.motor_period_ticks())) {
            self.sample_motors(truth);
        }
        if tick.is_multiple_of(u64::from(self.settings.imu_period_ticks())) {
            self.sample_imu(truth, tick);
        }
        while let Some(&(arrival, pitch_rad, pitch_rate_rad_s)) = self.under_way.front()
            && arrival <= tick
        {
            (self.held.pitch_rad, self.held.pitch_rate_rad_s) = (pitch_rad, pitch_rate_rad_s);
            self.under_way.pop_front();
        }
        self.held
    }

    /// Readings of the IMU in a second from now on.
    pub(super) fn set_imu_rate_hz(&mut self, rate_hz: f64) {
        self.settings.imu_rate_hz = rate_hz;
    }

    /// The recorder's time stamp of a tick, s: a little off where it has noise, and later than the one
    /// before, as of a recorder that stamps rows when they are written.
    pub(super) fn stamp(&mut self, tick: u64) -> f64 {
        let due_s = tick as f64 / 1000.0;
        if self.settings.time_stamp_noise_s == 0.0 {
            return due_s;
        }
        let noisy_s = due_s + self.stamp_noise.normal(self.settings.time_stamp_noise_s);
        let stamp_s = rounded(noisy_s.max(self.last_stamp_s + STAMP_STEP_S), STAMP_STEP_S);
        self.last_stamp_s = stamp_s;
        stamp_s
    }

    fn sample_motors(&mut self, truth: &Readings) {
        let settings = &self.settings;
        let step = settings.encoder_step_rad();
        self.held.motor_angle_rad = truth.motor_angle_rad.map(|angle| rounded(angle, step));
        for (motor, noise) in self.speed_noise.iter_mut().enumerate() {
            let speed = truth.motor_speed_rad_s[motor] + noise.normal(settings.motor_speed_noise_rad_s);
            self.held.motor_speed_rad_s[motor] = rounded(speed, settings.motor_speed_step_rad_s);
        }
    }

    fn sample_imu(&mut self, truth: &Readings, tick: u64) {
        let settings = &self.settings;
        let pitch = truth.pitch_rad + settings.imu_mount_angle_rad;
        let pitch = pitch + self.imu_noise.normal(settings.pitch_noise_rad);
        let rate = truth.pitch_rate_rad_s + settings.gyro_bias_rad_s;
        let rate = rate + self.imu_noise.normal(settings.pitch_rate_noise_rad_s);
        let latency = (settings.imu_latency_s / TICK_S).round() as u64;
        let arrival = if tick == 0 { 0 } else { tick + latency };
        let reading =
            (rounded(pitch, settings.pitch_step_rad), rounded(rate, settings.pitch_rate_step_rad_s));
        self.under_way.push_back((arrival, reading.0, reading.1));
    }
}

fn rounded(value: f64, step: f64) -> f64 {
    if step == 0.0 { value } else { (value / step).round() * step }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A truth that tells its tick.
    fn truth(tick: u64) -> Readings {
        let ramp = tick as f64 * 1e-3;
        Readings {
            motor_angle_rad: [ramp, -2.0 * ramp],
            motor_speed_rad_s: [ramp, 3.0 * ramp],
            pitch_rad: ramp,
            pitch_rate_rad_s: -ramp,
        }
    }

    /// No steps and no noise.
    fn ideal() -> SensorSettings {
        SensorSettings { imu_rate_hz: 1000.0, ..SensorSettings::default().exact() }
    }

    fn readings(settings: SensorSettings, ticks: u64) -> Vec<Readings> {
        let mut sensors = Sensors::new(settings, 1, 0);
        (0..ticks).map(|tick| sensors.read(&truth(tick), tick)).collect()
    }

    #[test]
    fn ideal_sensors_tell_the_truth_of_both_motors() {
        let found = readings(ideal(), 20);
        assert!(found.iter().zip(0..).all(|(reading, tick)| *reading == truth(tick)));
    }

    #[test]
    fn readings_are_held_between_samples_and_arrive_late() {
        for (imu_rate_hz, imu_latency_s, motor_rate_hz) in
            [(100.0, 0.0, 1000.0), (200.0, 0.012, 500.0), (100.0, 0.003, 100.0), (1000.0, 0.007, 1000.0)]
        {
            let settings = SensorSettings { imu_rate_hz, imu_latency_s, motor_rate_hz, ..ideal() };
            let latency = (imu_latency_s * 1000.0).round() as u64;
            for (tick, reading) in (0_u64..).zip(readings(settings, 100)) {
                let taken = |age: u64, rate_hz: f64| {
                    let period = (1000.0 / rate_hz) as u64;
                    tick.checked_sub(age).map_or(0, |seen| seen - seen % period)
                };
                let (imu, motors) = (truth(taken(latency, imu_rate_hz)), truth(taken(0, motor_rate_hz)));
                assert_eq!(
                    (reading.pitch_rad, reading.pitch_rate_rad_s),
                    (imu.pitch_rad, imu.pitch_rate_rad_s)
                );
                assert_eq!(reading.motor_angle_rad, motors.motor_angle_rad);
                assert_eq!(reading.motor_speed_rad_s, motors.motor_speed_rad_s);
            }
        }
    }

    #[test]
    fn readings_are_multiples_of_their_steps_and_off_by_mount_and_bias() {
        let settings = SensorSettings {
            encoder_bits: 14,
            motor_speed_step_rad_s: 1.0_f64.to_radians(),
            pitch_step_rad: 0.0055_f64.to_radians(),
            pitch_rate_step_rad_s: 0.061_f64.to_radians(),
            imu_mount_angle_rad: 0.02,
            gyro_bias_rad_s: -0.3,
            ..ideal()
        };
        for (tick, reading) in (0..).zip(readings(settings, 500)) {
            let truth = truth(tick);
            for (found, exact, step) in [
                (reading.motor_angle_rad[1], truth.motor_angle_rad[1], std::f64::consts::TAU / 16384.0),
                (reading.motor_speed_rad_s[1], truth.motor_speed_rad_s[1], 1.0_f64.to_radians()),
                (reading.pitch_rad, truth.pitch_rad + 0.02, 0.0055_f64.to_radians()),
                (reading.pitch_rate_rad_s, truth.pitch_rate_rad_s - 0.3, 0.061_f64.to_radians()),
            ] {
                let steps = found / step;
                assert!((steps - steps.round()).abs() < 1e-9, "{found} is {steps} steps");
                assert!((found - exact).abs() <= 0.5 * step * (1.0 + 1e-9), "{found} for {exact}");
            }
        }
    }

    #[test]
    fn noise_is_as_large_as_said_and_each_motors_own() {
        let settings = SensorSettings { motor_speed_noise_rad_s: 0.1, pitch_noise_rad: 0.02, ..ideal() };
        let found = readings(settings, 20_000);
        let deviation = |value: &dyn Fn(&Readings) -> f64| {
            let errors = found.iter().zip(0..).map(|(reading, tick)| value(reading) - value(&truth(tick)));
            (errors.map(|error| error * error).sum::<f64>() / found.len() as f64).sqrt()
        };
        for motor in [0, 1] {
            assert!((deviation(&|r| r.motor_speed_rad_s[motor]) / 0.1 - 1.0).abs() < 0.03);
        }
        assert!(
            (deviation(&|r| r.motor_speed_rad_s[1] - r.motor_speed_rad_s[0]) / 0.02_f64.sqrt() - 1.0).abs()
                < 0.03
        );
        assert!((deviation(&|r| r.pitch_rad) / 0.02 - 1.0).abs() < 0.03);
    }

    #[test]
    fn stamps_rise_by_microseconds_at_least() {
        for time_stamp_noise_s in [0.0, 1e-4, 1e-3] {
            let mut sensors = Sensors::new(SensorSettings { time_stamp_noise_s, ..ideal() }, 1, 0);
            let stamps: Vec<f64> = (0..20_000).map(|tick| sensors.stamp(tick)).collect();
            assert!(stamps.windows(2).all(|pair| pair[1] - pair[0] > 0.9e-6));
            let errors = stamps.iter().zip(0..).map(|(stamp, tick)| stamp - f64::from(tick) * 1e-3);
            let deviation = (errors.map(|error| error * error).sum::<f64>() / 20_000.0).sqrt();
            // A stamp that is held back by the one before is off by less.
            assert!(
                (0.75 * time_stamp_noise_s..=1.05 * time_stamp_noise_s + 1e-12).contains(&deviation),
                "{deviation}"
            );
        }
    }
}
