//! One plot of a stack, and the horizontal range that the stack shares.

use egui::{Color32, Ui};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotResponse, PlotUi};

use super::axes::{Axes, Extras, Y_AXIS_WIDTH};
use crate::theme::palette;

/// The shortest range that can be zoomed to.
const MIN_SPAN: f64 = 1e-3;

/// The horizontal range of a stack of plots: it follows the newest sample until the user moves it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeView {
    /// True if the newest sample stays at the right edge.
    pub follow: bool,
    /// Length of the range.
    pub span: f64,
    end: f64,
    limits: [f64; 2],
}

impl TimeView {
    /// A view that follows, `span` long.
    pub fn following(span: f64) -> Self {
        Self { follow: true, span, end: span, limits: [0.0, span] }
    }

    /// Takes note of the data's range; call it once a frame, before the plots.
    pub fn update(&mut self, data: [f64; 2]) {
        self.limits = data;
        if self.follow {
            self.end = data[1].max(data[0] + self.span);
        }
    }

    /// Shows all of the data and holds it.
    pub fn show_all(&mut self, data: [f64; 2]) {
        self.follow = false;
        self.limits = data;
        self.span = (data[1] - data[0]).max(MIN_SPAN);
        self.end = data[0] + self.span;
    }

    /// The visible range.
    pub fn range(&self) -> [f64; 2] {
        [self.end - self.span, self.end]
    }

    /// Moves the range by `delta` and holds it.
    fn pan(&mut self, delta: f64) {
        self.follow = false;
        let slack = 0.9 * self.span;
        self.end = (self.end + delta).clamp(self.limits[0] + self.span - slack, self.limits[1] + slack);
    }

    /// Zooms by `factor` about `center`; while following, the right edge stays.
    fn zoom(&mut self, factor: f64, center: f64) {
        let longest = 1.2 * (self.limits[1] - self.limits[0]).max(1.0);
        let span = (self.span / factor).clamp(MIN_SPAN, longest);
        if !self.follow {
            self.end = center + (self.end - center) * span / self.span;
        }
        self.span = span;
    }
}

/// One plot of a stack.
pub(super) struct TimePlot<'a> {
    /// Distinguishes it from other plots.
    pub(super) id: &'a str,
    /// Label of the vertical axis, with the unit.
    pub(super) label: &'a str,
    /// Height in points.
    pub(super) height: f32,
    /// Label of the horizontal axis; without one the axis is not drawn (the plot below has it).
    pub(super) x_label: Option<&'a str>,
}

/// View of one plot.
#[derive(Default)]
pub(super) struct Drawing<'a> {
    /// Lines with gaps, in the order in which they are drawn.
    pub(super) lines: Vec<(Color32, &'a [Vec<PlotPoint>])>,
    pub(super) y_range: [f64; 2],
    /// Horizontal lines with names.
    pub(super) limits: Vec<(String, f64)>,
    pub(super) extras: Extras,
}

impl TimePlot<'_> {
    pub(super) fn draw(
        &self,
        ui: &mut Ui,
        range: [f64; 2],
        drawing: &Drawing<'_>,
        beside: impl FnOnce(&mut PlotUi<'_>),
    ) -> PlotResponse<()> {
        let width = (ui.available_width() - Y_AXIS_WIDTH).max(1.0);
        let axes = Axes {
            x_label: self.x_label,
            y_label: self.label,
            height: self.height,
            x_lines: (f64::from(width) / 60.0).clamp(2.0, 8.0),
            y_lines: self.y_lines(),
        };
        let plot = Plot::new(self.id)
            .height(self.height.max(1.0))
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_double_click_reset(false)
            .allow_axis_zoom_drag(false)
            .label_formatter(|_| None);
        let plot = axes.with(&drawing.extras, plot, ui.visuals());
        let limit_color = palette(ui.visuals()).error;
        let shown = plot.show(ui, |plot_ui| {
            plot_ui.set_plot_bounds_x(range[0]..=range[1]);
            plot_ui.set_plot_bounds_y(drawing.y_range[0]..=drawing.y_range[1]);
            for (number, (name, value)) in drawing.limits.iter().enumerate() {
                let line = HLine::new(name, *value).id((self.id, "limit", number)).color(limit_color);
                plot_ui.hline(line.style(LineStyle::dashed_dense()).width(1.0).allow_hover(false));
            }
            for (number, (color, pieces)) in drawing.lines.iter().enumerate() {
                for (part, piece) in pieces.iter().enumerate() {
                    plot_ui.line(
                        Line::new(self.id, PlotPoints::Borrowed(piece))
                            .id((self.id, number, part))
                            .color(*color)
                            .width(1.3)
                            .allow_band(false)
                            .allow_hover(false),
                    );
                }
            }
            beside(plot_ui);
        });
        axes.name_in(*shown.transform.frame(), ui);
        shown
    }

    /// About how many horizontal grid lines there are.
    pub(super) fn y_lines(&self) -> f64 {
        (f64::from(self.height) / 40.0).max(4.0)
    }
}

/// Pixel columns of a plot that takes the available width.
pub(super) fn columns(ui: &Ui) -> usize {
    ((ui.available_width() - Y_AXIS_WIDTH).max(1.0) * ui.ctx().pixels_per_point()) as usize
}

/// Values beyond this cannot be distinguished on a screen, and their differences are no numbers.
const LARGEST: f64 = 1e300;

/// A vertical range with a margin, never empty, centred on all of these.
pub(super) fn y_range(ends: impl Iterator<Item = [f64; 2]>, min_span: f64) -> [f64; 2] {
    let ends = ends.map(|ends| ends.map(|end| end.clamp(-LARGEST, LARGEST)));
    let ends = ends.reduce(|all, one| [all[0].min(one[0]), all[1].max(one[1])]);
    let [low, high] = ends.unwrap_or([0.0, 0.0]);
    let center = 0.5 * low + 0.5 * high;
    let half = (0.55 * (high - low)).max(0.5 * min_span).max(1e-6 * center.abs());
    [center - half, center + half]
}

pub(super) fn interact(ui: &Ui, shown: &PlotResponse<()>, view: &mut TimeView, may_pan: bool) {
    let PlotResponse { response, transform, .. } = shown;
    let per_point = view.span / f64::from(transform.frame().width().max(1.0));
    if response.dragged() && may_pan {
        view.pan(-f64::from(response.drag_delta().x) * per_point);
    }
    if response.double_clicked() {
        view.follow = true;
    }
    let Some(pointer) = response.hover_pos() else { return };
    let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta(), input.zoom_delta()));
    let factor = f64::from(pinch) * (f64::from(wheel.y) / 200.0).exp();
    if (factor - 1.0).abs() > 1e-9 {
        view.zoom(factor, transform.value_from_position(pointer).x);
    }
    if wheel.x != 0.0 {
        view.pan(-f64::from(wheel.x) * per_point);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_following_view_keeps_the_newest_sample_at_its_right_edge() {
        let mut view = TimeView::following(10.0);
        view.update([0.0, 3.0]);
        assert_eq!(view.range(), [0.0, 10.0], "the first seconds fill the plot from the left");
        view.update([0.0, 42.0]);
        assert_eq!(view.range(), [32.0, 42.0]);
        view.pan(-5.0);
        view.update([0.0, 50.0]);
        assert_eq!(view.range(), [27.0, 37.0], "a moved view stays where it is");
    }

    #[test]
    fn zoom_keeps_the_value_under_the_pointer() {
        let mut view = TimeView::following(10.0);
        view.show_all([0.0, 10.0]);
        view.zoom(2.0, 4.0);
        assert_eq!(view.range(), [2.0, 7.0]);
        view.zoom(1e9, 4.0);
        assert!(view.span >= MIN_SPAN);
        view.zoom(1e-9, 4.0);
        assert!(view.span <= 12.0);
    }
}
