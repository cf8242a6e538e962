//! Dependencies between the modules of the core point downward only.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::disallowed_methods, reason = "this test reads the sources")]

use std::fs;
use std::path::{Path, PathBuf};

/// From the lowest module to the highest; a module may use those before it.
const LAYERS: [&str; 23] = [
    "parallel",
    "message",
    "unit_slip",
    "parameter",
    "signal",
    "friction",
    "model",
    "lqr",
    "effects",
    "model_file",
    "link",
    "record",
    "excitation",
    "identify",
    "control",
    "export",
    "simulate",
    "emulator",
    "device",
    "report",
    "refine",
    "reproduce",
    "lib",
];

#[test]
fn modules_use_only_those_below_them() {
    let core = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut checked = 0;
    let mut upward = Vec::new();
    for file in sources(core) {
        let place = file.strip_prefix(core).unwrap();
        let first = place.iter().next().unwrap().to_str().unwrap();
        let module = first.strip_suffix(".rs").unwrap_or(first);
        if ["tests", "benches", "fuzz"].contains(&module) || is_test(place) {
            continue;
        }
        let layer = LAYERS.iter().position(|name| *name == module);
        let layer = layer.unwrap_or_else(|| panic!("{module} has no place among the layers"));
        let text = fs::read_to_string(&file).unwrap();
        for used in used_modules(&text) {
            checked += 1;
            match LAYERS.iter().position(|name| *name == used) {
                Some(other) if other > layer => upward.push(format!("{}: {used}", place.display())),
                _ => {}
            }
        }
    }
    assert!(checked > 500, "only {checked} paths were read");
    assert!(upward.is_empty(), "upward: {upward:#?}");
}

/// All Rust files of a folder.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            files.push(path);
        }
    }
    files
}

fn is_test(place: &Path) -> bool {
    place.iter().any(|part| part.to_str().is_some_and(|name| name.contains("test")))
}

/// First segments of all paths from the crate's root, in the code before a module of tests and outside of comments.
fn used_modules(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let code: String = code
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .map(|line| line.to_owned() + "\n")
        .collect();
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{').and_then(|list| list.split_once(';')) {
            Some((list, _)) => found.extend(list.split(',').filter_map(first_segment)),
            None => found.extend(first_segment(rest)),
        }
    }
    found
}

/// The module that a path begins with; `None` for an item of the root.
fn first_segment(path: &str) -> Option<String> {
    let name: String = path.trim().chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    name.starts_with(|c: char| c.is_ascii_lowercase()).then_some(name)
}

#[test]
fn paths_in_lists_and_in_the_middle_of_code_are_read() {
    let text =
        "use crate::{model::State, ParameterError};\n// crate::device\nfn f() { crate::lqr::design(); }\n";
    assert_eq!(used_modules(text), ["model", "lqr"]);
}
