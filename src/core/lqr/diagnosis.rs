//! Names the cause once an outcome was refused: the Popov-Belevitch-Hautus tests on the modes of A that do
//! not die out, then the Hamiltonian's eigenvalues. Nothing here decides whether there is a solution.

use nalgebra::{Complex, DMatrix, DVector};

use super::doubling::Riccati;
use super::error::CareError;
use super::poles::eigenvalues;
use super::real::Real;
use super::sign::hamiltonian;
use super::square::{Square, SquareN};

/// Smallest singular value, relative to the norm of A, below which a mode counts as out of reach.
const OUT_OF_REACH: f64 = 1e-10;
/// Real part, relative to the norm, from which on a mode counts as not dying out.
const NOT_DYING_OUT: f64 = -1e-7;
/// Distance to the imaginary axis, relative to the norm, of a Hamiltonian eigenvalue that counts as on it.
const ON_AXIS: f64 = 1e-6;

/// A mode of A that a PBH test found out of reach.
pub(super) struct LostMode {
    pub(super) eigenvalue: Complex<f64>,
    /// Its direction in the state space: an eigenvector of A (not detectable) or of Aᵀ (not stabilisable).
    pub(super) direction: DVector<Complex<f64>>,
}

/// Returns the reason why `equation` has no stabilising solution.
pub(super) fn cause<T: Real>(equation: &Riccati<SquareN<T>>) -> CareError {
    let [a, g, q] = [&equation.a, &equation.g, &equation.q].map(to_dmatrix);
    if let Some(mode) = lost_mode(&a.transpose(), &g) {
        return CareError::NotStabilisable { eigenvalue: mode.eigenvalue };
    }
    let double = Riccati {
        a: equation.a.map(Real::to_f64),
        g: equation.g.map(Real::to_f64),
        q: equation.q.map(Real::to_f64),
    };
    let matrix = hamiltonian(&double);
    let norm = matrix.norm();
    let mut spectrum = vec![Complex::default(); matrix.size()];
    let nearest = eigenvalues(matrix, &mut spectrum)
        .and_then(|()| spectrum.into_iter().min_by(|one, other| one.re.abs().total_cmp(&other.re.abs())));
    if let Some(mode) = lost_mode(&a, &q) {
        return CareError::NotDetectable { eigenvalue: mode.eigenvalue };
    }
    match nearest {
        Some(eigenvalue) if eigenvalue.re.abs() <= ON_AXIS * norm => CareError::NoSolution { eigenvalue },
        _ => CareError::IllConditioned,
    }
}

/// The mode of `a` (v with a v = λ v, Re λ ≥ 0 to rounding) that `rows` sees least, where rows·v ≈ 0.
pub(super) fn lost_mode(a: &DMatrix<f64>, rows: &DMatrix<f64>) -> Option<LostMode> {
    let n = a.nrows();
    // Norms of large entries would overflow.
    let (unit, a, rows) = (a.amax(), of_largest_one(a), of_largest_one(rows));
    let mut modes = vec![Complex::default(); n];
    eigenvalues(SquareN::from_fn(n, |i, j| a[(i, j)]), &mut modes)?;
    let (size, weight) = (a.norm(), rows.norm());
    let row_scale = if weight > 0.0 { size.max(f64::MIN_POSITIVE) / weight } else { 0.0 };
    modes
        .into_iter()
        .filter(|mode| mode.im >= 0.0 && mode.re >= NOT_DYING_OUT * size)
        .filter_map(|eigenvalue| {
            let test = DMatrix::from_fn(n + rows.nrows(), n, |i, j| match i < n {
                true if i == j => Complex::from(a[(i, j)]) - eigenvalue,
                true => Complex::from(a[(i, j)]),
                false => Complex::from(rows[(i - n, j)] * row_scale),
            });
            let (value, direction) = smallest_singular(test)?;
            (value <= OUT_OF_REACH * size).then_some((value, LostMode { eigenvalue, direction }))
        })
        .min_by(|(one, _), (other, _)| one.total_cmp(other))
        .map(|(_, mode)| LostMode { eigenvalue: mode.eigenvalue * unit, ..mode })
}

/// The matrix over its largest entry.
fn of_largest_one(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.amax();
    if largest > 0.0 { matrix.map(|entry| entry / largest) } else { matrix.clone() }
}

/// Smallest singular value and its right vector.
fn smallest_singular(matrix: DMatrix<Complex<f64>>) -> Option<(f64, DVector<Complex<f64>>)> {
    if matrix.iter().any(|entry| !(entry.re.is_finite() && entry.im.is_finite())) {
        return None;
    }
    let svd = matrix.try_svd(false, true, f64::EPSILON, 10_000)?;
    let (index, value) = svd.singular_values.argmin();
    Some((value, svd.v_t?.row(index).adjoint()))
}

fn to_dmatrix<T: Real>(matrix: &SquareN<T>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.size(), matrix.size(), |i, j| matrix.at(i, j).to_f64())
}
