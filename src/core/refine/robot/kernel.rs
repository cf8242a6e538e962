//! The one kernel that every column passes: a smooth bump, and differences of it as its derivatives.

use std::ops::Range;

/// Half the kernel's support, and the time between the rows that it leaves, s.
const HALF_S: f64 = 0.026;
const STEP_S: f64 = 0.010;

/// A bump (1 − u²)⁴ with the sum 1, and its first and second difference: ∫ k″ x stands for the second derivative of x
/// without x being differentiated.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    weights: [Vec<f64>; 3],
    half: usize,
    /// Rows of the log for each row that is left.
    pub(super) thinning: usize,
}

impl Kernel {
    pub(super) fn new(dt_s: f64) -> Self {
        let half = ((HALF_S / dt_s).round() as usize).max(4);
        let bump = |i: usize| {
            let u = (i as f64 - half as f64) / half as f64;
            (1.0 - u * u).max(0.0).powi(4)
        };
        let mut smooth: Vec<f64> = (0..=2 * half).map(bump).collect();
        let sum: f64 = smooth.iter().sum();
        smooth.iter_mut().for_each(|weight| *weight /= sum);
        let at = |i: usize, shift: isize| {
            i.checked_add_signed(shift).and_then(|i| smooth.get(i)).copied().unwrap_or(0.0)
        };
        // Of a correlation, whose kernel runs against the time of a convolution.
        let first = (0..=2 * half).map(|i| (at(i, -1) - at(i, 1)) / (2.0 * dt_s)).collect();
        let second =
            (0..=2 * half).map(|i| (at(i, 1) - 2.0 * at(i, 0) + at(i, -1)) / (dt_s * dt_s)).collect();
        let thinning = ((STEP_S / dt_s).round() as usize).max(1);
        Self { weights: [smooth, first, second], half, thinning }
    }

    /// Rows that are left of so many.
    pub(super) fn count(&self, rows: usize) -> usize {
        rows.saturating_sub(2 * self.half).div_ceil(self.thinning)
    }

    /// Row of the log in the middle of a row that is left.
    pub(super) fn centre(&self, row: usize) -> usize {
        self.half + row * self.thinning
    }

    /// Rows of the log that rows which are left are made of.
    pub(super) fn rows_of(&self, left: Range<usize>) -> Range<usize> {
        left.start * self.thinning..(left.end - 1) * self.thinning + 2 * self.half + 1
    }

    /// A column (`order` 0) or its derivative of an order up to 2, thinned.
    pub(super) fn apply(&self, column: &[f64], order: usize) -> Vec<f64> {
        let weights = &self.weights[order];
        let windows = column.windows(2 * self.half + 1).step_by(self.thinning);
        windows.map(|window| dot(window, weights)).collect()
    }
}

/// Products of two columns, in eight sums side by side.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let cut = a.len() / 8 * 8;
    for (a, b) in a[..cut].chunks_exact(8).zip(b[..cut].chunks_exact(8)) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + a[cut..].iter().zip(&b[cut..]).map(|(a, b)| a * b).sum::<f64>()
}
