//! Next experiment: of the runs that a machine can do, the one in which effects that look alike would be farthest
//! apart.
//!
//! # Method
//! The refined model does each run in simulation. What the effect that was found adds to the residual, there and in the
//! log, is held against what a rival of it can add: sized to mimic it in both together, with the declared numbers free
//! within their tolerances. What the rival cannot mimic in the new run, in standard deviations of the noise, is how far
//! apart the two would be. The run with the largest such distance from the nearest rival is offered.

mod normal;
mod residuals;
mod runs;
mod separation;

use serde::Serialize;

use super::verdict::{Found, Refinement, Unexplained};
use crate::model::{AxisParameters, Motor, Rig};
use crate::record::Log;
use crate::simulate::Scenario;

use runs::runs;
use separation::separations;

/// A run that would tell more than the logs do.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NextExperiment {
    /// In words.
    pub summary: String,
    /// Ids of the effects that it tells from each other.
    pub separates: Vec<&'static str>,
    /// Scenario of the simulated robot; `None` if it is none.
    pub scenario: Option<String>,
    /// Distance between the residuals of those effects in standard deviations of the noise; 0 where it was not
    /// worked out.
    pub separation: f64,
    /// A command that runs exactly it; `None` if no command can.
    pub command: Option<String>,
}

impl NextExperiment {
    /// An experiment in words.
    pub(super) fn in_words(summary: String) -> Self {
        Self { summary, ..Self::default() }
    }
}

/// Standard deviations apart from which on a run is worth its while.
const WORTH: f64 = 5.0;

/// Information on a question.
pub(super) struct Context<'a> {
    pub(super) logs: &'a [Log],
    pub(super) motor: Motor,
    pub(super) seed: u64,
    /// Name of the file of the refined model, for commands.
    pub(super) file: &'a str,
}

/// The run that would tell most beyond what the logs have told; `None` if nothing is open.
pub(super) fn next_experiment(found: &Refinement, context: &Context<'_>) -> Option<NextExperiment> {
    let open = found.effects.iter().find(|effect| !effect.ambiguous_with.is_empty());
    let Some(effect) = open else { return of_rest(found, context) };
    let words = told_apart(effect);
    let runs = runs(&found.model);
    let separations = separations(found, effect, &runs, context).unwrap_or_default();
    let best = (0..separations.len()).max_by(|&a, &b| separations[a].total_cmp(&separations[b]));
    match best {
        Some(best) if separations[best] > WORTH => {
            let run = &runs[best];
            let summary = format!(
                "{}: {}, where they would differ by {:.0} standard deviations of the noise, the most of {} runs",
                words.0,
                run.words,
                separations[best],
                runs.len()
            );
            Some(NextExperiment {
                summary,
                separates: words.1,
                scenario: Some(run.experiment.scenario.name().to_owned()),
                separation: separations[best],
                command: Some(run.command(&found.model, context)),
            })
        }
        _ => {
            let summary = format!("{}: {}", words.0, effect.effect.kind().separated_by);
            Some(NextExperiment { separates: words.1, ..NextExperiment::in_words(summary) })
        }
    }
}

fn told_apart(effect: &Found) -> (String, Vec<&'static str>) {
    let others: Vec<&'static str> = effect.ambiguous_with.iter().map(|kind| kind.id).collect();
    let words = format!("to distinguish {} from {}", effect.effect.id(), others.join(", "));
    (words, std::iter::once(effect.effect.id()).chain(others).collect())
}

/// Experiment that would explain more of the remaining error.
fn of_rest(found: &Refinement, context: &Context<'_>) -> Option<NextExperiment> {
    let left: &Unexplained = &found.unexplained;
    if left.description.is_empty() {
        return None;
    }
    let runs = runs(&found.model);
    let on = |scenario: Scenario| runs.iter().find(|run| run.experiment.scenario == scenario);
    let swings = matches!(&found.model.rig, Rig::Axis(axis)
        if matches!(axis.parameters, AxisParameters::Rotary { gravity_torque_nm, .. } if gravity_torque_nm != 0.0));
    let (words, run) = match left.depends_on.first().map(String::as_str) {
        Some("time_s") | None => {
            let words = "repeat the same run, to see whether it recurs at the same time".to_owned();
            return Some(NextExperiment::in_words(words));
        }
        Some(name) if name.contains("speed") => (name, on(Scenario::FrictionSweep)),
        Some(name) if name.contains("torque") => (name, on(Scenario::Multisine)),
        Some(name) if name.contains("angle") => (name, on(Scenario::FrictionSweep)),
        Some(name) => (name, on(Scenario::Cruise)),
    };
    if swings {
        let summary = format!(
            "a run in which {words} varies more: raise and lower the load slowly over its whole range, then \
             swing it at several speeds"
        );
        return Some(NextExperiment::in_words(summary));
    }
    let summary = match run {
        Some(run) => format!("a run in which {words} varies more: {}", run.words),
        None => {
            format!("a run in which {words} varies while everything else is kept as constant as possible")
        }
    };
    Some(NextExperiment {
        scenario: run.map(|run| run.experiment.scenario.name().to_owned()),
        command: run.map(|run| run.command(&found.model, context)),
        ..NextExperiment::in_words(summary)
    })
}

#[cfg(test)]
mod tests;
