//! A pseudo-terminal that another program opens as if it were a serial port.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort, TTYPort};

use super::open_error::OpenError;

/// Writes that may wait for the client.
const WAITING: usize = 16_384;
/// How long one write waits before it looks whether it is still wanted.
const PATIENCE: Duration = Duration::from_millis(100);

/// Both ends of a pseudo-terminal: the far one is kept open, so that clients may come and go.
pub(super) struct Pty {
    near: TTYPort,
    far: TTYPort,
    /// The far end once more, for what its other handle cannot do.
    door: File,
    name: String,
    /// None while it is dropped.
    queue: Option<SyncSender<Vec<u8>>>,
    progress: Arc<Progress>,
    handed: u64,
    /// Bytes written, and when they were seen to become more.
    seen: (u64, Duration),
    writer: Option<JoinHandle<()>>,
}

/// What the writing thread shares.
#[derive(Debug, Default)]
struct Progress {
    /// Bytes that have been written or thrown away.
    done: AtomicU64,
    /// Bytes are to be thrown away.
    discards: AtomicBool,
}

impl Pty {
    pub(super) fn open(name: &str) -> Result<Self, OpenError> {
        let failed =
            |reason: String| OpenError::Failed { name: format!("a pseudo-terminal for {name}"), reason };
        let (near, far) = TTYPort::pair().map_err(|error| failed(error.to_string()))?;
        let mut writing = near.try_clone_native().map_err(|error| failed(error.to_string()))?;
        writing.set_timeout(PATIENCE).map_err(|error| failed(error.to_string()))?;
        let port = far.name().ok_or_else(|| failed("it has no name".to_owned()))?;
        let door = File::open(&port).map_err(|error| failed(error.to_string()))?;
        let (queue, chunks) = sync_channel(WAITING);
        let progress = Arc::new(Progress::default());
        let shared = Arc::clone(&progress);
        let thread = thread::Builder::new().name(name.to_owned());
        let writer = thread.spawn(move || write_all(&mut writing, &chunks, &shared));
        let writer = writer.map_err(|error| failed(error.to_string()))?;
        Ok(Self {
            near,
            far,
            door,
            name: port,
            queue: Some(queue),
            progress,
            handed: 0,
            seen: (0, Duration::ZERO),
            writer: Some(writer),
        })
    }

    /// What a client opens.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Waits for bytes of the client, at most so long, and puts what has come into `bytes`.
    pub(super) fn read(&mut self, wait: Duration, bytes: &mut Vec<u8>) {
        let mut buffer = [0; 4096];
        let read = self.near.set_timeout(wait).is_ok().then(|| self.near.read(&mut buffer));
        match read {
            Some(Ok(count)) => bytes.extend_from_slice(&buffer[..count]),
            Some(Err(error)) if error.kind() == ErrorKind::TimedOut => {}
            _ => thread::sleep(wait),
        }
    }

    /// Hands bytes over for writing; never waits. False where they were dropped because too many wait already.
    pub(super) fn write(&mut self, now: Duration, bytes: Vec<u8>) -> bool {
        let done = self.progress.done.load(Ordering::Acquire);
        if done == self.handed {
            self.progress.discards.store(false, Ordering::Release);
        }
        if done != self.seen.0 || done == self.handed {
            self.seen = (done, now);
        }
        if bytes.is_empty() {
            return true;
        }
        let length = bytes.len() as u64;
        let taken = self.queue.as_ref().is_some_and(|queue| queue.try_send(bytes).is_ok());
        self.handed += if taken { length } else { 0 };
        taken
    }

    /// For how long bytes have been waiting and none was taken.
    pub(super) fn stuck_for(&self, now: Duration) -> Duration {
        now.saturating_sub(self.seen.1)
    }

    /// Bytes that have been written but not read.
    pub(super) fn unread(&self) -> u32 {
        self.far.bytes_to_read().unwrap_or(0)
    }

    /// Throws away all that a client has not read, and lets the next one in.
    pub(super) fn forget_client(&mut self) {
        if self.progress.done.load(Ordering::Acquire) != self.handed {
            self.progress.discards.store(true, Ordering::Release);
        }
        // What cannot be cleared stays until it is read; the next call tries again.
        self.near.clear(ClearBuffer::Output).unwrap_or(());
        self.far.clear(ClearBuffer::Input).unwrap_or(());
        self.release();
    }

    /// Takes back the lock of a client that was killed. The serial library would take a shared lock of its own
    /// instead, which keeps out every client that wants the port for itself.
    pub(super) fn release(&mut self) {
        rustix::termios::ioctl_tiocnxcl(&self.door).unwrap_or(());
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        self.queue = None;
        self.progress.discards.store(true, Ordering::Release);
        while self.writer.as_ref().is_some_and(|writer| !writer.is_finished()) {
            self.forget_client();
            thread::sleep(Duration::from_millis(1));
        }
        if let Some(writer) = self.writer.take() {
            writer.join().unwrap_or(());
        }
    }
}

fn write_all(port: &mut TTYPort, chunks: &Receiver<Vec<u8>>, progress: &Progress) {
    for chunk in chunks {
        let mut left = chunk.as_slice();
        while !left.is_empty() && !progress.discards.load(Ordering::Acquire) {
            match port.write(left) {
                Ok(count) => {
                    progress.done.fetch_add(count as u64, Ordering::AcqRel);
                    left = &left[count..];
                }
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                Err(_) => thread::sleep(PATIENCE),
            }
        }
        progress.done.fetch_add(left.len() as u64, Ordering::AcqRel);
    }
}
