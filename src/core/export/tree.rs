//! JSON, and YAML and CSV made from the same tree.

use serde_json::Value;

use super::Controller;

pub(super) fn json(controller: &Controller) -> String {
    let mut text =
        serde_json::to_string_pretty(controller).expect("a controller is plain finite numbers and strings");
    text.push('\n');
    text
}

fn value(controller: &Controller) -> Value {
    serde_json::to_value(controller).expect("a controller is plain finite numbers and strings")
}

/// YAML: maps in block style, everything else as the JSON that YAML 1.2 contains.
pub(super) fn yaml(controller: &Controller) -> String {
    let mut text = String::new();
    write_yaml(&value(controller), 0, &mut text);
    text
}

fn write_yaml(value: &Value, depth: usize, text: &mut String) {
    let Value::Object(map) = value else { return };
    for (key, inner) in map {
        text.push_str(&"  ".repeat(depth));
        text.push_str(key);
        if inner.is_object() {
            text.push_str(":\n");
            write_yaml(inner, depth + 1, text);
        } else {
            text.push_str(&format!(": {inner}\n"));
        }
    }
}

/// CSV: one `key,value` row for each leaf.
pub(super) fn csv(controller: &Controller) -> String {
    let mut text = String::from("key,value\n");
    write_csv(&value(controller), "", &mut text);
    text
}

fn write_csv(value: &Value, path: &str, text: &mut String) {
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, inner)| write_csv(inner, &join(key), text)),
        Value::Array(items) => {
            items
                .iter()
                .enumerate()
                .for_each(|(index, inner)| write_csv(inner, &join(&index.to_string()), text));
        }
        Value::String(string) => text.push_str(&format!("{path},\"{}\"\n", string.replace('"', "\"\""))),
        leaf => text.push_str(&format!("{path},{leaf}\n")),
    }
}
