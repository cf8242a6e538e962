//! Least squares of what an effect adds over what a rival and the declared numbers can.

use nalgebra::{DMatrix, DVector};

/// Normal equations.
#[derive(Clone)]
pub(super) struct Normal {
    gram: DMatrix<f64>,
    right: DVector<f64>,
    square: f64,
}

impl Normal {
    pub(super) fn new(columns: &[Vec<f64>], told: &[f64]) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let count = columns.len();
        Self {
            gram: DMatrix::from_fn(count, count, |i, j| dot(&columns[i], &columns[j])),
            right: DVector::from_fn(count, |i, _| dot(&columns[i], told)),
            square: dot(told, told),
        }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self {
            gram: &self.gram + &other.gram,
            right: &self.right + &other.right,
            square: self.square + other.square,
        }
    }

    /// The least sum of squares, the first coefficients held within their tolerances.
    pub(super) fn least(&self, tolerances: &[f64]) -> f64 {
        let mut gram = self.gram.clone();
        for place in 0..gram.nrows() {
            let held = tolerances.get(place).map_or(0.0, |tolerance| 1.0 / (tolerance * tolerance));
            gram[(place, place)] += held + 1e-9 * gram[(place, place)] + 1e-300;
        }
        match gram.cholesky() {
            Some(factors) => (self.square - self.right.dot(&factors.solve(&self.right))).max(0.0),
            None => self.square,
        }
    }
}
