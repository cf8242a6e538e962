//! Checks of matrices before solving: shape, finite entries, symmetry.

use nalgebra::{DMatrix, Dim, Matrix, RawStorage};

use super::error::CareError;

/// Largest |mᵢⱼ − mⱼᵢ| that counts as symmetric, relative to the largest entry: room for products rounded in
/// another order, none for a typing error.
const SYMMETRY_TOLERANCE: f64 = 1e-12;

pub(super) fn check_shape(
    matrix: &'static str,
    found: &DMatrix<f64>,
    [rows, columns]: [usize; 2],
) -> Result<(), CareError> {
    if found.shape() == (rows, columns) {
        return Ok(());
    }
    let (found_rows, found_columns) = found.shape();
    Err(CareError::Shape {
        matrix,
        rows: found_rows,
        columns: found_columns,
        needed_rows: rows,
        needed_columns: columns,
    })
}

pub(super) fn check_finite<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    matrix: &'static str,
    entries: &Matrix<f64, R, C, S>,
) -> Result<(), CareError> {
    // Column by column, as stored.
    match entries.iter().position(|entry| !entry.is_finite()) {
        None => Ok(()),
        Some(index) => {
            let (row, column) = (index % entries.nrows(), index / entries.nrows());
            Err(CareError::NonFinite {
                matrix,
                row: row + 1,
                column: column + 1,
                value: entries[(row, column)],
            })
        }
    }
}

pub(super) fn check_symmetric<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(
    matrix: &'static str,
    entries: &Matrix<f64, R, C, S>,
) -> Result<(), CareError> {
    let tolerance = SYMMETRY_TOLERANCE * entries.iter().fold(0.0, |largest, entry| entry.abs().max(largest));
    for column in 0..entries.ncols() {
        for row in 0..column {
            let (upper, lower) = (entries[(row, column)], entries[(column, row)]);
            if (upper - lower).abs() > tolerance {
                return Err(CareError::NotSymmetric {
                    matrix,
                    row: row + 1,
                    column: column + 1,
                    upper,
                    lower,
                });
            }
        }
    }
    Ok(())
}
