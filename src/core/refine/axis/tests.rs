//! The loop closed on measured and made logs of one motor or axis.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::model::{Model, Motor};
use crate::record::{HealthFinding, Log, LogKind, Severity};
use crate::refine::{Options, Refinement, Verdict, refine, residual, verdict::Channels};
use crate::shared::shared_log;
use crate::simulate::{self, ControllerChoice, Experiment, Scenario};

fn refined(model: &str, logs: &[Log], held_out: &[Log], estimate: &[&str]) -> Refinement {
    let model = Model::from_toml(model, "model.toml").unwrap();
    let estimate = estimate.iter().map(|&name| name.to_owned()).collect();
    let options = Options { estimate, ..Options::default() };
    refine(&model, logs, held_out, &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn ids(found: &Refinement) -> Vec<&str> {
    found.effects.iter().map(|found| found.effect.id()).collect()
}

const SHAFT: &str = "name = \"shaft\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.005\n[friction]\n\
                     coulomb_nm = 0.03\nviscous_nm_s_rad = 0.0005\n";

/// The same as a carriage, with the same numbers.
const RAIL: &str = "name = \"rail\"\n[axis]\nkind = \"linear\"\nmass_kg = 0.005\n[friction]\n\
                    coulomb_n = 0.03\nviscous_n_s_m = 0.0005\n";
const RAIL_NAMES: [(&str, &str); 3] =
    [("time_s", "time_s"), ("motor_angle_rad", "position_m"), ("torque_nm", "force_n")];

fn on_rail(log: &Log) -> Log {
    let column = |(old, new): &(&'static str, &'static str)| (*new, log.column(old).unwrap().to_vec());
    Log::from_columns(log.source.clone(), RAIL_NAMES.iter().map(column))
}

/// A shaft that turns back and forth without ever resting long, driven by the torque that its motion takes, with what
/// `more` adds to it; noise of an encoder of 16 bits and of the torque.
fn shaft(seed: u64, more: impl Fn(f64, f64, f64) -> f64) -> Log {
    const ROWS: usize = 30_000;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
    let waves =
        [(3.0, 0.11), (2.0, 0.23), (1.0, 0.57), (0.3, 1.9)].map(|(size, hz)| (size, hz, TAU * uniform()));
    let step = TAU / 65_536.0;
    let mut columns: [Vec<f64>; 3] = Default::default();
    for row in 0..ROWS {
        let time = row as f64 * 1e-3;
        let (mut q, mut v, mut a) = (0.0, 0.0, 0.0);
        for (size, hz, phase) in waves {
            let angle = TAU * hz * time + phase;
            q += size * (1.0 - angle.cos()) / (TAU * hz);
            v += size * angle.sin();
            a += size * TAU * hz * angle.cos();
        }
        let torque = 0.005 * a + 0.03 * v.signum() + 0.0005 * v + more(time, q, v) + 0.004 * uniform();
        columns[0].push(time);
        columns[1].push((q / step + uniform()).round() * step);
        columns[2].push(torque);
    }
    let names = ["time_s", "motor_angle_rad", "torque_nm"];
    Log::from_columns("made.csv", names.into_iter().zip(columns))
}

#[test]
fn a_clean_shaft_lacks_nothing() {
    for seed in 0..4 {
        let found = refined(SHAFT, &[shaft(seed, |_, _, _| 0.0)], &[], &[]);
        assert_eq!(
            found.verdict,
            Verdict::ModelAdequate,
            "{seed}: {:?} {:?}",
            ids(&found),
            found.unexplained
        );
        let ratio = found.after.rmse.main() / found.after.noise_floor.main();
        assert!((0.8..1.2).contains(&ratio), "{ratio}");
    }
}

#[test]
fn effects_are_named_and_sized() {
    // Each takes so much more torque; key and value that it has.
    type More = fn(f64, f64, f64) -> f64;
    let cases: [(&str, More, &str, f64); 5] = [
        ("cogging", |_, q, _| -0.006 * (14.0 * q).sin(), "sin_1_nm", 0.006),
        ("quadratic_drag", |_, _, v| 4e-4 * v * v.abs(), "drag_nm_s2_rad2", 4e-4),
        ("viscous_asymmetry", |_, _, v| 0.001 * v.abs(), "viscous_nm_s_rad", 0.001),
        ("coulomb_error", |_, _, v| 0.012 * v.signum(), "coulomb_nm", 0.012),
        ("thermal_friction", |t, _, v| 0.01 * (-t / 6.0).exp_m1() * v.signum(), "fall_nm", 0.01),
    ];
    for (id, more, key, expected) in cases {
        let found = refined(SHAFT, &[shaft(1, more)], &[shaft(2, more)], &[]);
        assert_eq!(ids(&found), [id], "{:?}", found.unexplained);
        let effect = &found.effects[0];
        let place = effect.effect.parameters().iter().position(|(name, _)| name == key).unwrap();
        let (_, value) = effect.effect.parameters()[place];
        assert!((value / expected - 1.0).abs() < 0.1, "{id}: {value} for {expected}");
        let [low, high] = effect.ci95[place].unwrap();
        assert!(low < value && value < high && high - low < 0.5 * expected, "{id}: {low} {high}");
        assert!(found.after.rmse.main() < 1.1 * found.after.noise_floor.main(), "{id}");
    }
}

/// A ripple of a shaft, small against the noise that its position's makes of the acceleration.
fn rippling(_: f64, q: f64, _: f64) -> f64 {
    -0.006 * (14.0 * q).sin()
}

fn extended(log: &Log, rows: usize) -> Log {
    let last = |values: &[f64]| values[values.len() - 1];
    let columns = log.columns.iter().map(|column| {
        let standing = (1..=rows).map(|row| match column.name.as_str() {
            "time_s" => last(&column.values) + row as f64 * 1e-3,
            "torque_nm" => 0.0,
            _ => last(&column.values),
        });
        (column.name.clone(), column.values.iter().copied().chain(standing).collect())
    });
    Log::from_columns("extended.csv", columns)
}

#[test]
fn standing_still_at_the_end_hides_nothing() {
    let log = extended(&shaft(1, rippling), 20_000);
    assert_eq!(ids(&refined(SHAFT, &[log], &[], &[])), ["cogging"]);
    let still = extended(&between(&shaft(2, rippling), 0.0..0.2), 10_000);
    let found = refined(SHAFT, &[shaft(1, rippling)], &[still], &[]);
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::DataUnfit, 0));
}

#[test]
fn one_bad_cell_changes_no_effect() {
    let log = shaft(1, rippling);
    let with = |column: &str| {
        let columns = log.columns.iter().map(|own| {
            let mut values = own.values.clone();
            if own.name == column {
                values[20_002] += 50.0;
            }
            (own.name.clone(), values)
        });
        Log::from_columns("bad.csv", columns)
    };
    for column in ["torque_nm", "motor_angle_rad"] {
        let found = refined(SHAFT, &[with(column)], &[shaft(2, rippling)], &[]);
        assert_eq!(ids(&found), ["cogging"], "{column}");
        let named =
            |finding: &HealthFinding| finding.column == column && finding.problem.contains("20.002 s");
        assert!(found.data_health.iter().any(named), "{:?}", found.data_health);
    }
}

#[test]
fn order_of_logs_copies_and_cuts_change_no_effect() {
    let (a, b) = (shaft(1, rippling), between(&shaft(3, rippling), 0.0..20.0));
    let held_out = [shaft(2, rippling)];
    let size = |logs: &[Log]| {
        let found = refined(SHAFT, logs, &held_out, &[]);
        assert_eq!(ids(&found), ["cogging"]);
        let effect = &found.effects[0];
        let place = effect.effect.parameters().iter().position(|(name, _)| name == "sin_1_nm").unwrap();
        (effect.effect.parameters()[place].1, effect.ci95[place].unwrap())
    };
    let (value, [low, high]) = size(&[a.clone(), b.clone()]);
    let (turned, _) = size(&[b.clone(), a.clone()]);
    let (copied, [copied_low, copied_high]) = size(&[a.clone(), b.clone(), a.clone()]);
    let (cut, _) = size(&[between(&a, 0.003..30.0), b]);
    assert!((turned - value).abs() < 1e-9);
    assert!((low..=high).contains(&cut), "{cut} outside {low} to {high}");
    assert!(copied == value && (copied_high - copied_low - (high - low)).abs() < 1e-12);
}

/// A sticky spot at one angle is friction that depends on the angle in all of its harmonics.
#[test]
fn harmonics_of_one_cause_have_one_name() {
    let spot = |_: f64, q: f64, v: f64| {
        let off = (q + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        0.03 * (-(off / 0.12).powi(2)).exp() * (v / 0.02).tanh()
    };
    let found = refined(SHAFT, &[shaft(1, spot)], &[shaft(2, spot)], &[]);
    assert!(ids(&found).iter().all(|id| *id == "position_dependent_friction"), "{:?}", ids(&found));
    assert_ne!(found.verdict, Verdict::ModelAdequate);
}

/// What the model says of the time between command and torque is no delay once more.
#[test]
fn a_declared_delay_counts_once() {
    let model = crate::model_file::presets::paper();
    let go_on = &mut |_| ControlFlow::Continue(());
    let experiment =
        Experiment { seconds: 60.0, ..Experiment::new(Scenario::Multisine, ControllerChoice::Pi) };
    let log = simulate::run(&experiment, &model, &model, go_on).unwrap().log(Motor::Left);
    let found = refine(&model, &[log], &[], &Options::default(), go_on).unwrap();
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::ModelAdequate, 0), "{:?}", ids(&found));
}

/// The refined model, written and read again, has the error that was told.
#[test]
fn the_refined_model_has_the_error_after() {
    let more = |_: f64, q: f64, v: f64| 0.006 * (9.0 * q).cos() + 0.012 * v.signum();
    let held_out = [shaft(2, more)];
    let found = refined(SHAFT, &[shaft(1, more)], &held_out, &[]);
    assert_eq!(found.effects.len(), 2, "{:?}", ids(&found));
    let again = Model::from_toml(&found.model.to_toml(), "new.toml").unwrap();
    let quiet = &mut |_| ControlFlow::Continue(());
    let told = residual(&again, &held_out, &Options::default(), quiet).unwrap();
    let ratio = told.errors.rmse.main() / found.after.rmse.main();
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

/// A spring that no effect of a shaft is: never a wrong name.
#[test]
fn what_the_library_lacks_has_no_name() {
    let found = refined(SHAFT, &[shaft(1, |_, q, _| 0.004 * q)], &[shaft(2, |_, q, _| 0.004 * q)], &[]);
    assert_eq!((found.verdict, ids(&found)), (Verdict::UnexplainedResidual, vec![]));
    assert_eq!(found.unexplained.depends_on[0], "motor_angle_rad");
}

#[test]
fn logs_that_cannot_answer_are_told_before_any_effect() {
    let log = shaft(1, |_, q, _| 0.006 * (14.0 * q).sin());
    let with = |name: &str, change: &dyn Fn(usize, f64) -> f64| {
        let columns = log.columns.iter().map(|column| {
            let values = column.values.iter().enumerate();
            let changed =
                values.map(|(row, &value)| if column.name == name { change(row, value) } else { value });
            (column.name.clone(), changed.collect())
        });
        Log::from_columns("bad.csv", columns)
    };
    let every = |step: usize| {
        let columns = log
            .columns
            .iter()
            .map(|column| (column.name.clone(), column.values.iter().copied().step_by(step).collect()));
        Log::from_columns("thin.csv", columns)
    };
    let first = |rows: usize| {
        let columns = log.columns.iter().map(|column| (column.name.clone(), column.values[..rows].to_vec()));
        Log::from_columns("short.csv", columns)
    };
    for (what, bad, column, told) in [
        ("wrong sign", with("torque_nm", &|_, v| -v), "torque_nm", "sign"),
        ("milli", with("torque_nm", &|_, v| 1000.0 * v), "torque_nm", "times what the declared model wants"),
        ("dead", with("motor_angle_rad", &|_, _| 1.0), "motor_angle_rad", "does not change"),
        (
            "dead half",
            with("motor_angle_rad", &|row, v| if row < 15_000 { v } else { 1.0 }),
            "motor_angle_rad",
            "the sensor is dead",
        ),
        ("dead torque", with("torque_nm", &|_, _| 0.01), "torque_nm", "does not change"),
        (
            "torque dies",
            with("torque_nm", &|row, v| if row < 15_000 { v } else { 0.0 }),
            "torque_nm",
            "the sensor is dead",
        ),
        ("clipped", with("torque_nm", &|_, v| v.clamp(-0.03, 0.03)), "torque_nm", "cut off"),
        ("seldom clipped", with("torque_nm", &|_, v| v.clamp(-0.045, 0.045)), "torque_nm", "cut off"),
        ("slow", every(30), "time_s", "too few"),
        ("short", first(600), "motor_angle_rad", "are needed"),
        (
            "at rest",
            with("motor_angle_rad", &|row, _| 1e-4 * f64::from(u8::from(row % 7 == 0))),
            "motor_angle_rad",
            "",
        ),
    ] {
        for (model, bad, column) in [
            (SHAFT, bad.clone(), column),
            (RAIL, on_rail(&bad), RAIL_NAMES.iter().find(|(name, _)| *name == column).unwrap().1),
        ] {
            let found = refined(model, std::slice::from_ref(&bad), &[], &[]);
            assert_eq!((found.verdict, ids(&found)), (Verdict::DataUnfit, vec![]), "{what}");
            let mends = found.data_health.iter().map(|finding| finding.remedy.as_str());
            assert!(mends.clone().all(|mend| !mend.contains("inf") && !mend.contains("NaN")), "{what}");
            let model = Model::from_toml(model, "model.toml").unwrap();
            let watch = &mut |_| ControlFlow::Continue(());
            let far = residual(&model, &[bad], &Options::default(), watch).unwrap();
            let is_finite = |channels: &Channels| channels.0.iter().all(|(_, value)| value.value.is_finite());
            assert!(is_finite(&far.errors.nrmse) && is_finite(&far.errors.rmse), "{what}: {:?}", far.errors);
            let mut errors = found.data_health.iter().filter(|finding| finding.severity == Severity::Error);
            assert!(
                errors.any(|finding| finding.column == column && finding.problem.contains(told)),
                "{what}: {:#?}",
                found.data_health
            );
        }
    }
}

/// A position in another unit makes the inertia look as many times larger or smaller, and is no effect.
#[test]
fn a_position_in_another_unit_is_told_and_no_effect_is() {
    let log = shaft(1, |_, q, _| 0.006 * (14.0 * q).sin());
    let scaled = |log: &Log, name: &str, factor: f64| {
        let columns = log.columns.iter().filter(|column| !column.name.contains("speed")).map(|column| {
            let factor = if column.name == name { factor } else { 1.0 };
            (column.name.clone(), column.values.iter().map(|value| factor * value).collect())
        });
        Log::from_columns("unit.csv", columns)
    };
    let rail = on_rail(&log);
    for (model, log, name, factor, told) in [
        (SHAFT, &log, "motor_angle_rad", 360.0 / TAU, "in degrees"),
        (SHAFT, &log, "motor_angle_rad", 1.0 / TAU, "in turns"),
        (RAIL, &rail, "position_m", 1000.0, "in millimetres"),
    ] {
        let found = refined(model, &[scaled(log, name, factor)], &[], &[]);
        assert_eq!(
            (found.verdict, ids(&found)),
            (Verdict::DataUnfit, vec![]),
            "{told}: {:#?}",
            found.data_health
        );
        let is_told = |finding: &&HealthFinding| finding.column == name && finding.problem.contains(told);
        let unit = found.data_health.iter().find(is_told).unwrap();
        assert!(
            unit.remedy.ends_with(&format!("--map {name}={name}*{:.6}", 1.0 / factor)),
            "{}",
            unit.remedy
        );
        assert_ne!(refined(model, &[scaled(log, name, 1.0)], &[], &[]).verdict, Verdict::DataUnfit, "{told}");
    }
}

/// At one speed nothing but noise accelerates a shaft, which looks like an error of its inertia or of the torque's way.
#[test]
fn even_motion_tells_of_cogging_and_not_of_the_inertia() {
    let model = Model::from_toml(SHAFT, "shaft.toml").unwrap();
    let cogging = "[[effects]]\nid = \"cogging\"\norder_1 = 14.0\ncos_1_nm = 0.006\nsin_1_nm = 0.004\n";
    let robot = Model::from_toml(&format!("{SHAFT}{cogging}"), "shaft.toml").unwrap();
    for target_speed_rad_s in [2.0, 5.0] {
        let run = Experiment::new(Scenario::SpeedTracking, ControllerChoice::Pi);
        let run = Experiment { seconds: 20.0, target_speed_rad_s, ..run };
        let outcome = simulate::run(&run, &model, &robot, &mut |_| ControlFlow::Continue(())).unwrap();
        let found = refined(SHAFT, &[outcome.log(Motor::Left)], &[], &[]);
        assert_eq!(ids(&found), ["cogging"], "{target_speed_rad_s}");
        assert_eq!(found.effects[0].effect.get("order_1"), Some(14.0));
        assert!(found.data_health.iter().any(|finding| finding.problem.contains("motion is so even")));
    }
}

/// Held-out logs steer the answer too.
/// A log of another kind is refused, on either side, also where the model describes both.
#[test]
fn held_out_logs_are_of_the_kind_of_the_others() {
    let model = crate::model_file::presets::paper();
    let log = |columns: &[&str]| {
        let values: Vec<f64> = (0..200).map(|row| f64::from(row) * 0.01).collect();
        Log::from_columns("a.csv", columns.iter().map(|name| (*name, values.clone())))
    };
    let (bench, robot) = (log(LogKind::Bench.required()), log(LogKind::Robot.required()));
    for (one, other) in [(&bench, &robot), (&robot, &bench)] {
        let found = refine(
            &model,
            std::slice::from_ref(one),
            &[one.clone(), other.clone()],
            &Options::default(),
            &mut |_| ControlFlow::Continue(()),
        );
        let error = found.err().unwrap();
        assert!(error.to_string().contains("refine with them separately"), "{error}");
    }
}

#[test]
fn held_out_logs_are_checked_and_have_the_rate_of_the_others() {
    let (log, other) = (shaft(1, |_, _, _| 0.0), shaft(2, |_, _, _| 0.0));
    let columns = |change: &dyn Fn(&str, &[f64]) -> Vec<f64>| {
        let changed = other.columns.iter().map(|column| {
            let name: &str = &column.name;
            (column.name.clone(), change(name, &column.values))
        });
        Log::from_columns("other.csv", changed)
    };
    let dead = columns(&|name, values| match name {
        "motor_angle_rad" => vec![1.0; values.len()],
        _ => values.to_vec(),
    });
    let half = columns(&|_, values| values.iter().copied().step_by(2).collect());
    let errors = |found: Refinement| -> Vec<(String, String)> {
        assert_eq!((found.verdict, found.effects.len()), (Verdict::DataUnfit, 0));
        let errors = found.data_health.into_iter().filter(|finding| finding.severity == Severity::Error);
        errors.map(|finding| (finding.column, finding.problem + ": " + &finding.remedy)).collect()
    };
    let found = errors(refined(SHAFT, std::slice::from_ref(&log), &[dead], &[]));
    assert_eq!(found[0].0, "motor_angle_rad", "{found:?}");
    for (logs, held_out) in [(vec![log.clone()], vec![half.clone()]), (vec![log, half], vec![])] {
        let [(column, told)] = errors(refined(SHAFT, &logs, &held_out, &[])).try_into().unwrap();
        let parts = ["other.csv has 500.0 Hz", "made.csv has 1000.0", "resample every log to 500.0"];
        assert!(column == "time_s" && parts.iter().all(|part| told.contains(part)), "{told}");
    }
}

#[test]
fn the_same_log_gives_the_same_bytes() {
    let told = || {
        let found = refined(SHAFT, &[shaft(3, |_, q, _| 0.004 * (5.0 * q).sin())], &[], &[]);
        serde_json::to_string(&found).unwrap() + &found.document.to_html() + &found.model.to_toml()
    };
    assert_eq!(told(), told());
}

const BENCH: &str = "name = \"R0\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.005\n[friction]\n\
                     coulomb_nm = 0.0338\nstatic_nm = 0.0761\nviscous_nm_s_rad = 0.00049\n\
                     stribeck_speed_rad_s = 1.612\nstribeck_exponent = 0.231\noffset_nm = -0.0016\n";

#[test]
fn undeclared_cogging_of_a_bench_log_is_found() {
    let logs =
        ["log", "heldout"].map(|part| shared_log(&format!("undeclared/example-bench/{part}.csv"), &[]));
    let [Some(log), Some(held_out)] = logs else { return };
    let found = refined(BENCH, &[log], &[held_out], &[]);
    assert_eq!(ids(&found), ["cogging"]);
    let value = |key: &str| found.effects[0].effect.get(key).unwrap();
    assert_eq!(value("order_1"), 14.0);
    let size = value("cos_1_nm").hypot(value("sin_1_nm"));
    assert!((size / 0.009 - 1.0).abs() < 0.1, "{size}");
}

const LAAS: [&str; 3] = ["torque_nm=current_a", "motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s"];
const SMALL: &str = "name = \"small\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.0002\n[friction]\n\
                     coulomb_nm = 0.08\nviscous_nm_s_rad = 0.0002\n";
const FREE: [&str; 4] = ["inertia_kg_m2", "viscous_nm_s_rad", "coulomb_nm", "offset_nm"];

/// Whatever the model file says of the inertia, which nobody measured.
#[test]
fn cogging_of_a_measured_motor_is_found_at_its_order() {
    let Some(log) = shared_log("laas_bldc/speed_test1.csv", &LAAS) else { return };
    for inertia in ["0.0002", "4e-6", "0.01"] {
        let found = refined(&SMALL.replacen("0.0002", inertia, 1), std::slice::from_ref(&log), &[], &FREE);
        assert_eq!(ids(&found)[0], "cogging");
        assert_eq!(found.effects[0].effect.get("order_1"), Some(72.0));
        let drop = 1.0 - found.after.rmse.main() / found.before.rmse.main();
        assert!(drop > 0.55, "{inertia}: {drop}");
        // In one direction alone they are the same.
        let twin = &found.effects[0].ambiguous_with;
        assert!(twin.iter().any(|kind| kind.id == "position_dependent_friction"), "{twin:?}");
    }
}

/// The rows of a log at some times.
fn between(log: &Log, times_s: std::ops::Range<f64>) -> Log {
    let time = log.column("time_s").unwrap();
    let rows: Vec<usize> = (0..time.len()).filter(|&row| times_s.contains(&time[row])).collect();
    let column = |column: &crate::record::Column| {
        (column.name.clone(), rows.iter().map(|&row| column.values[row]).collect())
    };
    Log::from_columns(log.source.clone(), log.columns.iter().map(column))
}

fn error_of(model: &Model, log: &Log) -> f64 {
    let quiet = &mut |_| ControlFlow::Continue(());
    residual(model, std::slice::from_ref(log), &Options::default(), quiet).unwrap().errors.rmse.main()
}

/// A motor whose torque constant has waves of two orders, which have one period in common, a whole turn, recorded with an
/// encoder that counts from elsewhere.
fn rippled(seed: u64, zero_rad: f64) -> Log {
    let mut log = shaft(seed, |_, _, _| 0.0);
    let angles = log.column("motor_angle_rad").unwrap().to_vec();
    for column in &mut log.columns {
        for (value, q) in column.values.iter_mut().zip(&angles) {
            match &*column.name {
                // What acts is 1 + ripple times what is asked for.
                "torque_nm" => {
                    *value /= 1.0 + 0.12 * (9.0 * q).cos() - 0.16 * (9.0 * q).sin() + 0.1 * (7.0 * q).cos()
                }
                "motor_angle_rad" => *value += zero_rad,
                _ => {}
            }
        }
    }
    log
}

/// The zero is found within half a step of those that are tried, 24 in a period of the finest wave, and the error with it
/// is that of the first record.
#[test]
fn another_zero_of_the_encoder_is_found_and_the_ripple_carries_over() {
    const RIPPLE: &str = "[[effects]]\nid = \"torque_ripple\"\norder_1 = 9.0\ncos_1 = 0.12\nsin_1 = -0.16\n\
                          order_2 = 7.0\ncos_2 = 0.1\nsin_2 = 0.0\n";
    let text = SHAFT.to_owned() + RIPPLE;
    let model = Model::from_toml(&text, "shaft.toml").unwrap();
    let first = rippled(1, 0.0);
    let before = error_of(&model, &first);
    for zero_rad in [0.4, 2.0, 5.5] {
        let again = rippled(2, zero_rad);
        let found = refined(&text, &[first.clone(), again.clone()], &[], &[]);
        let [ripple] = &found.transfer[..] else { panic!("{:?}", found.transfer) };
        let [own, other] = ripple.encoder_offsets_rad[..] else { panic!("{ripple:?}") };
        assert_eq!(own, 0.0);
        assert!(
            (other - (TAU - zero_rad)).abs() < 0.5 * TAU / (9.0 * 24.0),
            "{other} for {}",
            TAU - zero_rad
        );
        assert!(ripple.error_drop_ci95.is_some_and(|[low, _]| low > 25.0), "{ripple:?}");
        assert_eq!(found.verdict, Verdict::ModelAdequate, "{:?}", ids(&found));
        let after = error_of(&model, &again);
        assert!((0.9..1.1).contains(&(after / before)), "{after} for {before}");
    }
}

/// The first half of the record of a motor, refined, serves the second, though a function of the driver was switched
/// between them.
#[test]
fn a_refined_motor_carries_over_to_another_record() {
    let Some(log) = shared_log("laas_bldc/speed_test1.csv", &LAAS) else { return };
    let (first, second) = (between(&log, 0.0..15.0), between(&log, 15.0..31.0));
    let found = refined(SMALL, &[first], &[], &FREE);
    assert_eq!(found.effects[0].effect.get("order_1"), Some(72.0), "{:?}", ids(&found));
    let declared = Model::from_toml(SMALL, "small.toml").unwrap();
    let drop = 1.0 - error_of(&found.model, &second) / error_of(&declared, &second);
    assert!(drop > 0.55, "{drop}");
}

/// Another record of that motor, at fifteen times the speed and with its encoder in relative mode: near its reversals,
/// where the waves are within the filter, the effect carries over, with its declared numbers estimated anew; elsewhere it
/// does no harm. What friction became at low speed does not reach that far, and that is said.
#[test]
fn an_effect_of_a_measured_motor_carries_over_to_a_record_at_other_speeds() {
    let logs = ["speed_test1", "acc_current", "rolling_data1"];
    let logs = logs.map(|name| shared_log(&format!("laas_bldc/{name}.csv"), &LAAS));
    let [Some(slow), Some(fast), Some(rolling)] = logs else { return };
    let model = refined(SMALL, &[slow], &[], &FREE).model;
    let text = model.to_toml();
    let options =
        Options { speeds: Some([0.0, 12.0]), estimate: vec!["all".to_owned()], ..Options::default() };
    let quiet = &mut |_| ControlFlow::Continue(());
    let near = refine(&model, std::slice::from_ref(&fast), &[], &options, quiet).unwrap();
    assert_eq!(near.transfer[0].id, "cogging");
    assert!(near.transfer[0].error_drop_percent > 55.0, "{:?}", near.transfer);
    let warned = |found: &[crate::record::HealthFinding], words: &str| {
        found.iter().any(|finding| finding.severity == Severity::Warning && finding.problem.contains(words))
    };
    assert!(warned(&near.data_health, "counts from elsewhere"), "{:#?}", near.data_health);
    let all = refined(&text, std::slice::from_ref(&fast), std::slice::from_ref(&rolling), &["all"]);
    assert!(all.transfer[0].error_drop_percent > -2.0, "{:?}", all.transfer);
    for log in [fast, rolling] {
        let told = residual(&model, &[log], &Options::default(), quiet).unwrap();
        assert!(warned(&told.data_health, "friction of the model was told from"), "{:#?}", told.data_health);
    }
}

#[test]
fn a_fast_measured_motor_gets_no_effect() {
    let Some(log) = shared_log("laas_bldc/acc_current.csv", &LAAS) else { return };
    let found = refined(SMALL, &[log], &[], &FREE);
    assert!(found.effects.is_empty(), "{:?}", ids(&found));
    let lag = |finding: &crate::record::HealthFinding| finding.problem.contains("ms later than");
    assert!(found.data_health.iter().any(lag), "{:#?}", found.data_health);
}

#[test]
fn the_published_positioning_axis_lacks_effects() {
    let Some(log) = shared_log("emps/emps_standard.csv", &[]) else { return };
    let model = "name = \"EMPS\"\n[axis]\nkind = \"linear\"\nmass_kg = 95.1089\n[friction]\ncoulomb_n = 20.3935\n\
                 viscous_n_s_m = 203.5034\noffset_n = -3.1648\n";
    let found = refined(model, &[log], &[], &["all"]);
    let (before, after) = (found.before.nrmse.main(), found.after.nrmse.main());
    assert!((0.038..0.047).contains(&before), "{before}");
    assert!(after <= 0.026, "{after}: {:?}", ids(&found));
    assert_eq!(ids(&found)[..2], ["viscous_asymmetry", "low_speed_friction"]);
    // Each is sure on rows that took no part in the estimates.
    for effect in &found.effects {
        let [low, high] = effect.error_drop_ci95.unwrap();
        assert!(0.0 < low && low < effect.error_drop_percent && effect.error_drop_percent < high);
    }
}

/// Without a weight the torque says little of its unit, and the speed says that a gear is between.
#[test]
fn a_gear_is_told_of_an_arm_without_a_weight_too() {
    let map = ["motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s"];
    let model = "name = \"pendulum\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.01158\ngravity_torque_nm = 0.05739\n\
                 [friction]\ncoulomb_nm = 0.09\nviscous_nm_s_rad = 0.047\n";
    let Some(log) = shared_log("go1_pendulum/go1_m0kg_sin_sin.csv", &map) else { return };
    for estimate in [&[][..], &["all"]] {
        let found = refined(model, std::slice::from_ref(&log), &[], estimate);
        assert_eq!((found.verdict, ids(&found)), (Verdict::DataUnfit, vec![]));
        let told = found.data_health.iter().any(|finding| {
            finding.severity == Severity::Error
                && finding.column == "torque_nm"
                && finding.problem.contains("gear")
        });
        assert!(told, "{:#?}", found.data_health);
    }
}

#[test]
fn a_geared_torque_is_told_before_any_effect() {
    let map = ["motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s"];
    let mended =
        ["motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s*6.33", "torque_nm=torque_nm*6.33"];
    let model = "name = \"pendulum\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.034\ngravity_torque_nm = 1.529\n\
                 [friction]\ncoulomb_nm = 0.0914\nviscous_nm_s_rad = 0.047\n";
    let path = |name: &str| format!("go1_pendulum/go1_m1kg_{name}.csv");
    let Some(raw) = shared_log(&path("sin_sin"), &map) else { return };
    let found = refined(model, &[raw], &[], &[]);
    assert_eq!(found.verdict, Verdict::DataUnfit);
    assert!(found.data_health[0].problem.contains("a gear lies between"), "{:#?}", found.data_health);
    let logs: Vec<Log> = ["sin_sin", "lift_and_drop", "sin_time_square"]
        .iter()
        .filter_map(|name| shared_log(&path(name), &mended))
        .collect();
    let held_out: Vec<Log> = shared_log(&path("up_and_down"), &mended).into_iter().collect();
    let found = refined(model, &logs, &held_out, &["all"]);
    assert_ne!(found.verdict, Verdict::DataUnfit, "{:#?}", found.data_health);
    assert!(found.after.nrmse.main() < 0.1, "{}", found.after.nrmse.main());
}

/// One path after another left out, for each weight: mended, every log answers, and no effect raises the error.
#[test]
fn a_measured_pendulum_tells_each_path_from_the_others() {
    let map = ["motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s*6.33", "torque_nm=torque_nm*6.33"];
    let paths = ["sin_sin", "lift_and_drop", "up_and_down", "sin_time_square"];
    for (mass, most) in [(0.0, 0.7), (1.0, 0.25), (3.0, 0.25)] {
        let (inertia, gravity) = (0.0225 * mass + 0.01153, 1.4715 * (mass + 0.039));
        let model = format!(
            "name = \"pendulum\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = {inertia}\n\
             gravity_torque_nm = {gravity}\n[friction]\ncoulomb_nm = 0.0914\nviscous_nm_s_rad = 0.047\n"
        );
        for out in paths {
            let read = |path: &str| shared_log(&format!("go1_pendulum/go1_m{mass:.0}kg_{path}.csv"), &map);
            let Some(held_out) = read(out) else { return };
            let logs: Vec<Log> =
                paths.iter().filter(|path| **path != out).filter_map(|path| read(path)).collect();
            let found = refined(&model, &logs, &[held_out], &["all"]);
            assert_ne!(found.verdict, Verdict::DataUnfit, "{mass} {out}: {:#?}", found.data_health);
            let [before, after] = [&found.before, &found.after].map(|errors| errors.nrmse.main());
            assert!(after <= before && after < most, "{mass} {out}: {before} {after}");
        }
    }
}
