//! Weights for a wanted pole: found where there are known ones, refused where no weights can be.

use nalgebra::Complex;

use crate::lqr::{Placement, SampledLoop, design, sampled_poles, weights_for_pole};
use crate::model::{LinearModel, Weights};
use crate::model_file::presets;

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
        assert!(is_reached && (pole - wanted).norm() < 2e-2 * wanted.norm(), "{other:?}: {pole}");
        assert!(nearest(&poles(&model, &timing, &found), wanted) < 2e-2 * wanted.norm(), "{other:?}");
        assert_eq!(found.r, start.r);
        assert!(found.is_diagonal());
    }
}

/// A real pole stays real, wherever it is dragged.
#[test]
fn a_real_pole_is_moved_along_the_axis() {
    let (model, timing) = robot();
    let start = Weights::diagonal([2.0, 1.0, 20.0, 0.5], [1.0; 2]);
    let all = poles(&model, &timing, &start);
    let from = *all.iter().find(|pole| pole.im == 0.0).unwrap();
    let placed = weights_for_pole(&model, &timing, &start, from, Complex::new(1.3 * from.re, 5.0));
    let there = poles(&model, &timing, &placed.weights);
    assert!(placed.is_reached, "{placed:?}");
    assert!(
        nearest(&there, Complex::new(1.3 * from.re, 0.0)) < 2e-2 * from.norm(),
        "{placed:?} of {there:?}"
    );
}

/// No weights are offered whose loop does not stand, however near the pole comes with them.
#[test]
fn a_pole_that_no_stable_loop_has_is_not_reached() {
    let (model, timing) = robot();
    let start = Weights::diagonal([2.0, 1.0, 20.0, 0.5], [1.0; 2]);
    for from in poles(&model, &timing, &start).into_iter().take(4) {
        for wanted in [Complex::new(5.0, from.im), Complex::new(3.0, 9.0), Complex::new(-0.1, 400.0)] {
            let placed = weights_for_pole(&model, &timing, &start, from, wanted);
            let there = poles(&model, &timing, &placed.weights);
            assert!(there.iter().all(|pole| pole.re <= 0.0), "{wanted}: {placed:?} of {there:?}");
            assert!(nearest(&there, placed.pole) < 1e-9 * placed.pole.norm(), "{placed:?}");
            if wanted.re > 0.0 {
                assert!(!placed.is_reached, "{wanted}: {placed:?}");
            }
        }
    }
}

/// A loop that does not stand may only become better.
#[test]
fn from_a_loop_that_is_unstable_no_pole_goes_further_right() {
    let (model, timing) = robot();
    let start = Weights::diagonal([1e7, 1.0, 1e7, 0.5], [1.0; 2]);
    let rightmost =
        |poles: &[Complex<f64>]| poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max);
    let all = poles(&model, &timing, &start);
    assert!(rightmost(&all) > 0.0, "{all:?}");
    for from in all.iter().take(4) {
        for step in [Complex::new(-2.0, 0.0), Complex::new(4.0, 2.0)] {
            let placed = weights_for_pole(&model, &timing, &start, *from, from + step);
            let there = poles(&model, &timing, &placed.weights);
            assert!(rightmost(&there) <= rightmost(&all) * (1.0 + 1e-9), "{from} by {step}: {there:?}");
        }
    }
}

#[test]
fn no_way_is_no_change() {
    let (model, timing) = robot();
    let start = Weights::diagonal([2.0, 1.0, 20.0, 0.5], [1.0; 2]);
    for pole in poles(&model, &timing, &start).into_iter().take(4) {
        let same = weights_for_pole(&model, &timing, &start, pole, pole);
        assert!(same.is_reached);
        assert!((same.weights.q - start.q).norm() < 1e-12);
    }
}
