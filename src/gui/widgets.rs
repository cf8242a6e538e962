//! Small pieces that every tab uses: section heads, messages, number fields, number text.

use egui::emath::Numeric;
use egui::{Color32, DragValue, Event, Key, Response, RichText, Ui, WidgetText, vec2};

use crate::theme::palette;

/// Head of a section, with room for controls at its right.
pub(crate) fn section_ui(ui: &mut Ui, title: &str, controls: impl FnOnce(&mut Ui)) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label(RichText::new(title).heading().strong());
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), controls);
    });
}

/// Name and colour of a curve, for the head of a section.
pub(crate) fn legend_ui(ui: &mut Ui, name: &str, color: Color32) {
    ui.label(RichText::new(name).small().strong().color(color));
    let (rect, _) = ui.allocate_exact_size(vec2(16.0, 12.0), egui::Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, egui::Stroke::new(2.5, color));
}

/// A quiet explanation.
pub(crate) fn hint_ui(ui: &mut Ui, text: impl Into<String>) -> Response {
    ui.add(egui::Label::new(RichText::new(text).small().weak()).wrap())
}

/// Text of an empty page: what is missing, and how it comes; `more` adds to it.
pub(crate) fn empty_page_ui(ui: &mut Ui, missing: &str, hint: &str, more: impl FnOnce(&mut Ui)) {
    ui.add_space(0.3 * ui.available_height());
    ui.vertical_centered(|ui| {
        ui.label(missing);
        hint_ui(ui, hint);
        more(ui);
    });
}

/// A mistake, in the place where it was made.
pub(crate) fn error_ui(ui: &mut Ui, text: impl Into<String>) -> Response {
    let color = palette(ui.visuals()).error;
    ui.add(egui::Label::new(RichText::new(text).small().color(color)).wrap())
}

/// Something to know before trusting a result.
pub(crate) fn warning_ui(ui: &mut Ui, text: impl Into<String>) -> Response {
    let color = palette(ui.visuals()).warning;
    ui.add(egui::Label::new(RichText::new(text).small().color(color)).wrap())
}

/// Adds a number field that holds any magnitude: a drag changes it in proportion, typing sets it. It shows four digits,
/// and all of them while it is edited.
pub(crate) fn number_ui(ui: &mut Ui, value: &mut f64, name: &str, width: f32) -> Response {
    let speed = (0.01 * value.abs()).max(1e-6);
    let id = ui.next_auto_id();
    // A field that gets the focus by Tab gets it here.
    let editing = ui.is_enabled()
        && ui.memory_mut(|memory| {
            memory.interested_in_focus(id, ui.layer_id());
            memory.has_focus(id)
        });
    entry_ui(ui, value, name, |field| {
        field
            .speed(speed)
            .min_size(egui::vec2(width, 0.0))
            .custom_formatter(move |value, _| if editing { exact(value) } else { plain(value, 4) })
            .custom_parser(parse)
    })
}

/// Adds a number field as `adapt` makes it. Only what is dragged, or typed and then confirmed or left, changes the
/// value: entering and leaving it does not, and Esc discards what was typed.
pub(crate) fn entry_ui<T: Numeric>(
    ui: &mut Ui,
    value: &mut T,
    name: &str,
    adapt: impl for<'a> FnOnce(DragValue<'a>) -> DragValue<'a>,
) -> Response {
    let before = *value;
    let field = adapt(DragValue::new(value).update_while_editing(false).clip_text(true));
    let response = ui.add(field).accessible_name(name);
    let is_discarded = is_escaped(ui, &response) && !response.dragged();
    // A whole number beyond 2^53 loses digits as the field reads it.
    if is_discarded || value.to_f64() == before.to_f64() {
        *value = before;
    }
    response
}

/// Returns whether a field was left with Esc just now: it takes over what was typed up to two passes after it is left.
fn is_escaped(ui: &Ui, response: &Response) -> bool {
    let (now, key) = (ui.ctx().cumulative_pass_nr(), response.id.with("escaped"));
    if response.lost_focus() && escape_pressed(ui) {
        ui.data_mut(|data| data.insert_temp(key, now));
    }
    let escaped: Option<u64> = ui.data(|data| data.get_temp(key));
    escaped.is_some_and(|pass| now - pass <= 2)
}

/// Returns whether Esc was pressed in this frame, even if the press was taken away to stop the robot.
fn escape_pressed(ui: &Ui) -> bool {
    let is_escape = |event: &Event| matches!(event, Event::Key { key: Key::Escape, pressed: true, .. });
    ui.input(|input| input.raw.events.iter().any(is_escape))
}

/// A number with all of its digits: parsed again, it is the same to the last bit.
fn exact(value: f64) -> String {
    let is_handy = value == 0.0 || (1e-5..1e16).contains(&value.abs());
    if is_handy { value.to_string() } else { format!("{value:e}") }
}

/// Reads a number as people type it: surrounding spaces, a typographic minus, a decimal comma.
pub(crate) fn parse(text: &str) -> Option<f64> {
    let text = text.trim().replace('−', "-");
    let text = if text.contains('.') { text } else { text.replacen(',', ".", 1) };
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// A number with `digits` significant digits, with an exponent only where needed; for fields.
pub(crate) fn plain(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-4..7).contains(&exponent) {
        let text = format!("{value:.*e}", digits.saturating_sub(1));
        let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", trimmed(mantissa));
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    trimmed(&format!("{value:.decimals$}")).to_owned()
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// A number for reading: `digits` significant digits, fixed length, a typographic minus.
pub(crate) fn shown(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "–".to_owned();
    }
    let size = value.abs();
    if size != 0.0 && (!(1e-4..1e6).contains(&size)) {
        return format!("{value:.*e}", digits.saturating_sub(1)).replace('-', "−");
    }
    let exponent = if size == 0.0 { 0 } else { size.log10().floor() as i32 };
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

/// From one number to another: in percent, or nothing where there is no ratio.
pub(crate) fn change(a: f64, b: f64) -> String {
    let percent = 100.0 * (b / a - 1.0);
    if !percent.is_finite() {
        return "–".to_owned();
    }
    let sign = if percent > 0.0 { "+" } else { "" };
    if percent.abs() >= 1000.0 {
        format!("×{}", shown(b / a, 3))
    } else {
        format!("{sign}{} %", shown(percent, 3))
    }
}

/// Monospace text, for columns of numbers.
pub(crate) fn mono(text: impl Into<String>) -> RichText {
    RichText::new(text).monospace()
}

/// A row of choices of which one holds; says whether it was changed.
pub(crate) fn choice_ui<T: PartialEq + Copy>(
    ui: &mut Ui,
    value: &mut T,
    choices: &[(T, &str, &str)],
) -> bool {
    let mut changed = false;
    ui.spacing_mut().item_spacing.x = 2.0;
    for (choice, name, help) in choices {
        let text: WidgetText = (*name).into();
        changed |= ui.selectable_value(value, *choice, text).on_hover_text(*help).changed();
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits_and_lose_their_zeros() {
        for (value, text) in
            [(60.0, "60"), (0.00049, "0.00049"), (1.5e-7, "1.5e-7"), (123456.0, "123456"), (-0.25, "-0.25")]
        {
            assert_eq!(plain(value, 4), text);
        }
        assert_eq!(shown(-12.3456, 4), "−12.35");
        assert_eq!(shown(0.0, 3), "0.00");
        assert_eq!(shown(2.1e-15, 2), "2.1e−15");
    }

    #[test]
    fn exact_text_is_read_back_to_the_last_bit() {
        for value in [0.0, 2.0, 0.1, 1.0 / 3.0, 0.5_f64.sqrt(), -4.9e-4, 1e-300, 1.8e30, f64::MIN_POSITIVE] {
            assert_eq!(parse(&exact(value)), Some(value), "{}", exact(value));
        }
        assert_eq!(exact(60.0), "60");
    }

    #[test]
    fn a_change_is_shown_in_percent_or_as_a_factor() {
        for (a, b, text) in
            [(2.0, 3.0, "+50.0 %"), (-2.0, -1.0, "−50.0 %"), (1.0, 40.0, "×40.0"), (0.0, 1.0, "–")]
        {
            assert_eq!(change(a, b), text);
        }
    }

    #[test]
    fn typed_numbers_may_have_a_comma_or_a_real_minus() {
        assert_eq!(parse(" −0,5 "), Some(-0.5));
        assert_eq!(parse("1.5e-3"), Some(1.5e-3));
        for refused in ["", "abc", "nan", "inf", "1.0,5"] {
            assert_eq!(parse(refused), None, "{refused}");
        }
    }
}
