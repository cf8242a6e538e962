//! Inputs and outputs of effect laws.

/// Motion of a motor or axis, and of the robot that it drives, at one instant: a simulation step, a controller
/// sample or a row of a log.
///
/// On a linear axis the fields of the motor hold m, m/s, m/s² and N. Unknown fields are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionSample {
    /// Time since the start, s.
    pub time_s: f64,
    /// Time since the previous sample, s.
    pub dt_s: f64,
    /// q of this motor, rad.
    pub motor_angle_rad: f64,
    /// q̇ of this motor, rad/s.
    pub motor_speed_rad_s: f64,
    /// q̈ of this motor, rad/s².
    pub motor_accel_rad_s2: f64,
    /// Torque command T of this motor, N m.
    pub torque_nm: f64,
    /// Sum of the torque commands of both motors, N m.
    pub torque_sum_nm: f64,
    /// x, m.
    pub x_m: f64,
    /// ẋ, m/s.
    pub x_dot_m_s: f64,
    /// ẍ, m/s².
    pub x_accel_m_s2: f64,
    /// θ, rad.
    pub pitch_rad: f64,
    /// θ̇, rad/s.
    pub pitch_rate_rad_s: f64,
    /// θ̈, rad/s².
    pub pitch_accel_rad_s2: f64,
}

impl MotionSample {
    /// Returns the direction of rotation: 1, −1, or 0 at standstill.
    pub fn direction(&self) -> f64 {
        if self.motor_speed_rad_s == 0.0 { 0.0 } else { self.motor_speed_rad_s.signum() }
    }
}

/// Contribution of an effect to the right-hand sides of the declared model.
///
/// With r1 and r2 as the residuals of translation and pitch (left side less declared right side), the effects of a
/// robot sum to r1 = Σ on_motor/r + axle and r2 = −Σ on_motor + body; on a bench T − I q̈ − τ_f = −on_motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Action {
    /// Torque inside the motor: on the shaft, with the opposite torque on the body, N m (linear axis: N).
    pub motor_nm: f64,
    /// Amplitude of dry friction inside the motor in addition to the declared friction,
    /// N m (linear axis: N).
    pub friction_nm: f64,
    /// Horizontal force at the height of the axle, N.
    pub axle_n: f64,
    /// Torque on the body alone, N m.
    pub body_nm: f64,
}

impl Action {
    /// Creates a torque inside the motor, N m.
    pub fn motor(motor_nm: f64) -> Self {
        Self { motor_nm, ..Self::default() }
    }

    /// Creates dry friction inside the motor, N m.
    pub fn friction(friction_nm: f64) -> Self {
        Self { friction_nm, ..Self::default() }
    }

    /// A horizontal force at a height above the axle along a body that leans by `pitch_rad`, N and m.
    pub fn force(force_n: f64, height_m: f64, pitch_rad: f64) -> Self {
        let body_nm = if height_m == 0.0 { 0.0 } else { force_n * height_m * libm::cos(pitch_rad) };
        Self { axle_n: force_n, body_nm, ..Self::default() }
    }

    /// Creates a torque on the body, N m.
    pub fn body(body_nm: f64) -> Self {
        Self { body_nm, ..Self::default() }
    }

    /// All that acts on the shaft of a motor that turns in `direction` (1, −1, or 0 at standstill, where dry friction
    /// is whatever holds it), N m.
    pub fn on_motor_nm(&self, direction: f64) -> f64 {
        self.motor_nm - self.friction_nm * direction
    }

    /// This and `share` times another.
    pub fn plus(&self, share: f64, other: &Self) -> Self {
        Self {
            motor_nm: self.motor_nm + share * other.motor_nm,
            friction_nm: self.friction_nm + share * other.friction_nm,
            axle_n: self.axle_n + share * other.axle_n,
            body_nm: self.body_nm + share * other.body_nm,
        }
    }

    /// Returns whether all of it is finite.
    pub fn is_finite(&self) -> bool {
        [self.motor_nm, self.friction_nm, self.axle_n, self.body_nm].iter().all(|value| value.is_finite())
    }
}

/// A physical law with its memory. Moments are shown to it in their order, each once; it advances by their `dt_s`.
pub trait Law: Send + Sync {
    /// Returns its action at a sample.
    fn act(&mut self, moment: &MotionSample) -> Action;
    /// Returns the action of a law without memory; `None` for a law with memory.
    fn at(&self, _: &MotionSample) -> Option<Action> {
        None
    }
    /// The law with its memory.
    fn boxed_clone(&self) -> Box<dyn Law>;
}

/// A closure is a law with memory: what it captures.
impl<F> Law for F
where
    F: FnMut(&MotionSample) -> Action + Clone + Send + Sync + 'static,
{
    fn act(&mut self, moment: &MotionSample) -> Action {
        self(moment)
    }

    fn boxed_clone(&self) -> Box<dyn Law> {
        Box::new(self.clone())
    }
}

/// A law without memory.
#[derive(Clone, Copy)]
struct Memoryless<F>(F);

impl<F> Law for Memoryless<F>
where
    F: Fn(&MotionSample) -> Action + Clone + Send + Sync + 'static,
{
    fn act(&mut self, moment: &MotionSample) -> Action {
        (self.0)(moment)
    }

    fn at(&self, moment: &MotionSample) -> Option<Action> {
        Some((self.0)(moment))
    }

    fn boxed_clone(&self) -> Box<dyn Law> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Law> {
    fn clone(&self) -> Self {
        // Of the law, not of the box around it, which would be a law too.
        (**self).boxed_clone()
    }
}

/// One summand of an effect: a law that is linear in its amplitude, at unit amplitude.
#[derive(Clone)]
pub struct Term {
    /// Key of the amplitude; `None` if it is 1 whatever the parameters.
    pub amplitude: Option<String>,
    /// The law at unit amplitude, fresh.
    pub law: Box<dyn Law>,
}

impl Term {
    /// A law without memory, with an amplitude.
    pub fn new<F>(amplitude: impl Into<String>, law: F) -> Self
    where
        F: Fn(&MotionSample) -> Action + Clone + Send + Sync + 'static,
    {
        Self { amplitude: Some(amplitude.into()), law: Box::new(Memoryless(law)) }
    }

    /// A law with memory and an amplitude.
    pub fn remembering(amplitude: impl Into<String>, law: impl Law + 'static) -> Self {
        Self { amplitude: Some(amplitude.into()), law: Box::new(law) }
    }

    /// A law without an amplitude.
    pub fn fixed(law: impl Law + 'static) -> Self {
        Self { amplitude: None, law: Box::new(law) }
    }
}

impl std::fmt::Debug for Term {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Term").field("amplitude", &self.amplitude).finish_non_exhaustive()
    }
}
