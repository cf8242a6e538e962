//! An SLCAN adapter on the robot's bus, from its side.

use std::time::Duration;

use super::Emulator;
use crate::link::{
    Frame, StampedFrame,
    slcan::{Answer, BusErrors, BusState, Command, CommandDecoder, Status, Text, bit_rate_of_code},
};

/// From one report of a bus that does not work to the next.
const REPORTS: Duration = Duration::from_secs(1);
/// Form and stuffing: what a controller of another bit rate sees.
const OTHER_RATE: BusErrors = BusErrors(1 << 4 | 1 << 7);
/// Flags of a controller that is passive and has met errors of the bus.
const FLAGS_PASSIVE: u8 = 1 << 2 | 1 << 5 | 1 << 7;
/// Timestamps start anew at this, ms.
const STAMPS_MS: u128 = 60_000;

/// An adapter that has been plugged in. It obeys as adapters of the maker do: the bit rate is set while closed, frames
/// are taken only while open, and everything else is answered with a bell. At another bit rate than the bus it hears
/// and sends nothing, and reports errors.
#[derive(Clone, Debug, Default)]
pub struct EmulatedAdapter {
    commands: CommandDecoder,
    bit_rate: Option<u32>,
    channel: Channel,
    timestamps: bool,
    auto_poll: bool,
    /// When the trouble that there is was told last.
    reported: Option<Duration>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Channel {
    #[default]
    Closed,
    Open,
    Listening,
}

/// State of the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Trouble {
    OtherRate,
    BusOff,
}

impl EmulatedAdapter {
    /// Bit rate of the robot's bus, bit/s.
    pub const BIT_RATE: u32 = 1_000_000;

    /// Takes in what the computer has sent; commands to the robot go to it, and answers to `out`.
    pub fn receive(&mut self, now: Duration, mut bytes: &[u8], robot: &mut Emulator, out: &mut Vec<u8>) {
        while let Some(command) = self.commands.next(&mut bytes) {
            let answer = match command {
                Ok(Command::Nothing) => continue,
                Ok(Command::Send(frame)) => self.send(now, &frame, robot),
                Ok(command) => self.obey(command),
                Err(_) => Answer::Refused,
            };
            out.extend_from_slice(&answer.encode());
        }
    }

    /// Passes on a frame that is on the bus.
    pub fn hear(&self, heard: &StampedFrame, out: &mut Vec<u8>) {
        if self.channel != Channel::Closed && self.at_the_rate() {
            let stamp_ms = self.timestamps.then_some((heard.time.as_millis() % STAMPS_MS) as u16);
            out.extend_from_slice(&Answer::Frame { frame: heard.frame, stamp_ms }.encode());
        }
    }

    /// Reports a bus that does not work, once a second, and one that works again.
    pub fn report(&mut self, now: Duration, bus_is_off: bool, out: &mut Vec<u8>) {
        if self.channel == Channel::Closed {
            self.reported = None;
            return;
        }
        let status = |state, receive_errors, send_errors| {
            Answer::Status(Status { state, receive_errors, send_errors }).encode()
        };
        match self.trouble(bus_is_off) {
            Some(_) if self.reported.is_some_and(|told| now < told + REPORTS) => {}
            Some(trouble) => {
                self.reported = Some(now);
                if trouble == Trouble::OtherRate {
                    out.extend_from_slice(&Answer::Errors(OTHER_RATE).encode());
                    out.extend_from_slice(&status(BusState::Passive, 128, 0));
                } else {
                    out.extend_from_slice(&status(BusState::Off, 0, 256));
                }
            }
            None if self.reported.take().is_some() => {
                out.extend_from_slice(&status(BusState::Active, 0, 0));
            }
            None => {}
        }
    }

    /// Closes the channel, as one that nobody reads from any more.
    pub fn close(&mut self) {
        self.channel = Channel::Closed;
    }

    /// Returns whether frames are passed on.
    pub fn is_open(&self) -> bool {
        self.channel != Channel::Closed
    }

    fn at_the_rate(&self) -> bool {
        self.bit_rate == Some(Self::BIT_RATE)
    }

    fn trouble(&self, bus_is_off: bool) -> Option<Trouble> {
        match (self.at_the_rate(), bus_is_off) {
            (false, _) => Some(Trouble::OtherRate),
            (true, true) => Some(Trouble::BusOff),
            (true, false) => None,
        }
    }

    fn send(&self, now: Duration, frame: &Frame, robot: &mut Emulator) -> Answer {
        if self.channel != Channel::Open {
            return Answer::Refused;
        }
        if self.at_the_rate() {
            robot.receive(now, frame);
        }
        let extended = matches!(frame.id(), crate::link::FrameId::Extended(_));
        if self.auto_poll { Answer::Taken { extended } } else { Answer::Done }
    }

    fn obey(&mut self, command: Command) -> Answer {
        let closed = self.channel == Channel::Closed;
        match command {
            Command::Version => return text(b"1013").map_or(Answer::Refused, Answer::Version),
            Command::Firmware => return text(b"0100").map_or(Answer::Refused, Answer::Firmware),
            Command::SerialNumber => return text(b"EMUL").map_or(Answer::Refused, Answer::SerialNumber),
            Command::Flags if !closed => {
                return Answer::Flags(if self.at_the_rate() { 0 } else { FLAGS_PASSIVE });
            }
            Command::BitRate(code) if closed && bit_rate_of_code(code).is_some() => {
                self.bit_rate = bit_rate_of_code(code);
            }
            Command::Open if closed && self.bit_rate.is_some() => self.channel = Channel::Open,
            Command::Listen if closed && self.bit_rate.is_some() => self.channel = Channel::Listening,
            Command::Close if !closed => self.close(),
            Command::Timestamps(on) if closed => self.timestamps = on,
            Command::AutoPoll(on) if closed => self.auto_poll = on,
            _ => return Answer::Refused,
        }
        Answer::Done
    }
}

fn text(text: &[u8]) -> Option<Text> {
    Text::new(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::EmulatorSettings;
    use crate::model_file::presets;

    /// Responses of the adapter, line by line, at a time in ms.
    struct Line {
        adapter: EmulatedAdapter,
        robot: Emulator,
    }

    impl Line {
        fn new() -> Self {
            let robot = presets::paper().robot().unwrap().clone();
            let robot = Emulator::new(&robot, EmulatorSettings::default()).unwrap();
            Self { adapter: EmulatedAdapter::default(), robot }
        }

        fn ask(&mut self, ms: u64, text: &str) -> String {
            let now = Duration::from_millis(ms);
            let mut out = Vec::new();
            self.adapter.receive(now, text.as_bytes(), &mut self.robot, &mut out);
            self.robot.advance(now);
            while let Some(frame) = self.robot.frames(now) {
                self.adapter.hear(&frame, &mut out);
            }
            self.adapter.report(now, self.robot.bus_is_off(), &mut out);
            String::from_utf8(out).unwrap()
        }
    }

    #[test]
    fn a_session_is_as_with_a_real_adapter() {
        let mut line = Line::new();
        for (ms, asked, answered) in [
            // Nothing works before it is opened, and it is opened at a bit rate only.
            (0, "t1419C00000000000000\rt1418\rC\rO\rF\r", "\x07\x07\x07\x07\x07"),
            (0, "V\rv\rN\r\rS9\rsFFFF\rM00000000\rq\r", "V1013\rv0100\rNEMUL\r\x07\x07\x07\x07"),
            (1, "Z0\rS8\rL\r", "\r\r\r"),
            (1, "t14189C00000000000000\rL\rO\rS8\rF\rC\r", "\x07\x07\x07\x07F00\r\r"),
            (2, "O\rF\rt14188800000000000000\r", "\rF00\r\r"),
            // The echo of the drive, 0.25 ms later.
            (3, "", "t14188800000000000000\r"),
            (3, "C\rZ1\rX1\rO\rt14288800000000000000\rT00000141100\rr1410\r", "\r\r\r\rz\rZ\rz\r"),
            (4, "", "t142888000000000000000003\r"),
        ] {
            assert_eq!(line.ask(ms, asked), answered, "{asked:?}");
        }
        line.adapter.close();
        assert!(!line.adapter.is_open());
        assert_eq!(line.ask(5, "t14288800000000000000\r"), "\x07");
    }

    #[test]
    fn at_another_bit_rate_nothing_gets_through_and_errors_are_told() {
        let mut line = Line::new();
        assert_eq!(line.ask(0, "S6\rO\r"), "\r\re2fs\rsp128000\r");
        assert_eq!(line.ask(1, "F\rt14188800000000000000\r"), "FA4\r\r");
        assert_eq!(line.ask(999, ""), "");
        assert_eq!(line.ask(1000, ""), "e2fs\rsp128000\r");
        assert_eq!(line.ask(1001, "C\rS8\rO\r"), "\r\r\rsa000000\r");
    }

    #[test]
    fn a_bus_that_is_off_is_told_until_it_is_back() {
        let mut line = Line::new();
        line.ask(0, "S8\rO\r");
        line.robot.inject(crate::emulator::Fault::BusOff);
        assert_eq!(line.ask(1, "t14188800000000000000\r"), "\rsb000256\r");
        assert_eq!(line.ask(900, ""), "");
        line.robot.inject(crate::emulator::Fault::BusOn);
        assert_eq!(line.ask(901, ""), "sa000000\r");
        assert_eq!(line.ask(902, ""), "");
    }
}
