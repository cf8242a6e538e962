//! A robot that is watched or driven, on threads of its own.

mod counters;
mod decode;
mod files;
mod link;
mod player;
mod publisher;
mod rate;
mod recording;
mod relay;
mod replaying;
mod types;
mod wire;
mod worker;

pub use files::FileError;
pub use publisher::Waker;
pub use types::{
    Connection, Counters, Described, DriveStatus, Ending, Event, EventKind, ImuStatus, MotorStatus,
    RecordingStatus, SerialAddress, SerialAddressError, SessionMode, SessionOptions, SessionOrder, Source,
    SourceError, Status, Timing, Update,
};

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, SystemTime};

use super::pacer::lock_memory;
use super::stop::StopLine;
use super::{Clock, OpenError, Pacer, hurry, open_bus, open_imu};
use crate::control::{
    BalanceController, ControlError, ControllerKind,
    drive::{Drive, DriveError, DriveOrder, DriveSettings, Excitation, Listener},
};
use crate::emulator::{Emulator, EmulatorSettings};
use crate::link::{
    MotorOrder, Wheels,
    dbc::{self, Dbc, SignalMap},
};
use crate::lqr;
use crate::model::{Motor, RobotModel};
use crate::record::{ReplayError, recording::About};
use crate::simulate::SimulationError;
use counters::LinkCounters;
use decode::{FrameDecoder, Signals};
use link::{Heard, Link};
use player::Player;
use publisher::Publisher;
use recording::Recording;
use wire::Wire;
use worker::{Role, TICK, Worker};

/// Orders and updates that wait for the other side.
const ORDERS: usize = 64;
const UPDATES: usize = 64;

/// Why a session could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Bus or port.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A robot that cannot be driven as it is described.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// A robot that cannot be emulated.
    #[error(transparent)]
    Emulated(#[from] SimulationError),
    /// A controller that the emulated robot would need.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// A recording that cannot be made.
    #[error("{0}")]
    Recording(String),
    /// A recording that cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A file that cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A recording has no motors.
    #[error(
        "a recording can be monitored but not driven: give can:INTERFACE, slcan:PORT@BITRATE or emulated instead of {source_name}"
    )]
    ReplayDriven {
        /// The recording.
        source_name: String,
    },
    /// A DBC file, or a choice of its signals, that does not serve.
    #[error("{}: {problem}", file.display())]
    Dbc {
        /// The file.
        file: PathBuf,
        /// What is wrong, and the remedy.
        problem: String,
    },
    /// The system gives no thread.
    #[error("cannot start the robot thread: {0}")]
    Thread(#[from] std::io::Error),
}

/// Handle of a running session. Dropping it switches the motors off, if it has switched them on, and ends
/// everything.
pub struct Session {
    /// None once it is being dropped.
    orders: Option<SyncSender<SessionOrder>>,
    /// Orders that did not fit into the channel; none is ever dropped.
    waiting: VecDeque<SessionOrder>,
    /// Stops are not orders: nothing holds them up.
    stop_line: Arc<StopLine>,
    updates: Receiver<Update>,
    thread: Option<JoinHandle<Ending>>,
}

impl Session {
    /// Opens the source and starts the threads. `wake` is called on one of them whenever an update is there.
    /// May take as long as the system needs to open its ports.
    ///
    /// # Errors
    /// [`SessionError`]; then nothing is left open.
    pub fn open(options: SessionOptions, wake: Waker) -> Result<Self, SessionError> {
        let clock = Clock::start();
        let signals = options.dbc.as_ref().map(|described| signals(described, &options)).transpose()?;
        let mut decoder = FrameDecoder::new(&options.robot.link, signals, options.imu.is_some());
        let (order_sender, orders) = sync_channel(ORDERS);
        let (update_sender, updates) = sync_channel(UPDATES);
        let stop_line = StopLine::register();
        let drives = options.mode != SessionMode::Listen;
        if !drives {
            stop_line.end();
        }
        let link = open_link(&options, clock, &stop_line)?;
        let about = About {
            source: options.source.to_string(),
            interface: options.source.interface(),
            start: clock.epoch().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default(),
        };
        let bench = matches!(
            options.mode,
            SessionMode::Drive {
                excitation: Excitation::SpeedSweep { .. } | Excitation::Multisine { .. },
                ..
            }
        );
        let role = role(&options)?;
        let publisher = if matches!(options.source, Source::Replay { .. }) {
            Publisher::direct(update_sender, wake)
        } else {
            Publisher::relayed(update_sender, wake)?
        };
        // Its files are made when nothing else can fail.
        let mut recording = Recording::new(about, bench);
        if let Some(name) = &options.record {
            recording.start(name).map_err(SessionError::Recording)?;
        }
        if matches!(options.source, Source::Replay { .. }) {
            decoder.wheels = decoder.wheels.telling_sent();
        }
        let worker = Worker {
            link,
            role,
            decoder,
            heard: Heard::default(),
            pacer: Pacer::new(clock, TICK),
            counted: LinkCounters::new(options.source.bit_rate()),
            recording,
            orders,
            stop_line: Arc::clone(&stop_line),
            drive_orders: Vec::new(),
            publisher,
        };
        let thread = Builder::new().name("control".to_owned()).spawn(move || {
            // A recording is in no hurry, and must not keep a core from everybody else.
            if matches!(worker.link, Link::Replay(_)) {
                return worker.replay();
            }
            worker.work(hurry())
        })?;
        if drives {
            lock_memory();
        }
        let (orders, waiting) = (Some(order_sender), VecDeque::new());
        Ok(Self { orders, waiting, stop_line, updates, thread: Some(thread) })
    }

    /// Hands an order over without waiting. A stop overtakes the orders before it.
    pub fn send(&mut self, order: SessionOrder) {
        if order == SessionOrder::Drive(DriveOrder::Stop) {
            return self.stop_line.request();
        }
        self.waiting.push_back(order);
        self.flush();
    }

    fn flush(&mut self) {
        let Some(orders) = &self.orders else { return };
        while let Some(order) = self.waiting.pop_front() {
            if let Err(TrySendError::Full(order)) = orders.try_send(order) {
                self.waiting.push_front(order);
                return;
            }
        }
    }

    /// The updates since the last call, without waiting.
    pub fn poll(&mut self) -> Vec<Update> {
        self.flush();
        self.updates.try_iter().collect()
    }

    /// The next update; none if there is none within the time.
    pub fn wait(&mut self, timeout: Duration) -> Option<Update> {
        self.flush();
        self.updates.recv_timeout(timeout).ok()
    }

    /// Switches the motors off, if it has switched them on, ends everything and returns what the session has come to;
    /// `None` where its thread has ended by a defect of this program.
    pub fn close(mut self) -> Option<Ending> {
        self.end()
    }

    fn end(&mut self) -> Option<Ending> {
        self.orders = None;
        // The thread may have panicked; the sending thread has then switched the motors off.
        self.thread.take()?.join().ok()
    }

    /// Whether its threads have ended although nobody requested it: a fault of this program.
    pub fn has_died(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.end();
    }
}

fn open_link(
    options: &SessionOptions,
    clock: Clock,
    stop_line: &Arc<StopLine>,
) -> Result<Link, SessionError> {
    let listens = options.mode == SessionMode::Listen;
    match &options.source {
        Source::Can { .. } | Source::Slcan { .. } => {
            let bus = open_bus(&options.source, listens, &clock)?;
            let imu = options.imu.as_ref().map(open_imu).transpose()?;
            let mut wheels = Wheels::new(&options.robot.link);
            let off = [MotorOrder::Torque([0.0; 2]), MotorOrder::Off];
            let farewell = off.iter().flat_map(|order| wheels.frames(order)).collect();
            Ok(Link::Wire(Wire::start(clock, bus, imu, farewell, Arc::clone(stop_line))?))
        }
        Source::Emulated => {
            let settings = EmulatorSettings {
                seed: options.seed,
                wheels_in_air: options.mode.wheels_in_air(),
                on_board: if listens { on_board(&options.robot)? } else { None },
                ..EmulatorSettings::default()
            };
            let robot = Emulator::new(&options.robot, settings)?;
            Ok(Link::Emulated(Box::new(robot), Vec::new()))
        }
        Source::Replay { .. } if !listens => {
            Err(SessionError::ReplayDriven { source_name: options.source.to_string() })
        }
        Source::Replay { file } => {
            Ok(Link::Replay(Box::new(Player::open(file, options.replay_speed, clock)?)))
        }
    }
}

/// The controller of an emulated robot that is only listened to; `None` if its model makes none, so that it
/// stays on its stand.
fn on_board(robot: &RobotModel) -> Result<Option<BalanceController>, ControlError> {
    let gain = robot.weights.and_then(|weights| lqr::design(&robot.parameters.linear_model(), &weights).ok());
    let kind =
        if robot.friction.iter().any(Option::is_some) { ControllerKind::Flqr } else { ControllerKind::Lqr };
    gain.map(|design| BalanceController::new(kind, robot, design.gain)).transpose()
}

/// The chosen signals of a robot that a DBC file describes.
fn signals(described: &Described, options: &SessionOptions) -> Result<Signals, SessionError> {
    let refuse = |problem: String| SessionError::Dbc { file: described.file.clone(), problem };
    if options.mode != SessionMode::Listen {
        let problem = "a robot described by a DBC file can only be monitored; driving needs a \
                       motor protocol: leave the file out, or listen only";
        return Err(refuse(problem.to_owned()));
    }
    let text = files::read_text(&described.file, dbc::LARGEST_FILE_BYTES + 1)?;
    let file = Dbc::parse(&text).map_err(|error| refuse(error.to_string()))?;
    let constant_nm_a = torque_constant(options);
    let map = SignalMap::new(&file, &described.signals, constant_nm_a);
    let map = map.map_err(|error| refuse(error.to_string()))?;
    if let Some(motor) = map.missing_motor() {
        return Err(refuse(format!(
            "no signal is selected for the motion of the {motor} motor: add motor_speed_{motor}_rad_s=SIGNAL or \
             motor_angle_{motor}_rad=SIGNAL"
        )));
    }
    if map.has_pitch() && options.imu.is_some() {
        let problem = "the pitch is taken from both its signals and the IMU: leave one of the two out";
        return Err(refuse(problem.to_owned()));
    }
    let has_constant = options.robot.link.torque_constant_nm_a.is_some();
    let tells_current = Motor::BOTH.map(|motor| has_constant && map.has_torque(motor));
    Ok(Signals { map, tells_current })
}

/// Torque constant, N m/A. A robot that a DBC file describes tells torques: without a constant, each ampere that they
/// are turned into is one newton metre.
fn torque_constant(options: &SessionOptions) -> f64 {
    options.robot.link.torque_constant_nm_a.unwrap_or(1.0)
}

fn listener(options: &SessionOptions) -> Listener {
    if options.dbc.is_none() {
        return Listener::new(&options.robot);
    }
    let mut robot = options.robot.clone();
    robot.link.torque_constant_nm_a = Some(torque_constant(options));
    Listener::new(&robot)
}

fn role(options: &SessionOptions) -> Result<Role, DriveError> {
    Ok(match &options.mode {
        SessionMode::Listen => Role::Listen(Box::new(listener(options))),
        SessionMode::Drive { controller, excitation } => Role::Drive(Box::new(Drive::new(
            &options.robot,
            (**controller).clone(),
            *excitation,
            DriveSettings::default(),
        )?)),
    })
}
