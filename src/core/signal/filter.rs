//! Low-pass filters without phase: designed as second-order sections, run forwards and backwards.
//!
//! At both ends the signal is continued by its point reflection, and every section starts in the steady state
//! of its first input, so that a constant passes unchanged. A signal shorter than the continuation is continued
//! by what there is of it.

use std::f64::consts::PI;

/// Periods of the cut-off by which a signal is continued: long enough for the transient of a steep start to
/// die out before the signal begins.
const CONTINUED_PERIODS: f64 = 6.0;

/// A digital low-pass filter of even order that is applied forwards and backwards.
#[derive(Clone, Debug, PartialEq)]
pub struct ZeroPhase {
    sections: Vec<Section>,
    /// Samples by which a signal is continued at each end.
    reach: usize,
}

/// One second-order section with gain 1 at standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    /// Numerator b·(1, 2, 1).
    b: f64,
    /// Denominator (1, a1, a2).
    a1: f64,
    a2: f64,
}

impl ZeroPhase {
    /// Butterworth, maximally flat. `cutoff` in cycles per sample, in (0, 0.5): the gain there is 1/√2 for
    /// each direction, 1/2 in all. `order` is rounded up to an even number.
    pub fn butterworth(order: usize, cutoff: f64) -> Self {
        Self::from_poles(order, cutoff, |angle| (angle.cos(), angle.sin()))
    }

    /// Chebyshev type I: ripple of `ripple_db` in the pass band up to `cutoff` (cycles per sample, in
    /// (0, 0.5)), steeper than Butterworth. Gain 1 at standstill, so the ripple goes up from there.
    pub fn chebyshev(order: usize, ripple_db: f64, cutoff: f64) -> Self {
        let epsilon = (10_f64.powf(ripple_db / 10.0) - 1.0).sqrt();
        let width = (1.0 / epsilon).asinh() / even(order) as f64;
        Self::from_poles(order, cutoff, |angle| (width.sinh() * angle.cos(), width.cosh() * angle.sin()))
    }

    /// `pole` gives (−Re, Im) of the analogue prototype's pole at an angle from the negative real axis.
    fn from_poles(order: usize, cutoff: f64, pole: impl Fn(f64) -> (f64, f64)) -> Self {
        let order = even(order);
        let warped = (PI * cutoff).tan();
        let section = |k: usize| {
            let (decay, frequency) = pole(PI * (2 * k + 1) as f64 / (2 * order) as f64);
            // s² + p s + q with the bilinear transform s = (1 − z⁻¹)/(1 + z⁻¹).
            let (p, q) = (2.0 * decay * warped, (decay * decay + frequency * frequency) * warped * warped);
            let scale = 1.0 + p + q;
            Section { b: q / scale, a1: 2.0 * (q - 1.0) / scale, a2: (1.0 - p + q) / scale }
        };
        Self { sections: (0..order / 2).map(section).collect(), reach: (CONTINUED_PERIODS / cutoff) as usize }
    }

    /// The filtered signal, of the same length.
    ///
    /// ```
    /// use flqr_core::signal::filter::ZeroPhase;
    ///
    /// let filter = ZeroPhase::butterworth(4, 0.05);
    /// let noisy: Vec<f64> = (0..1000).map(|i| if i % 2 == 0 { 1.1 } else { 0.9 }).collect();
    /// assert!((filter.apply(&noisy)[500] - 1.0).abs() < 1e-3);
    /// ```
    pub fn apply(&self, signal: &[f64]) -> Vec<f64> {
        let reach = self.reach.min(signal.len().saturating_sub(1));
        let mut padded = continued(signal, reach);
        for _direction in 0..2 {
            self.sections.iter().for_each(|section| section.run(&mut padded));
            padded.reverse();
        }
        padded.drain(..reach);
        padded.truncate(signal.len());
        padded
    }

    /// Gain of both directions together at a frequency in cycles per sample.
    pub fn gain(&self, frequency: f64) -> f64 {
        self.sections.iter().map(|section| section.power(frequency)).product()
    }
}

fn even(order: usize) -> usize {
    order.max(1).next_multiple_of(2)
}

/// The signal with its point reflections of `reach` samples at both ends.
fn continued(signal: &[f64], reach: usize) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (signal.first(), signal.last()) else { return Vec::new() };
    let before = signal[1..=reach].iter().rev().map(|value| 2.0 * first - value);
    let after = signal[signal.len() - 1 - reach..signal.len() - 1].iter().rev();
    let after = after.map(|value| 2.0 * last - value);
    before.chain(signal.iter().copied()).chain(after).collect()
}

impl Section {
    /// Filters in place (transposed direct form II), starting in the steady state of the first value.
    fn run(self, signal: &mut [f64]) {
        let Self { b, a1, a2 } = self;
        let first = signal.first().copied().unwrap_or(0.0);
        let mut later = (b - a2) * first;
        let mut next = (2.0 * b - a1) * first + later;
        for value in signal {
            let input = *value;
            let output = b * input + next;
            next = 2.0 * b * input - a1 * output + later;
            later = b * input - a2 * output;
            *value = output;
        }
    }

    /// Squared gain of one direction.
    fn power(self, frequency: f64) -> f64 {
        let (c1, c2) = ((2.0 * PI * frequency).cos(), (4.0 * PI * frequency).cos());
        let Self { b, a1, a2 } = self;
        let numerator = b * b * (2.0 + 2.0 * c1).powi(2);
        numerator / (1.0 + a1 * a1 + a2 * a2 + 2.0 * a1 * (1.0 + a2) * c1 + 2.0 * a2 * c2)
    }
}

/// First derivative by central differences, one-sided at the ends; `step` is the distance of samples.
///
/// ```
/// use flqr_core::signal::filter::derivative;
///
/// assert_eq!(derivative(&[0.0, 1.0, 4.0, 9.0], 1.0), [1.0, 2.0, 4.0, 5.0]);
/// ```
pub fn derivative(signal: &[f64], step: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let slope = |index: usize| {
        let (from, to) = (index.saturating_sub(1), (index + 1).min(last));
        if to == from { 0.0 } else { (signal[to] - signal[from]) / ((to - from) as f64 * step) }
    };
    (0..signal.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave() -> Vec<f64> {
        let at = |k: f64| (0.05 * k).sin() + 0.3 * (0.9 * k).cos() + 0.01 * k;
        (0..60).map(|k| at(f64::from(k))).collect()
    }

    fn check(found: &[f64], expected: &[f64]) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
        }
    }

    /// SciPy 1.17: `sosfiltfilt(butter(4, 0.2, output='sos'), x, padlen=59)` and
    /// `sosfiltfilt(cheby1(8, 0.05, 0.08, output='sos'), x, padlen=59) * 10**(0.05/10)` with
    /// x = sin(0.05 k) + 0.3 cos(0.9 k) + 0.01 k, k = 0…59.
    #[test]
    fn filtered_wave_agrees_with_scipy() {
        let chosen = |signal: Vec<f64>| [0, 1, 17, 38, 59].map(|index| signal[index]);
        check(
            &chosen(ZeroPhase::butterworth(4, 0.1).apply(&wave())),
            &[
                0.3000001215823622,
                0.20157733669760863,
                0.9082159418262342,
                1.3134819017505637,
                0.4944559411735306,
            ],
        );
        check(
            &chosen(ZeroPhase::chebyshev(8, 0.05, 0.04).apply(&wave())),
            &[
                0.30441609148218746,
                0.3110611290354269,
                0.9188920211637023,
                1.307753530378789,
                0.49759217555147733,
            ],
        );
    }

    /// SciPy 1.17: `abs(sosfreqz(butter(4, 0.2, output='sos'), 2*pi*f)[1])**2`.
    #[test]
    fn gain_agrees_with_scipy() {
        let filter = ZeroPhase::butterworth(4, 0.1);
        check(
            &[0.05, 0.1, 0.2].map(|frequency| filter.gain(frequency)),
            &[0.9968223243819517, 0.5, 0.0015974440894568683],
        );
    }

    #[test]
    fn constants_and_short_signals_pass() {
        for length in 0..40 {
            let filtered = ZeroPhase::chebyshev(8, 0.05, 0.1).apply(&vec![2.5; length]);
            assert_eq!(filtered.len(), length);
            assert!(filtered.iter().all(|value| (value - 2.5).abs() < 1e-9), "{length}: {filtered:?}");
        }
    }

    #[test]
    fn derivative_of_a_parabola_is_exact_inside() {
        let parabola: Vec<f64> = (0..5).map(|k| f64::from(k).powi(2)).collect();
        assert_eq!(derivative(&parabola, 0.5), [2.0, 4.0, 8.0, 12.0, 14.0]);
        assert_eq!(derivative(&[1.0], 0.5), [0.0]);
        assert_eq!(derivative(&[], 0.5), [0.0; 0]);
    }
}
