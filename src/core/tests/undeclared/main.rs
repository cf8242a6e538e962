//! Robots with effects that their models do not declare, from a generator that shares no code with the engine.
//!
//! The cases here are a sample for every build; `cargo bench -p flqr-core --bench undeclared` prints the whole table.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::disallowed_methods, reason = "these tests read the given logs")]

#[expect(dead_code, reason = "the benchmark prints the whole table of cases")]
#[expect(
    clippy::collapsible_match,
    clippy::needless_range_loop,
    clippy::wrong_self_convention,
    reason = "as the equations are written"
)]
mod generator;

use std::ops::ControlFlow;

use flqr_core::model_file::Model;
use flqr_core::record::{ColumnMap, Log, ReadOptions, Severity, read_log};
use flqr_core::refine::{Options, Refinement, Verdict, refine};
use generator::{Case, Conditions, Fault, cases};

const SHORT: Conditions = Conditions { seconds: 24.0, excitation: 1.0, noise: 1.0 };

fn log(case: &Case) -> Log {
    Log::from_columns(case.name.clone(), case.record(false, SHORT).expect("the robot stays up"))
}

fn refined(case: &Case, log: Log) -> Refinement {
    let model = Model::from_toml(&case.declared.to_toml(), "declared").unwrap();
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

#[test]
fn a_clean_robot_lacks_nothing_and_gives_the_same_answer_again() {
    for tolerance in [0.0, 0.01] {
        let case = cases::clean(2, tolerance);
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
fn what_no_library_has_gets_no_name() {
    let case = cases::unknown(4, 7);
    let found = refined(&case, log(&case));
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::UnexplainedResidual, 0));
    assert!(!found.unexplained.depends_on.is_empty());
}

type Damage = (&'static str, fn(&mut Vec<f64>));

#[test]
fn damaged_columns_are_told_before_any_effect() {
    let damages: [Damage; 7] = [
        ("pitch_rate_rad_s", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("pitch_rate_rad_s", |column| column.iter_mut().for_each(|v| *v = v.to_degrees())),
        ("pitch_rad", |column| column.fill(0.01)),
        ("motor_speed_left_rad_s", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("torque_left_nm", |column| column.fill(0.0)),
        ("motor_angle_right_rad", |column| column.iter_mut().for_each(|v| *v = -*v)),
        ("time_s", |column| column.iter_mut().for_each(|v| *v *= 40.0)),
    ];
    let case = cases::clean(0, 0.0);
    let whole = log(&case);
    for (name, damage) in damages {
        let mut damaged = whole.clone();
        damage(&mut damaged.columns.iter_mut().find(|column| column.name == name).unwrap().values);
        let found = refined(&case, damaged);
        assert_eq!((found.verdict, ids(&found).len()), (Verdict::DataUnfit, 0), "{name}");
        let named = found.data_health.iter().any(|f| f.severity == Severity::Error && f.column == name);
        assert!(named, "{name}: {:?}", found.data_health);
    }
}

#[test]
fn a_robot_at_rest_is_unfit() {
    let case = cases::clean(0, 0.0);
    let still = Conditions { excitation: 0.0, ..SHORT };
    let log = Log::from_columns("still", case.record(false, still).unwrap());
    let found = refined(&case, log);
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::DataUnfit, 0), "{:?}", found.data_health);
}

/// The given example logs, where they are there.
#[test]
fn given_examples_are_right() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/undeclared");
    if !std::path::Path::new(folder).exists() {
        assert!(std::env::var_os("FLQR_REQUIRE_SHARED").is_none(), "{folder} is absent");
        println!("skipped: {folder} is absent");
        return;
    }
    let read = |path: String| {
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let map = ColumnMap::default();
        read_log(file, &path, &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(())).unwrap()
    };
    for (name, effect) in [("example-balance", Some("tether_spring")), ("example-clean", None)] {
        let text = std::fs::read_to_string(format!("{folder}/{name}/model.toml")).unwrap();
        let model = Model::from_toml(&text, name).unwrap();
        let logs = ["log", "heldout"].map(|log| read(format!("{folder}/{name}/{log}.csv")));
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
