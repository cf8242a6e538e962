use nalgebra::Matrix2x4;

use super::*;
use crate::model_file::{Model, RobotModel};
use crate::robot::{MotorLimits, State};

const MODEL: &str = r#"
name = "bench robot"
[robot]
body_mass_kg = 13.0
wheel_mass_kg = 1.0
wheel_inertia_kg_m2 = 0.005
wheel_radius_m = 0.1
com_height_m = 0.25
body_inertia_kg_m2 = 0.25
[friction.left]
coulomb_nm = 0.03
static_nm = 0.05
viscous_nm_s_rad = 0.001
stribeck_speed_rad_s = 1.0
stribeck_exponent = 1.0
offset_nm = 0.002
"#;

fn robot() -> RobotModel {
    Model::from_toml(MODEL, "test").unwrap().robot().unwrap().clone()
}

fn gain() -> Matrix2x4<f64> {
    Matrix2x4::new(-1.0, -2.0, -10.0, -3.0, -1.5, -2.0, -10.0, -3.0)
}

fn measurement() -> Measurement {
    let state = State { x_m: 0.1, x_dot_m_s: -0.2, pitch_rad: 0.03, pitch_rate_rad_s: 0.01 };
    Measurement { state, motor_speed_rad_s: [2.0, -2.0] }
}

#[test]
fn lqr_is_minus_gain_times_state() {
    let found = BalanceController::new(ControllerKind::Lqr, &robot(), gain()).unwrap().step(&measurement());
    // 1.0·0.1 − 2·0.2 + 10·0.03 + 3·0.01 and the same with 1.5·0.1
    assert!((found[0] - 0.03).abs() < 1e-15 && (found[1] - 0.08).abs() < 1e-15, "{found:?}");
}

#[test]
fn flqr_adds_the_friction_of_motors_that_have_one() {
    let found = BalanceController::new(ControllerKind::Flqr, &robot(), gain()).unwrap().step(&measurement());
    // 0.9 · (0.03 + 0.02 e⁻² + 0.001·2 + 0.002) by default; the right motor has no friction in the model.
    let left = 0.03 + 0.9 * (0.034 + 0.02 * (-2.0_f64).exp());
    assert!((found[0] - left).abs() < 1e-15 && (found[1] - 0.08).abs() < 1e-15, "{found:?}");
}

#[test]
fn torque_stays_within_the_limit_of_the_model() {
    let limited =
        RobotModel { limits: MotorLimits { torque_nm: Some(0.05), ..MotorLimits::default() }, ..robot() };
    let controller = BalanceController::new(ControllerKind::Lqr, &limited, gain()).unwrap();
    assert_eq!(controller.step(&measurement())[1], 0.05);
    let mut fallen = measurement();
    fallen.state.pitch_rad = -1.0;
    assert_eq!(controller.step(&fallen), [-0.05, -0.05]);
    for broken in [-1.0, f64::NAN] {
        let off = BalanceController { torque_limit_nm: broken, ..controller };
        assert_eq!(off.step(&fallen).map(f64::abs), [0.0, 0.0]);
    }
}

#[test]
fn flqr_without_friction_and_gains_that_are_no_numbers_are_refused() {
    let smooth = RobotModel { friction: [None; 2], ..robot() };
    let refused = BalanceController::new(ControllerKind::Flqr, &smooth, gain()).unwrap_err();
    assert_eq!(refused, ControlError::NoFriction);
    let mut broken = gain();
    broken[(1, 2)] = f64::NAN;
    let refused = BalanceController::new(ControllerKind::Lqr, &robot(), broken).unwrap_err();
    assert_eq!(refused.to_string(), "gain of motor right, state pitch is NaN: it must be a finite number");
}
