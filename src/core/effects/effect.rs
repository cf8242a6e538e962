//! An effect of a certain size on a certain machine.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::kind::{Declared, EffectKind, Feedforward, Parameter, Role};
use super::law::{Action, Law, MotionSample, Term};
use super::machine::Machine;
use super::{KINDS, kind};
use crate::model::{Effect, MachineKind, Motor};

/// A value of an effect that the library refuses.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct EffectError {
    /// Key of the refused value; `None` if one is missing.
    pub key: Option<String>,
    /// What is wrong and how to fix it.
    pub problem: String,
}

impl EffectError {
    pub(crate) fn at(key: &str, problem: String) -> Self {
        Self { key: Some(key.to_owned()), problem }
    }
}

impl Effect {
    /// An effect on a kind of machine; on a robot of one motor, or of both where none is named. Parameters may come in
    /// any order.
    ///
    /// # Errors
    /// An id, motor or key that the library does not know on such a machine, a parameter that is missing, and a value
    /// outside of its physical range.
    ///
    /// ```
    /// use flqr_core::model::{Effect, MachineKind, Motor};
    ///
    /// let parameters = [("order_1", 7.0), ("cos_1_nm", 0.05), ("sin_1_nm", 0.03)];
    /// let cogging = Effect::new("cogging", MachineKind::Robot, Some(Motor::Left), parameters)?;
    /// assert_eq!(cogging.get("cos_1_nm"), Some(0.05));
    /// assert!(Effect::new("cogging", MachineKind::Robot, None, [("order_1", 7.0)]).is_err()); // no amplitude
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new<K: AsRef<str>>(
        id: &str,
        machine: MachineKind,
        motor: Option<Motor>,
        parameters: impl IntoIterator<Item = (K, f64)>,
    ) -> Result<Self, EffectError> {
        let kind = kind_on(id, machine)?;
        if let Some(motor) = motor
            && !(kind.per_motor() && machine == MachineKind::Robot)
        {
            let problem = format!("{id} does not act on one motor: remove motor = \"{motor}\"");
            return Err(EffectError::at("motor", problem));
        }
        let given: Vec<(K, f64)> = parameters.into_iter().collect();
        let members = members(kind, machine, given.iter().map(|(key, _)| key.as_ref()));
        let allowed = keys(kind, machine, members);
        if let Some((unknown, _)) =
            given.iter().find(|(key, _)| allowed.iter().all(|(known, _)| key.as_ref() != known))
        {
            return Err(unknown_key(kind, machine, unknown.as_ref()));
        }
        let mut parameters = Vec::with_capacity(allowed.len());
        for (key, parameter) in allowed {
            let value = given.iter().find(|(name, _)| name.as_ref() == key).map(|&(_, value)| value);
            let Some(value) = value.or(parameter.default) else {
                let problem = format!("{id} lacks {key} ({}): add it", parameter.description);
                return Err(EffectError { key: None, problem });
            };
            check(id, &key, parameter, machine, value)?;
            parameters.push((key, value));
        }
        Ok(Self { id: kind.id, motor, parameters, fed: true })
    }

    /// The effect of an estimate: shape parameters as [`EffectKind::terms`] takes them, and the amplitudes in the order
    /// of those terms.
    ///
    /// # Errors
    /// As [`Effect::new`]; a list that is too short or too long.
    pub fn estimated(
        kind: &'static EffectKind,
        machine: MachineKind,
        motor: Option<Motor>,
        shape: &[f64],
        amplitudes: &[f64],
    ) -> Result<Self, EffectError> {
        let count = |role| kind.parameters.iter().filter(|parameter| parameter.role == role).count().max(1);
        let members = if kind.series() { shape.len() / count(Role::Shape) } else { 1 };
        let (mut shapes, mut sizes) = (shape.iter(), amplitudes.iter());
        let mut values = Vec::new();
        for (key, parameter) in keys(kind, machine, members) {
            let next = if parameter.role == Role::Shape { shapes.next() } else { sizes.next() };
            values.extend(next.map(|&value| (key, value)));
        }
        if shapes.next().or(sizes.next()).is_some() {
            let problem =
                format!("{} has fewer parameters than values: give one value per parameter", kind.id);
            return Err(EffectError { key: None, problem });
        }
        Self::new(kind.id, machine, motor, values)
    }

    /// Returns the effect for a shaft with an angle offset: at an angle q as this one at q + `turn_rad`. The same
    /// for one that does not return with every turn.
    #[must_use]
    pub fn turned(&self, turn_rad: f64) -> Self {
        let mut turned = self.clone();
        if self.kind().series() {
            for member in turned.parameters.chunks_exact_mut(self.kind().parameters.len()) {
                let [(_, order), (_, cos), (_, sin)] = member else { continue };
                let (s, c) = (*order * turn_rad).sin_cos();
                (*cos, *sin) = (*cos * c + *sin * s, *sin * c - *cos * s);
            }
        }
        turned
    }

    /// Returns its kind.
    pub fn kind(&self) -> &'static EffectKind {
        kind(self.id).expect("an effect is only made of a kind of the library")
    }

    /// Returns it with feedforward enabled or disabled (`feedforward = false` in a model file). The simulator
    /// has it either way.
    ///
    /// # Errors
    /// One that no controller can cancel.
    pub fn with_feedforward(self, fed: bool) -> Result<Self, EffectError> {
        match self.kind().feedforward {
            Feedforward::Never(reason) if fed => {
                let problem = format!("{} cannot be fed forward ({reason}): remove the key", self.kind().id);
                Err(EffectError::at("feedforward", problem))
            }
            _ => Ok(Self { fed, ..self }),
        }
    }

    /// Returns whether a controller cancels it.
    pub fn is_fed_forward(&self) -> bool {
        self.fed && self.kind().feedforward == Feedforward::Causal
    }

    /// Values of one role in their order.
    pub fn values(&self, role: Role) -> Vec<f64> {
        let own = |at: usize| &self.kind().parameters[at % self.kind().parameters.len()];
        let of_role = |&(at, _): &(usize, &(String, f64))| own(at).role == role;
        self.parameters.iter().enumerate().filter(of_role).map(|(_, &(_, value))| value).collect()
    }

    /// Returns whether it is in a motor of a robot.
    pub fn is_in(&self, motor: Motor) -> bool {
        self.kind().per_motor() && self.motor.is_none_or(|own| own == motor)
    }

    /// Its law on a machine: the sum of its terms, each times its amplitude.
    pub fn law(&self, machine: &Machine) -> EffectLaw {
        let amplitude = |term: &Term| term.amplitude.as_ref().map_or(1.0, |key| self.get(key).unwrap_or(0.0));
        let terms = self.kind().terms(machine, &self.values(Role::Shape));
        EffectLaw { terms: terms.into_iter().map(|term| (amplitude(&term), term.law)).collect() }
    }

    /// Writes it into a model's declared numbers, and says whether they hold all of it.
    pub fn declare_in(&self, model: Declared<'_>) -> bool {
        (self.kind().declare)(self, model)
    }
}

/// An effect's law on a machine, with its memory.
#[derive(Clone)]
pub struct EffectLaw {
    terms: Vec<(f64, Box<dyn Law>)>,
}

impl Law for EffectLaw {
    fn act(&mut self, moment: &MotionSample) -> Action {
        let mut sum = Action::default();
        for (amplitude, law) in &mut self.terms {
            sum = sum.plus(*amplitude, &law.act(moment));
        }
        sum
    }

    fn at(&self, moment: &MotionSample) -> Option<Action> {
        let add = |sum: Action, (amplitude, law): &(f64, Box<dyn Law>)| {
            Some(sum.plus(*amplitude, &law.at(moment)?))
        };
        self.terms.iter().try_fold(Action::default(), add)
    }

    fn boxed_clone(&self) -> Box<dyn Law> {
        Box::new(self.clone())
    }
}

impl std::fmt::Debug for EffectLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let amplitudes: Vec<f64> = self.terms.iter().map(|(amplitude, _)| *amplitude).collect();
        f.debug_struct("EffectLaw").field("amplitudes", &amplitudes).finish_non_exhaustive()
    }
}

/// As a table of a model file.
impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut table = serializer.serialize_map(None)?;
        table.serialize_entry("id", self.id())?;
        if let Some(motor) = self.motor {
            table.serialize_entry("motor", &motor.to_string())?;
        }
        for (key, value) in &self.parameters {
            table.serialize_entry(key, value)?;
        }
        if !self.fed {
            table.serialize_entry("feedforward", &false)?;
        }
        table.end()
    }
}

fn kind_on(id: &str, machine: MachineKind) -> Result<&'static EffectKind, EffectError> {
    let refused = |problem| Err(EffectError::at("id", problem));
    let known = || {
        let ids: Vec<&str> = KINDS.iter().filter(|kind| kind.is_on(machine)).map(|kind| kind.id).collect();
        ids.join(", ")
    };
    match kind(id) {
        None => refused(format!("unknown effect {id}: use one of {}", known())),
        Some(kind) if !kind.is_on(machine) => {
            let machine = match machine {
                MachineKind::Robot => "a robot",
                MachineKind::Rotary => "a rotary axis",
                MachineKind::Linear => "a linear axis",
            };
            refused(format!("{id} does not apply to {machine}: use one of {}", known()))
        }
        Some(kind) => Ok(kind),
    }
}

/// Keys of an effect with `members` members, and what they are.
fn keys(
    kind: &'static EffectKind,
    machine: MachineKind,
    members: usize,
) -> Vec<(String, &'static Parameter)> {
    let key = |parameter: &Parameter, member: usize| parameter.key(machine).replace('#', &member.to_string());
    (1..=members).flat_map(|member| kind.parameters.iter().map(move |p| (key(p, member), p))).collect()
}

/// Members of a series up to the highest number of a known key; 1 for an effect that is none.
fn members<'a>(kind: &EffectKind, machine: MachineKind, given: impl Iterator<Item = &'a str>) -> usize {
    let number = |key: &str| {
        kind.parameters.iter().find_map(|parameter| {
            let (before, after) = parameter.key(machine).split_once('#')?;
            let number: usize = key.strip_prefix(before)?.strip_suffix(after)?.parse().ok()?;
            (number <= MOST_MEMBERS).then_some(number)
        })
    };
    if kind.series() { given.filter_map(number).max().unwrap_or(1).max(1) } else { 1 }
}

/// Most members of a series; more are a mistyped number.
const MOST_MEMBERS: usize = 64;

fn unknown_key(kind: &EffectKind, machine: MachineKind, unknown: &str) -> EffectError {
    let known: Vec<String> =
        kind.parameters.iter().map(|parameter| parameter.key(machine).replace('#', "1")).collect();
    let more = if kind.series() { " and so on with 2, 3, …" } else { "" };
    let problem = format!("{} has no parameter {unknown}: use {}{more}", kind.id, known.join(", "));
    EffectError::at(unknown, problem)
}

fn check(
    id: &str,
    key: &str,
    parameter: &Parameter,
    machine: MachineKind,
    value: f64,
) -> Result<(), EffectError> {
    let [lowest, highest] = parameter.range(machine);
    if !(lowest..=highest).contains(&value) {
        let problem =
            format!("{key} = {value} of {id} is out of range: it must be from {lowest} to {highest}");
        return Err(EffectError::at(key, problem));
    }
    if parameter.whole && machine != MachineKind::Linear && value.fract() != 0.0 {
        let problem = format!("{key} = {value} of {id} must be a whole number");
        return Err(EffectError::at(key, problem));
    }
    Ok(())
}
