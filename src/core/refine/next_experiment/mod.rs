//! What to record next: of the runs that a machine can do, the one in which effects that look alike would be farthest
//! apart.
//!
//! # Method
//! The refined model does each run in simulation. What the effect that was found adds to the residual, there and in the
//! log, is held against what a rival of it can add: sized to mimic it in both together, with the declared numbers free
//! within their tolerances. What the rival cannot mimic in the new run, in standard deviations of the noise, is how far
//! apart the two would be. The run with the largest such distance from the nearest rival is offered.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::prediction::moments;
use super::verdict::{Found, Refinement, Unexplained};
use crate::effects::{self, Action, EffectKind, Law, Machine, MachineKind, Moment, Parameter, Role};
use crate::model_file::{AxisParameters, Model, Rig};
use crate::parallel;
use crate::record::Log;
use crate::robot::{Motor, Payload};
use crate::simulate::{self, ControllerChoice, Experiment, Scenario};

/// A run that would tell more than the logs do.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NextExperiment {
    /// In words.
    pub summary: String,
    /// Ids of the effects that it tells from each other.
    pub separates: Vec<&'static str>,
    /// Scenario of the simulated robot; none where it is none.
    pub scenario: Option<String>,
    /// How far the residuals of those effects would be apart, in standard deviations of the noise; 0 where it was not
    /// worked out.
    pub separation: f64,
    /// A command that runs exactly it; none where no command can.
    pub command: Option<String>,
}

impl NextExperiment {
    /// An experiment in words.
    pub(super) fn in_words(summary: String) -> Self {
        Self { summary, ..Self::default() }
    }
}

/// Length of a run, s.
const SECONDS: f64 = 30.0;
/// Rows over which residuals are averaged, s.
const ROW_S: f64 = 0.01;
/// Standard deviations apart from which on a run is worth its while.
const WORTH: f64 = 5.0;
/// Load that is put on a body, as a share of it.
const LOAD: f64 = 0.15;
/// Declared numbers that are free within their tolerances, as effects, and their keys on a robot, a shaft and a carriage.
const FREE: [(&str, [&str; 3]); 6] = [
    ("coulomb_error", ["coulomb_nm", "coulomb_nm", "coulomb_n"]),
    ("viscous_error", ["viscous_nm_s_rad", "viscous_nm_s_rad", "viscous_n_s_m"]),
    ("inertia_error", ["wheel_inertia_kg_m2", "inertia_kg_m2", "mass_kg"]),
    ("mass_error", ["body_mass_kg", "inertia_kg_m2", "mass_kg"]),
    ("com_height_error", ["com_height_m"; 3]),
    ("body_inertia_error", ["body_inertia_kg_m2"; 3]),
];

/// What is known of a question.
pub(super) struct Asked<'a> {
    pub(super) logs: &'a [Log],
    pub(super) motor: Motor,
    pub(super) seed: u64,
    /// Name of the file of the refined model, for commands.
    pub(super) file: &'a str,
}

/// The run that would tell most beyond what the logs have told; none where nothing is open.
pub(super) fn next_experiment(found: &Refinement, asked: &Asked<'_>) -> Option<NextExperiment> {
    let open = found.effects.iter().find(|effect| !effect.ambiguous_with.is_empty());
    let Some(effect) = open else { return of_rest(found, asked) };
    let words = told_apart(effect);
    let runs = runs(&found.model);
    let separations = separations(found, effect, &runs, asked).unwrap_or_default();
    let best = (0..separations.len()).max_by(|&a, &b| separations[a].total_cmp(&separations[b]));
    match best {
        Some(best) if separations[best] > WORTH => {
            let run = &runs[best];
            let summary = format!(
                "{}: {}, where they would be {:.0} standard deviations of the noise apart, the most of {} runs",
                words.0,
                run.words,
                separations[best],
                runs.len()
            );
            Some(NextExperiment {
                summary,
                separates: words.1,
                scenario: Some(run.experiment.scenario.name().to_owned()),
                separation: separations[best],
                command: Some(run.command(&found.model, asked)),
            })
        }
        _ => {
            let summary = format!("{}: {}", words.0, effect.effect.kind().separated_by);
            Some(NextExperiment { separates: words.1, ..NextExperiment::in_words(summary) })
        }
    }
}

fn told_apart(effect: &Found) -> (String, Vec<&'static str>) {
    let others: Vec<&'static str> = effect.ambiguous_with.iter().map(|kind| kind.id).collect();
    let words = format!("to tell {} from {}", effect.effect.id(), others.join(", "));
    (words, std::iter::once(effect.effect.id()).chain(others).collect())
}

/// What would tell more of what is left.
fn of_rest(found: &Refinement, asked: &Asked<'_>) -> Option<NextExperiment> {
    let left: &Unexplained = &found.unexplained;
    if left.description.is_empty() {
        return None;
    }
    let runs = runs(&found.model);
    let on = |scenario: Scenario| runs.iter().find(|run| run.experiment.scenario == scenario);
    let swings = matches!(&found.model.rig, Rig::Axis(axis)
        if matches!(axis.parameters, AxisParameters::Rotary { gravity_torque_nm, .. } if gravity_torque_nm != 0.0));
    let (words, run) = match left.depends_on.first().map(String::as_str) {
        Some("time_s") | None => {
            let words = "the same run again, to see whether it comes back at the same time".to_owned();
            return Some(NextExperiment::in_words(words));
        }
        Some(name) if name.contains("speed") => (name, on(Scenario::FrictionSweep)),
        Some(name) if name.contains("torque") => (name, on(Scenario::Multisine)),
        Some(name) if name.contains("angle") => (name, on(Scenario::FrictionSweep)),
        Some(name) => (name, on(Scenario::Cruise)),
    };
    if swings {
        let summary = format!(
            "a run in which {words} varies more: the load lifted slowly and let down slowly over its whole range, then \
             swung at several speeds"
        );
        return Some(NextExperiment::in_words(summary));
    }
    let summary = match run {
        Some(run) => format!("a run in which {words} varies more: {}", run.words),
        None => format!("a run in which {words} varies while all else is kept as even as can be"),
    };
    Some(NextExperiment {
        scenario: run.map(|run| run.experiment.scenario.name().to_owned()),
        command: run.map(|run| run.command(&found.model, asked)),
        ..NextExperiment::in_words(summary)
    })
}

/// A run that a machine can do.
struct Run {
    words: &'static str,
    experiment: Experiment,
    flags: String,
}

impl Run {
    fn command(&self, model: &Model, asked: &Asked<'_>) -> String {
        let Experiment { scenario, controller, seconds, .. } = &self.experiment;
        let file = match asked.file {
            "" => "MODEL".to_owned(),
            plain if plain.chars().all(|c| c.is_ascii_alphanumeric() || "/._-+=".contains(c)) => {
                plain.to_owned()
            }
            spaced => format!("'{}'", spaced.replace('\'', "'\\''")),
        };
        let controller = controller.name();
        // On the ground a log holds both motors.
        let of_right = asked.motor == Motor::Right && model.robot().is_some() && !self.experiment.on_ground();
        let motor = if of_right { " --motor right" } else { "" };
        format!(
            "flqr simulate {file} --scenario {scenario} --controller {controller} --seconds {seconds}{} --seed {}{motor} --log next.csv",
            self.flags, asked.seed
        )
    }
}

/// Runs that the simulated machine can do; none for a carriage.
fn runs(model: &Model) -> Vec<Run> {
    let run = |words, scenario, controller| {
        let experiment = Experiment::new(scenario, controller);
        let seconds = if scenario == Scenario::FrictionSweep { 120.0 } else { SECONDS };
        Run { words, experiment: Experiment { seconds, ..experiment }, flags: String::new() }
    };
    let air = |words, scenario| run(words, scenario, ControllerChoice::Pi);
    let turning = |words, target_speed_rad_s: f64| {
        let plain = air(words, Scenario::SpeedTracking);
        let flags = format!(" --target-speed {target_speed_rad_s}");
        Run { experiment: Experiment { target_speed_rad_s, ..plain.experiment.clone() }, flags, ..plain }
    };
    let mut found = vec![
        air("the wheels in the air at 33 constant speeds, both ways", Scenario::FrictionSweep),
        air("the wheels in the air under torques of many frequencies", Scenario::Multisine),
        turning("a wheel in the air, slowly forward", 1.0),
        turning("a wheel in the air, slowly backward", -1.0),
        turning("a wheel in the air, fast", 20.0),
    ];
    match &model.rig {
        Rig::Axis(axis) => {
            match axis.parameters {
                AxisParameters::Linear { .. } => found.clear(),
                // A load that swings cannot turn at a constant speed.
                AxisParameters::Rotary { gravity_torque_nm, .. } if gravity_torque_nm != 0.0 => {
                    found.retain(|run| run.experiment.scenario == Scenario::Multisine);
                    found
                        .iter_mut()
                        .for_each(|run| run.words = "torques of many frequencies about where it hangs");
                    return found;
                }
                AxisParameters::Rotary { .. } => {}
            }
            for (run, words) in found.iter_mut().zip([
                "33 constant speeds, both ways",
                "torques of many frequencies",
                "slowly forward",
                "slowly backward",
                "fast forward",
            ]) {
                run.words = words;
            }
        }
        Rig::Robot(robot) if robot.weights.is_some() => {
            let fed = robot.friction.iter().any(Option::is_some);
            let controller = if fed { ControllerChoice::Flqr } else { ControllerChoice::Lqr };
            let ground = |words, scenario| run(words, scenario, controller);
            let scaled = |words, torque_scale: f64| {
                let plain = ground(words, Scenario::Multisine);
                let flags = format!(" --torque-scale {torque_scale}");
                Run { experiment: Experiment { torque_scale, ..plain.experiment.clone() }, flags, ..plain }
            };
            let sloped = |words, slope_rad: f64| {
                let plain = ground(words, Scenario::Cruise);
                let flags = format!(" --slope {slope_rad}");
                Run { experiment: Experiment { slope_rad, ..plain.experiment.clone() }, flags, ..plain }
            };
            let loaded = |words, scenario| {
                let plain = ground(words, scenario);
                // As it is written in the command.
                let mass_kg = (10.0 * LOAD * robot.parameters.body_mass_kg).round() / 10.0;
                let height_m = robot.parameters.com_height_m;
                let payload = Some(Payload { mass_kg, height_m, forward_m: 0.0 });
                let flags = format!(" --payload {mass_kg}");
                Run { experiment: Experiment { payload, ..plain.experiment.clone() }, flags, ..plain }
            };
            found.extend([
                ground("standing still", Scenario::Station),
                ground("driving out and back", Scenario::Cruise),
                sloped("driving out and back up a slope", 0.05),
                sloped("driving out and back down a slope", -0.05),
                loaded("driving out and back with a load", Scenario::Cruise),
                ground("torques of many frequencies while it balances", Scenario::Multisine),
                scaled("twice the torques of many frequencies while it balances", 2.0),
                scaled("four times the torques of many frequencies while it balances", 4.0),
                loaded("torques of many frequencies while it balances, with a load", Scenario::Multisine),
            ]);
        }
        Rig::Robot(_) => {}
    }
    found
}

/// How far apart the effect and its nearest rival would be in each of the runs; none where the log has no motion.
fn separations(found: &Refinement, effect: &Found, runs: &[Run], asked: &Asked<'_>) -> Option<Vec<f64>> {
    let view = View::new(found, asked.motor)?;
    let recorded: Vec<Seen> = asked.logs.iter().filter_map(|log| view.seen(log)).collect();
    if recorded.is_empty() {
        return None;
    }
    let told = view.rows(&view.law(effect, &recorded));
    let rivals: Vec<Vec<Shaped>> = effect
        .ambiguous_with
        .iter()
        .map(|kind| view.shapes(kind, effect))
        .filter(|s| !s.is_empty())
        .collect();
    if rivals.is_empty() {
        return None;
    }
    // Of each rival the shape that mimics the effect best in the log.
    let mut chosen: Vec<(Shaped, Normal, f64)> = Vec::new();
    for shapes in rivals {
        let tried = shapes.into_iter().map(|shape| {
            let normal = view.normal(&recorded, &told, &shape);
            let left = normal.least(&view.tolerances);
            (shape, normal, left)
        });
        chosen.extend(tried.min_by(|a, b| a.2.total_cmp(&b.2)));
    }
    let threads = NonZeroUsize::new(2).expect("2 is not 0");
    Some(parallel::map(runs, threads, |run| {
        let experiment = Experiment { seed: asked.seed, ..run.experiment.clone() };
        let watch = &mut |_| ControlFlow::Continue(());
        let Ok(outcome) = simulate::run(&experiment, &found.model, &found.model, watch) else { return 0.0 };
        let fell = matches!(&outcome, simulate::Outcome::Ground(run) if run.statistics.fell);
        let Some(seen) = view.seen(&outcome.log(asked.motor)).filter(|_| !fell) else { return 0.0 };
        let seen = [seen];
        let told = view.rows(&view.law(effect, &seen));
        let apart = |(shape, normal, left): &(Shaped, Normal, f64)| {
            let both = normal.plus(&view.normal(&seen, &told, shape));
            (both.least(&view.tolerances) - left).max(0.0).sqrt()
        };
        chosen.iter().map(apart).fold(f64::INFINITY, f64::min)
    }))
}

/// Moments of a run of the robot on its wheels, or of one shaft.
struct Seen {
    moments: Vec<Vec<Moment>>,
    on_ground: bool,
}

/// A rival at a shape.
struct Shaped {
    kind: &'static EffectKind,
    values: Vec<f64>,
}

/// Residuals, seen in units of their noise.
struct View<'a> {
    model: &'a Model,
    ground: Option<Machine>,
    shaft: Machine,
    /// Noise of r1 and r2 on the ground and of the torque on a shaft, of rows of [`ROW_S`].
    noise: [f64; 3],
    tolerances: Vec<f64>,
    free: Vec<&'static EffectKind>,
}

/// Residual by residual in both equations.
type Residuals = Vec<[f64; 2]>;

impl<'a> View<'a> {
    fn new(found: &'a Refinement, motor: Motor) -> Option<Self> {
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
        let p = shaft.parameters;
        let curve = curve.map(|curve| *curve.parameters());
        let kind = if ground.is_some() { MachineKind::Robot } else { shaft.kind };
        let (mut free, mut tolerances) = (Vec::new(), Vec::new());
        for (id, keys) in FREE {
            let share = model.tolerance.share_of(keys[kind as usize]);
            let size = match id {
                "coulomb_error" => curve.map_or(0.01, |c| c.coulomb_nm),
                "viscous_error" => curve.map_or(1e-3, |c| c.viscous_nm_s_rad),
                "inertia_error" => p.wheel_inertia_kg_m2,
                "mass_error" => p.body_mass_kg,
                "com_height_error" => p.com_height_m,
                _ => p.body_inertia_kg_m2,
            };
            if let Some(effect) = effects::kind(id).filter(|effect| effect.is_on(kind)) {
                free.push(effect);
                tolerances.push((share * size).abs().max(1e-9));
            }
        }
        Some(Self { model, ground, shaft, noise, tolerances, free })
    }

    /// The motion of a log.
    fn seen(&self, log: &Log) -> Option<Seen> {
        let on_ground = log.column("pitch_rad").is_some();
        let moments = match self.model.robot().filter(|_| on_ground) {
            Some(robot) => super::robot::moments(robot, log)?.into(),
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

    /// What the effect does in each of the runs.
    fn law(&self, effect: &Found, seen: &[Seen]) -> Vec<Residuals> {
        let act = |seen: &Seen| self.act(effect.effect.kind(), &effect.effect.law(self.machine(seen)), seen);
        seen.iter().map(act).collect()
    }

    fn rows(&self, runs: &[Residuals]) -> Vec<f64> {
        runs.iter().flatten().flatten().copied().collect()
    }

    /// Normal equations of an effect's residual over a rival's terms and the declared numbers.
    fn normal(&self, seen: &[Seen], told: &[f64], rival: &Shaped) -> Normal {
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
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let count = columns.len();
        Normal {
            gram: DMatrix::from_fn(count, count, |i, j| dot(&columns[i], &columns[j])),
            right: DVector::from_fn(count, |i, _| dot(&columns[i], told)),
            square: dot(told, told),
        }
    }

    /// Shapes of a rival that may mimic an effect.
    fn shapes(&self, kind: &'static EffectKind, effect: &Found) -> Vec<Shaped> {
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

/// Normal equations.
#[derive(Clone)]
struct Normal {
    gram: DMatrix<f64>,
    right: DVector<f64>,
    square: f64,
}

impl Normal {
    fn plus(&self, other: &Self) -> Self {
        Self {
            gram: &self.gram + &other.gram,
            right: &self.right + &other.right,
            square: self.square + other.square,
        }
    }

    /// The least sum of squares, the first coefficients held within their tolerances.
    fn least(&self, tolerances: &[f64]) -> f64 {
        let mut gram = self.gram.clone();
        for place in 0..gram.nrows() {
            let held = tolerances.get(place).map_or(0.0, |tolerance| 1.0 / (tolerance * tolerance));
            gram[(place, place)] += held + 1e-9 * gram[(place, place)] + 1e-300;
        }
        match gram.cholesky() {
            Some(factors) => (self.square - self.right.dot(&factors.solve(&self.right))).max(0.0),
            None => self.square,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;
    use crate::model_file::presets;
    use crate::refine::verdict::{Channels, Errors, Quantity, Verdict};

    fn found(id: &str, parameters: &[(&str, f64)], rival: &str) -> Refinement {
        let effect = Effect::new(id, MachineKind::Robot, None, parameters.iter().copied()).unwrap();
        let mut model = presets::paper();
        if let Rig::Robot(robot) = &mut model.rig {
            robot.effects.push(effect.clone());
        }
        let floor = |name, value, unit| (name, Quantity::new(value, unit));
        let floors =
            vec![floor("combined", 0.3, "N"), floor("translation", 0.3, "N"), floor("pitch", 0.03, "N m")];
        let errors = Errors { noise_floor: Channels(floors), ..Errors::default() };
        let effect = Found {
            ci95: vec![None; effect.parameters().len()],
            units: vec!["1"; effect.parameters().len()],
            error_drop_percent: 50.0,
            error_drop_ci95: None,
            ambiguous_with: vec![effects::kind(rival).unwrap()],
            effect,
        };
        Refinement {
            verdict: Verdict::EffectsFound,
            effects: vec![effect],
            before: errors.clone(),
            after: errors,
            unexplained: Unexplained::default(),
            candidates: Vec::new(),
            closed_loop: None,
            next_experiment: None,
            data_health: Vec::new(),
            carried: Vec::new(),
            parameters: Vec::new(),
            model,
            explorer: Default::default(),
            document: Default::default(),
        }
    }

    fn asked(found: &Refinement, scenario: Scenario) -> NextExperiment {
        let experiment = Experiment { seconds: 12.0, ..Experiment::new(scenario, ControllerChoice::Flqr) };
        let watch = &mut |_| ControlFlow::Continue(());
        let log =
            simulate::run(&experiment, &presets::paper(), &found.model, watch).unwrap().log(Motor::Left);
        let asked = Asked { logs: &[log], motor: Motor::Left, seed: 1, file: "my robot.toml" };
        next_experiment(found, &asked).unwrap()
    }

    /// A slope pulls at the ground alone: with the wheels in the air an asymmetry of the friction stays.
    #[test]
    fn slope_and_asymmetry_are_told_apart_by_a_run_that_can_be_started() {
        let found = found("ground_slope", &[("slope_rad", 0.01)], "friction_asymmetry");
        let next = asked(&found, Scenario::Cruise);
        assert_eq!(next.separates, ["ground_slope", "friction_asymmetry"]);
        assert!(next.separation > WORTH, "{next:?}");
        let command = next.command.unwrap();
        assert!(command.starts_with("flqr simulate 'my robot.toml' --scenario "), "{command}");
        assert!(next.scenario.is_some_and(|scenario| command.contains(&scenario)));
        assert!(command.contains(" --seed 1 ") && !command.contains("--motor"), "{command}");
    }

    #[test]
    fn a_load_that_swings_is_not_asked_to_turn_at_a_constant_speed() {
        let model = |gravity: &str| {
            let text = format!(
                "name = \"arm\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.03\n{gravity}[friction]\n\
                 coulomb_nm = 0.1\nviscous_nm_s_rad = 0.01\n"
            );
            Model::from_toml(&text, "arm.toml").unwrap()
        };
        let scenarios = |model: &Model| -> Vec<Scenario> {
            runs(model).iter().map(|run| run.experiment.scenario).collect()
        };
        assert_eq!(scenarios(&model("gravity_torque_nm = 1.5\n")), [Scenario::Multisine]);
        assert_eq!(scenarios(&model("")).len(), 5);
    }

    #[test]
    fn a_command_names_the_motor_of_the_right_wheel_and_a_word_for_a_file_without_a_name() {
        let model = presets::paper();
        let asked = Asked { logs: &[], motor: Motor::Right, seed: 7, file: "" };
        let commands: Vec<String> = runs(&model).iter().map(|run| run.command(&model, &asked)).collect();
        let sweep = "flqr simulate MODEL --scenario friction-sweep --controller pi --seconds 120 --seed 7 --motor right";
        assert_eq!(commands[0], format!("{sweep} --log next.csv"));
        let still = commands.iter().find(|command| command.contains("station")).unwrap();
        assert!(!still.contains("--motor"), "{still}");
    }

    /// Nothing that a robot can do tells a lag of the IMU: there is no force to compare.
    #[test]
    fn what_no_run_tells_apart_is_told_in_words() {
        let found = found("command_delay", &[("delay_s", 0.004)], "imu_delay");
        let next = asked(&found, Scenario::Station);
        assert!(next.command.is_none() && next.summary.contains("30 Hz"), "{next:?}");
    }
}
