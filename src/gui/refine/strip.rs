//! Position in the loop: health ▸ residual ▸ candidates ▸ add ▸ before and after.

use egui::{
    Color32, Rect, RichText, Role, Sense, StrokeKind, TextStyle, TextWrapMode, Ui, Vec2, WidgetInfo,
    WidgetText, pos2, vec2,
};

use crate::theme::palette;

/// A step of the loop, and the part of the page that shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Step {
    /// True if the logs can answer.
    #[default]
    Health,
    /// Residual from them.
    Residual,
    /// Candidates.
    Candidates,
    /// Identified effects and their use in the model.
    Add,
    /// The errors of both models.
    Compare,
}

impl Step {
    /// In the order of the loop.
    pub(super) const ALL: [Self; 5] =
        [Self::Health, Self::Residual, Self::Candidates, Self::Add, Self::Compare];

    fn title(self) -> &'static str {
        match self {
            Self::Health => "Health",
            Self::Residual => "Residual",
            Self::Candidates => "Candidates",
            Self::Add => "Add",
            Self::Compare => "Before and after",
        }
    }

    /// Name for scripts.
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Health => "health",
            Self::Residual => "residual",
            Self::Candidates => "candidates",
            Self::Add => "add",
            Self::Compare => "compare",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Health => "Quality of the logs and their problems",
            Self::Residual => "Difference between measurement and model, and the variables it depends on",
            Self::Candidates => "All candidate effects and their outcomes",
            Self::Add => "Identified effects and their use in the model",
            Self::Compare => "Errors on held-out rows",
        }
    }
}

/// State of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    /// Nothing there yet.
    Open,
    Busy,
    Good,
    Plain,
    Warning,
    Error,
}

/// Short state of a step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StepState {
    pub(super) text: String,
    pub(super) tone: Tone,
}

impl StepState {
    pub(super) fn new(text: impl Into<String>, tone: Tone) -> Self {
        Self { text: text.into(), tone }
    }

    fn color(&self, ui: &Ui) -> Color32 {
        let colors = palette(ui.visuals());
        match self.tone {
            Tone::Open => ui.visuals().weak_text_color(),
            Tone::Plain => ui.visuals().text_color(),
            Tone::Busy => colors.accent,
            Tone::Good => colors.good,
            Tone::Warning => colors.warning,
            Tone::Error => colors.error,
        }
    }
}

/// Width of the arrow between two steps.
const ARROW: f32 = 14.0;
const HEIGHT: f32 = 40.0;

/// Draws the steps; a click shows one.
pub(super) fn ui(shown: &mut Step, states: &[StepState; 5], ui: &mut Ui) {
    ui.spacing_mut().item_spacing.x = 2.0;
    let count = Step::ALL.len() as f32;
    let gaps = (count - 1.0) * (ARROW + 2.0 * ui.spacing().item_spacing.x);
    let width = ((ui.available_width() - gaps) / count).max(1.0);
    ui.horizontal(|ui| {
        for (step, state) in Step::ALL.into_iter().zip(states) {
            if step != Step::ALL[0] {
                let arrow = egui::Label::new(RichText::new("▸").weak());
                ui.add_sized(vec2(ARROW, HEIGHT), arrow.selectable(false));
            }
            step_ui(shown, step, state, ui, vec2(width, HEIGHT));
        }
    });
}

fn step_ui(shown: &mut Step, step: Step, state: &StepState, ui: &mut Ui, size: Vec2) {
    let (rect, step_button) = ui.allocate_exact_size(size, Sense::click());
    let selected = *shown == step;
    let name = format!("step {}: {}", step.key(), state.text);
    step_button.widget_info(|| WidgetInfo::selected(Role::Button, true, selected, &name));
    if ui.is_rect_visible(rect) {
        let visuals = ui.style().interact_selectable(&step_button, selected);
        if selected || step_button.hovered() || step_button.has_focus() {
            ui.painter().rect(rect, 4.0, visuals.weak_bg_fill, visuals.bg_stroke, StrokeKind::Inside);
        }
        let title = RichText::new(format!("{}  {}", step as usize + 1, step.title())).strong();
        let color = if selected { visuals.text_color() } else { state.color(ui) };
        line_ui(title.color(visuals.text_color()), rect, 0.3, ui);
        line_ui(RichText::new(&state.text).small().color(color), rect, 0.72, ui);
    }
    if step_button.on_hover_text(format!("{}\n{}", step.help(), state.text)).clicked() {
        *shown = step;
    }
}

/// One line of a step, centred, at a fraction of its height, cut short where it is too long.
fn line_ui(text: RichText, rect: Rect, height: f32, ui: &Ui) {
    let width = (rect.width() - 8.0).max(1.0);
    let text: WidgetText = text.into();
    let galley = text.into_galley(ui, Some(TextWrapMode::Truncate), width, TextStyle::Body);
    let middle = pos2(rect.center().x, rect.top() + height * rect.height());
    let corner = middle - 0.5 * galley.size();
    ui.painter().galley(corner, galley, ui.visuals().text_color());
}
