//! Arming in two steps, the checks before it, and the active controller.

use egui::{Button, RichText, Ui, vec2};
use flqr_core::control::ControllerKind;
use flqr_core::control::drive::{Check, CheckResult, DriveOrder, Excitation, Stage};
use flqr_core::device::{SessionMode, SessionOrder};

use super::bar::{stage_name, stop_ui};
use super::link::sentence;
use super::transfer::{choice_of_transfer_ui, pending_ui};
use crate::command::Command;
use crate::context::ViewContext;
use crate::theme::palette;
use crate::widgets::{choice_ui, hint_ui, section_ui, warning_ui};

/// Draws the section; returns whether STOP was pressed.
pub(super) fn drive_ui(context: &ViewContext<'_>, ui: &mut Ui) -> bool {
    section_ui(ui, "Drive", |ui| {
        ui.label(RichText::new(stage_name(context.link)).strong());
    });
    if !context.link.may_drive() {
        ui.label(RichText::new("Listening only: nothing is sent.").strong());
        hint_ui(ui, "To drive, disconnect, choose “May drive” and connect again.");
        return false;
    }
    task_ui(context, ui);
    unsafe_limits_ui(context, ui);
    steps_ui(context, ui);
    let size = vec2(ui.available_width(), 34.0);
    let stop = ui.vertical_centered(|ui| stop_ui(ui, size).clicked()).inner;
    if let Some(drive) = context.link.status.as_ref().and_then(|status| status.drive.as_ref()) {
        checks_ui(&drive.checks, ui);
    }
    stop
}

fn task_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let Some(SessionMode::Drive { excitation, .. }) = context.link.options().map(|options| &options.mode)
    else {
        return;
    };
    let (text, balances) = match excitation {
        Excitation::Balance => ("Task: balance.".to_owned(), true),
        Excitation::BalanceMultisine => ("Task: balance with a multisine.".to_owned(), true),
        Excitation::SpeedSweep { seconds } => {
            (format!("Wheels in the air: constant speeds, {seconds} s."), false)
        }
        Excitation::Multisine { seconds } => (format!("Wheels in the air: multisine, {seconds} s."), false),
    };
    ui.label(text);
    if !balances {
        return;
    }
    ui.horizontal(|ui| {
        let mut kind = context.session.controller;
        let choices = [
            (ControllerKind::Lqr, "LQR", "Without friction feedforward"),
            (ControllerKind::Flqr, "FLQR", "With friction feedforward for each motor"),
        ];
        ui.scope(|ui| {
            if choice_ui(ui, &mut kind, &choices) {
                context.commands.send(Command::SetController(kind));
            }
        });
        hint_ui(ui, "Gains: Tune tab");
    });
    choice_of_transfer_ui(context, ui);
    pending_ui(context, ui);
}

/// Lists the limits that the model has disabled, next to the buttons that arm the robot.
fn unsafe_limits_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let Some(options) = context.link.options() else { return };
    for limit in options.robot.safety.unsafe_limits() {
        warning_ui(ui, sentence(&limit));
    }
}

fn steps_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let (link, order) =
        (context.link, |order| context.commands.send(Command::Order(SessionOrder::Drive(order))));
    let stage = link.stage();
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 2.0 * ui.spacing().item_spacing.x) / 3.0;
        let button = |ui: &mut Ui, name: &str, enabled: bool, help: &str, why_not: &str| {
            let button = Button::new(name).min_size(vec2(width, 28.0));
            ui.add_enabled(enabled, button).on_hover_text(help).on_disabled_hover_text(why_not).clicked()
        };
        let help = "Step 1: query the motors without torque and run the checks";
        if button(ui, "1  Check", stage == Some(Stage::Listening), help, "Only while listening") {
            order(DriveOrder::Check);
        }
        let help = "Step 2: switch the motors on; they follow the controller";
        if button(ui, "2  Arm", link.may_arm(), help, "Only after all checks have passed") {
            order(DriveOrder::Arm);
        }
        let held = matches!(stage, Some(Stage::Checking | Stage::Stopped(_)));
        if button(ui, "Release", held, "Back to listening", "Only after a stop, or instead of arming") {
            order(DriveOrder::Release);
        }
    });
}

fn checks_ui(checks: &[Check], ui: &mut Ui) {
    let colors = palette(ui.visuals());
    for check in checks {
        let (mark, color) = match check.result {
            CheckResult::Passed => ("ok  ", colors.good),
            CheckResult::Waiting => ("wait", colors.warning),
            CheckResult::Failed => ("fail", colors.error),
        };
        ui.horizontal_top(|ui| {
            ui.label(RichText::new(mark).monospace().strong().color(color));
            ui.vertical(|ui| {
                ui.spacing_mut().item_spacing.y = 1.0;
                ui.label(check.name);
                let text = RichText::new(&check.text).small();
                let text = if check.result == CheckResult::Passed { text.weak() } else { text.color(color) };
                ui.add(egui::Label::new(text).wrap());
            });
        });
    }
}
