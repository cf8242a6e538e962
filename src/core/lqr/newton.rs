//! Newton's method for the Riccati equation (Kleinman, IEEE Trans. Autom. Control 13, 1968): corrections by
//! Lyapunov equations, which are solved by Smith's doubling (SIAM J. Appl. Math. 16, 1968).

use super::doubling::Riccati;
use super::real::Real;
use super::square::Square;

impl<M: Square> Riccati<M> {
    /// AᵀP + PA − PGP + Q
    #[inline(always)]
    pub(super) fn residual(&self, p: &M) -> M {
        // P (A − GP) + AᵀP: its symmetric part, because rounding alone makes it unsymmetric.
        let half = p.times(&self.closed_loop(p)).plus_multiple(&self.a.transposed_times(p), M::Scalar::ONE);
        half.plus_multiple(&self.q, M::Scalar::ONE).symmetric_part()
    }

    /// A − GP
    #[inline(always)]
    pub(super) fn closed_loop(&self, p: &M) -> M {
        self.a.clone().plus_multiple(&self.g.times(p), -M::Scalar::ONE)
    }
}

/// X of CᵀX + XC + `right` = 0 for a stable C: the sum Σ (Sᵀ)ʲ V Sʲ with S the Cayley transform of C, doubled
/// `steps` times at most. `None` unless the powers of S die out, which is the proof that C is stable.
#[inline(always)]
pub(super) fn lyapunov<M: Square>(c: &M, right: &M, shift: f64, steps: usize) -> Option<M> {
    if !(shift > 0.0 && shift.is_finite()) {
        return None;
    }
    let shift = M::Scalar::from_f64(shift);
    // S = (C − γ)⁻¹(C + γ) = I + 2γ (C − γ)⁻¹, V = 2γ (C − γ)⁻ᵀ right (C − γ)⁻¹
    let inverse = c.clone().plus_diagonal(-shift).inverse()?.times_scalar(shift + shift);
    let mut sum =
        inverse.transposed_times(&right.times(&inverse)).times_scalar(M::Scalar::ONE / (shift + shift));
    let mut power = inverse.plus_diagonal(M::Scalar::ONE);
    for _ in 0..steps {
        let size = power.norm_squared();
        // Sum and power are then complete to rounding.
        if size < M::Scalar::EPSILON {
            return Some(sum.symmetric_part());
        }
        if !size.is_finite() {
            return None;
        }
        let growth = power.transposed_times(&sum.times(&power));
        sum = sum.plus_multiple(&growth, M::Scalar::ONE);
        power = power.times(&power);
    }
    None
}
