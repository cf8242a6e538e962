//! What the linear closed loop predicts, without noise, delay, friction and limits.

use nalgebra::Matrix2x4;

use crate::model_file::RobotModel;
use crate::robot::State;

/// Response of Ẋ = (A − BK) X (Eqs. 11, 13) from `initial`, at 0, `step_s`, 2 `step_s`, … up to `seconds`:
/// time in s and state. Exact at each step, by the matrix exponential. Empty when a time is not above zero.
pub fn predicted_response(
    robot: &RobotModel,
    gain: &Matrix2x4<f64>,
    initial: State,
    seconds: f64,
    step_s: f64,
) -> Vec<(f64, State)> {
    let steps = seconds / step_s;
    if !(seconds > 0.0 && step_s > 0.0 && steps.is_finite()) {
        return Vec::new();
    }
    let model = robot.parameters.linear_model();
    let transition = ((model.a - model.b * gain) * step_s).exp();
    let mut state = initial.to_vector();
    (0..=(steps + 1e-9) as usize)
        .map(|index| {
            let point = (index as f64 * step_s, State::from_vector(&state));
            state = transition * state;
            point
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::RobotParameters;

    const ROBOT: RobotModel = RobotModel {
        parameters: RobotParameters {
            body_mass_kg: 13.0,
            wheel_mass_kg: 1.0,
            wheel_inertia_kg_m2: 0.005,
            wheel_radius_m: 0.1,
            com_height_m: 0.25,
            body_inertia_kg_m2: 0.25,
            gravity_m_s2: 9.81,
        },
        friction: [None; 2],
        weights: None,
        compensation: None,
        torque_limit_nm: None,
    };

    /// The oracle: the classical Runge-Kutta method with steps so small that its error is below 1e-9.
    #[test]
    fn it_solves_the_differential_equation() {
        let gain = Matrix2x4::from_row_slice(&[-1.2, -2.0, -14.0, -2.0, -1.2, -2.0, -14.0, -2.0]);
        let initial = State { x_m: -0.1, pitch_rad: 0.02, ..State::default() };
        let response = predicted_response(&ROBOT, &gain, initial, 1.0, 0.1);
        assert_eq!(response.len(), 11);
        let model = ROBOT.parameters.linear_model();
        let closed = model.a - model.b * gain;
        let (mut x, h) = (initial.to_vector(), 1e-4);
        for _ in 0..10_000 {
            let k1 = closed * x;
            let k2 = closed * (x + k1 * (h / 2.0));
            let k3 = closed * (x + k2 * (h / 2.0));
            let k4 = closed * (x + k3 * h);
            x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
        }
        let (time, last) = response[10];
        assert!((time - 1.0).abs() < 1e-12 && (last.to_vector() - x).norm() < 1e-9, "{last:?} {x:?}");
    }

    #[test]
    fn no_time_no_response() {
        for (seconds, step_s) in [(0.0, 0.1), (1.0, 0.0), (f64::NAN, 0.1), (1.0, -1.0)] {
            let response = predicted_response(&ROBOT, &Matrix2x4::zeros(), State::default(), seconds, step_s);
            assert!(response.is_empty(), "{seconds} {step_s}");
        }
    }
}
