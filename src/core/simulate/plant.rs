//! The moving robot: Eqs. 4 and 5 with motors whose friction truly sticks.
//!
//! # Method
//! The coordinates are motor angle q and pitch θ, x = r (q + θ), because friction acts along q: a stuck
//! shaft is q̇ = 0 exactly and q does not change by a single bit. Both wheels share x and θ, hence q̇ too.
//! Friction is set-valued (Filippov): at q̇ = 0 it takes whatever value in Σ[f_p − f_s, f_p + f_s] keeps
//! q̈ = 0, and the robot then tips as one rigid body on locked wheels. Between changes of phase (sliding
//! forward, sliding backward, stuck) the motion is smooth and a Runge-Kutta step of order 4 serves; the
//! instant of a change is located inside the step. A time-stepping complementarity method would need
//! no events but is of first order; events are rare here, and order 4 keeps energy to rounding.

use std::ops::RangeInclusive;

use crate::friction::Stribeck;
use crate::robot::{Coefficients, RobotParameters, State};

/// Changes of phase within one substep after which the shaft is taken as stuck for the rest of it.
const MAX_CHANGES: usize = 8;
/// Share of a substep to which the instant of a change of phase is located.
const INSTANT_TOLERANCE: f64 = 1e-9;

/// What acts on the robot, constant during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forcing {
    /// Torque of the left and the right motor before friction, N m.
    pub torque_nm: [f64; 2],
    /// Horizontal force on the body, forward positive, N.
    pub push_n: f64,
    /// Where that force acts: above the axle along the body, m.
    pub push_height_m: f64,
}

/// A robot in motion.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    coefficients: Coefficients,
    radius_m: f64,
    friction: [Option<Stribeck>; 2],
    /// Sum of both motors' ranges at rest; none where no torque is needed to turn a resting shaft.
    stick_range_nm: Option<RangeNm>,
    motion: Motion,
    phase: Phase,
}

#[derive(Clone, Copy, Debug)]
struct RangeNm {
    low: f64,
    high: f64,
}

/// q, q̇, θ, θ̇; also their time derivatives.
#[derive(Clone, Copy, Debug)]
struct Motion {
    angle: f64,
    speed: f64,
    pitch: f64,
    pitch_rate: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Friction without a range at rest: one smooth law for all speeds.
    Free,
    /// The shaft turns forward (1) or backward (−1).
    Slide(f64),
    /// q̇ = 0 held by friction.
    Stuck,
}

impl Motion {
    fn moved(&self, rate: &Self, dt: f64) -> Self {
        Self {
            angle: self.angle + dt * rate.angle,
            speed: self.speed + dt * rate.speed,
            pitch: self.pitch + dt * rate.pitch,
            pitch_rate: self.pitch_rate + dt * rate.pitch_rate,
        }
    }
}

impl Plant {
    /// A robot at `state`. The parameters are taken as validated.
    pub fn new(parameters: &RobotParameters, friction: [Option<Stribeck>; 2], state: &State) -> Self {
        let radius_m = parameters.wheel_radius_m;
        let motion = Motion {
            angle: state.x_m / radius_m - state.pitch_rad,
            speed: parameters.motor_speed_rad_s(state),
            pitch: state.pitch_rad,
            pitch_rate: state.pitch_rate_rad_s,
        };
        let stick_range_nm = stick_range(&friction);
        let phase = if stick_range_nm.is_none() {
            Phase::Free
        } else if motion.speed == 0.0 {
            Phase::Stuck
        } else {
            Phase::Slide(motion.speed.signum())
        };
        Self { coefficients: parameters.coefficients(), radius_m, friction, stick_range_nm, motion, phase }
    }

    /// The true state.
    pub fn state(&self) -> State {
        self.state_of(&self.motion)
    }

    /// Motor angle q = x/r − θ, rad.
    pub fn motor_angle_rad(&self) -> f64 {
        self.motion.angle
    }

    /// Motor speed q̇, rad/s; exactly 0 while stuck.
    pub fn motor_speed_rad_s(&self) -> f64 {
        self.motion.speed
    }

    /// Whether friction holds the shafts.
    pub fn stuck(&self) -> bool {
        self.phase == Phase::Stuck
    }

    /// Moves on by `dt_s` in `substeps` equal steps of order 4.
    pub fn advance(&mut self, forcing: &Forcing, dt_s: f64, substeps: usize) {
        let step = dt_s / substeps as f64;
        for _ in 0..substeps {
            self.substep(forcing, step);
        }
    }

    fn substep(&mut self, forcing: &Forcing, step: f64) {
        let mut left = step;
        for _ in 0..MAX_CHANGES {
            if self.phase == Phase::Stuck && self.margin(forcing, &self.motion) < 0.0 {
                self.leave(forcing);
            }
            let next = self.runge_kutta(forcing, left);
            if self.margin(forcing, &next) >= 0.0 {
                self.motion = next;
                return;
            }
            let share = self.locate_change(forcing, left, &next);
            self.motion = self.runge_kutta(forcing, left * share);
            left *= 1.0 - share;
            if self.phase != Phase::Stuck {
                self.stop();
            }
        }
        self.stop();
        self.motion = self.runge_kutta(forcing, left);
    }

    fn stop(&mut self) {
        self.motion.speed = 0.0;
        self.phase = Phase::Stuck;
    }

    /// From stuck to sliding: in the direction of the torque that friction could not hold.
    fn leave(&mut self, forcing: &Forcing) {
        let needed = self.holding_torque(forcing, &self.motion);
        let range = self.stick_range_nm.expect("only friction with a range at rest sticks");
        self.phase = Phase::Slide(if needed > range.high { 1.0 } else { -1.0 });
    }

    /// At least 0 as long as the present phase goes on: the speed in the direction of sliding, or the
    /// distance of the holding torque from the end of its range.
    fn margin(&self, forcing: &Forcing, motion: &Motion) -> f64 {
        match (self.phase, self.stick_range_nm) {
            (Phase::Slide(direction), _) => direction * motion.speed,
            (Phase::Stuck, Some(range)) => {
                let needed = self.holding_torque(forcing, motion);
                (range.high - needed).min(needed - range.low)
            }
            (Phase::Free, _) | (Phase::Stuck, None) => f64::INFINITY,
        }
    }

    /// Share of the step `dt` at which the phase has just ended: bisection between 0, where it holds, and
    /// 1, where it does not (`end`), sped up by the secant.
    fn locate_change(&self, forcing: &Forcing, dt: f64, end: &Motion) -> f64 {
        let mut holds = (0.0, self.margin(forcing, &self.motion));
        let mut ended = (1.0, self.margin(forcing, end));
        let mut bisect = false;
        while ended.0 - holds.0 > INSTANT_TOLERANCE {
            let secant = holds.0 + (ended.0 - holds.0) * holds.1 / (holds.1 - ended.1);
            // A little beyond the secant, so that both ends close in.
            let share = if bisect {
                f64::midpoint(holds.0, ended.0)
            } else {
                (secant + 0.4 * INSTANT_TOLERANCE).clamp(holds.0, ended.0)
            };
            let margin = self.margin(forcing, &self.runge_kutta(forcing, dt * share));
            let width = ended.0 - holds.0;
            if margin >= 0.0 {
                holds = (share, margin);
            } else {
                ended = (share, margin);
            }
            bisect = ended.0 - holds.0 > 0.5 * width;
        }
        ended.0
    }

    fn runge_kutta(&self, forcing: &Forcing, dt: f64) -> Motion {
        let start = &self.motion;
        let k1 = self.rate(forcing, start);
        let k2 = self.rate(forcing, &start.moved(&k1, 0.5 * dt));
        let k3 = self.rate(forcing, &start.moved(&k2, 0.5 * dt));
        let k4 = self.rate(forcing, &start.moved(&k3, dt));
        let mean = |pick: fn(&Motion) -> f64| (pick(&k1) + 2.0 * (pick(&k2) + pick(&k3)) + pick(&k4)) / 6.0;
        let rate = Motion {
            angle: mean(|k| k.angle),
            speed: mean(|k| k.speed),
            pitch: mean(|k| k.pitch),
            pitch_rate: mean(|k| k.pitch_rate),
        };
        start.moved(&rate, dt)
    }

    fn rate(&self, forcing: &Forcing, motion: &Motion) -> Motion {
        let applied: f64 = forcing.torque_nm.iter().sum();
        let friction = match self.phase {
            Phase::Free => self.sliding_friction(motion.speed, motion.speed.signum()),
            Phase::Slide(direction) => self.sliding_friction(motion.speed, direction),
            Phase::Stuck => self.holding_torque(forcing, motion),
        };
        let (motor_accel, pitch_accel) = self.accelerations(forcing, motion, applied - friction);
        // While stuck q̈ is 0 up to rounding; exactly 0 keeps the angle to the last bit.
        let speed = if self.phase == Phase::Stuck { 0.0 } else { motor_accel };
        Motion { angle: motion.speed, speed, pitch: motion.pitch_rate, pitch_rate: pitch_accel }
    }

    fn sliding_friction(&self, speed: f64, direction: f64) -> f64 {
        let one = |curve: &Stribeck| {
            let p = curve.parameters();
            curve.level_nm(speed) * direction + p.viscous_nm_s_rad * speed + p.offset_nm
        };
        self.friction.iter().flatten().map(one).sum()
    }

    /// Friction torque, summed over both motors, that keeps q̈ = 0, N m. q̈ is linear in the shaft torque.
    fn holding_torque(&self, forcing: &Forcing, motion: &Motion) -> f64 {
        let applied: f64 = forcing.torque_nm.iter().sum();
        let (free, _) = self.accelerations(forcing, motion, 0.0);
        let per_nm = self.accelerations(forcing, motion, 1.0).0 - free;
        applied + free / per_nm
    }

    /// q̈ and θ̈ under the sum of the shaft torques after friction, rad/s².
    fn accelerations(&self, forcing: &Forcing, motion: &Motion, shaft_nm: f64) -> (f64, f64) {
        let along = shaft_nm + self.radius_m * forcing.push_n;
        let about = forcing.push_height_m * motion.pitch.cos() * forcing.push_n - shaft_nm;
        let found = self.coefficients.accelerations(&self.state_of(motion), along, about);
        (found.x_ddot_m_s2 / self.radius_m - found.pitch_accel_rad_s2, found.pitch_accel_rad_s2)
    }

    fn state_of(&self, motion: &Motion) -> State {
        State {
            x_m: self.radius_m * (motion.angle + motion.pitch),
            x_dot_m_s: self.radius_m * (motion.speed + motion.pitch_rate),
            pitch_rad: motion.pitch,
            pitch_rate_rad_s: motion.pitch_rate,
        }
    }
}

fn stick_range(friction: &[Option<Stribeck>; 2]) -> Option<RangeNm> {
    let sum = |end: fn(&RangeInclusive<f64>) -> f64| -> f64 {
        friction.iter().flatten().map(|curve| end(&curve.stick_range_nm())).sum()
    };
    let range = RangeNm { low: sum(|range| *range.start()), high: sum(|range| *range.end()) };
    (range.high > range.low).then_some(range)
}
