//! Search range: the permissible range [x_min, x_max] of Algorithm 1.

use super::FrictionPair;
use super::parameters::{OFFSET, SPEED};

/// A speed below this fraction of the fastest is standstill.
const STANDSTILL: f64 = 1e-9;

/// Which ranges to search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bounds {
    /// Ranges derived from the level of the torques and the range of the speeds, see [`SearchBox::from_pairs`].
    #[default]
    Data,
    /// The paper's Table 3 as printed, see [`SearchBox::paper`].
    Paper,
}

/// Closed ranges of the six parameters, in the order f_c, f_s, v_s, ξ, f_v, f_p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchBox {
    /// x_min; N m, N m, rad/s, none, N m s/rad, N m.
    pub lower: [f64; 6],
    /// x_max, units as `lower`.
    pub upper: [f64; 6],
}

impl SearchBox {
    /// Ranges from the data, for the largest torque τ and the smallest and largest speed q₁, q₂ (magnitudes):
    ///
    /// | | f_c | f_s | v_s | ξ | f_v | f_p |
    /// |---|---|---|---|---|---|---|
    /// | lower | 0 | 0 | q₁/20 | 0.05 | 0 | −2τ |
    /// | upper | 5τ | 15τ | q₂/5 | 2.2 | 5τ/q₂ | 2τ |
    ///
    /// Levels may exceed τ because f_s and, for small ξ, f_c are extrapolations beyond the measured speeds. Data
    /// of one direction can't tell f_c from f_p: f_p is then kept at 0 and counted into f_c.
    pub fn from_pairs(pairs: &[FrictionPair]) -> Self {
        let torque = pairs.iter().map(|p| p.torque_nm.abs()).fold(f64::MIN_POSITIVE, f64::max);
        let speeds = || pairs.iter().map(|p| p.speed_rad_s.abs());
        let fastest = speeds().fold(f64::MIN_POSITIVE, f64::max);
        let slowest = speeds().filter(|&q| q > STANDSTILL * fastest).fold(fastest, f64::min);
        let mut found = Self {
            lower: [0.0, 0.0, slowest / 20.0, 0.05, 0.0, -2.0 * torque],
            upper: [5.0 * torque, 15.0 * torque, fastest / 5.0, 2.2, 5.0 * torque / fastest, 2.0 * torque],
        };
        found.upper[SPEED] = (fastest / 5.0).max(slowest);
        if one_direction(pairs) {
            found.lower[OFFSET] = 0.0;
            found.upper[OFFSET] = 0.0;
        }
        found
    }

    /// Table 3 as printed. Its f_v ≥ 0.01 N m s/rad excludes the paper's own result of 4.9e-4. The zeros of v_s
    /// and ξ, where Eq. 28 is singular, are read as 1e-9.
    pub fn paper() -> Self {
        Self { lower: [0.01, 0.01, 1e-9, 1e-9, 0.01, -10.0], upper: [3.0, 10.0, 10.0, 2.2, 10.0, 10.0] }
    }

    pub(super) fn width(&self, d: usize) -> f64 {
        self.upper[d] - self.lower[d]
    }

    /// Returns whether every coordinate of a point is inside.
    pub fn contains(&self, point: &[f64; 6]) -> bool {
        (0..6).all(|d| (self.lower[d]..=self.upper[d]).contains(&point[d]))
    }
}

/// Returns whether the speeds never change their sign.
pub(super) fn one_direction(pairs: &[FrictionPair]) -> bool {
    pairs.iter().all(|p| p.speed_rad_s >= 0.0) || pairs.iter().all(|p| p.speed_rad_s <= 0.0)
}
