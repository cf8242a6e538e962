//! What the robot knows of itself: encoders and motor speeds every tick, the IMU every tenth.

use super::noise::Noise;
use super::planar::PlanarPlant;
use crate::ParameterError;
use crate::control::Measurement;
use crate::parameter::not_negative;
use crate::robot::State;

/// Sensors of the robot. Defaults: the paper's (section 4.1) where it states them, otherwise as noted.
/// A step of 0 means a reading without steps, a noise of 0 none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSettings {
    /// Step of the motor angles, rad. Default: 16 bit a turn (LK motors' protocol).
    pub encoder_step_rad: f64,
    /// Step of the motor speeds, rad/s. Default: 1 deg/s (LK motors' protocol).
    pub motor_speed_step_rad_s: f64,
    /// Standard deviation of the motor speeds before rounding, rad/s. Default: 0.5 deg/s (assumed).
    pub motor_speed_noise_rad_s: f64,
    /// Ticks of 1 ms from one IMU sample to the next, at least 1; between them the last one is held.
    /// Default: 10, the paper's 100 Hz.
    pub imu_period_ticks: u32,
    /// Step of the pitch, rad. Default: 0.01° (paper).
    pub pitch_step_rad: f64,
    /// Standard deviation of the pitch before rounding, rad. Default: 0.01° (assumed: one step).
    pub pitch_noise_rad: f64,
    /// Step of the pitch rate, rad/s. Default: 0.061 deg/s (JY901 data sheet: ±2000 deg/s in 16 bit).
    pub pitch_rate_step_rad_s: f64,
    /// Standard deviation of the pitch rate before rounding, rad/s. Default: 0.05 deg/s (JY901 data
    /// sheet).
    pub pitch_rate_noise_rad_s: f64,
}

impl Default for SensorSettings {
    fn default() -> Self {
        Self {
            encoder_step_rad: std::f64::consts::TAU / 65536.0,
            motor_speed_step_rad_s: 1.0_f64.to_radians(),
            motor_speed_noise_rad_s: 0.5_f64.to_radians(),
            imu_period_ticks: 10,
            pitch_step_rad: 0.01_f64.to_radians(),
            pitch_noise_rad: 0.01_f64.to_radians(),
            pitch_rate_step_rad_s: 0.061_f64.to_radians(),
            pitch_rate_noise_rad_s: 0.05_f64.to_radians(),
        }
    }
}

impl SensorSettings {
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        for (name, value) in [
            ("encoder_step_rad", self.encoder_step_rad),
            ("motor_speed_step_rad_s", self.motor_speed_step_rad_s),
            ("motor_speed_noise_rad_s", self.motor_speed_noise_rad_s),
            ("pitch_step_rad", self.pitch_step_rad),
            ("pitch_noise_rad", self.pitch_noise_rad),
            ("pitch_rate_step_rad_s", self.pitch_rate_step_rad_s),
            ("pitch_rate_noise_rad_s", self.pitch_rate_noise_rad_s),
        ] {
            not_negative(name, value)?;
        }
        crate::parameter::positive("imu_period_ticks", f64::from(self.imu_period_ticks))
    }
}

/// One tick's readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Readings {
    /// Encoders, left and right, rad.
    pub(super) motor_angle_rad: [f64; 2],
    /// What the controller gets.
    pub(super) measurement: Measurement,
}

/// The sensors with their noise and the IMU's held sample.
#[derive(Clone, Debug)]
pub(super) struct Sensors {
    settings: SensorSettings,
    wheel_radius_m: f64,
    speed_noise: [Noise; 2],
    imu_noise: Noise,
    pitch_rad: f64,
    pitch_rate_rad_s: f64,
}

impl Sensors {
    /// Noise takes the streams `first_stream` to `first_stream + 2` of the seed.
    pub(super) fn new(settings: SensorSettings, wheel_radius_m: f64, seed: u64, first_stream: u64) -> Self {
        Self {
            settings,
            wheel_radius_m,
            speed_noise: [0, 1].map(|motor| Noise::new(seed, first_stream + motor)),
            imu_noise: Noise::new(seed, first_stream + 2),
            pitch_rad: 0.0,
            pitch_rate_rad_s: 0.0,
        }
    }

    /// Readings at a tick. x and ẋ come from the wheels' mean: x = r (q + θ), ẋ = r (q̇ + θ̇) with the
    /// IMU's held values, as the robot computes them.
    pub(super) fn read(&mut self, plant: &PlanarPlant, tick: u64) -> Readings {
        if tick.is_multiple_of(u64::from(self.settings.imu_period_ticks)) {
            self.sample_imu(&plant.state());
        }
        let settings = &self.settings;
        let motor_angle_rad = [rounded(plant.motor_angle_rad(), settings.encoder_step_rad); 2];
        let motor_speed_rad_s = self.speed_noise.each_mut().map(|noise| {
            let speed = plant.motor_speed_rad_s() + noise.normal(settings.motor_speed_noise_rad_s);
            rounded(speed, settings.motor_speed_step_rad_s)
        });
        let mean = |pair: [f64; 2]| f64::midpoint(pair[0], pair[1]);
        let state = State {
            x_m: self.wheel_radius_m * (mean(motor_angle_rad) + self.pitch_rad),
            x_dot_m_s: self.wheel_radius_m * (mean(motor_speed_rad_s) + self.pitch_rate_rad_s),
            pitch_rad: self.pitch_rad,
            pitch_rate_rad_s: self.pitch_rate_rad_s,
        };
        Readings {
            motor_angle_rad,
            measurement: Measurement { state, motor_speed_rad_s, ..Measurement::default() },
        }
    }

    fn sample_imu(&mut self, state: &State) {
        let settings = &self.settings;
        let pitch = state.pitch_rad + self.imu_noise.normal(settings.pitch_noise_rad);
        let rate = state.pitch_rate_rad_s + self.imu_noise.normal(settings.pitch_rate_noise_rad_s);
        self.pitch_rad = rounded(pitch, settings.pitch_step_rad);
        self.pitch_rate_rad_s = rounded(rate, settings.pitch_rate_step_rad_s);
    }
}

fn rounded(value: f64, step: f64) -> f64 {
    if step == 0.0 { value } else { (value / step).round() * step }
}
