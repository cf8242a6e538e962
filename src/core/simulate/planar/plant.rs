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
//!
//! A step is a chain in which each stage waits for the friction at the speed that the stage before gave; what
//! else a stage needs (sine, cosine, one division) depends on earlier stages only and runs next to it. So
//! the chain is kept short: table, cubic, one product and one difference.

use std::ops::RangeInclusive;

use super::super::change::{MAX_CHANGES, first_below_zero};
use super::laws::{Laws, Loads, Motion, runge_kutta};
use super::near_angle::NearAngle;
use super::sliding::SlidingFriction;
use crate::friction::Stribeck;
use crate::model::{RobotParameters, State};

/// Inputs of the robot, constant during a step.
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
    pub(super) laws: Laws,
    pub(super) sliding: SlidingFriction,
    /// Sum of both motors' ranges at standstill, N m; `None` if no torque is needed to turn a resting shaft.
    pub(super) stick_range_nm: Option<RangeInclusive<f64>>,
    pub(super) motion: Motion,
    pub(super) phase: Phase,
    pub(super) near: NearAngle,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Phase {
    /// Friction without a range at standstill: one continuous law for all speeds.
    Free,
    /// The shafts turn forward (1) or backward (−1).
    Slide(f64),
    /// q̇ = 0, held by friction.
    Stuck,
}

impl PlanarPlant {
    /// A robot at `state`. The parameters are taken as validated.
    pub fn new(parameters: &RobotParameters, friction: [Option<Stribeck>; 2], state: &State) -> Self {
        let curves = || friction.iter().flatten();
        let low: f64 = curves().map(|curve| *curve.stick_range_nm().start()).sum();
        let high: f64 = curves().map(|curve| *curve.stick_range_nm().end()).sum();
        let stick_range_nm = (high > low).then_some(low..=high);
        let sliding = SlidingFriction::new(curves().copied());
        let laws = Laws::new(parameters, sliding.viscous_nm_s_rad, sliding.offset_nm);
        let motion = Motion {
            angle: state.x_m / parameters.wheel_radius_m - state.pitch_rad,
            speed: parameters.motor_speed_rad_s(state),
            pitch: state.pitch_rad,
            pitch_rate: state.pitch_rate_rad_s,
        };
        let phase = if stick_range_nm.is_none() {
            Phase::Free
        } else if motion.speed == 0.0 {
            Phase::Stuck
        } else {
            Phase::Slide(motion.speed.signum())
        };
        Self { laws, sliding, stick_range_nm, motion, phase, near: NearAngle::new(state.pitch_rad) }
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

    /// Returns whether friction holds the shafts.
    pub fn stuck(&self) -> bool {
        self.phase == Phase::Stuck
    }

    /// Moves on by `dt_s` in `substeps` equal steps of order 4.
    pub fn advance(&mut self, forcing: &Forcing, dt_s: f64, substeps: u32) {
        self.advance_on(pulp::Arch::new(), forcing, dt_s, substeps);
    }

    /// Newer encodings of the same operations need fewer instructions; the bytes are the same.
    fn advance_on(&mut self, arch: pulp::Arch, forcing: &Forcing, dt_s: f64, substeps: u32) {
        let loads = self.loads(forcing);
        arch.dispatch(Advance { plant: self, loads, step: dt_s / f64::from(substeps), substeps });
    }

    pub(super) fn loads(&self, forcing: &Forcing) -> Loads {
        Loads {
            torque_nm: forcing.torque_nm.iter().sum(),
            along_nm: self.laws.radius_m * forcing.push_n,
            about_nm: forcing.push_height_m * forcing.push_n,
        }
    }

    #[inline(always)]
    pub(super) fn advance_inline(&mut self, loads: &Loads, step: f64, substeps: u32) {
        self.begin(loads);
        for _ in 0..substeps {
            self.substep(loads, step);
        }
    }

    /// New loads may be more than friction holds.
    #[inline(always)]
    pub(super) fn begin(&mut self, loads: &Loads) {
        if self.phase == Phase::Stuck && self.margin(loads, &self.motion) < 0.0 {
            self.leave(loads);
        }
    }

    #[inline(always)]
    fn substep(&mut self, loads: &Loads, step: f64) {
        self.near.follow(self.motion.pitch);
        let next = self.runge_kutta(loads, step, NearAngle::rotated);
        if self.margin(loads, &next) >= 0.0 && self.near.reaches(next.pitch) {
            self.motion = next;
        } else {
            self.substep_with_changes(loads, step);
        }
    }

    #[cold]
    #[inline(never)]
    pub(super) fn substep_with_changes(&mut self, loads: &Loads, step: f64) {
        let mut left = step;
        for _ in 0..MAX_CHANGES {
            self.begin(loads);
            let next = self.runge_kutta(loads, left, NearAngle::sin_cos);
            if self.margin(loads, &next) >= 0.0 {
                self.motion = next;
                return;
            }
            let share = self.locate_change(loads, left, &next);
            self.motion = self.runge_kutta(loads, left * share, NearAngle::sin_cos);
            left *= 1.0 - share;
            if self.phase != Phase::Stuck {
                self.stop();
            }
        }
        self.stop();
        self.motion = self.runge_kutta(loads, left, NearAngle::sin_cos);
    }

    fn stop(&mut self) {
        self.motion.speed = 0.0;
        self.phase = Phase::Stuck;
    }

    /// From stuck to sliding, in the direction of the torque that friction could not hold.
    #[cold]
    #[inline(never)]
    fn leave(&mut self, loads: &Loads) {
        let (needed, _) = self.held(loads, &self.motion);
        let forward = self.stick_range_nm.as_ref().is_some_and(|range| needed > *range.end());
        self.phase = Phase::Slide(if forward { 1.0 } else { -1.0 });
    }

    /// At least 0 as long as the present phase goes on: the speed in the direction of sliding, or the
    /// distance of the holding torque from the nearer end of its range.
    #[inline(always)]
    fn margin(&self, loads: &Loads, motion: &Motion) -> f64 {
        match (self.phase, &self.stick_range_nm) {
            (Phase::Slide(direction), _) => direction * motion.speed,
            (Phase::Stuck, Some(range)) => {
                let (needed, _) = self.held(loads, motion);
                (range.end() - needed).min(needed - range.start())
            }
            (Phase::Free, _) | (Phase::Stuck, None) => f64::INFINITY,
        }
    }

    /// Fraction of the step `dt` at which the phase has just ended, for a step at the end of which it has (`end`).
    #[cold]
    #[inline(never)]
    fn locate_change(&self, loads: &Loads, dt: f64, end: &Motion) -> f64 {
        let margin_at =
            |share: f64| self.margin(loads, &self.runge_kutta(loads, dt * share, NearAngle::sin_cos));
        first_below_zero(self.margin(loads, &self.motion), self.margin(loads, end), margin_at)
    }

    /// Inlined into one loop-free step for each phase, which makes a step twice as fast.
    #[inline(always)]
    fn runge_kutta(&self, loads: &Loads, dt: f64, sin_cos: impl Fn(&NearAngle, f64) -> (f64, f64)) -> Motion {
        let Self { laws, near, sliding, .. } = self;
        match self.phase {
            Phase::Free => runge_kutta(
                &self.motion,
                dt,
                #[inline(always)]
                |at| laws.sliding(loads, sin_cos(near, at.pitch), at, at.speed.signum(), sliding),
            ),
            Phase::Slide(direction) => runge_kutta(
                &self.motion,
                dt,
                #[inline(always)]
                |at| laws.sliding(loads, sin_cos(near, at.pitch), at, direction, sliding),
            ),
            // q̈ = 0 exactly, not only up to rounding, so that the angle keeps its last bit.
            Phase::Stuck => runge_kutta(
                &self.motion,
                dt,
                #[inline(always)]
                |at| (0.0, laws.held(loads, sin_cos(near, at.pitch), at).1),
            ),
        }
    }

    #[inline(always)]
    fn held(&self, loads: &Loads, at: &Motion) -> (f64, f64) {
        self.laws.held(loads, self.near.sin_cos(at.pitch), at)
    }
}

/// The substeps of one call, compiled for each instruction set.
struct Advance<'a> {
    plant: &'a mut PlanarPlant,
    loads: Loads,
    step: f64,
    substeps: u32,
}

impl pulp::WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { plant, loads, step, substeps } = self;
        plant.advance_inline(&loads, step, substeps);
    }
}

#[cfg(test)]
mod tests;
