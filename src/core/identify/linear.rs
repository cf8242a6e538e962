//! Least squares in the four linear parameters within their ranges.

use nalgebra::{Matrix4, Vector4};

/// Normal equations of min ‖A c − τ‖² over c = [f_c, f_s, f_v, f_p], columns scaled to length 1.
#[derive(Clone, Debug)]
pub(super) struct NormalEquations {
    scale: Vector4<f64>,
    gram: Matrix4<f64>,
    right: Vector4<f64>,
}

/// The best c and which of its entries are free, not held by an end of their range.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearFit {
    pub(super) value: Vector4<f64>,
    pub(super) free: [bool; 4],
}

/// Solution with one entry fixed.
#[derive(Clone, Copy, PartialEq)]
enum Hold {
    Free,
    Lower,
    Upper,
}

impl NormalEquations {
    /// From AᵀA and Aᵀτ.
    pub(super) fn new(gram: &Matrix4<f64>, right: &Vector4<f64>) -> Self {
        /// Keeps collinear columns solvable; far below what changes a sum of squares.
        const RIDGE: f64 = 1e-14;
        let usable = |square: f64| square > 0.0 && square.is_finite();
        let scale = gram.diagonal().map(|square| if usable(square) { square.sqrt() } else { 1.0 });
        let mut scaled = Matrix4::from_fn(|i, j| gram[(i, j)] / (scale[i] * scale[j]));
        for i in 0..4 {
            scaled[(i, i)] += RIDGE;
        }
        Self { scale, gram: scaled, right: right.component_div(&scale) }
    }

    /// The minimum within lower ≤ c ≤ upper. The problem is convex: the set of held entries whose solution is
    /// inside the ranges and whose forces push outwards is the optimal one. Sets are tried by size.
    pub(super) fn solve(&self, lower: &Vector4<f64>, upper: &Vector4<f64>) -> LinearFit {
        let low = lower.component_mul(&self.scale);
        let high = upper.component_mul(&self.scale);
        let mut best: Option<(f64, Vector4<f64>, [Hold; 4])> = None;
        for held in 0..=4 {
            for holds in combinations(held, &low, &high) {
                let Some(value) = self.held_solution(&holds, &low, &high) else { continue };
                if self.is_optimal(&holds, &value, &low, &high) {
                    return self.unscaled(&value, &holds, &low, &high);
                }
                let inside = Vector4::from_fn(|i, _| value[i].clamp(low[i], high[i]));
                let cost = self.cost(&inside);
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, inside, holds));
                }
            }
        }
        let (_, value, holds) = best.expect("with all four entries held there is nothing to solve");
        self.unscaled(&value, &holds, &low, &high)
    }

    /// AᵀA restricted to the free entries, inverted and applied to a right-hand side; 0 in the held entries.
    pub(super) fn apply_inverse(&self, free: &[bool; 4], right: &Vector4<f64>) -> Vector4<f64> {
        let holds = free.map(|free| if free { Hold::Free } else { Hold::Lower });
        let right = Vector4::from_fn(|i, _| if free[i] { right[i] / self.scale[i] } else { 0.0 });
        let solved = self.restricted(&holds).cholesky().map_or(Vector4::zeros(), |c| c.solve(&right));
        solved.component_div(&self.scale)
    }

    fn restricted(&self, holds: &[Hold; 4]) -> Matrix4<f64> {
        let free = |i: usize| holds[i] == Hold::Free;
        Matrix4::from_fn(
            |i, j| {
                if free(i) && free(j) { self.gram[(i, j)] } else { f64::from(u8::from(i == j)) }
            },
        )
    }

    fn held_solution(
        &self,
        holds: &[Hold; 4],
        low: &Vector4<f64>,
        high: &Vector4<f64>,
    ) -> Option<Vector4<f64>> {
        let fixed = Vector4::from_fn(|i, _| match holds[i] {
            Hold::Free => 0.0,
            Hold::Lower => low[i],
            Hold::Upper => high[i],
        });
        let moved = self.right - self.gram * fixed;
        let right = Vector4::from_fn(|i, _| if holds[i] == Hold::Free { moved[i] } else { fixed[i] });
        Some(self.restricted(holds).cholesky()?.solve(&right))
    }

    fn is_optimal(
        &self,
        holds: &[Hold; 4],
        value: &Vector4<f64>,
        low: &Vector4<f64>,
        high: &Vector4<f64>,
    ) -> bool {
        let tolerance = 1e-12 * self.right.amax();
        let force = self.right - self.gram * value;
        (0..4).all(|i| match holds[i] {
            Hold::Free => (low[i] - tolerance..=high[i] + tolerance).contains(&value[i]),
            _ if low[i] == high[i] => true,
            Hold::Lower => force[i] <= tolerance,
            Hold::Upper => force[i] >= -tolerance,
        })
    }

    fn cost(&self, value: &Vector4<f64>) -> f64 {
        value.dot(&(self.gram * value)) - 2.0 * value.dot(&self.right)
    }

    fn unscaled(
        &self,
        value: &Vector4<f64>,
        holds: &[Hold; 4],
        low: &Vector4<f64>,
        high: &Vector4<f64>,
    ) -> LinearFit {
        let inside = Vector4::from_fn(|i, _| value[i].clamp(low[i], high[i]) / self.scale[i]);
        LinearFit { value: inside, free: holds.map(|hold| hold == Hold::Free) }
    }
}

/// All ways to hold `held` entries; an entry of zero range is always held.
fn combinations(held: usize, low: &Vector4<f64>, high: &Vector4<f64>) -> impl Iterator<Item = [Hold; 4]> {
    let fixed: [bool; 4] = std::array::from_fn(|i| low[i] == high[i]);
    (0..81usize).filter_map(move |code| {
        let holds = [1, 3, 9, 27].map(|power| [Hold::Free, Hold::Lower, Hold::Upper][code / power % 3]);
        let counted = holds.iter().filter(|&&hold| hold != Hold::Free).count() == held;
        let agrees = (0..4).all(|i| !fixed[i] || holds[i] == Hold::Lower);
        (counted && agrees).then_some(holds)
    })
}
