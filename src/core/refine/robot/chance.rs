//! What chance does: clean robots, simulated under the log's own excitation and passed through the same chain.
//!
//! The declared model, with the corrections that the log asks for, is driven by the recorded torques and held on the
//! recorded path by the feedback of its own LQR on what its simulated sensors say less what the recorded ones said: of a
//! robot under that controller the recorded sensors' noise cancels, and that of the simulated ones takes its place. Rates,
//! holds and steps of the readings are the log's; the strength of random loads and of the gyro's noise is set so that
//! the residuals' noise is as strong as the log's.

use std::num::NonZeroUsize;

use nalgebra::{Matrix2, Matrix4};

use crate::effects::Moment;
use crate::lqr::{self, Weights};
use crate::model_file::{RobotModel, Tolerances};
use crate::parallel;
use crate::robot::{RobotParameters, State};
use crate::simulate::noise::Noise;
use crate::simulate::{Forcing, PlanarPlant};

use super::candidates::library;
use super::channels::Channels;
use super::motion::Readings;
use super::nuisance::{Nuisance, nuisances};
use super::search::{Search, whitened};
use super::trace::Trace;

/// Clean robots, and the share of such sets of effects that the largest of them may exceed.
const ROBOTS: u64 = 10;
const LEVEL: f64 = 0.01;
/// Spread of the largest of many gains: that of the largest of many χ² is 2, and no fewer are believed.
const LEAST_SPREAD: f64 = 2.0;
/// First guesses of the random force, N, torque, N m, and of the gyro's noise, rad/s, in a row.
const FIRST: Levels = Levels { force_n: 1.0, torque_nm: 0.05, rate_rad_s: 5e-4 };
const THREADS: NonZeroUsize = NonZeroUsize::new(4).expect("four");
/// Steps of the plant in a row.
const SUBSTEPS: u32 = 2;

/// Strength of what is random.
#[derive(Clone, Copy)]
struct Levels {
    force_n: f64,
    torque_nm: f64,
    rate_rad_s: f64,
}

/// Gain that the largest of all effects exceeds in one of a hundred clean robots; 0 where none can be simulated.
pub(super) fn largest_gain(
    trace: &Trace,
    known: &Tolerances,
    channels: &Channels,
    corrections: &[(&Nuisance, f64)],
    seed: u64,
) -> f64 {
    let Some(twin) = Twin::new(trace, known, corrections) else { return 0.0 };
    let Some(levels) = twin.levels(channels.floors, seed) else { return 0.0 };
    let seeds: Vec<u64> =
        (1..=ROBOTS).map(|robot| seed.wrapping_mul(ROBOTS + 1).wrapping_add(robot)).collect();
    let gains: Vec<f64> =
        parallel::map(&seeds, THREADS, |&seed| twin.largest(levels, seed)).into_iter().flatten().collect();
    quantile_of_largest(&gains)
}

/// Quantile 1 − [`LEVEL`] of a Gumbel distribution through the largest gains by their mean and spread.
fn quantile_of_largest(gains: &[f64]) -> f64 {
    if gains.len() < 3 {
        return 0.0;
    }
    const EULER: f64 = 0.577_215_664_901_532_9;
    let count = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let spread = (variance.sqrt() * 6_f64.sqrt() / std::f64::consts::PI).max(LEAST_SPREAD);
    mean + spread * (-libm::log(-libm::log1p(-LEVEL)) - EULER)
}

/// The robot that stands in for the recorded one.
struct Twin<'a> {
    robot: RobotModel,
    gain: [f64; 4],
    known: &'a Tolerances,
    logs: Vec<(&'a Readings, &'a [Moment], usize)>,
}

impl<'a> Twin<'a> {
    fn new(trace: &'a Trace, known: &'a Tolerances, corrections: &[(&Nuisance, f64)]) -> Option<Self> {
        let mut robot = trace.robot.clone();
        // Its simulated IMU speaks at once.
        robot.sensors.imu_latency_s = 0.0;
        let value = |key: &str, declared: f64| {
            corrections.iter().find(|(n, _)| n.key == key).map_or(declared, |(n, off)| n.declared + off)
        };
        let p = robot.parameters;
        let corrected = RobotParameters {
            body_mass_kg: value("body_mass_kg", p.body_mass_kg),
            com_height_m: value("com_height_m", p.com_height_m),
            body_inertia_kg_m2: value("body_inertia_kg_m2", p.body_inertia_kg_m2),
            wheel_inertia_kg_m2: value("wheel_inertia_kg_m2", p.wheel_inertia_kg_m2),
            wheel_mass_kg: value("wheel_mass_kg", p.wheel_mass_kg),
            ..p
        };
        if corrected.validate().is_ok() {
            robot.parameters = corrected;
        }
        let weights = robot.weights.unwrap_or(Weights { q: Matrix4::identity(), r: Matrix2::identity() });
        let design = lqr::design(&robot.parameters.linear_model(), &weights).ok()?;
        let gain = [0, 1, 2, 3].map(|state: usize| design.gain[(0, state)]);
        Some(Self { robot, gain, known, logs: trace.recorded() })
    }

    /// Strengths at which the residuals' noise is that of the log.
    fn levels(&self, floors: [f64; 3], seed: u64) -> Option<Levels> {
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

    fn trace(&self, levels: Levels, seed: u64) -> Option<Trace<'_>> {
        let logs =
            self.logs.iter().zip(0..).map(|(log, number)| self.simulated(log, levels, seed, 4 * number));
        Some(Trace::of_training(&self.robot, logs.collect::<Option<_>>()?))
    }

    /// The largest gain that anything has in one clean robot.
    fn largest(&self, levels: Levels, seed: u64) -> Option<f64> {
        let trace = self.trace(levels, seed)?;
        let target = trace.residual();
        let channels = Channels::new(&trace, &target);
        let (mut free, mut tried) = (nuisances(&trace, self.known, &[]), library(&trace));
        whitened(&mut tried, &mut free, &channels);
        Some(Search::new(&trace, &channels, &free, &tried, &target, &|| 0.0).largest())
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
            let way = |angle: [f64; 2], pitch: f64| p.wheel_radius_m * (0.5 * (angle[0] + angle[1]) + pitch);
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
            log.x_m.push(recorded.x_m[0] + way(angle, said[0]));
            log.pitch_rad.push(said[0]);
            log.rate_rad_s.push(said[1]);
            for motor in 0..2 {
                log.angle_rad[motor].push(angle[motor]);
                log.torque_nm[motor].push(asked[motor]);
            }
            let random = torque.normal(levels.torque_nm);
            let forcing = Forcing {
                torque_nm: [asked[0] + random, asked[1]],
                push_n: force.normal(levels.force_n),
                push_height_m: 0.0,
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
