//! The last hours of the live robot, ready for plotting.

use flqr_core::record::Sample;

use crate::plot::{CHUNK, TimeColumn, ValueColumn};

/// Samples that plots can reach, two hours at 1 kHz: about 0.7 GB with the pyramids.
pub(crate) const HISTORY_SAMPLES: usize = 7_200_000;
/// Duration, s.
pub(crate) const HISTORY_S: f64 = 7200.0;

/// The recorded quantities, in the order of [`Sample::COLUMNS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Displacement,
    Velocity,
    Pitch,
    PitchRate,
    LeftAngle,
    RightAngle,
    LeftSpeed,
    RightSpeed,
    LeftTorque,
    RightTorque,
}

impl Channel {
    /// Those of a robot's state, which are what the controller sees.
    pub(crate) const STATE: [Self; 3] = [Self::Displacement, Self::Velocity, Self::Pitch];

    pub(crate) const ALL: [Self; 10] = [
        Self::Displacement,
        Self::Velocity,
        Self::Pitch,
        Self::PitchRate,
        Self::LeftAngle,
        Self::RightAngle,
        Self::LeftSpeed,
        Self::RightSpeed,
        Self::LeftTorque,
        Self::RightTorque,
    ];

    /// Name of the column in a log.
    pub(crate) fn key(self) -> &'static str {
        Sample::COLUMNS[1 + self as usize]
    }
}

/// Columns of time and of the recorded quantities. The oldest samples are dropped once the history is full.
#[derive(Default)]
pub(crate) struct History {
    time_s: TimeColumn,
    channels: [ValueColumn; 10],
    generation: u64,
    skipped: u64,
    dropped: u64,
}

impl History {
    /// Appends samples. Those whose time runs back or is no number are left out: no plot has a place for them.
    pub(crate) fn extend(&mut self, samples: &[Sample]) {
        for sample in samples {
            let last = self.time_s.last().unwrap_or(f64::NEG_INFINITY);
            if !sample.time_s.is_finite() || sample.time_s < last {
                self.skipped += 1;
                continue;
            }
            let [time_s, values @ ..] = sample.to_row();
            self.time_s.push(time_s);
            for (column, value) in self.channels.iter_mut().zip(values) {
                column.push(value);
            }
        }
        while self.time_s.len() > HISTORY_SAMPLES {
            self.time_s.drop_chunk();
            self.channels.iter_mut().for_each(ValueColumn::drop_chunk);
            self.dropped += CHUNK as u64;
        }
        self.generation += 1;
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        let generation = self.generation + 1;
        *self = Self { generation, ..Self::default() };
    }

    /// Samples that were left out.
    pub(crate) fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Samples that were dropped because the history was full.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Changes whenever the data do.
    pub(crate) fn generation(&self) -> u64 {
        self.generation
    }

    pub(crate) fn time_s(&self) -> &TimeColumn {
        &self.time_s
    }

    pub(crate) fn channel(&self, channel: Channel) -> &ValueColumn {
        &self.channels[channel as usize]
    }

    /// The newest sample of a channel.
    pub(crate) fn last(&self, channel: Channel) -> Option<f64> {
        self.channel(channel).last()
    }

    /// Time of the oldest sample, s; 0 when there is none.
    pub(crate) fn start_s(&self) -> f64 {
        self.time_s.first().unwrap_or(0.0)
    }

    /// Time of the newest sample, s; 0 when there is none.
    pub(crate) fn end_s(&self) -> f64 {
        self.time_s.last().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(time_s: f64) -> Sample {
        Sample::from_row(std::array::from_fn(|column| if column == 0 { time_s } else { column as f64 }))
    }

    #[test]
    fn channels_are_the_columns_of_a_log_and_odd_times_are_left_out() {
        let mut history = History::default();
        history.extend(&[0.0, 0.001, f64::NAN, 0.0005, 0.002].map(sample));
        assert_eq!((history.time_s().len(), history.skipped(), history.end_s()), (3, 2, 0.002));
        for channel in Channel::ALL {
            let column = Sample::COLUMNS.iter().position(|name| *name == channel.key()).unwrap();
            assert_eq!(history.last(channel), Some(column as f64), "{}", channel.key());
        }
        history.clear();
        assert_eq!((history.time_s().len(), history.skipped()), (0, 0));
    }

    #[test]
    fn an_hour_at_1_khz_keeps_to_its_memory() {
        let mut column = ValueColumn::default();
        (0..3_600_000).for_each(|index| column.push(f64::from(index)));
        let megabytes = 12 * column.bytes() / 1_000_000;
        assert!(megabytes <= 600, "12 channels take {megabytes} MB");
    }
}
