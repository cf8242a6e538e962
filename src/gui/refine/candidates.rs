//! Every candidate effect with its outcome, the best first.

use egui::{Grid, RichText, Sense, Ui, vec2};
use flqr_core::refine::{Outcome, Refinement, ScoredCandidate, Verdict};

use super::effects::place_text;
use super::strip::{StepState, Tone};
use crate::theme::palette;
use crate::widgets::{hint_ui, mono, section_ui, shown};

/// Width of the bar of a whole gain.
const BAR: f32 = 90.0;

/// State of this step.
pub(super) fn state(found: Option<&Refinement>) -> StepState {
    let Some(found) = found else { return StepState::new("no candidates", Tone::Open) };
    let listed = listed(found);
    let added = listed.iter().filter(|tried| tried.outcome == Outcome::Added).count();
    match listed.len() {
        0 => StepState::new("no list", Tone::Open),
        count => StepState::new(format!("{count} candidates, {added} added"), Tone::Plain),
    }
}

/// Candidates, each once: of trials that read alike, the best.
fn listed(found: &Refinement) -> Vec<&ScoredCandidate> {
    let mut listed: Vec<&ScoredCandidate> = Vec::new();
    for tried in &found.candidates {
        if !listed.iter().any(|other| (other.kind.id, &other.detail) == (tried.kind.id, &tried.detail)) {
            listed.push(tried);
        }
    }
    listed
}

pub(super) fn ui(found: &Refinement, ui: &mut Ui) {
    section_ui(ui, "Candidates", |_| {});
    if found.candidates.is_empty() {
        hint_ui(
            ui,
            match found.verdict {
                Verdict::DataUnfit => {
                    "No candidates: the logs are not suitable for identification, see Health."
                }
                _ => "No list of candidates for this search.",
            },
        );
        return;
    }
    hint_ui(
        ui,
        "Gain: error reduction on left-out blocks with this effect alone. z: estimate divided by its standard error. Hover over an effect for its description.",
    );
    ui.add_space(4.0);
    let grid = Grid::new("candidates").num_columns(6).striped(true).spacing([16.0, 3.0]);
    grid.show(ui, |ui| {
        for title in ["", "effect", "detail", "gain on left-out blocks", "z", "outcome"] {
            hint_ui(ui, title);
        }
        ui.end_row();
        for (index, tried) in listed(found).into_iter().enumerate() {
            row_ui(index, tried, ui);
        }
    });
}

fn row_ui(index: usize, tried: &ScoredCandidate, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    let added = tried.outcome == Outcome::Added;
    ui.label(mono(format!("{}", index + 1)).weak());
    let name = RichText::new(tried.kind.id);
    let name = if added { name.strong().color(colors.accent) } else { name };
    let kind = tried.kind;
    ui.add(egui::Label::new(name).extend().sense(Sense::hover())).on_hover_text(format!(
        "{}.\nActs: {}.\nBest shown by: {}.",
        kind.summary,
        place_text(kind.place),
        kind.separated_by
    ));
    ui.add(egui::Label::new(RichText::new(tried.detail.replace('-', "−")).small()).extend());
    ui.horizontal(|ui| {
        let share = (tried.gain_percent / 100.0).clamp(0.0, 1.0) as f32;
        let (rect, _) = ui.allocate_exact_size(vec2(BAR, 10.0), Sense::hover());
        let share = if share.is_finite() { share } else { 0.0 };
        let bar = egui::Rect::from_min_size(rect.min, vec2(share * rect.width(), rect.height()));
        ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        ui.painter().rect_filled(bar, 2.0, if added { colors.accent } else { colors.reference });
        ui.label(mono(format!("{} %", shown(tried.gain_percent, 3))));
    });
    // A shape without a standard error, as a limit is, has none.
    ui.label(mono(shown(if tried.z.is_finite() { tried.z } else { f64::NAN }, 3)));
    let color = match tried.outcome {
        Outcome::Added => colors.good,
        Outcome::Ambiguous(_) => colors.warning,
        Outcome::Explained | Outcome::TooSmall | Outcome::NotSignificant | Outcome::NotTestable => {
            ui.visuals().text_color()
        }
    };
    ui.add(egui::Label::new(RichText::new(tried.outcome.to_string()).color(color)).extend());
    ui.end_row();
}
