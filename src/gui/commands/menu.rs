//! The menus and the list of keys.

use egui::{Button, Grid, RichText, ScrollArea, Ui};

use super::{ALL, Entry, GESTURES, Menu, Situation};
use crate::command::Commands;

/// Draws the menu button with all menus.
pub(crate) fn menu_ui(situation: &Situation<'_>, commands: &Commands, ui: &mut Ui) {
    let menu = ui.menu_button("Menu", |ui| {
        for menu in Menu::ALL {
            ui.menu_button(menu.title(), |ui| {
                ScrollArea::vertical()
                    .max_height(560.0)
                    .show(ui, |ui| entries_ui(menu, situation, commands, ui));
            });
        }
    });
    menu.response.on_hover_text("All commands");
}

fn entries_ui(menu: Menu, situation: &Situation<'_>, commands: &Commands, ui: &mut Ui) {
    let of_menu = || ALL.iter().filter(move |entry| entry.menu == menu);
    let mut shown: Vec<&str> = Vec::new();
    for entry in of_menu() {
        match entry.group {
            None => entry_ui(entry, situation, commands, ui),
            Some(group) if shown.contains(&group) => {}
            Some(group) => {
                shown.push(group);
                ui.menu_button(group, |ui| {
                    ScrollArea::vertical().max_height(560.0).show(ui, |ui| {
                        for entry in of_menu().filter(|entry| entry.group == Some(group)) {
                            entry_ui(entry, situation, commands, ui);
                        }
                    });
                });
            }
        }
    }
}

fn entry_ui(entry: &Entry, situation: &Situation<'_>, commands: &Commands, ui: &mut Ui) {
    let sent = entry.send(situation);
    let button = Button::new(&*entry.name).shortcut_text(entry.keys_text(ui.ctx()));
    let button = ui.add_enabled(sent.is_ok(), button).accessible_name(entry.accessible_name(&sent));
    let button = button.on_hover_text(&*entry.help);
    match sent {
        Ok(command) if button.clicked() => {
            commands.send(command);
            ui.close();
        }
        Ok(_) => {}
        Err(reason) => {
            button.on_disabled_hover_text(reason);
        }
    }
}

/// Draws the list of shortcuts.
pub(crate) fn keys_ui(ui: &mut Ui) {
    let room = (ui.ctx().content_rect().height() - 90.0).max(120.0);
    ScrollArea::vertical().max_height(room).min_scrolled_height(room).show(ui, |ui| {
        Grid::new("keys").num_columns(2).spacing([16.0, 2.0]).show(ui, |ui| {
            for (keys, meaning) in GESTURES {
                ui.label(RichText::new(*keys).monospace());
                ui.label(*meaning);
                ui.end_row();
            }
        });
        ui.separator();
        let with_keys: Vec<_> = ALL.iter().filter(|entry| !entry.keys.is_empty()).collect();
        let (left, right) = with_keys.split_at(with_keys.len().div_ceil(2));
        Grid::new("command keys").num_columns(4).spacing([16.0, 2.0]).show(ui, |ui| {
            for row in 0..left.len() {
                for entry in left.get(row).into_iter().chain(right.get(row)) {
                    ui.label(RichText::new(entry.keys_text(ui.ctx())).monospace());
                    ui.label(&*entry.name).on_hover_text(&*entry.help);
                }
                ui.end_row();
            }
        });
    });
}
