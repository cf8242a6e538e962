//! Numbers in sentences.

use crate::report::number;

/// Three significant digits, without zeros at the end of decimals.
pub(super) fn sig(value: f64) -> String {
    short(number::significant(value, 3))
}

fn short(text: String) -> String {
    if !text.contains('.') || text.contains('·') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A share as per cent, two significant digits.
pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    let text = if value.abs() >= 10.0 { number::fixed(value, 0) } else { number::significant(value, 2) };
    format!("{} %", short(text))
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_sentences_are_short() {
        assert_eq!(sig(0.0500), "0.05");
        assert_eq!(sig(100.0), "100");
        assert_eq!(sig(4.9e-4), "0.00049");
        assert_eq!(sig(1e-9), "1·10⁻⁹");
        assert_eq!(percent(0.0123), "1.2 %");
        assert_eq!(percent(1.08), "108 %");
        assert_eq!(percent(0.02), "2 %");
        assert_eq!(listed(&["a".into(), "b".into(), "c".into()]), "a, b and c");
    }
}
