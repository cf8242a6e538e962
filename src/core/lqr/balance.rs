//! Symplectic balancing (Benner, Electron. Trans. Numer. Anal. 11, 2000): states in units in which the rows
//! and columns of the Hamiltonian matrix are of one size. Powers of two, so nothing is rounded.

use super::doubling::Riccati;
use super::real::Real;
use super::square::Square;

/// Sweeps over the states; three or four are usual.
const SWEEPS: usize = 30;
/// A state's unit changes where the sizes differ by more than this power of two.
const WORTHWHILE: i32 = 2;
/// Largest exponent of a unit, far from overflow of products of three.
const LARGEST_EXPONENT: i32 = 200;

/// D, diagonal, such that x = D z has a balanced equation.
pub(super) fn units<M: Square>(equation: &Riccati<M>) -> Vec<f64> {
    let size = equation.a.size();
    let mut exponents = vec![0_i32; size];
    for _ in 0..SWEEPS {
        let mut changed = false;
        for state in 0..size {
            let (input, output) = sizes(equation, &exponents, state);
            if input == 0.0 || output == 0.0 {
                continue;
            }
            // One unit larger by 2ᵉ: input sizes shrink and output sizes grow by that factor.
            let exponent = (0.5 * (input / output).log2()).round() as i32;
            // Of sizes that have overflowed or underflowed.
            let exponent = exponent.clamp(-2 * LARGEST_EXPONENT, 2 * LARGEST_EXPONENT);
            let bounded = (exponents[state] + exponent).clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT);
            if exponent.abs() >= WORTHWHILE && bounded != exponents[state] {
                exponents[state] = bounded;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    exponents.into_iter().map(power_of_two).collect()
}

/// Exact, which the library's `exp2` need not be.
fn power_of_two(exponent: i32) -> f64 {
    2.0_f64.powi(exponent)
}

/// Sizes of what drives `state` (its rows of A and G) and of what it drives (its columns of A and Q).
fn sizes<M: Square>(equation: &Riccati<M>, exponents: &[i32], state: usize) -> (f64, f64) {
    let (mut input, mut output) = (0.0, 0.0);
    for (other, other_exponent) in exponents.iter().enumerate() {
        let ratio = power_of_two(other_exponent - exponents[state]);
        let product = power_of_two(other_exponent + exponents[state]);
        let size = |entry: M::Scalar, unit: f64| entry.abs().to_f64() * unit;
        input += size(equation.g.at(state, other), 1.0 / product);
        output += size(equation.q.at(state, other), product);
        if other != state {
            input += size(equation.a.at(state, other), ratio);
            output += size(equation.a.at(other, state), 1.0 / ratio);
        }
    }
    (input, output)
}

impl<M: Square> Riccati<M> {
    /// The equation of D P D for the states z in x = D z.
    pub(super) fn in_units(&self, units: &[f64]) -> Self {
        Self {
            a: scaled(&self.a, |i, j| units[j] / units[i]),
            g: scaled(&self.g, |i, j| 1.0 / (units[i] * units[j])),
            q: scaled(&self.q, |i, j| units[i] * units[j]),
        }
    }
}

/// `matrix` with each entry times a power of two.
pub(super) fn scaled<M: Square>(matrix: &M, factor: impl Fn(usize, usize) -> f64) -> M {
    let mut scaled = matrix.clone();
    for i in 0..matrix.size() {
        for j in 0..matrix.size() {
            scaled.set(i, j, matrix.at(i, j).scaled(factor(i, j)));
        }
    }
    scaled
}
