//! The robot's LQR design: four states, two inputs, on the stack.

use nalgebra::{Complex, DMatrix, Matrix2, Matrix2x4, Matrix4, Matrix4x2, SMatrix};
use pulp::{Arch, NullaryFnOnce};

use super::care::{CareInput, solve_care};
use super::checks::{check_finite, check_symmetric};
use super::diagnosis::lost_mode;
use super::doubling::{Rest, Riccati, double};
use super::error::{CareError, DesignError};
use super::newton::lyapunov;
use super::poles::eigenvalues;
use super::square::{Square, Square4};
use crate::model::LinearModel;
use crate::model::Weights;

/// Gain, cost and closed loop of u = −K X (Eqs. 13, 24, 25).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LqrDesign {
    /// K = R⁻¹BᵀP, 2×4: rows left and right; N m/m, N m s/m, N m/rad, N m s/rad.
    pub gain: Matrix2x4<f64>,
    /// P, 4×4, symmetric positive semidefinite: ½ X₀ᵀPX₀ is the cost from X₀ on.
    pub cost: Matrix4<f64>,
    /// Eigenvalues of A − BK, 1/s, conjugates next to each other; all left of the imaginary axis.
    pub poles: [Complex<f64>; 4],
    /// ‖AᵀP + PA − PBR⁻¹BᵀP + Q‖_F / ‖P‖_F.
    pub riccati_residual: f64,
}

/// Part of Q's diagonal that may be missing from semidefiniteness, for rounding.
const SEMIDEFINITE_TOLERANCE: f64 = 1e-14;
/// R's determinant, relative to the product of its diagonal, below which G needs more digits than a double.
const WELL_CONDITIONED: f64 = 1e-3;
/// Residual, relative to P, above which the quick path gives way to the thorough one.
const QUICK_RESIDUAL: f64 = 1e-13;
/// Threshold for the relative error of P.
const QUICK_ERROR: f64 = 1e-12;
/// Relative size of the Newton step whose square is below every other error.
const QUICK_CORRECTION: f64 = 1e-7;
/// Distance to the imaginary axis, relative to the norm of A, below which the quick path cannot be sure of a
/// pole's side.
const DOUBTFUL: f64 = 1e-11;
/// Threshold below which a pole counts as on the axis.
const ON_AXIS: f64 = 1e-13;
/// The states as the model file and the window name them.
const STATES: [&str; 4] = ["x", "x_dot", "pitch", "pitch_rate"];

/// The optimal gain for `model` and `weights`: solves AᵀP + PA − PBR⁻¹BᵀP + Q = 0 (Eq. 25) for P, 4×4, and
/// returns K = R⁻¹BᵀP (Eq. 24) of u = −K X with the closed loop's poles.
///
/// Q must be symmetric positive semidefinite (to 1e-14 of each diagonal entry), R symmetric positive definite,
/// and every state must be reachable and, where it does not die out by itself, cost something. The paper asks
/// for poles that are "non-positive"; here they must be left of the imaginary axis, because a pole on it
/// means that a displacement stays for ever.
///
/// # Errors
/// [`DesignError`] names the entry, the weight or the mode that stands in the way.
///
/// # Method
/// Structure-preserving doubling and one Newton step on the stack; where the outcome is not good to rounding,
/// [`solve_care`] takes over.
///
/// ```
/// let model = flqr_core::model_file::presets::paper();
/// let robot = model.robot().ok_or("no robot")?;
/// let weights = robot.weights.ok_or("no weights")?;
/// let design = flqr_core::lqr::design(&robot.parameters.linear_model(), &weights)?;
/// assert!(design.poles.iter().all(|pole| pole.re < 0.0) && design.riccati_residual < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn design(model: &LinearModel, weights: &Weights) -> Result<LqrDesign, DesignError> {
    check(model, weights)?;
    if let Some(design) = Arch::new().dispatch(Quick { model, weights }) {
        return Ok(design);
    }
    thorough(model, weights)
}

fn check(model: &LinearModel, weights: &Weights) -> Result<(), DesignError> {
    check_finite("a", &model.a)?;
    check_finite("b", &model.b)?;
    check_finite("q", &weights.q)?;
    check_finite("r", &weights.r)?;
    check_symmetric("q", &weights.q)?;
    check_symmetric("r", &weights.r)?;
    if !is_positive_semidefinite(&weights.q) {
        return Err(DesignError::QNotPositiveSemidefinite);
    }
    let r = &weights.r;
    if !(r[(0, 0)] > 0.0 && r[(1, 1)] > 0.0 && relative_determinant(r) > f64::EPSILON) {
        return Err(CareError::RNotPositiveDefinite.into());
    }
    Ok(())
}

/// L D Lᵀ of Q, its diagonal enlarged by the tolerance, has no negative pivot.
fn is_positive_semidefinite(q: &Matrix4<f64>) -> bool {
    let mut rest = *q;
    for k in 0..4 {
        rest[(k, k)] += SEMIDEFINITE_TOLERANCE * q[(k, k)];
        let pivot = rest[(k, k)];
        if pivot < 0.0 || (pivot == 0.0 && (k + 1..4).any(|i| rest[(i, k)] != 0.0)) {
            return false;
        }
        for i in (k + 1..4).filter(|_| pivot > 0.0) {
            let factor = rest[(i, k)] / pivot;
            for j in k + 1..=i {
                rest[(i, j)] -= factor * rest[(j, k)];
            }
        }
    }
    true
}

/// det R over the product of R's diagonal, 1 for a diagonal R.
fn relative_determinant(r: &Matrix2<f64>) -> f64 {
    let ratio = r[(0, 1)] / r[(0, 0)] * (r[(1, 0)] / r[(1, 1)]);
    1.0 - ratio
}

/// [`quick`] as a call that is compiled for each instruction set; the digits are the same on all.
struct Quick<'a> {
    model: &'a LinearModel,
    weights: &'a Weights,
}

impl NullaryFnOnce for Quick<'_> {
    type Output = Option<LqrDesign>;

    #[inline(always)]
    fn call(self) -> Option<LqrDesign> {
        quick(self.model, self.weights)
    }
}

/// Doubling and one Newton step in double on the stack; `None` where the outcome is not good to rounding.
#[inline(always)]
fn quick(model: &LinearModel, weights: &Weights) -> Option<LqrDesign> {
    if relative_determinant(&weights.r) < WELL_CONDITIONED {
        return None;
    }
    let input = weighted_input(&model.b, &weights.r);
    let equation = Riccati {
        a: square(&model.a),
        g: square(&(model.b * input)).symmetric_part(),
        q: square(&weights.q).symmetric_part(),
    };
    let shift = shift(&equation)?;
    let doubled = double(&equation, shift, Rest { change: 1e-5, steps: 30 })?;
    let doubled_residual = equation.residual(&doubled);
    let correction = lyapunov(&equation.closed_loop(&doubled), &doubled_residual, shift, 30)?;
    let p = doubled.plus_multiple(&correction, 1.0);
    let relative = |matrix: &Square4| matrix.norm() / p.norm();
    let (residual, change) = (relative(&equation.residual(&p)), relative(&correction));
    // What is left of the residual asks for a correction in proportion.
    let error = residual * change / relative(&doubled_residual).max(f64::MIN_POSITIVE);
    if !(residual <= QUICK_RESIDUAL && change <= QUICK_CORRECTION && error <= QUICK_ERROR) {
        return None;
    }
    let mut poles = [Complex::default(); 4];
    eigenvalues(equation.closed_loop(&p), &mut poles)?;
    let doubtful = -DOUBTFUL * equation.a.norm();
    if !poles.iter().all(|pole| pole.re < doubtful) {
        return None;
    }
    let cost = Matrix4::from_row_slice(&p.0);
    Some(LqrDesign { gain: input * cost, cost, poles, riccati_residual: residual })
}

/// R⁻¹Bᵀ; its rows are equal to the last bit where B's columns are and R's diagonal is.
fn weighted_input(b: &Matrix4x2<f64>, r: &Matrix2<f64>) -> Matrix2x4<f64> {
    let determinant = r[(0, 0)] * r[(1, 1)] - r[(0, 1)] * r[(1, 0)];
    let row = |own: usize, other: usize| {
        (b.column(own) * r[(other, other)] - b.column(other) * r[(own, other)]) / determinant
    };
    Matrix2x4::from_rows(&[row(0, 1).transpose(), row(1, 0).transpose()])
}

fn square(matrix: &Matrix4<f64>) -> Square4 {
    Square4(std::array::from_fn(|index| matrix[(index / 4, index % 4)]))
}

/// Half the root mean square of the poles, which is nearer to their middle, from the trace of the
/// Hamiltonian's square.
#[inline(always)]
fn shift(equation: &Riccati<Square4>) -> Option<f64> {
    let squares = equation.a.trace_of_product(&equation.a) + equation.g.trace_of_product(&equation.q);
    let mean = 0.5 * (0.25 * squares.abs()).sqrt();
    (mean > 0.0 && mean.is_finite()).then_some(mean)
}

/// The general solver, and the cause where it finds nothing that can balance a robot.
#[cold]
fn thorough(model: &LinearModel, weights: &Weights) -> Result<LqrDesign, DesignError> {
    let (a, q) = (dynamic(&model.a), dynamic(&weights.q));
    let (b, r) = (dynamic(&model.b), dynamic(&weights.r));
    let solution = match solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r }) {
        Err(CareError::NotDetectable { eigenvalue }) => return Err(cause(&a, &b, &q, eigenvalue)),
        outcome => outcome?,
    };
    let mut poles = [Complex::default(); 4];
    poles.copy_from_slice(&solution.poles);
    if let Some(pole) = poles.into_iter().find(|pole| pole.re >= -ON_AXIS * a.norm()) {
        return Err(cause(&a, &b, &q, pole));
    }
    let cost = Matrix4::from_column_slice(solution.p.as_slice());
    let gain = match solution.gain {
        Some(gain) => Matrix2x4::from_column_slice(gain.as_slice()),
        None => weighted_input(&model.b, &weights.r) * cost,
    };
    Ok(LqrDesign { gain, cost, poles, riccati_residual: solution.relative_residual })
}

/// Which mode stays for ever, given that the closed loop has `pole` on or right of the axis.
fn cause(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, pole: Complex<f64>) -> DesignError {
    if let Some(mode) = lost_mode(&a.transpose(), &b.transpose()) {
        return CareError::NotStabilisable { eigenvalue: mode.eigenvalue }.into();
    }
    match lost_mode(a, q) {
        Some(mode) => {
            DesignError::NotDetectable { eigenvalue: mode.eigenvalue, state: STATES[mode.direction.icamax()] }
        }
        None => DesignError::NotStable { pole },
    }
}

fn dynamic<const ROWS: usize, const COLUMNS: usize>(matrix: &SMatrix<f64, ROWS, COLUMNS>) -> DMatrix<f64> {
    DMatrix::from_column_slice(ROWS, COLUMNS, matrix.as_slice())
}
