//! Recordings, played: everything that they hold, one by one and in order, each with its time.
//!
//! A recording is played from its robot log, from its raw frames, or from both together: then the rows are the ones
//! that were recorded, and the frames come along. Files of any length; what is damaged is left out and counted. A
//! time without rows or frames stays one.

mod frames;
mod rows;
#[cfg(test)]
mod tests;

use std::io::BufRead;
use std::time::Duration;

use super::recording::Row;
use super::{LogError, LogKind};
use crate::link::StampedFrame;
use crate::link::jy901::Packet;
use frames::FrameTrack;
use rows::RowTrack;

/// Times beyond this are taken as this. Seconds since 1970, which other loggers write, are below.
const LATEST: Duration = Duration::from_secs(10_000_000_000);

/// A file of a recording.
pub struct ReplayFile<R> {
    /// Its name in messages.
    pub name: String,
    /// Its text.
    pub reader: R,
}

/// Contents of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum ReplayItem {
    /// A row of the robot log.
    Row(Row),
    /// A frame of the bus; its time is that of the session.
    Frame(StampedFrame),
    /// A packet of the IMU.
    ImuPacket(Packet),
    /// Something that happened.
    Event(String),
}

/// Amount played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReplayCounts {
    /// Rows of the robot log.
    pub rows: u64,
    /// Frames and packets.
    pub frames: u64,
    /// Rows and lines that were left out because they are damaged.
    pub damaged: u64,
}

/// Reason why a recording cannot be played.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// A file of it cannot be read.
    #[error(transparent)]
    Read(#[from] LogError),
    /// A log of another kind.
    #[error(
        "{file} is not a {}, because it has no `{missing}`: give the robot log (.csv) or the raw frames (.log) of a recording",
        LogKind::Robot
    )]
    NotRobot {
        /// The file.
        file: String,
        /// The columns that are missing.
        missing: String,
    },
    /// Neither a row nor a frame.
    #[error("{file} contains neither rows nor frames: give a recording of a robot")]
    Empty {
        /// The file, or both.
        file: String,
    },
}

/// A recording on its way.
pub struct Replay<R> {
    rows: Option<RowTrack<R>>,
    frames: Option<FrameTrack<R>>,
    counts: ReplayCounts,
}

impl<R: BufRead> Replay<R> {
    /// A recording of a robot log, raw frames, or both. Times count from `start` (since 1970), if it is known:
    /// otherwise from where the robot log's do, without one from the first frame.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub fn new(
        rows: Option<ReplayFile<R>>,
        frames: Option<ReplayFile<R>>,
        start: Option<Duration>,
    ) -> Result<Self, ReplayError> {
        let names = rows.iter().chain(&frames).map(|file| file.name.clone());
        let names = names.collect::<Vec<_>>().join(" and ");
        let rows = rows.map(RowTrack::new).transpose()?;
        let start = start.or_else(|| rows.as_ref().and_then(RowTrack::start));
        let first = rows.as_ref().and_then(RowTrack::next_at).unwrap_or_default();
        let frames = frames.map(|file| FrameTrack::new(file, start, first)).transpose()?;
        let replay = Self { rows, frames, counts: ReplayCounts::default() };
        if replay.next_at().is_none() {
            return Err(ReplayError::Empty { file: names });
        }
        Ok(replay)
    }

    /// Returns whether rows are played, so that none are to be made of the frames.
    pub fn has_rows(&self) -> bool {
        self.rows.is_some()
    }

    /// Time of the next item; none at the end.
    pub fn next_at(&self) -> Option<Duration> {
        let rows = self.rows.as_ref().and_then(RowTrack::next_at);
        rows.into_iter().chain(self.frames.as_ref().and_then(FrameTrack::next_at)).min()
    }

    /// The next item with its time, which never runs back; none at the end.
    ///
    /// # Errors
    /// [`LogError`] of a file that cannot be read any further; once for each file, the other one goes on.
    pub fn next_item(&mut self) -> Result<Option<(Duration, ReplayItem)>, LogError> {
        let rows_at = self.rows.as_ref().and_then(RowTrack::next_at);
        let frames_at = self.frames.as_ref().and_then(FrameTrack::next_at);
        let of_rows = rows_at.is_some_and(|at| frames_at.is_none_or(|frames_at| at < frames_at));
        let item = match (&mut self.rows, &mut self.frames) {
            (Some(rows), _) if of_rows => rows.take()?,
            (_, Some(frames)) if frames_at.is_some() => frames.take()?,
            (rows, frames) => {
                // At the end of both: what they have failed with.
                if let Some(rows) = rows {
                    rows.take()?;
                }
                if let Some(frames) = frames {
                    frames.take()?;
                }
                None
            }
        };
        match item {
            Some((_, ReplayItem::Row(_))) => self.counts.rows += 1,
            Some((_, ReplayItem::Frame(_) | ReplayItem::ImuPacket(_))) => self.counts.frames += 1,
            Some((_, ReplayItem::Event(_))) | None => {}
        }
        Ok(item)
    }

    /// Progress of the replay.
    pub fn counts(&self) -> ReplayCounts {
        let rows = self.rows.as_ref().map_or(0, RowTrack::damaged);
        let frames = self.frames.as_ref().map_or(0, FrameTrack::damaged);
        ReplayCounts { damaged: rows + frames, ..self.counts }
    }

    /// The first damage of each file so far, and where frames run back in time.
    pub fn problems(&self) -> impl Iterator<Item = String> {
        let rows = self.rows.as_ref().and_then(RowTrack::problem);
        rows.into_iter().chain(self.frames.iter().flat_map(FrameTrack::problems))
    }
}
