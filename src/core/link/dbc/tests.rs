use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;
use crate::link::{Direction, MotorEvent, StampedFrame};
use crate::model::Motor;

const FILE: &str = r#"VERSION "1"

NS_ :

BS_:

BU_: IMU ECU

BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX
 SG_ Lost : 0|8@1+ (1,0) [0|0] "" Vector__XXX

BO_ 256 Imu: 8 IMU
 SG_ Pitch : 0|16@1- (0.01,0) [0|0] "deg" ECU
 SG_ Rate : 23|16@0- (0.1,0) [0|0] "deg/s" ECU
 SG_ Odd : 35|10@1+ (1,-5) [0|0] "" ECU
 SG_ Cross : 46|5@0+ (1,0) [0|0] "" ECU

BO_ 2147483905 Wheel: 8 ECU
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" ECU
 SG_ LeftSpeed m1 : 8|16@1- (0.1,0) [0|0] "rpm" ECU
 SG_ RightSpeed m2 : 8|16@1- (0.1,0) [0|0] "rpm" ECU
 SG_ LeftTorque m1 : 24|16@1- (1,0) [0|0] "mNm" ECU
 SG_ Temperature : 63|8@0- (1,0) [0|0] "degC" ECU

BO_ 258 Floats: 8 ECU
 SG_ Single : 0|32@1- (1,0) [0|0] "rad" ECU
 SG_ Pitch : 32|32@1- (1,0) [0|0] "furlong" ECU

BO_ 259 Double: 8 ECU
 SG_ Wide : 7|64@0- (2,0) [0|0] "rad" ECU

BO_ 260 Nested: 8 ECU
 SG_ Outer M : 0|4@1+ (1,0) [0|0] "" ECU
 SG_ Inner m3M : 4|4@1+ (1,0) [0|0] "" ECU
 SG_ Deep m1 : 8|8@1+ (1,0) [0|0] "" ECU

BO_ 261 Long: 64 ECU
 SG_ Far : 100|8@1+ (1,0) [0|0] "rad" ECU

SIG_VALTYPE_ 258 Single : 1;
SIG_VALTYPE_ 259 Wide : 2;
SG_MUL_VAL_ 260 Inner Outer 3-4, 9-9;
SG_MUL_VAL_ 260 Deep Inner 1-1;
"#;

fn dbc() -> Dbc {
    Dbc::parse(FILE).unwrap_or_else(|error| panic!("{error}"))
}

fn value(name: &str, data: &[u8]) -> Option<f64> {
    let dbc = dbc();
    let (message, signal) = name.split_once('.').unwrap();
    let (message, signal) =
        dbc.signals().find(|(m, s)| m.name == message && s.name == signal).expect("in the file");
    signal.value(&Frame::data(message.id, data).unwrap())
}

#[test]
fn messages_and_signals_are_listed() {
    let dbc = dbc();
    let names: Vec<_> = dbc.messages().iter().map(|message| (message.name.as_str(), message.id)).collect();
    let standard = FrameId::Standard;
    assert_eq!(
        names,
        [
            ("Imu", standard(256)),
            ("Wheel", FrameId::Extended(257)),
            ("Floats", standard(258)),
            ("Double", standard(259)),
            ("Nested", standard(260)),
            ("Long", standard(261)),
        ]
    );
    assert_eq!(dbc.signals().count(), 16);
    let (_, pitch) = dbc.signals().next().unwrap();
    assert_eq!((pitch.name.as_str(), pitch.unit.as_str()), ("Pitch", "deg"));
}

#[test]
fn signals_are_read_in_both_byte_orders() {
    for (name, data, expected) in [
        // Little-endian, signed: −300 × 0.01.
        ("Imu.Pitch", &[0xD4, 0xFE, 0, 0, 0, 0, 0, 0][..], Some(-3.0)),
        // Big-endian from bit 23, the highest of byte 2: 0x0102 = 258 × 0.1.
        ("Imu.Rate", &[0, 0, 0x01, 0x02, 0, 0, 0, 0], Some(25.8)),
        ("Imu.Rate", &[0, 0, 0xFF, 0xFF, 0, 0, 0, 0], Some(-0.1)),
        // Ten bits from bit 35 on: five of byte 4, five of byte 5; less 5.
        ("Imu.Odd", &[0, 0, 0, 0, 0xF8, 0x1F, 0, 0], Some(1018.0)),
        ("Imu.Odd", &[0, 0, 0, 0, 0x08, 0x00, 0, 0], Some(-4.0)),
        // Five bits within byte 5 from its bit 6 down to its bit 2.
        ("Imu.Cross", &[0, 0, 0, 0, 0, 0x7C, 0, 0], Some(31.0)),
        ("Imu.Cross", &[0, 0, 0, 0, 0, 0x04, 0, 0], Some(1.0)),
        ("Imu.Rate", &[0, 0, 0x01], None),
        ("Imu.Pitch", &[0xD4, 0xFE], Some(-3.0)),
        ("Floats.Single", &[0x00, 0x00, 0x80, 0xBF, 0, 0, 0, 0], Some(-1.0)),
        ("Double.Wide", &[0x3F, 0xF8, 0, 0, 0, 0, 0, 0], Some(3.0)),
        ("Long.Far", &[0; 8], None),
    ] {
        let value = value(name, data);
        assert!(
            match (value, expected) {
                (Some(value), Some(expected)) => (value - expected).abs() < 1e-12,
                (value, expected) => value == expected,
            },
            "{name} {data:02X?}: {value:?}"
        );
    }
}

#[test]
fn multiplexed_signals_are_there_only_when_selected() {
    let wheel = |which| [which, 0x64, 0x00, 0, 0, 0, 0, 0];
    assert_eq!(value("Wheel.LeftSpeed", &wheel(1)), Some(10.0));
    assert_eq!(value("Wheel.RightSpeed", &wheel(1)), None);
    assert_eq!(value("Wheel.RightSpeed", &wheel(2)), Some(10.0));
    for (selectors, inner, deep) in [
        (0x13, true, true),
        (0x23, true, false),
        (0x14, true, true),
        (0x19, true, true),
        (0x15, false, false),
    ] {
        let data = [selectors, 7];
        assert_eq!(value("Nested.Inner", &data).is_some(), inner, "{selectors:02X}");
        assert_eq!(value("Nested.Deep", &data).is_some(), deep, "{selectors:02X}");
    }
}

/// Every place in a frame, read bit by bit the slow way.
#[test]
fn every_place_is_read_as_bit_by_bit() {
    let mut random = ChaCha8Rng::seed_from_u64(0xDBC);
    for start in 0..64_u64 {
        for size in [1, 2, 5, 8, 13, 16, 31, 32, 33, 63, 64] {
            for (order, little) in [("1", true), ("0", false)] {
                let text = FILE.replace("0|16@1- (0.01,0)", &format!("{start}|{size}@{order}+ (1,0)"));
                let data = random.next_u64().to_le_bytes();
                let dbc = Dbc::parse(&text).unwrap();
                let (message, signal) = dbc.signals().next().unwrap();
                let ours = signal.value(&Frame::data(message.id, &data).unwrap());
                assert_eq!(ours, slowly(start, size, little, data), "{start}|{size}@{order}");
            }
        }
    }
}

fn slowly(start: u64, size: u64, little: bool, data: [u8; 8]) -> Option<f64> {
    let bit = |at: u64| Some(u64::from(data.get(at as usize / 8)? >> (at % 8) & 1));
    let mut at = start;
    let mut value = 0;
    for place in 0..size {
        value = if little { value | bit(at)? << place } else { value << 1 | bit(at)? };
        at = if little {
            at + 1
        } else if at.is_multiple_of(8) {
            at + 15
        } else {
            at - 1
        };
    }
    Some(value as f64)
}

fn choices(texts: &[&str]) -> Vec<Choice> {
    texts.iter().map(|text| text.parse().unwrap_or_else(|error| panic!("{error}"))).collect()
}

fn hear(map: &mut SignalMap, ms: u64, id: FrameId, data: &[u8]) -> Vec<Heard> {
    let frame = Frame::data(id, data).unwrap();
    map.receive(&StampedFrame { time: Duration::from_millis(ms), direction: Direction::Received, frame })
        .collect()
}

#[test]
fn chosen_signals_become_readings() {
    let chosen = choices(&[
        "pitch_rad=Imu.Pitch",
        "pitch_rate_rad_s=Rate",
        "motor_speed_left_rad_s=LeftSpeed*-0.10471975511965977",
        "torque_left_nm=LeftTorque",
        "motor_temperature_left_c=Temperature",
        "motor_angle_right_rad=Floats.Single",
    ]);
    let mut map = SignalMap::new(&dbc(), &chosen, 0.32).unwrap();

    let imu = hear(&mut map, 1, FrameId::Standard(256), &[0xD4, 0xFE, 0x01, 0x02, 0, 0, 0, 0]);
    let [Heard::Imu(reading)] = imu[..] else { panic!("{imu:?}") };
    assert!((reading.pitch_rad.to_degrees() + 3.0).abs() < 1e-9);
    assert!((reading.pitch_rate_rad_s.to_degrees() - 25.8).abs() < 1e-9);

    // 60 rpm backward in 0.1 rpm, 640 mN m, 40 °C: a turn a second.
    let wheel = [1, 0x58, 0x02, 0x80, 0x02, 0, 0, 40];
    let id = FrameId::Extended(257);
    for (ms, angle) in [(1000, 0.0), (2000, -std::f64::consts::TAU)] {
        let left = hear(&mut map, ms, id, &wheel);
        let [Heard::Motor(MotorEvent::State(Motor::Left, state))] = left[..] else { panic!("{left:?}") };
        assert!((state.speed_rad_s + std::f64::consts::TAU).abs() < 1e-9, "{state:?}");
        assert!((state.angle_rad - angle).abs() < 1e-9, "{state:?}");
        assert_eq!((state.current_a, state.temperature_c), (2.0, 40.0));
    }
    assert_eq!(hear(&mut map, 2000, FrameId::Standard(257), &wheel), [], "the other kind of identifier");
    assert_eq!(hear(&mut map, 2000, id, &[2, 0, 0, 0, 0, 0, 0, 0]), [], "not selected");

    // An angle alone: its rate is the difference.
    for (ms, angle, speed) in [(10, 1.0_f32, 0.0), (20, 1.5, 50.0), (20, 1.5, 50.0)] {
        let [a, b, c, d] = angle.to_le_bytes();
        let right = hear(&mut map, ms, FrameId::Standard(258), &[a, b, c, d, 0, 0, 0, 0]);
        let [Heard::Motor(MotorEvent::State(Motor::Right, state))] = right[..] else { panic!("{right:?}") };
        assert_eq!((state.angle_rad, state.current_a), (f64::from(angle), 0.0));
        assert!((state.speed_rad_s - speed).abs() < 1e-9 && state.temperature_c.is_nan(), "{state:?}");
    }
}

#[test]
fn a_value_that_is_no_number_tells_nothing_and_does_not_stay() {
    let mut map = SignalMap::new(&dbc(), &choices(&["motor_speed_right=Floats.Single*1"]), 1.0).unwrap();
    let mut speed = |ms, value: f32| {
        let [a, b, c, d] = value.to_le_bytes();
        match hear(&mut map, ms, FrameId::Standard(258), &[a, b, c, d, 0, 0, 0, 0])[..] {
            [] => None,
            [Heard::Motor(MotorEvent::State(Motor::Right, state))] => {
                Some((state.angle_rad, state.speed_rad_s))
            }
            ref other => panic!("{other:?}"),
        }
    };
    assert_eq!(speed(1000, 2.0), Some((0.0, 2.0)));
    for (ms, value) in [(1250, f32::NAN), (1500, f32::INFINITY), (1750, f32::NEG_INFINITY)] {
        assert_eq!(speed(ms, value), None);
    }
    assert_eq!(speed(2000, 4.0), Some((3.0, 4.0)), "the mean of 2 and 4 rad/s for the second in between");
}

#[test]
fn motors_of_which_nothing_moves_are_named() {
    let missing = |texts: &[&str]| SignalMap::new(&dbc(), &choices(texts), 1.0).unwrap().missing_motor();
    assert_eq!(missing(&["pitch=Imu.Pitch", "torque_left=LeftTorque"]), Some(Motor::Left));
    assert_eq!(missing(&["motor_speed_left=LeftSpeed"]), Some(Motor::Right));
    let both = ["motor_speed_left=LeftSpeed", "motor_angle_right=Floats.Single"];
    assert_eq!(missing(&both), None);
    let has_pitch = |texts: &[&str]| SignalMap::new(&dbc(), &choices(texts), 1.0).unwrap().has_pitch();
    let torque = SignalMap::new(&dbc(), &choices(&["torque_left=LeftTorque"]), 1.0).unwrap();
    assert_eq!(Motor::BOTH.map(|motor| torque.has_torque(motor)), [true, false]);
    assert!(!has_pitch(&both) && has_pitch(&["pitch_rate=Rate"]));
}

#[test]
fn wrong_choices_are_named() {
    let refused = |text: &str| SignalMap::new(&dbc(), &choices(&[text]), 1.0).unwrap_err().to_string();
    for (text, message) in [
        ("pitch_rad=Nothing", "the file has no signal Nothing for pitch_rad: choose one of its signals"),
        ("pitch_rad=Pitch", "the messages Imu and Floats both have a signal Pitch: write Imu.Pitch"),
        (
            "pitch_rad=Floats.Pitch",
            "the unit `furlong` of Floats.Pitch does not determine its scale as pitch_rad: add *FACTOR",
        ),
        ("pitch_rad=Far", "the signal Far is outside the 8 bytes of a classic CAN frame"),
    ] {
        assert_eq!(refused(text), message);
    }
    let twice = choices(&["pitch_rad=Imu.Pitch", "pitch_rad=Rate*1"]);
    assert!(matches!(SignalMap::new(&dbc(), &twice, 1.0), Err(ChoiceError::Twice { .. })));
    for text in
        ["pitch_rad", "pitch_rad=", "pitch_rad=.x", "pitch_rad=x.", "pitch_rad=x*y", "pitch_rad=x*inf"]
    {
        assert!(matches!(text.parse::<Choice>(), Err(ChoiceSyntaxError::Form { .. })), "{text}");
    }
    for unknown in ["lean", "pitch_", "motor_speed", "rad", ""] {
        let message = format!("{unknown}=Imu.Pitch").parse::<Choice>().unwrap_err().to_string();
        let expected = format!("unknown column `{unknown}`: use one of pitch_rad, ");
        assert!(message.starts_with(&expected), "{message}");
    }
}

#[test]
fn quantities_may_be_named_without_their_unit() {
    for (quantity, name) in Quantity::NAMES {
        assert_eq!(choices(&[&format!("{name}=x")])[0].quantity, quantity);
    }
    for (short, name) in [
        ("pitch", "pitch_rad"),
        ("pitch_rate", "pitch_rate_rad_s"),
        ("motor_angle_left", "motor_angle_left_rad"),
        ("motor_speed_right", "motor_speed_right_rad_s"),
        ("torque_left", "torque_left_nm"),
        ("motor_temperature_right", "motor_temperature_right_c"),
    ] {
        assert_eq!(choices(&[&format!("{short}=x")]), choices(&[&format!("{name}=x")]), "{short}");
    }
}

#[test]
fn units_are_worth_what_they_say() {
    use Quantity::*;
    for (quantity, unit, factor) in [
        (Pitch, "°", Some(0.017_453_292_519_943_295)),
        (Pitch, "deg/s", None),
        (PitchRate, "DPS", Some(0.017_453_292_519_943_295)),
        (Speed(Motor::Left), "rpm", Some(0.104_719_755_119_659_77)),
        (Angle(Motor::Right), "rev", Some(std::f64::consts::TAU)),
        (Torque(Motor::Left), "N·m", Some(1.0)),
        (Torque(Motor::Left), "N*m", Some(1.0)),
        (Torque(Motor::Left), "A", None),
        (Temperature(Motor::Left), "°C", Some(1.0)),
        (Pitch, "", None),
    ] {
        assert_eq!(quantity.factor_from_unit(unit), factor, "{quantity} {unit}");
    }
}

#[test]
fn what_is_no_dbc_is_told_with_its_place() {
    let broken = FILE.replace("SG_ Rate : 23|16@0-", "SG_ Rate : 23|16@2-");
    let error = Dbc::parse(&broken).unwrap_err().to_string();
    assert!(error.contains("not a DBC file") && error.contains("14:"), "{error}");
    let bytes = LARGEST_FILE_BYTES + 1;
    assert_eq!(Dbc::parse(&" ".repeat(bytes)), Err(DbcError::TooLarge { bytes }));
}

/// Files with flipped bits and torn ends, and noise: never a panic, neither in reading nor in decoding.
#[test]
fn flipped_files_do_no_harm() {
    let mut random = ChaCha8Rng::seed_from_u64(0xF11E);
    let mut read = 0;
    for _ in 0..400 {
        let mut bytes = FILE.as_bytes().to_vec();
        let bit = random.next_u32() as usize % (8 * bytes.len());
        bytes[bit / 8] ^= 1 << (bit % 8);
        if random.next_u32().is_multiple_of(8) {
            bytes.truncate(random.next_u32() as usize % bytes.len());
        }
        let Ok(dbc) = Dbc::parse(&String::from_utf8_lossy(&bytes)) else { continue };
        read += 1;
        for message in dbc.messages() {
            for length in 0..=8 {
                let data = random.next_u64().to_le_bytes();
                message.values(&Frame::data(message.id, &data[..length]).unwrap()).for_each(drop);
            }
        }
    }
    assert!(read > 50, "{read}");
    let mut noise = vec![0; 100_000];
    random.fill_bytes(&mut noise);
    assert!(Dbc::parse(&String::from_utf8_lossy(&noise)).is_err());
}
