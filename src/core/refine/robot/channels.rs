//! The residuals as two white channels.
//!
//! The gyro's noise enters r1 and r2 by way of θ̈ in one fixed ratio; c = r1 − κ r2 is free of it, and white like the
//! random forces that every robot feels. b = r2 + β c is what of r2 is independent of c. Each is made white by its own
//! filter, from a spectrum in which the lowest frequencies, where effects sit, are taken to be as strong as those above,
//! and lines as strong as what is beside them: structure stays visible as variance above 1.

use std::f64::consts::TAU;

use super::candidates::quantile;
use super::trace::{Pair, Part, Trace};

const ORDER: usize = 10;
/// Beginning of a log that is not used, s: what friction held before it, and how the robot moved, nobody knows.
const BEGINNING_S: f64 = 1.0;
/// Rows of one piece of the spectrum.
const PIECE: usize = 512;
/// Band whose level is taken for all that is below it, Hz.
const BAND_HZ: [f64; 2] = [3.0, 8.0];
/// Noise is smooth over the frequency: what is beyond the median of its neighbours, so far on both sides, Hz, by so many
/// standard deviations of a mean over pieces, is a line that something draws.
const NEIGHBOURS_HZ: f64 = 3.0;
const LINE: f64 = 5.0;

/// From r1 and r2 to white rows.
pub(super) struct Channels {
    kappa: f64,
    beta: f64,
    filters: [Filter; 2],
    /// Root mean square of c, r1 and r2 where there is nothing but noise.
    pub(super) floors: [f64; 3],
    /// Rows of the trace that are used, and those that are held out.
    rows: Vec<usize>,
    held_out: Vec<usize>,
}

#[derive(Clone)]
struct Filter {
    weights: [f64; ORDER],
    scale: f64,
}

impl Channels {
    /// From what is left of r1 and r2 on the rows for fitting.
    pub(super) fn new(trace: &Trace, left: &Pair) -> Self {
        let p = &trace.machine.parameters;
        let c = p.coefficients();
        let lever = p.body_mass_kg * p.com_height_m;
        let kappa = (c.c1 + lever) / (c.c3 + lever * p.wheel_radius_m);
        let parts = trace.parts();
        let runs: Vec<Vec<usize>> = trace
            .runs()
            .into_iter()
            .map(|run| run.rows.filter(|&row| parts[row] == Part::Fit).collect::<Vec<_>>())
            .filter(|rows| !rows.is_empty())
            .collect();
        let step_s = trace.step_s();
        let density = |column: &[f64]| Spectrum::new(column, &runs, step_s);
        let spectra = [density(&left[0]), density(&left[1])];
        let level = |spectrum: &Spectrum| spectrum.level([1.5, 5.0]);
        let (first, second) = (level(&spectra[0]), level(&spectra[1]));
        let beta = kappa * second / (first + kappa * kappa * second);
        let mixed = mixed(left, kappa, beta);
        let mut spectra = [density(&mixed[0]), density(&mixed[1]), spectra[0].clone(), spectra[1].clone()];
        spectra.iter_mut().for_each(Spectrum::leave_noise);
        let floors = [0, 2, 3].map(|i: usize| spectra[i].correlation(0).sqrt());
        let filters = [0, 1].map(|i: usize| Filter::new(&spectra[i]));
        let beginning = ORDER.max((BEGINNING_S / step_s) as usize);
        let rows = runs.iter().flat_map(|run| run.iter().copied().skip(beginning)).collect();
        let unseen = |run: super::trace::Run| {
            let start = run.rows.start;
            run.rows
                .filter(|&row| parts[row] == Part::HeldOut && row >= start + beginning)
                .collect::<Vec<_>>()
        };
        let held_out = trace.runs().into_iter().flat_map(unseen).collect();
        Self { kappa, beta, filters, floors, rows, held_out }
    }

    /// Rows of the trace in their order; white columns hold those of c, then those of b.
    pub(super) fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// c of r1 and r2, N.
    pub(super) fn combined(&self, pair: &Pair) -> Vec<f64> {
        pair[0].iter().zip(&pair[1]).map(|(r1, r2)| r1 - self.kappa * r2).collect()
    }

    /// Rows of the trace that are held out, in the order of what is [`Channels::unseen`].
    pub(super) fn held_out(&self) -> &[usize] {
        &self.held_out
    }

    /// The white rows of a column where it is held out.
    pub(super) fn unseen(&self, pair: &Pair) -> Vec<f64> {
        self.whitened(pair, &self.held_out)
    }

    /// The white rows of a column.
    pub(super) fn white(&self, pair: &Pair) -> Vec<f64> {
        self.whitened(pair, &self.rows)
    }

    fn whitened(&self, pair: &Pair, rows: &[usize]) -> Vec<f64> {
        let mixed = mixed(pair, self.kappa, self.beta);
        let mut white = Vec::with_capacity(2 * rows.len());
        for (column, filter) in mixed.iter().zip(&self.filters) {
            white.extend(rows.iter().map(|&row| filter.at(column, row)));
        }
        white
    }
}

fn mixed(pair: &Pair, kappa: f64, beta: f64) -> Pair {
    let c: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(r1, r2)| r1 - kappa * r2).collect();
    let b = pair[1].iter().zip(&c).map(|(r2, c)| r2 + beta * c).collect();
    [c, b]
}

impl Filter {
    /// Predicts a row from those before it.
    fn new(spectrum: &Spectrum) -> Self {
        let mut products = [0.0; ORDER + 1];
        products.iter_mut().enumerate().for_each(|(lag, value)| *value = spectrum.correlation(lag));
        products[0] *= 1.0 + 1e-4;
        let (mut weights, mut error) = ([0.0; ORDER], products[0]);
        for order in 0..ORDER {
            let known: f64 = (0..order).map(|i| weights[i] * products[order - i]).sum();
            let reflection = (products[order + 1] - known) / error;
            let before: [f64; ORDER] = weights;
            for i in 0..order {
                weights[i] = before[i] - reflection * before[order - 1 - i];
            }
            weights[order] = reflection;
            error *= 1.0 - reflection * reflection;
        }
        Self { weights, scale: 1.0 / error.max(1e-300).sqrt() }
    }

    fn at(&self, column: &[f64], row: usize) -> f64 {
        let past = column[row - ORDER..row].iter().rev();
        let said: f64 = self.weights.iter().zip(past).map(|(w, v)| w * v).sum();
        self.scale * (column[row] - said)
    }
}

/// Power at PIECE/2 + 1 frequencies, averaged over half-overlapping pieces.
#[derive(Clone)]
struct Spectrum {
    power: Vec<f64>,
    step_s: f64,
    pieces: f64,
}

impl Spectrum {
    fn new(column: &[f64], runs: &[Vec<usize>], step_s: f64) -> Self {
        let longest = runs.iter().map(Vec::len).max().unwrap_or(0);
        let size = PIECE.min(longest.max(16)) / 2 * 2;
        let window: Vec<f64> =
            (0..size).map(|i| 0.5 - 0.5 * libm::cos(TAU * (i as f64 + 0.5) / size as f64)).collect();
        let turns: Vec<(f64, f64)> = (0..size).map(|i| libm::sincos(TAU * i as f64 / size as f64)).collect();
        let norm: f64 = window.iter().map(|w| w * w).sum();
        let (mut power, mut count) = (vec![0.0; size / 2 + 1], 0.0);
        for run in runs {
            for start in (0..run.len().saturating_sub(size - 1)).step_by(size / 2) {
                let piece: Vec<f64> = run[start..start + size].iter().map(|&row| column[row]).collect();
                let mean = piece.iter().sum::<f64>() / size as f64;
                let piece: Vec<f64> = piece.iter().zip(&window).map(|(v, w)| (v - mean) * w).collect();
                for (frequency, power) in power.iter_mut().enumerate() {
                    let (mut re, mut im) = (0.0, 0.0);
                    for (i, value) in piece.iter().enumerate() {
                        let (sin, cos) = turns[i * frequency % size];
                        re += value * cos;
                        im += value * sin;
                    }
                    *power += (re * re + im * im) / norm;
                }
                count += 1.0;
            }
        }
        let pieces = f64::max(count, 1.0);
        power.iter_mut().for_each(|power| *power = (*power / pieces).max(1e-300));
        Self { power, step_s, pieces }
    }

    fn hz(&self, place: usize) -> f64 {
        place as f64 / (2 * (self.power.len() - 1)) as f64 / self.step_s
    }

    /// Powers from one frequency to another.
    fn inside(&self, band: [f64; 2]) -> Vec<f64> {
        let places = (0..self.power.len()).filter(|&place| (band[0]..=band[1]).contains(&self.hz(place)));
        places.map(|place| self.power[place]).collect()
    }

    fn level(&self, band: [f64; 2]) -> f64 {
        let inside = self.inside(band);
        if inside.is_empty() { self.power[0] } else { inside.iter().sum::<f64>() / inside.len() as f64 }
    }

    /// Multiple of the noise from which on there is a line.
    fn line(&self) -> f64 {
        1.0 + LINE / self.pieces.sqrt()
    }

    /// Mean level between two frequencies of what is no line.
    fn level_without_lines(&self, band: [f64; 2]) -> f64 {
        let inside = self.inside(band);
        let most = self.line() * quantile(&inside, 0.5);
        let noise = inside.iter().filter(|power| **power <= most);
        noise.clone().sum::<f64>() / f64::max(noise.count() as f64, 1.0)
    }

    /// Takes out what is not noise.
    fn leave_noise(&mut self) {
        let beside = |hz: f64| [(hz - NEIGHBOURS_HZ).max(BAND_HZ[0]), hz + NEIGHBOURS_HZ];
        let low = self.level_without_lines(BAND_HZ);
        let noise = |place: usize| {
            let hz = self.hz(place);
            if hz < BAND_HZ[0] {
                return low;
            }
            let level = self.level_without_lines(beside(hz));
            if self.power[place] > self.line() * level { level } else { self.power[place] }
        };
        self.power = (0..self.power.len()).map(noise).collect();
    }

    fn correlation(&self, lag: usize) -> f64 {
        let last = self.power.len() - 1;
        let wave = |place: usize| libm::cos(std::f64::consts::PI * (place * lag) as f64 / last as f64);
        let inner: f64 = (1..last).map(|place| 2.0 * self.power[place] * wave(place)).sum();
        (self.power[0] + inner + self.power[last] * wave(last)) / (2 * last) as f64
    }
}
