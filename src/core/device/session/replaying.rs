//! The session of a recording: what it holds goes the way of live data, at any speed.

use std::time::Duration;

use super::link::Link;
use super::player::Player;
use super::types::{Ending, EventKind};
use super::worker::Worker;
use crate::record::{LogError, ReplayCounts, ReplayItem};

/// Items between two looks at orders, updates and the recorder's queue.
const MOST_ITEMS: usize = 4096;
/// Samples in one update.
const MOST_SAMPLES: usize = 8192;

impl Worker {
    /// Until the session's handle is dropped. Nothing is lost on the way: where nobody takes the updates, or the
    /// recorder cannot keep up, the replay waits.
    pub(super) fn replay(mut self) -> Ending {
        let mut slice_end = None;
        let mut told = Vec::new();
        loop {
            let behind = self.recording.is_behind();
            let held = self.publisher.is_held() || behind;
            if held || !self.player().is_some_and(|player| player.hurries()) {
                self.pacer.wait();
            }
            let position = self.position();
            if self.take_orders(position).is_break() {
                break;
            }
            let had_ended = self.has_ended();
            if let Some(player) = self.player() {
                player.advance(held);
            }
            if !held {
                self.play(&mut slice_end);
                self.tell_problems(&mut told);
            }
            let ends = self.has_ended() && !had_ended;
            if ends {
                self.tell_end();
            }
            let many = self.publisher.samples.len() >= MOST_SAMPLES;
            let due = self.publisher.is_due(self.pacer.now());
            let hurries = !behind && self.player().is_some_and(|player| player.hurries());
            if due || many || ends || hurries {
                self.offer();
            }
        }
        self.end()
    }

    fn player(&mut self) -> Option<&mut Player> {
        if let Link::Replay(player) = &mut self.link { Some(player) } else { None }
    }

    fn position(&mut self) -> Duration {
        self.player().map_or(Duration::ZERO, |player| player.position())
    }

    fn has_ended(&mut self) -> bool {
        self.player().is_none_or(|player| player.has_ended())
    }

    /// Plays what is due. Where the recording has no rows, they are made of the frames in slices of a millisecond of
    /// its own time, so that they are the same at every speed.
    fn play(&mut self, slice_end: &mut Option<Duration>) {
        for _ in 0..MOST_ITEMS {
            match self.player().map_or(Ok(None), Player::next_item) {
                Ok(Some((time, item))) => self.play_item(slice_end, time, item),
                Ok(None) => {
                    let (position, ended) = (self.position(), self.has_ended());
                    if let Some(over) = slice_end.take_if(|end| *end <= position || ended) {
                        self.sample(over);
                    }
                    return;
                }
                Err(error) => self.tell_failure(&error),
            }
        }
        if let Some(player) = self.player() {
            player.fall_behind();
        }
    }

    fn play_item(&mut self, slice_end: &mut Option<Duration>, time: Duration, item: ReplayItem) {
        if matches!(item, ReplayItem::Frame(_) | ReplayItem::ImuPacket(_)) {
            if self.player().is_some_and(|player| player.has_rows()) {
                self.decoder.clear();
            } else {
                self.slice(slice_end, time);
            }
        }
        match item {
            ReplayItem::Row(row) => {
                self.counted.replayed(&row);
                self.keep_row(&row);
            }
            ReplayItem::Frame(frame) => self.hear_frame(&frame),
            ReplayItem::ImuPacket(packet) => self.hear_imu(time, &packet.encode()),
            ReplayItem::Event(text) => {
                let (sort, what) = text.split_once(": ").unwrap_or(("note", &text));
                let kind = EventKind::named(sort);
                let what = if kind.is_some() { what } else { &text };
                self.note(time, kind.unwrap_or(EventKind::Note), what.to_owned());
            }
        }
    }

    /// The first damage of each file, when it is met.
    fn tell_problems(&mut self, told: &mut Vec<String>) {
        let Some(player) = self.player() else { return };
        let new: Vec<String> = player.problems().filter(|problem| !told.contains(problem)).collect();
        for problem in new {
            let now = self.position();
            self.note(now, EventKind::Warning, problem.clone());
            told.push(problem);
        }
    }

    fn tell_failure(&mut self, error: &LogError) {
        let now = self.position();
        self.note(now, EventKind::Warning, error.to_string());
    }

    fn tell_end(&mut self) {
        let Some(ReplayCounts { rows, frames, damaged }) = self.player().map(|player| player.counts()) else {
            return;
        };
        let mut text = format!("end of the recording: {rows} rows and {frames} frames");
        if damaged > 0 {
            text += &format!(", {damaged} damaged lines were skipped");
        }
        let now = self.position();
        self.note(now, EventKind::Note, text);
    }

    fn offer(&mut self) {
        let now = self.position();
        self.poll_recording(now);
        let status = self.status(now);
        self.publisher.offer(status);
    }
}
