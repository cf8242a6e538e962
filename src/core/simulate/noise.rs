//! Random numbers of the simulated robot.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Normally distributed numbers, one independent stream per source, so that switching one source off
/// leaves the others as they were.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    generator: ChaCha8Rng,
    spare: Option<f64>,
}

impl Noise {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self { generator, spare: None }
    }

    /// A number with mean 0 and the given standard deviation (Box-Muller).
    pub(crate) fn normal(&mut self, deviation: f64) -> f64 {
        if deviation == 0.0 {
            return 0.0;
        }
        let standard = self.spare.take().unwrap_or_else(|| {
            // In (0, 1], so that the logarithm is finite.
            let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.uniform());
            self.spare = Some(radius * sin);
            radius * cos
        });
        deviation * standard
    }

    /// A number in [0, 1) on a grid of 2⁻⁵³.
    fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_tails_are_those_of_a_normal_distribution() {
        let mut noise = Noise::new(1, 0);
        let draws: Vec<f64> = (0..200_000).map(|_| noise.normal(2.0)).collect();
        let count = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / count;
        let variance = draws.iter().map(|d| d * d).sum::<f64>() / count;
        let beyond_two_sigma = draws.iter().filter(|d| d.abs() > 4.0).count() as f64 / count;
        assert!(mean.abs() < 0.02, "{mean}");
        assert!((variance - 4.0).abs() < 0.05, "{variance}");
        // erfc(√2) = 0.0455
        assert!((beyond_two_sigma - 0.0455).abs() < 0.002, "{beyond_two_sigma}");
    }

    #[test]
    fn streams_and_seeds_differ_and_repeat() {
        let first = |seed, stream| Noise::new(seed, stream).normal(1.0);
        assert_eq!(first(1, 0), first(1, 0));
        assert_ne!(first(1, 0), first(1, 1));
        assert_ne!(first(1, 0), first(2, 0));
    }
}
