//! Poles of the sampled loop, on the plane of s or of z, with lines of equal damping and rings of equal frequency.

use egui::{Color32, Pos2, Response, Stroke, Ui, Vec2};
use egui_plot::{Line, LineStyle, MarkerShape, PlotBounds, PlotPoints, PlotTransform, PlotUi, Points, Text};
use flqr_core::lqr::{SampledPole, weights_for_pole};
use flqr_core::model::{RobotParameters, Weights};
use nalgebra::Complex;

use super::margins::complex;
use super::predicted::quiet_plot;
use crate::command::Command;
use crate::context::ViewContext;
use crate::quantity::STATES;
use crate::theme::palette;
use crate::widgets::{choice_ui, shown, warning_ui};

/// Dampings that are drawn as lines.
const DAMPINGS: [f64; 4] = [0.3, 0.5, 0.7, 0.9];
/// Rays from this damping on have their names next to them.
const NAMED: f64 = 0.5;
/// Poles that set the view: the plant's own are the slowest.
const PLANTS: usize = 4;
/// From the pointer to a pole that is told of, points.
const REACH: f32 = 14.0;
const RING_POINTS: usize = 96;
/// Visible range of the s-plane to the left and to the right, in half widths.
const LEFT: f64 = 1.7;
const RIGHT: f64 = 0.3;

/// The plane that is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Plane {
    /// Rates, 1/s: ln z over the IMU's period.
    #[default]
    S,
    /// Factors over one IMU period.
    Z,
}

/// A pole in the user's hand.
struct Drag {
    /// Weights and place of the pole when it was taken.
    start: Weights,
    robot: RobotParameters,
    from: Complex<f64>,
    /// Last position of the pointer, 1/s.
    at: Option<Complex<f64>>,
    /// The view, which rests until the pole is let go.
    bounds: PlotBounds,
    /// Nearest reachable pole, if no weights reach the pointer.
    refused: Option<Complex<f64>>,
}

/// Selection.
#[derive(Default)]
pub(super) struct PolePlane {
    plane: Plane,
    drag: Option<Drag>,
    /// Weights that a drag has brought next to nothing, with what is to be said of them.
    spent: Option<(Weights, String)>,
}

/// A weight that falls below this fraction of what it was holds nothing any more.
const SPENT: f64 = 1e-3;

/// Warning for a drag that reduces a weight to nearly zero.
fn spent(before: &Weights, now: &Weights) -> Option<String> {
    let is_spent = |index: &usize| {
        let (before, now) = (before.q[(*index, *index)], now.q[(*index, *index)]);
        before > 0.0 && now < SPENT * before
    };
    let gone: Vec<usize> = (0..STATES.len()).filter(is_spent).collect();
    let weight = |index: &usize| {
        let [before, now] = [before, now].map(|weights| shown(weights.q[(*index, *index)], 3));
        format!("{} weight {before} → {now}", STATES[*index])
    };
    let listed = gone.iter().map(weight).collect::<Vec<_>>().join(", ");
    let meaning = if gone.contains(&0) { ": the robot barely returns to its position" } else { "" };
    (!gone.is_empty()).then(|| format!("This pole location removes the {listed}{meaning}. Undo restores it."))
}

impl PolePlane {
    pub(super) fn choice_ui(&mut self, ui: &mut Ui) {
        let choices = [
            (Plane::S, "s", "s-plane, 1/s: stable in the left half plane"),
            (Plane::Z, "z", "z-plane for one IMU period: stable inside the unit circle"),
        ];
        ui.scope(|ui| choice_ui(ui, &mut self.plane, &choices));
    }

    /// Draws the poles of the active design and of the other one.
    pub(super) fn ui(
        &mut self,
        context: &ViewContext<'_>,
        (now, other): (&[SampledPole], &[SampledPole]),
        ui: &mut Ui,
        size: Vec2,
    ) {
        let colors = palette(ui.visuals());
        let (x_label, y_label) = match self.plane {
            Plane::S => ("poles, real [1/s]", "imaginary [1/s]"),
            Plane::Z => ("poles, real z", "imaginary z"),
        };
        let bounds = match self.plane {
            Plane::S => {
                let [half, height] = rate_bounds(now, other, size);
                PlotBounds::from_min_max([-LEFT * half, -height], [RIGHT * half, height])
            }
            Plane::Z => {
                let half = 1.15 * f64::from((size.x.max(1.0) / size.y.max(1.0)).max(1.0));
                PlotBounds::from_min_max([-half, -1.15], [half, 1.15])
            }
        };
        // What ended out of sight of this plot, or was about another robot, is no drag.
        let held = ui.input(|input| input.pointer.any_down() || input.pointer.any_released());
        let robot = context.designer.in_force.map(|designed| designed.parameters);
        self.drag = self.drag.take().filter(|drag| held && Some(drag.robot) == robot);
        let bounds = self.drag.as_ref().map_or(bounds, |drag| drag.bounds);
        let plot = quiet_plot(ui, size, x_label, y_label).show_grid(false);
        let shown = plot.show(ui, |plot_ui| {
            plot_ui.set_plot_bounds(bounds);
            let quiet = colors.reference.gamma_multiply(0.45);
            match self.plane {
                Plane::S => rate_lines(plot_ui, &bounds, quiet),
                Plane::Z => factor_lines(plot_ui, quiet),
            }
            self.marks(plot_ui, other, 4.0, colors.reference);
            self.marks(plot_ui, now, 5.0, colors.accent);
        });
        let names = [context.designer.active, context.designer.active.other()].map(|slot| slot.name());
        let all = now.iter().map(|pole| (names[0], pole)).chain(other.iter().map(|pole| (names[1], pole)));
        let named = !other.is_empty();
        let nearest =
            shown.response.hover_pos().and_then(|pointer| self.nearest(&shown.transform, all, pointer));
        let nearest = nearest.map(|(name, pole)| (name, *pole));
        self.drag_ui(context, now, &shown.response, &shown.transform);
        self.spent_ui(context, &shown.response, ui);
        let refused = self.drag.as_ref().and_then(|drag| drag.refused);
        shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "pole map"));
        shown.response.on_hover_ui_at_pointer(|ui| {
            if let Some(refused) = refused {
                warning_ui(ui, refused_text(refused));
                return;
            }
            ui.label(match nearest {
                Some((name, pole)) => told(name, &pole, named),
                None => "Closed-loop poles including delay and IMU sampling. Rays: damping ratio; rings: natural frequency. Hover over a pole for its values; drag it to change the weights."
                    .to_owned(),
            });
        });
    }

    /// Over the foot of the plane, for as long as these weights are active.
    fn spent_ui(&self, context: &ViewContext<'_>, plane: &Response, ui: &mut Ui) {
        let Some((_, text)) = self.spent.as_ref().filter(|(of, _)| *of == context.session.weights()) else {
            return;
        };
        let room = plane.rect.with_min_x(plane.rect.left() + 6.0).shrink2(Vec2::new(0.0, 4.0));
        let place = egui::Layout::bottom_up(egui::Align::Min);
        let mut over = ui.new_child(egui::UiBuilder::new().max_rect(room).layout(place));
        egui::Frame::new().fill(ui.visuals().extreme_bg_color).show(&mut over, |ui| warning_ui(ui, text));
    }

    /// A dragged pole takes the weights with it, as far as there are weights for its place.
    fn drag_ui(
        &mut self,
        context: &ViewContext<'_>,
        now: &[SampledPole],
        response: &Response,
        transform: &PlotTransform,
    ) {
        if self.plane != Plane::S {
            return;
        }
        if response.drag_started()
            && let Some(pressed) = response.ctx.input(|input| input.pointer.press_origin())
        {
            let plants = now.iter().take(PLANTS).map(|pole| ("", pole));
            let taken = self.nearest(transform, plants, pressed);
            let bounds = *transform.bounds();
            let start = context.session.weights();
            let robot = context.designer.in_force.map(|designed| designed.parameters);
            self.drag = taken.zip(robot).map(|((_, pole), robot)| Drag {
                start,
                robot,
                from: pole.s,
                at: None,
                bounds,
                refused: None,
            });
        }
        if let (Some(pointer), true) = (response.interact_pointer_pos(), response.dragged()) {
            let at = transform.value_from_position(pointer);
            self.follow(context, Complex::new(at.x, at.y));
        }
        if response.drag_stopped()
            && let Some(Drag { refused: Some(refused), .. }) = self.drag.take()
        {
            context.commands.send(Command::Say(refused_text(refused)));
        }
    }

    fn follow(&mut self, context: &ViewContext<'_>, at: Complex<f64>) {
        let (Some(drag), Some(designed)) = (&mut self.drag, context.designer.in_force) else { return };
        // A pole stays on its side of the real axis, where its other half is its mirror image.
        let at = Complex::new(at.re, if drag.from.im < 0.0 { at.im.min(0.0) } else { at.im.max(0.0) });
        if drag.at.replace(at) == Some(at) {
            return;
        }
        let model = designed.parameters.linear_model();
        let placed = weights_for_pole(&model, &designed.timing, &drag.start, drag.from, at);
        drag.refused = (!placed.is_reached).then_some(placed.pole);
        self.spent = spent(&drag.start, &placed.weights).map(|text| (placed.weights, text));
        if placed.weights != context.session.weights() {
            context.commands.send(Command::SetWeights(placed.weights));
        }
    }

    fn place(&self, pole: &SampledPole) -> [f64; 2] {
        let at = match self.plane {
            Plane::S => pole.s,
            Plane::Z => pole.z,
        };
        [at.re, at.im]
    }

    fn marks(&self, plot_ui: &mut PlotUi<'_>, poles: &[SampledPole], radius: f32, color: Color32) {
        let places =
            poles.iter().map(|pole| self.place(pole)).filter(|[x, y]| x.is_finite() && y.is_finite());
        let marks = Points::new("", places.collect::<PlotPoints<'_>>()).shape(MarkerShape::Cross);
        plot_ui.points(marks.radius(radius).color(color).allow_hover(false));
    }

    fn nearest<'a>(
        &self,
        transform: &PlotTransform,
        poles: impl Iterator<Item = (&'static str, &'a SampledPole)>,
        pointer: Pos2,
    ) -> Option<(&'static str, &'a SampledPole)> {
        poles
            .map(|(name, pole)| {
                let [x, y] = self.place(pole);
                (
                    transform.position_from_point(&egui_plot::PlotPoint::new(x, y)).distance(pointer),
                    name,
                    pole,
                )
            })
            .filter(|(distance, ..)| *distance <= REACH)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, name, pole)| (name, pole))
    }
}

fn refused_text(nearest: Complex<f64>) -> String {
    format!("No weights place the pole there: the nearest is {} 1/s.", complex(nearest.re, nearest.im))
}

fn told(name: &str, pole: &SampledPole, named: bool) -> String {
    let of = if named { format!("{name}: ") } else { String::new() };
    let time = if pole.s.re < 0.0 {
        format!("time constant {} ms", shown(-1e3 / pole.s.re, 3))
    } else {
        "not asymptotically stable".to_owned()
    };
    format!(
        "{of}s = {} 1/s\ndamping {}, {} Hz\n{time}\nz = {}",
        complex(pole.s.re, pole.s.im),
        shown(pole.damping(), 3),
        shown(pole.s.norm() / std::f64::consts::TAU, 3),
        complex(pole.z.re, pole.z.im)
    )
}

/// Half the width and height of the view, 1/s, with equal scales; in steps, so that it rests during a drag.
fn rate_bounds(now: &[SampledPole], other: &[SampledPole], size: Vec2) -> [f64; 2] {
    let width = f64::from((size.x - crate::plot::Y_AXIS_WIDTH).max(1.0));
    let aspect = f64::from((size.y - 36.0).max(1.0)) / width;
    let plants = now.iter().take(PLANTS).chain(other.iter().take(PLANTS)).map(|pole| pole.s);
    let reach = plants
        .filter(|s| s.norm().is_finite())
        .map(|s| (-s.re / (0.95 * LEFT)).max(s.re / (0.8 * RIGHT)).max(s.im.abs() / (0.9 * aspect)))
        .fold(1.0, f64::max);
    let power = 10.0_f64.powf(reach.log10().floor());
    let step = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0].into_iter().find(|step| step * power >= reach).unwrap_or(10.0);
    [step * power, step * power * aspect]
}

/// Rays of damping and rings of frequency, with their names.
fn rate_lines(plot_ui: &mut PlotUi<'_>, bounds: &PlotBounds, color: Color32) {
    let ([left, bottom], [right, top]) = (bounds.min(), bounds.max());
    axis(plot_ui, [[0.0, bottom], [0.0, top]], color);
    axis(plot_ui, [[left, 0.0], [right, 0.0]], color);
    let faint = color.gamma_multiply(0.7);
    for damping in DAMPINGS {
        let slope = (1.0 - damping * damping).sqrt() / damping;
        // As far as the edge that it meets first.
        let length = (-left).min(top / slope);
        for sign in [-1.0, 1.0] {
            let end = [-length, sign * length * slope];
            dashed(plot_ui, vec![[0.0, 0.0], end], faint);
        }
        // Steep rays lie too close to each other for their names.
        if damping >= NAMED {
            text(plot_ui, [-0.82 * length, 0.82 * length * slope], &format!("ζ {damping}"), color);
        }
    }
    let rough = -left / 3.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|step| *step >= rough).unwrap_or(rough);
    let mut radius = step;
    while radius < -left {
        dashed(plot_ui, arc(radius, [0.5, 1.5]), faint);
        text(plot_ui, [-radius, 0.0], &format!("{} Hz", shown(radius / std::f64::consts::TAU, 2)), color);
        radius += step;
    }
}

/// The unit circle and curves of damping inside it.
fn factor_lines(plot_ui: &mut PlotUi<'_>, color: Color32) {
    axis(plot_ui, [[-1.0, 0.0], [1.0, 0.0]], color);
    plot_ui.line(
        Line::new("", PlotPoints::from(arc(1.0, [0.0, 2.0]))).color(color).width(1.2).allow_hover(false),
    );
    for damping in DAMPINGS {
        let decay = damping / (1.0 - damping * damping).sqrt();
        for sign in [-1.0, 1.0] {
            let points = (0..=RING_POINTS).map(|index| {
                let angle = std::f64::consts::PI * index as f64 / RING_POINTS as f64;
                let size = (-decay * angle).exp();
                [size * angle.cos(), sign * size * angle.sin()]
            });
            dashed(plot_ui, points.collect(), color.gamma_multiply(0.7));
        }
    }
}

fn arc(radius: f64, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let angle =
        |index: usize| std::f64::consts::PI * (from + (to - from) * index as f64 / RING_POINTS as f64);
    (0..=RING_POINTS).map(|index| [radius * angle(index).cos(), radius * angle(index).sin()]).collect()
}

fn axis(plot_ui: &mut PlotUi<'_>, points: [[f64; 2]; 2], color: Color32) {
    let line = Line::new("", PlotPoints::from(points.to_vec())).stroke(Stroke::new(1.0, color));
    plot_ui.line(line.allow_hover(false));
}

fn dashed(plot_ui: &mut PlotUi<'_>, points: Vec<[f64; 2]>, color: Color32) {
    let line = Line::new("", PlotPoints::from(points)).color(color).width(1.0);
    plot_ui.line(line.style(LineStyle::dotted_dense()).allow_hover(false));
}

fn text(plot_ui: &mut PlotUi<'_>, at: [f64; 2], text: &str, color: Color32) {
    let text = egui::RichText::new(text).size(10.0).color(color.gamma_multiply(1.8));
    plot_ui.text(Text::new("", at.into(), text).anchor(egui::Align2::CENTER_BOTTOM).allow_hover(false));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_that_a_drag_leaves_next_to_nothing_of_is_named() {
        let before = Weights::diagonal([60.0, 30.0, 100.0, 0.0], [20.0, 20.0]);
        let with = |index: usize, weight: f64| {
            let mut now = before;
            now.q[(index, index)] = weight;
            spent(&before, &now)
        };
        let text = with(0, 3e-9).unwrap();
        assert!(
            text.contains("displacement weight 60.0 → 3.00e−9") && text.contains("barely returns"),
            "{text}"
        );
        let text = with(2, 0.0).unwrap();
        assert!(text.contains("pitch weight 100 → 0.00") && !text.contains("barely returns"), "{text}");
        assert_eq!([with(0, 0.1), with(3, 0.0), with(1, 900.0)], [None, None, None]);
    }
}
