//! Printing of lines from a separate thread, so that a slow reader never blocks the producer.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::{Duration, Instant};

use super::interrupt::Interrupt;
use super::output::Failure;

/// Queue length above which optional lines are dropped.
const MOST_WAITING: usize = 256;
/// Queue length above which lines are dropped that must not be lost: hours of events that nobody reads.
const MOST_KEPT: usize = 1 << 16;
/// Polling interval of the reader.
const LOOK: Duration = Duration::from_millis(2);
/// Timeout after an interrupt for a reader that reads no line.
const PATIENCE: Duration = Duration::from_millis(500);

/// Prints lines in their order.
pub(super) struct Printer {
    /// `None` after the last line.
    lines: Option<SyncSender<Vec<u8>>>,
    /// Number of lines not printed yet.
    waiting: Arc<AtomicUsize>,
    dropped: u64,
    /// `None` after its failure has been reported.
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl Printer {
    /// Starts the thread.
    pub(super) fn start(out: impl Write + Send + 'static) -> Result<Self, Failure> {
        let (sender, lines) = sync_channel(MOST_KEPT);
        let waiting = Arc::new(AtomicUsize::new(0));
        let left = Arc::clone(&waiting);
        let thread = Builder::new().name("output".to_owned()).spawn(move || print(out, &lines, &left))?;
        Ok(Self { lines: Some(sender), waiting, dropped: 0, thread: Some(thread) })
    }

    /// Queues a line that must not be lost.
    pub(super) fn keep(&mut self, line: Vec<u8>) -> Result<(), Failure> {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        match self.lines.as_ref().map(|lines| lines.try_send(line)) {
            Some(Ok(())) => Ok(()),
            Some(Err(TrySendError::Full(_))) => {
                self.waiting.fetch_sub(1, Ordering::Relaxed);
                self.dropped += 1;
                Ok(())
            }
            None | Some(Err(TrySendError::Disconnected(_))) => self.join(),
        }
    }

    /// Queues an optional line unless the queue is full.
    pub(super) fn offer(&mut self, line: Vec<u8>) -> Result<(), Failure> {
        if self.waiting.load(Ordering::Relaxed) < MOST_WAITING {
            return self.keep(line);
        }
        self.dropped += 1;
        Ok(())
    }

    /// Waits until the queue has space, or until an interrupt.
    pub(super) fn wait_for_room(&self, interrupt: &Interrupt) {
        let lives = || self.thread.as_ref().is_some_and(|thread| !thread.is_finished());
        while self.waiting.load(Ordering::Relaxed) >= MOST_WAITING && lives() && !interrupt.came() {
            sleep(LOOK);
        }
    }

    /// Number of dropped lines.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Waits until all lines are printed; after an interrupt only while the reader still reads.
    pub(super) fn finish(mut self, interrupt: &Interrupt) -> Result<(), Failure> {
        self.lines = None;
        let mut left = self.waiting.load(Ordering::Relaxed);
        let mut since = Instant::now();
        while self.thread.as_ref().is_some_and(|thread| !thread.is_finished()) {
            sleep(LOOK);
            let now_left = self.waiting.load(Ordering::Relaxed);
            if now_left != left || !interrupt.came() {
                (left, since) = (now_left, Instant::now());
            } else if since.elapsed() > PATIENCE {
                return Err(Failure::Message(format!(
                    "{left} lines were not printed, because standard output is not read: read it to the end"
                )));
            }
        }
        self.join()
    }

    /// Result of the thread, which ends automatically.
    fn join(&mut self) -> Result<(), Failure> {
        let printed = self.thread.take().map_or(Ok(Ok(())), JoinHandle::join);
        let defect =
            |_| Failure::Defect("the printing thread has failed, an internal error: report it".to_owned());
        Ok(printed.map_err(defect)??)
    }
}

fn print(mut out: impl Write, lines: &Receiver<Vec<u8>>, waiting: &AtomicUsize) -> io::Result<()> {
    for line in lines {
        out.write_all(&line).and_then(|()| out.flush())?;
        waiting.fetch_sub(1, Ordering::Relaxed);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Accepts no byte while locked.
    #[derive(Clone, Default)]
    struct Gate(Arc<Mutex<Vec<u8>>>);

    impl Write for Gate {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().map_err(|_| io::ErrorKind::Other)?.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn behind_a_reader_that_stalls_lines_are_spared_but_none_that_is_to_be_kept() {
        let gate = Gate::default();
        let mut printer = Printer::start(gate.clone()).unwrap();
        let stalled = gate.0.lock().unwrap();
        for line in 0..1000 {
            printer.offer(format!("status {line}\n").into_bytes()).unwrap();
        }
        printer.keep(b"event\n".to_vec()).unwrap();
        printer.keep(b"end\n".to_vec()).unwrap();
        assert_eq!(printer.dropped(), 1000 - MOST_WAITING as u64);
        let told = Interrupt::default();
        told.raise(1);
        drop(stalled);
        printer.finish(&told).unwrap();
        let mut expected: String = (0..MOST_WAITING).map(|line| format!("status {line}\n")).collect();
        expected += "event\nend\n";
        assert_eq!(String::from_utf8(gate.0.lock().unwrap().clone()).unwrap(), expected);
    }

    #[test]
    fn a_slow_reader_is_waited_for_until_an_interrupt() {
        let gate = Gate::default();
        let mut printer = Printer::start(gate.clone()).unwrap();
        let told = Interrupt::default();
        for line in 0..2 * MOST_WAITING {
            printer.wait_for_room(&told);
            printer.offer(format!("status {line}\n").into_bytes()).unwrap();
        }
        assert_eq!(printer.dropped(), 0);
        let stalled = gate.0.lock().unwrap();
        (0..=MOST_WAITING).for_each(|_| printer.offer(b"status\n".to_vec()).unwrap());
        told.raise(1);
        printer.wait_for_room(&told);
        drop(stalled);
        printer.finish(&told).unwrap();
    }

    #[test]
    fn a_reader_that_takes_nothing_is_left_after_an_interrupt() {
        let gate = Gate::default();
        let mut printer = Printer::start(gate.clone()).unwrap();
        let stalled = gate.0.lock().unwrap();
        printer.keep(b"end\n".to_vec()).unwrap();
        let told = Interrupt::default();
        told.raise(1);
        let Err(Failure::Message(message)) = printer.finish(&told) else { panic!("it was printed") };
        assert!(message.starts_with("1 lines were not printed"), "{message}");
        drop(stalled);
    }

    #[test]
    fn a_reader_that_has_gone_is_told() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }

            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut printer = Printer::start(Closed).unwrap();
        let gone = |outcome| matches!(outcome, Err(Failure::ReaderGone));
        let told = printer.keep(b"first\n".to_vec());
        assert!(gone(told) || gone(printer.finish(&Interrupt::default())));
    }
}
