//! Stops, warnings and reconnects, with their times.

use std::collections::VecDeque;

use egui::{Label, RichText, ScrollArea, Ui};
use flqr_core::device::{Event, EventKind};

use crate::theme::palette;
use crate::widgets::{hint_ui, section_ui};

/// Largest number of stored events.
const KEPT: usize = 500;

/// The newest events.
#[derive(Default)]
pub(crate) struct EventLog {
    events: VecDeque<Event>,
}

impl EventLog {
    pub(super) fn extend(&mut self, events: &[Event]) {
        for event in events {
            if self.events.len() == KEPT {
                self.events.pop_front();
            }
            self.events.push_back(event.clone());
        }
    }

    pub(super) fn clear(&mut self) {
        self.events.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.events.len()
    }

    pub(super) fn last(&self) -> Option<&Event> {
        self.events.back()
    }

    pub(super) fn ui(&self, ui: &mut Ui) {
        section_ui(ui, "Events", |_| {});
        if self.events.is_empty() {
            hint_ui(ui, "Stops, warnings and reconnections are listed here.");
            return;
        }
        let colors = palette(ui.visuals());
        let height = ui.text_style_height(&egui::TextStyle::Body);
        ui.spacing_mut().item_spacing.y = 2.0;
        let area = ScrollArea::vertical().id_salt("events").auto_shrink(false);
        area.show_rows(ui, height, self.events.len(), |ui, rows| {
            for row in rows {
                let Some(event) = self.events.iter().rev().nth(row) else { continue };
                ui.horizontal(|ui| {
                    ui.set_height(height);
                    let time = format!("{:>9.3}", event.time.as_secs_f64());
                    ui.label(RichText::new(time).monospace().weak()).on_hover_text("Seconds since the start");
                    let text = RichText::new(&event.text);
                    let text = match event.kind {
                        EventKind::Note => text,
                        EventKind::Warning => text.color(colors.warning),
                        EventKind::Stop => text.strong().color(colors.error),
                    };
                    ui.add(Label::new(text).truncate()).on_hover_text(&event.text);
                });
            }
        });
    }
}
