//! The way of a torque from the controller to one motor's shaft.

use std::collections::VecDeque;

use super::simulation::TICK_S;
use crate::model::{Actuation, MotorLimits};

/// One motor with its command line: resolution of the command, transport delay, torque limit, slew limit,
/// and the limit that the supply's voltage sets at high speed, in this order. Deterministic; noise is the
/// caller's to add.
#[derive(Clone, Debug)]
pub struct Actuator {
    limits: MotorLimits,
    torque_step_nm: f64,
    under_way: VecDeque<f64>,
    /// Torque before the limit at high speed, N m.
    reached_nm: f64,
}

impl Actuator {
    /// A motor that has been requested no torque yet. The delay is rounded to whole ticks of 1 ms.
    pub fn new(limits: &MotorLimits, actuation: &Actuation) -> Self {
        let ticks = (actuation.delay_s / TICK_S).round() as usize;
        Self {
            limits: *limits,
            torque_step_nm: actuation.torque_step_nm,
            under_way: std::iter::repeat_n(0.0, ticks).collect(),
            reached_nm: 0.0,
        }
    }

    /// One tick: takes the torque that the controller asks for and gives the one on the shaft, N m, that
    /// was requested a delay ago, with the motor at its present speed, rad/s.
    pub fn step(&mut self, asked_nm: f64, motor_speed_rad_s: f64) -> f64 {
        self.under_way.push_back(self.in_steps(asked_nm));
        let arrived = self.under_way.pop_front().expect("a torque has just been pushed");
        let limited = self.limits.torque_nm.map_or(arrived, |limit| within(arrived, limit));
        self.reached_nm = match self.limits.torque_slew_nm_s {
            Some(slew) => self.reached_nm + within(limited - self.reached_nm, slew * TICK_S),
            None => limited,
        };
        self.at_speed(self.reached_nm, motor_speed_rad_s)
    }

    fn in_steps(&self, torque_nm: f64) -> f64 {
        let step = self.torque_step_nm;
        if step > 0.0 { (torque_nm / step).round() * step } else { torque_nm }
    }

    /// The torque that the supply's voltage leaves: all of it up to the rated speed, then linearly less
    /// down to none at the no-load speed. Only in the driving direction: braking has the motor's own
    /// voltage on its side.
    fn at_speed(&self, torque_nm: f64, speed_rad_s: f64) -> f64 {
        let Some(no_load) = self.limits.no_load_speed_rad_s else { return torque_nm };
        let rated = self.limits.rated_speed_rad_s.unwrap_or(0.0);
        let speed = speed_rad_s.abs();
        if torque_nm * speed_rad_s <= 0.0 || speed <= rated {
            return torque_nm;
        }
        let share = ((no_load - speed) / (no_load - rated)).max(0.0);
        // Without a torque limit only the no-load speed binds.
        let limit =
            self.limits.torque_nm.map_or(if share > 0.0 { f64::INFINITY } else { 0.0 }, |nm| nm * share);
        within(torque_nm, limit)
    }
}

/// A value cut to ± a limit; one that is not a number stays so.
fn within(value: f64, limit: f64) -> f64 {
    if value.abs() > limit { limit.copysign(value) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIRECT: Actuation = Actuation { delay_s: 0.0, torque_noise_nm: 0.0, torque_step_nm: 0.0 };
    /// MF9025v2: 2.42 N m up to 490 rpm.
    const MF9025: MotorLimits = MotorLimits {
        torque_nm: Some(2.42),
        torque_slew_nm_s: None,
        rated_speed_rad_s: Some(51.3),
        no_load_speed_rad_s: Some(61.3),
    };

    #[test]
    fn torque_arrives_after_the_delay() {
        for ticks in [0, 1, 4, 50] {
            let actuation = Actuation { delay_s: 1e-3 * ticks as f64, ..DIRECT };
            let mut motor = Actuator::new(&MotorLimits::default(), &actuation);
            let arrived: Vec<f64> = (1..100).map(|tick| motor.step(f64::from(tick), 0.0)).collect();
            let expected = (1..100).map(|tick: i32| f64::from((tick - ticks).max(0)));
            assert!(arrived.into_iter().eq(expected), "{ticks} ticks");
        }
    }

    #[test]
    fn torque_is_limited_and_falls_above_the_rated_speed_where_it_drives() {
        for (asked, speed, expected) in [
            (1.0, 0.0, 1.0),
            (3.0, 0.0, 2.42),
            (-3.0, 51.3, -2.42),
            (3.0, 56.3, 1.21),
            (-3.0, -56.3, -1.21),
            (1.0, 56.3, 1.0),
            (3.0, 61.3, 0.0),
            (3.0, 90.0, 0.0),
            // Braking.
            (-3.0, 90.0, -2.42),
            (3.0, -56.3, 2.42),
        ] {
            let found = Actuator::new(&MF9025, &DIRECT).step(asked, speed);
            assert!((found - expected).abs() < 1e-12, "{asked} N m at {speed} rad/s gave {found}");
        }
    }

    #[test]
    fn slew_limit_ramps_and_steps_round() {
        let limits = MotorLimits { torque_slew_nm_s: Some(100.0), ..MF9025 };
        let mut motor = Actuator::new(&limits, &Actuation { torque_step_nm: 0.25, ..DIRECT });
        let found: Vec<f64> =
            [0.3, 0.3, 0.3, 0.3, -9.0].into_iter().map(|asked| motor.step(asked, 0.0)).collect();
        for (found, expected) in found.iter().zip([0.1, 0.2, 0.25, 0.25, 0.15]) {
            assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
        }
    }

    #[test]
    fn torque_that_is_not_a_number_is_passed_on() {
        assert!(Actuator::new(&MF9025, &DIRECT).step(f64::NAN, 3.0).is_nan());
        assert_eq!(Actuator::new(&MF9025, &DIRECT).step(f64::INFINITY, 3.0), 2.42);
    }
}
