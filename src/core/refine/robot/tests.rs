//! What surrounds the search: which logs it takes, which names it knows, and in which quantity it answers.

use std::ops::ControlFlow;

use super::*;
use crate::friction::{Stribeck, StribeckParameters};
use crate::model::{Effect, MachineKind, ModelParameter, Motor, Rig};
use crate::model_file::presets;
use crate::record::Severity;
use crate::simulate::{self, ControllerChoice, Experiment, Scenario};

fn go_on(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A run of a robot under the controller of the paper's model.
fn run(actual: &Model, seconds: f64) -> Log {
    let experiment =
        Experiment { seconds, seed: 3, ..Experiment::new(Scenario::Multisine, ControllerChoice::Flqr) };
    simulate::run(&experiment, &presets::paper(), actual, &mut go_on).unwrap().log(Motor::Left)
}

fn changed(log: &Log, change: impl Fn(&str, &[f64]) -> Vec<f64>) -> Log {
    let columns =
        log.columns.iter().map(|column| (column.name.clone(), change(&column.name, &column.values)));
    Log::from_columns("other.csv", columns)
}

#[test]
fn held_out_logs_are_checked_and_have_the_rate_of_the_others() {
    let model = presets::paper();
    let log = run(&model, 12.0);
    let in_degrees = changed(&log, |name, values| {
        let factor = if name == "pitch_rate_rad_s" { 57.3 } else { 1.0 };
        values.iter().map(|value| factor * value).collect()
    });
    let half = changed(&log, |_, values| values.iter().copied().step_by(2).collect());
    for (held_out, column, told) in [
        (in_degrees, "pitch_rate_rad_s", "its unit is wrong"),
        (half, "time_s", "one filter is used for all logs"),
    ] {
        let logs = std::slice::from_ref(&log);
        let found =
            crate::refine::refine(&model, logs, &[held_out], &Options::default(), &mut go_on).unwrap();
        let mut errors = found.data_health.iter().filter(|finding| finding.severity == Severity::Error);
        assert_eq!(found.verdict, Verdict::DataUnfit);
        assert!(
            errors.any(|finding| finding.column == column && finding.problem.contains(told)),
            "{:#?}",
            found.data_health
        );
    }
}

/// What a fit of the declared numbers alone says of a robot.
fn corrected(model: &Model, log: &Log, estimate: &[String]) -> Vec<Corrected> {
    let robot = model.robot().unwrap();
    let readings = Readings::new(log).unwrap().acting(robot);
    let trace = Trace::new(robot, vec![readings], Vec::new());
    let target = trace.residual();
    let channels = Channels::new(&trace, &target);
    let mut free = nuisances(&trace, Known { tolerances: &model.tolerance, estimate });
    whitened(&mut [], &mut free, &channels, parallel::available());
    let search = Search::new(&trace, &channels, &free, &[], &target, &|| 0.0);
    corrections(&free, &search.fit(&[]).unwrap())
}

/// Numbers of friction are those of one motor, though their columns are those of both.
#[test]
fn friction_of_both_motors_is_told_per_motor() {
    const MORE: f64 = 0.004;
    let model = presets::paper();
    let mut actual = model.clone();
    let Rig::Robot(robot) = &mut actual.rig else { panic!("the paper's model is a robot") };
    for curve in robot.friction.iter_mut().flatten() {
        let p = *curve.parameters();
        let viscous_nm_s_rad = p.viscous_nm_s_rad + MORE;
        *curve = Stribeck::new(StribeckParameters { viscous_nm_s_rad, ..p }).unwrap();
    }
    let found = corrected(&model, &run(&actual, 20.0), &["viscous_nm_s_rad".to_owned()]);
    let viscous = found.iter().find(|found| found.key == "viscous_nm_s_rad").unwrap();
    let more = viscous.value - viscous.declared;
    assert!((more / MORE - 1.0).abs() < 0.3, "{more} of {MORE}");
    let [low, high] = viscous.ci95.unwrap();
    let truth = viscous.declared + MORE;
    assert!(low < truth && truth < high && high - low < 4.0 * MORE, "{low} {high} {truth}");
}

/// A robot that is as declared lacks nothing, and its numbers stay where they are declared.
#[test]
fn a_simulated_robot_lacks_nothing_and_keeps_its_numbers() {
    let model = presets::paper();
    let found =
        crate::refine::refine(&model, &[run(&model, 60.0)], &[], &Options::default(), &mut go_on).unwrap();
    assert_eq!((found.verdict, found.effects.len()), (Verdict::ModelAdequate, 0), "{:?}", found.unexplained);
    for own in &found.parameters {
        if let Some([low, high]) = own.ci95 {
            assert!(low < high, "{} has an interval without a width", own.key);
            assert!((low..=high).contains(&own.declared), "{}: {low} {high}", own.key);
        }
    }
}

/// An IMU that is mounted askew is named, and nothing else.
#[test]
fn a_mounting_angle_of_the_size_of_the_papers_is_a_pitch_offset() {
    let model = presets::paper();
    let mut actual = model.clone();
    let Rig::Robot(robot) = &mut actual.rig else { panic!("the paper's model is a robot") };
    robot.sensors.imu_mount_angle_rad = 0.016;
    let found =
        crate::refine::refine(&model, &[run(&actual, 60.0)], &[], &Options::default(), &mut go_on).unwrap();
    assert_eq!(found.effects.iter().map(|own| own.effect.id()).collect::<Vec<_>>(), ["pitch_offset"]);
    let [low, high] = found.effects[0].ci95[0].unwrap();
    assert!((low..=high).contains(&-0.016) || (low..=high).contains(&0.016), "{low} {high}");
}

/// A rope that does not pull back is a slope, which is simpler.
#[test]
fn of_equal_effects_the_simpler_is_named() {
    let model = presets::paper();
    for (id, sizes, told) in
        [("ground_slope", vec![0.03], "ground_slope"), ("tether_spring", vec![12.0, 0.5], "tether_spring")]
    {
        let mut actual = model.clone();
        let Rig::Robot(robot) = &mut actual.rig else { panic!("the paper's model is a robot") };
        let kind = crate::effects::kind(id).unwrap();
        robot.effects.extend(Effect::estimated(kind, MachineKind::Robot, None, &[], &sizes));
        let robot = model.robot().unwrap();
        let trace =
            Trace::new(robot, vec![Readings::new(&run(&actual, 20.0)).unwrap().acting(robot)], vec![]);
        let target = trace.residual();
        let channels = Channels::new(&trace, &target);
        let known = Known { tolerances: &model.tolerance, estimate: &[] };
        let (mut free, mut tried) = (nuisances(&trace, known), library(&trace, parallel::available()));
        tried.retain(|candidate| ["ground_slope", "tether_spring"].contains(&candidate.kind.id));
        whitened(&mut tried, &mut free, &channels, parallel::available());
        let mut search = Search::new(&trace, &channels, &free, &tried, &target, &|| 0.0);
        search.picks =
            tried.iter().filter(|candidate| candidate.kind.id == "tether_spring").cloned().collect();
        search.simplify();
        assert_eq!(search.picks.iter().map(|pick| pick.kind.id).collect::<Vec<_>>(), [told]);
    }
}

#[test]
fn names_are_known_or_refused_before_anything_is_read() {
    let mut model = presets::paper();
    model.tolerance.set("body_mass_kg", 0.0).unwrap();
    let log = run(&model, 12.0);
    let trace = Trace::new(model.robot().unwrap(), vec![Readings::new(&log).unwrap()], Vec::new());
    let keys = |estimate: &str| -> Vec<&str> {
        let known = Known { tolerances: &model.tolerance, estimate: &[estimate.to_owned()] };
        let keys = nuisances(&trace, known).into_iter().map(|nuisance| nuisance.key);
        keys.filter(|key| !key.is_empty()).collect()
    };
    assert!(keys("all").iter().copied().eq(ModelParameter::refined_on_robot()));
    assert!(keys("body_mass_kg").contains(&"body_mass_kg") && !keys("offset_nm").contains(&"body_mass_kg"));
    let options = |name: &str| Options { estimate: vec![name.to_owned()], ..Options::default() };
    let told = residual(&model, std::slice::from_ref(&log), &options("body_mass"), &mut go_on);
    assert!(matches!(told, Err(RefineError::UnknownParameter { .. })), "{told:?}");
    assert!(residual(&model, std::slice::from_ref(&log), &options("body_mass_kg"), &mut go_on).is_ok());
}

#[test]
fn a_bias_of_the_gyro_is_told_by_what_is_held_out() {
    let model = presets::paper();
    let log = run(&model, 40.0);
    let biased = |size: &dyn Fn(usize) -> f64| {
        changed(&log, |name, values| {
            let values = values.iter().enumerate();
            values
                .map(|(row, value)| value + if name == "pitch_rate_rad_s" { size(row) } else { 0.0 })
                .collect()
        })
    };
    let (always, rows) = (biased(&|_| 0.02), log.columns[0].values.len());
    // One that is gone when it counts is none.
    let gone = biased(&|row| if row < 2 * rows / 3 { 0.02 } else { 0.0 });
    let found = |log: &Log, held_out: &[&Log]| {
        let held_out: Vec<Readings> = held_out.iter().map(|log| Readings::new(log).unwrap()).collect();
        found::gyro_bias(&[Readings::new(log).unwrap()], &held_out)
    };
    for held_out in [vec![], vec![&always]] {
        let bias = found(&always, &held_out).unwrap();
        assert!(
            (bias.effect.parameters()[0].1 - 0.02).abs() < 0.002 && bias.error_drop_percent > 50.0,
            "{bias:?}"
        );
    }
    assert!(found(&gone, &[]).is_none() && found(&always, &[&log]).is_none() && found(&log, &[]).is_none());
}
