//! The quadratic term G = B R⁻¹ Bᵀ and the gain R⁻¹BᵀP, in double-double: where R is nearly singular, G in
//! double has lost the answer already.

use nalgebra::DMatrix;

use super::care::CareInput;
use super::checks::{check_finite, check_shape, check_symmetric};
use super::double_double::DoubleDouble;
use super::error::CareError;
use super::real::Real;
use super::square::{Square, SquareN};

/// G, and what it was made of.
pub(super) struct Input {
    pub(super) g: SquareN<DoubleDouble>,
    pub(super) weighted: Option<WeightedInput>,
}

/// B and R, factored: R = L Lᵀ.
pub(super) struct WeightedInput {
    states: usize,
    /// L, m×m.
    factor: SquareN<DoubleDouble>,
    /// L⁻¹Bᵀ, m rows of n.
    rows: Vec<Vec<DoubleDouble>>,
}

impl Input {
    pub(super) fn new(states: usize, input: CareInput) -> Result<Self, CareError> {
        match input {
            CareInput::Weighted { b, r } => {
                let weighted = WeightedInput::new(states, b, r)?;
                Ok(Self { g: weighted.quadratic_term(), weighted: Some(weighted) })
            }
            CareInput::Quadratic { g } => {
                check_shape("g", g, [states, states])?;
                check_finite("g", g)?;
                check_symmetric("g", g)?;
                Ok(Self { g: from_dmatrix(g).symmetric_part(), weighted: None })
            }
        }
    }
}

impl WeightedInput {
    fn new(states: usize, b: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<Self, CareError> {
        check_shape("b", b, [states, r.nrows()])?;
        check_shape("r", r, [r.nrows(), r.nrows()])?;
        check_finite("b", b)?;
        check_finite("r", r)?;
        check_symmetric("r", r)?;
        let factor = cholesky(&from_dmatrix(r).symmetric_part()).ok_or(CareError::RNotPositiveDefinite)?;
        let mut rows: Vec<Vec<DoubleDouble>> = b
            .column_iter()
            .map(|column| column.iter().map(|&entry| Real::from_f64(entry)).collect())
            .collect();
        substitute_forward(&factor, &mut rows);
        Ok(Self { states, factor, rows })
    }

    fn quadratic_term(&self) -> SquareN<DoubleDouble> {
        SquareN::from_fn(self.states, |i, j| {
            self.rows.iter().fold(DoubleDouble::ZERO, |sum, row| sum + row[i] * row[j])
        })
    }

    /// K = L⁻ᵀ (L⁻¹Bᵀ) P, m×n.
    pub(super) fn gain(&self, p: &SquareN<DoubleDouble>) -> DMatrix<f64> {
        let times_p = |row: &Vec<DoubleDouble>| -> Vec<DoubleDouble> {
            let column =
                |j| row.iter().enumerate().fold(DoubleDouble::ZERO, |sum, (i, &x)| sum + x * p.at(i, j));
            (0..self.states).map(column).collect()
        };
        let mut rows: Vec<_> = self.rows.iter().map(times_p).collect();
        substitute_back(&self.factor, &mut rows);
        DMatrix::from_fn(rows.len(), self.states, |i, j| rows[i][j].to_f64())
    }
}

pub(super) fn from_dmatrix(matrix: &DMatrix<f64>) -> SquareN<DoubleDouble> {
    SquareN::from_fn(matrix.nrows(), |i, j| DoubleDouble::from_f64(matrix[(i, j)]))
}

/// L of `matrix` = L Lᵀ; `None` unless every pivot is above the rounding of the doubles that `matrix` came in.
fn cholesky(matrix: &SquareN<DoubleDouble>) -> Option<SquareN<DoubleDouble>> {
    let size = matrix.size();
    let mut lower = matrix.zeros();
    for column in 0..size {
        for row in column..size {
            let mut rest = matrix.at(row, column);
            for k in 0..column {
                rest -= lower.at(row, k) * lower.at(column, k);
            }
            if row > column {
                lower.set(row, column, rest / lower.at(column, column));
                continue;
            }
            let negligible = f64::EPSILON * matrix.at(row, row).to_f64();
            if rest.to_f64() <= negligible.max(0.0) {
                return None;
            }
            lower.set(row, row, rest.sqrt());
        }
    }
    Some(lower)
}

/// rows ← L⁻¹ rows
fn substitute_forward(lower: &SquareN<DoubleDouble>, rows: &mut [Vec<DoubleDouble>]) {
    for i in 0..rows.len() {
        let (done, rest) = rows.split_at_mut(i);
        for (k, other) in done.iter().enumerate() {
            subtract_multiple(&mut rest[0], other, lower.at(i, k));
        }
        divide(&mut rest[0], lower.at(i, i));
    }
}

/// rows ← L⁻ᵀ rows
fn substitute_back(lower: &SquareN<DoubleDouble>, rows: &mut [Vec<DoubleDouble>]) {
    for i in (0..rows.len()).rev() {
        let (head, done) = rows.split_at_mut(i + 1);
        for (offset, other) in done.iter().enumerate() {
            subtract_multiple(&mut head[i], other, lower.at(i + 1 + offset, i));
        }
        divide(&mut head[i], lower.at(i, i));
    }
}

fn subtract_multiple(row: &mut [DoubleDouble], other: &[DoubleDouble], factor: DoubleDouble) {
    for (entry, &term) in row.iter_mut().zip(other) {
        *entry -= factor * term;
    }
}

fn divide(row: &mut [DoubleDouble], divisor: DoubleDouble) {
    for entry in row {
        *entry = *entry / divisor;
    }
}
