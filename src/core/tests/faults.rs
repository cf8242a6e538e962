//! Ten minutes of faults: a driven robot over its real bytes, in lock-step, on a bus that loses, doubles, overtakes and
//! damages frames, with an IMU line that damages bytes.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod faulty_bus;

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use faulty_bus::{FaultRates, Faulty};
use flqr_core::control::{
    BalanceController, ControllerKind,
    drive::{
        CheckResult, Drive, DriveEvent, DriveOrder, DriveSettings, Excitation, Inputs, Stage, StopReason,
    },
};
use flqr_core::emulator::{EmulatedBus, Emulator, EmulatorSettings, Fault};
use flqr_core::link::{
    Bus, Direction, ImuAssembler, ImuReading, MotorErrors, MotorEvent, MotorOrder, StampedFrame, Wheels,
    jy901::Decoder,
};
use flqr_core::lqr;
use flqr_core::model::{Motor, RobotModel};
use flqr_core::model_file::presets;
use flqr_core::record::{
    ColumnMap, ReadOptions, read_log,
    recording::{About, FrameLog, Row, push_event, push_frame, push_imu_packet, push_row, robot_header},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Fractions of the frames each way that are lost, doubled and overtaken.
const ROUGH: FaultRates = FaultRates {
    loss: 0.01,
    duplication: 0.01,
    reordering: 0.01,
    bit_flip: 0.0,
    stall: 0.0,
    stall_for: Duration::from_millis(50),
    delay: Duration::ZERO,
};
/// Fraction of the IMU's bytes that are damaged.
const DAMAGED_BYTES: f64 = 0.001;
const START: Duration = Duration::from_secs(1_700_000_000);

/// A host that drives and records.
struct Host {
    robot: Arc<Mutex<Emulator>>,
    bus: Faulty<EmulatedBus>,
    wheels: Wheels,
    decoder: Decoder,
    assembler: ImuAssembler,
    drive: Drive,
    random: ChaCha8Rng,
    tick: u64,
    stop: Option<(u64, StopReason)>,
    /// Ticks after a stop at which a torque was requested.
    torques_after_stop: u64,
    rows: String,
    frames: String,
    /// Frames received, rows, frames sent, and those that a bus that is off did not take.
    counts: [u64; 4],
    packets: u64,
}

impl Host {
    fn new(model: &RobotModel) -> Self {
        let robot =
            Emulator::new(model, EmulatorSettings { seed: 5, ..EmulatorSettings::default() }).unwrap();
        let robot = Arc::new(Mutex::new(robot));
        let gain = lqr::design(&model.parameters.linear_model(), &model.weights.unwrap()).unwrap().gain;
        let controller = BalanceController::new(ControllerKind::Flqr, model, gain).unwrap();
        let about = About { source: "emulated".to_owned(), interface: "can0".to_owned(), start: START };
        Self {
            bus: Faulty::new(EmulatedBus::new(Arc::clone(&robot)), ROUGH, 7),
            robot,
            wheels: Wheels::new(&model.link),
            decoder: Decoder::new(),
            assembler: ImuAssembler::new(&model.link),
            drive: Drive::new(model, controller, Excitation::Balance, DriveSettings::default()).unwrap(),
            random: ChaCha8Rng::seed_from_u64(11),
            tick: 0,
            stop: None,
            torques_after_stop: 0,
            rows: robot_header(&about),
            frames: String::new(),
            counts: [0; 4],
            packets: 0,
        }
    }

    fn now(&self) -> Duration {
        Duration::from_millis(self.tick)
    }

    fn inject(&mut self, fault: Fault) {
        self.robot.lock().unwrap().inject(fault);
    }

    /// What has come by now; whether the bus works.
    fn hear(&mut self) -> (Vec<MotorEvent>, Vec<ImuReading>, bool) {
        let now = self.now();
        let mut motors = Vec::new();
        let works = loop {
            match self.bus.receive(now) {
                Ok(Some(frame)) => {
                    self.counts[0] += 1;
                    push_frame(&mut self.frames, START, "can0", &frame);
                    motors.extend(self.wheels.receive(&frame));
                }
                Ok(None) => break true,
                Err(_) => break false,
            }
        };
        let mut bytes = self.robot.lock().unwrap().imu_bytes(now);
        for byte in &mut bytes {
            if self.random.random_bool(DAMAGED_BYTES) {
                *byte ^= 1 << self.random.random_range(0..8);
            }
        }
        self.decoder.push(now, &bytes);
        let mut imu = Vec::new();
        while let Some((time, packet)) = self.decoder.next() {
            self.packets += 1;
            push_imu_packet(&mut self.frames, START, time, &packet);
            imu.extend(self.assembler.push(time, &packet));
        }
        (motors, imu, works)
    }

    fn step(&mut self, orders: &[DriveOrder]) {
        let now = self.now();
        let (motors, imu, works) = self.hear();
        let inputs = Inputs { motors: &motors, imu: &imu, orders, bus_down: !works, late: Duration::ZERO };
        let output = self.drive.step(now, &inputs);
        for event in &output.events {
            match event {
                DriveEvent::Stage(Stage::Stopped(reason)) => self.stop = Some((self.tick, *reason)),
                DriveEvent::Stage(_) => self.stop = None,
                DriveEvent::Note(_) | DriveEvent::Warning(_) => {}
            }
        }
        for order in output.orders.iter() {
            self.send(order);
        }
        if let Some(sample) = output.sample {
            self.counts[1] += 1;
            push_row(&mut self.rows, &Row::from(sample));
        }
        for event in &output.events {
            push_event(&mut self.rows, now, &event.to_string());
        }
        self.tick += 1;
    }

    fn send(&mut self, order: &MotorOrder) {
        let torque = matches!(order, MotorOrder::Torque(torque) if *torque != [0.0; 2]);
        self.torques_after_stop += u64::from(self.stop.is_some() && torque);
        let time = self.now();
        let frames: Vec<_> = self.wheels.frames(order).collect();
        for frame in frames {
            // Whether the bus works is known from hearing.
            if self.bus.send(time, &frame).is_ok() {
                self.counts[2] += 1;
                let sent = StampedFrame { time, direction: Direction::Sent, frame };
                push_frame(&mut self.frames, START, "can0", &sent);
                assert_eq!(self.wheels.receive(&sent).count(), 0);
            } else {
                self.counts[3] += 1;
            }
        }
    }

    fn run(&mut self, ticks: u64) {
        (0..ticks).for_each(|_| self.step(&[]));
    }

    /// Until it is driven; the checks may take several tries on such a bus.
    fn arm(&mut self) {
        for _ in 0..20 {
            self.step(&[DriveOrder::Release]);
            self.run(1200);
            self.step(&[DriveOrder::Check]);
            for _ in 0..100 {
                self.run(100);
                if self.drive.checks().iter().all(|check| check.result == CheckResult::Passed) {
                    self.step(&[DriveOrder::Arm]);
                }
                if self.drive.stage() == Stage::Driving {
                    return;
                }
            }
        }
        panic!("never armed: {:#?}", self.drive.checks());
    }

    /// Ticks from now to the stop, and its reason.
    fn until_stop(&mut self, most: u64) -> Option<(u64, StopReason)> {
        let start = self.tick;
        while self.stop.is_none() && self.tick < start + most {
            self.run(1);
        }
        self.stop.map(|(tick, reason)| (tick - start, reason))
    }
}

/// A fault, what ends it, the stop that it must lead to, and within how many milliseconds: the limit of `[safety]`, and
/// what the sensor or the queries need to show it.
struct Case {
    fault: Fault,
    remedy: Option<Fault>,
    stop: &'static str,
    within_ms: u64,
}

fn cases() -> Vec<Case> {
    let case = |fault, remedy, stop, within_ms| Case { fault, remedy, stop, within_ms };
    use Motor::{Left, Right};
    vec![
        case(Fault::MotorVanishes(Left), Some(Fault::MotorReturns(Left)), "motor_silent", 20 + 3),
        case(Fault::MotorVanishes(Right), Some(Fault::MotorReturns(Right)), "motor_silent", 20 + 3),
        case(Fault::ImuSilent, Some(Fault::ImuReturns), "imu_silent", 50 + 2),
        case(Fault::ImuFrozen, Some(Fault::ImuReturns), "imu_frozen", 200 + 12),
        case(Fault::BusOff, Some(Fault::BusOn), "bus_down", 1),
        // Asked for every 30 and 60 ms in turn, and a reply may be lost.
        case(Fault::Voltage(18.0), Some(Fault::Voltage(24.0)), "voltage", 2 * 60 + 3),
        case(
            Fault::MotorErrors(Left, MotorErrors(64)),
            Some(Fault::MotorErrors(Left, MotorErrors(0))),
            "motor_error",
            2 * 60 + 3,
        ),
        case(Fault::Push { force_n: 400.0, duration_s: 0.2 }, None, "speed", 600),
    ]
}

#[test]
fn ten_minutes_of_faults_end_in_named_stops_without_torque_and_are_recorded_whole() {
    let model = presets::paper().robot().unwrap().clone();
    let mut host = Host::new(&model);
    let cases = cases();
    let (mut rounds, mut early) = (0, 0);
    while host.tick < 600_000 {
        let case = &cases[rounds % cases.len()];
        let has_flips = rounds % 2 == 1 && rounds >= cases.len();
        // Of a frame with a flipped bit nothing tells that it is wrong but what it says.
        host.bus.set_rates(FaultRates { bit_flip: if has_flips { 0.0005 } else { 0.0 }, ..ROUGH });
        host.arm();
        if host.until_stop(3000).is_none() {
            host.inject(case.fault);
            let (after, reason) = host.until_stop(5000).unwrap_or_else(|| panic!("{:?}", case.fault));
            if !has_flips {
                assert_eq!(reason.name(), case.stop, "{:?}: {reason}", case.fault);
                assert!(after <= case.within_ms, "{:?}: {reason} after {after} ms", case.fault);
            }
        } else {
            assert!(has_flips, "{:?}", host.stop);
            early += 1;
        }
        host.run(300);
        host.bus.set_rates(FaultRates::default());
        if let Some(remedy) = case.remedy {
            host.inject(remedy);
        }
        host.send(&MotorOrder::ClearErrors);
        host.run(300);
        assert!(host.drive.has_ended(), "{:?}: the motors have not said that they are off", case.fault);
        assert_eq!(host.torques_after_stop, 0);
        // A stall of 50 ms is longer than a motor may be silent.
        host.arm();
        host.bus.set_rates(FaultRates { stall: 1.0, ..ROUGH });
        host.run(1);
        host.bus.set_rates(ROUGH);
        let (after, reason) = host.until_stop(100).expect("a stall of 50 ms stops the robot");
        assert!(reason.name() == "motor_silent" && after <= 24, "{reason} after {after} ms");
        host.run(400);
        assert_eq!(host.torques_after_stop, 0);
        rounds += 1;
    }
    assert!(rounds >= 2 * cases.len() && early < rounds / 2, "{rounds} rounds, {early} ended by flips");
    counts_are_right(&mut host);
    recording_is_whole(&host);
}

fn counts_are_right(host: &mut Host) {
    host.bus.set_rates(FaultRates::default());
    host.run(100);
    let (sent, received) = (host.bus.sent(), host.bus.received());
    for counts in [sent, received] {
        assert_eq!(counts.handed_on, counts.frames - counts.lost + counts.duplicated, "{counts:?}");
        let share = counts.lost as f64 / counts.frames as f64;
        assert!((0.005..0.015).contains(&share) && counts.flipped > 0 && counts.stalls > 0, "{counts:?}");
    }
    let [heard, _, taken, refused] = host.counts;
    assert_eq!((received.handed_on, sent.frames), (heard, taken + refused));
    assert_eq!(host.decoder.intact(), host.packets);
    assert!(host.decoder.corrupted() > 0);
}

fn recording_is_whole(host: &Host) {
    let map = ColumnMap::default();
    let go_on = &mut |_| ControlFlow::Continue(());
    let log = read_log(host.rows.as_bytes(), "faults.csv", &ReadOptions::new(&map), go_on).unwrap();
    assert_eq!(log.rows() as u64, host.counts[1]);
    let mut frames = FrameLog::new(host.frames.as_bytes(), "faults.log");
    let mut read = [0, 0];
    while let Some((interface, _)) = frames.next_frame().unwrap() {
        read[usize::from(interface == "imu")] += 1;
    }
    assert_eq!(read, [host.counts[0] + host.counts[2], host.packets]);
    assert_eq!(frames.damaged(), 0);
}

/// What a robot that balances over its real bytes truly does after something goes wrong with it.
struct Lie {
    faults: &'static [Fault],
    stops: &'static [&'static str],
}

/// Sensors that lie and a second controller, each after 2 s of balancing: the robot is stopped by name before it has
/// gone far, whatever its sensors say.
#[test]
fn a_robot_whose_sensors_lie_is_stopped_before_it_has_gone_far() {
    use Motor::{Left, Right};
    let model = presets::paper().robot().unwrap().clone();
    let lies = [
        Lie { faults: &[Fault::EncoderFrozen(Left)], stops: &["encoder_frozen", "yaw_mismatch"] },
        Lie { faults: &[Fault::EncoderFrozen(Right)], stops: &["encoder_frozen", "yaw_mismatch"] },
        Lie {
            faults: &[Fault::EncoderFrozen(Left), Fault::EncoderFrozen(Right)],
            stops: &["encoder_frozen"],
        },
        Lie { faults: &[Fault::ImuAngleFrozen], stops: &["imu_stuck"] },
        Lie { faults: &[Fault::ImuRateZero], stops: &["imu_stuck"] },
        Lie { faults: &[Fault::ImuAngleOff(0.2)], stops: &["pitch_mismatch"] },
        Lie { faults: &[Fault::Commanded(Left, 0x81)], stops: &["other_controller"] },
        Lie { faults: &[Fault::Commanded(Right, 0xA2)], stops: &["other_controller"] },
        Lie { faults: &[Fault::Commanded(Right, 0xA1)], stops: &["other_controller"] },
    ];
    for Lie { faults, stops } in lies {
        let mut host = Host::new(&model);
        host.bus.set_rates(FaultRates::default());
        host.arm();
        assert_eq!(host.until_stop(2000), None);
        let start = host.robot.lock().unwrap().pose();
        faults.iter().for_each(|fault| host.inject(*fault));
        let (mut moved_m, mut pitch_rad) = (0.0_f64, 0.0_f64);
        let mut stop = None;
        while stop.is_none() && host.tick < 60_000 {
            stop = host.until_stop(1);
            let state = host.robot.lock().unwrap().state();
            moved_m = moved_m.max((state.x_m - start.state.x_m).abs());
            pitch_rad = pitch_rad.max(state.pitch_rad.abs());
        }
        let Some((_, reason)) = stop else { panic!("{faults:?}: {moved_m} m, {pitch_rad} rad") };
        assert!(stops.contains(&reason.name()), "{faults:?}: {reason}");
        assert!(moved_m < 0.3 && pitch_rad < 0.3, "{faults:?}: {moved_m} m, {pitch_rad} rad");
    }
}

/// One command of another controller, of any kind, keeps a robot from being armed.
#[test]
fn one_command_of_another_controller_fails_the_checks() {
    let model = presets::paper().robot().unwrap().clone();
    for command in [0x80, 0x81, 0x88, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8] {
        let mut host = Host::new(&model);
        host.bus.set_rates(FaultRates::default());
        host.step(&[DriveOrder::Check]);
        host.run(4500);
        let open = |host: &Host| {
            let open = host.drive.checks().iter().find(|check| check.result == CheckResult::Failed);
            open.map(|check| check.name)
        };
        assert_eq!(open(&host), None);
        host.inject(Fault::Commanded(Motor::Left, command));
        host.run(1000);
        assert_eq!(open(&host), Some("no other controller"), "{command:X}");
    }
}
