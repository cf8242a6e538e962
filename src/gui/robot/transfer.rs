//! Transfer of gains from the design to the connected robot: manually, or as they change.

use egui::{Button, Frame, Grid, Id, Margin, RichText, Stroke, Ui};
use flqr_core::control::{
    BalanceController,
    gate::{self, GainChange, Verdict},
};
use flqr_core::model::RobotModel;
use nalgebra::Matrix2x4;
use serde_json::{Value, json};

use super::link::{Link, sentence};
use crate::command::{Command, Commands};
use crate::context::ViewContext;
use crate::quantity::STATES;
use crate::theme::palette;
use crate::widgets::{change, choice_ui, error_ui, hint_ui, mono, shown};

/// The controller that the robot runs, and the one of the design.
#[derive(Default)]
pub(crate) struct Transfer {
    /// True if a driven robot gets new gains as they change, rather than manually.
    pub(crate) follow: bool,
    running: Option<BalanceController>,
    /// Gains that the operator has confirmed last: live changes stay within the factor of the gate from these.
    agreed: Matrix2x4<f64>,
    pending: Option<Pending>,
}

/// Design that the robot does not run yet.
pub(crate) struct Pending {
    design: BalanceController,
    pub(crate) verdict: Verdict,
}

impl Transfer {
    /// Begins with the controller of a new connection.
    pub(super) fn begin(&mut self, controller: Option<BalanceController>) {
        self.agreed = controller.as_ref().map_or_else(Matrix2x4::zeros, |controller| controller.gain);
        (self.running, self.pending) = (controller, None);
    }

    /// Takes arming as the confirmation of the gains of the robot.
    pub(super) fn note_armed(&mut self) {
        if let Some(running) = &self.running {
            self.agreed = running.gain;
        }
    }

    /// Takes the controller of the design; returns it if it is to be sent now.
    pub(super) fn set_design(
        &mut self,
        robot: &RobotModel,
        design: BalanceController,
        is_driven: bool,
    ) -> Option<BalanceController> {
        let running = self.running.as_ref()?;
        if is_same(running, &design) {
            self.pending = None;
            return None;
        }
        let verdict = gate::judge(robot, &self.agreed, &design);
        let is_free = match verdict {
            Verdict::Accept => self.follow || !is_driven,
            Verdict::Ask(_) => !is_driven,
            Verdict::Refuse(_) => false,
        };
        self.pending = Some(Pending { design, verdict });
        if !is_free {
            return None;
        }
        let agreed = self.agreed;
        let sent = self.take();
        if is_driven {
            self.agreed = agreed;
        }
        sent
    }

    /// Pending design.
    pub(crate) fn pending(&self) -> Option<&Pending> {
        self.pending.as_ref()
    }

    /// Takes the pending design, to be sent at the request of the operator; `None` if it is refused.
    pub(super) fn take(&mut self) -> Option<BalanceController> {
        let Pending { design, .. } =
            self.pending.take_if(|pending| !matches!(pending.verdict, Verdict::Refuse(_)))?;
        self.agreed = design.gain;
        self.running = Some(design.clone());
        Some(design)
    }

    /// Takes a design that was refused or pending while the robot was driven, now that it is not.
    pub(super) fn take_again(&mut self, robot: &RobotModel) -> Option<BalanceController> {
        let design = self.pending.as_ref()?.design.clone();
        self.set_design(robot, design, false)
    }

    pub(super) fn snapshot(&self) -> Value {
        let verdict = |pending: &Pending| match pending.verdict {
            Verdict::Accept => "accept",
            Verdict::Ask(_) => "ask",
            Verdict::Refuse(_) => "refuse",
        };
        let refusal = self.pending.as_ref().and_then(Pending::refusal);
        json!({
            "follow": self.follow,
            "gain": self.running.as_ref().map(|running| running.gain.row(0).iter().copied().collect::<Vec<_>>()),
            "pending": self.pending.as_ref().map(verdict),
            "refusal": refusal,
        })
    }
}

impl Pending {
    /// Reason for which it must not be sent to the robot.
    pub(crate) fn refusal(&self) -> Option<String> {
        match &self.verdict {
            Verdict::Refuse(refusal) => Some(sentence(&refusal.to_string())),
            Verdict::Accept | Verdict::Ask(_) => None,
        }
    }
}

/// Returns whether both control a robot identically: torque limit, yaw hold and odometry stay those of the
/// connection.
fn is_same(a: &BalanceController, b: &BalanceController) -> bool {
    (a.gain, a.feedforward, &a.effects) == (b.gain, b.feedforward, &b.effects)
}

/// Chooses how gains reach the robot.
pub(super) fn choice_of_transfer_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label("new gains");
        let mut follow = context.link.transfer.follow;
        let choices = [
            (false, "manually", "A robot being driven gets new gains with “Apply to robot”"),
            (true, "live", "A robot being driven gets new gains immediately, up to a factor of 2"),
        ];
        if ui.scope(|ui| choice_ui(ui, &mut follow, &choices)).inner {
            context.commands.send(Command::FollowGains(follow));
        }
    });
}

/// Draws the differences between the gains of the robot and of the design, and the button that applies them.
pub(crate) fn pending_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let transfer = &context.link.transfer;
    let (Some(pending), Some(running)) = (transfer.pending(), &transfer.running) else { return };
    let colors = palette(ui.visuals());
    let refusal = pending.refusal();
    let color = if refusal.is_some() { colors.error } else { colors.warning };
    let frame = Frame::new().stroke(Stroke::new(1.5, color)).corner_radius(6).inner_margin(Margin::same(8));
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal(|ui| {
            ui.label(RichText::new("The robot uses other gains").strong().color(color));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                apply_ui(context.link, context.commands, ui);
            });
        });
        if let Some(refusal) = &refusal {
            error_ui(ui, format!("Not applied, the previous gains remain active. {refusal}"));
        }
        changes_ui(running, &pending.design, ui);
    });
    ui.add_space(4.0);
}

/// Time after it appears for which the button that applies the design takes no click, s: it pushes what is below it away,
/// and the second half of a double click must not reach a driven robot.
const SETTLES_S: f64 = 0.6;

/// Returns whether the button appeared just now.
fn is_new(ui: &Ui) -> bool {
    let (now_s, frame) = (ui.input(|input| input.time), ui.ctx().cumulative_frame_nr());
    ui.data_mut(|data| {
        let shown = data.get_temp_mut_or(Id::unique("apply to robot"), (now_s, frame));
        if shown.1 + 1 < frame {
            shown.0 = now_s;
        }
        shown.1 = frame;
        now_s - shown.0 < SETTLES_S
    })
}

/// Draws the button that applies the design.
pub(super) fn apply_ui(link: &Link, commands: &Commands, ui: &mut Ui) {
    let Some(pending) = link.transfer.pending() else { return };
    let refusal = pending.refusal();
    let button = ui.add_enabled(refusal.is_none(), Button::new(RichText::new("Apply to robot").strong()));
    let button = button.on_hover_text("The gains are blended over 0.2 s");
    let is_clicked = button.on_disabled_hover_text(refusal.unwrap_or_default()).clicked();
    if !is_new(ui) && is_clicked {
        commands.send(Command::ApplyGains);
    }
}

fn changes_ui(running: &BalanceController, design: &BalanceController, ui: &mut Ui) {
    let changes: Vec<_> = gate::entries(&running.gain, &design.gain).collect();
    Grid::new("pending gains").num_columns(4).spacing([18.0, 1.0]).show(ui, |ui| {
        for head in ["gain", "robot", "design", "change"] {
            hint_ui(ui, head);
        }
        ui.end_row();
        change_rows_ui(&changes, ui);
    });
    if (running.feedforward, &running.effects) != (design.feedforward, &design.effects) {
        hint_ui(ui, "The friction feedforward also changes.");
    }
}

/// Draws one row for each gain; motors with equal gains have a common one.
pub(crate) fn change_rows_ui(changes: &[GainChange], ui: &mut Ui) {
    let both = |change: &GainChange| {
        let is_twin = |other: &GainChange| {
            other.motor != change.motor
                && (other.state, other.old, other.new) == (change.state, change.old, change.new)
        };
        changes.iter().any(is_twin)
    };
    for change in changes {
        let shared = both(change);
        if shared && change.motor == "right" {
            continue;
        }
        let state = gate::STATES.iter().position(|state| *state == change.state).map_or("", |at| STATES[at]);
        ui.label(if shared { state.to_owned() } else { format!("{state}, {}", change.motor) });
        ui.label(mono(shown(change.old, 4)));
        ui.label(mono(shown(change.new, 4)).strong());
        ui.label(mono(if change.old == change.new {
            "–".to_owned()
        } else {
            self::change(change.old, change.new)
        }));
        ui.end_row();
    }
}

#[cfg(test)]
mod tests {
    use egui::{Context, RawInput};

    use super::*;

    #[test]
    fn a_button_takes_no_click_just_after_it_appeared() {
        let context = Context::default();
        let at = |time: f64, is_shown: bool| {
            let mut found = None;
            let input = RawInput { time: Some(time), ..RawInput::default() };
            let mut output = context.run_ui(input, |ui| found = is_shown.then(|| is_new(ui)));
            output.textures_delta.clear();
            found
        };
        assert_eq!([at(1.0, true), at(1.4, true), at(1.7, true)], [Some(true), Some(true), Some(false)]);
        assert_eq!([at(1.8, false), at(1.9, false), at(2.0, true)], [None, None, Some(true)]);
        assert_eq!([at(2.3, true), at(2.7, true)], [Some(true), Some(false)]);
    }
}
