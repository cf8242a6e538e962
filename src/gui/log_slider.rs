//! A slider over many powers of ten that moves in proportion: so many percent a point, however short its rail is.

use std::ops::RangeInclusive;

use egui::accesskit::Action;
use egui::{EventFilter, Key, Rect, Response, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};

/// Change of the natural logarithm of the value per point of a drag or key press.
const USUAL: f64 = 0.015;
/// Change with Shift held.
const FINE: f64 = 0.0015;
const RAIL: f32 = 6.0;
const HANDLE: f32 = 6.5;

/// Tooltip.
pub(crate) const HELP: &str =
    "Drag, or ← and →: 1.5 % per point or key press, 0.15 % with Shift. The drag may leave the slider.";

/// Draws it; `range` is what the rail shows, and what a drag stays in unless the value lies beyond.
pub(crate) fn log_slider_ui(
    ui: &mut Ui,
    value: &mut f64,
    range: &RangeInclusive<f64>,
    name: &str,
) -> Response {
    let size = vec2(ui.spacing().slider_width, ui.spacing().interact_size.y);
    let (rect, mut response) = ui.allocate_exact_size(size, Sense::drag());
    let before = *value;
    *value = moved(before, steps(ui, &response), range);
    if *value != before {
        response.mark_changed();
    }
    if ui.is_rect_visible(rect) {
        paint(ui, rect, &response, share(*value, range));
    }
    let now = *value;
    response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), now, name));
    ui.ctx().accesskit_node_builder(response.id, |node| {
        node.set_min_numeric_value(*range.start());
        node.set_max_numeric_value(*range.end());
        node.add_action(Action::Increment);
        node.add_action(Action::Decrement);
    });
    response
}

/// Change by the user, as a natural logarithm.
fn steps(ui: &Ui, response: &Response) -> f64 {
    let mut way = response.drag_delta();
    if response.drag_started() {
        response.request_focus();
        // In a slow frame the pointer may have come from far away before its press.
        let pressed = ui.input(|input| input.pointer.press_origin());
        way = response.interact_pointer_pos().zip(pressed).map_or(Vec2::ZERO, |(at, from)| at - from);
    }
    let mut points = f64::from(way.x - way.y);
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        // With another modifier the arrows mean something else.
        let is_ours = ui.input(|input| !input.modifiers.command && !input.modifiers.alt);
        let presses = |key| if is_ours { ui.input(|input| input.num_presses(key)) as f64 } else { 0.0 };
        points += presses(Key::ArrowRight) - presses(Key::ArrowLeft);
    }
    let asked = |action| ui.input(|input| input.num_accesskit_action_requests(response.id, action)) as f64;
    points += asked(Action::Increment) - asked(Action::Decrement);
    points * if ui.input(|input| input.modifiers.shift) { FINE } else { USUAL }
}

/// `value` times e to the power of `by`, with digits that a person would type. From 0, which no factor leaves, it
/// goes to the smallest.
fn moved(value: f64, by: f64, range: &RangeInclusive<f64>) -> f64 {
    match () {
        () if by == 0.0 => value,
        () if value > 0.0 => {
            rounded(value * by.exp()).clamp(range.start().min(value), range.end().max(value))
        }
        () if by > 0.0 => *range.start(),
        () => value,
    }
}

/// To five digits, as a person would type it: less than a tenth of the smallest step is lost.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Position of a value on the rail, from 0 to 1.
fn share(value: f64, range: &RangeInclusive<f64>) -> f32 {
    let [low, high] = [range.start(), range.end()].map(|end| end.ln());
    if value > 0.0 { ((value.ln() - low) / (high - low)).clamp(0.0, 1.0) as f32 } else { 0.0 }
}

fn paint(ui: &Ui, rect: Rect, response: &Response, share: f32) {
    let visuals = ui.visuals();
    let round = visuals.widgets.inactive.corner_radius;
    let rail = Rect::from_center_size(rect.center(), vec2(rect.width(), RAIL));
    ui.painter().rect_filled(rail, round, visuals.widgets.inactive.bg_fill);
    let x = egui::lerp(rect.left() + HANDLE..=rect.right() - HANDLE, share);
    let fill = Rect::from_min_max(rail.min, pos2(x, rail.max.y));
    ui.painter().rect_filled(fill, round, visuals.selection.bg_fill);
    let look = ui.style().interact(response);
    let stroke =
        if response.has_focus() { visuals.selection.stroke } else { Stroke::new(1.0, look.fg_stroke.color) };
    ui.painter().circle(pos2(x, rail.center().y), HANDLE + look.expansion, look.bg_fill, stroke);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_is_a_factor_that_its_way_back_undoes_and_stays_on_the_rail() {
        let range = 1e-4..=1e4;
        assert!((moved(moved(60.0, 0.3, &range), -0.3, &range) - 60.0).abs() < 0.002);
        assert_eq!([moved(100.0, USUAL, &range), moved(100.0, -FINE, &range)], [101.51, 99.85]);
        assert_eq!(moved(1e4, 1.0, &range), 1e4);
        assert_eq!(moved(1e6, 1.0, &range), 1e6, "what was typed beyond the rail is not pulled onto it");
        assert!(moved(1e6, -1.0, &range) < 1e6);
        assert_eq!([moved(0.0, 1.0, &range), moved(0.0, -1.0, &range)], [1e-4, 0.0]);
    }

    #[test]
    fn powers_of_ten_are_evenly_spread_on_the_rail() {
        let range = 1e-4..=1e4;
        for (value, place) in [(0.0, 0.0), (1e-4, 0.0), (0.01, 0.25), (1.0, 0.5), (1e4, 1.0), (1e9, 1.0)] {
            assert!((share(value, &range) - place).abs() < 1e-6, "{value}");
        }
    }
}
