//! Errors of Riccati equations and designs.

use nalgebra::Complex;
use thiserror::Error;

/// Reason why [`solve_care`](super::solve_care) returns no P. Rows and columns count from 1.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CareError {
    /// A is 0×0.
    #[error("matrix a has no rows: give at least one state")]
    NoStates,
    /// A matrix does not fit the others.
    #[error(
        "matrix {matrix} is {rows}×{columns} but must be {needed_rows}×{needed_columns} to fit the others"
    )]
    #[expect(missing_docs, reason = "named as what they are")]
    Shape { matrix: &'static str, rows: usize, columns: usize, needed_rows: usize, needed_columns: usize },
    /// An entry is NaN or infinite.
    #[error("entry ({row}, {column}) of matrix {matrix} is {value}: it must be a finite number")]
    #[expect(missing_docs, reason = "named as what they are")]
    NonFinite { matrix: &'static str, row: usize, column: usize, value: f64 },
    /// Q, R or G is not symmetric.
    #[error(
        "matrix {matrix} is not symmetric: entry ({row}, {column}) is {upper} but ({column}, {row}) is {lower}"
    )]
    #[expect(missing_docs, reason = "named as what they are")]
    NotSymmetric { matrix: &'static str, row: usize, column: usize, upper: f64, lower: f64 },
    /// R is singular to rounding, indefinite or negative.
    #[error("matrix r is not positive definite: every combination of inputs must have a positive cost")]
    RNotPositiveDefinite,
    /// A mode that no input reaches does not die out.
    #[error(
        "not stabilisable: the unstable mode of a at {} is not controllable: check a and b",
        text(eigenvalue)
    )]
    NotStabilisable {
        /// Eigenvalue of A, 1/s.
        eigenvalue: Complex<f64>,
    },
    /// A mode on or right of the imaginary axis costs nothing.
    #[error(
        "not detectable: the mode of a at {} is not asymptotically stable and has no cost: give its states a weight in q",
        text(eigenvalue)
    )]
    NotDetectable {
        /// Eigenvalue of A, 1/s.
        eigenvalue: Complex<f64>,
    },
    /// The Hamiltonian matrix has eigenvalues on the imaginary axis and no P bounds them.
    #[error(
        "no stabilising solution: the Hamiltonian matrix has an eigenvalue at {}, on the imaginary axis \
         within rounding: change q",
        text(eigenvalue)
    )]
    NoSolution {
        /// The Hamiltonian's eigenvalue next to the axis, 1/s.
        eigenvalue: Complex<f64>,
    },
    /// The condition leaves no digit.
    #[error(
        "no solution found: the equation is too ill-conditioned for 32 digits: scale or reduce the model"
    )]
    IllConditioned,
    /// Numbers so far apart that products of them leave the range of doubles.
    #[error(
        "matrix {matrix} has an entry of {value:.0e}, too large or too small compared with the others for double precision: choose \
         other units for the states, the inputs or the cost"
    )]
    TooFarApart {
        /// The matrix with the most extreme entry.
        matrix: &'static str,
        /// That entry.
        value: f64,
    },
    /// P exists but does not fit a double.
    #[error(
        "the solution exceeds the range of double precision: choose other units for the states or the cost"
    )]
    OutOfRange,
}

/// Reason why [`design`](super::design) returns no gain.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DesignError {
    /// The matrices are not fit for a Riccati equation, or it has no solution.
    #[error(transparent)]
    Equation(#[from] CareError),
    /// Q would reward some state.
    #[error("matrix q is not positive semidefinite: no combination of states may have a negative cost")]
    QNotPositiveSemidefinite,
    /// A mode on or right of the imaginary axis costs nothing.
    #[error(
        "not detectable: the mode at {} is not asymptotically stable and has no cost: give {state} a weight above 0",
        text(eigenvalue)
    )]
    NotDetectable {
        /// Eigenvalue of A, 1/s.
        eigenvalue: Complex<f64>,
        /// The state that takes the largest part in the mode: x, x_dot, pitch or pitch_rate.
        state: &'static str,
    },
    /// The closed loop would not come to rest.
    #[error(
        "the closed loop has a pole at {}, which is not asymptotically stable: raise the weights in q relative to those in r",
        text(pole)
    )]
    NotStable {
        /// Eigenvalue of A − BK, 1/s.
        pole: Complex<f64>,
    },
}

/// An eigenvalue in few digits; a real one without its imaginary zero.
fn text(eigenvalue: &Complex<f64>) -> String {
    let imaginary = number(eigenvalue.im.abs());
    match (number(eigenvalue.re), eigenvalue.im) {
        (real, 0.0) => real,
        (real, above) if above > 0.0 => format!("{real}+{imaginary}i"),
        (real, _) => format!("{real}-{imaginary}i"),
    }
}

fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        // + 0.0 takes the sign from a negative zero.
        return format!("{:.4}", value + 0.0).trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.1e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_are_written_in_few_digits() {
        let written = |re: f64, im: f64| text(&Complex::new(re, im));
        assert_eq!(written(-0.0, 0.0), "0");
        assert_eq!(written(0.500_000_000_000_000_4, 0.0), "0.5");
        assert_eq!(written(8.6e-18, -3.0), "8.6e-18-3i");
        assert_eq!(written(100.0, 2.25), "100+2.25i");
    }
}
