//! The pairs laid out for speed, and the two quantities that every search needs of them: the sum of squared
//! errors of a candidate, and the fading exp(−(|q̇|/v_s)^ξ) of every pair.

use super::FrictionPair;
use super::exp2::exp2;
use super::parameters::{COULOMB, EXPONENT, OFFSET, Point, SPEED, STATIC, VISCOUS};

/// Candidates are given up in steps of this many pairs.
const STRIDE: usize = 64;
/// Partial sums that are kept apart, so that the order of summation is the same for every vector width.
const LANES: usize = 8;

/// Friction pairs as columns, filled up with zeros to whole [`LANES`], which no sum includes.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    count: usize,
    pub(super) speed: Vec<f64>,
    pub(super) torque: Vec<f64>,
    /// sign(q̇): −1, 0 or 1.
    pub(super) direction: Vec<f64>,
    /// log₂|q̇|; 0 at q̇ = 0, where the direction takes the fading out of the model.
    log2_speed: Vec<f64>,
}

impl Samples {
    pub(super) fn new(pairs: &[FrictionPair]) -> Self {
        let direction = |q: f64| if q == 0.0 { 0.0 } else { q.signum() };
        let log2 = |q: f64| if q == 0.0 { 0.0 } else { libm::log2(q.abs()) };
        let column = |of: &dyn Fn(&FrictionPair) -> f64| {
            let mut column: Vec<f64> = pairs.iter().map(of).collect();
            column.resize(pairs.len().next_multiple_of(LANES), 0.0);
            column
        };
        Self {
            count: pairs.len(),
            speed: column(&|p| p.speed_rad_s),
            torque: column(&|p| p.torque_nm),
            direction: column(&|p| direction(p.speed_rad_s)),
            log2_speed: column(&|p| log2(p.speed_rad_s)),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Root of the mean of squares, N m (Eq. 32).
    pub(super) fn rmse(&self, sum_of_squares: f64) -> f64 {
        (sum_of_squares / self.len() as f64).sqrt()
    }

    /// Σ (τ̄_f − τ̂_f)² of one candidate, (N m)².
    pub(super) fn sum_of_squares(&self, point: &Point) -> f64 {
        let mut sum = [f64::INFINITY];
        self.improve(&[*point], &mut sum);
        sum[0]
    }

    /// For each candidate the sum of squared errors, (N m)², where it is below the number in `sums`; the others
    /// keep theirs. The sum of a candidate stops as soon as it can no longer get below, which changes no result.
    pub(super) fn improve(&self, candidates: &[Point], sums: &mut [f64]) {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (candidate, sum) in candidates.iter().zip(sums) {
                    *sum = sum_below(self, candidate, *sum);
                }
            },
        );
    }

    /// For every pair u = (|q̇|/v_s)^ξ, at most about 708, and exp(−u), both without unit.
    pub(super) fn fade(
        &self,
        log2_stribeck_speed: f64,
        exponent: f64,
        power: &mut [f64],
        fading: &mut [f64],
    ) {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for ((x, u), s) in self.log2_speed.iter().zip(power).zip(fading) {
                    let bits = outer_bits(*x, log2_stribeck_speed, exponent);
                    *u = std::f64::consts::LN_2 * if bits < 1022.0 { bits } else { 1022.0 };
                    *s = exp2(-bits);
                }
            },
        );
    }

    /// ln u for u = (|q̇|/v_s)^ξ of pair `i`.
    pub(super) fn log_power(&self, i: usize, log2_stribeck_speed: f64, exponent: f64) -> f64 {
        exponent * (self.log2_speed[i] - log2_stribeck_speed) * std::f64::consts::LN_2
    }
}

/// log₂(log₂ e): makes the outer power one of two as well.
const OUTER: f64 = 0.528_766_372_944_897_6;

/// u / ln 2 for u = (|q̇|/v_s)^ξ, so that exp(−u) = 2^−(u / ln 2).
#[inline(always)]
fn outer_bits(log2_speed: f64, log2_stribeck_speed: f64, exponent: f64) -> f64 {
    exp2(exponent * (log2_speed - log2_stribeck_speed) + OUTER)
}

#[inline(always)]
fn sum_below(samples: &Samples, point: &Point, limit: f64) -> f64 {
    let log2_stribeck_speed = libm::log2(point[SPEED]);
    let drop = point[STATIC] - point[COULOMB];
    let mut lanes = [0.0; LANES];
    let mut squares = [0.0; STRIDE];
    let mut bits = [0.0; STRIDE];
    let mut start = 0;
    while start < samples.len() {
        let end = samples.speed.len().min(start + STRIDE);
        let count = STRIDE.min(samples.len() - start);
        let x = &samples.log2_speed[start..end];
        let q = &samples.speed[start..end];
        let direction = &samples.direction[start..end];
        let torque = &samples.torque[start..end];
        // Two loops: in one, the processor waits for the chain of both exponentials.
        for i in 0..end - start {
            bits[i] = outer_bits(x[i], log2_stribeck_speed, point[EXPONENT]);
        }
        for i in 0..end - start {
            let s = exp2(-bits[i]);
            let level = (point[COULOMB] + drop * s) * direction[i];
            let error = level + ((point[VISCOUS] * q[i] + point[OFFSET]) - torque[i]);
            squares[i] = error * error;
        }
        let (eights, rest) = squares[..count].as_chunks::<LANES>();
        for eight in eights {
            for (lane, square) in lanes.iter_mut().zip(eight) {
                *lane += square;
            }
        }
        for (lane, square) in lanes.iter_mut().zip(rest) {
            *lane += square;
        }
        start = end;
        let sum =
            ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5])) + ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7]));
        if end >= samples.len() {
            // NaN is no improvement.
            return if sum < limit { sum } else { limit };
        }
        if sum >= limit {
            return limit;
        }
    }
    limit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::test_data::{LEFT, even_pairs};

    /// The compiler's baseline and the widest instruction set of this machine, with counts that leave a rest.
    #[test]
    fn every_instruction_set_gives_the_same_bytes() {
        for count in [7, 64, 65, 260] {
            let samples = Samples::new(&even_pairs(&LEFT, count, 0.002, 1));
            for k in 0..200 {
                let k = f64::from(k);
                let point = [0.03 + 1e-4 * k, 0.08, 0.01 + 0.05 * k, 0.05 + 0.01 * k, 1e-5 * k, 0.001];
                let baseline = sum_below(&samples, &point, f64::INFINITY);
                assert_eq!(samples.sum_of_squares(&point).to_bits(), baseline.to_bits());
                let mut kept = [0.5 * baseline];
                samples.improve(&[point], &mut kept);
                assert_eq!(kept, [0.5 * baseline]);
            }
        }
    }

    #[test]
    fn singular_candidates_are_numbers_or_no_improvement() {
        let samples = Samples::new(&even_pairs(&LEFT, 21, 0.0, 1));
        for (speed, exponent) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0), (1e-300, 2.2)] {
            assert!(!samples.sum_of_squares(&[0.1, 0.2, speed, exponent, 0.0, 0.0]).is_nan());
        }
        assert_eq!(samples.sum_of_squares(&[f64::NAN, 0.2, 1.0, 1.0, 0.0, 0.0]), f64::INFINITY);
    }
}
