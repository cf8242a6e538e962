//! All messages since the start: the newest is in the status line, all are on the *Log* page.

use std::cell::Cell;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

use egui::{
    Align, CentralPanel, Color32, Frame, Layout, Margin, Rect, RichText, ScrollArea, TextEdit, TextStyle, Ui,
    UiBuilder, Visuals, vec2,
};

use flqr_core::message;
use serde_json::Value;

use crate::context::ViewContext;
use crate::pages::Page;
use crate::theme::palette;
use crate::widgets::hint_ui;

/// The oldest go first.
const LONGEST: usize = 2000;
/// Room for the time of a message.
const TIME_WIDTH: f32 = 96.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Severity {
    Note,
    Warning,
    Error,
}

impl Severity {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }

    /// The colour of its text.
    pub(crate) fn color(self, visuals: &Visuals) -> Color32 {
        match self {
            Self::Note => visuals.text_color(),
            Self::Warning => palette(visuals).warning,
            Self::Error => palette(visuals).error,
        }
    }
}

/// Message and severity.
pub(crate) type Said = (Severity, String);

/// Turns the outcome of some work into a message.
pub(crate) fn said(outcome: Result<String, String>) -> Said {
    match outcome {
        Ok(text) => (Severity::Note, text),
        Err(problem) => (Severity::Error, problem),
    }
}

/// One message, and how often it came in a row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Message {
    /// Since the start.
    pub(crate) time: Duration,
    pub(crate) severity: Severity,
    pub(crate) text: String,
    pub(crate) times: usize,
    /// Width that it was laid out in last, and the height that it took.
    laid_out: Cell<Option<(f32, f32)>>,
}

impl Message {
    fn text(&self) -> String {
        match self.times {
            1 => self.text.clone(),
            times => format!("{} ({times} times)", self.text),
        }
    }

    /// Height at `width`; computed once.
    fn height(&self, ui: &Ui, width: f32) -> f32 {
        if let Some((known, height)) = self.laid_out.get()
            && known == width
        {
            return height;
        }
        let font = TextStyle::Body.resolve(ui.style());
        let height = ui.painter().layout(self.text(), font, Color32::PLACEHOLDER, width).size().y;
        self.laid_out.set(Some((width, height)));
        height
    }

    fn line(&self) -> String {
        let times = if self.times > 1 { format!(" ({} times)", self.times) } else { String::new() };
        format!("{:9.3} s  {:5}  {}{times}", self.time.as_secs_f64(), self.severity.word(), self.text)
    }
}

/// All messages, and what the page shows of them.
pub(crate) struct Messages {
    start: Instant,
    all: VecDeque<Message>,
    /// Message that stays in the status line until the next user input.
    standing: Option<String>,
    filter: String,
    only_errors: bool,
}

impl Default for Messages {
    fn default() -> Self {
        Self {
            start: Instant::now(),
            all: VecDeque::new(),
            standing: None,
            filter: String::new(),
            only_errors: false,
        }
    }
}

impl Messages {
    pub(crate) fn add(&mut self, severity: Severity, text: impl Into<String>) {
        let (time, text) = (self.start.elapsed(), message::shown(&text.into()));
        match self.all.back_mut() {
            Some(last) if last.text == text && last.severity == severity => {
                last.time = time;
                last.times += 1;
                last.laid_out.take();
            }
            _ => {
                if self.all.len() == LONGEST {
                    self.all.pop_front();
                }
                let laid_out = Cell::new(None);
                self.all.push_back(Message { time, severity, text, times: 1, laid_out });
            }
        }
    }

    /// Adds a warning that the status line keeps until `release`.
    pub(crate) fn stand(&mut self, text: String) {
        self.add(Severity::Warning, text.clone());
        self.standing = Some(text);
    }

    /// The user has done something: what stood in the status line has been in view.
    pub(crate) fn release(&mut self) {
        self.standing = None;
    }

    /// Text of the status line.
    pub(crate) fn status(&self) -> Option<(Severity, &str)> {
        let newest = || self.all.back().map(|message| (message.severity, &*message.text));
        self.standing.as_deref().map(|text| (Severity::Warning, text)).or_else(newest)
    }

    fn shown(&self) -> Vec<&Message> {
        let filter = self.filter.trim().to_lowercase();
        let fits = |message: &&Message| {
            (!self.only_errors || message.severity != Severity::Note)
                && (filter.is_empty() || message.text.to_lowercase().contains(&filter))
        };
        self.all.iter().filter(fits).collect()
    }

    fn controls_ui(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            let filter = TextEdit::singleline(&mut self.filter).hint_text("filter").desired_width(180.0);
            ui.add(filter).accessible_name("message filter").on_hover_text("Filter messages");
            ui.checkbox(&mut self.only_errors, "Errors only").on_hover_text("And warnings");
            let shown = self.shown();
            let copy = ui.add_enabled(!shown.is_empty(), egui::Button::new("Copy messages"));
            if copy.on_hover_text("Copy the shown messages as text").clicked() {
                let lines: Vec<_> = shown.iter().map(|message| message.line()).collect();
                ui.ctx().copy_text(lines.join("\n"));
            }
            hint_ui(ui, format!("{} of {} messages", shown.len(), self.all.len()));
            if ui.button("Clear").on_hover_text("Clear all messages").clicked() {
                self.all.clear();
            }
        });
    }

    fn rows_ui(&self, ui: &mut Ui) {
        let shown = self.shown();
        if shown.is_empty() {
            hint_ui(ui, "No message.");
            return;
        }
        let space = ui.spacing().item_spacing;
        // The scroll bar's room is not the text's.
        let width =
            (ui.available_width() - TIME_WIDTH - space.x - 2.0 * ui.spacing().scroll.bar_width).max(80.0);
        let mut bottom = 0.0;
        let bottoms: Vec<f32> = shown
            .iter()
            .map(|message| {
                bottom += message.height(ui, width) + space.y;
                bottom
            })
            .collect();
        // Only what is in view is drawn.
        ScrollArea::vertical().auto_shrink(false).stick_to_bottom(true).show_viewport(ui, |ui, viewport| {
            ui.set_height(bottom);
            let corner = ui.min_rect().left_top();
            let first = bottoms.partition_point(|bottom| *bottom < viewport.top());
            for index in first..shown.len() {
                let top = if index == 0 { 0.0 } else { bottoms[index - 1] };
                if top > viewport.bottom() {
                    break;
                }
                let size = vec2(TIME_WIDTH + space.x + width, bottoms[index] - top);
                let rect = Rect::from_min_size(corner + vec2(0.0, top), size);
                let place = UiBuilder::new().max_rect(rect).layout(Layout::left_to_right(Align::Min));
                ui.scope_builder(place, |ui| row_ui(shown[index], ui));
            }
        });
    }
}

impl Page for Messages {
    fn ui(&mut self, _: &ViewContext<'_>, ui: &mut Ui) {
        let frame = Frame::central_panel(ui.style()).inner_margin(Margin::symmetric(10, 6));
        CentralPanel::default().frame(frame).show(ui, |ui| {
            self.controls_ui(ui);
            ui.separator();
            self.rows_ui(ui);
        });
    }

    fn snapshot(&self, _: &ViewContext<'_>) -> Value {
        Value::Null
    }

    fn command_line(&self, _: &ViewContext<'_>) -> Result<String, String> {
        Err("There is no command for this page.".to_owned())
    }
}

fn row_ui(message: &Message, ui: &mut Ui) {
    let time = RichText::new(format!("{:9.3} s", message.time.as_secs_f64())).monospace().weak();
    ui.allocate_ui(vec2(TIME_WIDTH, 0.0), |ui| {
        ui.set_width(TIME_WIDTH);
        ui.label(time).on_hover_text("Time since the start");
    });
    let text = RichText::new(message.text()).color(message.severity.color(ui.visuals()));
    ui.add(egui::Label::new(text).wrap().selectable(true));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_messages_are_counted_and_old_ones_go() {
        let mut messages = Messages::default();
        for _ in 0..3 {
            messages.add(Severity::Error, "no");
        }
        messages.add(Severity::Note, "no");
        assert_eq!(messages.all.iter().map(|m| m.times).collect::<Vec<_>>(), [3, 1]);
        for number in 0..3 * LONGEST {
            messages.add(Severity::Note, number.to_string());
        }
        assert_eq!(messages.all.len(), LONGEST);
        assert_eq!(messages.status(), Some((Severity::Note, "5999")));
        messages.filter = "599".to_owned();
        // 4599, 5599 and 5990 to 5999: the 599th is gone.
        assert_eq!(messages.shown().len(), 12);
    }

    #[test]
    fn what_stands_in_the_status_line_stays_until_it_is_released() {
        let mut messages = Messages::default();
        messages.stand("lost".to_owned());
        messages.add(Severity::Note, "back");
        messages.add(Severity::Error, "no");
        assert_eq!(messages.status(), Some((Severity::Warning, "lost")));
        messages.release();
        assert_eq!(messages.status(), Some((Severity::Error, "no")));
    }
}
