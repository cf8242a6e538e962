use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;
use crate::link::{Frame, FrameId};

fn standard(id: u16, data: &[u8]) -> Frame {
    Frame::data(FrameId::Standard(id), data).unwrap()
}

fn extended(id: u32, data: &[u8]) -> Frame {
    Frame::data(FrameId::Extended(id), data).unwrap()
}

fn text(name: &str) -> Text {
    Text::new(name.as_bytes()).unwrap()
}

fn received(frame: Frame, stamp_ms: Option<u16>) -> Answer {
    Answer::Frame { frame, stamp_ms }
}

#[test]
fn commands_are_the_lines_that_were_measured() {
    let torque = standard(0x141, &[0xA1, 0, 0, 0, 0x64, 0, 0, 0]);
    // The first eight: Linux' own examples, and what slcand and cansend put on a line.
    for (command, line) in [
        (Command::Send(standard(0x456, &[0x11, 0x22, 0x33])), "t4563112233"),
        (Command::Send(extended(0x12AB_CDEF, &[0xAA, 0x55])), "T12ABCDEF2AA55"),
        (Command::Send(Frame::remote(FrameId::Standard(0x123), 0).unwrap()), "r1230"),
        (Command::Close, "C"),
        (Command::BitRate(8), "S8"),
        (Command::Open, "O"),
        (Command::Send(torque), "t1418A100000064000000"),
        (Command::Send(extended(0x1234_5678, &[0xDE, 0xAD, 0xBE, 0xEF])), "T123456784DEADBEEF"),
        (Command::Send(Frame::remote(FrameId::Extended(0x1FFF_FFFF), 8).unwrap()), "R1FFFFFFF8"),
        (Command::Nothing, ""),
        (Command::Listen, "L"),
        (Command::BitTiming(0x031C), "s031C"),
        (Command::Version, "V"),
        (Command::Firmware, "v"),
        (Command::SerialNumber, "N"),
        (Command::Flags, "F"),
        (Command::Timestamps(true), "Z1"),
        (Command::Timestamps(false), "Z0"),
        (Command::AcceptanceCode(0x0012_3400), "M00123400"),
        (Command::AcceptanceMask(0xFFFF_FFFF), "mFFFFFFFF"),
        (Command::AutoPoll(true), "X1"),
        (Command::Poll, "P"),
        (Command::PollAll, "A"),
        (Command::UartRate(1), "U1"),
        (Command::AutoStart(2), "Q2"),
    ] {
        let sent = [line.as_bytes(), b"\r"].concat();
        assert_eq!(&*command.encode(), sent, "{line}");
        let mut decoder = CommandDecoder::default();
        let mut input = &sent[..];
        assert_eq!(decoder.next(&mut input), Some(Ok(command)), "{line}");
        assert_eq!(decoder.next(&mut input), None, "{line}");
    }
}

#[test]
fn what_is_no_command_is_refused() {
    for line in [
        "t",
        "t4563112",
        "t45631122334",
        "t4569112233445566778899",
        "t8003112233",
        "T200000000",
        "S",
        "S10",
        "Z2",
    ]
    .into_iter()
    .chain(["O1", "t456311223G", "x", "sFFF", "M1234567G", "\u{7}"])
    {
        assert_eq!(Command::decode(line.as_bytes()), None, "{line:?}");
    }
}

#[test]
fn an_adapter_is_opened_for_listening_without_leave_to_send() {
    let lines =
        |listen| opening(1_000_000, listen).map(|commands| commands.map(|c| c.encode().to_vec()).concat());
    assert_eq!(lines(true).unwrap(), b"C\rS8\rL\r");
    assert_eq!(lines(false).unwrap(), b"C\rS8\rO\r");
    assert_eq!(opening(123_456, false), None);
    let rates = (0..9).map(|code| bit_rate_of_code(code).unwrap());
    assert!(
        rates.enumerate().all(|(code, rate)| opening(rate, true).unwrap()[1] == Command::BitRate(code as u8))
    );
}

#[test]
fn answers_are_read_and_written() {
    let frame = standard(0x456, &[0x11, 0x22, 0x33]);
    let remote = Frame::remote(FrameId::Standard(0x123), 0).unwrap();
    let status =
        |state, receive_errors, send_errors| Answer::Status(Status { state, receive_errors, send_errors });
    for (answer, line) in [
        (received(frame, None), "t4563112233\r"),
        (received(frame, Some(0)), "t45631122330000\r"),
        (received(frame, Some(59_999)), "t4563112233EA5F\r"),
        (received(extended(0x12AB_CDEF, &[0xAA, 0x55]), Some(0x1234)), "T12ABCDEF2AA551234\r"),
        (received(remote, None), "r1230\r"),
        (received(remote, Some(0x10)), "r12300010\r"),
        (received(standard(0x7FF, &[]), None), "t7FF0\r"),
        (Answer::Done, "\r"),
        (Answer::Refused, "\u{7}"),
        (Answer::Taken { extended: false }, "z\r"),
        (Answer::Taken { extended: true }, "Z\r"),
        (status(BusState::Off, 256, 256), "sb256256\r"),
        (status(BusState::Active, 0, 7), "sa000007\r"),
        (status(BusState::Warning, 96, 0), "sw096000\r"),
        (status(BusState::Passive, 0, 128), "sp000128\r"),
        (Answer::Errors(BusErrors(0b1000_0001)), "e2as\r"),
        (Answer::Errors(BusErrors(0xFF)), "e8abBcfoOs\r"),
        (Answer::Version(text("1013")), "V1013\r"),
        (Answer::Firmware(text("0101")), "v0101\r"),
        (Answer::SerialNumber(text("A123")), "NA123\r"),
        (Answer::Flags(0xA4), "FA4\r"),
    ] {
        assert_eq!(&*answer.encode(), line.as_bytes(), "{line:?}");
        let mut decoder = AnswerDecoder::default();
        let mut input = line.as_bytes();
        assert_eq!(decoder.next(&mut input), Some(answer), "{line:?}");
        assert_eq!(decoder.next(&mut input), None, "{line:?}");
    }
    assert_eq!(BusErrors(0b1000_0001).names().collect::<Vec<_>>(), ["no acknowledgment", "stuffing"]);
    assert_eq!(text("1013").to_string(), "1013");
}

#[test]
fn what_adapters_do_differently_is_tolerated() {
    let frame = standard(0x1AB, &[0xCD, 0xEF]);
    assert_eq!(Answer::decode(b"t1ab2cdef"), received(frame, None));
    assert_eq!(Answer::decode(b"t1AB2CDEFEA60"), received(frame, None), "a stamp that there is not");
    let mut input = &b"t1AB2CDEF\r\n\r\nV1013\r\n"[..];
    let mut decoder = AnswerDecoder::default();
    let answers: Vec<_> = std::iter::from_fn(|| decoder.next(&mut input)).collect();
    assert_eq!(answers, [received(frame, None), Answer::Done, Answer::Version(text("1013"))]);
}

#[test]
fn damaged_lines_are_told_and_cost_no_other() {
    let good = standard(0x141, &[1, 2]);
    for broken in [
        "t14120102 \r",
        "t14\r",
        "t8002AABB\r",
        "T2000000020102\r",
        "t141201023\r",
        "tG4120102\r",
        "t1412010G\r",
    ]
    .into_iter()
    .chain(["e3ab\r", "e1x\r", "sx000000\r", "sb25625\r", "sb2562560\r", "F1\r", "?\r", "1412"])
    .chain(["t1419010203040506070809\r", "V\u{1}\r", "Vabcdefghijklmnopqrstuvwxyz\r"])
    {
        let broken =
            if broken.ends_with('\r') { broken.to_owned() } else { format!("{}\r", broken.repeat(50)) };
        let stream = [b"t14120102\r", broken.as_bytes(), b"t14120102\r\x07"].concat();
        for chunk in [1, 3, 500] {
            let mut decoder = AnswerDecoder::default();
            let mut answers = Vec::new();
            for mut bytes in stream.chunks(chunk) {
                answers.extend(std::iter::from_fn(|| decoder.next(&mut bytes)));
            }
            let frame = received(good, None);
            assert_eq!(answers, [frame, Answer::Damaged, frame, Answer::Refused], "{broken:?} by {chunk}");
        }
    }
}

#[test]
fn a_bell_within_a_line_is_both_told() {
    let mut input = &b"t141\x07\r"[..];
    let mut decoder = AnswerDecoder::default();
    let answers: Vec<_> = std::iter::from_fn(|| decoder.next(&mut input)).collect();
    assert_eq!(answers, [Answer::Damaged, Answer::Refused, Answer::Done]);
}

#[test]
fn a_frame_of_any_kind_comes_through_both_ways() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for round in 0..20_000 {
        let data = random.next_u64().to_le_bytes();
        let length = round % 9;
        let id = if random.next_u32().is_multiple_of(2) {
            FrameId::Standard((random.next_u32() & 0x7FF) as u16)
        } else {
            FrameId::Extended(random.next_u32() & 0x1FFF_FFFF)
        };
        let frame = if round % 10 == 9 {
            Frame::remote(id, length as u8).unwrap()
        } else {
            Frame::data(id, &data[..length]).unwrap()
        };
        let line = Command::Send(frame).encode();
        assert_eq!(Command::decode(&line[..line.len() - 1]), Some(Command::Send(frame)));
        let stamp_ms = (round % 3 == 0).then_some(round as u16);
        let line = received(frame, stamp_ms).encode();
        assert_eq!(Answer::decode(&line[..line.len() - 1]), received(frame, stamp_ms));
    }
}

/// Whatever comes out is written as a line that says the same; and in pieces the same comes out as at once.
#[test]
fn ten_million_random_and_flipped_bytes_are_read_without_harm() {
    let mut random = ChaCha8Rng::seed_from_u64(0x51CA);
    let mut frames = 0_u32;
    let mut decoder = AnswerDecoder::default();
    let mut commands = CommandDecoder::default();
    let mut chunk = vec![0; 10_000];
    for round in 0..1000 {
        random.fill_bytes(&mut chunk);
        if round % 2 == 1 {
            flip_lines(&mut chunk, &mut random);
        }
        let mut input = &chunk[..];
        while let Some(answer) = decoder.next(&mut input) {
            let line = answer.encode();
            if let Answer::Frame { .. } = answer {
                assert_eq!(Answer::decode(&line[..line.len() - 1]), answer);
                frames += 1;
            }
        }
        for mut piece in chunk.chunks(7) {
            while let Some(command) = commands.next(&mut piece) {
                if let Ok(command) = command {
                    let line = command.encode();
                    assert_eq!(Command::decode(&line[..line.len() - 1]), Some(command));
                }
            }
        }
    }
    assert!(frames > 50_000, "{frames}");
}

/// Lines of frames with, on average, one flipped bit in each two.
fn flip_lines(chunk: &mut [u8], random: &mut ChaCha8Rng) {
    for bytes in chunk.chunks_exact_mut(22) {
        let frame = standard(0x141, &random.next_u64().to_le_bytes());
        bytes.copy_from_slice(&Command::Send(frame).encode());
        let bit = random.next_u32() as usize % (2 * 176);
        if let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
}
