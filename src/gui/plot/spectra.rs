//! Spectra of what is visible, as plots of their own below each other.

use std::collections::BTreeMap;

use egui::{Color32, RichText, Ui, vec2};

use super::decimate::{Curve, DecimationCache, Indexed};
use super::spectrum::Spectrum;
use super::unit::label;
use super::view::{Drawing, TimePlot, TimeView, columns, interact, y_range};
use crate::widgets::{mono, shown};

/// While the range moves, a spectrum is made anew at most this often, s.
const INTERVAL_S: f64 = 0.25;
/// Room for the strongest frequency at the right.
const PEAK_WIDTH: f32 = 118.0;
/// What is weaker than the strongest by more than this, as a power of ten, is not worth the room.
const DECADES: f64 = 6.0;

/// What is shown of a spectrum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Measure {
    #[default]
    Amplitude,
    Density,
}

impl Measure {
    pub(super) const ALL: [(Self, &'static str, &'static str); 2] = [
        (Self::Amplitude, "Amplitude", "Peak value of the sine at each frequency (Hann window)"),
        (Self::Density, "Density", "One-sided power spectral density (Hann window)"),
    ];

    fn unit(self, unit: &str) -> String {
        match self {
            Self::Amplitude => unit.to_owned(),
            Self::Density => format!("({unit})²/Hz"),
        }
    }
}

/// The spectrum of one curve, and what it was made of.
#[derive(Default)]
struct Entry {
    of: Option<(u64, [u64; 2])>,
    made_s: f64,
    generation: u64,
    spectrum: Spectrum,
    /// Logarithms of amplitude and density.
    logarithms: [Vec<f64>; 2],
    caches: [DecimationCache; 2],
    problem: Option<&'static str>,
}

/// Spectra of a stack.
pub(super) struct Spectra {
    pub(super) measure: Measure,
    view: TimeView,
    entries: BTreeMap<String, Entry>,
    reach_hz: f64,
}

impl Default for Spectra {
    fn default() -> Self {
        let view = TimeView::following(1.0);
        Self { measure: Measure::default(), view, entries: BTreeMap::new(), reach_hz: 0.0 }
    }
}

impl Spectra {
    /// Makes the spectrum of a curve anew where data or range have changed, though not too often.
    pub(super) fn update<'c>(
        &mut self,
        ui: &Ui,
        key: String,
        generation: u64,
        range: [f64; 2],
        curve: impl FnOnce() -> Indexed<'c>,
    ) {
        let entry = self.entries.entry(key).or_default();
        let now = ui.input(|input| input.time);
        let of = Some((generation, range.map(f64::to_bits)));
        if entry.of == of {
            return;
        }
        if entry.of.is_some() && now - entry.made_s < INTERVAL_S {
            return ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(INTERVAL_S));
        }
        entry.take(&curve(), range);
        (entry.of, entry.made_s) = (of, now);
        entry.generation += 1;
    }

    /// Takes note of the highest frequency; before the plots.
    pub(super) fn begin(&mut self) {
        let ends = self.entries.values().filter_map(|entry| entry.spectrum.frequency_hz.last().copied());
        let reach = ends.fold(0.0, f64::max);
        if self.view.follow || (reach - self.reach_hz).abs() > 0.01 * reach {
            self.view.show_all([0.0, reach.max(1e-3)]);
        }
        self.reach_hz = reach;
    }

    pub(super) fn plot_ui(
        &mut self,
        ui: &mut Ui,
        id: &str,
        (name, unit): (&str, &str),
        (height, last): (f32, bool),
        curves: &[(String, String, Color32)],
    ) {
        let measure = self.measure;
        let y_label = label(name, &measure.unit(unit));
        let x_label = last.then_some("frequency [Hz]");
        let plot = TimePlot { id, label: &y_label, height, x_label, min_y_span: 1.0 };
        ui.horizontal_top(|ui| {
            let width = (ui.available_width() - PEAK_WIDTH).max(1.0);
            ui.allocate_ui(vec2(width, height), |ui| {
                let (range, columns) = (self.view.range(), columns(ui));
                for (key, ..) in curves {
                    if let Some(entry) = self.entries.get_mut(key) {
                        let (x, y) = (&entry.spectrum.frequency_hz, &entry.logarithms[measure as usize]);
                        let curve = Curve { x, y, scale: 1.0, gap: f64::INFINITY };
                        entry.caches[measure as usize].visible(curve, entry.generation, range, columns);
                    }
                }
                let entries =
                    curves.iter().filter_map(|(key, _, color)| Some((self.entries.get(key)?, color)));
                let visible: Vec<_> = entries
                    .map(|(entry, color)| (*color, entry.caches[measure as usize].last_visible()))
                    .collect();
                let ends = visible.iter().filter_map(|(_, visible)| visible.statistics);
                let ends: Vec<_> =
                    ends.map(|found| [found.min.max(found.max - DECADES), found.max]).collect();
                let mut drawing = Drawing { y_range: y_range(ends.into_iter(), 1.0), ..Drawing::default() };
                drawing.extras.logarithmic = true;
                drawing.lines =
                    visible.into_iter().map(|(color, visible)| (color, visible.pieces.as_slice())).collect();
                let shown = plot.draw(ui, range, &drawing, |_| {});
                interact(ui, &shown, &mut self.view, true);
                shown.response.accessible_name(format!("spectrum of {y_label}"));
            });
            ui.vertical(|ui| self.peaks_ui(ui, &y_label, curves));
        });
    }

    fn peaks_ui(&self, ui: &mut Ui, name: &str, curves: &[(String, String, Color32)]) {
        ui.spacing_mut().item_spacing.y = 2.0;
        ui.add_space(6.0);
        ui.label(RichText::new(name).small().weak());
        for (key, name, color) in curves {
            let Some(entry) = self.entries.get(key) else { continue };
            if let Some(problem) = entry.problem {
                ui.label(RichText::new(problem).small().weak());
                continue;
            }
            let spectrum = &entry.spectrum;
            let values = match self.measure {
                Measure::Amplitude => &spectrum.amplitude,
                Measure::Density => &spectrum.density,
            };
            let strongest = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]));
            let Some(strongest) = strongest else { continue };
            let text = format!("{} Hz", shown(spectrum.frequency_hz[strongest], 4));
            let help = format!(
                "{name}: strongest frequency, and its value; mean of {} windows over the visible range",
                spectrum.windows
            );
            ui.label(mono(text).color(*color)).on_hover_text(&help);
            ui.label(mono(shown(values[strongest], 3)).color(*color)).on_hover_text(help);
        }
    }
}

impl Entry {
    /// Of the longest part of the visible range without a gap.
    fn take(&mut self, curve: &Indexed<'_>, range: [f64; 2]) {
        let run = curve.longest_run(curve.inside(range));
        let values: Vec<f64> = run.clone().map(|index| curve.y(index)).collect();
        let rate_hz = if run.len() > 1 {
            (run.len() - 1) as f64 / (curve.x(run.end - 1) - curve.x(run.start))
        } else {
            f64::NAN
        };
        let found = Spectrum::of(&values, rate_hz);
        self.problem = found.is_none().then_some("too few samples");
        self.spectrum = found.unwrap_or_default();
        // What is exactly nothing has no logarithm, and is a gap.
        self.logarithms = [&self.spectrum.amplitude, &self.spectrum.density]
            .map(|all| all.iter().map(|v| v.log10()).collect());
    }
}
