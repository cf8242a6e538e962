//! Logs of an axis as rows of one regression: uniform time, one kernel for every column, rests left out.

use std::f64::consts::{PI, TAU};

use crate::effects::{EffectKind, Law, MotionSample as Moment, Place};
use crate::identify::motion::kinematics::{Stretch, near_rest, stretches, white_noise};
use crate::model::MachineKind;
use crate::record::Log;
use crate::refine::select::{Blocks, Member};
use crate::refine::split::split_rows_s;
use crate::signal::filter::{ZeroPhase, derivative};

/// Highest cut-off of the kernel, Hz.
const HIGHEST_CUTOFF_HZ: f64 = 100.0;
/// Largest share of the acceleration's variance that may be noise of the position.
const NOISE_SHARE: f64 = 0.05;
/// Rows in a period of the cut-off.
const ROWS_A_PERIOD: f64 = 2.5;
/// A speed below this share of the root mean square may be a rest.
const REST_SHARE: f64 = 0.03;
/// A reversal reaches up to so many times that speed.
const REVERSING: f64 = 2.0;
/// Share of rows in one direction below which motion goes the other way alone: the few moments of a reversal, where
/// friction sticks, do not tell the two directions apart.
const ONE_WAY: f64 = 0.15;
/// Periods of the cut-off that are left out at the ends of a stretch.
const END_PERIODS: f64 = 5.0;

/// Which part of the data a row is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Estimates are made from it.
    Fit,
    /// Errors are told on it.
    HeldOut,
    /// Neither, at a speed that is not asked about; filters see it.
    Beside,
}

/// One row of the regression.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) trace: usize,
    pub(super) sample: usize,
    pub(super) part: Part,
    /// Whether the row before is the one a step earlier.
    pub(super) follows: bool,
    /// Time since the start of its log, s.
    pub(super) time_s: f64,
    /// Whether the axis reverses nearby: friction that sticks for a moment takes any value there.
    pub(super) reverses: bool,
}

/// A stretch of a log with its motion.
pub(super) struct Trace {
    /// Place of its log, those that are fitted first.
    pub(super) log: usize,
    /// Time of the first sample since the start of the log, s.
    pub(super) start_s: f64,
    pub(super) step_s: f64,
    pub(super) position: Vec<f64>,
    pub(super) effort: Vec<f64>,
    pub(super) speed: Vec<f64>,
    /// Behind the kernel.
    pub(super) acceleration: Vec<f64>,
    /// By second differences.
    second: Vec<f64>,
}

/// All rows, and the kernel that every column passes.
pub(super) struct Rows {
    pub(super) traces: Vec<Trace>,
    pub(super) rows: Vec<Row>,
    pub(super) kernel: Kernel,
    /// Variance of white noise in the position and in the effort.
    pub(super) position_noise: f64,
    pub(super) effort_noise: f64,
    /// Share of the fitted logs' time that is left out because the axis rests.
    pub(super) rest_share: f64,
    /// How the column of the speed goes with the position, where there is one.
    pub(super) agreement: Option<Agreement>,
    asked: Asked,
}

/// Speeds that are asked about, either way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Asked([f64; 2]);

impl Asked {
    pub(super) fn new(speeds: Option<[f64; 2]>) -> Self {
        Self(speeds.unwrap_or([0.0, f64::INFINITY]))
    }

    fn is_all(self) -> bool {
        self == Self::new(None)
    }

    fn about(self, speed: f64) -> bool {
        (self.0[0]..=self.0[1]).contains(&speed.abs())
    }
}

/// How a column of the speed goes with the position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreement {
    /// The position's acceleration by the speed's.
    pub(super) factor: f64,
    /// By how much the speed is late, s.
    pub(super) lag_s: f64,
    /// Share of the position's acceleration that is not in the speed, whatever its factor and lag.
    pub(super) incoherent: f64,
}

/// The one filter of all columns, and the thinning after it.
pub(super) struct Kernel {
    pub(super) cutoff_hz: f64,
    pub(super) step_s: f64,
    pub(super) thinning: usize,
    filter: ZeroPhase,
}

impl Kernel {
    fn new(cutoff_hz: f64, step_s: f64) -> Self {
        let cutoff = cutoff_hz * step_s;
        let thinning = ((1.0 / (ROWS_A_PERIOD * cutoff)).floor() as usize).max(1);
        Self { cutoff_hz, step_s, thinning, filter: ZeroPhase::butterworth(4, cutoff) }
    }

    pub(super) fn apply(&self, signal: &[f64]) -> Vec<f64> {
        self.filter.apply(signal)
    }

    /// Gain at a frequency in cycles per sample.
    pub(super) fn gain(&self, frequency: f64) -> f64 {
        if frequency < 0.5 { self.filter.gain(frequency) } else { 0.0 }
    }

    /// Power of second differences of white noise of 1, over the frequency in cycles per sample.
    pub(super) fn acceleration_noise(&self, frequency: f64) -> f64 {
        let slope = 2.0 * (PI * frequency).sin() / self.step_s;
        (slope * slope * self.gain(frequency)).powi(2)
    }

    /// Power of the mean of two neighbours in white noise of 1.
    pub(super) fn effort_noise(&self, frequency: f64) -> f64 {
        ((PI * frequency).cos() * self.gain(frequency)).powi(2)
    }

    /// Variance that white noise of 1 leaves, after so many derivatives.
    pub(super) fn noise_gain(&self, derivatives: i32) -> f64 {
        const STEPS: usize = 2000;
        let power = |index: usize| {
            let frequency = (index as f64 + 0.5) / (2 * STEPS) as f64;
            let slope = (2.0 * PI * frequency).sin() / self.step_s;
            (slope.powi(derivatives) * self.filter.gain(frequency)).powi(2)
        };
        (0..STEPS).map(power).sum::<f64>() / STEPS as f64
    }

    fn blur(&self) -> usize {
        (1.0 / (self.cutoff_hz * self.step_s)).ceil() as usize
    }
}

/// Names of the columns of position and effort.
#[derive(Clone, Copy, Debug)]
pub(super) struct Names {
    pub(super) position: &'static str,
    pub(super) speed: &'static str,
    pub(super) effort: &'static str,
}

impl Rows {
    /// Rows of `logs`, of which the last third is held out unless there are logs `held_out`.
    /// `highest_hz` limits the kernel's cut-off.
    pub(super) fn new(
        logs: &[Log],
        held_out: &[Log],
        names: Names,
        (asked, highest_hz): (Asked, f64),
    ) -> Self {
        let cut = |log: &Log| {
            let column = |name: &str| log.column(name).unwrap_or_default();
            stretches(column("time_s"), column(names.position), column(names.effort))
        };
        let fitted: Vec<Vec<Stretch>> = logs.iter().map(cut).collect();
        let others: Vec<Vec<Stretch>> = held_out.iter().map(cut).collect();
        let all = || fitted.iter().flatten();
        let step_s = all().next().map_or(1.0, |stretch| stretch.step_s);
        let position_noise =
            logs.iter().map(|log| noise_of_rows(log, names.position, asked)).fold(0.0, f64::max);
        let effort_noise = white_noise(all().flat_map(|stretch| stretch.effort.windows(5)));
        let with_speed: Vec<Stretch> = logs.iter().flat_map(|log| with_speed(log, names)).collect();
        let kernel = choose_kernel(all(), &with_speed, (step_s, highest_hz), position_noise, asked);
        let agreement = agreement(&kernel, &with_speed, asked);
        let mut found = Self {
            traces: Vec::new(),
            rows: Vec::new(),
            kernel,
            position_noise,
            effort_noise,
            rest_share: 0.0,
            agreement,
            asked,
        };
        let (mut resting, mut samples) = (0, 0);
        for (log, stretches) in fitted.into_iter().enumerate() {
            let start_s = stretches.first().map_or(0.0, |stretch| stretch.start_s);
            let counts = found.add(log, stretches, start_s, Part::Fit);
            resting += counts[0];
            samples += counts[1];
        }
        if held_out.is_empty() {
            found.hold_out_last_third(logs.len());
        }
        for (log, stretches) in others.into_iter().enumerate() {
            let start_s = stretches.first().map_or(0.0, |stretch| stretch.start_s);
            found.add(logs.len() + log, stretches, start_s, Part::HeldOut);
        }
        found.rest_share = resting as f64 / samples.max(1) as f64;
        found
    }

    /// Adds the stretches of a log; numbers of resting and of all samples.
    fn add(&mut self, log: usize, stretches: Vec<Stretch>, log_start_s: f64, part: Part) -> [usize; 2] {
        let mut counts = [0; 2];
        let motions: Vec<Vec<f64>> = stretches
            .iter()
            .map(|stretch| derivative(&self.kernel.apply(&stretch.position), stretch.step_s))
            .collect();
        let speeds = || motions.iter().flatten();
        let rms = (speeds().map(|v| v * v).sum::<f64>() / speeds().count().max(1) as f64).sqrt();
        let noise = (self.position_noise * self.kernel.noise_gain(1)).sqrt();
        let rest_speed = (REST_SHARE * rms).max(3.0 * noise);
        for (stretch, speed) in stretches.into_iter().zip(motions) {
            let acceleration = derivative(&speed, stretch.step_s);
            // A clock that is off by orders of magnitude makes a kernel longer than the log.
            let blur = self.kernel.blur().min(stretch.position.len());
            // The kernel reaches twice as far as it resolves.
            let resting = near_rest(&speed, rest_speed, blur, 2 * blur);
            counts[0] += resting.iter().filter(|&&rest| rest).count();
            counts[1] += resting.len();
            let second = second_difference(&stretch.position, stretch.step_s);
            let trace = Trace {
                log,
                start_s: stretch.start_s - log_start_s,
                step_s: stretch.step_s,
                position: stretch.position,
                effort: stretch.effort,
                speed,
                acceleration,
                second,
            };
            let slow: Vec<bool> = trace.speed.iter().map(|v| v.abs() < REVERSING * rest_speed).collect();
            self.add_rows(&trace, [&resting, &widened(&slow, 2 * blur)], part);
            self.traces.push(trace);
        }
        counts
    }

    /// Holds out the last third of the rows in motion of each log, after a gap.
    fn hold_out_last_third(&mut self, logs: usize) {
        let splits: Vec<[f64; 2]> = (0..logs)
            .map(|log| {
                let counts = |row: &&Row| self.traces[row.trace].log == log && row.part != Part::Beside;
                let times: Vec<f64> = self.rows.iter().filter(counts).map(|row| row.time_s).collect();
                let own = self.traces.iter().filter(|trace| trace.log == log);
                let ends = own.map(|trace| trace.start_s + trace.step_s * trace.position.len() as f64);
                split_rows_s(&times, ends.fold(0.0, f64::max))
            })
            .collect();
        let mut follows = true;
        let rows = std::mem::take(&mut self.rows);
        for mut row in rows {
            let [end_s, begin_s] = splits[self.traces[row.trace].log];
            if (end_s..begin_s).contains(&row.time_s) {
                follows = false;
                continue;
            }
            if row.part == Part::Fit && row.time_s >= begin_s {
                row.part = Part::HeldOut;
            }
            row.follows &= std::mem::replace(&mut follows, true);
            self.rows.push(row);
        }
    }

    fn add_rows(&mut self, trace: &Trace, [resting, reversing]: [&[bool]; 2], part: Part) {
        let samples = trace.position.len();
        let ends = (END_PERIODS / (self.kernel.cutoff_hz * trace.step_s)) as usize;
        let mut before = None;
        for sample in (ends..samples.saturating_sub(ends)).step_by(self.kernel.thinning) {
            let time_s = trace.start_s + sample as f64 * trace.step_s;
            let part = if self.asked.about(trace.speed[sample]) { part } else { Part::Beside };
            let part = (!resting[sample]).then_some(part);
            if let Some(part) = part {
                let follows = before
                    .is_some_and(|before| before == part || before == Part::Beside || part == Part::Beside);
                self.rows.push(Row {
                    trace: self.traces.len(),
                    sample,
                    part,
                    follows,
                    time_s,
                    reverses: reversing[sample],
                });
            }
            before = part;
        }
    }

    /// Whether the position goes further than its noise, and the speed more.
    pub(super) fn moves(&self) -> bool {
        let speed = self.counted(|trace, sample| trace.speed[sample]);
        let rms = (speed.iter().map(|v| v * v).sum::<f64>() / speed.len().max(1) as f64).sqrt();
        let noise = (self.position_noise * self.kernel.noise_gain(1)).sqrt();
        rms > 5.0 * noise
    }

    /// Which rows are held out.
    pub(super) fn held_out(&self) -> Vec<bool> {
        self.rows.iter().map(|row| row.part == Part::HeldOut).collect()
    }

    /// Whether a fair share of the rows goes either way.
    pub(super) fn both_ways(&self) -> bool {
        let speeds = self.counted(|trace, sample| trace.speed[sample]);
        let forward = speeds.iter().filter(|speed| **speed > 0.0).count();
        let share = forward as f64 / speeds.len().max(1) as f64;
        (ONE_WAY..=1.0 - ONE_WAY).contains(&share)
    }

    /// A signal of each trace at the rows, unfiltered.
    pub(super) fn pick(&self, signal: impl Fn(&Trace, usize) -> f64) -> Vec<f64> {
        self.rows.iter().map(|row| signal(&self.traces[row.trace], row.sample)).collect()
    }

    /// The same at the rows that count.
    pub(super) fn counted(&self, signal: impl Fn(&Trace, usize) -> f64) -> Vec<f64> {
        let rows = self.rows.iter().filter(|row| row.part != Part::Beside);
        rows.map(|row| signal(&self.traces[row.trace], row.sample)).collect()
    }

    /// Lowest and highest speed of a part, but for one row in a hundred at either end.
    pub(super) fn speeds(&self, part: Part) -> Option<[f64; 2]> {
        let rows = self.rows.iter().filter(|row| row.part == part);
        let mut speeds: Vec<f64> = rows.map(|row| self.traces[row.trace].speed[row.sample].abs()).collect();
        speeds.sort_by(f64::total_cmp);
        let last = speeds.len().checked_sub(1)?;
        Some([speeds[last / 100], speeds[last - last / 100]])
    }

    /// A signal of each trace behind the kernel.
    pub(super) fn column(&self, signal: impl Fn(&Trace) -> Vec<f64>) -> Vec<f64> {
        let filtered: Vec<Vec<f64>> =
            self.traces.iter().map(|trace| self.kernel.apply(&signal(trace))).collect();
        self.rows.iter().map(|row| filtered[row.trace][row.sample]).collect()
    }

    /// What a law adds to r = T − I q̈ − τ_f, behind the kernel.
    pub(super) fn law_column(&self, law: &dyn Law, how: Acting) -> Vec<f64> {
        self.column(|trace| trace.acts(law, how))
    }
}

/// How a law is taken at the rows of a log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Acting {
    /// As the mean of two rows, as the torque that a second difference sees.
    between: bool,
    /// Finest wave of the position that it has, rad per unit; 0 where it has none.
    wave: f64,
}

/// Angle of a wave in a row above which it is taken as its mean over the row: rows alone would show a slower one.
const FINE_RAD: f64 = 1.0;
/// The mean is over so many places in a rad, and over so many at most.
const PLACES_A_RAD: f64 = 3.0;
const MOST_PLACES: f64 = 100.0;

impl Acting {
    pub(super) fn of(kind: &EffectKind, machine: MachineKind, shape: &[f64]) -> Self {
        let wave = |&shape: &f64| if machine == MachineKind::Linear { TAU / shape } else { shape };
        let finest = shape.iter().map(wave).fold(0.0, f64::max);
        Self { between: kind.place == Place::Actuator, wave: if kind.series() { finest } else { 0.0 } }
    }
}

impl Trace {
    /// Acceleration by second differences, which see just the torques of the rows before and at a sample.
    pub(super) fn second_difference(&self) -> Vec<f64> {
        self.second.clone()
    }

    /// What a law adds to the residual at every sample.
    pub(super) fn acts(&self, law: &dyn Law, how: Acting) -> Vec<f64> {
        let mut law = law.boxed_clone();
        let mut act = |moment: &Moment| -law.act(moment).on_motor_nm(moment.direction());
        let mut at = |sample: usize| {
            let moment = self.moment(sample);
            let turn = moment.motor_speed_rad_s * self.step_s;
            let angle = how.wave * turn.abs();
            if angle <= FINE_RAD {
                return act(&moment);
            }
            let places = (PLACES_A_RAD * angle).min(MOST_PLACES).ceil();
            let place =
                |index: u32| moment.motor_angle_rad + turn * ((f64::from(index) + 0.5) / places - 0.5);
            let sum =
                (0..places as u32).map(|index| act(&Moment { motor_angle_rad: place(index), ..moment }));
            sum.sum::<f64>() / places
        };
        let mut values: Vec<f64> = (0..self.position.len()).map(&mut at).collect();
        if how.between {
            for sample in (1..values.len()).rev() {
                values[sample] = 0.5 * (values[sample] + values[sample - 1]);
            }
        }
        values
    }

    /// What a law sees at a sample.
    pub(super) fn moment(&self, sample: usize) -> Moment {
        Moment {
            time_s: self.start_s + sample as f64 * self.step_s,
            dt_s: self.step_s,
            motor_angle_rad: self.position[sample],
            motor_speed_rad_s: self.speed[sample],
            motor_accel_rad_s2: self.second[sample],
            torque_nm: self.effort[sample],
            torque_sum_nm: self.effort[sample],
            ..Moment::default()
        }
    }
}

/// Samples that are no further than `reach` from a true one.
fn widened(flags: &[bool], reach: usize) -> Vec<bool> {
    let mut found = vec![false; flags.len()];
    for place in (0..flags.len()).filter(|&place| flags[place]) {
        found[place.saturating_sub(reach)..(place + reach + 1).min(flags.len())].fill(true);
    }
    found
}

/// Variance of white noise in a column, from what the rows around a row foretell of it: a cubic through two on either
/// side, at their own times, so that jitter of the clock counts as noise of a moving axis.
fn noise_of_rows(log: &Log, name: &str, asked: Asked) -> f64 {
    let (Some(time), Some(values)) = (log.column("time_s"), log.column(name)) else { return 0.0 };
    let usual_s = crate::record::row_time_s(time).unwrap_or(f64::INFINITY);
    let (mut sum, mut count) = (0.0, 0_usize);
    for (times, values) in time.windows(5).zip(values.windows(5)) {
        let near = times.windows(2).all(|pair| (0.1 * usual_s..3.0 * usual_s).contains(&(pair[1] - pair[0])));
        let speed = (values[4] - values[0]) / (times[4] - times[0]);
        if !near || !(asked.is_all() || asked.about(speed)) {
            continue;
        }
        let weight =
            |i: usize| (0..5).filter(|&j| j != i).map(|j| usual_s / (times[i] - times[j])).product::<f64>();
        let weights: [f64; 5] = std::array::from_fn(weight);
        let difference: f64 = weights.iter().zip(values).map(|(weight, value)| weight * value).sum();
        if difference.is_finite() {
            sum += difference * difference / weights.iter().map(|weight| weight * weight).sum::<f64>();
            count += 1;
        }
    }
    sum / count.max(1) as f64
}

/// The highest cut-off at which noise of the position is a small part of the acceleration.
fn choose_kernel<'a>(
    stretches: impl Iterator<Item = &'a Stretch> + Clone,
    with_speed: &[Stretch],
    (step_s, highest_hz): (f64, f64),
    position_noise: f64,
    asked: Asked,
) -> Kernel {
    let highest = HIGHEST_CUTOFF_HZ.min(0.25 / step_s).min(highest_hz);
    let divisors = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];
    let kernels = divisors.map(|divisor| Kernel::new(highest / divisor, step_s));
    let share = |kernel: &Kernel| {
        let (mut power, mut count) = (0.0, 0);
        for stretch in stretches.clone() {
            let speed = derivative(&kernel.apply(&stretch.position), step_s);
            let acceleration = derivative(&speed, step_s);
            let own = || acceleration.iter().zip(&speed).filter(|(_, speed)| asked.about(**speed));
            power += own().map(|(a, _)| a * a).sum::<f64>();
            count += own().count();
        }
        let own = position_noise * kernel.noise_gain(2) * count as f64 / power;
        let incoherent = agreement(kernel, with_speed, asked).map_or(0.0, |agreement| agreement.incoherent);
        // A speed that has nothing of the position's acceleration says nothing of the position's noise.
        if incoherent < 0.9 { own.max(incoherent) } else { own }
    };
    let mut best = None;
    for kernel in kernels {
        let share = share(&kernel);
        if best.as_ref().is_none_or(|(least, _)| share < *least) {
            let enough = share <= NOISE_SHARE;
            best = Some((share, kernel));
            if enough {
                break;
            }
        }
    }
    best.map_or_else(|| Kernel::new(highest, step_s), |(_, kernel)| kernel)
}

pub(super) fn second_difference(position: &[f64], step_s: f64) -> Vec<f64> {
    let last = position.len() - 1;
    let at = |sample: usize| {
        let middle = sample.clamp(1, last.max(2) - 1);
        (position[middle + 1] - 2.0 * position[middle] + position[middle - 1]) / (step_s * step_s)
    };
    (0..position.len()).map(at).collect()
}

/// Position with the column of the speed in the place of the effort; nothing where a log has none.
fn with_speed(log: &Log, names: Names) -> Vec<Stretch> {
    let (Some(time), Some(position), Some(speed)) =
        (log.column("time_s"), log.column(names.position), log.column(names.speed))
    else {
        return Vec::new();
    };
    stretches(time, position, speed)
}

/// Regression of the position's acceleration on the speed's, its slope and the slope of that, which take up a lag.
fn agreement(kernel: &Kernel, stretches: &[Stretch], asked: Asked) -> Option<Agreement> {
    let ends = (2.0 * END_PERIODS / (kernel.cutoff_hz * kernel.step_s)) as usize;
    let mut columns: [Vec<f64>; 4] = Default::default();
    for stretch in stretches.iter().filter(|stretch| stretch.position.len() / 4 > ends) {
        let of_position = kernel.apply(&second_difference(&stretch.position, stretch.step_s));
        let speed = if asked.is_all() { Vec::new() } else { kernel.apply(&stretch.effort) };
        let of_speed = kernel.apply(&derivative(&stretch.effort, stretch.step_s));
        let slope = derivative(&of_speed, stretch.step_s);
        let bend = derivative(&slope, stretch.step_s);
        let rows = (ends..of_position.len() - ends).step_by(kernel.thinning);
        for sample in rows.filter(|&sample| speed.get(sample).is_none_or(|&speed| asked.about(speed))) {
            let values = [of_speed[sample], slope[sample], bend[sample], of_position[sample]];
            columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
        }
    }
    let [speed, slope, bend, position] = &columns;
    let blocks = Blocks::new(&[speed, slope, bend], position, &vec![0; position.len()]);
    let members = [0, 1, 2].map(Member::free);
    let found = blocks.fit(&members, 0.0)?;
    let incoherent = blocks.left(&members, &found) / blocks.target_power();
    Some(Agreement { factor: found[0], lag_s: found[1] / found[0], incoherent })
}
