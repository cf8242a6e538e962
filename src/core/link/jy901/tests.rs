use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;

fn hex(text: &str) -> Vec<u8> {
    text.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn packet(text: &str) -> Packet {
    Packet::decode(&hex(text).try_into().unwrap()).expect(text)
}

fn near(ours: &[f64], theirs: &[f64], tolerance: f64) {
    let far = ours.iter().zip(theirs).any(|(a, b)| (a - b).abs() > tolerance);
    assert!(!far && ours.len() == theirs.len(), "{ours:?} {theirs:?}");
}

const ACCELERATION: &str = "55 51 00 00 00 00 00 08 E2 09 99";
const RATE: &str = "55 52 A4 00 5C FF 00 00 E2 09 91";
const ANGLE: &str = "55 53 FD FF 01 00 00 C0 10 2F A4";
const QUATERNION: &str = "55 59 82 5A 00 00 82 5A 00 00 66";

#[test]
fn worked_packets_say_what_they_should() {
    let degrees = |values: [f64; 3]| values.map(f64::to_degrees);
    let Reading::Acceleration { acceleration_g, temperature_c } = packet(ACCELERATION).reading() else {
        panic!()
    };
    assert_eq!((acceleration_g, temperature_c), ([0.0, 0.0, 1.0], 25.3));
    let Reading::Rate { rate_rad_s, temperature_c } = packet(RATE).reading() else { panic!() };
    near(&degrees(rate_rad_s), &[10.01, -10.01, 0.0], 0.001);
    assert_eq!(temperature_c, 25.3);
    let Reading::Angle { angle_rad, version } = packet(ANGLE).reading() else { panic!() };
    near(&degrees(angle_rad), &[-0.01648, 0.00549, -90.0], 0.000_005);
    assert_eq!(version, 0x2F10);
    let Reading::Quaternion(quaternion) = packet(QUATERNION).reading() else { panic!() };
    near(&quaternion, &[0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt(), 0.0], 2e-5);
}

#[test]
fn worked_packets_are_written_exactly() {
    let degrees = |values: [f64; 3]| values.map(f64::to_radians);
    for (made, text) in [
        (Packet::acceleration([0.0, 0.0, 1.0], 25.3), ACCELERATION),
        (Packet::rate(degrees([10.01, -10.01, 0.0]), 25.3), RATE),
        (Packet::angle(degrees([-0.01648, 0.00549, -90.0]), 0x2F10), ANGLE),
        (Packet::new(Kind::Quaternion, [0x5A82, 0, 0x5A82, 0]), QUATERNION),
    ] {
        assert_eq!(made.encode().to_vec(), hex(text));
        assert_eq!(packet(text), made);
    }
}

#[test]
fn the_other_packets_keep_their_words() {
    let words = [1, -2, 300, -30_000];
    let time = Packet { kind: Kind::Time, data: [25, 2, 9, 23, 59, 58, 0xE7, 0x03] };
    assert_eq!(time.reading(), Reading::Time { fields: [25, 2, 9, 23, 59, 58], milliseconds: 999 });
    let field = Packet::new(Kind::MagneticField, words).reading();
    assert_eq!(field, Reading::MagneticField { field: [1, -2, 300], temperature_c: -300.0 });
    let registers = Packet::new(Kind::Registers, words).reading();
    assert_eq!(registers, Reading::Registers([1, 65_534, 300, 35_536]));
    for kind in [Kind::Ports, Kind::Pressure, Kind::Position, Kind::Speed, Kind::Accuracy] {
        assert_eq!(Packet::new(kind, words).reading(), Reading::Words { kind, words });
    }
    for code in 0..=u8::MAX {
        let kind = Kind::of(code);
        assert_eq!(kind.is_some(), matches!(code, 0x50..=0x5A | 0x5F), "{code:02X}");
        assert!(kind.is_none_or(|kind| kind.code() == code));
    }
}

#[test]
fn values_beyond_the_scale_stop_at_its_end() {
    let Reading::Acceleration { acceleration_g, .. } =
        Packet::acceleration([100.0, -100.0, f64::NAN], 0.0).reading()
    else {
        panic!()
    };
    near(&acceleration_g, &[15.9996, -16.0, 0.0], 1e-3);
}

#[test]
fn settings_are_the_bytes_of_the_maker() {
    let writes = configure(100.0, 115_200, Content::BALANCE).unwrap();
    let expected =
        ["FF AA 69 88 B5", "FF AA 02 0E 00", "FF AA 03 09 00", "FF AA 04 06 00", "FF AA 00 00 00"].map(hex);
    assert_eq!(writes.concat(), expected.concat());
    assert_eq!(read_registers(0x03).encode().to_vec(), hex("FF AA 27 03 00"));
    for (rate_hz, baud, codes) in [(0.2, 4800, [1, 1]), (10.0, 9600, [6, 2]), (200.0, 921_600, [0x0B, 9])] {
        let writes = configure(rate_hz, baud, Content::BALANCE).unwrap();
        assert_eq!([writes[2][3], writes[3][3]], codes);
    }
}

#[test]
fn settings_that_cannot_be_are_refused() {
    use ConfigureError::*;
    let balance = Content::BALANCE;
    assert_eq!(configure(99.0, 115_200, balance), Err(NoSuchRate { rate_hz: 99.0 }));
    assert!(matches!(configure(f64::NAN, 115_200, balance), Err(NoSuchRate { .. })));
    assert_eq!(configure(100.0, 115_201, balance), Err(NoSuchBaud { baud: 115_201 }));
    // Three packets at 100 Hz are 33,000 bit/s, at 200 Hz 66,000.
    let slow = |needed_bit_s, baud| Err(LineTooSlow { needed_bit_s, baud });
    assert_eq!(configure(100.0, 19_200, balance), slow(33_000.0, 19_200));
    assert_eq!(configure(200.0, 57_600, balance), slow(66_000.0, 57_600));
    assert!(configure(100.0, 38_400, balance).is_ok() && configure(200.0, 115_200, balance).is_ok());
}

#[test]
fn an_emulated_imu_reads_what_is_written_to_it() {
    let mut decoder = RegisterWriteDecoder::default();
    let sent: Vec<u8> = [hex("00 FF"), configure(200.0, 230_400, Content(0x21E)).unwrap().concat()].concat();
    for chunk in [1, 3, 64] {
        let mut writes = Vec::new();
        for mut bytes in sent.chunks(chunk) {
            while let Some(write) = decoder.next(&mut bytes) {
                writes.push(write);
            }
        }
        assert_eq!((writes[0], writes[4], writes.len()), (UNLOCK, SAVE, 5));
        assert_eq!(writes[1].content(), Some(Content(0x21E)));
        assert_eq!((writes[2].rate_hz(), writes[3].baud()), (Some(200.0), Some(230_400)));
        assert_eq!((writes[2].baud(), writes[3].rate_hz()), (None, None));
    }
    assert_eq!(read_registers(0x30).asks_for(), Some(0x30));
}

fn decode_all(decoder: &mut Decoder, bytes: &[u8], chunk: usize) -> Vec<Packet> {
    let mut packets = Vec::new();
    for (at, bytes) in bytes.chunks(chunk).enumerate() {
        decoder.push(Duration::from_millis(at as u64), bytes);
        while let Some((time, packet)) = decoder.next() {
            assert_eq!(time, Duration::from_millis(at as u64));
            packets.push(packet);
        }
    }
    packets
}

fn counts(decoder: &Decoder) -> [u64; 3] {
    [decoder.intact(), decoder.corrupted(), decoder.stray()]
}

#[test]
fn packets_are_found_in_any_pieces_after_a_torn_start() {
    let stream = [hex("55 51 00 00 E2 09"), hex(ACCELERATION), hex(RATE), hex(ANGLE)].concat();
    for chunk in [1, 2, 7, 11, 100] {
        let mut decoder = Decoder::new();
        let packets = decode_all(&mut decoder, &stream, chunk);
        assert_eq!(packets, [packet(ACCELERATION), packet(RATE), packet(ANGLE)]);
        assert_eq!(counts(&decoder), [3, 0, 6]);
    }
}

#[test]
fn a_corrupted_packet_costs_no_other_one() {
    // 0x55 and a kind occur in its data, so that a false packet reaches into the next one.
    let tricky = Packet::new(Kind::Rate, [0x5155, 0x5255, 0x5355, 0x5155]).encode();
    for byte in 0..PACKET_BYTES {
        let mut broken = tricky;
        broken[byte] ^= 0x81;
        let stream = [hex(ACCELERATION), broken.to_vec(), hex(RATE), hex(ANGLE)].concat();
        let mut decoder = Decoder::new();
        let packets = decode_all(&mut decoder, &stream, 5);
        assert_eq!(packets, [packet(ACCELERATION), packet(RATE), packet(ANGLE)], "byte {byte}");
        assert_eq!(counts(&decoder), [3, 1, 0], "byte {byte}");
    }
}

/// 2 % of the packets with one wrong bit, and a torn start: all others come, and the corrupted ones are counted.
#[test]
fn two_percent_of_corrupted_packets_are_counted() {
    let mut random = ChaCha8Rng::seed_from_u64(901);
    let mut stream = random_packet(&mut random).encode()[4..].to_vec();
    let mut expected = Vec::new();
    let mut corrupted = 0;
    for round in 0..100_000 {
        let packet = random_packet(&mut random);
        let mut bytes = packet.encode();
        if random.next_u32() % 50 == 0 && round < 99_990 {
            let bit = random.next_u32() % 88;
            bytes[bit as usize / 8] ^= 1 << (bit % 8);
            corrupted += 1;
        } else {
            expected.push(packet);
        }
        stream.extend(bytes);
    }
    let mut decoder = Decoder::new();
    assert_eq!(decode_all(&mut decoder, &stream, 64), expected);
    assert_eq!(counts(&decoder), [expected.len() as u64, corrupted, 7]);
    assert!(corrupted > 1900, "{corrupted}");
}

/// Small values, as an IMU sends them.
fn random_packet(random: &mut ChaCha8Rng) -> Packet {
    let kind = [Kind::Acceleration, Kind::Rate, Kind::Angle][random.next_u32() as usize % 3];
    Packet::new(kind, [0; 4].map(|_: u8| (random.next_u32() % 4000) as i16 - 2000))
}

/// Noise, and packets with flipped bits: whatever comes out has the right sum and was in the stream.
#[test]
fn ten_million_random_and_flipped_bytes_give_only_packets_with_the_right_sum() {
    let mut random = ChaCha8Rng::seed_from_u64(55);
    let mut decoder = Decoder::new();
    let mut given = 0;
    let mut chunk = vec![0; 10_000];
    for round in 0..1000 {
        random.fill_bytes(&mut chunk);
        if round % 2 == 1 {
            flip_packets(&mut chunk, &mut random);
        }
        decoder.push(Duration::ZERO, &chunk);
        given += chunk.len() as u64;
        while let Some((_, packet)) = decoder.next() {
            let bytes = packet.encode();
            let sum: u32 = bytes[..10].iter().copied().map(u32::from).sum();
            assert_eq!(sum as u8, bytes[10]);
            assert_eq!(Packet::decode(&bytes), Some(packet));
        }
        let [intact, corrupted, stray] = counts(&decoder);
        assert!((0..=10).contains(&(given - 11 * (intact + corrupted) - stray)));
    }
    assert!(decoder.intact() > 100_000 && decoder.corrupted() > 500_000, "{:?}", counts(&decoder));
}

/// Packets with, on average, one flipped bit in each three.
fn flip_packets(chunk: &mut [u8], random: &mut ChaCha8Rng) {
    for bytes in chunk.chunks_exact_mut(PACKET_BYTES) {
        bytes.copy_from_slice(&random_packet(random).encode());
        let bit = random.next_u32() as usize % (3 * 88);
        if let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
}
