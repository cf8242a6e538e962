//! The emulated robot as another program meets it: on pseudo-terminals.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use flqr_core::link::{
    Frame, FrameId, jy901,
    lk::{self, MotorId, Reply},
    slcan::{self, Answer, AnswerDecoder},
};
use flqr_core::model::StateLayout;
use serde_json::Value;

/// `flqr emulate` with its standard input, which it watches.
struct Emulator {
    program: Child,
    ports: Value,
}

impl Emulator {
    fn start(arguments: &[&str]) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_flqr"))
            .args(["emulate", "--json", "--seconds", "60"])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(program.stdout.take().unwrap()).read_line(&mut line).unwrap();
        Self { program, ports: serde_json::from_str(&line).unwrap() }
    }

    fn open(&self, port: &str) -> File {
        let path = self.ports[port].as_str().unwrap();
        OpenOptions::new().read(true).write(true).open(path).unwrap()
    }

    /// Closes the standard input; the program ends by itself and says what it has done.
    fn end(mut self) -> String {
        drop(self.program.stdin.take());
        let mut message = String::new();
        self.program.stderr.take().unwrap().read_to_string(&mut message).unwrap();
        assert!(self.program.wait().unwrap().success(), "{message}");
        message
    }
}

/// The computer's end of an SLCAN line.
struct Host {
    port: File,
    decoder: AnswerDecoder,
    bytes: Vec<u8>,
    read: usize,
}

impl Host {
    fn open(emulator: &Emulator, bit_rate: u32) -> Self {
        let mut host = Self {
            port: emulator.open("slcan"),
            decoder: AnswerDecoder::default(),
            bytes: Vec::new(),
            read: 0,
        };
        let [_, rate, open] = slcan::opening(bit_rate, false).unwrap();
        for command in [rate, open] {
            host.tell(&command);
            assert_eq!(host.next(), Answer::Done);
        }
        host
    }

    fn tell(&mut self, command: &slcan::Command) {
        self.port.write_all(&command.encode()).unwrap();
    }

    fn next(&mut self) -> Answer {
        loop {
            let mut left = &self.bytes[self.read..];
            let answer = self.decoder.next(&mut left);
            self.read = self.bytes.len() - left.len();
            if let Some(answer) = answer {
                return answer;
            }
            let mut buffer = [0; 4096];
            let count = self.port.read(&mut buffer).unwrap();
            assert!(count > 0, "the port was closed");
            self.bytes = buffer[..count].to_vec();
            self.read = 0;
        }
    }

    /// The next frame of an identifier.
    fn frame(&mut self, wanted: impl Fn(FrameId) -> bool) -> Frame {
        loop {
            match self.next() {
                Answer::Frame { frame, .. } if wanted(frame.id()) => return frame,
                _ => {}
            }
        }
    }

    fn ask(&mut self, motor: MotorId, command: lk::Command) -> Reply {
        self.tell(&slcan::Command::Send(command.frame(motor)));
        let frame = self.frame(|id| id == motor.command_id());
        Reply::decode(frame.bytes().try_into().unwrap(), StateLayout::Current).unwrap()
    }
}

#[test]
fn motors_and_imu_answer_and_clients_come_and_go() {
    let emulator = Emulator::start(&["presets/paper.toml", "--seed", "7"]);
    assert_eq!(emulator.ports["seed"], 7);
    let motor = MotorId::new(1).unwrap();
    for _ in 0..2 {
        let mut host = Host::open(&emulator, 1_000_000);
        assert!(matches!(host.ask(motor, lk::Command::ReadState2), Reply::State2 { command: 0x9C, .. }));
        host.tell(&slcan::Command::Close);
        while host.next() != Answer::Done {}
    }
    // One that is gone without closing: the next one closes first.
    drop(Host::open(&emulator, 1_000_000));
    let mut port = emulator.open("slcan");
    for command in slcan::opening(500_000, true).unwrap() {
        port.write_all(&command.encode()).unwrap();
    }
    let mut heard = String::new();
    while !heard.contains("sp128000") {
        let mut buffer = [0; 256];
        let count = port.read(&mut buffer).unwrap();
        heard += std::str::from_utf8(&buffer[..count]).unwrap();
    }
    let mut imu = emulator.open("imu");
    let mut decoder = jy901::Decoder::new();
    imu.write_all(&jy901::configure(200.0, 115_200, jy901::Content::BALANCE).unwrap().concat()).unwrap();
    imu.write_all(&jy901::read_registers(0x03).encode()).unwrap();
    let mut registers = None;
    while registers.is_none() {
        let mut buffer = [0; 256];
        let count = imu.read(&mut buffer).unwrap();
        decoder.push(Duration::ZERO, &buffer[..count]);
        while let Some((_, packet)) = decoder.next() {
            if let jy901::Reading::Registers(words) = packet.reading() {
                registers = Some(words);
            }
        }
    }
    assert_eq!(registers, Some([0x0B, 0x06, 0, 0]));
    assert_eq!((decoder.corrupted(), decoder.stray()), (0, 0));
    emulator.end();
}

#[test]
fn an_imu_is_set_up_once_that_is_agreed_to() {
    let emulator = Emulator::start(&["--imu"]);
    let imu = format!("serial:{}@115200", emulator.ports["imu"].as_str().unwrap());
    let set_up = |more: &[&str]| {
        let program = Command::new(env!("CARGO_BIN_EXE_flqr"))
            .args(["imu", &imu, "--baud", "115200", "--json"])
            .args(more)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let message = String::from_utf8(program.stderr).unwrap();
        let answer = serde_json::from_slice::<Value>(&program.stdout).unwrap();
        if answer.get("error").is_some() { Err(message) } else { Ok(answer) }
    };
    let refused = set_up(&["--rate", "50"]).unwrap_err();
    assert!(refused.contains("at 115200 baud") && refused.contains("write permanently: 50 Hz"), "{refused}");
    assert!(refused.contains("add --yes"), "{refused}");
    assert!(set_up(&["--rate", "60", "--yes"]).unwrap_err().contains("does not support 60 Hz"));
    let set = set_up(&["--rate", "50", "--yes"]).unwrap();
    let rate_hz = |when: &str| set[when]["rate_hz"].as_f64().unwrap();
    assert!((90.0..110.0).contains(&rate_hz("before")), "the refused one wrote nothing: {set}");
    assert!((45.0..55.0).contains(&rate_hz("after")), "{set}");
    assert_eq!(set["after"]["packets"], serde_json::json!(["acceleration", "rate", "angle"]));
    emulator.end();
}

/// Its motors say nothing, for nobody asks them, but its IMU does.
#[test]
fn a_monitor_is_connected_only_where_the_source_that_was_named_is_heard() {
    let emulator = Emulator::start(&[]);
    let port = |name: &str| emulator.ports[name].as_str().unwrap().to_owned();
    let output = Command::new(env!("CARGO_BIN_EXE_flqr"))
        .args(["monitor", &format!("slcan:{}", port("slcan"))])
        .args(["--imu", &format!("serial:{}@115200", port("imu")), "--seconds", "2", "--json"])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let status: Vec<&Value> = lines.iter().filter(|line| line["type"] == "status").collect();
    assert!(status.last().unwrap()["imu"]["packets"].as_u64().unwrap() > 100, "{text}");
    assert!(status.iter().all(|line| line["connection"] == "silent" && line["hint"].is_string()), "{text}");
    emulator.end();
}

#[test]
fn of_a_full_bus_no_frame_is_lost_on_the_way_to_the_client() {
    let emulator = Emulator::start(&["--slcan", "--flood", "8000"]);
    assert_eq!(emulator.ports["imu"], Value::Null);
    let mut host = Host::open(&emulator, 1_000_000);
    let number = |host: &mut Host| {
        let frame = host.frame(|id| !(0x140..0x1C0).contains(&id.raw()));
        u32::from_le_bytes(frame.bytes()[..4].try_into().unwrap())
    };
    let first = number(&mut host);
    for expected in first + 1..first + 16_000 {
        assert_eq!(number(&mut host), expected);
    }
    host.tell(&slcan::Command::Close);
    let message = emulator.end();
    assert!(message.contains(" 0 not read by the SLCAN client"), "{message}");
}

#[test]
fn what_cannot_be_emulated_is_refused() {
    for (arguments, code, said) in [
        (vec!["--fault", "left-breaks@3"], 2, "left-vanishes@10"),
        (vec!["--actual", "colour=3"], 1, "unknown field `colour`"),
        (vec!["--actual", "left_motor_id=2"], 1, "right_motor_id"),
        (vec!["--actual", "left_motor_id"], 2, "KEY=VALUE"),
        (vec!["--balancing", "--wheels-in-air"], 2, "cannot be used with"),
        (vec!["--reply-id", "0x200"], 2, "0x140 or 0x180"),
        (vec!["--can", "no-such-can"], 1, "no-such-can"),
        (vec!["no-such-file.toml"], 1, "no-such-file.toml"),
    ] {
        let program =
            Command::new(env!("CARGO_BIN_EXE_flqr")).arg("emulate").args(&arguments).output().unwrap();
        let message = String::from_utf8(program.stderr).unwrap();
        assert_eq!(program.status.code(), Some(code), "{arguments:?}: {message}");
        assert!(message.contains(said) || said == "left-vanishes@10", "{arguments:?}: {message}");
    }
}
