//! One run of the robot: Runge-Kutta steps between the events at which friction sticks and lets go, a controller of
//! its own and sensors of their own.

use std::f64::consts::TAU;

use super::body::Body;
use super::fault::{Fault, Memory, Now};
use super::random::Random;

/// A log: column names and values.
pub(crate) type Recording = Vec<(&'static str, Vec<f64>)>;

const TICK: f64 = 1e-3;
const SUBSTEPS: usize = 4;
const NAMES: [&str; 11] = [
    "time_s",
    "x_m",
    "x_dot_m_s",
    "pitch_rad",
    "pitch_rate_rad_s",
    "motor_angle_left_rad",
    "motor_angle_right_rad",
    "motor_speed_left_rad_s",
    "motor_speed_right_rad_s",
    "torque_left_nm",
    "torque_right_nm",
];
/// x, ẋ, θ, θ̇, and an inner mass' shift and speed.
type State = [f64; 6];

/// How a run goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Conditions {
    pub(crate) seconds: f64,
    pub(crate) excitation: f64,
    /// Factor on the random loads and the sensors' noise.
    pub(crate) noise: f64,
}

impl Default for Conditions {
    fn default() -> Self {
        Self { seconds: 40.0, excitation: 1.0, noise: 1.0 }
    }
}

struct Plant<'a> {
    /// The true body, without the mass that moves inside of it.
    rigid: Body,
    whole: Body,
    faults: &'a [Fault],
    memory: Vec<[Memory; 2]>,
    shaft: [f64; 2],
    loads: [f64; 3],
    t: f64,
    stuck: bool,
    direction: f64,
    angle_zero: [f64; 2],
}

impl Plant<'_> {
    fn speed(&self, s: &State) -> f64 {
        s[1] / self.whole.radius - s[3]
    }

    /// Torque on both shafts without dry friction's direction when at standstill, force and body torque.
    fn loads(&self, s: &State, direction: f64) -> (f64, f64, f64) {
        let w = self.speed(s);
        let (mut shaft, mut axle, mut body) = (self.loads[0], self.loads[1], self.loads[2]);
        for motor in 0..2 {
            let curve = &self.whole.motors[motor];
            let angle = s[0] / self.whole.radius - s[2] + self.angle_zero[motor];
            let now = Now { angle, w, direction, asked: self.shaft[motor], rolled: s[0] / self.whole.radius };
            shaft += self.shaft[motor] - curve.at(w, direction);
            for (fault, memory) in self.faults.iter().zip(&self.memory) {
                shaft += fault.motor(now, &memory[motor], curve.coulomb);
            }
        }
        let weight = (self.whole.mass + 2.0 * self.whole.wheel) * self.whole.gravity;
        for (fault, memory) in self.faults.iter().zip(&self.memory) {
            let (f, n) = fault.outside(self.t, s, self.whole.radius, weight, &memory[0]);
            axle += f;
            body += n;
            match *fault {
                Fault::Mode { share, hz, damping } => {
                    let own = share * self.whole.inertia;
                    body += own * ((TAU * hz).powi(2) * s[4] + 2.0 * damping * TAU * hz * s[5]);
                }
                Fault::Slosh { kg, hz, damping } => {
                    let force = kg * ((TAU * hz).powi(2) * s[4] + 2.0 * damping * TAU * hz * s[5]);
                    let height = self.whole.height;
                    axle += force;
                    body +=
                        height * s[2].cos() * force + kg * self.whole.gravity * (height * s[2].sin() + s[4]);
                }
                Fault::Slip { .. } => {
                    // The robot is slower than its wheels: what it has of their acceleration is less.
                    let (mass, rate) = (self.whole.mass, memory[0].slip_rate);
                    axle += (mass + 2.0 * self.whole.wheel) * rate;
                    body += mass * self.whole.height * s[2].cos() * rate;
                }
                Fault::PitchOffset { rad } => {
                    body += self.whole.mass
                        * self.whole.gravity
                        * self.whole.height
                        * ((s[2] + rad).sin() - s[2].sin());
                }
                _ => {}
            }
        }
        (shaft, axle, body)
    }

    fn inner(&self, s: &State, x_accel: f64, turn: f64) -> f64 {
        let mut accel = 0.0_f64;
        for fault in self.faults {
            let (hz, damping, push) = match *fault {
                Fault::Mode { hz, damping, .. } => (hz, damping, turn),
                Fault::Slosh { hz, damping, .. } => {
                    (hz, damping, x_accel + self.whole.height * s[2].cos() * turn)
                }
                _ => continue,
            };
            accel = -(TAU * hz).powi(2) * s[4] - 2.0 * damping * TAU * hz * s[5] - push;
        }
        accel
    }

    /// Torque that friction has to bear to hold the shafts, and the derivative while they are held.
    fn held(&self, s: &State) -> (f64, State) {
        let (shaft, axle, body) = self.loads(s, 0.0);
        let b = &self.rigid;
        let (lever, r) = (b.mass * b.height, b.radius);
        let c = s[2].cos();
        let bottom = b.rolling() * r * r + 2.0 * lever * c * r + b.inertia + lever * b.height;
        let curl = lever * s[3] * s[3] * s[2].sin();
        let turn = (lever * b.gravity * s[2].sin() + r * curl + r * axle + body) / bottom;
        let needed = r * ((b.rolling() * r + lever * c) * turn - curl - axle);
        (shaft - needed, [s[1], r * turn, s[3], turn, s[5], self.inner(s, r * turn, turn)])
    }

    fn derivative(&self, s: &State) -> State {
        if self.stuck {
            return self.held(s).1;
        }
        let (shaft, axle, body) = self.loads(s, self.direction);
        let (x_accel, turn) = self.rigid.accelerate(s[2], s[3], shaft, axle, body);
        [s[1], x_accel, s[3], turn, s[5], self.inner(s, x_accel, turn)]
    }

    fn runge_kutta(&self, s: &State, h: f64) -> State {
        let at = |k: &State, h: f64| std::array::from_fn(|i| s[i] + h * k[i]);
        let k1 = self.derivative(s);
        let k2 = self.derivative(&at(&k1, h / 2.0));
        let k3 = self.derivative(&at(&k2, h / 2.0));
        let k4 = self.derivative(&at(&k3, h));
        std::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// Most that friction can hold.
    fn grip(&self, s: &State) -> f64 {
        let mut grip = 0.0;
        for motor in 0..2 {
            let curve = &self.whole.motors[motor];
            grip += curve.standing;
            let angle = s[0] / self.whole.radius - s[2] + self.angle_zero[motor];
            for (fault, memory) in self.faults.iter().zip(&self.memory) {
                let rolled = s[0] / self.whole.radius;
                let forward = Now { angle, w: 0.0, direction: 1.0, asked: self.shaft[motor], rolled };
                let backward = Now { direction: -1.0, ..forward };
                grip -= 0.5
                    * (fault.motor(forward, &memory[motor], curve.coulomb)
                        - fault.motor(backward, &memory[motor], curve.coulomb));
            }
        }
        grip.max(0.0)
    }

    /// Advances by `h`, event by event.
    fn advance(&mut self, s: &mut State, mut h: f64) {
        for _ in 0..6 {
            if self.stuck {
                let (load, _) = self.held(s);
                if load.abs() > self.grip(s) {
                    self.stuck = false;
                    self.direction = load.signum();
                }
            }
            let next = self.runge_kutta(s, h);
            if self.stuck || self.speed(&next) * self.direction >= 0.0 {
                *s = next;
                return;
            }
            // The shafts come to rest inside of the step: where?
            let (mut low, mut high) = (0.0, h);
            for _ in 0..25 {
                let middle = 0.5 * (low + high);
                let there = self.runge_kutta(s, middle);
                if self.speed(&there) * self.direction >= 0.0 { low = middle } else { high = middle }
            }
            *s = self.runge_kutta(s, low);
            s[1] = self.whole.radius * s[3];
            h -= low;
            self.stuck = true;
            if h <= 1e-12 {
                return;
            }
        }
        // Chatter at the edge of sticking: the rest of the step is spent at standstill.
        self.stuck = true;
        *s = self.runge_kutta(s, h);
    }

    fn remember(&mut self, s: &State, random: &mut Random) {
        let w = self.speed(s);
        let force = (self.shaft[0] + self.shaft[1]) / self.whole.radius;
        for (fault, memory) in self.faults.iter().zip(&mut self.memory) {
            let shared = (random.normal(), random.normal());
            for memory in memory {
                match *fault {
                    Fault::Presliding { travel, .. } => {
                        memory.bristle = (memory.bristle + w * TICK).clamp(-travel, travel);
                    }
                    Fault::Thermal { seconds, .. } => memory.warm += TICK / seconds * (1.0 - memory.warm),
                    Fault::HiddenFriction { hz, damping, .. } => {
                        // A resonance that nobody sees, driven by the shaft's speed.
                        let omega = TAU * hz;
                        let [place, speed] = memory.hidden;
                        let accel = omega * omega * (0.4 * w - place) - 2.0 * damping * omega * speed;
                        memory.hidden = [place + TICK * (speed + TICK * accel), speed + TICK * accel];
                    }
                    Fault::WalkingOffset { .. } => memory.walk += (TICK / 1.0).sqrt() * shared.0,
                    Fault::RateHysteresis { seconds, .. } => {
                        memory.slow_speed += TICK / seconds * (w - memory.slow_speed);
                    }
                    Fault::Weather { .. } => {
                        memory.gust += TICK * -memory.gust / 0.8 + (2.0 * TICK / 0.8).sqrt() * shared.0
                    }
                    Fault::RoughShove { .. } => {
                        memory.shove += TICK / 0.02 * (1.0 + 6.0 * shared.1 - memory.shove)
                    }
                    Fault::Slip { m_s_n, seconds } => {
                        memory.slip_rate = (m_s_n * force - memory.slip) / seconds;
                        memory.slip += TICK * memory.slip_rate;
                    }
                    Fault::TyreMemory { seconds, .. } => {
                        memory.tyre += TICK / seconds * ((s[1] / 0.05).tanh() - memory.tyre);
                    }
                    Fault::BodyWander { .. } => {
                        memory.wander += TICK * -memory.wander / 2.0 + (2.0 * TICK / 2.0).sqrt() * shared.0;
                    }
                    Fault::Hum { hz, .. } => memory.phase += TAU * hz * TICK + 0.03 * shared.0,
                    Fault::Bursts { every, .. } => {
                        let on = (self.t / every).fract() * every < 0.25;
                        memory.burst = if on { shared.1 * 4.0 } else { 0.0 };
                    }
                    Fault::Sag { seconds, .. } => {
                        // About 1 in the mean, of a torque of 0.4 N m.
                        let power = (self.shaft[0] / 0.4).powi(2).min(6.0);
                        memory.heat += TICK / seconds * (power - memory.heat);
                    }
                    Fault::Backlash { gap } => {
                        let side = memory.side + w * TICK;
                        memory.side = side.clamp(-gap, gap);
                    }
                    _ => {}
                }
            }
        }
    }
}

fn quantised(value: f64, step: f64) -> f64 {
    (value / step).round() * step
}

/// Asked torque to torque that acts.
fn through_actuator(faults: &[Fault], memory: &mut [[Memory; 2]], motor: usize, asked: f64) -> f64 {
    let mut acts = asked;
    for (fault, memory) in faults.iter().zip(memory) {
        let memory = &mut memory[motor];
        acts = match *fault {
            Fault::Delay { seconds } => {
                memory.asked.push(acts);
                let (whole, part) = ((seconds / TICK).floor(), (seconds / TICK).fract());
                let back = |n: f64| {
                    let last = memory.asked.len() - 1;
                    memory.asked[last.saturating_sub(n as usize)]
                };
                (1.0 - part) * back(whole) + part * back(whole + 1.0)
            }
            Fault::Lag { seconds } => {
                // What is requested holds for a tick, over which the mean acts.
                let (before, faded) = (memory.lagged - acts, (-TICK / seconds).exp());
                memory.lagged = acts + before * faded;
                acts + before * (1.0 - faded) * seconds / TICK
            }
            Fault::Gain { share } => acts * (1.0 + share),
            Fault::Saturation { nm } => acts.clamp(-nm, nm),
            Fault::Deadzone { nm } => acts - acts.clamp(-nm, nm),
            Fault::Backlash { gap } => {
                if memory.side.abs() < 0.999 * gap {
                    0.0
                } else {
                    acts
                }
            }
            _ => acts,
        };
    }
    acts
}

/// Tones of torque and a reference that wanders.
struct Excitation {
    tones: Vec<(f64, f64, f64)>,
    waypoints: Vec<(f64, f64)>,
}

impl Excitation {
    fn new(seconds: f64, size: f64, random: &mut Random) -> Self {
        let tones = (0..10)
            .map(|i| {
                let hz = 0.7 * 1.27f64.powi(i) * random.between(0.97, 1.03);
                (TAU * hz, random.between(0.0, TAU), size * 0.11)
            })
            .collect();
        let mut waypoints = vec![(0.0, 0.0)];
        while waypoints[waypoints.len() - 1].0 < seconds {
            let (t, _) = waypoints[waypoints.len() - 1];
            waypoints.push((t + random.between(1.4, 2.8), size * random.between(-0.85, 0.85)));
        }
        Self { tones, waypoints }
    }

    fn torque(&self, t: f64) -> f64 {
        self.tones.iter().map(|(omega, phase, size)| size * (omega * t + phase).sin()).sum()
    }

    /// Reference of x and ẋ: half a cosine from waypoint to waypoint.
    fn reference(&self, t: f64) -> (f64, f64) {
        let next =
            self.waypoints.iter().position(|(at, _)| *at > t).unwrap_or(self.waypoints.len() - 1).max(1);
        let ((t0, x0), (t1, x1)) = (self.waypoints[next - 1], self.waypoints[next]);
        let phase = std::f64::consts::PI * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        (
            x0 + (x1 - x0) * 0.5 * (1.0 - phase.cos()),
            (x1 - x0) * 0.5 * phase.sin() * std::f64::consts::PI / (t1 - t0),
        )
    }
}

/// The run of a `body` with `faults` under the controller of the `declared` body. `None` where the robot falls.
pub(crate) fn run(
    declared: &Body,
    body: &Body,
    faults: &[Fault],
    conditions: Conditions,
    seed: u64,
) -> Option<Recording> {
    let mut random = Random::new(seed);
    let mut whole = *body;
    let mut rigid_mass = 0.0;
    let mut rigid_inertia = 0.0;
    for fault in faults {
        match *fault {
            Fault::Mass { kg } => whole.mass += kg,
            Fault::Height { m } => whole.height += m,
            Fault::Inertia { kg_m2 } => whole.inertia += kg_m2,
            Fault::WheelInertia { kg_m2 } => whole.wheel_inertia += kg_m2,
            Fault::Slosh { kg, .. } => rigid_mass -= kg,
            Fault::Mode { share, .. } => rigid_inertia -= share * whole.inertia,
            _ => {}
        }
    }
    let rigid = Body { mass: whole.mass + rigid_mass, inertia: whole.inertia + rigid_inertia, ..whole };
    let gain = declared.gain();
    let excitation = Excitation::new(conditions.seconds, conditions.excitation, &mut random);
    let mut plant = Plant {
        rigid,
        whole,
        faults,
        memory: vec![Default::default(); faults.len()],
        shaft: [0.0; 2],
        loads: [0.0; 3],
        t: 0.0,
        stuck: true,
        direction: 1.0,
        angle_zero: [0.0, 0.41],
    };
    let noise = conditions.noise;
    let mut s: State = [0.0, 0.0, 0.01, 0.0, 0.0, 0.0];
    let start = -s[2];
    let (mut gyro, mut pitch) = (0.0, 0.0);
    let (gyro_bias, imu_delay) = faults.iter().fold((0.0, 0.0), |(bias, delay), fault| match *fault {
        Fault::GyroBias { rad_s } => (bias + rad_s, delay),
        Fault::ImuDelay { seconds } => (bias, delay + seconds),
        _ => (bias, delay),
    });
    let mut past: Vec<[f64; 2]> = Vec::new();
    let rows = (conditions.seconds / TICK).round() as usize;
    let mut columns: Recording = NAMES.iter().map(|name| (*name, Vec::with_capacity(rows))).collect();
    for row in 0..rows {
        let t = row as f64 * TICK;
        past.push([s[2], s[3]]);
        if row % 10 == 0 {
            let back = imu_delay / TICK;
            let at = |n: f64| past[row.saturating_sub(n as usize)];
            let (new, old, part) = (at(back.floor()), at(back.floor() + 1.0), back.fract());
            let blend = |i: usize| (1.0 - part) * new[i] + part * old[i];
            pitch = quantised(blend(0) + 1e-4 * noise * random.normal(), 0.01f64.to_radians());
            gyro = quantised(blend(1) + gyro_bias + 5.5e-4 * noise * random.normal(), 0.061f64.to_radians());
        }
        let w = s[1] / body.radius - s[3];
        let turn = TAU / 65536.0;
        let angle = quantised(s[0] / body.radius - s[2] - start, turn);
        let speed = quantised(w + 0.05 * noise * random.normal(), 1f64.to_radians());
        let x = body.radius * (angle + pitch);
        let x_dot = body.radius * (speed + gyro);
        let (wanted, wanted_speed) = excitation.reference(t);
        let feedback =
            -gain[0] * (x - wanted) - gain[1] * (x_dot - wanted_speed) - gain[2] * pitch - gain[3] * gyro;
        let asked: [f64; 2] = std::array::from_fn(|_| {
            quantised(feedback + excitation.torque(t) + 0.001 * random.normal(), 0.0026).clamp(-2.42, 2.42)
        });
        let values = [t, x, x_dot, pitch, gyro, angle, angle + 0.41, speed, speed, asked[0], asked[1]];
        columns.iter_mut().zip(values).for_each(|((_, column), value)| column.push(value));
        for (motor, &asked) in asked.iter().enumerate() {
            plant.shaft[motor] = through_actuator(faults, &mut plant.memory, motor, asked);
        }
        // White over the band of the log: 0.003 N m, 0.06 N and 0.007 N m per root of a hertz.
        let white = (0.5 / TICK).sqrt() * noise;
        plant.loads = [
            0.003 * white * random.normal(),
            0.055 * white * random.normal(),
            0.006 * white * random.normal(),
        ];
        for sub in 0..SUBSTEPS {
            let h = TICK / SUBSTEPS as f64;
            plant.t = t + sub as f64 * h;
            plant.advance(&mut s, h);
        }
        plant.remember(&s, &mut random);
        if s[2].abs() > 0.8 || !s[2].is_finite() {
            return None;
        }
    }
    Some(columns)
}
