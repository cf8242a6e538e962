use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::LineProblem::*;
use super::*;

fn written(entry: &Entry<'_>) -> String {
    let mut out = String::new();
    write_line(&mut out, entry);
    out
}

fn read(line: &str) -> Entry<'_> {
    parse_line(line).unwrap_or_else(|error| panic!("{line}: {error}")).expect("not blank")
}

fn standard(id: u16, data: &[u8]) -> LoggedFrame {
    Frame::data(FrameId::Standard(id), data).unwrap().into()
}

/// Lines as candump writes them, and their frames.
fn lines() -> Vec<(&'static str, LoggedFrame, Option<Direction>)> {
    use Direction::{Received, Sent};
    let torque = standard(0x141, &[0xA1, 0, 0, 0, 0x64, 0, 0, 0]);
    let fd = |id, flags, data: &[u8]| LoggedFrame::Fd(FdFrame::new(id, flags, data).unwrap());
    let Some(LoggedFrame::Classic { frame: eight, .. }) = Some(standard(0x123, &[0x11; 8])) else { panic!() };
    let error = Frame::error(4, [0, 0x0C, 0, 0, 0, 0, 0, 0]).unwrap();
    let remote = |length| Frame::remote(FrameId::Standard(0x123), length).unwrap().into();
    let wide = Frame::data(FrameId::Extended(0x123), &[1]).unwrap().into();
    vec![
        ("(1735270496.916858) vcan0 141#A100000064000000", torque, None),
        ("(1735270496.916858) vcan0 141#A100000064000000 T", torque, Some(Sent)),
        ("(0.000001) slcan0 141#A100000064000000 R", torque, Some(Received)),
        ("(1469439874.299654) can1 104#", standard(0x104, &[]), None),
        ("(1.000000) can0 00000123#01", wide, None),
        ("(1.000000) can0 123#R", remote(0), None),
        ("(1.000000) can0 123#R4 R", remote(4), Some(Received)),
        ("(1.000000) can0 123##711223344", fd(FrameId::Standard(0x123), 7, &[0x11, 0x22, 0x33, 0x44]), None),
        ("(1.000000) can0 1FFFFFFF##5", fd(FrameId::Extended(0x1FFF_FFFF), 5, &[]), None),
        ("(1.000000) can0 20000004#000C000000000000", error.into(), None),
        (
            "(1.000000) can0 123#1111111111111111_E",
            LoggedFrame::Classic { frame: eight, raw_length_code: Some(14) },
            None,
        ),
    ]
}

#[test]
fn lines_of_candump_are_read_and_written() {
    for (line, frame, direction) in lines() {
        let entry = read(line);
        assert_eq!((entry.frame, entry.direction), (frame, direction), "{line}");
        assert_eq!(written(&entry), format!("{line}\n"));
    }
    let entry = read("(1735270496.916858) vcan0 141#A1");
    assert_eq!((entry.time, entry.interface), (Duration::new(1_735_270_496, 916_858_000), "vcan0"));
}

#[test]
fn what_is_not_quite_candumps_form_is_read_too() {
    let data = standard(0x141, &[0xA1, 0x0B]);
    let at = |nanoseconds| Duration::new(1, nanoseconds);
    for (line, time) in [
        ("(1.5) can0 141#A10B", at(500_000_000)),
        ("(1) can0 141#A10B", at(0)),
        ("(1.123456789) can0 141#A10B", at(123_456_789)),
        ("  (1.000000)   can0\t141#A1.0B \r\n", at(0)),
        ("(1.000000) can0 141#a10b", at(0)),
        (" (1.000000)  can0  141   [2]  A1 0B", at(0)),
        (" (1.000000)  can0  141   [2]  A1 0B   '..'", at(0)),
        (" (1.000000)  can0  RX - -  141   [2]  A1 0B", at(0)),
    ] {
        let entry = read(line);
        assert_eq!((entry.time, entry.interface, entry.frame), (time, "can0", data), "{line}");
    }
    assert_eq!(read("(1.0) can0  TX B E  141   [1]  A1").direction, Some(Direction::Sent));
    for (line, same) in [
        ("(1.0)  can0  123   [4]  remote request", "(1.0) can0 123#R4"),
        ("(1.0)  can0  12345678   [0] ", "(1.0) can0 12345678#"),
        ("(1.0)  can0  20000004   [8]  00 0C 00 00 00 00 00 00   ERRORFRAME", "(1.0) can0 20000004#000C"),
        (
            "(1.0)  can0  123  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B",
            "(1.0) can0 123##4000102030405060708090A0B",
        ),
    ] {
        assert_eq!(read(line), read(same), "{line}");
    }
    for blank in ["", "\n", "  \t \r\n"] {
        assert_eq!(parse_line(blank), Ok(None));
    }
}

#[test]
fn what_is_wrong_is_told_with_its_column() {
    for (line, column, problem) in [
        ("vcan0  141   [8]  A1 00", 1, NoTime),
        ("1.0 can0 141#", 1, NoTime),
        ("(1.0 can0 141#", 1, BadTime),
        ("(-1.0) can0 141#", 1, BadTime),
        ("(1.0000000001) can0 141#", 1, BadTime),
        ("(99999999999999999999.0) can0 141#", 1, BadTime),
        ("(1.0)", 6, NoInterface),
        ("(1.0) can0", 11, NoFrame),
        ("(1.0) can0 14#00", 12, BadId),
        ("(1.0) can0 1410#00", 12, BadId),
        ("(1.0) can0 14G#00", 12, BadId),
        ("(1.0) can0 #00", 12, BadId),
        ("(1.0) can0 800#01", 12, IdTooLarge { id: 0x800 }),
        ("(1.0) can0 40000000#01", 12, IdTooLarge { id: 0x4000_0000 }),
        ("(1.0) can0 60000000#01", 12, IdTooLarge { id: 0x6000_0000 }),
        ("(1.0) can0 141#A10", 18, BadByte),
        ("(1.0) can0 141#A1G0", 18, BadByte),
        ("(1.0) can0 141#A1..B0", 19, BadByte),
        ("(1.0) can0 141#.A1", 16, BadByte),
        ("(1.0) can0 141#é", 16, BadByte),
        ("(1.0) can0 141#112233445566778899", 16, TooManyBytes),
        ("(1.0) can0 20000004#112233445566778899", 21, TooManyBytes),
        ("(1.0) can0 141#R9", 17, BadLength),
        ("(1.0) can0 141#R11", 17, BadLength),
        ("(1.0) can0 141##", 17, BadFlags),
        ("(1.0) can0 141##é", 17, BadFlags),
        ("(1.0) can0 141##1112233445566778899", 18, BadFdLength { bytes: 9 }),
        ("(1.0) can0 141#1122_E", 20, BadLengthCode),
        ("(1.0) can0 141#1122334455667788_8", 32, BadLengthCode),
        ("(1.0) can0 141#1122334455667788_", 32, BadLengthCode),
        ("(1.0) can0 141#80:10:11223344#00", 16, Xl),
        ("(1.0) can0 141#00 X", 19, BadDirection),
        ("(1.0) can0 141#00 R R", 21, Excess),
        ("(1.0) can0 141 [3] A1 00", 25, OtherLength { length: 3, bytes: 2 }),
        ("(1.0) can0 141 [1] A1 00", 23, Excess),
        ("(1.0) can0 141 [9] A1 00", 16, BadLength),
        ("(1.0) can0 141 8 A1 00", 16, BadLength),
        ("(1.0) can0 141 [1] A", 20, BadByte),
        ("(1.0) can0 141 [09] 00 00 00 00 00 00 00 00 00", 16, BadFdLength { bytes: 9 }),
    ] {
        assert_eq!(parse_line(line), Err(LineError { column, problem }), "{line}");
    }
    let error = parse_line("(1.0) can0 800#01").unwrap_err().to_string();
    assert_eq!(
        error,
        "column 12: the identifier 800 is too large: 3 digits go up to 7FF, 8 digits up to 1FFFFFFF"
    );
}

/// Another implementation reads and prints what is written here, and reads what it accepts as is read here.
#[cfg(target_os = "linux")]
#[test]
fn another_implementation_agrees() {
    let mut random = ChaCha8Rng::seed_from_u64(0xCD);
    let mut text: String = lines()
        .iter()
        .filter(|(line, ..)| !line.contains('_'))
        .map(|(line, ..)| format!("{line}\n"))
        .collect();
    for _ in 0..2000 {
        write_line(&mut text, &random_entry(&mut random));
    }
    let theirs: String = socketcan::dump::Reader::from_reader(text.as_bytes())
        .map(|record| format!("{}\n", record.expect("what is written here is read there")))
        .collect();
    assert_eq!(theirs, text);
    let ours: String = text.lines().map(|line| written(&read(line))).collect();
    assert_eq!(ours, text);
}

fn random_entry(random: &mut ChaCha8Rng) -> Entry<'static> {
    let mut data = [0; 64];
    random.fill_bytes(&mut data);
    let id = if random.next_u32().is_multiple_of(2) {
        FrameId::Standard((random.next_u32() & 0x7FF) as u16)
    } else {
        FrameId::Extended(random.next_u32() & 0x1FFF_FFFF)
    };
    let length = random.next_u32() as usize % 9;
    let frame = match random.next_u32() % 8 {
        0 => Frame::remote(id, length as u8).unwrap().into(),
        1 => Frame::error(random.next_u32() & 0x1FFF_FFFF, random.next_u64().to_le_bytes()).unwrap().into(),
        2 => {
            let lengths = [0, 1, 7, 8, 12, 16, 20, 24, 32, 48, 64];
            let length = lengths[random.next_u32() as usize % lengths.len()];
            LoggedFrame::Fd(FdFrame::new(id, 4 | random.next_u32() as u8 & 3, &data[..length]).unwrap())
        }
        _ => Frame::data(id, &data[..length]).unwrap().into(),
    };
    let time = Duration::from_micros(random.next_u64() >> 13);
    let direction = [None, Some(Direction::Sent), Some(Direction::Received)][random.next_u32() as usize % 3];
    Entry { time, interface: "can0", frame, direction }
}

/// Random text, and lines with flipped bits: whatever is read is written as a line that is read the same.
#[test]
fn ten_million_random_and_flipped_bytes_are_read_without_harm() {
    let mut random = ChaCha8Rng::seed_from_u64(0xDD);
    let (mut bytes, mut accepted) = (0, 0_u32);
    let mut line = String::new();
    while bytes < 10_000_000 {
        let mut raw = if random.next_u32().is_multiple_of(4) {
            let mut raw = vec![0; random.next_u32() as usize % 2000];
            random.fill_bytes(&mut raw);
            raw
        } else {
            line.clear();
            write_line(&mut line, &random_entry(&mut random));
            line.as_bytes().to_vec()
        };
        if !raw.is_empty() {
            let bit = random.next_u32() as usize % (8 * raw.len());
            raw[bit / 8] ^= 1 << (bit % 8);
        }
        bytes += raw.len();
        let text = String::from_utf8_lossy(&raw);
        for line in text.lines() {
            if let Ok(Some(entry)) = parse_line(line) {
                accepted += 1;
                let again = written(&entry);
                let micros = Duration::from_micros(entry.time.as_micros() as u64);
                assert_eq!(read(&again), Entry { time: micros, ..entry }, "{line}");
            }
        }
    }
    assert!(accepted > 1000, "{accepted}");
}
