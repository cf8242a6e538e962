//! What the README says exists, exists.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

fn readme() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap()
}

/// The word behind each "`flqr ", where it is a command and not a flag.
fn commands(text: &str) -> BTreeSet<&str> {
    text.split("`flqr ")
        .skip(1)
        .filter_map(|rest| rest.split([' ', '`']).next())
        .filter(|word| !word.starts_with('-'))
        .collect()
}

#[test]
fn every_command_has_help() {
    let text = readme();
    let commands = commands(&text);
    assert!(commands.contains("gains"), "{commands:?}");
    for command in commands {
        let output = Command::new(env!("CARGO_BIN_EXE_flqr")).args([command, "--help"]).output().unwrap();
        assert!(output.status.success(), "flqr {command}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn every_preset_and_picture_is_there() {
    let text = readme();
    let paths: BTreeSet<&str> = text
        .split(|c: char| c.is_whitespace() || "`()".contains(c))
        .filter(|word| {
            ["presets/", "assets/"].iter().any(|folder| word.starts_with(folder) && word.len() > folder.len())
        })
        .collect();
    assert!(paths.contains("presets/paper.toml"), "{paths:?}");
    for path in paths {
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(path).exists(), "{path}");
    }
}

#[test]
fn every_link_within_leads_to_a_heading() {
    let text = readme();
    let anchor = |heading: &str| heading.to_lowercase().replace(' ', "-").replace(',', "");
    let headings: BTreeSet<String> = text
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| anchor(line.trim_start_matches('#').trim()))
        .collect();
    let links: Vec<&str> = text.split("](#").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert!(links.contains(&"limits"), "{links:?}");
    for link in links {
        assert!(headings.contains(link), "#{link} is none of {headings:?}");
    }
}

#[test]
fn every_linked_file_is_there() {
    let text = readme();
    let links: BTreeSet<&str> = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .filter(|link| !link.starts_with('#') && !link.contains("://"))
        .collect();
    assert!(links.contains("LICENSE"), "{links:?}");
    for link in links {
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(link).exists(), "{link}");
    }
}

#[test]
fn every_note_is_used_and_every_used_one_is_there() {
    let text = readme();
    let notes: BTreeSet<&str> = text
        .lines()
        .filter(|line| line.starts_with("[^"))
        .filter_map(|line| line.split(']').next())
        .collect();
    let used: BTreeSet<&str> = text
        .lines()
        .filter(|line| !line.starts_with("[^"))
        .flat_map(|line| line.match_indices("[^").filter_map(|(at, _)| line[at..].split(']').next()))
        .collect();
    assert!(!used.is_empty());
    assert_eq!(notes, used);
}
