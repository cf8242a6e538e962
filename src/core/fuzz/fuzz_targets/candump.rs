//! Lines of text: what is read is written as a line that is read the same.
#![no_main]

use std::time::Duration;

use flqr_core::link::candump::{Entry, parse_line, write_line};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &str| {
    for line in input.lines() {
        match parse_line(line) {
            Ok(None) => {}
            Ok(Some(entry)) => {
                let mut again = String::new();
                write_line(&mut again, &entry);
                let time = Duration::new(entry.time.as_secs(), entry.time.subsec_micros() * 1000);
                assert_eq!(parse_line(&again), Ok(Some(Entry { time, ..entry })));
            }
            Err(error) => assert!((1..=line.len() + 1).contains(&error.column)),
        }
    }
});
