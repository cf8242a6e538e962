//! Changes from one row to another.

use std::collections::BTreeSet;

use egui::{ComboBox, Grid, Label, RichText, ScrollArea, Ui};

use super::ledger::Ledger;
use super::run::{Run, Value, differences};
use crate::widgets::{change, hint_ui, mono, section_ui, shown};

/// Greatest width of a name and of a text among the values; a tip has all of it.
const KEY_WIDTH: f32 = 170.0;
const TEXT_WIDTH: f32 = 90.0;

/// The two rows; until others are chosen those that are ticked, or the last two of one kind.
#[derive(Default)]
pub(super) struct Changes {
    chosen: [Option<u64>; 2],
}

impl Changes {
    pub(super) fn ui(&mut self, ledger: &Ledger, ticked: &BTreeSet<u64>, ui: &mut Ui) {
        section_ui(ui, "Changes", |_| {});
        let usual = usual(ledger, ticked);
        let mut numbers = usual;
        for (place, chosen) in self.chosen.iter_mut().enumerate() {
            chosen.take_if(|number| ledger.row(*number).is_none());
            if let Some(other) = choice_ui(ui, ledger, ["from", "to"][place], chosen.or(usual[place])) {
                *chosen = Some(other);
            }
            numbers[place] = chosen.or(usual[place]);
        }
        let [Some(old), Some(new)] = numbers.map(|number| ledger.row(number?)) else {
            hint_ui(ui, "Select two rows.");
            return;
        };
        ScrollArea::both().id_salt("changes").auto_shrink(false).show(ui, |ui| differences_ui(old, new, ui));
    }
}

/// The two ticked rows, or the last two of one kind, or the last two of all.
fn usual(ledger: &Ledger, ticked: &BTreeSet<u64>) -> [Option<u64>; 2] {
    if let (2, Some(first), Some(last)) = (ticked.len(), ticked.first(), ticked.last()) {
        return [Some(*first), Some(*last)];
    }
    if let Some(alike) = ledger.last_alike(|_| true) {
        return alike.map(Some);
    }
    let rows = ledger.rows();
    [2, 1].map(|back| rows.len().checked_sub(back).map(|index| rows[index].number))
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
        hint_ui(ui, format!("Nothing: both used the same values, {same}."));
    }
    Grid::new("changes").num_columns(4).striped(true).spacing([12.0, 3.0]).show(ui, |ui| {
        if !found.is_empty() {
            for head in ["value", "old", "new", "change"] {
                hint_ui(ui, head);
            }
            ui.end_row();
        }
        for row in &found {
            cell_ui(ui, KEY_WIDTH, RichText::new(&row.key).small());
            for value in [&row.old, &row.new] {
                cell_ui(ui, TEXT_WIDTH, mono(text(value.as_ref())));
            }
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

/// A text that is cut where it is longer than `width`; a tip has all of it then.
fn cell_ui(ui: &mut Ui, width: f32, text: RichText) {
    ui.horizontal(|ui| {
        ui.set_max_width(width);
        ui.add(Label::new(text).truncate());
    });
}

fn text(value: Option<&Value>) -> String {
    match value {
        None => "–".to_owned(),
        Some(Value::Number(number)) => shown(*number, 4),
        Some(Value::Text(text)) => text.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::{RunKind, Sources};

    #[test]
    fn the_newest_rows_of_one_kind_are_compared() {
        use RunKind::{Experiment, Fit, Refinement};
        for (kinds, expected) in [
            (&[Experiment, Experiment, Refinement][..], [Some(1), Some(2)]),
            (&[Fit, Experiment, Experiment, Fit], [Some(1), Some(4)]),
            (&[Experiment, Experiment, Experiment], [Some(2), Some(3)]),
            (&[Experiment, Refinement], [Some(1), Some(2)]),
            (&[Fit], [None, Some(1)]),
        ] {
            let mut ledger = Ledger::default();
            for kind in kinds {
                ledger.add(Run::new(*kind, "run", None, Sources::new(None, [])), 7);
            }
            assert_eq!(usual(&ledger, &BTreeSet::new()), expected, "{kinds:?}");
            let ticked = BTreeSet::from([1, 2]);
            assert_eq!(usual(&ledger, &ticked), [Some(1), Some(2)], "{kinds:?}");
        }
    }
}
