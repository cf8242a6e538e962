//! A stream of bytes in both directions; in pieces the same comes out as at once.
#![no_main]

use flqr_core::link::slcan::{Answer, AnswerDecoder, Command, CommandDecoder};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let answers = |piece: usize| {
        let mut decoder = AnswerDecoder::default();
        let mut answers = Vec::new();
        for mut bytes in input.chunks(piece) {
            answers.extend(std::iter::from_fn(|| decoder.next(&mut bytes)));
        }
        answers
    };
    let at_once = answers(input.len().max(1));
    assert_eq!(at_once, answers(1));
    for answer in at_once {
        let line = answer.encode();
        if let Answer::Frame { .. } | Answer::Status(_) | Answer::Flags(_) = answer {
            assert_eq!(Answer::decode(&line[..line.len() - 1]), answer);
        }
    }
    let mut decoder = CommandDecoder::default();
    let mut rest = input;
    while let Some(command) = decoder.next(&mut rest) {
        if let Ok(command) = command {
            let line = command.encode();
            assert_eq!(Command::decode(&line[..line.len() - 1]), Some(command));
        }
    }
});
