//! The structure-preserving doubling algorithm (Chu, Fan, Lin, Linear Algebra Appl. 396, 2005): a Cayley
//! transform turns the Riccati equation into a discrete one, whose iterates Hₖ reach P after 2ᵏ steps.

use super::real::Real;
use super::square::Square;

/// A, G and Q of AᵀP + PA − PGP + Q = 0; G and Q symmetric.
#[derive(Clone, Debug)]
pub(super) struct Riccati<M> {
    pub(super) a: M,
    pub(super) g: M,
    pub(super) q: M,
}

/// When the doubling has come to rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rest {
    /// Relative change of H, in the Frobenius norm, after which H is P (the error is its square).
    pub(super) change: f64,
    /// Steps after which H is returned as it stands.
    pub(super) steps: usize,
}

/// P by doubling, from the Cayley transform (Ham − γ)⁻¹(Ham + γ) of the Hamiltonian with `shift` γ > 0.
/// `None` where a matrix on the way is singular or not finite. The result is a candidate: whether it solves
/// the equation, and stabilises, is for the caller to see.
#[inline(always)]
pub(super) fn double<M: Square>(equation: &Riccati<M>, shift: f64, rest: Rest) -> Option<M> {
    let Riccati { mut a, mut g, q: mut h } = cayley(equation, M::Scalar::from_f64(shift))?;
    let mut last_change = f64::INFINITY;
    for _ in 0..rest.steps {
        let (mut inverse_a, mut inverse_g) = (a.clone(), g.clone());
        g.times(&h).plus_diagonal(M::Scalar::ONE).solve([&mut inverse_a, &mut inverse_g])?;
        let growth = a.transposed_times(&h.times(&inverse_a)).symmetric_part();
        let next = h.clone().plus_multiple(&growth, M::Scalar::ONE);
        let change = (growth.norm_squared() / next.norm_squared().max(f64::MIN_POSITIVE)).sqrt();
        if !change.is_finite() {
            return None;
        }
        // With poles on the axis the change halves until rounding makes it grow again.
        if change > last_change && last_change < TURNING {
            return Some(h);
        }
        h = next;
        if change <= rest.change {
            return Some(h);
        }
        last_change = change;
        g = g.plus_multiple(&a.times(&inverse_g).times(&a.transposed()).symmetric_part(), M::Scalar::ONE);
        a = a.times(&inverse_a);
    }
    Some(h)
}

/// A relative change below this is convergence; growth after it is rounding.
const TURNING: f64 = 1e-4;

/// The discrete equation's A, G and H₀.
#[inline(always)]
fn cayley<M: Square>(equation: &Riccati<M>, shift: M::Scalar) -> Option<Riccati<M>> {
    let Riccati { a, g, q } = equation;
    let twice = shift + shift;
    let shifted_inverse = a.clone().plus_diagonal(-shift).inverse()?;
    let inverse_g = shifted_inverse.times(g);
    // W = (A − γ)ᵀ + Q (A − γ)⁻¹ G
    let w = a.transposed().plus_diagonal(-shift).plus_multiple(&q.times(&inverse_g), M::Scalar::ONE);
    let w_inverse = w.inverse()?;
    Some(Riccati {
        a: w_inverse.transposed().times_scalar(twice).plus_diagonal(M::Scalar::ONE),
        g: inverse_g.times(&w_inverse).times_scalar(twice).symmetric_part(),
        q: w_inverse.times(&q.times(&shifted_inverse)).times_scalar(twice).symmetric_part(),
    })
}
