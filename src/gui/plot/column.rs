//! Columns of numbers that grow at their end for hours and are dropped at their start, in chunks that never
//! move: appending costs the same however much is held.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::pyramid::{Pyramid, Steps};

/// Samples of a leaf of a pyramid.
pub(super) const BLOCK: usize = 32;
/// Samples of a chunk, the unit in which the oldest are dropped.
pub const CHUNK: usize = 512 * BLOCK;

/// Identifies a column within a run of the program: columns with the same identifier have the same samples, except
/// for those that one of them has dropped or not received yet.
#[derive(Debug, PartialEq, Eq)]
struct Lineage(u64);

impl Default for Lineage {
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

impl Clone for Lineage {
    /// Returns another lineage, because a clone may grow differently.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Numbers in chunks; a clone shares them, so that a worker can read them while more are appended.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunks {
    chunks: VecDeque<Arc<Vec<f64>>>,
    lineage: Lineage,
    /// Samples that were dropped at the start.
    dropped: usize,
}

impl Chunks {
    fn push(&mut self, value: f64) {
        match self.chunks.back_mut() {
            // Copied first if a worker reads it.
            Some(chunk) if chunk.len() < CHUNK => Arc::make_mut(chunk).push(value),
            _ => {
                let mut chunk = Vec::with_capacity(CHUNK);
                chunk.push(value);
                self.chunks.push_back(Arc::new(chunk));
            }
        }
    }

    fn len(&self) -> usize {
        self.chunks.back().map_or(0, |last| CHUNK * (self.chunks.len() - 1) + last.len())
    }

    /// Drops the oldest chunk, if there is one.
    fn drop_first(&mut self) -> bool {
        let Some(chunk) = self.chunks.pop_front() else { return false };
        self.dropped += chunk.len();
        true
    }

    /// Lineage: unchanged as long as samples are only appended or dropped at the start.
    pub(super) fn lineage(&self) -> u64 {
        self.lineage.0
    }

    /// Number of samples dropped at the start.
    pub(super) fn dropped(&self) -> usize {
        self.dropped
    }
}

/// Read access to numbers, wherever they are.
#[derive(Clone, Copy, Debug)]
pub(super) enum Values<'a> {
    Slice(&'a [f64]),
    Chunks(&'a Chunks),
}

impl<'a> Values<'a> {
    pub(super) fn len(self) -> usize {
        match self {
            Self::Slice(values) => values.len(),
            Self::Chunks(values) => values.len(),
        }
    }

    pub(super) fn at(self, index: usize) -> f64 {
        match self {
            Self::Slice(values) => values[index],
            Self::Chunks(values) => values.chunks[index / CHUNK][index % CHUNK],
        }
    }

    /// Samples that lie in one chunk.
    pub(super) fn block(self, range: Range<usize>) -> &'a [f64] {
        match self {
            Self::Slice(values) => &values[range],
            Self::Chunks(values) => {
                let start = range.start % CHUNK;
                &values.chunks[range.start / CHUNK][start..start + range.len()]
            }
        }
    }

    /// Copy for a worker: a slice is copied, chunks are shared.
    pub(super) fn held(self, range: Range<usize>) -> Held {
        match self {
            Self::Slice(values) => {
                Held { values: HeldValues::Copied(values[range.clone()].to_vec()), range: 0..range.len() }
            }
            Self::Chunks(values) => Held { values: HeldValues::Shared(values.clone()), range },
        }
    }

    /// The end of the part of `range` whose samples are `before`, as `slice::partition_point` has it.
    pub(super) fn partition_point(self, range: Range<usize>, before: impl Fn(f64) -> bool) -> usize {
        let (mut low, mut high) = (range.start, range.end);
        while low < high {
            let middle = low + (high - low) / 2;
            if before(self.at(middle)) { low = middle + 1 } else { high = middle }
        }
        low
    }
}

/// Snapshot of a range that stays as it is when the column changes.
#[derive(Clone, Debug)]
pub(super) struct Held {
    values: HeldValues,
    range: Range<usize>,
}

#[derive(Clone, Debug)]
enum HeldValues {
    Copied(Vec<f64>),
    Shared(Chunks),
}

impl Held {
    pub(super) fn len(&self) -> usize {
        self.range.len()
    }

    pub(super) fn at(&self, index: usize) -> f64 {
        let values = match &self.values {
            HeldValues::Copied(values) => Values::Slice(values),
            HeldValues::Shared(values) => Values::Chunks(values),
        };
        values.at(self.range.start + index)
    }
}

/// Horizontal values that grow: they must be finite and must not run back.
#[derive(Clone, Debug, Default)]
pub struct TimeColumn {
    pub(super) values: Chunks,
    pub(super) steps: Steps,
}

/// Vertical values that grow; what is not finite is a gap.
#[derive(Clone, Debug, Default)]
pub struct ValueColumn {
    pub(super) values: Chunks,
    pub(super) pyramid: Pyramid,
}

impl TimeColumn {
    /// Appends a value.
    pub fn push(&mut self, value: f64) {
        self.values.push(value);
        self.steps.extend(Values::Chunks(&self.values));
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.values.chunks.is_empty()
    }

    /// A value.
    pub fn get(&self, index: usize) -> Option<f64> {
        (index < self.len()).then(|| Values::Chunks(&self.values).at(index))
    }

    /// The oldest value.
    pub fn first(&self) -> Option<f64> {
        self.get(0)
    }

    /// The newest value.
    pub fn last(&self) -> Option<f64> {
        self.get(self.len().checked_sub(1)?)
    }

    /// Number of values of at most `limit`.
    pub fn count_up_to(&self, limit: f64) -> usize {
        Values::Chunks(&self.values).partition_point(0..self.len(), |value| value <= limit)
    }

    /// Drops the oldest [`CHUNK`] values.
    pub fn drop_chunk(&mut self) {
        if self.values.drop_first() {
            self.steps.drop_chunk();
        }
    }
}

impl ValueColumn {
    /// Appends a value.
    pub fn push(&mut self, value: f64) {
        self.values.push(value);
        self.pyramid.extend(Values::Chunks(&self.values));
    }

    /// The newest value.
    pub fn last(&self) -> Option<f64> {
        self.values.chunks.back()?.last().copied()
    }

    /// Drops the oldest [`CHUNK`] values.
    pub fn drop_chunk(&mut self) {
        if self.values.drop_first() {
            self.pyramid.drop_chunk();
        }
    }

    /// Bytes held, the pyramid included.
    pub fn bytes(&self) -> usize {
        self.values.chunks.len() * CHUNK * size_of::<f64>() + self.pyramid.bytes()
    }
}
