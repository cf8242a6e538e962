//! One motor shaft on a bench: I q̈ = T − G sin q − τ_f(q̇), with friction that truly sticks.
//!
//! The method is that of [`super::plant`], for one shaft.

use std::ops::RangeInclusive;

use super::change::{MAX_CHANGES, first_below_zero};
use super::planar::sliding::SlidingFriction;
use crate::effects::{Action, EffectLaw, Law, MotionSample};
use crate::friction::Stribeck;

/// A shaft in motion.
#[derive(Clone, Debug)]
pub struct BenchPlant {
    inertia_kg_m2: f64,
    gravity_torque_nm: f64,
    sliding: SlidingFriction,
    /// Torques that friction can take at standstill, N m; `None` if no torque is needed to turn a resting shaft.
    range_nm: Option<RangeInclusive<f64>>,
    shaft: Shaft,
    phase: Phase,
    effects: Option<Box<Effects>>,
    /// Level of dry friction that effects add to the curve's, and the least that they may, N m.
    added_nm: f64,
    least_nm: f64,
}

/// Laws with what they have to remember of the motion.
#[derive(Clone, Debug)]
struct Effects {
    laws: Vec<EffectLaw>,
    time_s: f64,
    /// Speed before the last substep, rad/s; none before the first.
    speed_before: Option<f64>,
}

/// Angle and speed; also their rates of change.
#[derive(Clone, Copy, Debug)]
struct Shaft {
    angle: f64,
    speed: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Free,
    Slide(f64),
    Stuck,
}

impl BenchPlant {
    /// A shaft with an inertia (above 0, kg m²) and a gravity load of `gravity_torque_nm` × sin(angle), at
    /// an angle, rad, and a speed, rad/s.
    pub fn new(
        inertia_kg_m2: f64,
        gravity_torque_nm: f64,
        friction: Option<Stribeck>,
        angle_rad: f64,
        speed_rad_s: f64,
    ) -> Self {
        let range = friction.map(|curve| curve.stick_range_nm());
        let range_nm = range.filter(|range| range.end() > range.start());
        let phase = if range_nm.is_none() {
            Phase::Free
        } else if speed_rad_s == 0.0 {
            Phase::Stuck
        } else {
            Phase::Slide(speed_rad_s.signum())
        };
        Self {
            inertia_kg_m2,
            gravity_torque_nm,
            sliding: SlidingFriction::new(friction),
            range_nm,
            shaft: Shaft { angle: angle_rad, speed: speed_rad_s },
            phase,
            effects: None,
            added_nm: 0.0,
            least_nm: -friction.map_or(0.0, |f| f.parameters().coulomb_nm.min(f.parameters().static_nm)),
        }
    }

    /// Creates it with effects.
    pub fn with_effects(self, laws: Vec<EffectLaw>) -> Self {
        if laws.is_empty() {
            return self;
        }
        let offset = self.sliding.torque_nm(0.0, 0.0);
        let range_nm = self.range_nm.clone().unwrap_or(offset..=offset);
        let phase = match self.phase {
            Phase::Free if self.shaft.speed == 0.0 => Phase::Stuck,
            Phase::Free => Phase::Slide(self.shaft.speed.signum()),
            phase => phase,
        };
        let effects = Some(Box::new(Effects { laws, time_s: 0.0, speed_before: None }));
        Self { range_nm: Some(range_nm), phase, effects, ..self }
    }

    /// Same at a given time of its effects, s.
    pub fn at_time(mut self, time_s: f64) -> Self {
        if let Some(effects) = &mut self.effects {
            effects.time_s = time_s;
        }
        self
    }

    /// Angle, rad.
    pub fn angle_rad(&self) -> f64 {
        self.shaft.angle
    }

    /// Speed, rad/s; exactly 0 while stuck.
    pub fn speed_rad_s(&self) -> f64 {
        self.shaft.speed
    }

    /// Returns whether friction holds the shaft.
    pub fn stuck(&self) -> bool {
        self.phase == Phase::Stuck
    }

    /// Returns whether angle and speed are finite numbers.
    pub fn is_finite(&self) -> bool {
        self.shaft.angle.is_finite() && self.shaft.speed.is_finite()
    }

    /// Moves on by `dt_s` under the motor's torque in `substeps` equal steps of order 4. A torque that is
    /// not finite makes the motion not finite and nothing else.
    ///
    /// ```
    /// use flqr_core::friction::{Stribeck, StribeckParameters};
    /// use flqr_core::simulate::BenchPlant;
    ///
    /// let friction = Stribeck::new(StribeckParameters { coulomb_nm: 0.2, static_nm: 0.3, ..StribeckParameters::NONE })?;
    /// let mut shaft = BenchPlant::new(0.01, 0.0, Some(friction), 0.0, 0.0);
    /// shaft.advance(0.25, 1.0, 1000);
    /// assert!(shaft.stuck()); // below the static friction
    /// shaft.advance(0.35, 1.0, 1000);
    /// assert!(shaft.speed_rad_s() > 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn advance(&mut self, torque_nm: f64, dt_s: f64, substeps: u32) {
        let step = dt_s / f64::from(substeps);
        for _ in 0..substeps {
            let effects = self.act(torque_nm, step);
            self.substep(torque_nm + effects, step);
        }
    }

    /// Torque of the effects over the next substep, N m, their dry friction apart.
    fn act(&mut self, torque_nm: f64, step: f64) -> f64 {
        let Some(effects) = &mut self.effects else { return 0.0 };
        let Action { motor_nm, friction_nm, .. } =
            effects.act(&self.shaft, self.phase == Phase::Stuck, torque_nm, step);
        self.added_nm = if friction_nm < self.least_nm { self.least_nm } else { friction_nm };
        motor_nm
    }

    fn substep(&mut self, torque_nm: f64, step: f64) {
        let mut left = step;
        for _ in 0..MAX_CHANGES {
            self.release(torque_nm);
            let next = self.step(torque_nm, left);
            let Phase::Slide(direction) = self.phase else {
                self.shaft = next;
                return;
            };
            let end = direction * next.speed;
            if end >= 0.0 || end.is_nan() {
                self.shaft = next;
                return;
            }
            let start = (direction * self.shaft.speed).max(0.0);
            let share =
                first_below_zero(start, end, |share| direction * self.step(torque_nm, left * share).speed);
            self.shaft = Shaft { speed: 0.0, ..self.step(torque_nm, left * share) };
            self.phase = Phase::Stuck;
            left *= 1.0 - share;
        }
    }

    /// Lets the shaft go where friction cannot hold it. A stuck shaft does not move, so that this changes
    /// with the torque only.
    fn release(&mut self, torque_nm: f64) {
        let (Phase::Stuck, Some(range)) = (self.phase, &self.range_nm) else { return };
        let holding = torque_nm - self.load_nm(self.shaft.angle);
        let range = (range.start() - self.added_nm)..=(range.end() + self.added_nm);
        if holding.is_nan() {
            // Nothing holds what is not a number; it shows in the speed.
            self.phase = Phase::Slide(1.0);
        } else if !range.contains(&holding) {
            self.phase = Phase::Slide(if holding > *range.end() { 1.0 } else { -1.0 });
        }
    }

    fn load_nm(&self, angle: f64) -> f64 {
        if self.gravity_torque_nm == 0.0 { 0.0 } else { self.gravity_torque_nm * libm::sin(angle) }
    }

    fn step(&self, torque_nm: f64, dt: f64) -> Shaft {
        let start = self.shaft;
        if self.phase == Phase::Stuck {
            return start;
        }
        let moved = |rate: Shaft, dt: f64| Shaft {
            angle: start.angle + dt * rate.angle,
            speed: start.speed + dt * rate.speed,
        };
        let rate = |at: Shaft| {
            let direction =
                if let Phase::Slide(direction) = self.phase { direction } else { at.speed.signum() };
            let friction = self.sliding.torque_nm(at.speed, direction) + direction * self.added_nm;
            Shaft {
                angle: at.speed,
                speed: (torque_nm - self.load_nm(at.angle) - friction) / self.inertia_kg_m2,
            }
        };
        let k1 = rate(start);
        let k2 = rate(moved(k1, 0.5 * dt));
        let k3 = rate(moved(k2, 0.5 * dt));
        let k4 = rate(moved(k3, dt));
        let six_rates = Shaft {
            angle: k1.angle + 2.0 * (k2.angle + k3.angle) + k4.angle,
            speed: k1.speed + 2.0 * (k2.speed + k3.speed) + k4.speed,
        };
        moved(six_rates, dt / 6.0)
    }
}

impl Effects {
    /// Action over the next substep: as of its middle, to which the motion is carried on with the acceleration
    /// of the last one.
    fn act(&mut self, shaft: &Shaft, held: bool, torque_nm: f64, step: f64) -> Action {
        let before = self.speed_before.replace(shaft.speed).unwrap_or(shaft.speed);
        let acceleration = if held { 0.0 } else { (shaft.speed - before) / step };
        let half = 0.5 * step;
        let moment = MotionSample {
            time_s: self.time_s + half,
            dt_s: step,
            motor_angle_rad: shaft.angle + half * shaft.speed,
            motor_speed_rad_s: shaft.speed + half * acceleration,
            motor_accel_rad_s2: acceleration,
            torque_nm,
            torque_sum_nm: torque_nm,
            ..MotionSample::default()
        };
        self.time_s += step;
        self.laws.iter_mut().fold(Action::default(), |sum, law| sum.plus(1.0, &law.act(&moment)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::StribeckParameters;

    const INERTIA: f64 = 0.0025;

    fn left() -> Stribeck {
        Stribeck::new(StribeckParameters {
            coulomb_nm: 0.0338,
            static_nm: 0.0761,
            viscous_nm_s_rad: 4.9e-4,
            stribeck_speed_rad_s: 1.612,
            stribeck_exponent: 0.2310,
            offset_nm: -0.0016,
        })
        .unwrap()
    }

    #[test]
    fn angle_is_constant_inside_the_range_and_leaves_just_outside_at_both_ends() {
        let (low, high) = (-0.0016 - 0.0761, -0.0016 + 0.0761);
        for inside in [low * (1.0 - 1e-9), 0.5 * low, 0.0, 0.5 * high, high * (1.0 - 1e-9)] {
            let mut bench = BenchPlant::new(INERTIA, 0.0, Some(left()), 0.3, 0.0);
            for _ in 0..10_000 {
                bench.advance(inside, 1e-3, 10);
            }
            assert!(bench.stuck() && bench.angle_rad() == 0.3, "{inside} N m");
        }
        for outside in [low * (1.0 + 1e-9), high * (1.0 + 1e-9)] {
            let mut bench = BenchPlant::new(INERTIA, 0.0, Some(left()), 0.3, 0.0);
            for _ in 0..100 {
                bench.advance(outside, 1e-3, 10);
            }
            let moved = bench.angle_rad() - 0.3;
            assert!(moved * outside.signum() > 1e-3, "{outside} N m moved it by {moved} rad");
        }
    }

    #[test]
    fn coulomb_friction_stops_a_thrown_shaft_where_theory_says() {
        let level = 0.05;
        let coulomb = StribeckParameters {
            coulomb_nm: level,
            static_nm: level,
            viscous_nm_s_rad: 0.0,
            offset_nm: 0.0,
            ..*left().parameters()
        };
        let speed = 7.0;
        let mut bench = BenchPlant::new(INERTIA, 0.0, Stribeck::new(coulomb).ok(), 0.0, speed);
        let stop_s = INERTIA * speed / level;
        let before = (stop_s / 1e-3).floor() as usize;
        for tick in 0..=before {
            assert!(!bench.stuck(), "tick {tick}");
            bench.advance(0.0, 1e-3, 1);
        }
        let theory = 0.5 * INERTIA * speed * speed / level;
        assert!(bench.stuck() && (bench.angle_rad() / theory - 1.0).abs() < 1e-9, "{}", bench.angle_rad());
    }

    #[test]
    fn viscous_shaft_approaches_its_speed_exponentially() {
        let viscous = StribeckParameters {
            coulomb_nm: 0.0,
            static_nm: 0.0,
            viscous_nm_s_rad: 0.01,
            offset_nm: 0.0,
            ..*left().parameters()
        };
        let mut bench = BenchPlant::new(INERTIA, 0.0, Stribeck::new(viscous).ok(), 0.0, 0.0);
        for _ in 0..500 {
            bench.advance(0.1, 1e-3, 10);
        }
        let theory = 0.1 / 0.01 * (1.0 - f64::exp(-0.5 * 0.01 / INERTIA));
        assert!((bench.speed_rad_s() / theory - 1.0).abs() < 1e-9, "{}", bench.speed_rad_s());
    }

    #[test]
    fn pendulum_without_friction_keeps_its_energy() {
        let gravity = 0.4;
        let mut bench = BenchPlant::new(INERTIA, gravity, None, 2.0, 0.0);
        let energy = |b: &BenchPlant| 0.5 * INERTIA * b.speed_rad_s().powi(2) - gravity * b.angle_rad().cos();
        let start = energy(&bench);
        for _ in 0..10_000 {
            bench.advance(0.0, 1e-3, 10);
            assert!((energy(&bench) / start - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn pendulum_stays_where_friction_holds_its_weight() {
        let gravity = 0.4;
        // Friction of −0.0777 to 0.0745 N m holds angles of −0.0745 to 0.0777 N m / 0.4 N m.
        for (angle, held) in [(0.19, true), (-0.18, true), (0.20, false), (-0.19, false)] {
            let mut bench = BenchPlant::new(INERTIA, gravity, Some(left()), angle, 0.0);
            for _ in 0..100 {
                bench.advance(0.0, 1e-3, 10);
            }
            assert_eq!(bench.angle_rad() == angle, held, "{angle} rad");
        }
    }

    #[test]
    fn values_that_are_not_finite_show_and_end() {
        for torque in [f64::NAN, f64::INFINITY] {
            let mut bench = BenchPlant::new(INERTIA, 0.0, Some(left()), 0.3, 0.0);
            bench.advance(torque, 1e-3, 10);
            assert!(!bench.is_finite());
        }
    }
}
