//! Min/max decimation: at most two points a pixel column, so that cost and picture do not depend on how
//! much data is behind them.
//!
//! Awkward values: a sample that is not finite, and a step in time longer than the gap limit, end a piece of
//! the line; nothing that is not finite ever reaches the plot. Times must not run back.

use egui_plot::PlotPoint;

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

/// What is visible of a curve.
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
}

/// The decimated picture of one curve, kept until data, range or width change.
#[derive(Default)]
pub struct DecimationCache {
    key: Option<(u64, [u64; 3], usize)>,
    visible: Visible,
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
        let bits = [range[0], range[1], curve.scale].map(f64::to_bits);
        let key = Some((generation, bits, columns));
        if self.key != key {
            self.key = key;
            self.visible = decimate(curve, range, columns);
        }
        &self.visible
    }
}

/// The visible part of a curve; see [`Curve`].
pub fn decimate(curve: Curve<'_>, range: [f64; 2], columns: usize) -> Visible {
    let length = curve.x.len().min(curve.y.len());
    let valid = range[0].is_finite() && range[1].is_finite() && range[1] > range[0] && columns > 0;
    if length == 0 || !valid {
        return Visible::default();
    }
    let inside = curve.x[..length].partition_point(|&x| x < range[0])
        ..curve.x[..length].partition_point(|&x| x <= range[1]);
    // One sample beyond each end keeps the line going to the edge of the plot.
    let drawn = inside.start.saturating_sub(1)..(inside.end + 1).min(length);
    let statistics = statistics(&curve.y[inside], curve.scale);
    let column_width = column_width(range, columns, drawn.len());
    let mut pieces = Pieces::new(column_width);
    for index in drawn {
        pieces.push(curve.x[index], curve.y[index] * curve.scale, curve.gap);
    }
    Visible { pieces: pieces.finish(), statistics }
}

/// Width of a column in data units; 0 draws each sample. Columns start at whole multiples of their width, so
/// that the picture of old samples does not flicker while the range follows new ones.
fn column_width(range: [f64; 2], columns: usize, samples: usize) -> f64 {
    if samples <= 2 * columns { 0.0 } else { (range[1] - range[0]) / columns as f64 }
}

fn statistics(values: &[f64], scale: f64) -> Option<RangeStatistics> {
    let (mut count, mut min, mut max) = (0_usize, f64::INFINITY, f64::NEG_INFINITY);
    // Sums about the first value, in one pass: no digits are lost to a large mean.
    let shift = values.iter().copied().find(|value| value.is_finite())?;
    let (mut sum, mut squares) = (0.0, 0.0);
    for value in values.iter().filter(|value| value.is_finite()) {
        let moved = value - shift;
        count += 1;
        sum += moved;
        squares += moved * moved;
        min = min.min(*value);
        max = max.max(*value);
    }
    let mean = sum / count as f64;
    let variance = (squares / count as f64 - mean * mean).max(0.0);
    let ends = [min * scale, max * scale];
    Some(RangeStatistics {
        count,
        min: ends[0].min(ends[1]),
        max: ends[0].max(ends[1]),
        mean: (shift + mean) * scale,
        std: variance.sqrt() * scale.abs(),
    })
}

/// Builds the pieces column by column.
struct Pieces {
    column_width: f64,
    done: Vec<Vec<PlotPoint>>,
    current: Vec<PlotPoint>,
    column: Option<Column>,
}

/// Lowest and highest sample of one column.
struct Column {
    /// Where the next column begins.
    end: f64,
    last_x: f64,
    low: PlotPoint,
    high: PlotPoint,
}

impl Pieces {
    fn new(column_width: f64) -> Self {
        Self { column_width, done: Vec::new(), current: Vec::new(), column: None }
    }

    fn push(&mut self, x: f64, y: f64, gap: f64) {
        if !(x.is_finite() && y.is_finite()) {
            self.end_piece();
            return;
        }
        if self.last_x().is_some_and(|last| x - last > gap) {
            self.end_piece();
        }
        let point = PlotPoint::new(x, y);
        if self.column_width == 0.0 {
            self.current.push(point);
            return;
        }
        match &mut self.column {
            Some(column) if x < column.end => column.add(point),
            _ => {
                self.end_column();
                let end = ((x / self.column_width).floor() + 1.0) * self.column_width;
                self.column = Some(Column { end, last_x: x, low: point, high: point });
            }
        }
    }

    fn last_x(&self) -> Option<f64> {
        self.column.as_ref().map(|column| column.last_x).or_else(|| self.current.last().map(|point| point.x))
    }

    fn end_column(&mut self) {
        if let Some(column) = self.column.take() {
            column.emit(&mut self.current);
        }
    }

    fn end_piece(&mut self) {
        self.end_column();
        if !self.current.is_empty() {
            self.done.push(std::mem::take(&mut self.current));
        }
    }

    fn finish(mut self) -> Vec<Vec<PlotPoint>> {
        self.end_piece();
        self.done
    }
}

impl Column {
    fn add(&mut self, point: PlotPoint) {
        if point.y < self.low.y {
            self.low = point;
        }
        if point.y > self.high.y {
            self.high = point;
        }
        self.last_x = point.x;
    }

    /// Both extremes in their order; one point where they are the same.
    fn emit(self, points: &mut Vec<PlotPoint>) {
        let (early, late) =
            if self.low.x <= self.high.x { (self.low, self.high) } else { (self.high, self.low) };
        points.push(early);
        if late != early {
            points.push(late);
        }
    }
}

#[cfg(test)]
mod tests {
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
        assert!(points.len() <= 2 * 501, "{}", points.len());
        assert!(points.windows(2).all(|pair| pair[0].x <= pair[1].x));
        let highest = points.iter().map(|p| p.y).fold(f64::MIN, f64::max);
        let lowest = points.iter().map(|p| p.y).fold(f64::MAX, f64::min);
        assert_eq!((lowest, highest), (-9.0, 7.0));
        let statistics = visible.statistics.unwrap();
        assert_eq!((statistics.min, statistics.max, statistics.count), (-9.0, 7.0, 60_000));
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
