//! `[[effects]]` of a model file, and its checks.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::refusal::Refusal;
use crate::effects::{Declared, Feedforward};
use crate::model::{AxisModel, RobotModel};
use crate::model::{Effect, MachineKind, Motor};

/// One table, as it was read or is to be written.
pub(super) enum EffectTable {
    Read(toml::Table),
    Written(Effect),
}

impl<'de> Deserialize<'de> for EffectTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        toml::Table::deserialize(deserializer).map(Self::Read)
    }
}

impl Serialize for EffectTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Read(table) => table.serialize(serializer),
            Self::Written(effect) => effect.serialize(serializer),
        }
    }
}

pub(super) fn written(effects: &[Effect]) -> Vec<EffectTable> {
    effects.iter().cloned().map(EffectTable::Written).collect()
}

/// Takes the effects over; those that are errors of declared numbers put these right.
pub(super) fn read_into_robot(tables: Vec<EffectTable>, robot: &mut RobotModel) -> Result<(), Refusal> {
    let declare = |effect: &Effect, robot: &mut RobotModel| effect.declare_in(Declared::Robot(robot));
    for effect in read(tables, MachineKind::Robot, |effect| declare(effect, robot))? {
        robot.effects.push(effect);
    }
    Ok(())
}

/// Reads the effects of a motor or carriage.
pub(super) fn read_into_axis(
    tables: Vec<EffectTable>,
    machine: MachineKind,
    axis: &mut AxisModel,
) -> Result<(), Refusal> {
    let declare = |effect: &Effect, axis: &mut AxisModel| effect.declare_in(Declared::Axis(axis));
    for effect in read(tables, machine, |effect| declare(effect, axis))? {
        axis.effects.push(effect);
    }
    Ok(())
}

/// The effects that no declared number holds.
fn read(
    tables: Vec<EffectTable>,
    machine: MachineKind,
    mut declare: impl FnMut(&Effect) -> bool,
) -> Result<Vec<Effect>, Refusal> {
    let mut effects = Vec::new();
    for (at, table) in tables.into_iter().enumerate() {
        let EffectTable::Read(table) = table else { continue };
        let effect = effect(&table, machine).map_err(|(key, problem)| refusal(at, key, problem))?;
        if effect.kind().feedforward != Feedforward::Declared {
            effects.push(effect);
        } else if !declare(&effect) {
            let problem = format!("{} makes the model physically impossible: correct its value", effect.id());
            return Err(refusal(at, None, problem));
        }
    }
    Ok(effects)
}

fn refusal(at: usize, key: Option<String>, problem: String) -> Refusal {
    let key = key.unwrap_or_else(|| "id".to_owned());
    Refusal { path: vec!["effects".into(), at.to_string().into(), key.into()], problem }
}

/// An effect, or the key of what is wrong and the problem.
fn effect(table: &toml::Table, machine: MachineKind) -> Result<Effect, (Option<String>, String)> {
    let refused = |key: &str, problem: String| Err((Some(key.to_owned()), problem));
    let Some(id) = table.get("id") else {
        let first = table.keys().next().cloned();
        return Err((first, "an effect needs its id: add id = \"…\"".to_owned()));
    };
    let Some(id) = id.as_str() else {
        return refused("id", format!("id = {id} is not a name: write it as id = \"cogging\""));
    };
    let motor = match table.get("motor").map(|motor| (motor, motor.as_str())) {
        None | Some((_, Some("both"))) => None,
        Some((_, Some("left"))) => Some(Motor::Left),
        Some((_, Some("right"))) => Some(Motor::Right),
        Some((motor, _)) => {
            return refused("motor", format!("motor = {motor}: use \"left\", \"right\" or \"both\""));
        }
    };
    let mut parameters = Vec::new();
    let fed = match table.get("feedforward").map(|fed| (fed, fed.as_bool())) {
        None => None,
        Some((_, Some(fed))) => Some(fed),
        Some((fed, None)) => {
            return refused("feedforward", format!("feedforward = {fed}: use true or false"));
        }
    };
    let others = ["id", "motor", "feedforward"];
    for (key, value) in table.iter().filter(|(key, _)| !others.contains(&key.as_str())) {
        let number = value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
        let Some(number) = number else {
            return refused(key, format!("{key} = {value} is not a number: write it as {key} = 0.1"));
        };
        parameters.push((key.as_str(), number));
    }
    let with_feedforward = |effect: Effect| match fed {
        Some(fed) => effect.with_feedforward(fed),
        None => Ok(effect),
    };
    Effect::new(id, machine, motor, parameters)
        .and_then(with_feedforward)
        .map_err(|error| (error.key, error.problem))
}
