//! Eqs. 4 and 5 in motor angle and pitch, and one step of a smooth motion.
//!
//! With x = r (q + θ), along = ΣT + a and about = −ΣT + b, where a and b are what gravity, spin and a push add
//! to Eqs. 5 and 4:
//! - D q̈ = (c₃/r + c₅ cos θ) along − (c₁ + c₅ cos θ) about,
//! - D θ̈ = c₁ about − c₅ cos θ along, D = d + c₂c₅ sin² θ;
//! - held shafts, q̈ = 0: (c₁r + c₃ + 2c₂ cos θ) θ̈ = a + b.

use super::number::Number;
use crate::model::RobotParameters;

/// q, q̇, θ, θ̇.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion<N = f64> {
    pub(super) angle: N,
    pub(super) speed: N,
    pub(super) pitch: N,
    pub(super) pitch_rate: N,
}

/// The robot without its friction's level, which depends on speed in a separate way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Laws<N = f64> {
    pub(super) radius_m: N,
    pub(super) c1: N,
    pub(super) c2: N,
    pub(super) c4: N,
    pub(super) c5: N,
    pub(super) c3_per_radius: N,
    pub(super) determinant: N,
    pub(super) c2c5: N,
    /// c₁r and c₁r + c₃.
    pub(super) c1r: N,
    pub(super) locked: N,
    /// Sums of both motors' f_v and f_p.
    pub(super) viscous_nm_s_rad: N,
    pub(super) offset_nm: N,
}

/// Inputs of the robot during one sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Loads<N = f64> {
    /// ΣT before friction, N m.
    pub(super) torque_nm: N,
    /// r F of a push F, N m.
    pub(super) along_nm: N,
    /// h F of a push F at height h, N m.
    pub(super) about_nm: N,
}

/// Friction level at a speed's magnitude, N m, summed over both motors.
pub(super) trait Level<N> {
    fn amplitude_nm(&self, speed: N) -> N;
}

impl Laws {
    pub(super) fn new(parameters: &RobotParameters, viscous_nm_s_rad: f64, offset_nm: f64) -> Self {
        let c = parameters.coefficients();
        let radius_m = parameters.wheel_radius_m;
        Self {
            radius_m,
            c1: c.c1,
            c2: c.c2,
            c4: c.c4,
            c5: c.c5,
            c3_per_radius: c.c3 / radius_m,
            determinant: c.determinant,
            c2c5: c.c2 * c.c5,
            c1r: c.c1 * radius_m,
            locked: c.c1 * radius_m + c.c3,
            viscous_nm_s_rad,
            offset_nm,
        }
    }
}

impl<N: Number> Laws<N> {
    /// q̈ and θ̈ of shafts that slide in `direction` (1 or −1), rad/s².
    #[inline(always)]
    pub(super) fn sliding(
        &self,
        loads: &Loads<N>,
        (sin, cos): (N, N),
        at: &Motion<N>,
        direction: N,
        friction: &impl Level<N>,
    ) -> (N, N) {
        let level = friction.amplitude_nm(at.speed);
        let (a, b) = self.own(loads, (sin, cos), at.pitch_rate);
        let c5_cos = self.c5 * cos;
        let (by_along, by_about) = (self.c3_per_radius + c5_cos, self.c1 + c5_cos);
        let inverse = a.constant(1.0) / (self.determinant + self.c2c5 * (sin * sin));
        let (speed_per_nm, pitch_per_nm) = ((by_along + by_about) * inverse, by_about * inverse);
        // All but the level first: it takes longest, and the next stage waits for it.
        let steady = (loads.torque_nm - self.offset_nm) - self.viscous_nm_s_rad * at.speed;
        let speed = (by_along * a - by_about * b) * inverse + speed_per_nm * steady;
        let pitch = (self.c1 * b - c5_cos * a) * inverse - pitch_per_nm * steady;
        (speed - (direction * speed_per_nm) * level, pitch + (direction * pitch_per_nm) * level)
    }

    /// Friction summed over both motors, N m, that keeps q̈ = 0, and θ̈ under it, rad/s². The motors'
    /// torque does not enter θ̈: between locked wheels and body it is internal.
    #[inline(always)]
    pub(super) fn held(&self, loads: &Loads<N>, (sin, cos): (N, N), at: &Motion<N>) -> (N, N) {
        let (a, b) = self.own(loads, (sin, cos), at.pitch_rate);
        let c2_cos = self.c2 * cos;
        let pitch = (a + b) / (self.locked + (c2_cos + c2_cos));
        ((loads.torque_nm + a) - (self.c1r + c2_cos) * pitch, pitch)
    }

    /// a and b, N m.
    #[inline(always)]
    fn own(&self, loads: &Loads<N>, (sin, cos): (N, N), pitch_rate: N) -> (N, N) {
        let spin = (self.c2 * sin) * (pitch_rate * pitch_rate);
        (loads.along_nm + spin, loads.about_nm * cos + self.c4 * sin)
    }
}

/// One classical step of order 4 under the accelerations q̈ and θ̈ of a smooth motion.
#[inline(always)]
pub(super) fn runge_kutta<N: Number>(
    start: &Motion<N>,
    dt: N,
    accelerations: impl Fn(&Motion<N>) -> (N, N),
) -> Motion<N> {
    let half = dt * dt.constant(0.5);
    let k1 = start.rates(accelerations(start));
    let second = start.moved(&k1, half);
    let k2 = second.rates(accelerations(&second));
    let third = start.moved(&k2, half);
    let k3 = third.rates(accelerations(&third));
    let fourth = start.moved(&k3, dt);
    let k4 = fourth.rates(accelerations(&fourth));
    let two = dt.constant(2.0);
    let sum = |pick: fn(&Motion<N>) -> N| (pick(&k1) + two * pick(&k2)) + (two * pick(&k3) + pick(&k4));
    let six_rates = Motion {
        angle: sum(|k| k.angle),
        speed: sum(|k| k.speed),
        pitch: sum(|k| k.pitch),
        pitch_rate: sum(|k| k.pitch_rate),
    };
    start.moved(&six_rates, dt * dt.constant(1.0 / 6.0))
}

impl<N: Number> Motion<N> {
    #[inline(always)]
    fn rates(&self, (speed, pitch_rate): (N, N)) -> Self {
        Self { angle: self.speed, speed, pitch: self.pitch_rate, pitch_rate }
    }

    #[inline(always)]
    fn moved(&self, rate: &Self, dt: N) -> Self {
        Self {
            angle: self.angle + dt * rate.angle,
            speed: self.speed + dt * rate.speed,
            pitch: self.pitch + dt * rate.pitch,
            pitch_rate: self.pitch_rate + dt * rate.pitch_rate,
        }
    }
}
