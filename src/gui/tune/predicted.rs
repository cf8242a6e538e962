//! Predicted response of the sampled loop to a disturbance, for the active and the other design, and its poles.

use egui::{Color32, Ui, Vec2, vec2};
use egui_plot::{Corner, HLine, Legend, Line, LineStyle, Plot, PlotPoint, PlotPoints};
use flqr_core::lqr::{Disturbance, SampledPole, SampledResponse, sampled_poles, sampled_response};
use flqr_core::model::State;

use super::pole_plane::PolePlane;
use super::trials::Trials;
use crate::context::ViewContext;
use crate::design::Designed;
use crate::plot::{Axes, Unit, UnitChoice, degrees};
use crate::quantity::angle;
use crate::theme::palette;
use crate::widgets::{hint_ui, shown};

/// Points of a drawn curve.
const POINTS: usize = 400;
/// Longest response, s.
const LONGEST_S: f64 = 20.0;
/// Widths of the page from which on there is room for another plot.
const ROOM_FOR_MORE: f32 = 860.0;
/// Room for the line before the numbers.
const SEPARATOR: f32 = 24.0;
/// Fraction of the limit from which on it is drawn.
const NEAR_LIMIT: f64 = 0.4;

/// Plotted parts of a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Displacement,
    Pitch,
    Torque,
}

impl Shown {
    fn label(self, degrees: bool) -> &'static str {
        match self {
            Self::Displacement => "displacement [m]",
            Self::Pitch if degrees => "pitch [°]",
            Self::Pitch => "pitch [rad]",
            Self::Torque => "motor torque [N m]",
        }
    }

    /// Position of the legend away from the curves.
    fn corner(self) -> Corner {
        match self {
            Self::Displacement => Corner::RightBottom,
            Self::Pitch | Self::Torque => Corner::RightTop,
        }
    }
}

/// A predicted response, ready for plotting.
#[derive(Default)]
struct Response {
    of: Option<(Designed, Disturbance, f64, bool)>,
    displacement: Vec<PlotPoint>,
    /// In the shown unit.
    pitch: Vec<PlotPoint>,
    torque_nm: Vec<PlotPoint>,
    /// Key figures.
    summary: String,
    poles: Vec<SampledPole>,
}

/// Predictions for the active design and for the other one.
pub(super) struct Predicted {
    now: Response,
    other: Response,
    plane: PolePlane,
    /// Signal of the first plot in a small window.
    first: Shown,
    /// Angles in degrees.
    degrees: bool,
}

impl Default for Predicted {
    fn default() -> Self {
        Self {
            now: Response::default(),
            other: Response::default(),
            plane: PolePlane::default(),
            first: Shown::Displacement,
            degrees: true,
        }
    }
}

impl Predicted {
    /// Poles of the active design, of the sampled loop.
    pub(super) fn poles(&mut self, context: &ViewContext<'_>, trials: &Trials) -> &[SampledPole] {
        self.update(context, trials.shown());
        &self.now.poles
    }

    fn update(&mut self, context: &ViewContext<'_>, disturbance: Disturbance) {
        let Some(now) = context.designer.in_force else {
            self.now = Response::default();
            return;
        };
        let other = context.designer.different();
        let seconds = duration_s(&now).max(other.as_ref().map_or(0.0, duration_s));
        self.now.update(&now, disturbance, seconds, self.degrees);
        match other {
            Some(other) => self.other.update(&other, disturbance, seconds, self.degrees),
            None => self.other = Response::default(),
        }
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, trials: &mut Trials, ui: &mut Ui) {
        if context.designer.in_force.is_none() {
            // Filled, or the panel would shrink and stay so.
            let size = ui.available_size();
            ui.label(egui::RichText::new("Predicted").heading().strong());
            hint_ui(ui, "no design");
            ui.set_min_size(size);
            return;
        }
        self.degrees = degrees(ui.ctx());
        self.update(context, trials.shown());
        let many = ui.available_width() >= ROOM_FOR_MORE;
        let text = self.text(context, trials);
        let beside = ui.horizontal(|ui| {
            self.head_ui(trials, many, ui);
            let fits = small_width(&text, ui) + SEPARATOR <= ui.available_width();
            if fits {
                ui.separator();
                summary_ui(&text, ui);
            }
            fits
        });
        if !beside.inner {
            summary_ui(&text, ui);
        }
        let shown: &[Shown] = match (many, self.first) {
            (true, _) => &[Shown::Displacement, Shown::Pitch, Shown::Torque],
            (false, first) => &[first, Shown::Torque],
        };
        let spacing = ui.spacing().item_spacing.x;
        let plane = (0.34 * ui.available_width()).clamp(150.0, 340.0);
        let width = (ui.available_width() - plane) / shown.len() as f32 - spacing;
        let size = vec2(width, ui.available_height());
        let limit_nm = context.session.robot().and_then(|robot| robot.limits.torque_nm);
        ui.horizontal_top(|ui| {
            for what in shown {
                self.response_plot(context, *what, limit_nm, ui, size);
            }
            let size = vec2(ui.available_width(), ui.available_height());
            // With a separate id, or a drag would end where a plot before it gets more parts.
            let scope = egui::UiBuilder::new().scope_id(egui::Id::unique("pole map"));
            ui.scope_builder(scope, |ui| {
                self.plane.ui(context, (&self.now.poles, &self.other.poles), ui, size);
            });
        });
    }

    fn head_ui(&mut self, trials: &mut Trials, many: bool, ui: &mut Ui) {
        ui.label(egui::RichText::new("Predicted").heading().strong());
        trials.choice_ui(ui);
        if !many {
            ui.separator();
            let choices =
                [(Shown::Displacement, "x", "Plot displacement"), (Shown::Pitch, "θ", "Plot pitch")];
            ui.scope(|ui| crate::widgets::choice_ui(ui, &mut self.first, &choices));
        }
        ui.separator();
        self.plane.choice_ui(ui);
    }

    /// Range shown in the plots, in words and numbers.
    fn text(&self, context: &ViewContext<'_>, trials: &Trials) -> String {
        let (of, now) = (trials.shown_text(self.degrees), &self.now.summary);
        if self.other.summary.is_empty() {
            return format!("{of}: {now}");
        }
        let [active, other] =
            [context.designer.active, context.designer.active.other()].map(|slot| slot.name());
        format!("{of}: {active} {now}; {other} {}", self.other.summary)
    }

    fn response_plot(
        &self,
        context: &ViewContext<'_>,
        what: Shown,
        limit_nm: Option<f64>,
        ui: &mut Ui,
        size: Vec2,
    ) {
        let colors = palette(ui.visuals());
        let legend =
            Legend::default().position(what.corner()).follow_insertion_order(true).background_alpha(0.6);
        let mut plot = quiet_plot(ui, size, "time [s]", what.label(self.degrees));
        if context.designer.different().is_some() {
            plot = plot.legend(legend);
        }
        let names = [context.designer.active.other().name(), context.designer.active.name()];
        plot.show(ui, |plot_ui| {
            let limit = limit_nm.filter(|_| what == Shown::Torque);
            let near = |limit: &f64| self.peak_nm() >= NEAR_LIMIT * limit;
            for limit in limit.filter(near).into_iter().flat_map(|limit| [-limit, limit]) {
                let line = HLine::new("", limit).color(colors.error.gamma_multiply(0.8)).width(1.0);
                plot_ui.hline(line.allow_hover(false));
            }
            let curve = |name: &'static str, points, color: Color32, width: f32| {
                Line::new(name, PlotPoints::Borrowed(points)).color(color).width(width).allow_hover(false)
            };
            if !self.other.displacement.is_empty() {
                let line = curve(names[0], self.other.points(what), colors.reference, 1.5);
                plot_ui.line(line.style(LineStyle::dashed_loose()));
            }
            plot_ui.line(curve(names[1], self.now.points(what), colors.accent, 1.8));
        });
    }

    fn peak_nm(&self) -> f64 {
        let all = self.now.torque_nm.iter().chain(&self.other.torque_nm);
        all.fold(0.0, |peak: f64, point| peak.max(point.y.abs()))
    }
}

impl Response {
    fn update(&mut self, designed: &Designed, disturbance: Disturbance, seconds: f64, degrees: bool) {
        let key = Some((*designed, disturbance, seconds, degrees));
        if self.of == key {
            return;
        }
        self.of = key;
        let (model, gain) = (designed.parameters.linear_model(), &designed.design.gain);
        let initial = disturbance.state(&designed.parameters);
        let response = sampled_response(&model, gain, &designed.timing, &initial, seconds);
        self.displacement = thinned(&response, |index| response.states[index].x_m);
        let (_, scale) = Unit::Angle.shown(UnitChoice { degrees, ..UnitChoice::default() });
        self.pitch = thinned(&response, |index| scale * response.states[index].pitch_rad);
        self.torque_nm = thinned(&response, |index| stronger(response.torque_nm[index]));
        self.summary = summary(&response, disturbance, degrees);
        self.poles = sampled_poles(&model, gain, &designed.timing);
    }

    fn points(&self, what: Shown) -> &[PlotPoint] {
        match what {
            Shown::Displacement => &self.displacement,
            Shown::Pitch => &self.pitch,
            Shown::Torque => &self.torque_nm,
        }
    }
}

fn summary_ui(text: &str, ui: &mut Ui) {
    hint_ui(ui, text).on_hover_text(
        "Linear sampled loop with delay and IMU sample-and-hold; without noise, friction and torque limit",
    );
}

/// Width of a small text in one line.
fn small_width(text: &str, ui: &Ui) -> f32 {
    let font = egui::TextStyle::Small.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, Color32::PLACEHOLDER).size().x
}

fn stronger([left, right]: [f64; 2]) -> f64 {
    if left.abs() >= right.abs() { left } else { right }
}

/// The curve with the smallest and the largest value of each of its parts, so that no peak is lost.
fn thinned(response: &SampledResponse, value: impl Fn(usize) -> f64) -> Vec<PlotPoint> {
    let count = response.states.len();
    let part = count.div_ceil(POINTS / 2).max(1);
    let mut points = Vec::with_capacity(POINTS + 2);
    for start in (0..count).step_by(part) {
        let range = start..(start + part).min(count);
        let by_value = |a: &usize, b: &usize| value(*a).total_cmp(&value(*b));
        let (Some(low), Some(high)) = (range.clone().min_by(by_value), range.max_by(by_value)) else {
            continue;
        };
        let both = [low.min(high), low.max(high)];
        let different = if low == high { &both[..1] } else { &both[..] };
        points.extend(
            different.iter().map(|index| PlotPoint::new(*index as f64 * response.tick_s, value(*index))),
        );
    }
    points.retain(|point| point.y.is_finite());
    points
}

/// Largest pitch and torque, and when it is where it belongs, in one line.
fn summary(response: &SampledResponse, disturbance: Disturbance, degrees: bool) -> String {
    if response.states.is_empty() {
        return "not analysed: its delay is too long".to_owned();
    }
    let largest = |value: &dyn Fn(&State) -> f64| {
        response.states.iter().fold(0.0, |peak: f64, state| peak.max(value(state).abs()))
    };
    let pitch = angle(largest(&|state| state.pitch_rad), degrees);
    let peak = format!("max. {pitch} and {} N m", shown(response.peak_torque_nm(), 3));
    let x_m = largest(&|state| state.x_m);
    // What counts as arrived: 2 % of the step, or of the farthest it was driven off.
    let band_m = 0.02 * if let Disturbance::Step(step) = disturbance { step.abs() } else { x_m };
    let last = response.states.iter().rposition(|state| state.x_m.abs() > band_m);
    match last {
        Some(last) if last + 1 == response.states.len() => {
            format!("{peak}, not settled after {} s", shown(last as f64 * response.tick_s, 2))
        }
        Some(last) => format!("{peak}, settled after {} s", shown((last + 1) as f64 * response.tick_s, 2)),
        None => peak,
    }
}

/// Until the slowest pole has faded to 1 %, in steps so that a drag does not stretch the axis all the time.
fn duration_s(designed: &Designed) -> f64 {
    let slowest = designed.design.poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
    let wanted = (4.6 / slowest).clamp(0.5, LONGEST_S);
    [1.0, 2.0, 3.0, 5.0, 8.0, 12.0].into_iter().find(|s| *s >= wanted).unwrap_or(LONGEST_S)
}

pub(super) fn quiet_plot<'a>(ui: &Ui, size: Vec2, x_label: &'a str, y_label: &'a str) -> Plot<'a> {
    let plot = Plot::new(("predicted", y_label))
        .width(size.x.max(1.0))
        .height(size.y.max(1.0))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .label_formatter(|_| None);
    Axes { x_label: Some(x_label), y_label, height: size.y, x_lines: 4.0, y_lines: 4.0 }
        .on(plot, ui.visuals())
}
