//! Rating of a number: a mark, a colour and a word, so that no meaning hangs on the colour alone.

use egui::{Color32, Rect, Sense, Shape, Stroke, Ui, WidgetInfo, accesskit::Role, vec2};

use crate::theme::palette;

/// From good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Verdict {
    Good,
    Tight,
    Bad,
}

impl Verdict {
    /// `Good` from `good` on, `Bad` below `bad`, where more is better.
    pub(super) fn of(value: f64, good: f64, bad: f64) -> Self {
        if value >= good {
            Self::Good
        } else if value >= bad {
            Self::Tight
        } else {
            Self::Bad
        }
    }

    /// Word for people and scripts.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Tight => "tight",
            Self::Bad => "bad",
        }
    }

    pub(super) fn color(self, ui: &Ui) -> Color32 {
        let colors = palette(ui.visuals());
        match self {
            Self::Good => colors.good,
            Self::Tight => colors.warning,
            Self::Bad => colors.error,
        }
    }

    /// The mark: a disc, a triangle or a square in its colour; its name says of what it is.
    pub(super) fn mark_ui(self, ui: &mut Ui, of: &str) {
        let (rect, response) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
        let (color, center) = (self.color(ui), rect.center());
        match self {
            Self::Good => ui.painter().circle_filled(center, 4.5, color),
            Self::Tight => {
                let corners =
                    [vec2(0.0, -5.5), vec2(5.5, 4.5), vec2(-5.5, 4.5)].map(|corner| center + corner);
                ui.painter().add(Shape::convex_polygon(corners.to_vec(), color, Stroke::NONE))
            }
            Self::Bad => ui.painter().rect_filled(Rect::from_center_size(center, vec2(9.0, 9.0)), 1.0, color),
        };
        let name = format!("{of}: {}", self.word());
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &name));
        response.on_hover_text(self.word());
    }
}
