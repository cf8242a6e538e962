//! Every parameter of a model with where its number comes from, as the comments of its file say.
//!
//! A comment behind a value reads `unit; origin: how` or `unit; origin, place`, one behind a table's head
//! `origin, place` or `origin: how` for those of its values that name no origin of their own.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::model::{Model, RobotModel};

/// Origin of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// Printed in the paper.
    Paper,
    /// Follows from printed numbers.
    Derived,
    /// Chosen, because the paper does not give it.
    Assumed,
    /// A constant that everybody uses.
    Standard,
    /// The file leaves it out, and the program's default stands.
    Default,
    /// The file does not say.
    NotStated,
}

/// A parameter of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Table and key as in the model file.
    pub key: String,
    /// Its value as in the model file.
    pub value: String,
    /// Unit; empty where the file's comment gives none.
    pub unit: String,
    /// Origin of the number.
    pub origin: Origin,
    /// Reason for the choice, as in the file.
    pub how: String,
}

impl Origin {
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Derived => "derived",
            Self::Assumed => "assumed",
            Self::Standard => "standard",
            Self::Default => "default",
            Self::NotStated => "not said",
        }
    }

    /// The origin that a remark begins with, and the rest of the remark.
    fn of(remark: &str) -> Option<(Self, &str)> {
        let end = remark.find(|c: char| !c.is_alphanumeric()).unwrap_or(remark.len());
        let origin = match &remark[..end] {
            "paper" => Self::Paper,
            "derived" => Self::Derived,
            "assumed" => Self::Assumed,
            "standard" => Self::Standard,
            _ => return None,
        };
        Some((origin, remark[end..].trim_start_matches([',', ':', ';', ' '])))
    }
}

/// Comment of a value.
#[derive(Clone, Default)]
struct Remark {
    unit: String,
    origin: Option<Origin>,
    how: String,
}

/// A model as TOML with the tables of motors, sensors and chassis even where they are at their defaults.
pub(super) fn complete(model: &Model, robot: &RobotModel) -> String {
    let mut text = model.to_toml();
    let tables = [
        ("chassis", toml::to_string(&robot.chassis)),
        ("actuation", toml::to_string(&robot.actuation)),
        ("sensors", toml::to_string(&robot.sensors)),
    ];
    for (name, table) in tables {
        let head = format!("\n[{name}]\n");
        if !text.contains(&head) {
            text += &head;
            text += &table.expect("plain numbers always have a TOML form");
        }
    }
    text
}

/// All parameters of a model, in the order of its full form `complete` (TOML with every table); `text` is its file
/// as it was written. Text that is not a model file gives values without origin.
pub(super) fn parameters(complete: &str, text: &str) -> Vec<Parameter> {
    let remarks = remarks(text);
    let in_order = lines(complete).filter(|line| line.key != "name");
    let parameter = |line: Line<'_>| {
        let remark = remarks.get(&line.key).cloned();
        let origin =
            remark.as_ref().map_or(Origin::Default, |remark| remark.origin.unwrap_or(Origin::NotStated));
        let Remark { unit, how, .. } = remark.unwrap_or_default();
        Parameter { key: line.key, value: line.value, unit, origin, how }
    };
    in_order.map(parameter).collect()
}

/// A `key = value # comment`; a list may go on over several lines.
struct Line<'a> {
    /// With its table.
    key: String,
    value: String,
    comment: &'a str,
    /// The comment of the table's head.
    table_comment: &'a str,
}

fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let (mut table, mut table_comment) = (String::new(), "");
    let mut rest = text.lines().map(|line| {
        let (code, comment) = line.split_once('#').unwrap_or((line, ""));
        (code.trim(), comment.trim())
    });
    std::iter::from_fn(move || {
        loop {
            let (code, comment) = rest.next()?;
            let Some((key, first)) = code.split_once('=') else {
                if let Some(head) = code.strip_prefix('[') {
                    table = format!("{}.", head.trim_matches(['[', ']']));
                    table_comment = comment;
                }
                continue;
            };
            let mut value = first.trim().to_owned();
            while value.matches('[').count() > value.matches(']').count() {
                value.push_str(rest.next().map_or("]", |(code, _)| code));
            }
            let key = format!("{table}{}", key.trim());
            return Some(Line {
                key,
                value: value.replace(",]", "]").replace("],[", "], ["),
                comment,
                table_comment,
            });
        }
    })
}

/// Comments before the first value of the file: one text for each paragraph and each item of a list.
pub(super) fn preface(text: &str) -> Vec<String> {
    let mut paragraphs: Vec<String> = Vec::new();
    let mut is_open = false;
    for line in text.lines().map_while(|line| line.strip_prefix('#')) {
        let words = line.trim();
        // An item of a list, or a word and its meaning in columns.
        let columns = words.split_once("   ").map(|(word, meaning)| format!("{word}: {}", meaning.trim()));
        let item = words.strip_prefix("- ").map(str::to_owned).or(columns);
        match paragraphs.last_mut().filter(|_| is_open && item.is_none() && !words.is_empty()) {
            Some(paragraph) => {
                paragraph.push(' ');
                paragraph.push_str(words);
            }
            None if words.is_empty() => {}
            None => paragraphs.push(item.unwrap_or_else(|| words.to_owned())),
        }
        is_open = !words.is_empty();
    }
    paragraphs
}

fn remarks(text: &str) -> BTreeMap<String, Remark> {
    lines(text).map(|line| (line.key.clone(), remark(&line))).collect()
}

fn remark(line: &Line<'_>) -> Remark {
    let own = |text: &str| Origin::of(text).map(|(origin, how)| (origin, how.to_owned()));
    let (unit, rest) = match own(line.comment) {
        Some(_) => ("", line.comment),
        None => line.comment.split_once(';').unwrap_or((line.comment, "")),
    };
    let unit = unit.trim().to_owned();
    let rest = rest.trim();
    match (own(rest), own(line.table_comment)) {
        (Some((origin, how)), _) => Remark { unit, origin: Some(origin), how },
        (None, Some((origin, how))) if rest.is_empty() => Remark { unit, origin: Some(origin), how },
        (None, head) => Remark { unit, origin: head.map(|(origin, _)| origin), how: rest.to_owned() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::presets;

    fn of_paper() -> Vec<Parameter> {
        let model = presets::paper();
        parameters(&complete(&model, model.robot().unwrap()), presets::ALL[0].1)
    }

    #[test]
    fn comments_say_where_a_number_comes_from() {
        let text = "name = \"x\" # no parameter\n[robot]\nmass = 2.0 # kg; derived: from two halves\nradius = 1.0\n\
                    [friction.left]  # paper, Table 4\na = 1 # N m\nb = 2 # N m; assumed: guessed\nc = 3 # N m; rounded\n";
        let complete = "name = \"x\"\n[robot]\nmass = 2.0\nradius = 1.0\nextra = 5\n[friction.left]\na = 1\nb = 2\nc = 3\n";
        let found: Vec<_> = parameters(complete, text)
            .into_iter()
            .map(|p| format!("{} {} {} {:?} {}", p.key, p.value, p.unit, p.origin, p.how))
            .collect();
        assert_eq!(
            found,
            [
                "robot.mass 2.0 kg Derived from two halves",
                "robot.radius 1.0  NotStated ",
                "robot.extra 5  Default ",
                "friction.left.a 1 N m Paper Table 4",
                "friction.left.b 2 N m Assumed guessed",
                "friction.left.c 3 N m Paper rounded",
            ]
        );
    }

    #[test]
    fn lists_may_go_on_over_lines_and_tables_may_be_nested() {
        let text = "[lqr] # assumed: no word\nq = [   # SI\n  [1.0, 2.0], # first\n  [3.0, 4.0],\n]\n[a.b]\nc = 1 # m; derived\n";
        let complete = "[lqr]\nq = [[1.0, 2.0], [3.0, 4.0]]\n[a.b]\nc = 1\n";
        let found = parameters(complete, text);
        assert_eq!((found[0].value.as_str(), found[0].origin), ("[[1.0, 2.0], [3.0, 4.0]]", Origin::Assumed));
        assert_eq!(parameters(text, text)[0].value, "[[1.0, 2.0], [3.0, 4.0]]");
        assert_eq!((found[1].key.as_str(), found[1].origin), ("a.b.c", Origin::Derived));
        assert_eq!(parameters("a = [1,\n", "")[0].value, "[1]");
    }

    #[test]
    fn the_preface_of_a_file_is_read_as_paragraphs() {
        let text = "# One\n# goes on.\n#\n# Two:\n#   - first\n#     item\n#   - second\n#   word     meaning\nname = 1 # not this\n# nor this\n";
        assert_eq!(preface(text), ["One goes on.", "Two:", "first item", "second", "word: meaning"]);
        assert!(preface("").is_empty());
    }

    #[test]
    fn the_papers_preset_gives_the_origin_of_all_that_the_paper_is_silent_on() {
        let found = of_paper();
        let origin = |key: &str| found.iter().find(|p| p.key == key).map(|p| p.origin);
        assert_eq!(origin("friction.left.static_nm"), Some(Origin::Paper));
        assert_eq!(origin("robot.wheel_radius_m"), Some(Origin::Assumed));
        for table in ["robot.", "friction.", "lqr.", "compensation."] {
            let silent = |p: &&Parameter| p.key.starts_with(table) && p.origin == Origin::NotStated;
            let silent: Vec<_> =
                found.iter().filter(silent).filter(|p| p.key != "robot.gravity_m_s2").collect();
            assert!(silent.is_empty(), "{silent:?}");
        }
    }
}
