//! The live robot: its controls, and displacement, velocity and pitch over a shared time axis.

use std::time::Duration;

use egui::{ComboBox, RichText, Ui};
use flqr_core::device::SessionOrder;

use crate::command::{Command, Source};
use crate::context::ViewContext;
use crate::history::{Channel, HISTORY_S};
use crate::plot::{Curve, DecimationCache, RangeStatistics, TimeCurve, TimePlot, TimeView};
use crate::quantity::{Quantity, to_scale};
use crate::theme::palette;
use crate::widgets::{choice_ui, error_ui, hint_ui, mono, number_ui, warning_ui};

/// Longer steps in time are drawn as gaps, s: of the simulated robot, and of a real one.
const GAP_S: [f64; 2] = [0.02, 0.1];
/// Room for the statistics at the right of each plot.
const STATISTICS_WIDTH: f32 = 118.0;
/// Height of the time axis with its label.
const TIME_AXIS_HEIGHT: f32 = 36.0;

const SPANS_S: [(f64, &str); 4] = [(5.0, "5 s"), (10.0, "10 s"), (30.0, "30 s"), (HISTORY_S, "60 s")];
const RATES: [(u64, &str); 4] = [(100, "10 Hz"), (50, "20 Hz"), (33, "30 Hz"), (17, "60 Hz")];

/// State of the plots.
pub(super) struct LivePlots {
    view: TimeView,
    caches: [DecimationCache; 3],
    degrees: bool,
    push_n: f64,
    push_s: f64,
    interval_ms: u64,
}

impl LivePlots {
    pub(super) fn new() -> Self {
        Self {
            view: TimeView::following(10.0),
            caches: Default::default(),
            degrees: true,
            push_n: 20.0,
            push_s: 0.1,
            interval_ms: 33,
        }
    }

    pub(super) fn reset_view(&mut self) {
        self.view = TimeView::following(self.view.span);
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
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
        });
        if context.source == Source::Simulated {
            simulated_ui(context, ui);
        } else if context.history.time_s().is_empty() {
            hint_ui(
                ui,
                "No row of displacement, velocity and pitch has come yet: they need both motors and the IMU.",
            );
        }
        self.plots_ui(context, ui);
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

    fn view_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        ui.toggle_value(&mut self.view.follow, "Follow").on_hover_text(
            "Keep the newest sample in view. Dragging a plot holds it; a double click follows again.",
        );
        let shown = SPANS_S.iter().find(|(span, _)| *span == self.view.span);
        let text = shown.map_or_else(|| format!("{:.1} s", self.view.span), |(_, name)| (*name).to_owned());
        let combo = ComboBox::from_id_salt("span").selected_text(text).width(52.0).show_ui(ui, |ui| {
            for (span, name) in SPANS_S {
                if ui.selectable_label(self.view.span == span, name).clicked() {
                    self.view.span = span;
                }
            }
        });
        combo
            .response
            .on_hover_text("Length of the time axis; up to 60 s are kept")
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
        combo.response.on_hover_text("How often the plots are drawn").accessible_name("frame rate");
        ui.scope(|ui| {
            let choices = [(true, "deg", "Pitch in degrees"), (false, "rad", "Pitch in radians")];
            choice_ui(ui, &mut self.degrees, &choices);
        });
    }

    fn plots_ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let history = context.history;
        let end = history.end_s();
        let start = history.time_s().first().copied().unwrap_or(0.0).max(end - HISTORY_S);
        self.view.update([start, end]);
        let gap = GAP_S[usize::from(context.source != Source::Simulated)];
        let spacing = ui.spacing().item_spacing.y;
        let height = ((ui.available_height() - TIME_AXIS_HEIGHT - 3.0 * spacing) / 3.0).max(30.0);
        let colors = palette(ui.visuals()).channels;
        for (index, channel) in Channel::ALL.into_iter().enumerate() {
            let quantity = Quantity::of(channel, self.degrees);
            let last = index == 2;
            let plot = TimePlot {
                id: quantity.name,
                label: &quantity.label(),
                height: if last { height + TIME_AXIS_HEIGHT } else { height },
                x_label: last.then_some("time [s]"),
                min_y_span: quantity.min_span,
            };
            let curve =
                Curve { x: history.time_s(), y: history.channel(channel), scale: quantity.scale, gap };
            let (view, cache) = (&mut self.view, &mut self.caches[index]);
            let (color, generation) = (colors[index], history.generation());
            ui.horizontal_top(|ui| {
                let width = (ui.available_width() - STATISTICS_WIDTH).max(1.0);
                let statistics = ui
                    .allocate_ui(egui::vec2(width, plot.height), |ui| {
                        plot.show(ui, view, &mut [TimeCurve { color, curve, generation, cache }])
                    })
                    .inner;
                ui.vertical(|ui| statistics_ui(ui, &quantity, statistics[0]));
            });
        }
    }
}

fn run_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let paused = context.live.paused;
    let (name, help) = if paused {
        ("Run", "Let the simulated robot go on (Ctrl+P)")
    } else {
        ("Pause", "Hold the simulated robot (Ctrl+P)")
    };
    let button = ui.add(egui::Button::new(name).min_size(egui::vec2(52.0, 0.0))).on_hover_text(help);
    if button.clicked() {
        context.commands.send(Command::SetPaused(!paused));
    }
    if ui.button("Reset").on_hover_text("Put the robot at the start and clear the plots").clicked() {
        context.commands.send(Command::ResetSimulation);
    }
    ui.separator();
}

/// Why the simulated robot does not run, if so.
fn simulated_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    if context.live.fell {
        warning_ui(ui, "The robot fell (pitch beyond 0.8 rad) and is stopped. Reset puts it upright again.");
    }
    if context.designer.in_force.is_none() {
        error_ui(ui, "There is no design, so nothing runs: weights that give one start the robot.");
    }
    if let Some(problem) = &context.live.problem {
        error_ui(ui, format!("The simulated robot did not take the change: {problem}."));
    }
}

fn replay_ui(context: &ViewContext<'_>, ui: &mut Ui) {
    let paused = context.link.replay_is_paused;
    let (name, help) =
        if paused { ("Run", "Let the replay go on (Ctrl+P)") } else { ("Pause", "Hold the replay (Ctrl+P)") };
    let button = ui.add(egui::Button::new(name).min_size(egui::vec2(52.0, 0.0))).on_hover_text(help);
    if button.clicked() {
        context.commands.send(Command::Order(SessionOrder::Pause(!paused)));
    }
    ui.separator();
}

/// What a reader of the plot would measure, as text (for screen readers too).
fn statistics_ui(ui: &mut Ui, quantity: &Quantity, statistics: Option<RangeStatistics>) {
    ui.spacing_mut().item_spacing.y = 2.0;
    ui.add_space(6.0);
    ui.label(RichText::new(quantity.label()).small().weak());
    let rows = statistics.map_or([("mean", f64::NAN), ("std", f64::NAN), ("p-p", f64::NAN)], |s| {
        [("mean", s.mean), ("std", s.std), ("p-p", s.peak_to_peak())]
    });
    let peak_to_peak = statistics.map_or(0.0, |s| s.peak_to_peak());
    for (name, value) in rows {
        let help = match name {
            "mean" => "Mean of the visible samples",
            "std" => "Standard deviation of the visible samples",
            _ => "Peak to peak: largest minus smallest visible sample",
        };
        let text = format!("{name:<4}{:>10}", to_scale(value, peak_to_peak));
        ui.label(mono(text)).on_hover_text(help);
    }
}
