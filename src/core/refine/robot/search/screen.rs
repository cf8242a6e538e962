//! What single candidates would gain, in one look.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::{Candidate, Search};
use crate::refine::robot::kernel::dot;

/// What single candidates would gain beside nuisances and picks.
pub(in crate::refine::robot) struct Screen<'a> {
    active: Vec<&'a [f64]>,
    factors: Cholesky<f64, nalgebra::Dyn>,
    left: Vec<f64>,
}

impl<'a> Screen<'a> {
    pub(in crate::refine::robot) fn new(search: &'a Search<'_>, picks: &'a [Candidate]) -> Option<Self> {
        let active = search.columns(picks);
        let members = search.members(picks);
        let mut gram = DMatrix::from_fn(active.len(), active.len(), |i, j| {
            if j <= i { dot(active[i], active[j]) } else { 0.0 }
        });
        for j in 0..active.len() {
            for i in 0..j {
                gram[(i, j)] = gram[(j, i)];
            }
            gram[(j, j)] = gram[(j, j)] * (1.0 + 1e-9) + 1.0 / members[j].spread.powi(2);
        }
        let factors = gram.cholesky()?;
        let right =
            DVector::from_iterator(active.len(), active.iter().map(|column| dot(column, &search.target)));
        let coefficients = factors.solve(&right);
        let mut left = search.target.clone();
        for (column, coefficient) in active.iter().zip(&coefficients) {
            left.iter_mut().zip(*column).for_each(|(left, value)| *left -= coefficient * value);
        }
        Some(Self { active, factors, left })
    }

    /// Share of a candidate's columns that nuisances and picks cannot say, the largest of its columns.
    pub(in crate::refine::robot) fn own_share(&self, candidate: &Candidate) -> f64 {
        let share = |column: &Vec<f64>| {
            let with =
                DVector::from_iterator(self.active.len(), self.active.iter().map(|other| dot(other, column)));
            let power = dot(column, column);
            if power > 0.0 { 1.0 - with.dot(&self.factors.solve(&with)) / power } else { 0.0 }
        };
        candidate.white.iter().map(share).fold(0.0, f64::max)
    }

    /// Sum of squares that a candidate would take away; 0 where its size would be impossible.
    pub(super) fn gain(&self, candidate: &Candidate) -> f64 {
        let size = candidate.white.len();
        let with: Vec<DVector<f64>> = candidate
            .white
            .iter()
            .map(|column| {
                DVector::from_iterator(self.active.len(), self.active.iter().map(|other| dot(other, column)))
            })
            .collect();
        let solved: Vec<DVector<f64>> = with.iter().map(|with| self.factors.solve(with)).collect();
        let own = DMatrix::from_fn(size, size, |i, j| {
            let direct = dot(&candidate.white[i], &candidate.white[j]);
            let ridge = if i == j { 1e-9 * direct } else { 0.0 };
            direct - with[i].dot(&solved[j]) + ridge
        });
        // With priors in the factors the left residual is not orthogonal to the nuisances; its gradient is what counts.
        let right =
            DVector::from_iterator(size, candidate.white.iter().map(|column| dot(column, &self.left)));
        let Some(factors) = own.cholesky() else { return 0.0 };
        let values = factors.solve(&right);
        let bounds = candidate.bounds();
        let fixed = candidate.is_fixed();
        // A fixed one is screened loosely, its shape is refined later.
        let possible = values.iter().zip(&bounds).all(|(value, [low, high])| {
            let (low, high) = if fixed { (0.3 * low, 3.0 * high) } else { (*low, *high) };
            (low..=high).contains(value)
        });
        if !possible {
            return 0.0;
        }
        if !fixed {
            return right.dot(&values);
        }
        let value = values[0].clamp(bounds[0][0], bounds[0][1]);
        2.0 * value * right[0] - value * value / values[0] * right[0]
    }
}
