//! A thread that writes a recording while the robot runs, and never holds up who hands it something.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::session::{Event, RecordingStatus};
use crate::link::StampedFrame;
use crate::link::jy901::Packet;
use crate::record::BenchSample;
use crate::record::recording::{self, About, Names, Row};
use crate::robot::Motor;

/// What is handed over reaches the system within this time, unless the machine is too busy.
const FLUSH_INTERVAL: Duration = Duration::from_millis(50);
/// Whether the files are still where they were made is looked at after so many flushes.
const FLUSHES_BETWEEN_LOOKS: u32 = 20;
/// Rows and frames on their way to the thread: three seconds of a full bus at 1 Mbit/s.
const QUEUE: usize = 1 << 15;
/// Text in memory before it is handed to the system, bytes.
const BLOCK: usize = 1 << 16;

/// Why no recording could be started.
#[derive(Debug, thiserror::Error)]
pub enum RecorderError {
    /// One of its files is there already.
    #[error("{} is there already and is not overwritten: give another name or move it away", file.display())]
    Exists {
        /// The file.
        file: PathBuf,
    },
    /// The folder it is to be in is not there.
    #[error("{}: the folder {} is not there: make it or give another name", file.display(), folder.display())]
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
        /// What the system said.
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
    lost: AtomicU64,
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
    Event(Duration, String),
}

impl Recorder {
    /// Makes the files of the recording `name` ([`Names`]) and starts its thread; `bench` adds the motors' bench
    /// logs.
    ///
    /// # Errors
    /// [`RecorderError`]; then no file is left behind.
    pub fn start(name: &Path, about: &About, bench: bool) -> Result<Self, RecorderError> {
        let names = Names::new(name);
        let files = Files::create(&names, about, bench)?;
        let status = RecordingStatus { file: names.robot_log, rows: 0, frames: 0, bytes: 0, problem: None };
        let shared = Arc::new(Shared {
            ending: AtomicBool::new(false),
            lost: AtomicU64::new(0),
            waiting: AtomicUsize::new(0),
            status: Mutex::new(status),
        });
        let (queue, items) = sync_channel(QUEUE);
        let writer = Writer { files, about: about.clone(), shared: Arc::clone(&shared), pending: [0; 2] };
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
        self.input.shared.status().clone()
    }

    /// Rows, frames and events that did not reach the files: the disk was too slow or the recording has ended early.
    pub fn lost(&self) -> u64 {
        self.input.shared.lost.load(Ordering::Relaxed)
    }

    /// Writes all that was handed over, and ends.
    pub fn finish(mut self) -> RecordingStatus {
        self.join();
        self.status()
    }

    fn join(&mut self) {
        self.input.shared.ending.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            if thread.join().is_err() {
                let problem = "the recording has ended by a fault of this program";
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

    /// An intact packet of the IMU and when it was heard, since the start of the session.
    pub fn imu_packet(&self, time: Duration, packet: &Packet) {
        self.hand_over(Item::ImuPacket(time, *packet));
    }

    /// Something that happened.
    pub fn event(&self, event: &Event) {
        self.hand_over(Item::Event(event.time, format!("{}: {}", event.kind.name(), event.text)));
    }

    /// Whether half of the queue is free, for who can wait.
    pub fn has_room(&self) -> bool {
        self.shared.waiting.load(Ordering::Relaxed) < QUEUE / 2
    }

    fn hand_over(&self, item: Item) {
        self.shared.waiting.fetch_add(1, Ordering::Relaxed);
        if self.queue.try_send(item).is_err() {
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
            self.shared.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Shared {
    fn status(&self) -> std::sync::MutexGuard<'_, RecordingStatus> {
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the thread works on.
struct Writer {
    files: Files,
    about: About,
    shared: Arc<Shared>,
    /// Rows and frames that are in memory only.
    pending: [u64; 2],
}

impl Writer {
    fn run(mut self, items: &Receiver<Item>) {
        let mut turn = 0_u32;
        loop {
            // Read first, so that what was handed over before is taken in below.
            let ending = self.shared.ending.load(Ordering::Acquire);
            turn = turn.wrapping_add(1);
            let look = turn.is_multiple_of(FLUSHES_BETWEEN_LOOKS);
            let done = self.take_in(items).and_then(|()| if look { self.files.look() } else { Ok(()) });
            if let Err(problem) = done {
                return self.give_up(problem, items);
            }
            if ending {
                return;
            }
            thread::park_timeout(FLUSH_INTERVAL);
        }
    }

    /// Writes what has been handed over.
    fn take_in(&mut self, items: &Receiver<Item>) -> Result<(), String> {
        // Not more than the queue holds, so that the end is not put off for ever.
        for item in items.try_iter().take(QUEUE) {
            self.shared.waiting.fetch_sub(1, Ordering::Relaxed);
            self.push(item);
            if self.files.longest() > BLOCK {
                self.flush()?;
            }
        }
        self.flush()
    }

    fn push(&mut self, item: Item) {
        let Self { files, about, pending: [rows, frames], .. } = self;
        match item {
            Item::Row(row) => {
                recording::push_row(&mut files.robot_log.text, &row);
                *rows += 1;
            }
            Item::Bench(sample) => {
                for (part, motor) in files.bench.iter_mut().zip(Motor::BOTH) {
                    recording::push_bench_row(&mut part.text, &sample, motor);
                }
            }
            Item::Frame(frame) => {
                recording::push_frame(&mut files.frames.text, about.start, &about.interface, &frame);
                *frames += 1;
            }
            Item::ImuPacket(time, packet) => {
                recording::push_imu_packet(&mut files.frames.text, about.start, time, &packet);
                *frames += 1;
            }
            Item::Event(time, what) => recording::push_event(&mut files.robot_log.text, time, &what),
        }
    }

    fn flush(&mut self) -> Result<(), String> {
        let bytes = self.files.flush()?;
        let mut status = self.shared.status();
        status.bytes += bytes;
        let [rows, frames] = std::mem::take(&mut self.pending);
        status.rows += rows;
        status.frames += frames;
        Ok(())
    }

    fn give_up(self, problem: String, items: &Receiver<Item>) {
        let left = self.pending.iter().sum::<u64>() + items.try_iter().count() as u64;
        self.shared.lost.fetch_add(left, Ordering::Relaxed);
        self.shared.waiting.store(0, Ordering::Relaxed);
        self.shared.status().problem = Some(problem);
    }
}

/// The files of a recording; the bench logs only where they are wanted.
struct Files {
    robot_log: Part,
    frames: Part,
    bench: Vec<Part>,
}

impl Files {
    /// Makes all files, or none.
    fn create(names: &Names, about: &About, bench: bool) -> Result<Self, RecorderError> {
        let mut made = Vec::new();
        let done = Self::create_each(names, about, bench, &mut made);
        if done.is_err() {
            for file in made {
                // What matters is the first error.
                fs::remove_file(file).unwrap_or(());
            }
        }
        done
    }

    fn create_each(
        names: &Names,
        about: &About,
        bench: bool,
        made: &mut Vec<PathBuf>,
    ) -> Result<Self, RecorderError> {
        let mut create = |file: &Path, header: String| {
            let part = Part::create(file, header)?;
            made.push(file.to_owned());
            Ok(part)
        };
        let robot_log = create(&names.robot_log, recording::robot_header(about))?;
        let frames = create(&names.frames, String::new())?;
        let motors = names.bench.iter().zip(Motor::BOTH).filter(|_| bench);
        let bench = motors.map(|(file, motor)| create(file, recording::bench_header(about, motor)));
        let bench = bench.collect::<Result<_, _>>()?;
        Ok(Self { robot_log, frames, bench })
    }

    /// The frames first: with a row on the disk, the frames that were handed over before it are there too.
    fn parts(&mut self) -> impl Iterator<Item = &mut Part> {
        [&mut self.frames, &mut self.robot_log].into_iter().chain(&mut self.bench)
    }

    fn longest(&mut self) -> usize {
        self.parts().map(|part| part.text.len()).max().unwrap_or(0)
    }

    /// Hands the text in memory to the system; gives its length in bytes.
    fn flush(&mut self) -> Result<u64, String> {
        self.parts().map(Part::flush).sum()
    }

    /// Whether the files are still there. A deleted file takes text without complaint.
    fn look(&mut self) -> Result<(), String> {
        self.parts().try_for_each(|part| match fs::metadata(&part.path) {
            Ok(_) => Ok(()),
            Err(error) => Err(part.problem(&error)),
        })
    }
}

/// A file that grows.
struct Part {
    path: PathBuf,
    file: Box<dyn Write + Send>,
    /// Text that is in memory only.
    text: String,
}

impl Part {
    fn create(path: &Path, header: String) -> Result<Self, RecorderError> {
        let open = fs::OpenOptions::new().write(true).create_new(true).open(path);
        let file = open.map_err(|error| not_created(path, error))?;
        Ok(Self { path: path.to_owned(), file: Box::new(file), text: header })
    }

    fn flush(&mut self) -> Result<u64, String> {
        self.file.write_all(self.text.as_bytes()).map_err(|error| self.problem(&error))?;
        let length = self.text.len() as u64;
        self.text.clear();
        Ok(length)
    }

    fn problem(&self, error: &io::Error) -> String {
        let file = self.path.display();
        match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                format!("{file}: the disk is full and the recording has ended: make room and start a new one")
            }
            io::ErrorKind::NotFound => {
                format!(
                    "{file} is gone and the recording has ended: leave its folder in place and start a new one"
                )
            }
            _ => format!("{file}: {error}, and the recording has ended: check the disk and start a new one"),
        }
    }
}

fn not_created(file: &Path, error: io::Error) -> RecorderError {
    let file = file.to_owned();
    match error.kind() {
        io::ErrorKind::AlreadyExists => RecorderError::Exists { file },
        io::ErrorKind::NotFound => {
            let folder = file.parent().unwrap_or(Path::new(".")).to_owned();
            RecorderError::NoFolder { file, folder }
        }
        _ => RecorderError::Failed { file, error },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Direction, Frame, FrameId};

    /// Takes so many bytes.
    struct Disk(usize);

    impl Write for Disk {
        fn write(&mut self, text: &[u8]) -> io::Result<usize> {
            let room = self.0.min(text.len());
            self.0 -= room;
            if room == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(room) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn part(name: &str, room: usize) -> Part {
        Part { path: name.into(), file: Box::new(Disk(room)), text: String::new() }
    }

    fn frame() -> StampedFrame {
        let frame = Frame::full(FrameId::Standard(0x141), [0xA1, 0, 0, 0, 0x84, 1, 0, 0]);
        StampedFrame { time: Duration::from_millis(1), direction: Direction::Sent, frame }
    }

    fn input(queue: usize) -> (RecorderInput, Receiver<Item>) {
        let status = RecordingStatus { file: "run.csv".into(), rows: 0, frames: 0, bytes: 0, problem: None };
        let shared = Shared {
            ending: AtomicBool::new(true),
            lost: AtomicU64::new(0),
            waiting: AtomicUsize::new(0),
            status: Mutex::new(status),
        };
        let (queue, items) = sync_channel(queue);
        (RecorderInput { queue, shared: Arc::new(shared) }, items)
    }

    fn writer(input: &RecorderInput, room: usize) -> Writer {
        let files = Files {
            robot_log: part("run.csv", usize::MAX),
            frames: part("run.log", room),
            bench: Vec::new(),
        };
        let about = About {
            source: "can:can0".into(),
            interface: "can0".into(),
            start: Duration::from_secs(1_700_000_000),
        };
        Writer { files, about, shared: Arc::clone(&input.shared), pending: [0; 2] }
    }

    #[test]
    fn a_full_disk_ends_the_recording_and_says_so_and_nothing_else_stops() {
        let (input, items) = input(8);
        (0..3).for_each(|_| input.frame(&frame()));
        writer(&input, 100).run(&items);
        let status = input.shared.status().clone();
        assert_eq!(
            status.problem.as_deref(),
            Some("run.log: the disk is full and the recording has ended: make room and start a new one")
        );
        assert_eq!((status.frames, input.shared.lost.load(Ordering::Relaxed)), (0, 3));
        drop(items);
        input.frame(&frame());
        assert_eq!(input.shared.lost.load(Ordering::Relaxed), 4);
    }

    #[test]
    fn what_the_queue_cannot_take_is_counted() {
        let (input, items) = input(2);
        (0..5).for_each(|_| input.frame(&frame()));
        writer(&input, usize::MAX).run(&items);
        let line = "(1700000000.001000) can0 141#A100000084010000 T\n";
        let status = input.shared.status().clone();
        assert_eq!((status.frames, status.bytes, status.problem), (2, 2 * line.len() as u64, None));
        assert_eq!(input.shared.lost.load(Ordering::Relaxed), 3);
    }

    #[test]
    fn a_file_that_is_taken_away_is_missed() {
        let mut files = writer(&input(1).0, usize::MAX).files;
        files.frames.path = "no such folder/run.log".into();
        let problem = files.look().unwrap_err();
        assert!(
            problem.starts_with("no such folder/run.log is gone and the recording has ended"),
            "{problem}"
        );
    }
}
