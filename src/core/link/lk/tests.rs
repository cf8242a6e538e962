use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;
use crate::link::MotorErrors;
use crate::model::StateLayout;

fn motor(number: u8) -> MotorId {
    MotorId::new(number).unwrap()
}

fn bytes(hex: &str) -> [u8; 8] {
    let bytes: Vec<u8> = hex.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
    bytes.try_into().unwrap()
}

#[test]
fn commands_are_the_bytes_of_the_papers() {
    let current = |iq| Command::TorqueCurrent { iq };
    let counter = SenseOfRotation::Counterclockwise;
    // The first four are worked from the papers, the others by their rules.
    let table = [
        (current(388), "A1 00 00 00 84 01 00 00"),
        (current(-194), "A1 00 00 00 3E FF 00 00"),
        (Command::Speed { speed_cdps: 28_648, iq_limit: 0 }, "A2 00 00 00 E8 6F 00 00"),
        (Command::On, "88 00 00 00 00 00 00 00"),
        (Command::Off, "80 00 00 00 00 00 00 00"),
        (Command::Stop, "81 00 00 00 00 00 00 00"),
        (Command::Brake(Brake::Engage), "8C 00 00 00 00 00 00 00"),
        (Command::Brake(Brake::Release), "8C 01 00 00 00 00 00 00"),
        (Command::Brake(Brake::Read), "8C 10 00 00 00 00 00 00"),
        (Command::ReadState1, "9A 00 00 00 00 00 00 00"),
        (Command::ClearErrors, "9B 00 00 00 00 00 00 00"),
        (Command::ReadState2, "9C 00 00 00 00 00 00 00"),
        (Command::ReadState3, "9D 00 00 00 00 00 00 00"),
        (Command::OpenLoop { power: -850 }, "A0 00 00 00 AE FC 00 00"),
        (Command::Speed { speed_cdps: -28_648, iq_limit: 500 }, "A2 00 F4 01 18 90 FF FF"),
        (Command::SpeedLimited { speed_cdps: 1, iq_limit: -1 }, "AD 00 FF FF 01 00 00 00"),
        (Command::Angle { angle_cdeg: -36_000 }, "A3 00 00 00 60 73 FF FF"),
        (Command::AngleLimited { angle_cdeg: 36_000, max_speed_dps: 0xFEDC }, "A4 00 DC FE A0 8C 00 00"),
        (Command::TurnAngle { sense: counter, angle_cdeg: 35_999 }, "A5 01 00 00 9F 8C 00 00"),
        (
            Command::TurnAngleLimited {
                sense: SenseOfRotation::Clockwise,
                angle_cdeg: 100,
                max_speed_dps: 500,
            },
            "A6 00 F4 01 64 00 00 00",
        ),
        (Command::Step { angle_cdeg: -1 }, "A7 00 00 00 FF FF FF FF"),
        (Command::StepLimited { angle_cdeg: 9_000, max_speed_dps: 360 }, "A8 00 68 01 28 23 00 00"),
        (Command::ReadEncoder, "90 00 00 00 00 00 00 00"),
        (Command::ReadAngle, "92 00 00 00 00 00 00 00"),
        (Command::ReadTurnAngle, "94 00 00 00 00 00 00 00"),
        (Command::SetAngle { angle_cdeg: 256 }, "95 00 00 00 00 01 00 00"),
        (Command::WriteZero, "19 00 00 00 00 00 00 00"),
        (Command::WriteOffset { offset: 0xBEEF }, "91 00 00 00 00 00 EF BE"),
        (
            Command::Parameters { access: ParameterAccess::Read236, bytes: [0x0A, 0, 0, 0, 0, 0, 0] },
            "C0 0A 00 00 00 00 00 00",
        ),
        (
            Command::Parameters { access: ParameterAccess::WriteGains, bytes: [0, 1, 2, 3, 4, 5, 6] },
            "31 00 01 02 03 04 05 06",
        ),
    ];
    for (command, hex) in table {
        assert_eq!(command.encode(), bytes(hex), "{command:?}");
        assert_eq!(Command::decode(bytes(hex)), Ok(command), "{hex}");
    }
}

#[test]
fn bytes_that_are_no_command_are_refused_with_the_reason() {
    for hex in [
        "A1 23 36 01 E1 FE 00 C0",
        "A1 01 00 00 84 01 00 00",
        "A1 00 00 00 84 01 01 00",
        "80 00 00 00 00 00 00 01",
        "8C 02 00 00 00 00 00 00",
        "A5 02 00 00 00 00 00 00",
        "91 00 00 00 01 00 00 00",
    ] {
        let command = bytes(hex)[0];
        assert_eq!(Command::decode(bytes(hex)), Err(WireError::InvalidField { command }), "{hex}");
    }
    for code in [0x00, 0xFF] {
        let refused = Err(WireError::UnknownCommand(code));
        assert_eq!(Command::decode([code, 0, 0, 0, 0, 0, 0, 0]), refused);
        assert_eq!(Reply::decode([code; 8], StateLayout::Current), Err(WireError::UnknownCommand(code)));
    }
    for got in 0..8 {
        let frame = Frame::data(motor(1).command_id(), &[0xA1; 8][..got]).unwrap();
        assert_eq!(payload(&frame), Err(WireError::Truncated { needed: 8, got }));
    }
}

#[test]
fn replies_are_the_bytes_of_the_papers() {
    let moving = State2 { temperature_c: 35, iq: 310, speed_dps: -287, encoder: 0xC000 };
    let current = |power| State1::Current {
        temperature_c: 35,
        voltage_cv: 2401,
        current_ca: -35,
        power,
        errors: MotorErrors(8),
    };
    let older = State1::Older { temperature_c: -4, voltage_dv: 0x01F0, errors: MotorErrors(1) };
    let state1 = |command, state| Reply::State1 { command, state };
    // The first three are worked from the papers, the others by their rules.
    let table = [
        (Reply::State2 { command: 0xA1, state: moving }, "A1 23 36 01 E1 FE 00 C0"),
        (state1(0x9A, current(0x00)), "9A 23 61 09 DD FF 00 08"),
        (Reply::Angle { angle_cdeg: -36_000 }, "92 60 73 FF FF FF FF FF"),
        (Reply::Angle { angle_cdeg: 36_000 }, "92 A0 8C 00 00 00 00 00"),
        (Reply::State2 { command: 0x9C, state: moving }, "9C 23 36 01 E1 FE 00 C0"),
        (Reply::State2 { command: 0xAD, state: moving }, "AD 23 36 01 E1 FE 00 C0"),
        (state1(0x9B, current(0x10)), "9B 23 61 09 DD FF 10 08"),
        (
            Reply::State3(PhaseCurrents { temperature_c: -1, currents: [1, -1, 256] }),
            "9D FF 01 00 FF FF 00 01",
        ),
        (Reply::Brake { state: 1 }, "8C 01 00 00 00 00 00 00"),
        (
            Reply::Encoder(Encoder { position: 0x1234, raw: 0xABCD, offset: 0x9999 }),
            "90 00 34 12 CD AB 99 99",
        ),
        (Reply::TurnAngle { angle_cdeg: 359_999 }, "94 00 00 00 3F 7E 05 00"),
        (Reply::Offset { command: 0x19, offset: 0x0102 }, "19 00 00 00 00 00 02 01"),
        (Reply::Echo { bytes: bytes("95 00 00 00 01 00 00 00") }, "95 00 00 00 01 00 00 00"),
    ];
    for (reply, hex) in table {
        assert_eq!(reply.encode(), bytes(hex), "{reply:?}");
        assert_eq!(Reply::decode(bytes(hex), StateLayout::Current), Ok(reply), "{hex}");
    }
    let hex = "9A FC 00 F0 01 00 00 01";
    assert_eq!(state1(0x9A, older).encode(), bytes(hex));
    assert_eq!(Reply::decode(bytes(hex), StateLayout::Older), Ok(state1(0x9A, older)));
    assert_eq!((older.voltage_v(), older.supply_current_a(), older.on()), (49.6, None, None));
    assert_eq!([0x00, 0x10, 0x20].map(|power| current(power).on()), [Some(true), Some(false), None]);
    assert_eq!((current(0).voltage_v(), current(0).supply_current_a()), (24.01, Some(-0.35)));
}

#[test]
fn frames_go_to_and_come_from_the_right_identifiers() {
    let state = State2 { temperature_c: 35, iq: 310, speed_dps: -287, encoder: 0xC000 };
    let reply = Reply::State2 { command: 0xA1, state };
    for (frame, id, told) in [
        (Command::On.frame(motor(1)), 0x141, Address::CommandOrReply(motor(1))),
        (Command::On.frame(motor(32)), 0x160, Address::CommandOrReply(motor(32))),
        (reply.frame(motor(1), ReplyId::Shared), 0x141, Address::CommandOrReply(motor(1))),
        (reply.frame(motor(1), ReplyId::Apart), 0x181, Address::Reply(motor(1))),
        (reply.frame(motor(32), ReplyId::Apart), 0x1A0, Address::Reply(motor(32))),
        (torques_frame([388, -388, 0, 0]), 0x280, Address::Torques),
    ] {
        assert_eq!(frame.id(), FrameId::Standard(id));
        assert_eq!(address(&frame), Some(told));
        assert_eq!(payload(&frame).unwrap(), frame.bytes());
    }
    assert_eq!((MotorId::new(0), MotorId::new(33)), (None, None));
}

#[test]
fn torques_of_all_motors_are_one_frame() {
    let worked = bytes("84 01 7C FE 00 00 00 00");
    assert_eq!(torques_frame([388, -388, 0, 0]).bytes(), worked);
    assert_eq!(torques(worked), [388, -388, 0, 0]);
    assert_eq!(
        torques(torques_frame([1, -2, 2048, -2048]).bytes().try_into().unwrap()),
        [1, -2, 2048, -2048]
    );
}

/// What is read from any bytes is written as those bytes again, but for bytes that a reply does not use.
#[test]
fn ten_million_random_and_flipped_bytes_are_read_without_harm() {
    let mut random = ChaCha8Rng::seed_from_u64(0x4C4B);
    let mut read = [0_u32; 2];
    for round in 0..1_250_000_u32 {
        let mut bytes = random.next_u64().to_le_bytes();
        if round % 2 == 0 {
            bytes = bytes_of_a_command(&bytes);
            let bit = random.next_u32() % 64;
            bytes[bit as usize / 8] ^= 1 << (bit % 8);
        }
        if let Ok(command) = Command::decode(bytes) {
            assert_eq!(command.encode(), bytes);
            read[0] += 1;
        }
        for layout in [StateLayout::Current, StateLayout::Older] {
            if let Ok(reply) = Reply::decode(bytes, layout) {
                assert_eq!(Reply::decode(reply.encode(), layout), Ok(reply));
                read[1] += 1;
            }
        }
    }
    assert!(read[0] > 100_000 && read[1] > 1_000_000, "{read:?}");
}

/// A command that the first bytes choose.
fn bytes_of_a_command(bytes: &[u8; 8]) -> [u8; 8] {
    let [code, value, ..] = *bytes;
    let iq = i16::from(value) - 128;
    let commands = [
        Command::TorqueCurrent { iq },
        Command::On,
        Command::ReadState2,
        Command::Angle { angle_cdeg: i32::from(iq) },
        Command::TurnAngle { sense: SenseOfRotation::Clockwise, angle_cdeg: u32::from(value) },
        Command::WriteOffset { offset: u16::from(value) },
    ];
    commands[usize::from(code) % commands.len()].encode()
}
