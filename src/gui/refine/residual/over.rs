//! The residual over any variable, and its order spectrum.

use std::f64::consts::TAU;

use egui::{ComboBox, Ui, Vec2, vec2};
use egui_plot::{FilledArea, Line, MarkerShape, Plot, PlotPoint, PlotPoints, Points};
use flqr_core::refine::{Explorer, Variable};
use flqr_core::signal::{Band, Bin, binned};

use crate::plot::Axes;
use crate::theme::palette;
use crate::widgets::{choice_ui, hint_ui, shown};

/// Most points that are drawn of a residual.
const MOST_POINTS: usize = 1200;
const MOST_BINS: usize = 90;

/// Over what, and of which rows.
#[derive(Clone, Debug, PartialEq)]
struct Choice {
    /// Name of the variable.
    variable: String,
    /// True if an angle is taken modulo a turn.
    folded: bool,
    held_out: bool,
    band: Band,
}

/// Plot data, cached until the selection or the result changes.
#[derive(Default)]
struct Drawn {
    key: Option<(u64, Choice)>,
    points: [Vec<PlotPoint>; 2],
    bins: [Vec<Bin>; 2],
}

/// State of the plot over a variable.
pub(super) struct Over {
    choice: Choice,
    /// Of an answer, the variable on which the residual depends most.
    suggested: Option<(u64, &'static str)>,
    drawn: Drawn,
}

impl Default for Over {
    fn default() -> Self {
        let choice = Choice { variable: String::new(), folded: true, held_out: true, band: Band::Error };
        Self { choice, suggested: None, drawn: Drawn::default() }
    }
}

/// A variable that goes round: an angle of a shaft.
fn goes_round(variable: &Variable) -> bool {
    variable.name.starts_with("motor_angle") && variable.unit == "rad"
}

impl Over {
    /// Shows a variable.
    pub(super) fn choose(&mut self, name: &str) {
        name.clone_into(&mut self.choice.variable);
    }

    /// Looks for the variable on which the residual depends most, unless one was chosen.
    pub(super) fn suggest(&mut self, explorer: &Explorer, generation: u64) {
        if self.suggested.is_some_and(|(number, _)| number == generation) {
            return;
        }
        let spread = |variable: &Variable| {
            let folded: Vec<f64> = variable.values.iter().map(|value| value.rem_euclid(TAU)).collect();
            let values = if goes_round(variable) { &folded } else { &variable.values };
            let bins = binned(values, &explorer.before, MOST_BINS, Band::Error);
            bins.iter().map(|bin| bin.mean * bin.mean).sum::<f64>() / bins.len().max(1) as f64
        };
        // Everything depends on time where nothing else explains it.
        let others = explorer.variables.iter().skip(1).map(|variable| (spread(variable), variable.name));
        let best = others.max_by(|a, b| a.0.total_cmp(&b.0));
        self.suggested = best.map(|(_, name)| (generation, name));
    }

    /// The chosen variable, at first the suggested one.
    fn variable<'a>(&self, explorer: &'a Explorer) -> Option<&'a Variable> {
        explorer
            .variable(&self.choice.variable)
            .or_else(|| explorer.variable(self.suggested?.1))
            .or_else(|| explorer.variables.first())
    }

    pub(super) fn controls_ui(&mut self, explorer: &Explorer, ui: &mut Ui) {
        let Some(variable) = self.variable(explorer) else { return };
        let combo =
            ComboBox::from_id_salt("variable of the residual").selected_text(variable.name).width(180.0);
        let chosen = combo.show_ui(ui, |ui| {
            for other in &explorer.variables {
                let selected = other.name == variable.name;
                if ui.selectable_label(selected, other.name).clicked() {
                    other.name.clone_into(&mut self.choice.variable);
                }
            }
        });
        chosen.response.on_hover_text("Variable to plot the residual over").accessible_name("residual over");
        if goes_round(variable) {
            let help = "Angle within one turn, to show periodic residuals";
            ui.checkbox(&mut self.choice.folded, "one turn").on_hover_text(help);
        }
        if explorer.held_out.iter().any(|held| *held) {
            let help = "Held-out rows only";
            ui.checkbox(&mut self.choice.held_out, "held-out rows").on_hover_text(help);
        }
        ui.scope(|ui| {
            let error = "Mean ± 2 standard errors, assuming independent rows";
            let quartiles = "Interquartile range of the rows";
            let choices = [(Band::Error, "± 2 s.e.", error), (Band::Quartiles, "quartiles", quartiles)];
            choice_ui(ui, &mut self.choice.band, &choices);
        });
    }

    fn prepare(&mut self, explorer: &Explorer, variable: &Variable, generation: u64) {
        let choice = Choice { variable: variable.name.to_owned(), ..self.choice.clone() };
        let key = Some((generation, choice.clone()));
        if self.drawn.key == key {
            return;
        }
        let folded = choice.folded && goes_round(variable);
        let only_held_out = choice.held_out && explorer.held_out.iter().any(|held| *held);
        let used = |row: usize| !only_held_out || explorer.held_out.get(row).copied().unwrap_or(false);
        let rows: Vec<usize> = (0..variable.values.len()).filter(|row| used(*row)).collect();
        let value = |row: &usize| {
            let value = variable.values[*row];
            if folded { value.rem_euclid(TAU) } else { value }
        };
        let x: Vec<f64> = rows.iter().map(value).collect();
        let of = |residual: &[f64]| -> Vec<f64> {
            rows.iter().map(|row| residual.get(*row).copied().unwrap_or(f64::NAN)).collect()
        };
        let residuals = [of(&explorer.before), of(&explorer.after)];
        let step = x.len().div_ceil(MOST_POINTS).max(1);
        self.drawn.points = residuals.each_ref().map(|y| {
            let points = x.iter().zip(y).step_by(step);
            let points = points.filter(|(x, y)| x.is_finite() && y.is_finite());
            points.map(|(x, y)| PlotPoint::new(*x, *y)).collect()
        });
        self.drawn.bins = residuals.each_ref().map(|y| binned(&x, y, MOST_BINS, choice.band));
        self.drawn.key = key;
    }

    pub(super) fn ui(&mut self, explorer: &Explorer, generation: u64, size: Vec2, ui: &mut Ui) {
        let Some(variable) = self.variable(explorer) else { return };
        self.prepare(explorer, variable, generation);
        let colors = palette(ui.visuals()).runs;
        let (x_label, y_label) =
            (format!("{} [{}]", variable.name, variable.unit), format!("residual [{}]", explorer.unit));
        let plot = chart("residual over a variable", ui, size, (&x_label, &y_label));
        let Drawn { points, bins, .. } = &self.drawn;
        plot.show(ui, |plot| {
            for (points, color) in points.iter().zip(colors) {
                let dots = Points::new("rows", PlotPoints::Borrowed(points)).id(("rows", color));
                plot.points(
                    dots.color(color.gamma_multiply(0.35))
                        .radius(1.2)
                        .shape(MarkerShape::Circle)
                        .allow_hover(false),
                );
            }
            for (number, (bins, color)) in bins.iter().zip(colors).enumerate() {
                let column = |of: fn(&Bin) -> f64| bins.iter().map(of).collect::<Vec<f64>>();
                let (x, low, high) = (column(|b| b.x), column(|b| b.low), column(|b| b.high));
                let band = FilledArea::new("band", &x, &low, &high).id(("band", number));
                plot.add(band.fill_color(color.gamma_multiply(0.28)).allow_hover(false));
                let mean: PlotPoints<'_> = bins.iter().map(|bin| [bin.x, bin.mean]).collect();
                let mean = Line::new("mean", mean).id(("mean", number)).color(color).width(1.8);
                plot.line(mean.allow_band(false).allow_hover(false));
            }
        });
    }

    /// Spread of the means, as text next to the plot.
    pub(super) fn summary_ui(&self, explorer: &Explorer, ui: &mut Ui) {
        let reach = |bins: &[Bin]| {
            let (low, high) = bins.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), bin| {
                (low.min(bin.mean), high.max(bin.mean))
            });
            shown(high - low, 3)
        };
        let [before, after] = self.drawn.bins.each_ref().map(|bins| reach(bins));
        let unit = explorer.unit;
        hint_ui(ui, format!("peak-to-peak of the means: {before} {unit} before, {after} {unit} after"));
    }
}

/// Amplitudes of the orders of the motor's angle.
pub(super) fn orders_ui(explorer: &Explorer, size: Vec2, ui: &mut Ui) {
    let colors = palette(ui.visuals()).runs;
    let y_label = format!("amplitude [{}]", explorer.unit);
    let plot = chart("orders of the residual", ui, size, ("order of the motor's angle", &y_label));
    plot.show(ui, |plot| {
        for (column, color) in [1, 2].into_iter().zip(colors) {
            // A line down to 0 at each order.
            let mut stems = Vec::new();
            for order in explorer.orders.iter().filter(|order| order.iter().all(|value| value.is_finite())) {
                let at = order[0] + 0.3 * (column as f64 - 1.5);
                stems.extend([[at, 0.0], [at, order[column]], [at, 0.0]]);
            }
            let stems = Line::new("orders", PlotPoints::from(stems)).id(("orders", column));
            plot.line(stems.color(color).width(1.4).allow_band(false).allow_hover(false));
        }
    });
}

/// The strongest order of each, as text.
pub(super) fn orders_summary(explorer: &Explorer) -> String {
    let strongest = |column: usize| {
        let best = explorer.orders.iter().max_by(|a, b| a[column].total_cmp(&b[column]));
        best.map_or_else(String::new, |order| {
            format!("order {:.0} with {} {}", order[0], shown(order[column], 3), explorer.unit)
        })
    };
    format!("strongest: {} before, {} after", strongest(1), strongest(2))
}

fn chart<'a>(id: &'a str, ui: &Ui, size: Vec2, (x_label, y_label): (&'a str, &'a str)) -> Plot<'a> {
    let size = size.max(vec2(1.0, 1.0));
    let plot = Plot::new(id).width(size.x).height(size.y).allow_scroll(false).label_formatter(|_| None);
    let x_lines = 0.012 * f64::from(size.x);
    Axes { x_label: Some(x_label), y_label, height: size.y, x_lines, y_lines: 5.0 }.on(plot, ui.visuals())
}
