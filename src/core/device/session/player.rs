//! A recording in place of a robot: how far it has been played, and how fast it is.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Duration;

use super::SessionError;
use super::files::open_recording;
use super::types::{Connection, SessionOrder};
use crate::device::Clock;
use crate::record::{LogError, Replay, ReplayCounts, ReplayItem};

/// Played at once where speed has no limit.
const STEP: Duration = Duration::from_millis(100);
/// A time without rows and frames that is told.
const GAP: Duration = Duration::from_secs(1);

/// A recording that is played.
pub(super) struct Player {
    replay: Replay<BufReader<File>>,
    clock: Clock,
    speed: f64,
    paused: bool,
    /// What the clock read when the position was moved on last.
    moved_at: Duration,
    /// Time of the recording.
    position: Duration,
    /// Time of the newest item.
    newest: Duration,
}

impl Player {
    /// Opens a recording; it begins at its first item.
    pub(super) fn open(file: &Path, speed: f64, clock: Clock) -> Result<Self, SessionError> {
        let replay = open_recording(file)?;
        let begin = replay.next_at().unwrap_or_default();
        Ok(Self {
            replay,
            clock,
            speed,
            paused: false,
            moved_at: clock.now(),
            position: begin,
            newest: begin,
        })
    }

    pub(super) fn order(&mut self, order: &SessionOrder) {
        match order {
            SessionOrder::Pause(paused) => self.paused = *paused,
            SessionOrder::ReplaySpeed(speed) => self.speed = *speed,
            _ => {}
        }
    }

    /// Whether rows are played, so that none are to be made of the frames.
    pub(super) fn has_rows(&self) -> bool {
        self.replay.has_rows()
    }

    pub(super) fn has_ended(&self) -> bool {
        self.replay.next_at().is_none()
    }

    /// Whether it goes on as fast as it can.
    pub(super) fn hurries(&self) -> bool {
        self.speed == f64::INFINITY && !self.paused && !self.has_ended()
    }

    /// Time of the recording.
    pub(super) fn position(&self) -> Duration {
        self.position
    }

    /// Moves on by the time that has passed, unless it is held.
    pub(super) fn advance(&mut self, held: bool) {
        let now = self.clock.now();
        let passed = now.saturating_sub(std::mem::replace(&mut self.moved_at, now));
        if held || self.paused || self.has_ended() {
            return;
        }
        let way = if self.hurries() {
            // Over gaps in one step.
            let next = self.replay.next_at().unwrap_or_default();
            next.saturating_sub(self.position) + STEP
        } else {
            // A speed that is none stands still.
            Duration::try_from_secs_f64(passed.as_secs_f64() * self.speed).unwrap_or_default()
        };
        self.position = self.position.saturating_add(way);
    }

    /// The next item that is due.
    pub(super) fn next_item(&mut self) -> Result<Option<(Duration, ReplayItem)>, LogError> {
        match self.replay.next_at() {
            Some(at) if at > self.position => return Ok(None),
            Some(at) => self.newest = at,
            // Nothing comes after the newest one.
            None => self.position = self.newest,
        }
        self.replay.next_item()
    }

    /// There was no time for all that is due.
    pub(super) fn fall_behind(&mut self) {
        self.position = self.newest;
    }

    pub(super) fn counts(&self) -> ReplayCounts {
        self.replay.counts()
    }

    pub(super) fn problems(&self) -> impl Iterator<Item = String> {
        self.replay.problems()
    }

    pub(super) fn connection(&self) -> Connection {
        match self.replay.next_at() {
            None => Connection::Ended,
            Some(next) if self.position >= self.newest + GAP => Connection::Silent {
                hint: format!(
                    "nothing was recorded from {:.1} s to {:.1} s",
                    self.newest.as_secs_f64(),
                    next.as_secs_f64()
                ),
            },
            Some(_) => Connection::Connected,
        }
    }
}
