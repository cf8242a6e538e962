//! Drawing of the blocks of a page.

use egui::{
    Align, FontId, Frame, Label, Layout, Link as LinkText, Margin, Rect, Response, RichText, ScrollArea,
    Shape, Stroke, TextStyle, Ui, vec2,
};

use super::markdown::{Block, Link, Span, plain};
use crate::theme::palette;

/// Font sizes of headings of level 1 to 3, points.
const HEADING_SIZES: [f32; 3] = [21.0, 16.5, 14.0];
const LINE_HEIGHT: f32 = 18.0;
const INDENT: f32 = 18.0;
/// Minimum width of a column with longer text; a table that is still too wide scrolls sideways.
const LEAST_COLUMN: f32 = 110.0;
/// Maximum width of a word that is not broken.
const LONGEST_WORD: f32 = 240.0;
const COLUMN_GAP: f32 = 14.0;

/// Result of drawing a block.
#[derive(Default)]
pub(super) struct Drawn {
    /// Link that was clicked.
    pub(super) clicked: Option<Link>,
    /// Rectangle of the table row to show.
    pub(super) row: Option<Rect>,
}

/// Width of the longest cell and of the longest word of each column; empty until measured.
pub(super) type Columns = Vec<[f32; 2]>;

/// Draws a block; `row` is the row of a table to locate.
pub(super) fn block_ui(block: &Block, columns: &mut Columns, row: Option<usize>, ui: &mut Ui) -> Drawn {
    match block {
        Block::Heading { level, spans, .. } => {
            let size = HEADING_SIZES[(level - 1).min(HEADING_SIZES.len() - 1)];
            ui.add_space(if *level == 1 { 0.0 } else { 0.6 * size });
            ui.add(Label::new(RichText::new(plain(spans)).size(size).strong()).wrap());
            if *level <= 2 {
                let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 1.0), egui::Sense::hover());
                ui.painter().hline(
                    rect.x_range(),
                    rect.center().y,
                    ui.visuals().widgets.noninteractive.bg_stroke,
                );
            }
            Drawn::default()
        }
        Block::Text { marker, depth, spans } => {
            ui.horizontal_top(|ui| {
                ui.add_space(INDENT * depth.saturating_sub(1) as f32);
                if *depth > 0 {
                    let marker = RichText::new(marker.as_deref().unwrap_or_default());
                    ui.spacing_mut().item_spacing.x = 0.0;
                    let size = vec2(INDENT, LINE_HEIGHT);
                    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
                        ui.set_min_size(size);
                        ui.label(marker);
                    });
                }
                ui.vertical(|ui| Drawn { clicked: spans_ui(spans, ui), row: None }).inner
            })
            .inner
        }
        Block::Note { label, spans } => {
            ui.horizontal_top(|ui| {
                ui.weak(format!("[{label}]"));
                ui.vertical(|ui| Drawn { clicked: spans_ui(spans, ui), row: None }).inner
            })
            .inner
        }
        Block::Code(text) => {
            code_ui(text, ui);
            Drawn::default()
        }
        Block::Table(rows) => table_ui(rows, columns, row, ui),
    }
}

fn code_ui(text: &str, ui: &mut Ui) {
    let frame =
        Frame::new().fill(ui.visuals().extreme_bg_color).inner_margin(Margin::same(8)).corner_radius(4);
    frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.with_layout(Layout::right_to_left(Align::TOP), |ui| {
            if ui.small_button("Copy").on_hover_text("Copy this text").clicked() {
                ui.ctx().copy_text(text.to_owned());
            }
            ui.with_layout(Layout::top_down(Align::LEFT), |ui| {
                ui.add(Label::new(RichText::new(text).monospace()).wrap());
            });
        });
    });
}

/// Draws text that wraps; returns the link that was clicked.
fn spans_ui(spans: &[Span], ui: &mut Ui) -> Option<Link> {
    let mut clicked = None;
    ui.spacing_mut().interact_size.y = LINE_HEIGHT;
    ui.spacing_mut().item_spacing = vec2(0.0, 0.0);
    ui.horizontal_wrapped(|ui| {
        for span in spans {
            let text = rich(span);
            match &span.link {
                None => {
                    ui.add(Label::new(text).wrap());
                }
                Some(Link::File(file)) => {
                    ui.add(Label::new(text).wrap())
                        .on_hover_text(format!("In the source repository: {file}"));
                }
                Some(link) => {
                    if link_ui(link, text, ui).clicked() {
                        clicked = Some(link.clone());
                    }
                }
            }
        }
    });
    clicked
}

fn link_ui(link: &Link, text: RichText, ui: &mut Ui) -> Response {
    let color = palette(ui.visuals()).accent;
    let response = ui.add(LinkText::new(text.color(color)));
    match link {
        Link::Web(address) => response.on_hover_text(format!("Copy the address {address}")),
        _ => response,
    }
}

fn rich(span: &Span) -> RichText {
    let mut text = RichText::new(&span.text).line_height(Some(LINE_HEIGHT));
    if span.strong {
        text = text.strong();
    }
    if span.emphasis {
        text = text.italics();
    }
    if span.code {
        text = text.code();
    }
    if matches!(span.link, Some(Link::Note(_))) {
        text = text.small();
    }
    text
}

fn table_ui(rows: &[Vec<Vec<Span>>], columns: &mut Columns, wanted: Option<usize>, ui: &mut Ui) -> Drawn {
    if columns.is_empty() {
        *columns = measured(rows, ui);
    }
    let widths = widths(columns, ui.available_width());
    let mut drawn = Drawn::default();
    ScrollArea::horizontal().show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for (number, row) in rows.iter().enumerate() {
            let background = ui.painter().add(Shape::Noop);
            let response = ui.horizontal_top(|ui| {
                ui.spacing_mut().item_spacing.x = COLUMN_GAP;
                for (cell, width) in row.iter().zip(&widths) {
                    ui.vertical(|ui| {
                        ui.set_width(*width);
                        ui.add_space(3.0);
                        if number == 0 {
                            ui.add(Label::new(RichText::new(plain(cell)).strong()).wrap());
                        } else {
                            drawn.clicked = spans_ui(cell, ui).or(drawn.clicked.take());
                        }
                        ui.add_space(3.0);
                    });
                }
            });
            let rect = response.response.rect.expand2(vec2(4.0, 0.0));
            if number % 2 == 1 {
                ui.painter().set(background, Shape::rect_filled(rect, 2.0, ui.visuals().faint_bg_color));
            }
            if number == 0 {
                let stroke = Stroke::new(1.0, palette(ui.visuals()).reference);
                ui.painter().hline(rect.x_range(), rect.bottom(), stroke);
            }
            if wanted == Some(number) {
                drawn.row = Some(rect);
            }
        }
    });
    drawn
}

/// Widths of the longest cell and the longest word of each column.
fn measured(rows: &[Vec<Vec<Span>>], ui: &Ui) -> Columns {
    let fonts = [TextStyle::Body, TextStyle::Monospace].map(|style| style.resolve(ui.style()));
    let width = |text: &str, font: &FontId| {
        ui.fonts_mut(|fonts| {
            fonts.layout_no_wrap(text.to_owned(), font.clone(), egui::Color32::WHITE).size().x
        })
    };
    let mut columns = vec![[0.0_f32; 2]; rows.iter().map(Vec::len).max().unwrap_or(0)];
    for row in rows {
        for (cell, [longest, word]) in row.iter().zip(&mut columns) {
            let mut total = 0.0;
            for span in cell {
                let font = &fonts[usize::from(span.code)];
                total += width(&span.text, font);
                for part in span.text.split_whitespace() {
                    *word = word.max(width(part, font));
                }
            }
            // A header is drawn in strong letters of the same width; the sum is rounded up against wrapping.
            *longest = longest.max(total.ceil() + 2.0);
        }
    }
    columns
}

/// Widths of the columns for an available width: that of their text, limited to a common maximum.
fn widths(columns: &Columns, available: f32) -> Vec<f32> {
    let free = available - COLUMN_GAP * columns.len().saturating_sub(1) as f32;
    let mut order: Vec<f32> = columns.iter().map(|[longest, _]| *longest).collect();
    order.sort_by(f32::total_cmp);
    let (mut remaining, mut count, mut limit) = (free, order.len(), f32::INFINITY);
    for longest in order {
        limit = remaining / count as f32;
        if longest > limit {
            break;
        }
        limit = f32::INFINITY;
        remaining -= longest;
        count -= 1;
    }
    let limit = limit.max(LEAST_COLUMN);
    columns.iter().map(|[longest, word]| longest.min(limit.max(word.min(LONGEST_WORD)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_fill_the_width_and_short_ones_stay_short() {
        let columns = vec![[100.0, 50.0], [900.0, 80.0], [600.0, 80.0]];
        let gaps = 2.0 * COLUMN_GAP;
        assert_eq!(widths(&columns, 2000.0), [100.0, 900.0, 600.0]);
        assert_eq!(widths(&columns, 900.0 + gaps), [100.0, 400.0, 400.0]);
        assert_eq!(widths(&columns, 1400.0 + gaps), [100.0, 700.0, 600.0]);
        assert_eq!(widths(&columns, 150.0), [100.0, LEAST_COLUMN, LEAST_COLUMN], "it scrolls sideways");
        assert_eq!(widths(&vec![[300.0, 200.0]], 150.0), [200.0], "words stay whole");
    }
}
