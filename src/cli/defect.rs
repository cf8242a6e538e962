//! Handling of internal errors.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::{self, Write};
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use super::error_keys::{self, ErrorKeys};
use super::output::complain;

/// Exit code of an internal error, `EX_SOFTWARE` of `sysexits.h`.
pub(super) const EXIT_CODE: u8 = 70;

/// Last message, so that several threads do not report the same error.
static SAID: Mutex<String> = Mutex::new(String::new());

/// Runs the program. A panic ends it with one sentence and exit code 70; destructors run, so that motors are switched
/// off and temporary files removed.
pub(crate) fn guard(run: impl FnOnce() -> ExitCode) -> ExitCode {
    panic::set_hook(Box::new(report));
    panic::catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| {
        if error_keys::wanted() {
            let said = SAID.lock().unwrap_or_else(PoisonError::into_inner).clone();
            ErrorKeys::new("defect", &said).print();
        }
        ExitCode::from(EXIT_CODE)
    })
}

fn report(panic: &PanicHookInfo) {
    let place =
        panic.location().map_or(String::new(), |place| format!(" ({}:{})", place.file(), place.line()));
    let what = panic.payload_as_str().unwrap_or("no reason given");
    let sentence = format!("internal error{place}: {what}: report it with the command and its files");
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if *said != sentence {
        complain(&sentence);
        *said = sentence;
    }
    let backtrace = Backtrace::capture();
    if backtrace.status() == BacktraceStatus::Captured {
        writeln!(io::stderr().lock(), "{backtrace}").unwrap_or(());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_one_sentence_and_exit_code_70() {
        let code = guard(|| panic!("row {} of 3", 7));
        drop(panic::take_hook());
        assert_eq!(format!("{code:?}"), format!("{:?}", ExitCode::from(70)));
        let said = SAID.lock().unwrap().clone();
        assert!(said.starts_with("internal error (src/cli/defect.rs:"), "{said}");
        assert!(said.ends_with("row 7 of 3: report it with the command and its files"), "{said}");
    }
}
