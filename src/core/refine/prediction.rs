//! Short predictions: from the log's own states on, the model moves under the recorded torques, and its end is compared
//! with the log's.
//!
//! States of a log are local fits of what its sensors said around a row. Their noise is known from the readings' own
//! scatter; moved on by the model from a state that is off by so much, it gives the part of the error that is no fault of
//! the model's. A robot that balances is unstable: beyond a second that part is all there is.

use std::num::NonZeroUsize;

use nalgebra::{DMatrix, DVector};

use super::split::split_s;
use super::verdict::{Prediction, Quantity};
use crate::effects::{EffectLaw, Law, Machine, Moment, RobotLaws};
use crate::model_file::{AxisParameters, Model, Rig, RobotModel};
use crate::parallel;
use crate::record::Log;
use crate::robot::{Motor, State};
use crate::simulate::{Actuator, BenchPlant, FALL_PITCH_RAD, Followed, Forcing, Noise, Plant};

/// Lengths of the predictions, s.
const HORIZONS_S: [f64; 3] = [0.05, 0.2, 1.0];
/// Most starts in all logs together.
const STARTS: usize = 40;
/// Half of the window of a local fit: of the motors' and axes' angles, and of the IMU, s.
const ANGLE_HALF_S: f64 = 0.008;
const IMU_HALF_S: f64 = 0.03;
/// Longest step of the integration, s.
const STEP_S: f64 = 5e-4;

/// Which rows predictions start from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    All,
    LastThird,
}

/// Errors of the model's predictions; empty where the logs are too short for any.
pub(super) fn predictions(
    model: &Model,
    logs: &[Log],
    rows: Rows,
    motor: Motor,
    seed: u64,
) -> Vec<Prediction> {
    let robot = model.robot().filter(|_| logs.iter().all(|log| log.column("pitch_rad").is_some()));
    let records: Vec<Record> = logs.iter().filter_map(|log| Record::new(log, robot.is_some())).collect();
    let starts: usize = records.iter().map(|record| record.starts(rows).len()).sum();
    let every = starts.div_ceil(STARTS).max(1);
    let mut runs: Vec<(Moving, Scatter, Start)> = Vec::new();
    for record in &records {
        let scatter = record.scatter();
        let first = Moving::new(model, motor, robot.is_some());
        runs.extend(
            record.follow(first, rows, every).into_iter().map(|(moving, start)| (moving, scatter, start)),
        );
    }
    let places: Vec<usize> = (0..runs.len()).collect();
    let threads = NonZeroUsize::new(2).expect("2 is not 0");
    let errors = parallel::map(&places, threads, |&place| {
        let (moving, scatter, start) = &runs[place];
        start.errors(moving, scatter, seed, place as u64)
    });
    let names: &[(&'static str, &'static str)] = match (robot.is_some(), &model.rig) {
        (true, _) => &[("pitch_rad", "rad"), ("x_m", "m"), ("motor_angle_rad", "rad")],
        (false, Rig::Axis(axis)) if matches!(axis.parameters, AxisParameters::Linear { .. }) => {
            &[("position_m", "m")]
        }
        _ => &[("motor_angle_rad", "rad")],
    };
    summed(names, &errors)
}

/// Error, motion and noise of each variable at each horizon, of one start.
type Ends = Vec<Vec<[f64; 3]>>;

fn summed(names: &[(&'static str, &'static str)], runs: &[Ends]) -> Vec<Prediction> {
    let finite = |end: &[f64; 3]| end.iter().all(|value| value.is_finite());
    let mut found = Vec::new();
    for (place, (variable, unit)) in names.iter().enumerate() {
        for (horizon, horizon_s) in HORIZONS_S.into_iter().enumerate() {
            let ends: Vec<[f64; 3]> =
                runs.iter().filter_map(|run| run.get(horizon)?.get(place).copied()).filter(finite).collect();
            if ends.is_empty() {
                continue;
            }
            let rms = |n: usize| {
                let sum: f64 = ends.iter().map(|end| end[n] * end[n]).sum();
                Quantity::new((sum / ends.len() as f64).sqrt(), unit)
            };
            let [rmse, motion, noise_floor] = [0, 1, 2].map(rms);
            let told = noise_floor.value < motion.value;
            found.push(Prediction { variable, horizon_s, rmse, motion, noise_floor, told });
        }
    }
    found
}

/// A log at even times.
struct Record {
    dt_s: f64,
    time_s: Vec<f64>,
    /// Angles of both motors, or the one position of an axis.
    angles: Vec<Vec<f64>>,
    efforts: Vec<Vec<f64>>,
    /// Pitch and pitch rate of a robot, and the rows at which the IMU spoke.
    imu: Option<(Vec<f64>, Vec<f64>, Vec<usize>)>,
    /// Rows after which time is missing, and rows without a number in every cell, in their order.
    broken: Vec<usize>,
}

/// What a log says of the machine at a row.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    angle: [f64; 2],
    speed: [f64; 2],
    pitch: f64,
    rate: f64,
}

/// Standard deviations of what it says.
#[derive(Clone, Copy, Debug, Default)]
struct Scatter {
    angle: f64,
    speed: f64,
    pitch: f64,
    rate: f64,
}

impl Record {
    fn new(log: &Log, robot: bool) -> Option<Self> {
        let time = log.column("time_s")?;
        if time.len() < 20 {
            return None;
        }
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        let dt_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let rows = ((time[time.len() - 1] - time[0]) / dt_s).round() as usize + 1;
        let limit = 4 * time.len();
        // Slower than the shortest prediction.
        if !(dt_s > 0.0 && dt_s <= HORIZONS_S[0] && rows > 20 && rows < limit) {
            return None;
        }
        let even = |name: &str, held: bool| {
            log.column(name).map(|column| super::robot::at_even_times(time, column, dt_s, rows, held))
        };
        let names: [&[&str]; 2] = if robot {
            [&["motor_angle_left_rad", "motor_angle_right_rad"], &["torque_left_nm", "torque_right_nm"]]
        } else if log.column("motor_angle_rad").is_some() {
            [&["motor_angle_rad"], &["torque_nm"]]
        } else {
            [&["position_m"], &["force_n"]]
        };
        let [angles, efforts] = [(0, false), (1, true)].map(|(place, held): (usize, bool)| {
            names[place].iter().map(|name| even(name, held)).collect::<Option<Vec<_>>>()
        });
        let imu = if robot {
            let (pitch, rate) = (even("pitch_rad", true)?, even("pitch_rate_rad_s", true)?);
            let fresh = super::robot::fresh_rows(&pitch, &rate);
            Some((pitch, rate, fresh))
        } else {
            None
        };
        let time_s = (0..rows).map(|row| time[0] + row as f64 * dt_s).collect();
        let mut record = Self { dt_s, time_s, angles: angles?, efforts: efforts?, imu, broken: Vec::new() };
        let gaps = time.windows(2).filter(|pair| pair[1] - pair[0] > 3.0 * dt_s);
        let mut broken: Vec<usize> = gaps.map(|pair| ((pair[0] - time[0]) / dt_s) as usize).collect();
        broken.extend((0..rows).filter(|&row| !record.is_whole(row)));
        broken.sort_unstable();
        record.broken = broken;
        Some(record)
    }

    /// Whether every cell of a row has a number.
    fn is_whole(&self, row: usize) -> bool {
        let of_imu =
            self.imu.as_ref().is_none_or(|(pitch, rate, _)| pitch[row].is_finite() && rate[row].is_finite());
        of_imu && self.angles.iter().chain(&self.efforts).all(|column| column[row].is_finite())
    }

    fn margin(&self) -> usize {
        (IMU_HALF_S / self.dt_s).ceil() as usize + self.angle_half()
    }

    fn angle_half(&self) -> usize {
        ((ANGLE_HALF_S / self.dt_s).round() as usize).max(3)
    }

    fn ahead(&self, horizon_s: f64) -> usize {
        ((horizon_s / self.dt_s).round() as usize).max(1)
    }

    /// Rows to start from, a quarter of a second apart.
    fn starts(&self, rows: Rows) -> Vec<usize> {
        let count = self.time_s.len();
        let first = match rows {
            Rows::All => 0,
            Rows::LastThird => (split_s(count as f64 * self.dt_s)[1] / self.dt_s) as usize,
        };
        let (margin, ahead) = (self.margin(), self.ahead(HORIZONS_S[HORIZONS_S.len() - 1]));
        let step = ((0.25 / self.dt_s) as usize).max(1);
        let whole = |start: &usize| {
            let first = self.broken.partition_point(|&row| row + margin < *start);
            self.broken.get(first).is_none_or(|&row| row > start + ahead + margin)
        };
        let fresh = |start: usize| match &self.imu {
            Some((_, _, fresh)) => {
                fresh.get(fresh.partition_point(|&row| row < start)).copied().unwrap_or(start)
            }
            None => start,
        };
        let last = count.saturating_sub(ahead + 2 * margin + 1);
        let starts = (first + margin..last).step_by(step).map(fresh);
        // The next fresh row may be past the last start, or the same for two of them.
        let mut starts: Vec<usize> = starts.filter(|&start| start < last).filter(whole).collect();
        starts.dedup();
        starts
    }

    /// A straight or bent line through the angle around a row: value and slope.
    fn angle_at(&self, column: &[f64], row: usize) -> (f64, f64) {
        let half = self.angle_half() as isize;
        let (mut s0, mut s2, mut s4, mut y0, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for i in -half..=half {
            let t = i as f64 * self.dt_s;
            let y = column[(row as isize + i) as usize] - column[row];
            (s0, s2, s4) = (s0 + 1.0, s2 + t * t, s4 + t * t * t * t);
            (y0, y1, y2) = (y0 + y, y1 + t * y, y2 + t * t * y);
        }
        (column[row] + (y0 * s4 - y2 * s2) / (s0 * s4 - s2 * s2), y1 / s2)
    }

    /// Normal equations of pitch, rate, acceleration and jerk at a row from the IMU's readings around it.
    fn imu_fit(&self, row: usize, weights: [f64; 2]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (pitch, rate, fresh) = self.imu.as_ref()?;
        let half = (IMU_HALF_S / self.dt_s).ceil() as usize;
        let own = fresh.partition_point(|&other| other + half < row)
            ..fresh.partition_point(|&other| other <= row + half);
        let own = if own.len() < 5 {
            let middle = fresh.partition_point(|&other| other < row);
            middle.saturating_sub(2)..(middle + 3).min(fresh.len())
        } else {
            own
        };
        let (mut gram, mut right) = (DMatrix::zeros(4, 4), DVector::zeros(4));
        for &place in &fresh[own] {
            let t = (place as f64 - row as f64) * self.dt_s;
            let of_pitch = [1.0, t, 0.5 * t * t, t * t * t / 6.0];
            let of_rate = [0.0, 1.0, t, 0.5 * t * t];
            for (line, value, weight) in
                [(of_pitch, pitch[place], weights[0]), (of_rate, rate[place], weights[1])]
            {
                let line = DVector::from_row_slice(&line);
                right += weight * value * &line;
                gram += weight * &line * line.transpose();
            }
        }
        Some((gram, right))
    }

    fn weights(&self) -> [f64; 2] {
        self.imu.as_ref().map_or([1.0; 2], |(pitch, rate, fresh)| {
            [pitch, rate].map(|column| {
                let said: Vec<f64> = fresh.iter().map(|&row| column[row]).collect();
                1.0 / noise_of(&said).powi(2)
            })
        })
    }

    fn told(&self, row: usize, weights: [f64; 2]) -> Told {
        let mut told = Told::default();
        for motor in 0..2 {
            let column = self.angles.get(motor).unwrap_or(&self.angles[0]);
            (told.angle[motor], told.speed[motor]) = self.angle_at(column, row);
        }
        if let Some((gram, right)) = self.imu_fit(row, weights)
            && let Some(factors) = gram.cholesky()
        {
            let fit = factors.solve(&right);
            (told.pitch, told.rate) = (fit[0], fit[1]);
        }
        told
    }

    /// Noise of what is told, from the scatter of the readings.
    fn scatter(&self) -> Scatter {
        let noise = noise_of(&self.angles[0]);
        let half = self.angle_half() as isize;
        let times = || (-half..=half).map(|i| i as f64 * self.dt_s);
        let (s0, s2, s4) =
            times().fold((0.0, 0.0, 0.0), |(s0, s2, s4), t| (s0 + 1.0, s2 + t * t, s4 + t.powi(4)));
        let mut scatter = Scatter {
            angle: noise * (s4 / (s0 * s4 - s2 * s2)).sqrt(),
            speed: noise / f64::sqrt(s2),
            ..Scatter::default()
        };
        if let Some((gram, _)) = self.imu_fit(self.time_s.len() / 2, self.weights())
            && let Some(inverse) = gram.try_inverse()
        {
            (scatter.pitch, scatter.rate) = (inverse[(0, 0)].sqrt(), inverse[(1, 1)].sqrt());
        }
        scatter
    }

    /// The machine shown all of the log, and stopped at each `every`th start.
    fn follow(&self, mut moving: Moving, rows: Rows, every: usize) -> Vec<(Moving, Start)> {
        let weights = self.weights();
        let all = self.starts(rows);
        let chosen: Vec<usize> = all.into_iter().step_by(every).collect();
        let Some(&last) = chosen.last() else { return Vec::new() };
        let mut found = Vec::with_capacity(chosen.len());
        for row in 0..=last {
            if chosen.binary_search(&row).is_ok() {
                let told = self.told(row, weights);
                let ends = HORIZONS_S.map(|h| (self.ahead(h), self.told(row + self.ahead(h), weights)));
                let most = self.ahead(HORIZONS_S[HORIZONS_S.len() - 1]);
                let efforts = self.efforts.iter().map(|column| column[row..row + most].to_vec()).collect();
                // The IMU's rows around it may be outside of what was looked at for gaps.
                if told.is_finite() && ends.iter().all(|(_, end)| end.is_finite()) {
                    let (dt_s, time_s) = (self.dt_s, self.time_s[row]);
                    let start = Start { dt_s, time_s, told, ends: ends.to_vec(), efforts };
                    found.push((moving.clone(), start));
                }
            }
            // A memory keeps what it has been shown.
            if self.is_whole(row) && self.is_whole((row + 1).min(self.time_s.len() - 1)) {
                moving.show(self, row);
            }
        }
        found
    }
}

/// Every row of a bench log as a law sees it.
pub(super) fn moments(log: &Log) -> Option<Vec<Moment>> {
    let record = Record::new(log, false)?;
    let rows = record.time_s.len();
    let half = record.angle_half();
    let inside = |row: usize| row.clamp(half, (rows - 1).saturating_sub(half).max(half));
    if rows <= 2 * half {
        return None;
    }
    let speeds: Vec<f64> = (0..rows).map(|row| record.angle_at(&record.angles[0], inside(row)).1).collect();
    let accel = |row: usize| {
        let (before, after) = (row.saturating_sub(half), (row + half).min(rows - 1));
        (speeds[after] - speeds[before]) / ((after - before) as f64 * record.dt_s)
    };
    let moment = |row: usize| Moment {
        time_s: record.time_s[row],
        dt_s: record.dt_s,
        motor_angle_rad: record.angles[0][row],
        motor_speed_rad_s: speeds[row],
        motor_accel_rad_s2: accel(row),
        torque_nm: record.efforts[0][row],
        torque_sum_nm: record.efforts[0][row],
        ..Moment::default()
    };
    Some((0..rows).map(moment).collect())
}

/// Standard deviation of white noise in readings, from their third differences, which leave little of any motion.
fn noise_of(values: &[f64]) -> f64 {
    let mut bends: Vec<f64> =
        values.windows(4).map(|v| (v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]).abs()).collect();
    if bends.is_empty() {
        return 1.0;
    }
    let middle = bends.len() / 2;
    let noise = *bends.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745 / 20.0_f64.sqrt();
    // Readings in steps that stand still most of the time.
    let steps = values.windows(2).map(|v| (v[1] - v[0]).abs()).filter(|step| *step > 0.0);
    let step = steps.fold(f64::INFINITY, f64::min);
    let rounding = if step.is_finite() { step / 12.0_f64.sqrt() } else { 0.0 };
    noise.max(rounding.min(1e-3)).max(1e-9)
}

/// A machine that can be shown a log and be let go.
#[derive(Clone)]
enum Moving {
    Robot {
        plant: Box<Plant>,
        actuators: [Actuator; 2],
        offsets: [f64; 2],
        radius_m: f64,
    },
    Axis {
        inertia: f64,
        gravity: f64,
        friction: Option<crate::friction::Stribeck>,
        laws: Vec<EffectLaw>,
        before: f64,
    },
}

impl Moving {
    fn new(model: &Model, motor: Motor, robot_log: bool) -> Self {
        match &model.rig {
            Rig::Robot(robot) if robot_log => {
                let robot: RobotModel = robot.with_effects_declared();
                let sensors = &robot.sensors;
                Self::Robot {
                    actuators: [(); 2].map(|()| Actuator::new(&robot.limits, &robot.actuation)),
                    offsets: [sensors.imu_mount_angle_rad, sensors.gyro_bias_rad_s],
                    radius_m: robot.parameters.wheel_radius_m,
                    plant: Box::new(Plant::new(&robot, &State::default())),
                }
            }
            Rig::Robot(robot) => {
                let laws = RobotLaws::new(&Machine::wheel_in_air(robot), &robot.effects);
                Self::Axis {
                    inertia: robot.parameters.wheel_inertia_kg_m2,
                    gravity: 0.0,
                    friction: robot.friction[motor as usize],
                    laws: laws.into_motor(motor),
                    before: 0.0,
                }
            }
            Rig::Axis(axis) => {
                let machine = Machine::axis(axis);
                let (inertia, gravity, friction) = match axis.parameters {
                    AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction } => {
                        (inertia_kg_m2, gravity_torque_nm, friction)
                    }
                    AxisParameters::Linear { mass_kg, friction } => (mass_kg, 0.0, friction),
                };
                let laws = axis.effects.iter().map(|effect| effect.law(&machine)).collect();
                Self::Axis { inertia, gravity, friction, laws, before: 0.0 }
            }
        }
    }

    /// Lets what has a memory remember a row.
    fn show(&mut self, record: &Record, row: usize) {
        let dt = record.dt_s;
        let after = (row + 1).min(record.time_s.len() - 1);
        let speed = |column: &[f64]| (column[after] - column[row]) / dt;
        match self {
            Self::Robot { plant, actuators, offsets, radius_m } => {
                let speeds = [0, 1].map(|motor: usize| speed(&record.angles[motor]));
                let torque_nm = [0, 1]
                    .map(|motor: usize| actuators[motor].step(record.efforts[motor][row], speeds[motor]));
                let Some((pitch, rate, _)) = &record.imu else { return };
                let told = Told {
                    angle: [0, 1].map(|motor: usize| record.angles[motor][row]),
                    speed: speeds,
                    pitch: pitch[row],
                    rate: rate[row],
                };
                plant.follow(&told.of_robot(*offsets, *radius_m), torque_nm, dt);
            }
            Self::Axis { laws, before, .. } => {
                let speed = speed(&record.angles[0]);
                let moment = Moment {
                    time_s: record.time_s[row],
                    dt_s: dt,
                    motor_angle_rad: record.angles[0][row],
                    motor_speed_rad_s: speed,
                    motor_accel_rad_s2: (speed - *before) / dt,
                    torque_nm: record.efforts[0][row],
                    ..Moment::default()
                };
                *before = speed;
                laws.iter_mut().for_each(|law| {
                    law.act(&moment);
                });
            }
        }
    }
}

impl Told {
    fn is_finite(&self) -> bool {
        let pairs = [self.angle, self.speed, [self.pitch, self.rate]];
        pairs.as_flattened().iter().all(|value| value.is_finite())
    }

    /// As the simulated robot takes it, readings' offsets off.
    fn of_robot(&self, [mount, bias]: [f64; 2], radius_m: f64) -> Followed {
        let (pitch_rad, pitch_rate_rad_s) = (self.pitch - mount, self.rate - bias);
        let mean = |pair: [f64; 2]| 0.5 * (pair[0] + pair[1]);
        Followed {
            state: State {
                x_m: radius_m * (mean(self.angle) + pitch_rad),
                x_dot_m_s: radius_m * (mean(self.speed) + pitch_rate_rad_s),
                pitch_rad,
                pitch_rate_rad_s,
            },
            motor_angle_rad: self.angle,
            motor_speed_rad_s: self.speed,
        }
    }
}

/// A state to start from, and the states that it led to.
struct Start {
    dt_s: f64,
    time_s: f64,
    told: Told,
    /// Rows ahead, and what the log says there.
    ends: Vec<(usize, Told)>,
    efforts: Vec<Vec<f64>>,
}

impl Start {
    fn errors(&self, moving: &Moving, scatter: &Scatter, seed: u64, stream: u64) -> Ends {
        let mut noise = Noise::new(seed, stream);
        let told = &self.told;
        let off = Told {
            angle: told.angle.map(|angle| angle + noise.normal(scatter.angle)),
            speed: told.speed.map(|speed| speed + noise.normal(scatter.speed)),
            pitch: told.pitch + noise.normal(scatter.pitch),
            rate: told.rate + noise.normal(scatter.rate),
        };
        let [free, disturbed] = [told, &off].map(|told| self.run(moving, told));
        let truth = self.ends.iter().map(|(_, end)| values(moving, end));
        let start = values(moving, told);
        let reading = match moving {
            Moving::Robot { radius_m, .. } => {
                vec![scatter.pitch, radius_m * scatter.angle.hypot(scatter.pitch), scatter.angle]
            }
            Moving::Axis { .. } => vec![scatter.angle],
        };
        truth
            .zip(free.iter().zip(&disturbed))
            .map(|(truth, (free, disturbed))| {
                // Where noise at the start may have thrown the robot over, it may be the cause of all of the error.
                let thrown = matches!(moving, Moving::Robot { .. })
                    && (free[0].abs() >= FALL_PITCH_RAD || disturbed[0].abs() >= FALL_PITCH_RAD);
                let of = |n: usize| {
                    let error = free[n] - truth[n];
                    let noise = (disturbed[n] - free[n]).hypot(reading[n]);
                    [error, truth[n] - start[n], if thrown { noise.max(error.abs()) } else { noise }]
                };
                (0..truth.len()).map(of).collect()
            })
            .collect()
    }

    /// Variables at the horizons.
    fn run(&self, moving: &Moving, told: &Told) -> Vec<Vec<f64>> {
        let substeps = (self.dt_s / STEP_S).ceil().clamp(1.0, 100.0) as u32;
        match moving.clone() {
            Moving::Robot { mut plant, mut actuators, offsets, radius_m } => {
                plant.let_go(&told.of_robot(offsets, radius_m));
                let mut seen = Vec::new();
                let step = |row: usize| {
                    // One that has fallen lies there.
                    if plant.state().pitch_rad.abs() < FALL_PITCH_RAD || seen.is_empty() {
                        let speeds = plant.motor_speed_rad_s();
                        let torque_nm = [0, 1].map(|motor: usize| {
                            actuators[motor].step(self.efforts[motor][row], speeds[motor])
                        });
                        plant.advance(&Forcing { torque_nm, ..Forcing::default() }, self.dt_s, substeps);
                        let (state, [left, right]) = (plant.state(), plant.motor_angle_rad());
                        let x_m = state.x_m + radius_m * offsets[0];
                        seen = vec![state.pitch_rad + offsets[0], x_m, 0.5 * (left + right)];
                    }
                    seen.clone()
                };
                self.ends_of(step)
            }
            Moving::Axis { inertia, gravity, friction, laws, .. } => {
                let mut shaft = BenchPlant::new(inertia, gravity, friction, told.angle[0], told.speed[0])
                    .with_effects(laws)
                    .at_time(self.time_s);
                self.ends_of(|row| {
                    shaft.advance(self.efforts[0][row], self.dt_s, substeps);
                    vec![shaft.angle_rad()]
                })
            }
        }
    }

    fn ends_of(&self, mut step: impl FnMut(usize) -> Vec<f64>) -> Vec<Vec<f64>> {
        let mut found = Vec::with_capacity(self.ends.len());
        let mut row = 0;
        for (ahead, _) in &self.ends {
            let mut now = Vec::new();
            while row < *ahead {
                now = step(row);
                row += 1;
            }
            found.push(now);
        }
        found
    }
}

/// Variables as the log says them: pitch, x and motor angle, or the one of an axis.
fn values(moving: &Moving, told: &Told) -> Vec<f64> {
    match moving {
        Moving::Robot { radius_m, .. } => {
            let mean = 0.5 * (told.angle[0] + told.angle[1]);
            vec![told.pitch, radius_m * (mean + told.pitch), mean]
        }
        Moving::Axis { .. } => vec![told.angle[0]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::presets;

    fn bench(dt_s: f64, rows: usize, change: impl Fn(&mut Vec<f64>)) -> Log {
        let time: Vec<f64> = (0..rows).map(|row| row as f64 * dt_s).collect();
        let angle = time.iter().map(|t| libm::sin(*t)).collect();
        let mut torque: Vec<f64> = time.iter().map(|t| 0.01 * libm::cos(*t)).collect();
        change(&mut torque);
        Log::from_columns("made", [("time_s", time), ("motor_angle_rad", angle), ("torque_nm", torque)])
    }

    fn told(log: &Log) -> Vec<Prediction> {
        predictions(&presets::paper(), std::slice::from_ref(log), Rows::All, Motor::Left, 1)
    }

    #[test]
    fn rows_slower_than_the_shortest_prediction_give_none() {
        assert_eq!(told(&bench(0.2, 400, |_| ())), []);
        assert_eq!(told(&bench(0.04, 1000, |_| ())).len(), 3);
    }

    #[test]
    fn cells_without_a_number_are_gone_round() {
        let clean = told(&bench(1e-3, 8000, |_| ()));
        let holed = told(&bench(1e-3, 8000, |torque| torque[1000] = f64::NAN));
        assert_eq!(holed.len(), clean.len());
        for value in holed.iter().flat_map(|p| [&p.rmse, &p.motion, &p.noise_floor]) {
            assert!(value.value.is_finite(), "{holed:?}");
        }
        assert_eq!(told(&bench(1e-3, 8000, |torque| torque.fill(f64::NAN))), []);
    }

    /// The next reading of a slow IMU may be after the last row that a prediction can start from.
    #[test]
    fn no_start_is_moved_past_the_end_by_a_slow_imu() {
        for rows in (2500..2600).step_by(7) {
            let time: Vec<f64> = (0..rows).map(|row| f64::from(row) * 1e-3).collect();
            let of = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
            let held = |t: f64| (t * 10.0 + 1e-6).floor() / 10.0;
            let log = Log::from_columns(
                "made",
                [
                    ("motor_angle_left_rad", of(&|t| t)),
                    ("motor_angle_right_rad", of(&|t| t)),
                    ("torque_left_nm", of(&|_| 0.0)),
                    ("torque_right_nm", of(&|_| 0.0)),
                    ("pitch_rad", of(&|t| 0.01 * libm::sin(held(t)))),
                    ("pitch_rate_rad_s", of(&|t| 0.01 * libm::cos(held(t)))),
                    ("time_s", time.clone()),
                ],
            );
            let record = Record::new(&log, true).unwrap();
            let starts = record.starts(Rows::All);
            assert!(starts.is_sorted_by(|a, b| a < b), "{starts:?}");
            let last = starts.last().unwrap() + record.ahead(1.0) + record.margin();
            assert!(last < rows as usize, "{starts:?}");
            assert_eq!(told(&log).len(), 9);
        }
    }
}
