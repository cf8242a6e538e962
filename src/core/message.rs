//! Messages that quote what files hold.

use std::fmt::Write;

/// Longest message, characters.
const LONGEST: usize = 500;
/// Characters of a longer message that its beginning takes; the end has the fix.
const BEGINNING: usize = 320;
/// Most significant digits of a number.
const DIGITS: usize = 12;

/// Makes a message fit to be shown: [`escaped`], numbers of at most 12 significant digits, at most 500 characters.
///
/// ```
/// assert_eq!(flqr_core::message::shown("0.30000000000000004 N m\u{7}"), "0.3 N m\\u{7}");
/// ```
pub fn shown(message: &str) -> String {
    shortened(&rounded(&escaped(message)))
}

/// Escapes what would act on a terminal or reorder the text around it: control characters, line ends among them, and
/// characters that set the direction of writing.
pub fn escaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for character in text.chars() {
        if acts(character) {
            plain.extend(character.escape_default());
        } else {
            plain.push(character);
        }
    }
    plain
}

/// [`escaped`] text of several lines, whose line ends stay.
pub fn escaped_lines(text: &str) -> String {
    text.split('\n').map(escaped).collect::<Vec<_>>().join("\n")
}

fn acts(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2060}'..='\u{206F}' | '\u{FEFF}')
}

fn shortened(message: &str) -> String {
    let count = message.chars().count();
    if count <= LONGEST {
        return message.to_owned();
    }
    let beginning: String = message.chars().take(BEGINNING).collect();
    let end: String = message.chars().skip(count - (LONGEST - BEGINNING - 3)).collect();
    format!("{beginning} … {end}")
}

/// Rounds the numbers of a text that have more digits than a person reads. What is part of a name or of a path stays.
fn rounded(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    let mut before = ' ';
    while let Some(start) = rest.find(|character: char| character.is_ascii_digit()) {
        let (head, tail) = rest.split_at(start);
        plain.push_str(head);
        before = head.chars().next_back().unwrap_or(before);
        let number = &tail[..numeral_length(tail)];
        let after = &tail[number.len()..];
        if is_part_of_a_name(before, after) {
            plain.push_str(number);
        } else {
            push_rounded(&mut plain, number);
        }
        before = number.chars().next_back().unwrap_or(before);
        rest = after;
    }
    plain + rest
}

/// Length of the number at the beginning of a text: digits, a fraction, an exponent.
fn numeral_length(text: &str) -> usize {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let mut length = digits(text);
    if let Some(fraction) = text[length..].strip_prefix('.').map(digits).filter(|count| *count > 0) {
        length += 1 + fraction;
    }
    if let Some(exponent) = text[length..].strip_prefix(['e', 'E']) {
        let unsigned = exponent.strip_prefix(['-', '+']).unwrap_or(exponent);
        if digits(unsigned) > 0 {
            length += 1 + exponent.len() - unsigned.len() + digits(unsigned);
        }
    }
    length
}

fn is_part_of_a_name(before: char, after: &str) -> bool {
    let mut after = after.chars();
    let (next, second) = (after.next().unwrap_or(' '), after.next().unwrap_or(' '));
    let of_name = |character: char| character.is_alphanumeric() || "_/\\".contains(character);
    of_name(before) || before == '.' || of_name(next) || (".-".contains(next) && of_name(second))
}

fn push_rounded(text: &mut String, number: &str) {
    let mantissa = number.split(['e', 'E']).next().unwrap_or_default();
    let significant = mantissa.trim_start_matches(['0', '.']).bytes().filter(u8::is_ascii_digit).count();
    let rounded = number.parse::<f64>().ok().filter(|value| significant > DIGITS && value.is_finite());
    let Some(value) = rounded.and_then(|value| format!("{value:.*e}", DIGITS - 1).parse::<f64>().ok()) else {
        text.push_str(number);
        return;
    };
    let plain = value == 0.0 || (1e-5..1e12).contains(&value);
    let written = if plain { write!(text, "{value}") } else { write!(text, "{value:e}") };
    written.expect("writing to a string cannot fail");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(shown("column `\u{1b}[31mred\u{7}`\r\nnext"), "column `\\u{1b}[31mred\\u{7}`\\r\\nnext");
        assert_eq!(shown("right to left \u{202e}txt.exe"), "right to left \\u{202e}txt.exe");
        assert_eq!(shown("Länge in µm, ‖x‖ ≤ 1 · 10⁻³"), "Länge in µm, ‖x‖ ≤ 1 · 10⁻³");
        assert_eq!(escaped_lines("a\u{8}b\nc\td"), "a\\u{8}b\nc\\td");
    }

    #[test]
    fn long_messages_keep_their_beginning_and_their_end() {
        let long = format!("model.toml:1:1: {} is unknown: remove it", "ä".repeat(5000));
        let short = shown(&long);
        assert_eq!(short.chars().count(), LONGEST);
        assert!(
            short.starts_with("model.toml:1:1: ää") && short.ends_with("ä is unknown: remove it"),
            "{short}"
        );
        let fits = "x".repeat(LONGEST);
        assert_eq!(shown(&fits), fits);
    }

    #[test]
    fn numbers_have_at_most_twelve_digits() {
        let huge = format!("{}", 1e300);
        for (long, short) in [
            ("pitch = 0.30000000000000004 rad", "pitch = 0.3 rad"),
            ("from -12.345678901234567 to 1e-7", "from -12.3456789012 to 1e-7"),
            ("1.2345678901234567e-300: too small", "1.23456789012e-300: too small"),
            ("(0.000012345678901234567)", "(0.0000123456789012)"),
            (&format!("is {huge}, lower it"), "is 1e300, lower it"),
            ("9007199254740993 rows", "9.00719925474e15 rows"),
            ("line 12, column 345", "line 12, column 345"),
            ("torque_nm*0.0174532925199", "torque_nm*0.0174532925199"),
            // Names stay as they are.
            ("run_20260101123045123.csv: empty", "run_20260101123045123.csv: empty"),
            ("/data/1699999999.1234567890/a.csv", "/data/1699999999.1234567890/a.csv"),
            ("1699999999123456.csv is empty", "1699999999123456.csv is empty"),
        ] {
            assert_eq!(shown(long), short);
        }
    }
}
