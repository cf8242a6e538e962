//! The strip under the tabs while a robot is the source: stage, connection, rates, recording, and STOP.

use egui::{Align, Button, Color32, Frame, Label, Layout, Margin, Response, RichText, Ui, vec2};
use flqr_core::control::drive::{Stage, StopReason};
use flqr_core::device::{Connection, SessionOrder};

use super::link::{Link, sentence};
use super::transfer::apply_ui;
use crate::command::{Command, Commands, Source};
use crate::context::ViewContext;
use crate::pages::Tab;
use crate::theme::palette;
use crate::widgets::plain;

/// Fill of the button that stops the robot, in both themes.
const STOP_FILL: Color32 = Color32::from_rgb(196, 32, 28);

pub(crate) const STOP_HEIGHT: f32 = 30.0;

/// Draws the strip; returns whether STOP was pressed.
pub(crate) fn bar_ui(link: &Link, (source, tab): (Source, Tab), commands: &Commands, ui: &mut Ui) -> bool {
    ui.horizontal(|ui| {
        ui.set_height(STOP_HEIGHT);
        chip_ui(link, ui);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let stop = link.may_drive() && stop_ui(ui, vec2(150.0, STOP_HEIGHT)).clicked();
            // These two pages have it next to the differences.
            if !matches!(tab, Tab::Tune | Tab::Robot) {
                apply_ui(link, commands, ui);
            }
            recording_ui(link, ui);
            rates_ui(link, ui);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                text_ui(link, (source, tab), commands, ui);
            });
            stop
        })
        .inner
    })
    .inner
}

/// Draws the button that sets the torque to zero and switches the motors off.
pub(crate) fn stop_ui(ui: &mut Ui, size: egui::Vec2) -> Response {
    let text = RichText::new("STOP   Esc, Space").strong().color(Color32::WHITE);
    let button = Button::new(text).fill(STOP_FILL).min_size(size);
    ui.add(button).accessible_name("STOP").on_hover_text("No torque, motors off, immediately (Esc or Space)")
}

/// Displayed name of the stage.
pub(super) fn stage_name(link: &Link) -> &'static str {
    match link.stage() {
        _ if link.awaits_motors_off() => "Motors not confirmed off",
        None => "Disconnected",
        Some(Stage::Listening) => "Listening",
        Some(Stage::Checking) => "Checking",
        Some(Stage::Driving) => "Driving",
        Some(Stage::Stopped(_)) => "Stopped",
    }
}

fn chip_ui(link: &Link, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    let (fill, text) = match link.stage() {
        None if !link.end_problems().is_empty() => (colors.error, ui.visuals().extreme_bg_color),
        None => (ui.visuals().widgets.inactive.bg_fill, ui.visuals().text_color()),
        Some(Stage::Listening) => (colors.accent, ui.visuals().extreme_bg_color),
        Some(Stage::Checking) => (colors.warning, ui.visuals().extreme_bg_color),
        Some(Stage::Driving) => (colors.good, ui.visuals().extreme_bg_color),
        Some(Stage::Stopped(_)) => (colors.error, ui.visuals().extreme_bg_color),
    };
    Frame::new().fill(fill).corner_radius(10).inner_margin(Margin::symmetric(12, 4)).show(ui, |ui| {
        ui.add(Label::new(RichText::new(stage_name(link)).strong().color(text)).selectable(false));
    });
}

fn text_ui(link: &Link, (source, tab): (Source, Tab), commands: &Commands, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    let Some(options) = link.options() else {
        if let Some(problem) = link.end_problems().first() {
            let problem = RichText::new(sentence(problem)).strong().color(colors.error);
            ui.add(Label::new(problem).truncate());
            return;
        }
        let away = tab != Tab::Robot;
        if away && ui.button("Go to connection").on_hover_text("The Robot tab (Ctrl+5)").clicked() {
            commands.send(Command::SelectTab(Tab::Robot));
        }
        ui.weak(format!("{}: nothing is connected", source.name()));
        return;
    };
    ui.label(RichText::new(options.source.to_string()).monospace());
    if let Some(Stage::Stopped(reason)) = link.stage() {
        ui.add(Label::new(RichText::new(stopped(link, &reason)).strong().color(colors.error)).truncate());
        return;
    }
    let (text, good) = connection_text(link);
    let text = RichText::new(text);
    ui.add(Label::new(if good { text } else { text.strong().color(colors.warning) }).truncate());
}

/// Describes a stop: motors that may still have torque first, then the reason and the remedy.
pub(super) fn stopped(link: &Link, reason: &StopReason) -> String {
    let text = sentence(&reason.to_string());
    if link.awaits_motors_off() {
        return format!(
            "Waiting for the motors to confirm that they are off. If this remains, switch off their supply. {text}"
        );
    }
    remedy(reason).map_or_else(|| text.clone(), |remedy| format!("{text} {remedy}"))
}

/// Returns the remedy of a stop whose reason does not name it.
fn remedy(reason: &StopReason) -> Option<&'static str> {
    Some(match reason {
        StopReason::Requested => "Release it to arm again.",
        StopReason::Done => "Its recording can be fitted on the Friction tab.",
        StopReason::MotorError { .. } => "Remove the cause, then power-cycle the motor.",
        StopReason::NotFinite => "Check the raw frames and the scales in [link] of the model.",
        _ => return None,
    })
}

/// Describes the connection; the second value is true if it is normal.
pub(super) fn connection_text(link: &Link) -> (String, bool) {
    let Some(status) = &link.status else {
        let text =
            if link.is_opening() { "connecting…" } else { "open, waiting for the first measurements" };
        return (text.to_owned(), true);
    };
    match &status.connection {
        Connection::Connected if !link.may_drive() && !link.is_replay() => {
            ("connected; listen-only, nothing is sent".to_owned(), true)
        }
        Connection::Connected if link.is_replay() && link.replay_is_paused => ("paused".to_owned(), true),
        Connection::Connected if link.is_replay() => ("playing".to_owned(), true),
        Connection::Connected if link.stage() == Some(Stage::Listening) => {
            ("connected; not armed, nothing is sent".to_owned(), true)
        }
        Connection::Connected if link.stage() == Some(Stage::Checking) => {
            ("querying the motors, without torque".to_owned(), true)
        }
        Connection::Connected if link.stage() == Some(Stage::Driving) => {
            ("the motors are driven".to_owned(), true)
        }
        Connection::Connected => ("connected".to_owned(), true),
        Connection::Silent { hint } => (format!("silent: {hint}"), false),
        Connection::Lost { reason } => (format!("connection lost, reconnecting: {reason}"), false),
        Connection::Ended => ("end of the recording".to_owned(), true),
    }
}

fn rates_ui(link: &Link, ui: &mut Ui) {
    let Some(status) = link.status.as_ref().filter(|_| link.is_open()) else { return };
    let text = format!("{:>4} rows/s {:>5.0} frames/s", link.rows_hz(), status.counters.received_hz);
    ui.label(RichText::new(text).small().monospace().weak())
        .on_hover_text("Robot-log rows and bus frames in the last second");
}

fn recording_ui(link: &Link, ui: &mut Ui) {
    let status = link.status.as_ref().filter(|_| link.is_open());
    let Some(recording) = status.and_then(|status| status.recording.as_ref()) else { return };
    let colors = palette(ui.visuals());
    let (text, color) = match &recording.problem {
        Some(_) => ("REC failed", colors.warning),
        None => ("REC", colors.error),
    };
    let help = recording.problem.clone().unwrap_or_else(|| recording.file.display().to_string());
    ui.label(RichText::new(text).strong().color(color)).on_hover_text(help);
}

/// Draws the controls of a replay.
pub(super) fn replay_ui(context: &ViewContext<'_>, speed: &mut f64, ui: &mut Ui) {
    let paused = context.link.replay_is_paused;
    ui.horizontal(|ui| {
        let (name, help) = if paused {
            ("Run", "Resume the replay (Ctrl+P)")
        } else {
            ("Pause", "Pause the replay (Ctrl+P)")
        };
        if ui.add(Button::new(name).min_size(vec2(56.0, 0.0))).on_hover_text(help).clicked() {
            context.commands.send(Command::Order(SessionOrder::Pause(!paused)));
        }
        if super::form::speed_ui(speed, ui) {
            context.commands.send(Command::Order(SessionOrder::ReplaySpeed(*speed)));
        }
        ui.weak(format!("real time × {}", plain(*speed, 2)));
    });
}
