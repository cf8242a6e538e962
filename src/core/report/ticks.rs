//! Positions and labels of axis ticks.

use super::chart::Scale;
use super::number;

/// A place on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

/// Ticks within `range` (`range[0] < range[1]`, positive for a logarithmic axis), about `count` of them.
pub(super) fn ticks(scale: Scale, range: [f64; 2], count: usize) -> Vec<Tick> {
    match scale {
        Scale::Log if libm::log10(range[1] / range[0]) >= 2.0 => decades(range, count),
        _ => linear(range, count),
    }
}

/// At multiples of 1, 2 or 5 times a power of ten: the step that gives the most ticks up to `count`.
fn linear(range: [f64; 2], count: usize) -> Vec<Tick> {
    let [low, high] = range;
    let least_step = (high - low) / count.max(1) as f64;
    let power = libm::floor(libm::log10(least_step)) as i32;
    // A step that is a whole multiple of ten to `power`, so that no rounding creeps in: value = multiple·10^power.
    let multiple =
        [1, 2, 5, 10].into_iter().find(|&m| f64::from(m) * ten_to(power) >= least_step * (1.0 - 1e-9));
    let multiple = multiple.unwrap_or(10);
    let step = f64::from(multiple) * ten_to(power);
    let slack = 1e-6 * step;
    let first = libm::ceil((low - slack) / step) as i64;
    let last = libm::floor((high + slack) / step) as i64;
    let decimals = usize::try_from(-(power + i32::from(multiple == 10))).unwrap_or(0);
    let largest = low.abs().max(high.abs());
    let plain = decimals <= 4 && largest < 1e5;
    let digits = usize::try_from(libm::floor(libm::log10(largest)) as i32 - power + 1).unwrap_or(1);
    (first..=last)
        .map(|index| {
            let units = index * i64::from(multiple);
            let value = units as f64 * ten_to(power);
            let label =
                if plain { number::fixed(value, decimals) } else { number::scientific(value, digits) };
            Tick { value, label }
        })
        .collect()
}

/// At powers of ten, leaving out as many between two as `count` asks for.
fn decades(range: [f64; 2], count: usize) -> Vec<Tick> {
    let first = libm::ceil(libm::log10(range[0]) - 1e-9) as i32;
    let last = libm::floor(libm::log10(range[1]) + 1e-9) as i32;
    let stride = (last - first + 1).unsigned_abs().div_ceil(count.max(1) as u32).max(1);
    (first..=last)
        .step_by(stride as usize)
        .map(|power| Tick { value: ten_to(power), label: number::power_of_ten(power) })
        .collect()
}

/// Exact where a double can be.
fn ten_to(power: i32) -> f64 {
    if power >= 0 { libm::pow(10.0, f64::from(power)) } else { 1.0 / libm::pow(10.0, f64::from(-power)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, range: [f64; 2], count: usize) -> Vec<String> {
        ticks(scale, range, count).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_at_round_values() {
        for (range, count, expected) in [
            ([0.0, 1.0], 5, "0.0 0.2 0.4 0.6 0.8 1.0"),
            ([0.0, 60.0], 6, "0 10 20 30 40 50 60"),
            ([-0.07, 0.12], 5, "−0.05 0.00 0.05 0.10"),
            ([-50.0, 50.0], 5, "−40 −20 0 20 40"),
            ([0.0, 10.0], 10, "0 1 2 3 4 5 6 7 8 9 10"),
            ([1.0, 9.5e4], 3, "0 50000"),
            ([0.0, 3e-5], 3, "0 1·10⁻⁵ 2·10⁻⁵ 3·10⁻⁵"),
            ([99_990.0, 100_010.0], 2, "9.999·10⁴ 1·10⁵ 1.0001·10⁵"),
            ([0.3, 0.7], 4, "0.3 0.4 0.5 0.6 0.7"),
        ] {
            let expected: Vec<_> =
                expected.split(' ').filter(|label| *label != "0" || range[0] <= 0.0).collect();
            assert_eq!(labels(Scale::Linear, range, count), expected, "{range:?} {count}");
        }
    }

    #[test]
    fn there_are_never_more_than_asked_for_and_one_and_all_lie_inside() {
        for count in 1..12 {
            for range in [[-3.7, 12.9], [0.0, 1e-9], [1e6, 1.5e6], [-1e-3, 7e-3], [0.1, 0.3]] {
                let found = ticks(Scale::Linear, range, count);
                assert!(found.len() <= count + 1, "{range:?} {count}: {}", found.len());
                let slack = 1e-6 * (range[1] - range[0]);
                let inside = |tick: &Tick| tick.value >= range[0] - slack && tick.value <= range[1] + slack;
                assert!(found.iter().all(inside));
            }
        }
    }

    #[test]
    fn logarithmic_axes_have_powers_of_ten() {
        assert_eq!(labels(Scale::Log, [0.0015, 20.0], 6), ["10⁻²", "10⁻¹", "1", "10"]);
        assert_eq!(labels(Scale::Log, [1e-9, 1.0], 4), ["10⁻⁹", "10⁻⁶", "10⁻³", "1"]);
        assert_eq!(labels(Scale::Log, [2.0, 8.0], 4), ["2", "4", "6", "8"]);
    }
}
