//! A robot that is watched or driven, on threads of its own.

mod hearing;
mod link;
mod publisher;
mod rate;
mod tally;
mod types;
mod wire;
mod worker;

pub use publisher::Waker;
pub use types::{
    Connection, Counters, DriveStatus, Event, EventKind, ImuStatus, MotorStatus, RecordingStatus,
    SerialAddress, SerialAddressError, SessionMode, SessionOptions, SessionOrder, Source, SourceError,
    Status, Timing, Update,
};

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, SystemTime};

use super::{Clock, OpenError, Pacer, hurry, open_bus, open_imu};
use crate::control::drive::{Drive, DriveError, DriveSettings, Excitation, Listener};
use crate::control::{BalanceController, ControlError, ControllerKind};
use crate::link::{Emulator, EmulatorSettings, MotorOrder, Wheels};
use crate::lqr;
use crate::model_file::RobotModel;
use crate::record::recording::About;
use crate::simulate::SimulationError;
use hearing::Hearing;
use link::{Heard, Link};
use publisher::Publisher;
use tally::Tally;
use wire::Wire;
use worker::{Recording, Role, TICK, Worker};

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
    /// Recordings are read as files.
    #[error(
        "recordings cannot be replayed yet: open the robot log as a file, or convert it with flqr convert"
    )]
    Replay,
    /// The system gives no thread.
    #[error("no thread for the robot: {0}")]
    Thread(#[from] std::io::Error),
}

/// Handle of a running session. Dropping it switches the motors off, if it has switched them on, and ends
/// everything.
pub struct Session {
    /// None once it is being dropped.
    orders: Option<SyncSender<SessionOrder>>,
    /// Orders that did not fit into the channel; none is ever dropped.
    waiting: VecDeque<SessionOrder>,
    updates: Receiver<Update>,
    thread: Option<JoinHandle<()>>,
}

impl Session {
    /// Opens the source and starts the threads. `wake` is called on one of them whenever an update is there.
    /// May take as long as the system needs to open its ports.
    ///
    /// # Errors
    /// [`SessionError`]; then nothing is left open.
    pub fn open(options: SessionOptions, wake: Waker) -> Result<Self, SessionError> {
        let clock = Clock::start();
        let (order_sender, orders) = sync_channel(ORDERS);
        let (update_sender, updates) = sync_channel(UPDATES);
        let link = open_link(&options, clock)?;
        let mut recording = Recording {
            recorder: None,
            input: None,
            about: About {
                source: options.source.to_string(),
                interface: options.source.interface(),
                start: clock.epoch().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default(),
            },
            bench: matches!(
                options.mode,
                SessionMode::Drive {
                    excitation: Excitation::SpeedSweep { .. } | Excitation::Multisine { .. },
                    ..
                }
            ),
        };
        if let Some(name) = &options.record {
            recording.start(name).map_err(SessionError::Recording)?;
        }
        let worker = Worker {
            link,
            role: role(&options)?,
            hearing: Hearing::new(&options.robot.link),
            heard: Heard::default(),
            pacer: Pacer::new(clock, TICK),
            tally: Tally::new(options.source.bit_rate()),
            recording,
            orders,
            drive_orders: Vec::new(),
            publisher: Publisher::new(update_sender, wake),
        };
        let thread = Builder::new().name("control".to_owned()).spawn(move || {
            hurry();
            worker.work();
        })?;
        Ok(Self { orders: Some(order_sender), waiting: VecDeque::new(), updates, thread: Some(thread) })
    }

    /// Hands an order over without waiting.
    pub fn send(&mut self, order: SessionOrder) {
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

    /// Whether its threads have ended although nobody asked for it: a fault of this program.
    pub fn has_died(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // One that panicked has ended as well; the sending thread has then switched the motors off.
            thread.join().unwrap_or(());
        }
    }
}

fn open_link(options: &SessionOptions, clock: Clock) -> Result<Link, SessionError> {
    let listens = options.mode == SessionMode::Listen;
    match &options.source {
        Source::Can { .. } | Source::Slcan { .. } => {
            let bus = open_bus(&options.source, listens, &clock)?;
            let imu = options.imu.as_ref().map(open_imu).transpose()?;
            let wheels = Wheels::new(&options.robot.link);
            let off = [MotorOrder::Torque([0.0; 2]), MotorOrder::Off];
            let farewell = off.iter().flat_map(|order| wheels.frames(order)).collect();
            Ok(Link::Wire(Wire::start(clock, bus, imu, farewell)?))
        }
        Source::Emulated => {
            let settings = EmulatorSettings {
                seed: options.seed,
                wheels_in_air: options.mode.wheels_in_air(),
                on_board: if listens { on_board(&options.robot)? } else { None },
                ..EmulatorSettings::default()
            };
            Ok(Link::Emulated(Box::new(Emulator::new(&options.robot, settings)?)))
        }
        Source::Replay { .. } => Err(SessionError::Replay),
    }
}

/// The controller of an emulated robot that is only listened to; none where its model makes none, so that it
/// stays on its stand.
fn on_board(robot: &RobotModel) -> Result<Option<BalanceController>, ControlError> {
    let gain = robot.weights.and_then(|weights| lqr::design(&robot.parameters.linear_model(), &weights).ok());
    let kind =
        if robot.friction.iter().any(Option::is_some) { ControllerKind::Flqr } else { ControllerKind::Lqr };
    gain.map(|design| BalanceController::new(kind, robot, design.gain)).transpose()
}

fn role(options: &SessionOptions) -> Result<Role, DriveError> {
    Ok(match &options.mode {
        SessionMode::Listen => Role::Listen(Box::new(Listener::new(&options.robot))),
        SessionMode::Drive { controller, excitation } => Role::Drive(Box::new(Drive::new(
            &options.robot,
            (**controller).clone(),
            *excitation,
            DriveSettings::default(),
        )?)),
    })
}
