//! Linear least squares with intervals that hold under coloured residuals.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

/// Most blocks of the delete-a-block intervals; 20 degrees of freedom less one cost 7 % of width.
const BLOCKS: usize = 20;
/// Fewest blocks from which an interval is told.
const FEWEST_BLOCKS: usize = 6;
/// Student's t at 97.5 % for 5 to 19 degrees of freedom.
const STUDENT: [f64; 15] = [
    2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281, 2.2010, 2.1788, 2.1604, 2.1448, 2.1314, 2.1199, 2.1098,
    2.1009, 2.0930,
];

/// Least squares through normal equations of columns scaled to length 1: the fits here have a handful of
/// columns, and what is too close to call is refused by [`Normal::sines`] long before squaring hurts.
pub(super) struct Normal {
    /// Lengths of the columns.
    lengths: DVector<f64>,
    /// Correlations of the columns.
    gram: DMatrix<f64>,
}

impl Normal {
    pub(super) fn new(columns: &[Vec<f64>]) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let lengths = DVector::from_iterator(columns.len(), columns.iter().map(|c| dot(c, c).sqrt()));
        let entry = |i: usize, j: usize| match lengths[i] * lengths[j] {
            0.0 => 0.0,
            product => dot(&columns[i], &columns[j]) / product,
        };
        let gram = DMatrix::from_fn(columns.len(), columns.len(), entry);
        Self { lengths, gram }
    }

    /// For each column the sine of its angle to the span of the others: 0 where it says nothing of its own.
    pub(super) fn sines(&self) -> Vec<f64> {
        let count = self.lengths.len();
        match self.gram.clone().cholesky() {
            Some(factors) => factors.inverse().diagonal().iter().map(|v| 1.0 / v.sqrt()).collect(),
            None => (0..count).map(|index| self.sine_by_removal(index)).collect(),
        }
    }

    /// For a singular set: whether the others without this column are less singular.
    fn sine_by_removal(&self, index: usize) -> f64 {
        let rank = |gram: DMatrix<f64>| gram.symmetric_eigenvalues().iter().filter(|&&v| v > 1e-10).count();
        let others = self.gram.clone().remove_row(index).remove_column(index);
        if others.is_empty() || rank(others) < rank(self.gram.clone()) { 1.0 } else { 0.0 }
    }

    /// Largest by smallest singular value of the scaled columns.
    pub(super) fn condition(&self) -> f64 {
        let values = self.gram.clone().symmetric_eigenvalues();
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = values.iter().copied().fold(0.0, f64::max);
        (largest / smallest.max(0.0)).sqrt()
    }

    /// The coefficients, or nothing where the columns depend on each other.
    pub(super) fn solve(&self, columns: &[Vec<f64>], target: &[f64]) -> Option<DVector<f64>> {
        let moment = |(column, length): (&Vec<f64>, &f64)| {
            column.iter().zip(target).map(|(a, b)| a * b).sum::<f64>() / length
        };
        let moments = DVector::from_iterator(columns.len(), columns.iter().zip(&self.lengths).map(moment));
        let scaled = self.gram.clone().cholesky()?.solve(&moments);
        Some(scaled.component_div(&self.lengths))
    }
}

/// Residual of the target.
pub(super) fn residual(columns: &[Vec<f64>], coefficients: &DVector<f64>, target: &[f64]) -> Vec<f64> {
    let mut left = target.to_vec();
    for (column, coefficient) in columns.iter().zip(coefficients) {
        left.iter_mut().zip(column).for_each(|(left, value)| *left -= coefficient * value);
    }
    left
}

/// Half widths of 95 % intervals: the spread of the coefficients as one block of neighbouring rows after
/// another is left out (jackknife), with Student's t. Residuals may be correlated over less than a block and
/// of uneven size. Nothing where there are too few rows, or a coefficient hangs on one block.
///
/// `columns` are the derivatives of the model, `residual` what it leaves at the least-squares solution.
pub(super) fn half_widths(columns: &[Vec<f64>], residual: &[f64]) -> Option<DVector<f64>> {
    let blocks = blocks(residual.len(), columns.len())?;
    let whole = moments(columns, residual, &(0..residual.len()));
    let mut spread = DVector::zeros(columns.len());
    for block in &blocks {
        let part = moments(columns, residual, block);
        let shift = solve_scaled(&whole.0 - part.0, &(&whole.1 - part.1))?;
        spread += shift.component_mul(&shift);
    }
    let count = blocks.len() as f64;
    let student = STUDENT[blocks.len() - FEWEST_BLOCKS];
    Some(spread.map(|sum: f64| student * (sum * (count - 1.0) / count).sqrt()))
}

/// Blocks of neighbouring rows, as many as leave twice as many rows as coefficients in each, but at least the
/// fewest that carry an interval.
fn blocks(rows: usize, coefficients: usize) -> Option<Vec<Range<usize>>> {
    let count =
        (rows / (2 * coefficients.max(4))).clamp(FEWEST_BLOCKS.min(rows / coefficients.max(1)), BLOCKS);
    let bound = |index: usize| index * rows / count;
    (count >= FEWEST_BLOCKS).then(|| (0..count).map(|index| bound(index)..bound(index + 1)).collect())
}

/// JᵀJ and Jᵀr over some rows.
fn moments(columns: &[Vec<f64>], residual: &[f64], rows: &Range<usize>) -> (DMatrix<f64>, DVector<f64>) {
    let dot =
        |a: &[f64], b: &[f64]| a[rows.clone()].iter().zip(&b[rows.clone()]).map(|(a, b)| a * b).sum::<f64>();
    let count = columns.len();
    let gram = DMatrix::from_fn(count, count, |i, j| dot(&columns[i], &columns[j]));
    (gram, DVector::from_fn(count, |i, _| dot(&columns[i], residual)))
}

/// Solves with the matrix scaled to a diagonal of 1; nothing where it is singular.
fn solve_scaled(matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = matrix.diagonal().map(|value| 1.0 / value.sqrt());
    if !scale.iter().all(|value| value.is_finite()) {
        return None;
    }
    let scaled =
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let factors = scaled.cholesky()?;
    let diagonal = factors.l_dirty().diagonal();
    if diagonal.iter().any(|&value| value < 1e-5) {
        return None;
    }
    Some(factors.solve(&right.component_mul(&scale)).component_mul(&scale))
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn uniform(random: &mut ChaCha8Rng) -> f64 {
        random.next_u32() as f64 / u32::MAX as f64 - 0.5
    }

    /// First-order coloured noise.
    fn coloured(random: &mut ChaCha8Rng, memory: f64, rows: usize) -> Vec<f64> {
        let mut state = 0.0;
        (0..rows)
            .map(|_| {
                state = memory * state + uniform(random);
                state
            })
            .collect()
    }

    /// Slow columns under noise with a memory of ten rows: intervals for independent rows would hold in about
    /// four of ten cases.
    #[test]
    fn intervals_hold_the_truth_under_coloured_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let (truth, runs) = (DVector::from_vec(vec![2.0, -1.0]), 200);
        let mut held = 0;
        for _ in 0..runs {
            let columns = vec![vec![1.0; 600], coloured(&mut random, 0.9, 600)];
            let noise = coloured(&mut random, 0.9, 600);
            let target: Vec<f64> = residual(&columns, &-&truth, &noise);
            let found = Normal::new(&columns).solve(&columns, &target).unwrap();
            let widths = half_widths(&columns, &residual(&columns, &found, &target)).unwrap();
            held += (0..2).filter(|&i| (found[i] - truth[i]).abs() < widths[i]).count();
        }
        assert!((360..=394).contains(&held), "{held} of {} intervals hold the truth", 2 * runs);
    }

    #[test]
    fn sines_tell_which_columns_depend_on_each_other() {
        let ramp: Vec<f64> = (0..10).map(f64::from).collect();
        let twice: Vec<f64> = ramp.iter().map(|v| 2.0 * v).collect();
        let wave: Vec<f64> = (0..10).map(|k| f64::from(k % 2) - 0.5).collect();
        let sines = Normal::new(&[ramp.clone(), twice, wave.clone()]).sines();
        assert!(sines[0] < 1e-6 && sines[1] < 1e-6 && sines[2] > 0.9, "{sines:?}");
        let sines = Normal::new(&[vec![0.0; 10], wave]).sines();
        assert!(sines[0] < 1e-6 && sines[1] > 0.9, "{sines:?}");
    }

    #[test]
    fn a_coefficient_that_hangs_on_one_block_has_no_interval() {
        let mut step = vec![0.0; 200];
        step[..5].fill(1.0);
        assert_eq!(half_widths(&[vec![1.0; 200], step], &vec![0.1; 200]), None);
    }
}
