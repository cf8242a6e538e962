//! From a balanced equation to its stabilising solution: methods in the order of their price, each assessed
//! by its outcome.

use nalgebra::Complex;

use super::double_double::DoubleDouble;
use super::doubling::{Rest, Riccati, double};
use super::newton::lyapunov;
use super::poles::eigenvalues;
use super::real::Real;
use super::sign::{by_sign_function, hamiltonian};
use super::square::{Square, SquareN};

type Equation<T> = Riccati<SquareN<T>>;
type Exact = SquareN<DoubleDouble>;

/// A relative correction below this is below the rounding of P to double.
const NEGLIGIBLE: f64 = 1e-19;
/// A contraction of successive corrections in double slower than this will not reach [`NEGLIGIBLE`] soon.
const SLOW: f64 = 0.1;
/// Refinement in double-double: towards a pole on the axis Newton's method halves its error, beyond is rounding.
const STAGNANT: f64 = 0.75;
/// Corrections above this have no quadratic convergence to assess by yet.
const FAR: f64 = 1e-2;
/// Error above which digits are missing that the user would expect.
const WORTH_A_WARNING: f64 = 1e-9;
/// Error above which P is no answer.
const USELESS: f64 = 1e-2;
/// Newton steps at most; from far away each halves the error.
const NEWTON_STEPS: usize = 80;
/// Largest relative residual of a P whose stability cannot be proved.
const LIMIT_RESIDUAL: f64 = 1e-11;
/// Largest distance to the imaginary axis, relative to the norm of A − GP, of a pole that counts as on it.
const ON_AXIS: f64 = 1e-7;

/// A stabilising solution, or the limit of such.
pub(super) struct Found {
    pub(super) p: Exact,
    pub(super) poles: Vec<Complex<f64>>,
    pub(super) warnings: Vec<String>,
}

/// P on the way: `error` estimates its relative error by the last correction; `stable` where A − GP was
/// proved so.
struct Candidate {
    p: Exact,
    error: f64,
    stable: bool,
}

/// The stabilising solution of `equation`, `None` where no method's outcome passes.
pub(super) fn find(equation: &Equation<DoubleDouble>) -> Option<Found> {
    let shift = shift(equation);
    let mut candidates = Vec::new();
    if let Some(p) = double(&in_double(equation), shift, Rest { change: 1e-9, steps: 60 }) {
        let quick = refine::<f64>(equation, p.map(Into::into), SLOW);
        if quick.stable && quick.error <= NEGLIGIBLE {
            return accept(equation, quick, quick_poles);
        }
        candidates.push(refine::<DoubleDouble>(equation, quick.p, STAGNANT));
    }
    for method in [doubled, by_sign_function] {
        if candidates.iter().any(|candidate| candidate.stable && candidate.error <= WORTH_A_WARNING) {
            break;
        }
        let start = method(equation);
        candidates.extend(start.map(|p| refine::<DoubleDouble>(equation, p, STAGNANT)));
    }
    // Stable ones first, by their error; the others by their residual.
    let rank = |one: &Candidate| match one.stable {
        true => (0, one.error),
        false => (1, relative_residual(equation, &one.p)),
    };
    candidates.sort_by(|one, other| {
        let ((group, error), (other_group, other_error)) = (rank(one), rank(other));
        group.cmp(&other_group).then(error.total_cmp(&other_error))
    });
    candidates.into_iter().find_map(|candidate| accept(equation, candidate, exact_poles))
}

/// Doubling in double-double, with another shift where the first meets a singular matrix.
fn doubled(equation: &Equation<DoubleDouble>) -> Option<Exact> {
    let shift = shift(equation);
    let rest = Rest { change: 1e-18, steps: 90 };
    [1.0, 3.0, 1.0 / 3.0].iter().find_map(|factor| double(equation, factor * shift, rest))
}

/// Newton's method with residuals in double-double and corrections in `T`, until they are negligible or
/// contract by no more than `slow`.
fn refine<T>(equation: &Equation<DoubleDouble>, start: Exact, slow: f64) -> Candidate
where
    T: Real + Into<DoubleDouble>,
    DoubleDouble: Into<T>,
{
    let mut candidate = Candidate { p: start, error: f64::INFINITY, stable: false };
    for _ in 0..NEWTON_STEPS {
        let residual = equation.residual(&candidate.p).map(Into::into);
        let closed_loop: SquareN<T> = equation.closed_loop(&candidate.p).map(Into::into);
        let shift = closed_loop.clone().mean_modulus();
        let Some(correction) = lyapunov(&closed_loop, &residual, shift, T::SQUARINGS) else {
            candidate.stable = false;
            return candidate;
        };
        candidate.stable = true;
        let next = candidate.p.clone().plus_multiple(&correction.map(Into::into), DoubleDouble::ONE);
        let change = correction.norm() / next.norm().max(f64::MIN_POSITIVE);
        if !change.is_finite() || (change > slow * candidate.error && candidate.error < FAR) {
            return candidate;
        }
        candidate = Candidate { p: next, error: change, stable: true };
        if change <= NEGLIGIBLE {
            return candidate;
        }
    }
    candidate
}

/// Judges a candidate by the poles that `poles` finds and by its residual.
fn accept(
    equation: &Equation<DoubleDouble>,
    candidate: Candidate,
    poles: fn(&Exact) -> Option<Vec<Complex<f64>>>,
) -> Option<Found> {
    let closed_loop = equation.closed_loop(&candidate.p);
    let poles = poles(&closed_loop)?;
    let mut warnings = Vec::new();
    if candidate.stable && poles.iter().all(|pole| pole.re < 0.0) {
        if candidate.error > USELESS {
            return None;
        }
        if candidate.error > WORTH_A_WARNING {
            warnings.push(format!(
                "the equation is ill-conditioned: p has a relative error of about {:.0e}",
                candidate.error
            ));
        }
        return Some(Found { p: candidate.p, poles, warnings });
    }
    let near = ON_AXIS * closed_loop.norm();
    let rightmost = poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
    let residual = relative_residual(equation, &candidate.p);
    if !(rightmost.abs() <= near && residual <= LIMIT_RESIDUAL) {
        return None;
    }
    warnings.push(format!(
        "poles on the imaginary axis within rounding (real part {rightmost:.1e}): the \
         closed loop is not asymptotically stable, and p may not be the unique solution"
    ));
    Some(Found { p: candidate.p, poles, warnings })
}

/// ‖residual‖ over the norms of Q and PGP. Not over those of PA: a huge P with PA + AᵀP = 0 drowns any Q.
fn relative_residual(equation: &Equation<DoubleDouble>, p: &Exact) -> f64 {
    let terms = p.times(&equation.g.times(p)).norm() + equation.q.norm();
    equation.residual(p).norm() / terms.max(f64::MIN_POSITIVE)
}

/// Poles by the QR algorithm in double, or in double-double where double cannot tell their side of the axis.
fn quick_poles(closed_loop: &Exact) -> Option<Vec<Complex<f64>>> {
    let mut poles = vec![Complex::default(); closed_loop.size()];
    eigenvalues(closed_loop.map(Real::to_f64), &mut poles)?;
    let doubtful = -1e4 * f64::EPSILON * closed_loop.norm();
    if poles.iter().all(|pole| pole.re < doubtful) { Some(poles) } else { exact_poles(closed_loop) }
}

fn exact_poles(closed_loop: &Exact) -> Option<Vec<Complex<f64>>> {
    let mut poles = vec![Complex::default(); closed_loop.size()];
    eigenvalues(closed_loop.clone(), &mut poles)?;
    Some(poles)
}

fn in_double(equation: &Equation<DoubleDouble>) -> Equation<f64> {
    let double = |matrix: &Exact| matrix.map(Real::to_f64);
    Riccati { a: double(&equation.a), g: double(&equation.g), q: double(&equation.q) }
}

/// A shift for the doubling: the geometric mean of the poles' moduli, or a norm where a pole is zero.
fn shift(equation: &Equation<DoubleDouble>) -> f64 {
    let mean = hamiltonian(&in_double(equation)).mean_modulus();
    let norm = (equation.a.norm() + equation.g.norm() + equation.q.norm()) / equation.a.size() as f64;
    let smallest = (f64::EPSILON * norm).max(f64::MIN_POSITIVE);
    if mean > smallest {
        mean
    } else if norm > 0.0 {
        norm
    } else {
        1.0
    }
}
