//! Declared numbers that are estimated along, free or within their tolerances.

use crate::effects::{COULOMB_ERROR, EffectKind, FRICTION_ASYMMETRY, INERTIA_ERROR, VISCOUS_ERROR};
use crate::identify::motion::kinematics::direction;
use crate::identify::motion::place;
use crate::refine::error::RefineError;
use crate::refine::select::Member;

use super::rig::Declared;
use super::trace::{Rows, Trace};

/// Share of the Coulomb level that an offset may be off by, beside its own tolerance.
const OFFSET_OF_COULOMB: f64 = 0.01;
/// A curve that fades above this share of the fastest motion is as good as constant there.
const STRIBECK_OF_FASTEST: f64 = 0.5;
/// How far a free inertia may be from the declared one, as a share of it.
const FREE_INERTIA: [f64; 2] = [-0.99, 99.0];
/// A sampled torque may act anywhere between its own row and the next.
const TIMING_ROWS: f64 = 0.5;

/// The effect that says the same as a number.
type Said = Option<&'static EffectKind>;

/// A declared number that is estimated along.
pub(super) struct Nuisance {
    /// Key as in the model file; empty for the timing of the torque, which no model holds.
    pub(super) key: &'static str,
    pub(super) declared: f64,
    /// What an estimate adds to it; of the Stribeck speed and exponent the logarithm.
    pub(super) column: Vec<f64>,
    pub(super) tolerance: f64,
    pub(super) free: bool,
    /// The effect that says the same without a tolerance.
    pub(super) effect: Said,
    /// Whether it is the timing of the torque.
    pub(super) is_timing: bool,
}

impl Nuisance {
    /// Whether it is the inertia or mass.
    pub(super) fn is_inertia(&self) -> bool {
        self.says(&INERTIA_ERROR)
    }

    /// Whether it is of the friction, its offset among them.
    pub(super) fn is_friction(&self) -> bool {
        self.opposes_motion() || self.is_offset()
    }

    /// Whether it is friction that is never below 0.
    fn opposes_motion(&self) -> bool {
        self.says(&VISCOUS_ERROR) || self.says(&COULOMB_ERROR)
    }

    /// Whether it is the torque that is there either way.
    pub(super) fn is_offset(&self) -> bool {
        self.says(&FRICTION_ASYMMETRY)
    }

    /// Whether an effect says the same.
    pub(super) fn says(&self, kind: &EffectKind) -> bool {
        self.effect == Some(kind)
    }

    pub(super) fn member(&self, column: usize) -> Member {
        if !self.free {
            Member::within(column, self.tolerance)
        } else if self.is_inertia() {
            // An axis without inertia would take the torque for its own explanation.
            Member { bounds: FREE_INERTIA.map(|share| share * self.declared), ..Member::free(column) }
        } else if self.opposes_motion() {
            // Friction takes power, it never gives any.
            Member { bounds: [-self.declared, f64::INFINITY], ..Member::free(column) }
        } else {
            Member::free(column)
        }
    }

    /// The corrected number.
    pub(super) fn corrected(&self, change: f64) -> f64 {
        if self.is_logarithmic() { self.declared * change.exp() } else { self.declared + change }
    }

    pub(super) fn is_logarithmic(&self) -> bool {
        self.key.starts_with("stribeck")
    }
}

/// Everything that is estimated along.
///
/// # Errors
/// A name in `estimate` that is none.
pub(super) fn nuisances(
    declared: &Declared,
    rows: &Rows,
    estimate: &[String],
) -> Result<Vec<Nuisance>, RefineError> {
    let free = free_numbers(declared, rows, estimate)?;
    let mut along = Along { declared, rows, free, found: Vec::new() };
    along.add_inertia();
    along.add_viscous();
    along.add_coulomb();
    along.add_stribeck();
    along.add_offset();
    along.add_gravity();
    let mut found = along.found;
    found.extend(missing_stribeck(declared, rows));
    found.push(timing(rows));
    Ok(found)
}

/// Which numbers of an axis the log alone tells.
fn free_numbers(
    declared: &Declared,
    rows: &Rows,
    estimate: &[String],
) -> Result<[bool; place::ALL], RefineError> {
    let keys = declared.axis().keys();
    if let Some(name) = estimate.iter().find(|name| *name != "all" && !keys.contains(&name.as_str())) {
        let allowed = keys.iter().filter(|key| !key.is_empty()).copied().collect::<Vec<_>>().join(", ");
        return Err(RefineError::UnknownParameter { name: name.clone(), allowed });
    }
    let all = estimate.iter().any(|name| name == "all");
    let asked =
        |index: usize| (all && index <= place::OFFSET) || estimate.iter().any(|name| name == keys[index]);
    // One way, both are the same constant: the offset stays as it is declared.
    let told_apart = rows.both_ways() || !asked(place::COULOMB);
    Ok(std::array::from_fn(|index| asked(index) && (index != place::OFFSET || told_apart)))
}

/// The declared numbers so far.
struct Along<'a> {
    declared: &'a Declared,
    rows: &'a Rows,
    free: [bool; place::ALL],
    found: Vec<Nuisance>,
}

impl Along<'_> {
    /// A number, unless it is neither free nor uncertain.
    fn add(&mut self, index: usize, declared: f64, tolerance: f64, effect: Said, column: Vec<f64>) {
        let free = self.free[index];
        if free || tolerance > 0.0 {
            let key = self.declared.axis().keys()[index];
            self.found.push(Nuisance { key, declared, column, tolerance, free, effect, is_timing: false });
        }
    }

    fn share(&self, index: usize) -> f64 {
        self.declared.tolerances.share_of(self.declared.axis().keys()[index])
    }

    /// A number that is off by a share of itself.
    fn add_share(&mut self, index: usize, declared: f64, effect: Said, column: Vec<f64>) {
        self.add(index, declared, self.share(index) * declared, effect, column);
    }

    fn add_inertia(&mut self) {
        let column = self.rows.column(Trace::second_difference);
        self.add_share(place::INERTIA, self.declared.inertia, Some(&INERTIA_ERROR), column);
    }

    fn add_viscous(&mut self) {
        let column = self.rows.column(|trace| trace.speed.clone());
        self.add_share(place::VISCOUS, self.declared.curve().viscous_nm_s_rad, Some(&VISCOUS_ERROR), column);
    }

    fn add_coulomb(&mut self) {
        let column = against_motion(self.rows, |speed| 1.0 - self.fade(speed));
        self.add_share(place::COULOMB, self.declared.curve().coulomb_nm, Some(&COULOMB_ERROR), column);
    }

    /// How much of the static level is left at a speed; nothing of a curve without one.
    fn fade(&self, speed: f64) -> f64 {
        let curve = self.declared.curve();
        if self.declared.has_stribeck() {
            fading(speed, curve.stribeck_speed_rad_s, curve.stribeck_exponent)
        } else {
            0.0
        }
    }

    /// The static level, and the speed and exponent with which it fades.
    fn add_stribeck(&mut self) {
        if !self.declared.has_stribeck() {
            return;
        }
        let curve = self.declared.curve();
        let level = against_motion(self.rows, |speed| self.fade(speed));
        self.add_share(place::STATIC, curve.static_nm, None, level);
        let drop = curve.static_nm - curve.coulomb_nm;
        const STEP: f64 = 1e-3;
        let slope = |rows: &Rows, step_scale: f64, step_exponent: f64| {
            let at = |side: f64| {
                let scale = curve.stribeck_speed_rad_s * (side * step_scale).exp();
                let exponent = curve.stribeck_exponent * (side * step_exponent).exp();
                move |speed: f64| fading(speed, scale, exponent)
            };
            let (up, down) = (at(1.0), at(-1.0));
            against_motion(rows, |speed| drop * (up(speed) - down(speed)) / (2.0 * STEP))
        };
        for (index, declared, column) in [
            (place::STRIBECK_SPEED, curve.stribeck_speed_rad_s, slope(self.rows, STEP, 0.0)),
            (place::STRIBECK_EXPONENT, curve.stribeck_exponent, slope(self.rows, 0.0, STEP)),
        ] {
            self.add(index, declared, self.share(index), None, column);
        }
    }

    fn add_offset(&mut self) {
        let curve = self.declared.curve();
        let tolerance =
            self.share(place::OFFSET) * curve.offset_nm.abs() + OFFSET_OF_COULOMB * curve.coulomb_nm;
        let column = self.rows.column(|trace| vec![1.0; trace.position.len()]);
        self.add(place::OFFSET, curve.offset_nm, tolerance, Some(&FRICTION_ASYMMETRY), column);
    }

    fn add_gravity(&mut self) {
        let (gravity, share) = (self.declared.gravity, self.share(place::GRAVITY));
        let sines = |trace: &Trace| trace.position.iter().map(|&angle| libm::sin(angle)).collect();
        if !self.declared.is_linear() {
            self.add(place::GRAVITY, gravity, share * gravity.abs(), None, self.rows.column(sines));
        }
    }
}

/// A curve without a Stribeck part may lack a little of one, at speeds that the log has.
fn missing_stribeck(declared: &Declared, rows: &Rows) -> Option<Nuisance> {
    let curve = declared.curve();
    let level = declared.tolerances.share_of(declared.axis().keys()[place::STATIC]) * curve.coulomb_nm;
    let fastest = rows.counted(|trace, sample| trace.speed[sample].abs()).into_iter().fold(0.0, f64::max);
    let scale = curve.stribeck_speed_rad_s;
    if declared.has_stribeck() || level <= 0.0 || scale >= STRIBECK_OF_FASTEST * fastest {
        return None;
    }
    Some(Nuisance {
        key: "",
        declared: 0.0,
        column: against_motion(rows, |speed| fading(speed, scale, curve.stribeck_exponent)),
        tolerance: level,
        free: false,
        effect: None,
        is_timing: false,
    })
}

/// When a sampled torque acts.
fn timing(rows: &Rows) -> Nuisance {
    Nuisance {
        key: "",
        declared: 0.0,
        column: rows.column(torque_rate),
        tolerance: TIMING_ROWS * rows.kernel.step_s,
        free: false,
        effect: None,
        is_timing: true,
    }
}

/// A level of friction against the motion, by the speed.
fn against_motion(rows: &Rows, level: impl Fn(f64) -> f64) -> Vec<f64> {
    rows.column(|trace| trace.speed.iter().map(|&speed| direction(speed) * level(speed)).collect())
}

/// Share of the static level that is left at a speed.
fn fading(speed: f64, scale: f64, exponent: f64) -> f64 {
    libm::exp(-libm::pow(speed.abs() / scale, exponent))
}

/// Change of the torque over that interval, N m/s: what a shift in time adds, without a share of the torque's noise.
fn torque_rate(trace: &Trace) -> Vec<f64> {
    let before = |sample: usize| trace.effort[sample.saturating_sub(1)];
    (0..trace.effort.len()).map(|sample| (trace.effort[sample] - before(sample)) / trace.step_s).collect()
}
