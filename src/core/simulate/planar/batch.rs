//! Many planar robots side by side, as Monte Carlo needs them.
//!
//! Each lane of a vector register is one robot: its own parameters, friction, loads and phase. The laws are the
//! ones of the plant alone, operation for operation, so a robot takes the same path to the last bit, whatever
//! the instruction set and whoever its neighbours are. A lane whose phase changes within a substep is handed
//! to the plant alone for that substep; its neighbours do not wait for the instant to be located.

use pulp::Simd;

use super::lanes::{Lanes, MAX_LANES, Mask};
use super::laws::{Laws, Level, Loads, Motion, runge_kutta};
use super::near_angle::{NearAngle, REACH_RAD};
use super::number::Number;
use super::plant::{Forcing, Phase, PlanarPlant};
use super::sliding::{SlidingFriction, WITHIN_MASK, level};

/// Moves every plant on by `dt_s` under its own forcing, in `substeps` equal steps of order 4: the same as
/// [`PlanarPlant::advance`] of each, several times as fast.
///
/// # Panics
/// If there are not as many forcings as plants.
pub fn advance_batch(plants: &mut [PlanarPlant], forcings: &[Forcing], dt_s: f64, substeps: u32) {
    advance_batch_on(pulp::Arch::new(), plants, forcings, dt_s, substeps);
}

fn advance_batch_on(
    arch: pulp::Arch,
    plants: &mut [PlanarPlant],
    forcings: &[Forcing],
    dt_s: f64,
    substeps: u32,
) {
    assert_eq!(plants.len(), forcings.len(), "each plant has its forcing");
    arch.dispatch(AdvanceBatch { plants, forcings, step: dt_s / f64::from(substeps), substeps });
}

struct AdvanceBatch<'a> {
    plants: &'a mut [PlanarPlant],
    forcings: &'a [Forcing],
    step: f64,
    substeps: u32,
}

impl pulp::WithSimd for AdvanceBatch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { plants, forcings, step, substeps } = self;
        let lanes = if S::F64_LANES > 1 { S::F64_LANES } else { usize::MAX };
        let mut groups = plants.chunks_exact_mut(lanes);
        let mut loads = forcings.chunks_exact(lanes);
        for (plants, forcings) in groups.by_ref().zip(loads.by_ref()) {
            Group::new(simd, plants, forcings, step).advance(substeps);
        }
        for (plant, forcing) in groups.into_remainder().iter_mut().zip(loads.remainder()) {
            let loads = plant.loads(forcing);
            plant.advance_inline(&loads, step, substeps);
        }
    }
}

/// As many plants as a vector has lanes. A plant's motion is here, its phase and known angle there as well.
struct Group<'a, S: Simd> {
    simd: S,
    plants: &'a mut [PlanarPlant],
    loads_alone: [Loads; MAX_LANES],
    loads: Loads<Lanes<S>>,
    laws: Laws<Lanes<S>>,
    stick_low_nm: Lanes<S>,
    stick_high_nm: Lanes<S>,
    near: NearAngle<Lanes<S>>,
    motion: Motion<Lanes<S>>,
    phases: Phases<S>,
    step: Lanes<S>,
}

/// The phases of a group: 1 in exactly one of the three for each lane, with its sign where it slides.
#[derive(Clone, Copy)]
struct Phases<S: Simd> {
    slide: Lanes<S>,
    stuck: Mask<S>,
    free: Mask<S>,
    any_stuck: bool,
    any_free: bool,
}

impl<'a, S: Simd> Group<'a, S> {
    #[inline(always)]
    fn new(simd: S, plants: &'a mut [PlanarPlant], forcings: &[Forcing], step: f64) -> Self {
        let mut loads_alone = [Loads::default(); MAX_LANES];
        for ((loads, plant), forcing) in loads_alone.iter_mut().zip(&mut *plants).zip(forcings) {
            *loads = plant.loads(forcing);
            plant.begin(loads);
        }
        let (of_loads, all) = (&loads_alone[..S::F64_LANES], &*plants);
        let law = |law: fn(&Laws) -> f64| Lanes::of(simd, all, |plant| law(&plant.laws));
        Self {
            simd,
            loads: Loads {
                torque_nm: Lanes::of(simd, of_loads, |loads| loads.torque_nm),
                along_nm: Lanes::of(simd, of_loads, |loads| loads.along_nm),
                about_nm: Lanes::of(simd, of_loads, |loads| loads.about_nm),
            },
            laws: Laws {
                radius_m: law(|laws| laws.radius_m),
                c1: law(|laws| laws.c1),
                c2: law(|laws| laws.c2),
                c4: law(|laws| laws.c4),
                c5: law(|laws| laws.c5),
                c3_per_radius: law(|laws| laws.c3_per_radius),
                determinant: law(|laws| laws.determinant),
                c2c5: law(|laws| laws.c2c5),
                c1r: law(|laws| laws.c1r),
                locked: law(|laws| laws.locked),
                viscous_nm_s_rad: law(|laws| laws.viscous_nm_s_rad),
                offset_nm: law(|laws| laws.offset_nm),
            },
            stick_low_nm: Lanes::of(simd, all, |plant| {
                plant.stick_range_nm.as_ref().map_or(0.0, |r| *r.start())
            }),
            stick_high_nm: Lanes::of(simd, all, |plant| {
                plant.stick_range_nm.as_ref().map_or(0.0, |r| *r.end())
            }),
            near: near(simd, all),
            motion: Motion {
                angle: Lanes::of(simd, all, |plant| plant.motion.angle),
                speed: Lanes::of(simd, all, |plant| plant.motion.speed),
                pitch: Lanes::of(simd, all, |plant| plant.motion.pitch),
                pitch_rate: Lanes::of(simd, all, |plant| plant.motion.pitch_rate),
            },
            phases: Phases::of(simd, all),
            step: Lanes::of(simd, all, |_| step),
            loads_alone,
            plants,
        }
    }

    #[inline(always)]
    fn advance(mut self, substeps: u32) {
        for _ in 0..substeps {
            self.substep();
        }
        let motions = arrays(&self.motion);
        for (lane, plant) in self.plants.iter_mut().enumerate() {
            plant.motion = lane_of(&motions, lane);
        }
    }

    #[inline(always)]
    fn substep(&mut self) {
        let reach = self.step.constant(REACH_RAD);
        let half = self.step.constant(0.5 * REACH_RAD);
        if !half.at_least((self.motion.pitch - self.near.angle).abs()).all() {
            let pitches = self.motion.pitch.to_array();
            for (plant, pitch) in self.plants.iter_mut().zip(pitches) {
                plant.near.follow(pitch);
            }
            self.near = near(self.simd, self.plants);
        }
        let next = self.runge_kutta();
        let in_reach = reach.at_least((next.pitch - self.near.angle).abs());
        let done = self.phase_goes_on(&next).and(in_reach);
        if done.all() {
            self.motion = next;
        } else {
            let mut ends = arrays(&next);
            let step = self.step.to_array()[0];
            finish_alone(
                self.plants,
                &self.loads_alone,
                step,
                &arrays(&self.motion),
                &mut ends,
                &done.to_array(),
            );
            self.motion = Motion {
                angle: Lanes::from_array(self.simd, &ends.angle),
                speed: Lanes::from_array(self.simd, &ends.speed),
                pitch: Lanes::from_array(self.simd, &ends.pitch),
                pitch_rate: Lanes::from_array(self.simd, &ends.pitch_rate),
            };
            self.phases = Phases::of(self.simd, self.plants);
        }
    }

    /// As [`PlanarPlant`] has it for each phase.
    #[inline(always)]
    fn runge_kutta(&self) -> Motion<Lanes<S>> {
        let Self { laws, loads, near, phases, .. } = self;
        let tables = Tables {
            simd: self.simd,
            lanes: std::array::from_fn(|lane| &self.plants[lane.min(S::F64_LANES - 1)].sliding),
            stuck: phases.any_stuck.then_some(phases.stuck),
        };
        runge_kutta(
            &self.motion,
            self.step,
            #[inline(always)]
            |at| {
                let sin_cos = near.rotated(at.pitch);
                let direction = if phases.any_free {
                    phases.free.select(at.speed.signum(), phases.slide)
                } else {
                    phases.slide
                };
                let (speed, pitch_rate) = laws.sliding(loads, sin_cos, at, direction, &tables);
                if !phases.any_stuck {
                    return (speed, pitch_rate);
                }
                let held = laws.held(loads, sin_cos, at).1;
                (phases.stuck.select(speed.constant(0.0), speed), phases.stuck.select(held, pitch_rate))
            },
        )
    }

    /// Returns whether the margin of [`PlanarPlant`] is at least 0.
    #[inline(always)]
    fn phase_goes_on(&self, next: &Motion<Lanes<S>>) -> Mask<S> {
        let Self { laws, loads, near, phases, .. } = self;
        let zero = self.step.constant(0.0);
        let mut goes_on = (phases.slide * next.speed).at_least(zero);
        if phases.any_stuck {
            let (needed, _) = laws.held(loads, near.rotated(next.pitch), next);
            let held = self.stick_high_nm.at_least(needed).and(needed.at_least(self.stick_low_nm));
            goes_on = phases.stuck.select_mask(held, goes_on);
        }
        if phases.any_free { goes_on.or(phases.free) } else { goes_on }
    }
}

#[inline(always)]
fn near<S: Simd>(simd: S, plants: &[PlanarPlant]) -> NearAngle<Lanes<S>> {
    NearAngle {
        angle: Lanes::of(simd, plants, |plant| plant.near.angle),
        sin: Lanes::of(simd, plants, |plant| plant.near.sin),
        cos: Lanes::of(simd, plants, |plant| plant.near.cos),
    }
}

#[inline(always)]
fn arrays<S: Simd>(motion: &Motion<Lanes<S>>) -> Motion<[f64; MAX_LANES]> {
    Motion {
        angle: motion.angle.to_array(),
        speed: motion.speed.to_array(),
        pitch: motion.pitch.to_array(),
        pitch_rate: motion.pitch_rate.to_array(),
    }
}

fn lane_of(motions: &Motion<[f64; MAX_LANES]>, lane: usize) -> Motion {
    Motion {
        angle: motions.angle[lane],
        speed: motions.speed[lane],
        pitch: motions.pitch[lane],
        pitch_rate: motions.pitch_rate[lane],
    }
}

/// The substep from `starts` of the plants that are not `done`: into `ends`.
#[cold]
#[inline(never)]
fn finish_alone(
    plants: &mut [PlanarPlant],
    loads: &[Loads],
    step: f64,
    starts: &Motion<[f64; MAX_LANES]>,
    ends: &mut Motion<[f64; MAX_LANES]>,
    done: &[bool; MAX_LANES],
) {
    for (lane, plant) in plants.iter_mut().enumerate().filter(|(lane, _)| !done[*lane]) {
        plant.motion = lane_of(starts, lane);
        plant.substep_with_changes(&loads[lane], step);
        ends.angle[lane] = plant.motion.angle;
        ends.speed[lane] = plant.motion.speed;
        ends.pitch[lane] = plant.motion.pitch;
        ends.pitch_rate[lane] = plant.motion.pitch_rate;
    }
}

impl<S: Simd> Phases<S> {
    #[inline(always)]
    fn of(simd: S, plants: &[PlanarPlant]) -> Self {
        let number = |of: fn(Phase) -> f64| Lanes::of(simd, plants, |plant| of(plant.phase));
        let slide = number(|phase| if let Phase::Slide(direction) = phase { direction } else { 0.0 });
        let one = slide.constant(1.0);
        let stuck = number(|phase| f64::from(phase == Phase::Stuck)).equals(one);
        let free = number(|phase| f64::from(phase == Phase::Free)).equals(one);
        Self { slide, stuck, free, any_stuck: stuck.any(), any_free: free.any() }
    }
}

/// The tables of a group's plants.
struct Tables<'a, S: Simd> {
    simd: S,
    lanes: [&'a SlidingFriction; MAX_LANES],
    /// Lanes that need no friction.
    stuck: Option<Mask<S>>,
}

impl<S: Simd> Level<Lanes<S>> for Tables<'_, S> {
    #[inline(always)]
    fn amplitude_nm(&self, speed: Lanes<S>) -> Lanes<S> {
        let mut magnitude = speed.abs();
        if let Some(stuck) = self.stuck {
            // Rest is outside of the tables, which costs time.
            magnitude = stuck.select(magnitude.constant(1.0), magnitude);
        }
        let above = magnitude - magnitude.masked(!WITHIN_MASK);
        let speeds = magnitude.to_array();
        let mut factors = [[0.0; MAX_LANES]; 4];
        for lane in 0..S::F64_LANES {
            let cell = self.lanes[lane].cell_or_constant(speeds[lane]);
            for (factor, value) in factors.iter_mut().zip(cell) {
                factor[lane] = value;
            }
        }
        level(&factors.map(|factor| Lanes::from_array(self.simd, &factor)), above)
    }
}

#[cfg(test)]
mod tests;
