//! Both motors with their command lines.

use super::actuator::Actuator;
use super::noise::Noise;
use super::simulation::TORQUE_STREAM;
use crate::model::{Actuation, MotorLimits};

/// The way of both torques from the controller to the shafts, noise included.
#[derive(Clone, Debug)]
pub(super) struct Motors {
    actuators: [Actuator; 2],
    noise: [Noise; 2],
    noise_nm: f64,
}

impl Motors {
    pub(super) fn new(limits: &MotorLimits, actuation: &Actuation, seed: u64) -> Self {
        Self {
            actuators: [(); 2].map(|()| Actuator::new(limits, actuation)),
            noise: [0, 1].map(|motor| Noise::new(seed, TORQUE_STREAM + motor)),
            noise_nm: actuation.torque_noise_nm,
        }
    }

    /// One tick: takes the torques that are requested and gives those on the shafts, N m, at the motors'
    /// present speeds, rad/s.
    pub(super) fn step(&mut self, asked_nm: [f64; 2], speed_rad_s: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|motor| {
            let noise = self.noise[motor].normal(self.noise_nm);
            self.actuators[motor].step(asked_nm[motor], speed_rad_s[motor]) + noise
        })
    }
}
