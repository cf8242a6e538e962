//! Keys of model files that have been renamed: files with the old names still load.

use std::fmt;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::position_at;

/// A key that has been renamed.
pub(super) struct Renamed {
    /// `friction`, or the id of an effect.
    place: &'static str,
    old: &'static str,
    new: &'static str,
}

const fn renamed(place: &'static str, old: &'static str, new: &'static str) -> Renamed {
    Renamed { place, old, new }
}

const RENAMED: &[Renamed] = &[
    renamed("friction", "told_from_rad_s", "fitted_speed_range_rad_s"),
    renamed("friction", "told_from_m_s", "fitted_speed_range_m_s"),
    renamed("low_speed_friction", "level_nm", "amplitude_nm"),
    renamed("low_speed_friction", "level_n", "amplitude_n"),
    renamed("presliding", "way_rad", "breakaway_displacement_rad"),
    renamed("presliding", "way_m", "breakaway_displacement_m"),
    renamed("presliding", "level_nm", "amplitude_nm"),
    renamed("presliding", "level_n", "amplitude_n"),
    renamed("structural_mode", "share", "fraction"),
];

/// An old key in a model file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenamedKey {
    /// Line, from 1.
    pub line: usize,
    /// Name in the file.
    pub old: &'static str,
    /// Current name.
    pub new: &'static str,
}

impl fmt::Display for RenamedKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {} is now called {}; the old name still works", self.line, self.old, self.new)
    }
}

/// Returns the keys of a model file that have been renamed since it was written.
pub fn renamed_keys(text: &str) -> Vec<RenamedKey> {
    let found = found(text).into_iter();
    found
        .map(|(span, key)| RenamedKey { line: position_at(text, span.start).0, old: key.old, new: key.new })
        .collect()
}

/// Returns the text of a model file with the current names of all keys.
pub(super) fn with_current_keys(text: &str) -> String {
    let mut current = text.to_owned();
    let mut found = found(text);
    found.sort_by_key(|(span, _)| span.start);
    for (span, key) in found.into_iter().rev() {
        current.replace_range(span, key.new);
    }
    current
}

/// Old keys and their places in the text.
type Found = Vec<(Range<usize>, &'static Renamed)>;

fn found(text: &str) -> Found {
    DeTable::parse(text).ok().and_then(|mut document| rename(document.get_mut()).ok()).unwrap_or_default()
}

/// Gives the keys of a document their current names.
///
/// # Errors
/// Byte and problem of an old key next to the current one.
pub(super) fn rename(document: &mut DeTable<'_>) -> Result<Found, (usize, String)> {
    let mut found = Vec::new();
    if let Some(DeValue::Table(friction)) = document.get_mut("friction").map(Spanned::get_mut) {
        rename_in(friction, "friction", &mut found)?;
    }
    if let Some(DeValue::Array(effects)) = document.get_mut("effects").map(Spanned::get_mut) {
        for effect in effects.iter_mut() {
            let DeValue::Table(effect) = effect.get_mut() else { continue };
            let id = effect.get("id").and_then(|id| id.get_ref().as_str()).map(str::to_owned);
            if let Some(id) = id {
                rename_in(effect, &id, &mut found)?;
            }
        }
    }
    Ok(found)
}

fn rename_in(table: &mut DeTable<'_>, place: &str, found: &mut Found) -> Result<(), (usize, String)> {
    for key in RENAMED.iter().filter(|key| key.place == place) {
        let Some((name, _)) = table.get_key_value(key.old) else { continue };
        let span = name.span();
        if table.contains_key(key.new) {
            let Renamed { old, new, .. } = key;
            return Err((
                span.start,
                format!("{old} is the old name of {new}, which is given too: remove {old}"),
            ));
        }
        if let Some(value) = table.remove(key.old) {
            table.insert(Spanned::new(span.clone(), key.new.into()), value);
        }
        found.push((span, key));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    const SHAFT: &str = r#"name = "shaft" # bench
[axis]
kind = "rotary"
inertia_kg_m2 = 0.001
[friction]
coulomb_nm = 0.03
viscous_nm_s_rad = 0.0005
told_from_rad_s = [0.1, 10.5] # from the first log
[[effects]]
id = "presliding"
way_rad = 0.01
level_nm = 0.02
[[effects]]
id = "low_speed_friction"
speed_rad_s = 0.5
level_nm = 0.01
[[effects]]
id = "structural_mode"
frequency_hz = 30.0
damping_ratio = 0.05
share = 0.1
"#;

    #[test]
    fn old_keys_load_as_the_current_ones() {
        let keys: Vec<String> = renamed_keys(SHAFT).iter().map(ToString::to_string).collect();
        assert_eq!(keys.len(), 5, "{keys:?}");
        assert_eq!(
            keys[0],
            "line 8: told_from_rad_s is now called fitted_speed_range_rad_s; the old name still works"
        );
        let current = with_current_keys(SHAFT);
        assert!(renamed_keys(&current).is_empty(), "{current}");
        assert!(current.contains("fitted_speed_range_rad_s = [0.1, 10.5] # from the first log"), "{current}");
        let model = Model::from_toml(SHAFT, "old.toml").unwrap();
        assert_eq!(Model::from_toml(&current, "new.toml").unwrap(), model);
        // Saving writes the current names alone and leaves the comments.
        let saved = model.to_toml_over(SHAFT);
        assert!(renamed_keys(&saved).is_empty() && saved.contains("# bench"), "{saved}");
        assert_eq!(Model::from_toml(&saved, "saved.toml").unwrap(), model);
    }

    #[test]
    fn a_key_with_both_of_its_names_is_refused_with_its_line() {
        for (old, new, line) in [
            ("told_from_rad_s = [0.1, 10.5]", "fitted_speed_range_rad_s = [0.1, 10.5]", 8),
            ("way_rad = 0.01", "breakaway_displacement_rad = 0.01", 11),
            ("share = 0.1", "fraction = 0.1", 21),
        ] {
            let text = SHAFT.replace(old, &format!("{old}\n{new}"));
            let error = Model::from_toml(&text, "m.toml").unwrap_err();
            assert_eq!((error.line, error.column), (line, 1), "{error}");
            let name = old.split(' ').next().unwrap();
            assert!(
                error.problem.starts_with(name) && error.problem.ends_with(&format!("remove {name}")),
                "{error}"
            );
        }
    }

    #[test]
    fn a_value_of_an_old_key_is_checked_at_its_line() {
        let error = Model::from_toml(&SHAFT.replace("[0.1, 10.5]", "[5.0, 1.0]"), "m.toml").unwrap_err();
        assert_eq!(error.line, 8, "{error}");
        let error =
            Model::from_toml(&SHAFT.replace("way_rad = 0.01", "way_rad = -1.0"), "m.toml").unwrap_err();
        assert_eq!(error.line, 11, "{error}");
    }
}
