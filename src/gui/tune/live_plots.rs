//! The live robot: its controls, and displacement, velocity and pitch over a shared time axis.

use std::time::Duration;

use egui::{ComboBox, Ui};
use flqr_core::device::SessionOrder;

use crate::command::{Command, Source};
use crate::context::ViewContext;
use crate::history::{Channel, HISTORY_S};
use crate::plot::{Data, Panel, PanelCurve, Stack, TimeView, Unit};
use crate::quantity::Quantity;
use crate::runs::Sources;
use crate::theme::palette;
use crate::widgets::{error_ui, hint_ui, number_ui, warning_ui};

/// Longer steps in time are drawn as gaps, s: of the simulated robot, and of a real one.
const GAP_S: [f64; 2] = [0.02, 0.1];
const SPANS_S: [(f64, &str); 7] = [
    (5.0, "5 s"),
    (10.0, "10 s"),
    (30.0, "30 s"),
    (60.0, "60 s"),
    (600.0, "10 min"),
    (3600.0, "1 h"),
    (HISTORY_S, "2 h"),
];
const RATES: [(u64, &str); 4] = [(100, "10 Hz"), (50, "20 Hz"), (33, "30 Hz"), (17, "60 Hz")];

/// Beyond this pitch the robot counts as fallen, rad.
const FALLEN_RAD: f64 = 0.8;

/// State of the plots.
pub(super) struct LivePlots {
    stack: Stack,
    push_n: f64,
    push_s: f64,
    interval_ms: u64,
}

impl LivePlots {
    pub(super) fn new() -> Self {
        Self { stack: Stack::live("live", 10.0), push_n: 20.0, push_s: 0.1, interval_ms: 33 }
    }

    pub(super) fn reset_view(&mut self) {
        self.stack.view = TimeView::following(self.stack.view.span);
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let history = context.history;
        self.stack.update([history.start_s(), history.end_s()]);
        let panels = panels(context, ui);
        ui.horizontal_wrapped(|ui| {
            match context.source {
                Source::Simulated => run_ui(context, ui),
                Source::Replay => replay_ui(context, ui),
                Source::Emulated | Source::Can | Source::Slcan => {}
            }
            if matches!(context.source, Source::Simulated | Source::Emulated) {
                self.push_ui(context, ui);
            }
            self.view_ui(context, ui);
            self.stack.tools_ui(ui, &panels);
        });
        if context.source == Source::Simulated {
            simulated_ui(context, ui);
        } else if history.time_s().is_empty() {
            hint_ui(ui, "No displacement, velocity and pitch yet: they need both motors and the IMU.");
        }
        if history.dropped() > 0 {
            hint_ui(
                ui,
                format!("The oldest {} samples were dropped; the last 2 h are stored.", history.dropped()),
            );
        }
        if self.stack.exports() {
            self.stack.sources = vec![source(context)];
        }
        self.stack.show(ui, &panels).send(context.commands);
    }

    fn push_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let push = ui.button("Push").on_hover_text("Push the body forward at its centre of mass");
        if push.clicked() {
            let (force_n, duration_s) = (self.push_n, self.push_s);
            context.commands.send(match context.source {
                Source::Simulated => Command::Push { force_n, duration_s },
                _ => Command::Order(SessionOrder::Push { force_n, duration_s }),
            });
        }
        number_ui(ui, &mut self.push_n, "push force", 40.0)
            .on_hover_text("Force of the push; negative: backward");
        ui.label("N for");
        number_ui(ui, &mut self.push_s, "push duration", 40.0).on_hover_text("Duration of the push");
        self.push_s = self.push_s.clamp(0.001, 10.0);
        ui.label("s");
        ui.separator();
    }

    /// Length of the time axis, and how often it is drawn.
    fn view_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let shown = SPANS_S.iter().find(|(span, _)| *span == self.stack.view.span);
        let text =
            shown.map_or_else(|| format!("{:.1} s", self.stack.view.span), |(_, name)| (*name).to_owned());
        let combo = ComboBox::from_id_salt("span").selected_text(text).width(52.0).show_ui(ui, |ui| {
            for (span, name) in SPANS_S {
                if ui.selectable_label(self.stack.view.span == span, name).clicked() {
                    self.stack.view.span = span;
                }
            }
        });
        combo
            .response
            .on_hover_text("Length of the time axis; the last 2 h at 1 kHz are stored")
            .accessible_name("time span");
        let rate = RATES.iter().find(|(ms, _)| *ms == self.interval_ms).map_or("", |(_, name)| name);
        let combo = ComboBox::from_id_salt("rate").selected_text(rate).width(56.0).show_ui(ui, |ui| {
            for (interval_ms, name) in RATES {
                if ui.selectable_value(&mut self.interval_ms, interval_ms, name).changed() {
                    let interval = Duration::from_millis(interval_ms);
                    context.commands.send(Command::SetFrameInterval(interval));
                }
            }
        });
        combo.response.on_hover_text("Refresh rate of the plots").accessible_name("frame rate");
    }
}

/// Every recorded quantity; the controller's state is shown at first.
fn panels<'a>(context: &ViewContext<'a>, ui: &Ui) -> Vec<Panel<'a>> {
    let history = context.history;
    let robot = context.session.robot();
    let torque = Unit::Torque(robot.and_then(|robot| robot.link.torque_constant_nm_a));
    let limit_nm = robot.and_then(|robot| robot.limits.torque_nm);
    let colors = palette(ui.visuals()).channels;
    let gap = GAP_S[usize::from(context.source != Source::Simulated)];
    let panel = |(number, channel): (usize, Channel)| {
        let quantity = Quantity::of(channel, false);
        let (unit, limits) = match channel {
            Channel::Pitch => (Unit::Angle, vec![("fallen", FALLEN_RAD)]),
            Channel::LeftAngle | Channel::RightAngle => (Unit::Angle, Vec::new()),
            Channel::PitchRate | Channel::LeftSpeed | Channel::RightSpeed => (Unit::AngularSpeed, Vec::new()),
            Channel::LeftTorque | Channel::RightTorque => {
                (torque, limit_nm.map(|limit| ("torque limit", limit)).into_iter().collect())
            }
            _ => (Unit::Plain(quantity.unit), Vec::new()),
        };
        let curve = PanelCurve {
            name: "".into(),
            key: channel.key().into(),
            color: colors[number % colors.len()],
            data: Data::Growing(history.time_s(), history.channel(channel)),
            generation: history.generation(),
            gap,
        };
        let shown = Channel::STATE.contains(&channel);
        Panel {
            name: quantity.name.into(),
            unit,
            min_span: quantity.min_span,
            shown,
            curves: vec![curve],
            limits,
        }
    };
    Channel::ALL.into_iter().enumerate().map(panel).collect()
}

/// Source of the curves, for exports: they are no run of the ledger.
fn source(context: &ViewContext<'_>) -> String {
    let model = context.session.model();
    let sources = Sources::new(Some(&model), []);
    format!("live plots, {}: model {}, sources {}", context.source.name(), model.name, sources.hex())
}

fn run_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let paused = context.live.paused;
    let (name, help) = if paused {
        ("Run", "Resume the simulated robot (Ctrl+P)")
    } else {
        ("Pause", "Pause the simulated robot (Ctrl+P)")
    };
    let button = ui.add(egui::Button::new(name).min_size(egui::vec2(52.0, 0.0))).on_hover_text(help);
    if button.clicked() {
        context.commands.send(Command::SetPaused(!paused));
    }
    if ui.button("Reset").on_hover_text("Restart the robot and clear the plots").clicked() {
        context.commands.send(Command::ResetSimulation);
    }
    ui.separator();
}

/// Reason why the simulated robot does not run, if any.
fn simulated_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    if context.live.fell {
        warning_ui(ui, "The robot fell (pitch beyond 0.8 rad). Reset restarts it.");
    }
    if context.designer.in_force.is_none() {
        error_ui(ui, "The simulation is stopped because there is no valid design. Change the weights.");
    }
    if let Some(problem) = &context.live.problem {
        error_ui(ui, format!("The simulation rejected the change: {problem}."));
    }
}

fn replay_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let paused = context.link.replay_is_paused;
    let (name, help) =
        if paused { ("Run", "Resume the replay (Ctrl+P)") } else { ("Pause", "Pause the replay (Ctrl+P)") };
    let button = ui.add(egui::Button::new(name).min_size(egui::vec2(52.0, 0.0))).on_hover_text(help);
    if button.clicked() {
        context.commands.send(Command::Order(SessionOrder::Pause(!paused)));
    }
    ui.separator();
}
