//! Tolerances of the declared numbers.

use super::{MachineKind, ModelParameter, PARAMETERS, ToleranceGroup};
use crate::parameter::{ParameterError, within};

/// Fractions of themselves by which declared numbers may be off; what a file does not name has its group's default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerances {
    /// Key and share, sorted by the key.
    pub(crate) named: Vec<(&'static str, f64)>,
}

/// A tolerance that several parameters share: key, default fraction, members.
const GROUPS: [(&str, f64, ToleranceGroup); 4] = [
    ("masses", 0.02, ToleranceGroup::Masses),
    ("lengths", 0.01, ToleranceGroup::Lengths),
    ("inertias", 0.05, ToleranceGroup::Inertias),
    ("friction", 0.1, ToleranceGroup::Friction),
];

impl Tolerances {
    /// By which fraction of itself the number with this key of the model file may be off; 0 where it has no tolerance.
    /// The group names `masses`, `lengths`, `inertias` and `friction` are keys too.
    pub fn share_of(&self, key: &str) -> f64 {
        if let Some((_, share)) = self.named.iter().find(|(name, _)| *name == key) {
            return *share;
        }
        if let Some((_, share, _)) = GROUPS.iter().find(|(group, ..)| *group == key) {
            return *share;
        }
        match ModelParameter::of_key(key).map(|parameter| parameter.tolerance) {
            Some(ToleranceGroup::MassesAndLengths) => self.share_of("masses") + self.share_of("lengths"),
            Some(own) => {
                let group = GROUPS.iter().find(|(_, _, group)| *group == own);
                group.map_or(0.0, |(key, ..)| self.share_of(key))
            }
            None => 0.0,
        }
    }

    /// Says how well a number, or a group of them, is known.
    ///
    /// # Errors
    /// A share below 0 or above 1, or a key that no model has.
    pub fn set(&mut self, key: &str, share: f64) -> Result<(), ParameterError> {
        let Some(key) = tolerance_keys(&MachineKind::ALL).find(|name| *name == key) else {
            let allowed = "left out, because no parameter of a model file has this name";
            return Err(ParameterError { name: "tolerance", value: share, allowed: allowed.into() });
        };
        within(key, share, 0.0..=1.0, "a fraction from 0 to 1")?;
        match self.named.binary_search_by_key(&key, |(name, _)| *name) {
            Ok(place) => self.named[place].1 = share,
            Err(place) => self.named.insert(place, (key, share)),
        }
        Ok(())
    }
}

/// All keys that machines of some kinds may have.
pub(crate) fn tolerance_keys(kinds: &[MachineKind]) -> impl Iterator<Item = &'static str> {
    let members = |group: ToleranceGroup| {
        let own = move |parameter: &&ModelParameter| parameter.tolerance == group;
        let on = |parameter: &&ModelParameter| parameter.machines.iter().any(|kind| kinds.contains(kind));
        PARAMETERS.iter().filter(own).filter(on).map(|parameter| parameter.key).collect::<Vec<_>>()
    };
    let mut found = Vec::new();
    for (key, _, group) in GROUPS {
        let members = members(group);
        if !members.is_empty() {
            found.push(key);
            found.extend(members);
        }
    }
    found.extend(members(ToleranceGroup::MassesAndLengths));
    found.into_iter()
}
