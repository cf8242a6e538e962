//! Weights for a wanted pole: found where there are known ones, refused where no weights can be.

use nalgebra::Complex;

use crate::lqr::{Placement, SampledLoop, Weights, design, sampled_poles, weights_for_pole};
use crate::model_file::presets;
use crate::robot::LinearModel;

fn robot() -> (LinearModel, SampledLoop) {
    let paper = presets::paper();
    let robot = paper.robot().unwrap();
    (robot.parameters.linear_model(), SampledLoop::of(robot))
}

fn poles(model: &LinearModel, timing: &SampledLoop, weights: &Weights) -> Vec<Complex<f64>> {
    let gain = design(model, weights).unwrap().gain;
    sampled_poles(model, &gain, timing).into_iter().map(|pole| pole.s).collect()
}

fn nearest(poles: &[Complex<f64>], to: Complex<f64>) -> f64 {
    poles.iter().map(|pole| (pole - to).norm()).fold(f64::INFINITY, f64::min)
}

/// The wanted pole is one of weights that are known, so there are weights for it.
#[test]
fn a_pole_that_weights_can_have_is_reached() {
    let (model, timing) = robot();
    let start = Weights::diagonal([2.0, 1.0, 20.0, 0.5], [1.0; 2]);
    let from = poles(&model, &timing, &start)[0];
    assert!(from.im.abs() > 0.1, "a pair: {from}");
    for other in [[2.4, 1.0, 20.0, 0.5], [6.0, 1.0, 20.0, 0.5], [9.0, 2.0, 5.0, 0.1], [1.0, 0.2, 60.0, 1.0]] {
        // The pole on its way from one set of weights to the other.
        let mut wanted = from;
        for share in 1..=100 {
            let between = [0, 1, 2, 3].map(|state| {
                let (a, b): (f64, f64) = (start.q[(state, state)], other[state]);
                a * (b / a).powf(f64::from(share) / 100.0)
            });
            let all = poles(&model, &timing, &Weights::diagonal(between, [1.0; 2]));
            wanted =
                all.into_iter().min_by(|a, b| (a - wanted).norm().total_cmp(&(b - wanted).norm())).unwrap();
        }
        assert!(wanted.im.abs() > 0.1, "still a pair: {wanted}");
        let Placement { weights: found, pole, is_reached } =
            weights_for_pole(&model, &timing, &start, from, wanted);
        assert!(is_reached && (pole - wanted).norm() < 2e-3 * wanted.norm(), "{other:?}: {pole}");
        assert!(nearest(&poles(&model, &timing, &found), wanted) < 2e-3 * wanted.norm(), "{other:?}");
        assert_eq!(found.r, start.r);
        assert!(found.is_diagonal());
    }
}

/// No weights are offered whose loop does not stand, however near the pole comes with them.
#[test]
fn a_pole_that_no_weights_have_is_refused_with_the_nearest() {
    let (model, timing) = robot();
    let start = Weights::diagonal([2.0, 1.0, 20.0, 0.5], [1.0; 2]);
    let from = poles(&model, &timing, &start)[0];
    for wanted in [Complex::new(5.0, from.im), Complex::new(3.0, 9.0), Complex::new(-0.1, 40.0)] {
        let placed = weights_for_pole(&model, &timing, &start, from, wanted);
        assert!(!placed.is_reached, "{wanted}");
        assert!(placed.pole.re < 0.0, "{placed:?}");
        let there = poles(&model, &timing, &placed.weights);
        assert!(nearest(&there, placed.pole) < 2e-3 * placed.pole.norm(), "{placed:?}");
        assert!(there.iter().all(|pole| pole.re <= 0.0), "{placed:?}");
    }
}

#[test]
fn no_way_is_no_change() {
    let (model, timing) = robot();
    let start = Weights::diagonal([2.0, 1.0, 20.0, 0.5], [1.0; 2]);
    for pole in poles(&model, &timing, &start).into_iter().take(4) {
        let same = weights_for_pole(&model, &timing, &start, pole, pole);
        assert!((same.weights.q - start.q).norm() < 1e-12);
    }
}
