//! Signals: stop the robot before the program ends or is suspended.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;

use flqr_core::device::abandon_replacements;

use super::output::Failure;

/// Timeout for the motors to confirm that they are off before the program ends or is suspended.
const MOTORS_OFF_LAST: Duration = Duration::from_secs(2);
/// Time for the recording of a stop to reach the disk.
const RECORDED: Duration = Duration::from_millis(100);
/// Polling interval.
const LOOK: Duration = Duration::from_millis(1);

/// Request to end the program.
#[derive(Clone, Default)]
pub(super) struct Interrupt(Arc<Noted>);

#[derive(Default)]
struct Noted {
    came: AtomicBool,
    /// Number of the first signal; 0 if none was received.
    signal: AtomicI32,
    /// The program is about to be suspended, or has not resumed yet.
    suspends: AtomicBool,
}

/// Activity of the program while it watches for signals.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Duty {
    /// Monitors a robot; ends at a signal as soon as possible.
    Monitor,
    /// Drives a robot; every signal stops it and ends the command.
    Drive,
    /// Shows the window: a signal stops the robot and ends the program.
    Window,
}

impl Interrupt {
    /// Watches for signals. A second one ends the program as soon as no motor is on.
    pub(super) fn watch(duty: Duty) -> Result<Self, Failure> {
        let interrupt = Self::default();
        system::watch(duty, interrupt.clone()).map_err(|error| {
            Failure::Message(format!("cannot watch for Ctrl+C and other signals: {error}"))
        })?;
        Ok(interrupt)
    }

    /// Records a signal; returns whether it is the first.
    pub(super) fn raise(&self, signal: i32) -> bool {
        let first = self.0.signal.compare_exchange(0, signal, Ordering::AcqRel, Ordering::Acquire).is_ok();
        self.0.came.store(true, Ordering::Release);
        first
    }

    /// Returns whether a signal was received.
    pub(super) fn came(&self) -> bool {
        self.0.came.load(Ordering::Acquire)
    }

    /// Returns the name of the first signal.
    pub(super) fn signal(&self) -> Option<&'static str> {
        Some(self.0.signal.load(Ordering::Acquire)).filter(|signal| *signal != 0).map(system::name)
    }

    /// Waits until a requested suspension is over.
    pub(super) fn wait_for_suspension(&self) {
        while self.0.suspends.load(Ordering::Acquire) {
            std::thread::sleep(LOOK);
        }
    }
}

/// Stops every robot and waits for the motors that respond.
fn stop_robots() {
    flqr_core::device::stop_all();
    let looks = MOTORS_OFF_LAST.as_millis() / LOOK.as_millis();
    for look in 0..looks {
        if flqr_core::device::all_stopped() {
            if look > 0 {
                std::thread::sleep(RECORDED);
            }
            return;
        }
        std::thread::sleep(LOOK);
    }
}

/// Stops every robot and removes temporary files before `end` ends the program.
fn end(end: impl FnOnce()) {
    stop_robots();
    abandon_replacements(end);
}

#[cfg(unix)]
mod system {
    use std::io;
    use std::sync::atomic::Ordering;
    use std::thread::Builder;

    use signal_hook::consts::signal::{
        SIGALRM, SIGHUP, SIGINT, SIGIO, SIGPROF, SIGQUIT, SIGSYS, SIGTERM, SIGTRAP, SIGTSTP, SIGTTIN,
        SIGTTOU, SIGUSR1, SIGUSR2, SIGVTALRM, SIGXCPU, SIGXFSZ,
    };
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::{emulate_default_handler, signal_name};

    use super::{Duty, Interrupt, end, stop_robots};

    /// Signals that suspend the program.
    const SUSPEND: [i32; 3] = [SIGTSTP, SIGTTIN, SIGTTOU];
    /// Signals that request termination.
    const END: [i32; 4] = [SIGINT, SIGTERM, SIGHUP, SIGQUIT];
    /// Further signals that would end it immediately.
    const KILL: [i32; 10] =
        [SIGUSR1, SIGUSR2, SIGXFSZ, SIGXCPU, SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGSYS, SIGTRAP];
    /// Those of Linux alone that have no name here: SIGSTKFLT, SIGPWR and the real-time signals (signal(7)).
    const UNNAMED: [std::ops::RangeInclusive<i32>; 3] = [16..=16, 30..=30, 34..=64];

    pub(super) fn watch(duty: Duty, interrupt: Interrupt) -> io::Result<()> {
        // A monitor may be suspended at any time. A file that has grown to its limit ends its recording, not itself.
        let kinds =
            if duty == Duty::Monitor { vec![&END[..], &[SIGXFSZ]] } else { vec![&SUSPEND[..], &END, &KILL] };
        let mut numbers = kinds.concat();
        if duty != Duty::Monitor && cfg!(target_os = "linux") {
            numbers.extend(UNNAMED.into_iter().flatten());
        }
        let mut signals = Signals::new(numbers)?;
        let work = move || {
            flqr_core::device::hurry();
            for signal in signals.forever() {
                take(duty, &interrupt, signal);
            }
        };
        Builder::new().name("signals".to_owned()).spawn(work).map(drop)
    }

    fn take(duty: Duty, interrupt: &Interrupt, signal: i32) {
        if SUSPEND.contains(&signal) {
            interrupt.0.suspends.store(true, Ordering::Release);
            interrupt.raise(signal);
            stop_robots();
            emulate(signal);
            interrupt.0.suspends.store(false, Ordering::Release);
        } else if duty == Duty::Monitor && signal == SIGXFSZ {
            // The write fails, and the recording says so.
        } else if interrupt.raise(signal) && duty != Duty::Window {
            flqr_core::device::stop_all();
        } else {
            end(|| emulate(signal));
        }
    }

    /// Applies the default action of a signal, which for those without a name is to end the program.
    fn emulate(signal: i32) {
        if emulate_default_handler(signal).is_err() {
            std::process::exit(128 + signal);
        }
    }

    pub(super) fn name(signal: i32) -> &'static str {
        signal_name(signal).unwrap_or("signal")
    }
}

#[cfg(not(unix))]
mod system {
    use super::{Duty, Interrupt, end};

    pub(super) fn watch(duty: Duty, interrupt: Interrupt) -> Result<(), ctrlc::Error> {
        ctrlc::set_handler(move || {
            if interrupt.raise(1) && duty != Duty::Window {
                flqr_core::device::stop_all();
            } else {
                end(|| std::process::exit(1));
            }
        })
    }

    pub(super) fn name(_: i32) -> &'static str {
        "Ctrl+C"
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::{Error, Write};

    use flqr_core::device::replace_file;

    #[test]
    fn no_temporary_file_remains_when_a_signal_ends_the_program() {
        let folder = std::env::temp_dir().join(format!("flqr-interrupt-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let count = || fs::read_dir(&folder).unwrap().count();
        let mut counts = Vec::new();
        let replaced = replace_file(&folder.join("model.toml"), |file| {
            file.write_all(b"half of the new")?;
            counts.push(count());
            super::end(|| counts.push(count()));
            Err(Error::other("the program has ended"))
        });
        assert!(replaced.is_err());
        assert_eq!(counts, [1, 0], "while the file is written, and at the end of the program");
        fs::remove_dir_all(&folder).unwrap();
    }
}
