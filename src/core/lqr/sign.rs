//! The stabilising solution from the matrix sign function of the Hamiltonian (Roberts, Int. J. Control 32,
//! 1980; determinantal scaling by Byers, Linear Algebra Appl. 85, 1987). Dearer than doubling, but it also
//! finds P where an unstable mode is not seen by Q.

use super::doubling::Riccati;
use super::real::Real;
use super::square::{Square, SquareN};

/// Newton steps; about ten are usual, more for eigenvalues next to the imaginary axis.
const STEPS: usize = 80;
/// A step's relative change after which the next one, quadratically smaller, is the last.
const LAST_CHANGE: f64 = 1e-9;

/// [A, −G; −Q, −Aᵀ]
pub(super) fn hamiltonian<T: Real>(equation: &Riccati<SquareN<T>>) -> SquareN<T> {
    let n = equation.a.size();
    SquareN::from_fn(2 * n, |i, j| match (i < n, j < n) {
        (true, true) => equation.a.at(i, j),
        (true, false) => -equation.g.at(i, j - n),
        (false, true) => -equation.q.at(i - n, j),
        (false, false) => -equation.a.at(j - n, i - n),
    })
}

/// P by the sign function; `None` where the Hamiltonian has eigenvalues on the axis or its stable subspace
/// is no graph, which is what a mode out of the inputs' reach makes of it.
pub(super) fn by_sign_function<T: Real>(equation: &Riccati<SquareN<T>>) -> Option<SquareN<T>> {
    let mut sign = hamiltonian(equation);
    for _ in 0..STEPS {
        let scale = T::from_f64(sign.clone().mean_modulus().recip());
        let scaled = sign.clone().times_scalar(scale);
        let next = scaled.clone().plus_multiple(&scaled.inverse()?, T::ONE).times_scalar(T::from_f64(0.5));
        let change = next.clone().plus_multiple(&sign, -T::ONE).norm() / next.norm();
        sign = next;
        if !change.is_finite() {
            return None;
        }
        if change < LAST_CHANGE {
            let last = sign.clone().plus_multiple(&sign.inverse()?, T::ONE).times_scalar(T::from_f64(0.5));
            return stable_graph(&last);
        }
    }
    None
}

/// P with (sign + I) [I; P] = 0, by least squares.
fn stable_graph<T: Real>(sign: &SquareN<T>) -> Option<SquareN<T>> {
    let n = sign.size() / 2;
    let shifted = sign.clone().plus_diagonal(T::ONE);
    let block =
        |row: usize, column: usize| SquareN::from_fn(n, |i, j| shifted.at(row * n + i, column * n + j));
    let (upper, lower) = (block(0, 1), block(1, 1));
    let gram = |other: [&SquareN<T>; 2]| {
        upper.transposed_times(other[0]).plus_multiple(&lower.transposed_times(other[1]), T::ONE)
    };
    let mut p = gram([&block(0, 0), &block(1, 0)]).times_scalar(-T::ONE);
    gram([&upper, &lower]).solve([&mut p])?;
    Some(p.symmetric_part())
}
