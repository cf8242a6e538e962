//! The whole robot: two wheels apart, pitch and yaw, motors whose friction truly sticks.
//!
//! # Dynamics
//! The wheels roll without slip, neither along nor across: the axle's middle moves at v along the heading,
//! the body pitches at θ̇ and turns at ψ̇. With the notation of [`crate::model`], b the track, J_ψ the body
//! about the vertical, γ the slope of the path, β = θ + γ, A = M + 2m + 2I/r² and D = J + M l²:
//! - A v̇ + M l cos β θ̈ = M l sin β (θ̇² + ψ̇²) + ΣT/r + Q_v
//! - M l cos β v̇ + D θ̈ = M l sin β (l cos β ψ̇² + v γ̇) − ΣT + Q_θ
//! - (J_ψ + M l² sin² β + 2 (m + I/r²) (b/2)² + I) ψ̈
//!   = −M l sin β (v + l cos β (2 θ̇ + γ̇)) ψ̇ + (b/2r) (T_r − T_l) + Q_ψ
//!
//! These are Kane's equations with v, θ̇ and ψ̇ as speeds: the centre of mass at l (sin β, 0, cos β) in a
//! frame that moves at v and turns at ψ̇ about the path's normal and −γ̇ about the axle. T is the torque
//! after friction; Q are the other forces, those of gravity and tether being derivatives of a potential.
//! On level ground Q_θ = M g l sin θ, and without yaw the first two lines are Eqs. 5 and 4.
//!
//! # Effects
//! - Gravity on the slope of the surroundings, a plane: ahead and across change places as the robot turns.
//! - a separate ground under each wheel: what each wheel climbs brakes that wheel, their difference turns
//!   the robot and rolls it by asin((z_r − z_l)/b), which takes cos(roll) of the weight's moment and shifts
//!   weight to the lower wheel; the path's curvature.
//! - A push on the body along the path, a tether, a payload, which moves the centre of mass.
//! - Those of [`crate::effects`] that the model lists.
//!
//! Neglected: slip of the tyres, their springiness and the turning torque of their contact patches; wheels
//! that leave the ground; the inertia of rolling; forces of the air; motion of the legs; the difference
//! between the body's inertias about its upright and its fore-and-aft axis. On uneven ground the axle's
//! middle is taken to move at the mean of both speeds up the mean of both slopes.
//!
//! # Method
//! The coordinates are both motor angles and the pitch, because friction acts along the motor angles: a
//! stuck shaft is q̇ = 0 exactly and q does not change by a single bit. The wheels' paths, the speed and
//! the yaw follow: s = r (q + θ), v = (ṡ_l + ṡ_r)/2, ψ = (s_r − s_l)/b. Friction is set-valued
//! (Filippov): at q̇ = 0 it takes whatever value in [f_p − f_s, f_p + f_s] keeps q̈ = 0. Between changes of
//! phase, of which each shaft has its own, the motion is smooth and a Runge-Kutta step of order 4 serves;
//! the instant of a change is located inside the step, and the phases that follow are the one combination
//! that is consistent with both ranges.

mod body;
mod effects;
mod laws;
mod motion;
mod shafts;
mod terrain;

use super::change::{MAX_CHANGES, first_below_zero};
use super::planar::Forcing;
use crate::model::Ground;
use crate::model::{RobotModel, State};
use effects::Effects;
use laws::{Laws, Loads};
use motion::{Motion, Smooth, runge_kutta};
use shafts::{Phase, Phases, Shaft, margins, settled, shaft_torques, turning_torques};

/// The robot in motion.
#[derive(Clone, Debug)]
pub struct Plant {
    laws: Laws,
    shafts: [Shaft; 2],
    motion: Motion,
    phases: Phases,
    effects: Option<Box<Effects>>,
}

/// State of the robot: the truth behind the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// State along the path; x is the way of the axle's middle.
    pub state: State,
    /// Heading, 0 at the start, to the left positive, rad.
    pub yaw_rad: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
    /// Roll, right wheel higher positive, rad.
    pub roll_rad: f64,
    /// Height of the ground under the left and the right wheel, m.
    pub ground_height_m: [f64; 2],
}

/// A moment of a recorded motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Followed {
    /// State along the path.
    pub state: State,
    /// Motor angles q, left and right, rad.
    pub motor_angle_rad: [f64; 2],
    /// Motor speeds, rad/s.
    pub motor_speed_rad_s: [f64; 2],
}

impl Plant {
    /// A robot with its model's surroundings and effects, at `start` with heading 0 and no yaw rate. The model is
    /// taken as validated, with effects that are errors of declared numbers put into these.
    pub fn new(robot: &RobotModel, start: &State) -> Self {
        Self::on_ground(robot, &[const { Ground::flat() }; 2], start)
    }

    /// Creates it with separate ground under the left and the right wheel, in addition to the surroundings'
    /// slope; one that is flat leaves the surroundings' ground.
    pub fn on_ground(robot: &RobotModel, grounds: &[Ground; 2], start: &State) -> Self {
        let grounds = Self::grounds_under(robot, grounds);
        let laws = Laws::new(&robot.parameters, &robot.chassis, &robot.surroundings, grounds);
        let mut shafts = robot.friction.map(Shaft::new);
        let effects = Effects::new(robot);
        if effects.is_some() {
            shafts.iter_mut().for_each(Shaft::allow_added);
        }
        let phases = [Phase::Free; 2];
        let mut plant = Self { laws, shafts, motion: Motion::default(), phases, effects };
        plant.place(start);
        plant
    }

    /// Puts the robot into a state, with heading 0 and no yaw rate.
    pub fn place(&mut self, state: &State) {
        self.motion = self.laws.motion(state);
        self.phases = [0, 1].map(|i: usize| self.shafts[i].phase_at(self.motion.speed[i]));
    }

    /// The ground under each wheel, of an experiment and of the surroundings.
    pub(super) fn grounds_under<'a>(robot: &'a RobotModel, grounds: &'a [Ground; 2]) -> [&'a Ground; 2] {
        let own = &robot.surroundings.ground;
        [0, 1].map(|i: usize| if grounds[i].is_flat() { &own[i] } else { &grounds[i] })
    }

    /// Lets the effects see a recorded moment, so that those with a memory have it, and leaves the robot there.
    pub fn follow(&mut self, recorded: &Followed, torque_nm: [f64; 2], dt_s: f64) {
        let Some(mut effects) = self.effects.take() else { return };
        self.let_go(recorded);
        effects.act(self, torque_nm, dt_s);
        self.effects = Some(effects);
    }

    /// Puts the robot into a recorded motion, its motors' angles apart as they were.
    pub fn let_go(&mut self, recorded: &Followed) {
        self.place(&recorded.state);
        self.motion.angle = recorded.motor_angle_rad;
        self.motion.speed = recorded.motor_speed_rad_s;
        self.phases = [0, 1].map(|i: usize| self.shafts[i].phase_at(self.motion.speed[i]));
    }

    /// Moves on by `dt_s` in `substeps` equal steps of order 4. A torque or state that is not finite makes
    /// the motion not finite and nothing else.
    pub fn advance(&mut self, forcing: &Forcing, dt_s: f64, substeps: u32) {
        let loads = self.laws.loads(forcing, &self.motion);
        let step = dt_s / f64::from(substeps);
        if self.effects.is_some() {
            return self.advance_with_effects(&loads, step, substeps);
        }
        // Held shafts have been checked at the end of each substep, but under the loads of that call.
        self.release(&loads);
        pulp::Arch::new().dispatch(Advance { plant: self, loads, step, substeps });
    }

    /// Step with effects, which are held constant over each substep at their value in its middle.
    #[cold]
    #[inline(never)]
    fn advance_with_effects(&mut self, loads: &Loads, step: f64, substeps: u32) {
        let Some(mut effects) = self.effects.take() else { return };
        for _ in 0..substeps {
            let (motors, whole) = effects.act(self, loads.torque_nm, step);
            for (shaft, action) in self.shafts.iter_mut().zip(&motors) {
                shaft.add(action.friction_nm);
            }
            let loads = loads.with(motors.map(|action| action.motor_nm), whole.axle_n, whole.body_nm);
            self.release(&loads);
            if self.laws.is_even() {
                self.substeps::<false>(&loads, step, 1);
            } else {
                self.substeps::<true>(&loads, step, 1);
            }
        }
        self.effects = Some(effects);
    }

    /// The true state.
    pub fn state(&self) -> State {
        self.pose().state
    }

    /// The true state with heading, roll and the ground below.
    pub fn pose(&self) -> Pose {
        self.laws.pose(&self.motion)
    }

    /// Motor angles q, left and right, rad: 0 with the robot upright at x = 0.
    pub fn motor_angle_rad(&self) -> [f64; 2] {
        self.motion.angle
    }

    /// Motor speeds q̇, rad/s; exactly 0 while stuck.
    pub fn motor_speed_rad_s(&self) -> [f64; 2] {
        self.motion.speed
    }

    /// Returns whether friction holds the shafts.
    pub fn stuck(&self) -> [bool; 2] {
        self.phases.map(|phase| phase == Phase::Stuck)
    }

    /// Kinetic and potential energy, J; 0 when upright at standstill.
    pub fn energy_j(&self) -> f64 {
        self.laws.energy_j(&self.motion)
    }

    /// Returns whether every coordinate and speed is a finite number.
    pub fn is_finite(&self) -> bool {
        self.motion.is_finite()
    }

    #[inline(always)]
    fn substeps<const UNEVEN: bool>(&mut self, loads: &Loads, step: f64, substeps: u32) {
        for _ in 0..substeps {
            let next = if self.phases.contains(&Phase::Stuck) {
                runge_kutta(&self.motion, step, &InPhases::<UNEVEN> { plant: self, loads })
            } else {
                runge_kutta(&self.motion, step, &Turning::<UNEVEN> { plant: self, loads })
            };
            let end = self.worst_margin::<UNEVEN>(loads, &next);
            if ended(end) {
                self.change(loads, step, end);
            } else {
                self.motion = next;
            }
        }
    }

    /// A step in which phases end, the first with a margin of `end`.
    #[cold]
    #[inline(never)]
    fn change(&mut self, loads: &Loads, step: f64, mut end: f64) {
        let mut left = step;
        for _ in 0..MAX_CHANGES {
            let start = self.worst_margin::<true>(loads, &self.motion).max(0.0);
            let margin_at = |share| self.worst_margin::<true>(loads, &self.step(loads, left * share));
            let share = first_below_zero(start, end, margin_at);
            self.motion = self.step(loads, left * share);
            left *= 1.0 - share;
            self.stop(loads);
            self.release(loads);
            let next = self.step(loads, left);
            end = self.worst_margin::<true>(loads, &next);
            if !ended(end) {
                self.motion = next;
                return;
            }
        }
        self.rest();
        self.motion = self.step(loads, left);
        self.stop(loads);
    }

    #[inline(always)]
    fn margins<const UNEVEN: bool>(&self, loads: &Loads, motion: &Motion) -> [f64; 2] {
        let response = || self.laws.response::<UNEVEN>(loads, motion);
        margins(&self.shafts, self.phases, loads.torque_nm, motion.speed, response)
    }

    #[inline(always)]
    fn worst_margin<const UNEVEN: bool>(&self, loads: &Loads, motion: &Motion) -> f64 {
        let [left, right] = self.margins::<UNEVEN>(loads, motion);
        // Unlike min(), keeps a margin that is not a number.
        if left < right || left.is_nan() { left } else { right }
    }

    /// Ends the sliding of shafts that have come to rest or beyond.
    fn stop(&mut self, loads: &Loads) {
        let margins = self.margins::<true>(loads, &self.motion);
        for (i, margin) in margins.into_iter().enumerate() {
            if margin < 0.0 && self.phases[i] != Phase::Stuck {
                self.motion.speed[i] = 0.0;
                self.phases[i] = Phase::Stuck;
            }
        }
    }

    /// Lets shafts go that friction cannot hold.
    fn release(&mut self, loads: &Loads) {
        if !self.phases.contains(&Phase::Stuck) {
            return;
        }
        let margin = self.worst_margin::<true>(loads, &self.motion);
        if margin.is_nan() {
            // Nothing holds what is not a number; it shows in the speed.
            self.phases = [Phase::Free; 2];
        } else if margin < 0.0 {
            let response = self.laws.response::<true>(loads, &self.motion);
            self.phases = settled(&self.shafts, self.phases, loads.torque_nm, self.motion.speed, &response);
        }
    }

    /// Takes shafts at standstill as stuck.
    fn rest(&mut self) {
        for (phase, speed) in self.phases.iter_mut().zip(self.motion.speed) {
            if *phase != Phase::Free && speed == 0.0 {
                *phase = Phase::Stuck;
            }
        }
    }

    /// The next motion in the present phases, whichever they are.
    fn step(&self, loads: &Loads, dt: f64) -> Motion {
        runge_kutta(&self.motion, dt, &InPhases::<true> { plant: self, loads })
    }
}

/// Motion in the present phases, whichever they are; on level ground the ground need not be asked (not
/// `UNEVEN`).
struct InPhases<'a, const UNEVEN: bool> {
    plant: &'a Plant,
    loads: &'a Loads,
}

impl<const UNEVEN: bool> Smooth for InPhases<'_, UNEVEN> {
    #[inline(always)]
    fn rate(&self, at: &Motion) -> Motion {
        let Self { plant, loads } = *self;
        let response = plant.laws.response::<UNEVEN>(loads, at);
        let shaft_nm = shaft_torques(&plant.shafts, plant.phases, loads.torque_nm, at.speed, &response);
        let mut rate = at.rate(&response, shaft_nm);
        for (acceleration, phase) in rate.speed.iter_mut().zip(plant.phases) {
            // Exactly, not only up to rounding, so that the angle keeps its last bit.
            if phase == Phase::Stuck {
                *acceleration = 0.0;
            }
        }
        rate
    }
}

/// Accelerations if no shaft sticks.
struct Turning<'a, const UNEVEN: bool> {
    plant: &'a Plant,
    loads: &'a Loads,
}

impl<const UNEVEN: bool> Smooth for Turning<'_, UNEVEN> {
    #[inline(always)]
    fn rate(&self, at: &Motion) -> Motion {
        let Self { plant, loads } = *self;
        let response = plant.laws.response::<UNEVEN>(loads, at);
        at.rate(&response, turning_torques(&plant.shafts, plant.phases, loads.torque_nm, at.speed))
    }
}

/// Returns whether a margin says that a phase has ended. One that is not a number does not: such a motion is past all
/// phases.
fn ended(margin: f64) -> bool {
    margin < 0.0
}

/// The substeps of one call, compiled for each instruction set: newer encodings of the same operations need
/// fewer instructions; the bytes are the same.
struct Advance<'a> {
    plant: &'a mut Plant,
    loads: Loads,
    step: f64,
    substeps: u32,
}

impl pulp::WithSimd for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { plant, loads, step, substeps } = self;
        if plant.laws.is_even() {
            plant.substeps::<false>(&loads, step, substeps);
        } else {
            plant.substeps::<true>(&loads, step, substeps);
        }
    }
}

#[cfg(test)]
mod tests;
