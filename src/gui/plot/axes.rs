//! One look for all axes: round grid values, quiet lines, labels with units.

use egui::{Align2, Color32, FontId, Rangef, Rect, RichText, Ui, Visuals, vec2};
use egui_plot::{AxisHints, GridInput, GridMark, HPlacement, Plot};
use flqr_core::report::number::fixed;

/// Width kept for a vertical axis, so that stacked plots line up.
pub(crate) const Y_AXIS_WIDTH: f32 = 64.0;

/// Height of the horizontal axis with its label.
pub(crate) const X_AXIS_HEIGHT: f32 = 36.0;

/// Labels of both axes and how many grid lines each has, about.
pub(crate) struct Axes<'a> {
    /// Without one the horizontal axis is not drawn: the plot below has it.
    pub(crate) x_label: Option<&'a str>,
    pub(crate) y_label: &'a str,
    /// Height of the plot with its horizontal axis, in points: where it is too low for the label, the unit is left of
    /// it.
    pub(crate) height: f32,
    pub(crate) x_lines: f64,
    pub(crate) y_lines: f64,
}

/// Optional parts of a plot.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Extras {
    /// What is at the right; room is kept for it where only other plots of the stack have one.
    pub(super) right: Right,
    /// The vertical values are logarithms to the base of ten.
    pub(super) logarithmic: bool,
}

/// Right axis of a plot.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Right {
    /// The plot reaches to its edge.
    #[default]
    Nothing,
    /// As much room as an axis takes.
    Room,
    /// A second vertical axis of its own scale.
    Axis(SecondAxis),
}

/// A second vertical axis: where the first one shows `y`, it shows `(y − first) · scale + second`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SecondAxis {
    label: String,
    color: Color32,
    first: f64,
    second: f64,
    scale: f64,
}

impl SecondAxis {
    /// An axis that shows `range` where the first one shows `left`, with round values at the first one's `lines`.
    pub(super) fn new(label: String, color: Color32, range: [f64; 2], left: [f64; 2], lines: f64) -> Self {
        let step = grid_step(left, lines);
        let count = ((left[1] - left[0]) / step - 1.0).max(1.5);
        let own_step = round_step((range[1] - range[0]) / count);
        let middle = |ends: [f64; 2], step: f64| ((0.5 * ends[0] + 0.5 * ends[1]) / step).round() * step;
        let scale = own_step / step;
        Self { label, color, first: middle(left, step), second: middle(range, own_step), scale }
    }

    /// Maps a value of this axis to the first one.
    pub(super) fn place(&self, value: f64) -> f64 {
        (value - self.second) / self.scale + self.first
    }

    fn value(&self, place: f64) -> f64 {
        (place - self.first) * self.scale + self.second
    }
}

impl<'a> Axes<'a> {
    /// Length of the vertical axis.
    fn length(&self) -> f32 {
        self.height - if self.x_label.is_some() { X_AXIS_HEIGHT } else { 0.0 }
    }

    /// Writes what has no room along the vertical axis into the corner of the plot, which has `frame`.
    pub(crate) fn name_in(&self, frame: Rect, ui: &Ui) {
        if let Some(name) = left_out(self.y_label, self.length()) {
            let (place, font) = (frame.left_top() + vec2(4.0, 1.0), FontId::proportional(11.5));
            let color = ui.visuals().weak_text_color();
            ui.painter().with_clip_rect(frame).text(place, Align2::LEFT_TOP, name, font, color);
        }
    }

    /// Gives a plot these axes.
    pub(crate) fn on<'p>(&self, plot: Plot<'p>, visuals: &Visuals) -> Plot<'p>
    where
        'a: 'p,
    {
        self.with(&Extras::default(), plot, visuals)
    }

    /// Gives a plot these axes and more.
    pub(super) fn with<'p>(&self, extras: &Extras, plot: Plot<'p>, visuals: &Visuals) -> Plot<'p>
    where
        'a: 'p,
    {
        let hints = |hints: AxisHints<'p>, label: &str, spacing: Rangef| {
            hints
                .label(label.to_owned())
                .label_spacing(spacing)
                .tick_label_font(FontId::proportional(11.5))
                .formatter(|mark, _| tick(mark.value, mark.step_size))
        };
        let (x_lines, y_lines, logarithmic) = (self.x_lines, self.y_lines, extras.logarithmic);
        let x = hints(AxisHints::new_x(), self.x_label.unwrap_or_default(), Rangef::new(24.0, 30.0));
        let y_label = fitting(self.y_label, self.length());
        let y = hints(AxisHints::new_y(), y_label, Rangef::new(12.0, 16.0))
            .placement(HPlacement::Left)
            .min_thickness(Y_AXIS_WIDTH);
        let y = if logarithmic { y.formatter(|mark, _| power_of_ten(mark.value)) } else { y };
        let mut y_axes = vec![y];
        y_axes.extend(right_axis(&extras.right));
        plot.custom_x_axes(vec![x])
            .custom_y_axes(y_axes)
            .show_axes([self.x_label.is_some(), true])
            .x_grid_spacer(move |input| round_marks(input, x_lines))
            .y_grid_spacer(move |input| {
                let marks = round_marks(input, y_lines);
                if logarithmic {
                    marks.into_iter().filter(|mark| mark.value.fract() == 0.0).collect()
                } else {
                    marks
                }
            })
            .grid_color(grid_color(visuals))
    }
}

/// The name that a label along an axis of `length` leaves out.
fn left_out(label: &str, length: f32) -> Option<&str> {
    let name = label.rfind('[').map_or(label, |at| label[..at].trim_end());
    (fitting(label, length) != label && !name.is_empty()).then_some(name)
}

/// As much of a label as fits along an axis: all of it, the unit, or nothing.
fn fitting(label: &str, length: f32) -> &str {
    const LETTER_WIDTH: f32 = 6.2;
    let fits = |text: &&str| LETTER_WIDTH * text.chars().count() as f32 <= length;
    let unit = label.rfind('[').map_or("", |at| &label[at..]);
    [label, unit].into_iter().find(fits).unwrap_or_default()
}

fn right_axis<'p>(right: &Right) -> Option<AxisHints<'p>> {
    let hints = AxisHints::new_y()
        .placement(HPlacement::Right)
        .label_spacing(Rangef::new(12.0, 16.0))
        .tick_label_font(FontId::proportional(11.5))
        .min_thickness(Y_AXIS_WIDTH);
    match right {
        Right::Nothing => None,
        Right::Room => Some(hints.formatter(|_, _| String::new())),
        Right::Axis(axis) => {
            let label = RichText::new(&axis.label).color(axis.color);
            let axis = axis.clone();
            let hints = hints.label(label).tick_label_color(axis.color);
            Some(hints.formatter(move |mark, _| tick(axis.value(mark.value), mark.step_size * axis.scale)))
        }
    }
}

fn power_of_ten(exponent: f64) -> String {
    match exponent {
        _ if exponent.fract() != 0.0 => String::new(),
        -3.0..=3.0 => tick(10.0_f64.powf(exponent), 10.0_f64.powf(exponent)),
        _ => format!("1e{exponent:.0}").replace('-', "−"),
    }
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below `rough`.
fn round_step(rough: f64) -> f64 {
    let power = 10.0_f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|step| *step >= rough).unwrap_or(10.0 * power)
}

/// Fewer labelled lines than this tell no scale.
const FEWEST_MARKS: usize = 2;

/// Step between about `count` lines over a range; smaller where too few round values would lie inside.
fn grid_step(range: [f64; 2], count: f64) -> f64 {
    let rough = (range[1] - range[0]) / count;
    let steps = [1.0, 0.5, 0.25, 0.1].map(|part| round_step(part * rough));
    let enough = |step: &f64| inner_marks(range, *step).1 >= FEWEST_MARKS;
    steps.into_iter().find(enough).unwrap_or(steps[0])
}

/// The first multiple of a step inside of a range, and how many there are. None is at the very edge, where its label
/// would run into the next plot's.
fn inner_marks([low, high]: [f64; 2], step: f64) -> (f64, usize) {
    let edge = 0.035 * (high - low);
    let first = ((low + edge) / step).ceil();
    let last = ((high - edge) / step).floor();
    (first, if last >= first { (last - first) as usize + 1 } else { 0 })
}

/// Grid marks at round values (1, 2 or 5 times a power of ten), about `count` of them.
fn round_marks(input: GridInput, count: f64) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let rough = (high - low) / count;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let step_size = grid_step([low, high], count);
    let (first, number) = inner_marks([low, high], step_size);
    (0..number).map(|index| GridMark { value: (first + index as f64) * step_size, step_size }).collect()
}

/// Quieter than what is drawn over it.
fn grid_color(visuals: &Visuals) -> Color32 {
    visuals.text_color().gamma_multiply(if visuals.dark_mode { 0.16 } else { 0.22 })
}

/// A tick with the decimals that its step needs.
fn tick(value: f64, step: f64) -> String {
    if value.abs() >= 1e6 {
        return format!("{value:.1e}").replace('-', "−");
    }
    let decimals = (-step.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    fixed(value, decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_plot_keeps_the_unit_of_its_label() {
        for (label, length, left) in [
            ("velocity [m/s]", 100.0, "velocity [m/s]"),
            ("velocity [m/s]", 50.0, "[m/s]"),
            ("velocity [m/s]", 10.0, ""),
            ("order", 10.0, ""),
            ("pitch [°]", 60.0, "pitch [°]"),
            ("", 0.0, ""),
        ] {
            assert_eq!(fitting(label, length), left, "{label} on {length}");
        }
        assert_eq!(left_out("velocity [m/s]", 50.0), Some("velocity"), "it is written into the plot");
        assert_eq!([left_out("velocity [m/s]", 100.0), left_out("", 0.0)], [None, None]);
    }

    #[test]
    fn grid_marks_are_round_and_inside() {
        let marks = |bounds| -> Vec<String> {
            let input = GridInput { bounds, base_step_size: 1.0 };
            round_marks(input, 4.0).iter().map(|mark| tick(mark.value, mark.step_size)).collect()
        };
        assert_eq!(marks((-0.013, 0.029)), ["0.00", "0.02"]);
        assert_eq!(marks((-0.2, 0.2)), ["−0.1", "0.0", "0.1"]);
        assert_eq!(marks((-0.43, 0.41)), ["−0.4", "−0.2", "0.0", "0.2"], "one alone would tell no scale");
        assert!(marks((1.0, 1.0)).is_empty());
        assert!(marks((f64::NEG_INFINITY, 1.0)).is_empty());
    }

    #[test]
    fn a_second_axis_has_round_values_at_the_lines_of_the_first_and_room_for_its_range() {
        for (range, left) in
            [([-0.3, 0.4], [-1.0, 2.0]), ([1e3, 1.7e3], [0.0, 0.013]), ([2.0, 2.1], [-7.0, 9.0])]
        {
            let axis = SecondAxis::new(String::new(), Color32::WHITE, range, left, 5.0);
            let bounds = (left[0], left[1]);
            for mark in round_marks(GridInput { bounds, base_step_size: 1.0 }, 5.0) {
                let (value, step) = (axis.value(mark.value), mark.step_size * axis.scale);
                assert!((value / step - (value / step).round()).abs() < 1e-6, "{value} in steps of {step}");
                assert!((axis.place(value) - mark.value).abs() < 1e-9 * mark.step_size);
            }
            for end in range {
                let place = axis.place(end);
                assert!(place >= left[0] && place <= left[1], "{end} is at {place} of {left:?}");
            }
        }
        assert_eq!(["0.01", "1000", "1e−5", ""].map(str::to_owned), [-2.0, 3.0, -5.0, 0.5].map(power_of_ten));
    }

    #[test]
    fn ticks_have_the_decimals_of_their_step() {
        assert_eq!(tick(-0.15, 0.05), "−0.15");
        assert_eq!(tick(-0.0, 0.1), "0.0");
        assert_eq!(tick(20.0, 10.0), "20");
        assert_eq!(tick(-2e13, 1e13), "−2.0e13");
    }
}
