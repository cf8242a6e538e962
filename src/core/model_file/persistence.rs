//! Saving over a file that a person has written: its comments, order and spelling of numbers stay.

use toml_edit::{DocumentMut, Item, TableLike, Value};

use super::renamed_keys::with_current_keys;
use crate::model::Model;

impl Model {
    /// The model as TOML in the form of `existing`, the file that it replaces: comments and order stay, and
    /// so do numbers that have not changed. Text that is no model's is replaced as a whole.
    pub fn to_toml_over(&self, existing: &str) -> String {
        let existing = &with_current_keys(existing);
        let fresh = self.to_toml();
        let is_this = |text: &String| Self::from_toml(text, "").is_ok_and(|model| model == *self);
        // Keys at their defaults are kept where they were written, unless that would be another model.
        [false, true]
            .into_iter()
            .find_map(|remove| merged(existing, &fresh, remove).filter(is_this))
            .unwrap_or(fresh)
    }
}

fn merged(existing: &str, fresh: &str, remove: bool) -> Option<String> {
    let mut kept: DocumentMut = existing.parse().ok()?;
    let fresh: DocumentMut = fresh.parse().ok()?;
    merge(kept.as_table_mut(), fresh.as_table(), remove);
    Some(kept.to_string())
}

fn merge(kept: &mut dyn TableLike, fresh: &dyn TableLike, remove: bool) {
    if remove {
        let gone: Vec<String> =
            kept.iter().map(|(key, _)| key.to_owned()).filter(|key| !fresh.contains_key(key)).collect();
        for key in gone {
            kept.remove(&key);
        }
    }
    for (key, item) in fresh.iter() {
        match kept.get_mut(key) {
            Some(old) => merge_item(old, item, remove),
            None => {
                kept.insert(key, unplaced(item.clone()));
            }
        }
    }
}

fn merge_item(old: &mut Item, new: &Item, remove: bool) {
    if let (Some(old), Some(new)) = (old.as_table_like_mut(), new.as_table_like()) {
        return merge(old, new, remove);
    }
    match (old, new) {
        (Item::ArrayOfTables(old), Item::ArrayOfTables(new)) => {
            while old.len() > new.len() {
                old.remove(old.len() - 1);
            }
            for (index, table) in new.iter().enumerate() {
                match old.get_mut(index) {
                    // A list of effects: what another one had is not kept.
                    Some(kept) => merge(kept, table, true),
                    None => old.push(table.clone()),
                }
            }
        }
        (Item::Value(old), Item::Value(new)) => merge_value(old, new),
        (old, new) => *old = unplaced(new.clone()),
    }
}

fn merge_value(old: &mut Value, new: &Value) {
    if let (Some(old), Some(new)) = (old.as_array_mut(), new.as_array())
        && old.len() == new.len()
    {
        return old.iter_mut().zip(new.iter()).for_each(|(old, new)| merge_value(old, new));
    }
    let number = |value: &Value| value.as_float().or(value.as_integer().map(|whole| whole as f64));
    let same = match (number(old), number(new)) {
        (Some(old), Some(new)) => old == new,
        _ => old.as_str().is_some() && old.as_str() == new.as_str(),
    };
    if !same {
        let decor = old.decor().clone();
        *old = new.clone();
        *old.decor_mut() = decor;
    }
}

/// A table of another text has no place in this one yet: it goes to the end.
fn unplaced(mut item: Item) -> Item {
    if let Item::Table(table) = &mut item {
        table.set_position(None);
        for (_, inner) in table.iter_mut() {
            *inner = unplaced(std::mem::take(inner));
        }
    }
    item
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Rig, RobotModel, Weights};

    const WRITTEN: &str = r#"# My robot, weighed on 3 May.
name = "mine"

[lqr]                       # tuned by hand
q_diagonal = [60, 30.0, 1e2, 5.0]   # displacement first
r_diagonal = [20.0, 20.0]

# Everything above the axle.
[robot]
body_mass_kg = 13           # with battery
wheel_mass_kg = 1.0
wheel_inertia_kg_m2 = 5e-3
wheel_radius_m = 0.1
com_height_m = 0.25
body_inertia_kg_m2 = 0.25

[limits]
# none known yet
"#;

    fn robot(model: &mut Model) -> &mut RobotModel {
        match &mut model.rig {
            Rig::Robot(robot) => robot,
            Rig::Axis(_) => panic!("a robot was written"),
        }
    }

    #[test]
    fn an_unchanged_model_leaves_its_file_as_it_was() {
        let model = Model::from_toml(WRITTEN, "m").unwrap();
        let text = model.to_toml_over(WRITTEN);
        for line in WRITTEN.lines() {
            assert!(text.contains(line), "{line:?} is gone: {text}");
        }
    }

    #[test]
    fn what_changes_is_changed_in_its_place() {
        let mut model = Model::from_toml(WRITTEN, "m").unwrap();
        robot(&mut model).weights = Some(Weights::diagonal([70.0, 30.0, 100.0, 5.0], [20.0, 20.0]));
        robot(&mut model).parameters.wheel_radius_m = 0.11;
        robot(&mut model).limits.torque_nm = Some(2.42);
        let text = model.to_toml_over(WRITTEN);
        assert_eq!(Model::from_toml(&text, "again").unwrap(), model);
        for kept in [
            "# My robot, weighed on 3 May.",
            "[lqr]                       # tuned by hand",
            "q_diagonal = [70.0, 30.0, 1e2, 5.0]   # displacement first",
            "body_mass_kg = 13           # with battery",
            "wheel_inertia_kg_m2 = 5e-3",
            "wheel_radius_m = 0.11",
            "torque_nm = 2.42",
        ] {
            assert!(text.contains(kept), "{kept:?} is not in {text}");
        }
        assert!(text.find("[lqr]") < text.find("[robot]"), "the order stays: {text}");
    }

    #[test]
    fn what_is_gone_is_gone_and_what_comes_is_added() {
        let mut model = Model::from_toml(WRITTEN, "m").unwrap();
        let weights = robot(&mut model).weights.take();
        let text = model.to_toml_over(WRITTEN);
        assert_eq!(Model::from_toml(&text, "again").unwrap(), model);
        assert!(!text.contains("[lqr]") && text.contains("# with battery"), "{text}");
        robot(&mut model).weights = weights;
        let again = model.to_toml_over(&text);
        assert_eq!(Model::from_toml(&again, "again").unwrap(), model);
        assert!(again.contains("# with battery"), "{again}");
    }

    #[test]
    fn a_text_that_is_no_model_or_another_ones_is_replaced() {
        let model = Model::from_toml(WRITTEN, "m").unwrap();
        let axis = "name = \"Rail\"\n[axis]\nkind = \"linear\"\nmass_kg = 9.0\n";
        for other in ["", "precious = words\n", "[[[", axis] {
            let text = model.to_toml_over(other);
            assert_eq!(Model::from_toml(&text, "again").unwrap(), model, "{other:?}");
        }
    }
}
