//! The weights of the quadratic cost (Eq. 15).

use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// Weights of ½∫ XᵀQX + uᵀRu dt (Eq. 15), X = [x, ẋ, θ, θ̇]ᵀ and u = [T_l, T_r]ᵀ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Q, 4×4, symmetric positive semidefinite; diagonal in 1/m², s²/m², 1/rad², s²/rad².
    pub q: Matrix4<f64>,
    /// R, 2×2, symmetric positive definite; diagonal in 1/(N m)².
    pub r: Matrix2<f64>,
}

impl Weights {
    /// Diagonal weights.
    ///
    /// ```
    /// use flqr_core::model::Weights;
    ///
    /// // Bryson's rule: the inverse square of the largest acceptable deviation of each state and torque.
    /// let weight = |largest: f64| 1.0 / (largest * largest);
    /// let weights = Weights::diagonal([0.5, 1.0, 0.1, 1.0].map(weight), [2.0, 2.0].map(weight));
    /// assert!((weights.q[(0, 0)] - 4.0).abs() < 1e-12);
    /// ```
    pub fn diagonal(q: [f64; 4], r: [f64; 2]) -> Self {
        Self { q: Matrix4::from_diagonal(&Vector4::from(q)), r: Matrix2::from_diagonal(&Vector2::from(r)) }
    }

    /// Changes the weight of one state (0 x, 1 ẋ, 2 θ, 3 θ̇). Entries off the diagonal follow by the root of
    /// the ratio, so that Q stays as positive as it was; a weight of 0, or from 0, takes them to 0.
    pub fn set_state_weight(&mut self, state: usize, weight: f64) {
        let ratio = weight / self.q[(state, state)];
        let factor = if ratio.is_finite() && ratio > 0.0 { ratio.sqrt() } else { 0.0 };
        for other in (0..4).filter(|&other| other != state) {
            self.q[(state, other)] *= factor;
            self.q[(other, state)] *= factor;
        }
        self.q[(state, state)] = weight;
    }

    /// Returns whether neither matrix has an entry off its diagonal.
    pub fn is_diagonal(&self) -> bool {
        let off_diagonal_is_zero = |rows: usize, entry: &dyn Fn(usize, usize) -> f64| {
            (0..rows).all(|i| (0..rows).all(|j| i == j || entry(i, j) == 0.0))
        };
        off_diagonal_is_zero(4, &|i, j| self.q[(i, j)]) && off_diagonal_is_zero(2, &|i, j| self.r[(i, j)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlations_survive_a_change_of_one_weight() {
        let mut weights = Weights::diagonal([2.0, 0.01, 58.5, 0.01], [1.0; 2]);
        (weights.q[(0, 2)], weights.q[(2, 0)]) = (10.8, 10.8);
        let correlation = |w: &Weights| w.q[(0, 2)] / (w.q[(0, 0)] * w.q[(2, 2)]).sqrt();
        let before = correlation(&weights);
        for weight in [1e-4, 3.0, 1e4] {
            weights.set_state_weight(0, weight);
            assert!((correlation(&weights) - before).abs() < 1e-12 && weights.q[(0, 0)] == weight);
            assert_eq!(weights.q, weights.q.transpose());
        }
        weights.set_state_weight(2, 0.0);
        assert!(weights.is_diagonal());
    }
}
