//! Declared numbers, free within their tolerances.

use crate::effects::{Action, Form, KINDS, Moment};
use crate::model_file::Tolerances;
use crate::refine::select::Member;

use super::trace::{Pair, Trace};

/// A declared number.
pub(super) struct Nuisance {
    /// Key as in the model file; empty for what no file declares.
    pub(super) key: &'static str,
    pub(super) declared: f64,
    /// By how much it may be off.
    pub(super) tolerance: f64,
    pub(super) pair: Pair,
    pub(super) white: Vec<f64>,
}

impl Nuisance {
    /// Its part in a fit, as a column.
    pub(super) fn member(&self, column: usize) -> Member {
        if self.tolerance.is_finite() { Member::within(column, self.tolerance) } else { Member::free(column) }
    }
}

/// Angles that the IMU's mounting and the floor are off by without anybody calling it an effect, rad.
const MOUNTING_RAD: f64 = 5e-4;
/// Share of the friction that nobody knows next to rest, and the speed below which, rad/s.
const REST_SHARE: f64 = 0.3;
const REST_SPEED_RAD_S: f64 = 0.1;

/// All declared numbers of a robot; those named in `estimate` (or all of them) without a tolerance.
pub(super) fn nuisances(trace: &Trace, known: &Tolerances, estimate: &[String]) -> Vec<Nuisance> {
    let p = trace.machine.parameters;
    let friction = trace.robot.friction.map(|curve| curve.map(|curve| *curve.parameters()));
    let mut found = Vec::new();
    let mut add = |key: &'static str, declared: f64, tolerance: f64, pair: Pair| {
        let free = !key.is_empty() && estimate.iter().any(|name| name == key || name == "all");
        let tolerance = if free { f64::INFINITY } else { tolerance };
        if tolerance > 0.0 {
            found.push(Nuisance { key, declared, tolerance, pair, white: Vec::new() });
        }
    };
    let of_kind = |id: &str| {
        let kind = KINDS.iter().find(|kind| kind.id == id).expect("the library has the parameters' errors");
        trace.columns(kind, Form::Law, &[]).swap_remove(0)
    };
    add(
        "body_mass_kg",
        p.body_mass_kg,
        known.share_of("body_mass_kg") * p.body_mass_kg,
        of_kind("mass_error"),
    );
    add(
        "com_height_m",
        p.com_height_m,
        known.share_of("com_height_m") * p.com_height_m,
        of_kind("com_height_error"),
    );
    add(
        "body_inertia_kg_m2",
        p.body_inertia_kg_m2,
        known.share_of("body_inertia_kg_m2") * p.body_inertia_kg_m2,
        of_kind("body_inertia_error"),
    );
    add(
        "wheel_inertia_kg_m2",
        p.wheel_inertia_kg_m2,
        known.share_of("wheel_inertia_kg_m2") * p.wheel_inertia_kg_m2,
        of_kind("inertia_error"),
    );
    let wheels = trace.pair(|| |m: &Moment| Action::force(-2.0 * m.x_accel_m_s2, 0.0, 0.0));
    add("wheel_mass_kg", p.wheel_mass_kg, known.share_of("wheel_mass_kg") * p.wheel_mass_kg, wheels);
    let both = |of: fn(&crate::friction::StribeckParameters) -> f64| {
        friction.iter().flatten().map(|f| of(f) * of(f)).sum::<f64>().sqrt()
    };
    let curve = friction.iter().flatten().next().copied();
    let fading = move |m: &Moment| {
        curve.map_or(0.0, |f| {
            libm::exp(-libm::pow(m.motor_speed_rad_s.abs() / f.stribeck_speed_rad_s, f.stribeck_exponent))
        })
    };
    // Of both motors together, which turn alike: the left one's key stands for both.
    let declared = |of: fn(&crate::friction::StribeckParameters) -> f64| curve.map_or(0.0, |f| of(&f));
    let share =
        |key: &str, of: fn(&crate::friction::StribeckParameters) -> f64| known.share_of(key) * both(of);
    add(
        "coulomb_nm",
        declared(|f| f.coulomb_nm),
        share("coulomb_nm", |f| f.coulomb_nm),
        trace.pair(|| move |m: &Moment| Action::friction(1.0 - fading(m))),
    );
    add(
        "static_nm",
        declared(|f| f.static_nm),
        share("static_nm", |f| f.static_nm),
        trace.pair(|| move |m: &Moment| Action::friction(fading(m))),
    );
    add(
        "viscous_nm_s_rad",
        declared(|f| f.viscous_nm_s_rad),
        share("viscous_nm_s_rad", |f| f.viscous_nm_s_rad),
        trace.pair(|| |m: &Moment| Action::motor(-m.motor_speed_rad_s)),
    );
    add(
        "offset_nm",
        declared(|f| f.offset_nm),
        share("offset_nm", |f| f.offset_nm),
        trace.pair(|| |_: &Moment| Action::motor(-1.0)),
    );
    let rest = REST_SHARE * both(|f| f.static_nm);
    add(
        "",
        0.0,
        rest,
        trace
            .pair(|| |m: &Moment| Action::friction(libm::exp(-m.motor_speed_rad_s.abs() / REST_SPEED_RAD_S))),
    );
    add("", 0.0, MOUNTING_RAD, of_kind("pitch_offset"));
    add("", 0.0, MOUNTING_RAD, of_kind("ground_slope"));
    found
}
