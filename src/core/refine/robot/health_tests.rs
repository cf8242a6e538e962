//! A good log, altered in every way that people's logs are: told before any effect, and no effect to explain it.

use std::ops::ControlFlow;

use crate::model::Motor;
use crate::model_file::presets;
use crate::record::{HealthFinding, Log, Severity};
use crate::refine::{Options, Refinement, Verdict, refine};
use crate::simulate::{self, ControllerChoice, Experiment, Scenario};

fn driven(scenario: Scenario) -> Log {
    let experiment =
        Experiment { seconds: 12.0, seed: 3, ..Experiment::new(scenario, ControllerChoice::Flqr) };
    let model = presets::paper();
    simulate::run(&experiment, &model, &model, &mut |_| ControlFlow::Continue(())).unwrap().log(Motor::Left)
}

fn refined(log: Log) -> Refinement {
    refine(&presets::paper(), &[log], &[], &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap()
}

/// The log with columns of some names changed, row by row.
fn with(log: &Log, names: &[&str], change: impl Fn(usize, f64) -> f64) -> Log {
    let columns = log.columns.iter().map(|column| {
        let changed = names.contains(&&*column.name);
        let of = |(row, &value): (usize, &f64)| if changed { change(row, value) } else { value };
        (column.name.clone(), column.values.iter().enumerate().map(of).collect())
    });
    Log::from_columns("altered.csv", columns)
}

/// The log with left and right exchanged in the columns that begin so.
fn crossed(log: &Log, beginnings: &[&str]) -> Log {
    let columns = log.columns.iter().map(|column| {
        let name = &column.name;
        let other =
            if name.contains("left") { name.replace("left", "right") } else { name.replace("right", "left") };
        let from = if beginnings.iter().any(|start| name.starts_with(start)) { &other } else { name };
        (name.clone(), log.column(from).unwrap().to_vec())
    });
    Log::from_columns("altered.csv", columns)
}

fn thinned(log: &Log, rows: impl Fn(usize) -> bool) -> Log {
    let columns = log.columns.iter().map(|column| {
        let kept = column.values.iter().enumerate().filter(|(row, _)| rows(*row));
        (column.name.clone(), kept.map(|(_, value)| *value).collect())
    });
    Log::from_columns("altered.csv", columns)
}

#[test]
fn bad_logs_are_told_before_any_effect() {
    let log = driven(Scenario::Multisine);
    let torques = ["torque_left_nm", "torque_right_nm"];
    let (angle, pitch) = (["motor_angle_left_rad"], ["pitch_rad"]);
    let swapped = "left and right";
    let cases: Vec<(&str, Log, &str, &str)> = vec![
        ("wheels crosswise", crossed(&log, &["motor_"]), "torque_left_nm", swapped),
        ("torques crosswise", crossed(&log, &["torque_"]), "torque_left_nm", swapped),
        ("speeds crosswise", crossed(&log, &["motor_speed_"]), "motor_speed_left_rad_s", swapped),
        ("angles crosswise", crossed(&log, &["motor_angle_"]), "motor_speed_left_rad_s", swapped),
        ("torques turned round", with(&log, &torques, |_, v| -v), "torque_left_nm", "sign"),
        ("wheel turned round", with(&log, &angle, |_, v| -v), "motor_speed_left_rad_s", "sign"),
        ("pitch turned round", with(&log, &pitch, |_, v| -v), "pitch_rate_rad_s", "sign"),
        ("torque in mN m", with(&log, &torques, |_, v| 1000.0 * v), "torque_left_nm", "unit"),
        ("one torque in mN m", with(&log, &torques[1..], |_, v| 1000.0 * v), "torque_right_nm", "unit"),
        ("pitch in degrees", with(&log, &pitch, |_, v| v.to_degrees()), "pitch_rate_rad_s", "unit"),
        ("angle in degrees", with(&log, &angle, |_, v| v.to_degrees()), "motor_speed_left_rad_s", "unit"),
        ("dead wheel", with(&log, &angle, |_, _| 0.3), "motor_angle_left_rad", "never changes"),
        (
            "wheel dies",
            with(&log, &angle, |row, v| if row < 6000 { v } else { 0.3 }),
            "motor_angle_left_rad",
            "dead",
        ),
        ("dead pitch", with(&log, &pitch, |_, _| 0.01), "pitch_rad", "never changes"),
        ("constant torque", with(&log, &torques[..1], |_, _| 0.1), "torque_left_nm", "never changes"),
        (
            "torque dies",
            with(&log, &torques[..1], |row, v| if row < 6000 { v } else { 0.0 }),
            "torque_left_nm",
            "dead",
        ),
        ("clipped", with(&log, &torques, |_, v| v.clamp(-0.05, 0.05)), "torque_left_nm", "at the limit"),
        ("33 rows a second", thinned(&log, |row| row % 30 == 0), "time_s", "too few"),
        ("short", thinned(&log, |row| row < 2000), "time_s", "too short"),
    ];
    let mut untold = Vec::new();
    for (what, log, column, told) in cases {
        let found = refined(log);
        let mut errors = found.data_health.iter().filter(|finding| finding.severity == Severity::Error);
        let named = errors.any(|finding| finding.column == column && finding.problem.contains(told));
        if found.verdict != Verdict::DataUnfit || !found.effects.is_empty() || !named {
            untold.push((what, found.verdict, found.data_health));
        }
    }
    assert!(untold.is_empty(), "{untold:#?}");
}

/// Standing still excites nothing.
#[test]
fn a_robot_at_rest_has_nothing_to_tell() {
    let log = driven(Scenario::Station);
    let found = refined(with(&log, &["motor_angle_left_rad", "motor_angle_right_rad"], |_, v| 0.01 * v));
    assert!(found.effects.is_empty() && found.verdict != Verdict::EffectsFound, "{:#?}", found.data_health);
    let few = |finding: &HealthFinding| finding.problem.contains("few effects can be identified");
    assert!(found.data_health.iter().any(few), "{:#?}", found.data_health);
}

/// What a robot does by itself is no fault of its log.
#[test]
fn good_logs_have_no_swapped_sides() {
    for scenario in [Scenario::Multisine, Scenario::Flat, Scenario::Bridge, Scenario::Cruise, Scenario::Kick]
    {
        let log = driven(scenario);
        let readings = super::Readings::new(&log).unwrap();
        let found = super::of_signals(&log, &readings, presets::paper().robot().unwrap());
        let told = |part: &str| found.iter().any(|finding| finding.problem.contains(part));
        assert!(
            !told("the other wheel") && !told("the other torque") && !told("of one of them"),
            "{scenario:?}: {found:#?}"
        );
        assert_eq!(super::crosswise(&readings), None, "{scenario:?}");
    }
}
