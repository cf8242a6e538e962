//! What the linear model predicts for the gains in force and for A: responses and poles.

use egui::{Ui, vec2};
use egui_plot::{
    Corner, HLine, Legend, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotPoints, Points, VLine,
};
use flqr_core::robot::State;
use flqr_core::simulate::predicted_response;

use crate::context::ViewContext;
use crate::design::Designed;
use crate::plot::Axes;
use crate::theme::{Palette, palette};

/// The response starts displaced by this, at rest and upright, m.
const START_M: f64 = -0.1;
const POINTS: usize = 400;

/// A predicted response, ready for plotting.
#[derive(Default)]
struct Response {
    of: Option<(Designed, f64)>,
    displacement: Vec<PlotPoint>,
    pitch_deg: Vec<PlotPoint>,
}

/// Predicted responses of the gains in force and of A.
#[derive(Default)]
pub(super) struct Predicted {
    new: Response,
    old: Response,
}

impl Predicted {
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        let Some(new) = context.designer.in_force else {
            // Filled, or the panel would shrink and stay so.
            let size = ui.available_size();
            ui.label(egui::RichText::new("Predicted").heading().strong());
            crate::widgets::hint_ui(ui, "no design");
            ui.set_min_size(size);
            return;
        };
        let old = context.designer.reference.filter(|reference| reference.design != new.design);
        let seconds = duration_s(&new).max(old.as_ref().map_or(0.0, duration_s));
        self.new.update(context, &new, seconds);
        if let Some(old) = &old {
            self.old.update(context, old, seconds);
        }
        let colors = palette(ui.visuals());
        ui.horizontal(|ui| {
            ui.label(egui::RichText::new("Predicted").heading().strong());
            crate::widgets::hint_ui(ui, "from 0.1 m behind, linear, without noise, delay and friction");
        });
        let size = vec2((ui.available_width() - 16.0) / 3.0, ui.available_height());
        let old_response = old.as_ref().map(|_| &self.old);
        ui.horizontal_top(|ui| {
            let pick_x: Pick = |response| &response.displacement;
            let pick_pitch: Pick = |response| &response.pitch_deg;
            response_plot(ui, size, "displacement [m]", &self.new, old_response, pick_x, colors);
            response_plot(ui, size, "pitch [°]", &self.new, old_response, pick_pitch, colors);
            pole_plot(ui, size, &new, old.as_ref(), colors);
        });
    }
}

impl Response {
    fn update(&mut self, context: &ViewContext<'_>, designed: &Designed, seconds: f64) {
        let Some(robot) = context.session.robot() else { return };
        let key = Some((*designed, seconds));
        if self.of == key {
            return;
        }
        self.of = key;
        let robot = flqr_core::model_file::RobotModel { parameters: designed.parameters, ..robot.clone() };
        let initial = State { x_m: START_M, ..State::default() };
        let step = seconds / POINTS as f64;
        let response = predicted_response(&robot, &designed.design.gain, initial, seconds, step);
        let points = |value: fn(&State) -> f64| {
            let all = response.iter().map(|(time, state)| PlotPoint::new(*time, value(state)));
            all.filter(|point| point.y.is_finite()).collect()
        };
        self.displacement = points(|state| state.x_m);
        self.pitch_deg = points(|state| state.pitch_rad.to_degrees());
    }
}

type Pick = fn(&Response) -> &Vec<PlotPoint>;

/// Until the slowest pole has faded to 1 %, in steps so that a drag does not stretch the axis all the time.
fn duration_s(designed: &Designed) -> f64 {
    let slowest = designed.design.poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
    let wanted = (4.6 / slowest).clamp(0.5, 60.0);
    [1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 60.0].into_iter().find(|s| *s >= wanted).unwrap_or(60.0)
}

fn quiet_plot<'a>(ui: &Ui, size: egui::Vec2, x_label: &'a str, y_label: &'a str) -> Plot<'a> {
    let plot = Plot::new(("predicted", y_label))
        .width(size.x.max(1.0))
        .height(size.y.max(1.0))
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .label_formatter(|_| None);
    Axes { x_label: Some(x_label), y_label, x_lines: 4.0, y_lines: 4.0 }.on(plot, ui.visuals())
}

fn response_plot(
    ui: &mut Ui,
    size: egui::Vec2,
    label: &str,
    new: &Response,
    old: Option<&Response>,
    pick: Pick,
    colors: Palette,
) {
    // The displacement ends at the top, the pitch begins there.
    let corner = if label.starts_with("pitch") { Corner::RightTop } else { Corner::RightBottom };
    let plot = quiet_plot(ui, size, "time [s]", label)
        .legend(Legend::default().position(corner).follow_insertion_order(true).background_alpha(0.6));
    plot.show(ui, |plot_ui| {
        if let Some(old) = old {
            plot_ui.line(
                Line::new("A", PlotPoints::Borrowed(pick(old)))
                    .color(colors.reference)
                    .style(LineStyle::dashed_loose())
                    .width(1.5)
                    .allow_hover(false),
            );
        }
        plot_ui.line(
            Line::new("in force", PlotPoints::Borrowed(pick(new)))
                .color(colors.accent)
                .width(1.8)
                .allow_hover(false),
        );
    });
}

fn pole_plot(ui: &mut Ui, size: egui::Vec2, new: &Designed, old: Option<&Designed>, colors: Palette) {
    let points = |designed: &Designed| -> PlotPoints<'static> {
        let finite = designed.design.poles.iter().filter(|pole| pole.re.is_finite() && pole.im.is_finite());
        finite.map(|pole| [pole.re, pole.im]).collect()
    };
    let plot = quiet_plot(ui, size, "poles, real [1/s]", "imaginary [1/s]")
        .include_x(0.5)
        .include_y(-1.0)
        .include_y(1.0)
        .set_margin_fraction(vec2(0.1, 0.15));
    plot.show(ui, |plot_ui| {
        let axis = egui::Stroke::new(1.0, colors.reference.gamma_multiply(0.6));
        plot_ui.hline(HLine::new("real axis", 0.0).stroke(axis).allow_hover(false));
        plot_ui.vline(VLine::new("limit of stability", 0.0).stroke(axis).allow_hover(false));
        if let Some(old) = old {
            let marks = Points::new("A", points(old)).shape(MarkerShape::Cross).radius(4.5);
            plot_ui.points(marks.color(colors.reference).allow_hover(false));
        }
        let marks = Points::new("in force", points(new)).shape(MarkerShape::Cross).radius(5.5);
        plot_ui.points(marks.color(colors.accent).allow_hover(false));
    });
}
