//! Declared numbers, free within their tolerances.

use crate::effects::{Action, EffectKind, Form, KINDS, MotionSample as Moment};
use crate::friction::StribeckParameters;
use crate::model::{ModelParameter, Tolerances};
use crate::refine::select::Member;

use super::trace::{Pair, Trace};

/// How well the declared numbers are known: their tolerances, and those that are free.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) tolerances: &'a Tolerances,
    pub(super) estimate: &'a [String],
}

impl Known<'_> {
    fn share_of(&self, key: &str) -> f64 {
        self.tolerances.share_of(key)
    }
}

/// A declared number.
pub(super) struct Nuisance {
    /// Key as in the model file; empty for what no file declares.
    pub(super) key: &'static str,
    pub(super) declared: f64,
    /// Effects that stand for the same without a tolerance: beside one of them the number stays as declared.
    effects: &'static [&'static str],
    /// Share of a coefficient that the declared number changes by: a column of friction stands for the sum of all motors,
    /// the number for one of them.
    pub(super) per_motor: f64,
    /// Standard deviation of half the difference between the motors' numbers, which their sum does not show.
    pub(super) between_motors: f64,
    /// By how much a coefficient may be off.
    pub(super) tolerance: f64,
    pub(super) pair: Pair,
    pub(super) white: Vec<f64>,
}

impl Nuisance {
    /// The declared number with what a coefficient says.
    pub(super) fn corrected(&self, coefficient: f64) -> f64 {
        self.declared + self.per_motor * coefficient
    }

    /// Its part in a fit beside effects of some kinds, as a column.
    pub(super) fn member(&self, column: usize, beside: impl Iterator<Item = &'static EffectKind>) -> Member {
        if { beside }.any(|kind| self.effects.contains(&kind.id)) {
            Member { bounds: [0.0; 2], spread: 1e-12, ..Member::free(column) }
        } else if self.tolerance.is_finite() {
            Member::within(column, self.tolerance)
        } else {
            Member::free(column)
        }
    }
}

/// Angles that the IMU's mounting and the floor are off by without anybody calling it an effect, rad.
const MOUNTING_RAD: f64 = 5e-4;
/// Rows by which a sampled torque may act earlier or later than the model says without anybody calling it an effect.
const TIMING_ROWS: f64 = 1.0;
/// Numbers that each motor has.
const FRICTION: [&str; 4] = ["coulomb_nm", "static_nm", "viscous_nm_s_rad", "offset_nm"];
/// Share of the friction that nobody knows next to rest, and the speed below which, rad/s.
const REST_SHARE: f64 = 0.3;
const REST_SPEED_RAD_S: f64 = 0.1;

/// A number of a friction curve.
type OfCurve = fn(&StribeckParameters) -> f64;

/// All declared numbers of a robot; those that are free (or all of them) without a tolerance.
pub(super) fn nuisances(trace: &Trace, known: Known<'_>) -> Vec<Nuisance> {
    let p = trace.machine.parameters;
    let friction = trace.robot.friction.map(|curve| curve.map(|curve| *curve.parameters()));
    let motors = friction.iter().flatten().count();
    let per_motor = |key: &str| if FRICTION.contains(&key) && motors > 1 { 1.0 / motors as f64 } else { 1.0 };
    let mut found = Vec::new();
    let between = |key: &str, of: OfCurve| {
        let each = friction.iter().flatten().map(|f| (known.share_of(key) * of(f)).powi(2) / 3.0);
        if motors > 1 { 0.5 * each.sum::<f64>().sqrt() } else { 0.0 }
    };
    let mut add = |key: &'static str,
                   declared: f64,
                   [tolerance, between_motors]: [f64; 2],
                   effects: &'static [&'static str],
                   pair: Pair| {
        let free = !key.is_empty() && known.estimate.iter().any(|name| name == key || name == "all");
        let tolerance = if free { f64::INFINITY } else { tolerance };
        // A column of nothing has nothing to say of its number.
        if tolerance > 0.0 && pair.iter().flatten().any(|value| *value != 0.0) {
            let per_motor = per_motor(key);
            let between_motors = if free { 0.0 } else { between_motors };
            found.push(Nuisance {
                key,
                declared,
                effects,
                per_motor,
                between_motors,
                tolerance,
                pair,
                white: Vec::new(),
            });
        }
    };
    let of_kind = |id: &str| {
        let kind = KINDS.iter().find(|kind| kind.id == id).expect("the library has the parameters' errors");
        trace.columns(kind, Form::Law, &[]).swap_remove(0)
    };
    let mut declared = p;
    for (row, place) in ModelParameter::of_robot() {
        let Some(effect) = &row.effect else { continue };
        let value = *place(&mut declared);
        let tolerance = known.share_of(row.key) * value;
        add(row.key, value, [tolerance, 0.0], std::slice::from_ref(effect), of_kind(effect));
    }
    let wheels = trace.pair(|| |m: &Moment| Action::force(-2.0 * m.x_accel_m_s2, 0.0, 0.0));
    let tolerance = known.share_of("wheel_mass_kg") * p.wheel_mass_kg;
    add("wheel_mass_kg", p.wheel_mass_kg, [tolerance, 0.0], &[], wheels);
    let both = |of: OfCurve| friction.iter().flatten().map(|f| of(f) * of(f)).sum::<f64>().sqrt();
    let curve = friction.iter().flatten().next().copied();
    let fading = move |m: &Moment| {
        curve.map_or(0.0, |f| {
            libm::exp(-libm::pow(m.motor_speed_rad_s.abs() / f.stribeck_speed_rad_s, f.stribeck_exponent))
        })
    };
    // Of both motors together, which turn alike: the left one's key stands for both.
    let of_curve: [(&'static str, OfCurve, Pair); 4] = [
        ("coulomb_nm", |f| f.coulomb_nm, trace.pair(|| move |m: &Moment| Action::friction(1.0 - fading(m)))),
        ("static_nm", |f| f.static_nm, trace.pair(|| move |m: &Moment| Action::friction(fading(m)))),
        (
            "viscous_nm_s_rad",
            |f| f.viscous_nm_s_rad,
            trace.pair(|| |m: &Moment| Action::motor(-m.motor_speed_rad_s)),
        ),
        ("offset_nm", |f| f.offset_nm, trace.pair(|| |_: &Moment| Action::motor(-1.0))),
    ];
    for (key, of, pair) in of_curve {
        let declared = curve.map_or(0.0, |f| of(&f));
        add(key, declared, [known.share_of(key) * both(of), between(key, of)], &[], pair);
    }
    let rest = REST_SHARE * both(|f| f.static_nm);
    let fades = |m: &Moment| Action::friction(libm::exp(-m.motor_speed_rad_s.abs() / REST_SPEED_RAD_S));
    add("", 0.0, [rest, 0.0], &[], trace.pair(|| fades));
    for effect in [&["pitch_offset"], &["ground_slope"]] {
        add("", 0.0, [MOUNTING_RAD, 0.0], effect, of_kind(effect[0]));
    }
    let late: &[&str] = &["command_delay", "actuator_lag"];
    add("", 0.0, [TIMING_ROWS * trace.row_s(), 0.0], late, timing(trace));
    found
}

/// What a torque that acts a second later changes.
fn timing(trace: &Trace) -> Pair {
    trace.pair(|| {
        let mut before = None;
        move |m: &Moment| {
            let last = before.replace(m.torque_sum_nm).unwrap_or(m.torque_sum_nm);
            Action::motor((last - m.torque_sum_nm) / m.dt_s)
        }
    })
}
