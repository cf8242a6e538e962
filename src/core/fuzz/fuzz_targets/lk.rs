//! Frames of both motors, each of 12 bytes of input: identifier, direction, time and data.
#![no_main]

use std::time::Duration;

use flqr_core::link::{lk::{Command, Reply}, Direction, Frame, FrameId, StampedFrame, Wheels};
use flqr_core::model::{LinkSettings, StateLayout};
use libfuzzer_sys::fuzz_target;

const IDS: [u16; 6] = [0x141, 0x142, 0x181, 0x182, 0x280, 0x143];

fuzz_target!(|input: &[u8]| {
    let mut wheels = Wheels::new(&LinkSettings::default());
    let mut time = Duration::ZERO;
    for step in input.as_chunks::<12>().0 {
        let [id, direction, low, high, data @ ..] = *step;
        if let Ok(command) = Command::decode(data) {
            assert_eq!(command.encode(), data);
        }
        for layout in [StateLayout::Current, StateLayout::Older] {
            if let Ok(reply) = Reply::decode(data, layout) {
                assert_eq!(Reply::decode(reply.encode(), layout), Ok(reply));
            }
        }
        time += Duration::from_micros(u64::from(u16::from_le_bytes([low, high])));
        let id = FrameId::Standard(IDS[usize::from(id) % IDS.len()]);
        let direction = if direction % 2 == 0 { Direction::Received } else { Direction::Sent };
        let frame = StampedFrame { time, direction, frame: Frame::full(id, data) };
        assert!(wheels.receive(&frame).count() <= 2);
    }
});
