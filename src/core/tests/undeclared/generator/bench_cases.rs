//! The cases of a motor on a bench, frozen by their seeds.

use std::f64::consts::TAU;

use super::bench_run::run;
use super::body::{Curve, MOTORS};
use super::random::Random;
use super::robot_run::Recording;

/// One undeclared effect of a motor.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Flaw {
    Cogging { order: f64, nm: f64, phase: f64 },
    Ripple { order: f64, share: f64, phase: f64 },
    QuadraticDrag { nm_s2: f64 },
    ViscousAsymmetry { nm_s: f64 },
    FrictionAsymmetry { nm: f64 },
    Coulomb { nm: f64 },
    Viscous { nm_s: f64 },
    LowSpeed { nm: f64, speed: f64 },
    LoadFriction { share: f64 },
    Presliding { nm: f64, travel: f64 },
    Thermal { nm: f64, seconds: f64 },
    PositionFriction { order: f64, nm: f64, phase: f64 },
    Backlash { gap: f64, rotor: f64 },
    Delay { seconds: f64 },
    Lag { seconds: f64 },
    Gain { share: f64 },
    Inertia { share: f64 },
    Saturation { nm: f64 },
    Deadzone { nm: f64 },
    // Outside of every library: nothing logged shows what they depend on, or no effect has their form.
    HiddenFriction { nm: f64, hz: f64 },
    Walk { nm: f64, seconds: f64 },
    RateHysteresis { nm: f64, seconds: f64 },
    Hum { nm: f64, hz: f64 },
    Disc { share: f64, hz: f64 },
    Spring { nm_rad: f64, centre: f64 },
}

/// What turns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shaft {
    pub(crate) inertia: f64,
    pub(crate) curve: Curve,
}

const SHAFTS: [Shaft; 4] = [
    Shaft { inertia: 0.005, curve: MOTORS[0] },
    Shaft { inertia: 0.005, curve: MOTORS[1] },
    Shaft {
        inertia: 0.0038,
        curve: Curve { coulomb: 0.025, standing: 0.045, knee: 0.9, shape: 0.8, ..MOTORS[0] },
    },
    Shaft { inertia: 0.0065, curve: Curve { coulomb: 0.05, standing: 0.05, viscous: 0.001, ..MOTORS[1] } },
];

/// One log of a motor to assess.
pub(crate) struct BenchCase {
    pub(crate) name: String,
    pub(crate) seed: u64,
    pub(crate) declared: Shaft,
    pub(crate) shaft: Shaft,
    pub(crate) flaws: Vec<Flaw>,
}

/// Kinds of single effects.
pub(crate) const SINGLES: usize = 20;
/// Kinds of effects that no library has.
pub(crate) const OUTSIDE: usize = 7;
/// Pairs of kinds.
pub(crate) const PAIRS: [[usize; 2]; 12] =
    [[0, 5], [0, 6], [2, 4], [13, 0], [10, 0], [3, 11], [5, 14], [1, 6], [18, 0], [16, 4], [7, 2], [17, 3]];

impl Flaw {
    /// The id under which it ought to be named; none outside the library.
    pub(crate) fn id(&self) -> Option<&'static str> {
        Some(match self {
            Self::Cogging { order, .. } if order.fract() == 0.0 => "cogging",
            Self::Ripple { .. } => "torque_ripple",
            Self::QuadraticDrag { .. } => "quadratic_drag",
            Self::ViscousAsymmetry { .. } => "viscous_asymmetry",
            Self::FrictionAsymmetry { .. } => "friction_asymmetry",
            Self::Coulomb { .. } => "coulomb_error",
            Self::Viscous { .. } => "viscous_error",
            Self::LowSpeed { .. } => "low_speed_friction",
            Self::LoadFriction { .. } => "load_dependent_friction",
            Self::Presliding { .. } => "presliding",
            Self::Thermal { .. } => "thermal_friction",
            Self::PositionFriction { .. } => "position_dependent_friction",
            Self::Backlash { .. } => "backlash",
            Self::Delay { .. } => "command_delay",
            Self::Lag { .. } => "actuator_lag",
            Self::Gain { .. } => "torque_gain",
            Self::Inertia { .. } => "inertia_error",
            Self::Saturation { .. } => "torque_saturation",
            Self::Deadzone { .. } => "torque_deadzone",
            _ => return None,
        })
    }

    /// A parameter of the named effect and its true value, where it has one that stands for its size.
    pub(crate) fn truth(&self, shaft: &Shaft) -> Option<(&'static str, f64)> {
        Some(match *self {
            Self::QuadraticDrag { nm_s2 } => ("drag_nm_s2_rad2", nm_s2),
            Self::ViscousAsymmetry { nm_s } => ("viscous_nm_s_rad", nm_s),
            Self::FrictionAsymmetry { nm } | Self::Coulomb { nm } => ("coulomb_nm", nm),
            Self::Viscous { nm_s } => ("viscous_nm_s_rad", nm_s),
            Self::LowSpeed { nm, .. } => ("amplitude_nm", nm),
            Self::LoadFriction { share } => ("coefficient", share),
            Self::Thermal { nm, .. } => ("fall_nm", nm),
            Self::Presliding { nm, .. } => ("amplitude_nm", nm),
            Self::Delay { seconds } => ("delay_s", seconds),
            Self::Lag { seconds } => ("time_constant_s", seconds),
            Self::Gain { share } => ("gain", share),
            Self::Inertia { share } => ("inertia_kg_m2", share * shaft.inertia),
            Self::Saturation { nm } => ("limit_nm", nm),
            Self::Deadzone { nm } => ("width_nm", nm),
            _ => return None,
        })
    }

    fn scaled(mut self, share: f64) -> Self {
        match &mut self {
            Self::Cogging { nm: size, .. }
            | Self::Ripple { share: size, .. }
            | Self::QuadraticDrag { nm_s2: size }
            | Self::ViscousAsymmetry { nm_s: size }
            | Self::FrictionAsymmetry { nm: size }
            | Self::Coulomb { nm: size }
            | Self::Viscous { nm_s: size }
            | Self::LowSpeed { nm: size, .. }
            | Self::LoadFriction { share: size }
            | Self::Presliding { nm: size, .. }
            | Self::Thermal { nm: size, .. }
            | Self::PositionFriction { nm: size, .. }
            | Self::Backlash { gap: size, .. }
            | Self::Delay { seconds: size }
            | Self::Lag { seconds: size }
            | Self::Gain { share: size }
            | Self::Inertia { share: size }
            | Self::Deadzone { nm: size }
            | Self::HiddenFriction { nm: size, .. }
            | Self::Walk { nm: size, .. }
            | Self::RateHysteresis { nm: size, .. }
            | Self::Hum { nm: size, .. }
            | Self::Disc { share: size, .. }
            | Self::Spring { nm_rad: size, .. } => *size *= share,
            // A higher limit clips less.
            Self::Saturation { nm } => *nm *= 1.0 + 0.35 * (1.0 - share),
        }
        self
    }
}

/// The effects number `kind`, drawn anew for each seed.
fn single(kind: usize, shaft: &Shaft, random: &mut Random) -> Vec<Flaw> {
    use Flaw::*;
    let level = shaft.curve.coulomb;
    let mut size = |low: f64, high: f64| random.between(low, high);
    let phase = size(0.0, TAU);
    let one = match kind {
        0 => Cogging { order: size(5.0, 30.0).round(), nm: size(0.006, 0.015), phase },
        1 => Ripple { order: size(4.0, 24.0).round(), share: size(0.1, 0.25), phase },
        2 => QuadraticDrag { nm_s2: size(4e-4, 1e-3) },
        3 => ViscousAsymmetry { nm_s: random.sign() * random.between(0.002, 0.005) },
        4 => FrictionAsymmetry { nm: random.sign() * random.between(0.008, 0.02) },
        5 => Coulomb { nm: level * size(0.6, 1.2) },
        6 => Viscous { nm_s: size(0.002, 0.006) },
        7 => LowSpeed { nm: size(0.02, 0.04), speed: size(0.3, 1.0) },
        8 => LoadFriction { share: size(0.15, 0.4) },
        9 => Presliding { nm: size(0.7, 1.0) * level, travel: size(0.03, 0.12) },
        10 => Thermal { nm: level * size(0.4, 0.7), seconds: size(5.0, 15.0) },
        11 => PositionFriction { order: size(1.0, 5.0).round(), nm: level * size(0.25, 0.5), phase },
        12 => Backlash { gap: size(0.02, 0.06), rotor: size(0.05, 0.2) },
        13 => Delay { seconds: size(0.004, 0.01) },
        14 => Lag { seconds: size(0.005, 0.012) },
        15 => Gain { share: random.sign() * random.between(0.25, 0.4) },
        16 => Inertia { share: size(0.3, 0.6) },
        17 => Saturation { nm: level * size(1.6, 2.2) },
        18 => Deadzone { nm: size(0.01, 0.025) },
        _ => {
            // Two or three orders.
            let first = size(3.0, 9.0).round();
            let orders = [first, 2.0 * first, 3.0 * first + 1.0];
            let many = 2 + usize::from(size(0.0, 1.0) > 0.5);
            return (0..many)
                .map(|n| Cogging {
                    order: orders[n],
                    nm: size(0.005, 0.009) / (1.0 + n as f64 * 0.4),
                    phase: size(0.0, TAU),
                })
                .collect();
        }
    };
    vec![one]
}

fn outside(kind: usize, shaft: &Shaft, random: &mut Random) -> Flaw {
    use Flaw::*;
    let level = shaft.curve.coulomb;
    match kind {
        0 => HiddenFriction { nm: level * random.between(0.3, 0.6), hz: random.between(0.4, 3.0) },
        1 => Walk { nm: random.between(0.008, 0.02), seconds: random.between(0.3, 2.0) },
        2 => RateHysteresis { nm: level * random.between(0.4, 0.7), seconds: random.between(0.1, 0.4) },
        3 => Hum { nm: random.between(0.006, 0.02), hz: random.between(3.0, 30.0) },
        4 => Disc { share: random.between(0.3, 0.6), hz: random.between(6.0, 18.0) },
        5 => Spring { nm_rad: random.between(0.003, 0.008), centre: random.between(-1.0, 4.0) },
        _ => Cogging {
            order: random.between(5.0, 15.0).floor() + random.between(0.3, 0.7),
            nm: random.between(0.008, 0.02),
            phase: random.between(0.0, TAU),
        },
    }
}

fn start(seed: u64, tolerance: f64) -> (Random, Shaft, Shaft) {
    let mut random = Random::new(seed.wrapping_mul(6_151).wrapping_add(29));
    let declared = SHAFTS[(seed % 4) as usize];
    let mut shaft = declared;
    let mut off = |value: &mut f64, share: f64| *value *= 1.0 + random.between(-share, share);
    off(&mut shaft.inertia, tolerance);
    off(&mut shaft.curve.coulomb, 5.0 * tolerance);
    off(&mut shaft.curve.standing, 5.0 * tolerance);
    off(&mut shaft.curve.viscous, 5.0 * tolerance);
    shaft.curve.standing = shaft.curve.standing.max(shaft.curve.coulomb);
    (random, declared, shaft)
}

impl BenchCase {
    /// A motor as declared, within `tolerance`.
    pub(crate) fn clean(seed: u64, tolerance: f64) -> Self {
        let (_, declared, shaft) = start(seed, tolerance);
        Self { name: "bench clean".into(), seed, declared, shaft, flaws: Vec::new() }
    }

    /// Effects of some kinds at a `share` of their realistic sizes.
    pub(crate) fn with(kinds: &[usize], share: f64, seed: u64) -> Self {
        let (mut random, declared, shaft) = start(seed, 0.0);
        let flaws: Vec<Flaw> = kinds
            .iter()
            .flat_map(|&kind| single(kind, &declared, &mut random))
            .map(|f| f.scaled(share))
            .collect();
        let mut case = Self { name: String::new(), seed, declared, shaft, flaws };
        case.name = case.ids().join("+");
        case
    }

    /// An effect that no library has.
    pub(crate) fn unknown(kind: usize, seed: u64) -> Self {
        let (mut random, declared, shaft) = start(seed, 0.0);
        let flaws = vec![outside(kind, &declared, &mut random)];
        Self { name: "bench outside".into(), seed, declared, shaft, flaws }
    }

    /// Names of what it has, each once.
    pub(crate) fn ids(&self) -> Vec<&'static str> {
        let mut ids: Vec<&'static str> = self.flaws.iter().filter_map(Flaw::id).collect();
        ids.dedup();
        ids
    }

    /// A log, of another excitation and other noise for the held-out one.
    /// `noise` is a factor on the noise of the sensors and on the torque that nobody measures.
    pub(crate) fn record(&self, held_out: bool, seconds: f64, noise: f64) -> Recording {
        run(self, seconds, noise, 1 + 2 * self.seed + u64::from(held_out))
    }

    /// The model file of this motor.
    pub(crate) fn model_file(&self) -> String {
        let Shaft { inertia, curve } = self.declared;
        format!(
            "name = \"bench\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = {inertia}\n[friction]\ncoulomb_nm = {}\nstatic_nm = {}\nviscous_nm_s_rad = {}\nstribeck_speed_rad_s = {}\nstribeck_exponent = {}\noffset_nm = {}\n",
            curve.coulomb, curve.standing, curve.viscous, curve.knee, curve.shape, curve.offset
        )
    }
}
