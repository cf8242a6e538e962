//! Reports of skipped tests.

use std::io::{Write, stderr};
use std::thread;

/// Reports that the test of this thread is skipped, and how to run it. Written past the test harness, which hides the
/// output of tests that pass.
pub(crate) fn report_skipped(how_to_run: &str) {
    let thread = thread::current();
    let _closed = writeln!(stderr(), "skipped: {}: {how_to_run}", thread.name().unwrap_or("a test"));
}
