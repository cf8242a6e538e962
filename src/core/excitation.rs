//! Motions and torques that make a log worth identifying from: pure functions of time, for the simulated
//! robot as for a real one.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

/// Speeds forward and backward; together the 33 that make 264 pairs, eight each (the paper has 260).
const FORWARD_SPEEDS: usize = 17;
const BACKWARD_SPEEDS: usize = 16;
/// Fastest speed, rad/s (section 4.2).
const FASTEST_RAD_S: f64 = 50.0;
/// Slowest speed, rad/s: there the curve is steepest and the paper's data end too early, but a shaft under
/// speed control still turns without stopping.
const SLOWEST_RAD_S: f64 = 0.1;
/// Change of speed between two dwells, rad/s².
const RAMP_RAD_S2: f64 = 40.0;
/// A dwell is a whole number of these, s, so that its edges of a tenth are whole milliseconds.
const DWELL_STEP_S: f64 = 0.01;
/// Shortest dwell, s: half a second gives pairs, and the ramp before it has to die away.
const LEAST_DWELL_S: f64 = 0.6;

/// Period of the multisines that robots are excited with, s, and their harmonics.
const MULTISINE_PERIOD_S: f64 = 10.0;
const MULTISINE_HARMONICS: RangeInclusive<u32> = 3..=47;
/// Root of the mean of squares of the multisine on top of a balancing robot's torques, N m: about the friction's.
pub const BALANCE_MULTISINE_NM: f64 = 0.06;

/// A place on a path and the speed there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathPoint {
    /// Way from the start, m.
    pub x_m: f64,
    /// Speed, m/s.
    pub x_dot_m_s: f64,
}

impl PathPoint {
    /// Station keeping: the start, at standstill.
    pub const STATION: Self = Self { x_m: 0.0, x_dot_m_s: 0.0 };
}

/// The constant speeds of section 3.1 in one run: ramps, and dwells at one speed each.
///
/// Paper: speeds spread evenly over −50 to 50 rad/s. Here: 17 forward and 16 backward, from 50 down to
/// 0.1 rad/s by equal ratios, because the curve bends where the speed is low. Each direction begins at its
/// fastest speed, so that slow speeds are reached by a turning shaft, not by breaking loose.
///
/// ```
/// use flqr_core::excitation::SpeedSweep;
///
/// let sweep = SpeedSweep::new(120.0).ok_or("too short")?;
/// assert!(sweep.dwell_s() > 2.0 && sweep.duration_s() <= 120.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedSweep {
    levels: Vec<Level>,
    dwell_s: f64,
}

/// One speed of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    speed_rad_s: f64,
    /// End of the ramp that leads to it, s.
    reached_s: f64,
}

impl SpeedSweep {
    /// A sweep that takes at most `seconds`; `None` if its dwells would be too short for pairs.
    pub fn new(seconds: f64) -> Option<Self> {
        let speeds: Vec<f64> = speeds().collect();
        let mut ramps_s = 0.0;
        let mut from = 0.0;
        for speed in &speeds {
            ramps_s += f64::abs(speed - from) / RAMP_RAD_S2;
            from = *speed;
        }
        let dwell_s = ((seconds - ramps_s) / speeds.len() as f64 / DWELL_STEP_S).floor() * DWELL_STEP_S;
        if dwell_s.is_nan() || dwell_s < LEAST_DWELL_S {
            return None;
        }
        let mut levels = Vec::new();
        let (mut now_s, mut from) = (0.0, 0.0);
        for speed_rad_s in speeds {
            let reached_s = now_s + f64::abs(speed_rad_s - from) / RAMP_RAD_S2;
            levels.push(Level { speed_rad_s, reached_s });
            (now_s, from) = (reached_s + dwell_s, speed_rad_s);
        }
        Some(Self { levels, dwell_s })
    }

    /// Shortest time in which a sweep can be done, s.
    pub fn least_seconds() -> f64 {
        let turning_s = 4.0 * FASTEST_RAD_S / RAMP_RAD_S2;
        ((FORWARD_SPEEDS + BACKWARD_SPEEDS) as f64 * LEAST_DWELL_S + turning_s).ceil()
    }

    /// Time at each speed, s.
    pub fn dwell_s(&self) -> f64 {
        self.dwell_s
    }

    /// End of the last dwell, s.
    pub fn duration_s(&self) -> f64 {
        self.levels.last().map_or(0.0, |level| level.reached_s + self.dwell_s)
    }

    /// Target speed, rad/s; exactly constant during a dwell.
    pub fn at(&self, time_s: f64) -> f64 {
        let next = self.levels.partition_point(|level| level.reached_s <= time_s);
        let before = next.checked_sub(1).map(|index| self.levels[index]);
        let (start_s, from) =
            before.map_or((0.0, 0.0), |level| (level.reached_s + self.dwell_s, level.speed_rad_s));
        match self.levels.get(next) {
            Some(level) if time_s > start_s => {
                let share = (time_s - start_s) / (level.reached_s - start_s);
                from + share.min(1.0) * (level.speed_rad_s - from)
            }
            _ => from,
        }
    }
}

fn speeds() -> impl Iterator<Item = f64> {
    let falling = |count: usize, sign: f64| {
        (0..count).map(move |index| {
            let share = index as f64 / (count - 1) as f64;
            sign * FASTEST_RAD_S * libm::pow(SLOWEST_RAD_S / FASTEST_RAD_S, share)
        })
    };
    falling(FORWARD_SPEEDS, 1.0).chain(falling(BACKWARD_SPEEDS, -1.0))
}

/// A jump from one value to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// When, s.
    pub start_s: f64,
    /// Value before.
    pub before: f64,
    /// Value from then on.
    pub after: f64,
}

impl Step {
    /// The value at a time.
    pub fn at(&self, time_s: f64) -> f64 {
        if time_s < self.start_s { self.before } else { self.after }
    }
}

/// A move from rest to rest along a polynomial of order 5: speed and acceleration are continuous.
///
/// ```
/// use flqr_core::excitation::SmoothMove;
///
/// let motion = SmoothMove { start_s: 1.0, duration_s: 4.0, distance_m: 2.0 };
/// assert_eq!((motion.at(0.0).x_m, motion.at(3.0).x_m, motion.at(9.0).x_m), (0.0, 1.0, 2.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothMove {
    /// When it begins, s.
    pub start_s: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Distance, m.
    pub distance_m: f64,
}

impl SmoothMove {
    /// Highest speed / (distance / duration).
    pub const PEAK: f64 = 1.875;

    /// Place and speed at a time.
    pub fn at(&self, time_s: f64) -> PathPoint {
        let share = ((time_s - self.start_s) / self.duration_s).clamp(0.0, 1.0);
        let rest = 1.0 - share;
        let travelled = share * share * share * (10.0 - 15.0 * share + 6.0 * share * share);
        PathPoint {
            x_m: self.distance_m * travelled,
            x_dot_m_s: self.distance_m / self.duration_s * 30.0 * share * share * rest * rest,
        }
    }
}

/// Laps out and back: out over 0.3 of a lap, stand for 0.2, back over 0.3, stand for 0.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutAndBack {
    /// Duration of a lap, s.
    pub lap_s: f64,
    /// Number of laps.
    pub laps: u32,
    /// Distance of the far end, m.
    pub distance_m: f64,
}

impl OutAndBack {
    /// Laps of about `lap_s` that fill `seconds`, at least one, with the given highest speed, m/s.
    pub fn filling(seconds: f64, lap_s: f64, peak_m_s: f64) -> Self {
        let laps = (seconds / lap_s).round().max(1.0);
        let lap_s = seconds / laps;
        Self { lap_s, laps: laps as u32, distance_m: peak_m_s * 0.3 * lap_s / SmoothMove::PEAK }
    }

    /// Place and speed at a time; at the start, at standstill, behind the last lap.
    pub fn at(&self, time_s: f64) -> PathPoint {
        if time_s >= self.lap_s * f64::from(self.laps) {
            return PathPoint::STATION;
        }
        let time_s = time_s.rem_euclid(self.lap_s);
        let leg = |start: f64, distance_m: f64| SmoothMove {
            start_s: start * self.lap_s,
            duration_s: 0.3 * self.lap_s,
            distance_m,
        };
        let [out, back] = [leg(0.0, self.distance_m), leg(0.5, -self.distance_m)].map(|leg| leg.at(time_s));
        PathPoint { x_m: out.x_m + back.x_m, x_dot_m_s: out.x_dot_m_s + back.x_dot_m_s }
    }
}

/// A sum of sines of equal amplitude at odd multiples of 1/period, with the phases of Schroeder (1970), which
/// keep the peak below twice the root of the mean of squares in place of 3 times and more. A response at an even
/// multiple is no linear answer.
///
/// ```
/// use flqr_core::excitation::{Multisine, Phases};
///
/// let torque = Multisine::new(10.0, 3..=47, 0.5, Phases::Falling);
/// let samples: Vec<f64> = (0..10_000).map(|i| torque.at(1e-3 * f64::from(i))).collect();
/// let rms = (samples.iter().map(|value| value * value).sum::<f64>() / 1e4).sqrt();
/// assert!((rms - 0.5).abs() < 1e-6 && samples.iter().all(|value| value.abs() < 1.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Multisine {
    amplitude: f64,
    /// rad/s and rad.
    lines: Vec<(f64, f64)>,
}

/// One of two multisines with the same spectrum and peak that are no multiples of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phases {
    /// The frequency falls as time goes on.
    Falling,
    /// Time-reversed profile.
    Rising,
}

impl Multisine {
    /// A multisine over the odd ones of `harmonics` with the given root of the mean of squares over a period.
    pub fn new(period_s: f64, harmonics: RangeInclusive<u32>, rms: f64, phases: Phases) -> Self {
        let harmonics: Vec<u32> = harmonics.filter(|harmonic| !harmonic.is_multiple_of(2)).collect();
        let count = harmonics.len() as f64;
        let turn = if phases == Phases::Rising { PI } else { -PI };
        let line = |(index, harmonic): (usize, u32)| {
            let index = index as f64;
            (TAU * f64::from(harmonic) / period_s, turn * index * (index - 1.0) / count)
        };
        let amplitude = rms * (2.0 / count.max(1.0)).sqrt();
        Self { amplitude, lines: harmonics.into_iter().enumerate().map(line).collect() }
    }

    /// Value at a time.
    pub fn at(&self, time_s: f64) -> f64 {
        let sum: f64 = self.lines.iter().map(|(speed, phase)| libm::cos(speed * time_s + phase)).sum();
        self.amplitude * sum
    }
}

/// Multisines of the left and the right motor with the given root of the mean of squares, N m.
pub fn multisines(rms_nm: f64) -> [Multisine; 2] {
    [Phases::Falling, Phases::Rising]
        .map(|phases| Multisine::new(MULTISINE_PERIOD_S, MULTISINE_HARMONICS, rms_nm, phases))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweep_holds_each_of_33_speeds_for_its_dwell_and_ramps_between() {
        let sweep = SpeedSweep::new(60.0).unwrap();
        let speeds: Vec<f64> = sweep.levels.iter().map(|level| level.speed_rad_s).collect();
        assert_eq!(speeds.len(), 33);
        let fastest = speeds.iter().fold(0.0, |most: f64, speed| most.max(speed.abs()));
        let slow = speeds.iter().filter(|speed| speed.abs() < 0.2).count();
        assert!(fastest == 50.0 && speeds.contains(&-50.0) && slow >= 4, "{speeds:?}");
        assert!(sweep.duration_s() <= 60.0 && sweep.duration_s() > 59.0);
        let ticks: Vec<f64> = (0..60_000).map(|tick| sweep.at(f64::from(tick) * 1e-3)).collect();
        let steepest = ticks.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(steepest < 1.001 * RAMP_RAD_S2 * 1e-3, "{steepest}");
        for speed in speeds {
            let held = ticks.iter().filter(|target| **target == speed).count() as f64 * 1e-3;
            // The last speed is held to the end of the run.
            assert!(held >= sweep.dwell_s() - 0.002, "{speed} rad/s for {held} s");
        }
        assert!(SpeedSweep::new(SpeedSweep::least_seconds()).is_some());
        for seconds in [0.0, 20.0, f64::NAN] {
            assert_eq!(SpeedSweep::new(seconds), None);
        }
    }

    #[test]
    fn speeds_of_paths_are_the_derivatives_of_their_places() {
        let path = OutAndBack::filling(60.0, 20.0, 0.4);
        let bridge = SmoothMove { start_s: 2.0, duration_s: 6.0, distance_m: -1.0 };
        for at in [&(|t| path.at(t)) as &dyn Fn(f64) -> PathPoint, &|t| bridge.at(t)] {
            let mut fastest: f64 = 0.0;
            for tick in 1..59_999 {
                let time = f64::from(tick) * 1e-3;
                let slope = (at(time + 1e-6).x_m - at(time - 1e-6).x_m) / 2e-6;
                assert!((slope - at(time).x_dot_m_s).abs() < 1e-6, "at {time} s");
                fastest = fastest.max(at(time).x_dot_m_s.abs());
            }
            assert!((0.3..0.400_001).contains(&fastest), "{fastest} m/s");
        }
    }

    #[test]
    fn laps_end_where_they_began_whatever_the_duration() {
        for (seconds, laps) in [(1.0, 1), (15.0, 1), (60.0, 3), (65.0, 3), (3600.0, 180)] {
            let path = OutAndBack::filling(seconds, 20.0, 0.4);
            assert_eq!(
                (path.laps, path.at(0.0), path.at(seconds)),
                (laps, PathPoint::STATION, PathPoint::STATION)
            );
            assert!((path.at(0.4 * path.lap_s).x_m - path.distance_m).abs() < 1e-12);
            assert!((path.lap_s * f64::from(laps) - seconds).abs() < 1e-9);
        }
    }

    #[test]
    fn multisine_has_its_power_at_its_lines_alone_and_a_low_peak() {
        let signals = [Phases::Falling, Phases::Rising].map(|phases| {
            let multisine = Multisine::new(10.0, 3..=47, 0.1, phases);
            (0..10_000).map(|tick| multisine.at(f64::from(tick) * 1e-3)).collect::<Vec<f64>>()
        });
        for signal in &signals {
            let power = signal.iter().map(|value| value * value).sum::<f64>() / 10_000.0;
            let peak = signal.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            assert!((power.sqrt() - 0.1).abs() < 1e-12, "{power}");
            assert!(peak < 0.195, "{peak}");
            for harmonic in 0..60 {
                let (mut sin, mut cos) = (0.0, 0.0);
                for (tick, value) in signal.iter().enumerate() {
                    let angle = TAU * f64::from(harmonic) * tick as f64 / 10_000.0;
                    sin += value * angle.sin() / 5000.0;
                    cos += value * angle.cos() / 5000.0;
                }
                let excited = (3..=47).contains(&harmonic) && harmonic % 2 == 1;
                let expected = if excited { 0.1 * (2.0_f64 / 23.0).sqrt() } else { 0.0 };
                assert!((f64::hypot(sin, cos) - expected).abs() < 1e-12, "line {harmonic}");
            }
        }
        let likeness: f64 = signals[0].iter().zip(&signals[1]).map(|(l, r)| l * r).sum::<f64>() / 100.0;
        assert!(likeness.abs() < 0.5, "{likeness}");
    }

    #[test]
    fn a_step_changes_once() {
        let step = Step { start_s: 0.5, before: 1.0, after: 5.0 };
        assert_eq!([0.0, 0.499, 0.5, 9.0].map(|time| step.at(time)), [1.0, 1.0, 5.0, 5.0]);
    }
}
