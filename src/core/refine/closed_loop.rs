//! The refined model as the plant: what the controller of before and the one made from the refined model do with it.
//!
//! An effect that a controller could cancel is offered to it only if the simulated loop stays as calm with it as
//! without: with four plants, one seed each: as it is, with a payload, with a longer delay, and with a smaller
//! effect. Otherwise the refined model carries it with `feedforward = false`: the simulator has it, the controller
//! leaves it.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use serde::Serialize;

use super::error::RefineError;
use super::{Watch, report};
use crate::effects::{EffectKind, Feedforward, Role};
use crate::model::{Effect, MachineKind, Model, Rig, RobotModel, RobotParameters};
use crate::parallel;
use crate::simulate::{self, ControllerChoice, Experiment, Outcome, Run, Scenario, TimedPose};

/// Runs of the simulated robot with the refined model as the plant: the controller of before and the one made from the
/// refined model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClosedLoop {
    /// One for each scenario.
    pub scenarios: Vec<LoopPair>,
    /// Use of each effect in the controller.
    pub feedforward: Vec<Fed>,
}

/// One scenario under both controllers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoopPair {
    /// Name as of `flqr simulate --scenario`.
    pub scenario: String,
    /// Under the controller of the declared model.
    pub before: LoopRun,
    /// Under that of the refined model.
    pub after: LoopRun,
}

/// Statistics of a run, from the true simulated state after the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopRun {
    /// Displacement, m; about its target where it drives.
    pub x_m: Spread,
    /// Speed, m/s.
    pub x_dot_m_s: Spread,
    /// Pitch, rad.
    pub pitch_rad: Spread,
    /// A periodic motion that keeps itself up; `None` if the robot comes to rest, or only noise moves it.
    pub limit_cycle: Option<LimitCycle>,
    /// True if it fell.
    pub fell: bool,
}

/// Spread of a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
    /// Largest less smallest value.
    pub peak_to_peak: f64,
}

/// A periodic motion of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LimitCycle {
    /// Amplitude of x at its frequency, m.
    pub amplitude_m: f64,
    /// Its frequency, Hz.
    pub frequency_hz: f64,
}

/// Use of an effect in the controller.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fed {
    /// Id of the effect.
    #[serde(serialize_with = "id")]
    pub effect: &'static EffectKind,
    /// True if the controller cancels it.
    pub used: bool,
    /// Reason.
    pub reason: String,
}

fn id<S: serde::Serializer>(kind: &&'static EffectKind, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(kind.id)
}

/// Length of a run and where its statistics begin, s.
const SECONDS: f64 = 20.0;
const FROM_S: f64 = 5.0;
/// Duration of the runs that check a feedforward.
const CHECK_SECONDS: f64 = 8.0;
const CHECK_FROM_S: f64 = 2.0;
/// Variations of those runs: payload as a fraction of the body, longer delay, s, and smaller effect.
const PAYLOAD: f64 = 0.1;
const LATER_S: f64 = 0.002;
const SMALLER: f64 = 0.85;
/// Fraction of the power of the wheels' way that a limit cycle has about one frequency, and its least amplitude, m.
const PERIODIC: f64 = 0.5;
const LEAST_CYCLE_M: f64 = 5e-4;
/// Largest allowed increase of oscillation by a feedforward: factor, and absolute values, m and rad/s.
const CALM: f64 = 1.25;
const STILL_M: f64 = 5e-4;
const STILL_RAD_S: f64 = 0.05;

/// Simulates the refined model under the controllers of before and after, and marks in it the effects that a controller
/// must leave; all that it could cancel where no loop can be simulated. `None` if nothing was found.
pub(super) fn closed_loop(
    declared: &Model,
    refined: &mut Model,
    kinds: &[&'static EffectKind],
    seed: u64,
    watch: Watch<'_>,
) -> Result<Option<ClosedLoop>, RefineError> {
    if kinds.is_empty() {
        return Ok(None);
    }
    let added: Vec<usize> = {
        let (known, all) = (effects_of(declared), effects_of(refined));
        (0..all.len()).filter(|&place| !known.contains(&all[place])).collect()
    };
    let weighted = |model: &Model| model.robot().is_some_and(|robot| robot.weights.is_some());
    let can_run = weighted(declared) && weighted(refined);
    let feedforward = offered(refined, kinds, &added, can_run.then_some(seed), watch)?;
    if !can_run {
        return Ok(Some(ClosedLoop { scenarios: Vec::new(), feedforward }));
    }
    let actual = &*refined;
    let scenarios = [Scenario::Station, Scenario::Multisine];
    let jobs: Vec<(Scenario, &Model)> =
        scenarios.iter().flat_map(|&scenario| [(scenario, declared), (scenario, actual)]).collect();
    let runs = parallel::map(&jobs, parallel::available(), |(scenario, controller)| {
        let run = ground_run(*scenario, controller, actual, SECONDS, seed)?;
        Some(told(&run, actual.robot()?, *scenario, FROM_S))
    });
    let pairs = scenarios.iter().zip(runs.chunks(2)).filter_map(|(scenario, pair)| {
        let (before, after) = (pair[0]?, pair[1]?);
        Some(LoopPair { scenario: scenario.name().to_owned(), before, after })
    });
    Ok(Some(ClosedLoop { scenarios: pairs.collect(), feedforward }))
}

fn effects_of(model: &Model) -> &[Effect] {
    match &model.rig {
        Rig::Robot(robot) => &robot.effects,
        Rig::Axis(axis) => &axis.effects,
    }
}

fn ground_run(
    scenario: Scenario,
    controller: &Model,
    actual: &Model,
    seconds: f64,
    seed: u64,
) -> Option<Run> {
    let own = controller.robot()?;
    let fed = own.friction.iter().any(Option::is_some) || own.effects.iter().any(Effect::is_fed_forward);
    let choice = if fed { ControllerChoice::Flqr } else { ControllerChoice::Lqr };
    let experiment = Experiment { seconds, seed, ..Experiment::new(scenario, choice) };
    match simulate::run(&experiment, controller, actual, &mut |_| ControlFlow::Continue(())) {
        Ok(Outcome::Ground(run)) => Some(run),
        _ => None,
    }
}

fn told(run: &Run, robot: &RobotModel, scenario: Scenario, from_s: f64) -> LoopRun {
    let poses = counted(run, from_s);
    let spread = |of: &dyn Fn(&TimedPose) -> f64| {
        let values: Vec<f64> = poses.iter().map(of).collect();
        spread(&values)
    };
    let cycle = if scenario == Scenario::Station { cycle(poses, &robot.parameters) } else { None };
    LoopRun {
        x_m: spread(&|p| p.pose.state.x_m),
        x_dot_m_s: spread(&|p| p.pose.state.x_dot_m_s),
        pitch_rad: spread(&|p| p.pose.state.pitch_rad),
        limit_cycle: cycle,
        fell: run.statistics.fell,
    }
}

/// The poses that count; all of a run that fell before.
fn counted(run: &Run, from_s: f64) -> &[TimedPose] {
    let first = run.poses.partition_point(|pose| pose.time_s < from_s);
    if first + 2 < run.poses.len() { &run.poses[first..] } else { &run.poses }
}

fn spread(values: &[f64]) -> Spread {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / count;
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    Spread { mean, std: variance.sqrt(), peak_to_peak: (high - low).max(0.0) }
}

/// A motion of which most is about one frequency.
fn cycle(poses: &[TimedPose], p: &RobotParameters) -> Option<LimitCycle> {
    let seconds = poses.last()?.time_s - poses.first()?.time_s;
    let x: Vec<f64> = poses.iter().map(|pose| pose.pose.state.x_m).collect();
    let way: Vec<f64> =
        poses.iter().map(|pose| pose.pose.state.x_m - p.wheel_radius_m * pose.pose.state.pitch_rad).collect();
    let (x, way) = (level(&x), level(&way));
    let total = 2.0 * way.iter().map(|v| v * v).sum::<f64>() / way.len() as f64;
    // Squares of the amplitudes at the multiples of one wave in the run, up to 20 Hz.
    let most = ((20.0 * seconds) as usize).min(way.len() / 2);
    let powers: Vec<f64> = (1..most).map(|waves| wave(&way, waves).powi(2)).collect();
    let strongest = (0..powers.len()).max_by(|&a, &b| powers[a].total_cmp(&powers[b]))?;
    let near = strongest.saturating_sub(1)..(strongest + 2).min(powers.len());
    let band: f64 = powers[near.clone()].iter().sum();
    if band < PERIODIC * total || band.sqrt() < LEAST_CYCLE_M {
        return None;
    }
    let centre: f64 = near.clone().map(|place| powers[place] * (place + 1) as f64).sum::<f64>() / band;
    let amplitude: f64 = near.map(|place| wave(&x, place + 1).powi(2)).sum::<f64>();
    Some(LimitCycle { amplitude_m: amplitude.sqrt(), frequency_hz: centre / seconds })
}

/// Without its straight line.
fn level(values: &[f64]) -> Vec<f64> {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let (mut product, mut square) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let t = i as f64 - middle;
        product += t * value;
        square += t * t;
    }
    let slope = product / square.max(1.0);
    values.iter().enumerate().map(|(i, value)| value - mean - slope * (i as f64 - middle)).collect()
}

/// Amplitude of a whole number of waves.
fn wave(values: &[f64], waves: usize) -> f64 {
    let (turn_sin, turn_cos) = libm::sincos(TAU * waves as f64 / values.len() as f64);
    let (mut sin, mut cos, mut re, mut im) = (0.0, 1.0, 0.0, 0.0);
    for value in values {
        re += value * cos;
        im += value * sin;
        (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
    }
    2.0 * re.hypot(im) / values.len() as f64
}

/// Use of each added effect; those that are not offered are marked in the model. Without a seed none can be
/// tried.
fn offered(
    refined: &mut Model,
    kinds: &[&'static EffectKind],
    added: &[usize],
    seed: Option<u64>,
    watch: Watch<'_>,
) -> Result<Vec<Fed>, RefineError> {
    let effects = effects_of(refined);
    let able: Vec<usize> = added.iter().copied().filter(|&place| effects[place].is_fed_forward()).collect();
    // One after the other, each next to those that have passed, so that none hides behind another.
    let (mut verdicts, mut passed) = (Vec::new(), Vec::new());
    for (number, &place) in able.iter().enumerate() {
        report(watch, number as f64 / able.len() as f64)?;
        let verdict = match seed {
            Some(seed) => trial(refined, &able, &passed, place, seed),
            None => Err(UNTRIED.to_owned()),
        };
        if verdict.is_ok() {
            passed.push(place);
        }
        verdicts.push(verdict);
    }
    let mut told: Vec<Fed> = Vec::new();
    for &kind in kinds {
        // Of several of a kind, each has its own.
        let before = told.iter().filter(|fed| fed.effect == kind).count();
        let own = (0..able.len()).filter(|&own| effects[able[own]].kind() == kind).nth(before);
        let (used, reason) = match (own.map(|own| &verdicts[own]), kind.feedforward) {
            (Some(Ok(reason)), _) if kind.by_angle() => (true, format!("{reason}; {ARMED}")),
            (Some(Ok(reason)), _) => (true, reason.clone()),
            (Some(Err(reason)), _) => (false, reason.clone()),
            (None, Feedforward::Never(reason)) => (false, reason.to_owned()),
            (None, _) => (true, "corrected in the declared parameters of the controller".to_owned()),
        };
        told.push(Fed { effect: kind, used, reason });
    }
    let refused: Vec<usize> =
        able.iter().zip(&verdicts).filter(|(_, verdict)| verdict.is_err()).map(|(place, _)| *place).collect();
    keep_from(refined, &refused);
    Ok(told)
}

/// Reason without a simulated loop.
const UNTRIED: &str =
    "left out: no closed loop could be simulated with this model to verify that it stays stable";
/// Reason for a robot being driven.
const ARMED: &str =
    "not used when driving a robot, because its motor angles are relative to the position at arming";

/// Marks effects that no controller may cancel.
fn keep_from(model: &mut Model, places: &[usize]) {
    let effects = match &mut model.rig {
        Rig::Robot(robot) => &mut robot.effects,
        Rig::Axis(axis) => &mut axis.effects,
    };
    for &place in places {
        if let Ok(left) = effects[place].clone().with_feedforward(false) {
            effects[place] = left;
        }
    }
}

/// Returns whether the loop stays as calm where one more of the effects is fed forward next to some, and how calm it
/// is.
fn trial(
    refined: &Model,
    able: &[usize],
    beside: &[usize],
    added: usize,
    seed: u64,
) -> Result<String, String> {
    let feeding = |fed: &dyn Fn(usize) -> bool| {
        let mut model = refined.clone();
        let others: Vec<usize> = able.iter().copied().filter(|&place| !fed(place)).collect();
        keep_from(&mut model, &others);
        model
    };
    let none = feeding(&|place| beside.contains(&place));
    let some = feeding(&|place| place == added || beside.contains(&place));
    let plants = variations(refined, added);
    let jobs: Vec<(usize, &Model)> = (0..plants.len()).flat_map(|n| [(n, &none), (n, &some)]).collect();
    let runs = parallel::map(&jobs, parallel::available(), |(n, controller)| {
        ground_run(Scenario::Station, controller, &plants[*n].1, CHECK_SECONDS, seed.wrapping_add(*n as u64))
    });
    let (mut swing, mut worst) = ([0.0; 2], None);
    for (n, pair) in runs.chunks(2).enumerate() {
        let [Some(without), Some(with)] = pair else {
            return Err("left out: its closed loop could not be simulated".to_owned());
        };
        let Some(robot) = plants[n].1.robot() else { continue };
        let calm = |run: &Run| {
            let poses = counted(run, CHECK_FROM_S);
            let speeds: Vec<f64> =
                poses.iter().map(|pose| robot.parameters.motor_speed_rad_s(&pose.pose.state)).collect();
            (spread(&speeds).std, cycle(poses, &robot.parameters).map_or(0.0, |cycle| cycle.amplitude_m))
        };
        let ((speed_without, cycle_without), (speed_with, cycle_with)) = (calm(without), calm(with));
        swing[0] += speed_without / plants.len() as f64;
        swing[1] += speed_with / plants.len() as f64;
        let falls = with.statistics.fell && !without.statistics.fell;
        let cycles = cycle_with > CALM * cycle_without + STILL_M;
        if falls || cycles || speed_with > CALM * speed_without + STILL_RAD_S {
            let what = if falls {
                "the simulated robot falls".to_owned()
            } else if cycles {
                format!("the simulated loop has a limit cycle of {:.1} mm", 1e3 * cycle_with)
            } else {
                format!("the motor speed varies by {speed_with:.2} instead of {speed_without:.2} rad/s")
            };
            worst = worst.or(Some(format!("left out: with it and {}, {what}", plants[n].0)));
        }
    }
    match worst {
        Some(reason) => Err(reason),
        None => Ok(format!(
            "cancelled by the controller; the motor speed in simulation varies by {:.3} rad/s without and {:.3} rad/s with it",
            swing[0], swing[1]
        )),
    }
}

/// Plants that a feedforward has to serve.
fn variations(refined: &Model, fed: usize) -> Vec<(&'static str, Model)> {
    let changed = |change: &dyn Fn(&mut RobotModel)| {
        let mut model = refined.clone();
        if let Rig::Robot(robot) = &mut model.rig {
            change(robot);
        }
        model
    };
    let payload = changed(&|robot| {
        let p = robot.parameters;
        robot.set_parameters(RobotParameters { body_mass_kg: (1.0 + PAYLOAD) * p.body_mass_kg, ..p });
    });
    let later = changed(&|robot| robot.actuation.delay_s += LATER_S);
    let smaller = changed(&|robot| {
        if let Some(effect) = scaled(&robot.effects[fed], SMALLER) {
            robot.effects[fed] = effect;
        }
    });
    vec![
        ("the nominal model", refined.clone()),
        ("a payload of 10 % of the body mass", payload),
        ("2 ms of additional delay", later),
        ("a 15 % smaller effect", smaller),
    ]
}

/// Returns the effect with another size.
fn scaled(effect: &Effect, share: f64) -> Option<Effect> {
    let own = effect.kind().parameters;
    let sized = effect.parameters().iter().enumerate().map(|(n, (key, value))| {
        let amplitude = own[n % own.len()].role == Role::Amplitude;
        (key.as_str(), if amplitude { share * value } else { *value })
    });
    Effect::new(effect.id(), MachineKind::Robot, effect.motor(), sized).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::presets;
    use crate::simulate::Pose;

    fn with_cogging(size_nm: f64) -> Model {
        let mut model = presets::paper();
        let Rig::Robot(robot) = &mut model.rig else { unreachable!() };
        let parameters = [("order_1", 7.0), ("cos_1_nm", size_nm), ("sin_1_nm", 0.0)];
        robot.effects.push(Effect::new("cogging", MachineKind::Robot, None, parameters).unwrap());
        model
    }

    #[test]
    fn a_swing_is_told_with_its_frequency_and_amplitude_and_noise_is_none() {
        let at = |tick: usize, x_m: f64| {
            let state = crate::model::State { x_m, ..Default::default() };
            TimedPose { time_s: 0.01 * tick as f64, pose: Pose { state, ..Pose::default() } }
        };
        let p = presets::paper().robot().unwrap().parameters;
        let swings: Vec<TimedPose> = (0..1500)
            .map(|i| at(i, 0.02 * f64::sin(TAU * 0.43 * 0.01 * i as f64) + 1e-4 * i as f64))
            .collect();
        let found = cycle(&swings, &p).unwrap();
        assert!(
            (found.frequency_hz - 0.43).abs() < 0.015 && (found.amplitude_m - 0.02).abs() < 2e-3,
            "{found:?}"
        );
        let mut noise = simulate::Noise::new(3, 0);
        let rough: Vec<TimedPose> = (0..1500).map(|i| at(i, noise.normal(0.01))).collect();
        assert_eq!(cycle(&rough, &p), None);
    }

    #[test]
    fn cogging_is_cancelled_and_the_loop_gets_calmer() {
        let declared = presets::paper();
        let mut refined = with_cogging(0.05);
        let kinds = [crate::effects::kind("cogging").unwrap()];
        let found = closed_loop(&declared, &mut refined, &kinds, 1, &mut |_| ControlFlow::Continue(()))
            .unwrap()
            .unwrap();
        assert!(found.feedforward[0].used, "{found:?}");
        assert!(refined.robot().unwrap().effects[0].is_fed_forward());
        let station = &found.scenarios[0];
        assert!(station.after.x_m.std < station.before.x_m.std, "{station:?}");
    }

    fn watched(declared: &Model, refined: &mut Model, ids: &[&str], seed: u64) -> ClosedLoop {
        let kinds: Vec<&'static EffectKind> =
            ids.iter().map(|id| crate::effects::kind(id).unwrap()).collect();
        closed_loop(declared, refined, &kinds, seed, &mut |_| ControlFlow::Continue(())).unwrap().unwrap()
    }

    /// Without weights there is no loop to try it in. What was declared before stays as it was.
    #[test]
    fn an_effect_that_no_loop_has_tried_is_left_out_and_marked() {
        let mut declared = with_cogging(0.05);
        let Rig::Robot(robot) = &mut declared.rig else { unreachable!() };
        robot.weights = None;
        let mut refined = declared.clone();
        let Rig::Robot(robot) = &mut refined.rig else { unreachable!() };
        let cogging = |order: f64| {
            let parameters = [("order_1", order), ("cos_1_nm", 0.02), ("sin_1_nm", 0.0)];
            Effect::new("cogging", MachineKind::Robot, None, parameters).unwrap()
        };
        robot.effects.extend([cogging(14.0), cogging(21.0)]);
        let found = watched(&declared, &mut refined, &["cogging", "cogging", "aero_drag"], u64::MAX);
        let fed: Vec<bool> = effects_of(&refined).iter().map(Effect::is_fed_forward).collect();
        assert_eq!(fed, [true, false, false]);
        assert!(found.scenarios.is_empty() && found.feedforward.len() == 3);
        assert!(found.feedforward.iter().all(|fed| !fed.used), "{found:?}");
        assert!(found.feedforward[1].reason.contains("no closed loop could be simulated"), "{found:?}");
        assert!(found.feedforward[2].reason.contains("lean"), "{found:?}");
        let text = refined.to_toml();
        assert_eq!(text.matches("feedforward = false").count(), 2);
        assert_eq!(Model::from_toml(&text, "again").unwrap(), refined);
    }

    /// Dry friction that is cancelled whole swings where it is a little less than estimated.
    #[test]
    fn an_effect_that_makes_the_loop_swing_is_refused_and_the_reason_says_where() {
        let declared = presets::paper();
        let mut refined = declared.clone();
        let Rig::Robot(robot) = &mut refined.rig else { unreachable!() };
        let parameters = [("speed_rad_s", 1.0), ("amplitude_nm", 0.3)];
        robot.effects.push(Effect::new("low_speed_friction", MachineKind::Robot, None, parameters).unwrap());
        let found = watched(&declared, &mut refined, &["low_speed_friction"], 1);
        let fed = &found.feedforward[0];
        assert!(!fed.used && fed.reason.starts_with("left out: with it and "), "{found:?}");
        assert!(!effects_of(&refined)[0].is_fed_forward());
        // The controller of after leaves it out, so that the loop is the one of before.
        let station = &found.scenarios[0];
        assert!(!station.after.fell && station.after.x_m.std <= 1.05 * station.before.x_m.std, "{station:?}");
    }

    #[test]
    fn trials_end_when_they_are_cancelled() {
        let (declared, mut refined) = (presets::paper(), with_cogging(0.05));
        let kinds = [crate::effects::kind("cogging").unwrap()];
        let ended = closed_loop(&declared, &mut refined, &kinds, 1, &mut |_| ControlFlow::Break(()));
        assert_eq!(ended, Err(RefineError::Cancelled));
    }
}
