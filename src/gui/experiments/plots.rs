//! Both runs in the same plots over one time axis, with the time that is shown and the range of the statistics.

use egui::Ui;

use super::run::Recorded;
use super::runs::Comparison;
use super::signals::Signal;
use crate::command::Commands;
use crate::plot::{Data, Marks, Moved, Panel, PanelCurve, Stack};
use crate::theme::palette;

/// Longer steps in time are drawn as gaps, s.
const GAP_S: f64 = 0.05;
/// Beyond this pitch a robot counts as fallen, rad.
const FALLEN_RAD: f64 = 0.8;

/// State of the plots.
pub(super) struct Plots {
    pub(super) stack: Stack,
}

impl Default for Plots {
    fn default() -> Self {
        Self { stack: Stack::new("runs", 60.0) }
    }
}

impl Plots {
    /// The tools, for a row above the plots.
    pub(super) fn tools_ui(&mut self, ui: &mut Ui, comparison: &Comparison) {
        self.stack.tools_ui(ui, &panels(ui, comparison));
    }

    pub(super) fn ui(
        &mut self,
        ui: &mut Ui,
        comparison: &Comparison,
        commands: &Commands,
        marks: &mut Marks,
    ) -> Moved {
        self.stack.update(marks.limits);
        self.stack.sources = comparison.provenances();
        let panels = panels(ui, comparison);
        self.stack.show_marked(ui, &panels, Some(marks)).send(commands)
    }
}

fn panels<'a>(ui: &Ui, comparison: &'a Comparison) -> Vec<Panel<'a>> {
    let robot = comparison.model.robot();
    let panel = |(column, signal): (usize, &Signal)| {
        let limits = match signal.key {
            "pitch_rad" => vec![("fallen", FALLEN_RAD)],
            key if key.starts_with("torque") => {
                let limit = robot.and_then(|robot| robot.limits.torque_nm);
                limit.map(|limit| ("torque limit", limit)).into_iter().collect()
            }
            _ => Vec::new(),
        };
        Panel {
            name: signal.quantity.name.into(),
            unit: signal.unit,
            min_span: signal.quantity.min_span,
            shown: true,
            curves: curves(ui, comparison, column, signal),
            limits,
        }
    };
    comparison.signals(false).iter().enumerate().map(panel).collect()
}

fn curves<'a>(ui: &Ui, comparison: &'a Comparison, column: usize, signal: &Signal) -> Vec<PanelCurve<'a>> {
    let colors = palette(ui.visuals());
    let curve = |name: &'static str, key: String, color, run: &'a Recorded, values: &'a [f64]| PanelCurve {
        name: name.into(),
        key: key.into(),
        color,
        data: Data::Fixed(&run.time_s, values),
        generation: comparison.generation,
        gap: GAP_S,
    };
    let scenario = comparison.settings.scenario;
    let mut curves = Vec::new();
    if signal.has_target
        && let Some((_, run)) = comparison.recorded().next()
        && let Some(values) = &run.target_rad_s
    {
        curves.push(curve("target", format!("target_{}", signal.key), colors.reference, run, values));
    }
    for (variant, run) in comparison.recorded() {
        let key = format!("{}_{}", variant.name(scenario), signal.key);
        let color = colors.runs[variant as usize];
        curves.push(curve(variant.title(scenario), key, color, run, &run.columns[column]));
    }
    curves
}
