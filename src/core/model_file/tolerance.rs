//! The `[tolerance]` table of a model file.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::refusal::Refusal;
use crate::model::{MachineKind, Tolerances, tolerance_keys};

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
            Self::Read(table) => read(&table, machine),
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

fn read(table: &toml::Table, machine: MachineKind) -> Result<Tolerances, Refusal> {
    let mut found = Tolerances::default();
    for (key, value) in table {
        let refused =
            |problem: String| Refusal { path: vec!["tolerance".into(), key.clone().into()], problem };
        if !tolerance_keys(&[machine]).any(|name| name == key) {
            let allowed = tolerance_keys(&[machine]).collect::<Vec<_>>().join(", ");
            return Err(refused(format!("unknown key `{key}` in [tolerance]: use {allowed}")));
        }
        let number = value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
        let Some(share) = number else {
            return Err(refused(format!(
                "{key} = {value} is not a number: write a fraction as {key} = 0.02"
            )));
        };
        found.set(key, share).map_err(|error| refused(error.to_string()))?;
    }
    Ok(found)
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
            (SHAFT, "friction = 20", "a fraction from 0 to 1"),
            (SHAFT, "friction = \"high\"", "is not a number"),
            (SHAFT, "body_mass_kg = 0.1", "unknown key `body_mass_kg`"),
            (RAIL, "coulomb_nm = 0.1", "use masses, mass_kg, friction, stribeck_exponent, coulomb_n"),
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
