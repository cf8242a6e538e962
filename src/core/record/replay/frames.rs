//! The raw frames of a recording that is played.

use std::io::BufRead;
use std::time::Duration;

use super::{LATEST, ReplayError, ReplayFile, ReplayItem};
use crate::link::StampedFrame;
use crate::record::LogError;
use crate::record::recording::{FrameLog, IMU_INTERFACE, imu_packet};

/// Frames of a file are a little out of order where a sent one was stamped before a received one; where time runs
/// back by more than this, the clock was set back or another recording begins.
const OUT_OF_ORDER: Duration = Duration::from_secs(1);

/// Frames and packets of a candump file, in its order, which is the one in which they were received.
pub(super) struct FrameTrack<R> {
    name: String,
    log: FrameLog<'static, R>,
    /// Time of the file, since 1970, that is zero.
    zero: Duration,
    /// By how much the file's clock was set back so far.
    set_back: Duration,
    /// Latest time so far, since 1970.
    last: Duration,
    next: Option<(Duration, ReplayItem)>,
    failed: Option<LogError>,
}

impl<R: BufRead> FrameTrack<R> {
    /// Times count from `start` (since 1970); where that is not known, the first frame is at `first`.
    pub(super) fn new(
        file: ReplayFile<R>,
        start: Option<Duration>,
        first: Duration,
    ) -> Result<Self, ReplayError> {
        let ReplayFile { name, reader } = file;
        let mut log = FrameLog::new(reader, name.clone());
        let frame = log.next_frame()?.map(|(interface, frame)| (interface.to_owned(), frame));
        let (set_back, last) = (Duration::ZERO, Duration::ZERO);
        let mut track = Self { name, log, zero: Duration::ZERO, set_back, last, next: None, failed: None };
        if let Some((interface, frame)) = frame {
            track.zero = start.unwrap_or_else(|| frame.time.saturating_sub(first));
            track.place(interface == IMU_INTERFACE, frame);
        }
        Ok(track)
    }

    pub(super) fn next_at(&self) -> Option<Duration> {
        self.next.as_ref().map(|(time, _)| *time)
    }

    pub(super) fn take(&mut self) -> Result<Option<(Duration, ReplayItem)>, LogError> {
        let Some(next) = self.next.take() else { return self.failed.take().map_or(Ok(None), Err) };
        match self.log.next_frame() {
            Ok(Some((interface, frame))) => {
                let of_imu = interface == IMU_INTERFACE;
                self.place(of_imu, frame);
            }
            Ok(None) => {}
            Err(error) => self.failed = Some(error),
        }
        Ok(Some(next))
    }

    pub(super) fn damaged(&self) -> u64 {
        self.log.damaged()
    }

    pub(super) fn problems(&self) -> impl Iterator<Item = String> {
        let problems = self.log.first_problem().into_iter().chain(self.log.time_problem());
        problems.map(|problem| format!("{}: {problem}", self.name))
    }

    /// Makes a frame the next item, at its time of the session.
    fn place(&mut self, of_imu: bool, frame: StampedFrame) {
        let mut at = frame.time.saturating_add(self.set_back);
        if at.saturating_add(OUT_OF_ORDER) < self.last {
            self.set_back = self.set_back.saturating_add(self.last - at);
            at = self.last;
        }
        self.last = self.last.max(at);
        let [time, due] = [at, self.last].map(|at| at.saturating_sub(self.zero).min(LATEST));
        let packet = of_imu.then(|| imu_packet(&frame.frame)).flatten();
        let frame = StampedFrame { time, ..frame };
        self.next = Some((due, packet.map_or(ReplayItem::Frame(frame), ReplayItem::ImuPacket)));
    }
}
