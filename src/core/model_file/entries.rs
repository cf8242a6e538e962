//! A model as a flat list of what its file says, to tell two apart.

use std::collections::BTreeMap;
use std::fmt;

use toml::Value;

use crate::model::Model;

/// One value of a model file.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A number in the file's unit.
    Number(f64),
    /// Anything else, as it is written.
    Text(String),
}

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => text.fmt(f),
        }
    }
}

impl Model {
    /// All values of the model's file, each with its table in front: `robot.body_mass_kg`, and with its place in
    /// lists, counted from 1: `lqr.r_diagonal[2]`.
    pub fn entries(&self) -> BTreeMap<String, Entry> {
        let table = self.to_toml().parse::<toml::Table>().expect("what was just written has a TOML form");
        let mut entries = BTreeMap::new();
        for (key, value) in table {
            flatten(key, value, &mut entries);
        }
        entries
    }
}

fn flatten(key: String, value: Value, entries: &mut BTreeMap<String, Entry>) {
    let entry = match value {
        Value::Table(table) => {
            for (name, value) in table {
                flatten(format!("{key}.{name}"), value, entries);
            }
            return;
        }
        Value::Array(values) => {
            for (index, value) in values.into_iter().enumerate() {
                flatten(format!("{key}[{}]", index + 1), value, entries);
            }
            return;
        }
        Value::Float(number) => Entry::Number(number),
        Value::Integer(number) => Entry::Number(number as f64),
        Value::String(text) => Entry::Text(text),
        other => Entry::Text(other.to_string()),
    };
    entries.insert(key, entry);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_of_a_file_has_its_place() {
        let text = "name = \"R\"\n[robot]\nbody_mass_kg = 13.0\nwheel_mass_kg = 1.0\nwheel_inertia_kg_m2 = 0.005\n\
            wheel_radius_m = 0.1\ncom_height_m = 0.25\nbody_inertia_kg_m2 = 0.25\n\
            [lqr]\nq_diagonal = [60.0, 30.0, 100.0, 5.0]\nr_diagonal = [20.0, 21.0]\n";
        let entries = Model::from_toml(text, "test").unwrap().entries();
        assert_eq!(entries["name"], Entry::Text("R".to_owned()));
        assert_eq!(entries["robot.body_mass_kg"], Entry::Number(13.0));
        assert_eq!(entries["lqr.q_diagonal[3]"], Entry::Number(100.0));
        assert_eq!(entries["lqr.r_diagonal[2]"], Entry::Number(21.0));
    }
}
