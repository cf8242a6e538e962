//! Every experiment of the paper on the simulated robot, ours next to theirs.
//!
//! The experiments run as [`crate::simulate`] runs them for everybody else; here they are chosen, put next to the
//! paper's numbers and assessed. Every sentence of the report that compares or concludes is made from the figures
//! it names, so that another model or seed gives other sentences and not other figures under the same words.

mod assumptions;
mod balance;
mod causes;
mod identification;
mod kick;
mod pages;
mod paper;
mod parameters;
mod phrases;
mod table;
#[cfg(test)]
mod tests;
mod tracking;
mod trials;

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use serde::Serialize;

pub use pages::{Contradiction, Finding};
pub use parameters::{Origin, Parameter};
pub use table::{Column, Table};

use crate::identify::FitError;
use crate::model::Model;
use crate::report::{Block, Document};
use crate::simulate::ExperimentError;
use pages::Pages;

/// Options of a reproduction.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    /// The model's file as it was written; its comments say where the numbers come from. May be empty.
    pub model_text: &'a str,
    /// Seed of all noise; it and those after it make the spread over seeds.
    pub seed: u64,
    /// Seeds of the balance experiments.
    pub seeds: NonZeroUsize,
    /// Threads to run the experiments on; the result does not depend on it.
    pub threads: NonZeroUsize,
}

impl Settings<'_> {
    /// A seed of the balance experiments, from 0.
    fn seed_number(&self, number: usize) -> u64 {
        self.seed.wrapping_add(number as u64)
    }
}

/// Number of seeds that shows the spread within a short wait.
pub const DEFAULT_SEEDS: NonZeroUsize = NonZeroUsize::new(5).expect("five is not zero");

/// Every table and figure of the paper with ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproduction {
    /// Name of the model.
    pub model: String,
    /// First seed.
    pub seed: u64,
    /// Number of seeds of the balance experiments.
    pub seeds: usize,
    /// Ours next to theirs.
    pub tables: Vec<Table>,
    /// Claims of the paper, with results.
    pub findings: Vec<Finding>,
    /// Contradictions in the paper, by number.
    pub contradictions: Vec<Contradiction>,
    /// Every parameter of the model with where its number comes from.
    pub parameters: Vec<Parameter>,
    /// All of it as a report with the figures.
    #[serde(skip)]
    pub document: Document,
}

/// Reason why the experiments could not be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReproduceError {
    /// A model of a single axis.
    #[error(
        "the paper's experiments need a robot, but {model:?} describes a single axis: give a model with a [robot] table"
    )]
    NotARobot {
        /// Name of the model.
        model: String,
    },
    /// A robot without friction, which leaves nothing to identify and to compensate.
    #[error(
        "the paper's experiments are about friction: add [friction.left] and [friction.right] to the model"
    )]
    NoFriction,
    /// An experiment that could not be run.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// A sweep that gave no friction curve.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The caller broke off.
    #[error("the experiments were cancelled: start them again")]
    Cancelled,
}

/// Runs all experiments of the paper on `model` and compares them with the paper's numbers. `watch` is told the share
/// that is done, from 0 to 1, and may break off.
///
/// # Errors
/// See [`ReproduceError`].
pub fn reproduce(
    model: &Model,
    settings: &Settings<'_>,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Reproduction, ReproduceError> {
    let robot = model.robot().ok_or_else(|| ReproduceError::NotARobot { model: model.name.clone() })?;
    let trials = trials::run_all(model, settings, watch)?;
    let parameters = parameters::parameters(&parameters::complete(model, robot), settings.model_text);
    let mut pages = Pages::default();
    identification::write(robot, &trials.motors, &mut pages);
    tracking::write(robot, &trials.tracking, trials.target_speed_rad_s, &mut pages);
    balance::introduce(robot, &mut pages);
    balance::write(&balance::FLAT, robot, &trials.flat, &mut pages);
    balance::write(&balance::BRIDGE, robot, &trials.bridge, &mut pages);
    causes::write(&trials.causes, &mut pages);
    kick::write(&trials.kick, &trials.windows, &mut pages);
    balance::abstracts_claim(&trials.flat, &trials.bridge, &mut pages);
    assumptions::write(&parameters, settings.model_text, &mut pages);
    let document = document(&model.name, settings, &pages);
    let Pages { tables, findings, mut contradictions, .. } = pages;
    contradictions.sort_by_key(|contradiction| contradiction.number);
    Ok(Reproduction {
        model: model.name.clone(),
        seed: settings.seed,
        seeds: settings.seeds.get(),
        tables,
        findings,
        contradictions,
        parameters,
        document,
    })
}

fn document(model: &str, settings: &Settings<'_>, pages: &Pages) -> Document {
    let verdict = |finding: &Finding| {
        format!("{}: {}.", if finding.holds { "Holds" } else { "Does not hold" }, finding.claim)
    };
    let holds = pages.findings.iter().filter(|finding| finding.holds).count();
    let opening = [
        Block::section("Summary of the claims"),
        Block::paragraph(format!(
            "{holds} of {} claims hold; the values are in the sections.",
            pages.findings.len()
        )),
        Block::List { numbered: false, items: pages.findings.iter().map(verdict).collect() },
    ];
    Document {
        title: "Reproduction of the paper's experiments".to_owned(),
        summary: format!(
            "Model: {model}; noise: {}. Paper: Zhang, Zhou, Zhang, Zheng, Chen, \"Balance Control \
             Method for Bipedal Wheel-Legged Robots Based on Friction Feedforward Linear Quadratic Regulator\", Sensors \
             2025, 25(4), 1056. Simulation: the robot of the model, not a real one. The same model and seed \
             give the same report.",
            match settings.seeds.get() {
                1 => format!("seed {}", settings.seed),
                count => format!("seeds {} to {}", settings.seed, settings.seed_number(count - 1)),
            },
        ),
        blocks: opening.into_iter().chain(pages.blocks.iter().cloned()).collect(),
    }
}
