//! Status cards of motors, IMU, bus and control loop.

use std::time::Duration;

use egui::{Align, Color32, Frame, Label, Layout, Margin, ProgressBar, Rect, RichText, Ui, UiBuilder, vec2};
use flqr_core::device::{Counters, ImuStatus, MotorStatus, Status};
use flqr_core::model::Motor;

use super::jitter::jitter_ui;
use crate::theme::palette;
use crate::widgets::mono;

const HEIGHT: f32 = 196.0;
/// Narrower cards would cut their numbers off.
const LEAST_WIDTH: f32 = 176.0;
const CARDS: usize = 5;
/// A reading older than this is marked.
const OLD: Duration = Duration::from_millis(200);

/// Draws all cards, in as many rows as the width requires.
pub(super) fn cards_ui(status: &Status, ui: &mut Ui) {
    let spacing = ui.spacing().item_spacing.x;
    let room = ui.available_width();
    let columns = if room >= CARDS as f32 * (LEAST_WIDTH + spacing) { CARDS } else { 3 };
    let width = ((room - (columns - 1) as f32 * spacing) / columns as f32).max(1.0);
    let origin = ui.cursor().min;
    for card in 0..CARDS {
        let (row, column) = (card / columns, card % columns);
        // The loop's ticks take the room that is left in the last row.
        let spans = if card == CARDS - 1 { columns - column } else { 1 };
        let size = vec2(spans as f32 * (width + spacing) - spacing, HEIGHT);
        let corner = origin + vec2(column as f32 * (width + spacing), row as f32 * (HEIGHT + spacing));
        let rect = Rect::from_min_size(corner, size);
        ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| card_ui(card, status, ui));
    }
    let rows = CARDS.div_ceil(columns) as f32;
    ui.allocate_rect(
        Rect::from_min_size(origin, vec2(room.max(1.0), rows * (HEIGHT + spacing) - spacing)),
        egui::Sense::hover(),
    );
}

fn card_ui(card: usize, status: &Status, ui: &mut Ui) {
    let frame = Frame::new()
        .fill(ui.visuals().faint_bg_color)
        .corner_radius(6)
        .inner_margin(Margin::symmetric(10, 6));
    frame.show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        ui.spacing_mut().item_spacing = vec2(6.0, 2.0);
        ui.spacing_mut().interact_size.y = 16.0;
        match card {
            0 => motor_ui(Motor::Left, &status.motors[0], ui),
            1 => motor_ui(Motor::Right, &status.motors[1], ui),
            2 => imu_ui(&status.imu, ui),
            3 => bus_ui(&status.counters, ui),
            _ => jitter_ui(&status.timing, ui),
        }
    });
}

pub(super) fn title_ui(ui: &mut Ui, title: &str) {
    ui.label(RichText::new(title).heading().strong());
    ui.add_space(2.0);
}

fn motor_ui(motor: Motor, status: &MotorStatus, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    title_ui(ui, if motor == Motor::Left { "Left motor" } else { "Right motor" });
    row_ui(ui, "readings", &rate(status.rate_hz), None);
    age_ui(ui, status.age);
    row_ui(ui, "missed replies", &status.missed.to_string(), (status.missed > 0).then_some(colors.warning));
    if let Some(round_trip) = status.health.and_then(|health| health.round_trip) {
        row_ui(ui, "round trip", &with_unit(Some(1e3 * round_trip.as_secs_f64()), 1, "ms"), None)
            .on_hover_text("Round-trip time of a query");
    }
    row_ui(ui, "temperature", &with_unit(status.temperature_c, 0, "°C"), None);
    let voltage = status.health.and_then(|health| health.voltage_v);
    row_ui(ui, "supply", &with_unit(voltage, 1, "V"), None);
    // Of a motor that is no longer asked nobody knows what it does now.
    let is_old = status.age.is_some_and(|age| age > OLD);
    let current_a = status.current_a.filter(|_| !is_old);
    row_ui(ui, "torque current", &with_unit(current_a, 2, "A"), None);
    let Some(health) = status.health else {
        row_ui(ui, "errors", "not read", None);
        return;
    };
    if let Some(on) = health.on {
        let power = match on {
            _ if is_old => "–",
            true => "on",
            false => "off",
        };
        row_ui(ui, "power", power, None)
            .on_hover_text("Last value reported by the motor; empty when outdated");
    }
    if health.errors.is_none() {
        row_ui(ui, "errors", "none", (!is_old).then_some(colors.good));
    } else {
        let text = RichText::new(health.errors.to_string()).strong().color(colors.error);
        ui.add(Label::new(text).truncate()).on_hover_text(health.errors.to_string());
    }
}

fn imu_ui(status: &ImuStatus, ui: &mut Ui) {
    let colors = palette(ui.visuals());
    title_ui(ui, "IMU");
    row_ui(ui, "readings", &rate(status.rate_hz), None);
    age_ui(ui, status.age);
    row_ui(ui, "temperature", &with_unit(status.temperature_c, 0, "°C"), None);
    row_ui(ui, "packets", &status.packets.to_string(), None);
    row_ui(ui, "corrupted", &status.corrupted.to_string(), (status.corrupted > 0).then_some(colors.warning));
    let stray = status.stray_bytes;
    row_ui(ui, "stray bytes", &stray.to_string(), (stray > 0).then_some(colors.warning));
}

fn bus_ui(counters: &Counters, ui: &mut Ui) {
    let warning = palette(ui.visuals()).warning;
    title_ui(ui, "Bus");
    load_ui(counters.bus_load, ui);
    row_ui(ui, "frames", &format!("{:.0}/s", counters.received_hz), None);
    row_ui(ui, "received", &counters.received.to_string(), None);
    row_ui(ui, "sent", &counters.sent.to_string(), None);
    for (name, count) in [
        ("dropped", counters.dropped),
        ("lost", counters.lost),
        ("late", counters.late),
        ("errors", counters.errors),
        ("reconnects", counters.reconnects),
    ] {
        row_ui(ui, name, &count.to_string(), (count > 0).then_some(warning)).on_hover_text(match name {
            "dropped" => "Frames dropped by the system or the adapter",
            "lost" => "Frames and samples lost before the control loop, the window or the recording",
            "late" => "Control-loop ticks at least one period late",
            "errors" => "Error frames and damaged lines",
            _ => "Number of reconnections of the bus",
        });
    }
}

fn load_ui(load: Option<f64>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("load").small().weak());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let text = load.map_or_else(|| "–".to_owned(), |load| format!("{:.0} %", 100.0 * load));
            let text = RichText::new(text).small();
            let bar = ProgressBar::new(load.unwrap_or(0.0) as f32).desired_height(14.0).corner_radius(3);
            ui.add(bar.text(text)).on_hover_text(
                "Bus load in the last second, including bit stuffing; unknown without a bit rate",
            );
        });
    });
}

/// Draws a name at the left and its value at the right.
pub(super) fn row_ui(ui: &mut Ui, name: &str, value: &str, color: Option<Color32>) -> egui::Response {
    ui.horizontal(|ui| {
        ui.label(RichText::new(name).small().weak());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let text = mono(value);
            ui.add(Label::new(color.map_or(text.clone(), |color| text.strong().color(color))).truncate());
        });
    })
    .response
}

fn age_ui(ui: &mut Ui, age: Option<Duration>) {
    let old = age.is_some_and(|age| age > OLD);
    let color = old.then_some(palette(ui.visuals()).warning);
    row_ui(ui, "age", &age.map_or_else(|| "–".to_owned(), duration), color);
}

fn rate(rate_hz: f64) -> String {
    format!("{rate_hz:.0} Hz")
}

fn with_unit(value: Option<f64>, decimals: usize, unit: &str) -> String {
    let value = value.filter(|value| value.is_finite());
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$} {unit}").replace('-', "−"))
}

/// A duration with the unit that keeps it short.
pub(super) fn duration(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    match seconds {
        _ if seconds < 1e-3 => format!("{:.0} µs", 1e6 * seconds),
        _ if seconds < 0.01 => format!("{:.1} ms", 1e3 * seconds),
        _ if seconds < 1.0 => format!("{:.0} ms", 1e3 * seconds),
        _ if seconds < 100.0 => format!("{seconds:.1} s"),
        _ => format!("{:.0} min", seconds / 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_stay_short() {
        for (micros, text) in [
            (12, "12 µs"),
            (1_200, "1.2 ms"),
            (45_000, "45 ms"),
            (3_210_000, "3.2 s"),
            (600_000_000, "10 min"),
        ] {
            assert_eq!(duration(Duration::from_micros(micros)), text);
        }
    }
}
