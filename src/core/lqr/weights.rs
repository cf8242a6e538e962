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
    pub fn diagonal(q: [f64; 4], r: [f64; 2]) -> Self {
        Self { q: Matrix4::from_diagonal(&Vector4::from(q)), r: Matrix2::from_diagonal(&Vector2::from(r)) }
    }

    /// Whether neither matrix has an entry off its diagonal.
    pub fn is_diagonal(&self) -> bool {
        let off_diagonal_is_zero = |rows: usize, entry: &dyn Fn(usize, usize) -> f64| {
            (0..rows).all(|i| (0..rows).all(|j| i == j || entry(i, j) == 0.0))
        };
        off_diagonal_is_zero(4, &|i, j| self.q[(i, j)]) && off_diagonal_is_zero(2, &|i, j| self.r[(i, j)])
    }
}
