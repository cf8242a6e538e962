//! A robot that follows a script: what a test sees and says of it, and windows that are connected to it.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use flqr_core::control::drive::{Check, CheckResult, DriveOrder, Stage, StopReason};
use flqr_core::device::{
    Advice, CanInterface, Connection, Counters, DriveStatus, Ending, ImuStatus, Interfaces, MotorStatus,
    RecordingStatus, SerialPort, SessionOptions, SessionOrder, Status, Timing, Update,
};
use flqr_core::link::{Direction, Frame, FrameId, MotorErrors, MotorHealth, StampedFrame};
use flqr_core::record::Sample;
use flqr_gui::robot::{Devices, RobotFeed};
use flqr_gui::{Tab, WindowOptions};

use super::{SIZE, Window, click, open, options, until};

/// What a test sees and says of the scripted robot.
#[derive(Debug, Default)]
pub(crate) struct Shared {
    pub(crate) opened: Vec<SessionOptions>,
    pub(crate) orders: Vec<SessionOrder>,
    pub(crate) updates: Vec<Update>,
    pub(crate) closed: bool,
    pub(crate) died: bool,
    pub(crate) refuse: Option<String>,
    /// Opening waits until this is false.
    pub(crate) holds_opening: bool,
    /// At the end of a session, the motors have not confirmed that they are off.
    pub(crate) motors_stay_on: bool,
    /// The recording at the end of a session.
    pub(crate) recording: Option<RecordingStatus>,
    pub(crate) can: Vec<CanInterface>,
    pub(crate) serial: Vec<SerialPort>,
    pub(crate) advice: Vec<Advice>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Script(Arc<Mutex<Shared>>);

impl Script {
    pub(crate) fn with<R>(&self, f: impl FnOnce(&mut Shared) -> R) -> R {
        f(&mut self.0.lock().unwrap())
    }

    /// The robot tells something.
    pub(crate) fn tell(&self, update: Update) {
        self.with(|shared| shared.updates.push(update));
    }

    /// Orders to the drive since the last call.
    pub(crate) fn drive_orders(&self) -> Vec<DriveOrder> {
        let orders = self.with(|shared| std::mem::take(&mut shared.orders));
        let drive = |order| match order {
            SessionOrder::Drive(order) => Some(order),
            _ => None,
        };
        orders.into_iter().filter_map(drive).collect()
    }
}

pub(crate) struct ScriptFeed(Script);

impl RobotFeed for ScriptFeed {
    fn send(&mut self, order: SessionOrder) {
        self.0.with(|shared| shared.orders.push(order));
    }

    fn poll(&mut self) -> Vec<Update> {
        self.0.with(|shared| std::mem::take(&mut shared.updates))
    }

    fn has_died(&self) -> bool {
        self.0.with(|shared| shared.died)
    }

    fn close(self: Box<Self>) -> Option<Ending> {
        self.0.with(|shared| {
            let motors_off = !shared.motors_stay_on;
            (!shared.died).then(|| Ending { motors_off, recording: shared.recording.clone() })
        })
    }
}

impl Drop for ScriptFeed {
    fn drop(&mut self) {
        self.0.with(|shared| shared.closed = true);
    }
}

impl Devices for Script {
    fn open(
        &self,
        options: SessionOptions,
        _wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Result<Box<dyn RobotFeed>, String> {
        self.with(|shared| shared.opened.push(options));
        while self.with(|shared| shared.holds_opening) {
            std::thread::yield_now();
        }
        match self.with(|shared| shared.refuse.clone()) {
            Some(problem) => Err(problem),
            None => Ok(Box::new(ScriptFeed(self.clone()))),
        }
    }

    fn interfaces(&self) -> Interfaces {
        self.with(|shared| Interfaces {
            can: shared.can.clone(),
            serial: shared.serial.clone(),
            advice: shared.advice.clone(),
        })
    }
}

pub(crate) fn can(name: &str, command: Option<&str>) -> CanInterface {
    CanInterface {
        name: name.to_owned(),
        up: command.is_none(),
        is_virtual: false,
        state: None,
        bit_rate: Some(500_000),
        send_errors: None,
        receive_errors: None,
        received: 0,
        sent: 0,
        errors: 0,
        dropped: 0,
        command: command.map(str::to_owned),
    }
}

pub(crate) fn usb(port: &str) -> SerialPort {
    SerialPort {
        port: port.to_owned(),
        stable_name: None,
        description: Some("CH340".to_owned()),
        serial_number: None,
        driver: None,
        is_usb: true,
    }
}

pub(crate) fn health(voltage_v: f64, errors: u8) -> MotorHealth {
    MotorHealth {
        time: Duration::ZERO,
        temperature_c: 41.0,
        voltage_v: Some(voltage_v),
        supply_current_a: None,
        on: Some(true),
        errors: MotorErrors(u32::from(errors)),
        round_trip: None,
    }
}

pub(crate) fn status(time_s: f64) -> Status {
    let motor = MotorStatus {
        temperature_c: Some(41.0),
        health: Some(health(24.1, 0)),
        current_a: Some(-0.35),
        rate_hz: 1000.0,
        age: Some(Duration::from_micros(800)),
        missed: 3,
    };
    Status {
        time: Duration::from_secs_f64(time_s),
        connection: Connection::Connected,
        drive: None,
        motors: [motor; 2],
        imu: ImuStatus {
            rate_hz: 200.0,
            age: Some(Duration::from_millis(3)),
            temperature_c: Some(36.0),
            packets: 4321,
            corrupted: 7,
            stray_bytes: 19,
        },
        counters: Counters {
            received: 123_456,
            sent: 0,
            received_hz: 2000.0,
            bus_load: Some(0.43),
            dropped: 11,
            lost: 12,
            errors: 13,
            late: 14,
            reconnects: 15,
        },
        timing: Timing {
            ticks: 10_000,
            median_s: 8e-6,
            p99_s: 6e-5,
            greatest_s: 1.3e-3,
            skipped: 0,
            histogram: vec![0, 5, 3000, 5000, 1500, 400, 90, 3, 1, 0, 1, 0, 0, 0, 0],
        },
        recording: None,
    }
}

pub(crate) fn update(time_s: f64) -> Update {
    Update { samples: Vec::new(), frames: Vec::new(), events: Vec::new(), status: status(time_s) }
}

/// Motors of a robot that is stopped are off.
pub(crate) fn at_stage(time_s: f64, stage: Stage, checks: &[(&'static str, CheckResult, &str)]) -> Update {
    let check = |(name, result, text): &(&'static str, CheckResult, &str)| Check {
        name,
        result: *result,
        text: (*text).to_owned(),
    };
    let mut update = update(time_s);
    let motors_off = matches!(stage, Stage::Listening | Stage::Stopped(_));
    update.status.drive = Some(DriveStatus { stage, motors_off, checks: checks.iter().map(check).collect() });
    update
}

pub(crate) fn sample(time_s: f64, x_m: f64) -> Sample {
    Sample {
        time_s,
        x_m,
        x_dot_m_s: 0.1 * time_s.cos(),
        pitch_rad: 0.02 * time_s.sin(),
        pitch_rate_rad_s: 0.0,
        motor_angle_left_rad: 0.0,
        motor_angle_right_rad: 0.0,
        motor_speed_left_rad_s: 0.0,
        motor_speed_right_rad_s: 0.0,
        torque_left_nm: 0.0,
        torque_right_nm: 0.0,
    }
}

/// A kilohertz of rows.
pub(crate) fn rows(from_s: f64, count: usize) -> Vec<Sample> {
    (0..count).map(|index| from_s + index as f64 * 1e-3).map(|time_s| sample(time_s, time_s.sin())).collect()
}

pub(crate) fn frame(time_s: f64, id: u16, command: u8) -> StampedFrame {
    let frame = Frame::full(FrameId::Standard(id), [command, 32, 1, 2, 3, 4, 5, 6]);
    let direction = if id < 0x142 { Direction::Received } else { Direction::Sent };
    StampedFrame { time: Duration::from_secs_f64(time_s), direction, frame }
}

pub(crate) fn script_window(tab: Tab, script: &Script, source: &str) -> Window {
    let window_options = WindowOptions {
        devices: Arc::new(script.clone()),
        source: Some(source.parse().unwrap()),
        ..options(tab)
    };
    let mut window = open(window_options, SIZE);
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    window
}

/// A robot that is stopped, but whose motors have not confirmed that they are off.
pub(crate) fn not_off(time_s: f64, reason: StopReason) -> Update {
    let mut update = at_stage(time_s, Stage::Stopped(reason), &[]);
    update.status.drive.as_mut().unwrap().motors_off = false;
    update
}

/// On its way to a session that may drive.
pub(crate) fn connecting_window(script: &Script) -> Window {
    let window_options = WindowOptions { devices: Arc::new(script.clone()), ..options(Tab::Robot) };
    let mut window = open(window_options, SIZE);
    click(&mut window, "emulated");
    click(&mut window, "May drive");
    click(&mut window, "Connect");
    window
}

/// Connected in a session that may drive.
pub(crate) fn drive_window(script: &Script) -> Window {
    let mut window = connecting_window(script);
    until(&mut window, "connecting", |s| s["robot_tab"]["session"] == "open");
    tell(&mut window, script, at_stage(0.1, Stage::Listening, &[]));
    window
}

pub(crate) fn tell(window: &mut Window, script: &Script, update: Update) {
    script.tell(update);
    window.run_steps(3);
}

pub(crate) const GOOD: &[(&str, CheckResult, &str)] =
    &[("left motor", CheckResult::Passed, "answers"), ("IMU", CheckResult::Passed, "200 Hz")];

/// From listening to driving, as a person does it.
pub(crate) fn arm(window: &mut Window, script: &Script) {
    click(window, "1  Check");
    tell(window, script, at_stage(0.5, Stage::Checking, GOOD));
    click(window, "2  Arm");
    tell(window, script, at_stage(1.0, Stage::Driving, GOOD));
    script.drive_orders();
}
