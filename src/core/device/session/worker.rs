//! The control loop's thread: everything that was heard goes in, everything that is sent or shown comes out.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use super::hearing::Hearing;
use super::link::{Heard, Link};
use super::publisher::Publisher;
use super::tally::Tally;
use super::types::{Connection, DriveStatus, Event, EventKind, SessionOrder, Status, Timing};
use crate::control::drive::{Drive, DriveEvent, DriveOrder, Inputs, Listener, Output, Stage};
use crate::device::{Pacer, Recorder, RecorderInput};
use crate::link::{Direction, MotorOrder, StampedFrame};
use crate::record::Sample;
use crate::record::recording::{About, Row};

/// Period of the control loop.
pub(super) const TICK: Duration = Duration::from_millis(1);
/// Silence after which something is said of it.
const SILENT: Duration = Duration::from_secs(1);
/// Longest time for which the motors are told to switch off when a session ends.
const FAREWELL: Duration = Duration::from_millis(300);

/// What the samples are made by.
pub(super) enum Role {
    Listen(Box<Listener>),
    Drive(Box<Drive>),
}

/// The running session.
pub(super) struct Worker {
    pub(super) link: Link,
    pub(super) role: Role,
    pub(super) hearing: Hearing,
    pub(super) heard: Heard,
    pub(super) pacer: Pacer,
    pub(super) tally: Tally,
    pub(super) recording: Recording,
    pub(super) orders: Receiver<SessionOrder>,
    pub(super) drive_orders: Vec<DriveOrder>,
    pub(super) publisher: Publisher,
}

/// The recording, if one is made.
pub(super) struct Recording {
    pub(super) recorder: Option<Recorder>,
    pub(super) input: Option<RecorderInput>,
    pub(super) about: About,
    /// Whether bench logs belong to it.
    pub(super) bench: bool,
}

impl Recording {
    pub(super) fn start(&mut self, name: &Path) -> Result<(), String> {
        if self.recorder.is_some() {
            return Err("a recording is being made already: end it first".to_owned());
        }
        let recorder = Recorder::start(name, &self.about, self.bench).map_err(|error| error.to_string())?;
        self.input = Some(recorder.input());
        self.recorder = Some(recorder);
        Ok(())
    }

    /// Whether rows and frames would soon be lost.
    pub(super) fn is_behind(&self) -> bool {
        self.input.as_ref().is_some_and(|input| !input.has_room())
    }

    pub(super) fn end(&mut self) -> Option<String> {
        self.input = None;
        let status = self.recorder.take()?.finish();
        Some(status.problem.unwrap_or_else(|| {
            format!(
                "{}: {} rows and {} frames were recorded",
                status.file.display(),
                status.rows,
                status.frames
            )
        }))
    }
}

impl Worker {
    /// Until the session's handle is dropped.
    pub(super) fn work(mut self) {
        loop {
            let tick = self.pacer.wait();
            if self.take_orders(tick.due).is_break() {
                break;
            }
            let now = tick.due + tick.late;
            self.tally.tick(&tick);
            self.tick(now, tick.late);
            if self.publisher.is_due(tick.due) {
                self.publish(now);
            }
        }
        self.farewell();
        self.recording.end();
    }

    pub(super) fn take_orders(&mut self, now: Duration) -> ControlFlow<()> {
        loop {
            match self.orders.try_recv() {
                Ok(SessionOrder::Drive(order)) => self.drive_orders.push(order),
                Ok(SessionOrder::Record(name)) => self.record(now, name.as_deref()),
                Ok(SessionOrder::Interval(interval)) => self.publisher.interval = interval,
                Ok(order) => self.link.order(&order),
                Err(TryRecvError::Empty) => return ControlFlow::Continue(()),
                Err(TryRecvError::Disconnected) => return ControlFlow::Break(()),
            }
        }
    }

    fn record(&mut self, now: Duration, name: Option<&Path>) {
        match name {
            Some(name) => {
                if let Err(problem) = self.recording.start(name) {
                    self.note(now, EventKind::Warning, problem);
                }
            }
            None => {
                if let Some(text) = self.recording.end() {
                    self.note(now, EventKind::Note, text);
                }
            }
        }
    }

    /// One period of the control loop.
    fn tick(&mut self, now: Duration, late: Duration) {
        self.link.collect(now, &mut self.heard);
        self.tally.lost(self.heard.inbox.lost);
        self.hearing.clear();
        if matches!(self.role, Role::Listen(_)) {
            self.listen(now);
        } else {
            self.drive(now, late);
        }
    }

    /// Takes what was heard in slices of a millisecond, so that every one of them makes a sample however late
    /// this thread comes.
    fn listen(&mut self, now: Duration) {
        self.drive_orders.clear();
        let inbox = std::mem::take(&mut self.heard.inbox);
        let mut imu = inbox.imu.iter().peekable();
        let mut slice_end = None;
        for frame in &inbox.frames {
            while let Some((time, bytes)) = imu.next_if(|(time, _)| *time <= frame.time) {
                self.slice(&mut slice_end, *time);
                self.hear_imu(*time, bytes);
            }
            self.slice(&mut slice_end, frame.time);
            self.hear_frame(frame);
        }
        for (time, bytes) in imu {
            self.slice(&mut slice_end, *time);
            self.hear_imu(*time, bytes);
        }
        self.sample(now);
        self.heard.inbox = inbox;
    }

    /// Ends the slice that is over at `time`, and begins one where there is none.
    pub(super) fn slice(&mut self, end: &mut Option<Duration>, time: Duration) {
        if let Some(over) = end.take_if(|end| *end <= time) {
            self.sample(over);
        }
        end.get_or_insert(time + TICK);
    }

    /// The sample of what has been heard by `now`.
    pub(super) fn sample(&mut self, now: Duration) {
        let Role::Listen(listener) = &mut self.role else { return };
        let sample = listener.hear(now, &self.hearing.motors, &self.hearing.imu);
        self.hearing.clear();
        if let Some(sample) = sample {
            self.keep(sample);
        }
    }

    pub(super) fn hear_frame(&mut self, frame: &StampedFrame) {
        self.hearing.frame(frame, &mut self.tally, self.recording.input.as_ref());
        self.publisher.frame(*frame);
    }

    pub(super) fn hear_imu(&mut self, time: Duration, bytes: &[u8]) {
        self.hearing.imu_bytes(time, bytes, &mut self.tally, self.recording.input.as_ref());
    }

    fn keep(&mut self, sample: Sample) {
        let row = self.tally.row(&sample);
        self.keep_row(&row);
    }

    pub(super) fn keep_row(&mut self, row: &Row) {
        if let Some(recorder) = &self.recording.input {
            recorder.row(row);
        }
        self.publisher.samples.push(row.sample);
    }

    fn drive(&mut self, now: Duration, late: Duration) {
        let inbox = std::mem::take(&mut self.heard.inbox);
        inbox.frames.iter().for_each(|frame| self.hear_frame(frame));
        inbox.imu.iter().for_each(|(time, bytes)| self.hear_imu(*time, bytes));
        self.heard.inbox = inbox;
        let bus_down = self.link.problem().is_some();
        let Role::Drive(drive) = &mut self.role else { return };
        let inputs = Inputs {
            motors: &self.hearing.motors,
            imu: &self.hearing.imu,
            orders: &self.drive_orders,
            bus_down,
            late,
        };
        let output = drive.step(now, &inputs);
        let driving = drive.stage() == Stage::Driving;
        self.drive_orders.clear();
        self.obey(now, &output, driving);
    }

    fn obey(&mut self, now: Duration, output: &Output, driving: bool) {
        let told = self.link.note_driving(driving);
        for order in output.orders.iter() {
            self.send(now, order);
        }
        // Without the sending thread's watch nobody would switch off after this one.
        if !told && driving {
            self.drive_orders.push(DriveOrder::Stop);
        }
        if let Some(sample) = output.sample {
            self.keep(sample);
        }
        if let (Some(bench), Some(recorder)) = (&output.bench, &self.recording.input) {
            recorder.bench(bench);
        }
        for event in &output.events {
            let kind = match event {
                DriveEvent::Stage(Stage::Stopped(_)) => EventKind::Stop,
                DriveEvent::Stage(_) | DriveEvent::Note(_) => EventKind::Note,
                DriveEvent::Warning(_) => EventKind::Warning,
            };
            self.note(now, kind, event.to_string());
        }
    }

    fn send(&mut self, now: Duration, order: &MotorOrder) {
        for frame in self.hearing.wheels.frames(order) {
            if !self.link.send(now, frame) {
                continue;
            }
            let sent = StampedFrame { time: now, direction: Direction::Sent, frame };
            self.hear_frame(&sent);
        }
        if matches!(order, MotorOrder::Torque(_) | MotorOrder::ReadState) {
            self.tally.asked();
        }
    }

    pub(super) fn note(&mut self, time: Duration, kind: EventKind, text: String) {
        let event = Event { time, kind, text };
        if let Some(recorder) = &self.recording.input {
            recorder.event(&event);
        }
        self.publisher.events.push(event);
    }

    fn publish(&mut self, now: Duration) {
        let status = self.status(now);
        let lost = self.publisher.publish(status);
        self.tally.lost(lost);
    }

    /// How everything stands.
    pub(super) fn status(&mut self, now: Duration) -> Status {
        let [dropped, errors, reconnects] = self.link.losses();
        self.tally.bus(dropped, errors, reconnects);
        Status {
            time: now,
            connection: self.connection(now),
            drive: match &self.role {
                Role::Listen(_) => None,
                Role::Drive(drive) => {
                    Some(DriveStatus { stage: drive.stage(), checks: drive.checks().to_vec() })
                }
            },
            motors: self.tally.motor_status(now),
            imu: self.tally.imu_status(now),
            counters: self.tally.counters(now, self.recording.recorder.as_ref().map_or(0, Recorder::lost)),
            timing: self.timing(),
            recording: self.recording.recorder.as_ref().map(Recorder::status),
        }
    }

    /// Of the control loop, which a recording has not.
    fn timing(&self) -> Timing {
        if matches!(self.link, Link::Replay(_)) { Timing::default() } else { self.pacer.timing() }
    }

    fn connection(&self, now: Duration) -> Connection {
        if let Link::Replay(player) = &self.link {
            return player.connection();
        }
        if let Some(reason) = self.link.problem() {
            return Connection::Lost { reason };
        }
        let heard = self.tally.heard().unwrap_or_default();
        if now < heard + SILENT { Connection::Connected } else { Connection::Silent { hint: self.hint() } }
    }

    fn hint(&self) -> String {
        if let Some(hint) = self.link.hint() {
            return hint;
        }
        match self.hearing.ids() {
            Some(ids) => format!(
                "frames of {ids} are heard, but {}",
                self.hearing.wanted()
            ),
            None => "nothing is heard: motors answer only when they are asked, by the robot's own controller or while \
                     checking; check supply, wiring, termination and bit rate"
                .to_owned(),
        }
    }

    /// Stops the motors before the link is closed.
    fn farewell(&mut self) {
        let Role::Drive(drive) = &self.role else { return };
        if matches!(drive.stage(), Stage::Listening) {
            return;
        }
        self.drive_orders.push(DriveOrder::Stop);
        let ticks = (FAREWELL.as_nanos() / TICK.as_nanos()) as u64;
        for _ in 0..ticks {
            let tick = self.pacer.wait();
            let now = tick.due + tick.late;
            self.tick(now, Duration::ZERO);
            if let Role::Drive(drive) = &self.role
                && drive.has_ended()
            {
                break;
            }
        }
    }
}
