use std::f64::consts::PI;

use super::*;
use crate::shared::shared_log;

/// A bench log without faults: a swept shaft with an encoder of 16 bits and noise in the torque.
fn bench() -> Log {
    let time: Vec<f64> = (0..4000).map(|row| f64::from(row) * 1e-3).collect();
    let quantum = 2.0 * PI / 65536.0;
    let angle = |t: f64| 6.0 * (2.0 * t).sin() + 2.0 * (7.0 * t).cos();
    let speed = |t: f64| 12.0 * (2.0 * t).cos() - 14.0 * (7.0 * t).sin();
    let noise = |t: f64| 0.01 * (1e5 * t * t).sin();
    Log::from_columns(
        "made.csv",
        [
            ("motor_angle_rad", time.iter().map(|&t| (angle(t) / quantum).round() * quantum).collect()),
            ("motor_speed_rad_s", time.iter().map(|&t| speed(t) + 5.0 * noise(t)).collect()),
            ("torque_nm", time.iter().map(|&t| 0.1 * (3.0 * t).sin() + noise(t)).collect()),
            ("time_s", time),
        ],
    )
}

/// The log with one column changed.
fn with(log: &Log, name: &str, change: impl Fn(usize, f64) -> f64) -> Log {
    let mut log = log.clone();
    let column = log.columns.iter_mut().find(|column| column.name == name).unwrap();
    column.values.iter_mut().enumerate().for_each(|(row, value)| *value = change(row, *value));
    log
}

#[test]
fn a_log_without_faults_has_infos_only() {
    let findings = data_health(&bench());
    assert!(findings.iter().all(|finding| finding.severity == Severity::Info), "{findings:#?}");
    assert!(findings.iter().any(|f| f.problem == "1000 rows a second over 3.999 s"), "{findings:#?}");
}

#[test]
fn each_fault_is_named_with_its_column_and_mend() {
    use Severity::{Error, Info, Warning};
    let bench = bench();
    for (log, severity, column, problem, remedy) in [
        (with(&bench, "time_s", |_, t| 1000.0 * t), Warning, "time_s", "in milliseconds", "time_s*0.001"),
        (with(&bench, "time_s", |_, t| 30.0 * t), Warning, "time_s", "too slow to resolve", "50 Hz"),
        (with(&bench, "time_s", |_, t| t / 20.0), Warning, "time_s", "20000 Hz is faster", "unit of"),
        (
            with(&bench, "time_s", |row, t| t - 0.01 * f64::from(row == 50)),
            Error,
            "time_s",
            "in 1 row",
            "sort",
        ),
        (
            with(&bench, "time_s", |row, t| t + 0.2 * f64::from(row > 9)),
            Warning,
            "time_s",
            "longest of 0.201 s at 0.009 s",
            "split",
        ),
        (
            with(&bench, "time_s", |row, t| t + 4e-4 * (row % 2) as f64),
            Warning,
            "time_s",
            "jitter: the time between rows is 60 % to 140 %",
            "stamp",
        ),
        (
            with(&bench, "motor_speed_rad_s", |_, w| w * 180.0 / PI),
            Warning,
            "motor_speed_rad_s",
            "like degrees per second",
            "motor_speed_rad_s*0.01745",
        ),
        (
            with(&bench, "motor_speed_rad_s", |_, w| w * 30.0 / PI),
            Warning,
            "motor_speed_rad_s",
            "revolutions per minute",
            "*0.1047",
        ),
        (
            with(&bench, "motor_angle_rad", |_, q| q * 180.0 / PI),
            Warning,
            "motor_speed_rad_s",
            "the position in degrees",
            "if so, read it with --map motor_angle_rad=motor_angle_rad*0.0174533",
        ),
        (
            with(&bench, "motor_speed_rad_s", |_, w| -w),
            Warning,
            "motor_speed_rad_s",
            "the opposite sign",
            "*-1.00",
        ),
        (
            with(&bench, "motor_speed_rad_s", |_, w| w / 6.33),
            Warning,
            "motor_speed_rad_s",
            "revolutions per second",
            "*6.3",
        ),
        (
            with(&bench, "motor_speed_rad_s", |_, w| w * 3.0),
            Warning,
            "motor_speed_rad_s",
            "gear ratio",
            "*0.33",
        ),
        (
            with(&bench, "torque_nm", |_, t| (t * 1000.0).round()),
            Warning,
            "torque_nm",
            "is an integer",
            "FACTOR in N m",
        ),
        (
            with(&bench, "torque_nm", |_, t| t * 1500.0),
            Warning,
            "torque_nm",
            "milliamperes",
            "torque_nm*0.001",
        ),
        (
            with(&bench, "torque_nm", |_, t| t.clamp(-0.08, 0.08)),
            Warning,
            "torque_nm",
            "are at the limits -0.08 and 0.08",
            "less torque",
        ),
        (
            with(&bench, "torque_nm", |_, _| 0.0),
            Warning,
            "torque_nm",
            "the value is 0 throughout",
            "connected",
        ),
        (with(&bench, "torque_nm", |_, _| f64::NAN), Warning, "torque_nm", "no number", "record it again"),
        (
            with(&bench, "torque_nm", |row, t| if row == 7 { f64::NAN } else { t }),
            Info,
            "torque_nm",
            "1 of 4000 rows has no value",
            "",
        ),
        (
            with(&bench, "torque_nm", |_, t| (t * 50.0).round() / 50.0),
            Warning,
            "torque_nm",
            "the resolution is about 2.000e-2",
            "finer sensor",
        ),
        (
            with(&bench, "motor_angle_rad", |_, q| q.rem_euclid(2.0 * PI)),
            Warning,
            "motor_angle_rad",
            "by a whole turn",
            "unwrapped angle",
        ),
        (
            with(&bench, "motor_angle_rad", |row, _| row as f64 * 0.01),
            Info,
            "motor_angle_rad",
            "one direction only",
            "",
        ),
    ] {
        let findings = data_health(&log);
        let fits = |f: &&HealthFinding| {
            (f.severity, f.column.as_str()) == (severity, column)
                && f.problem.contains(problem)
                && f.remedy.contains(remedy)
        };
        assert!(findings.iter().any(|f| fits(&f)), "{problem}: {findings:#?}");
        let worse = findings.iter().filter(|f| f.severity > severity).count();
        assert_eq!(worse, 0, "{problem}: {findings:#?}");
    }
}

#[test]
fn the_map_of_a_unit_goes_to_the_column_that_is_off() {
    let unit = |position: f64, speed: f64| {
        let log = with(&bench(), "motor_angle_rad", |_, q| q * position);
        let log = with(&log, "motor_speed_rad_s", |_, w| w * speed);
        let findings = data_health(&log);
        let warnings = findings.iter().filter(|f| f.severity > Severity::Info);
        warnings.map(|f| (f.problem.clone(), f.remedy.clone())).collect::<Vec<_>>()
    };
    let (degrees, rpm) = (180.0 / PI, 30.0 / PI);
    let [(_, remedy)] = &unit(degrees, 1.0)[..] else { panic!("one finding") };
    assert_eq!(remedy, "if so, read it with --map motor_angle_rad=motor_angle_rad*0.0174533");
    let [(_, remedy)] = &unit(1.0, degrees)[..] else { panic!("one finding") };
    assert_eq!(remedy, "if so, read it with --map motor_speed_rad_s=motor_speed_rad_s*0.0174533");
    let [(problem, remedy)] = &unit(degrees, rpm)[..] else { panic!("one finding") };
    assert!(problem.contains("revolutions per minute against a position in degrees or a gear"), "{problem}");
    let both =
        "--map motor_angle_rad=motor_angle_rad*0.0174533 --map motor_speed_rad_s=motor_speed_rad_s*0.1047198";
    assert!(remedy.contains(both), "{remedy}");
    let [(problem, remedy)] = &unit(1.0 / (2.0 * PI), rpm)[..] else { panic!("one finding") };
    assert!(problem.contains("against a position in revolutions"), "{problem}");
    assert!(remedy.contains("motor_angle_rad*6.2831853 --map motor_speed_rad_s=motor_speed_rad_s*0.1047198"));
    let [(_, remedy)] = &unit(1.0, 3.0)[..] else { panic!("one finding") };
    assert!(
        remedy.contains("if the position is right, --map motor_speed_rad_s=motor_speed_rad_s*0.33"),
        "{remedy}"
    );
    let other = "; if the speed is right, --map motor_angle_rad=motor_angle_rad*";
    let factor: f64 = remedy.split(other).nth(1).unwrap().parse().unwrap();
    assert!((factor - 3.0).abs() < 0.05, "{remedy}");
}

/// A time in another unit is told once, and a speed that is off besides keeps its own finding.
#[test]
fn a_time_in_another_unit_is_no_fault_of_the_speed() {
    for (unit, factor) in [(1e3, "0.001"), (1e6, "0.000001"), (1e9, "0.000000001")] {
        let log = with(&bench(), "time_s", |_, t| t * unit);
        let findings = data_health(&log);
        let warnings: Vec<&HealthFinding> = findings.iter().filter(|f| f.severity > Severity::Info).collect();
        let remedy = format!("--map time_s=time_s*{factor}");
        assert!(
            matches!(warnings[..], [time] if time.column == "time_s" && time.remedy.ends_with(&remedy)),
            "{warnings:#?}"
        );
        let findings = data_health(&with(&log, "motor_speed_rad_s", |_, w| w * 180.0 / PI));
        assert!(findings.iter().any(|f| f.problem.contains("degrees per second")), "{findings:#?}");
    }
}

/// A recorder that pauses while the motor goes on: the speed is not to blame.
#[test]
fn a_gap_in_time_is_no_fault_of_the_units() {
    let bench = bench();
    let mut paused = bench.clone();
    for column in &mut paused.columns {
        column.values.drain(1234..1934);
    }
    let findings = data_health(&paused);
    let warnings: Vec<&HealthFinding> = findings.iter().filter(|f| f.severity > Severity::Info).collect();
    assert!(matches!(warnings[..], [gap] if gap.problem.starts_with("gaps of more")), "{warnings:#?}");
}

/// One value that is off and comes back, by whole turns and by little more than the noise of the sensor.
#[test]
fn a_single_spike_in_position_is_found_with_its_time() {
    let bench = bench();
    for (row, size) in [(1, 2.0 * PI), (2000, 2.0 * PI), (2000, -0.01), (3998, 50.0)] {
        let log = with(&bench, "motor_angle_rad", |at, q| q + size * f64::from(at == row));
        let findings = data_health(&log);
        let warnings: Vec<&HealthFinding> = findings.iter().filter(|f| f.severity > Severity::Info).collect();
        let [spike] = warnings[..] else { panic!("{row} {size}: {warnings:#?}") };
        assert_eq!(spike.column, "motor_angle_rad");
        assert!(spike.problem.starts_with("one value differs by "), "{spike:?}");
        assert!(spike.problem.ends_with(&format!(", at {} s", row as f64 * 1e-3)), "{spike:?}");
        assert_eq!(spike.remedy, "remove the row");
    }
    let slow = with(&bench, "motor_angle_rad", |row, q| 0.1 * q + 2.0 * PI * f64::from(row == 700));
    assert!(data_health(&slow).iter().all(|f| !f.problem.contains("whole turn")));
    let two = with(&bench, "motor_angle_rad", |row, q| q + f64::from(row == 900 || row == 1900));
    let found = &data_health(&two)[0].problem;
    assert!(found.starts_with("2 single values") && found.ends_with("at 0.9 s"), "{found}");
    // A jump that stays, a rest with a flickering last digit and a hard stop are no spikes.
    for harmless in [
        with(&bench, "motor_angle_rad", |row, q| q + f64::from(row > 2000)),
        with(&bench, "motor_angle_rad", |row, q| if row > 500 { q } else { 1e-4 * f64::from(row % 97 == 5) }),
        with(&bench, "motor_angle_rad", |row, _| (row as f64 * 1e-3 - 2.0).abs()),
    ] {
        let findings = data_health(&harmless);
        assert!(findings.iter().all(|f| !f.problem.contains("the rows around")), "{findings:#?}");
    }
}

#[test]
fn columns_held_by_a_slower_sensor_are_told() {
    let bench = bench();
    let torque = bench.column("torque_nm").unwrap().to_vec();
    let held = with(&bench, "torque_nm", |row, _| torque[row / 10 * 10]);
    let findings = data_health(&held);
    let expected = "each value is held for 10 rows; the sensor updates at about 100 Hz";
    assert!(findings.iter().any(|f| f.column == "torque_nm" && f.problem == expected), "{findings:#?}");
}

#[test]
fn a_pitch_in_degrees_is_suspected() {
    let log = Log::from_columns(
        "r.csv",
        [("time_s", vec![0.0, 0.001, 0.002]), ("pitch_rad", vec![0.5, -12.0, 3.0])],
    );
    let findings = data_health(&log);
    let pitch = findings.iter().find(|f| f.severity == Severity::Warning && f.column == "pitch_rad").unwrap();
    assert_eq!(pitch.problem, "values up to 12.0000 look like degrees");
    assert_eq!(pitch.remedy, "if so, read it with --map pitch_rad=pitch_rad*0.0174533");
    // And the columns that a robot log needs besides are missing.
    assert_eq!(findings[0].severity, Severity::Error);
    assert!(findings[0].problem.starts_with("a robot log needs `x_m`, `x_dot_m_s`"), "{findings:#?}");
}

#[test]
fn pairs_of_friction_are_judged_without_a_clock() {
    let speeds: Vec<f64> = (-10..=10).filter(|&v| v != 0).map(f64::from).collect();
    let pairs = |sign: f64, speeds: &[f64]| {
        let torques = speeds.iter().map(|v| sign * (0.03 * v.signum() + 0.001 * v)).collect();
        Log::from_columns("p.csv", [("speed_rad_s", speeds.to_vec()), ("torque_nm", torques)])
    };
    assert_eq!(data_health(&pairs(1.0, &speeds)), []);
    assert!(data_health(&pairs(-1.0, &speeds))[0].remedy.contains("torque_nm=torque_nm*-1"));
    assert!(data_health(&pairs(1.0, &speeds[..5]))[0].problem.contains("5 pairs are too few"));
    assert!(data_health(&pairs(1.0, &speeds[10..]))[0].problem.contains("one sign only"));
}

#[test]
fn dropped_rows_are_never_silent() {
    let log = Log {
        dropped_rows: 1,
        problem_count: 2,
        problems: vec![crate::record::LineProblem {
            line: 7,
            column: "torque_nm".into(),
            problem: "bad".into(),
        }],
        ..bench()
    };
    let found = &data_health(&log)[0];
    assert_eq!(found.severity, Severity::Warning);
    assert_eq!(
        found.problem,
        "2 cells or rows could not be used and 1 of 4001 rows was skipped, the first at line 7, column \
         `torque_nm`: bad"
    );
}

#[test]
fn one_is_written_as_one() {
    let log = Log {
        dropped_rows: 1,
        problem_count: 1,
        problems: vec![crate::record::LineProblem { line: 7, column: String::new(), problem: "bad".into() }],
        ..with(&bench(), "time_s", |row, _| row as f64)
    };
    let findings = data_health(&log);
    let told = |text: &str| findings.iter().any(|f| f.problem.starts_with(text));
    assert!(told("1 cell or row could not be used and 1 of 4001 rows was skipped"), "{findings:#?}");
    assert!(told("1 row a second over 3999"), "{findings:#?}");
}

/// A value that the recorder wrote as NaN is told with its line, as text in its place is.
#[test]
fn missing_values_are_told_with_their_line() {
    use crate::record::{ColumnMap, ReadOptions, read_log};
    let row = |row: u32| {
        let cell = if row == 30 || row == 40 { "NaN" } else { "20" };
        format!("0.{row:03},0.{row},1,{cell}\n")
    };
    let header = "# made\ntime_s,motor_angle_rad,torque_nm,motor_temperature_c\n";
    for (last, expected) in [
        (36, "1 of 26 rows has no value, at line 23"),
        (60, "2 of 50 rows have no value, the first at line 23"),
    ] {
        let text = header.to_owned() + &(10..last).map(row).collect::<String>();
        let map = ColumnMap::default();
        let mut quiet = |_| std::ops::ControlFlow::Continue(());
        let log = read_log(text.as_bytes(), "run.csv", &ReadOptions::new(&map), &mut quiet).unwrap();
        let findings = data_health(&log);
        let found =
            findings.iter().find(|f| f.column == "motor_temperature_c" && f.problem.contains("no value"));
        assert_eq!(found.map(|f| f.problem.as_str()), Some(expected), "{findings:#?}");
    }
}

/// The findings of a shared log.
fn shared(name: &str, map: &[&str]) -> Option<Vec<HealthFinding>> {
    shared_log(name, map).map(|log| data_health(&log))
}

#[test]
fn simulated_logs_without_faults_have_infos_only() {
    for name in ["example-clean", "example-balance", "example-bench"] {
        for part in ["log", "heldout"] {
            let Some(findings) = shared(&format!("undeclared/{name}/{part}.csv"), &[]) else { return };
            assert!(findings.iter().all(|f| f.severity == Severity::Info), "{name}: {findings:#?}");
        }
    }
    let Some(findings) = shared("emps/emps_standard.csv", &[]) else { return };
    assert!(findings.iter().all(|f| f.severity == Severity::Info), "{findings:#?}");
}

/// One sample of a measured log is moved, and found at its line.
#[test]
fn a_spike_in_a_measured_log_is_found() {
    for (name, column, row, size) in [
        ("emps/emps_standard.csv", "position_m", 12_345, 0.05),
        ("undeclared/example-bench/log.csv", "motor_angle_rad", 9_876, 2.0 * PI),
    ] {
        let Some(log) = shared_log(name, &[]) else { return };
        let log = with(&log, column, |at, value| value + size * f64::from(at == row));
        let findings = data_health(&log);
        let warnings: Vec<&HealthFinding> = findings.iter().filter(|f| f.severity > Severity::Info).collect();
        let [spike] = warnings[..] else { panic!("{name}: {warnings:#?}") };
        assert_eq!(spike.column, column);
        assert!(spike.problem.ends_with(&format!("line {}", row + 2)), "{spike:?}");
    }
}

/// What is odd about the measured logs, as their descriptions tell.
#[test]
fn oddities_of_measured_logs_are_found() {
    let laas = ["motor_angle_rad=angle_rad", "motor_speed_rad_s=speed_rad_s", "torque_nm=current_a"];
    for (name, column, problem) in [
        ("laas_bldc/acc_current.csv", "time_s", "gaps of more than five rows"),
        ("laas_bldc/acc_current.csv", "time_s", "jitter: "),
        ("laas_bldc/rolling_data1.csv", "motor_angle_rad", "one direction only"),
        ("go1_pendulum/go1_m1kg_sin_sin.csv", "motor_speed_rad_s", "the speed is 0.15"),
    ] {
        let Some(findings) = shared(name, &laas[..if name.starts_with("go1") { 2 } else { 3 }]) else {
            return;
        };
        assert!(
            findings.iter().any(|f| f.column == column && f.problem.contains(problem)),
            "{name}: {findings:#?}"
        );
        // Rows stamped late in a fast motion are no spikes.
        assert!(findings.iter().all(|f| !f.problem.contains("rows around")), "{name}: {findings:#?}");
    }
}
