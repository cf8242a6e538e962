//! Messages of the TOML reader with the remedy.

use super::position_at;

/// Of text that is no TOML, at a byte of it.
pub(super) fn not_toml(message: &str, text: &str, byte: usize) -> String {
    let found = line_around(text, byte);
    if !text.ends_with('\n') && byte >= text.trim_end().len() {
        return format!(
            "the file ends in the middle of `{found}`: complete the line, or use the complete file if this one was truncated"
        );
    }
    format!("{} in `{found}`: write it as key = value or [table]", in_words(message))
}

/// Of TOML that is no model.
pub(super) fn unread(message: &str, text: &str, byte: usize) -> String {
    let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match names.split_first() {
        Some((key, known)) if message.starts_with("unknown field") => unknown(key, known),
        Some((key, _)) if message.starts_with("missing field") => {
            let ends_here = !rest_of_lines(text, byte).iter().any(|line| line.starts_with('['));
            let cut = "; the file ends in this table: if it was truncated, use the complete file";
            format!("missing key `{key}`: add it here{}", if ends_here { cut } else { "" })
        }
        _ => format!("{} in `{}`", in_words(message), line_around(text, byte)),
    }
}

fn unknown(key: &str, known: &[&str]) -> String {
    let near = known.iter().map(|other| (strsim::levenshtein(key, other), other)).min();
    let remedy = match near.filter(|(distance, _)| 2 * distance <= key.len()) {
        Some((_, other)) => format!("write `{other}`, the most similar key, or remove it"),
        None => "remove it, or correct its name".to_owned(),
    };
    let known = known.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ");
    if known.is_empty() {
        format!("unknown key `{key}`: {remedy}")
    } else {
        format!("unknown key `{key}`: {remedy}; known keys: {known}")
    }
}

/// A message in one line and without Rust's names.
fn in_words(message: &str) -> String {
    let line = message.split_whitespace().collect::<Vec<_>>().join(" ");
    line.replace("f64", "a number").replace("an array of length", "a list of length")
}

/// The line that a byte is in, cut to what a message can hold.
fn line_around(text: &str, byte: usize) -> String {
    let (line, _) = position_at(text, byte);
    text.lines().nth(line - 1).unwrap_or_default().trim().chars().take(60).collect()
}

/// The lines after the one that a byte is in.
fn rest_of_lines(text: &str, byte: usize) -> Vec<&str> {
    let (line, _) = position_at(text, byte);
    text.lines().skip(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_key_comes_with_the_nearest_known_one() {
        let message = "unknown field `limts`, expected one of `name`, `limits`";
        let told = "unknown key `limts`: write `limits`, the most similar key, or remove it; known keys: `name`, `limits`";
        assert_eq!(unread(message, "", 0), told);
        let message = "unknown field `colour`, expected `inertia_kg_m2` or `gravity_torque_nm`";
        assert!(
            unread(message, "", 0)
                .starts_with("unknown key `colour`: remove it, or correct its name; known keys: `in")
        );
    }
}
