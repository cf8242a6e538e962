//! A robot that balances: the residuals of translation and pitch, and what its model lacks.
//!
//! # Method
//! r1 and r2 are weak forms: integrals of the log against one smooth bump and its differences ([`kernel`]), so that
//! nothing noisy is differentiated. Between the IMU's held readings the declared model moves the robot on under the
//! recorded torques ([`motion`]). The residuals are turned into two channels that the gyro's noise does not couple, each
//! made white ([`channels`]). Every effect gives columns in both, by its own law over the recorded motion ([`trace`]);
//! declared numbers are free within their tolerances ([`nuisance`]); forward selection with swaps judges by left-out
//! blocks ([`search`]). A second pass fills the gaps with the motion of the model that has the effects.

mod bias;
mod candidates;
mod chance;
mod channels;
mod dependence;
mod found;
mod gaps;
mod health;
mod kernel;
mod leftover;
mod lines;
mod motion;
mod nuisance;
mod search;
mod smooth;
mod trace;
mod tried;
mod twin;
mod uncertainty;
mod waves;

use crate::effects::{EffectKind, Form, MotionSample as Moment};
use crate::model::{Model, ModelParameter, RobotModel};
use crate::parallel;
use crate::record::{HealthFinding, Log, LogKind};
use crate::signal::quantile::student_t_975;

use super::corrected::Coefficient;
use super::error::RefineError;
use super::verdict::{
    Channels as PerChannel, Corrected, Errors, Found, Quantity, Refinement, Residual, Verdict,
};
use super::{Explorer, Options, Variable, Watch, is_unfit, report};
use candidates::library;
use channels::Channels;
use motion::Readings;
pub(super) use motion::{at_even_times, fresh_rows};
use nuisance::{Known, Nuisance, nuisances};
use search::{Fit, Search, whitened};
use trace::{Pair, Part, Trace};
use twin::{Levels, Twin};

/// Share of the structure that named effects must explain, so that they can be its cause.
const EXPLAINED: f64 = 0.95;
/// The same where no more than so much of the noise's power is left.
const MOST_OF_IT: f64 = 0.5;
const LITTLE: f64 = 0.1;

/// How far a model is from logs of its robot.
pub(super) fn residual(
    model: &Model,
    logs: &[Log],
    options: &Options,
    watch: Watch<'_>,
) -> Result<Residual, RefineError> {
    let robot = robot_of(model, logs)?;
    check_names(&options.estimate)?;
    let pieces = gaps::pieces(logs);
    let readings = read(&pieces)?;
    let mut data_health = health::check(pieces.iter().zip(&readings), robot);
    data_health.extend(gaps::findings(logs));
    report(watch, 0.3)?;
    if is_unfit(&data_health) {
        return Ok(Residual { errors: Errors::default(), tests: Vec::new(), data_health });
    }
    let readings: Vec<Readings> = readings.into_iter().map(|r| r.acting(robot)).collect();
    let trace = Trace::new(robot, readings.clone(), readings);
    data_health.extend(health::check_motion(&trace));
    report(watch, 0.8)?;
    let residual = trace.residual();
    let channels = Channels::new(&trace, &residual);
    let errors = errors(&trace, &channels, &residual);
    let tests = leftover::tests(&trace, &channels, &residual);
    Ok(Residual { errors, tests, data_health })
}

/// Whether the logged torques act as late as the model says, and not as they are logged: a model file without a word of
/// it says what is usual, and some logs hold what acts. What leaves less of r1 is taken.
fn torques_are_late(robot: &RobotModel, logs: &[Readings]) -> bool {
    let power = |of: fn(Readings, &RobotModel) -> Readings| {
        let logs = logs.iter().map(|log| of(log.clone(), robot)).collect();
        Trace::of_training(robot, logs).residual()[0].iter().map(|r| r * r).sum::<f64>()
    };
    robot.actuation.delay_s > 0.0 && power(Readings::acting) < power(Readings::without_offsets)
}

fn robot_of<'a>(model: &'a Model, logs: &[Log]) -> Result<&'a RobotModel, RefineError> {
    let first = logs.first().ok_or(RefineError::NoLogs)?;
    model.robot().ok_or_else(|| RefineError::WrongModel {
        file: first.source.clone(),
        kind: LogKind::Robot,
        wanted: "motor or axis",
    })
}

fn read(logs: &[Log]) -> Result<Vec<Readings>, RefineError> {
    let read = |log: &Log| Readings::new(log).ok_or_else(|| log.missing_for(LogKind::Robot).into());
    logs.iter().map(read).collect()
}

/// Every row of a log as a law sees it, from the left and from the right motor.
pub(super) fn moments(robot: &RobotModel, log: &Log) -> Option<[Vec<Moment>; 2]> {
    let readings = Readings::new(log).filter(|readings| readings.rows() > 100)?.acting(robot);
    let kernel = kernel::Kernel::new(readings.dt_s);
    Some(motion::Motion::new(&readings, robot, &kernel, None).moments)
}

/// Finds what the model of a robot lacks. Without `held_out` logs the last third of each log is held out.
pub(super) fn refine(
    model: &Model,
    logs: &[Log],
    held_out: &[Log],
    (options, banned): (&Options, &[&'static EffectKind]),
    watch: Watch<'_>,
) -> Result<Refinement, RefineError> {
    let robot = robot_of(model, logs)?;
    check_names(&options.estimate)?;
    let (pieces, held_pieces) = (gaps::pieces(logs), gaps::pieces(held_out));
    let (training, others) = (read(&pieces)?, read(&held_pieces)?);
    let read = pieces.iter().zip(&training).chain(held_pieces.iter().zip(&others));
    let mut data_health = health::check(read, robot);
    data_health.extend(gaps::findings(logs).into_iter().chain(gaps::findings(held_out)));
    if is_unfit(&data_health) {
        return Ok(Refinement::unfit(model, data_health));
    }
    let is_late = torques_are_late(robot, &training);
    let of_log = |log: Readings| if is_late { log.acting(robot) } else { log.without_offsets(robot) };
    let acting = |readings: Vec<Readings>| readings.into_iter().map(of_log).collect::<Vec<_>>();
    let (training, others) = (acting(training), acting(others));
    let bias = found::gyro_bias(&training, &others).filter(|bias| !banned.contains(&bias.effect.kind()));
    let mut trace = Trace::new(robot, training, others);
    data_health.extend(health::check_motion(&trace));
    if is_unfit(&data_health) {
        return Ok(Refinement::unfit(model, data_health));
    }
    let known = Known { tolerances: &model.tolerance, estimate: &options.estimate };
    let mut channels = Channels::new(&trace, &trace.residual());
    let chance = std::sync::OnceLock::new();
    let unfit = |mut data_health: Vec<HealthFinding>| {
        data_health.push(health::inseparable());
        Ok(Refinement::unfit(model, data_health))
    };
    // Of a robot that stands, friction that sticks takes any torque, and accelerations are noise.
    let moves = trace.moves();
    let mut is_last = false;
    loop {
        let done = if is_last { 0.55 } else { 0.1 };
        report(watch, done)?;
        let target = trace.residual();
        let (mut free, mut tried) = (nuisances(&trace, known), library(&trace, parallel::available()));
        tried.retain(|candidate| moves && !banned.contains(&candidate.kind));
        whitened(&mut tried, &mut free, &channels, parallel::available());
        let by_chance =
            || *chance.get_or_init(|| by_chance(&trace, &channels, &free, &target, (known, options.seed)));
        let mut search = Search::new(&trace, &channels, &free, &tried, &target, &by_chance);
        search.threads = parallel::available();
        search.run(&mut |share| report(watch, done + 0.4 * share))?;
        search.settle();
        if is_last {
            search.simplify();
            search.merge_pushes();
            search.confirm();
            search.polish();
        }
        let Some(fit) = search.fit(&search.picks) else { return unfit(data_health) };
        if search.picks.is_empty() {
            return Ok(answer(model, &search, (&fit, &fit), bias, data_health));
        }
        if is_last {
            let Some((fit, sized)) = sure(&mut search, known, options.seed) else {
                return unfit(data_health);
            };
            return Ok(answer(model, &search, (&fit, &sized), bias, data_health));
        }
        let left = search.left_raw(&search.picks, &fit.judged.coefficients);
        let loads = trace.loads(&found::laws(&search, &fit));
        channels = Channels::new(&trace, &left);
        trace.refill(&loads);
        is_last = true;
    }
}

/// A clean robot that stands in for the recorded one, with its noise; none where it cannot be simulated.
fn twin<'a>(
    trace: &'a Trace<'_>,
    known: Known<'a>,
    channels: &Channels,
    corrections: &[(&Nuisance, f64)],
    seed: u64,
) -> Option<(Twin<'a>, Levels)> {
    let twin = Twin::new(trace, known, corrections)?;
    let levels = twin.levels(channels.floors, seed)?;
    Some((twin, levels))
}

/// What clean robots reach by chance.
fn by_chance(
    trace: &Trace<'_>,
    channels: &Channels,
    free: &[Nuisance],
    target: &Pair,
    (known, seed): (Known<'_>, u64),
) -> f64 {
    let search = Search::new(trace, channels, free, &[], target, &|| 0.0);
    let Some(bare) = search.fit(&[]) else { return 0.0 };
    let corrections: Vec<(&Nuisance, f64)> = free.iter().zip(bare.judged.coefficients).collect();
    twin(trace, known, channels, &corrections, seed)
        .map_or(0.0, |(twin, levels)| chance::largest_gain(&twin, levels, seed))
}

/// The fit of the picks whose size is surely not 0, as it is and with sizes that the chain has nothing added to; the others
/// are dropped, one by one.
fn sure(search: &mut Search<'_>, known: Known<'_>, seed: u64) -> Option<(Fit, Fit)> {
    loop {
        let fit = search.fit(&search.picks)?;
        let sized = unbiased(search, fit.clone(), known, seed);
        match found::unsure(search, &sized) {
            Some(place) => search.picks.remove(place),
            None => return Some((fit, sized)),
        };
    }
}

/// Takes off what the chain itself adds to the sizes.
fn unbiased(search: &Search<'_>, mut fit: Fit, known: Known<'_>, seed: u64) -> Fit {
    let is_simulated = |pick: &candidates::Candidate| pick.form == Form::Law && !pick.kind.trial.brief;
    if search.picks.is_empty() || !search.picks.iter().all(is_simulated) {
        return fit;
    }
    // As declared: a log's own corrections would be drawn to what is declared a second time.
    let shifts = twin(search.trace, known, search.channels, &[], seed).and_then(|(twin, levels)| {
        bias::shifts(search, &fit, &twin.with(found::laws(search, &fit))?, levels, seed)
    });
    let first = search.nuisances.len();
    for (place, (shift, error)) in shifts.into_iter().flatten().enumerate() {
        fit.judged.coefficients[first + place] -= shift;
        fit.doubt[first + place] = error;
    }
    fit
}

fn check_names(names: &[String]) -> Result<(), RefineError> {
    let keys: Vec<&str> = ModelParameter::refined_on_robot().collect();
    match names.iter().find(|name| *name != "all" && !keys.contains(&name.as_str())) {
        Some(name) => Err(RefineError::UnknownParameter { name: name.clone(), allowed: keys.join(", ") }),
        None => Ok(()),
    }
}

fn answer(
    model: &Model,
    search: &Search<'_>,
    (fit, sized): (&Fit, &Fit),
    bias: Option<Found>,
    data_health: Vec<HealthFinding>,
) -> Refinement {
    let trace = search.trace;
    let bare = search.fit(&[]);
    let bare = bare.as_ref().unwrap_or(fit);
    let rows = search.rows() as f64;
    let (lacking, leftover) = (bare.score / rows - 1.0, fit.score / rows - 1.0);
    let structure = if trace.moves() { leftover::structure(search, fit) } else { None };
    let share = 1.0 - leftover / lacking;
    // A moment that is left beside what explains most of it does not make that doubtful. A wave over the motor's angle
    // does: of what is said to depend on a place nothing is left that depends on it.
    let is_refuted = structure.as_ref().is_some_and(|structure| structure.is_wave)
        && search
            .picks
            .iter()
            .any(|pick| pick.kind.by_angle() || pick.kind.trial.forms.contains(&Form::Wave));
    let explained = search.picks.is_empty()
        || structure.is_none()
        || !is_refuted && (share > EXPLAINED || leftover < LITTLE && share > MOST_OF_IT);
    let picks = if explained { search.picks.as_slice() } else { &[] };
    let used = if explained { fit } else { bare };
    let sized = if picks.is_empty() { used } else { sized };
    let mut effects = found::effects(search, picks, sized, used);
    effects.extend(bias);
    let residual =
        |picks: &[candidates::Candidate], fit: &Fit| search.left_raw(picks, &fit.judged.coefficients);
    let (left_before, left_after) = (residual(&[], bare), residual(picks, used));
    let before = errors(trace, search.channels, &left_before);
    let after = errors(trace, search.channels, &left_after);
    let unexplained = match structure {
        Some(structure) => Some(structure.told),
        None if effects.is_empty() && trace.moves() => leftover::only_held_out(search, fit),
        None => None,
    };
    let verdict = match (effects.is_empty(), &unexplained) {
        (false, _) => Verdict::EffectsFound,
        (true, Some(_)) => Verdict::UnexplainedResidual,
        (true, None) => Verdict::ModelAdequate,
    };
    let parameters = corrections(search.nuisances, used);
    let candidates = tried::tried(search, &effects);
    let refined = found::refined(model, search, picks, used, &effects, &parameters);
    let explorer = explorer(search, &left_before, &left_after);
    Refinement {
        verdict,
        effects,
        before,
        after,
        unexplained: unexplained.unwrap_or_default(),
        candidates,
        closed_loop: None,
        next_experiment: None,
        data_health,
        transfer: Vec::new(),
        parameters,
        model: refined,
        explorer,
        document: Default::default(),
    }
}

/// c at every row.
fn explorer(search: &Search<'_>, before: &Pair, after: &Pair) -> Explorer {
    let trace = search.trace;
    // As what was measured less what the model asks for.
    let combined = |pair: &Pair| search.channels.combined(pair).iter().map(|c| -c).collect();
    let torque = trace.torque_nm();
    let radius = trace.machine.parameters.wheel_radius_m;
    let measured = [torque.iter().map(|t| -t / radius).collect(), torque.clone()];
    let variable = |name, unit, of: fn(&Moment) -> f64| Variable::new(name, unit, trace.variable(of));
    let angle = trace.variable(|m| m.motor_angle_rad);
    Explorer {
        channel: "combined",
        variables: vec![
            variable("time_s", "s", |m| m.time_s),
            variable("motor_angle_rad", "rad", |m| m.motor_angle_rad),
            variable("motor_speed_rad_s", "rad/s", |m| m.motor_speed_rad_s),
            Variable::new("torque_nm", "N m", torque),
            variable("x_m", "m", |m| m.x_m),
            variable("x_dot_m_s", "m/s", |m| m.x_dot_m_s),
            variable("pitch_rad", "rad", |m| m.pitch_rad),
            variable("pitch_rate_rad_s", "rad/s", |m| m.pitch_rate_rad_s),
        ],
        held_out: trace.parts().iter().map(|part| *part == Part::HeldOut).collect(),
        measured: combined(&measured),
        before: combined(before),
        after: combined(after),
        unit: "N",
        noise_floor: search.channels.floors[0],
        orders: Vec::new(),
    }
    .finished(Some(&angle))
}

fn corrections(nuisances: &[Nuisance], fit: &Fit) -> Vec<Corrected> {
    let quantile = student_t_975(fit.blocks.count().max(2) - 1);
    let spread = fit.blocks.spread(&fit.members, 1.0);
    let corrected = |(index, nuisance): (usize, &Nuisance)| {
        let value = fit.judged.coefficients[index];
        let spread = spread.as_ref();
        Coefficient {
            value,
            estimate: spread.map_or(value, |spread| spread.estimates[index]),
            error: spread
                .map_or(f64::INFINITY, |spread| spread.standard_error(index))
                .hypot(nuisance.between_motors / nuisance.per_motor),
            // Friction next to rest, where the static one acts, is free.
            alone: spread
                .filter(|_| nuisance.key != "static_nm")
                .map_or(f64::INFINITY, |spread| spread.alone[index]),
            tolerance: nuisance.tolerance,
            quantile,
        }
        .corrected(nuisance.key, nuisance.declared, |coefficient| nuisance.corrected(coefficient))
    };
    nuisances.iter().enumerate().filter(|(_, nuisance)| !nuisance.key.is_empty()).map(corrected).collect()
}

/// Root mean squares on the rows that are held out.
fn errors(trace: &Trace<'_>, channels: &Channels, left: &Pair) -> Errors {
    let parts = trace.parts();
    let rms = |column: &[f64]| {
        let rows = column.iter().zip(&parts).filter(|(_, part)| **part == Part::HeldOut);
        let (sum, count) =
            rows.fold((0.0, 0.0), |(sum, count), (value, _)| (sum + value * value, count + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    };
    let torque = rms(&trace.torque_nm());
    let radius = trace.machine.parameters.wheel_radius_m;
    let names = [("combined", "N"), ("translation", "N"), ("pitch", "N m")];
    let columns = [channels.combined(left), left[0].clone(), left[1].clone()];
    let scales = [torque / radius, torque / radius, torque];
    let per = |value: &dyn Fn(usize) -> f64, plain: bool| {
        let of = |(i, (name, unit)): (usize, &(&'static str, &'static str))| {
            (*name, Quantity::new(value(i), if plain { "1" } else { unit }))
        };
        PerChannel(names.iter().enumerate().map(of).collect())
    };
    let found: Vec<f64> = columns.iter().map(|column| rms(column)).collect();
    Errors {
        rmse: per(&|i| found[i], false),
        noise_floor: per(&|i| channels.floors[i], false),
        nrmse: per(&|i| found[i] / scales[i], true),
        prediction: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
