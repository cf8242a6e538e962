//! Two time cursors, A and B, on all plots of a stack at once: dragged, or moved sample by sample with the keyboard.

use egui::{Align2, Color32, CursorIcon, Key, Modifiers, PointerButton, Response, RichText, Ui};
use egui_plot::{LineStyle, PlotPoint, PlotTransform, PlotUi, Text, VLine};

use super::decimate::Indexed;
use super::marks::REACH;

/// Names of the cursors.
pub(super) const NAMES: [&str; 2] = ["A", "B"];
/// Samples that a key moves a cursor by: plain, and with Shift.
const STEPS: [(Modifiers, usize); 2] = [(Modifiers::SHIFT, 10), (Modifiers::NONE, 1)];

/// Positions of the cursors, and the one moved by the keyboard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cursors {
    pub(super) at: [f64; 2],
    pub(super) active: usize,
    hold: Option<usize>,
}

impl Cursors {
    /// At a third and two thirds of a range.
    pub(super) fn within(range: [f64; 2]) -> Self {
        let at = [1.0, 2.0].map(|part| range[0] + (range[1] - range[0]) * part / 3.0);
        Self { at, active: 0, hold: None }
    }

    /// The earlier and the later one.
    pub(super) fn range(&self) -> [f64; 2] {
        [self.at[0].min(self.at[1]), self.at[0].max(self.at[1])]
    }

    pub(super) fn draw(&self, plot: &mut PlotUi<'_>, color: Color32) {
        let bounds = plot.plot_bounds();
        let top = bounds.max()[1];
        for (number, at) in self.at.into_iter().enumerate() {
            let style = if number == 0 { LineStyle::Solid } else { LineStyle::dashed_loose() };
            let width = if number == self.active { 1.8 } else { 1.1 };
            let line = VLine::new(NAMES[number], at).id(("cursor", number)).color(color).width(width);
            plot.vline(line.style(style).allow_hover(false));
            let name = RichText::new(format!(" {} ", NAMES[number])).size(11.5).strong();
            let text = Text::new(NAMES[number], PlotPoint::new(at, top), name).id(("cursor name", number));
            plot.text(text.anchor(Align2::LEFT_TOP).color(color).allow_hover(false));
        }
    }

    /// Starts to drag the cursor near a press. Returns whether a drag moves a cursor rather than the plot.
    pub(super) fn interact(&mut self, ui: &Ui, response: &Response, transform: &PlotTransform) -> bool {
        if response.drag_started_by(PointerButton::Primary) {
            let pressed = ui.input(|input| input.pointer.press_origin());
            self.hold = pressed.and_then(|at| self.near(at.x, transform));
            self.active = self.hold.unwrap_or(self.active);
        }
        if let (Some(number), Some(pointer), true) =
            (self.hold, response.interact_pointer_pos(), response.dragged())
        {
            self.at[number] = transform.value_from_position(pointer).x;
        }
        let held = self.hold.is_some() && (response.dragged() || response.drag_stopped());
        if response.drag_stopped() {
            self.hold = None;
        }
        if held || response.hover_pos().is_some_and(|at| self.near(at.x, transform).is_some()) {
            ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
        }
        held
    }

    /// The cursor at a place; of two the active one.
    fn near(&self, x: f32, transform: &PlotTransform) -> Option<usize> {
        let distance = |number: usize| (transform.position_from_point_x(self.at[number]) - x).abs();
        let order = [self.active, 1 - self.active];
        let nearest = if distance(order[1]) < distance(order[0]) { order[1] } else { order[0] };
        (distance(nearest) <= REACH).then_some(nearest)
    }

    /// Puts both on samples of `curve`, and the active one as many further as keys were pressed.
    pub(super) fn follow_samples(&mut self, curve: &Indexed<'_>, steps: i64) {
        for (number, at) in self.at.iter_mut().enumerate() {
            let Some(nearest) = curve.nearest(*at) else { return };
            let steps = if number == self.active { steps } else { 0 };
            let index = (nearest as i64 + steps).clamp(0, curve.len() as i64 - 1);
            *at = curve.x(index as usize);
        }
    }
}

/// Samples to move by, from the keys that were pressed.
pub(super) fn steps(ui: &Ui) -> i64 {
    let mut steps = 0;
    for (modifiers, length) in STEPS {
        for (key, sign) in [(Key::ArrowLeft, -1), (Key::ArrowRight, 1)] {
            let presses = ui.input_mut(|input| input.count_and_consume_key(modifiers, key));
            steps += sign * (presses * length) as i64;
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::super::decimate::{Data, DecimationCache};
    use super::*;

    #[test]
    fn cursors_stand_on_samples_and_stop_at_the_ends() {
        let x = [0.0, 1.0, 2.0, 3.0, 10.0];
        let mut cache = DecimationCache::default();
        let curve = cache.indexed(Data::Fixed(&x, &[0.0; 5]), [1.0, 1.0], 1);
        let mut cursors = Cursors::within([0.0, 9.0]);
        assert_eq!(cursors.at, [3.0, 6.0]);
        cursors.follow_samples(&curve, 0);
        assert_eq!(cursors.at, [3.0, 3.0], "the nearest sample");
        cursors.active = 1;
        cursors.follow_samples(&curve, 1);
        assert_eq!((cursors.at, cursors.range()), ([3.0, 10.0], [3.0, 10.0]));
        cursors.follow_samples(&curve, -100);
        assert_eq!(cursors.range(), [0.0, 3.0]);
    }
}
