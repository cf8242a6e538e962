//! Robots with effects that their models do not declare, from a generator that shares no code with the engine.
//!
//! The cases here are a sample for every build; `cargo bench -p flqr-core --bench undeclared` prints the whole table.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod bench;
mod generator;
#[cfg(test)]
#[path = "../shared/mod.rs"]
mod shared;

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use flqr_core::model::Model;
use flqr_core::record::{Log, Severity};
use flqr_core::refine::{Options, Outcome, Refinement, Verdict, refine};
use generator::fault::Fault;
use generator::{Case, Conditions, cases};
use shared::{shared_log, shared_text};

const SHORT: Conditions = Conditions { seconds: 24.0, excitation: 1.0, noise: 1.0 };

fn log(case: &Case) -> Log {
    Log::from_columns(case.name.clone(), case.record(false, SHORT).expect("the robot stays up"))
}

fn refined(case: &Case, log: Log) -> Refinement {
    let model = Model::from_toml(&case.declared.model_file(), "declared").unwrap();
    refine(&model, &[log], &[], &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap()
}

fn ids(found: &Refinement) -> Vec<&'static str> {
    found.effects.iter().map(|found| found.effect.id()).collect()
}

#[test]
fn effects_are_named_with_their_sizes() {
    for (fault, key, size) in [
        (Fault::Tether { n_m: 12.0, anchor: -0.05 }, "stiffness_n_m", 12.0),
        (Fault::Delay { seconds: 0.005 }, "delay_s", 0.005),
        (Fault::Gain { share: -0.1 }, "gain", -0.1),
        (Fault::Viscous { nm_s: 0.006 }, "viscous_nm_s_rad", 0.006),
        (Fault::PitchOffset { rad: 0.02 }, "angle_rad", 0.02),
        (Fault::ImuDelay { seconds: 0.008 }, "delay_s", 0.008),
        (Fault::GyroBias { rad_s: 0.02 }, "rate_rad_s", 0.02),
    ] {
        let case = Case { faults: vec![fault], ..cases::clean(3, 0.0) };
        let found = refined(&case, log(&case));
        assert_eq!(ids(&found), [fault.id().unwrap()], "{:?}", found.unexplained);
        assert_eq!(found.verdict, Verdict::EffectsFound);
        let value = found.effects[0].effect.get(key).unwrap();
        assert!((value / size - 1.0).abs() < 0.1, "{fault:?} comes out as {value}");
    }
}

/// Cases assessed side by side.
fn judged(cases: Vec<Case>) -> Vec<(Case, Refinement)> {
    let threads = NonZeroUsize::new(2).unwrap();
    let found = flqr_core::parallel::map(&cases, threads, |case| refined(case, log(case)));
    cases.into_iter().zip(found).collect()
}

/// Returns whether the robot's effect is among those named or those that cannot be distinguished from one.
fn is_named(fault: &Fault, found: &Refinement) -> bool {
    found.effects.iter().any(|effect| {
        let others = effect.ambiguous_with.iter().map(|kind| kind.id);
        others.chain([effect.effect.id()]).any(|id| Some(id) == fault.id())
    })
}

/// Of these cases at least so many have all of their effects named, and no more.
fn holds(cases: Vec<Case>, least: usize) {
    let judged = judged(cases);
    let is_right = |(case, found): &&(Case, Refinement)| {
        found.effects.len() == case.faults.len() && case.faults.iter().all(|fault| is_named(fault, found))
    };
    let (right, wrong): (Vec<_>, Vec<_>) = judged.iter().partition(is_right);
    let told: Vec<_> = wrong.iter().map(|(case, found)| (&case.name, ids(found), found.verdict)).collect();
    assert!(right.len() >= least, "{} of {}: {told:?}", right.len(), judged.len());
}

#[test]
fn a_sample_of_realistic_effects_is_named() {
    let kinds = [0, 2, 5, 10, 19, 21, 24, 25, 26, 28, 34];
    assert!(kinds.iter().all(|&kind| kind < cases::SINGLES));
    holds(kinds.iter().map(|&kind| cases::one(kind, 1.0, 7000 + kind as u64)).collect(), 10);
}

#[test]
fn a_sample_of_quarter_size_is_named() {
    let kinds = [3, 6, 8, 13, 20, 22];
    holds(kinds.iter().map(|&kind| cases::one(kind, 0.25, 7100 + kind as u64)).collect(), 5);
}

#[test]
fn a_sample_of_pairs_is_named() {
    holds(cases::PAIRS[..4].iter().zip(7200..).map(|(pair, seed)| cases::two(*pair, seed)).collect(), 3);
}

#[test]
fn sizes_are_in_their_intervals() {
    let kinds = [6, 8, 13, 18, 20, 24];
    let judged = judged(kinds.iter().map(|&kind| cases::one(kind, 1.0, 7300 + kind as u64)).collect());
    let inside = |(case, found): &&(Case, Refinement)| {
        let weight_n = (case.declared.mass + 2.0 * case.declared.wheel) * case.declared.gravity;
        let (key, size) = case.faults[0].truth(weight_n).unwrap();
        found.effects.iter().filter(|effect| Some(effect.effect.id()) == case.faults[0].id()).any(|effect| {
            let place = effect.effect.parameters().iter().position(|(name, _)| name == key).unwrap();
            let [low, high] = effect.ci95[place].unwrap();
            (low..=high).contains(&size)
        })
    };
    assert!(judged.iter().filter(inside).count() >= 5);
}

#[test]
fn a_clean_robot_lacks_nothing_and_gives_the_same_answer_again() {
    for share in [0.0, 1.0] {
        let case = cases::clean(2, share);
        let log = log(&case);
        let found = refined(&case, log.clone());
        assert_eq!(
            (found.verdict, ids(&found).len()),
            (Verdict::ModelAdequate, 0),
            "{:?}",
            found.unexplained
        );
        let again = refined(&case, log);
        let bytes = |found: &Refinement| serde_json::to_string(found).unwrap();
        assert_eq!(bytes(&again), bytes(&found));
    }
}

#[test]
fn clean_robots_lack_nothing_however_strong_their_noise() {
    for noise in [0.5, 2.0] {
        for (seed, share) in [(11, 0.0), (12, 1.0)] {
            let case = cases::clean(seed, share);
            let recording = case.record(false, Conditions { noise, ..SHORT }).unwrap();
            let found = refined(&case, Log::from_columns("clean", recording));
            assert_eq!(
                (found.verdict, ids(&found)),
                (Verdict::ModelAdequate, vec![]),
                "noise × {noise}, share {share}: {}",
                found.unexplained.description
            );
        }
    }
}

#[test]
fn what_no_library_has_gets_no_name() {
    let kinds = [0, 1, 4, 5, 7];
    assert!(kinds.iter().all(|&kind| kind < cases::OUTSIDE));
    let judged = judged(kinds.iter().map(|&kind| cases::unknown(kind, 7400 + kind as u64)).collect());
    for (case, found) in &judged {
        assert_eq!((found.verdict, ids(found)), (Verdict::UnexplainedResidual, vec![]), "{:?}", case.faults);
        assert!(!found.unexplained.depends_on.is_empty());
    }
}

#[test]
fn what_was_tried_is_told() {
    let case = Case { faults: vec![Fault::Tether { n_m: 12.0, anchor: 0.0 }], ..cases::clean(3, 0.0) };
    let found = refined(&case, log(&case));
    let first = &found.candidates[0];
    assert_eq!((first.kind.id, &first.outcome), ("tether_spring", &Outcome::Added));
    assert!(first.gain_percent > 10.0 && first.z > 5.0, "{first:?}");
    let gains: Vec<f64> = found.candidates.iter().map(|tried| tried.gain_percent).collect();
    assert!(found.candidates.len() > 1 && gains[0] >= gains[1], "{gains:?}");
}

type Damage = (&'static str, fn(&mut Vec<f64>));

#[test]
fn damaged_columns_are_told_before_any_effect() {
    let damages: [Damage; 12] = [
        ("x_m", |column| column.iter_mut().for_each(|v| *v *= 0.8)),
        ("pitch_rate_rad_s", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("pitch_rate_rad_s", |column| column.iter_mut().for_each(|v| *v = v.to_degrees())),
        ("pitch_rad", |column| column.fill(0.01)),
        ("pitch_rate_rad_s", |column| column.fill(0.0)),
        ("motor_angle_left_rad", |column| column.iter_mut().for_each(|v| *v = v.to_degrees())),
        ("motor_speed_left_rad_s", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("torque_left_nm", |column| column.fill(0.0)),
        ("torque_left_nm", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("torque_left_nm", |column| column.iter_mut().for_each(|v| *v *= 1000.0)),
        ("motor_angle_right_rad", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("time_s", |column| column.iter_mut().for_each(|v| *v *= 40.0)),
    ];
    let case = cases::clean(0, 0.0);
    let whole = log(&case);
    for (name, damage) in damages {
        let mut damaged = whole.clone();
        damage(&mut damaged.columns.iter_mut().find(|column| column.name == name).unwrap().values);
        is_unfit(&case, damaged, name);
    }
}

/// The log is unfit, its `column` is told to be why, and nothing is named.
fn is_unfit(case: &Case, log: Log, column: &str) {
    let found = refined(case, log);
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::DataUnfit, 0), "{column}");
    let errors: Vec<_> = found.data_health.iter().filter(|f| f.severity == Severity::Error).collect();
    let names = |text: &str| column.split('/').any(|column| text.contains(column));
    assert!(errors.iter().any(|f| names(&f.column) || names(&f.problem)), "{column}: {errors:?}");
}

#[test]
fn short_slow_swapped_and_clipped_logs_are_unfit() {
    let case = cases::clean(0, 0.0);
    let whole = log(&case);
    let with = |change: &dyn Fn(&mut Log)| {
        let mut log = whole.clone();
        change(&mut log);
        log
    };
    let short = with(&|log| log.columns.iter_mut().for_each(|column| column.values.truncate(5000)));
    is_unfit(&case, short, "time_s");
    let slow = with(&|log| {
        for column in &mut log.columns {
            column.values = column.values.iter().copied().step_by(30).collect();
        }
    });
    is_unfit(&case, slow, "time_s");
    let swapped = with(&|log| {
        let place = |name: &str| log.columns.iter().position(|column| column.name == name).unwrap();
        let [left, right] = ["motor_angle_left_rad", "motor_angle_right_rad"].map(place);
        // A turn on the spot tells the wheels apart.
        for row in 0..log.columns[left].values.len() {
            let turn = 0.5 * (row as f64 * 1e-3 * 0.7).sin();
            log.columns[left].values[row] += turn;
            log.columns[right].values[row] -= turn;
        }
        let names = [left, right].map(|place| log.columns[place].name.clone());
        (log.columns[left].name, log.columns[right].name) = (names[1].clone(), names[0].clone());
        for (name, sign) in [("motor_speed_left_rad_s", 1.0), ("motor_speed_right_rad_s", -1.0)] {
            let column = log.columns.iter_mut().find(|column| column.name == name).unwrap();
            for (row, value) in column.values.iter_mut().enumerate() {
                *value += sign * 0.35 * (row as f64 * 1e-3 * 0.7).cos();
            }
        }
    });
    is_unfit(&case, swapped, "motor_speed_left_rad_s/motor_angle");
    let clipped = with(&|log| {
        for column in log.columns.iter_mut().filter(|column| column.name.starts_with("torque")) {
            column.values.iter_mut().for_each(|v| *v = v.clamp(-0.25, 0.25));
        }
    });
    is_unfit(&case, clipped, "torque_left_nm/torque_right_nm");
}

#[test]
fn a_log_of_other_wheels_is_unfit() {
    for factor in [0.8, 1.2] {
        let mut case = cases::clean(0, 0.0);
        let log = log(&case);
        case.declared.radius *= factor;
        is_unfit(&case, log, "wheel_radius_m");
    }
}

#[test]
fn a_robot_at_rest_gets_no_effect_and_a_warning() {
    let case = cases::clean(0, 0.0);
    let still = Conditions { excitation: 0.0, ..SHORT };
    let log = Log::from_columns("still", case.record(false, still).unwrap());
    let found = refined(&case, log);
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::ModelAdequate, 0), "{:?}", found.data_health);
    assert!(found.data_health.iter().any(|finding| finding.problem.contains("the robot hardly moves")));
}

/// The given example logs, where they are there.
#[test]
fn given_examples_are_right() {
    for (name, effect) in [("example-balance", Some("tether_spring")), ("example-clean", None)] {
        let Some(text) = shared_text(&format!("undeclared/{name}/model.toml")) else { return };
        let model = Model::from_toml(&text, name).unwrap();
        let logs =
            ["log", "heldout"].map(|log| shared_log(&format!("undeclared/{name}/{log}.csv"), &[]).unwrap());
        for (first, second) in [(0, 1), (1, 0)] {
            let (log, held) = ([logs[first].clone()], [logs[second].clone()]);
            let found =
                refine(&model, &log, &held, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap();
            assert_eq!(ids(&found), effect.into_iter().collect::<Vec<_>>(), "{name}");
            if effect.is_some() {
                let size = |key| found.effects[0].effect.get(key).unwrap();
                assert!((size("stiffness_n_m") / 12.0 - 1.0).abs() < 0.1);
                assert!((size("pull_n") / -0.6 - 1.0).abs() < 0.2);
                let (rest, floor) = (found.after.rmse.main(), found.after.noise_floor.main());
                // 1.1 is for the median over many robots.
                assert!(
                    rest < 1.2 * floor,
                    "{rest} for a floor of {floor}, before {}",
                    found.before.rmse.main()
                );
            } else {
                assert_eq!(found.verdict, Verdict::ModelAdequate, "{:?}", found.unexplained);
            }
        }
    }
}
