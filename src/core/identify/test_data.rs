//! Made-up data for the tests.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::FrictionPair;
use super::swarm::uniform;
use crate::friction::{Stribeck, StribeckParameters};

/// Left motor of Table 4.
pub(super) const LEFT: StribeckParameters = StribeckParameters {
    coulomb_nm: 0.0338,
    static_nm: 0.0761,
    viscous_nm_s_rad: 4.9e-4,
    stribeck_speed_rad_s: 1.612,
    stribeck_exponent: 0.2310,
    offset_nm: -0.0016,
};

/// Right motor of Table 4.
pub(super) const RIGHT: StribeckParameters = StribeckParameters {
    coulomb_nm: 0.0406,
    static_nm: 0.0617,
    viscous_nm_s_rad: 4.3e-4,
    stribeck_speed_rad_s: 2.253,
    stribeck_exponent: 0.2772,
    offset_nm: 0.0014,
};

/// Normal deviates by Box and Muller.
pub(super) struct Noise(ChaCha8Rng);

impl Noise {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(super) fn uniform(&mut self) -> f64 {
        uniform(&mut self.0)
    }

    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Pairs at the given speeds with noise of this standard deviation, N m.
pub(super) fn pairs_at(
    parameters: &StribeckParameters,
    speeds: impl IntoIterator<Item = f64>,
    noise_nm: f64,
    seed: u64,
) -> Vec<FrictionPair> {
    let curve = Stribeck::new(*parameters).unwrap();
    let mut noise = Noise::new(seed);
    speeds
        .into_iter()
        .map(|speed_rad_s| FrictionPair {
            speed_rad_s,
            torque_nm: curve.torque_nm(speed_rad_s) + noise_nm * noise.normal(),
        })
        .collect()
}

/// Pairs at even speeds from −50 to 50 rad/s, as the paper's 260.
pub(super) fn even_pairs(
    parameters: &StribeckParameters,
    count: u32,
    noise_nm: f64,
    seed: u64,
) -> Vec<FrictionPair> {
    let speeds = (0..count).map(|i| -50.0 + 100.0 * f64::from(i) / f64::from(count - 1));
    pairs_at(parameters, speeds, noise_nm, seed)
}
