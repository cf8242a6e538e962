//! The command palette: a filter over all commands.

use egui::{Button, Context, Key, Modal, Modifiers, RichText, ScrollArea, TextEdit, Ui, vec2};

use super::{ALL, Entry, Situation};
use crate::command::{Command, Commands};
use crate::robot::{STOP_HEIGHT, stop_ui};
use crate::widgets::hint_ui;

/// The open palette.
#[derive(Default)]
pub(crate) struct Palette {
    filter: String,
    /// Index of the match that Enter takes.
    chosen: usize,
    has_focus: bool,
}

impl Palette {
    /// Draws the palette; returns whether it stays open.
    pub(crate) fn ui(&mut self, situation: &Situation<'_>, commands: &Commands, ctx: &Context) -> bool {
        let modal = Modal::new(egui::Id::unique("palette")).show(ctx, |ui| {
            ui.set_width(520.0_f32.min(ctx.content_rect().width() - 40.0).max(0.0));
            // The one of the strip cannot be reached behind this.
            if situation.is_hot && stop_ui(ui, vec2(ui.available_width(), STOP_HEIGHT)).clicked() {
                commands.send(Command::Stop);
            }
            self.content_ui(situation, commands, ui)
        });
        modal.inner && !modal.should_close()
    }

    fn content_ui(&mut self, situation: &Situation<'_>, commands: &Commands, ui: &mut Ui) -> bool {
        // Before the field can take them.
        let pressed = |ui: &Ui, key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let (up, down) = (pressed(ui, Key::ArrowUp), pressed(ui, Key::ArrowDown));
        let enter = pressed(ui, Key::Enter);
        let field = TextEdit::singleline(&mut self.filter)
            .hint_text("type part of a command name")
            .desired_width(f32::INFINITY);
        let field = ui.add(field).accessible_name("command");
        if !std::mem::replace(&mut self.has_focus, true) {
            field.request_focus();
        }
        if field.changed() {
            self.chosen = 0;
        }
        let found = found(&self.filter);
        if found.is_empty() {
            hint_ui(ui, "No command matches.");
            return true;
        }
        self.chosen = (self.chosen + usize::from(down)).saturating_sub(usize::from(up)).min(found.len() - 1);
        let mut open = true;
        ScrollArea::vertical().max_height(380.0).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for (row, index) in found.iter().enumerate() {
                open &= self.row_ui((row, *index), (enter, up || down), situation, commands, ui);
            }
        });
        open
    }

    /// Returns whether the palette stays open.
    fn row_ui(
        &self,
        (row, index): (usize, usize),
        (enter, moved): (bool, bool),
        situation: &Situation<'_>,
        commands: &Commands,
        ui: &mut Ui,
    ) -> bool {
        let entry = &ALL[index];
        let sent = entry.send(situation);
        let chosen = row == self.chosen;
        let text = RichText::new(&*entry.name);
        let text = if sent.is_ok() { text } else { text.weak() };
        let right = match &sent {
            Ok(_) => entry.keys_text(ui.ctx()),
            Err(reason) => (*reason).to_owned(),
        };
        let button = Button::selectable(chosen, text)
            .shortcut_text(right)
            .min_size(egui::vec2(ui.available_width(), 0.0));
        let button = ui.add(button).accessible_name(entry.accessible_name(&sent));
        if chosen && moved {
            button.scroll_to_me(None);
        }
        let taken = button.clicked() || (chosen && enter);
        button.on_hover_text(&*entry.help);
        match sent {
            Ok(command) if taken => {
                commands.send(command);
                false
            }
            _ => true,
        }
    }
}

/// Commands whose names contain all letters of `filter` in order, the best match first.
pub(super) fn found(filter: &str) -> Vec<usize> {
    let filter = filter.trim().to_lowercase();
    let mut found: Vec<_> = ALL
        .iter()
        .enumerate()
        .filter_map(|(index, entry)| Some((distance_to(&filter, entry)?, index)))
        .collect();
    found.sort_unstable();
    found.into_iter().map(|(_, index)| index).collect()
}

/// Distance of a command from `filter`: by its name, or as a part of a name by its other words.
fn distance_to(filter: &str, entry: &Entry) -> Option<(usize, usize)> {
    let known = |word: &str| entry.also.split(' ').any(|other| other.starts_with(word));
    let by_words = filter.split_whitespace().all(known) && !filter.is_empty();
    let by_name = distance(filter, &entry.name.to_lowercase());
    by_name.into_iter().chain(by_words.then_some((3, 1))).min()
}

/// Distance of `name` from `filter`; `None` if the letters are not all in it in order. The whole name is
/// nearest, then its start, then the start of a word in it, then a part of it, then letters near each other.
fn distance(filter: &str, name: &str) -> Option<(usize, usize)> {
    if filter.is_empty() {
        return Some((0, 0));
    }
    if name == filter {
        return Some((0, 0));
    }
    if let Some(at) = name.find(filter) {
        let at_word = at == 0 || name[..at].ends_with(|c: char| !c.is_alphanumeric());
        return Some((if at == 0 { 1 } else { 3 - usize::from(at_word) }, 0));
    }
    let mut letters = name.char_indices();
    let (mut first, mut last) = (None, 0);
    for wanted in filter.chars().filter(|c| !c.is_whitespace()) {
        let (at, _) = letters.find(|(_, letter)| *letter == wanted)?;
        first.get_or_insert(at);
        last = at;
    }
    Some((4, last - first.unwrap_or(0) + name.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first(filter: &str) -> &'static str {
        found(filter).first().map_or("none", |index| &*ALL[*index].id)
    }

    #[test]
    fn a_part_or_some_letters_of_a_name_find_it() {
        for (filter, id) in [
            ("light", "theme"),
            ("STOP", "stop"),
            ("expmnts", "tab-experiments"),
            ("rst weights", "reset-weights"),
            ("source: can", "source-can"),
            ("friction", "tab-friction"),
            ("split", "right-tune"),
            ("tiles", "reset-layout"),
            ("csv", "export-csv"),
            ("import", "open-log"),
            ("export", "export-csv"),
            ("residual", "residual"),
            ("report", "save-report"),
            ("exit", "quit"),
        ] {
            assert_eq!(first(filter), id, "{filter}");
        }
        for filter in ["tile", "split", "dock"] {
            let layout = |index: &usize| {
                matches!(ALL[*index].group, Some("Tiles")) || ALL[*index].id == "reset-layout"
            };
            assert!(found(filter).iter().take(10).all(layout), "{filter}");
        }
        for (filter, ids) in [
            ("refine", &["find-missing", "residual", "use-found", "save-report"][..]),
            ("export", &["export-csv", "export-figure", "save-report"]),
            ("add", &["use-found"]),
        ] {
            let found: Vec<_> = found(filter).into_iter().map(|index| &*ALL[index].id).collect();
            assert!(
                ids.iter().all(|id| found.iter().take(12).any(|found| found == id)),
                "{filter}: {found:?}"
            );
        }
        assert!(found("zzzzq").is_empty());
        assert_eq!(found("").len(), ALL.len());
    }
}
