//! One look for all axes: round grid values, quiet lines, labels with units.

use egui::{Color32, FontId, Rangef, Visuals};
use egui_plot::{AxisHints, GridInput, GridMark, HPlacement, Plot};

/// Width kept for a vertical axis, so that stacked plots line up.
pub(crate) const Y_AXIS_WIDTH: f32 = 64.0;

/// Labels of both axes and how many grid lines each has, about.
pub(crate) struct Axes<'a> {
    /// Without one the horizontal axis is not drawn: the plot below has it.
    pub(crate) x_label: Option<&'a str>,
    pub(crate) y_label: &'a str,
    pub(crate) x_lines: f64,
    pub(crate) y_lines: f64,
}

impl<'a> Axes<'a> {
    /// Gives a plot these axes.
    pub(crate) fn on<'p>(&self, plot: Plot<'p>, visuals: &Visuals) -> Plot<'p>
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
        let (x_lines, y_lines) = (self.x_lines, self.y_lines);
        let x = hints(AxisHints::new_x(), self.x_label.unwrap_or_default(), Rangef::new(24.0, 30.0));
        let y = hints(AxisHints::new_y(), self.y_label, Rangef::new(12.0, 16.0))
            .placement(HPlacement::Left)
            .min_thickness(Y_AXIS_WIDTH);
        plot.custom_x_axes(vec![x])
            .custom_y_axes(vec![y])
            .show_axes([self.x_label.is_some(), true])
            .x_grid_spacer(move |input| round_marks(input, x_lines))
            .y_grid_spacer(move |input| round_marks(input, y_lines))
            .grid_color(grid_color(visuals))
    }
}

/// Grid marks at round values (1, 2 or 5 times a power of ten), about `count` of them, none at the very
/// edge, where its label would run into the next plot's.
fn round_marks(input: GridInput, count: f64) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let rough = (high - low) / count;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10.0_f64.powf(rough.log10().floor());
    let step_size =
        [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(10.0 * power);
    let edge = 0.035 * (high - low);
    let first = ((low + edge) / step_size).ceil();
    let last = ((high - edge) / step_size).floor();
    let number = if last >= first { (last - first) as usize + 1 } else { 0 };
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
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_marks_are_round_and_inside() {
        let marks = |bounds| -> Vec<String> {
            let input = GridInput { bounds, base_step_size: 1.0 };
            round_marks(input, 4.0).iter().map(|mark| tick(mark.value, mark.step_size)).collect()
        };
        assert_eq!(marks((-0.013, 0.029)), ["0.00", "0.02"]);
        assert_eq!(marks((-0.2, 0.2)), ["−0.1", "0.0", "0.1"]);
        assert!(marks((1.0, 1.0)).is_empty());
        assert!(marks((f64::NEG_INFINITY, 1.0)).is_empty());
    }

    #[test]
    fn ticks_have_the_decimals_of_their_step() {
        assert_eq!(tick(-0.15, 0.05), "−0.15");
        assert_eq!(tick(-0.0, 0.1), "0.0");
        assert_eq!(tick(20.0, 10.0), "20");
        assert_eq!(tick(-2e13, 1e13), "−2.0e13");
    }
}
