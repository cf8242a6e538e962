//! Frame times of the window, for scripts.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time window of the longest frame.
const MEMORY: Duration = Duration::from_secs(10);

/// Number and times of the frames that were drawn.
#[derive(Default)]
pub(crate) struct Frames {
    drawn: u64,
    /// When and how long, each longer than all later ones.
    longest: VecDeque<(Instant, f32)>,
}

impl Frames {
    /// Takes note of a frame that took `seconds`, where that is known.
    pub(crate) fn note(&mut self, now: Instant, seconds: Option<f32>) {
        self.drawn += 1;
        let Some(seconds) = seconds else { return };
        while self.longest.back().is_some_and(|(_, other)| *other <= seconds) {
            self.longest.pop_back();
        }
        self.longest.push_back((now, seconds));
        while self.longest.front().is_some_and(|(at, _)| now.duration_since(*at) > MEMORY) {
            self.longest.pop_front();
        }
    }

    /// Number of frames and the longest of the last ten seconds.
    pub(crate) fn to_value(&self) -> serde_json::Value {
        let longest = self.longest.front().map(|(_, seconds)| (1e4 * seconds).round() / 10.0);
        serde_json::json!({ "drawn": self.drawn, "longest_ms": longest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_frame_is_forgotten_in_time() {
        let (start, mut frames) = (Instant::now(), Frames::default());
        for (at, milliseconds, longest) in
            [(0, 3.0, 3.0), (1, 9.0, 9.0), (2, 4.0, 9.0), (11, 1.0, 9.0), (12, 2.0, 4.0)]
        {
            frames.note(start + Duration::from_secs(at), Some(1e-3 * milliseconds));
            assert_eq!(frames.to_value()["longest_ms"], longest, "after {at} s");
        }
        frames.note(start, None);
        assert_eq!(frames.to_value()["drawn"], 6);
    }
}
