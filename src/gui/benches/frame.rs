//! Processor time of one frame with 60 s of 1 kHz data in three plots: layout and tessellation, no graphics
//! driver. The peer is the same picture with plain lines of egui_plot.
//!
//! `cargo bench -p flqr-gui --bench frame`

use divan::Bencher;
use egui::{Color32, Context, RawInput, Rect, Ui, vec2};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints};
use flqr_gui::plot::{Curve, DecimationCache, TimeCurve, TimePlot, TimeView};

const SAMPLES: usize = 60_000;
const PLOTS: usize = 3;

fn main() {
    divan::main();
}

struct Data {
    time_s: Vec<f64>,
    values: [Vec<f64>; PLOTS],
}

fn data() -> Data {
    let time_s: Vec<f64> = (0..SAMPLES).map(|index| index as f64 * 1e-3).collect();
    let values = [1.0, 2.5, 7.0].map(|frequency| {
        let noise = |index: usize| ((index * 7919) % 1013) as f64 / 1013.0 - 0.5;
        time_s.iter().enumerate().map(|(i, t)| (frequency * t).sin() + 0.1 * noise(i)).collect()
    });
    Data { time_s, values }
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

fn ours(
    ui: &mut Ui,
    data: &Data,
    view: &mut TimeView,
    caches: &mut [DecimationCache; PLOTS],
    generation: u64,
) {
    view.update([0.0, 60.0]);
    for (index, cache) in caches.iter_mut().enumerate() {
        let id = ["displacement", "velocity", "pitch"][index];
        let plot = TimePlot {
            id,
            label: id,
            height: 240.0,
            x_label: (index == 2).then_some("time [s]"),
            min_y_span: 0.01,
        };
        let curve = Curve { x: &data.time_s, y: &data.values[index], scale: 1.0, gap: 0.02 };
        plot.show(ui, view, &mut [TimeCurve { color: Color32::LIGHT_BLUE, curve, generation, cache }]);
    }
}

/// While live: every frame has new data, so nothing is cached.
#[divan::bench]
fn live(bencher: Bencher<'_, '_>) {
    let (ctx, data) = (Context::default(), data());
    let (mut view, mut caches) = (TimeView::following(60.0), Default::default());
    let mut generation = 0;
    bencher.bench_local(|| {
        generation += 1;
        frame(&ctx, |ui| ours(ui, &data, &mut view, &mut caches, generation))
    });
}

/// While paused: the picture of the frame before.
#[divan::bench]
fn paused(bencher: Bencher<'_, '_>) {
    let (ctx, data) = (Context::default(), data());
    let (mut view, mut caches) = (TimeView::following(60.0), Default::default());
    bencher.bench_local(|| frame(&ctx, |ui| ours(ui, &data, &mut view, &mut caches, 1)));
}

/// The peer as it comes: egui_plot's own aggregation, points borrowed.
#[divan::bench]
fn peer_plain_lines(bencher: Bencher<'_, '_>) {
    peer(bencher, true);
}

/// The peer without its aggregation, as before version 0.37.
#[divan::bench(sample_count = 20)]
fn peer_every_point(bencher: Bencher<'_, '_>) {
    peer(bencher, false);
}

fn peer(bencher: Bencher<'_, '_>, aggregate: bool) {
    let (ctx, data) = (Context::default(), data());
    let lines: Vec<Vec<PlotPoint>> = data
        .values
        .iter()
        .map(|values| data.time_s.iter().zip(values).map(|(t, y)| PlotPoint::new(*t, *y)).collect())
        .collect();
    bencher.bench_local(|| {
        frame(&ctx, |ui| {
            for (index, points) in lines.iter().enumerate() {
                Plot::new(index).height(240.0).show(ui, |plot_ui| {
                    plot_ui.line(Line::new("y", PlotPoints::Borrowed(points)).allow_band(aggregate));
                });
            }
        })
    });
}
