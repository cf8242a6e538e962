//! Checks before a run: whether it can be made, and the margins of the sampled loop.

use egui::Ui;
use flqr_core::lqr::Margins;
use flqr_core::model::Model;

use super::run::{Settings, Variant, check};
use crate::context::ViewContext;
use crate::widgets::{error_ui, hint_ui, shown, warning_ui};

/// The last answer and what it is about.
#[derive(Default)]
pub(super) struct Preflight {
    about: Option<(Settings, Model)>,
    /// Sentences of both runs; the same one once.
    refusals: Vec<String>,
    warnings: Vec<String>,
}

impl Preflight {
    pub(super) fn ui(&mut self, context: &ViewContext<'_>, settings: &Settings, ui: &mut Ui) {
        let model = context.session.model_in_use();
        if self.about.as_ref().is_none_or(|about| (&about.0, &about.1) != (settings, &model)) {
            self.update(settings, &model);
            self.about = Some((settings.clone(), model));
        }
        for refusal in &self.refusals {
            error_ui(ui, refusal);
        }
        for warning in &self.warnings {
            warning_ui(ui, format!("Before the run: {warning}."));
        }
        let designed = context.designer.in_force.filter(|_| settings.scenario.on_ground());
        if let Some(margins) = designed.map(|designed| designed.margins).filter(|margins| margins.stable) {
            hint_ui(ui, text(&margins)).on_hover_text(
                "Sampled loop at 1 kHz with the model's delay and IMU, both motors together; without friction, limits and noise.",
            );
        }
    }

    /// Returns whether a sentence is among those that are shown.
    pub(super) fn says(&self, sentence: &str) -> bool {
        self.refusals.iter().chain(&self.warnings).any(|shown| shown == sentence)
    }

    fn update(&mut self, settings: &Settings, model: &Model) {
        (self.refusals, self.warnings) = (Vec::new(), Vec::new());
        for variant in Variant::ALL {
            let title = variant.title(settings.scenario);
            match check(settings, variant, model) {
                Ok(warnings) => self.warnings.extend(warnings),
                Err(problem) => self.refusals.push(format!("{title}: {problem}.")),
            }
        }
        self.warnings.dedup();
    }
}

fn text(margins: &Margins) -> String {
    let delay = if margins.delay_s.is_finite() {
        format!("{} ms additional delay", shown(1e3 * margins.delay_s, 3))
    } else {
        "any delay".to_owned()
    };
    let up = if margins.gain_up.is_finite() { shown(margins.gain_up, 3) } else { "∞".to_owned() };
    format!(
        "Margins: gains × {} to {up}, {}° of phase, {delay}.",
        shown(margins.gain_down, 2),
        shown(margins.phase_rad.to_degrees(), 3)
    )
}
