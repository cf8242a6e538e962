//! Differences between two models by key of their files.

use std::collections::BTreeSet;

use super::Entry;
use crate::model::Model;

/// A key that two models do not have alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Tables and key with points between them, and the number of an entry of a list from 1 in brackets:
    /// `lqr.q_diagonal[3]`.
    pub key: String,
    /// Value of before; `None` if the key was not there.
    pub old: Option<String>,
    /// Value of now; `None` if the key is gone.
    pub new: Option<String>,
}

impl Model {
    /// Returns the differences in `new`, in the order of the keys.
    pub fn changes_to(&self, new: &Self) -> Vec<Change> {
        let (old, new) = (self.entries(), new.entries());
        let keys: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
        let changes = keys.into_iter().map(|key| Change {
            key: key.clone(),
            old: old.get(key).map(Entry::to_string),
            new: new.get(key).map(Entry::to_string),
        });
        changes.filter(|change| change.old != change.new).collect()
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
        let crate::model::Rig::Robot(robot) = &mut new.rig else { panic!("the paper has a robot") };
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
