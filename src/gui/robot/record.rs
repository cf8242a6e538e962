//! File and status of the recording.

use std::path::PathBuf;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use egui::{Button, TextEdit, Ui, vec2};
use flqr_core::device::{RecordingStatus, SessionOrder};

use super::cards::row_ui;
use crate::command::{Command, FilePurpose};
use crate::context::ViewContext;
use crate::widgets::{error_ui, hint_ui, section_ui, warning_ui};

/// Typed text.
#[derive(Default)]
pub(crate) struct RecordForm {
    pub(super) path: String,
    pub(super) dialog_problem: Option<String>,
}

impl RecordForm {
    /// Suggests a name that no earlier recording has.
    pub(crate) fn suggest(&mut self) {
        self.path = format!("robot-{}.csv", stamp(SystemTime::now()));
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let recording = context.link.status.as_ref().and_then(|status| status.recording.as_ref());
        section_ui(ui, "Recording", |_| {});
        match recording {
            Some(recording) if recording.problem.is_none() => running_ui(context, recording, ui),
            _ => self.start_ui(context, ui),
        }
        if let Some(recording) = recording {
            status_ui(recording, ui);
        }
    }

    fn start_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let field = TextEdit::singleline(&mut self.path).desired_width(f32::INFINITY);
        ui.add(field)
            .accessible_name("recording to write")
            .on_hover_text("Robot log (.csv); the raw frames go to a .log file of the same name");
        ui.horizontal(|ui| {
            let named = !self.path.trim().is_empty();
            let start = Button::new("Record").min_size(vec2(84.0, 0.0));
            if ui.add_enabled(named, start).on_hover_text("Start recording rows and raw frames").clicked() {
                let path = with_ending(PathBuf::from(self.path.trim()));
                context.commands.send(Command::Order(SessionOrder::Record(Some(path))));
            }
            if ui.button("Choose…").on_hover_text("Choose folder and name").clicked() {
                context.commands.send(Command::ShowDialog(FilePurpose::SaveRecording));
            }
            if ui.button("New name").on_hover_text("New name with the current time (UTC)").clicked() {
                self.suggest();
            }
        });
        if let Some(problem) = &self.dialog_problem {
            warning_ui(ui, problem);
        }
    }
}

fn running_ui(context: &ViewContext<'_>, recording: &RecordingStatus, ui: &mut Ui) {
    hint_ui(ui, recording.file.display().to_string());
    let button = Button::new("Stop recording").min_size(vec2(ui.available_width(), 26.0));
    if ui.vertical_centered(|ui| ui.add(button)).inner.clicked() {
        context.commands.send(Command::Order(SessionOrder::Record(None)));
    }
}

fn status_ui(recording: &RecordingStatus, ui: &mut Ui) {
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        row_ui(ui, "rows", &recording.rows.to_string(), None);
        row_ui(ui, "frames", &recording.frames.to_string(), None);
        row_ui(ui, "size", &format!("{:.2} MB", recording.bytes as f64 / 1e6), None);
    });
    if let Some(problem) = &recording.problem {
        error_ui(ui, format!("Recording stopped: {problem}"));
    }
}

fn with_ending(path: PathBuf) -> PathBuf {
    if path.extension().is_none() { path.with_extension("csv") } else { path }
}

/// Date and time (UTC) for a file name.
fn stamp(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs();
    let (day, second) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = date(day);
    format!("{year:04}{month:02}{day:02}-{:02}{:02}{:02}", second / 3600, second / 60 % 60, second % 60)
}

/// Date of a day since 1970, in the Gregorian calendar: years are counted from March, so that a leap day is
/// the last of its year.
fn date(day: u64) -> (u64, u64, u64) {
    /// Days from 0000-03-01 to 1970-01-01.
    const MARCH_OF_YEAR_0: u64 = 719_468;
    let day = day + MARCH_OF_YEAR_0;
    let (era, day) = (day / 146_097, day % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (year, month) = (400 * era + year, if month < 10 { month + 3 } else { month - 9 });
    (year + u64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `date -u -d @SECONDS +%Y%m%d-%H%M%S`
    #[test]
    fn a_time_has_the_date_that_the_calendar_gives_it() {
        for (seconds, text) in [
            (0, "19700101-000000"),
            (951_782_399, "20000228-235959"),
            (951_782_400, "20000229-000000"),
            (1_709_251_199, "20240229-235959"),
            (1_735_689_600, "20250101-000000"),
            (4_107_542_400, "21000301-000000"),
        ] {
            assert_eq!(stamp(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }

    #[test]
    fn a_name_without_an_ending_gets_one() {
        assert_eq!(with_ending(PathBuf::from("run")), PathBuf::from("run.csv"));
        assert_eq!(with_ending(PathBuf::from("run.txt")), PathBuf::from("run.txt"));
    }
}
