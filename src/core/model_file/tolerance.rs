//! How well the declared numbers are known.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::refusal::Refusal;
use crate::effects::MachineKind;
use crate::parameter::{ParameterError, within};

/// Shares of themselves by which declared numbers may be off; what a file does not name has its group's default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerances {
    /// Key and share, sorted by the key.
    named: Vec<(&'static str, f64)>,
}

/// Numbers of one kind.
struct Group {
    key: &'static str,
    share: f64,
    members: &'static [(&'static str, &'static [MachineKind])],
}

const ROBOT: &[MachineKind] = &[MachineKind::Robot];
const ROTARY: &[MachineKind] = &[MachineKind::Rotary];
const LINEAR: &[MachineKind] = &[MachineKind::Linear];
const TURNING: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary];
const ALL: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];

const MASSES: Group = Group {
    key: "masses",
    share: 0.02,
    members: &[("body_mass_kg", ROBOT), ("wheel_mass_kg", ROBOT), ("mass_kg", LINEAR)],
};
const LENGTHS: Group =
    Group { key: "lengths", share: 0.01, members: &[("wheel_radius_m", ROBOT), ("com_height_m", ROBOT)] };
const INERTIAS: Group = Group {
    key: "inertias",
    share: 0.05,
    members: &[("wheel_inertia_kg_m2", ROBOT), ("body_inertia_kg_m2", ROBOT), ("inertia_kg_m2", ROTARY)],
};
const FRICTION: Group = Group {
    key: "friction",
    share: 0.1,
    members: &[
        ("coulomb_nm", TURNING),
        ("static_nm", TURNING),
        ("viscous_nm_s_rad", TURNING),
        ("stribeck_speed_rad_s", TURNING),
        ("offset_nm", TURNING),
        ("coulomb_n", LINEAR),
        ("static_n", LINEAR),
        ("viscous_n_s_m", LINEAR),
        ("stribeck_speed_m_s", LINEAR),
        ("offset_n", LINEAR),
        ("stribeck_exponent", ALL),
    ],
};
const GROUPS: [Group; 4] = [MASSES, LENGTHS, INERTIAS, FRICTION];
/// A mass on a lever: known as well as both together.
const GRAVITY: &str = "gravity_torque_nm";

impl Tolerances {
    /// By which share of itself the number with this key of the model file may be off; 0 where it has no tolerance.
    /// The group names `masses`, `lengths`, `inertias` and `friction` are keys too.
    pub fn share_of(&self, key: &str) -> f64 {
        if let Some((_, share)) = self.named.iter().find(|(name, _)| *name == key) {
            return *share;
        }
        if key == GRAVITY {
            return self.share_of(MASSES.key) + self.share_of(LENGTHS.key);
        }
        if let Some(group) = GROUPS.iter().find(|group| group.key == key) {
            return group.share;
        }
        let group = GROUPS.iter().find(|group| group.members.iter().any(|(member, _)| *member == key));
        group.map_or(0.0, |group| self.share_of(group.key))
    }

    /// Says how well a number, or a group of them, is known.
    ///
    /// # Errors
    /// A share below 0 or above 1, or a key that no model has.
    pub fn set(&mut self, key: &str, share: f64) -> Result<(), ParameterError> {
        let Some(key) = keys(ALL).find(|name| *name == key) else {
            let allowed = "left out, because no number of a model file has this key";
            return Err(ParameterError { name: "tolerance", value: share, allowed: allowed.into() });
        };
        within(key, share, 0.0..=1.0, "a share from 0 to 1")?;
        match self.named.binary_search_by_key(&key, |(name, _)| *name) {
            Ok(place) => self.named[place].1 = share,
            Err(place) => self.named.insert(place, (key, share)),
        }
        Ok(())
    }

    fn read(table: &toml::Table, machine: MachineKind) -> Result<Self, Refusal> {
        let mut found = Self::default();
        for (key, value) in table {
            let refused =
                |problem: String| Refusal { path: vec!["tolerance".into(), key.clone().into()], problem };
            if !keys(&[machine]).any(|name| name == key) {
                let allowed = keys(&[machine]).collect::<Vec<_>>().join(", ");
                return Err(refused(format!("unknown key `{key}` in [tolerance]: use {allowed}")));
            }
            let number = value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
            let Some(share) = number else {
                return Err(refused(format!(
                    "{key} = {value} is not a number: write a share as {key} = 0.02"
                )));
            };
            found.set(key, share).map_err(|error| refused(error.to_string()))?;
        }
        Ok(found)
    }
}

/// All keys that machines of some kinds may have.
fn keys(kinds: &[MachineKind]) -> impl Iterator<Item = &'static str> {
    let has = |on: &[MachineKind]| on.iter().any(|kind| kinds.contains(kind));
    let mut found = Vec::new();
    for group in &GROUPS {
        let members: Vec<_> =
            group.members.iter().filter(|(_, on)| has(on)).map(|(member, _)| *member).collect();
        if !members.is_empty() {
            found.push(group.key);
            found.extend(members);
        }
    }
    if has(ROTARY) {
        found.push(GRAVITY);
    }
    found.into_iter()
}

/// `[tolerance]`, as it was read or is to be written.
pub(super) enum ToleranceTable {
    Read(toml::Table),
    Written(Tolerances),
}

impl ToleranceTable {
    pub(super) fn is_default(&self) -> bool {
        match self {
            Self::Read(table) => table.is_empty(),
            Self::Written(tolerances) => tolerances.named.is_empty(),
        }
    }

    pub(super) fn read(self, machine: MachineKind) -> Result<Tolerances, Refusal> {
        match self {
            Self::Read(table) => Tolerances::read(&table, machine),
            Self::Written(tolerances) => Ok(tolerances),
        }
    }
}

impl Default for ToleranceTable {
    fn default() -> Self {
        Self::Written(Tolerances::default())
    }
}

impl<'de> Deserialize<'de> for ToleranceTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        toml::Table::deserialize(deserializer).map(Self::Read)
    }
}

impl Serialize for ToleranceTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Read(table) => table.serialize(serializer),
            Self::Written(tolerances) => serializer.collect_map(tolerances.named.iter().copied()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Model;
    use super::*;

    const SHAFT: &str = "name = \"shaft\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.005\n";
    const RAIL: &str = "name = \"rail\"\n[axis]\nkind = \"linear\"\nmass_kg = 95.0\n";

    #[test]
    fn a_number_goes_before_its_group_and_a_group_before_the_default() {
        let text = format!("{SHAFT}[tolerance]\nfriction = 0.3\ncoulomb_nm = 0\n");
        let model = Model::from_toml(&text, "m.toml").unwrap();
        let share = |key| model.tolerance.share_of(key);
        assert_eq!(
            (share("coulomb_nm"), share("viscous_nm_s_rad"), share("inertia_kg_m2")),
            (0.0, 0.3, 0.05)
        );
        assert_eq!((share("gravity_torque_nm"), share("nothing")), (0.03, 0.0));
        assert_eq!(Model::from_toml(&model.to_toml(), "again").unwrap(), model, "{}", model.to_toml());
    }

    #[test]
    fn defaults_are_not_written_and_every_number_of_a_machine_has_one() {
        for (text, key, share) in [
            (SHAFT, "inertia_kg_m2", 0.05),
            (RAIL, "mass_kg", 0.02),
            (super::super::presets::ALL[0].1, "com_height_m", 0.01),
        ] {
            let model = Model::from_toml(text, "m.toml").unwrap();
            assert_eq!(model.tolerance.share_of(key), share);
            assert!(!model.to_toml().contains("[tolerance]"));
        }
    }

    #[test]
    fn each_mistake_is_named_with_its_line() {
        for (text, key, part) in [
            (SHAFT, "inertia_kg_m2 = -0.1", "inertia_kg_m2 = -0.1 is out of range"),
            (SHAFT, "friction = 20", "a share from 0 to 1"),
            (SHAFT, "friction = \"high\"", "is not a number"),
            (SHAFT, "body_mass_kg = 0.1", "unknown key `body_mass_kg`"),
            (RAIL, "coulomb_nm = 0.1", "use masses, mass_kg, friction, coulomb_n"),
        ] {
            let error = Model::from_toml(&format!("{text}[tolerance]\n{key}\n"), "m.toml").unwrap_err();
            assert!((error.line, error.problem.contains(part)) == (6, true), "{error} ({part})");
        }
        let mut tolerances = Tolerances::default();
        assert!(tolerances.set("colour", 0.1).is_err() && tolerances.set("masses", 0.5).is_ok());
        assert_eq!(tolerances.share_of("body_mass_kg"), 0.5);
    }

    #[test]
    fn the_order_in_which_shares_are_set_does_not_count() {
        let set = |keys: &[(&str, f64)]| {
            let mut found = Tolerances::default();
            keys.iter().for_each(|&(key, share)| found.set(key, share).unwrap());
            found
        };
        assert_eq!(
            set(&[("friction", 0.2), ("masses", 0.1), ("friction", 0.3)]),
            set(&[("masses", 0.1), ("friction", 0.3)])
        );
    }
}
