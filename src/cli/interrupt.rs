//! Signals of the system: the robot is stopped before the program ends or is suspended.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;

use super::output::Failure;

/// Longest time that the end or the suspension of the program waits for motors to confirm that they are off.
const MOTORS_OFF_LAST: Duration = Duration::from_secs(2);
/// Time in which the recording of a stop gets onto the disk.
const RECORDED: Duration = Duration::from_millis(100);
/// Pause between two looks at something that another thread does.
const LOOK: Duration = Duration::from_millis(1);

/// Whether the program is to end.
#[derive(Clone, Default)]
pub(super) struct Interrupt(Arc<Noted>);

#[derive(Default)]
struct Noted {
    came: AtomicBool,
    /// Number of the first signal; 0 where none came.
    signal: AtomicI32,
    /// Whether the program is about to be suspended, or was and has not gone on yet.
    suspends: AtomicBool,
}

/// What the program does while it watches for signals.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Duty {
    /// Watches a robot, and ends at a signal as soon as it can.
    Monitor,
    /// Drives a robot, which every signal stops; then the command ends.
    Drive,
    /// Shows the window: a signal stops the robot and ends the program.
    Window,
}

impl Interrupt {
    /// Watches for signals from now on. A second one ends the program once no motor is on, whatever it is doing.
    pub(super) fn watch(duty: Duty) -> Result<Self, Failure> {
        let interrupt = Self::default();
        system::watch(duty, interrupt.clone()).map_err(|error| {
            Failure::Message(format!("cannot watch for Ctrl+C and other signals: {error}"))
        })?;
        Ok(interrupt)
    }

    /// Notes that a signal came, unless one has come before; returns whether this is the first.
    pub(super) fn raise(&self, signal: i32) -> bool {
        let first = self.0.signal.compare_exchange(0, signal, Ordering::AcqRel, Ordering::Acquire).is_ok();
        self.0.came.store(true, Ordering::Release);
        first
    }

    /// Whether one came.
    pub(super) fn came(&self) -> bool {
        self.0.came.load(Ordering::Acquire)
    }

    /// Name of the signal that came first.
    pub(super) fn signal(&self) -> Option<&'static str> {
        Some(self.0.signal.load(Ordering::Acquire)).filter(|signal| *signal != 0).map(system::name)
    }

    /// Waits until a suspension that was requested is over.
    pub(super) fn wait_for_suspension(&self) {
        while self.0.suspends.load(Ordering::Acquire) {
            std::thread::sleep(LOOK);
        }
    }
}

/// Stops every robot, and waits for motors that answer.
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

#[cfg(unix)]
mod system {
    use std::io;
    use std::sync::atomic::Ordering;
    use std::thread::Builder;

    use signal_hook::consts::signal::{
        SIGALRM, SIGHUP, SIGINT, SIGPROF, SIGQUIT, SIGTERM, SIGTSTP, SIGTTIN, SIGTTOU, SIGUSR1, SIGUSR2,
        SIGVTALRM, SIGXCPU, SIGXFSZ,
    };
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::{emulate_default_handler, signal_name};

    use super::{Duty, Interrupt, stop_robots};

    /// Signals that would suspend the program.
    const SUSPEND: [i32; 3] = [SIGTSTP, SIGTTIN, SIGTTOU];
    /// Signals by which it is asked to end.
    const END: [i32; 4] = [SIGINT, SIGTERM, SIGHUP, SIGQUIT];
    /// Further signals that would end it at once.
    const KILL: [i32; 7] = [SIGUSR1, SIGUSR2, SIGXFSZ, SIGXCPU, SIGALRM, SIGVTALRM, SIGPROF];

    pub(super) fn watch(duty: Duty, interrupt: Interrupt) -> io::Result<()> {
        // A monitor may be suspended at any time. A file that has grown to its limit ends its recording, not itself.
        let kinds =
            if duty == Duty::Monitor { vec![&END[..], &[SIGXFSZ]] } else { vec![&SUSPEND[..], &END, &KILL] };
        let mut signals = Signals::new(kinds.concat())?;
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
            stop_robots();
            emulate(signal);
        }
    }

    /// What the system does where nobody watches for the signal. Nothing is to be done where that fails.
    fn emulate(signal: i32) {
        emulate_default_handler(signal).unwrap_or(());
    }

    pub(super) fn name(signal: i32) -> &'static str {
        signal_name(signal).unwrap_or("signal")
    }
}

#[cfg(not(unix))]
mod system {
    use super::{Duty, Interrupt, stop_robots};

    pub(super) fn watch(duty: Duty, interrupt: Interrupt) -> Result<(), ctrlc::Error> {
        ctrlc::set_handler(move || {
            if interrupt.raise(1) && duty != Duty::Window {
                flqr_core::device::stop_all();
            } else {
                stop_robots();
                std::process::exit(1);
            }
        })
    }

    pub(super) fn name(_: i32) -> &'static str {
        "Ctrl+C"
    }
}
