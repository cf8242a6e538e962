//! The wheel-legged robot as a two-wheeled inverted pendulum: parameters, coefficients, linear and
//! nonlinear dynamics.
//!
//! # Derivation (numbers in brackets: equations of Zhang et al., Sensors 2025, 25(4), 1056)
//! Assumptions of the paper: the chassis is one rigid body whose mass sits at its centre of mass; leg
//! motion is neglected (the pole length is constant during a run); both wheels are equal and roll
//! without slip, so φ = x/r; the ground is level; roll and yaw are left out.
//!
//! 1. Each wheel, with motor torque Tᵢ and the horizontal reaction Nᵢ of the chassis, rolls by
//!    (I + m r²) ẍ/r = Tᵢ − Nᵢ r [1], [2].
//! 2. The axle moves with the mean of both wheels; their sum is
//!    (2I + 2m r²) ẍ/r = ΣT − r (N_l + N_r) [3].
//! 3. Horizontally the chassis obeys N_l + N_r = M d²/dt² (x + l sin θ)
//!    = M (ẍ + l θ̈ cos θ − l θ̇² sin θ) [16] to [23]; put into step 2 it gives [5]:
//!    (2I + 2m r² + M r²) ẍ = r ΣT + M r² l θ̇² sin θ − M r² l θ̈ cos θ.
//! 4. Moments about the axle, with the motors' reaction −ΣT, give [4]:
//!    (J + M l²) θ̈ = M g l sin θ − M l ẍ cos θ − ΣT.
//!
//! Friction acts on the motor shaft: wherever the robot has friction, Tᵢ is replaced by Tᵢ − τ_f(q̇ᵢ) in
//! both equations, with the motor speed q̇ = ẋ/r − θ̇.
//!
//! # Notation
//! The paper uses several letters twice (K: gain and sample count; c₁, c₂: coefficients and learning
//! factors; N: data points and particles); code uses the words below.
//!
//! | paper | here | unit |
//! |---|---|---|
//! | M, m | `body_mass_kg`, `wheel_mass_kg` | kg |
//! | I, J | `wheel_inertia_kg_m2`, `body_inertia_kg_m2` | kg m² |
//! | r, l | `wheel_radius_m`, `com_height_m` | m |
//! | x, ẋ | `x_m`, `x_dot_m_s`, forward positive | m, m/s |
//! | θ, θ̇ | `pitch_rad`, `pitch_rate_rad_s`, forward positive, 0 upright | rad, rad/s |
//! | q, q̇ | `motor_angle_rad`, `motor_speed_rad_s`: wheel angle minus pitch | rad, rad/s |
//! | T_l, T_r | `torque_left_nm`, `torque_right_nm`, drive the robot forward | N m |
//! | K in u = −K X | `gain` | N m/m, N m s/m, N m/rad, N m s/rad |
//! | K samples, section 3.1 | `edge_samples` | 1 |
//! | c₁…c₅ [8] | [`Coefficients`] | see there |
//! | c₁, c₂ [Table 2] | `learn_cognitive`, `learn_social` | 1 |

use nalgebra::{Matrix4, Matrix4x2, Vector4};
use serde::{Deserialize, Serialize};

use super::ModelParameter;
use crate::parameter::{ParameterError, positive};

/// Acceleration of free fall in model files that give none, m/s².
pub const STANDARD_GRAVITY_M_S2: f64 = 9.81;

/// Physical parameters of the robot, names as in the model file's `[robot]` table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotParameters {
    /// M: everything above the axle, kg.
    pub body_mass_kg: f64,
    /// m: one wheel, kg.
    pub wheel_mass_kg: f64,
    /// I: one wheel and its rotor about the axle, kg m².
    pub wheel_inertia_kg_m2: f64,
    /// r: wheel radius, m.
    pub wheel_radius_m: f64,
    /// l: axle to the body's centre of mass, m.
    pub com_height_m: f64,
    /// J: body about its centre of mass, kg m².
    pub body_inertia_kg_m2: f64,
    /// g: acceleration of free fall, m/s².
    pub gravity_m_s2: f64,
}

/// State X = [x, ẋ, θ, θ̇]ᵀ (Eq. 9).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Displacement of the axle, m.
    pub x_m: f64,
    /// Speed of the axle, m/s.
    pub x_dot_m_s: f64,
    /// Pitch from upright, rad.
    pub pitch_rad: f64,
    /// Pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
}

impl State {
    /// The state as a vector in the order of Eq. 9.
    pub fn to_vector(self) -> Vector4<f64> {
        Vector4::new(self.x_m, self.x_dot_m_s, self.pitch_rad, self.pitch_rate_rad_s)
    }

    /// The state from a vector in the order of Eq. 9.
    pub fn from_vector(vector: &Vector4<f64>) -> Self {
        Self { x_m: vector[0], x_dot_m_s: vector[1], pitch_rad: vector[2], pitch_rate_rad_s: vector[3] }
    }
}

/// Coefficients of Eq. 8 and d = c₁c₃ − c₂c₅.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// c₁ = (2I + 2m r² + M r²)/r, kg m.
    pub c1: f64,
    /// c₂ = M r l, kg m².
    pub c2: f64,
    /// c₃ = J + M l², kg m².
    pub c3: f64,
    /// c₄ = M g l, N m/rad.
    pub c4: f64,
    /// c₅ = M l, kg m.
    pub c5: f64,
    /// d = c₁c₃ − c₂c₅, kg² m³; above zero for every real robot.
    pub determinant: f64,
}

/// Linear dynamics Ẋ = A X + B u about upright standing (Eqs. 11, 12), u = [T_l, T_r]ᵀ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearModel {
    /// A, 4×4.
    pub a: Matrix4<f64>,
    /// B, 4×2; its columns are equal because both wheels are.
    pub b: Matrix4x2<f64>,
}

/// Accelerations of the nonlinear dynamics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accelerations {
    /// ẍ, m/s².
    pub x_ddot_m_s2: f64,
    /// θ̈, rad/s².
    pub pitch_accel_rad_s2: f64,
}

impl Coefficients {
    /// ẍ and θ̈ of Eqs. 4 and 5 under any loads: `along_nm` drives the wheels (ΣT of the shafts, plus r times
    /// a horizontal force), `about_nm` turns the body about the axle (−ΣT, plus h cos θ times a horizontal
    /// force that acts h above the axle). The state enters by sin θ, cos θ and θ̇.
    #[inline(always)]
    pub fn accelerations(
        &self,
        (sin, cos): (f64, f64),
        pitch_rate_rad_s: f64,
        along_nm: f64,
        about_nm: f64,
    ) -> Accelerations {
        let Self { c1, c2, c3, c4, c5, determinant } = *self;
        // c1 ẍ + c2 cos θ θ̈ = along, c5 cos θ ẍ + c3 θ̈ = about
        let along = along_nm + c2 * pitch_rate_rad_s * pitch_rate_rad_s * sin;
        let about = about_nm + c4 * sin;
        // c1 c3 − c2 c5 cos² θ, without its cancellation when upright
        let inverse = 1.0 / (determinant + c2 * c5 * (1.0 - cos) * (1.0 + cos));
        Accelerations {
            x_ddot_m_s2: (c3 * along - c2 * cos * about) * inverse,
            pitch_accel_rad_s2: (c1 * about - c5 * cos * along) * inverse,
        }
    }
}

impl RobotParameters {
    /// Refuses masses, lengths and inertias that are not finite and above zero.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let mut values = *self;
        ModelParameter::of_robot()
            .try_for_each(|(parameter, place)| positive(parameter.key, *place(&mut values)))
    }

    /// c₁…c₅ (Eq. 8).
    pub fn coefficients(&self) -> Coefficients {
        let (body, radius, height) = (self.body_mass_kg, self.wheel_radius_m, self.com_height_m);
        let radius_squared = radius * radius;
        let rolling = 2.0 * self.wheel_inertia_kg_m2 + 2.0 * self.wheel_mass_kg * radius_squared;
        let c1 = (rolling + body * radius_squared) / radius;
        let c2 = body * radius * height;
        let c3 = self.body_inertia_kg_m2 + body * height * height;
        let c4 = body * self.gravity_m_s2 * height;
        let c5 = body * height;
        // The same as c1 c3 − c2 c5, whose two products nearly cancel where the inertias are small.
        let determinant = (rolling * c3 + body * radius_squared * self.body_inertia_kg_m2) / radius;
        Coefficients { c1, c2, c3, c4, c5, determinant }
    }

    /// A and B of Ẋ = A X + B u (Eqs. 11, 12).
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// let model = robot.parameters.linear_model();
    /// // Upright standing is unstable: one open-loop pole is in the right half-plane.
    /// assert!(model.a.complex_eigenvalues().iter().any(|pole| pole.re > 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn linear_model(&self) -> LinearModel {
        let Coefficients { c1, c2, c3, c4, c5, determinant: d } = self.coefficients();
        let mut a = Matrix4::zeros();
        a[(0, 1)] = 1.0;
        a[(2, 3)] = 1.0;
        a[(1, 2)] = -c2 * c4 / d;
        a[(3, 2)] = c1 * c4 / d;
        let mut b = Matrix4x2::zeros();
        for motor in 0..2 {
            b[(1, motor)] = (c2 + c3) / d;
            b[(3, motor)] = -(c1 + c5) / d;
        }
        LinearModel { a, b }
    }

    /// ẍ and θ̈ of the nonlinear dynamics (Eqs. 4, 5) under `shaft_torque_nm`, the sum of both motors'
    /// torques after friction.
    pub fn accelerations(&self, state: &State, shaft_torque_nm: f64) -> Accelerations {
        self.coefficients().accelerations(
            state.pitch_rad.sin_cos(),
            state.pitch_rate_rad_s,
            shaft_torque_nm,
            -shaft_torque_nm,
        )
    }

    /// Motor speed q̇ = ẋ/r − θ̇, rad/s, that goes with a state.
    pub fn motor_speed_rad_s(&self, state: &State) -> f64 {
        state.x_dot_m_s / self.wheel_radius_m - state.pitch_rate_rad_s
    }

    /// Kinetic and potential energy, J, zero when upright at rest; the oracle for integrators.
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// use flqr_core::model::State;
    ///
    /// let tilted = State { pitch_rad: 0.1, ..State::default() };
    /// let upright = State::default();
    /// assert!(robot.parameters.energy_j(&tilted) < robot.parameters.energy_j(&upright));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn energy_j(&self, state: &State) -> f64 {
        let radius = self.wheel_radius_m;
        let rolling = 2.0 * self.wheel_mass_kg + 2.0 * self.wheel_inertia_kg_m2 / (radius * radius);
        let coefficients = self.coefficients();
        let (v, rate) = (state.x_dot_m_s, state.pitch_rate_rad_s);
        0.5 * (rolling + self.body_mass_kg) * v * v
            + coefficients.c5 * v * rate * state.pitch_rad.cos()
            + 0.5 * coefficients.c3 * rate * rate
            + coefficients.c4 * (state.pitch_rad.cos() - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: RobotParameters = RobotParameters {
        body_mass_kg: 13.0,
        wheel_mass_kg: 1.0,
        wheel_inertia_kg_m2: 0.005,
        wheel_radius_m: 0.1,
        com_height_m: 0.25,
        body_inertia_kg_m2: 0.25,
        gravity_m_s2: 9.81,
    };

    #[test]
    fn accelerations_satisfy_newtons_equations_4_and_5() {
        let p = ROBOT;
        for (pitch_rad, pitch_rate_rad_s, torque) in [(0.3, -1.2, 0.7), (-1.0, 2.0, -1.5), (0.0, 0.0, 1.0)] {
            let state = State { pitch_rad, pitch_rate_rad_s, ..State::default() };
            let Accelerations { x_ddot_m_s2: x_ddot, pitch_accel_rad_s2: pitch_accel } =
                p.accelerations(&state, torque);
            let (sin, cos) = pitch_rad.sin_cos();
            let (m, r, l) = (p.body_mass_kg, p.wheel_radius_m, p.com_height_m);
            let equation_4 = (p.body_inertia_kg_m2 + m * l * l) * pitch_accel
                - (m * p.gravity_m_s2 * l * sin - m * l * x_ddot * cos - torque);
            let equation_5 = (2.0 * p.wheel_inertia_kg_m2 + 2.0 * p.wheel_mass_kg * r * r + m * r * r)
                * x_ddot
                - (r * torque + m * r * r * l * (pitch_rate_rad_s.powi(2) * sin - pitch_accel * cos));
            assert!(equation_4.abs() < 1e-12 && equation_5.abs() < 1e-12, "{equation_4} {equation_5}");
        }
    }

    #[test]
    fn linear_model_is_the_derivative_of_the_nonlinear_one_when_upright() {
        let LinearModel { a, b } = ROBOT.linear_model();
        let step = 1e-6;
        let derivative = |state: State, torque: f64| {
            let upper = ROBOT.accelerations(&state, torque);
            let lower = ROBOT.accelerations(&State::from_vector(&-state.to_vector()), -torque);
            let slope = |u: f64, l: f64| (u - l) / (2.0 * step);
            (
                slope(upper.x_ddot_m_s2, lower.x_ddot_m_s2),
                slope(upper.pitch_accel_rad_s2, lower.pitch_accel_rad_s2),
            )
        };
        let by_pitch = derivative(State { pitch_rad: step, ..State::default() }, 0.0);
        let by_torque = derivative(State::default(), step);
        let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-6;
        assert!(close(a[(1, 2)], by_pitch.0) && close(a[(3, 2)], by_pitch.1));
        assert!(close(b[(1, 0)], by_torque.0) && close(b[(3, 1)], by_torque.1));
    }

    #[test]
    fn power_of_the_torque_is_the_change_of_energy() {
        let state = State { x_m: 0.0, x_dot_m_s: 0.4, pitch_rad: 0.2, pitch_rate_rad_s: -0.9 };
        let torque = 0.8;
        let acceleration = ROBOT.accelerations(&state, torque);
        let rates = Vector4::new(
            state.x_dot_m_s,
            acceleration.x_ddot_m_s2,
            state.pitch_rate_rad_s,
            acceleration.pitch_accel_rad_s2,
        );
        let step = 1e-6;
        let moved = |sign: f64| State::from_vector(&(state.to_vector() + rates * (sign * step)));
        let change = (ROBOT.energy_j(&moved(1.0)) - ROBOT.energy_j(&moved(-1.0))) / (2.0 * step);
        let power = torque * ROBOT.motor_speed_rad_s(&state);
        assert!((change - power).abs() < 1e-7, "{change} {power}");
    }

    #[test]
    fn determinant_keeps_its_digits_where_the_inertias_are_tiny() {
        let tiny = RobotParameters {
            wheel_mass_kg: 1e-12,
            wheel_inertia_kg_m2: 1e-14,
            body_inertia_kg_m2: 1e-12,
            ..ROBOT
        };
        // [(2I + 2m r²)(J + M l²) + M r² J]/r in exact rationals: c1 c3 − c2 c5 in doubles has none of them right.
        let exact = 1.6250000000004001e-12;
        let found = tiny.coefficients().determinant;
        assert!((found / exact - 1.0).abs() < 1e-14, "{found} for {exact}");
    }

    #[test]
    fn negative_mass_is_refused_by_name() {
        let error = RobotParameters { body_mass_kg: -1.0, ..ROBOT }.validate().unwrap_err();
        assert_eq!(
            error.to_string(),
            "body_mass_kg = -1 is out of range: it must be a finite number above 0"
        );
    }
}
