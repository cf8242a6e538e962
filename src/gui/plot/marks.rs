//! A time cursor and a chosen range over a stack of plots, moved by dragging.

use egui::{Color32, CursorIcon, Response, Stroke, Ui};
use egui_plot::{PlotTransform, PlotUi, Span, VLine};

/// Hit distance of a mark, points.
pub(super) const REACH: f32 = 6.0;

/// Dragged object.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hold {
    Cursor,
    /// One end of the range; the other one stays where it is.
    End {
        other: f64,
    },
}

/// Cursor and range that all plots of a stack show.
#[derive(Clone, Copy, Debug)]
pub struct Marks {
    /// Position of the cursor.
    pub cursor: f64,
    /// The chosen range.
    pub range: [f64; 2],
    /// True if the range is shaded.
    pub shade: bool,
    /// Options.
    pub limits: [f64; 2],
    hold: Option<Hold>,
}

/// User actions on the marks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// The cursor was moved.
    pub cursor: bool,
    /// The range was changed.
    pub range: bool,
}

impl Marks {
    /// Marks at the start of `limits`.
    pub fn new(limits: [f64; 2]) -> Self {
        Self { cursor: limits[0], range: limits, shade: false, limits, hold: None }
    }

    /// Returns whether a drag moves a mark, and not the plot.
    pub(super) fn held(&self) -> bool {
        self.hold.is_some()
    }

    pub(super) fn draw(&self, plot: &mut PlotUi<'_>, color: Color32) {
        if self.shade {
            let [low, high] = self.range;
            let shade = Span::new("", low..=high).fill(color.gamma_multiply(0.08));
            plot.span(shade.border(Stroke::new(1.0, color.gamma_multiply(0.35))));
        }
        plot.vline(VLine::new("cursor", self.cursor).color(color).width(1.2).allow_hover(false));
    }

    /// A press near a mark moves it, a drag with Shift chooses a new range, a click brings the cursor.
    pub(super) fn interact(&mut self, ui: &Ui, response: &Response, transform: &PlotTransform) -> Moved {
        let value = |x: f32| {
            let value = transform.value_from_position(egui::pos2(x, 0.0)).x;
            value.clamp(self.limits[0], self.limits[1])
        };
        let pointer = response.interact_pointer_pos().map(|at| (at.x, value(at.x)));
        if response.drag_started_by(egui::PointerButton::Primary) {
            let pressed = ui.input(|input| input.pointer.press_origin()).map(|at| at.x);
            let shift = ui.input(|input| input.modifiers.shift);
            self.hold = match pressed {
                Some(x) if shift => Some(Hold::End { other: value(x) }),
                Some(x) => self.near(x, transform),
                None => None,
            };
        }
        let mut moved = Moved::default();
        if let (Some(hold), Some((_, at)), true) = (self.hold, pointer, response.dragged()) {
            moved = self.take(hold, at);
        }
        if response.drag_stopped() {
            self.hold = None;
        }
        if let (Some((_, at)), true) = (pointer, response.clicked()) {
            self.cursor = at;
            moved.cursor = true;
        }
        let hovered = response.hover_pos().and_then(|at| self.near(at.x, transform)).is_some();
        if hovered || self.held() {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        moved
    }

    fn take(&mut self, hold: Hold, at: f64) -> Moved {
        match hold {
            Hold::Cursor => {
                self.cursor = at;
                Moved { cursor: true, range: false }
            }
            Hold::End { other } => {
                self.range = [at.min(other), at.max(other)];
                Moved { cursor: false, range: true }
            }
        }
    }

    fn near(&self, x: f32, transform: &PlotTransform) -> Option<Hold> {
        let place = |value: f64| transform.position_from_point_x(value);
        let near = |value: f64| (place(value) - x).abs() <= REACH;
        let [low, high] = self.range;
        match () {
            () if near(self.cursor) => Some(Hold::Cursor),
            () if !self.shade => None,
            () if near(low) => Some(Hold::End { other: high }),
            () if near(high) => Some(Hold::End { other: low }),
            () => None,
        }
    }
}
