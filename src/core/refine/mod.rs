//! Closing the loop with measured data: the residual of a declared model, the effects that it lacks, and the model
//! refined by them.
//!
//! # Method
//! 1. The log is checked ([`crate::record::data_health`] and the checks of this room). What makes the question
//!    unanswerable is said before any effect is named.
//! 2. Equation errors: every column, the target and each derivative pass one common kernel, and nothing noisy is
//!    differentiated without it. Rests are left out, as sticking friction takes any value there.
//! 3. Declared parameters are estimated along within their tolerances.
//! 4. The rows are made white by the residual's own correlation, the same filter for every column ([`whiten`]).
//! 5. Each effect of the library gives columns: its law over the recorded motion at unit amplitude. Forward selection
//!    with swaps, pairs and one backward check on the error of left-out blocks ([`select`]). Intervals come from the
//!    jackknife over blocks.
//! 6. How large a gain has to be for a name is set for each log: simulated clean machines with its motion and its noise
//!    pass the same search, and what one in a hundred of them would show is the threshold.
//! 7. What is left is held against smooth functions of everything that was recorded. A residual that these explain much
//!    better than the library does has no name: `unexplained_residual`.

mod axis;
mod cleaning;
mod closed_loop;
mod corrected;
mod demo;
mod error;
mod explorer;
mod gain;
mod gate;
mod largest;
mod left_out;
mod next_experiment;
mod pages;
mod pictures;
mod prediction;
mod rates;
mod robot;
pub mod select;
mod split;
mod verdict;
pub mod whiten;

use std::ops::ControlFlow;

use crate::model::{AxisParameters, Model, Motor, Rig};
use crate::record::{HealthFinding, Log, LogKind, Severity};

pub use closed_loop::{ClosedLoop, Fed, LimitCycle, LoopPair, LoopRun, Spread};
pub use demo::{Demonstration, DemonstrationError, Truth, demonstrate};
pub use error::RefineError;
pub use explorer::{Explorer, Variable};
pub use left_out::without;
use next_experiment::Context;
pub use next_experiment::NextExperiment;
use prediction::{Rows, predictions};
pub use verdict::{
    Channels, Corrected, Errors, Found, Outcome, Prediction, Quantity, Refinement, Residual, ScoredCandidate,
    Sized, Test, Transfer, Unexplained, Verdict,
};

/// Options of a refinement.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Motor of a robot's model that a bench log belongs to.
    pub motor: Motor,
    /// Declared numbers that are free, as named in the model file; `all` stands for inertia or mass, viscous, Coulomb
    /// and offset. The others are estimated along within their tolerances.
    pub estimate: Vec<String>,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Lowest and highest speed of the rows of an axis that count, either way, rad/s or m/s; all of them where none.
    pub speeds: Option<[f64; 2]>,
    /// Name of the file that the refined model will have, for the commands of an answer; empty for a word in its place.
    pub model_file: String,
}

/// Fraction of the work that the search is; the rest is the closed loop, predictions and the next experiment.
const SEARCH: f64 = 0.75;

/// Most effects that are left out of a search because predictions are worse with them.
const MOST_BANNED: usize = 3;

/// Receives the fraction of the work that is done, and may cancel it.
type Watch<'a> = &'a mut dyn FnMut(f64) -> ControlFlow<()>;

fn report(watch: Watch<'_>, share: f64) -> Result<(), RefineError> {
    if watch(share).is_break() { Err(RefineError::Cancelled) } else { Ok(()) }
}

/// Returns whether logs cannot answer.
fn is_unfit(findings: &[HealthFinding]) -> bool {
    findings.iter().any(|finding| finding.severity == Severity::Error)
}

/// Computes the residual of a model on logs of its machine.
///
/// # Errors
/// No log, logs of several kinds, a log of another machine or without its columns.
pub fn residual(
    model: &Model,
    logs: &[Log],
    options: &Options,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Residual, RefineError> {
    let kind = kind_of(model, logs)?;
    check_speeds(options, kind)?;
    let (mut logs, mut of_cells) = cleaning::repaired(logs);
    of_cells.extend(cleaning::without_duplicates(&mut logs));
    let logs = logs.as_slice();
    let mut found = match kind {
        LogKind::Robot => robot::residual(model, logs, options, watch),
        _ => axis::residual(model, logs, options, watch),
    }?;
    found.data_health.extend(of_cells);
    if !found.errors.rmse.0.is_empty() {
        report(watch, 1.0)?;
        found.errors.prediction = predictions(model, logs, Rows::All, options.motor, options.seed);
    }
    Ok(found)
}

/// Finds what a model lacks, and adds it. Without `held_out` logs the last third of each log is held out, after a gap
/// of 0.5 s.
///
/// `watch` receives the fraction of the work that is done.
///
/// # Errors
/// No log, logs of several kinds, a log of another machine or without its columns, a name in `estimate` that is no
/// parameter, or the watcher ended it.
pub fn refine(
    model: &Model,
    logs: &[Log],
    held_out: &[Log],
    options: &Options,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Refinement, RefineError> {
    let kind = kind_of(model, logs)?;
    check_speeds(options, kind)?;
    if let Some(other) = held_out.iter().find(|log| !log.serves(kind)) {
        kind_of(model, held_out)?;
        return Err(mixed(logs, kind, other));
    }
    let (mut logs, mut of_cells) = cleaning::repaired(logs);
    let (mut held_out, of_held_out) = cleaning::repaired(held_out);
    of_cells.extend(of_held_out);
    of_cells.extend(cleaning::without_duplicates(&mut logs));
    of_cells.extend(cleaning::without_duplicates(&mut held_out));
    let (logs, held_out) = (logs.as_slice(), held_out.as_slice());
    let (assessed, rows) = if held_out.is_empty() { (logs, Rows::LastThird) } else { (held_out, Rows::All) };
    let predicted = |model: &Model| predictions(model, assessed, rows, options.motor, options.seed);
    let of_motor = (kind != LogKind::Robot).then_some(options.motor);
    let mut banned = Vec::new();
    let mut found = loop {
        let searching = &mut |share: f64| watch(SEARCH * share);
        let mut found = match kind {
            LogKind::Robot => robot::refine(model, logs, held_out, (options, &banned), searching),
            _ => axis::refine(model, logs, held_out, (options, &banned), searching),
        }?;
        if found.verdict == Verdict::DataUnfit {
            break found;
        }
        if let Some(implausible) = gate::implausible(&found, |effect| declared_number(model, kind, effect)) {
            found.data_health.insert(0, implausible);
            break Refinement::unfit(model, found.data_health);
        }
        report(watch, SEARCH + 0.05)?;
        found.before.prediction = predicted(model);
        found.after.prediction =
            if found.model == *model { found.before.prediction.clone() } else { predicted(&found.model) };
        // Where numbers are free, predictions of the declared model are no measure for the effects.
        let numbers_hold = options.estimate.is_empty();
        let culprit = || numbers_hold.then(|| gate::culprit(&found, of_motor, predicted)).flatten();
        match gate::unsure(&found).or_else(culprit) {
            Some(kind) if banned.len() < MOST_BANNED => banned.push(kind),
            _ => break found,
        }
    };
    found.data_health.extend(of_cells);
    if found.verdict != Verdict::DataUnfit {
        let kinds: Vec<_> = found.effects.iter().map(|effect| effect.effect.kind()).collect();
        let trying = &mut |share: f64| watch(SEARCH + 0.1 + 0.1 * share);
        found.closed_loop = closed_loop::closed_loop(model, &mut found.model, &kinds, options.seed, trying)?;
        report(watch, SEARCH + 0.2)?;
        let context = Context { logs, motor: options.motor, seed: options.seed, file: &options.model_file };
        found.next_experiment = next_experiment::next_experiment(&found, &context);
    }
    let (explorer, held) = (&found.explorer, &found.explorer.held_out);
    for (errors, residual) in [(&mut found.before, &explorer.before), (&mut found.after, &explorer.after)] {
        if let Some((_, main)) = errors.rmse.0.first_mut() {
            main.ci95 = explorer::interval(residual, held);
        }
    }
    found.document = pages::document(&found, logs, held_out);
    Ok(found)
}

/// The declared number that an effect is an error of.
fn declared_number(model: &Model, kind: LogKind, effect: &Found) -> Option<f64> {
    let id = effect.effect.id();
    match (&model.rig, kind) {
        (Rig::Robot(robot), LogKind::Robot) => match id {
            "mass_error" => Some(robot.parameters.body_mass_kg),
            "com_height_error" => Some(robot.parameters.com_height_m),
            "body_inertia_error" => Some(robot.parameters.body_inertia_kg_m2),
            _ => None,
        },
        _ if id != "inertia_error" => None,
        (Rig::Robot(robot), _) => Some(robot.parameters.wheel_inertia_kg_m2),
        (Rig::Axis(axis), _) => Some(match axis.parameters {
            AxisParameters::Rotary { inertia_kg_m2, .. } => inertia_kg_m2,
            AxisParameters::Linear { mass_kg, .. } => mass_kg,
        }),
    }
}

fn check_speeds(options: &Options, kind: LogKind) -> Result<(), RefineError> {
    match options.speeds {
        None => Ok(()),
        Some(_) if kind == LogKind::Robot => Err(RefineError::SpeedsOfRobot),
        Some([low, high]) if 0.0 <= low && low < high => Ok(()),
        Some([low, high]) => Err(RefineError::Speeds { low, high }),
    }
}

/// Returns the common kind of the logs that the model describes: a log may serve several kinds.
fn kind_of(model: &Model, logs: &[Log]) -> Result<LogKind, RefineError> {
    let first = logs.first().ok_or(RefineError::NoLogs)?;
    let (kinds, wanted): (&[LogKind], _) = match &model.rig {
        Rig::Robot(_) => (&[LogKind::Robot, LogKind::Bench], "robot, or one of its wheels in the air"),
        Rig::Axis(axis) => match axis.parameters {
            AxisParameters::Rotary { .. } => (&[LogKind::Bench], "motor's shaft"),
            AxisParameters::Linear { .. } => (&[LogKind::LinearAxis], "linear axis"),
        },
    };
    let kind_of = |log: &Log| kinds.iter().copied().find(|kind| log.serves(*kind));
    for log in logs {
        if kind_of(log).is_some() {
            continue;
        }
        return Err(match log.kind() {
            Ok(LogKind::FrictionPairs) => RefineError::Pairs { file: log.source.clone() },
            Ok(kind) => RefineError::WrongModel { file: log.source.clone(), kind, wanted },
            Err(_) => log.missing_for(nearest(log, kinds)).into(),
        });
    }
    let kind = kind_of(first).unwrap_or(kinds[0]);
    match logs.iter().find(|log| kind_of(log) != Some(kind)) {
        None => Ok(kind),
        Some(other) => Err(mixed(logs, kind, other)),
    }
}

/// The error where `other` is of another kind than the logs.
fn mixed(logs: &[Log], kind: LogKind, other: &Log) -> RefineError {
    RefineError::MixedLogs {
        first: logs.first().map(|log| log.source.clone()).unwrap_or_default(),
        first_kind: kind,
        second: other.source.clone(),
        second_kind: other.kind().unwrap_or(kind),
    }
}

/// The kind of which a log lacks the fewest columns.
fn nearest(log: &Log, kinds: &[LogKind]) -> LogKind {
    let missing = |kind: &LogKind| kind.required().iter().filter(|name| log.column(name).is_none()).count();
    kinds.iter().copied().min_by_key(missing).unwrap_or(LogKind::Bench)
}
