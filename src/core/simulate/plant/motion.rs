//! Position and velocity of the robot, and one Runge-Kutta step of order 4.

use super::laws::Response;

/// The coordinates that are integrated; also their rates of change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    /// Motor angles q, rad.
    pub(super) angle: [f64; 2],
    /// Motor speeds q̇, rad/s.
    pub(super) speed: [f64; 2],
    /// Angle of the line from axle to centre of mass, from the normal of the sloped ground, rad.
    pub(super) lean: f64,
    /// Its rate against inertial space, rad/s.
    pub(super) lean_rate: f64,
    /// Way of the axle's middle up the slope, m.
    pub(super) uphill: f64,
}

impl Motion {
    /// Its rates of change under torques on the shafts.
    #[inline(always)]
    pub(super) fn rate(&self, response: &Response, shaft_nm: [f64; 2]) -> Self {
        Self {
            angle: self.speed,
            speed: response.motor_accelerations(shaft_nm),
            lean: self.lean_rate,
            lean_rate: response.lean_acceleration(shaft_nm),
            uphill: response.uphill,
        }
    }

    #[inline(always)]
    pub(super) fn moved(&self, rate: &Self, dt: f64) -> Self {
        self.combined(rate, |value, rate| value + dt * rate)
    }

    #[inline(always)]
    fn combined(&self, other: &Self, with: impl Fn(f64, f64) -> f64) -> Self {
        let pair = |a: [f64; 2], b: [f64; 2]| [with(a[0], b[0]), with(a[1], b[1])];
        Self {
            angle: pair(self.angle, other.angle),
            speed: pair(self.speed, other.speed),
            lean: with(self.lean, other.lean),
            lean_rate: with(self.lean_rate, other.lean_rate),
            uphill: with(self.uphill, other.uphill),
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        let Self { angle, speed, lean, lean_rate, uphill } = self;
        [angle[0], angle[1], speed[0], speed[1], *lean, *lean_rate, *uphill].iter().all(|v| v.is_finite())
    }
}

/// A smooth motion. A closure in its place would not be inlined, which takes half again as long.
pub(super) trait Smooth {
    fn rate(&self, at: &Motion) -> Motion;
}

/// One classical Runge-Kutta step.
#[inline(always)]
pub(super) fn runge_kutta(start: &Motion, dt: f64, law: &impl Smooth) -> Motion {
    let k1 = law.rate(start);
    let k2 = law.rate(&start.moved(&k1, 0.5 * dt));
    let k3 = law.rate(&start.moved(&k2, 0.5 * dt));
    let k4 = law.rate(&start.moved(&k3, dt));
    let outer = k1.combined(&k4, |a, b| a + b);
    let inner = k2.combined(&k3, |a, b| a + b);
    start.moved(&outer.combined(&inner, |outer, inner| outer + 2.0 * inner), dt / 6.0)
}
