//! Spectra of what is visible, as plots of their own below each other.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Color32, RichText, Ui, vec2};
use flqr_core::signal::Spectrum;

use super::decimate::{Curve, DecimationCache, Snapshot};
use super::unit::label;
use super::view::{Drawing, TimePlot, TimeView, columns, interact, y_range};
use crate::job::{Job, Outcome, Waker};
use crate::widgets::{error_ui, mono, shown};

/// While the range moves, a spectrum is made anew at most this often, s.
const INTERVAL_S: f64 = 0.25;
/// Room for the strongest frequency at the right.
const PEAK_WIDTH: f32 = 118.0;
/// Dynamic range of a spectrum, in powers of ten below its maximum.
const DECADES: f64 = 6.0;

/// Kind of spectrum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Measure {
    #[default]
    Amplitude,
    Density,
}

impl Measure {
    pub(super) const ALL: [(Self, &'static str, &'static str); 2] = [
        (Self::Amplitude, "Amplitude", "Amplitude spectrum, peak value (Hann window)"),
        (Self::Density, "Density", "One-sided power spectral density (Hann window)"),
    ];

    fn unit(self, unit: &str) -> String {
        match self {
            Self::Amplitude => unit.to_owned(),
            Self::Density => format!("({unit})²/Hz"),
        }
    }
}

/// Generation of a curve's data, and the range.
type Of = (u64, [u64; 2]);

/// The spectrum of one curve, and what it was made of.
#[derive(Default)]
struct Entry {
    of: Option<Of>,
    generation: u64,
    found: Found,
    caches: [DecimationCache; 2],
}

/// Result of a worker.
#[derive(Default)]
struct Found {
    spectrum: Spectrum,
    /// Logarithms of amplitude and density.
    logarithms: [Vec<f64>; 2],
    problem: Option<&'static str>,
}

/// Curves that a worker was given.
struct SpectraJob {
    wanted: Vec<(String, Of)>,
    /// Brings one for each.
    job: Job<(), Vec<Found>>,
}

/// Spectra of a stack.
pub(super) struct Spectra {
    pub(super) measure: Measure,
    view: TimeView,
    entries: BTreeMap<String, Entry>,
    job: Option<SpectraJob>,
    /// When the job was started.
    started_s: f64,
    problem: Option<String>,
    reach_hz: f64,
}

impl Default for Spectra {
    fn default() -> Self {
        Self {
            measure: Measure::default(),
            view: TimeView::following(1.0),
            entries: BTreeMap::new(),
            job: None,
            started_s: f64::NEG_INFINITY,
            problem: None,
            reach_hz: 0.0,
        }
    }
}

impl Spectra {
    /// Has the spectra of what has changed made anew by a worker, though not too often; each curve has its name, the
    /// generation of its data, and what to hand to the worker.
    pub(super) fn update(
        &mut self,
        ui: &Ui,
        range: [f64; 2],
        curves: &[(String, u64)],
        mut snapshot: impl FnMut(usize) -> Snapshot,
    ) {
        self.drain();
        self.entries.retain(|key, _| curves.iter().any(|(other, _)| other == key));
        let of = |generation: u64| (generation, range.map(f64::to_bits));
        let is_old = |(key, generation): &(String, u64)| {
            self.entries.get(key).is_none_or(|entry| entry.of != Some(of(*generation)))
        };
        let old: Vec<usize> = (0..curves.len()).filter(|index| is_old(&curves[*index])).collect();
        if old.is_empty() || self.job.is_some() {
            return;
        }
        let now = ui.input(|input| input.time);
        if now - self.started_s < INTERVAL_S {
            return ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(INTERVAL_S));
        }
        self.started_s = now;
        let wanted = old.iter().map(|index| (curves[*index].0.clone(), of(curves[*index].1))).collect();
        let snapshots: Vec<_> = old.into_iter().map(&mut snapshot).collect();
        let ctx = ui.ctx().clone();
        let waker: Waker = Arc::new(move || ctx.request_repaint());
        let work = move |_: &_| snapshots.iter().map(Found::of).collect();
        match Job::start("spectra", &waker, work) {
            Ok(job) => self.job = Some(SpectraJob { wanted, job }),
            Err(error) => self.problem = Some(format!("Cannot start computing the spectra: {error}.")),
        }
    }

    fn drain(&mut self) {
        let Some(SpectraJob { wanted, job }) = &mut self.job else { return };
        let found = match job.poll().1 {
            Outcome::Running => return,
            Outcome::Done(found) => {
                self.problem = None;
                found
            }
            Outcome::Broken => {
                self.problem = Some("Computing the spectra failed: this is an internal error.".to_owned());
                // Not tried again with the same data.
                wanted.iter().map(|_| Found::default()).collect()
            }
        };
        for ((key, of), found) in wanted.drain(..).zip(found) {
            let entry = self.entries.entry(key).or_default();
            (entry.of, entry.found) = (Some(of), found);
            entry.generation += 1;
        }
        self.job = None;
    }

    /// Takes note of the highest frequency; before the plots.
    pub(super) fn begin(&mut self, ui: &mut Ui) {
        if let Some(problem) = &self.problem {
            error_ui(ui, problem);
        }
        let ends =
            self.entries.values().filter_map(|entry| entry.found.spectrum.frequency_hz.last().copied());
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
        let plot = TimePlot { id, label: &y_label, height, x_label };
        ui.horizontal_top(|ui| {
            let width = (ui.available_width() - PEAK_WIDTH).max(1.0);
            ui.allocate_ui(vec2(width, height), |ui| {
                let (range, columns) = (self.view.range(), columns(ui));
                for (key, ..) in curves {
                    if let Some(entry) = self.entries.get_mut(key) {
                        let found = &entry.found;
                        let (x, y) = (&found.spectrum.frequency_hz, &found.logarithms[measure as usize]);
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
            let spectrum = &entry.found.spectrum;
            let waits = (entry.generation == 0).then_some("computing");
            if let Some(problem) = entry.found.problem.or(waits) {
                ui.label(RichText::new(problem).small().weak());
                continue;
            }
            let values = match self.measure {
                Measure::Amplitude => &spectrum.amplitude,
                Measure::Density => &spectrum.density,
            };
            let strongest = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]));
            let Some(strongest) = strongest else { continue };
            let text = format!("{} Hz", shown(spectrum.frequency_hz[strongest], 4));
            let help = format!(
                "{name}: peak frequency and value; average of {} windows in the visible range",
                spectrum.windows
            );
            ui.label(mono(text).color(*color)).on_hover_text(&help);
            ui.label(mono(shown(values[strongest], 3)).color(*color)).on_hover_text(help);
        }
    }
}

impl Found {
    /// Of a curve without gaps at an even rate.
    fn of(curve: &Snapshot) -> Self {
        let values: Vec<f64> = (0..curve.len()).map(|index| curve.y(index)).collect();
        let rate_hz = match curve.len() {
            0 | 1 => f64::NAN,
            length => (length - 1) as f64 / (curve.x(length - 1) - curve.x(0)),
        };
        let found = Spectrum::of(&values, rate_hz);
        let problem = found.is_none().then_some("too few samples");
        let spectrum = found.unwrap_or_default();
        // What is exactly nothing has no logarithm, and is a gap.
        let logarithms =
            [&spectrum.amplitude, &spectrum.density].map(|all| all.iter().map(|v| v.log10()).collect());
        Self { spectrum, logarithms, problem }
    }
}

#[cfg(test)]
mod tests {
    use super::super::decimate::Data;
    use super::*;

    #[test]
    fn a_spectrum_is_of_its_data_once_it_is_made_and_goes_with_its_curve() {
        let x: Vec<f64> = (0..1000).map(|row| f64::from(row) * 1e-3).collect();
        let curve =
            |_| DecimationCache::default().indexed(Data::Fixed(&x, &x), [1.0, 1.0], 1).snapshot(0..1000);
        let mut spectra = Spectra::default();
        egui::__run_test_ui(|ui| {
            let a = [("a".to_owned(), 1)];
            spectra.update(ui, [0.0, 1.0], &a, curve);
            if spectra.job.is_some() {
                assert!(spectra.entries.values().all(|entry| entry.of.is_none()), "it is still being made");
            }
            while spectra.job.is_some() {
                spectra.update(ui, [0.0, 1.0], &a, curve);
                std::thread::yield_now();
            }
            assert_eq!(spectra.entries["a"].of, Some((1, [0.0_f64, 1.0].map(f64::to_bits))));
            spectra.update(ui, [0.0, 1.0], &[("b".to_owned(), 1)], curve);
            assert!(!spectra.entries.contains_key("a"), "nobody looks at it");
        });
    }
}
