//! Control of a real robot, from received data to motor orders, in stages, within limits and under watchdogs. Pure: time
//! and received data are arguments.
//!
//! One [`Drive::step`] a millisecond, in every stage:
//! - [`Stage::Listening`]: no order to the motors. [`Listener`] makes samples of what others make the robot do.
//! - [`Stage::Checking`]: the state of the motors is queried at 200 Hz and their health at 22 Hz. [`Check`]s report what
//!   is right, what remains to be done, and what is wrong with its remedy.
//! - [`Stage::Driving`]: motors on, torques at 1 kHz, which the motors answer with their state, and health at 22 Hz.
//!   Every watch and limit of `[safety]` is evaluated before a torque is commanded. The torque limit rises from 0 within
//!   0.2 s of arming. Small torques then show whether the motors turn in the right direction (`torque_sign.rs`) and by
//!   the right amount (`torque_scale.rs`).
//! - [`Stage::Stopped`]: no torque and motors off in the same step, repeated every 5 ms until both have said that they
//!   are off; then nothing. A stop before arming sends nothing: the motors were not switched on here. With
//!   `stop = "zero_then_off"` the motors roll out without torque before they are switched off.
//!
//! Torques stay within `torque_nm` and change by `torque_slew_nm_s` at most, both of `[limits]`; only the stop is not
//! slewed. Distance, heading and motor angles count from where the robot was armed, motor angles such that
//! x = r (q + θ) = 0 there; while checking, from the first reading. So the rotors' own angles are not known, and
//! effects that depend on them, as cogging, are not fed forward.

mod checks;
mod estimate;
mod exchange;
mod handover;
mod imu_watch;
mod listener;
mod program;
mod regression;
mod self_test;
mod sign;
mod stage;
mod switching;
mod torque_scale;
mod torque_sign;
mod watch;
mod wheel_watch;

pub use exchange::{DriveError, DriveEvent, DriveSettings, Inputs, Orders, Output};
pub use listener::Listener;
pub use stage::{Check, CheckResult, DriveOrder, Excitation, ImuValue, Stage, StopReason};

use std::time::Duration;

use crate::control::{BalanceController, Reference, gate};
use crate::link::MotorOrder;
use crate::link::protocol::protocol;
use crate::model::{Motor, RobotModel, State, StopAction, TICK_S};
use crate::record::{BenchSample, Sample};
use checks::Checks;
use estimate::Estimator;
use imu_watch::GravityWatch;
use program::Program;
use self_test::{Finding, SelfTest};
use switching::Switching;
use watch::Watch;
use wheel_watch::WheelWatch;

/// Times between two queries of the motors' health, in turn: with unequal ones a reply that is later than the next
/// query shows in the round trip.
const HEALTH_PERIODS: [Duration; 2] = [Duration::from_millis(30), Duration::from_millis(60)];
/// Time between two queries of the motors' state where no torque is commanded.
const STATE_PERIOD: Duration = Duration::from_millis(5);
/// Time between two looks at the checks.
const CHECK_PERIOD: Duration = Duration::from_millis(50);
/// Longest time until a motor has said that it is on.
const ON_TIMEOUT: Duration = Duration::from_millis(200);
/// Time from arming until the whole torque is there, s.
const RAMP_S: f64 = 0.2;
/// Speed from which on motors that roll out are switched off, rad/s, and age of a reading of it.
const SLOW_RAD_S: f64 = 1.0;
const FRESH: Duration = Duration::from_millis(20);
/// A robot that is driven, or may be.
#[derive(Clone, Debug)]
pub struct Drive {
    robot: Box<RobotModel>,
    settings: DriveSettings,
    torque_limit_nm: f64,
    /// Greatest change of a torque in one tick, N m.
    slew_nm: f64,
    stage: Stage,
    watch: Watch,
    wheels: WheelWatch,
    gravity: GravityWatch,
    estimator: Estimator,
    program: Program,
    checks: Checks,
    self_test: SelfTest,
    /// Whether the controller feeds effects forward that depend on angles which are not known here.
    loses_effects: bool,
    reference: Reference,
    asked_nm: [f64; 2],
    armed: Duration,
    armed_pitch_rad: f64,
    switching: Option<Switching>,
    next_health: Duration,
    health_queries: usize,
    next_state: Duration,
    next_checks: Duration,
    last_step: Option<Duration>,
}

impl Drive {
    /// A robot that is listened to, before the first step.
    ///
    /// # Errors
    /// A model that does not say how much torque a current makes or how much is allowed, or is out of range, gains that
    /// [`gate::check`] refuses, and a sweep that is too short.
    pub fn new(
        robot: &RobotModel,
        controller: BalanceController,
        excitation: Excitation,
        settings: DriveSettings,
    ) -> Result<Self, DriveError> {
        robot.validate()?;
        let torque_limit_nm = torque_limit(robot)?;
        if matches!(excitation, Excitation::Balance | Excitation::BalanceMultisine) {
            gate::check(robot, &controller)?;
        }
        let loses_effects = controller.needs_rotor_angle();
        let program = Program::new(robot, controller.without_rotor_angle(), excitation, torque_limit_nm)?;
        Ok(Self {
            settings,
            torque_limit_nm,
            slew_nm: robot.limits.torque_slew_nm_s.map_or(f64::INFINITY, |slew| slew * TICK_S),
            stage: Stage::Listening,
            watch: Watch::new(),
            wheels: WheelWatch::new(robot, program.balances()),
            gravity: GravityWatch::new(robot.parameters.gravity_m_s2, robot.parameters.com_height_m),
            estimator: Estimator::new(robot),
            checks: Checks::new(program.balances(), Duration::ZERO),
            self_test: SelfTest::new(robot, program.balances(), torque_limit_nm),
            program,
            loses_effects,
            reference: Reference::default(),
            asked_nm: [0.0; 2],
            armed: Duration::ZERO,
            armed_pitch_rad: 0.0,
            switching: None,
            next_health: Duration::ZERO,
            health_queries: 0,
            next_state: Duration::ZERO,
            next_checks: Duration::ZERO,
            last_step: None,
            robot: Box::new(robot.clone()),
        })
    }

    /// How far the robot is from being driven.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// What has to be right before it is, as far as known; of the last time of checking.
    pub fn checks(&self) -> &[Check] {
        self.checks.list()
    }

    /// Whether the motors are off and have said so, or were never switched on.
    pub fn has_ended(&self) -> bool {
        self.stage == Stage::Listening || matches!(self.stage, Stage::Stopped(_)) && self.switching.is_none()
    }

    /// Returns the largest torque commanded of a motor, N m.
    pub fn torque_limit_nm(&self) -> f64 {
        self.torque_limit_nm
    }

    /// One tick.
    pub fn step(&mut self, now: Duration, inputs: &Inputs<'_>) -> Output {
        let mut output = Output::default();
        self.watch.hear(inputs, &self.robot.safety);
        self.estimator.hear(now, self.watch.states(), self.watch.imu.last);
        if let Some(switching) = &mut self.switching {
            switching.hear(inputs.motors);
        }
        for order in inputs.orders {
            self.obey(now, order, &mut output);
        }
        match self.stage {
            Stage::Listening => {}
            Stage::Checking => self.check(now, &mut output),
            Stage::Driving => self.drive(now, inputs, &mut output),
            Stage::Stopped(_) => self.switch(now, &mut output),
        }
        self.last_step = Some(now);
        output
    }

    fn obey(&mut self, now: Duration, order: &DriveOrder, output: &mut Output) {
        match (order, self.stage) {
            // Motors that still roll out are switched off.
            (DriveOrder::Stop, Stage::Stopped(_)) => {
                self.switching.as_mut().into_iter().for_each(Switching::has_rolled_out);
            }
            (DriveOrder::Finish, Stage::Stopped(_)) => {}
            (DriveOrder::Stop, _) => self.stop(now, StopReason::Requested, output),
            (DriveOrder::Finish, _) => self.stop(now, StopReason::TimeOver, output),
            (DriveOrder::Check, Stage::Listening) => self.begin_checks(now, output),
            (DriveOrder::Arm, Stage::Checking) => self.arm(now, output),
            (DriveOrder::Release, Stage::Checking | Stage::Stopped(_)) => self.release(output),
            (DriveOrder::Release, Stage::Listening) => {}
            (DriveOrder::Controller(controller), stage) => {
                self.take_over((**controller).clone(), stage, output);
            }
            (DriveOrder::Reference(reference), _) => self.refer_to(reference, output),
            (DriveOrder::Check, _) => refuse(output, "to check the robot, release it first"),
            (DriveOrder::Arm, _) => refuse(output, "to arm the robot, run the checks first"),
            (DriveOrder::Release, Stage::Driving) => refuse(output, "to release the robot, stop it first"),
        }
    }

    fn begin_checks(&mut self, now: Duration, output: &mut Output) {
        if self.loses_effects {
            let text =
                "effects that depend on the rotor angles are not compensated: angles are relative to arming";
            output.events.push(DriveEvent::Warning(text.to_owned()));
        }
        output.events.extend(self.robot.safety.unsafe_limits().into_iter().map(DriveEvent::Warning));
        let loss = protocol(self.robot.link.protocol).command_loss;
        output.events.extend(loss.map(|text| DriveEvent::Warning(text.to_owned())));
        self.checks = Checks::new(self.program.balances(), now);
        (self.next_health, self.next_state, self.next_checks) = (now, now, now);
        self.reach(Stage::Checking, output);
    }

    fn arm(&mut self, now: Duration, output: &mut Output) {
        self.checks.judge(now, &self.watch, &self.robot);
        if let Some(open) = self.checks.open() {
            let text = format!("not armed, because of {}: {}", open.name, open.text);
            output.events.push(DriveEvent::Warning(text));
            return;
        }
        self.estimator.count_from_here();
        self.program.start();
        self.self_test = SelfTest::new(&self.robot, self.program.balances(), self.torque_limit_nm);
        self.wheels.restart();
        self.gravity.restart();
        self.armed_pitch_rad = self.watch.imu.last.map_or(0.0, |imu| imu.pitch_rad);
        self.reference = Reference::default();
        self.asked_nm = [0.0; 2];
        self.armed = now;
        self.next_health = now + HEALTH_PERIODS[0];
        self.switching = Some(Switching::on(now));
        self.reach(Stage::Driving, output);
    }

    fn release(&mut self, output: &mut Output) {
        if let Some(motor) = self.switching.as_ref().and_then(Switching::missing) {
            let text = format!(
                "not released, because the {motor} motor has not confirmed that it is off: switch its supply off, or disconnect"
            );
            output.events.push(DriveEvent::Warning(text));
            return;
        }
        self.reach(Stage::Listening, output);
    }

    fn take_over(&mut self, controller: BalanceController, stage: Stage, output: &mut Output) {
        let Program::Balance { controller: handover, .. } = &mut self.program else {
            return refuse(
                output,
                "with the wheels in the air, speed control is active and no other controller is accepted",
            );
        };
        let controller = handover.complete(controller);
        if let Err(refusal) = gate::check(&self.robot, &controller) {
            let text =
                format!("the new gains are not applied and the previous ones remain active: {refusal}");
            return refuse(output, &text);
        }
        handover.hand_over(controller);
        if stage != Stage::Driving {
            handover.finish();
        }
        output.events.push(DriveEvent::Note("new gains applied"));
    }

    fn refer_to(&mut self, reference: &Reference, output: &mut Output) {
        let State { x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s } = reference.state;
        let finite =
            [x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s, reference.yaw_rad].iter().all(|v| v.is_finite());
        if finite && x_m.abs() <= self.robot.safety.distance_m {
            self.reference = *reference;
        } else {
            refuse(output, "a setpoint that is not finite or beyond distance_m in [safety] is rejected");
        }
    }

    fn check(&mut self, now: Duration, output: &mut Output) {
        self.checks.observe(&self.watch);
        if due(&mut self.next_state, now, STATE_PERIOD) {
            output.orders.push(MotorOrder::ReadState);
        }
        self.ask_health(now, output);
        if due(&mut self.next_checks, now, CHECK_PERIOD) {
            self.checks.judge(now, &self.watch, &self.robot);
        }
        output.sample = self.estimator.readings().map(|readings| {
            Sample::new(now.as_secs_f64(), &readings, &self.estimator.held(&readings).state, [0.0; 2])
        });
    }

    fn drive(&mut self, now: Duration, inputs: &Inputs<'_>, output: &mut Output) {
        let time_s = (now - self.armed).as_secs_f64();
        let Some(readings) = self.estimator.readings() else {
            return self.stop(now, StopReason::NotFinite, output);
        };
        let held = self.estimator.held(&readings);
        let acted_nm = self.estimator.acting_when_read(now);
        self.compare_sensors(&held.state, acted_nm);
        let problem = self.problem(now, inputs, &held.state, readings.motor_speed_rad_s);
        if let Some(reason) = problem {
            return self.stop(now, reason, output);
        }
        if self.settings.torque_scale_check {
            match self.self_test.step(time_s, (&readings, self.estimator.age_s(now)), acted_nm) {
                Some(Finding::Stop(reason)) => return self.stop(now, reason, output),
                Some(Finding::Warning(text)) => output.events.push(DriveEvent::Warning(text.to_owned())),
                None => {}
            }
        }
        let program_s = self.program_time_s(time_s);
        if self.program.is_done(program_s) {
            return self.stop(now, StopReason::Done, output);
        }
        let balances = self.program.balances();
        let measurement = if balances && self.settings.latency_compensation {
            self.estimator.at_action(now, &readings)
        } else {
            held
        };
        let wanted = self.program.step(program_s, &measurement, &self.reference);
        let nudges_nm =
            if self.settings.torque_scale_check { self.self_test.nudge_nm(time_s) } else { [0.0; 2] };
        let limit_nm = self.torque_limit_nm;
        let ramp_nm = limit_nm * ((time_s + TICK_S) / RAMP_S).min(1.0);
        // Nudges stand on top of a torque at the rising limit, or nothing would be seen of them.
        let wanted = [0, 1].map(|motor: usize| {
            (wanted[motor].clamp(-ramp_nm, ramp_nm) + nudges_nm[motor]).clamp(-limit_nm, limit_nm)
        });
        let asked: [f64; 2] = std::array::from_fn(|motor| self.slewed(motor, wanted[motor]));
        if !asked.iter().all(|torque| torque.is_finite()) {
            return self.stop(now, StopReason::NotFinite, output);
        }
        self.asked_nm = asked;
        self.estimator.remember_asked(now, asked);
        self.switch(now, output);
        output.orders.push(MotorOrder::Torque(asked));
        self.ask_health(now, output);
        output.sample = Some(Sample::new(now.as_secs_f64(), &readings, &held.state, asked));
        output.bench = self.program.target_rad_s(program_s).map(|target_speed_rad_s| BenchSample {
            time_s: now.as_secs_f64(),
            motor_angle_rad: readings.motor_angle_rad,
            motor_speed_rad_s: readings.motor_speed_rad_s,
            torque_nm: asked,
            target_speed_rad_s,
        });
    }

    /// Asks the motors for their health where it is time to.
    fn ask_health(&mut self, now: Duration, output: &mut Output) {
        if due(&mut self.next_health, now, HEALTH_PERIODS[self.health_queries % 2]) {
            self.health_queries += 1;
            output.orders.push(MotorOrder::ReadHealth);
        }
    }

    /// Hands the newest readings to the watches that compare sensors with each other.
    fn compare_sensors(&mut self, state: &State, acted_nm: [f64; 2]) {
        let [Some(left), Some(right)] = self.watch.states() else { return };
        if !self.program.balances() {
            return self.wheels.hear_in_air(&[left, right], acted_nm, &self.robot.safety);
        }
        let Some(imu) = self.watch.imu.last else { return };
        self.wheels.hear(&[left, right], &imu, acted_nm, &self.robot.safety);
        self.gravity.hear(&imu, state);
    }

    /// Time of the program: wheels in the air are nudged before it begins.
    fn program_time_s(&self, time_s: f64) -> f64 {
        if self.program.balances() || !self.settings.torque_scale_check {
            time_s
        } else {
            (time_s - self.self_test.end_s()).max(0.0)
        }
    }

    fn problem(
        &self,
        now: Duration,
        inputs: &Inputs<'_>,
        state: &State,
        motor_speed_rad_s: [f64; 2],
    ) -> Option<StopReason> {
        let limits = &self.robot.safety;
        let late = inputs.late.max(watch::lateness(now, self.last_step));
        let inputs = Inputs { late, ..*inputs };
        let balances = self.program.balances();
        self.watch
            .problem(now, &inputs, limits, self.armed)
            .or_else(|| self.never_on(now))
            .or_else(|| self.watch.imu.frozen(now, limits, balances))
            .or_else(|| self.watch.imu.inconsistent(limits))
            .or_else(|| self.wheels.problem(limits))
            .or_else(|| {
                if balances {
                    watch::out_of_bounds(state, limits)
                        .or_else(|| self.wheels.too_fast(limits))
                        .or_else(|| self.gravity.problem(limits))
                } else {
                    // The stand may hold the body at any pitch.
                    let pitch_rad = imu_watch::near_zero(state.pitch_rad - self.armed_pitch_rad);
                    watch::too_fast(motor_speed_rad_s, limits).or_else(|| {
                        (pitch_rad.abs() > limits.tilt_rad).then_some(StopReason::Tilt { pitch_rad })
                    })
                }
            })
    }

    /// A motor that has not said that it is on.
    fn never_on(&self, now: Duration) -> Option<StopReason> {
        let switching = self.switching.as_ref().filter(|on| now > on.since() + ON_TIMEOUT)?;
        switching.missing().map(|motor| StopReason::MotorOff { motor })
    }

    fn slewed(&self, motor: usize, wanted_nm: f64) -> f64 {
        let change = wanted_nm - self.asked_nm[motor];
        // A change within the slew is taken as it is, to the last bit.
        if change.abs() > self.slew_nm {
            self.asked_nm[motor] + self.slew_nm.copysign(change)
        } else {
            wanted_nm
        }
    }

    /// Sends zero torque and switches the motors off in this very step. Motors that were not switched on here belong to
    /// somebody else, and nothing is sent to them.
    fn stop(&mut self, now: Duration, reason: StopReason, output: &mut Output) {
        let driven = self.stage == Stage::Driving;
        output.orders = Orders::default();
        self.asked_nm = [0.0; 2];
        let rolls_out = driven && self.robot.safety.stop == StopAction::ZeroThenOff && !self.is_slow(now);
        self.reach(Stage::Stopped(reason), output);
        if driven {
            self.switching =
                Some(if rolls_out { Switching::off_after_roll_out(now) } else { Switching::off(now) });
            self.switch(now, output);
        }
    }

    /// Whether both motors turn slowly, or one of them is silent.
    fn is_slow(&self, now: Duration) -> bool {
        let states = self.watch.states();
        let heard = states.iter().flatten().filter(|state| now <= state.time + FRESH);
        heard.clone().count() < Motor::BOTH.len()
            || heard.clone().all(|state| state.speed_rad_s.abs() < SLOW_RAD_S)
    }

    /// Switches the motors on or off until they have said so; each order to be off comes with one of no torque.
    fn switch(&mut self, now: Duration, output: &mut Output) {
        let is_slow = self.is_slow(now);
        let Some(switching) = &mut self.switching else { return };
        if is_slow && switching.waits(now) {
            switching.has_rolled_out();
        }
        if let Some(order) = switching.due(now) {
            if order == MotorOrder::Off {
                output.orders.push(MotorOrder::Torque([0.0; 2]));
            }
            if !switching.waits(now) {
                output.orders.push(order);
            }
        }
        if switching.is_done() {
            self.switching = None;
        }
    }

    fn reach(&mut self, stage: Stage, output: &mut Output) {
        self.stage = stage;
        output.events.push(DriveEvent::Stage(stage));
    }
}

fn refuse(output: &mut Output, reason: &str) {
    output.events.push(DriveEvent::Warning(reason.to_owned()));
}

/// Whether it is time for something periodic.
fn due(next: &mut Duration, now: Duration, period: Duration) -> bool {
    let is_due = now >= *next;
    if is_due {
        *next = now + period;
    }
    is_due
}

/// The model's limit, within the range of the torque command.
fn torque_limit(robot: &RobotModel) -> Result<f64, DriveError> {
    let host = (protocol(robot.link.protocol).host)(&robot.link);
    let range = host.torque_range().map_err(DriveError::NoTorqueRange)?;
    let limit_nm = robot.limits.torque_nm.ok_or(DriveError::NoTorqueLimit)?;
    let greatest_nm = range.max_nm;
    if limit_nm > greatest_nm {
        return Err(DriveError::TorqueLimit { limit_nm, greatest_nm });
    }
    Ok(limit_nm)
}

#[cfg(test)]
mod tests;
