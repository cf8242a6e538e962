//! Lateness of the control loop's ticks: a histogram with logarithmic bins, median, 99th percentile and largest value.

use std::time::Duration;

use egui::{Align2, FontId, Rect, RichText, Sense, Ui, pos2, vec2};
use flqr_core::device::Timing;

use super::cards::{duration, row_ui, title_ui};
use crate::theme::palette;
use crate::widgets::hint_ui;

/// Room for the labels under the bars.
const LABELS: f32 = 15.0;
/// Edges that are labelled.
const LABELLED: [(f64, &str); 5] =
    [(1e-6, "1 µs"), (1e-5, "10 µs"), (1e-4, "0.1 ms"), (1e-3, "1 ms"), (1e-2, "10 ms")];

/// Draws the card.
pub(super) fn jitter_ui(timing: &Timing, ui: &mut Ui) {
    title_ui(ui, "Loop jitter");
    if timing.ticks == 0 {
        hint_ui(ui, "No control loop (a recording has none).");
        return;
    }
    let color = (timing.skipped > 0).then(|| palette(ui.visuals()).warning);
    let lateness = format!("{} / {}", text(timing.median_s), text(timing.p99_s));
    row_ui(ui, "p50 / p99", &lateness, None).on_hover_text("Median and 99th percentile of the lateness");
    row_ui(ui, "max", &text(timing.greatest_s), None);
    row_ui(ui, "ticks, skipped", &format!("{}, {}", timing.ticks, timing.skipped), color)
        .on_hover_text("Number of ticks, and ticks skipped because the previous one took too long");
    histogram_ui(timing, ui);
}

fn text(seconds: f64) -> String {
    Duration::try_from_secs_f64(seconds).map_or_else(|_| "–".to_owned(), duration)
}

fn histogram_ui(timing: &Timing, ui: &mut Ui) {
    let size = vec2(ui.available_width(), ui.available_height().max(LABELS + 20.0));
    let (area, response) = ui.allocate_exact_size(size, Sense::hover());
    let bins = Timing::EDGES_S.len() + 1;
    let bars = Rect::from_min_max(area.min, pos2(area.max.x, area.max.y - LABELS));
    let width = bars.width() / bins as f32;
    let (painter, colors) = (ui.painter(), palette(ui.visuals()));
    painter.hline(bars.x_range(), bars.max.y, ui.visuals().widgets.noninteractive.bg_stroke);
    let most = timing.histogram.iter().copied().max().unwrap_or(0);
    let height = |count: u64| (1.0 + count as f32).ln() / (1.0 + most as f32).ln().max(f32::MIN_POSITIVE);
    for (bin, count) in timing.histogram.iter().enumerate().take(bins).filter(|(_, count)| **count > 0) {
        let left = bars.min.x + bin as f32 * width;
        let top = bars.max.y - (bars.height() * height(*count)).max(1.5);
        let bar = Rect::from_min_max(pos2(left + 0.5, top), pos2(left + width - 0.5, bars.max.y));
        painter.rect_filled(bar, 1, colors.accent);
    }
    for (edge_s, label) in LABELLED {
        let bin = Timing::EDGES_S.partition_point(|edge| *edge < edge_s * 0.999) + 1;
        let x = bars.min.x + bin as f32 * width;
        painter.vline(x, bars.max.y..=bars.max.y + 3.0, ui.visuals().widgets.noninteractive.fg_stroke);
        let color = ui.visuals().weak_text_color();
        painter.text(pos2(x, area.max.y), Align2::CENTER_BOTTOM, label, FontId::proportional(10.0), color);
    }
    response.on_hover_ui(|ui| {
        ui.label("Histogram of tick lateness (logarithmic count)");
        for (bin, count) in timing.histogram.iter().enumerate().filter(|(_, count)| **count > 0) {
            let bin = match Timing::EDGES_S.get(bin) {
                Some(edge) => format!("up to {:>7}", text(*edge)),
                None => "later          ".to_owned(),
            };
            ui.label(RichText::new(format!("{bin}  {count}")).monospace());
        }
    });
}
