//! A pyramid over a column: extremes, mean and gaps of blocks of 32 samples, of 8 such blocks, and so on. Any
//! range is answered exactly from a few nodes and at most 62 samples, whatever its length.
//!
//! Nodes exist for complete blocks only, so appending never changes one; the samples behind the last complete
//! block are read one by one. What is not finite counts as a gap and never as a value.

use std::collections::VecDeque;
use std::ops::Range;

use super::column::{BLOCK, CHUNK, Values};

/// Nodes that a node of the next level covers.
const FAN: usize = 8;
/// Levels: 32, 256, 2048 and 16 384 samples a node.
const LEVELS: usize = 4;

/// Samples of a node.
const fn size(level: usize) -> usize {
    1 << shift(level)
}

/// Exponent of two.
const fn shift(level: usize) -> u32 {
    BLOCK.ilog2() + level as u32 * FAN.ilog2()
}

/// Nodes of all levels, the finest first.
#[derive(Clone, Debug)]
struct Levels<N>([VecDeque<N>; LEVELS]);

impl<N> Default for Levels<N> {
    fn default() -> Self {
        Self(Default::default())
    }
}

/// A piece of a range.
enum Part {
    Node { level: usize, index: usize },
    Samples(Range<usize>),
}

impl<N: Copy> Levels<N> {
    /// Adds the nodes that `samples` samples complete; `join` is told how many samples each of its nodes has.
    fn extend(
        &mut self,
        samples: usize,
        leaf: impl Fn(Range<usize>) -> N,
        join: impl Fn(&[N; FAN], usize) -> N,
    ) {
        while (self.0[0].len() + 1) * BLOCK <= samples {
            let start = self.0[0].len() * BLOCK;
            self.0[0].push_back(leaf(start..start + BLOCK));
            for level in 1..LEVELS {
                let below = &self.0[level - 1];
                if below.len() < (self.0[level].len() + 1) * FAN {
                    break;
                }
                let first = self.0[level].len() * FAN;
                let node = join(&std::array::from_fn(|child| below[first + child]), size(level - 1));
                self.0[level].push_back(node);
            }
        }
    }

    fn drop_chunk(&mut self) {
        for (level, nodes) in self.0.iter_mut().enumerate() {
            nodes.drain(..nodes.len().min(CHUNK / size(level)));
        }
    }

    fn bytes(&self) -> usize {
        self.0.iter().map(|nodes| nodes.capacity() * size_of::<N>()).sum()
    }

    /// The coarsest node that starts at `start`, ends by `end` and is below `below`.
    fn node_at(&self, start: usize, end: usize, below: usize) -> Option<(usize, usize)> {
        (0..below).rev().find_map(|level| {
            let (size, index) = (size(level), start >> shift(level));
            let fits = start & (size - 1) == 0 && start + size <= end && index < self.0[level].len();
            fits.then_some((level, index))
        })
    }

    /// The range in few pieces, from its start to its end.
    fn parts(&self, range: Range<usize>) -> impl Iterator<Item = Part> {
        let (mut at, end) = (range.start, range.end);
        std::iter::from_fn(move || {
            if at >= end {
                return None;
            }
            if let Some((level, index)) = self.node_at(at, end, LEVELS) {
                at += size(level);
                return Some(Part::Node { level, index });
            }
            let start = at;
            at = ((at / BLOCK + 1) * BLOCK).min(end);
            Some(Part::Samples(start..at))
        })
    }

    /// The first sample for which `sample` holds; `node` may be true of a node without one, never the reverse.
    fn first(
        &self,
        range: Range<usize>,
        below: usize,
        node: &impl Fn(&N, usize) -> bool,
        sample: &impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let mut at = range.start;
        while at < range.end {
            if let Some((level, index)) = self.node_at(at, range.end, below) {
                let end = at + size(level);
                let found = || self.first(at..end, level, node, sample);
                if node(&self.0[level][index], size(level))
                    && let Some(found) = found()
                {
                    return Some(found);
                }
                at = end;
            } else {
                let end = ((at / BLOCK + 1) * BLOCK).min(range.end);
                if let Some(found) = (at..end).find(|index| sample(*index)) {
                    return Some(found);
                }
                at = end;
            }
        }
        None
    }

    /// The last sample for which `sample` holds; see [`Levels::first`].
    fn last(
        &self,
        range: Range<usize>,
        below: usize,
        node: &impl Fn(&N, usize) -> bool,
        sample: &impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let mut end = range.end;
        while end > range.start {
            let fitting = (0..below).rev().find_map(|level| {
                let start = end.checked_sub(size(level))?;
                let fits = end & (size(level) - 1) == 0 && start >= range.start;
                let index = start >> shift(level);
                (fits && index < self.0[level].len()).then_some((level, index, start))
            });
            if let Some((level, index, start)) = fitting {
                if node(&self.0[level][index], size(level))
                    && let Some(found) = self.last(start..end, level, node, sample)
                {
                    return Some(found);
                }
                end = start;
            } else {
                let start = ((end - 1) / BLOCK * BLOCK).max(range.start);
                if let Some(found) = (start..end).rev().find(|index| sample(*index)) {
                    return Some(found);
                }
                end = start;
            }
        }
        None
    }
}

/// What a block holds. Places are counted from its start.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: f64,
    max: f64,
    mean: f64,
    /// Sum of the squares of what differs from the mean.
    squares: f64,
    min_at: u32,
    max_at: u32,
    /// Finite samples.
    count: u32,
}

/// Summary of the finite samples of a range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Summary {
    pub(super) count: usize,
    pub(super) mean: f64,
    /// Sum of the squares of what differs from the mean.
    pub(super) squares: f64,
    pub(super) extremes: Extremes,
}

/// Smallest and largest finite sample of a range; of equals the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extremes {
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) min_at: usize,
    pub(super) max_at: usize,
}

impl Extremes {
    const NONE: Self = Self { min: f64::INFINITY, max: f64::NEG_INFINITY, min_at: 0, max_at: 0 };

    fn take_min(&mut self, value: f64, at: usize) {
        if value < self.min {
            (self.min, self.min_at) = (value, at);
        }
    }

    fn take_max(&mut self, value: f64, at: usize) {
        if value > self.max {
            (self.max, self.max_at) = (value, at);
        }
    }
}

impl Summary {
    const NONE: Self = Self { count: 0, mean: 0.0, squares: 0.0, extremes: Extremes::NONE };

    /// Takes the moments of another part in (Chan's formula: no digits are lost to a large mean).
    fn take_moments(&mut self, count: usize, mean: f64, squares: f64) {
        if count == 0 {
            return;
        }
        let total = self.count + count;
        let (share, difference) = (count as f64 / total as f64, mean - self.mean);
        self.squares += squares + difference * difference * share * self.count as f64;
        self.mean += share * difference;
        self.count = total;
    }

    fn take_samples(&mut self, samples: &[f64], start: usize) {
        let finite = || samples.iter().copied().filter(|value| value.is_finite());
        let count = finite().count();
        // About the first value, so that a large one leaves digits for the others.
        let shift = finite().next().unwrap_or(0.0);
        let mean = finite().map(|value| value - shift).sum::<f64>() / count.max(1) as f64;
        let squares = finite().map(|value| (value - shift - mean) * (value - shift - mean)).sum();
        self.take_moments(count, shift + mean, squares);
        for (offset, value) in samples.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            self.extremes.take_min(*value, start + offset);
            self.extremes.take_max(*value, start + offset);
        }
    }

    fn take_node(&mut self, node: &Node, start: usize) {
        self.take_moments(node.count as usize, node.mean, node.squares);
        self.extremes.take_min(node.min, start + node.min_at as usize);
        self.extremes.take_max(node.max, start + node.max_at as usize);
    }

    fn node(self) -> Node {
        let Extremes { min, max, min_at, max_at } = self.extremes;
        let (min_at, max_at, count) = (min_at as u32, max_at as u32, self.count as u32);
        Node { min, max, mean: self.mean, squares: self.squares, min_at, max_at, count }
    }
}

/// Pyramid over vertical values.
#[derive(Clone, Debug, Default)]
pub(super) struct Pyramid(Levels<Node>);

impl Pyramid {
    pub(super) fn of(values: Values<'_>) -> Self {
        let mut pyramid = Self::default();
        pyramid.extend(values);
        pyramid
    }

    /// Takes in what has been appended to `values`.
    pub(super) fn extend(&mut self, values: Values<'_>) {
        let leaf = |range: Range<usize>| {
            let mut summary = Summary::NONE;
            summary.take_samples(values.block(range), 0);
            summary.node()
        };
        let join = |nodes: &[Node; FAN], size: usize| {
            let mut summary = Summary::NONE;
            for (index, node) in nodes.iter().enumerate() {
                summary.take_node(node, index * size);
            }
            summary.node()
        };
        self.0.extend(values.len(), leaf, join);
    }

    pub(super) fn drop_chunk(&mut self) {
        self.0.drop_chunk();
    }

    pub(super) fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// Summary of a range; nothing where no sample is finite.
    pub(super) fn summary(&self, values: Values<'_>, range: Range<usize>) -> Option<Summary> {
        let mut summary = Summary::NONE;
        for part in self.0.parts(range) {
            match part {
                Part::Node { level, index } => {
                    summary.take_node(&self.0.0[level][index], index * size(level))
                }
                Part::Samples(range) => summary.take_samples(values.block(range.clone()), range.start),
            }
        }
        (summary.count > 0).then_some(summary)
    }

    /// Extremes of a range; nothing where no sample is finite.
    pub(super) fn extremes(&self, values: Values<'_>, range: Range<usize>) -> Option<Extremes> {
        let mut found = Extremes::NONE;
        for part in self.0.parts(range) {
            match part {
                Part::Node { level, index } => {
                    let (node, start) = (&self.0.0[level][index], index * size(level));
                    found.take_min(node.min, start + node.min_at as usize);
                    found.take_max(node.max, start + node.max_at as usize);
                }
                Part::Samples(range) => {
                    for (offset, value) in values.block(range.clone()).iter().enumerate() {
                        // An infinite one is no value; of a NaN no comparison holds.
                        if value.abs() < f64::INFINITY {
                            found.take_min(*value, range.start + offset);
                            found.take_max(*value, range.start + offset);
                        }
                    }
                }
            }
        }
        (found.min <= found.max).then_some(found)
    }

    /// The last finite sample of a range that is below `low` or above `high`.
    pub(super) fn last_outside(
        &self,
        values: Values<'_>,
        range: Range<usize>,
        [low, high]: [f64; 2],
    ) -> Option<usize> {
        let outside = |value: f64| value.is_finite() && (value < low || value > high);
        let node = |node: &Node, _| node.min < low || node.max > high;
        self.0.last(range, LEVELS, &node, &|index| outside(values.at(index)))
    }
}

/// Largest steps between neighbours, to find gaps in time.
#[derive(Clone, Debug, Default)]
pub(super) struct Steps {
    levels: Levels<f64>,
    /// A value is not finite, or below the one before it.
    is_broken: bool,
    checked: usize,
}

impl Steps {
    pub(super) fn of(values: Values<'_>) -> Self {
        let mut steps = Self::default();
        steps.extend(values);
        steps
    }

    /// Takes in what has been appended to `values`.
    pub(super) fn extend(&mut self, values: Values<'_>) {
        for index in self.checked..values.len() {
            let before = index.checked_sub(1).map_or(f64::MIN, |before| values.at(before));
            self.is_broken |= !(values.at(index).is_finite() && values.at(index) >= before);
        }
        self.checked = values.len();
        let leaf = |range: Range<usize>| range.map(|index| step(values, index)).fold(0.0, f64::max);
        self.levels.extend(values.len(), leaf, |nodes, _| nodes.iter().copied().fold(0.0, f64::max));
    }

    pub(super) fn drop_chunk(&mut self) {
        self.levels.drop_chunk();
        self.checked = self.checked.saturating_sub(CHUNK);
    }

    /// Returns whether the values can be a horizontal axis.
    pub(super) fn are_sound(&self) -> bool {
        !self.is_broken
    }
}

/// From the sample before, 0 for the first.
fn step(values: Values<'_>, index: usize) -> f64 {
    index.checked_sub(1).map_or(0.0, |before| values.at(index) - values.at(before))
}

fn has_hole(node: &Node, samples: usize) -> bool {
    (node.count as usize) < samples
}

/// Finds gaps: samples that are not finite, and steps in time longer than a limit.
#[derive(Clone, Copy)]
pub(super) struct Gaps<'a> {
    pub(super) x: Values<'a>,
    pub(super) steps: &'a Steps,
    pub(super) y: Values<'a>,
    pub(super) pyramid: &'a Pyramid,
    /// A longer step is a gap.
    pub(super) longest: f64,
}

impl Gaps<'_> {
    /// Returns whether a gap lies before the sample.
    pub(super) fn is_before(&self, index: usize) -> bool {
        step(self.x, index) > self.longest
    }

    /// The first sample of a range that is not finite or follows a gap that lies in the range.
    pub(super) fn first(&self, range: Range<usize>) -> Option<usize> {
        let later = range.start + 1..range.end;
        let long = |largest: &f64, _| *largest > self.longest;
        let jump = self.steps.levels.first(later, LEVELS, &long, &|index| self.is_before(index));
        let hole = range.start..jump.unwrap_or(range.end);
        let hole = self.pyramid.0.first(hole, LEVELS, &has_hole, &|index| !self.y.at(index).is_finite());
        hole.or(jump)
    }

    /// The same, a gap before the range included.
    pub(super) fn first_from(&self, range: Range<usize>) -> Option<usize> {
        let begins = !range.is_empty() && self.is_before(range.start);
        if begins { Some(range.start) } else { self.first(range) }
    }

    /// The last sample of a range that is not finite or follows a gap that lies in the range.
    pub(super) fn last(&self, range: Range<usize>) -> Option<usize> {
        let later = range.start + 1..range.end;
        let long = |largest: &f64, _| *largest > self.longest;
        let jump = self.steps.levels.last(later, LEVELS, &long, &|index| self.is_before(index));
        let hole = jump.unwrap_or(range.start)..range.end;
        let hole = self.pyramid.0.last(hole, LEVELS, &has_hole, &|index| !self.y.at(index).is_finite());
        hole.max(jump)
    }
}
