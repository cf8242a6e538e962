//! Processor time of one frame with six lines of 600 000 points (ten minutes of 1 kHz) in three plots with tools and
//! statistics: layout and tessellation, no graphics driver. The peer is the same picture with plain lines of
//! egui_plot, which aggregates by itself.
//!
//! `cargo bench -p flqr-gui --bench frame`

use divan::Bencher;
use egui::{Color32, Context, RawInput, Rect, Ui, vec2};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints};
use flqr_gui::plot::{Data, Panel, PanelCurve, Stack, TimeColumn, Unit, ValueColumn};

const SAMPLES: usize = 600_000;
const LINES: usize = 6;
const NAMES: [&str; 3] = ["displacement", "velocity", "pitch"];
/// Samples between two frames while live.
const FRAME_SAMPLES: usize = 33;

fn main() {
    // As the window does.
    flqr_gui::keep_freed_memory();
    divan::main();
}

fn value(line: usize, index: usize) -> f64 {
    let noise = ((index * 7919) % 1013) as f64 / 1013.0 - 0.5;
    ((line as f64 + 1.0) * 1e-3 * index as f64).sin() + 0.1 * noise
}

fn time_s(index: usize) -> f64 {
    index as f64 * 1e-3
}

/// Columns that grow, as the live robot's.
#[derive(Default)]
struct Live {
    time_s: TimeColumn,
    values: [ValueColumn; LINES],
    generation: u64,
}

impl Live {
    fn append(&mut self, count: usize) {
        for _ in 0..count {
            let index = self.time_s.len();
            self.time_s.push(time_s(index));
            for (line, column) in self.values.iter_mut().enumerate() {
                column.push(value(line, index));
            }
        }
    }
}

/// Three plots of two lines each.
fn panels<'a>(data: &[Data<'a>; LINES], generation: u64) -> Vec<Panel<'a>> {
    let curve = |line: usize| PanelCurve {
        name: ["left", "right"][line % 2].into(),
        key: format!("line_{line}").into(),
        color: Color32::LIGHT_BLUE,
        data: data[line],
        generation,
        gap: 0.02,
    };
    let panel = |(number, name): (usize, &'static str)| Panel {
        name: name.into(),
        unit: Unit::Angle,
        min_span: 0.01,
        shown: true,
        curves: vec![curve(2 * number), curve(2 * number + 1)],
        limits: Vec::new(),
    };
    NAMES.into_iter().enumerate().map(panel).collect()
}

/// One frame, from input to triangles.
fn frame(ctx: &Context, draw: impl FnMut(&mut Ui)) -> usize {
    let input = RawInput {
        screen_rect: Some(Rect::from_min_size(egui::Pos2::ZERO, vec2(1280.0, 800.0))),
        ..RawInput::default()
    };
    let output = ctx.run_ui(input, draw);
    ctx.tessellate(output.shapes, output.pixels_per_point).len()
}

fn draw(ui: &mut Ui, stack: &mut Stack, panels: &[Panel<'_>]) {
    ui.horizontal_wrapped(|ui| stack.tools_ui(ui, panels));
    drop(stack.show(ui, panels));
}

/// While live: every frame has new samples, all ten minutes are visible.
#[divan::bench]
fn live(bencher: Bencher<'_, '_>) {
    let (ctx, mut data) = (Context::default(), Live::default());
    data.append(SAMPLES);
    let mut stack = Stack::live("live", SAMPLES as f64 * 1e-3);
    bencher.bench_local(|| {
        data.append(FRAME_SAMPLES);
        data.generation += 1;
        let end = data.time_s.last().unwrap_or(0.0);
        stack.update([0.0, end]);
        let columns: [Data<'_>; LINES] =
            std::array::from_fn(|line| Data::Growing(&data.time_s, &data.values[line]));
        let panels = panels(&columns, data.generation);
        frame(&ctx, |ui| draw(ui, &mut stack, &panels))
    });
}

/// Columns that stay.
fn fixed() -> (Vec<f64>, [Vec<f64>; LINES]) {
    let values = |line| (0..SAMPLES).map(|index| value(line, index)).collect();
    ((0..SAMPLES).map(time_s).collect(), std::array::from_fn(values))
}

fn still(bencher: Bencher<'_, '_>, mut limits: impl FnMut(u64) -> [f64; 2]) {
    let (ctx, (time_s, values)) = (Context::default(), fixed());
    let columns: [Data<'_>; LINES] = std::array::from_fn(|line| Data::Fixed(&time_s, &values[line]));
    let panels = panels(&columns, 1);
    let mut stack = Stack::new("still", 1.0);
    let mut number = 0;
    bencher.bench_local(|| {
        number += 1;
        stack.show_all(limits(number));
        frame(&ctx, |ui| draw(ui, &mut stack, &panels))
    });
}

/// Nothing changes between two frames.
#[divan::bench]
fn paused(bencher: Bencher<'_, '_>) {
    still(bencher, |_| [0.0, 600.0]);
}

/// The range moves with every frame.
#[divan::bench]
fn panned(bencher: Bencher<'_, '_>) {
    still(bencher, |number| [0.01 * (number % 100) as f64, 600.0]);
}

/// The peer as it comes: egui_plot's own aggregation, points borrowed.
#[divan::bench(sample_count = 20)]
fn peer_plain_lines(bencher: Bencher<'_, '_>) {
    let (ctx, (time_s, values)) = (Context::default(), fixed());
    let points = |values: &Vec<f64>| {
        time_s.iter().zip(values).map(|(t, y)| PlotPoint::new(*t, *y)).collect::<Vec<_>>()
    };
    let lines = values.each_ref().map(points);
    bencher.bench_local(|| {
        frame(&ctx, |ui| {
            for (number, pair) in lines.chunks(2).enumerate() {
                Plot::new(number).height(240.0).show(ui, |plot_ui| {
                    for (part, points) in pair.iter().enumerate() {
                        plot_ui.line(Line::new("y", PlotPoints::Borrowed(points)).id(part));
                    }
                });
            }
        })
    });
}
