//! A file, and a frame for each of its messages.
#![no_main]

use flqr_core::link::Frame;
use flqr_core::link::dbc::Dbc;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (&[u8], [u8; 8])| {
    let (text, data) = input;
    let Ok(dbc) = Dbc::parse(&String::from_utf8_lossy(text)) else { return };
    for message in dbc.messages() {
        for length in 0..=8 {
            let frame = Frame::data(message.id, &data[..length]).expect("at most 8 bytes");
            message.values(&frame).for_each(drop);
        }
    }
});
