//! The control loop's thread: everything that was received goes in, everything that is sent or shown comes out.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use super::counters::LinkCounters;
use super::decode::FrameDecoder;
use super::link::{Heard, Link};
use super::publisher::Publisher;
use super::recording::Recording;
use super::types::{Connection, DriveStatus, Ending, Event, EventKind, SessionOrder, Status, Timing};
use crate::control::drive::{Drive, DriveEvent, DriveOrder, Inputs, Listener, Output, Stage, StopReason};
use crate::device::stop::StopLine;
use crate::device::{Pacer, Priority, Recorder};
use crate::link::{Direction, MotorEvent, MotorOrder, StampedFrame};
use crate::record::Sample;
use crate::record::recording::Row;

/// Period of the control loop.
pub(super) const TICK: Duration = Duration::from_millis(1);
/// Silence after which something is said of it.
const SILENT: Duration = Duration::from_secs(1);
/// Longest time for which the motors are told to switch off when a session ends; an adapter that was lost needs some to
/// come back.
const FAREWELL: Duration = Duration::from_secs(2);

/// Lateness from which on this computer, and not the robot, is taken for the cause of a silence: half of the time
/// that a motor may be silent.
const BUSY: Duration = Duration::from_millis(10);

/// What the samples are made by.
pub(super) enum Role {
    Listen(Box<Listener>),
    Drive(Box<Drive>),
}

/// The running session.
pub(super) struct Worker {
    pub(super) link: Link,
    pub(super) role: Role,
    pub(super) decoder: FrameDecoder,
    pub(super) heard: Heard,
    pub(super) pacer: Pacer,
    pub(super) counted: LinkCounters,
    pub(super) recording: Recording,
    pub(super) orders: Receiver<SessionOrder>,
    pub(super) stop_line: Arc<StopLine>,
    pub(super) drive_orders: Vec<DriveOrder>,
    pub(super) publisher: Publisher,
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.link.finish_sending();
        self.stop_line.end();
    }
}

impl Worker {
    /// Until the session's handle is dropped.
    pub(super) fn work(mut self, priority: Priority) -> Ending {
        if let (Priority::Usual(reason), Role::Drive(_)) = (priority, &self.role) {
            self.note(self.pacer.now(), EventKind::Warning, reason);
        }
        loop {
            let tick = self.pacer.wait();
            if self.take_orders(tick.due).is_break() {
                break;
            }
            let now = tick.due + tick.late;
            self.counted.tick(&tick);
            self.tick(now, tick.late);
            if self.publisher.is_due(tick.due) {
                self.publish(now);
            }
        }
        self.farewell();
        // The last frames, which only then are known to have been sent.
        self.link.finish_sending();
        self.link.collect(self.pacer.now(), &mut self.heard);
        self.hear_all();
        self.end()
    }

    /// Completes the recording.
    pub(super) fn end(&mut self) -> Ending {
        let motors_off = match &self.role {
            Role::Listen(_) => true,
            Role::Drive(drive) => !is_hot(drive),
        };
        Ending { motors_off, recording: self.recording.end() }
    }

    pub(super) fn take_orders(&mut self, now: Duration) -> ControlFlow<()> {
        loop {
            match self.orders.try_recv() {
                Ok(SessionOrder::Drive(order)) => self.drive_orders.push(order),
                Ok(SessionOrder::Record(name)) => {
                    if let Err(problem) = self.recording.order(name) {
                        self.note(now, EventKind::Warning, problem);
                    }
                }
                Ok(SessionOrder::Interval(interval)) => self.publisher.interval = interval,
                Ok(order) => self.link.order(&order),
                Err(TryRecvError::Empty) => return ControlFlow::Continue(()),
                Err(TryRecvError::Disconnected) => return ControlFlow::Break(()),
            }
        }
    }

    /// One period of the control loop.
    fn tick(&mut self, now: Duration, late: Duration) {
        self.link.collect(now, &mut self.heard);
        self.counted.lost(self.heard.inbox.lost);
        self.decoder.clear();
        if matches!(self.role, Role::Listen(_)) {
            self.listen(now);
        } else {
            self.drive(now, late);
        }
    }

    /// Takes what was received in slices of a millisecond, so that every one of them makes a sample however late
    /// this thread comes.
    fn listen(&mut self, now: Duration) {
        self.drive_orders.clear();
        let inbox = std::mem::take(&mut self.heard.inbox);
        inbox.sent.iter().for_each(|frame| self.hear_sent(frame));
        let mut imu = inbox.imu.iter().peekable();
        let mut slice_end = None;
        for frame in &inbox.frames {
            while let Some((time, bytes)) = imu.next_if(|(time, _)| *time <= frame.time) {
                self.slice(&mut slice_end, time);
                self.hear_imu(time, bytes);
            }
            self.slice(&mut slice_end, frame.time);
            self.hear_frame(frame);
        }
        for (time, bytes) in imu {
            self.slice(&mut slice_end, time);
            self.hear_imu(time, bytes);
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

    /// The sample of what has been received by `now`.
    pub(super) fn sample(&mut self, now: Duration) {
        self.tell_lost_turns();
        let Role::Listen(listener) = &mut self.role else { return };
        let sample = listener.hear(now, &self.decoder.motors, &self.decoder.imu);
        self.decoder.clear();
        if let Some(sample) = sample {
            self.keep(sample);
        }
    }

    fn tell_lost_turns(&mut self) {
        for index in 0..self.decoder.motors.len() {
            if let MotorEvent::TurnsLost { motor, time, silent } = self.decoder.motors[index] {
                let silent_s = silent.as_secs_f64();
                let text = format!(
                    "the {motor} motor was silent for {silent_s:.2} s: its angle and the displacement continue from their last values"
                );
                self.note(time, EventKind::Warning, text);
            }
        }
    }

    pub(super) fn hear_frame(&mut self, frame: &StampedFrame) {
        self.decoder.frame(frame, &mut self.counted, self.recording.input.as_ref());
        self.publisher.frame(*frame);
    }

    pub(super) fn hear_imu(&mut self, time: Duration, bytes: &[u8]) {
        self.decoder.imu_bytes(time, bytes, &mut self.counted, self.recording.input.as_ref());
    }

    fn keep(&mut self, sample: Sample) {
        let row = self.counted.row(&sample);
        self.keep_row(&row);
    }

    pub(super) fn keep_row(&mut self, row: &Row) {
        if let Some(recorder) = &self.recording.input {
            recorder.row(row);
        }
        self.publisher.samples.push(row.sample);
    }

    /// A frame that was written to the bus.
    fn hear_sent(&mut self, frame: &StampedFrame) {
        self.decoder.written(frame);
        self.counted.frame(frame);
        if let Some(recorder) = &self.recording.input {
            recorder.frame(frame);
        }
        self.publisher.frame(*frame);
    }

    /// Takes all that was sent and received since the last tick; the commands first, for the replies are told by them.
    fn hear_all(&mut self) {
        let inbox = std::mem::take(&mut self.heard.inbox);
        inbox.sent.iter().for_each(|frame| self.hear_sent(frame));
        inbox.frames.iter().for_each(|frame| self.hear_frame(frame));
        inbox.imu.iter().for_each(|(time, bytes)| self.hear_imu(time, bytes));
        self.heard.inbox = inbox;
    }

    fn drive(&mut self, now: Duration, late: Duration) {
        self.hear_all();
        let stop = self.stop_line.pending();
        if stop.is_some() {
            self.drive_orders.insert(0, DriveOrder::Stop);
        }
        // A motor cannot answer a command that still waits for the sending thread.
        let late = late.max(self.link.backlog(now));
        self.counted.lateness(now, late);
        let bus_down = self.link.problem().is_some();
        let Role::Drive(drive) = &mut self.role else { return };
        let inputs = Inputs {
            motors: &self.decoder.motors,
            imu: &self.decoder.imu,
            orders: &self.drive_orders,
            bus_down,
            late,
        };
        let output = drive.step(now, &inputs);
        let hot = is_hot(drive);
        self.drive_orders.clear();
        self.link.set_hot(hot);
        self.obey(now, &output);
        self.stop_line.set_motors_on(hot);
        if let Some(stop) = stop {
            self.stop_line.obeyed(stop);
        }
    }

    fn obey(&mut self, now: Duration, output: &Output) {
        if output.events.iter().any(|event| matches!(event, DriveEvent::Stage(Stage::Stopped(_)))) {
            self.link.forget_waiting();
        }
        for order in output.orders.iter() {
            self.send(now, order);
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
            if let DriveEvent::Stage(Stage::Stopped(reason)) = event {
                self.explain_delay(now, reason);
            }
        }
    }

    /// Says of a stop for silence or lateness whether this program came late itself.
    fn explain_delay(&mut self, now: Duration, reason: &StopReason) {
        if !matches!(
            reason,
            StopReason::MotorSilent { .. } | StopReason::ImuSilent { .. } | StopReason::Late { .. }
        ) {
            return;
        }
        let greatest = self.counted.greatest_lateness(now);
        let greatest_ms = 1e3 * greatest.as_secs_f64();
        let whose = if greatest < BUSY {
            "the delay is not caused by this program: check the robot, its adapter and cables"
        } else {
            "this computer was too busy: close other programs"
        };
        let text = format!(
            "in the second before the stop, the control loop and the sending thread were at most {greatest_ms:.1} \
             ms late: {whose}"
        );
        self.note(now, EventKind::Note, text);
    }

    fn send(&mut self, now: Duration, order: &MotorOrder) {
        for frame in self.decoder.wheels.frames(order) {
            if self.link.send(now, frame) {
                // Before its reply is there, however late it is received that the frame was sent.
                self.decoder.sent(&StampedFrame { time: now, direction: Direction::Sent, frame });
            }
        }
        if matches!(order, MotorOrder::Torque(_) | MotorOrder::ReadState) {
            self.counted.asked();
        }
    }

    pub(super) fn note(&mut self, time: Duration, kind: EventKind, text: String) {
        let event = Event { time, kind, text };
        if let Some(recorder) = &self.recording.input {
            recorder.event(&event);
        }
        self.publisher.events.push(event);
    }

    /// Tells what has come of an order to begin or to end a recording.
    pub(super) fn poll_recording(&mut self, now: Duration) {
        if let Some((kind, text)) = self.recording.poll() {
            self.note(now, kind, text);
        }
    }

    fn publish(&mut self, now: Duration) {
        self.poll_recording(now);
        let [dropped, errors, reconnects] = self.link.losses();
        self.counted.bus(dropped, errors, reconnects);
        let connection = self.connection(now);
        let Self { role, counted, recording, pacer, publisher, .. } = self;
        let lost = publisher.publish(recording.input.clone(), |status| {
            status.time = now;
            status.connection = connection;
            if let Role::Drive(drive) = role {
                let (stage, motors_off) = (drive.stage(), drive.has_ended());
                let empty = || DriveStatus { stage, motors_off, checks: Vec::new() };
                let shown = status.drive.get_or_insert_with(empty);
                (shown.stage, shown.motors_off) = (stage, motors_off);
                // While the robot is driven they stay as they are, and need no new memory.
                if shown.checks != drive.checks() {
                    shown.checks = drive.checks().to_vec();
                }
            }
            status.motors = counted.motor_status(now);
            status.imu = counted.imu_status(now);
            status.counters = counted.counters(now, recording.recorder.as_ref().map_or(0, Recorder::lost));
            pacer.fill_timing(&mut status.timing);
        });
        self.counted.lost(lost);
    }

    /// How a replay stands.
    pub(super) fn status(&mut self, now: Duration) -> Status {
        let [dropped, errors, reconnects] = self.link.losses();
        self.counted.bus(dropped, errors, reconnects);
        Status {
            time: now,
            connection: self.connection(now),
            drive: None,
            motors: self.counted.motor_status(now),
            imu: self.counted.imu_status(now),
            counters: self.counted.counters(now, self.recording.recorder.as_ref().map_or(0, Recorder::lost)),
            timing: Timing::default(),
            recording: self.recording.recorder.as_ref().map(Recorder::status),
        }
    }

    fn connection(&self, now: Duration) -> Connection {
        if let Link::Replay(player) = &self.link {
            return player.connection();
        }
        if let Some(reason) = self.link.problem() {
            return Connection::Lost { reason };
        }
        match self.counted.heard() {
            Some(heard) if now < heard + SILENT => Connection::Connected,
            _ => Connection::Silent { hint: self.hint() },
        }
    }

    fn hint(&self) -> String {
        if let Some(hint) = self.link.hint() {
            return hint;
        }
        match self.decoder.ids() {
            Some(ids) => format!("frames of {ids} are received, but {}", self.decoder.wanted()),
            None => "no frames: motors reply only to queries of the robot's controller or of \
                     the checks; check supply, wiring, termination and bit rate"
                .to_owned(),
        }
    }

    /// Stops the motors before the link is closed, if they were switched on here.
    fn farewell(&mut self) {
        self.stop_line.request();
        let ticks = (FAREWELL.as_nanos() / TICK.as_nanos()) as u64;
        for _ in 0..ticks {
            match &self.role {
                Role::Drive(drive) if is_hot(drive) => {}
                Role::Drive(_) | Role::Listen(_) => break,
            }
            let tick = self.pacer.wait();
            let now = tick.due + tick.late;
            self.tick(now, Duration::ZERO);
        }
    }
}

/// Whether the motors were switched on here and have not confirmed that they are off.
fn is_hot(drive: &Drive) -> bool {
    match drive.stage() {
        Stage::Listening | Stage::Checking => false,
        Stage::Driving | Stage::Stopped(_) => !drive.has_ended(),
    }
}
