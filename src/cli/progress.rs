//! Progress bar on standard error for work longer than a second.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows no bar.
const QUIET: Duration = Duration::from_secs(1);

/// A bar that appears only once the work has taken a second, and only on a terminal.
pub(crate) struct Progress {
    started: Instant,
    bar: ProgressBar,
    label: String,
}

impl Progress {
    /// Creates a bar that is not shown yet.
    pub(crate) fn new(label: impl Into<String>) -> Self {
        let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::hidden());
        Self { started: Instant::now(), bar, label: label.into() }
    }

    /// Sets the completed fraction.
    pub(crate) fn set_share(&self, share: f64) {
        self.set((1000.0 * share) as u64, 1000);
    }

    /// Sets the progress to `done` of `total` units.
    pub(crate) fn set(&self, done: u64, total: u64) {
        if self.bar.is_hidden() && self.started.elapsed() > QUIET {
            let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            self.bar.set_style(style);
            self.bar.set_message(self.label.clone());
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_length(total);
        self.bar.set_position(done);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
