//! The emulated robot over its real bytes.

#[path = "../tests/faulty_bus/mod.rs"]
mod faulty_bus;

use std::sync::{Arc, Mutex};

use faulty_bus::{FaultRates, Faulty};

use super::*;
use crate::control::{ControllerKind, Measurement, Reference};
use crate::link::{
    Bus, FrameId, ImuAssembler, ImuReading, MotorErrors, MotorEvent, MotorHealth, MotorOrder, MotorState,
    Wheels,
    jy901::{self, Content},
    lk::{self, Command, MotorId, Reply},
};
use crate::lqr;
use crate::model::{PitchAxis, StateLayout, TorqueCommand, Turn};
use crate::model_file::presets;
use crate::record::Sample;
use crate::simulate::{Simulation, Statistics};

fn paper() -> RobotModel {
    presets::paper().robot().unwrap().clone()
}

fn flqr(robot: &RobotModel) -> BalanceController {
    let gain = lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap().gain;
    BalanceController::new(ControllerKind::Flqr, robot, gain).unwrap()
}

fn ms(tick: u64) -> Duration {
    Duration::from_millis(tick)
}

/// A host in lock-step with the robot: hears, then sends, once a tick.
struct Host {
    robot: Arc<Mutex<Emulator>>,
    bus: EmulatedBus,
    wheels: Wheels,
    decoder: jy901::Decoder,
    imu: ImuAssembler,
    motors: [Option<MotorState>; 2],
    health: [Option<MotorHealth>; 2],
    switched: Vec<(Motor, bool)>,
    asked_a: [f64; 2],
    heard: u64,
    reading: Option<ImuReading>,
    tick: u64,
}

impl Host {
    fn new(model: &RobotModel, settings: EmulatorSettings) -> Self {
        let robot = Arc::new(Mutex::new(Emulator::new(model, settings).unwrap()));
        Self {
            bus: EmulatedBus::new(Arc::clone(&robot)),
            robot,
            wheels: Wheels::new(&model.link),
            decoder: jy901::Decoder::new(),
            imu: ImuAssembler::new(&model.link),
            motors: [None; 2],
            health: [None; 2],
            switched: Vec::new(),
            asked_a: [0.0; 2],
            heard: 0,
            reading: None,
            tick: 0,
        }
    }

    /// Takes in what has come by this tick.
    fn hear(&mut self) {
        let mut bus = self.bus.clone();
        self.hear_from(&mut bus);
    }

    fn hear_from(&mut self, bus: &mut impl Bus) {
        while let Ok(Some(frame)) = bus.receive(ms(self.tick)) {
            self.heard += 1;
            for event in self.wheels.receive(&frame) {
                match event {
                    MotorEvent::State(motor, state) => self.motors[motor as usize] = Some(state),
                    MotorEvent::Health(motor, health) => self.health[motor as usize] = Some(health),
                    MotorEvent::Switched { motor, on, .. } => self.switched.push((motor, on)),
                    MotorEvent::Commanded { motor, current_a, .. } => {
                        self.asked_a[motor as usize] = current_a.unwrap_or(0.0);
                    }
                    MotorEvent::TurnsLost { .. } => {}
                }
            }
        }
        let bytes = self.robot.lock().unwrap().imu_bytes(ms(self.tick));
        self.decoder.push(ms(self.tick), &bytes);
        while let Some((time, packet)) = self.decoder.next() {
            self.reading = self.imu.push(time, &packet).or(self.reading);
        }
    }

    fn send(&mut self, order: &MotorOrder) {
        for frame in self.wheels.frames(order) {
            self.bus.send(ms(self.tick), &frame).unwrap();
            let time = ms(self.tick);
            assert_eq!(
                self.wheels.receive(&StampedFrame { time, direction: Direction::Sent, frame }).count(),
                0
            );
        }
    }

    /// One tick: hears, sends an order, and lets 1 ms pass.
    fn step(&mut self, order: &MotorOrder) {
        self.hear();
        self.send(order);
        self.tick += 1;
    }

    fn read_for(&mut self, ticks: u64) {
        (0..ticks).for_each(|_| self.step(&MotorOrder::ReadState));
    }

    fn readings(&self) -> Option<Readings> {
        let [left, right] = [self.motors[0]?, self.motors[1]?];
        let imu = self.reading?;
        Some(Readings {
            motor_angle_rad: [left.angle_rad, right.angle_rad],
            motor_speed_rad_s: [left.speed_rad_s, right.speed_rad_s],
            pitch_rad: imu.pitch_rad,
            pitch_rate_rad_s: imu.pitch_rate_rad_s,
        })
    }

    /// Balances for so many ticks; tells what was measured and asked.
    fn balance(&mut self, controller: &BalanceController, ticks: u64) -> Vec<Sample> {
        let start = self.tick;
        let mut samples = Vec::new();
        while self.tick < start + ticks {
            self.hear();
            let readings = self.readings().expect("the robot has been read");
            let Measurement { state, .. } = controller.odometry.measurement(&readings);
            let asked = controller.step(&controller.odometry.measurement(&readings), &Reference::default());
            samples.push(Sample::new(1e-3 * (self.tick - start) as f64, &readings, &state, asked));
            self.send(&MotorOrder::Torque(asked));
            self.tick += 1;
        }
        samples
    }

    fn place(&self) -> Place {
        self.robot.lock().unwrap().place()
    }
}

fn emulated(settings: EmulatorSettings) -> Host {
    Host::new(&paper(), settings)
}

#[test]
fn the_wire_is_one_tick_of_the_delay_and_nothing_else() {
    let mut robot = paper();
    // The steps of the bytes.
    robot.sensors.pitch_step_rad = std::f64::consts::PI / 32768.0;
    robot.sensors.pitch_rate_step_rad_s = 2000.0_f64.to_radians() / 32768.0;
    robot.actuation.torque_step_nm = 0.32 / robot.link.current_steps_per_a;
    let controller = flqr(&robot);
    let mut host = Host::new(&robot, EmulatorSettings { seed: 1, ..EmulatorSettings::default() });
    host.read_for(1);
    let hand = Hand::Rocks { since: 0 };
    let held = |tick| hand.state(tick, 0.0).unwrap();
    let settings = SimulationSettings { seed: 1, initial: held(0), ..SimulationSettings::default() };
    let mut pure = SimulatedRobot::on_ground(&robot, &settings, &[const { Ground::flat() }; 2]).unwrap();
    for tick in 0..1500 {
        let [wire] = host.balance(&controller, 1)[..] else { panic!("one sample") };
        let measurement = controller.odometry.measurement(&pure.read());
        let asked = controller.step(&measurement, &Reference::default());
        if tick == 0 {
            pure.hold(asked, &held(1))
        } else {
            pure.advance(asked)
        }
        let (found, expected) = (wire.pitch_rad, measurement.state.pitch_rad);
        assert!((found - expected).abs() < 1e-9, "tick {tick}: {found} for {expected}");
    }
}

#[test]
fn lock_step_over_the_wire_has_the_statistics_of_the_simulated_run() {
    let robot = paper();
    let controller = flqr(&robot);
    let mut variances = [[0.0; 3]; 2];
    for seed in 1..=12 {
        let mut host = emulated(EmulatorSettings { seed, ..EmulatorSettings::default() });
        host.read_for(5);
        let settings = SimulationSettings { seed, ..SimulationSettings::default() };
        let mut simulation = Simulation::new(&robot, controller.clone(), settings).unwrap();
        let pure: Vec<Sample> = (0..60_000).map(|_| simulation.step()).collect();
        for (samples, sums) in [host.balance(&controller, 60_000), pure].iter().zip(&mut variances) {
            let Statistics { x_m, x_dot_m_s, pitch_rad, fell, settled, .. } =
                Statistics::of(samples).unwrap();
            assert!(settled && !fell, "seed {seed}");
            for (sum, of) in sums.iter_mut().zip([x_m, x_dot_m_s, pitch_rad]) {
                *sum += of.std * of.std / 12.0;
            }
        }
    }
    for (wire, pure) in variances[0].iter().zip(variances[1]) {
        let ratio = (wire / pure).sqrt();
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }
}

#[test]
fn on_the_stand_angles_show_the_pitch_however_the_robot_is_wired() {
    let own = paper().link;
    let wirings = [
        own,
        LinkSettings { pitch_axis: PitchAxis::Pitch, ..own },
        LinkSettings { pitch_direction: Turn::Backward, ..own },
        LinkSettings { left_direction: Turn::Backward, right_direction: Turn::Forward, ..own },
        LinkSettings { left_motor_id: 4, right_motor_id: 3, encoder_steps: 16_384, ..own },
        LinkSettings { torque_command: TorqueCommand::Together, state_layout: StateLayout::Older, ..own },
        LinkSettings { torque_constant_nm_a: Some(0.81), current_steps_per_a: 62.5, ..own },
    ];
    for (link, reply_base) in wirings.into_iter().zip([None, Some(0x180)].into_iter().cycle()) {
        let robot = RobotModel { link, ..paper() };
        let mut host = Host::new(&robot, EmulatorSettings { reply_base, ..EmulatorSettings::default() });
        for _ in 0..4000 {
            host.step(&MotorOrder::ReadState);
            if host.tick > 10 {
                let Readings { motor_angle_rad, pitch_rad, .. } = host.readings().unwrap();
                let pitch_rate_rad_s = host.reading.unwrap().pitch_rate_rad_s;
                let truth = host.robot.lock().unwrap().state();
                for angle in motor_angle_rad {
                    // Heard a tick later.
                    assert!((angle + truth.pitch_rad).abs() < 5e-4, "{link:?}");
                }
                // Noise of 0.0017 rad, and held for 10 ms.
                assert!((pitch_rad - truth.pitch_rad).abs() < 0.012, "{link:?}");
                assert!((pitch_rate_rad_s - truth.pitch_rate_rad_s).abs() < 0.012, "{link:?}");
                // A centre of mass at 0.16 m that rocks by 0.25 rad/s² feels 0.004 g.
                assert!(
                    (host.reading.unwrap().tilt_rad.unwrap() - truth.pitch_rad).abs() < 0.012,
                    "{link:?}"
                );
            }
        }
        host.step(&MotorOrder::ReadHealth);
        host.hear();
        let health = host.health[1].unwrap();
        assert_eq!(
            (health.voltage_v.unwrap(), health.errors.is_none(), host.place()),
            (24.0, true, Place::Stand)
        );
        // It balances with the torque that is meant.
        let samples = host.balance(&flqr(&robot), 3000);
        assert!(samples.iter().all(|sample| sample.pitch_rad.abs() < 0.3), "{link:?}");
        assert_eq!(host.place(), Place::Free);
    }
}

#[test]
fn a_robot_that_is_wired_otherwise_shows_it() {
    let own = paper().link;
    let on_stand = |actual: LinkSettings| {
        let mut host = emulated(EmulatorSettings { actual: Some(actual), ..EmulatorSettings::default() });
        host.read_for(1000);
        host
    };
    let pitch = |host: &Host| host.reading.unwrap().pitch_rad;
    assert!(pitch(&on_stand(own)) > 0.05);
    assert!(pitch(&on_stand(LinkSettings { pitch_direction: Turn::Backward, ..own })) < -0.05);
    let other_id = on_stand(LinkSettings { right_motor_id: 7, ..own });
    assert!(other_id.motors[0].is_some() && other_id.motors[1].is_none());
    // 1 N m is 388 steps; a motor of 62.5 steps in an ampere and 0.81 N m/A makes 5.03 N m of them.
    let winding = LinkSettings { current_steps_per_a: 62.5, torque_constant_nm_a: Some(0.81), ..own };
    for (actual, factor) in [(own, 1.0), (winding, 124.12 / 62.5 * 0.81 / 0.32)] {
        let robot = RobotModel { friction: [None; 2], ..paper() };
        let settings =
            EmulatorSettings { actual: Some(actual), wheels_in_air: true, ..EmulatorSettings::default() };
        let mut host = Host::new(&robot, settings);
        for _ in 0..100 {
            host.step(&MotorOrder::Torque([0.1, -0.1]));
        }
        host.hear();
        let [left, right] = host.readings().unwrap().motor_speed_rad_s;
        let expected = factor * 0.1 / 0.002 * 0.097;
        assert!(
            (left / expected - 1.0).abs() < 0.05 && (right / expected + 1.0).abs() < 0.05,
            "{left} {right}"
        );
    }
}

#[test]
fn a_robot_that_fell_lies_until_it_is_carried_back() {
    let mut host = emulated(EmulatorSettings::default());
    host.read_for(100);
    let falling = |host: &mut Host| (0..800).for_each(|_| host.step(&MotorOrder::Torque([1.0; 2])));
    falling(&mut host);
    assert_eq!(host.place(), Place::Lying);
    host.step(&MotorOrder::Off);
    let before = host.readings().unwrap().motor_angle_rad;
    let mut places = vec![host.place()];
    for _ in 0..3000 {
        host.step(&MotorOrder::ReadState);
        if places.last() != Some(&host.place()) {
            places.push(host.place());
        }
        let Readings { motor_angle_rad, motor_speed_rad_s, .. } = host.readings().unwrap();
        let on_stand = host.place() == Place::Stand;
        for motor in [0, 1] {
            let moved = (motor_angle_rad[motor] - before[motor]).abs();
            assert!(moved < if on_stand { 0.11 } else { 2e-4 }, "{moved} {:?}", host.place());
            assert!(on_stand || motor_speed_rad_s[motor].abs() < 0.06);
        }
    }
    assert_eq!(places, [Place::Lying, Place::Carried, Place::Stand]);
    assert_eq!(host.switched, [(Motor::Left, false), (Motor::Right, false)]);
    // Motors that are off give no torque.
    host.step(&MotorOrder::Torque([1.0; 2]));
    host.read_for(10);
    assert_eq!(host.place(), Place::Stand);
    host.step(&MotorOrder::On);
    let x_m = flqr(&paper()).odometry.measurement(&host.readings().unwrap()).state.x_m;
    assert!(x_m.abs() > 0.1, "the wheels have turned: {x_m}");
    falling(&mut host);
    assert_eq!(host.place(), Place::Lying);
}

#[test]
fn wheels_in_the_air_turn_by_torque_and_at_speeds() {
    let mut host = emulated(EmulatorSettings { wheels_in_air: true, ..EmulatorSettings::default() });
    host.read_for(10);
    let speed = |number, speed_cdps, iq_limit| {
        Command::Speed { speed_cdps, iq_limit }.frame(MotorId::new(number).unwrap())
    };
    // 5 rad/s forward: the right motor's own sense is backward.
    host.bus.send(ms(host.tick), &speed(1, 28_648, 0)).unwrap();
    host.bus.send(ms(host.tick), &speed(2, -28_648, 60)).unwrap();
    host.read_for(1500);
    for speed in host.readings().unwrap().motor_speed_rad_s {
        assert!((speed - 5.0).abs() < 0.2, "{speed}");
    }
    assert_eq!(host.place(), Place::Stand);
    host.step(&MotorOrder::Off);
    host.read_for(4000);
    // At rest, but for the noise of one step.
    assert!(host.readings().unwrap().motor_speed_rad_s.iter().all(|speed| speed.abs() < 0.04));
}

#[test]
fn a_listener_hears_a_robot_that_balances_by_itself() {
    let settings = EmulatorSettings { on_board: Some(flqr(&paper())), ..EmulatorSettings::default() };
    let mut host = emulated(settings);
    let mut torques = 0.0_f64;
    for _ in 0..10_000 {
        host.hear();
        host.tick += 1;
        torques = torques.max(host.asked_a[0].abs());
    }
    // Two commands and two replies each millisecond, four more each 100 ms.
    assert!((40_000..=40_420).contains(&host.heard), "{}", host.heard);
    let pitch_rad = host.readings().unwrap().pitch_rad;
    assert!(host.place() == Place::Free && pitch_rad.abs() < 0.05 && torques > 0.05, "{pitch_rad} {torques}");
    // Pushed over, it switches its motors off and begins anew once it is back on its stand.
    host.robot.lock().unwrap().push(400.0, 0.2);
    for _ in 0..1000 {
        host.hear();
        host.tick += 1;
    }
    assert_ne!(host.place(), Place::Free);
    for _ in 0..8000 {
        host.hear();
        host.tick += 1;
    }
    assert_eq!(host.place(), Place::Free);
    assert!(host.readings().unwrap().pitch_rad.abs() < 0.05);
}

#[test]
fn motors_answer_as_the_protocol_says() {
    let answer = |robot: &mut Emulator, number: u8, command: Command| {
        let now = robot.time() + ms(1);
        robot.receive(now, &command.frame(MotorId::new(number).unwrap()));
        assert_eq!(robot.frames(now + Duration::from_micros(249)), None);
        let reply = robot.frames(now + Duration::from_micros(250))?;
        assert_eq!(reply.frame.id().raw(), 0x180 + u32::from(number));
        Reply::decode(reply.frame.bytes().try_into().unwrap(), StateLayout::Current).ok()
    };
    let settings = EmulatorSettings { reply_base: Some(0x180), ..EmulatorSettings::default() };
    let robot = &mut Emulator::new(&paper(), settings).unwrap();
    for command in [Command::On, Command::Stop, Command::SetAngle { angle_cdeg: -12_345 }, Command::Off] {
        assert_eq!(answer(robot, 1, command), Some(Reply::Echo { bytes: command.encode() }));
    }
    let Some(Reply::State1 { state, .. }) = answer(robot, 1, Command::ReadState1) else { panic!() };
    assert_eq!((state.on(), state.voltage_v(), state.temperature_c()), (Some(false), 24.0, 30.0));
    let Some(Reply::Encoder(encoder)) = answer(robot, 2, Command::ReadEncoder) else { panic!() };
    let Some(Reply::TurnAngle { angle_cdeg }) = answer(robot, 2, Command::ReadTurnAngle) else { panic!() };
    let Some(Reply::Angle { angle_cdeg: many }) = answer(robot, 2, Command::ReadAngle) else { panic!() };
    // Rocked by 0.09° in the tick between two of them.
    assert!((f64::from(angle_cdeg) - f64::from(encoder.position) * 36_000.0 / 65_536.0).abs() < 2.0);
    assert!((many - i64::from(angle_cdeg)).abs() < 3, "{many} {angle_cdeg}");
    let set = Command::SetAngle { angle_cdeg: -12_345 };
    answer(robot, 2, set);
    let Some(Reply::Angle { angle_cdeg }) = answer(robot, 2, Command::ReadAngle) else { panic!() };
    assert!((angle_cdeg + 12_345).abs() < 3, "{angle_cdeg}");
    assert_eq!(answer(robot, 1, Command::Brake(lk::Brake::Read)), Some(Reply::Brake { state: 1 }));
    assert!(matches!(answer(robot, 1, Command::ReadState3), Some(Reply::State3(_))));
    assert!(matches!(answer(robot, 1, Command::ClearErrors), Some(Reply::State1 { .. })));
    for ignored in [Command::OpenLoop { power: 3 }, Command::WriteZero, Command::Angle { angle_cdeg: 3 }] {
        assert_eq!(answer(robot, 1, ignored), None);
    }
    assert_eq!(answer(robot, 3, Command::ReadState2), None);
    let remote = Frame::remote(FrameId::Standard(0x141), 8).unwrap();
    robot.receive(robot.time(), &remote);
    robot.receive(robot.time(), &Frame::data(FrameId::Standard(0x141), &[0x9C]).unwrap());
    assert_eq!(robot.frames(robot.time() + ms(1)), None);
}

#[test]
fn faults_come_and_go_at_their_time() {
    let fault = |at, fault| TimedFault { at: ms(at), fault };
    let faults = vec![
        fault(100, Fault::MotorVanishes(Motor::Left)),
        fault(200, Fault::MotorReturns(Motor::Left)),
        fault(300, Fault::MotorErrors(Motor::Right, MotorErrors(0b1001))),
        fault(300, Fault::Voltage(18.5)),
        fault(400, Fault::MotorErrors(Motor::Right, MotorErrors(0))),
        fault(500, Fault::MotorTemperature(Motor::Left, 95.0)),
        fault(600, Fault::BusOff),
        fault(700, Fault::BusOn),
    ];
    let mut host = emulated(EmulatorSettings { faults, wheels_in_air: true, ..EmulatorSettings::default() });
    let heard_at = |host: &Host| host.motors.map(|motor| motor.unwrap().time.as_millis());
    host.read_for(150);
    assert_eq!(heard_at(&host), [99, 148]);
    host.read_for(100);
    assert_eq!(heard_at(&host), [248, 248]);
    let health = |host: &mut Host, order| {
        host.step(order);
        host.hear();
        let health = host.health[1].unwrap();
        (health.errors.0, health.voltage_v.unwrap(), health.on)
    };
    host.read_for(100);
    assert_eq!(health(&mut host, &MotorOrder::ClearErrors), (9, 18.5, Some(false)), "the cause is there");
    host.read_for(100);
    assert_eq!(health(&mut host, &MotorOrder::ReadHealth), (9, 18.5, Some(false)), "not cleared yet");
    assert_eq!(health(&mut host, &MotorOrder::ClearErrors), (0, 18.5, Some(true)));
    while host.tick < 600 {
        host.read_for(1);
    }
    // 20 °C a second.
    assert_eq!(host.motors[0].unwrap().temperature_c, 32.0);
    let frame = host.wheels.frames(&MotorOrder::ReadState).next().unwrap();
    assert!(host.bus.send(ms(650), &frame).is_err() && host.bus.receive(ms(650)).is_err());
    host.tick = 710;
    host.read_for(4000);
    assert_eq!(host.motors[0].unwrap().temperature_c, 95.0);
}

#[test]
fn the_imu_falls_silent_and_freezes() {
    let fault = |at, fault| TimedFault { at: ms(at), fault };
    let faults = vec![
        fault(95, Fault::ImuSilent),
        fault(195, Fault::ImuReturns),
        fault(295, Fault::ImuFrozen),
        fault(395, Fault::ImuReturns),
    ];
    let mut robot =
        Emulator::new(&paper(), EmulatorSettings { faults, ..EmulatorSettings::default() }).unwrap();
    let cycles: Vec<Vec<u8>> = (0..50).map(|cycle| robot.imu_bytes(ms(10 * cycle) + ms(1))).collect();
    for (cycle, bytes) in cycles.iter().enumerate() {
        assert_eq!(bytes.len(), if (10..20).contains(&cycle) { 0 } else { 33 }, "{cycle}");
        let repeated = cycle > 0 && !bytes.is_empty() && *bytes == cycles[cycle - 1];
        assert_eq!(repeated, (30..40).contains(&cycle), "{cycle}");
    }
}

#[test]
fn the_imus_registers_open_only_by_its_key() {
    let mut robot = Emulator::new(&paper(), EmulatorSettings::default()).unwrap();
    let second = |robot: &mut Emulator, from: u64| -> usize {
        (from..from + 1000).map(|tick| robot.imu_bytes(ms(tick)).len()).sum()
    };
    assert_eq!(second(&mut robot, 1), 100 * 33);
    let writes = jy901::configure(200.0, 230_400, Content::BALANCE).unwrap().concat();
    robot.imu_receive(ms(1001), &writes[5..]);
    assert_eq!(second(&mut robot, 1001), 100 * 33);
    // In pieces.
    writes.chunks(3).for_each(|piece| robot.imu_receive(ms(2001), piece));
    let fast = second(&mut robot, 2001);
    assert!((199 * 33..=201 * 33).contains(&fast), "{fast}");
    robot.imu_receive(ms(3001), &jy901::read_registers(0x02).encode());
    let mut decoder = jy901::Decoder::new();
    decoder.push(ms(3010), &robot.imu_bytes(ms(3010)));
    let packets = std::iter::from_fn(|| decoder.next()).map(|(_, packet)| packet.reading());
    let answers: Vec<_> = packets.filter(|reading| matches!(reading, jy901::Reading::Registers(_))).collect();
    assert_eq!(answers, [jy901::Reading::Registers([0b1110, 0x0B, 0x07, 0])]);
    // Only the angle, and then nothing; after 10 s it is locked again.
    let write = |register, value| jy901::RegisterWrite { register, value }.encode();
    robot.imu_receive(ms(3011), &write(0x02, 0b1000));
    robot.imu_bytes(ms(3012));
    let angle = second(&mut robot, 3013);
    assert!((199 * 11..=202 * 11).contains(&angle), "{angle}");
    robot.imu_receive(ms(12_500), &write(0x03, 0x0D));
    robot.imu_bytes(ms(13_000));
    assert!(second(&mut robot, 13_001) > 0);
    robot.imu_receive(ms(15_000), &[jy901::UNLOCK.encode(), write(0x03, 0x0D)].concat());
    robot.imu_bytes(ms(15_001));
    assert_eq!(second(&mut robot, 15_002), 0);
}

#[test]
fn an_imu_line_that_is_too_slow_loses_cycles() {
    let mut robot = Emulator::new(&paper(), EmulatorSettings::default()).unwrap();
    let baud = jy901::RegisterWrite { register: 0x04, value: 2 };
    robot.imu_receive(ms(1), &[jy901::UNLOCK.encode(), baud.encode()].concat());
    robot.imu_bytes(ms(1000));
    // 33 bytes take 34 ms at 9600 baud.
    let bytes: usize = (1001..2001).map(|tick| robot.imu_bytes(ms(tick)).len()).sum();
    assert_eq!(bytes, 25 * 33);
}

#[test]
fn same_seed_and_calls_same_bytes() {
    let run = |seed| {
        let on_board = Some(flqr(&paper()));
        let settings = EmulatorSettings { seed, on_board, flood_hz: 700, ..EmulatorSettings::default() };
        let mut robot = Emulator::new(&paper(), settings).unwrap();
        let mut heard = Vec::new();
        for tick in 0..500 {
            robot.advance(ms(tick));
            heard.extend(std::iter::from_fn(|| robot.frames(ms(tick))));
        }
        (heard, robot.imu_bytes(ms(500)))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
    assert_ne!(run(1).1, run(2).1);
}

#[test]
fn it_stands_a_lossy_bus() {
    let rates = FaultRates { loss: 0.01, duplication: 0.01, reordering: 0.01, ..FaultRates::default() };
    let robot = Arc::new(Mutex::new(Emulator::new(&paper(), EmulatorSettings::default()).unwrap()));
    let mut bus = Faulty::new(EmulatedBus::new(Arc::clone(&robot)), rates, 1);
    let mut host = emulated(EmulatorSettings::default());
    host.robot = Arc::clone(&robot);
    let controller = flqr(&paper());
    for tick in 0..10_000 {
        host.tick = tick;
        host.hear_from(&mut bus);
        let order = match host.readings() {
            Some(readings) if tick > 5 => {
                let measurement = controller.odometry.measurement(&readings);
                MotorOrder::Torque(controller.step(&measurement, &Reference::default()))
            }
            _ => MotorOrder::ReadState,
        };
        for frame in host.wheels.frames(&order) {
            bus.send(ms(tick), &frame).unwrap();
            host.wheels.receive(&StampedFrame { time: ms(tick), direction: Direction::Sent, frame }).count();
        }
    }
    assert!(host.place() == Place::Free && bus.sent().lost > 100 && bus.received().lost > 100);
    assert!(host.readings().unwrap().pitch_rad.abs() < 0.05);
}

#[test]
fn wiring_that_cannot_be_is_refused() {
    let actual = Some(LinkSettings { left_motor_id: 2, ..paper().link });
    let refused =
        Emulator::new(&paper(), EmulatorSettings { actual, ..EmulatorSettings::default() }).unwrap_err();
    assert!(refused.to_string().contains("right_motor_id"), "{refused}");
}
