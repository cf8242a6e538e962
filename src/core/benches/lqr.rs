//! Speed of the LQR design and of the general Riccati solver.
//!
//! `cargo bench -p flqr-core --bench lqr`

use divan::{Bencher, black_box};
use flqr_core::lqr::{CareInput, SampledLoop, design, margins, solve_care};
use flqr_core::model::{LinearModel, RobotParameters, Weights};
use nalgebra::{DMatrix, DVector};

fn main() {
    divan::main();
}

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

/// What one drag of a slider costs: P, K, residual and poles of four states and two inputs.
#[divan::bench(sample_size = 1000)]
fn design_of_the_robot(bencher: Bencher) {
    let (model, weights) = (robot(), Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0, 20.0]));
    bencher.bench_local(|| design(black_box(&model), black_box(&weights)));
}

/// What the margins of the sampled loop add to the drag: 1 kHz, 4 ms of delay, 100 Hz IMU.
#[divan::bench(sample_size = 10)]
fn margins_of_the_robot(bencher: Bencher) {
    let (model, weights) = (robot(), Weights::diagonal([60.0, 30.0, 100.0, 5.0], [20.0, 20.0]));
    let gain = design(&model, &weights).expect("the robot has a design").gain;
    let timing = SampledLoop {
        tick_s: 0.001,
        delay_s: 0.004,
        imu_period_s: 0.01,
        imu_latency_s: 0.0,
        wheel_radius_m: 0.1,
    };
    bencher.bench_local(|| margins(black_box(&model), black_box(&gain), black_box(&timing)));
}

/// The design by the general solver, with residuals in double-double.
#[divan::bench]
fn general_solver_on_the_robot(bencher: Bencher) {
    let model = robot();
    let a = DMatrix::from_column_slice(4, 4, model.a.as_slice());
    let b = DMatrix::from_column_slice(4, 2, model.b.as_slice());
    let q = DMatrix::from_diagonal(&DVector::from_column_slice(&[60.0, 30.0, 100.0, 5.0]));
    let r = DMatrix::identity(2, 2) * 20.0;
    bencher.bench_local(|| solve_care(black_box(&a), black_box(&q), CareInput::Weighted { b: &b, r: &r }));
}

/// Heat along a rod of n cells that is cooled at one end.
#[divan::bench(args = [4, 20, 60, 100])]
fn general_solver_by_size(bencher: Bencher, n: usize) {
    let a = DMatrix::from_fn(n, n, |i, j| match (i, j) {
        _ if i == j => -1.0,
        _ if i + 1 == j || j + 1 == i => 0.5,
        _ => 0.0,
    });
    let b = DMatrix::from_fn(n, 1, |i, _| f64::from(u8::from(i + 1 == n)));
    let (q, r) = (DMatrix::identity(n, n), DMatrix::identity(1, 1));
    bencher.bench_local(|| solve_care(black_box(&a), black_box(&q), CareInput::Weighted { b: &b, r: &r }));
}
