//! The manual in the window.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use common::{SIZE, Window, click, command, open, options, random_input, state};
use egui::{Event, Key, vec2};
use egui_kittest::kittest::Queryable;
use flqr_gui::Tab;

const TITLES: [&str; 15] = [
    "flqr manual",
    "Model and LQR design",
    "Simulation",
    "Experiments of the paper",
    "Friction identification",
    "Logs and recordings",
    "Model refinement",
    "Robot on CAN",
    "Files and effects",
    "Command line",
    "The window",
    "Figures",
    "Limits",
    "Comparison with other tools",
    "Source code",
];

/// File of the page that is shown; `None` while the manual is closed.
fn page(window: &Window) -> Option<String> {
    state(window)["manual"]["page"].as_str().map(str::to_owned)
}

fn press(window: &mut Window, key: Key) {
    window.key_press(key);
    window.run_steps(4);
}

#[test]
fn f1_opens_the_page_of_each_tab() {
    let mut window = open(options(Tab::Tune), SIZE);
    for (tab, file, heading) in [
        ("Tune", "design.md", "Model and LQR design"),
        ("Friction", "friction.md", "Friction identification"),
        ("Refine", "refine.md", "Model refinement"),
        ("Experiments", "simulate.md", "Simulation"),
        ("Robot", "robot.md", "Robot on CAN"),
        ("Runs", "window.md", "Run ledger"),
        ("Log", "window.md", "Messages"),
    ] {
        click(&mut window, tab);
        press(&mut window, Key::F1);
        assert_eq!(page(&window).as_deref(), Some(file), "{tab}");
        let shown = window.get_all_by_label(heading).any(|node| SIZE.y > node.rect().bottom());
        assert!(shown, "{tab}: {heading} is in view");
        press(&mut window, Key::Escape);
        assert_eq!(page(&window), None, "Esc closes it");
    }
}

#[test]
fn a_link_leads_to_its_heading_and_back_returns() {
    let mut window = open(options(Tab::Tune), SIZE);
    command(&mut window, "manual");
    assert_eq!(page(&window).as_deref(), Some("design.md"));
    window.get_by_label("model files").click();
    window.run_steps(4);
    assert_eq!(page(&window).as_deref(), Some("files.md"));
    assert!(window.query_by_label("Model file").is_some(), "the heading is in view");
    click(&mut window, "Back");
    assert_eq!(page(&window).as_deref(), Some("design.md"));

    click(&mut window, "Figures");
    assert_eq!(page(&window).as_deref(), Some("figures.md"));
    press(&mut window, Key::F1);
    assert_eq!(page(&window).as_deref(), Some("design.md"), "F1 goes to the page of what is in view");
}

#[test]
fn every_page_is_drawn_from_its_start_to_its_end() {
    let mut window = open(options(Tab::Tune), SIZE);
    press(&mut window, Key::F1);
    let mut files = std::collections::BTreeSet::new();
    for title in TITLES {
        let listed = window.get_all_by_label(title).next().unwrap();
        listed.click();
        window.run_steps(4);
        files.insert(page(&window).unwrap());
    }
    assert_eq!(files.len(), TITLES.len());
}

#[test]
fn a_search_leads_to_the_row_of_a_table() {
    for size in [SIZE, vec2(560.0, 500.0)] {
        let mut window = open(options(Tab::Tune), size);
        press(&mut window, Key::F1);
        window.event(Event::Text("presliding dahl".to_owned()));
        window.run_steps(3);
        press(&mut window, Key::Enter);
        press(&mut window, Key::Escape);
        let manual = &state(&window)["manual"];
        assert_eq!(manual["page"], "files.md", "{size}: Esc has cleared the search");
        assert!(manual["offset"].as_f64().unwrap() > 500.0, "{size}: {manual}");
        let row = window.get_all_by_label_contains("Dahl model").next().unwrap().rect();
        assert!(row.top() > 0.0 && row.bottom() < size.y, "{size}: {row}");
    }
}

#[test]
fn keys_scroll_the_page_and_the_manual_stays_below_the_bars() {
    let mut window = open(options(Tab::Tune), SIZE);
    press(&mut window, Key::F1);
    assert_eq!(state(&window)["manual"]["offset"], 0.0);
    press(&mut window, Key::PageDown);
    for _ in 0..60 {
        window.step();
    }
    assert!(state(&window)["manual"]["offset"].as_f64().unwrap() > 100.0);
    let bar = window.get_by_label("Menu").rect();
    let field = window.get_by_label("search the manual").rect();
    assert!(field.top() > bar.bottom());
}

#[test]
fn random_input_in_the_manual_breaks_nothing() {
    for seed in 0..4 {
        let mut window = open(options(Tab::Tune), SIZE);
        press(&mut window, Key::F1);
        random_input(&mut window, seed);
        let _shown = page(&window);
    }
}
