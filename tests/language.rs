//! Help, messages and labels are written in plain control-engineering English: words of the project's former dialect
//! stay out of them.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Words and phrases that must not appear, and what to write instead.
const BANNED: &[(&str, &str)] = &[
    ("asked for", "commanded, requested"),
    ("asked torque", "commanded torque"),
    ("at rest", "at standstill"),
    ("bears", "tolerates"),
    ("beside", "compared with, next to"),
    ("by chance", "null distribution"),
    ("by itself", "automatically"),
    ("by themselves", "automatically"),
    ("carried", "transfer"),
    ("cannot answer", "log not suitable for identification"),
    ("counts as 1", "max. deviation"),
    ("data unfit", "log not suitable for identification"),
    ("defect of flqr", "internal error"),
    ("doubt", "penalise"),
    ("fate", "outcome"),
    ("find what is missing", "find missing effects"),
    ("for good", "permanently"),
    ("from rest", "from standstill"),
    ("gets up", "recovers"),
    ("handicap", "penalise"),
    ("hangs on", "depends on"),
    ("height of the legs", "leg height"),
    ("how far is the model", "compute residual"),
    ("hunt", "limit-cycle"),
    ("hunts", "limit-cycles"),
    ("in force", "active"),
    ("is heard", "is received"),
    ("its own", "leave it out"),
    ("judge", "assess, score"),
    ("lean of", "initial tilt"),
    ("let go", "released"),
    ("level of dry friction", "dry friction"),
    ("level of friction", "friction amplitude"),
    ("mend", "fix, remedy"),
    ("mended", "fixed"),
    ("mends", "fixes"),
    ("no thread for", "cannot start"),
    ("nobody", "no one; say who or what"),
    ("none where", "`None` if"),
    ("not sure", "not significant"),
    ("of before", "previous"),
    ("of now", "current"),
    ("ours", "simulation, this program"),
    ("picks", "selected"),
    ("polish", "local refinement"),
    ("put right", "corrected"),
    ("rests", "is at standstill"),
    ("share", "fraction"),
    ("shares", "fractions"),
    ("stale", "out of date"),
    ("surely", "significantly"),
    ("swarm alone", "PSO only"),
    ("tells", "reports, shows"),
    ("the loop as it runs", "the sampled closed loop"),
    ("theirs", "the paper's, the file's"),
    ("told", "reported, identified"),
    ("tried", "candidates"),
    ("twin", "surrogate"),
    ("way of the", "distance, displacement"),
    ("waves", "harmonics, spectral lines"),
    ("what is left", "residual"),
    ("what was found", "effects, results"),
    ("whoever", "say who"),
];

/// Places where a phrase is proper English or a fixed name.
const ALLOWED: &[(&str, &str)] = &[
    // Standard path of data files.
    ("src/gui/dialog.rs", "share"),
];

/// Parts with their own schedule: the identification pipeline.
const SKIPPED: &[&str] = &["src/core/refine/axis/", "src/core/refine/robot/"];

#[test]
fn messages_and_labels_are_plain() {
    let mut found = Vec::new();
    for file in files(Path::new("src"), "rs") {
        let name = file.to_string_lossy().replace('\\', "/");
        let is_test = ["/tests", "tests.rs", "/benches/", "/fuzz/"].iter().any(|part| name.contains(part));
        if is_test || SKIPPED.iter().any(|part| name.starts_with(part)) {
            continue;
        }
        let source = fs::read_to_string(&file).unwrap();
        let product = source.split("#[cfg(test)]\nmod ").next().unwrap();
        for (line, text) in literals(product) {
            if text.contains(' ') {
                found.extend(complaints(&name, line, &text));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn help_is_plain() {
    let help = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_flqr")).args(arguments).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let main = help(&["--help"]);
    let commands = main.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = commands.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let names: Vec<&str> = names.filter(|name| !name.is_empty() && *name != "help").collect();
    assert!(names.contains(&"refine") && names.contains(&"timing"), "{names:?}");
    let pages = names.iter().map(|name| (*name, help(&[name, "--help"]))).chain([("flqr", main.clone())]);
    let found: Vec<String> = pages.flat_map(|(name, page)| lines_with_complaints(name, &page)).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn literals_and_phrases_are_found() {
    let source = "// \"no\"\nlet a = 'x'; let b: &'static str = \"one \\\"two\\\" \\\n    three\";\nr#\"a \"raw\" one\"#; b'\"'";
    let expected = [(2, "one \\\"two\\\" three".to_owned()), (4, "a \"raw\" one".to_owned())];
    assert_eq!(literals(source), expected);
    assert_eq!(complaints("f.rs", 3, "A share of it").len(), 1);
    assert!(complaints("f.rs", 3, "shared, threshold, retried, {told}").is_empty());
    assert_eq!(lines_with_complaints("page", "fine\nthe way it is told").len(), 1);
}

fn lines_with_complaints(name: &str, page: &str) -> Vec<String> {
    page.lines().enumerate().flat_map(|(index, text)| complaints(name, index + 1, text)).collect()
}

/// Describes each banned phrase in a text.
fn complaints(name: &str, line: usize, text: &str) -> Vec<String> {
    let text = without_placeholders(&text.replace("\\n", " "));
    let words: Vec<String> = text
        .split(|letter: char| !(letter.is_alphanumeric() || letter == '_'))
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let spaced = format!(" {} ", words.join(" "));
    let is_allowed = |phrase: &str| ALLOWED.iter().any(|(file, allowed)| *file == name && *allowed == phrase);
    BANNED
        .iter()
        .filter(|(phrase, _)| spaced.contains(&format!(" {phrase} ")) && !is_allowed(phrase))
        .map(|(phrase, instead)| format!("{name}:{line}: “{phrase}” (write: {instead}) in {:?}", text.trim()))
        .collect()
}

/// A format string without the names in its braces.
fn without_placeholders(text: &str) -> String {
    let mut parts = text.split('{');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |plain, part| plain + " " + part.split_once('}').map_or(part, |(_, rest)| rest))
}

/// Files of a folder and its subfolders, in order.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = fs::read_dir(folder) else { return found };
    let mut entries: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.extension().is_some_and(|extension| extension == ending) {
            found.push(path);
        }
    }
    found
}

/// String literals of Rust source with their lines, line continuations joined.
fn literals(source: &str) -> Vec<(usize, String)> {
    let bytes = source.as_bytes();
    let (mut found, mut at) = (Vec::new(), 0);
    let line_of = |at: usize| 1 + source[..at].matches('\n').count();
    while at < bytes.len() {
        let rest = &source[at..];
        if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if let Some(end) = char_literal(rest) {
            at += end;
        } else if let Some((start, hashes)) = raw_start(source, at) {
            let close = format!("\"{}", "#".repeat(hashes));
            let length = source[start..].find(&close).unwrap_or(source.len() - start);
            found.push((line_of(at), source[start..start + length].to_owned()));
            at = start + length + close.len();
        } else if bytes[at] == b'"' {
            let mut end = at + 1;
            while bytes[end] != b'"' {
                end += if bytes[end] == b'\\' { 2 } else { 1 };
            }
            found.push((line_of(at), joined(&source[at + 1..end])));
            at = end + 1;
        } else {
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    found
}

/// Length of a character literal at the start of a text; lifetimes are none.
fn char_literal(text: &str) -> Option<usize> {
    let inside = text.strip_prefix('\'')?;
    let length = match inside.strip_prefix('\\') {
        Some(escape) => 2 + escape.char_indices().skip(1).find(|(_, letter)| *letter == '\'')?.0,
        None => 1 + inside.chars().next()?.len_utf8(),
    };
    text[length..].starts_with('\'').then_some(length + 1)
}

/// Start of the content of a raw string at a place, and its number of hashes.
fn raw_start(source: &str, at: usize) -> Option<(usize, usize)> {
    let before = source[..at].chars().next_back();
    if before.is_some_and(|letter| letter.is_alphanumeric() && letter != 'b' || letter == '_') {
        return None;
    }
    let after = source[at..].strip_prefix('r')?;
    let hashes = after.bytes().take_while(|byte| *byte == b'#').count();
    after[hashes..].starts_with('"').then_some((at + 1 + hashes + 1, hashes))
}

fn joined(literal: &str) -> String {
    let mut lines = literal.split("\\\n");
    let first = lines.next().unwrap_or_default().to_owned();
    lines.fold(first, |text, line| text + line.trim_start())
}
