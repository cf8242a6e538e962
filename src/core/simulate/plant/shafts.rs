//! Both motor shafts: which friction holds, which slide, and the torques that follow.

use std::ops::RangeInclusive;

use super::super::planar::sliding::SlidingFriction;
use super::laws::Response;
use crate::friction::Stribeck;

/// State of a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Phase {
    /// Friction without a range at standstill: one continuous law for all speeds.
    Free,
    /// Turns forward (1) or backward (−1).
    Slide(f64),
    /// q̇ = 0, held by friction.
    Stuck,
}

pub(super) type Phases = [Phase; 2];

/// Friction of one motor.
#[derive(Clone, Debug)]
pub(super) struct Shaft {
    sliding: SlidingFriction,
    /// Torques that friction can take at standstill, N m; `None` if no torque is needed to turn a resting shaft.
    range_nm: Option<RangeInclusive<f64>>,
    /// Level of dry friction on top of the curve's, N m.
    added_nm: f64,
    /// The least that may be added, N m.
    least_nm: f64,
}

impl Shaft {
    pub(super) fn new(friction: Option<Stribeck>) -> Self {
        let range = friction.map(|curve| curve.stick_range_nm());
        let level = |curve: Stribeck| curve.parameters().coulomb_nm.min(curve.parameters().static_nm);
        Self {
            sliding: SlidingFriction::new(friction),
            range_nm: range.filter(|range| range.end() > range.start()),
            added_nm: 0.0,
            least_nm: -friction.map_or(0.0, level),
        }
    }

    /// Lets effects add dry friction, also where the curve has none.
    pub(super) fn allow_added(&mut self) {
        let offset = self.sliding.torque_nm(0.0, 0.0);
        self.range_nm.get_or_insert(offset..=offset);
    }

    /// Adds dry friction to the curve's from now on; no level gets below 0.
    pub(super) fn add(&mut self, amplitude_nm: f64) {
        self.added_nm = if amplitude_nm < self.least_nm { self.least_nm } else { amplitude_nm };
    }

    /// Phase of a shaft that turns at a speed or rests.
    pub(super) fn phase_at(&self, speed: f64) -> Phase {
        if self.range_nm.is_none() {
            Phase::Free
        } else if speed == 0.0 {
            Phase::Stuck
        } else {
            Phase::Slide(speed.signum())
        }
    }

    /// Friction that brakes a turning shaft, N m.
    #[inline(always)]
    fn friction_nm(&self, phase: Phase, speed: f64) -> f64 {
        let direction = if let Phase::Slide(direction) = phase { direction } else { speed.signum() };
        self.sliding.torque_nm(speed, direction) + direction * self.added_nm
    }

    /// Distance of the friction that would hold the shaft from the nearer end of its range, N m.
    fn reserve_nm(&self, holding_nm: f64) -> f64 {
        let Some(range) = &self.range_nm else { return f64::INFINITY };
        (range.end() - holding_nm).min(holding_nm - range.start()) + self.added_nm
    }
}

/// Torques on both shafts after friction, N m: the motors' less friction where a shaft turns, and what
/// keeps q̈ = 0 where it is held.
#[inline(always)]
pub(super) fn shaft_torques(
    shafts: &[Shaft; 2],
    phases: Phases,
    torque_nm: [f64; 2],
    speed: [f64; 2],
    response: &Response,
) -> [f64; 2] {
    let stuck = phases.map(|phase| phase == Phase::Stuck);
    if stuck == [true; 2] {
        return response.holding_both();
    }
    let turning = turning_torques(shafts, phases, torque_nm, speed);
    [0, 1].map(|i: usize| if stuck[i] { response.holding_one(i, turning[1 - i]) } else { turning[i] })
}

/// Accelerations if both shafts turn.
#[inline(always)]
pub(super) fn turning_torques(
    shafts: &[Shaft; 2],
    phases: Phases,
    torque_nm: [f64; 2],
    speed: [f64; 2],
) -> [f64; 2] {
    [0, 1].map(|i: usize| torque_nm[i] - shafts[i].friction_nm(phases[i], speed[i]))
}

/// At least 0 for each shaft whose phase goes on: the speed in the direction of sliding, rad/s, or the
/// reserve of the holding friction, N m.
#[inline(always)]
pub(super) fn margins(
    shafts: &[Shaft; 2],
    phases: Phases,
    torque_nm: [f64; 2],
    speed: [f64; 2],
    response: impl FnOnce() -> Response,
) -> [f64; 2] {
    let shaft_nm = if phases.contains(&Phase::Stuck) {
        shaft_torques(shafts, phases, torque_nm, speed, &response())
    } else {
        [0.0; 2]
    };
    [0, 1].map(|i| match phases[i] {
        Phase::Free => f64::INFINITY,
        Phase::Slide(direction) => direction * speed[i],
        Phase::Stuck => shafts[i].reserve_nm(torque_nm[i] - shaft_nm[i]),
    })
}

/// The phases that go on from here where resting shafts may break away. Friction of a resting shaft is a
/// force in a box and the response to shaft torques is positive definite, so that just one combination
/// fits: held shafts within their ranges, the others accelerating against their friction. The combination
/// with the best of the worst margins is taken, which is that one also where rounding blurs it.
pub(super) fn settled(
    shafts: &[Shaft; 2],
    phases: Phases,
    torque_nm: [f64; 2],
    speed: [f64; 2],
    response: &Response,
) -> Phases {
    let options = |i: usize| match phases[i] {
        Phase::Stuck => [Some(Phase::Stuck), Some(Phase::Slide(1.0)), Some(Phase::Slide(-1.0))],
        other => [Some(other), None, None],
    };
    let mut best = (f64::NEG_INFINITY, phases);
    for left in options(0).into_iter().flatten() {
        for right in options(1).into_iter().flatten() {
            let trial = [left, right];
            let shaft_nm = shaft_torques(shafts, trial, torque_nm, speed, response);
            let acceleration = response.motor_accelerations(shaft_nm);
            let margin = |i: usize| match (phases[i], trial[i]) {
                (Phase::Stuck, Phase::Stuck) => shafts[i].reserve_nm(torque_nm[i] - shaft_nm[i]),
                // As the torque that is left over, so that both kinds of margin compare.
                (Phase::Stuck, Phase::Slide(direction)) => direction * acceleration[i] / response.own(),
                _ => f64::INFINITY,
            };
            let worst = margin(0).min(margin(1));
            if worst > best.0 {
                best = (worst, trial);
            }
        }
    }
    best.1
}
