//! The robot's design: properties, an oracle of twice the digits, refusals.

use nalgebra::{Complex, DMatrix, Matrix2, Matrix4, Matrix4x2};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::lqr::{CareError, CareInput, DesignError, LqrDesign, design, solve_care};
use crate::model::{LinearModel, RobotParameters, Weights};

fn robot() -> LinearModel {
    RobotParameters {
        body_mass_kg: 13.0,
        wheel_mass_kg: 1.0,
        wheel_inertia_kg_m2: 0.005,
        wheel_radius_m: 0.1,
        com_height_m: 0.25,
        body_inertia_kg_m2: 0.25,
        gravity_m_s2: 9.81,
    }
    .linear_model()
}

fn paper_like(r: f64) -> Weights {
    Weights::diagonal([60.0, 30.0, 100.0, 5.0], [r, r])
}

#[test]
fn design_of_the_robot_is_exact_stable_and_equal_on_both_sides() {
    let LqrDesign { gain, cost, poles, riccati_residual } = design(&robot(), &paper_like(20.0)).unwrap();
    assert!(riccati_residual <= 1e-13, "{riccati_residual:e}");
    assert_eq!(gain.row(0), gain.row(1));
    assert_eq!(cost, cost.transpose());
    assert!(cost.symmetric_eigenvalues().min() > 0.0);
    assert!(poles.iter().all(|pole| pole.re < 0.0));
    // P₁₁ to 16 digits, as in the references of the general solver.
    assert!((cost[(0, 0)] / 97.677_118_483_163_92 - 1.0).abs() < 1e-14);
}

/// The poles' elementary symmetric functions are the coefficients of det(s − A + BK), which for this robot
/// are sums of products of single entries.
#[test]
fn poles_satisfy_the_characteristic_polynomial() {
    let model = robot();
    let LqrDesign { gain, poles, .. } = design(&model, &paper_like(20.0)).unwrap();
    let closed_loop = model.a - model.b * gain;
    for pole in poles {
        let shifted = closed_loop.map(Complex::from) - Matrix4::identity() * pole;
        let others: f64 = poles.iter().map(|other| (other - pole).norm()).filter(|gap| *gap > 0.0).product();
        assert!(shifted.determinant().norm() < 1e-9 * others, "{pole}");
    }
}

#[test]
fn each_motor_has_half_the_gain_of_one_motor_at_half_the_weight() {
    let model = robot();
    let gain = design(&model, &paper_like(20.0)).unwrap().gain;
    let a = DMatrix::from_column_slice(4, 4, model.a.as_slice());
    let b = DMatrix::from_column_slice(4, 1, model.b.column(0).into_owned().as_slice());
    let q = DMatrix::from_column_slice(4, 4, paper_like(20.0).q.as_slice());
    let r = DMatrix::from_element(1, 1, 10.0);
    let one = solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r }).unwrap().gain.unwrap();
    for state in 0..4 {
        assert!((2.0 * gain[(0, state)] / one[(0, state)] - 1.0).abs() < 1e-13);
    }
}

#[test]
fn scaling_all_weights_leaves_the_gain() {
    let weights = paper_like(20.0);
    let scaled = Weights { q: weights.q * 8.0, r: weights.r * 8.0 };
    let (one, other) = (design(&robot(), &weights).unwrap(), design(&robot(), &scaled).unwrap());
    assert!((one.gain - other.gain).norm() < 1e-13 * one.gain.norm());
    assert!((one.cost * 8.0 - other.cost).norm() < 1e-13 * other.cost.norm());
}

/// The whole range of the window's sliders, against the general solver's double-double.
#[test]
fn any_weights_of_the_sliders_give_a_stable_and_exact_design() {
    let model = robot();
    let a = DMatrix::from_column_slice(4, 4, model.a.as_slice());
    let b = DMatrix::from_column_slice(4, 2, model.b.as_slice());
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    let mut draw = |low: f64, high: f64| 10_f64.powf(generator.random_range(low..=high));
    for case in 0..1000 {
        let weights = Weights::diagonal([0; 4].map(|_| draw(-4.0, 6.0)), [0; 2].map(|_| draw(-3.0, 4.0)));
        let found = design(&model, &weights).unwrap();
        assert!(found.poles.iter().all(|pole| pole.re < 0.0), "{weights:?}");
        // 1e-13, or what rounding P to double leaves where the poles are far apart.
        let rounding = f64::EPSILON * (model.a.norm() + (model.b * found.gain).norm());
        assert!(found.riccati_residual <= 1e-13 + 4.0 * rounding, "{weights:?} {}", found.riccati_residual);
        assert!(found.cost.symmetric_eigenvalues().min() > -1e-14 * found.cost.norm(), "{weights:?}");
        if case % 10 == 0 {
            let (q, r) = (
                DMatrix::from_column_slice(4, 4, weights.q.as_slice()),
                DMatrix::from_column_slice(2, 2, weights.r.as_slice()),
            );
            let exact = solve_care(&a, &q, CareInput::Weighted { b: &b, r: &r }).unwrap();
            let gain = exact.gain.unwrap();
            let (cost_error, gain_error) =
                (distance(found.cost.as_slice(), &exact.p), distance(found.gain.as_slice(), &gain));
            assert!(cost_error < 1e-11 && gain_error < 1e-11, "{weights:?}: {cost_error:e} {gain_error:e}");
        }
    }
}

/// ‖found − expected‖ / ‖expected‖, column by column.
fn distance(found: &[f64], expected: &DMatrix<f64>) -> f64 {
    (DMatrix::from_column_slice(expected.nrows(), expected.ncols(), found) - expected).norm()
        / expected.norm()
}

#[test]
fn full_matrices_are_weights_too() {
    let mut weights = paper_like(20.0);
    (weights.q[(0, 2)], weights.q[(2, 0)]) = (10.0, 10.0);
    weights.r = Matrix2::new(20.0, 4.0, 4.0, 30.0);
    let found = design(&robot(), &weights).unwrap();
    assert!(found.riccati_residual <= 1e-13 && found.poles.iter().all(|pole| pole.re < 0.0));
    // A semidefinite Q of rank 1: y = x + 2 pitch, with the rounding of its outer product.
    let output = nalgebra::Vector4::new(0.1, 0.0, 0.7, 0.3);
    weights.q = output * output.transpose();
    assert!(design(&robot(), &weights).is_ok());
}

#[test]
fn bad_weights_and_models_are_refused_by_name() {
    let good = paper_like(20.0);
    let edited = |edit: &dyn Fn(&mut Weights)| {
        let mut weights = good;
        edit(&mut weights);
        design(&robot(), &weights).unwrap_err()
    };
    let zero = Complex::default();
    let cases: [(DesignError, DesignError); 8] = [
        (edited(&|w| w.q[(0, 0)] = 0.0), DesignError::NotDetectable { eigenvalue: zero, state: "x" }),
        (edited(&|w| w.q = Matrix4::zeros()), DesignError::NotDetectable { eigenvalue: zero, state: "x" }),
        (edited(&|w| w.q[(1, 1)] = -1e-9), DesignError::QNotPositiveSemidefinite),
        (edited(&|w| (w.q[(0, 1)], w.q[(1, 0)]) = (43.0, 43.0)), DesignError::QNotPositiveSemidefinite),
        (edited(&|w| w.r[(1, 1)] = 0.0), CareError::RNotPositiveDefinite.into()),
        (edited(&|w| w.r = Matrix2::new(1.0, 1.0, 1.0, 1.0)), CareError::RNotPositiveDefinite.into()),
        (
            edited(&|w| w.q[(3, 2)] = 1.0),
            CareError::NotSymmetric { matrix: "q", row: 3, column: 4, upper: 0.0, lower: 1.0 }.into(),
        ),
        (
            edited(&|w| w.r[(0, 0)] = f64::INFINITY),
            CareError::NonFinite { matrix: "r", row: 1, column: 1, value: f64::INFINITY }.into(),
        ),
    ];
    for (found, expected) in cases {
        assert_eq!(found, expected);
    }
    assert_eq!(
        edited(&|w| w.q[(0, 0)] = 0.0).to_string(),
        "not detectable: the mode at 0 is not asymptotically stable and has no cost: give x a weight above 0"
    );
    let motorless = LinearModel { b: Matrix4x2::zeros(), ..robot() };
    let error = design(&motorless, &good).unwrap_err();
    assert!(matches!(error, DesignError::Equation(CareError::NotStabilisable { .. })), "{error}");
}
