//! From frames and bytes to what motors and IMU say.

use std::collections::BTreeSet;
use std::time::Duration;

use super::tally::Tally;
use crate::device::RecorderInput;
use crate::link::jy901::Decoder;
use crate::link::{FrameId, FrameKind, ImuAssembler, ImuReading, MotorEvent, StampedFrame, Wheels};
use crate::robot::LinkSettings;

/// Ids that are remembered for hints.
const MOST_IDS: usize = 12;

/// Decoders of both lines, and what they gave since it was last cleared.
pub(super) struct Hearing {
    pub(super) wheels: Wheels,
    decoder: Decoder,
    assembler: ImuAssembler,
    pub(super) motors: Vec<MotorEvent>,
    pub(super) imu: Vec<ImuReading>,
    ids: BTreeSet<FrameId>,
}

impl Hearing {
    pub(super) fn new(settings: &LinkSettings) -> Self {
        Self {
            wheels: Wheels::new(settings),
            decoder: Decoder::new(),
            assembler: ImuAssembler::new(settings),
            motors: Vec::new(),
            imu: Vec::new(),
            ids: BTreeSet::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.motors.clear();
        self.imu.clear();
    }

    /// A frame of the bus.
    pub(super) fn frame(
        &mut self,
        frame: &StampedFrame,
        tally: &mut Tally,
        recorder: Option<&RecorderInput>,
    ) {
        tally.frame(frame);
        if let Some(recorder) = recorder {
            recorder.frame(frame);
        }
        if frame.frame.kind() == FrameKind::Data && self.ids.len() < MOST_IDS {
            self.ids.insert(frame.frame.id());
        }
        for event in self.wheels.receive(frame) {
            tally.motor(&event);
            self.motors.push(event);
        }
    }

    /// Bytes of the IMU's line, read at a time.
    pub(super) fn imu_bytes(
        &mut self,
        time: Duration,
        bytes: &[u8],
        tally: &mut Tally,
        recorder: Option<&RecorderInput>,
    ) {
        self.decoder.push(time, bytes);
        while let Some((time, packet)) = self.decoder.next() {
            if let Some(recorder) = recorder {
                recorder.imu_packet(time, &packet);
            }
            if let Some(reading) = self.assembler.push(time, &packet) {
                tally.imu(&reading);
                self.imu.push(reading);
            }
        }
        tally.imu_packets(self.decoder.intact(), self.decoder.corrupted(), self.decoder.stray());
    }

    /// The ids that were heard, for a hint; none where nothing was.
    pub(super) fn ids(&self) -> Option<String> {
        let shown = self.ids.iter().map(|id| format!("0x{:X}", id.raw())).collect::<Vec<_>>().join(", ");
        (!shown.is_empty()).then_some(shown)
    }
}
