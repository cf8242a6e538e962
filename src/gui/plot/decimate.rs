//! Drawn parts of a curve: the extremes of each pixel column, from its pyramid, so that cost and picture do not
//! depend on how much data is behind them.
//!
//! Awkward values: a sample that is not finite, and a step in time longer than the gap limit, end a piece of
//! the line; nothing that is not finite ever reaches the plot. Within one column, what lies between its first and
//! its last gap is one piece. A curve whose times are not finite or run back is not drawn.

use std::ops::Range;

use egui_plot::PlotPoint;

use super::column::{Held, TimeColumn, ValueColumn, Values};
use super::draw_cache::DrawCache;
use super::pyramid::{Extremes, Gaps, Pyramid, Steps, Summary};

/// Data of one curve.
#[derive(Clone, Copy, Debug)]
pub struct Curve<'a> {
    /// Horizontal values, not decreasing.
    pub x: &'a [f64],
    /// Vertical values, as many as `x`.
    pub y: &'a [f64],
    /// The plot shows `y` times this.
    pub scale: f64,
    /// A larger step in `x` is drawn as a gap.
    pub gap: f64,
}

/// Data of a curve.
#[derive(Clone, Copy, Debug)]
pub enum Data<'a> {
    /// Columns that stay while their generation does: horizontal values and as many vertical ones.
    Fixed(&'a [f64], &'a [f64]),
    /// Columns that grow, with pyramids of their own.
    Growing(&'a TimeColumn, &'a ValueColumn),
}

impl Data<'_> {
    /// Lineages of both columns: unchanged as long as samples are only appended or dropped at the start.
    fn lineages(&self, generation: u64) -> [u64; 2] {
        match self {
            Self::Fixed(x, _) => [generation, x.len() as u64],
            Self::Growing(x, y) => [x.values.lineage(), y.values.lineage()],
        }
    }
}

/// Visible parts of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Visible {
    /// Pieces of the line, gaps between them.
    pub pieces: Vec<Vec<PlotPoint>>,
    /// Statistics of all visible samples, not only of those drawn; none when nothing is visible.
    pub statistics: Option<RangeStatistics>,
}

/// Statistics of the finite samples in a range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeStatistics {
    /// Number of samples.
    pub count: usize,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation, of the samples (divided by their number).
    pub std: f64,
}

impl RangeStatistics {
    /// Largest minus smallest value.
    pub fn peak_to_peak(&self) -> f64 {
        self.max - self.min
    }

    /// Root of the mean square.
    pub fn rms(&self) -> f64 {
        self.mean.hypot(self.std)
    }

    fn new(summary: &Summary, scale: f64) -> Self {
        let Extremes { min, max, .. } = summary.extremes;
        let ends = [min * scale, max * scale];
        Self {
            count: summary.count,
            min: ends[0].min(ends[1]),
            max: ends[0].max(ends[1]),
            mean: summary.mean * scale,
            std: (summary.squares / summary.count as f64).sqrt() * scale.abs(),
        }
    }
}

/// A curve with its pyramids: every question about it costs the same however long it is.
#[derive(Clone, Copy)]
pub(super) struct Indexed<'a> {
    gaps: Gaps<'a>,
    scale: f64,
    length: usize,
    dropped: usize,
}

/// Samples of a range that stay as they are, for a worker.
#[derive(Clone, Debug)]
pub(super) struct Snapshot {
    x: Held,
    y: Held,
    scale: f64,
}

impl Snapshot {
    /// Number of samples.
    pub(super) fn len(&self) -> usize {
        self.x.len()
    }

    /// Time of a sample.
    pub(super) fn x(&self, index: usize) -> f64 {
        self.x.at(index)
    }

    /// A sample as it is shown.
    pub(super) fn y(&self, index: usize) -> f64 {
        self.y.at(index) * self.scale
    }
}

impl<'a> Indexed<'a> {
    fn new(gaps: Gaps<'a>, scale: f64, dropped: usize) -> Self {
        let length = gaps.x.len().min(gaps.y.len());
        Self { gaps, scale, length: if gaps.steps.are_sound() { length } else { 0 }, dropped }
    }

    /// A curve of columns that grow.
    pub(super) fn growing(x: &'a TimeColumn, y: &'a ValueColumn, scale: f64, gap: f64) -> Self {
        let (steps, pyramid, dropped) = (&x.steps, &y.pyramid, x.values.dropped());
        let (x, y) = (Values::Chunks(&x.values), Values::Chunks(&y.values));
        Self::new(Gaps { x, steps, y, pyramid, longest: gap }, scale, dropped)
    }

    /// Number of samples.
    pub(super) fn len(&self) -> usize {
        self.length
    }

    /// Time of a sample.
    pub(super) fn x(&self, index: usize) -> f64 {
        self.gaps.x.at(index)
    }

    /// A sample as it is shown.
    pub(super) fn y(&self, index: usize) -> f64 {
        self.gaps.y.at(index) * self.scale
    }

    /// The samples from `range[0]` to `range[1]`, both included.
    pub(super) fn inside(&self, range: [f64; 2]) -> Range<usize> {
        let start = self.gaps.x.partition_point(0..self.length, |x| x < range[0]);
        start..self.gaps.x.partition_point(start..self.length, |x| x <= range[1])
    }

    /// Statistics of the finite samples.
    pub(super) fn statistics(&self, range: Range<usize>) -> Option<RangeStatistics> {
        let summary = self.gaps.pyramid.summary(self.gaps.y, range)?;
        Some(RangeStatistics::new(&summary, self.scale))
    }

    /// The sample that holds at a time: the last one not later; none before the first and beyond a gap.
    pub(super) fn held_at(&self, x: f64) -> Option<usize> {
        let index = self.gaps.x.partition_point(0..self.length, |other| other <= x).checked_sub(1)?;
        (x - self.x(index) <= self.gaps.longest && self.y(index).is_finite()).then_some(index)
    }

    /// The sample nearest to a time; none of an empty curve.
    pub(super) fn nearest(&self, x: f64) -> Option<usize> {
        let after = self.gaps.x.partition_point(0..self.length, |other| other < x);
        let before = after
            .checked_sub(1)
            .filter(|before| after == self.length || x - self.x(*before) <= self.x(after) - x);
        before.or((after < self.length).then_some(after))
    }

    /// The last sample of a range that is shown outside of `band`.
    pub(super) fn last_outside(&self, range: Range<usize>, band: [f64; 2]) -> Option<usize> {
        let ends = band.map(|end| end / self.scale);
        let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        self.gaps.pyramid.last_outside(self.gaps.y, range, ends)
    }

    /// The longest part of a range without a gap.
    pub(super) fn longest_run(&self, range: Range<usize>) -> Range<usize> {
        let (mut best, mut start) = (range.start..range.start, range.start);
        while start < range.end {
            let gap = self.gaps.first(start..range.end).unwrap_or(range.end);
            if gap - start > best.len() {
                best = start..gap;
            }
            // What is no number is left out; what follows a gap begins the next part.
            let is_hole = gap < range.end && !self.gaps.y.at(gap).is_finite();
            start = gap + usize::from(is_hole || gap == start);
        }
        best
    }

    /// The samples of a range for a worker.
    pub(super) fn snapshot(&self, range: Range<usize>) -> Snapshot {
        let (x, y) = (self.gaps.x.held(range.clone()), self.gaps.y.held(range));
        Snapshot { x, y, scale: self.scale }
    }

    /// Returns the drawn parts between `range[0]` and `range[1]` in a plot of `columns` pixels.
    pub(super) fn visible(&self, range: [f64; 2], columns: usize) -> Visible {
        self.visible_of(range, columns, &mut DrawCache::default(), [0; 4])
    }

    /// Same as [`Self::visible`], with the columns `kept` from the last frame; see [`DrawCache::draw`] for `of`.
    fn visible_of(&self, range: [f64; 2], columns: usize, kept: &mut DrawCache, of: [u64; 4]) -> Visible {
        let valid = range[0].is_finite() && range[1].is_finite() && range[1] > range[0] && columns > 0;
        if self.length == 0 || !valid {
            return Visible::default();
        }
        let inside = self.inside(range);
        // One sample beyond each end keeps the line going to the edge of the plot.
        let drawn = inside.start.saturating_sub(1)..(inside.end + 1).min(self.length);
        let statistics = self.statistics(inside);
        let mut pieces = Pieces::default();
        if drawn.len() <= 2 * columns {
            for index in drawn.clone() {
                if index > drawn.start && self.gaps.is_before(index) {
                    pieces.end();
                }
                pieces.point(PlotPoint::new(self.x(index), self.y(index)));
            }
        } else {
            kept.draw(self, of, drawn, (range[1] - range[0]) / columns as f64, &mut pieces);
        }
        pieces.end();
        Visible { pieces: pieces.done, statistics }
    }

    /// The first sample of those up to `at` that is not below `edge`.
    pub(super) fn first_from(&self, at: usize, edge: f64) -> usize {
        self.gaps.x.partition_point(0..at, |x| x < edge)
    }

    pub(super) fn gaps(&self) -> &Gaps<'a> {
        &self.gaps
    }

    /// Number of samples dropped at the start of the curve.
    pub(super) fn dropped(&self) -> usize {
        self.dropped
    }

    /// Both extremes of a range in their order; `None` if no sample is finite.
    pub(super) fn extremes(&self, range: Range<usize>) -> Option<[PlotPoint; 2]> {
        let found = self.gaps.pyramid.extremes(self.gaps.y, range)?;
        let low = PlotPoint::new(self.x(found.min_at), found.min * self.scale);
        let high = PlotPoint::new(self.x(found.max_at), found.max * self.scale);
        Some(if found.min_at <= found.max_at { [low, high] } else { [high, low] })
    }
}

/// The picture and the pyramids of one curve, kept until data, range or width change.
#[derive(Default)]
pub struct DecimationCache {
    key: Option<(u64, [u64; 4], usize)>,
    visible: Visible,
    kept: DrawCache,
    own: OwnPyramids,
}

/// Pyramids of columns that have none.
#[derive(Default)]
struct OwnPyramids {
    /// Generation and length of what they are of.
    of: Option<(u64, usize)>,
    steps: Steps,
    pyramid: Pyramid,
}

impl DecimationCache {
    /// The visible part of `curve` between `range[0]` and `range[1]`, for a plot `columns` pixels wide.
    /// `generation` must change whenever the curve's data do.
    pub fn visible(
        &mut self,
        curve: Curve<'_>,
        generation: u64,
        range: [f64; 2],
        columns: usize,
    ) -> &Visible {
        let Curve { x, y, scale, gap } = curve;
        self.visible_of(Data::Fixed(x, y), [scale, gap], generation, range, columns)
    }

    /// Same as [`Self::visible`], for any data; `look` is the scale and the largest step that is no gap.
    pub(super) fn visible_of(
        &mut self,
        data: Data<'_>,
        look: [f64; 2],
        generation: u64,
        range: [f64; 2],
        columns: usize,
    ) -> &Visible {
        let [start, end, scale, gap] = [range[0], range[1], look[0], look[1]].map(f64::to_bits);
        let key = Some((generation, [start, end, scale, gap], columns));
        if self.key != key {
            self.key = key;
            let [x, y] = data.lineages(generation);
            let curve = self.own.indexed(data, look, generation);
            self.visible = curve.visible_of(range, columns, &mut self.kept, [x, y, scale, gap]);
        }
        &self.visible
    }

    /// Last visible parts.
    pub(super) fn last_visible(&self) -> &Visible {
        &self.visible
    }

    /// The curve with its pyramids, which are made here for columns that have none.
    pub(super) fn indexed<'a>(&'a mut self, data: Data<'a>, look: [f64; 2], generation: u64) -> Indexed<'a> {
        self.own.indexed(data, look, generation)
    }
}

impl OwnPyramids {
    fn indexed<'a>(&'a mut self, data: Data<'a>, [scale, gap]: [f64; 2], generation: u64) -> Indexed<'a> {
        match data {
            Data::Growing(x, y) => Indexed::growing(x, y, scale, gap),
            Data::Fixed(x, y) => {
                let (x, y) = (Values::Slice(x), Values::Slice(y));
                let of = Some((generation, x.len()));
                if self.of != of {
                    (self.of, self.steps, self.pyramid) = (of, Steps::of(x), Pyramid::of(y));
                }
                let (steps, pyramid) = (&self.steps, &self.pyramid);
                Indexed::new(Gaps { x, steps, y, pyramid, longest: gap }, scale, 0)
            }
        }
    }
}

/// The visible part of a curve; see [`Curve`].
pub fn decimate(curve: Curve<'_>, range: [f64; 2], columns: usize) -> Visible {
    DecimationCache::default().visible(curve, 0, range, columns).clone()
}

/// Pieces of a line while it is put together.
#[derive(Default)]
pub(super) struct Pieces {
    done: Vec<Vec<PlotPoint>>,
    current: Vec<PlotPoint>,
}

impl Pieces {
    pub(super) fn end(&mut self) {
        if !self.current.is_empty() {
            self.done.push(std::mem::take(&mut self.current));
        }
    }

    /// Makes room for so many points.
    pub(super) fn reserve(&mut self, points: usize) {
        self.current.reserve(points);
    }

    /// One sample; what is no number, or none any more in the unit that is shown, ends the piece.
    fn point(&mut self, point: PlotPoint) {
        if point.y.is_finite() {
            self.current.push(point);
        } else {
            self.end();
        }
    }

    /// Both extremes of a range in their order; one point where they are the same.
    pub(super) fn extremes(&mut self, extremes: Option<[PlotPoint; 2]>) {
        let Some([early, late]) = extremes else { return };
        self.point(early);
        if late != early {
            self.point(late);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::CHUNK;
    use super::*;

    fn curve<'a>(x: &'a [f64], y: &'a [f64]) -> Curve<'a> {
        Curve { x, y, scale: 1.0, gap: 1.0 }
    }

    #[test]
    fn extremes_survive_and_few_points_remain() {
        let x: Vec<f64> = (0..60_000).map(|i| f64::from(i) * 1e-3).collect();
        let mut y: Vec<f64> = x.iter().map(|t| (3.0 * t).sin()).collect();
        y[12_345] = 7.0;
        y[54_321] = -9.0;
        let visible = decimate(curve(&x, &y), [0.0, 60.0], 500);
        let points: Vec<_> = visible.pieces.concat();
        assert_eq!(visible.pieces.len(), 1);
        // Columns are up to an eighth narrower than a pixel.
        assert!(points.len() <= 2 * (500 * 9 / 8 + 1), "{}", points.len());
        assert!(points.windows(2).all(|pair| pair[0].x <= pair[1].x));
        let highest = points.iter().map(|p| p.y).fold(f64::MIN, f64::max);
        let lowest = points.iter().map(|p| p.y).fold(f64::MAX, f64::min);
        assert_eq!((lowest, highest), (-9.0, 7.0));
        let statistics = visible.statistics.unwrap();
        assert_eq!((statistics.min, statistics.max, statistics.count), (-9.0, 7.0, 60_000));
    }

    /// A tiny generator: the same numbers in every run.
    struct Random(u64);

    impl Random {
        fn below(&mut self, limit: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as usize % limit
        }

        fn unit(&mut self) -> f64 {
            self.below(1 << 30) as f64 / f64::from(1 << 30)
        }
    }

    /// A random walk with holes, infinities and jumps in time, some of them close together.
    fn walk(random: &mut Random, length: usize) -> (Vec<f64>, Vec<f64>) {
        let (mut time, mut value) = (100.0 * random.unit(), 1e3 * random.unit());
        let holes = [0, 3, 300][random.below(3)];
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for _ in 0..length {
            time += match random.below(2000) {
                0 => 5.0,
                1..20 => 0.0,
                _ => 1e-3 * (0.5 + random.unit()),
            };
            value += random.unit() - 0.5;
            x.push(time);
            let hole = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][random.below(3)];
            y.push(if random.below(2000) < holes { hole } else { value });
        }
        (x, y)
    }

    /// The largest of 8 to 15 times a power of two that is not above `width`.
    fn width_of_columns(width: f64) -> f64 {
        let mut unit = 2.0_f64.powi(60);
        while 8.0 * unit > width {
            unit *= 0.5;
        }
        (8..16).map(|eighths| f64::from(eighths) * unit).rfind(|column| *column <= width).unwrap()
    }

    /// Walks over every sample: columns, then the runs between gaps of each, the inner ones as one.
    fn brute_force(curve: Curve<'_>, range: [f64; 2], columns: usize) -> Vec<Vec<PlotPoint>> {
        let Curve { x, y, scale, gap } = curve;
        let inside: Vec<usize> = (0..x.len()).filter(|&i| x[i] >= range[0] && x[i] <= range[1]).collect();
        let after = x.iter().filter(|&&x| x < range[0]).count();
        let (mut start, mut end) = (after.saturating_sub(1), (after + inside.len() + 1).min(x.len()));
        let mut width = 0.0;
        if end - start > 2 * columns {
            width = width_of_columns((range[1] - range[0]) / columns as f64);
            // Columns are whole.
            let same = |i: usize, j: usize| (x[i] / width).floor() == (x[j] / width).floor();
            while start > 0 && same(start - 1, start) {
                start -= 1;
            }
            while end < x.len() && same(end - 1, end) {
                end += 1;
            }
        }
        // A column is the list of its runs; a run is a list of samples.
        let mut picture: Vec<Vec<Vec<usize>>> = Vec::new();
        let mut limit = f64::NEG_INFINITY;
        let mut joined = Vec::new();
        for i in start..end {
            let jump = i > start && x[i] - x[i - 1] > gap;
            if width == 0.0 || x[i] >= limit || i == start {
                limit = ((x[i] / width).floor() + 1.0) * width;
                joined.push(i > start && !jump && y[i].is_finite() && y[i - 1].is_finite());
                picture.push(vec![Vec::new(); if y[i].is_finite() { 1 } else { 2 }]);
            } else if jump || !y[i].is_finite() {
                picture.last_mut().unwrap().push(Vec::new());
            }
            if y[i].is_finite() {
                picture.last_mut().unwrap().last_mut().unwrap().push(i);
            }
        }
        let extremes = |run: &[usize]| -> Vec<PlotPoint> {
            let Some(&first) = run.first() else { return Vec::new() };
            let low = run.iter().fold(first, |best, &i| if y[i] < y[best] { i } else { best });
            let high = run.iter().fold(first, |best, &i| if y[i] > y[best] { i } else { best });
            let mut both = vec![low.min(high), low.max(high)];
            both.dedup();
            both.into_iter().map(|i| PlotPoint::new(x[i], y[i] * scale)).collect()
        };
        let mut pieces: Vec<Vec<PlotPoint>> = Vec::new();
        for (column, joined) in picture.iter().zip(joined) {
            let mut runs = vec![column[0].clone()];
            if let [_, inner @ .., last] = column.as_slice() {
                runs.extend([inner.concat(), last.clone()]);
            }
            for (number, run) in runs.iter().enumerate() {
                let points = extremes(run);
                match pieces.last_mut() {
                    Some(piece) if number == 0 && joined => piece.extend(points),
                    _ => pieces.push(points),
                }
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        pieces
    }

    #[test]
    fn the_pyramid_draws_what_every_sample_alone_would() {
        let mut random = Random(7);
        for round in 0..60 {
            let length = [3, 63, 64, 65, 700, 40_000][random.below(6)];
            let (x, y) = walk(&mut random, length);
            let curve = Curve { x: &x, y: &y, scale: [1.0, -57.3][random.below(2)], gap: 0.1 };
            let (mut time, mut values) = (TimeColumn::default(), ValueColumn::default());
            // In odd portions, so that blocks are completed in all places.
            let mut taken = 0;
            while taken < length {
                let end = (taken + 1 + random.below(977)).min(length);
                x[taken..end].iter().for_each(|x| time.push(*x));
                y[taken..end].iter().for_each(|y| values.push(*y));
                taken = end;
            }
            let growing = Indexed::growing(&time, &values, curve.scale, curve.gap);
            for _ in 0..8 {
                let span = x[length - 1] - x[0];
                let start = x[0] + span * (1.4 * random.unit() - 0.2);
                let range = [start, start + 1e-3 + span * random.unit() * random.unit()];
                let columns = 1 + random.below(900);
                let expected = brute_force(curve, range, columns);
                let found = decimate(curve, range, columns);
                assert!(found.pieces == expected, "round {round}, {range:?}, {columns} columns of {length}");
                assert!(growing.visible(range, columns) == found, "round {round}");
                let inside =
                    (0..length).filter(|&i| x[i] >= range[0] && x[i] <= range[1] && y[i].is_finite());
                let inside: Vec<f64> = inside.map(|i| y[i] * curve.scale).collect();
                check_statistics(found.statistics, &inside);
            }
        }
    }

    fn check_statistics(found: Option<RangeStatistics>, values: &[f64]) {
        let Some(found) = found else { return assert!(values.is_empty()) };
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let std = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
        let ends = values.iter().fold([f64::MAX, f64::MIN], |e, v| [e[0].min(*v), e[1].max(*v)]);
        assert_eq!((found.count, [found.min, found.max]), (values.len(), ends));
        let size = ends[0].abs().max(ends[1].abs()).max(1.0);
        assert!((found.mean - mean).abs() <= 1e-11 * size, "{} {mean}", found.mean);
        assert!((found.std - std).abs() <= 1e-9 * size, "{} {std}", found.std);
    }

    /// Data grow, the oldest are dropped, the view follows, stands, moves and zooms: what is kept from one frame to the
    /// next makes no difference.
    #[test]
    fn what_is_kept_of_the_last_frame_draws_what_a_fresh_start_would() {
        for seed in 0..6 {
            let mut random = Random(100 + seed);
            let (x, y) = walk(&mut random, 4 * CHUNK);
            let (mut time, mut values) = (TimeColumn::default(), ValueColumn::default());
            let (mut cache, mut taken, mut dropped) = (DecimationCache::default(), 0, 0);
            let (mut span, mut center, mut columns) = (1.0, x[0], 300);
            for frame in 0..400 {
                for _ in 0..random.below(300).min(x.len() - taken) {
                    time.push(x[taken]);
                    values.push(y[taken]);
                    taken += 1;
                }
                if time.len() > 2 * CHUNK + 5000 {
                    time.drop_chunk();
                    values.drop_chunk();
                    dropped += CHUNK;
                }
                if taken == dropped {
                    continue;
                }
                let [first, last] = [x[dropped], x[taken - 1]];
                match random.below(40) {
                    0 => span = (last - first + 1.0) * random.unit(),
                    1 => center = first + (last - first) * random.unit(),
                    2 => columns = 50 + random.below(900),
                    3..20 => center += span * (random.unit() - 0.5) * 0.3,
                    20..25 => center = last - 0.5 * span,
                    25..30 => (span, center) = (last - first + 1e-3, 0.5 * (first + last)),
                    _ => {}
                }
                let range = [center - 0.5 * span, center + 0.5 * span];
                let data = Data::Growing(&time, &values);
                let found = cache.visible_of(data, [2.0, 0.1], frame, range, columns);
                let fresh = Indexed::growing(&time, &values, 2.0, 0.1).visible(range, columns);
                assert!(*found == fresh, "seed {seed}, frame {frame}, {range:?}, {columns} columns");
            }
            // Another column in the same place is another curve.
            let count = time.len();
            (time, values) = (TimeColumn::default(), ValueColumn::default());
            (0..count).for_each(|index| {
                time.push(x[dropped + index]);
                values.push(1.0);
            });
            let range = [x[dropped], x[taken - 1]];
            let found = cache.visible_of(Data::Growing(&time, &values), [2.0, 0.1], 401, range, columns);
            assert!(found.pieces.iter().flatten().all(|point| point.y == 2.0), "seed {seed}");
        }
    }

    #[test]
    fn what_is_dropped_at_the_start_leaves_the_rest_as_it_was() {
        let mut random = Random(3);
        let (x, y) = walk(&mut random, 2 * CHUNK + 1234);
        let (mut time, mut values) = (TimeColumn::default(), ValueColumn::default());
        x.iter().for_each(|x| time.push(*x));
        y.iter().for_each(|y| values.push(*y));
        time.drop_chunk();
        values.drop_chunk();
        let curve = Curve { x: &x[CHUNK..], y: &y[CHUNK..], scale: 1.0, gap: 0.1 };
        let growing = Indexed::growing(&time, &values, 1.0, 0.1);
        for columns in [50, 777, 40_000] {
            let range = [x[CHUNK] - 1.0, x[x.len() - 1]];
            assert_eq!(growing.visible(range, columns), decimate(curve, range, columns));
        }
        assert_eq!((time.len(), time.first()), (CHUNK + 1234, Some(x[CHUNK])));
    }

    #[test]
    fn the_last_sample_outside_of_a_band_and_the_longest_run_are_found() {
        let x: Vec<f64> = (0..9000).map(f64::from).collect();
        let mut y = vec![0.0; 9000];
        (y[77], y[4567], y[4600]) = (5.0, -5.0, f64::INFINITY);
        let mut cache = DecimationCache::default();
        let curve = cache.indexed(Data::Fixed(&x, &y), [2.0, 1.5], 1);
        assert_eq!(curve.last_outside(0..9000, [-9.0, 9.0]), Some(4567));
        assert_eq!(curve.last_outside(0..4567, [-9.0, 9.0]), Some(77));
        assert_eq!(curve.last_outside(78..4567, [-9.0, 9.0]), None);
        assert_eq!(curve.longest_run(0..9000), 0..4600);
        assert_eq!(curve.longest_run(1000..9000), 4601..9000);
        assert_eq!((curve.held_at(77.5), curve.y(77)), (Some(77), 10.0));
        assert_eq!((curve.held_at(-1.0), curve.held_at(4600.2), curve.held_at(9005.0)), (None, None, None));
    }

    #[test]
    fn a_curve_whose_time_runs_back_is_not_drawn() {
        for x in [[0.0, 2.0, 1.0], [0.0, f64::NAN, 1.0]] {
            assert_eq!(decimate(curve(&x, &[1.0; 3]), [0.0, 2.0], 10), Visible::default());
        }
    }

    #[test]
    fn gaps_and_non_finite_samples_split_the_line_at_any_zoom() {
        let x: Vec<f64> = (0..3000).map(|i| f64::from(i) * 1e-3 + if i < 2000 { 0.0 } else { 5.0 }).collect();
        let mut y = vec![1.0; x.len()];
        y[500] = f64::NAN;
        y[1000] = f64::INFINITY;
        for (range, columns) in [([0.0, 8.0], 100), ([0.0, 8.0], 5000)] {
            let visible = decimate(curve(&x, &y), range, columns);
            assert_eq!(visible.pieces.len(), 4, "{columns} columns");
            assert!(visible.pieces.iter().flatten().all(|p| p.x.is_finite() && p.y.is_finite()));
            assert_eq!(visible.statistics.unwrap().count, 2998);
        }
    }

    #[test]
    fn statistics_are_those_of_the_visible_samples() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        let y = [100.0, 1.0, 2.0, 3.0, 100.0];
        let visible = decimate(Curve { scale: 2.0, ..curve(&x, &y) }, [0.5, 3.5], 100);
        let statistics = visible.statistics.unwrap();
        assert_eq!((statistics.mean, statistics.peak_to_peak()), (4.0, 4.0));
        assert!((statistics.std - (8.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(visible.pieces.concat().len(), 5, "one sample beyond each end is drawn");
    }

    #[test]
    fn nothing_is_visible_of_nothing() {
        for (range, columns) in [([0.0, 0.0], 10), ([f64::NAN, 1.0], 10), ([0.0, 1.0], 0)] {
            assert_eq!(decimate(curve(&[0.5], &[1.0]), range, columns), Visible::default());
        }
        assert_eq!(decimate(curve(&[], &[]), [0.0, 1.0], 10), Visible::default());
    }

    #[test]
    fn the_cache_answers_for_its_key_only() {
        let mut cache = DecimationCache::default();
        let first = cache.visible(curve(&[0.0, 1.0], &[1.0, 2.0]), 1, [0.0, 1.0], 10).clone();
        let same = cache.visible(curve(&[0.0, 1.0], &[5.0, 6.0]), 1, [0.0, 1.0], 10).clone();
        let newer = cache.visible(curve(&[0.0, 1.0], &[5.0, 6.0]), 2, [0.0, 1.0], 10).clone();
        assert_eq!(first, same);
        assert_ne!(first, newer);
    }
}
