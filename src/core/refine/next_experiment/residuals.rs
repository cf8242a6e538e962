//! Contribution of effects to the residual of a run, in units of its noise.

use super::normal::Normal;
use crate::effects::{self, Action, EffectKind, Law, Machine, MotionSample, Parameter, Role};
use crate::model::{AxisParameters, MachineKind, Model, ModelParameter, Motor, ParameterPlace, Rig};
use crate::record::Log;
use crate::refine::{
    prediction::moments,
    robot,
    verdict::{Found, Refinement},
};

/// Rows over which residuals are averaged, s.
const ROW_S: f64 = 0.01;
/// Effects that stand for errors of declared numbers, which are free within their tolerances.
const FREE: [&str; 6] = [
    "coulomb_error",
    "viscous_error",
    "inertia_error",
    "mass_error",
    "com_height_error",
    "body_inertia_error",
];

/// Moments of a run of the robot on its wheels, or of one shaft.
pub(super) struct Seen {
    moments: Vec<Vec<MotionSample>>,
    on_ground: bool,
}

/// A rival at a shape.
pub(super) struct Shaped {
    kind: &'static EffectKind,
    values: Vec<f64>,
}

/// Residuals, seen in units of their noise.
pub(super) struct View<'a> {
    model: &'a Model,
    ground: Option<Machine>,
    shaft: Machine,
    /// Noise of r1 and r2 on the ground and of the torque on a shaft, of rows of [`ROW_S`].
    noise: [f64; 3],
    pub(super) tolerances: Vec<f64>,
    free: Vec<&'static EffectKind>,
}

/// Residual by residual in both equations.
pub(super) type Residuals = Vec<[f64; 2]>;

impl<'a> View<'a> {
    pub(super) fn new(found: &'a Refinement, motor: Motor) -> Option<Self> {
        let model = &found.model;
        let floor = |name: &str| {
            found.after.noise_floor.0.iter().find(|(own, _)| *own == name).map(|(_, quantity)| quantity.value)
        };
        let torque = floor("torque").or(floor("force")).or(floor("pitch"))?;
        let noise = [floor("translation").unwrap_or(torque), floor("pitch").unwrap_or(torque), torque];
        let (ground, shaft, curve) = match &model.rig {
            Rig::Robot(robot) => {
                let curve = robot.friction[motor as usize];
                (Some(Machine::robot(robot)), Machine::wheel_in_air(robot), curve)
            }
            Rig::Axis(axis) => {
                let (AxisParameters::Rotary { friction, .. } | AxisParameters::Linear { friction, .. }) =
                    axis.parameters;
                (None, Machine::axis(axis), friction)
            }
        };
        let mut p = shaft.parameters;
        let curve = curve.map(|curve| *curve.parameters());
        let kind = if ground.is_some() { MachineKind::Robot } else { shaft.kind };
        let (mut free, mut tolerances) = (Vec::new(), Vec::new());
        for id in FREE {
            let Some(declared) = ModelParameter::of_effect(id, kind) else { continue };
            let share = model.tolerance.share_of(declared.key);
            let size = match ModelParameter::of_effect(id, MachineKind::Robot).map(|row| row.place) {
                Some(ParameterPlace::Friction(place)) => {
                    let unknown = if id == "coulomb_error" { 0.01 } else { 1e-3 };
                    curve.map_or(unknown, |mut curve| *place(&mut curve))
                }
                Some(ParameterPlace::Robot(place)) => *place(&mut p),
                Some(ParameterPlace::Axis) | None => continue,
            };
            if let Some(effect) = effects::kind(id).filter(|effect| effect.is_on(kind)) {
                free.push(effect);
                tolerances.push((share * size).abs().max(1e-9));
            }
        }
        Some(Self { model, ground, shaft, noise, tolerances, free })
    }

    /// The motion of a log.
    pub(super) fn seen(&self, log: &Log) -> Option<Seen> {
        let on_ground = log.column("pitch_rad").is_some();
        let moments = match self.model.robot().filter(|_| on_ground) {
            Some(robot) => robot::moments(robot, log)?.into(),
            None => vec![moments(log)?],
        };
        Some(Seen { moments, on_ground })
    }

    /// r1 and r2, or the torque on the shaft, of a law that starts anew in each run.
    fn act(&self, kind: &EffectKind, law: &dyn Law, seen: &Seen) -> Residuals {
        let Some(first) = seen.moments.first() else { return Vec::new() };
        let radius = self.ground.as_ref().map_or(1.0, |machine| machine.parameters.wheel_radius_m);
        let motors = if kind.per_motor() { seen.moments.len() } else { 1 };
        let mut found = vec![[0.0; 2]; first.len()];
        if seen.on_ground || kind.per_motor() || self.ground.is_none() {
            for moments in &seen.moments[..motors] {
                let mut law = law.boxed_clone();
                for (row, moment) in found.iter_mut().zip(moments) {
                    let action: Action = law.act(moment);
                    let motor = action.on_motor_nm(moment.direction());
                    if seen.on_ground {
                        row[0] += motor / radius + action.axle_n;
                        row[1] += action.body_nm - motor;
                    } else {
                        row[0] += motor;
                    }
                }
            }
        }
        let dt_s = first.first().map_or(1e-3, |moment| moment.dt_s);
        let block = ((ROW_S / dt_s).round() as usize).max(1);
        let noise =
            if seen.on_ground { [self.noise[0], self.noise[1]] } else { [self.noise[2], f64::INFINITY] };
        let mean = |rows: &[[f64; 2]]| {
            let sum = rows.iter().fold([0.0; 2], |sum, row| [sum[0] + row[0], sum[1] + row[1]]);
            [0, 1].map(|i: usize| sum[i] / rows.len() as f64 / noise[i])
        };
        found.chunks(block).map(mean).collect()
    }

    fn machine(&self, seen: &Seen) -> &Machine {
        self.ground.as_ref().filter(|_| seen.on_ground).unwrap_or(&self.shaft)
    }

    /// Contribution of the effect in each of the runs.
    pub(super) fn law(&self, effect: &Found, seen: &[Seen]) -> Vec<Residuals> {
        let act = |seen: &Seen| self.act(effect.effect.kind(), &effect.effect.law(self.machine(seen)), seen);
        seen.iter().map(act).collect()
    }

    pub(super) fn rows(&self, runs: &[Residuals]) -> Vec<f64> {
        runs.iter().flatten().flatten().copied().collect()
    }

    /// Normal equations of an effect's residual over a rival's terms and the declared numbers.
    pub(super) fn normal(&self, seen: &[Seen], told: &[f64], rival: &Shaped) -> Normal {
        let column = |kind: &'static EffectKind, values: &[f64], term: usize| -> Vec<f64> {
            let runs: Vec<Residuals> = seen
                .iter()
                .map(|seen| {
                    let terms = kind.terms(self.machine(seen), values);
                    terms.get(term).map_or_else(Vec::new, |term| self.act(kind, &*term.law, seen))
                })
                .collect();
            let mut rows = self.rows(&runs);
            rows.resize(told.len(), 0.0);
            rows
        };
        let machine = self.ground.as_ref().unwrap_or(&self.shaft);
        let own = rival.kind.terms(machine, &rival.values).len();
        let mut columns: Vec<Vec<f64>> = self.free.iter().map(|kind| column(kind, &[], 0)).collect();
        columns.extend((0..own).map(|term| column(rival.kind, &rival.values, term)));
        Normal::new(&columns, told)
    }

    /// Shapes of a rival that may mimic an effect.
    pub(super) fn shapes(&self, kind: &'static EffectKind, effect: &Found) -> Vec<Shaped> {
        let machine = self.ground.as_ref().unwrap_or(&self.shaft);
        let value = |parameter: &Parameter| -> f64 {
            let key = parameter.key(machine.kind);
            let unit = parameter.unit(machine.kind);
            let own = effect.effect.kind().parameters;
            let like = effect.effect.parameters().iter().enumerate().find(|(n, (name, _))| {
                let same = &own[n % own.len()];
                name == key || (same.role == Role::Shape && same.unit(machine.kind) == unit)
            });
            like.map(|(_, (_, value))| *value).or(parameter.default).unwrap_or(match unit {
                "s" => 5e-3,
                "Hz" => 4.0,
                "rad" => 0.05,
                "rad/s" => 0.7,
                "m/s" => 0.01,
                "kg m²" => 0.2 * self.shaft.parameters.wheel_inertia_kg_m2,
                _ => 0.1,
            })
        };
        let middle: Vec<f64> = kind.shapes().map(value).collect();
        let Some(first) = kind.shapes().next() else { return vec![Shaped { kind, values: middle }] };
        let shares: &[f64] = if first.whole { &[1.0] } else { &[0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 2.5] };
        let at = |share: &f64| {
            let mut values = middle.clone();
            values[0] *= share;
            let possible = kind.shapes().zip(&values).all(|(parameter, value)| {
                let [low, high] = parameter.range(machine.kind);
                (low..=high).contains(value)
            });
            (possible && !kind.terms(machine, &values).is_empty()).then_some(Shaped { kind, values })
        };
        shares.iter().filter_map(at).collect()
    }
}
