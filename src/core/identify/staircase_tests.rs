//! Staircases of speeds from a simulated bench: one shaft with Stribeck friction under a speed controller, Runge–Kutta
//! at a twentieth of a millisecond, recorded with quantised speed, noise and jitter.

use std::ops::ControlFlow;

use super::test_data::{Noise, RIGHT, even_pairs};
use super::*;
use crate::friction::Stribeck;
use crate::model::Motor;
use crate::record::{ColumnMap, Log, ReadOptions, read_log};
use crate::shared::shared_log;

const INERTIA: f64 = 0.005;
/// 1 deg/s.
const SPEED_STEP: f64 = 0.017_453_292_519_943_295;

/// How a bench records.
#[derive(Clone, Copy)]
struct Bench {
    sample_s: f64,
    /// Fraction of the sample time by which a stamp may be off.
    jitter: f64,
    ramp_rad_s2: f64,
    with_speed: bool,
    with_target: bool,
    torque_noise_nm: f64,
}

const BENCH: Bench = Bench {
    sample_s: 0.001,
    jitter: 0.0,
    ramp_rad_s2: 20.0,
    with_speed: true,
    with_target: false,
    torque_noise_nm: 0.01,
};

/// The target speed: each level is reached by a ramp and held.
fn target(levels: &[(f64, f64)], ramp: f64, time: f64) -> f64 {
    let (mut start, mut from) = (0.0, 0.0);
    for &(level, hold) in levels {
        let climb = (level - from).abs() / ramp;
        if time < start + climb {
            return from + (level - from) * (time - start) / climb;
        }
        if time < start + climb + hold {
            return level;
        }
        start += climb + hold;
        from = level;
    }
    from
}

fn acceleration(curve: &Stribeck, torque: f64, speed: f64) -> f64 {
    // Friction turns steeply but smoothly through zero, so that the integrator may pass it.
    let direction = (speed / 1e-3).tanh();
    let p = curve.parameters();
    let friction = curve.amplitude_nm(speed) * direction + p.viscous_nm_s_rad * speed + p.offset_nm;
    (torque - friction) / INERTIA
}

/// Runs the bench through the levels (speed rad/s, seconds).
fn record(levels: &[(f64, f64)], bench: Bench, seed: u64) -> Log {
    const DT: f64 = 5e-5;
    let curve = Stribeck::new(RIGHT).unwrap();
    let mut noise = Noise::new(seed);
    let mut from = 0.0;
    let mut duration = 0.0;
    for &(level, hold) in levels {
        duration += f64::abs(level - from) / bench.ramp_rad_s2 + hold;
        from = level;
    }
    let (mut angle, mut speed, mut integral) = (0.0f64, 0.0f64, 0.0f64);
    let mut columns = vec![Vec::new(); 5];
    let mut stamp = 0.0;
    let steps = (duration / DT) as usize;
    for n in 0..steps {
        let time = n as f64 * DT;
        let wanted = target(levels, bench.ramp_rad_s2, time);
        let error = wanted - speed;
        integral += 4.0 * error * DT;
        let torque = 0.2 * error + integral;
        if time >= stamp {
            let measured = speed + 0.5 * SPEED_STEP * noise.normal();
            columns[0].push(time);
            columns[1].push(angle);
            columns[2].push(torque + bench.torque_noise_nm * noise.normal());
            columns[3].push((measured / SPEED_STEP).round() * SPEED_STEP);
            columns[4].push(wanted);
            stamp = time + bench.sample_s * (1.0 + bench.jitter * (2.0 * noise.uniform() - 1.0));
        }
        let slope = |speed: f64| acceleration(&curve, torque, speed);
        let k1 = slope(speed);
        let k2 = slope(speed + 0.5 * DT * k1);
        let k3 = slope(speed + 0.5 * DT * k2);
        let k4 = slope(speed + DT * k3);
        angle += DT * speed + DT * DT / 6.0 * (k1 + k2 + k3);
        speed += DT / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    let names = ["time_s", "motor_angle_rad", "torque_nm", "motor_speed_rad_s", "target_speed_rad_s"];
    let kept = |name: &str| match name {
        "motor_speed_rad_s" => bench.with_speed,
        "target_speed_rad_s" => bench.with_target,
        _ => true,
    };
    Log::from_columns("bench.csv", names.into_iter().zip(columns).filter(|(name, _)| kept(name)))
}

/// Every level held for `hold` s gives eight pairs at that speed and on the curve, and nothing else does.
fn check(levels: &[(f64, f64)], bench: Bench, speed_tolerance: f64) -> PairSet {
    let set = pairs_from_log(&record(levels, bench, 1), Motor::Left).unwrap();
    let expected: Vec<f64> = levels
        .iter()
        .filter(|(level, hold)| *level != 0.0 && *hold >= 0.6)
        .map(|(level, _)| *level)
        .collect();
    let found: Vec<f64> = set.dwells.iter().map(|dwell| dwell.speed_rad_s).collect();
    assert_eq!(found.len(), expected.len(), "{found:.3?} for {expected:.3?}; {:?}", set.warnings);
    let curve = Stribeck::new(RIGHT).unwrap();
    for (k, pair) in set.pairs.iter().enumerate() {
        let level = expected[k / 8];
        assert!((pair.speed_rad_s - level).abs() < speed_tolerance, "{} for {level}", pair.speed_rad_s);
        // Eight segments of 40 ms or more average the torque noise; six standard errors.
        let samples = 0.08 * levels.iter().find(|(l, _)| *l == level).unwrap().1 / bench.sample_s;
        let allowed = 6.0 * bench.torque_noise_nm / samples.sqrt() + 1e-3;
        let torque = curve.torque_nm(pair.speed_rad_s);
        assert!((pair.torque_nm - torque).abs() < allowed, "{pair:?} for {torque}");
    }
    assert!(set.is_constant_speed(), "{}", set.constant_share);
    set
}

fn both_directions(speeds: &[f64], hold: f64) -> Vec<(f64, f64)> {
    speeds.iter().chain([0.0].iter()).copied().chain(speeds.iter().map(|q| -q)).map(|q| (q, hold)).collect()
}

#[test]
fn a_staircase_is_split_at_its_speeds_without_being_told_them() {
    let levels = both_directions(&[0.1, 0.3, 1.0, 3.0, 8.0, 20.0, 45.0], 1.5);
    let set = check(&levels, BENCH, 0.02);
    assert_eq!(set.pairs.len(), 14 * 8);
    assert_eq!(set.warnings, Vec::<String>::new());
}

#[test]
fn target_speed_angle_only_jitter_and_slow_sampling_give_the_same_split() {
    let levels = both_directions(&[0.3, 1.0, 3.0, 8.0, 20.0], 2.0);
    check(&levels, Bench { with_target: true, ..BENCH }, 0.02);
    check(&levels, Bench { with_speed: false, ..BENCH }, 0.02);
    check(&levels, Bench { jitter: 0.4, ..BENCH }, 0.02);
    check(&levels, Bench { sample_s: 0.01, jitter: 0.2, ..BENCH }, 0.02);
    check(&levels, Bench { sample_s: 0.02, ramp_rad_s2: 8.0, torque_noise_nm: 0.002, ..BENCH }, 0.02);
}

#[test]
fn uneven_dwells_and_a_speed_as_small_as_its_quantisation_are_found() {
    let levels = [(0.02, 4.0), (0.06, 2.0), (-0.03, 3.0), (2.0, 0.8), (2.2, 5.0), (-6.0, 1.0), (-5.6, 1.2)];
    check(&levels, BENCH, 0.01);
}

#[test]
fn a_short_dwell_is_left_out_and_its_time_is_named() {
    let levels = [(2.0, 2.0), (6.0, 0.35), (10.0, 2.0), (15.0, 2.0)];
    for with_target in [false, true] {
        let set = check(&levels, Bench { with_target, ..BENCH }, 0.02);
        assert_eq!(set.warnings.len(), 1, "{:?}", set.warnings);
        let text = &set.warnings[0];
        assert!(text.contains("too short"), "{text}");
        let start: f64 = text.split("from ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((2.25..2.5).contains(&start), "{text}");
    }
}

#[test]
fn a_gap_ends_a_dwell_and_rows_without_speed_are_left_out() {
    let log = record(&[(3.0, 4.0), (9.0, 2.0)], BENCH, 1);
    let cut = |name: &str| -> Vec<f64> {
        let values = log.column(name).unwrap();
        values[..1500].iter().chain(&values[2200..]).copied().collect()
    };
    let names = ["time_s", "motor_angle_rad", "torque_nm", "motor_speed_rad_s"];
    let mut columns: Vec<(&str, Vec<f64>)> = names.iter().map(|name| (*name, cut(name))).collect();
    columns[3].1[100..110].fill(f64::NAN);
    let set = pairs_from_log(&Log::from_columns("gap.csv", columns), Motor::Left).unwrap();
    let speeds: Vec<i64> = set.dwells.iter().map(|dwell| dwell.speed_rad_s.round() as i64).collect();
    assert_eq!(speeds, [3, 3, 9]);
    assert!(set.dwells[0].end_s < 1.51 && set.dwells[1].start_s > 2.19);
    assert!(set.pairs.iter().all(|pair| pair.speed_rad_s.is_finite() && pair.torque_nm.is_finite()));
}

/// A sine, a ramp and an unsteady walk are no constant speeds.
#[test]
fn other_motions_are_told_apart() {
    let log = |angle: &dyn Fn(f64) -> f64| {
        let time: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 0.001).collect();
        let angle: Vec<f64> = time.iter().map(|&t| angle(t)).collect();
        let torque = vec![0.1; time.len()];
        Log::from_columns("motion.csv", [("time_s", time), ("motor_angle_rad", angle), ("torque_nm", torque)])
    };
    let share = |log: Log| pairs_from_log(&log, Motor::Left).map_or(0.0, |set| set.constant_share);
    for period in [0.5, 2.0, 8.0] {
        let omega = std::f64::consts::TAU / period;
        let found = share(log(&|t| 5.0 * (omega * t).sin()));
        assert!(found < 0.4, "sine of {period} s: {found}");
    }
    assert!(share(log(&|t| 0.5 * t * t)) < 0.4);
    let multisine = |t: f64| (1..6).map(|k| (1.3 * f64::from(k * k) * t).sin() / f64::from(k)).sum::<f64>();
    assert!(share(log(&multisine)) < 0.4);
}

/// From the bench log to the parameters: the whole way of section 3.
#[test]
fn a_sweep_gives_back_the_curve() {
    let levels = both_directions(&[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0], 1.0);
    let log = record(&levels, BENCH, 2);
    let report =
        fit(&[log], None, Motor::Left, &FitOptions::default(), &mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(report.pairs.len(), 160);
    let [found, truth] = [report.stribeck().unwrap(), RIGHT].map(|p| Stribeck::new(p).unwrap());
    for speed in [-40.0, -3.0, -0.3, -0.05, 0.05, 0.1, 1.0, 15.0, 40.0] {
        let (found, truth) = (found.torque_nm(speed), truth.torque_nm(speed));
        assert!((found - truth).abs() < 0.0015, "at {speed} rad/s: {found} for {truth}");
    }
}

#[test]
fn logs_of_one_speed_each_are_merged_and_other_mixtures_are_refused() {
    let run = |logs: &[Log]| {
        fit(logs, None, Motor::Left, &FitOptions::default(), &mut |_| ControlFlow::Continue(()))
    };
    let one = |speed: f64| record(&[(speed, 2.0)], BENCH, 1);
    let error = run(&[one(5.0)]).unwrap_err().to_string();
    assert!(error.contains("are at one speed, 5.0") && error.contains("bench.csv"), "{error}");
    let logs: Vec<Log> = [-20.0, -5.0, -1.0, -0.2, 0.2, 1.0, 5.0, 20.0].map(one).into();
    assert_eq!(run(&logs).unwrap().pairs.len(), 64);
    assert_eq!(run(&[]).unwrap_err(), FitError::NoLogs);
}

/// Measured data: a real motor under a speed controller whose speed wanders by a tenth.
#[test]
fn a_measured_constant_speed_is_recognised() {
    let map = ["torque_nm=current_a", "motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s"];
    let Some(log) = shared_log("laas_bldc/speed_test1.csv", &map) else { return };
    let set = pairs_from_log(&log, Motor::Left).unwrap();
    let speeds: Vec<f64> = set.dwells.iter().map(|dwell| dwell.speed_rad_s).collect();
    assert!(set.is_constant_speed(), "{} {speeds:?} {:?}", set.constant_share, set.warnings);
    assert!(speeds.iter().all(|speed| (3.8..5.8).contains(speed)), "{speeds:?}");
}

/// Measured motions that are not constant speeds: a current sine, a positioning axis, a swinging pendulum.
#[test]
fn measured_motions_are_fitted_as_motions() {
    let bldc = ["torque_nm=current_a", "motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s"];
    for (name, map, key) in [
        ("laas_bldc/acc_current.csv", &bldc[..], "inertia_kg_m2"),
        ("undeclared/example-bench/log.csv", &[], "inertia_kg_m2"),
        ("emps/emps_standard.csv", &[], "mass_kg"),
    ] {
        let Some(log) = shared_log(name, map) else { return };
        let report =
            fit(&[log], None, Motor::Left, &FitOptions::default(), &mut |_| ControlFlow::Continue(()));
        let report = report.unwrap();
        assert!(
            report.parameters.contains_key(key) && report.pairs.is_empty(),
            "{name}: {:?}",
            report.parameters
        );
        assert!(report.stribeck().is_none());
    }
}

#[test]
fn naming_the_inertia_asks_for_a_fit_from_motion() {
    let options = FitOptions { estimate: vec!["inertia_kg_m2".to_owned()], ..FitOptions::default() };
    let log = record(&both_directions(&[1.0, 4.0, 9.0, 16.0], 0.6), BENCH, 1);
    let report = fit(&[log], None, Motor::Left, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let inertia = report.parameters["inertia_kg_m2"].value;
    assert!((inertia / INERTIA - 1.0).abs() < 0.05, "{inertia}");
    assert_eq!((report.iterations, report.history.len()), (0, 0));
}

#[test]
fn names_to_estimate_are_checked_for_constant_speeds() {
    let run = |names: &[&str]| {
        let estimate = names.iter().map(|name| (*name).to_owned()).collect();
        let options = FitOptions { estimate, ..FitOptions::default() };
        let pairs = even_pairs(&RIGHT, 40, 0.001, 1);
        let speeds = pairs.iter().map(|pair| pair.speed_rad_s).collect();
        let torques = pairs.iter().map(|pair| pair.torque_nm).collect();
        let log = Log::from_columns("pairs.csv", [("speed_rad_s", speeds), ("torque_nm", torques)]);
        fit(&[log], None, Motor::Left, &options, &mut |_| ControlFlow::Continue(()))
    };
    for name in ["nonsense", "inertia_kg_m2", ""] {
        let error = run(&["static_nm", name]).unwrap_err().to_string();
        let expected = format!("`{name}` cannot be estimated from constant speeds");
        assert!(error.starts_with(&expected) && error.contains("coulomb_nm, static_nm"), "{error}");
    }
    let six = &super::parameters::KEYS[..];
    for (names, partly) in [(&["all"][..], false), (&[], false), (six, false), (&["static_nm"], true)] {
        let text = run(names).unwrap().warnings.join("\n");
        assert_eq!(text.contains("`static_nm` was requested"), partly, "{names:?}: {text}");
    }
}

/// A staircase too short for pairs is fitted as a general motion and says why; a motion that is none does not.
#[test]
fn a_staircase_that_became_a_motion_says_why() {
    let levels: Vec<(f64, f64)> = both_directions(&[2.0, 6.0, 10.0, 15.0, 9.0, 4.0], 0.3);
    let run =
        |log: Log| fit(&[log], None, Motor::Left, &FitOptions::default(), &mut |_| ControlFlow::Continue(()));
    for with_target in [false, true] {
        let report = run(record(&levels, Bench { with_target, ramp_rad_s2: 60.0, ..BENCH }, 1)).unwrap();
        let text = report.warnings.join("\n");
        assert!(report.pairs.is_empty(), "{:?}", report.pairs);
        assert!(
            text.contains("fitted as a general motion instead: bench.csv: no segment")
                && text.contains("0.5 s"),
            "{text}"
        );
    }
    let time: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 0.001).collect();
    let angle = time.iter().map(|t| 5.0 * (7.0 * t).sin()).collect();
    let torque = time.iter().map(|t| -0.005 * 245.0 * (7.0 * t).sin() + 0.05 * (7.0 * t).cos().signum());
    let columns = [("torque_nm", torque.collect()), ("motor_angle_rad", angle), ("time_s", time)];
    let text = run(Log::from_columns("sine.csv", columns)).unwrap().warnings.join("\n");
    assert!(!text.contains("fitted as a general motion"), "{text}");
}

#[test]
fn a_model_of_another_axis_is_refused() {
    let text = "name = \"slide\"\n[axis]\nkind = \"linear\"\nmass_kg = 3.0\n";
    let model = crate::model::Model::from_toml(text, "slide.toml").unwrap();
    let log = record(&[(3.0, 1.0)], BENCH, 1);
    let result =
        fit(&[log], Some(&model), Motor::Left, &FitOptions::default(), &mut |_| ControlFlow::Continue(()));
    let error = result.unwrap_err().to_string();
    assert!(error.contains("bench.csv is a bench log") && error.contains("linear axis log"), "{error}");
}

#[test]
fn a_refusal_for_want_of_data_names_the_cells_that_could_not_be_read() {
    let pairs = "speed_rad_s,torque_nm\n1,0.1\n2,x\n3,0.3\n4,?\n5,0.5\nfast,0.6\n7,0.7\n8,0.8\n";
    let quiet = &mut |_| ControlFlow::Continue(());
    let map = ColumnMap::default();
    let log = read_log(pairs.as_bytes(), "pairs.csv", &ReadOptions::new(&map), quiet).unwrap();
    let refused = |logs: &[Log]| {
        let watch = &mut |_: &FitProgress| ControlFlow::Continue(());
        fit(logs, None, Motor::Left, &FitOptions::default(), watch).unwrap_err().to_string()
    };
    assert_eq!(
        refused(std::slice::from_ref(&log)),
        "the pairs of pairs.csv have 5 distinct speeds, but six parameters need at least 6: record more speeds; 3 cells or \
         rows of pairs.csv could not be read, `torque_nm` at lines 3, 5, `speed_rad_s` at line 7; correct them there, or \
         record the log again"
    );
    // What is wanting for another reason is said without them.
    let estimate = vec!["nonsense".to_owned()];
    let options = FitOptions { estimate, ..FitOptions::default() };
    let error = fit(&[log], None, Motor::Left, &options, &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(!error.to_string().contains("pairs.csv"), "{error}");
}
