//! Measured against both models, and their residuals below, over one time axis.

use egui::{Ui, vec2};
use flqr_core::refine::Explorer;

use crate::command::Commands;
use crate::plot::{Data, Marks, Panel, PanelCurve, Stack, Unit, one_after_another};
use crate::theme::palette;

/// Name of the plots of the page.
pub(crate) const RESIDUAL_STACK: &str = "residual";

/// Curves in time; logs stand one after another.
pub(super) struct InTime {
    time_s: Vec<f64>,
    /// A longer step is a gap.
    gap_s: f64,
    /// Measured, and as the models have it: before, after.
    effort: [Vec<f64>; 3],
    /// Before, after.
    residual: [Vec<f64>; 2],
    stack: Stack,
    marks: Marks,
    generation: u64,
}

impl InTime {
    pub(super) fn new(explorer: &Explorer, generation: u64) -> Self {
        let time = explorer.variable("time_s").map_or(&[][..], |time| &time.values);
        let (time_s, gap_s, several) = one_after_another(time);
        let model = |residual: &[f64]| {
            explorer.measured.iter().zip(residual).map(|(measured, left)| measured - left).collect()
        };
        let limits = [time_s.first().copied().unwrap_or(0.0), time_s.last().copied().unwrap_or(1.0)];
        let mut stack = Stack::new(RESIDUAL_STACK, 1.0);
        stack.show_all(limits);
        if several {
            stack.x[0] = "time, log after log [s]";
        }
        Self {
            gap_s,
            effort: [explorer.measured.clone(), model(&explorer.before), model(&explorer.after)],
            residual: [explorer.before.clone(), explorer.after.clone()],
            stack,
            marks: Marks::new(limits),
            generation,
            time_s,
        }
    }

    pub(super) fn show_all(&mut self) {
        self.stack.show_all(self.marks.limits);
    }

    /// The tools, and the plots over `height`; `sources` say where the curves come from.
    pub(super) fn ui(
        &mut self,
        explorer: &Explorer,
        sources: Vec<String>,
        height: f32,
        commands: &Commands,
        ui: &mut Ui,
    ) {
        let Self { time_s, gap_s, effort, residual, stack, marks, generation } = self;
        let colors = palette(ui.visuals());
        let curve = |name: &'static str, key: &str, color, values| PanelCurve {
            name: name.into(),
            key: format!("{key}_{name}").into(),
            color,
            data: Data::Fixed(time_s, values),
            generation: *generation,
            gap: *gap_s,
        };
        let panel = |name: &'static str, curves| Panel {
            name: name.into(),
            unit: Unit::Plain(explorer.unit),
            min_span: 1e-6,
            shown: true,
            curves,
            limits: Vec::new(),
        };
        let [before, after] = colors.runs;
        let channel = explorer.channel;
        let panels = [
            panel(
                channel,
                vec![
                    curve("log", channel, colors.measured, &effort[0]),
                    curve("before", channel, before, &effort[1]),
                    curve("after", channel, after, &effort[2]),
                ],
            ),
            panel(
                "residual",
                vec![
                    curve("before", "residual", before, &residual[0]),
                    curve("after", "residual", after, &residual[1]),
                ],
            ),
        ];
        stack.sources = sources;
        stack.update(marks.limits);
        ui.horizontal_wrapped(|ui| stack.tools_ui(ui, &panels));
        let size = vec2(ui.available_width(), height);
        ui.allocate_ui(size, |ui| {
            ui.set_min_height(size.y);
            stack.show_marked(ui, &panels, Some(marks)).send(commands);
        });
    }
}
