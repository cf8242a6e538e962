//! The linear closed loop, for overlaying what a gain promises.

use nalgebra::Matrix2x4;

use crate::model::{RobotModel, State};

/// Longest response, so that a slip of the hand does not fill the memory.
const MAX_STATES: f64 = 1e6;

/// Response of Ẋ = (A − B K) X from `initial`: time, s, and state every `dt_s` from 0 to `seconds`, exact
/// (matrix exponential), without friction, noise, delay or limit. A gain that does not stabilise gives a
/// response that grows. Empty unless both times are above 0; cut at a million states.
pub fn predicted_response(
    robot: &RobotModel,
    gain: &Matrix2x4<f64>,
    initial: State,
    seconds: f64,
    dt_s: f64,
) -> Vec<(f64, State)> {
    if !(seconds > 0.0 && dt_s > 0.0) {
        return Vec::new();
    }
    let model = robot.parameters.linear_model();
    let transition = ((model.a - model.b * gain) * dt_s).exp();
    // The last instant counts although seconds / dt falls a rounding short of a whole number.
    let steps = (seconds / dt_s * (1.0 + 1e-12)).floor().min(MAX_STATES - 1.0) as usize;
    let mut state = initial.to_vector();
    (0..=steps)
        .map(|step| {
            let here = (step as f64 * dt_s, State::from_vector(&state));
            state = transition * state;
            here
        })
        .collect()
}
