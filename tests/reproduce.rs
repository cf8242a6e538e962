//! `flqr reproduce` as scripts see it.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

fn flqr(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program was built with its tests")
}

fn path(name: &str) -> String {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name).display().to_string()
}

/// The JSON and the report of one run with one seed.
fn reproduced(threads: &str) -> (Vec<u8>, String) {
    let report = path(&format!("reproduced-{threads}.html"));
    let output = flqr(&["reproduce", "--seeds", "1", "--threads", threads, "--report", &report, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    (output.stdout, std::fs::read_to_string(report).unwrap())
}

#[test]
fn the_number_of_threads_changes_no_byte_and_every_table_has_both_sides() {
    let (json, report) = reproduced("1");
    assert!(reproduced("2") == (json.clone(), report.clone()), "one and two threads differ");
    let found: Value = serde_json::from_slice(&json).unwrap();
    let tables = found["tables"].as_array().unwrap();
    for number in 1..=7 {
        let id = format!("table_{number}");
        let table = tables.iter().find(|table| table["id"] == id.as_str()).unwrap();
        for side in ["ours", "paper"] {
            let rows = table[side].as_array().unwrap();
            assert_eq!(rows.len(), table["rows"].as_array().unwrap().len(), "{id} {side}");
            let columns = table["columns"].as_array().unwrap().len();
            assert!(rows.iter().all(|row| row.as_array().unwrap().len() == columns), "{id} {side}");
        }
    }
    let ids: Vec<_> = tables.iter().map(|table| table["id"].as_str().unwrap()).collect();
    for id in ["figure_6", "figure_7", "table_5_factors", "table_6_factors", "table_7_ratios"] {
        assert!(ids.contains(&id), "{ids:?}");
    }
    let numbers: Vec<_> = found["contradictions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["number"].as_u64().unwrap())
        .collect();
    assert_eq!(numbers, (1..=11).collect::<Vec<_>>());
    for figure in [4, 5, 6, 7, 8, 10, 12] {
        assert!(report.contains(&format!("<figcaption>Figure {figure}: ")), "no figure {figure}");
    }
}

/// What the paper's preset was made for, with the seed that everybody gets.
#[test]
fn the_papers_preset_hunts_under_lqr_and_is_calmed_by_flqr() {
    let output = flqr(&["reproduce", "--seeds", "1", "--json"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let holds = |id: &str| {
        let findings = found["findings"].as_array().unwrap();
        findings.iter().find(|finding| finding["id"] == id).unwrap()["holds"].as_bool().unwrap()
    };
    for id in [
        "table_4_curve",
        "figures_6_7_rise",
        "table_5_lqr",
        "table_5_factors",
        "table_6_lqr",
        "table_7_disturbed",
    ] {
        assert!(holds(id), "{id}");
    }
    // The paper's factor of 23 in x on the bridge is more than this robot reaches.
    assert!(!holds("table_6_factors"));
    assert!(!holds("abstract_claim_paper"));
}

#[test]
fn models_that_cannot_serve_are_refused_in_one_line() {
    let axis = path("reproduce-axis.toml");
    std::fs::write(&axis, "name = \"rail\"\n[axis]\nkind = \"linear\"\nmass_kg = 95.0\n").unwrap();
    let output = flqr(&["reproduce", &axis]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), message.trim().lines().count()), (Some(1), 1), "{message}");
    assert!(message.contains("describes a single axis: give a model with a [robot] table"), "{message}");
    assert_eq!(flqr(&["reproduce", "--seeds", "0"]).status.code(), Some(2));
}
