//! What differs between two models, key by key as their files would have it.

use super::Model;

/// A key that two models do not have alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Tables and key with points between them, and the number of an entry of a list from 1 in brackets:
    /// `lqr.q_diagonal[3]`.
    pub key: String,
    /// Value of before; none where the key was not there.
    pub old: Option<String>,
    /// Value of now; none where the key is gone.
    pub new: Option<String>,
}

impl Model {
    /// What is other in `new`, in the order of the keys.
    pub fn changes_to(&self, new: &Self) -> Vec<Change> {
        let (old, new) = (leaves(self), leaves(new));
        let value = |all: &[(String, String)], key: &str| {
            all.iter().find(|(other, _)| other == key).map(|(_, value)| value.clone())
        };
        let mut changes: Vec<Change> = old
            .iter()
            .map(|(key, value_of_old)| Change {
                key: key.clone(),
                old: Some(value_of_old.clone()),
                new: value(&new, key),
            })
            .collect();
        let added = new.iter().filter(|(key, _)| value(&old, key).is_none());
        changes.extend(added.map(|(key, value)| Change {
            key: key.clone(),
            old: None,
            new: Some(value.clone()),
        }));
        changes.retain(|change| change.old != change.new);
        changes.sort_by(|a, b| a.key.cmp(&b.key));
        changes
    }
}

/// Keys with the values that are no tables.
fn leaves(model: &Model) -> Vec<(String, String)> {
    let table: toml::Table = model.to_toml().parse().expect("a model's own text is TOML");
    let mut found = Vec::new();
    collect(String::new(), &toml::Value::Table(table), &mut found);
    found
}

fn collect(key: String, value: &toml::Value, found: &mut Vec<(String, String)>) {
    match value {
        toml::Value::Table(table) => {
            for (name, value) in table {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                collect(key, value, found);
            }
        }
        toml::Value::Array(array) => {
            for (index, value) in array.iter().enumerate() {
                collect(format!("{key}[{}]", index + 1), value, found);
            }
        }
        toml::Value::String(text) => found.push((key, text.clone())),
        toml::Value::Float(number) => found.push((key, number.to_string())),
        other => found.push((key, other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::presets;

    #[test]
    fn every_key_that_differs_is_named_once_with_both_values() {
        let old = presets::paper();
        assert_eq!(old.changes_to(&old), []);
        let text = old.to_toml();
        let mut new = Model::from_toml(&text, "m").unwrap();
        new.name = "another".to_owned();
        let crate::model_file::Rig::Robot(robot) = &mut new.rig else { panic!("the paper has a robot") };
        robot.parameters.body_mass_kg = 20.0;
        robot.friction[1] = None;
        robot.effects.clear();
        let changes = old.changes_to(&new);
        let find = |key: &str| changes.iter().find(|change| change.key == key).cloned();
        let mass = find("robot.body_mass_kg").unwrap();
        assert_eq!((mass.old, mass.new), (Some("13".to_owned()), Some("20".to_owned())));
        assert_eq!(find("name").unwrap().new.as_deref(), Some("another"));
        let gone = find("friction.right.coulomb_nm").unwrap();
        assert!(gone.old.is_some() && gone.new.is_none(), "{gone:?}");
        assert_eq!(changes.len(), 2 + 6, "{changes:?}");
        let back = new.changes_to(&old);
        assert_eq!(back.len(), changes.len());
        assert!(back.iter().zip(&changes).all(|(a, b)| (&a.old, &a.new) == (&b.new, &b.old)));
    }
}
