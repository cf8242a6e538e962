//! The cases, frozen by their seeds.

use std::f64::consts::TAU;

use super::body::{BODIES, Body};
use super::fault::Fault;
use super::random::Random;

/// One log to assess.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) seed: u64,
    pub(crate) declared: Body,
    pub(crate) body: Body,
    pub(crate) faults: Vec<Fault>,
}

/// Kinds of single effects of a robot, at realistic size.
pub(crate) const SINGLES: usize = 35;

/// The effect number `kind`, drawn anew for each seed; `whole` is the robot that it is on.
pub(crate) fn single(kind: usize, whole: &Body, random: &mut Random) -> Fault {
    use Fault::*;
    let mut size = |low: f64, high: f64| random.between(low, high);
    let phase = size(0.0, TAU);
    let weight = (whole.mass + 2.0 * whole.wheel) * whole.gravity;
    match kind {
        0 => Cogging { order: size(7.0, 24.0).round(), nm: size(0.01, 0.03), phase },
        1 => TorqueRipple { order: size(6.0, 20.0).round(), share: size(0.06, 0.15), phase },
        2 => QuadraticDrag { nm_s2: size(4e-4, 1e-3) },
        3 => ViscousAsymmetry { nm_s: size(0.004, 0.01) },
        4 => FrictionAsymmetry { nm: size(0.02, 0.05) },
        5 => Coulomb { nm: size(0.02, 0.05) },
        6 => Viscous { nm_s: size(0.004, 0.01) },
        7 => LowSpeed { nm: size(0.04, 0.08), speed: size(0.4, 1.2) },
        8 => LoadFriction { share: size(0.06, 0.15) },
        9 => Presliding { nm: whole.motors[0].coulomb, travel: size(0.1, 0.3) },
        10 => Thermal { share: size(0.4, 0.7), seconds: size(5.0, 15.0) },
        11 => PositionFriction { order: size(1.0, 4.0).round(), nm: size(0.015, 0.03), phase },
        12 => Backlash { gap: size(0.004, 0.01) },
        13 => Delay { seconds: size(0.003, 0.008) },
        14 => Lag { seconds: size(0.004, 0.012) },
        15 => Gain { share: random.sign() * random.between(0.06, 0.15) },
        16 => Saturation { nm: size(0.8, 1.0) * whole.mass * whole.radius },
        17 => Deadzone { nm: size(0.03, 0.08) },
        18 => PitchOffset { rad: random.sign() * random.between(0.01, 0.03) },
        19 => Slope { rad: random.sign() * random.between(0.02, 0.05) },
        20 => Tether { n_m: size(8.0, 20.0), anchor: size(-0.1, 0.1) },
        21 => Mass { kg: whole.mass * random.sign() * random.between(0.08, 0.15) },
        22 => Height { m: whole.height * random.sign() * random.between(0.08, 0.15) },
        23 => Inertia { kg_m2: whole.inertia * random.sign() * random.between(0.2, 0.4) },
        24 => Aero { n_s2: size(2.0, 5.0) },
        25 => Rolling { n: weight * random.between(0.01, 0.025) },
        26 => Eccentric { n: weight * size(0.01, 0.025), phase },
        27 => Mode { share: size(0.2, 0.4), hz: size(4.0, 9.0), damping: size(0.02, 0.06) },
        28 => Slosh { kg: whole.mass * size(0.05, 0.1), hz: size(0.8, 2.0), damping: size(0.02, 0.08) },
        29 => GyroBias { rad_s: random.sign() * random.between(0.01, 0.03) },
        30 => ImuDelay { seconds: size(0.005, 0.015) },
        31 => Terrain { n: weight * size(0.01, 0.03), length: size(0.25, 0.5), phase },
        32 => Slip { m_s_n: size(1.5e-3, 4e-3), seconds: size(0.01, 0.03) },
        33 => WheelInertia { kg_m2: whole.wheel_inertia * random.sign() * random.between(0.4, 0.8) },
        _ => Push {
            n: random.sign() * random.between(8.0, 20.0),
            at: random.between(5.0, 20.0),
            seconds: random.between(0.1, 0.4),
        },
    }
}

/// Effects that no library has.
pub(crate) fn outside(kind: usize, random: &mut Random) -> Fault {
    use Fault::*;
    match kind {
        0 => HiddenFriction { nm: random.between(0.05, 0.1), hz: random.between(1.0, 3.0), damping: 0.1 },
        1 => WalkingOffset { nm: random.between(0.03, 0.06) },
        2 => RoughShove { n: random.between(15.0, 30.0), at: random.between(6.0, 20.0) },
        3 => RateHysteresis { nm: random.between(0.04, 0.08), seconds: random.between(0.1, 0.3) },
        4 => Weather { n: random.between(2.0, 4.0) },
        5 => TyreMemory { n: random.between(2.0, 4.0), seconds: random.between(0.3, 0.8) },
        6 => PitchTimesWay { nm: random.sign() * random.between(10.0, 20.0) },
        7 => BodyWander { nm: random.between(0.3, 0.6) },
        8 => Hum { nm: random.between(0.03, 0.06), hz: random.between(3.0, 9.0) },
        9 => Bursts { nm: random.between(0.3, 0.6), every: random.between(1.5, 4.0) },
        10 => TwoAngles {
            nm: random.between(0.04, 0.08),
            order: random.between(4.0, 6.0).round(),
            other: random.between(2.2, 2.8),
        },
        11 => Sag { share: random.between(0.2, 0.4), seconds: random.between(0.5, 2.0) },
        _ => Patch {
            n: random.between(3.0, 6.0),
            at: random.between(-0.3, 0.3),
            width: random.between(0.08, 0.2),
        },
    }
}
/// Kinds of [`outside`].
pub(crate) const OUTSIDE: usize = 13;

/// A robot and its declaration, off by up to a fraction of its tolerances.
fn start(seed: u64, share: f64) -> (Random, Body, Body) {
    let mut random = Random::new(seed.wrapping_mul(7919).wrapping_add(17));
    let declared = BODIES[(seed % 4) as usize];
    let body = declared.jittered(share, &mut random);
    (random, declared, body)
}

fn case(name: String, seed: u64, declared: Body, body: Body, faults: Vec<Fault>) -> Case {
    Case { name, seed, declared, body, faults }
}

/// A robot as declared, within a fraction of its tolerances.
pub(crate) fn clean(seed: u64, share: f64) -> Case {
    let (_, declared, body) = start(seed, share);
    case("clean".into(), seed, declared, body, Vec::new())
}

/// One effect of a kind at a `share` of its realistic size.
pub(crate) fn one(kind: usize, share: f64, seed: u64) -> Case {
    let (mut random, declared, body) = start(seed, 0.0);
    let fault = single(kind, &declared, &mut random).scaled(share);
    case(fault.id().unwrap_or("outside").into(), seed, declared, body, vec![fault])
}

/// Two effects.
pub(crate) fn two(kinds: [usize; 2], seed: u64) -> Case {
    let (mut random, declared, body) = start(seed, 0.0);
    let faults: Vec<Fault> = kinds.iter().map(|&kind| single(kind, &declared, &mut random)).collect();
    let name = faults.iter().filter_map(Fault::id).collect::<Vec<_>>().join("+");
    case(name, seed, declared, body, faults)
}

/// An effect that no library has.
pub(crate) fn unknown(kind: usize, seed: u64) -> Case {
    let (mut random, declared, body) = start(seed, 0.0);
    case("outside".into(), seed, declared, body, vec![outside(kind, &mut random)])
}

/// Pairs that do not sit in the same place.
pub(crate) const PAIRS: [[usize; 2]; 12] = [
    [0, 20],
    [5, 19],
    [14, 21],
    [4, 25],
    [6, 18],
    [20, 22],
    [0, 13],
    [15, 19],
    [2, 28],
    [8, 20],
    [16, 5],
    [26, 23],
];
