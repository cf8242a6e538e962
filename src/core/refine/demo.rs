//! The whole loop without hardware or files: a simulated robot with something that its model does not have.

use std::ops::ControlFlow;

use serde::Serialize;

use super::error::RefineError;
use super::verdict::Refinement;
use super::{Options, refine};
use crate::model::{Effect, MachineKind, Model, Rig, RobotParameters};
use crate::model_file::presets;
use crate::record::Log;
use crate::report::{Block, Cell, Column, Table};
use crate::simulate::{self, ControllerChoice, Experiment, ExperimentError, Noise, Scenario};

/// Length of each record, s.
const SECONDS: f64 = 30.0;
/// Standard deviation of the hidden robot's parameter errors.
const MASS_OFF: f64 = 0.005;
const LENGTH_OFF: f64 = 0.0025;
const INERTIA_OFF: f64 = 0.0125;

/// Result of a demonstration.
#[derive(Clone, Debug, Serialize)]
pub struct Demonstration {
    /// Effects identified from the recorded data.
    #[serde(flatten)]
    pub found: Refinement,
    /// True effect, unknown to the search.
    pub truth: Truth,
    /// Recorded data.
    #[serde(skip)]
    pub logs: Vec<Log>,
}

/// Hidden effect of a demonstration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// The effect, as in a model file.
    pub effect: Effect,
    /// True if it is among the effects that were found, or among those that were not distinguished from one of them.
    pub named: bool,
}

/// Reason why there is no demonstration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DemonstrationError {
    /// A run that could not be recorded.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// A search that did not end.
    #[error(transparent)]
    Refine(#[from] RefineError),
}

/// Hidden effects; the seed chooses.
const HIDDEN: [(&str, &[(&str, f64)]); 4] = [
    ("cogging", &[("order_1", 7.0), ("cos_1_nm", 0.05), ("sin_1_nm", 0.03)]),
    ("tether_spring", &[("stiffness_n_m", 6.0), ("pull_n", 0.8)]),
    ("load_dependent_friction", &[("coefficient", 0.15)]),
    ("torque_gain", &[("gain", -0.12)]),
];

/// Records a robot that has something its model lacks, and closes the loop with the records: the paper's robot, its
/// numbers off within their tolerances, driven out and back and shaken under the declared model's controller. `seed`
/// chooses what is hidden and draws all noise. `watch` is told the fraction of the work that is done.
///
/// # Errors
/// The watcher ended it.
pub fn demonstrate(
    seed: u64,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Demonstration, DemonstrationError> {
    let declared = presets::paper();
    let (hidden, actual) = hidden_robot(&declared, seed);
    let mut logs = Vec::new();
    for (number, scenario) in [Scenario::Cruise, Scenario::Multisine].into_iter().enumerate() {
        let experiment =
            Experiment { seconds: SECONDS, seed, ..Experiment::new(scenario, ControllerChoice::Flqr) };
        let mut part = |share: f64| watch(0.1 * (number as f64 + share));
        let outcome = simulate::run(&experiment, &declared, &actual, &mut part)?;
        let mut log = outcome.log(crate::model::Motor::Left);
        log.source = format!("recording of the scenario {scenario}");
        logs.push(log);
    }
    let options = Options { seed, ..Options::default() };
    let mut found = refine(&declared, &logs, &[], &options, &mut |share| watch(0.2 + 0.8 * share))?;
    let named = found.effects.iter().any(|effect| {
        effect.effect.kind() == hidden.kind() || effect.ambiguous_with.contains(&hidden.kind())
    });
    let truth = Truth { effect: hidden, named };
    tell(&truth, &mut found);
    Ok(Demonstration { found, truth, logs })
}

fn hidden_robot(declared: &Model, seed: u64) -> (Effect, Model) {
    let (id, parameters) = HIDDEN[(seed.wrapping_sub(1) % HIDDEN.len() as u64) as usize];
    let effect = Effect::new(id, MachineKind::Robot, None, parameters.iter().copied())
        .expect("a test makes every hidden effect");
    let mut actual = declared.clone();
    if let Rig::Robot(robot) = &mut actual.rig {
        let mut noise = Noise::new(seed, u64::MAX);
        let mut off = |value: f64, deviation: f64| {
            value * (1.0 + noise.normal(deviation).clamp(-2.0 * deviation, 2.0 * deviation))
        };
        let p = robot.parameters;
        robot.set_parameters(RobotParameters {
            body_mass_kg: off(p.body_mass_kg, MASS_OFF),
            com_height_m: off(p.com_height_m, LENGTH_OFF),
            body_inertia_kg_m2: off(p.body_inertia_kg_m2, INERTIA_OFF),
            wheel_inertia_kg_m2: off(p.wheel_inertia_kg_m2, INERTIA_OFF),
            ..p
        });
        robot.effects.push(effect.clone());
    }
    (effect, actual)
}

/// Adds the truth to the report, at its end.
fn tell(truth: &Truth, found: &mut Refinement) {
    let own = found.effects.iter().find(|effect| effect.effect.kind() == truth.effect.kind());
    let row = |(key, value): &(String, f64)| {
        let estimate = own.and_then(|own| own.effect.get(key));
        let interval = own.and_then(|own| {
            let place = own.effect.parameters().iter().position(|(name, _)| name == key)?;
            own.ci95[place]
        });
        let number = |value: Option<f64>| value.map_or(Cell::Empty, |value| Cell::significant(value, 4));
        vec![
            Cell::text(truth.effect.id()),
            Cell::text(key.clone()),
            Cell::significant(*value, 4),
            number(estimate),
            number(interval.map(|ends| ends[0])),
            number(interval.map(|ends| ends[1])),
        ]
    };
    let table = Table {
        caption: "Hidden effect and identified effects".to_owned(),
        columns: vec![
            Column::new("Effect", ""),
            Column::new("Parameter", ""),
            Column::new("True", ""),
            Column::new("Found", ""),
            Column::grouped("95 % interval", "from", ""),
            Column::grouped("95 % interval", "to", ""),
        ],
        rows: truth.effect.parameters().iter().map(row).collect(),
        note: String::new(),
    };
    found.document.blocks.push(Block::section("Hidden effect of this demonstration"));
    found.document.blocks.push(Block::paragraph(
        "The robot was simulated with an effect that its model does not have. The identification uses the recorded data only.",
    ));
    found.document.blocks.push(Block::Table(table));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hidden_effect_can_be_made_and_the_robot_is_another_one() {
        let declared = presets::paper();
        let hidden = [
            (0, "torque_gain", "gain", -0.12),
            (1, "cogging", "sin_1_nm", 0.03),
            (2, "tether_spring", "stiffness_n_m", 6.0),
            (3, "load_dependent_friction", "coefficient", 0.15),
            (4, "torque_gain", "gain", -0.12),
        ];
        for (seed, id, key, value) in hidden {
            let (effect, actual) = hidden_robot(&declared, seed);
            assert_eq!((effect.id(), effect.get(key)), (id, Some(value)), "seed {seed}");
            let robot = actual.robot().unwrap();
            assert_eq!(robot.effects, [effect]);
            let mass = robot.parameters.body_mass_kg / declared.robot().unwrap().parameters.body_mass_kg;
            assert!(mass != 1.0 && (mass - 1.0).abs() <= 0.01, "seed {seed}: {mass}");
            assert!(robot.validate().is_ok());
        }
    }
}
