//! Motors on a bench with effects that their models do not declare.

use std::ops::ControlFlow;

use flqr_core::model::Model;
use flqr_core::record::Log;
use flqr_core::refine::{Options, Refinement, Verdict, refine};

use crate::generator::bench_cases::{BenchCase, OUTSIDE, PAIRS, SINGLES};

const SECONDS: f64 = 40.0;

fn refined(case: &BenchCase) -> Refinement {
    let log = |held_out| Log::from_columns(case.name.clone(), case.record(held_out, SECONDS, 1.0));
    let model = Model::from_toml(&case.model_file(), "declared").unwrap();
    let options = Options::default();
    refine(&model, &[log(false)], &[log(true)], &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Returns whether an effect is among what was named, or told to look the same.
fn has(found: &Refinement, id: &str) -> bool {
    let is = |kind: &str| kind == id;
    found
        .effects
        .iter()
        .any(|found| is(found.effect.id()) || found.ambiguous_with.iter().any(|kind| is(kind.id)))
}

#[test]
fn effects_are_named_with_their_sizes() {
    let (mut right, mut inside, mut sizes) = (0, 0, 0);
    for kind in 0..SINGLES {
        let case = BenchCase::with(&[kind], 1.0, 7000 + kind as u64);
        let found = refined(&case);
        let named = case.ids().iter().all(|id| has(&found, id)) && found.effects.len() == 1;
        right += usize::from(named);
        if !named {
            println!("{}: {:?} {:?}", case.name, found.effects, found.unexplained);
        }
        let truth = case.flaws.iter().find_map(|flaw| flaw.truth(&case.declared));
        let Some((key, truth)) = truth else { continue };
        let Some(effect) = found.effects.iter().find(|found| found.effect.id() == case.name) else {
            continue;
        };
        let place = effect.effect.parameters().iter().position(|(name, _)| name == key).unwrap();
        let Some([low, high]) = effect.ci95[place] else { continue };
        sizes += 1;
        inside += usize::from((low..=high).contains(&truth));
    }
    assert!(right + 1 >= SINGLES, "{right} of {SINGLES}");
    assert!(inside + 2 >= sizes && sizes >= 10, "{inside} of {sizes}");
}

#[test]
fn clean_motors_lack_nothing() {
    for (seed, tolerance) in [(50, 0.0), (51, 0.01), (52, 0.01), (53, 0.01)] {
        let found = refined(&BenchCase::clean(seed, tolerance));
        assert_eq!((found.verdict, found.effects.len()), (Verdict::ModelAdequate, 0), "{:?}", found.effects);
        assert!(found.after.rmse.main() < 1.15 * found.after.noise_floor.main());
    }
}

#[test]
fn what_no_library_has_is_told_and_not_named() {
    let mut told = 0;
    for kind in 0..OUTSIDE {
        let found = refined(&BenchCase::unknown(kind, 8000 + kind as u64));
        let honest = found.verdict == Verdict::UnexplainedResidual && found.effects.is_empty();
        told += usize::from(honest);
        if !honest {
            println!("{kind}: {:?}", found.effects);
        }
    }
    assert!(told + 1 >= OUTSIDE, "{told} of {OUTSIDE}");
}

#[test]
fn two_effects_at_once_are_both_named() {
    let mut right = 0;
    let pairs = &PAIRS[..4];
    for (pair, seed) in pairs.iter().zip(9000..) {
        let case = BenchCase::with(pair, 1.0, seed);
        let found = refined(&case);
        right += usize::from(case.ids().iter().all(|id| has(&found, id)));
    }
    assert!(right + 1 >= pairs.len(), "{right} of {}", pairs.len());
}
