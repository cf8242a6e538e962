//! Curves of recordings, read from their files when they are to be drawn.

use std::path::Path;

use flqr_core::record::{ColumnMap, Log, Sample};

use super::run::{Channel, Run, Series};
use crate::history;
use crate::job::{Job, Outcome, Waker};
use crate::load::{LoadProgress, load};
use crate::quantity::Quantity;

/// A row whose curves are being read.
pub(super) struct Reading {
    pub(super) row: Run,
    job: Job<LoadProgress, Result<Series, String>>,
}

impl Reading {
    /// Starts to read `file` for `row`.
    pub(super) fn start(row: &Run, file: &Path, waker: &Waker) -> Result<Self, String> {
        let file = file.to_owned();
        let read = move |reporter: &crate::job::Reporter<LoadProgress>| {
            let loaded = load(&file, &ColumnMap::default(), 0, reporter)?;
            series(&loaded.log)
        };
        let job = Job::start("read-curves", waker, read)
            .map_err(|error| format!("Cannot start reading the recording: {error}."))?;
        Ok(Self { row: row.clone(), job })
    }

    /// The curves once they are read, or why they are not.
    pub(super) fn drain(&mut self) -> Option<Result<Series, String>> {
        match self.job.poll().1 {
            Outcome::Running => None,
            Outcome::Done(result) => Some(result),
            Outcome::Broken => Some(Err("Reading the curves failed: this is an internal error".to_owned())),
        }
    }
}

/// The columns of a robot log that a simulated run has too, under the same names.
fn series(log: &Log) -> Result<Series, String> {
    let unread = || format!("{} has no time_s: it has no curves to draw", log.source);
    let time_s = log.column(Sample::COLUMNS[0]).ok_or_else(unread)?.to_vec();
    let channel = |channel: history::Channel| {
        let Quantity { name, unit, .. } = Quantity::of(channel, false);
        Some(Channel { name, unit, values: log.column(channel.key())?.to_vec() })
    };
    Ok(Series { time_s, channels: history::Channel::ALL.into_iter().filter_map(channel).collect() })
}

#[cfg(test)]
mod tests {
    use flqr_core::record::Column;

    use super::*;

    #[test]
    fn curves_of_a_recording_have_the_names_of_a_simulated_run() {
        let column = |name: &str, values: [f64; 2]| Column { name: name.to_owned(), values: values.into() };
        let mut log = Log::default();
        assert!(series(&log).unwrap_err().contains("no time_s"));
        log.columns = vec![
            column("torque_left_nm", [0.5, 0.6]),
            column("time_s", [0.0, 0.01]),
            column("x_m", [1.0, 2.0]),
            column("remark", [0.0, 0.0]),
        ];
        let found = series(&log).unwrap();
        assert_eq!(found.time_s, [0.0, 0.01]);
        let channels: Vec<_> =
            found.channels.iter().map(|channel| (channel.name, channel.unit, channel.values[1])).collect();
        assert_eq!(channels, [("displacement", "m", 2.0), ("left torque", "N m", 0.6)]);
    }
}
