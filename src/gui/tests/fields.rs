//! Number fields: entering and leaving one changes nothing, and Esc restores what was there.

#![expect(clippy::unwrap_used, reason = "helpers of tests, where a panic is the report")]

mod common;

use common::{SIZE, Window, click, open, options, state};
use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use flqr_core::model::Model;
use flqr_gui::{Tab, WindowOptions};
use serde_json::Value;

/// A model whose numbers have more digits than a field shows.
fn window(tab: Tab) -> Window {
    let text = common::ROBOT
        .replace("[60.0, 30.0, 100.0, 5.0]", "[2.0, 33.333333333333336, 100.12345678, 0.1]")
        .replace("static_nm = 0.0761", "static_nm = 0.0761234567")
        .replace("body_mass_kg = 13.0", "body_mass_kg = 13.0123456");
    let model = Model::from_toml(&text, "test.toml").unwrap();
    // High enough that no field is scrolled out of sight.
    open(WindowOptions { model, ..options(tab) }, SIZE + vec2(400.0, 2200.0))
}

/// What a field could change.
fn content(window: &Window) -> Value {
    let state = state(window);
    let keys = ["q_diagonal", "r_diagonal", "gain", "friction", "unsaved_changes", "undo"];
    let mut content: Vec<_> = keys.iter().map(|key| state[*key].clone()).collect();
    let fields = window.get_all_by_role(Role::SpinButton);
    content.extend(fields.map(|field| field.accesskit_node().value().unwrap_or_default().into()));
    content.into()
}

fn names(window: &Window) -> Vec<String> {
    let fields = window.query_all_by_role(Role::SpinButton);
    fields.filter_map(|field| field.accesskit_node().label()).collect()
}

const PAGES: [Tab; 5] = [Tab::Tune, Tab::Friction, Tab::Refine, Tab::Experiments, Tab::Robot];

#[test]
fn tab_goes_through_every_page_and_changes_nothing() {
    for page in PAGES {
        let mut window = window(page);
        let before = content_if_any(&window);
        for _ in 0..150 {
            window.key_press(Key::Tab);
            window.step();
        }
        // Out of the last field.
        window.key_press(Key::Escape);
        window.run_steps(4);
        assert_eq!(content_if_any(&window), before, "{page:?}");
    }
}

fn content_if_any(window: &Window) -> Value {
    if names(window).is_empty() { state(window)["unsaved_changes"].clone() } else { content(window) }
}

#[test]
fn a_click_and_enter_escape_or_another_click_change_no_field() {
    for page in PAGES {
        let mut window = window(page);
        for name in names(&window) {
            let before = content(&window);
            for leave in [Key::Enter, Key::Escape, Key::Tab] {
                window.get_by_role_and_label(Role::SpinButton, &name).click();
                window.run_steps(3);
                window.key_press(leave);
                window.run_steps(4);
                if leave == Key::Tab {
                    window.key_press(Key::Escape);
                    window.run_steps(4);
                }
                assert_eq!(content(&window), before, "{name}, {leave:?}");
            }
        }
    }
}

#[test]
fn escape_discards_what_was_typed() {
    for page in PAGES {
        let mut window = window(page);
        for name in names(&window) {
            let before = content(&window);
            window.get_by_role_and_label(Role::SpinButton, &name).click();
            window.run_steps(3);
            window.key_press_modifiers(Modifiers::COMMAND, Key::A);
            window.event(Event::Text("7.25".to_owned()));
            window.run_steps(2);
            window.key_press(Key::Escape);
            window.run_steps(5);
            assert_eq!(content(&window), before, "{name}");
        }
    }
}

#[test]
fn a_field_shows_all_digits_while_it_is_edited_and_writes_what_was_typed() {
    let mut window = window(Tab::Tune);
    for (name, short, all) in [
        ("velocity weight", "33.33", "33.333333333333336"),
        ("pitch weight", "100.1", "100.12345678"),
        ("static friction left", "0.07612", "0.0761234567"),
        ("body mass value", "13.01", "13.0123456"),
        ("displacement deviation", "0.7071", "0.7071067811865475"),
    ] {
        let shown = |window: &Window| window.get_by_label(name).value().unwrap();
        assert_eq!(shown(&window), short);
        window.get_by_label(name).click();
        window.run_steps(3);
        assert_eq!(shown(&window), all);
        window.key_press(Key::Escape);
        window.run_steps(4);
        assert_eq!(shown(&window), short);
    }
    common::enter(&mut window, "displacement weight", "2.00001");
    assert_eq!(state(&window)["q_diagonal"][0], 2.00001);
    common::enter(&mut window, "displacement deviation", "0.5");
    assert_eq!(state(&window)["q_diagonal"][0], 4.0);
    click(&mut window, "Reset weights");
    assert_eq!(state(&window)["q_diagonal"][0], 2.0);
}
