//! Rows of equal weight at every frequency: one recursive filter for all columns, from what noise of the sensors alone
//! makes of a row.
//!
//! The filter comes from the noise, not from the residual: what a model lacks is no noise, and a filter that took it
//! for such would hide it.

use std::f64::consts::TAU;

/// Order of the filter.
const ORDER: usize = 8;
/// Fraction of white noise that is added, so that no part of the band is blown up.
const FLOOR: f64 = 1e-3;
/// Frequencies of the sums over the band.
const STEPS: usize = 2000;

/// Prediction of a row's noise from the rows before it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whitener {
    coefficients: [f64; ORDER],
    /// Places of the rows that have all their predecessors.
    rows: Vec<usize>,
}

impl Whitener {
    /// `power` is the noise's power over the frequency in cycles per sample, from 0 to 0.5; there is one row in
    /// `thinning` samples. `follows` says of each row whether it comes right after the one before, `wanted` whether it
    /// may be used.
    pub fn new(
        power: impl Fn(f64) -> f64,
        thinning: usize,
        follows: &[bool],
        wanted: impl Fn(usize) -> bool,
    ) -> Self {
        let mut products = [0.0; ORDER + 1];
        for index in 0..STEPS {
            let frequency = (index as f64 + 0.5) / (2 * STEPS) as f64;
            let power = power(frequency);
            for (lag, product) in products.iter_mut().enumerate() {
                *product += power * (TAU * frequency * (lag * thinning) as f64).cos();
            }
        }
        products[0] *= 1.0 + FLOOR;
        let (mut rows, mut run) = (Vec::new(), 0);
        for (row, follows) in follows.iter().enumerate() {
            run = match (wanted(row), follows) {
                (false, _) => 0,
                (true, true) => run + 1,
                (true, false) => 1,
            };
            if run > ORDER {
                rows.push(row);
            }
        }
        Self { coefficients: levinson(&products), rows }
    }

    /// Leaves out more rows.
    pub fn keep(&mut self, wanted: impl Fn(usize) -> bool) {
        self.rows.retain(|&row| wanted(row));
    }

    /// Places of the rows that are left.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// A column at those rows.
    pub fn apply(&self, column: &[f64]) -> Vec<f64> {
        let at = |row: usize| {
            let past = &column[row - ORDER..row];
            column[row] - self.coefficients.iter().zip(past.iter().rev()).map(|(a, b)| a * b).sum::<f64>()
        };
        self.rows.iter().map(|&row| at(row)).collect()
    }

    /// The transposed filter: what `white` says of each of `count` rows.
    pub fn transposed(&self, white: &[f64], count: usize) -> Vec<f64> {
        let mut found = vec![0.0; count];
        for (&row, value) in self.rows.iter().zip(white) {
            found[row] += value;
            for (lag, coefficient) in self.coefficients.iter().enumerate() {
                found[row - 1 - lag] -= coefficient * value;
            }
        }
        found
    }

    /// Squared gain at a frequency in cycles per row.
    pub fn power_gain(&self, frequency: f64) -> f64 {
        let (mut re, mut im) = (1.0, 0.0);
        for (lag, coefficient) in self.coefficients.iter().enumerate() {
            let (sin, cos) = (TAU * frequency * (lag + 1) as f64).sin_cos();
            re -= coefficient * cos;
            im += coefficient * sin;
        }
        re * re + im * im
    }

    /// Variance of a row of noise with this power, behind the filter.
    pub fn variance(&self, power: impl Fn(f64) -> f64, thinning: usize) -> f64 {
        let at = |index: usize| {
            let frequency = (index as f64 + 0.5) / (2 * STEPS) as f64;
            power(frequency) * self.power_gain(frequency * thinning as f64)
        };
        (0..STEPS).map(at).sum::<f64>() / STEPS as f64
    }
}

/// The predictor of the correlations, as long as they are those of a process.
fn levinson(products: &[f64; ORDER + 1]) -> [f64; ORDER] {
    let (mut found, mut error) = ([0.0; ORDER], products[0]);
    for order in 0..ORDER {
        let known: f64 = (0..order).map(|i| found[i] * products[order - i]).sum();
        let reflection = (products[order + 1] - known) / error;
        if error <= 0.0 || !reflection.is_finite() || reflection.abs() >= 1.0 {
            break;
        }
        let before = found;
        for i in 0..order {
            found[i] = before[i] - reflection * before[order - 1 - i];
        }
        found[order] = reflection;
        error *= 1.0 - reflection * reflection;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A process of first order, by its spectrum.
    fn coloured(frequency: f64) -> f64 {
        1.0 / (1.0 + 0.81 - 1.8 * (TAU * frequency).cos())
    }

    #[test]
    fn coloured_noise_becomes_white() {
        let (mut state, mut seed) = (0.0, 1_u64);
        let mut noise = Vec::new();
        for _ in 0..20_000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state = 0.9 * state + (seed >> 40) as f64 / f64::from(1 << 24) - 0.5;
            noise.push(state);
        }
        let mut follows = vec![true; noise.len()];
        follows[0] = false;
        follows[500] = false;
        let whitener = Whitener::new(coloured, 1, &follows, |_| true);
        let white = whitener.apply(&noise);
        assert_eq!(white.len(), noise.len() - 2 * ORDER);
        let power: f64 = white.iter().map(|v| v * v).sum();
        let next: f64 = white.windows(2).map(|pair| pair[0] * pair[1]).sum();
        assert!((next / power).abs() < 0.02, "{}", next / power);
        assert!((power / white.len() as f64 * 12.0 - 1.0).abs() < 0.05);
        assert!((whitener.variance(coloured, 1) - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_transposed_filter_gives_the_same_products() {
        let follows = [false, true, true, true, true, true, true, true, true, true, true, true];
        let whitener = Whitener::new(coloured, 1, &follows, |_| true);
        let column: Vec<f64> = (0..12).map(|k| f64::from(k * k % 7)).collect();
        let white = [0.3, -1.0, 2.0, 0.5];
        let one: f64 = whitener.apply(&column).iter().zip(white).map(|(a, b)| a * b).sum();
        let other: f64 = whitener.transposed(&white, 12).iter().zip(&column).map(|(a, b)| a * b).sum();
        assert!((one - other).abs() < 1e-12, "{one} {other}");
    }
}
