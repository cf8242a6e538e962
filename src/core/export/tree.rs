//! JSON, and YAML and CSV made from the same tree.

use serde_json::Value;

use super::Controller;
use crate::record::text_cell;

pub(super) fn json(controller: &Controller) -> String {
    let mut text =
        serde_json::to_string_pretty(controller).expect("a controller is plain finite numbers and strings");
    text.push('\n');
    text
}

fn value(controller: &Controller) -> Value {
    serde_json::to_value(controller).expect("a controller is plain finite numbers and strings")
}

/// YAML: maps in block style, lists in flow style, strings as in JSON.
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
            text.push_str(&format!(": {}\n", yaml_leaf(inner)));
        }
    }
}

/// YAML 1.1 reads a number with an exponent but no point as a string.
fn yaml_leaf(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(yaml_leaf).collect::<Vec<_>>().join(", ")),
        Value::Number(number) => match number.to_string().split_once('e') {
            Some((digits, exponent)) if !digits.contains('.') => format!("{digits}.0e{exponent}"),
            _ => number.to_string(),
        },
        other => other.to_string(),
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
        Value::String(string) => {
            text.push_str(&format!("{path},\"{}\"\n", text_cell(string).replace('"', "\"\"")));
        }
        leaf => text.push_str(&format!("{path},{leaf}\n")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{BalanceController, ControllerKind};
    use crate::model_file::presets;

    fn controller() -> Controller {
        let model = presets::paper();
        let mut gain = nalgebra::Matrix2x4::from_element(-0.25);
        gain[(0, 1)] = 1e-9;
        let controller = BalanceController::new(ControllerKind::Flqr, model.robot().unwrap(), gain).unwrap();
        Controller::new("a \"quoted\" name", &controller, None)
    }

    #[test]
    fn yaml_is_readable_for_version_1_1_too() {
        let text = yaml(&controller());
        assert!(text.contains("gain:\n  left: [-0.25, 1.0e-9, -0.25, -0.25]\n"), "{text}");
        assert!(text.starts_with("name: \"a \\\"quoted\\\" name\"\n"), "{text}");
    }

    #[test]
    fn no_cell_of_csv_is_a_formula() {
        let named = |name: &str| csv(&Controller { name: name.to_owned(), ..controller() });
        for (name, cell) in [("=1+1", "\"'=1+1\""), ("@SUM(A1)", "\"'@SUM(A1)\""), ("a=b", "\"a=b\"")] {
            let text = named(name);
            assert!(text.starts_with(&format!("key,value\nname,{cell}\n")), "{text}");
            assert!(text.contains("\ngain.left.0,-0.25\n"), "numbers stay numbers: {text}");
        }
    }

    #[test]
    fn csv_has_one_row_for_each_leaf() {
        let text = csv(&controller());
        assert!(text.starts_with("key,value\nname,\"a \"\"quoted\"\" name\"\n"), "{text}");
        assert!(
            text.contains("\ngain.left.1,1e-9\n") && text.contains("\nfeedforward.right.offset_nm,0.0014\n")
        );
        assert!(text.lines().all(|line| line.split(',').count() == 2), "{text}");
    }
}
