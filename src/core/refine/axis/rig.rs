//! What a model declares of one axis.

use crate::effects::{Machine, Role};
use crate::friction::{Stribeck, StribeckParameters};
use crate::identify::motion::{Axis, kinematics::direction, place};
use crate::model::{AxisParameters, Effect, MachineKind, Model, Motor, Rig, Tolerances};
use crate::refine::{
    Variable,
    select::{Blocks, Member},
};

use super::nuisance::Nuisance;
use super::trace::{Acting, Names, Part, Rows, Trace};

/// Largest share of the acceleration's power that is taken for noise.
const MOST_NOISE: f64 = 0.5;

/// The declared axis.
#[derive(Clone, Debug)]
pub(super) struct Declared {
    pub(super) machine: Machine,
    pub(super) inertia: f64,
    /// As in the model file.
    declared_inertia: f64,
    pub(super) gravity: f64,
    /// From a logged effort to the one that acts, s.
    pub(super) delay_s: f64,
    pub(super) friction: Option<StribeckParameters>,
    pub(super) effects: Vec<Effect>,
    pub(super) tolerances: Tolerances,
    /// Speeds from which the model has its friction.
    pub(super) told_from: Option<[f64; 2]>,
    /// Where the angle of each log counts from, as the effects have it, rad.
    pub(super) zeros_rad: Vec<f64>,
}

impl Declared {
    /// One motor of a robot with its wheel in the air, or the axis of a model.
    pub(super) fn new(model: &Model, motor: Motor) -> Self {
        let (machine, inertia, gravity, friction, effects) = match &model.rig {
            Rig::Robot(robot) => (
                Machine::wheel_in_air(robot),
                robot.parameters.wheel_inertia_kg_m2,
                0.0,
                robot.friction[motor as usize],
                robot.effects.iter().filter(|effect| effect.is_in(motor)).cloned().collect(),
            ),
            Rig::Axis(axis) => {
                let (inertia, gravity, friction) = match axis.parameters {
                    AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction } => {
                        (inertia_kg_m2, gravity_torque_nm, friction)
                    }
                    AxisParameters::Linear { mass_kg, friction } => (mass_kg, 0.0, friction),
                };
                (Machine::axis(axis), inertia, gravity, friction, axis.effects.clone())
            }
        };
        Self {
            machine,
            inertia,
            declared_inertia: inertia,
            gravity,
            delay_s: model.robot().map_or(0.0, |robot| robot.actuation.delay_s),
            friction: friction.map(|curve| *curve.parameters()),
            effects,
            tolerances: model.tolerance.clone(),
            told_from: match &model.rig {
                Rig::Robot(_) => None,
                Rig::Axis(axis) => axis.fitted_speed_range,
            },
            zeros_rad: Vec::new(),
        }
    }

    pub(super) fn is_linear(&self) -> bool {
        self.machine.kind == MachineKind::Linear
    }

    pub(super) fn axis(&self) -> Axis {
        if self.is_linear() { Axis::Linear } else { Axis::Rotary }
    }

    pub(super) fn names(&self) -> Names {
        if self.is_linear() {
            Names { position: "position_m", speed: "velocity_m_s", effort: "force_n" }
        } else {
            Names { position: "motor_angle_rad", speed: "motor_speed_rad_s", effort: "torque_nm" }
        }
    }

    /// Columns as what a residual may depend on.
    pub(super) fn variables(
        &self,
        time_s: Vec<f64>,
        position: Vec<f64>,
        speed: Vec<f64>,
        acceleration: Vec<f64>,
        effort: Vec<f64>,
    ) -> Vec<Variable> {
        let names = self.names();
        let (units, acceleration_name) = if self.is_linear() {
            (["m", "m/s", "m/s²", "N"], "acceleration_m_s2")
        } else {
            (["rad", "rad/s", "rad/s²", "N m"], "motor_acceleration_rad_s2")
        };
        vec![
            Variable::new("time_s", "s", time_s),
            Variable::new(names.position, units[0], position),
            Variable::new(names.speed, units[1], speed),
            Variable::new(names.effort, units[3], effort),
            Variable::new(acceleration_name, units[2], acceleration),
        ]
    }

    pub(super) fn channel(&self) -> &'static str {
        if self.is_linear() { "force" } else { "torque" }
    }

    pub(super) fn effort_unit(&self) -> &'static str {
        if self.is_linear() { "N" } else { "N m" }
    }

    pub(super) fn curve(&self) -> StribeckParameters {
        self.friction.unwrap_or(StribeckParameters::NONE)
    }

    /// Whether its friction at rest is another than when it slides.
    pub(super) fn has_stribeck(&self) -> bool {
        self.curve().static_nm != self.curve().coulomb_nm
    }

    /// Efforts at the rows: measured, and measured less what the declared numbers explain.
    pub(super) fn targets(&self, rows: &Rows) -> [Vec<f64>; 2] {
        let measured = rows.column(torque_between);
        let curve = Stribeck::new(self.curve()).expect("the model's curve was checked when it was loaded");
        let declared = rows.column(|trace| {
            let acceleration = trace.second_difference();
            (0..trace.position.len())
                .map(|sample| {
                    self.inertia * acceleration[sample]
                        + curve.torque_nm(trace.speed[sample])
                        + self.gravity * libm::sin(trace.position[sample])
                })
                .collect()
        });
        let mut target: Vec<f64> = measured.iter().zip(&declared).map(|(a, b)| a - b).collect();
        for effect in &self.effects {
            let known = self.known(effect, rows);
            target.iter_mut().zip(&known).for_each(|(target, known)| *target -= known);
        }
        [measured, target]
    }

    /// What a declared effect adds to the residual, by each log's own zero of the angle.
    pub(super) fn known(&self, effect: &Effect, rows: &Rows) -> Vec<f64> {
        let how = Acting::of(effect.kind(), self.machine.kind, &effect.values(Role::Shape));
        rows.column(|trace| {
            let zero_rad = self.zeros_rad.get(trace.log).copied().unwrap_or(0.0);
            trace.acts(&effect.turned(zero_rad).law(&self.machine), how)
        })
    }

    /// Unit of its speed.
    pub(super) fn speed_unit(&self) -> &'static str {
        if self.is_linear() { "m/s" } else { "rad/s" }
    }

    /// Puts a free inertia where the rows have it, as a first guess: the noise of an acceleration is weighed by it.
    pub(super) fn take_over_free(&mut self, rows: &Rows, estimate: &[String]) {
        let key = self.axis().keys()[place::INERTIA];
        if !estimate.iter().any(|name| name == "all" || name == key) {
            return;
        }
        let measured = rows.column(torque_between);
        let columns = [
            rows.column(Trace::second_difference),
            rows.column(|trace| trace.speed.clone()),
            rows.column(|trace| trace.speed.iter().map(|&speed| direction(speed)).collect()),
            rows.column(|trace| vec![1.0; trace.position.len()]),
        ];
        let fitted: Vec<usize> =
            (0..rows.rows.len()).filter(|&row| rows.rows[row].part == Part::Fit).collect();
        let at = |column: &[f64]| -> Vec<f64> { fitted.iter().map(|&row| column[row]).collect() };
        let columns = columns.map(|column| at(&column));
        let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut blocks = Blocks::new(&views, &at(&measured), &vec![0; fitted.len()]);
        let noise = rows.position_noise * rows.kernel.noise_gain(2);
        let power = blocks.length(0).powi(2) / fitted.len().max(1) as f64;
        blocks.discount(0, 0, noise.min(MOST_NOISE * power));
        // One way, the direction is the offset.
        let all = [0, 1, 2, 3].map(Member::free);
        let found = blocks.fit(&all, 0.0).or_else(|| blocks.fit(&[all[0], all[1], all[3]], 0.0));
        if let Some(inertia) = found.map(|found| found[0]).filter(|inertia| *inertia > 0.0) {
            self.inertia = inertia;
        }
    }

    /// A number as the model file has it.
    pub(super) fn in_file(&self, nuisance: &Nuisance) -> f64 {
        if nuisance.is_inertia() { self.declared_inertia } else { nuisance.declared }
    }

    /// The friction curve with corrected numbers; none where no curve has them.
    pub(super) fn corrected_curve(&self, corrections: &[(&'static str, f64)]) -> Option<Stribeck> {
        let value = |key: &str, declared: f64| {
            corrections.iter().find(|(name, _)| *name == key).map_or(declared, |&(_, value)| value)
        };
        let keys = self.axis().keys();
        let p = self.curve();
        Stribeck::new(StribeckParameters {
            coulomb_nm: value(keys[place::COULOMB], p.coulomb_nm).max(0.0),
            static_nm: match p.static_nm == p.coulomb_nm {
                true => value(keys[place::COULOMB], p.coulomb_nm).max(0.0),
                false => value(keys[place::STATIC], p.static_nm).max(0.0),
            },
            viscous_nm_s_rad: value(keys[place::VISCOUS], p.viscous_nm_s_rad).max(0.0),
            stribeck_speed_rad_s: value(keys[place::STRIBECK_SPEED], p.stribeck_speed_rad_s),
            stribeck_exponent: value(keys[place::STRIBECK_EXPONENT], p.stribeck_exponent).min(10.0),
            offset_nm: value(keys[place::OFFSET], p.offset_nm),
        })
        .ok()
    }

    /// The model with corrected numbers.
    pub(super) fn corrected_model(
        &self,
        model: &Model,
        motor: Motor,
        (corrections, told_from): (&[(&'static str, f64)], Option<[f64; 2]>),
    ) -> Model {
        let value = |key: &str, declared: f64| {
            corrections.iter().find(|(name, _)| *name == key).map_or(declared, |&(_, value)| value)
        };
        let keys = self.axis().keys();
        let curve = self.corrected_curve(corrections);
        let has_friction = self.friction.is_some()
            || corrections.iter().any(|(key, _)| keys[place::VISCOUS..=place::OFFSET].contains(key));
        // Where the corrected numbers make no curve, the declared one stays.
        let friction = if has_friction { curve.or_else(|| Stribeck::new(self.curve()).ok()) } else { None };
        let inertia = value(keys[place::INERTIA], self.inertia);
        let inertia = if inertia > 0.0 { inertia } else { self.inertia };
        let mut model = model.clone();
        match &mut model.rig {
            Rig::Robot(robot) => {
                robot.parameters.wheel_inertia_kg_m2 = inertia;
                robot.friction[motor as usize] = friction;
            }
            Rig::Axis(axis) => {
                match &mut axis.parameters {
                    AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction: own } => {
                        (*inertia_kg_m2, *own) = (inertia, friction);
                        *gravity_torque_nm = value(keys[place::GRAVITY], self.gravity);
                    }
                    AxisParameters::Linear { mass_kg, friction: own } => {
                        (*mass_kg, *own) = (inertia, friction);
                    }
                }
                axis.fitted_speed_range = told_from;
                // By the zero of the first log.
                let zero_rad = self.zeros_rad.first().copied().unwrap_or(0.0);
                axis.effects.iter_mut().for_each(|effect| *effect = effect.turned(zero_rad));
            }
        }
        model
    }
}

/// Mean torque over the interval that a second difference sees, if a row's torque acts until the next row.
pub(super) fn torque_between(trace: &Trace) -> Vec<f64> {
    let before = |sample: usize| trace.effort[sample.saturating_sub(1)];
    (0..trace.effort.len()).map(|sample| 0.5 * (trace.effort[sample] + before(sample))).collect()
}
