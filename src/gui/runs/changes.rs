//! What changed from one row to another.

use egui::{ComboBox, Grid, RichText, ScrollArea, Ui};

use super::run::{Ledger, Run, Value, differences};
use crate::widgets::{change, hint_ui, mono, section_ui, shown};

/// The two rows; the last two until others are chosen.
#[derive(Default)]
pub(super) struct Changes {
    chosen: [Option<u64>; 2],
}

impl Changes {
    pub(super) fn ui(&mut self, ledger: &Ledger, ui: &mut Ui) {
        section_ui(ui, "What changed", |_| {});
        let rows = ledger.rows();
        for (place, chosen) in self.chosen.iter_mut().enumerate() {
            chosen.take_if(|number| ledger.row(*number).is_none());
            let usual = rows.len().checked_sub(2 - place).map(|index| rows[index].number);
            let number = chosen.or(usual);
            if let Some(other) = choice_ui(ui, ledger, ["from", "to"][place], number) {
                *chosen = Some(other);
            }
        }
        let numbers = [0, 1].map(|place| {
            self.chosen[place].or(rows.len().checked_sub(2 - place).map(|index| rows[index].number))
        });
        let [Some(old), Some(new)] = numbers.map(|number| ledger.row(number?)) else {
            hint_ui(ui, "Two rows are needed.");
            return;
        };
        ScrollArea::both().id_salt("changes").auto_shrink(false).show(ui, |ui| differences_ui(old, new, ui));
    }
}

/// Another row where one was chosen.
fn choice_ui(ui: &mut Ui, ledger: &Ledger, name: &str, number: Option<u64>) -> Option<u64> {
    let title = |run: &Run| format!("{}  {}", run.number, run.title);
    let text = number.and_then(|number| ledger.row(number)).map_or("–".to_owned(), title);
    let mut chosen = None;
    ui.horizontal(|ui| {
        ui.add_sized([32.0, 18.0], egui::Label::new(name));
        let combo =
            ComboBox::from_id_salt(name).selected_text(text).width(ui.available_width() - 8.0).truncate();
        let combo = combo.show_ui(ui, |ui| {
            for run in ledger.rows().iter().rev() {
                if ui.selectable_label(number == Some(run.number), title(run)).clicked() {
                    chosen = Some(run.number);
                }
            }
        });
        combo.response.accessible_name(format!("{name} run"));
    });
    chosen
}

fn differences_ui(old: &Run, new: &Run, ui: &mut Ui) {
    let found = differences(old, new);
    if found.is_empty() {
        let same = if old.sources == new.sources { "and the same sources" } else { "with other sources" };
        hint_ui(ui, format!("Nothing: both were made with the same values, {same}."));
    }
    Grid::new("changes").num_columns(4).striped(true).spacing([12.0, 3.0]).show(ui, |ui| {
        if !found.is_empty() {
            for head in ["value", "old", "new", "change"] {
                hint_ui(ui, head);
            }
            ui.end_row();
        }
        for row in &found {
            ui.label(RichText::new(&row.key).small());
            ui.label(mono(text(row.old.as_ref())));
            ui.label(mono(text(row.new.as_ref())));
            let numbers = (&row.old, &row.new);
            let relative = match numbers {
                (Some(Value::Number(old)), Some(Value::Number(new))) => change(*old, *new),
                _ => String::new(),
            };
            ui.label(mono(relative).weak());
            ui.end_row();
        }
    });
    ui.add_space(4.0);
    for run in [old, new] {
        hint_ui(ui, format!("{}: {}", run.number, run.result));
    }
}

fn text(value: Option<&Value>) -> String {
    match value {
        None => "–".to_owned(),
        Some(Value::Number(number)) => shown(*number, 4),
        Some(Value::Text(text)) => text.clone(),
    }
}
