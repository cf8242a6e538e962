//! Two runs on one clock: the shift at which a signal of one looks most like that of the other, or an event.

/// A signal over time. Times rise; both slices have one length.
#[derive(Clone, Copy, Debug)]
pub struct Signal<'a> {
    /// Times, s.
    pub time_s: &'a [f64],
    /// One value for each; a sample that is not finite is left out.
    pub values: &'a [f64],
}

/// Best alignment of two signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Time shift of the moved signal, s.
    pub shift_s: f64,
    /// Correlation of both there, 1 at most.
    pub correlation: f64,
}

/// Instants at which signals are compared.
const INSTANTS: usize = 1000;
/// Each search after the first is this much finer, around the best so far.
const FINER: f64 = 20.0;
const SEARCHES: usize = 3;
/// Fraction of the shorter signal that has to lie on the other.
const OVERLAP: f64 = 0.5;

/// The shift of `moved` at which its correlation with `fixed` is largest, over all at which half of the shorter
/// one lies on the other; to about a millionth of the longer one's duration. None for signals that are constant,
/// or have fewer than two samples.
///
/// ```
/// use flqr_core::record::{Signal, best_alignment};
///
/// let time_s: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
/// let pulse = |centre_s: f64| time_s.iter().map(|t| (-(t - centre_s).powi(2)).exp()).collect::<Vec<_>>();
/// let (earlier, later) = (pulse(4.0), pulse(5.5));
/// let (fixed, moved) =
///     (Signal { time_s: &time_s, values: &earlier }, Signal { time_s: &time_s, values: &later });
/// let alignment = best_alignment(fixed, moved).ok_or("no alignment")?;
/// assert!((alignment.shift_s + 1.5).abs() < 1e-3 && alignment.correlation > 0.999);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn best_alignment(fixed: Signal<'_>, moved: Signal<'_>) -> Option<Alignment> {
    let (fixed, moved) = (Samples::of(fixed)?, Samples::of(moved)?);
    let least = OVERLAP * fixed.duration().min(moved.duration());
    let (mut low, mut high) = (fixed.start() + least - moved.end(), fixed.end() - least - moved.start());
    let mut best: Option<Alignment> = None;
    let mut step = fixed.duration().max(moved.duration()) / INSTANTS as f64;
    for _ in 0..SEARCHES {
        for index in 0..=((high - low) / step).ceil() as usize {
            let shift_s = low + index as f64 * step;
            let Some(correlation) = correlation(&fixed, &moved, shift_s) else { continue };
            if best.is_none_or(|best| correlation > best.correlation) {
                best = Some(Alignment { shift_s, correlation });
            }
        }
        let shift_s = best?.shift_s;
        (low, high) = (shift_s - step, shift_s + step);
        step /= FINER;
    }
    best
}

/// Time at which a signal first comes to a level, s, between two samples by a line. None where it never does.
///
/// ```
/// use flqr_core::record::{Signal, first_crossing_s};
///
/// let signal = Signal { time_s: &[0.0, 1.0, 2.0], values: &[0.0, 0.0, 4.0] };
/// assert_eq!(first_crossing_s(signal, 1.0), Some(1.25));
/// ```
pub fn first_crossing_s(signal: Signal<'_>, level: f64) -> Option<f64> {
    let samples = Samples::of(signal)?;
    let before = samples.values[0] < level;
    let after = samples.values.iter().position(|value| (*value < level) != before)?;
    let [t0, t1] = [after - 1, after].map(|index| samples.time_s[index]);
    let [v0, v1] = [after - 1, after].map(|index| samples.values[index]);
    Some(t0 + (t1 - t0) * (level - v0) / (v1 - v0))
}

/// The finite samples of a signal, two at least.
struct Samples {
    time_s: Vec<f64>,
    values: Vec<f64>,
}

impl Samples {
    fn of(signal: Signal<'_>) -> Option<Self> {
        let finite = |(time, value): &(&f64, &f64)| time.is_finite() && value.is_finite();
        let (time_s, values): (Vec<f64>, Vec<f64>) =
            signal.time_s.iter().zip(signal.values).filter(finite).unzip();
        (values.len() >= 2 && time_s[0] < time_s[time_s.len() - 1]).then_some(Self { time_s, values })
    }

    fn start(&self) -> f64 {
        self.time_s[0]
    }

    fn end(&self) -> f64 {
        self.time_s[self.time_s.len() - 1]
    }

    fn duration(&self) -> f64 {
        self.end() - self.start()
    }

    /// Value at a time inside; the walk goes on from `index`, because instants rise.
    fn at(&self, time_s: f64, index: &mut usize) -> f64 {
        while *index + 2 < self.time_s.len() && self.time_s[*index + 1] < time_s {
            *index += 1;
        }
        let [t0, t1] = [self.time_s[*index], self.time_s[*index + 1]];
        let [v0, v1] = [self.values[*index], self.values[*index + 1]];
        if t1 > t0 { v0 + (v1 - v0) * ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { v1 }
    }
}

/// Of both where they lie on each other; `None` if either is constant there.
fn correlation(fixed: &Samples, moved: &Samples, shift_s: f64) -> Option<f64> {
    let from = fixed.start().max(moved.start() + shift_s);
    let to = fixed.end().min(moved.end() + shift_s);
    let (mut i, mut j) = (0, 0);
    let (mut sums, mut squares, mut product) = ([0.0; 2], [0.0; 2], 0.0);
    // Counted from the first value: a large offset would cost digits.
    let origin = [fixed.values[0], moved.values[0]];
    for index in 0..INSTANTS {
        let time_s = from + (to - from) * index as f64 / (INSTANTS - 1) as f64;
        let pair = [fixed.at(time_s, &mut i) - origin[0], moved.at(time_s - shift_s, &mut j) - origin[1]];
        for side in 0..2 {
            sums[side] += pair[side];
            squares[side] += pair[side] * pair[side];
        }
        product += pair[0] * pair[1];
    }
    let count = INSTANTS as f64;
    let variance = |side: usize| squares[side] - sums[side] * sums[side] / count;
    let scale = (variance(0) * variance(1)).sqrt();
    let found = (product - sums[0] * sums[1] / count) / scale;
    (variance(0) > 1e-12 * squares[0] && variance(1) > 1e-12 * squares[1] && found.is_finite())
        .then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A response that begins at `start_s`, sampled at its own instants.
    fn response(start_s: f64, from_s: f64, step_s: f64, samples: usize) -> (Vec<f64>, Vec<f64>) {
        let time_s: Vec<f64> = (0..samples).map(|index| from_s + step_s * index as f64).collect();
        let value = |time: &f64| {
            let since = (time - start_s).max(0.0);
            3.0 + (-0.8 * since).exp() * (5.0 * since).sin()
        };
        let values = time_s.iter().map(value).collect();
        (time_s, values)
    }

    #[test]
    fn the_same_response_is_found_at_another_time_and_rate() {
        let (fixed_s, fixed) = response(4.0, 0.0, 0.001, 12_000);
        for (start_s, from_s, step_s, samples) in
            [(4.0, 0.0, 0.001, 12_000), (6.37, 1.0, 0.002, 5_000), (103.2, 100.0, 0.01, 1_100)]
        {
            let (moved_s, moved) = response(start_s, from_s, step_s, samples);
            let found = best_alignment(
                Signal { time_s: &fixed_s, values: &fixed },
                Signal { time_s: &moved_s, values: &moved },
            )
            .unwrap();
            assert!((found.shift_s - (4.0 - start_s)).abs() < 2e-3, "{found:?} for {start_s}");
            assert!(found.correlation > 0.999 && found.correlation <= 1.0 + 1e-9);
        }
    }

    #[test]
    fn a_signal_without_a_shape_is_not_aligned() {
        let (time_s, values) = response(1.0, 0.0, 0.01, 500);
        let shaped = Signal { time_s: &time_s, values: &values };
        let flat = vec![2.5; 500];
        let holes = vec![f64::NAN; 500];
        for other in [&flat, &holes] {
            assert_eq!(best_alignment(shaped, Signal { time_s: &time_s, values: other }), None);
        }
        assert_eq!(best_alignment(shaped, Signal { time_s: &[], values: &[] }), None);
    }

    #[test]
    fn an_event_is_where_the_level_is_first_passed() {
        let time_s = [0.0, 1.0, 2.0, 3.0, 4.0];
        let signal = |values| Signal { time_s: &time_s, values };
        assert_eq!(first_crossing_s(signal(&[0.0, 0.0, 4.0, 0.0, 4.0]), 1.0), Some(1.25));
        assert_eq!(first_crossing_s(signal(&[5.0, 3.0, f64::NAN, 1.0, 0.0]), 2.0), Some(2.0));
        assert_eq!(first_crossing_s(signal(&[0.0; 5]), 1.0), None);
    }
}
