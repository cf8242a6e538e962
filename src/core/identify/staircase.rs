//! Finds the stretches of constant speed in a log.
//!
//! If the log contains a target speed, its constant segments are the candidates. Otherwise the measured speed is
//! averaged over blocks of about 0.05 s and cut where its level changes: the cut set that minimises the squared
//! deviation from the levels plus a price for each cut (penalised change points, exact by pruned dynamic programming;
//! Killick, Fearnhead and Eckley 2012). Ramps fall into many short pieces, which are no dwells. The noise that sets
//! the price is taken from the differences of neighbouring blocks.

use std::borrow::Cow;
use std::ops::Range;

/// A dwell lasts at least this long, s.
pub(super) const LEAST_DWELL_S: f64 = 0.5;
/// A dwell has at least this many samples: five in each segment.
const LEAST_SAMPLES: usize = 40;
/// Length of a block, s.
const BLOCK_S: f64 = 0.05;
/// More blocks than this are made longer instead.
const MOST_BLOCKS: usize = 20_000;
/// Slower than this is standstill, rad/s.
const REST_RAD_S: f64 = 2e-3;
/// Speeds closer than this, or than 2 %, are one level, rad/s.
const LEVEL_RAD_S: f64 = 0.01;

/// The rows of a log that can be used.
pub(super) struct Recording<'a> {
    pub(super) time: Cow<'a, [f64]>,
    angle: Cow<'a, [f64]>,
    pub(super) torque: Cow<'a, [f64]>,
    speed: Option<Cow<'a, [f64]>>,
    target: Option<Cow<'a, [f64]>>,
}

/// Dwells as ranges of rows, with what was dropped.
pub(super) struct Split {
    pub(super) dwells: Vec<Range<usize>>,
    pub(super) constant_share: f64,
    /// Stretches of constant speed that are too short.
    pub(super) short_dwells: usize,
    pub(super) warnings: Vec<String>,
}

impl<'a> Recording<'a> {
    /// Keeps the rows in which every given column is finite. A speed column without any number is ignored.
    pub(super) fn new(
        time: &'a [f64],
        angle: &'a [f64],
        torque: &'a [f64],
        speed: Option<&'a [f64]>,
        target: Option<&'a [f64]>,
    ) -> Self {
        let useful = |column: Option<&'a [f64]>| column.filter(|values| values.iter().any(|v| v.is_finite()));
        let (speed, target) = (useful(speed), useful(target));
        let columns: Vec<&[f64]> =
            [Some(time), Some(angle), Some(torque), speed, target].into_iter().flatten().collect();
        let kept: Vec<usize> =
            (0..time.len()).filter(|&i| columns.iter().all(|column| column[i].is_finite())).collect();
        let pick = |column: &'a [f64]| {
            if kept.len() == column.len() {
                Cow::Borrowed(column)
            } else {
                Cow::Owned(kept.iter().map(|&i| column[i]).collect())
            }
        };
        Self {
            time: pick(time),
            angle: pick(angle),
            torque: pick(torque),
            speed: speed.map(pick),
            target: target.map(pick),
        }
    }

    /// Mean speed of some rows, rad/s: the slope of the angle, or the mean of the speed column where they disagree.
    pub(super) fn mean_speed(&self, rows: Range<usize>) -> f64 {
        let slope = slope(&self.time[rows.clone()], &self.angle[rows.clone()]);
        let Some(speed) = &self.speed else { return slope };
        let mean = mean(&speed[rows]);
        // A quantised speed is off by half a step of about 1 deg/s at most.
        let agree = (slope - mean).abs() <= 0.02 + 0.02 * mean.abs();
        if agree { slope } else { mean }
    }

    /// Mean speed of a block, without the cost of a regression.
    fn block_speed(&self, rows: Range<usize>) -> f64 {
        match &self.speed {
            Some(speed) => mean(&speed[rows]),
            None => {
                let last = rows.end.min(self.time.len() - 1);
                (self.angle[last] - self.angle[rows.start]) / (self.time[last] - self.time[rows.start])
            }
        }
    }

    /// Stretches without a gap.
    fn pieces(&self) -> Vec<Range<usize>> {
        let limit = (10.0 * self.sample_time()).max(0.1);
        let mut pieces = Vec::new();
        let mut start = 0;
        for i in 1..self.time.len() {
            if self.time[i] - self.time[i - 1] > limit {
                pieces.push(start..i);
                start = i;
            }
        }
        pieces.push(start..self.time.len());
        pieces
    }

    /// Median time between rows, s.
    fn sample_time(&self) -> f64 {
        median(self.time.windows(2).map(|pair| pair[1] - pair[0]).collect())
    }

    fn duration(&self, rows: &Range<usize>) -> f64 {
        self.time[rows.end - 1] - self.time[rows.start]
    }
}

/// A stretch at one level, in blocks.
#[derive(Clone, Debug)]
struct Level {
    blocks: Range<usize>,
    mean: f64,
}

/// Splits a recording at its speeds.
pub(super) fn split(recording: &Recording) -> Split {
    let mut found = Split { dwells: Vec::new(), constant_share: 0.0, short_dwells: 0, warnings: Vec::new() };
    if recording.time.len() < LEAST_SAMPLES {
        found.warnings.push(format!("the log has only {} usable rows", recording.time.len()));
        return found;
    }
    let duration = recording.time[recording.time.len() - 1] - recording.time[0];
    let block_s = BLOCK_S.max(duration / MOST_BLOCKS as f64);
    let block = (block_s / recording.sample_time()).round().max(1.0) as usize;
    let (mut constant, mut moving) = (0.0, 0.0);
    for piece in recording.pieces() {
        let blocks = Blocks::new(recording, piece, block);
        moving += blocks.moving_time(recording);
        let before = found.warnings.len();
        let candidates = candidates(recording, &blocks, &mut found.warnings);
        found.short_dwells += found.warnings.len() - before;
        for rows in candidates {
            let rows = settled(&blocks, rows);
            if keep(recording, &blocks, &rows, &mut found.warnings) {
                constant += recording.duration(&rows);
                found.dwells.push(rows);
            }
        }
    }
    found.constant_share = if moving > 0.0 { (constant / moving).min(1.0) } else { 0.0 };
    found
}

/// Means of the speed over blocks of rows.
struct Blocks {
    rows: Range<usize>,
    size: usize,
    speed: Vec<f64>,
}

impl Blocks {
    fn new(recording: &Recording, rows: Range<usize>, size: usize) -> Self {
        let count = rows.len() / size;
        let speed = (0..count)
            .map(|b| rows.start + b * size)
            .map(|start| recording.block_speed(start..start + size))
            .collect();
        Self { rows, size, speed }
    }

    fn rows_of(&self, blocks: &Range<usize>) -> Range<usize> {
        let start = self.rows.start + blocks.start * self.size;
        start..self.rows.start + blocks.end * self.size
    }

    fn moving_time(&self, recording: &Recording) -> f64 {
        let moving = self.speed.iter().filter(|speed| speed.abs() > REST_RAD_S).count();
        recording.duration(&self.rows) * moving as f64 / self.speed.len().max(1) as f64
    }

    /// Standard deviation of a block's mean, from the differences of neighbours; ramps and steps are outliers.
    fn noise(&self) -> f64 {
        let differences: Vec<f64> = self.speed.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        if differences.is_empty() { 0.0 } else { 1.4826 * median(differences) / std::f64::consts::SQRT_2 }
    }

    /// Noise below which a difference of levels means nothing, rad/s.
    fn resolution(&self) -> f64 {
        self.noise().max(0.1 * LEVEL_RAD_S)
    }
}

/// Rows that may be dwells: stretches of constant target, else of constant measured level.
fn candidates(recording: &Recording, blocks: &Blocks, warnings: &mut Vec<String>) -> Vec<Range<usize>> {
    if let Some(target) = &recording.target {
        let runs = constant_runs(target, blocks.rows.clone());
        let steady: f64 = runs
            .iter()
            .filter(|rows| long_enough(recording, rows))
            .map(|rows| recording.duration(rows))
            .sum();
        if steady >= 0.5 * recording.duration(&blocks.rows) {
            let (long, short): (Vec<_>, Vec<_>) =
                runs.into_iter().partition(|rows| long_enough(recording, rows));
            // Shorter than a block is a step of a ramp.
            let dwells =
                short.iter().filter(|rows| rows.len() > 2 * blocks.size && target[rows.start] != 0.0);
            warnings.extend(dwells.map(|rows| too_short(recording, rows)));
            return long;
        }
    }
    let levels = merged(change_points(&blocks.speed, blocks.resolution()), blocks);
    let mut kept = Vec::new();
    for (i, level) in levels.iter().enumerate() {
        let rows = blocks.rows_of(&level.blocks);
        if long_enough(recording, &rows) {
            kept.push(rows);
        } else if is_flat(blocks, &levels, i) {
            warnings.push(too_short(recording, &rows));
        }
    }
    kept
}

fn too_short(recording: &Recording, rows: &Range<usize>) -> String {
    format!(
        "the segment from {:.2} s to {:.2} s ({} samples) is too short and was skipped: {LEAST_DWELL_S} s and \
         {LEAST_SAMPLES} samples are required",
        recording.time[rows.start],
        recording.time[rows.end - 1],
        rows.len()
    )
}

fn long_enough(recording: &Recording, rows: &Range<usize>) -> bool {
    rows.len() >= LEAST_SAMPLES && recording.duration(rows) >= 0.98 * LEAST_DWELL_S
}

/// Stretches in which a value stays exactly the same.
fn constant_runs(values: &[f64], rows: Range<usize>) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = rows.start;
    for i in rows.start + 1..=rows.end {
        if i == rows.end || values[i] != values[start] {
            runs.push(start..i);
            start = i;
        }
    }
    runs
}

/// Returns whether a short piece is a dwell rather than a part of a ramp: its drift is small next to the steps around
/// it.
fn is_flat(blocks: &Blocks, levels: &[Level], i: usize) -> bool {
    let Some(neighbours) =
        i.checked_sub(1).and_then(|before| Some((levels.get(before)?, levels.get(i + 1)?)))
    else {
        return false;
    };
    let level = &levels[i];
    let step = (level.mean - neighbours.0.mean).abs().min((level.mean - neighbours.1.mean).abs());
    let values = &blocks.speed[level.blocks.clone()];
    let flat = drift(values).abs() < 0.25 * step && !bends(values, level.mean);
    level.blocks.len() >= 4 && level.mean.abs() > LEVEL_RAD_S && flat
}

/// A candidate without the blocks at its start in which the motor is still on its way to the speed of its second
/// half; at most half of it is cut.
fn settled(blocks: &Blocks, rows: Range<usize>) -> Range<usize> {
    let first = (rows.start - blocks.rows.start).div_ceil(blocks.size);
    let last = ((rows.end - blocks.rows.start) / blocks.size).min(blocks.speed.len());
    let half = first + last.saturating_sub(first) / 2;
    if half >= last {
        return rows;
    }
    let later = &blocks.speed[half..last];
    let level = median(later.to_vec());
    let allowed = (0.02 * level.abs()).max(LEVEL_RAD_S).max(4.0 * standard_deviation(later));
    let off = (first..half).rev().find(|&b| (blocks.speed[b] - level).abs() > allowed);
    off.map_or(rows.start, |b| blocks.rows_of(&(b..b + 1)).end)..rows.end
}

/// Returns whether a candidate is steady once its first and last tenth are gone, and in motion.
fn keep(recording: &Recording, blocks: &Blocks, rows: &Range<usize>, warnings: &mut Vec<String>) -> bool {
    if !long_enough(recording, rows) {
        warnings.push(too_short(recording, rows));
        return false;
    }
    let edge = rows.len() / 10;
    let inner = rows.start + edge..rows.end - edge;
    let speed = recording.mean_speed(inner.clone());
    if speed.abs() <= REST_RAD_S {
        return false;
    }
    let first = (inner.start - blocks.rows.start).div_ceil(blocks.size);
    let last = ((inner.end - blocks.rows.start) / blocks.size).min(blocks.speed.len());
    let values = &blocks.speed[first.min(last)..last];
    let swing = standard_deviation(values);
    let spread = 3.5 * swing / (values.len().max(1) as f64).sqrt();
    let allowed = (0.1 * speed.abs()).max(2.0 * LEVEL_RAD_S).max(spread.min(0.3 * speed.abs()));
    let moved = drift(values).abs();
    let steady =
        !bends(values, speed) && moved <= allowed && swing <= (0.15 * speed.abs()).max(5.0 * LEVEL_RAD_S);
    if !steady {
        warnings.push(format!(
            "the speed is not constant from {:.2} s to {:.2} s (mean {speed:.3}, drift {moved:.3}, standard deviation \
             {swing:.3} rad/s): the segment was skipped",
            recording.time[rows.start],
            recording.time[rows.end - 1]
        ));
    }
    steady
}

/// Joins neighbours whose levels differ by less than can matter.
fn merged(levels: Vec<Level>, blocks: &Blocks) -> Vec<Level> {
    let mut joined: Vec<Level> = Vec::new();
    for level in levels {
        match joined.last_mut() {
            Some(last) if (last.mean - level.mean).abs() <= LEVEL_RAD_S.max(0.02 * last.mean.abs()) => {
                last.blocks.end = level.blocks.end;
                last.mean = mean(&blocks.speed[last.blocks.clone()]);
            }
            _ => joined.push(level),
        }
    }
    joined
}

/// Levels of a piecewise constant signal in noise of a known standard deviation.
fn change_points(signal: &[f64], noise: f64) -> Vec<Level> {
    let count = signal.len();
    if count == 0 {
        return Vec::new();
    }
    let price = 6.0 * noise * noise * (count as f64).ln().max(1.0);
    // Sums from a middle value on, so that squares keep their digits.
    let middle = signal[count / 2];
    let mut sums = vec![(0.0, 0.0)];
    for value in signal {
        let (sum, squares) = sums[sums.len() - 1];
        let value = value - middle;
        sums.push((sum + value, squares + value * value));
    }
    let deviation = |from: usize, to: usize| {
        let sum = sums[to].0 - sums[from].0;
        (sums[to].1 - sums[from].1 - sum * sum / (to - from) as f64).max(0.0)
    };
    let mut least = vec![-price];
    let mut previous = vec![0];
    let mut open = vec![0];
    for end in 1..=count {
        let cost = |&start: &usize| least[start] + deviation(start, end) + price;
        let best = open.iter().copied().reduce(|a, b| if cost(&b) < cost(&a) { b } else { a }).unwrap_or(0);
        let cheapest = cost(&best);
        // A start that is dearer even without a further cut never wins again.
        open.retain(|start| least[*start] + deviation(*start, end) <= cheapest);
        least.push(cheapest);
        previous.push(best);
        open.push(end);
    }
    let mut levels = Vec::new();
    let mut end = count;
    while end > 0 {
        let start = previous[end];
        levels.push(Level { blocks: start..end, mean: mean(&signal[start..end]) });
        end = start;
    }
    levels.reverse();
    levels
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn standard_deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Slope of a regression line.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let (middle_x, middle_y) = (mean(x), mean(y));
    let square: f64 = x.iter().map(|x| (x - middle_x) * (x - middle_x)).sum();
    x.iter().zip(y).map(|(x, y)| (x - middle_x) * (y - middle_y)).sum::<f64>() / square
}

/// Rise of the regression line from the first to the last value; 0 for fewer than two.
fn drift(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return 0.0;
    }
    let x: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
    slope(&x, values) * (values.len() - 1) as f64
}

/// Returns whether the speed is rather the top of a swing.
fn bends(values: &[f64], speed: f64) -> bool {
    bend(values).abs() > (0.06 * speed.abs()).max(2.0 * LEVEL_RAD_S)
}

/// Mean of the middle third less that of the outer thirds: the top of a swing is no constant speed, however flat.
fn bend(values: &[f64]) -> f64 {
    let third = values.len() / 3;
    if third == 0 {
        return 0.0;
    }
    let (start, end) = (&values[..third], &values[values.len() - third..]);
    mean(&values[third..values.len() - third]) - 0.5 * (mean(start) + mean(end))
}
