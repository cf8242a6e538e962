//! Friction of one motor: the Stribeck curve (Eq. 28) and its feedforward (Eq. 29).
//!
//! At rest, q̇ = 0, a curve has no single value: the shaft sticks and friction takes whatever value in
//! [f_p − f_s, f_p + f_s] holds it. [`Stribeck::torque_nm`] states f_p there, the middle of that range,
//! because sign(0) = 0; [`Stribeck::stick_range_nm`] gives the range. The right-hand limit is f_p + f_s.
//! The slope at 0⁺ is f_v − (f_s − f_c) · d/dω (ω/v_s)^ξ: −∞ for ξ < 1 and f_s > f_c,
//! f_v − (f_s − f_c)/v_s for ξ = 1 and f_v for ξ > 1; see [`Stribeck::slope_nm_s_rad`].

mod feedforward;
mod stribeck;

pub use feedforward::{Compensation, Feedforward};
pub use stribeck::{Stribeck, StribeckParameters};
