//! Checks of the README and the manual: commands, options, keys, links and language.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use flqr_core::model::{LinkSettings, SafetyLimits};
use flqr_core::record::LogKind;
use serde_json::Value;

const LARGEST_README_BYTES: usize = 12_000;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README and manual pages: path below the root, and text.
fn pages() -> BTreeMap<PathBuf, String> {
    let manual = Path::new("assets/manual");
    let files = std::fs::read_dir(root().join(manual)).unwrap();
    let mut paths: Vec<_> = files.map(|file| manual.join(file.unwrap().file_name())).collect();
    paths.push("README.md".into());
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(root().join(&path)).unwrap();
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// Lines outside of fenced code, and lines within.
fn prose_and_code(text: &str) -> (Vec<&str>, Vec<&str>) {
    let (mut prose, mut code, mut fenced) = (Vec::new(), Vec::new(), false);
    for line in text.lines() {
        if line.starts_with("```") {
            fenced = !fenced;
        } else if fenced {
            code.push(line);
        } else {
            prose.push(line);
        }
    }
    (prose, code)
}

/// Code spans of a text without fenced code.
fn spans<'a>(prose: &[&'a str]) -> impl Iterator<Item = &'a str> {
    prose.iter().flat_map(|line| line.split('`').skip(1).step_by(2))
}

/// Every command line: words behind `flqr`, up to a comment, a pipe or another command.
fn command_lines(text: &str) -> Vec<Vec<&str>> {
    let (prose, code) = prose_and_code(text);
    let lines = spans(&prose).chain(code);
    lines
        .filter_map(|line| line.strip_prefix("flqr"))
        .filter(|rest| rest.is_empty() || rest.starts_with(' '))
        .map(|rest| {
            rest.split_whitespace().take_while(|word| !["#", ">", "|", "&&"].contains(word)).collect()
        })
        .collect()
}

fn help(command: Option<&str>) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_flqr")).args(command).arg("--help").output().unwrap();
    assert!(output.status.success(), "flqr {command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Whether a help text lists an option.
fn lists(help: &str, option: &str) -> bool {
    help.split(|c: char| c.is_whitespace() || ",.`".contains(c)).any(|word| word == option)
}

#[test]
fn every_command_and_option_has_help() {
    let mut helps: BTreeMap<Option<&str>, String> = BTreeMap::new();
    let pages = pages();
    for (page, text) in &pages {
        for words in command_lines(text) {
            let command = words.first().copied().filter(|word| !word.starts_with('-') && *word != "COMMAND");
            let help = helps.entry(command).or_insert_with(|| help(command));
            for option in words.iter().filter(|word| word.starts_with("--")) {
                assert!(lists(help, option), "{}: flqr {command:?} has no {option}", page.display());
            }
        }
    }
    for command in ["gains", "refine", "drive"] {
        assert!(helps.contains_key(&Some(command)), "{command} is not in the manual");
    }
    for (page, text) in &pages {
        let mut prose = prose_and_code(text).0;
        // Notes quote options of other programs.
        prose.retain(|line| !line.starts_with("[^"));
        for span in spans(&prose).filter(|span| span.starts_with("--")) {
            let option = span.split([' ', '=']).next().unwrap();
            let known = helps.values().any(|help| lists(help, option));
            assert!(known, "{}: no command has {option}", page.display());
        }
    }
}

#[test]
fn every_command_and_option_is_in_the_manual() {
    let texts: String = pages().into_values().collect();
    let commands = help(None);
    let listed = commands.split("\nCommands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = listed.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    for command in names.filter(|name| !name.is_empty() && *name != "help") {
        assert!(texts.contains(&format!("flqr {command}")), "{command} is not in the manual");
        let help = help(Some(command));
        let options =
            help.lines().filter_map(|line| line.trim_start().split(' ').find(|word| word.starts_with("--")));
        let options: BTreeSet<_> = options.filter(|option| !["--json", "--help"].contains(option)).collect();
        for option in options {
            assert!(texts.contains(option), "flqr {command} {option} is not in the manual");
        }
    }
}

#[test]
fn every_named_path_of_the_project_exists() {
    for (page, text) in pages() {
        let words = text.split(|c: char| c.is_whitespace() || "`()".contains(c));
        for path in words.filter(|word| {
            ["presets/", "assets/", "src/", "tests/", ".ci/"]
                .iter()
                .any(|folder| word.starts_with(folder) && word.len() > folder.len())
        }) {
            let path = path.split('#').next().unwrap();
            assert!(root().join(path).exists(), "{}: {path}", page.display());
        }
    }
}

/// The anchor of a heading, as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose_and_code(text).0.into_iter().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

/// Links to files of the project: page below the root, empty within the same page, and anchor.
fn links(page: &Path, text: &str) -> Vec<(PathBuf, Option<String>)> {
    let prose = prose_and_code(text).0.join("\n");
    let targets = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let resolved = |target: &str| {
        let (file, anchor) =
            target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
        let mut path = if file.is_empty() { page.to_owned() } else { page.parent().unwrap().to_owned() };
        for part in Path::new(file).components() {
            match part {
                Component::ParentDir => {
                    assert!(path.pop(), "{}: {target} leaves the project", page.display())
                }
                part => path.push(part),
            }
        }
        (path, anchor.map(str::to_owned))
    };
    targets.filter(|target| !target.contains("://")).map(resolved).collect()
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let pages = pages();
    let mut with_anchor = 0;
    for (page, text) in &pages {
        for (path, anchor) in links(page, text) {
            assert!(root().join(&path).is_file(), "{}: {} is no file", page.display(), path.display());
            if let Some(anchor) = anchor {
                let anchors = pages.get(&path).map(|text| anchors(text)).unwrap_or_default();
                let place = path.display();
                assert!(
                    anchors.contains(&anchor),
                    "{}: {place} has no #{anchor}: {anchors:?}",
                    page.display()
                );
                with_anchor += 1;
            }
        }
    }
    assert!(with_anchor > 10, "{with_anchor} links to headings");
}

#[test]
fn every_page_is_reached_from_the_readme_and_from_the_index() {
    let pages = pages();
    for start in ["README.md", "assets/manual/index.md"] {
        let mut reached = BTreeSet::new();
        let mut open = vec![PathBuf::from(start)];
        while let Some(page) = open.pop() {
            if let Some(text) = pages.get(&page)
                && reached.insert(page.clone())
            {
                open.extend(links(&page, text).into_iter().map(|(path, _)| path));
            }
        }
        let manual: Vec<_> = pages.keys().filter(|page| !page.ends_with("README.md")).collect();
        for page in manual {
            assert!(reached.contains(page), "{} is not reached from {start}", page.display());
        }
    }
    assert!(
        links(Path::new("README.md"), &pages[Path::new("README.md")]).contains(&("LICENSE".into(), None))
    );
}

#[test]
fn every_note_is_used_and_defined() {
    let mut found = 0;
    for (page, text) in pages() {
        let defines = |line: &&str| line.starts_with("[^");
        let notes: BTreeSet<&str> =
            text.lines().filter(defines).filter_map(|line| line.split(']').next()).collect();
        let used: BTreeSet<&str> = text
            .lines()
            .filter(|line| !defines(line))
            .flat_map(|line| line.match_indices("[^").filter_map(|(at, _)| line[at..].split(']').next()))
            .collect();
        found += used.len();
        assert_eq!(notes, used, "{}", page.display());
    }
    assert!(found > 0);
}

#[test]
fn the_readme_is_short() {
    let bytes = pages()[Path::new("README.md")].len();
    assert!(bytes <= LARGEST_README_BYTES, "{bytes} bytes");
}

/// Rows of a table of keys: key and default.
fn assert_defaults(page: &str, settings: &Value) {
    for (key, value) in settings.as_object().unwrap() {
        let row = page
            .lines()
            .find(|line| line.split('|').nth(1).is_some_and(|cell| cell.contains(&format!("`{key}`"))))
            .unwrap_or_else(|| panic!("{key} has no row"));
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let place = cells[1].split(", ").position(|name| name == format!("`{key}`")).unwrap();
        let shown = cells[2].split(", ").nth(place).unwrap().trim_matches(['`', '"']);
        match value {
            Value::Null => assert_eq!(shown, "none", "{key}"),
            Value::String(text) => assert_eq!(shown, text, "{key}"),
            Value::Bool(value) => assert_eq!(shown, value.to_string(), "{key}"),
            number => {
                let (shown, number): (f64, f64) = (shown.parse().unwrap(), number.as_f64().unwrap());
                assert!((shown - number).abs() <= 1e-4 * number.abs(), "{key}: {shown}, not {number}");
            }
        }
    }
}

#[test]
fn the_manual_gives_the_defaults_of_safety_and_link() {
    let pages = pages();
    let robot = &pages[Path::new("assets/manual/robot.md")];
    assert_defaults(robot, &serde_json::to_value(SafetyLimits::default()).unwrap());
    assert_defaults(robot, &serde_json::to_value(LinkSettings::default()).unwrap());
}

#[test]
fn the_manual_gives_the_permitted_ranges_of_safety() {
    let pages = pages();
    let robot = &pages[Path::new("assets/manual/robot.md")];
    let defaults = serde_json::to_value(SafetyLimits::default()).unwrap();
    let rejection = |key: &str, value: f64| {
        let mut limits = defaults.clone();
        limits[key] = value.into();
        let limits: SafetyLimits = serde_json::from_value(limits).unwrap();
        limits.validate().map_or_else(|error| error.to_string(), |()| String::new())
    };
    for key in defaults.as_object().unwrap().iter().filter(|(_, value)| value.is_f64()).map(|(key, _)| key) {
        let row = robot.lines().find(|line| line.starts_with(&format!("| `{key}` |"))).unwrap();
        let range = row.split('|').nth(3).unwrap().trim();
        let (low, high) = range.split_once("to ").unwrap();
        let high: f64 = high.parse().unwrap();
        assert!(rejection(key, 1.001 * high).contains("at most"), "{key}: {range}");
        assert!(!rejection(key, high).contains("at most"), "{key}: {range}");
        if let Ok(low) = low.trim().parse::<f64>() {
            assert!(rejection(key, 0.999 * low).contains("at least"), "{key}: {range}");
            assert!(!rejection(key, low).contains("at least"), "{key}: {range}");
        } else {
            assert_eq!(low, "up ", "{key}: {range}");
        }
    }
}

#[test]
fn the_manual_lists_every_log_column() {
    let pages = pages();
    let files = &pages[Path::new("assets/manual/files.md")];
    for column in LogKind::ALL.into_iter().flat_map(LogKind::required) {
        assert!(files.contains(&format!("`{column}`")), "{column}");
    }
}

/// Words that the documentation does not use, each with the phrases in which it is correct.
const BANNED: &[(&str, &[&str])] = &[
    ("mend", &[]),
    ("mends", &[]),
    ("told", &[]),
    ("tells", &[]),
    ("asked", &[]),
    ("ask", &[]),
    ("asks", &[]),
    ("tell", &[]),
    ("keep", &[]),
    ("keeps", &[]),
    ("kept", &[]),
    ("level", &[]),
    ("levels", &[]),
    ("share", &[]),
    ("shares", &[]),
    ("way", &[]),
    ("ways", &[]),
    ("waves", &[]),
    ("rests", &[]),
    ("at rest", &[]),
    ("left", &["left motor", "left and right"]),
    ("clean", &[]),
    ("sure", &[]),
    ("judge", &[]),
    ("judged", &[]),
    ("doubt", &[]),
    ("handicap", &[]),
    ("chance", &[]),
    ("twin", &[]),
    ("null", &["null distribution"]),
    ("carried", &[]),
    ("moment", &[]),
    ("picks", &[]),
    ("tried", &[]),
    ("fate", &[]),
    ("bears", &[]),
    ("counts as", &[]),
    ("gets up", &[]),
    ("hunt", &[]),
    ("hunts", &[]),
    ("for ever", &[]),
    ("by itself", &[]),
    ("by themselves", &[]),
    ("own", &[]),
    ("of before", &[]),
    ("of now", &[]),
    ("for good", &[]),
    ("none where", &[]),
    ("beside", &[]),
    ("swarm", &["particle swarm"]),
    ("house", &[]),
    ("room", &[]),
    ("floor", &["noise floor"]),
    ("how far is", &[]),
    ("what is missing", &[]),
];

/// Words of a text in lower case, between single spaces, without code, addresses and quotations.
fn words(text: &str) -> String {
    let prose = prose_and_code(text).0.join("\n");
    let outside = |text: &str, mark: char| text.split(mark).step_by(2).collect::<Vec<_>>().join(" x ");
    let plain = outside(&outside(&prose, '`'), '"');
    let plain: Vec<_> = plain.split_whitespace().filter(|word| !word.contains("://")).collect();
    let plain = plain.join(" ").to_lowercase();
    let found: Vec<_> = plain.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    format!(" {} ", found.join(" "))
}

/// The banned words of a text.
fn banned(text: &str) -> Vec<&'static str> {
    let words = words(text);
    let is_used = |(word, allowed): &&(&str, &[&str])| {
        let without = allowed.iter().fold(words.clone(), |text, phrase| text.replace(phrase, "x"));
        without.contains(&format!(" {word} "))
    };
    BANNED.iter().filter(is_used).map(|(word, _)| *word).collect()
}

#[test]
fn no_page_uses_a_banned_word() {
    assert_eq!(banned("What is left; the `share` of the left motor, its \"own\" way."), ["way", "left"]);
    for (page, text) in pages() {
        assert_eq!(banned(&text), [""; 0], "{}", page.display());
    }
}
