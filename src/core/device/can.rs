//! CAN interfaces of Linux (SocketCAN).

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{setsockopt, sockopt};
use socketcan::{
    CanFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, ShouldRetry, Socket, SocketOptions, StandardId,
};

use super::bus_health::{BusHealth, BusState};
use super::interfaces;
use super::open_error::OpenError;
use crate::link::{Bus, BusError, Direction, Frame, FrameId, FrameKind, StampedFrame};

/// Bytes of the receive buffer that are requested: half a second of a full bus, where the kernel takes about 1 kB a
/// frame. Without a privilege it gives less (`net.core.rmem_max`).
const RECEIVE_BUFFER: usize = 4 << 20;

/// Time between two looks at the kernel's count of dropped frames.
const DROP_CHECK: Duration = Duration::from_millis(20);

/// A raw CAN socket bound to one interface. It hears the frames of all other programs and error frames, not its own.
#[derive(Debug)]
pub struct SocketCan {
    socket: CanSocket,
    name: String,
    listen_only: bool,
    health: Arc<BusHealth>,
    drops: Drops,
    newest: Duration,
}

/// The kernel's count of frames that found the receive buffer full.
#[derive(Clone, Copy, Debug, Default)]
struct Drops {
    counted: u32,
    next_check: Duration,
}

impl SocketCan {
    /// Opens an interface; with `listen_only` it never sends. Listening is this program's promise: the controller
    /// itself still acknowledges frames, unless the interface was set up with `listen-only on`.
    ///
    /// # Errors
    /// [`OpenError`] names what is missing and its remedy.
    pub fn open(name: &str, listen_only: bool, health: Arc<BusHealth>) -> Result<Self, OpenError> {
        let socket = CanSocket::open(name).map_err(|error| why_closed(name, &error))?;
        interfaces::require_up(name)?;
        let failed =
            |error: io::Error| OpenError::Failed { name: name.to_owned(), reason: error.to_string() };
        socket.set_nonblocking(true).map_err(failed)?;
        socket.set_error_filter_accept_all().map_err(failed)?;
        socket.set_recv_timestamp(true).map_err(failed)?;
        let bus = Self {
            socket,
            name: name.to_owned(),
            listen_only,
            health,
            drops: Drops::default(),
            newest: Duration::ZERO,
        };
        bus.set_receive_buffer(RECEIVE_BUFFER)?;
        bus.health.set_hint(hint(name, BusState::ErrorActive));
        Ok(bus)
    }

    /// A second handle for another thread. Frames that it sends are not received by this one.
    ///
    /// # Errors
    /// [`OpenError::Failed`].
    pub fn try_clone(&self) -> Result<Self, OpenError> {
        let socket = self
            .socket
            .as_raw_socket()
            .try_clone()
            .map_err(|error| OpenError::Failed { name: self.name.clone(), reason: error.to_string() })?;
        Ok(Self {
            socket: CanSocket::from(OwnedFd::from(socket)),
            name: self.name.clone(),
            listen_only: self.listen_only,
            health: Arc::clone(&self.health),
            drops: self.drops,
            newest: self.newest,
        })
    }

    /// Asks the kernel for a receive buffer of about that many bytes.
    ///
    /// # Errors
    /// [`OpenError::Failed`].
    pub fn set_receive_buffer(&self, bytes: usize) -> Result<(), OpenError> {
        setsockopt(&self.socket, sockopt::RcvBufForce, &bytes)
            .or_else(|_| setsockopt(&self.socket, sockopt::RcvBuf, &bytes))
            .map_err(|error| OpenError::Failed { name: self.name.clone(), reason: error.to_string() })
    }

    fn count_drops(&mut self, now: Duration) {
        if now < self.drops.next_check {
            return;
        }
        self.drops.next_check = now + DROP_CHECK;
        if let Some(total) = kernel_drops(&self.socket) {
            self.health.add_dropped(u64::from(total.wrapping_sub(self.drops.counted)));
            self.drops.counted = total;
        }
    }

    /// Session time of a frame's arrival at the socket. The kernel stamps by the system's time, which may jump: an
    /// age that cannot be is taken as none. Times never go back.
    fn arrival(&mut self, now: Duration, stamp: Option<SystemTime>) -> Duration {
        let age = stamp.and_then(|stamp| SystemTime::now().duration_since(stamp).ok());
        let age = age.filter(|age| *age < Duration::from_secs(1)).unwrap_or_default();
        self.newest = self.newest.max(now.saturating_sub(age));
        self.newest
    }

    fn broken(&self, error: &io::Error) -> BusError {
        let (name, reason) = (self.name.clone(), error.to_string());
        match error.raw_os_error().map(Errno::from_raw) {
            Some(Errno::ENOBUFS | Errno::EAGAIN) => BusError::Full { name },
            Some(Errno::ENETDOWN) => BusError::Gone { name, reason: "the interface was set down".to_owned() },
            Some(Errno::ENODEV | Errno::ENXIO) => {
                BusError::Gone { name, reason: "the interface was unplugged or removed".to_owned() }
            }
            _ => BusError::Failed { name, reason },
        }
    }
}

impl Bus for SocketCan {
    fn send(&mut self, _: Duration, frame: &Frame) -> Result<(), BusError> {
        if self.listen_only {
            return Err(BusError::ListensOnly { name: self.name.clone() });
        }
        let Some(frame) = to_socket(frame) else {
            let reason = "only interfaces send error frames".to_owned();
            return Err(BusError::Failed { name: self.name.clone(), reason });
        };
        self.socket.write_frame(&frame).map_err(|error| self.broken(&error))
    }

    fn receive(&mut self, now: Duration) -> Result<Option<StampedFrame>, BusError> {
        let received = self.socket.read_frame_with_timestamps();
        self.count_drops(now);
        match received {
            Ok((frame, stamps)) => {
                let time = self.arrival(now, stamps.socket);
                let frame = from_socket(&frame);
                if let Some(frame) = frame.filter(|frame| frame.kind() == FrameKind::Error) {
                    self.health.add_error();
                    if let Some(state) = state_in(&frame) {
                        self.health.set_state(state);
                        self.health.set_hint(hint(&self.name, state));
                    }
                }
                Ok(frame.map(|frame| StampedFrame { time, direction: Direction::Received, frame }))
            }
            Err(error) if error.should_retry() => Ok(None),
            Err(error) => Err(self.broken(&error)),
        }
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), BusError> {
        wait_readable(&self.socket, timeout).map_err(|error| self.broken(&error.into()))
    }
}

/// Sleeps until there is something to read, or an error to be read; rounds up to whole milliseconds.
pub(super) fn wait_readable(source: &impl AsFd, timeout: Duration) -> nix::Result<()> {
    let milliseconds = timeout.as_micros().div_ceil(1000);
    let timeout = PollTimeout::try_from(milliseconds).unwrap_or(PollTimeout::MAX);
    match poll(&mut [PollFd::new(source.as_fd(), PollFlags::POLLIN)], timeout) {
        Ok(_) | Err(Errno::EINTR) => Ok(()),
        Err(error) => Err(error),
    }
}

/// Frames dropped since the socket was opened: `SO_MEMINFO`, its last number (Linux 4.12).
fn kernel_drops(socket: &CanSocket) -> Option<u32> {
    const SOL_SOCKET: i32 = nix::libc::SOL_SOCKET;
    const SO_MEMINFO: i32 = nix::libc::SO_MEMINFO;
    const DROPS: usize = 8;
    let mut numbers = [0; 4 * (DROPS + 1)];
    let length = socket.get_socket_option_bytes(SOL_SOCKET, SO_MEMINFO, &mut numbers).ok()?;
    let drops = numbers[..length].get(4 * DROPS..)?;
    Some(u32::from_ne_bytes(drops.try_into().ok()?))
}

fn to_socket(frame: &Frame) -> Option<CanFrame> {
    let id: Id = match frame.id() {
        FrameId::Standard(id) => StandardId::new(id)?.into(),
        FrameId::Extended(id) => ExtendedId::new(id)?.into(),
    };
    match frame.kind() {
        FrameKind::Data => CanFrame::new(id, frame.bytes()),
        FrameKind::Remote => CanFrame::new_remote(id, usize::from(frame.length())),
        FrameKind::Error => None,
    }
}

fn from_socket(frame: &CanFrame) -> Option<Frame> {
    let id = match frame.id() {
        Id::Standard(id) => FrameId::Standard(id.as_raw()),
        Id::Extended(id) => FrameId::Extended(id.as_raw()),
    };
    match frame {
        CanFrame::Data(_) => Frame::data(id, frame.data()),
        CanFrame::Remote(_) => Frame::remote(id, u8::try_from(frame.dlc()).ok()?),
        CanFrame::Error(error) => {
            let mut details = [0; 8];
            details.iter_mut().zip(frame.data()).for_each(|(detail, byte)| *detail = *byte);
            Frame::error(error.error_bits(), details)
        }
    }
}

/// What an error frame says of the controller's state (Linux, `can/error.h`).
fn state_in(frame: &Frame) -> Option<BusState> {
    const CONTROLLER: u32 = 0x4;
    const BUS_OFF: u32 = 0x40;
    const RESTARTED: u32 = 0x100;
    let (classes, problem) = (frame.id().raw(), frame.bytes()[1]);
    match classes {
        classes if classes & BUS_OFF != 0 => Some(BusState::BusOff),
        classes if classes & CONTROLLER != 0 && problem & 0x30 != 0 => Some(BusState::ErrorPassive),
        classes if classes & CONTROLLER != 0 && problem & 0x0C != 0 => Some(BusState::ErrorWarning),
        classes if classes & CONTROLLER != 0 && problem & 0x40 != 0 => Some(BusState::ErrorActive),
        classes if classes & RESTARTED != 0 => Some(BusState::ErrorActive),
        _ => None,
    }
}

/// What to look at where nothing is received.
fn hint(name: &str, state: BusState) -> String {
    match (state, interfaces::bit_rate(name)) {
        (BusState::BusOff, _) => format!(
            "{name} is BUS-OFF: check bit rate, wiring and termination, then `sudo ip link set {name} type can restart`"
        ),
        (BusState::ErrorPassive, Some(rate)) => format!(
            "{name} is ERROR-PASSIVE at {rate} bit/s: check the bit rate of the robot and the termination at both ends"
        ),
        (_, Some(rate)) => {
            format!("no frames on {name} at {rate} bit/s: check that the robot is on and uses this bit rate")
        }
        (_, None) => format!("no frames on {name}: check that a device is sending there"),
    }
}

fn why_closed(name: &str, error: &io::Error) -> OpenError {
    let interface = name.to_owned();
    match error.raw_os_error().map(Errno::from_raw) {
        // Without CAN in the kernel, or its module: which of these depends on the kernel.
        Some(Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT) => OpenError::NoCan { interface },
        Some(Errno::ENODEV | Errno::ENXIO) => interfaces::why_no_interface(name),
        Some(Errno::EPERM | Errno::EACCES) => OpenError::NoPermission {
            name: interface,
            remedy: "raw CAN sockets are not permitted: run flqr outside of the sandbox or container, \
                   or give the container CAP_NET_RAW"
                .to_owned(),
        },
        _ => OpenError::Failed { name: interface, reason: error.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_frames_tell_the_state() {
        for (classes, problem, state) in [
            (0x40, 0, Some(BusState::BusOff)),
            (0x4, 0x10, Some(BusState::ErrorPassive)),
            (0x4, 0x20, Some(BusState::ErrorPassive)),
            (0x4, 0x04, Some(BusState::ErrorWarning)),
            (0x4, 0x08, Some(BusState::ErrorWarning)),
            (0x4, 0x40, Some(BusState::ErrorActive)),
            (0x100, 0, Some(BusState::ErrorActive)),
            (0x20, 0, None),
        ] {
            let frame = Frame::error(classes, [0, problem, 0, 0, 0, 0, 0, 0]).unwrap();
            assert_eq!(state_in(&frame), state, "{classes:#x} {problem:#x}");
        }
    }

    #[test]
    fn frames_pass_to_the_kernels_form_and_back() {
        let standard = FrameId::standard(0x7FF).unwrap();
        let extended = FrameId::extended(0x12AB_CDEF).unwrap();
        for frame in [
            Frame::data(standard, &[]).unwrap(),
            Frame::data(extended, &[1, 2, 3]).unwrap(),
            Frame::full(standard, [0xA5; 8]),
            Frame::remote(standard, 8).unwrap(),
            Frame::remote(extended, 0).unwrap(),
        ] {
            assert_eq!(from_socket(&to_socket(&frame).unwrap()), Some(frame));
        }
        assert_eq!(to_socket(&Frame::error(0x40, [0; 8]).unwrap()), None);
    }
}
