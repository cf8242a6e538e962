//! Linear least squares with a handful of unknowns.

use nalgebra::{SMatrix, SVector};

/// Solution of min Σ (y − row·solution)².
#[derive(Clone, Copy, Debug)]
pub(super) struct Solution<const N: usize> {
    pub(super) value: SVector<f64, N>,
    /// Standard deviations, from the residual.
    pub(super) deviation: SVector<f64, N>,
    /// Sum of the squared residual.
    pub(super) residual: f64,
}

/// Solves for the unknowns of rows (regressors, y); `None` if they are not independent. Each column is scaled by its
/// norm first, so that regressors may have any size.
pub(super) fn least_squares<const N: usize>(
    rows: impl Iterator<Item = ([f64; N], f64)> + Clone,
) -> Option<Solution<N>> {
    let norm = rows.clone().fold([0.0; N], |mut squares: [f64; N], (row, _)| {
        squares.iter_mut().zip(row).for_each(|(square, value)| *square += value * value);
        squares
    });
    let scale = SVector::<f64, N>::from(norm.map(f64::sqrt));
    if scale.iter().any(|scale| *scale == 0.0) {
        return None;
    }
    let (mut information, mut moment, mut square, mut count) =
        (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros(), 0.0, 0.0);
    for (row, y) in rows {
        let row = SVector::<f64, N>::from(row).component_div(&scale);
        information += row * row.transpose();
        moment += row * y;
        square += y * y;
        count += 1.0;
    }
    let inverse = information.try_inverse()?;
    let solution = inverse * moment;
    let residual = (square - solution.dot(&moment)).max(0.0);
    let variance = residual / (count - N as f64).max(1.0);
    let deviation = inverse.diagonal().map(|diagonal| (variance * diagonal).max(0.0).sqrt());
    Some(Solution {
        value: solution.component_div(&scale),
        deviation: deviation.component_div(&scale),
        residual,
    })
}
