//! What the robot is: numbers, friction curve and an LQR gain found by letting the Riccati equation run.

use super::random::Random;

/// Friction of one motor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    pub(crate) coulomb: f64,
    pub(crate) standing: f64,
    pub(crate) viscous: f64,
    pub(crate) knee: f64,
    pub(crate) shape: f64,
    pub(crate) offset: f64,
}

impl Curve {
    /// Torque against a turn in `direction` at speed `w`.
    pub(crate) fn at(&self, w: f64, direction: f64) -> f64 {
        let fade = (-((w.abs() / self.knee).powf(self.shape))).exp();
        direction * (self.coulomb + (self.standing - self.coulomb) * fade) + self.viscous * w + self.offset
    }
}

/// The paper's two motors.
pub(crate) const MOTORS: [Curve; 2] = [
    Curve { coulomb: 0.0338, standing: 0.0761, viscous: 0.00049, knee: 1.612, shape: 0.231, offset: -0.0016 },
    Curve { coulomb: 0.0406, standing: 0.0617, viscous: 0.00043, knee: 2.253, shape: 0.2772, offset: 0.0014 },
];

/// A robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub(crate) mass: f64,
    pub(crate) wheel: f64,
    pub(crate) wheel_inertia: f64,
    pub(crate) radius: f64,
    pub(crate) height: f64,
    pub(crate) inertia: f64,
    pub(crate) gravity: f64,
    pub(crate) motors: [Curve; 2],
    /// Diagonals of the cost: x, ẋ, θ, θ̇; one motor.
    pub(crate) cost: ([f64; 4], f64),
}

/// Fractions of themselves by which the numbers of a robot may be off.
pub(crate) struct Tolerances {
    pub(crate) masses: f64,
    pub(crate) lengths: f64,
    pub(crate) inertias: f64,
    pub(crate) friction: f64,
}

/// What the model files of the cases say: a scale, a rule, and a friction curve that was measured once.
pub(crate) const TOLERANCES: Tolerances =
    Tolerances { masses: 0.01, lengths: 0.005, inertias: 0.02, friction: 0.1 };

/// The robots of the cases.
pub(crate) const BODIES: [Body; 4] = [
    Body {
        mass: 13.0,
        wheel: 1.0,
        wheel_inertia: 0.005,
        radius: 0.1,
        height: 0.25,
        inertia: 0.25,
        gravity: 9.81,
        motors: MOTORS,
        cost: ([60.0, 30.0, 100.0, 5.0], 20.0),
    },
    Body {
        mass: 10.5,
        wheel: 0.85,
        wheel_inertia: 0.0038,
        radius: 0.095,
        height: 0.3,
        inertia: 0.24,
        gravity: 9.81,
        motors: MOTORS,
        cost: ([40.0, 25.0, 90.0, 4.0], 22.0),
    },
    Body {
        mass: 16.0,
        wheel: 1.2,
        wheel_inertia: 0.0065,
        radius: 0.11,
        height: 0.22,
        inertia: 0.3,
        gravity: 9.81,
        motors: MOTORS,
        cost: ([70.0, 35.0, 120.0, 6.0], 18.0),
    },
    Body {
        mass: 9.0,
        wheel: 0.7,
        wheel_inertia: 0.0028,
        radius: 0.085,
        height: 0.2,
        inertia: 0.12,
        gravity: 9.81,
        motors: MOTORS,
        cost: ([50.0, 20.0, 80.0, 3.0], 25.0),
    },
];

impl Body {
    /// The same robot, every number off by up to a `share` of its tolerance.
    pub(crate) fn jittered(mut self, share: f64, random: &mut Random) -> Self {
        let mut off = |value: &mut f64, tolerance: f64| {
            *value *= 1.0 + random.between(-share * tolerance, share * tolerance);
        };
        off(&mut self.mass, TOLERANCES.masses);
        off(&mut self.wheel, TOLERANCES.masses);
        off(&mut self.wheel_inertia, TOLERANCES.inertias);
        off(&mut self.height, TOLERANCES.lengths);
        off(&mut self.inertia, TOLERANCES.inertias);
        for motor in &mut self.motors {
            off(&mut motor.coulomb, TOLERANCES.friction);
            off(&mut motor.standing, TOLERANCES.friction);
            off(&mut motor.viscous, TOLERANCES.friction);
        }
        self
    }

    /// Mass that a push along the ground has to move.
    pub(crate) fn rolling(&self) -> f64 {
        self.mass + 2.0 * self.wheel + 2.0 * self.wheel_inertia / (self.radius * self.radius)
    }

    /// ẍ and θ̈ under shaft torque `s`, axle force `f` and body torque `n`.
    pub(crate) fn accelerate(&self, pitch: f64, rate: f64, s: f64, f: f64, n: f64) -> (f64, f64) {
        let lever = self.mass * self.height;
        let (a, b, c) = (self.rolling(), lever * pitch.cos(), self.inertia + lever * self.height);
        let along = s / self.radius + f + lever * rate * rate * pitch.sin();
        let about = lever * self.gravity * pitch.sin() - s + n;
        let bottom = a * c - b * b;
        ((c * along - b * about) / bottom, (a * about - b * along) / bottom)
    }

    /// Feedback of one motor on x, ẋ, θ, θ̇: the Riccati equation integrated until it rests.
    pub(crate) fn gain(&self) -> [f64; 4] {
        let (mut a, mut b) = ([[0.0; 4]; 4], [0.0; 4]);
        (a[0][1], a[2][3]) = (1.0, 1.0);
        let h = 1e-6;
        let (x, turn) = self.accelerate(h, 0.0, 0.0, 0.0, 0.0);
        (a[1][2], a[3][2]) = (x / h, turn / h);
        let (x, turn) = self.accelerate(0.0, 0.0, 1.0, 0.0, 0.0);
        (b[1], b[3]) = (x, turn);
        let (q, r) = self.cost;
        let mut p = [[0.0; 4]; 4];
        for _ in 0..60_000 {
            let mut pb = [0.0; 4];
            for i in 0..4 {
                pb[i] = (0..4).map(|j| p[i][j] * b[j]).sum();
            }
            let mut next = p;
            for i in 0..4 {
                for j in 0..4 {
                    let both: f64 = (0..4).map(|k| a[k][i] * p[k][j] + p[i][k] * a[k][j]).sum();
                    let rate = both - 2.0 * pb[i] * pb[j] / r + if i == j { q[i] } else { 0.0 };
                    next[i][j] += 2e-4 * rate;
                }
            }
            p = next;
        }
        std::array::from_fn(|i| (0..4).map(|j| p[i][j] * b[j]).sum::<f64>() / r)
    }
}
