//! The members of a JSON object one by one, so that a bad one does not take the others with it.

use serde_json::Value;

/// The members of the object in `text`, each `None` if its value cannot be read, and whether the text ends early.
pub(super) fn members(text: &str) -> (Vec<(String, Option<Value>)>, bool) {
    let mut found = Vec::new();
    let Some(mut rest) = text.trim_start().strip_prefix('{') else { return (found, true) };
    loop {
        rest = rest.trim_start_matches(|c: char| c.is_whitespace() || c == ',');
        if rest.is_empty() {
            return (found, true);
        }
        if rest.starts_with('}') {
            return (found, false);
        }
        let Some(key_end) = value_end(rest) else { return (found, true) };
        let (key, behind) = rest.split_at(key_end);
        let Ok(key) = serde_json::from_str::<String>(key) else { return (found, true) };
        let Some(behind) = behind.trim_start().strip_prefix(':') else { return (found, true) };
        let behind = behind.trim_start();
        let Some(end) = value_end(behind) else {
            found.push((key, None));
            return (found, true);
        };
        found.push((key, serde_json::from_str(&behind[..end]).ok()));
        rest = &behind[end..];
    }
}

/// End of the value at the start of `text`; `None` if the text ends before it.
fn value_end(text: &str) -> Option<usize> {
    let (mut depth, mut in_text, mut escaped) = (0_usize, false, false);
    for (at, byte) in text.bytes().enumerate() {
        if in_text {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => {
                    in_text = false;
                    if depth == 0 {
                        return Some(at + 1);
                    }
                }
                _ => {}
            }
            continue;
        }
        match byte {
            b'"' => in_text = true,
            b'{' | b'[' => depth += 1,
            b'}' | b']' if depth == 0 => return Some(at),
            b'}' | b']' => {
                depth -= 1;
                if depth == 0 {
                    return Some(at + 1);
                }
            }
            b',' | b':' if depth == 0 => return Some(at),
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn each_member_stands_for_itself() {
        let text =
            r#" {"a": 1, "b": [1, {"c": "}\"]"}], "bad": NaN, "d": "x:,", "e": {"f": nul}, "g": null } "#;
        let (found, cut) = members(text);
        let expected = [
            ("a", Some(json!(1))),
            ("b", Some(json!([1, { "c": "}\"]" }]))),
            ("bad", None),
            ("d", Some(json!("x:,"))),
            ("e", None),
            ("g", Some(json!(null))),
        ];
        assert_eq!(found, expected.map(|(key, value)| (key.to_owned(), value)));
        assert!(!cut);
    }

    #[test]
    fn a_cut_text_gives_the_members_before_the_cut() {
        for (text, count) in
            [("", 0), ("{", 0), ("{\"a\": 1, \"b\": [1, 2", 2), ("{\"a\": 1, \"b", 1), ("{\"a\": 1,", 1)]
        {
            let (found, cut) = members(text);
            assert_eq!((found.len(), cut), (count, true), "{text}");
            assert!(found.iter().all(|(key, value)| (key == "a") == value.is_some()), "{text}");
        }
    }
}
