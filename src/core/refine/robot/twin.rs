//! A robot that stands in for the recorded one, simulated under the log's own excitation.
//!
//! The declared model, with the corrections that the log asks for, is driven by the recorded torques and held on the
//! recorded path by the feedback of its own LQR on what its simulated sensors say less what the recorded ones said: of a
//! robot under that controller the recorded sensors' noise cancels, and that of the simulated ones takes its place. Rates,
//! holds and steps of the readings are the log's; the strength of random loads and of the gyro's noise is set so that
//! the residuals' noise is as strong as the log's.

use nalgebra::{Matrix2, Matrix4};

use crate::effects::{Declared, EffectKind, Law, MotionSample as Moment, Place, Term};
use crate::lqr::{self};
use crate::model::{Effect, MachineKind, ModelParameter, RobotModel, State, Weights};
use crate::simulate::{Forcing, Noise, PlanarPlant};

use super::channels::Channels;
use super::motion::Readings;
use super::nuisance::{Known, Nuisance};
use super::trace::Trace;

/// First guesses of the random force, N, torque, N m, and of the gyro's noise, rad/s, in a row.
const FIRST: Levels = Levels { force_n: 1.0, torque_nm: 0.05, rate_rad_s: 5e-4 };
/// Steps of the plant in a row.
const SUBSTEPS: u32 = 2;

/// Strength of what is random.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    force_n: f64,
    torque_nm: f64,
    rate_rad_s: f64,
}

/// The robot that stands in for the recorded one.
pub(super) struct Twin<'a> {
    /// What the chain is told of it. What else the model declares, readings and residual are free of.
    declared: RobotModel,
    robot: RobotModel,
    /// What acts beside: laws with their sizes.
    acting: Vec<(&'static EffectKind, Term, f64)>,
    gain: [f64; 4],
    pub(super) known: Known<'a>,
    logs: Vec<(&'a Readings, &'a [Moment], usize)>,
}

impl<'a> Twin<'a> {
    pub(super) fn new(trace: &'a Trace, known: Known<'a>, corrections: &[(&Nuisance, f64)]) -> Option<Self> {
        let mut declared = trace.robot.clone();
        declared.effects.clear();
        declared.sensors.imu_latency_s = 0.0;
        let mut robot = declared.clone();
        let value = |key: &str, declared: f64| {
            corrections.iter().find(|(n, _)| n.key == key).map_or(declared, |(n, off)| n.corrected(*off))
        };
        let mut corrected = robot.parameters;
        for (row, place) in ModelParameter::of_robot() {
            let number = place(&mut corrected);
            *number = value(row.key, *number);
        }
        if corrected.validate().is_ok() {
            robot.parameters = corrected;
        }
        let weights = robot.weights.unwrap_or(Weights { q: Matrix4::identity(), r: Matrix2::identity() });
        let design = lqr::design(&robot.parameters.linear_model(), &weights).ok()?;
        let gain = [0, 1, 2, 3].map(|state: usize| design.gain[(0, state)]);
        Some(Self { declared, robot, acting: Vec::new(), gain, known, logs: trace.recorded() })
    }

    /// The same with effects: those of declared numbers are put there. None where the numbers would be impossible.
    pub(super) fn with(mut self, effects: Vec<(&'static EffectKind, Term, f64)>) -> Option<Self> {
        for (kind, term, size) in effects {
            if kind.place != Place::Parameter {
                self.acting.push((kind, term, size));
                continue;
            }
            let effect = Effect::estimated(kind, MachineKind::Robot, None, &[], &[size]).ok()?;
            if !effect.declare_in(Declared::Robot(&mut self.robot)) {
                return None;
            }
        }
        Some(self)
    }

    /// Strengths at which the residuals' noise is that of the log.
    pub(super) fn levels(&self, floors: [f64; 3], seed: u64) -> Option<Levels> {
        let mut levels = FIRST;
        for _ in 0..2 {
            let trace = self.trace(levels, seed)?;
            let found = Channels::new(&trace, &trace.residual()).floors;
            let along = floors[0] / found[0];
            let about = floors[2] / found[2];
            if !(along.is_finite() && about.is_finite()) {
                return None;
            }
            levels.force_n *= along;
            levels.torque_nm *= along;
            levels.rate_rad_s *= about;
        }
        Some(levels)
    }

    pub(super) fn trace(&self, levels: Levels, seed: u64) -> Option<Trace<'_>> {
        let logs =
            self.logs.iter().zip(0..).map(|(log, number)| self.simulated(log, levels, seed, 4 * number));
        Some(Trace::of_training(&self.declared, logs.collect::<Option<_>>()?))
    }

    /// A log of the robot as declared; none where it falls.
    fn simulated(
        &self,
        &(recorded, moments, rows): &(&Readings, &[Moment], usize),
        levels: Levels,
        seed: u64,
        stream: u64,
    ) -> Option<Readings> {
        let p = &self.robot.parameters;
        let [mut force, mut torque, mut rate] = [0, 1, 2].map(|i| Noise::new(seed, stream + i));
        let start = &moments[0];
        let mut plant = PlanarPlant::new(
            p,
            self.robot.friction,
            &State {
                x_m: start.x_m,
                x_dot_m_s: start.x_dot_m_s,
                pitch_rad: start.pitch_rad,
                pitch_rate_rad_s: start.pitch_rate_rad_s,
            },
        );
        let steps = Steps::new(recorded);
        let zero = recorded.angle_rad.each_ref().map(|angle| angle[0] - plant.motor_angle_rad());
        let way = |angle: [f64; 2], pitch: f64| p.wheel_radius_m * (0.5 * (angle[0] + angle[1]) + pitch);
        let way_at_start = way(recorded.angle_rad.each_ref().map(|angle| angle[0]), start.pitch_rad);
        let mut effects = Acting::new(&self.acting, zero);
        let mut log = recorded.emptied(rows);
        let (mut fresh, mut said) = (recorded.fresh.iter().copied().peekable(), [0.0; 2]);
        for (row, moment) in moments.iter().enumerate().take(rows) {
            let state = plant.state();
            if fresh.next_if_eq(&row).is_some() {
                said = [
                    rounded(state.pitch_rad, steps.pitch),
                    rounded(state.pitch_rate_rad_s + rate.normal(levels.rate_rad_s), steps.rate),
                ];
                log.fresh.push(row);
            }
            let angle =
                [0, 1].map(|motor: usize| rounded(plant.motor_angle_rad() + zero[motor], steps.angle));
            let was = [recorded.pitch_rad[row], recorded.rate_rad_s[row]];
            let off = [
                way(angle, said[0]) - way([recorded.angle_rad[0][row], recorded.angle_rad[1][row]], was[0]),
                p.wheel_radius_m * (plant.motor_speed_rad_s() + said[1] - moment.motor_speed_rad_s - was[1]),
                said[0] - was[0],
                said[1] - was[1],
            ];
            let back: f64 = self.gain.iter().zip(off).map(|(gain, off)| gain * off).sum();
            let asked =
                [0, 1].map(|motor: usize| rounded(recorded.torque_nm[motor][row] - back, steps.torque));
            log.time_s.push(recorded.time_s[row]);
            log.x_m.push(start.x_m + way(angle, said[0]) - way_at_start);
            log.pitch_rad.push(said[0]);
            log.rate_rad_s.push(said[1]);
            for motor in 0..2 {
                log.angle_rad[motor].push(angle[motor]);
                log.torque_nm[motor].push(asked[motor]);
            }
            let added = effects.act(&plant, asked, recorded.time_s[row], recorded.dt_s);
            let random = torque.normal(levels.torque_nm);
            let push_n = force.normal(levels.force_n) + added.axle_n;
            let forcing = Forcing {
                torque_nm: [asked[0] + random + added.motor_nm[0], asked[1] + added.motor_nm[1]],
                push_n,
                // A torque on the body is the force higher up; where there is no force, there is none.
                push_height_m: if push_n == 0.0 { 0.0 } else { added.body_nm / push_n },
            };
            plant.advance(&forcing, recorded.dt_s, SUBSTEPS);
            if state.pitch_rad.abs() > 1.0 || !state.pitch_rad.is_finite() {
                return None;
            }
        }
        Some(log)
    }
}

/// Steps of the readings: the smallest change of each.
struct Steps {
    pitch: f64,
    rate: f64,
    angle: f64,
    torque: f64,
}

impl Steps {
    fn new(log: &Readings) -> Self {
        Self {
            pitch: smallest_step(&log.pitch_rad),
            rate: smallest_step(&log.rate_rad_s),
            angle: smallest_step(&log.angle_rad[0]),
            torque: smallest_step(&log.torque_nm[0]),
        }
    }
}

fn smallest_step(column: &[f64]) -> f64 {
    let steps = column.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 1e-9);
    let smallest = steps.fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

fn rounded(value: f64, step: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}

/// Effects on the simulated robot, held over a row at what they are at its beginning.
struct Acting {
    laws: Vec<Actor>,
    zero_rad: [f64; 2],
    before: Option<State>,
}

/// A law with its size, once for each motor where each has its own.
struct Actor {
    per_motor: bool,
    size: f64,
    laws: [Box<dyn Law>; 2],
}

/// What they add.
#[derive(Default)]
struct Added {
    motor_nm: [f64; 2],
    axle_n: f64,
    body_nm: f64,
}

impl Acting {
    fn new(effects: &[(&'static EffectKind, Term, f64)], zero_rad: [f64; 2]) -> Self {
        let law = |(kind, term, size): &(&'static EffectKind, Term, f64)| Actor {
            per_motor: kind.per_motor(),
            size: *size,
            laws: [term.law.clone(), term.law.clone()],
        };
        Self { laws: effects.iter().map(law).collect(), zero_rad, before: None }
    }

    fn act(&mut self, plant: &PlanarPlant, asked: [f64; 2], time_s: f64, dt_s: f64) -> Added {
        if self.laws.is_empty() {
            return Added::default();
        }
        let state = plant.state();
        let before = self.before.replace(state).unwrap_or(state);
        let x_accel_m_s2 = (state.x_dot_m_s - before.x_dot_m_s) / dt_s;
        let pitch_accel_rad_s2 = (state.pitch_rate_rad_s - before.pitch_rate_rad_s) / dt_s;
        let moments = [0, 1].map(|motor: usize| Moment {
            time_s,
            dt_s,
            motor_angle_rad: plant.motor_angle_rad() + self.zero_rad[motor],
            motor_speed_rad_s: plant.motor_speed_rad_s(),
            torque_nm: asked[motor],
            torque_sum_nm: asked[0] + asked[1],
            x_m: state.x_m,
            x_dot_m_s: state.x_dot_m_s,
            x_accel_m_s2,
            pitch_rad: state.pitch_rad,
            pitch_rate_rad_s: state.pitch_rate_rad_s,
            pitch_accel_rad_s2,
            ..Moment::default()
        });
        let mut added = Added::default();
        for Actor { per_motor, size, laws } in &mut self.laws {
            if *per_motor {
                for ((law, moment), sum) in laws.iter_mut().zip(&moments).zip(&mut added.motor_nm) {
                    *sum += *size * law.act(moment).on_motor_nm(moment.direction());
                }
            } else {
                let action = laws[0].act(&moments[0]);
                added.axle_n += *size * action.axle_n;
                added.body_nm += *size * action.body_nm;
            }
        }
        added
    }
}
