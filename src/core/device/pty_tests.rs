//! Adapters and IMUs on pseudo-terminals.

use std::io::{self, Read, Write};
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use std::{env, fs, process, thread};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serialport::{SerialPort, TTYPort};

use super::*;
use crate::link::jy901::{Content, Decoder, Kind, Packet};
use crate::link::slcan::{Answer, Command, CommandDecoder};
use crate::link::{Bus, BusError, Frame, FrameId};

/// The far end of a pseudo-terminal, and a name that stays when another one takes its place.
struct Pty {
    far: TTYPort,
    /// Kept, so that the far end lives on between two programs on the near one.
    near: TTYPort,
    link: PathBuf,
}

impl Pty {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let link = env::temp_dir().join(format!("flqr-pty-{}-{number}", process::id()));
        let (far, near) = TTYPort::pair().unwrap();
        symlink(near.name().unwrap(), &link).unwrap();
        Self { far, near, link }
    }

    fn name(&self) -> String {
        self.link.to_str().unwrap().to_owned()
    }

    /// Pulls the plug: the name leads nowhere.
    fn unplug(self) -> PathBuf {
        fs::remove_file(&self.link).unwrap();
        self.link
    }

    fn plug_in_at(link: PathBuf) -> Self {
        let (far, near) = TTYPort::pair().unwrap();
        symlink(near.name().unwrap(), &link).unwrap();
        Self { far, near, link }
    }
}

/// Answers an adapter gives to its commands.
type Manners = fn(&Command) -> Option<Answer>;

const POLITE: Manners = |_| Some(Answer::Done);

/// An adapter that answers every line, then sends what it is given; remembers every byte that it was sent.
struct Adapter {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<(TTYPort, Vec<u8>)>,
}

impl Adapter {
    /// `sends` goes out once the adapter is opened.
    fn start(mut far: TTYPort, manners: Manners, sends: Vec<u8>) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            let (mut heard, mut decoder, mut bytes) = (Vec::new(), CommandDecoder::default(), [0; 4096]);
            loop {
                // What was sent before the stop is still on its way.
                let stopping = stopped.load(Ordering::Relaxed);
                far.set_timeout(Duration::from_millis(if stopping { 200 } else { 5 })).unwrap();
                let count = far.read(&mut bytes).unwrap_or(0);
                if stopping && count == 0 {
                    break;
                }
                heard.extend_from_slice(&bytes[..count]);
                let mut input = &bytes[..count];
                while let Some(command) = decoder.next(&mut input) {
                    let command = command.unwrap();
                    manners(&command).iter().for_each(|answer| far.write_all(&answer.encode()).unwrap());
                    if matches!(command, Command::Open | Command::Listen) {
                        send(&mut far, &sends);
                    }
                }
            }
            (far, heard)
        });
        Self { stop, thread }
    }

    fn heard(self) -> (TTYPort, Vec<u8>) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// A pseudo-terminal takes no more than its reader has room for.
fn send(far: &mut TTYPort, mut bytes: &[u8]) {
    while !bytes.is_empty() {
        match far.write(&bytes[..bytes.len().min(977)]) {
            Ok(count) => bytes = &bytes[count..],
            Err(error) => assert_eq!(error.kind(), io::ErrorKind::TimedOut, "{error}"),
        }
    }
}

fn frames(count: u32) -> Vec<Frame> {
    let frame = |number: u32| {
        Frame::full(FrameId::Standard(0x141), [number.to_le_bytes(); 2].concat().try_into().unwrap())
    };
    (0..count).map(frame).collect()
}

fn lines(frames: &[Frame]) -> Vec<u8> {
    frames
        .iter()
        .flat_map(|frame| Answer::Frame { frame: *frame, stamp_ms: None }.encode().to_vec())
        .collect()
}

fn open(port: String, listen_only: bool, clock: &Clock) -> Result<BusPair, OpenError> {
    open_bus(&Source::Slcan { port, bit_rate: 1_000_000 }, listen_only, clock)
}

/// That many frames, or those that have come after a long time.
fn hear(bus: &mut dyn Bus, clock: &Clock, count: usize) -> Vec<Frame> {
    let (mut heard, deadline) = (Vec::new(), clock.now() + Duration::from_secs(30));
    while heard.len() < count && clock.now() < deadline {
        bus.wait(Duration::from_millis(20)).unwrap();
        while let Some(stamped) = bus.receive(clock.now()).unwrap() {
            heard.push(stamped.frame);
        }
    }
    heard
}

#[test]
fn a_listening_session_sends_what_opens_and_closes_the_adapter_and_nothing_else() {
    let (pty, clock, sent) = (Pty::new(), Clock::start(), frames(5000));
    let name = pty.name();
    let adapter = Adapter::start(pty.far, POLITE, lines(&sent));
    let mut bus = open(name, true, &clock).unwrap();
    assert!(bus.writer.is_none());
    assert!(bus.reader.send(clock.now(), &sent[0]).is_err());
    assert_eq!(hear(bus.reader.as_mut(), &clock, sent.len()), sent);
    assert_eq!((bus.health.errors(), bus.health.dropped()), (0, 0));
    drop(bus);
    assert_eq!(adapter.heard().1, b"C\rS8\rL\rC\r");
    fs::remove_file(pty.link).unwrap();
    drop(pty.near);
}

#[test]
fn a_driving_session_sends_frames_that_the_adapter_reads() {
    let (pty, clock, frames) = (Pty::new(), Clock::start(), frames(300));
    let adapter = Adapter::start(pty.far.try_clone_native().unwrap(), POLITE, Vec::new());
    let mut bus = open(pty.name(), false, &clock).unwrap();
    let writer = bus.writer.as_mut().unwrap();
    for frame in &frames {
        while writer.send(clock.now(), frame).is_err() {
            clock.sleep_until(clock.now() + Duration::from_millis(1));
        }
    }
    drop(bus);
    let sent: Vec<u8> = frames.iter().flat_map(|frame| Command::Send(*frame).encode().to_vec()).collect();
    let heard = adapter.heard().1;
    let end = String::from_utf8_lossy(&heard[heard.len().saturating_sub(40)..]);
    assert!(heard == [b"C\rS8\rO\r", &sent[..], b"C\r"].concat(), "{} bytes to {end:?}", heard.len());
    fs::remove_file(&pty.link).unwrap();
}

#[test]
fn an_adapter_that_takes_nothing_is_full_and_nobody_waits_for_it() {
    let (pty, clock) = (Pty::new(), Clock::start());
    let mut bus = open(pty.name(), false, &clock).unwrap();
    let writer = bus.writer.as_mut().unwrap();
    let refused = frames(100_000).iter().find_map(|frame| writer.send(clock.now(), frame).err());
    assert_eq!(refused, Some(BusError::Full { name: pty.name() }));
    assert!(bus.health.hint().unwrap().contains("has not answered"));
    fs::remove_file(&pty.link).unwrap();
}

#[test]
fn an_adapter_that_cannot_listen_is_never_opened_for_sending() {
    let (pty, clock) = (Pty::new(), Clock::start());
    let manners: Manners = |command| {
        let refused = matches!(command, Command::Listen | Command::Close);
        Some(if refused { Answer::Refused } else { Answer::Done })
    };
    let adapter = Adapter::start(pty.far.try_clone_native().unwrap(), manners, Vec::new());
    let refused = open(pty.name(), true, &clock).err().unwrap();
    assert_eq!(refused, OpenError::Refused { port: pty.name(), command: "L".to_owned() });
    // An adapter that is slow to close may refuse the next command, so it is tried again.
    assert_eq!(adapter.heard().1, b"C\rS8\rL\rC\rS8\rL\rC\rS8\rL\rC\r");
    fs::remove_file(&pty.link).unwrap();
}

/// The answer to whoever closed the adapter before, which nobody has read, is not taken for an answer to us.
#[test]
fn answers_to_those_before_are_let_go() {
    let (mut pty, clock) = (Pty::new(), Clock::start());
    pty.far.write_all(b"\rt1412").unwrap();
    let manners: Manners =
        |command| Some(if *command == Command::Close { Answer::Refused } else { Answer::Done });
    let adapter = Adapter::start(pty.far.try_clone_native().unwrap(), manners, Vec::new());
    drop(open(pty.name(), true, &clock).unwrap());
    assert_eq!(adapter.heard().1, b"C\rS8\rL\rC\r");
    fs::remove_file(&pty.link).unwrap();
}

#[test]
fn damage_refusals_and_states_are_counted_and_told() {
    let (pty, clock, good) = (Pty::new(), Clock::start(), frames(2));
    let told = [&lines(&good[..1])[..], b"t141G\r\x07e2fo\rsp130005\r", &lines(&good[1..])[..]].concat();
    let adapter = Adapter::start(pty.far.try_clone_native().unwrap(), POLITE, told);
    let mut bus = open(pty.name(), true, &clock).unwrap();
    assert_eq!(hear(bus.reader.as_mut(), &clock, 2), good);
    assert_eq!((bus.health.errors(), bus.health.dropped()), (3, 1));
    assert_eq!(bus.health.state(), BusState::ErrorPassive);
    assert!(bus.health.hint().unwrap().contains("form, receive overrun"));
    drop(bus);
    adapter.heard();
    fs::remove_file(&pty.link).unwrap();
}

#[test]
fn an_adapter_that_is_unplugged_and_plugged_in_again_resumes_by_itself() {
    let (pty, clock, sent) = (Pty::new(), Clock::start(), frames(20));
    let name = pty.name();
    let adapter = Adapter::start(pty.far.try_clone_native().unwrap(), POLITE, lines(&sent[..10]));
    let mut bus = open(name, true, &clock).unwrap();
    assert_eq!(hear(bus.reader.as_mut(), &clock, 10), sent[..10]);
    drop(adapter.heard());
    let link = pty.unplug();
    bus.reader.wait(Duration::from_millis(20)).unwrap();
    let lost = bus.reader.receive(clock.now());
    assert!(matches!(lost, Err(BusError::Gone { .. })), "{lost:?}");
    assert!(bus.health.lost().is_some());
    let pty = Pty::plug_in_at(link);
    let adapter = Adapter::start(pty.far.try_clone_native().unwrap(), POLITE, lines(&sent[10..]));
    assert_eq!(hear(bus.reader.as_mut(), &clock, 10), sent[10..]);
    assert_eq!((bus.health.lost(), bus.health.reconnects()), (None, 1));
    drop(bus);
    assert_eq!(adapter.heard().1, b"C\rS8\rL\rC\r");
    fs::remove_file(&pty.link).unwrap();
}

#[test]
fn what_cannot_be_opened_is_named_with_its_mend() {
    let (pty, clock) = (Pty::new(), Clock::start());
    let missing = open("/dev/ttyACM77".to_owned(), true, &clock).err().unwrap();
    assert!(matches!(missing, OpenError::NoPort { .. }), "{missing}");
    let rate = Source::Slcan { port: pty.name(), bit_rate: 123_456 };
    assert_eq!(open_bus(&rate, true, &clock).err(), Some(OpenError::BitRate { bit_rate: 123_456 }));
    let first = open_imu(&SerialAddress { port: pty.name(), baud: 115_200 }).unwrap();
    assert_eq!(open(pty.name(), true, &clock).err(), Some(OpenError::InUse { port: pty.name() }));
    drop(first);
    fs::remove_file(&pty.link).unwrap();
}

/// 60 s of an IMU at 200 Hz with three packets a cycle. It begins in the middle of a packet, and one bit of every
/// fiftieth packet is flipped.
#[test]
fn every_intact_packet_of_a_disturbed_imu_arrives_and_every_corrupted_one_is_counted() {
    const TORN: usize = 6;
    let pty = Pty::new();
    let mut random = ChaCha8Rng::seed_from_u64(0x901);
    let (mut stream, mut intact, mut corrupted) = (vec![0x11; TORN], Vec::new(), 0);
    for number in 0..200 * 60 * 3 {
        let kind = [Kind::Acceleration, Kind::Rate, Kind::Angle][number % 3];
        let packet = Packet { kind, data: random.next_u64().to_le_bytes() };
        let mut bytes = packet.encode();
        if random.next_u32() % 50 == 0 {
            let bit = random.next_u32() as usize % (8 * bytes.len());
            bytes[bit / 8] ^= 1 << (bit % 8);
            corrupted += 1;
        } else {
            intact.push(packet);
        }
        stream.extend_from_slice(&bytes);
    }
    let mut port = open_imu(&SerialAddress { port: pty.name(), baud: 115_200 }).unwrap();
    let mut far = pty.far;
    let total = stream.len();
    let sender = thread::spawn(move || {
        send(&mut far, &stream);
        far
    });
    let (mut decoder, mut found, mut read, mut bytes) = (Decoder::new(), Vec::new(), 0, [0; 4096]);
    let clock = Clock::start();
    while read < total && clock.now() < Duration::from_secs(60) {
        let count = port.read(&mut bytes).unwrap();
        decoder.push(clock.now(), &bytes[..count]);
        found.extend(std::iter::from_fn(|| decoder.next()).map(|(_, packet)| packet));
        read += count;
    }
    assert!(corrupted > 500);
    assert_eq!(found, intact);
    assert_eq!((decoder.corrupted(), decoder.stray()), (corrupted, TORN as u64));
    // Nothing was sent to the IMU.
    let mut far = sender.join().unwrap();
    far.set_timeout(Duration::ZERO).unwrap();
    assert!(far.read(&mut bytes).is_err());
    fs::remove_file(&pty.link).unwrap();
}

#[test]
fn an_imu_is_configured_only_when_asked_and_found_again_after_a_loss() {
    let pty = Pty::new();
    let mut port = open_imu(&SerialAddress { port: pty.name(), baud: 9600 }).unwrap();
    port.configure(200.0, 115_200, Content::BALANCE).unwrap();
    let mut far = pty.far.try_clone_native().unwrap();
    let mut written = [0; 25];
    far.read_exact(&mut written).unwrap();
    let expected = crate::link::jy901::configure(200.0, 115_200, Content::BALANCE).unwrap();
    assert_eq!(written.to_vec(), expected.concat());
    drop(far);
    let link = pty.unplug();
    let mut bytes = [0; 16];
    assert!(port.read(&mut bytes).is_err() && !port.is_open());
    assert_eq!(port.read(&mut bytes).unwrap(), 0);
    let mut pty = Pty::plug_in_at(link);
    pty.far.write_all(b"again").unwrap();
    let (clock, mut count) = (Clock::start(), 0);
    while count == 0 && clock.now() < Duration::from_secs(30) {
        count = port.read(&mut bytes).unwrap();
    }
    assert_eq!((&bytes[..count], port.reconnects()), (&b"again"[..], 1));
    fs::remove_file(&pty.link).unwrap();
}
