//! The pixel columns that a curve is drawn of, kept while samples are appended and while the view moves: only columns
//! that come into view and the last one, which may still grow, are worked out.
//!
//! A column is a stretch of time that starts at a whole multiple of its width. The width is that of a pixel column or
//! up to an eighth less, one of eight to an octave, so that a range that grows keeps its columns for a while. All
//! columns are whole, those at the edges of the view too, so that none depends on where the view is.

use std::collections::VecDeque;
use std::ops::Range;

use egui_plot::PlotPoint;

use super::decimate::{Indexed, Pieces};

/// Both extremes in their order, the same twice where there is but one; `None` if no sample is a number.
type Extremes = Option<[PlotPoint; 2]>;

/// Drawn parts of a column.
struct Column {
    /// Counted from the first sample that the curve ever had.
    samples: Range<usize>,
    /// True if a gap in time lies before it.
    is_apart: bool,
    /// Of all samples, or of those up to the first gap inside.
    first: Extremes,
    /// Of the samples from the first gap to the last one, and of those after that.
    rest: Option<Box<[Extremes; 2]>>,
}

/// Columns next to each other.
#[derive(Default)]
pub(super) struct DrawCache {
    /// Key of the columns: the data, their look and the width.
    of: Option<[u64; 5]>,
    columns: VecDeque<Column>,
}

/// The width of the columns where a pixel's is `width`.
fn column_width(width: f64) -> f64 {
    /// Of the fraction of a number all bits but the first three.
    const FINE: u64 = (1 << 49) - 1;
    f64::from_bits(width.to_bits() & !FINE).max(f64::MIN_POSITIVE)
}

/// Where the column of a time starts, in widths. Its product with a width is exact: a width has four digits.
fn number(x: f64, width: f64) -> f64 {
    let number = (x / width).floor();
    // A quotient just below a whole number may be rounded to it.
    if number * width > x { number - 1.0 } else { number }
}

impl DrawCache {
    /// Draws the columns that the samples in `drawn` lie in; `of` says what the curve is and how it looks, and is
    /// another one as soon as samples have changed that were there.
    pub(super) fn draw(
        &mut self,
        curve: &Indexed<'_>,
        of: [u64; 4],
        drawn: Range<usize>,
        pixel: f64,
        pieces: &mut Pieces,
    ) {
        let width = column_width(pixel);
        let [x, y, scale, gap] = of;
        let of = Some([x, y, scale, gap, width.to_bits()]);
        if self.of != of {
            (self.of, self.columns) = (of, VecDeque::new());
        }
        let edge = number(curve.x(drawn.start), width) * width;
        let start = curve.first_from(drawn.start, edge);
        self.leave(curve.dropped() + start..curve.dropped() + drawn.end, curve.dropped());
        let last = self.extend(curve, start..drawn.end, width);
        pieces.reserve(2 * self.columns.len() + 2);
        self.columns.iter().chain(&last).for_each(|column| column.draw(pieces));
    }

    /// Leaves the columns that are in view and whose samples are all there.
    fn leave(&mut self, view: Range<usize>, dropped: usize) {
        let gone = |samples: &Range<usize>| samples.start < dropped || samples.end <= view.start;
        while self.columns.front().is_some_and(|column| gone(&column.samples)) {
            self.columns.pop_front();
        }
        while self.columns.back().is_some_and(|column| column.samples.start >= view.end) {
            self.columns.pop_back();
        }
    }

    /// Adds the columns that are missing on both sides; returns the one with the newest sample, which isn't kept.
    fn extend(&mut self, curve: &Indexed<'_>, view: Range<usize>, width: f64) -> Option<Column> {
        let dropped = curve.dropped();
        let mut right = view.start;
        if let (Some(front), Some(back)) = (self.columns.front(), self.columns.back()) {
            let (left, known) = (front.samples.start - dropped, back.samples.end - dropped);
            right = known;
            for column in columns(curve, view.start..left, left, width).into_iter().rev() {
                self.columns.push_front(column);
            }
        }
        self.columns.extend(columns(curve, right..view.end, curve.len(), width));
        self.columns.pop_back_if(|column| column.samples.end == dropped + curve.len())
    }
}

/// The columns that the samples of `view` lie in, of which none goes beyond `end`.
fn columns(curve: &Indexed<'_>, view: Range<usize>, end: usize, width: f64) -> Vec<Column> {
    let (mut start, mut guess, mut columns) = (view.start, 1, Vec::new());
    if view.is_empty() {
        return columns;
    }
    let mut gap = curve.gaps().first_from(start..end);
    while start < view.end {
        let limit = (number(curve.x(start), width) + 1.0) * width;
        let samples = start..next(curve, start, end, limit, guess);
        (start, guess) = (samples.end, samples.len());
        if gap.is_some_and(|gap| gap < start) {
            columns.push(Column::split(curve, samples));
            gap = curve.gaps().first_from(start..end);
        } else {
            columns.push(Column::whole(curve, samples, false));
        }
    }
    columns
}

/// The first sample after `start` that is not below `limit`: about `guess` samples on, as a rule.
fn next(curve: &Indexed<'_>, start: usize, end: usize, limit: f64, guess: usize) -> usize {
    let below = |index: usize| curve.x(index) < limit;
    let (mut low, mut high, mut reach) = (start + 1, (start + guess).clamp(start + 1, end), 1);
    if high < end && below(high) {
        low = high + 1;
        while low + reach < end && below(low + reach) {
            low += reach + 1;
            reach *= 2;
        }
        high = (low + reach).min(end);
    } else {
        while high - low > reach && !below(high - reach) {
            high -= reach;
            reach *= 2;
        }
        if high - low > reach {
            low = high - reach + 1;
        }
    }
    curve.gaps().x.partition_point(low..high, |x| x < limit)
}

impl Column {
    /// A column without a gap inside.
    fn whole(curve: &Indexed<'_>, samples: Range<usize>, is_apart: bool) -> Self {
        let first = curve.extremes(samples.clone());
        Self { samples: absolute(curve, samples), is_apart, first, rest: None }
    }

    /// A column that may have gaps before and inside.
    fn split(curve: &Indexed<'_>, samples: Range<usize>) -> Self {
        let gaps = curve.gaps();
        let is_apart = gaps.is_before(samples.start);
        let Some(first) = gaps.first(samples.clone()) else { return Self::whole(curve, samples, is_apart) };
        let last = gaps.last(samples.clone()).unwrap_or(first);
        let rest = [first..last, last..samples.end].map(|part| curve.extremes(part));
        let first = curve.extremes(samples.start..first);
        Self { samples: absolute(curve, samples), is_apart, first, rest: Some(Box::new(rest)) }
    }

    fn draw(&self, pieces: &mut Pieces) {
        if self.is_apart {
            pieces.end();
        }
        pieces.extremes(self.first);
        for extremes in self.rest.iter().flat_map(|rest| rest.iter()) {
            pieces.end();
            pieces.extremes(*extremes);
        }
    }
}

fn absolute(curve: &Indexed<'_>, samples: Range<usize>) -> Range<usize> {
    curve.dropped() + samples.start..curve.dropped() + samples.end
}
