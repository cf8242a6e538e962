//! Amplitude spectrum and power spectral density of a curve without gaps.
//!
//! The mean is taken off, a Hann window is laid over. Up to 65 536 samples are one window, filled up with zeros to
//! a power of two; of more, windows of 32 768 samples are averaged (Welch), half of each over the next, at most 32
//! of them, spread evenly.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

/// Longest single window, samples.
const LONGEST: usize = 1 << 16;
/// Windows that are averaged.
const MOST_WINDOWS: usize = 32;
/// Fewer samples have no spectrum.
const FEWEST: usize = 16;

/// A spectrum; the lists are equally long.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// From above zero to half the rate, Hz.
    pub frequency_hz: Vec<f64>,
    /// Peak value of a sine of that frequency, in the curve's unit.
    pub amplitude: Vec<f64>,
    /// One-sided, in the square of the curve's unit by hertz.
    pub density: Vec<f64>,
    /// Windows that were averaged.
    pub windows: usize,
}

impl Spectrum {
    /// Computes the spectrum of samples at a fixed rate, Hz; `None` of fewer than 16 samples or for a rate that is not
    /// positive.
    ///
    /// ```
    /// use flqr_core::signal::Spectrum;
    /// let sine: Vec<f64> = (0..4096).map(|i| 0.3 * (2.0 * std::f64::consts::PI * 62.5 * i as f64 / 1000.0).sin()).collect();
    /// let spectrum = Spectrum::of(&sine, 1000.0).unwrap();
    /// let peak = spectrum.amplitude.iter().copied().fold(0.0, f64::max);
    /// assert!((peak - 0.3).abs() < 1e-3);
    /// ```
    pub fn of(values: &[f64], rate_hz: f64) -> Option<Self> {
        if values.len() < FEWEST || !(rate_hz.is_finite() && rate_hz > 0.0) {
            return None;
        }
        let length = if values.len() > LONGEST { LONGEST / 2 } else { values.len() };
        let window: Vec<f64> =
            (0..length).map(|index| 0.5 - 0.5 * (TAU * index as f64 / length as f64).cos()).collect();
        let size = length.next_power_of_two();
        let transform = RealFftPlanner::<f64>::new().plan_fft_forward(size);
        let (mut padded, mut bins) = (transform.make_input_vec(), transform.make_output_vec());
        let mut power = vec![0.0; size / 2];
        let starts = starts(values.len(), length);
        for start in &starts {
            let part = &values[*start..start + length];
            let mean = part.iter().sum::<f64>() / length as f64;
            padded.fill(0.0);
            for ((padded, value), weight) in padded.iter_mut().zip(part).zip(&window) {
                *padded = (value - mean) * weight;
            }
            // It fails only for buffers of another length.
            transform.process(&mut padded, &mut bins).ok()?;
            for (sum, bin) in power.iter_mut().zip(&bins[1..]) {
                *sum += bin.norm_sqr();
            }
        }
        let count = starts.len() as f64;
        let sum: f64 = window.iter().sum();
        let squares: f64 = window.iter().map(|weight| weight * weight).sum();
        let one_sided = |bin: usize| if bin + 1 == size / 2 { 1.0 } else { 2.0 };
        let per_bin = |(bin, power): (usize, &f64)| (one_sided(bin), power / count);
        Some(Self {
            frequency_hz: (1..=size / 2).map(|bin| bin as f64 * rate_hz / size as f64).collect(),
            amplitude: power.iter().enumerate().map(per_bin).map(|(f, p)| f * p.sqrt() / sum).collect(),
            density: power
                .iter()
                .enumerate()
                .map(per_bin)
                .map(|(f, p)| f * p / (rate_hz * squares))
                .collect(),
            windows: starts.len(),
        })
    }
}

/// Start of windows.
fn starts(samples: usize, length: usize) -> Vec<usize> {
    let room = samples - length;
    let count = (room / (length / 2) + 1).min(MOST_WINDOWS);
    (0..count).map(|number| if count > 1 { room * number / (count - 1) } else { 0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_shows_its_amplitude_at_its_frequency() {
        for samples in [4096, 5000, 200_000] {
            let sine = |index: usize| 40.0 + 0.3 * (TAU * 31.25 * index as f64 * 1e-3).sin();
            let values: Vec<f64> = (0..samples).map(sine).collect();
            let found = Spectrum::of(&values, 1000.0).unwrap();
            let peak =
                (0..found.amplitude.len()).max_by(|a, b| found.amplitude[*a].total_cmp(&found.amplitude[*b]));
            let peak = peak.unwrap();
            assert!((found.frequency_hz[peak] - 31.25).abs() < 0.2, "{}", found.frequency_hz[peak]);
            assert!((found.amplitude[peak] - 0.3).abs() < 0.01, "{}", found.amplitude[peak]);
            assert_eq!(found.windows, if samples > LONGEST { 11 } else { 1 });
        }
    }

    #[test]
    fn the_density_adds_up_to_the_variance() {
        let mut state = 1_u64;
        let noise = |_: i32| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1 << 31) - 0.5
        };
        let values: Vec<f64> = (0..150_000).map(noise).collect();
        let found = Spectrum::of(&values, 500.0).unwrap();
        let width = found.frequency_hz[1] - found.frequency_hz[0];
        let variance = found.density.iter().sum::<f64>() * width;
        assert!((variance * 12.0 - 1.0).abs() < 0.02, "{variance}");
    }

    #[test]
    fn too_little_has_no_spectrum() {
        assert_eq!(Spectrum::of(&[1.0; 15], 1.0), None);
        assert_eq!(Spectrum::of(&[1.0; 100], f64::NAN), None);
        assert!(Spectrum::of(&[1.0; 100], 1.0).unwrap().amplitude.iter().all(|amplitude| *amplitude < 1e-12));
    }
}
