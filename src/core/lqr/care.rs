//! The continuous algebraic Riccati equation for any number of states and inputs.

use nalgebra::{Complex, DMatrix};

use super::balance::{scaled, units};
use super::checks::{check_finite, check_shape, check_symmetric};
use super::diagnosis::cause;
use super::double_double::DoubleDouble;
use super::doubling::Riccati;
use super::error::CareError;
use super::input::{Input, from_dmatrix};
use super::real::Real;
use super::search::find;
use super::square::{Square, SquareN};

/// Quadratic term of the equation.
#[derive(Clone, Copy, Debug)]
pub enum CareInput<'a> {
    /// G = B R⁻¹ Bᵀ, formed in twice the precision of a double, so that R may be nearly singular.
    Weighted {
        /// B, n×m.
        b: &'a DMatrix<f64>,
        /// R, m×m, symmetric positive definite.
        r: &'a DMatrix<f64>,
    },
    /// G itself.
    Quadratic {
        /// G, n×n, symmetric.
        g: &'a DMatrix<f64>,
    },
}

/// The stabilising solution of a Riccati equation.
#[derive(Clone, Debug, PartialEq)]
pub struct CareSolution {
    /// P, n×n, symmetric.
    pub p: DMatrix<f64>,
    /// K = R⁻¹BᵀP, m×n, of u = −K x; absent where G was given.
    pub gain: Option<DMatrix<f64>>,
    /// Eigenvalues of A − GP, n of them, conjugates next to each other.
    pub poles: Vec<Complex<f64>>,
    /// ‖AᵀP + PA − PGP + Q‖_F / ‖P‖_F of the returned P (of ‖Q‖_F alone where P = 0), itself evaluated in
    /// twice the precision of a double.
    pub relative_residual: f64,
    /// Warnings on P: poles on the imaginary axis, digits lost to bad condition.
    pub warnings: Vec<String>,
}

/// Solves AᵀP + PA − PGP + Q = 0 (Eq. 25) for the symmetric P that makes A − GP stable, G = B R⁻¹ Bᵀ; the
/// control is u = −K x with K = R⁻¹BᵀP (Eq. 24).
///
/// A and Q are n×n, B n×m, R m×m, for any n ≥ 1 and m. Q is symmetric, of any definiteness; R symmetric
/// positive definite; symmetric means to 1e-12 of the largest entry, and the mean of both halves is taken.
///
/// P is the exact solution for the doubles given, rounded to double, as far as the condition of the
/// equation lets 32 digits reach; a warning says where fewer than nine are left. Poles on the imaginary
/// axis, where P is the limit of stabilising solutions, are a warning too.
///
/// # Errors
/// Matrices of wrong shape, not finite, not symmetric; R not positive definite; [`CareError::NotStabilisable`],
/// [`CareError::NotDetectable`] or [`CareError::NoSolution`] where no stabilising P is found. That follows
/// from the outcome (no finite P, a residual that stays, poles in the right half-plane); tests of rank only
/// name the cause.
///
/// # Method
/// Balancing by powers of two; structure-preserving doubling; Newton's method with residuals in
/// double-double until the corrections are below the rounding of the result. Where that does not contract,
/// the doubling is repeated in double-double; where Q does not see an unstable mode, the matrix sign function
/// takes its place. References are at each of these modules' heads.
///
/// ```
/// use flqr_core::lqr::{CareInput, solve_care};
/// use nalgebra::DMatrix;
///
/// let matrix = |rows, columns, entries: &[f64]| DMatrix::from_row_slice(rows, columns, entries);
/// let (a, b) = (matrix(2, 2, &[0.0, 1.0, 0.0, 0.0]), matrix(2, 1, &[0.0, 1.0]));
/// let (q, r) = (matrix(2, 2, &[1.0, 0.0, 0.0, 2.0]), matrix(1, 1, &[1.0]));
/// let solution = solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r })?;
/// assert_eq!(solution.p, matrix(2, 2, &[2.0, 1.0, 1.0, 2.0])); // Laub 1979, example 1
/// # Ok::<(), flqr_core::lqr::CareError>(())
/// ```
pub fn solve_care(a: &DMatrix<f64>, q: &DMatrix<f64>, input: CareInput) -> Result<CareSolution, CareError> {
    let n = a.nrows();
    if n == 0 {
        return Err(CareError::NoStates);
    }
    for (name, matrix) in [("a", a), ("q", q)] {
        check_shape(name, matrix, [n, n])?;
        check_finite(name, matrix)?;
    }
    check_symmetric("q", q)?;
    let extreme = extreme_entry(a, q, input);
    let input = Input::new(n, input)?;
    if input.g.entries().iter().any(|entry| !entry.is_finite()) {
        return Err(extreme.map_or(CareError::OutOfRange, Extreme::error));
    }
    let equation = Riccati { a: from_dmatrix(a), g: input.g, q: from_dmatrix(q).symmetric_part() };
    let units = units(&equation);
    let balanced = equation.in_units(&units);
    let Some(found) = find(&balanced) else {
        let extreme = extreme.filter(|entry| entry.is_beyond_products() || has_large_entries(&balanced));
        return Err(extreme.map_or_else(|| cause(&balanced), Extreme::error));
    };
    let exact = scaled(&found.p, |i, j| 1.0 / (units[i] * units[j]));
    let p = exact.map(Real::to_f64);
    let rounded: SquareN<DoubleDouble> = p.map(Real::from_f64);
    let solution = CareSolution {
        gain: input.weighted.map(|weighted| weighted.gain(&exact)),
        poles: found.poles,
        relative_residual: relative(equation.residual(&rounded).norm(), p.norm()),
        warnings: found.warnings,
        p: DMatrix::from_row_slice(n, n, p.entries()),
    };
    if solution.is_finite() && p.norm().is_finite() { Ok(solution) } else { Err(CareError::OutOfRange) }
}

impl CareSolution {
    fn is_finite(&self) -> bool {
        let gain = self.gain.iter().flat_map(DMatrix::iter);
        let poles = self.poles.iter().flat_map(|pole| [&pole.re, &pole.im]);
        self.p
            .iter()
            .chain(gain)
            .chain(poles)
            .chain([&self.relative_residual])
            .all(|number| number.is_finite())
    }
}

/// Largest entry of a balanced equation of which products of three, squared for their norms, are in the range of
/// doubles.
const LARGEST_ENTRY: f64 = 1e50;

/// Decimal exponent of an entry beyond which such products leave that range.
const LARGEST_EXPONENT: f64 = 100.0;

fn has_large_entries(equation: &Riccati<SquareN<DoubleDouble>>) -> bool {
    let mut entries = [&equation.a, &equation.g, &equation.q].into_iter().flat_map(Square::entries);
    // Also where an entry is not a number.
    !entries.all(|entry| entry.abs().to_f64() <= LARGEST_ENTRY)
}

/// An entry of a matrix as the user gave it.
#[derive(Clone, Copy)]
struct Extreme {
    matrix: &'static str,
    value: f64,
}

impl Extreme {
    fn exponent(self) -> f64 {
        self.value.abs().log10().abs()
    }

    fn is_beyond_products(self) -> bool {
        self.exponent() > LARGEST_EXPONENT
    }

    fn error(self) -> CareError {
        CareError::TooFarApart { matrix: self.matrix, value: self.value }
    }
}

/// The entry that is farthest from 1; `None` if all are zero.
fn extreme_entry(a: &DMatrix<f64>, q: &DMatrix<f64>, input: CareInput) -> Option<Extreme> {
    let of_input = match input {
        CareInput::Weighted { b, r } => [("b", b), ("r", r)],
        CareInput::Quadratic { g } => [("g", g), ("g", g)],
    };
    let matrices = [("a", a), ("q", q)].into_iter().chain(of_input);
    let entries =
        matrices.flat_map(|(matrix, entries)| entries.iter().map(move |&value| Extreme { matrix, value }));
    entries
        .filter(|entry| entry.value != 0.0)
        .max_by(|one, other| one.exponent().total_cmp(&other.exponent()))
}

/// `residual` over `size`, or as it is where P is zero.
fn relative(residual: f64, size: f64) -> f64 {
    if size > 0.0 { residual / size } else { residual }
}
