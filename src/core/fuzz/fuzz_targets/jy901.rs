//! A stream of bytes: all are accounted for, and no packet has a wrong sum.
#![no_main]

use std::time::Duration;

use flqr_core::link::{jy901::{Decoder, RegisterWriteDecoder}, ImuAssembler};
use flqr_core::model::LinkSettings;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let mut decoder = Decoder::new();
    let mut assembler = ImuAssembler::new(&LinkSettings::default());
    decoder.push(Duration::ZERO, input);
    let mut found = 0;
    while let Some((time, packet)) = decoder.next() {
        let bytes = packet.encode();
        assert!(input.windows(11).any(|window| window == bytes));
        let sum: u32 = bytes[..10].iter().copied().map(u32::from).sum();
        assert_eq!(sum as u8, bytes[10]);
        assembler.push(time, &packet);
        found += 1;
    }
    assert_eq!(found, decoder.intact());
    let waiting = input.len() as u64 - 11 * (decoder.intact() + decoder.corrupted()) - decoder.stray();
    assert!(waiting <= 10);
    let mut rest = input;
    let mut writes = RegisterWriteDecoder::default();
    while let Some(write) = writes.next(&mut rest) {
        assert!(input.windows(5).any(|window| window == write.encode()));
    }
});
