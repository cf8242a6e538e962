//! One run of a motor with its wheel in the air: Heun steps between the events at which friction sticks and lets go, a
//! speed loop of its own and sensors of their own.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::bench_cases::{BenchCase, Flaw, Shaft};
use super::random::Random;
use super::robot_run::Recording;

const TICK: f64 = 1e-3;
const SUBSTEPS: usize = 10;
/// Encoder of 16 bits, and a speed in steps of 1 deg/s with noise.
const ANGLE_STEP: f64 = TAU / 65_536.0;
const SPEED_STEP: f64 = TAU / 360.0;
const SPEED_NOISE: f64 = 0.017;
const TORQUE_NOISE: f64 = 1.4e-3;
/// Standard deviation of the torque that nobody measures, new each millisecond.
const UNMEASURED: f64 = 1.5e-3;

/// What flaws remember, by flaw.
#[derive(Clone, Default)]
struct Memory {
    bristle: f64,
    asked: VecDeque<f64>,
    lagged: Option<f64>,
    /// Rotor in its gap: place and speed against the wheel.
    gap: [f64; 2],
    /// A hidden state and its rate.
    hidden: [f64; 2],
    /// What is left of a kick.
    slow: f64,
}

struct Plant<'a> {
    shaft: Shaft,
    flaws: &'a [Flaw],
    memory: Vec<Memory>,
    angle: f64,
    speed: f64,
    /// Which way it slides; 0 while it sticks.
    direction: f64,
    time: f64,
}

/// Torque of the wheel's loop and what of it reaches the wheel.
struct Drive {
    acting: f64,
    disturbance: f64,
}

impl Plant<'_> {
    /// Torques that do not depend on whether it slides, at an angle and a speed.
    fn free(&self, drive: &Drive, angle: f64, speed: f64) -> f64 {
        let mut sum = drive.acting + drive.disturbance - self.shaft.curve.offset;
        sum -= self.shaft.curve.viscous * speed;
        for (flaw, memory) in self.flaws.iter().zip(&self.memory) {
            sum += match *flaw {
                Flaw::Cogging { order, nm, phase } => nm * (order * angle + phase).sin(),
                Flaw::Ripple { order, share, phase } => drive.acting * share * (order * angle + phase).sin(),
                Flaw::QuadraticDrag { nm_s2 } => -nm_s2 * speed * speed.abs(),
                Flaw::ViscousAsymmetry { nm_s } => -nm_s * speed.abs(),
                Flaw::FrictionAsymmetry { nm } => -nm,
                Flaw::Viscous { nm_s } => -nm_s * speed,
                Flaw::Presliding { nm, .. } => -nm * memory.bristle,
                Flaw::Hum { nm, hz } => nm * (TAU * hz * self.time).sin(),
                Flaw::Walk { nm, .. } => nm * memory.hidden[0],
                Flaw::Spring { nm_rad, centre } => -nm_rad * (angle - centre),
                Flaw::Disc { share, hz } => {
                    let stiffness = share * self.shaft.inertia * (TAU * hz).powi(2);
                    stiffness * memory.hidden[0] + 0.02 * stiffness / (TAU * hz) * memory.hidden[1]
                }
                _ => 0.0,
            };
        }
        sum
    }

    /// Level of dry friction at a speed.
    fn level(&self, drive: &Drive, speed: f64) -> f64 {
        let curve = &self.shaft.curve;
        let fade = (-(speed.abs() / curve.knee).powf(curve.shape)).exp();
        let mut level = curve.coulomb + (curve.standing - curve.coulomb) * fade;
        for (flaw, memory) in self.flaws.iter().zip(&self.memory) {
            level += match *flaw {
                Flaw::Coulomb { nm } => nm,
                Flaw::LowSpeed { nm, speed: scale } => nm * (-speed.abs() / scale).exp(),
                Flaw::LoadFriction { share } => share * drive.acting.abs(),
                Flaw::Thermal { nm, seconds } => -nm * (1.0 - (-self.time / seconds).exp()),
                Flaw::PositionFriction { order, nm, phase } => nm * (order * self.angle + phase).cos(),
                Flaw::Presliding { nm, .. } => -nm,
                Flaw::HiddenFriction { nm, hz } => nm * (TAU * hz * self.time).sin(),
                Flaw::RateHysteresis { nm, .. } => nm * (2.0 * (memory.slow - speed)).tanh(),
                _ => 0.0,
            };
        }
        level.max(0.0)
    }

    fn inertia(&self) -> f64 {
        let more = self.flaws.iter().map(|flaw| match *flaw {
            Flaw::Inertia { share } => share * self.shaft.inertia,
            _ => 0.0,
        });
        self.shaft.inertia + more.sum::<f64>()
    }

    fn step(&mut self, drive: &Drive, dt: f64) {
        let inertia = self.inertia();
        let before = (self.angle, self.speed);
        if self.direction == 0.0 {
            let load = self.free(drive, self.angle, 0.0);
            if load.abs() > self.level(drive, 0.0) {
                self.direction = load.signum();
            }
        }
        if self.direction != 0.0 {
            let accelerate = |plant: &Self, angle: f64, speed: f64| {
                (plant.free(drive, angle, speed) - plant.direction * plant.level(drive, speed)) / inertia
            };
            let first = accelerate(self, self.angle, self.speed);
            let second = accelerate(self, self.angle + dt * self.speed, self.speed + dt * first);
            let speed = self.speed + 0.5 * dt * (first + second);
            // Never across a standstill: there friction decides anew.
            let stops = speed * self.direction <= 0.0;
            let new = if stops { 0.0 } else { speed };
            self.angle += 0.5 * dt * (self.speed + new);
            self.speed = new;
            if stops {
                self.direction = 0.0;
            }
        }
        self.time += dt;
        self.remember(before, dt);
    }

    /// Advances what follows the motion.
    fn remember(&mut self, (angle, speed): (f64, f64), dt: f64) {
        let (moved, acceleration, now) = (self.angle - angle, (self.speed - speed) / dt, self.speed);
        for (flaw, memory) in self.flaws.iter().zip(&mut self.memory) {
            match *flaw {
                Flaw::Presliding { travel, .. } => {
                    memory.bristle += (moved - moved.abs() * memory.bristle) / travel;
                }
                Flaw::RateHysteresis { seconds, .. } => memory.slow += dt / seconds * (now - memory.slow),
                Flaw::Disc { hz, .. } => {
                    let [place, rate] = memory.hidden;
                    let pull = -(TAU * hz).powi(2) * place - 0.02 * TAU * hz * rate - acceleration;
                    memory.hidden[1] += dt * pull;
                    memory.hidden[0] += dt * memory.hidden[1];
                }
                _ => {}
            }
        }
    }

    /// What reaches the wheel of a torque that is requested, for one tick.
    fn acting(&mut self, asked: f64, random: &mut Random) -> f64 {
        let mut torque = asked;
        let inertia = self.shaft.inertia;
        for (flaw, memory) in self.flaws.iter().zip(&mut self.memory) {
            match *flaw {
                Flaw::Gain { share } => torque *= 1.0 + share,
                Flaw::Saturation { nm } => torque = torque.clamp(-nm, nm),
                Flaw::Deadzone { nm } => torque = torque.signum() * (torque.abs() - nm).max(0.0),
                Flaw::Delay { seconds } => {
                    memory.asked.push_front(torque);
                    let late = seconds / TICK;
                    let at = |i: usize| memory.asked.get(i).or(memory.asked.back()).copied().unwrap_or(0.0);
                    let share = late.fract();
                    torque = (1.0 - share) * at(late as usize) + share * at(late as usize + 1);
                    memory.asked.truncate(late as usize + 3);
                }
                Flaw::Lag { seconds } => {
                    let mut value = memory.lagged.unwrap_or(torque);
                    let mut mean = 0.0;
                    for _ in 0..20 {
                        mean += value / 20.0;
                        value += (torque - value) * (1.0 - (-TICK / 20.0 / seconds).exp());
                    }
                    memory.lagged = Some(value);
                    torque = mean;
                }
                Flaw::Backlash { gap, rotor } => {
                    // The rotor flies between the sides and moves with the wheel when it touches one.
                    let [place, rate] = &mut memory.gap;
                    let mut free = 0.0;
                    for _ in 0..20 {
                        let end = if torque > 0.0 { gap } else { 0.0 };
                        if *place == end {
                            *rate = 0.0;
                            continue;
                        }
                        free += 1.0 / 20.0;
                        *rate += TICK / 20.0 * torque / (rotor * inertia);
                        *place += TICK / 20.0 * *rate;
                        if !(0.0..=gap).contains(place) {
                            (*place, *rate) = (place.clamp(0.0, gap), 0.0);
                        }
                    }
                    torque *= 1.0 - free;
                }
                Flaw::Walk { seconds, .. } => {
                    let keep = (-TICK / seconds).exp();
                    memory.hidden[0] = keep * memory.hidden[0] + (1.0 - keep * keep).sqrt() * random.normal();
                }
                _ => {}
            }
        }
        torque
    }
}

/// The speed that the loop is requested, rad/s, at every tick, and torque on top of it: slow both ways, steps or waves.
fn reference(style: u64, ticks: usize, random: &mut Random) -> Vec<[f64; 2]> {
    let seconds = ticks as f64 * TICK;
    let (height, period) = (random.between(4.5, 6.0), random.between(0.2, 0.35) * seconds);
    let waves: Vec<[f64; 3]> = (0..9)
        .map(|index| {
            let hz = 0.11 * 1.75_f64.powi(index) * random.between(0.85, 1.15);
            [random.between(0.7, 1.3) * (0.9 / (1.0 + 0.25 * hz)), hz, random.between(0.0, TAU)]
        })
        .collect();
    let shakes: Vec<[f64; 3]> = (0..6)
        .map(|_| [random.between(2e-3, 5e-3), random.between(5.0, 45.0), random.between(0.0, TAU)])
        .collect();
    let (mut level, mut until) = (0.0, 0.0);
    (0..ticks)
        .map(|tick| {
            let t = tick as f64 * TICK;
            let triangle = height * (4.0 * ((t / period + 0.25).fract() - 0.5).abs() - 1.0);
            let multi: f64 = waves.iter().map(|[size, hz, phase]| size * (TAU * hz * t + phase).sin()).sum();
            if t >= until {
                level = random.sign() * random.between(0.5, 7.0);
                until = t + random.between(0.6, 1.8);
            }
            let speed = match style {
                0 => triangle + 0.5 * multi,
                1 if t < 0.5 * seconds => triangle,
                1 => level + 0.3 * multi,
                _ if t < 0.4 * seconds => 0.8 * level,
                _ => 1.6 * multi + 0.4 * triangle,
            };
            let shake = shakes.iter().map(|[size, hz, phase]| size * (TAU * hz * t + phase).sin()).sum();
            [speed, shake]
        })
        .collect()
}

/// A log of `seconds` at 1 kHz, with a factor on all noise.
pub(crate) fn run(case: &BenchCase, seconds: f64, noise: f64, seed: u64) -> Recording {
    let mut random = Random::new(seed.wrapping_mul(104_729).wrapping_add(5));
    let ticks = (seconds / TICK) as usize;
    let wanted = reference(case.seed % 3, ticks, &mut random);
    // Of the encoder, the same in every run.
    let zero = Random::new(case.seed).between(0.0, TAU);
    let mut plant = Plant {
        shaft: case.shaft,
        flaws: &case.flaws,
        memory: vec![Memory::default(); case.flaws.len()],
        angle: zero,
        speed: 0.0,
        direction: 0.0,
        time: 0.0,
    };
    let mut columns: [Vec<f64>; 4] = std::array::from_fn(|_| Vec::with_capacity(ticks));
    let mut integral = 0.0;
    for (tick, [speed, shake]) in wanted.into_iter().enumerate() {
        let seen_angle = ((plant.angle - zero) / ANGLE_STEP).round() * ANGLE_STEP;
        let seen_speed =
            ((plant.speed + noise * SPEED_NOISE * random.normal()) / SPEED_STEP).round() * SPEED_STEP;
        let lack = speed - seen_speed;
        integral = (integral + TICK * 0.25 * lack).clamp(-0.08, 0.08);
        let asked = (0.05 * lack + integral + shake).clamp(-0.25, 0.25);
        let drive = Drive {
            acting: plant.acting(asked, &mut random),
            disturbance: noise * UNMEASURED * random.normal(),
        };
        let seen_torque = asked + noise * TORQUE_NOISE * random.normal();
        let row = [tick as f64 * TICK, seen_angle, seen_speed, (seen_torque * 1e5).round() / 1e5];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        for _ in 0..SUBSTEPS {
            plant.step(&drive, TICK / SUBSTEPS as f64);
        }
    }
    let names = ["time_s", "motor_angle_rad", "motor_speed_rad_s", "torque_nm"];
    names.into_iter().zip(columns).collect()
}
