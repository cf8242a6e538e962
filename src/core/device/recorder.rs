//! A thread that writes a recording while the robot runs, and never holds up who hands it something.

mod files;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::session::{Event, EventKind, RecordingStatus};
use crate::link::StampedFrame;
use crate::link::jy901::Packet;
use crate::record::BenchSample;
use crate::record::recording::{About, Names, Row};
use files::Files;

/// Time between two turns of the thread. What is handed over reaches the system within two of them, unless the machine
/// is too busy.
const FLUSH_INTERVAL: Duration = Duration::from_millis(25);
/// After so many turns, just under a second, the files are put on the disk itself, and looked for where they were made.
const TURNS_BETWEEN_SYNCS: u32 = 36;
/// After a stop the files are put on the disk this many turns later, when it has been written.
const TURNS_TO_STOP: u32 = 2;
/// Rows and frames on their way to the thread: three seconds of a full bus at 1 Mbit/s.
const QUEUE: usize = 1 << 15;

/// Why no recording could be started.
#[derive(Debug, thiserror::Error)]
pub enum RecorderError {
    /// One of its files is there already.
    #[error("{} exists and is not overwritten: give another name or move it away", file.display())]
    Exists {
        /// The file.
        file: PathBuf,
    },
    /// The folder it is to be in is not there.
    #[error("{}: the folder {} does not exist: create it or give another name", file.display(), folder.display())]
    NoFolder {
        /// The file.
        file: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// Anything else that the system says.
    #[error("{}: cannot write the recording: {error}: check the folder, its permissions and the space on the disk", file.display())]
    Failed {
        /// The file.
        file: PathBuf,
        /// Message of the system.
        error: io::Error,
    },
}

/// A running recording. It ends with [`Recorder::finish`] or when it is dropped.
#[derive(Debug)]
pub struct Recorder {
    input: RecorderInput,
    thread: Option<JoinHandle<()>>,
}

/// Where rows, frames and events are handed over; every thread may have its own. Nothing here waits.
#[derive(Clone, Debug)]
pub struct RecorderInput {
    queue: SyncSender<Item>,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    ending: AtomicBool,
    /// Rows, frames and other items that did not reach the files.
    lost: [AtomicU64; 3],
    /// Items in the queue.
    waiting: AtomicUsize,
    status: Mutex<RecordingStatus>,
}

#[derive(Debug)]
enum Item {
    Row(Row),
    Bench(BenchSample),
    Frame(StampedFrame),
    ImuPacket(Duration, Packet),
    Event(Event),
}

impl Item {
    /// The count that it belongs to where it is lost.
    fn count(&self) -> usize {
        match self {
            Self::Row(_) => ROWS,
            Self::Frame(_) | Self::ImuPacket(..) => FRAMES,
            Self::Bench(_) | Self::Event(_) => OTHERS,
        }
    }

    /// Its time, if it belongs into the file of frames.
    fn frame_time(&self) -> Option<Duration> {
        match self {
            Self::Frame(frame) => Some(frame.time),
            Self::ImuPacket(time, _) => Some(*time),
            Self::Row(_) | Self::Bench(_) | Self::Event(_) => None,
        }
    }
}

/// Indices of counts.
const ROWS: usize = 0;
const FRAMES: usize = 1;
const OTHERS: usize = 2;

impl Recorder {
    /// Makes the files of the recording `name` ([`Names`]) and starts its thread; `bench` adds the motors' bench
    /// logs.
    ///
    /// # Errors
    /// [`RecorderError`]; then no file is left behind.
    pub fn start(name: &Path, about: &About, bench: bool) -> Result<Self, RecorderError> {
        let names = Names::new(name);
        let files = Files::create(&names, about, bench)?;
        let shared = Arc::new(Shared::new(names.robot_log));
        let (queue, items) = sync_channel(QUEUE);
        let writer = Writer::new(files, about.clone(), Arc::clone(&shared));
        let thread = thread::Builder::new().name("recorder".to_owned()).spawn(move || writer.run(&items));
        let thread = thread.map_err(|error| RecorderError::Failed { file: name.to_owned(), error })?;
        Ok(Self { input: RecorderInput { queue, shared }, thread: Some(thread) })
    }

    /// Another place to hand over rows, frames and events.
    pub fn input(&self) -> RecorderInput {
        self.input.clone()
    }

    /// How it stands.
    pub fn status(&self) -> RecordingStatus {
        self.input.status()
    }

    /// Rows, frames and events that did not reach the files: the disk was too slow or the recording has ended early.
    pub fn lost(&self) -> u64 {
        self.input.shared.lost().iter().sum()
    }

    /// Writes all that was handed over, and ends. What the disk was too slow for is a problem too.
    pub fn finish(mut self) -> RecordingStatus {
        self.join();
        self.input.shared.final_status()
    }

    fn join(&mut self) {
        self.input.shared.ending.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            if thread.join().is_err() {
                let problem = "the recording has stopped by an internal error";
                self.input.shared.status().problem.get_or_insert_with(|| problem.to_owned());
            }
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.join();
    }
}

impl RecorderInput {
    /// A row of the robot log; times have to rise.
    pub fn row(&self, row: &Row) {
        self.hand_over(Item::Row(*row));
    }

    /// A row of both motors' bench logs.
    pub fn bench(&self, sample: &BenchSample) {
        self.hand_over(Item::Bench(*sample));
    }

    /// A frame of the bus, its time since the start of the session.
    pub fn frame(&self, frame: &StampedFrame) {
        self.hand_over(Item::Frame(*frame));
    }

    /// An intact packet of the IMU and when it was received, since the start of the session.
    pub fn imu_packet(&self, time: Duration, packet: &Packet) {
        self.hand_over(Item::ImuPacket(time, *packet));
    }

    /// Something that happened.
    pub fn event(&self, event: &Event) {
        self.hand_over(Item::Event(event.clone()));
    }

    /// How it stands.
    pub fn status(&self) -> RecordingStatus {
        self.shared.current_status()
    }

    /// Whether half of the queue is free, for who can wait; a recording that has ended early takes nothing and holds
    /// nobody up.
    pub fn has_room(&self) -> bool {
        self.shared.waiting.load(Ordering::Relaxed) < QUEUE / 2 || self.shared.status().problem.is_some()
    }

    fn hand_over(&self, item: Item) {
        let count = item.count();
        self.shared.waiting.fetch_add(1, Ordering::Relaxed);
        if self.queue.try_send(item).is_err() {
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
            self.shared.lost[count].fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Shared {
    fn new(file: PathBuf) -> Self {
        let status = RecordingStatus { file, rows: 0, rows_lost: 0, frames: 0, bytes: 0, problem: None };
        Self {
            ending: AtomicBool::new(false),
            lost: Default::default(),
            waiting: AtomicUsize::new(0),
            status: Mutex::new(status),
        }
    }

    fn current_status(&self) -> RecordingStatus {
        let mut status = self.status().clone();
        if status.problem.is_some() {
            status.rows_lost = self.lost()[ROWS];
        }
        status
    }

    fn final_status(&self) -> RecordingStatus {
        let mut status = self.status().clone();
        let lost = self.lost();
        status.rows_lost = lost[ROWS];
        let file = status.file.display();
        let names = [
            (ROWS, "row", "rows"),
            (FRAMES, "frame", "frames"),
            (OTHERS, "bench row or event", "bench rows or events"),
        ];
        let parts: Vec<String> = { names.into_iter() }
            .filter(|(kind, ..)| lost[*kind] > 0)
            .map(|(kind, one, many)| format!("{} {}", lost[kind], if lost[kind] == 1 { one } else { many }))
            .collect();
        if parts.is_empty() {
            return status;
        }
        let verb = if lost.iter().sum::<u64>() == 1 { "was" } else { "were" };
        let lost = format!("{} {verb} lost", parts.join(" and "));
        status.problem = Some(match status.problem {
            Some(problem) => format!("{problem}; {lost}"),
            None => format!("{file}: {lost}, because the disk was too slow: record to another one"),
        });
        status
    }

    fn lost(&self) -> [u64; 3] {
        self.lost.each_ref().map(|count| count.load(Ordering::Relaxed))
    }

    fn status(&self) -> std::sync::MutexGuard<'_, RecordingStatus> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the thread works on.
struct Writer {
    files: Files,
    about: About,
    shared: Arc<Shared>,
    /// What was taken in during this turn or the one before, frames apart from all else. Frames come from several
    /// threads, a little out of order; they are written in the order of their times.
    held_frames: Vec<(Duration, Item)>,
    held: Vec<Item>,
    /// How many of `held` are from the turn before, and the newest time of a frame then.
    old: usize,
    newest_old: Option<Duration>,
}

impl Writer {
    fn new(files: Files, about: About, shared: Arc<Shared>) -> Self {
        let (held_frames, held) = (Vec::new(), Vec::new());
        Self { files, about, shared, held_frames, held, old: 0, newest_old: None }
    }

    fn run(mut self, items: &Receiver<Item>) {
        let mut turns_left = TURNS_BETWEEN_SYNCS;
        loop {
            // Read first, so that what was handed over before is taken in below.
            let ending = self.shared.ending.load(Ordering::Acquire);
            if self.take_in(items) {
                turns_left = turns_left.min(TURNS_TO_STOP);
            }
            let mut done = self.write(ending);
            turns_left -= 1;
            if turns_left == 0 || ending {
                turns_left = TURNS_BETWEEN_SYNCS;
                done = done.and_then(|()| self.files.sync()).and_then(|()| self.files.look());
            }
            if let Err(problem) = done {
                return self.give_up(problem, items);
            }
            if ending {
                return;
            }
            thread::park_timeout(FLUSH_INTERVAL);
        }
    }

    /// Takes in what has been handed over; returns whether a stop was among it.
    fn take_in(&mut self, items: &Receiver<Item>) -> bool {
        let mut stopped = false;
        // Not more than the queue holds, so that the end is not put off for ever.
        for item in items.try_iter().take(QUEUE) {
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
            stopped |= matches!(&item, Item::Event(event) if event.kind == EventKind::Stop);
            match item.frame_time() {
                Some(time) => self.held_frames.push((time, item)),
                None => self.held.push(item),
            }
        }
        stopped
    }

    /// Writes what was taken in before this turn, or everything.
    fn write(&mut self, everything: bool) -> Result<(), String> {
        self.held_frames.sort_by_key(|(time, _)| *time);
        let (frames, others) = if everything {
            (self.held_frames.len(), self.held.len())
        } else {
            let newest = self.newest_old;
            (self.held_frames.partition_point(|(time, _)| Some(*time) <= newest), self.old)
        };
        self.newest_old = self.held_frames.last().map(|(time, _)| *time);
        self.old = self.held.len() - others;
        // The frames first: with a row on the disk, the frames that were handed over before it are there too.
        for (_, item) in self.held_frames.drain(..frames) {
            self.files.push(&self.about, &item);
        }
        self.flush()?;
        for item in self.held.drain(..others) {
            self.files.push(&self.about, &item);
        }
        self.flush()
    }

    fn flush(&mut self) -> Result<(), String> {
        let written = self.files.flush();
        let mut status = self.shared.status();
        status.rows = self.files.robot_log.written;
        status.frames = self.files.frames.written;
        status.bytes += written?;
        Ok(())
    }

    fn give_up(self, problem: String, items: &Receiver<Item>) {
        let lost = |count: usize, more: u64| {
            self.shared.lost[count].fetch_add(more, Ordering::Relaxed);
        };
        lost(ROWS, self.files.robot_log.entries);
        lost(FRAMES, self.files.frames.entries);
        let held = self.held_frames.into_iter().map(|(_, item)| item).chain(self.held);
        held.chain(items.try_iter()).for_each(|item| lost(item.count(), 1));
        self.shared.status().problem = Some(problem);
    }
}

#[cfg(test)]
mod tests;
