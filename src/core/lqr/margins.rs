//! Gain, phase and delay margins of the sampled loop: sampled, delayed, with a held IMU.

use nalgebra::{Complex, Matrix2x4};

use super::sampled_loop::{ContinuousLoop, SampledSystem};
use crate::model::{LinearModel, RobotModel, TICK_S};

/// When the controller measures and acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledLoop {
    /// Time from one control tick to the next, s.
    pub tick_s: f64,
    /// From a measurement to the torque that answers it, s; any fraction of a tick.
    pub delay_s: f64,
    /// From one IMU sample to the next, s; rounded to whole ticks, between which the sample is held.
    pub imu_period_s: f64,
    /// Age of an IMU sample when it arrives, s; rounded to whole ticks.
    pub imu_latency_s: f64,
    /// r: the encoders give x = r (q + θ), so that x and ẋ have part of the held pitch in them; m.
    pub wheel_radius_m: f64,
}

/// Stability margins of the sampled loop, broken at the plant input, both motors together.
///
/// For an unstable loop, both factors are 1 and the other margins 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// True if every eigenvalue of the closed loop over one IMU period lies inside of the unit circle.
    pub stable: bool,
    /// Least factor above 1 of all gains (or of the motors' torque per command) that makes it unstable; infinite
    /// where none does.
    pub gain_up: f64,
    /// Largest factor below 1 that makes it unstable; 0 where none does.
    pub gain_down: f64,
    /// Least phase, lag or lead, that makes it unstable, rad; π where none does.
    pub phase_rad: f64,
    /// Least delay, in addition to the loop's own, that makes it unstable, s; infinite where none does.
    pub delay_s: f64,
    /// Frequency at which the loop's gain passes 1 with that phase margin, rad/s; 0 where it never passes 1.
    pub crossover_rad_s: f64,
    /// Frequency at which the loop oscillates at `gain_up`, rad/s, half the IMU's rate at most; 0 where it is
    /// infinite.
    pub gain_up_rad_s: f64,
    /// Frequency at `gain_down`.
    pub gain_down_rad_s: f64,
}

/// Longest delay whose eigenvalues are computed, ticks; of a longer one they would take more than a frame.
const LONGEST_QUEUE: f64 = 64.0;
/// IMU period and latency from which on the loop is not analysed, ticks.
const LONGEST_HOLD: f64 = 256.0;
/// Lowest frequency that is searched for crossings, rad/s.
const LOWEST_RAD_S: f64 = 1e-3;
/// Frequencies of the search in each decade.
const PER_DECADE: f64 = 24.0;
/// Fraction of half the IMU's rate from which on the folded frequencies count in the search.
const FOLDING: f64 = 0.1;
/// Fraction of half the IMU's rate from which on a loop counts as one that alternates.
const ALTERNATING: f64 = 0.9;
/// Factor up to which it is next to doing so, and frequencies may miss a delay that makes it.
const NEAR: f64 = 4.0;
/// Crossings of a kind that are refined, nearest first.
const REFINED: usize = 3;
const NEWTON_STEPS: usize = 12;
const BISECTIONS: usize = 30;

const UNSTABLE: Margins = Margins {
    stable: false,
    gain_up: 1.0,
    gain_down: 1.0,
    phase_rad: 0.0,
    delay_s: 0.0,
    crossover_rad_s: 0.0,
    gain_up_rad_s: 0.0,
    gain_down_rad_s: 0.0,
};

/// Margins of u = −K X as a robot runs it: `gain` 2×4 on `model`, whose two inputs act alike.
///
/// Stability comes from the eigenvalues over one IMU period, margins from the frequency at which a
/// closed-loop pole reaches the unit circle; both are exact for the linear loop with zero-order hold of torque and
/// IMU. Friction, limits and noise are not in it. A loop with more than 64 ticks of delay counts as unstable
/// where any lesser delay makes it so, and so does one whose IMU period or latency reaches 256 ticks, whose
/// tick is not above 0, or that has a number that is not finite.
///
/// ```
/// # let model = flqr_core::model_file::presets::paper();
/// # let robot = model.robot().ok_or("no robot")?;
/// # let linear = robot.parameters.linear_model();
/// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
/// use flqr_core::lqr::{SampledLoop, margins};
///
/// let margins = margins(&linear, &gain, &SampledLoop::of(robot));
/// assert!(margins.stable && margins.phase_rad.to_degrees() > 40.0 && margins.delay_s > 0.03);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn margins(model: &LinearModel, gain: &Matrix2x4<f64>, timing: &SampledLoop) -> Margins {
    if !timing.is_within_reach() {
        return UNSTABLE;
    }
    let longest_s = LONGEST_QUEUE * timing.tick_s;
    if timing.delay_s > longest_s {
        let shorter = margins(model, gain, &SampledLoop { delay_s: longest_s, ..*timing });
        let borne = shorter.stable && longest_s + shorter.delay_s > timing.delay_s;
        return if borne { Analysis::new(model, gain, timing).margins() } else { UNSTABLE };
    }
    let analysis = Analysis::new(model, gain, timing);
    if analysis.is_stable(0.0) { analysis.margins() } else { UNSTABLE }
}

impl SampledLoop {
    /// The loop of a robot: control at 1 kHz, its model's delay, IMU and wheels. Motors that are read at a lower
    /// rate count with their readings' mean age as delay, which is an approximation.
    pub fn of(robot: &RobotModel) -> Self {
        let robot = &robot.with_effects_declared();
        Self {
            tick_s: TICK_S,
            delay_s: robot.torque_delay_s() + robot.sensors.mean_motor_age_s(),
            imu_period_s: f64::from(robot.sensors.imu_period_ticks()) * TICK_S,
            imu_latency_s: robot.sensors.imu_latency_s,
            wheel_radius_m: robot.parameters.wheel_radius_m,
        }
    }

    /// Returns whether the eigenvalues of the loop are computed, in a time that a frame has.
    pub(super) fn is_analysed(&self) -> bool {
        self.is_within_reach() && self.delay_s <= LONGEST_QUEUE * self.tick_s
    }

    fn is_within_reach(&self) -> bool {
        let ticks = |time_s: f64| time_s / self.tick_s;
        self.tick_s > 0.0
            && (0.0..f64::INFINITY).contains(&ticks(self.delay_s))
            && (0.0..LONGEST_HOLD).contains(&ticks(self.imu_period_s))
            && (0.0..LONGEST_HOLD).contains(&ticks(self.imu_latency_s))
    }
}

/// The loop of one design, with more delay where it is requested.
pub(super) struct Analysis {
    continuous: ContinuousLoop,
    timing: SampledLoop,
}

/// A pole on the unit circle: its frequency, and the factor, phase or delay that put it there.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    frequency_rad_s: f64,
    value: f64,
}

/// Crossings of the negative real axis and the unit circle.
#[derive(Default)]
struct Crossings {
    gain: Vec<Crossing>,
    phase: Vec<Crossing>,
    delay: Vec<Crossing>,
}

impl Analysis {
    pub(super) fn new(model: &LinearModel, gain: &Matrix2x4<f64>, timing: &SampledLoop) -> Self {
        let continuous = ContinuousLoop {
            a: model.a,
            b: model.b.column_mean(),
            gain: gain.row(0) + gain.row(1),
            wheel_radius_m: timing.wheel_radius_m,
        };
        Self { continuous, timing: *timing }
    }

    pub(super) fn system(&self, extra_delay_s: f64) -> SampledSystem {
        let SampledLoop { tick_s, delay_s, imu_period_s, imu_latency_s, .. } = self.timing;
        let ticks = |time_s: f64| (time_s / tick_s).round() as usize;
        let (period, latency) = (ticks(imu_period_s).max(1), ticks(imu_latency_s));
        SampledSystem::new(&self.continuous, tick_s, delay_s + extra_delay_s, period, latency)
    }

    /// Margins of a loop that is stable.
    fn margins(&self) -> Margins {
        let system = self.system(0.0);
        let Crossings { gain, phase, delay } = self.crossings(&system);
        let up = nearest_factor(&system, &gain, f64::ln);
        let down = nearest_factor(&system, &gain, |factor| -factor.ln());
        let phase = nearest(&phase, f64::abs, |frequency, lag| {
            system.characteristic(frequency, Complex::from_polar(1.0, -lag))
        });
        let delay = nearest(
            &delay,
            |extra| extra,
            |frequency, extra_delay_s| {
                self.system(extra_delay_s.max(0.0)).characteristic(frequency, Complex::from(1.0))
            },
        );
        let half_rate = 0.5 * system.imu_rate_rad_s();
        let alternates =
            up.is_some_and(|up| up.value < NEAR && up.frequency_rad_s >= ALTERNATING * half_rate);
        let longest_s = LONGEST_QUEUE * self.timing.tick_s;
        let borne = |extra: &Crossing| !alternates || self.is_stable(longest_s.min(0.5 * extra.value));
        let delay = delay.filter(borne).or_else(|| self.delay_by_bisection()).or(delay);
        let value = |found: Option<Crossing>, none: f64| found.map_or(none, |crossing| crossing.value);
        let frequency = |found: Option<Crossing>| found.map_or(0.0, |crossing| crossing.frequency_rad_s);
        Margins {
            stable: true,
            gain_up: value(up, f64::INFINITY),
            gain_down: value(down, 0.0),
            phase_rad: value(phase, std::f64::consts::PI).abs(),
            delay_s: value(delay, f64::INFINITY),
            crossover_rad_s: frequency(phase),
            gain_up_rad_s: frequency(up),
            gain_down_rad_s: frequency(down),
        }
    }

    fn is_stable(&self, extra_delay_s: f64) -> bool {
        self.system(extra_delay_s).spectral_radius(1.0).is_some_and(|radius| radius < 1.0)
    }

    /// For loops next to alternating from one IMU sample to the next, whose hold hides crossings from the search.
    fn delay_by_bisection(&self) -> Option<Crossing> {
        let (mut low, mut high) = (0.0, self.timing.tick_s / 16.0);
        while self.is_stable(high) {
            (low, high) = (high, 2.0 * high);
            if high > LONGEST_QUEUE * self.timing.tick_s {
                return None;
            }
        }
        for _ in 0..BISECTIONS {
            let middle = f64::midpoint(low, high);
            *(if self.is_stable(middle) { &mut low } else { &mut high }) = middle;
        }
        let imu_rate = self.system(0.0).imu_rate_rad_s();
        Some(Crossing { frequency_rad_s: 0.5 * imu_rate, value: low })
    }

    /// From the lowest frequency to half the IMU's rate; above it a pole's frequency has no meaning to the IMU.
    fn crossings(&self, system: &SampledSystem) -> Crossings {
        let highest = 0.5 * system.imu_rate_rad_s();
        let folding = (FOLDING * highest).max(LOWEST_RAD_S);
        let mut found = Crossings::default();
        found.search(LOWEST_RAD_S, folding, |frequency| system.baseband(frequency));
        // With what is folded at the present gain, and overlapping, because the two differ by a little.
        found.search(0.9 * folding, highest, |frequency| {
            system.characteristic(frequency, Complex::from(1.0)) - 1.0
        });
        found
    }
}

impl Crossings {
    fn search(&mut self, lowest: f64, highest: f64, response: impl Fn(f64) -> Complex<f64>) {
        let decades = (highest / lowest).log10().max(0.0);
        let steps = (PER_DECADE * decades).ceil();
        let at = |step: f64| {
            let frequency = highest * 10_f64.powf(decades * (step / steps - 1.0));
            (frequency, response(frequency))
        };
        let mut before = at(0.0);
        for step in 1..=steps as usize {
            let after = at(step as f64);
            self.add_between(before, after);
            before = after;
        }
    }

    fn add_between(&mut self, before: (f64, Complex<f64>), after: (f64, Complex<f64>)) {
        let between = |share: f64| {
            let frequency_rad_s = before.0 * (after.0 / before.0).powf(share);
            (frequency_rad_s, before.1 + (after.1 - before.1) * share)
        };
        let passes = |b: f64, a: f64| (b < 0.0) != (a < 0.0);
        if passes(before.1.im, after.1.im) {
            let (frequency_rad_s, response) = between(before.1.im / (before.1.im - after.1.im));
            if response.re < 0.0 {
                self.gain.push(Crossing { frequency_rad_s, value: -1.0 / response.re });
            }
        }
        let [low, high] = [before.1, after.1].map(|response| response.norm().ln());
        if passes(low, high) {
            let (frequency_rad_s, response) = between(low / (low - high));
            let lag = (-response).arg();
            self.phase.push(Crossing { frequency_rad_s, value: lag });
            let delay_s = lag.rem_euclid(std::f64::consts::TAU) / frequency_rad_s;
            self.delay.push(Crossing { frequency_rad_s, value: delay_s });
        }
    }
}

/// The factor nearest to 1 on the side on which `distance` is positive.
fn nearest_factor(system: &SampledSystem, gain: &[Crossing], distance: fn(f64) -> f64) -> Option<Crossing> {
    let by_factor = |frequency: f64, factor: f64| system.characteristic(frequency, Complex::from(factor));
    let at_half_rate = factor_at_half_rate(system).filter(|crossing| distance(crossing.value) > 0.0);
    nearest(gain, distance, by_factor)
        .into_iter()
        .chain(at_half_rate)
        .min_by(|a, b| distance(a.value).total_cmp(&distance(b.value)))
}

/// The factor that lets the loop alternate from one IMU sample to the next; the line through the circle's
/// real axis that a search between frequencies cannot see. By Newton's method from no loop at all.
fn factor_at_half_rate(system: &SampledSystem) -> Option<Crossing> {
    let mut factor = 0.0;
    for _ in 0..NEWTON_STEPS {
        let here = system.characteristic_at_half_rate(factor);
        let step = 1e-6 * factor.max(1.0);
        let slope = (system.characteristic_at_half_rate(factor + step) - here) / step;
        let change = -here / slope;
        factor += change;
        if !(factor > 0.0 && factor.is_finite()) {
            return None;
        }
        if change.abs() <= 1e-9 * factor {
            return Some(Crossing { frequency_rad_s: 0.5 * system.imu_rate_rad_s(), value: factor });
        }
    }
    None
}

/// The crossing nearest to the present loop, refined until `characteristic` is zero.
fn nearest(
    crossings: &[Crossing],
    distance: impl Fn(f64) -> f64,
    characteristic: impl Fn(f64, f64) -> Complex<f64>,
) -> Option<Crossing> {
    let by_distance = |a: &Crossing, b: &Crossing| distance(a.value).total_cmp(&distance(b.value));
    let mut nearest: Vec<_> = crossings.iter().filter(|c| distance(c.value) >= 0.0).copied().collect();
    nearest.sort_by(by_distance);
    nearest
        .into_iter()
        .take(REFINED)
        .filter_map(|crossing| refined(crossing, &characteristic))
        .filter(|crossing| distance(crossing.value) >= 0.0)
        .min_by(by_distance)
}

/// Newton's method for the two real unknowns of one complex equation.
fn refined(start: Crossing, characteristic: impl Fn(f64, f64) -> Complex<f64>) -> Option<Crossing> {
    let Crossing { mut frequency_rad_s, mut value } = start;
    let (frequency_step, value_step) = (1e-6 * frequency_rad_s, 1e-6 * value.abs());
    for _ in 0..NEWTON_STEPS {
        let here = characteristic(frequency_rad_s, value);
        let by_frequency = (characteristic(frequency_rad_s + frequency_step, value) - here) / frequency_step;
        let by_value = (characteristic(frequency_rad_s, value + value_step) - here) / value_step;
        let determinant = by_frequency.re * by_value.im - by_frequency.im * by_value.re;
        let frequency_change = (here.im * by_value.re - here.re * by_value.im) / determinant;
        let value_change = (here.re * by_frequency.im - here.im * by_frequency.re) / determinant;
        if !(frequency_change.is_finite() && value_change.is_finite()) {
            return None;
        }
        // Far steps leave the crossing that was meant.
        let shorten = 1_f64
            .min(0.3 * frequency_rad_s / frequency_change.abs())
            .min(0.5 * start.value.abs().max(value.abs()) / value_change.abs());
        frequency_rad_s += shorten * frequency_change;
        value += shorten * value_change;
        if frequency_change.abs() <= 1e-9 * frequency_rad_s && value_change.abs() <= 1e-9 * value.abs() {
            return (frequency_rad_s > 0.0).then_some(Crossing { frequency_rad_s, value });
        }
    }
    None
}
