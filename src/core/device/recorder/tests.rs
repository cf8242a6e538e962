use std::io::Write;
use std::path::Path;
use std::sync::mpsc::sync_channel;

use super::files::{Disk as DiskTrait, Part};
use super::*;
use crate::link::{Direction, Frame, FrameId};
use crate::record::Sample;
use crate::record::recording::push_row;

/// What a disk was asked to do, in turn.
#[derive(Clone, Debug, PartialEq)]
enum Done {
    Written(String),
    Synced,
}

/// Takes so many bytes.
struct Disk(usize, Arc<Mutex<Vec<Done>>>);

impl Write for Disk {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        let room = self.0.min(text.len());
        self.0 -= room;
        self.1.lock().unwrap().push(Done::Written(String::from_utf8(text[..room].to_vec()).unwrap()));
        if room == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(room) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskTrait for Disk {
    fn sync(&self) -> io::Result<()> {
        self.1.lock().unwrap().push(Done::Synced);
        Ok(())
    }

    fn look(&self, path: &Path) -> io::Result<()> {
        if path.starts_with("no such folder") { Err(io::ErrorKind::NotFound.into()) } else { Ok(()) }
    }
}

fn at_ms(ms: u64) -> StampedFrame {
    let frame = Frame::full(FrameId::Standard(0x141), [0xA1, 0, 0, 0, 0x84, 1, 0, ms as u8]);
    StampedFrame { time: Duration::from_millis(ms), direction: Direction::Sent, frame }
}

fn row() -> Row {
    Row::from(Sample {
        time_s: 0.0,
        x_m: 0.0,
        x_dot_m_s: 0.0,
        pitch_rad: 0.0,
        pitch_rate_rad_s: 0.0,
        motor_angle_left_rad: 0.0,
        motor_angle_right_rad: 0.0,
        motor_speed_left_rad_s: 0.0,
        motor_speed_right_rad_s: 0.0,
        torque_left_nm: 0.0,
        torque_right_nm: 0.0,
    })
}

/// A recorder that is to end, whose disks have so much room for rows and for frames.
struct Bench {
    input: RecorderInput,
    items: Receiver<Item>,
    writer: Writer,
    rows: Arc<Mutex<Vec<Done>>>,
    frames: Arc<Mutex<Vec<Done>>>,
}

fn bench(queue: usize, rows_room: usize, frames_room: usize) -> Bench {
    let shared = Arc::new(Shared::new("run.csv".into()));
    shared.ending.store(true, Ordering::Relaxed);
    let (queue, items) = sync_channel(queue);
    let [rows, frames] = [(); 2].map(|()| Arc::<Mutex<Vec<Done>>>::default());
    let part = |name: &str, room, done: &Arc<Mutex<Vec<Done>>>| Part {
        path: name.into(),
        file: Box::new(Disk(room, Arc::clone(done))),
        text: String::new(),
        entries: 0,
        written: 0,
    };
    let files = Files {
        robot_log: part("run.csv", rows_room, &rows),
        frames: part("run.log", frames_room, &frames),
        bench: Vec::new(),
    };
    let start = Duration::from_secs(1_700_000_000);
    let about = About { source: "can:can0".into(), interface: "can0".into(), start };
    let writer = Writer::new(files, about, Arc::clone(&shared));
    Bench { input: RecorderInput { queue, shared }, items, writer, rows, frames }
}

/// Milliseconds of the frames that were written, in the order of the file.
fn written_ms(done: &Mutex<Vec<Done>>) -> Vec<u8> {
    let done = done.lock().unwrap();
    let text: String = done
        .iter()
        .filter_map(|done| if let Done::Written(text) = done { Some(text.as_str()) } else { None })
        .collect();
    text.lines().map(|line| u8::from_str_radix(&line[line.len() - 4..line.len() - 2], 16).unwrap()).collect()
}

#[test]
fn a_full_disk_ends_the_recording_with_the_rows_and_frames_that_are_not_in_its_files() {
    let Bench { input, items, writer, .. } = bench(8, usize::MAX, 100);
    (0..3).for_each(|ms| input.frame(&at_ms(ms)));
    input.row(&row());
    writer.run(&items);
    let status = input.shared.status().clone();
    assert_eq!(
        status.problem.as_deref(),
        Some("run.log: the disk is full and the recording has stopped: free disk space and start a new one")
    );
    // Two lines of 47 bytes fit.
    assert_eq!((status.rows, status.frames, input.shared.lost()), (0, 2, [1, 1, 0]));
    drop(items);
    input.frame(&at_ms(3));
    input.row(&row());
    assert_eq!(input.shared.lost(), [2, 2, 0]);

    let mut fits = "# 0.000 s note: 30 °C\n".to_owned();
    (0..2).for_each(|_| push_row(&mut fits, &row()));
    let Bench { input, items, writer, .. } = bench(16, fits.len() + 3, usize::MAX);
    let event = Event { time: Duration::ZERO, kind: EventKind::Note, text: "30 °C".to_owned() };
    input.row(&row());
    input.event(&event);
    (0..4).for_each(|_| input.row(&row()));
    input.event(&event);
    writer.run(&items);
    assert_eq!(input.shared.current_status().rows_lost, 3);
    let status = input.shared.final_status();
    let problem = status.problem.as_deref();
    assert_eq!(
        problem,
        Some(
            "run.csv: the disk is full and the recording has stopped: free disk space and start a new one; 3 rows were lost"
        )
    );
    assert_eq!((status.rows, status.rows_lost), (2, 3));
}

#[test]
fn what_the_queue_cannot_take_is_counted() {
    let Bench { input, items, writer, .. } = bench(2, usize::MAX, usize::MAX);
    (0..5).for_each(|ms| input.frame(&at_ms(ms)));
    writer.run(&items);
    let line = "(1700000000.001000) can0 141#A100000084010001 T\n";
    let status = input.shared.status().clone();
    assert_eq!((status.frames, status.bytes, status.problem), (2, 2 * line.len() as u64, None));
    assert_eq!(input.shared.lost(), [0, 3, 0]);
    (0..7).for_each(|_| input.row(&row()));
    let problem = input.shared.final_status().problem.unwrap();
    assert_eq!(
        problem,
        "run.csv: 5 rows and 3 frames were lost, because the disk was too slow: record to another one"
    );
}

/// Frames of two threads come a little out of order, also from one turn to the next.
#[test]
fn frames_are_written_in_the_order_of_their_times() {
    let Bench { input, items, mut writer, frames, .. } = bench(64, usize::MAX, usize::MAX);
    for turn in [&[1, 3, 2][..], &[5, 4, 7], &[6, 9], &[], &[8]] {
        turn.iter().for_each(|ms| input.frame(&at_ms(*ms)));
        writer.take_in(&items);
        writer.write(false).unwrap();
    }
    // 8 comes when 9, a turn before, is in the file.
    assert_eq!(written_ms(&frames), [1, 2, 3, 4, 5, 6, 7, 9, 8], "at the latest a turn after they came");
}

#[test]
fn a_row_is_written_after_the_frames_that_were_handed_over_before_it() {
    let Bench { input, items, mut writer, frames, rows } = bench(64, usize::MAX, usize::MAX);
    for ms in 0..10 {
        input.frame(&at_ms(ms));
        input.row(&row());
        writer.take_in(&items);
        writer.write(false).unwrap();
        let count = rows.lock().unwrap().len();
        assert!(written_ms(&frames).len() >= count, "{ms}");
    }
    assert_eq!(written_ms(&frames).len(), 9);
}

#[test]
fn the_files_are_on_the_disk_at_the_end_soon_after_a_stop_and_within_a_second() {
    let synced = |done: &Mutex<Vec<Done>>| {
        let done = done.lock().unwrap();
        done.iter().filter(|done| **done == Done::Synced).count()
    };
    let Bench { input, items, writer, rows, frames } = bench(64, usize::MAX, usize::MAX);
    input.frame(&at_ms(1));
    writer.run(&items);
    assert_eq!((synced(&rows), frames.lock().unwrap().last()), (1, Some(&Done::Synced)));

    let stop = Event { time: Duration::ZERO, kind: EventKind::Stop, text: "stopped".to_owned() };
    for (event, turns) in [(Some(stop), TURNS_TO_STOP), (None, TURNS_BETWEEN_SYNCS)] {
        let Bench { input, items, writer, frames, .. } = bench(64, usize::MAX, usize::MAX);
        input.shared.ending.store(false, Ordering::Relaxed);
        input.frame(&at_ms(1));
        event.iter().for_each(|event| input.event(event));
        let shared = Arc::clone(&input.shared);
        let thread = thread::spawn(move || writer.run(&items));
        while synced(&frames) == 0 {
            thread::yield_now();
        }
        assert!(written_ms(&frames) == [1], "after {turns} turns");
        shared.ending.store(true, Ordering::Relaxed);
        thread.thread().unpark();
        thread.join().unwrap();
    }
    assert!(FLUSH_INTERVAL * TURNS_BETWEEN_SYNCS < Duration::from_secs(1));
}

#[test]
fn a_file_that_is_taken_away_is_missed() {
    let mut files = bench(1, usize::MAX, usize::MAX).writer.files;
    files.frames.path = "no such folder/run.log".into();
    let problem = files.look().unwrap_err();
    assert!(problem.starts_with("no such folder/run.log is gone and the recording has stopped"), "{problem}");
}
