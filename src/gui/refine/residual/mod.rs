//! Difference between measurement and model, and the variables it depends on.

mod in_time;
mod over;

use egui::{ScrollArea, Ui, vec2};
use flqr_core::refine::{Explorer, Refinement, Residual};

use super::compare;
use super::run::Answered;
use super::strip::{StepState, Tone};
use crate::command::Commands;
use crate::theme::palette;
use crate::widgets::{hint_ui, legend_ui, section_ui, shown};
use in_time::InTime;
pub(crate) use in_time::RESIDUAL_STACK;
use over::{Over, orders_summary, orders_ui};

/// The pictures need this much; a lower page scrolls.
const LEAST_HEIGHT: f32 = 460.0;

/// State of this step.
#[derive(Default)]
pub(super) struct ResidualStep {
    /// Curves of an answer, with the answer's number.
    in_time: Option<(u64, InTime)>,
    over: Over,
}

/// Returns whether there are plots of what was found.
pub(super) fn has_plots(refined: Option<&Answered<Box<Refinement>>>) -> bool {
    refined.is_some_and(|found| !found.answer.explorer.before.is_empty())
}

/// State of this step.
pub(super) fn state(
    refined: Option<&Answered<Box<Refinement>>>,
    residual: Option<&Answered<Box<Residual>>>,
) -> StepState {
    let newer =
        residual.filter(|residual| refined.is_none_or(|found| found.generation < residual.generation));
    let errors = match (newer, refined) {
        (Some(residual), _) => &residual.answer.errors,
        (None, Some(found)) => &found.answer.before,
        (None, None) => return StepState::new("not computed", Tone::Open),
    };
    let (Some((_, rmse)), floor) = (errors.rmse.0.first(), errors.noise_floor.main()) else {
        return StepState::new("none", Tone::Open);
    };
    let text = format!("{} {}, noise {}", shown(rmse.value, 3), rmse.unit, shown(floor, 3));
    StepState::new(text, Tone::Plain)
}

impl ResidualStep {
    /// Shows the residual over a variable.
    pub(super) fn choose(&mut self, variable: &str) {
        self.over.choose(variable);
    }

    pub(super) fn ui(
        &mut self,
        refined: Option<&Answered<Box<Refinement>>>,
        residual: Option<&Answered<Box<Residual>>>,
        sources: &[String],
        commands: &Commands,
        ui: &mut Ui,
    ) {
        let room = ui.available_height();
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if let Some(found) = refined.filter(|found| !found.answer.explorer.before.is_empty()) {
                let explorer = (&found.answer.explorer, found.generation);
                self.pictures_ui(explorer, sources, room.max(LEAST_HEIGHT), commands, ui);
            }
            if let Some(residual) = residual {
                section_ui(ui, "Residual", |_| {});
                compare::residual_ui(&residual.answer, ui);
                if refined.is_none() {
                    hint_ui(ui, "Use “Find missing effects” to get the plots of the residual.");
                }
            }
        });
    }

    fn pictures_ui(
        &mut self,
        (explorer, generation): (&Explorer, u64),
        sources: &[String],
        room: f32,
        commands: &Commands,
        ui: &mut Ui,
    ) {
        if self.in_time.as_ref().is_none_or(|(number, _)| *number != generation) {
            self.in_time = Some((generation, InTime::new(explorer, generation)));
        }
        self.over.suggest(explorer, generation);
        let Some((_, in_time)) = &mut self.in_time else { return };
        let start = ui.cursor().top();
        section_ui(ui, "Measured minus model", |ui| {
            if ui.button("Whole log").on_hover_text("Show all rows (double click)").clicked() {
                in_time.show_all();
            }
            let colors = palette(ui.visuals());
            // Drawn from the right, so the last comes first.
            for (name, color) in
                [("after", colors.runs[1]), ("before", colors.runs[0]), ("log", colors.measured)]
            {
                legend_ui(ui, name, color);
            }
        });
        in_time.ui(explorer, sources.to_vec(), 0.5 * room, commands, ui);
        section_ui(ui, "Residual over", |ui| {
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                self.over.controls_ui(explorer, ui);
            });
        });
        let used = ui.cursor().top() - start;
        let summary = 22.0;
        let height = (room - used - summary).max(140.0);
        let width = ui.available_width() - ui.spacing().item_spacing.x;
        let both = !explorer.orders.is_empty();
        ui.horizontal_top(|ui| {
            ui.vertical(|ui| {
                let width = if both { 0.56 * width } else { width };
                ui.set_width(width);
                self.over.ui(explorer, generation, vec2(width, height), ui);
                self.over.summary_ui(explorer, ui);
            });
            if both {
                ui.vertical(|ui| {
                    orders_ui(explorer, vec2(0.44 * width, height), ui);
                    hint_ui(ui, orders_summary(explorer));
                });
            }
        });
    }
}
