//! The last minute of the live robot, ready for plotting.

use flqr_core::record::Sample;

/// Samples that plots can reach: 60 s at 1 kHz.
pub(crate) const HISTORY_SAMPLES: usize = 60_000;
/// The same as a duration, s.
pub(crate) const HISTORY_S: f64 = 60.0;

/// The plotted quantities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Displacement,
    Velocity,
    Pitch,
}

impl Channel {
    pub(crate) const ALL: [Self; 3] = [Self::Displacement, Self::Velocity, Self::Pitch];
}

/// Columns of time and the plotted quantities. Each column is one slice, so that plots need no copy; the
/// oldest half is dropped when twice the history is held, so that appending stays cheap.
#[derive(Default)]
pub(crate) struct History {
    time_s: Vec<f64>,
    channels: [Vec<f64>; 3],
    generation: u64,
    skipped: u64,
}

impl History {
    /// Appends samples. Those whose time runs back or is no number are left out: no plot has a place for them.
    pub(crate) fn extend(&mut self, samples: &[Sample]) {
        for sample in samples {
            let last = self.time_s.last().copied().unwrap_or(f64::NEG_INFINITY);
            if !sample.time_s.is_finite() || sample.time_s < last {
                self.skipped += 1;
                continue;
            }
            self.time_s.push(sample.time_s);
            for (column, value) in
                self.channels.iter_mut().zip([sample.x_m, sample.x_dot_m_s, sample.pitch_rad])
            {
                column.push(value);
            }
        }
        if self.time_s.len() > 2 * HISTORY_SAMPLES {
            let surplus = self.time_s.len() - HISTORY_SAMPLES;
            self.time_s.drain(..surplus);
            for column in &mut self.channels {
                column.drain(..surplus);
            }
        }
        self.generation += 1;
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.time_s.clear();
        for column in &mut self.channels {
            column.clear();
        }
        self.skipped = 0;
        self.generation += 1;
    }

    /// Samples that were left out.
    pub(crate) fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Changes whenever the data do.
    pub(crate) fn generation(&self) -> u64 {
        self.generation
    }

    pub(crate) fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    pub(crate) fn channel(&self, channel: Channel) -> &[f64] {
        &self.channels[channel as usize]
    }

    /// The newest sample of a channel.
    pub(crate) fn last(&self, channel: Channel) -> Option<f64> {
        self.channel(channel).last().copied()
    }

    /// Time of the newest sample, s; 0 when there is none.
    pub(crate) fn end_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }
}
