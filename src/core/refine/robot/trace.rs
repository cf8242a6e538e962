//! Logs as rows of r1 and r2, and effects as columns over the same rows.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use crate::effects::{Action, EffectKind, Form, Law, Machine, MotionSample as Moment, Place, Term};
use crate::model::{Effect, Motor, RobotModel};
use crate::refine::split::split_s;

use super::health;
use super::kernel::Kernel;
use super::motion::{Loads, Motion, Readings, late_residual, of_action};
use super::waves;

/// What a row is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Fit,
    Gap,
    HeldOut,
}

/// Values in r1 and r2 at every row.
pub(super) type Pair = [Vec<f64>; 2];

/// A stretch of one log.
struct Piece {
    readings: Readings,
    motion: Motion,
    parts: Vec<Part>,
    /// r1 and r2 of the declared model alone, once somebody asks for them.
    plain: OnceLock<Pair>,
}

/// All rows.
pub(super) struct Trace<'a> {
    pub(super) robot: &'a RobotModel,
    pub(super) machine: Machine,
    pub(super) kernel: Kernel,
    pieces: Vec<Piece>,
}

/// Where the rows of one log stand.
pub(super) struct Run {
    pub(super) rows: std::ops::Range<usize>,
}

impl<'a> Trace<'a> {
    /// The logs as they were read.
    pub(super) fn readings(&self) -> impl Iterator<Item = &Readings> {
        self.pieces.iter().map(|piece| &piece.readings)
    }

    /// Rows of the logs; where none are held out, of each log its last third is.
    pub(super) fn new(robot: &'a RobotModel, training: Vec<Readings>, held_out: Vec<Readings>) -> Self {
        let dt_s = training.first().map_or(1e-3, |readings| readings.dt_s);
        let kernel = Kernel::new(dt_s);
        let split = held_out.is_empty();
        let parts = |readings: &Readings, fit: bool| -> Vec<Part> {
            let count = kernel.count(readings.rows());
            let row = |at_s: f64| (at_s / readings.dt_s).round() as usize;
            let [end, begin] = split_s(readings.rows() as f64 * readings.dt_s).map(row);
            let part = |row: usize| {
                let centre = kernel.centre(row);
                match (fit, split) {
                    (false, _) => Part::HeldOut,
                    (true, true) if centre >= begin => Part::HeldOut,
                    (true, true) if centre >= end => Part::Gap,
                    _ => Part::Fit,
                }
            };
            (0..count).map(part).collect()
        };
        let logs =
            training.into_iter().map(|log| (log, true)).chain(held_out.into_iter().map(|log| (log, false)));
        let pieces = logs
            .map(|(readings, fit)| {
                let motion = Motion::new(&readings, robot, &kernel, None);
                Piece { parts: parts(&readings, fit), readings, motion, plain: OnceLock::new() }
            })
            .collect();
        let mut trace = Self { robot, machine: Machine::robot(robot), kernel, pieces };
        trace.take_off_known();
        trace
    }

    /// Takes what the model's own effects do off the residual.
    fn take_off_known(&mut self) {
        let known: Vec<Vec<Pair>> = self
            .robot
            .effects
            .iter()
            .map(|effect| self.each(|piece| self.raw_effect(effect, piece)))
            .collect();
        for raw in &known {
            for (piece, raw) in self.pieces.iter_mut().zip(raw) {
                for (residual, raw) in piece.motion.residual.iter_mut().zip(raw) {
                    let known = self.kernel.apply(raw, 0);
                    residual.iter_mut().zip(&known).for_each(|(left, known)| *left -= known);
                }
            }
        }
    }

    fn each(&self, of: impl Fn(&Piece) -> Pair) -> Vec<Pair> {
        self.pieces.iter().map(of).collect()
    }

    fn raw_effect(&self, effect: &Effect, piece: &Piece) -> Pair {
        let kind = effect.kind();
        let motors: Vec<usize> = if kind.per_motor() {
            Motor::BOTH.into_iter().filter(|motor| effect.is_in(*motor)).map(|motor| motor as usize).collect()
        } else {
            vec![0]
        };
        self.raw_law(kind, &effect.law(&self.machine), piece, &motors)
    }

    /// All rows of some logs for fitting.
    pub(super) fn of_training(robot: &'a RobotModel, logs: Vec<Readings>) -> Self {
        let kernel = Kernel::new(logs.first().map_or(1e-3, |readings| readings.dt_s));
        let piece = |readings: Readings| {
            let motion = Motion::new(&readings, robot, &kernel, None);
            let parts = vec![Part::Fit; kernel.count(readings.rows())];
            Piece { parts, readings, motion, plain: OnceLock::new() }
        };
        let pieces = logs.into_iter().map(piece).collect();
        Self { robot, machine: Machine::robot(robot), kernel, pieces }
    }

    /// What was recorded for fitting: readings, the left motor's moments, and how many of their rows.
    pub(super) fn recorded(&self) -> Vec<(&Readings, &[Moment], usize)> {
        let of = |piece: &'_ Piece| piece.parts.iter().filter(|part| **part == Part::Fit).count();
        let used = self.pieces.iter().filter(|piece| of(piece) > 0);
        used.map(|piece| {
            let rows = self.kernel.centre(of(piece)).min(piece.readings.rows());
            (&piece.readings, piece.motion.moments[0].as_slice(), rows)
        })
        .collect()
    }

    /// Whether the robot moves in any of the logs.
    pub(super) fn moves(&self) -> bool {
        !self.pieces.iter().all(|piece| health::is_still(&piece.readings))
    }

    /// Time between rows of the logs, s.
    pub(super) fn row_s(&self) -> f64 {
        self.pieces.first().map_or(1e-3, |piece| piece.readings.dt_s)
    }

    /// Time between rows, s.
    pub(super) fn step_s(&self) -> f64 {
        self.pieces.first().map_or(1e-2, |piece| piece.readings.dt_s * self.kernel.thinning as f64)
    }

    /// What each row is for.
    pub(super) fn parts(&self) -> Vec<Part> {
        self.pieces.iter().flat_map(|piece| piece.parts.iter().copied()).collect()
    }

    /// Rows log by log.
    pub(super) fn runs(&self) -> Vec<Run> {
        let mut start = 0;
        let run = |piece: &Piece| {
            let rows = start..start + piece.parts.len();
            start = rows.end;
            Run { rows }
        };
        self.pieces.iter().map(run).collect()
    }

    /// r1 and r2 of the declared model.
    pub(super) fn residual(&self) -> Pair {
        [0, 1].map(|equation: usize| {
            self.pieces.iter().flat_map(|piece| piece.motion.residual[equation].iter().copied()).collect()
        })
    }

    /// T of both motors.
    pub(super) fn torque_nm(&self) -> Vec<f64> {
        self.pieces.iter().flat_map(|piece| piece.motion.torque_nm.iter().copied()).collect()
    }

    /// A variable at every row, from the left motor's moment.
    pub(super) fn variable(&self, of: impl Fn(&Moment) -> f64) -> Vec<f64> {
        let at = |piece: &Piece| -> Vec<f64> {
            (0..piece.parts.len()).map(|row| of(&piece.motion.moments[0][self.kernel.centre(row)])).collect()
        };
        self.pieces.iter().flat_map(at).collect()
    }

    /// Every moment of the left motor.
    pub(super) fn moments(&self) -> impl Iterator<Item = &Moment> {
        self.pieces.iter().flat_map(|piece| &piece.motion.moments[0])
    }

    /// The motion anew, with what effects add to it.
    pub(super) fn refill(&mut self, loads: &[Loads]) {
        for (piece, loads) in self.pieces.iter_mut().zip(loads) {
            piece.motion = Motion::new(&piece.readings, self.robot, &self.kernel, Some(loads));
        }
        self.take_off_known();
    }

    /// r1 and r2 of an arbitrary action over the rows; `action` makes a fresh law for each log.
    pub(super) fn pair<F: FnMut(&Moment) -> Action>(&self, mut action: impl FnMut() -> F) -> Pair {
        let mut found = [Vec::new(), Vec::new()];
        let radius = self.machine.parameters.wheel_radius_m;
        for piece in &self.pieces {
            let mut law = action();
            let mut raw = [Vec::new(), Vec::new()];
            for moment in &piece.motion.moments[0] {
                let [r1, r2] = of_action(&law(moment), moment.direction(), radius);
                raw[0].push(r1);
                raw[1].push(r2);
            }
            for (found, raw) in found.iter_mut().zip(&raw) {
                found.extend(self.kernel.apply(raw, 0));
            }
        }
        found
    }

    /// Unit columns of a kind in a form at shape parameters.
    pub(super) fn columns(&self, kind: &'static EffectKind, form: Form, shape: &[f64]) -> Vec<Pair> {
        match form {
            Form::Law => {
                let terms = kind.terms(&self.machine, shape);
                terms.iter().map(|term| self.term(kind, term)).collect()
            }
            Form::Forward(_) => {
                let terms = kind.terms(&self.machine, shape);
                let forward = |term: &Term| {
                    self.pair(|| {
                        let mut law = term.law.clone();
                        move |m: &Moment| {
                            let share = if m.motor_speed_rad_s > 0.0 { 2.0 } else { 0.0 };
                            Action::default().plus(share, &law.act(m))
                        }
                    })
                };
                terms.iter().map(forward).collect()
            }
            Form::Driven => vec![self.driven(shape)],
            Form::Wave => [0.0, 0.25]
                .map(|quarter| {
                    let (length_m, weight_n) = (shape[1], self.machine.weight_n());
                    self.pair(|| {
                        move |m: &Moment| {
                            let phase = TAU * (m.x_m / length_m - quarter);
                            Action::force(weight_n * TAU / length_m * libm::cos(phase), 0.0, 0.0)
                        }
                    })
                })
                .into(),
            Form::Late => vec![self.late(shape[0])],
        }
    }

    /// Unit columns of cos and sin of the orders `first`, `first` + 1, … of the motors' angle.
    pub(super) fn waves(
        &self,
        action: fn(f64, &Moment) -> Action,
        first: f64,
        count: usize,
    ) -> Vec<[Pair; 2]> {
        let mut found = vec![<[Pair; 2]>::default(); count];
        for piece in &self.pieces {
            let chain = (&self.kernel, self.machine.parameters.wheel_radius_m);
            waves::extend(&mut found, first, action, &piece.motion.moments, chain);
        }
        found
    }

    /// Torque that a part of the body on a spring adds, per inertia of the part.
    fn driven(&self, shape: &[f64]) -> Pair {
        let (omega, damping) = (TAU * shape[0], shape[1]);
        self.pair(|| {
            let (mut shift, mut speed) = (0.0, 0.0);
            move |m: &Moment| {
                let pull = omega * omega * shift + 2.0 * damping * omega * speed;
                let accel = -pull - m.pitch_accel_rad_s2;
                speed += m.dt_s * accel;
                shift += m.dt_s * speed;
                Action::body(pull + m.pitch_accel_rad_s2)
            }
        })
    }

    /// What the residual changes by where the IMU speaks late.
    fn late(&self, delay_s: f64) -> Pair {
        let mut found = [Vec::new(), Vec::new()];
        for piece in &self.pieces {
            let residual = |delay_s: f64| {
                late_residual(&piece.readings, &piece.motion.shafts, self.robot, &self.kernel, delay_s)
            };
            let (now, late) = (piece.plain.get_or_init(|| residual(0.0)), residual(delay_s));
            for (equation, found) in found.iter_mut().enumerate() {
                let pairs = now[equation].iter().zip(&late[equation]);
                found.extend(pairs.map(|(now, late)| now - late));
            }
        }
        found
    }

    fn raw_term(&self, kind: &'static EffectKind, term: &Term, piece: &Piece) -> Pair {
        let motors: &[usize] = if kind.per_motor() { &[0, 1] } else { &[0] };
        self.raw_law(kind, &*term.law, piece, motors)
    }

    fn raw_law(&self, kind: &'static EffectKind, law: &dyn Law, piece: &Piece, motors: &[usize]) -> Pair {
        let radius = self.machine.parameters.wheel_radius_m;
        let rows = piece.readings.rows();
        let mut raw = [vec![0.0; rows], vec![0.0; rows]];
        let moments = if kind.place == Place::Actuator { &piece.motion.asked } else { &piece.motion.moments };
        for moments in motors.iter().map(|&motor| &moments[motor]) {
            let mut law = law.boxed_clone();
            for (row, moment) in moments.iter().enumerate() {
                let [r1, r2] = of_action(&law.act(moment), moment.direction(), radius);
                raw[0][row] += r1;
                raw[1][row] += r2;
            }
        }
        if kind.place == Place::Actuator {
            // Torques act from their row on; the rows' own times are between two of them.
            for column in &mut raw {
                let mut before = column[0];
                for value in column.iter_mut() {
                    let now = *value;
                    *value = 0.5 * (now + before);
                    before = now;
                }
            }
        }
        raw
    }

    fn term(&self, kind: &'static EffectKind, term: &Term) -> Pair {
        let mut found = [Vec::new(), Vec::new()];
        for piece in &self.pieces {
            let raw = self.raw_term(kind, term, piece);
            for (found, raw) in found.iter_mut().zip(&raw) {
                found.extend(self.kernel.apply(raw, 0));
            }
        }
        found
    }

    /// What chosen effects add to the motion of each log: `terms` are laws with their coefficients.
    pub(super) fn loads(&self, chosen: &[(&'static EffectKind, Term, f64)]) -> Vec<Loads> {
        let radius = self.machine.parameters.wheel_radius_m;
        let of_piece = |piece: &Piece| {
            let rows = piece.readings.rows();
            let mut loads =
                Loads { shafts_nm: vec![0.0; rows], axle_n: vec![0.0; rows], body_nm: vec![0.0; rows] };
            let known = self
                .robot
                .effects
                .iter()
                .map(|effect| (effect.kind().per_motor(), self.raw_effect(effect, piece), 1.0));
            let chosen = chosen
                .iter()
                .map(|(kind, term, size)| (kind.per_motor(), self.raw_term(kind, term, piece), *size));
            for (in_motor, [r1, r2], size) in known.chain(chosen) {
                for row in 0..rows {
                    // The same accelerations come from a force at the axle and a torque on the body.
                    if in_motor {
                        loads.shafts_nm[row] += size * r1[row] * radius;
                    } else {
                        loads.axle_n[row] += size * r1[row];
                        loads.body_nm[row] += size * r2[row];
                    }
                }
            }
            loads
        };
        self.pieces.iter().map(of_piece).collect()
    }
}
