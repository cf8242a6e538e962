//! From frames and bytes to what motors and IMU say.

use std::collections::BTreeSet;
use std::time::Duration;

use super::counters::LinkCounters;
use crate::device::RecorderInput;
use crate::link::{
    FrameId, FrameKind, ImuAssembler, ImuReading, MotorEvent, StampedFrame, Wheels,
    dbc::{Heard, SignalMap},
    jy901::Decoder,
};
use crate::model::LinkSettings;

/// Ids that are remembered for hints.
const MOST_IDS: usize = 12;

/// What a DBC file tells of the frames.
pub(super) struct Signals {
    pub(super) map: SignalMap,
    /// Of which motors currents are known; the others' stand for torques, or for nothing.
    pub(super) tells_current: [bool; 2],
}

/// Decoders of both lines, and what they gave since it was last cleared.
pub(super) struct FrameDecoder {
    pub(super) wheels: Wheels,
    signals: Option<Signals>,
    decoder: Decoder,
    assembler: ImuAssembler,
    pub(super) motors: Vec<MotorEvent>,
    pub(super) imu: Vec<ImuReading>,
    ids: BTreeSet<FrameId>,
    /// Whether the IMU is on a separate line, and so tells nothing of the source of frames.
    imu_is_apart: bool,
}

impl FrameDecoder {
    pub(super) fn new(settings: &LinkSettings, signals: Option<Signals>, imu_is_apart: bool) -> Self {
        Self {
            wheels: Wheels::new(settings),
            signals,
            decoder: Decoder::new(),
            assembler: ImuAssembler::new(settings),
            motors: Vec::new(),
            imu: Vec::new(),
            ids: BTreeSet::new(),
            imu_is_apart,
        }
    }

    /// A frame that this program orders to be sent, by which its reply is distinguished from a command of somebody else.
    pub(super) fn sent(&mut self, frame: &StampedFrame) {
        self.motors.extend(self.wheels.receive(frame));
    }

    /// One of them that was written to the bus.
    pub(super) fn written(&mut self, frame: &StampedFrame) {
        self.wheels.written(frame);
    }

    pub(super) fn clear(&mut self) {
        self.motors.clear();
        self.imu.clear();
    }

    /// A frame of the bus.
    pub(super) fn frame(
        &mut self,
        frame: &StampedFrame,
        counted: &mut LinkCounters,
        recorder: Option<&RecorderInput>,
    ) {
        counted.frame(frame);
        if let Some(recorder) = recorder {
            recorder.frame(frame);
        }
        if frame.frame.kind() == FrameKind::Data && self.ids.len() < MOST_IDS {
            self.ids.insert(frame.frame.id());
        }
        if self.signals.is_some() {
            return self.described(frame, counted);
        }
        for event in self.wheels.receive(frame) {
            counted.motor(&event);
            self.motors.push(event);
        }
    }

    /// A frame of a robot that a DBC file describes.
    fn described(&mut self, frame: &StampedFrame, counted: &mut LinkCounters) {
        let Some(Signals { map, tells_current }) = &mut self.signals else { return };
        for heard in map.receive(frame) {
            match heard {
                Heard::Motor(event) => {
                    self.motors.push(event);
                    let mut shown = event;
                    if let MotorEvent::State(motor, state) = &mut shown
                        && !tells_current[*motor as usize]
                    {
                        state.current_a = f64::NAN;
                    }
                    counted.motor(&shown);
                }
                Heard::Imu(reading) => {
                    counted.imu(&reading, true);
                    self.imu.push(reading);
                }
            }
        }
    }

    /// Whether frames have the pitch, so that the IMU of a recording is not received next to them.
    fn frames_have_pitch(&self) -> bool {
        self.signals.as_ref().is_some_and(|signals| signals.map.has_pitch())
    }

    /// What frames are to be of.
    pub(super) fn wanted(&self) -> &'static str {
        if self.signals.is_some() {
            "none of them has a selected signal: check the DBC file and the selected signals"
        } else {
            "none of the robot's motors: check left_motor_id and right_motor_id in [link]"
        }
    }

    /// Bytes of the IMU's line, read at a time.
    pub(super) fn imu_bytes(
        &mut self,
        time: Duration,
        bytes: &[u8],
        counted: &mut LinkCounters,
        recorder: Option<&RecorderInput>,
    ) {
        self.decoder.push(time, bytes);
        while let Some((time, packet)) = self.decoder.next() {
            if let Some(recorder) = recorder {
                recorder.imu_packet(time, &packet);
            }
            if let Some(reading) = self.assembler.push(time, &packet)
                && !self.frames_have_pitch()
            {
                counted.imu(&reading, !self.imu_is_apart);
                self.imu.push(reading);
            }
        }
        counted.imu_packets(self.decoder.intact(), self.decoder.corrupted(), self.decoder.stray());
    }

    /// The ids that were received, for a hint; `None` if nothing was.
    pub(super) fn ids(&self) -> Option<String> {
        let shown = self.ids.iter().map(|id| format!("0x{:X}", id.raw())).collect::<Vec<_>>().join(", ");
        (!shown.is_empty()).then_some(shown)
    }
}
