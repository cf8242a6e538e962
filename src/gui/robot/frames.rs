//! The newest raw frames, with a filter. Frames that pass it are stored separately, so that only visible rows are drawn.

use std::collections::VecDeque;
use std::fmt::Write;

use egui::{Label, RichText, ScrollArea, TextEdit, Ui};
use flqr_core::link::{Direction, FrameId, StampedFrame, describe};
use flqr_core::model::LinkSettings;

use crate::widgets::{choice_ui, hint_ui, mono, section_ui};

/// Largest number of stored frames, before and after the filter.
const KEPT: usize = 2000;

/// Directions of the frames that are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Way {
    #[default]
    Both,
    Received,
    Sent,
}

/// Filter of the shown frames, as typed.
#[derive(Clone, Debug, Default, PartialEq)]
struct Filter {
    ids: String,
    text: String,
    way: Way,
}

/// Parsed filter.
#[derive(Clone, Debug, Default)]
struct Test {
    /// Shown identifiers; all if empty.
    ids: Vec<u32>,
    /// Text to find in the bytes, as hexadecimal digits without spaces, or in the decoded text, in lower case.
    text: String,
    way: Way,
}

impl Filter {
    fn read(&self) -> Result<Test, String> {
        let words = self.ids.split([',', ';', ' ']).filter(|word| !word.is_empty());
        let id = |word: &str| {
            let digits = word.trim_start_matches("0x").trim_start_matches("0X");
            u32::from_str_radix(digits, 16)
                .map_err(|_| format!("{word:?} is not an identifier: give hexadecimal numbers, such as 141"))
        };
        let ids = words.map(id).collect::<Result<_, _>>()?;
        let text = self.text.trim().to_lowercase();
        let is_hex = text.chars().all(|letter| letter.is_ascii_hexdigit() || letter == ' ');
        Ok(Test { ids, text: if is_hex { text.replace(' ', "") } else { text }, way: self.way })
    }
}

impl Test {
    fn passes(&self, stamped: &StampedFrame, settings: &LinkSettings, buffer: &mut String) -> bool {
        let way = match self.way {
            Way::Both => true,
            Way::Received => stamped.direction == Direction::Received,
            Way::Sent => stamped.direction == Direction::Sent,
        };
        if !way || !(self.ids.is_empty() || self.ids.contains(&stamped.frame.id().raw())) {
            return false;
        }
        if self.text.is_empty() {
            return true;
        }
        buffer.clear();
        for byte in stamped.frame.bytes() {
            push(buffer, format_args!("{byte:02x}"));
        }
        buffer.contains(&self.text)
            || describe(stamped, settings).is_some_and(|text| text.to_lowercase().contains(&self.text))
    }
}

/// Table of the newest frames.
#[derive(Default)]
pub(crate) struct FrameTable {
    all: VecDeque<StampedFrame>,
    shown: VecDeque<StampedFrame>,
    filter: Filter,
    test: Test,
    problem: Option<String>,
    held: bool,
    /// Settings of the robot that sends the frames.
    settings: LinkSettings,
    buffer: String,
}

impl FrameTable {
    /// Adds frames, unless the table is held.
    pub(super) fn extend(&mut self, frames: &[StampedFrame]) {
        if self.held {
            return;
        }
        for frame in frames {
            keep(&mut self.all, *frame);
            if self.test.passes(frame, &self.settings, &mut self.buffer) {
                keep(&mut self.shown, *frame);
            }
        }
    }

    /// Removes all frames; new frames are those of a robot with these settings.
    pub(super) fn begin(&mut self, settings: LinkSettings) {
        self.settings = settings;
        self.all.clear();
        self.shown.clear();
    }

    /// Frames that pass the filter.
    pub(super) fn shown(&self) -> usize {
        self.shown.len()
    }

    fn refilter(&mut self) {
        match self.filter.read() {
            Ok(test) => (self.test, self.problem) = (test, None),
            Err(problem) => return self.problem = Some(problem),
        }
        self.shown.clear();
        self.shown.extend(
            self.all.iter().filter(|frame| self.test.passes(frame, &self.settings, &mut self.buffer)),
        );
    }

    pub(super) fn ui(&mut self, ui: &mut Ui) {
        section_ui(ui, "Raw frames", |ui| {
            ui.toggle_value(&mut self.held, "Hold")
                .on_hover_text("Freeze this view; everything else continues");
            let count = format!("{} of {}", self.shown.len(), self.all.len());
            ui.label(RichText::new(count).small().weak())
                .on_hover_text(format!("Frames matching the filter, of the newest {KEPT}"));
        });
        let before = self.filter.clone();
        self.filter_ui(ui);
        if self.filter != before {
            self.refilter();
        }
        if let Some(problem) = &self.problem {
            crate::widgets::error_ui(ui, problem);
        }
        self.rows_ui(ui);
    }

    fn filter_ui(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.label("id");
            let field = TextEdit::singleline(&mut self.filter.ids).hint_text("all").desired_width(84.0);
            ui.add(field)
                .accessible_name("identifiers to show")
                .on_hover_text("Hexadecimal identifiers, several separated by spaces: 141 142");
            ui.label("bytes or text");
            let field = TextEdit::singleline(&mut self.filter.text).hint_text("any").desired_width(110.0);
            ui.add(field)
                .accessible_name("bytes or text to show")
                .on_hover_text("Hexadecimal bytes (9C 20), or part of the decoded text");
            ui.scope(|ui| {
                let choices = [
                    (Way::Both, "all", "Both directions"),
                    (Way::Received, "rx", "Received from the bus"),
                    (Way::Sent, "tx", "Sent by this program"),
                ];
                choice_ui(ui, &mut self.filter.way, &choices);
            });
        });
    }

    fn rows_ui(&self, ui: &mut Ui) {
        let head = format!("{:>11}  {:2}  {:>8}  {:1}  {:23}  meaning", "time [s]", "", "id", "n", "bytes");
        ui.add(Label::new(mono(head).weak()).truncate());
        if self.shown.is_empty() {
            let text = if self.all.is_empty() { "No frame yet." } else { "No frame matches the filter." };
            hint_ui(ui, text);
        }
        ui.spacing_mut().item_spacing.y = 1.0;
        let height = ui.text_style_height(&egui::TextStyle::Monospace);
        let area = ScrollArea::vertical().id_salt("frames").auto_shrink(false);
        area.show_rows(ui, height, self.shown.len(), |ui, rows| {
            for row in rows {
                // The newest comes first.
                let Some(frame) = self.shown.iter().rev().nth(row) else { continue };
                let line = line(frame, &self.settings);
                ui.add(Label::new(mono(&line)).truncate()).on_hover_text(mono(line));
            }
        });
    }
}

fn keep(frames: &mut VecDeque<StampedFrame>, frame: StampedFrame) {
    if frames.len() == KEPT {
        frames.pop_front();
    }
    frames.push_back(frame);
}

fn line(stamped: &StampedFrame, settings: &LinkSettings) -> String {
    let frame = &stamped.frame;
    let way = if stamped.direction == Direction::Sent { "tx" } else { "rx" };
    let id = match frame.id() {
        FrameId::Standard(id) => format!("{id:03X}"),
        FrameId::Extended(id) => format!("{id:08X}"),
    };
    let mut text = format!("{:>11.4}  {way}  {id:>8}  {}  ", stamped.time.as_secs_f64(), frame.length());
    let start = text.len();
    for byte in frame.bytes() {
        push(&mut text, format_args!("{byte:02X} "));
    }
    while text.len() < start + 25 {
        text.push(' ');
    }
    text.push_str(&describe(stamped, settings).unwrap_or_default());
    text
}

fn push(text: &mut String, part: std::fmt::Arguments<'_>) {
    text.write_fmt(part).expect("a string takes all that is written to it");
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use flqr_core::link::Frame;

    use super::*;

    fn table() -> FrameTable {
        let mut table = FrameTable::default();
        let frames: Vec<StampedFrame> = (0..3000_u32)
            .map(|number| {
                let id = FrameId::Standard(if number % 3 == 0 { 0x141 } else { 0x142 });
                let direction = if number % 2 == 0 { Direction::Sent } else { Direction::Received };
                let bytes = [0x9C, (number % 256) as u8, 0, 0, 0, 0, 0, 0];
                StampedFrame {
                    time: Duration::from_millis(number.into()),
                    direction,
                    frame: Frame::full(id, bytes),
                }
            })
            .collect();
        table.extend(&frames);
        table
    }

    #[test]
    fn the_table_is_bounded_and_keeps_the_newest() {
        let table = table();
        assert_eq!((table.all.len(), table.shown.len()), (KEPT, KEPT));
        assert_eq!(table.shown.back().unwrap().time, Duration::from_millis(2999));
    }

    #[test]
    fn a_filter_takes_identifiers_bytes_and_directions() {
        for (ids, text, way, expected) in [
            ("141", "", Way::Both, 666),
            ("0x141, 142", "", Way::Both, 2000),
            ("7FF", "", Way::Both, 0),
            ("", "9c ff", Way::Both, 8),
            ("", "9CFF", Way::Both, 8),
            ("", "", Way::Sent, 1000),
            ("141", "9c fe", Way::Sent, 3),
        ] {
            let mut table = table();
            table.filter = Filter { ids: ids.to_owned(), text: text.to_owned(), way };
            table.refilter();
            assert_eq!(table.shown.len(), expected, "{ids:?} {text:?} {way:?}");
        }
    }

    #[test]
    fn an_invalid_filter_is_reported_and_changes_nothing() {
        let mut table = table();
        table.filter.ids = "wheel".to_owned();
        table.refilter();
        assert!(table.problem.as_ref().unwrap().contains("wheel"));
        assert_eq!(table.shown.len(), KEPT);
    }

    #[test]
    fn a_held_table_takes_nothing_in() {
        let mut table = table();
        table.held = true;
        let frame = *table.all.front().unwrap();
        table.extend(&[frame]);
        assert_ne!(table.all.back(), Some(&frame));
    }

    #[test]
    fn a_line_has_its_columns_whatever_the_frame() {
        let stamped =
            |frame| StampedFrame { time: Duration::from_millis(1500), direction: Direction::Sent, frame };
        for (frame, text) in [
            (
                Frame::data(FrameId::Standard(0x141), &[0x9C, 1]).unwrap(),
                "     1.5000  tx       141  2  9C 01                    incomplete: 2 of 8 bytes",
            ),
            (
                Frame::remote(FrameId::Extended(0x1ABCDE), 8).unwrap(),
                "     1.5000  tx  001ABCDE  8                           remote request",
            ),
        ] {
            assert_eq!(line(&stamped(frame), &LinkSettings::default()).trim_end(), text);
        }
    }
}
