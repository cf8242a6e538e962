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

use super::near_angle::NearAngle;
use super::sliding::SlidingFriction;
use crate::friction::Stribeck;
use crate::robot::{Accelerations, Coefficients, RobotParameters, State};

/// Changes of phase within one substep after which the shafts are taken as stuck for the rest of it.
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
#[derive(Clone, Debug)]
pub struct PlanarPlant {
    laws: Laws,
    motion: Motion,
    phase: Phase,
}

/// What does not change as the robot moves.
#[derive(Clone, Debug)]
struct Laws {
    coefficients: Coefficients,
    radius_m: f64,
    per_radius: f64,
    sliding: SlidingFriction,
    /// Sum of both motors' ranges at rest, N m; none where no torque is needed to turn a resting shaft.
    stick_range_nm: Option<RangeInclusive<f64>>,
}

/// q, q̇, θ, θ̇; also their rates of change.
#[derive(Clone, Copy, Debug)]
struct Motion {
    angle: f64,
    speed: f64,
    pitch: f64,
    pitch_rate: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Friction without a range at rest: one continuous law for all speeds.
    Free,
    /// The shafts turn forward (1) or backward (−1).
    Slide(f64),
    /// q̇ = 0, held by friction.
    Stuck,
}

/// The loads of one tick, with the pitch at its start.
struct Loads {
    torque_nm: f64,
    push_n: f64,
    push_height_m: f64,
    start: NearAngle,
}

impl PlanarPlant {
    /// A robot at `state`. The parameters are taken as validated.
    pub fn new(parameters: &RobotParameters, friction: [Option<Stribeck>; 2], state: &State) -> Self {
        let laws = Laws::new(parameters, &friction);
        let motion = Motion {
            angle: state.x_m / parameters.wheel_radius_m - state.pitch_rad,
            speed: parameters.motor_speed_rad_s(state),
            pitch: state.pitch_rad,
            pitch_rate: state.pitch_rate_rad_s,
        };
        let phase = if laws.stick_range_nm.is_none() {
            Phase::Free
        } else if motion.speed == 0.0 {
            Phase::Stuck
        } else {
            Phase::Slide(motion.speed.signum())
        };
        Self { laws, motion, phase }
    }

    /// The true state.
    pub fn state(&self) -> State {
        let Motion { angle, speed, pitch, pitch_rate } = self.motion;
        State {
            x_m: self.laws.radius_m * (angle + pitch),
            x_dot_m_s: self.laws.radius_m * (speed + pitch_rate),
            pitch_rad: pitch,
            pitch_rate_rad_s: pitch_rate,
        }
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
    pub fn advance(&mut self, forcing: &Forcing, dt_s: f64, substeps: u32) {
        let loads = Loads {
            torque_nm: forcing.torque_nm.iter().sum(),
            push_n: forcing.push_n,
            push_height_m: forcing.push_height_m,
            start: NearAngle::new(self.motion.pitch),
        };
        let step = dt_s / f64::from(substeps);
        for _ in 0..substeps {
            self.substep(&loads, step);
        }
    }

    fn substep(&mut self, loads: &Loads, step: f64) {
        let mut left = step;
        for _ in 0..MAX_CHANGES {
            if self.phase == Phase::Stuck && self.margin(loads, &self.motion) < 0.0 {
                self.leave(loads);
            }
            let next = self.runge_kutta(loads, left);
            if self.margin(loads, &next) >= 0.0 {
                self.motion = next;
                return;
            }
            let share = self.locate_change(loads, left, &next);
            self.motion = self.runge_kutta(loads, left * share);
            left *= 1.0 - share;
            if self.phase != Phase::Stuck {
                self.stop();
            }
        }
        self.stop();
        self.motion = self.runge_kutta(loads, left);
    }

    fn stop(&mut self) {
        self.motion.speed = 0.0;
        self.phase = Phase::Stuck;
    }

    /// From stuck to sliding, in the direction of the torque that friction could not hold.
    fn leave(&mut self, loads: &Loads) {
        let (needed, _) = self.laws.held(loads, &self.motion);
        let forward = self.laws.stick_range_nm.as_ref().is_some_and(|range| needed > *range.end());
        self.phase = Phase::Slide(if forward { 1.0 } else { -1.0 });
    }

    /// At least 0 as long as the present phase goes on: the speed in the direction of sliding, or the
    /// distance of the holding torque from the nearer end of its range.
    fn margin(&self, loads: &Loads, motion: &Motion) -> f64 {
        match (self.phase, &self.laws.stick_range_nm) {
            (Phase::Slide(direction), _) => direction * motion.speed,
            (Phase::Stuck, Some(range)) => {
                let (needed, _) = self.laws.held(loads, motion);
                (range.end() - needed).min(needed - range.start())
            }
            (Phase::Free, _) | (Phase::Stuck, None) => f64::INFINITY,
        }
    }

    /// Share of the step `dt` at which the phase has just ended: between 0, where it holds, and 1, where
    /// it does not (`end`), by secants with a bisection after each that was slow.
    fn locate_change(&self, loads: &Loads, dt: f64, end: &Motion) -> f64 {
        let mut holds = (0.0, self.margin(loads, &self.motion));
        let mut ended = (1.0, self.margin(loads, end));
        let mut bisect = false;
        while ended.0 - holds.0 > INSTANT_TOLERANCE {
            let width = ended.0 - holds.0;
            let share = if bisect {
                holds.0 + 0.5 * width
            } else {
                // A little beyond the secant, so that both ends close in.
                let secant = holds.0 + width * holds.1 / (holds.1 - ended.1);
                (secant + 0.4 * INSTANT_TOLERANCE).clamp(holds.0, ended.0)
            };
            let margin = self.margin(loads, &self.runge_kutta(loads, dt * share));
            if margin >= 0.0 {
                holds = (share, margin);
            } else {
                ended = (share, margin);
            }
            bisect = ended.0 - holds.0 > 0.5 * width;
        }
        ended.0
    }

    fn runge_kutta(&self, loads: &Loads, dt: f64) -> Motion {
        let laws = &self.laws;
        match self.phase {
            Phase::Free => runge_kutta(&self.motion, dt, &Free { laws, loads }),
            Phase::Slide(direction) => runge_kutta(&self.motion, dt, &Sliding { laws, loads, direction }),
            Phase::Stuck => runge_kutta(&self.motion, dt, &Held { laws, loads }),
        }
    }
}

/// The smooth motion of one phase. Everything below is inlined into one loop-free step for each phase,
/// which makes a step twice as fast.
trait Smooth {
    /// q̈ and θ̈, rad/s².
    fn accelerations(&self, at: &Motion) -> (f64, f64);

    #[inline(always)]
    fn rate(&self, at: &Motion) -> Motion {
        let (speed, pitch_rate) = self.accelerations(at);
        Motion { angle: at.speed, speed, pitch: at.pitch_rate, pitch_rate }
    }
}

struct Free<'a> {
    laws: &'a Laws,
    loads: &'a Loads,
}

struct Sliding<'a> {
    laws: &'a Laws,
    loads: &'a Loads,
    direction: f64,
}

struct Held<'a> {
    laws: &'a Laws,
    loads: &'a Loads,
}

impl Smooth for Free<'_> {
    #[inline(always)]
    fn accelerations(&self, at: &Motion) -> (f64, f64) {
        self.laws.sliding(self.loads, at, at.speed.signum())
    }
}

impl Smooth for Sliding<'_> {
    #[inline(always)]
    fn accelerations(&self, at: &Motion) -> (f64, f64) {
        self.laws.sliding(self.loads, at, self.direction)
    }
}

impl Smooth for Held<'_> {
    #[inline(always)]
    fn accelerations(&self, at: &Motion) -> (f64, f64) {
        // q̈ = 0 exactly, not only up to rounding, so that the angle keeps its last bit.
        (0.0, self.laws.held(self.loads, at).1)
    }
}

/// One classical step of order 4.
#[inline(always)]
fn runge_kutta(start: &Motion, dt: f64, law: &impl Smooth) -> Motion {
    let k1 = law.rate(start);
    let k2 = law.rate(&start.moved(&k1, 0.5 * dt));
    let k3 = law.rate(&start.moved(&k2, 0.5 * dt));
    let k4 = law.rate(&start.moved(&k3, dt));
    let mean = |pick: fn(&Motion) -> f64| pick(&k1) + 2.0 * (pick(&k2) + pick(&k3)) + pick(&k4);
    let six_rates = Motion {
        angle: mean(|k| k.angle),
        speed: mean(|k| k.speed),
        pitch: mean(|k| k.pitch),
        pitch_rate: mean(|k| k.pitch_rate),
    };
    start.moved(&six_rates, dt / 6.0)
}

impl Motion {
    #[inline(always)]
    fn moved(&self, rate: &Self, dt: f64) -> Self {
        Self {
            angle: self.angle + dt * rate.angle,
            speed: self.speed + dt * rate.speed,
            pitch: self.pitch + dt * rate.pitch,
            pitch_rate: self.pitch_rate + dt * rate.pitch_rate,
        }
    }
}

impl Laws {
    fn new(parameters: &RobotParameters, friction: &[Option<Stribeck>; 2]) -> Self {
        let curves = || friction.iter().flatten();
        let low: f64 = curves().map(|curve| *curve.stick_range_nm().start()).sum();
        let high: f64 = curves().map(|curve| *curve.stick_range_nm().end()).sum();
        Self {
            coefficients: parameters.coefficients(),
            radius_m: parameters.wheel_radius_m,
            per_radius: 1.0 / parameters.wheel_radius_m,
            sliding: SlidingFriction::new(curves().copied()),
            stick_range_nm: (high > low).then_some(low..=high),
        }
    }

    /// q̈ and θ̈ of shafts that slide in `direction`, rad/s².
    #[inline(always)]
    fn sliding(&self, loads: &Loads, motion: &Motion, direction: f64) -> (f64, f64) {
        let (coasting, per_nm) = self.accelerations(loads, motion);
        let shaft_nm = loads.torque_nm - self.sliding.torque_nm(motion.speed, direction);
        (coasting.0 + shaft_nm * per_nm.0, coasting.1 + shaft_nm * per_nm.1)
    }

    /// Friction summed over both motors, N m, that keeps q̈ = 0, and θ̈ under it, rad/s². The motors'
    /// torque does not enter θ̈: between locked wheels and body it is internal.
    #[inline(always)]
    fn held(&self, loads: &Loads, motion: &Motion) -> (f64, f64) {
        let (coasting, per_nm) = self.accelerations(loads, motion);
        let shaft_nm = -coasting.0 / per_nm.0;
        (loads.torque_nm - shaft_nm, coasting.1 + shaft_nm * per_nm.1)
    }

    /// q̈ and θ̈ without any torque between body and wheels, rad/s², and what 1 N m there adds to them:
    /// Eqs. 4 and 5 are linear in it, and without gravity and spin its effect alone is left.
    #[inline(always)]
    fn accelerations(&self, loads: &Loads, motion: &Motion) -> ((f64, f64), (f64, f64)) {
        let (sin, cos) = loads.start.sin_cos(motion.pitch);
        let relative = |found: Accelerations| {
            let pitch = found.pitch_accel_rad_s2;
            (found.x_ddot_m_s2 * self.per_radius - pitch, pitch)
        };
        let along = self.radius_m * loads.push_n;
        let about = loads.push_height_m * cos * loads.push_n;
        let coasting = self.coefficients.accelerations((sin, cos), motion.pitch_rate, along, about);
        let per_nm = self.coefficients.accelerations((0.0, cos), 0.0, 1.0, -1.0);
        (relative(coasting), relative(per_nm))
    }
}

#[cfg(test)]
mod tests;
