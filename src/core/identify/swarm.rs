//! The particle swarm of the paper's Algorithm 1 (Eqs. 39 to 42, Tables 2 and 3).

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::parameters::{Point, named};
use super::samples::Samples;
use super::{FrictionPair, SearchBox};
use crate::friction::StribeckParameters;

/// Settings of Algorithm 1; the default is Table 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PsoSettings {
    /// M, number of particles.
    pub particles: usize,
    /// c₁, pull towards a particle's own best.
    pub learn_cognitive: f64,
    /// c₂, pull towards the best of all.
    pub learn_social: f64,
    /// ω_s, inertia at the start.
    pub inertia_start: f64,
    /// ω_e, inertia at the end.
    pub inertia_end: f64,
    /// α, fraction of the velocity that a position moves by.
    pub constraint_factor: f64,
    /// Largest velocity of a parameter as a fraction of its range. The paper prints 0.5 without a unit; an absolute
    /// 0.5 would be no limit at all for f_v and a severe one for v_s, and only the relative reading keeps the rule
    /// "restore, invert, move again" inside of the range: α · 0.5 = 0.3 of it is less than half.
    pub velocity_limit: f64,
    /// T, number of iterations.
    pub iterations: usize,
    /// The search ends when the best error (RMSE, N m) is below this in two consecutive iterations. The paper
    /// names no number; the default of 0 never ends it.
    pub error_threshold: f64,
}

impl Default for PsoSettings {
    fn default() -> Self {
        Self {
            particles: 128,
            learn_cognitive: 1.6,
            learn_social: 2.0,
            inertia_start: 0.9,
            inertia_end: 0.4,
            constraint_factor: 0.6,
            velocity_limit: 0.5,
            iterations: 500,
            error_threshold: 0.0,
        }
    }
}

/// The swarm after one iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PsoProgress {
    /// Iterations done, from 1.
    pub iteration: usize,
    /// Best error so far: RMSE over the pairs, N m.
    pub best_error_nm: f64,
    /// The parameters that have it.
    pub best: StribeckParameters,
}

/// Algorithm 1 as an iterator: each item is one iteration; dropping it ends the search.
///
/// Per particle and dimension v ← ω v + c₁k₁(p − x) + c₂k₂(g − x), limited, and x ← x + α v (Eq. 41) with fresh
/// k₁, k₂ in [0, 1); ω = ω_e + (ω_s − ω_e)(T − t)/T (Eq. 42). A coordinate that would leave its range goes back,
/// inverts its velocity and moves again. p follows within the iteration, g after it, as Algorithm 1 has it. The
/// fitness is 1/error (Eq. 40), so the smaller error wins. Same pairs, box, settings and seed: same bytes.
///
/// ```
/// # use flqr_core::friction::{Stribeck, StribeckParameters};
/// # use flqr_core::identify::FrictionPair;
/// # let truth = StribeckParameters {
/// #     coulomb_nm: 0.2, static_nm: 0.3, viscous_nm_s_rad: 0.01, stribeck_speed_rad_s: 1.0, stribeck_exponent: 1.0, offset_nm: 0.0,
/// # };
/// # let curve = Stribeck::new(truth)?;
/// # let speeds = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0].into_iter().flat_map(|speed| [speed, -speed]);
/// let pairs: Vec<FrictionPair> = speeds
///     .map(|speed_rad_s| FrictionPair { speed_rad_s, torque_nm: curve.torque_nm(speed_rad_s) })
///     .collect();
/// use flqr_core::identify::{Pso, PsoSettings, SearchBox};
///
/// let range = SearchBox::from_pairs(&pairs);
/// let errors: Vec<f64> =
///     Pso::new(&pairs, range, PsoSettings::default(), 1).take(50).map(|progress| progress.best_error_nm).collect();
/// assert!(errors.is_sorted_by(|earlier, later| later <= earlier));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pso {
    samples: Samples,
    range: SearchBox,
    settings: PsoSettings,
    random: ChaCha8Rng,
    iteration: usize,
    below_threshold: usize,
    positions: Vec<Point>,
    velocities: Vec<Point>,
    best_positions: Vec<Point>,
    best_sums: Vec<f64>,
    sums: Vec<f64>,
    global: usize,
    global_best: Point,
}

impl Pso {
    /// Spreads the particles over the box. Needs at least one pair and one particle, finite pairs and a box whose
    /// lower bounds are not above its upper ones; otherwise the search finds nothing and ends at once.
    pub fn new(pairs: &[FrictionPair], range: SearchBox, settings: PsoSettings, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |low: f64, width: f64| low + uniform(&mut random) * width;
        let mut positions = Vec::with_capacity(settings.particles);
        let mut velocities = Vec::with_capacity(settings.particles);
        for _ in 0..settings.particles {
            positions.push(std::array::from_fn(|d| draw(range.lower[d], range.width(d)).min(range.upper[d])));
            velocities.push(std::array::from_fn(|d| {
                let limit = settings.velocity_limit * range.width(d);
                draw(-limit, 2.0 * limit)
            }));
        }
        let samples = Samples::new(pairs);
        let mut best_sums = vec![f64::INFINITY; settings.particles];
        samples.improve(&positions, &mut best_sums);
        let global = smallest(&best_sums);
        Self {
            global_best: positions.get(global).copied().unwrap_or(range.lower),
            best_positions: positions.clone(),
            sums: best_sums.clone(),
            iteration: 0,
            below_threshold: 0,
            samples,
            range,
            settings,
            random,
            positions,
            velocities,
            best_sums,
            global,
        }
    }

    /// The best of the swarm so far, also before the first iteration.
    pub fn progress(&self) -> PsoProgress {
        let sum = self.best_sums.get(self.global).copied().unwrap_or(f64::INFINITY);
        PsoProgress {
            iteration: self.iteration,
            best_error_nm: self.samples.rmse(sum),
            best: named(&self.global_best),
        }
    }

    /// Returns whether the search ended because the error stayed below the threshold.
    pub fn reached_threshold(&self) -> bool {
        self.below_threshold >= 2
    }

    pub(super) fn best_point(&self) -> &Point {
        &self.global_best
    }

    fn move_particles(&mut self) {
        let settings = self.settings;
        let remaining = (settings.iterations - self.iteration) as f64 / settings.iterations as f64;
        let inertia = settings.inertia_end + (settings.inertia_start - settings.inertia_end) * remaining;
        for n in 0..self.positions.len() {
            for d in 0..6 {
                let (x, v) = (self.positions[n][d], self.velocities[n][d]);
                let own =
                    settings.learn_cognitive * uniform(&mut self.random) * (self.best_positions[n][d] - x);
                let social = settings.learn_social * uniform(&mut self.random) * (self.global_best[d] - x);
                let limit = settings.velocity_limit * self.range.width(d);
                let v = (inertia * v + own + social).clamp(-limit, limit);
                (self.positions[n][d], self.velocities[n][d]) = self.stepped(d, x, v);
            }
        }
    }

    /// One coordinate's move; the last clamp acts only where settings allow steps of more than half the range.
    fn stepped(&self, d: usize, x: f64, v: f64) -> (f64, f64) {
        let (low, high) = (self.range.lower[d], self.range.upper[d]);
        let moved = x + self.settings.constraint_factor * v;
        if (low..=high).contains(&moved) {
            return (moved, v);
        }
        ((x - self.settings.constraint_factor * v).clamp(low, high), -v)
    }

    fn remember_bests(&mut self) {
        self.sums.copy_from_slice(&self.best_sums);
        self.samples.improve(&self.positions, &mut self.sums);
        for n in 0..self.sums.len() {
            if self.sums[n] < self.best_sums[n] {
                self.best_sums[n] = self.sums[n];
                self.best_positions[n] = self.positions[n];
            }
        }
        self.global = smallest(&self.best_sums);
        self.global_best = self.best_positions[self.global];
    }
}

impl Iterator for Pso {
    type Item = PsoProgress;

    fn next(&mut self) -> Option<PsoProgress> {
        let empty = self.positions.is_empty() || self.samples.len() == 0;
        if empty || self.iteration == self.settings.iterations || self.reached_threshold() {
            return None;
        }
        self.move_particles();
        self.remember_bests();
        self.iteration += 1;
        let progress = self.progress();
        let below = progress.best_error_nm < self.settings.error_threshold;
        self.below_threshold = if below { self.below_threshold + 1 } else { 0 };
        Some(progress)
    }
}

/// The first of the smallest numbers.
fn smallest(numbers: &[f64]) -> usize {
    (0..numbers.len()).reduce(|best, n| if numbers[n] < numbers[best] { n } else { best }).unwrap_or(0)
}

/// Uniform in [0, 1) with 53 bits; written out so that it stays the same whatever a random library does.
pub(super) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::test_data::{LEFT, even_pairs};

    fn swarm(seed: u64) -> Pso {
        let pairs = even_pairs(&LEFT, 60, 0.002, 1);
        let settings = PsoSettings { particles: 24, iterations: 60, ..PsoSettings::default() };
        Pso::new(&pairs, SearchBox::from_pairs(&pairs), settings, seed)
    }

    #[test]
    fn particles_stay_inside_and_the_best_error_never_rises() {
        for seed in 0..5 {
            let mut swarm = swarm(seed);
            let mut last = swarm.progress().best_error_nm;
            let range = swarm.range;
            for iteration in 1.. {
                assert!(
                    swarm.positions.iter().all(|x| range.contains(x)),
                    "seed {seed}, iteration {iteration}"
                );
                let Some(step) = swarm.next() else { break };
                assert_eq!(step.iteration, iteration);
                assert!(step.best_error_nm <= last);
                last = step.best_error_nm;
            }
            assert_eq!(swarm.progress().iteration, 60);
        }
    }

    /// The rule for a coordinate that would leave its range: back, velocity inverted, moved again.
    #[test]
    fn a_coordinate_that_would_leave_turns_round() {
        let swarm = swarm(1);
        let (low, width) = (swarm.range.lower[0], swarm.range.width(0));
        let (x, v) = swarm.stepped(0, low + 0.1 * width, -0.5 * width);
        assert!((x - (low + 0.4 * width)).abs() < 1e-15 && v == 0.5 * width);
        let (x, v) = swarm.stepped(0, low + 0.6 * width, 0.5 * width);
        assert!((x - (low + 0.9 * width)).abs() < 1e-15 && v == 0.5 * width);
    }

    #[test]
    fn the_seed_decides_every_byte() {
        let history = |seed| swarm(seed).map(|step| step.best_error_nm.to_bits()).collect::<Vec<_>>();
        assert_eq!(history(7), history(7));
        assert_ne!(history(7), history(8));
    }

    /// The sum that a particle is assessed by must be the sum over Eq. 28, also where it was given up early.
    #[test]
    fn the_best_error_is_that_of_the_curve() {
        let pairs = even_pairs(&LEFT, 60, 0.002, 1);
        let best = swarm(3).last().unwrap();
        let curve = crate::friction::Stribeck::new(best.best).unwrap();
        let squares: f64 = pairs.iter().map(|p| (curve.torque_nm(p.speed_rad_s) - p.torque_nm).powi(2)).sum();
        let expected = (squares / pairs.len() as f64).sqrt();
        assert!((best.best_error_nm / expected - 1.0).abs() < 1e-12);
    }

    /// Contradiction of the paper: fitness below a threshold; read as error below it, twice in a row.
    #[test]
    fn stops_after_two_iterations_below_the_threshold() {
        let pairs = even_pairs(&LEFT, 60, 0.002, 1);
        let settings = PsoSettings { error_threshold: 1.0, ..PsoSettings::default() };
        let mut swarm = Pso::new(&pairs, SearchBox::from_pairs(&pairs), settings, 1);
        assert_eq!(swarm.by_ref().count(), 2);
        assert!(swarm.reached_threshold());
    }

    #[test]
    fn nothing_to_search_ends_at_once() {
        let range = SearchBox::paper();
        assert_eq!(Pso::new(&[], range, PsoSettings::default(), 1).count(), 0);
        let pairs = even_pairs(&LEFT, 60, 0.0, 1);
        let none = PsoSettings { particles: 0, ..PsoSettings::default() };
        assert_eq!(Pso::new(&pairs, range, none, 1).count(), 0);
    }
}
