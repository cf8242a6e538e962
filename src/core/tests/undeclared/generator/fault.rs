//! What a model does not declare.

use std::f64::consts::TAU;

/// One undeclared effect. Torques are those of each motor unless they say otherwise.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fault {
    Cogging { order: f64, nm: f64, phase: f64 },
    TorqueRipple { order: f64, share: f64, phase: f64 },
    QuadraticDrag { nm_s2: f64 },
    ViscousAsymmetry { nm_s: f64 },
    FrictionAsymmetry { nm: f64 },
    Coulomb { nm: f64 },
    Viscous { nm_s: f64 },
    LowSpeed { nm: f64, speed: f64 },
    LoadFriction { share: f64 },
    Presliding { nm: f64, travel: f64 },
    Thermal { share: f64, seconds: f64 },
    PositionFriction { order: f64, nm: f64, phase: f64 },
    Backlash { gap: f64 },
    Delay { seconds: f64 },
    Lag { seconds: f64 },
    Gain { share: f64 },
    Saturation { nm: f64 },
    Deadzone { nm: f64 },
    PitchOffset { rad: f64 },
    Slope { rad: f64 },
    Tether { n_m: f64, anchor: f64 },
    Mass { kg: f64 },
    Height { m: f64 },
    Inertia { kg_m2: f64 },
    Aero { n_s2: f64 },
    Rolling { n: f64 },
    Eccentric { n: f64, phase: f64 },
    Mode { share: f64, hz: f64, damping: f64 },
    Slosh { kg: f64, hz: f64, damping: f64 },
    GyroBias { rad_s: f64 },
    ImuDelay { seconds: f64 },
    Terrain { n: f64, length: f64, phase: f64 },
    Push { n: f64, at: f64, seconds: f64 },
    Slip { m_s_n: f64, seconds: f64 },
    WheelInertia { kg_m2: f64 },
    // Outside of every library: nothing logged shows what they depend on.
    HiddenFriction { nm: f64, hz: f64, damping: f64 },
    WalkingOffset { nm: f64 },
    RoughShove { n: f64, at: f64 },
    RateHysteresis { nm: f64, seconds: f64 },
    Weather { n: f64 },
    TyreMemory { n: f64, seconds: f64 },
    PitchTimesWay { nm: f64 },
    BodyWander { nm: f64 },
    Hum { nm: f64, hz: f64 },
    Bursts { nm: f64, every: f64 },
    TwoAngles { nm: f64, order: f64, other: f64 },
    Sag { share: f64, seconds: f64 },
    Patch { n: f64, at: f64, width: f64 },
}

impl Fault {
    /// The id under which it ought to be named; none outside the library.
    pub(crate) fn id(&self) -> Option<&'static str> {
        use Fault::*;
        Some(match self {
            Cogging { .. } => "cogging",
            TorqueRipple { .. } => "torque_ripple",
            QuadraticDrag { .. } => "quadratic_drag",
            ViscousAsymmetry { .. } => "viscous_asymmetry",
            FrictionAsymmetry { .. } => "friction_asymmetry",
            Coulomb { .. } => "coulomb_error",
            Viscous { .. } => "viscous_error",
            LowSpeed { .. } => "low_speed_friction",
            LoadFriction { .. } => "load_dependent_friction",
            Presliding { .. } => "presliding",
            Thermal { .. } => "thermal_friction",
            PositionFriction { .. } => "position_dependent_friction",
            Backlash { .. } => "backlash",
            Delay { .. } => "command_delay",
            Lag { .. } => "actuator_lag",
            Gain { .. } => "torque_gain",
            Saturation { .. } => "torque_saturation",
            Deadzone { .. } => "torque_deadzone",
            PitchOffset { .. } => "pitch_offset",
            Slope { .. } => "ground_slope",
            Tether { .. } => "tether_spring",
            Mass { .. } => "mass_error",
            Height { .. } => "com_height_error",
            Inertia { .. } => "body_inertia_error",
            Aero { .. } => "aero_drag",
            Rolling { .. } => "rolling_resistance",
            Eccentric { .. } => "wheel_eccentricity",
            Mode { .. } => "structural_mode",
            Slosh { .. } => "slosh",
            GyroBias { .. } => "gyro_bias",
            ImuDelay { .. } => "imu_delay",
            Terrain { .. } => "terrain",
            Push { .. } => "external_push",
            Slip { .. } => "wheel_slip",
            WheelInertia { .. } => "inertia_error",
            HiddenFriction { .. }
            | WalkingOffset { .. }
            | RoughShove { .. }
            | RateHysteresis { .. }
            | Weather { .. }
            | TyreMemory { .. }
            | PitchTimesWay { .. }
            | BodyWander { .. }
            | Hum { .. }
            | Bursts { .. }
            | TwoAngles { .. }
            | Sag { .. }
            | Patch { .. } => return None,
        })
    }

    /// A parameter of the named effect and its true value, where it has one that stands for its size.
    pub(crate) fn truth(&self, weight_n: f64) -> Option<(&'static str, f64)> {
        use Fault::*;
        Some(match *self {
            QuadraticDrag { nm_s2 } => ("drag_nm_s2_rad2", nm_s2),
            Coulomb { nm } => ("coulomb_nm", nm),
            Viscous { nm_s } => ("viscous_nm_s_rad", nm_s),
            LoadFriction { share } => ("coefficient", share),
            Delay { seconds } => ("delay_s", seconds),
            Lag { seconds } => ("time_constant_s", seconds),
            Gain { share } => ("gain", share),
            PitchOffset { rad } => ("angle_rad", rad),
            Slope { rad } => ("slope_rad", rad),
            Tether { n_m, .. } => ("stiffness_n_m", n_m),
            Mass { kg } => ("mass_kg", kg),
            Height { m } => ("height_m", m),
            Inertia { kg_m2 } => ("inertia_kg_m2", kg_m2),
            Aero { n_s2 } => ("drag_n_s2_m2", n_s2),
            Rolling { n } => ("coefficient", n / weight_n),
            GyroBias { rad_s } => ("rate_rad_s", rad_s),
            ImuDelay { seconds } => ("delay_s", seconds),
            WheelInertia { kg_m2 } => ("inertia_kg_m2", kg_m2),
            Slip { m_s_n, .. } => ("slip_m_s_n", m_s_n),
            LowSpeed { nm, .. } => ("amplitude_nm", nm),
            Saturation { nm } => ("limit_nm", nm),
            Slosh { kg, .. } => ("mass_kg", kg),
            Push { n, .. } => ("force_n", n),
            _ => return None,
        })
    }

    /// The same effect at `share` of its size.
    pub(crate) fn scaled(mut self, share: f64) -> Self {
        use Fault::*;
        match &mut self {
            Cogging { nm: size, .. }
            | TorqueRipple { share: size, .. }
            | QuadraticDrag { nm_s2: size }
            | ViscousAsymmetry { nm_s: size }
            | FrictionAsymmetry { nm: size }
            | Coulomb { nm: size }
            | Viscous { nm_s: size }
            | LowSpeed { nm: size, .. }
            | LoadFriction { share: size }
            | Presliding { travel: size, .. }
            | Thermal { share: size, .. }
            | PositionFriction { nm: size, .. }
            | Backlash { gap: size }
            | Delay { seconds: size }
            | Lag { seconds: size }
            | Gain { share: size }
            | Deadzone { nm: size }
            | PitchOffset { rad: size }
            | Slope { rad: size }
            | Tether { n_m: size, .. }
            | Mass { kg: size }
            | Height { m: size }
            | Inertia { kg_m2: size }
            | Aero { n_s2: size }
            | Rolling { n: size }
            | Eccentric { n: size, .. }
            | Mode { share: size, .. }
            | Slosh { kg: size, .. }
            | GyroBias { rad_s: size }
            | ImuDelay { seconds: size }
            | Terrain { n: size, .. }
            | Push { n: size, .. }
            | Slip { m_s_n: size, .. }
            | WheelInertia { kg_m2: size }
            | HiddenFriction { nm: size, .. }
            | WalkingOffset { nm: size }
            | RoughShove { n: size, .. }
            | RateHysteresis { nm: size, .. }
            | Weather { n: size }
            | TyreMemory { n: size, .. }
            | PitchTimesWay { nm: size }
            | BodyWander { nm: size }
            | Hum { nm: size, .. }
            | Bursts { nm: size, .. }
            | TwoAngles { nm: size, .. }
            | Sag { share: size, .. }
            | Patch { n: size, .. } => *size *= share,
            // A higher limit clips less.
            Saturation { nm } => *nm *= 1.0 + 0.35 * (1.0 - share),
        }
        self
    }
}

/// Slowly varying states of the effects, advanced once a millisecond.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    pub(crate) bristle: f64,
    pub(crate) warm: f64,
    pub(crate) asked: Vec<f64>,
    pub(crate) lagged: f64,
    pub(crate) side: f64,
    pub(crate) hidden: [f64; 2],
    pub(crate) walk: f64,
    pub(crate) gust: f64,
    pub(crate) slow_speed: f64,
    pub(crate) shove: f64,
    pub(crate) slip: f64,
    pub(crate) slip_rate: f64,
    pub(crate) tyre: f64,
    pub(crate) wander: f64,
    pub(crate) burst: f64,
    pub(crate) heat: f64,
    pub(crate) phase: f64,
}

/// Speed, angle, torque and the rest that an effect's torque in one motor depends on.
#[derive(Clone, Copy)]
pub(crate) struct Now {
    pub(crate) angle: f64,
    pub(crate) w: f64,
    pub(crate) direction: f64,
    pub(crate) asked: f64,
    /// The wheel's own turn against the ground.
    pub(crate) rolled: f64,
}

impl Fault {
    /// Extra torque inside one motor, against the declared curve; `level` is that curve's Coulomb part.
    pub(crate) fn motor(&self, now: Now, memory: &Memory, level: f64) -> f64 {
        use Fault::*;
        let Now { angle, w, direction, asked, rolled } = now;
        match *self {
            Cogging { order, nm, phase } => nm * (order * angle + phase).sin(),
            TorqueRipple { order, share, phase } => asked * share * (order * angle + phase).sin(),
            QuadraticDrag { nm_s2 } => -nm_s2 * w * w.abs(),
            ViscousAsymmetry { nm_s } => -nm_s * w.max(0.0),
            FrictionAsymmetry { nm } if direction > 0.0 => -nm,
            FrictionAsymmetry { .. } => 0.0,
            Coulomb { nm } => -nm * direction,
            Viscous { nm_s } => -nm_s * w,
            LowSpeed { nm, speed } => -nm * direction * (-w.abs() / speed).exp(),
            LoadFriction { share } => -share * asked.abs() * direction,
            Presliding { nm, travel } => -nm * (memory.bristle / travel - direction),
            Thermal { share, .. } => share * level * direction * memory.warm,
            PositionFriction { order, nm, phase } => -nm * direction * (order * angle + phase).cos(),
            HiddenFriction { nm, .. } => -nm * direction * memory.hidden[0].tanh(),
            RateHysteresis { nm, .. } => -nm * (2.0 * (memory.slow_speed - w)).tanh() * direction,
            WalkingOffset { nm } => nm * memory.walk,
            Hum { nm, .. } => nm * memory.phase.sin(),
            Bursts { nm, .. } => nm * memory.burst,
            TwoAngles { nm, order, other } => nm * (order * angle).sin() * (other * rolled).sin(),
            Sag { share, .. } => share * asked * (1.0 - memory.heat),
            _ => 0.0,
        }
    }

    /// Force at the axle and torque on the body.
    pub(crate) fn outside(
        &self,
        t: f64,
        state: &[f64; 6],
        radius: f64,
        weight_n: f64,
        memory: &Memory,
    ) -> (f64, f64) {
        use Fault::*;
        let [x, v, pitch, ..] = *state;
        match *self {
            Slope { rad } => (-weight_n * rad.sin(), 0.0),
            Tether { n_m, anchor } => (-n_m * (x - anchor), 0.0),
            Aero { n_s2 } => (-n_s2 * v * v.abs(), 0.0),
            Rolling { n } => (-n * (v / 0.005).tanh(), 0.0),
            Eccentric { n, phase } => (n * (x / radius + phase).cos(), 0.0),
            Terrain { n, length, phase } => (n * (TAU * x / length + phase).sin(), 0.0),
            Push { n, at, seconds } => (if t >= at && t < at + seconds { n } else { 0.0 }, 0.0),
            RoughShove { n, at } => (if (at..at + 0.6).contains(&t) { n * memory.shove } else { 0.0 }, 0.0),
            Weather { n } => (n * memory.gust, 0.0),
            TyreMemory { n, .. } => (-n * memory.tyre, 0.0),
            PitchTimesWay { nm } => (0.0, nm * x * pitch),
            BodyWander { nm } => (0.0, nm * memory.wander),
            Patch { n, at, width } => {
                let inside = (-((x - at) / width).powi(4)).exp();
                (-n * inside * (v / 0.01).tanh(), 0.0)
            }
            _ => (0.0, 0.0),
        }
    }
}
