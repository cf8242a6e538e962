//! A log at even times, and what it says of the machine at each row: local fits of what the sensors said around it.

use nalgebra::{DMatrix, DVector};

use super::{HORIZONS_S, Rows};
use crate::effects::MotionSample;
use crate::record::Log;
use crate::refine::robot::{at_even_times, fresh_rows};
use crate::refine::split::split_s;

/// Half of the window of a local fit: of the motors' and axes' angles, and of the IMU, s.
const ANGLE_HALF_S: f64 = 0.008;
const IMU_HALF_S: f64 = 0.03;

/// A log at even times.
pub(super) struct Record {
    pub(super) dt_s: f64,
    pub(super) time_s: Vec<f64>,
    /// Angles of both motors, or the one position of an axis.
    pub(super) angles: Vec<Vec<f64>>,
    pub(super) efforts: Vec<Vec<f64>>,
    /// Pitch and pitch rate of a robot, and the rows at which the IMU spoke.
    pub(super) imu: Option<(Vec<f64>, Vec<f64>, Vec<usize>)>,
    /// Rows after which time is missing, and rows without a number in every cell, in their order.
    broken: Vec<usize>,
}

/// Machine state at a row of a log.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told {
    pub(super) angle: [f64; 2],
    pub(super) speed: [f64; 2],
    pub(super) pitch: f64,
    pub(super) rate: f64,
}

/// Standard deviations of what it says.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scatter {
    pub(super) angle: f64,
    pub(super) speed: f64,
    pub(super) pitch: f64,
    pub(super) rate: f64,
}

impl Told {
    pub(super) fn is_finite(&self) -> bool {
        let pairs = [self.angle, self.speed, [self.pitch, self.rate]];
        pairs.as_flattened().iter().all(|value| value.is_finite())
    }
}

impl Record {
    pub(super) fn new(log: &Log, robot: bool) -> Option<Self> {
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
            log.column(name).map(|column| at_even_times(time, column, dt_s, rows, held))
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
            let fresh = fresh_rows(&pitch, &rate);
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

    /// Returns whether every cell of a row has a number.
    pub(super) fn is_whole(&self, row: usize) -> bool {
        let of_imu =
            self.imu.as_ref().is_none_or(|(pitch, rate, _)| pitch[row].is_finite() && rate[row].is_finite());
        of_imu && self.angles.iter().chain(&self.efforts).all(|column| column[row].is_finite())
    }

    pub(super) fn margin(&self) -> usize {
        (IMU_HALF_S / self.dt_s).ceil() as usize + self.angle_half()
    }

    fn angle_half(&self) -> usize {
        ((ANGLE_HALF_S / self.dt_s).round() as usize).max(3)
    }

    pub(super) fn ahead(&self, horizon_s: f64) -> usize {
        ((horizon_s / self.dt_s).round() as usize).max(1)
    }

    /// Rows to start from, a quarter of a second apart.
    pub(super) fn starts(&self, rows: Rows) -> Vec<usize> {
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

    pub(super) fn weights(&self) -> [f64; 2] {
        self.imu.as_ref().map_or([1.0; 2], |(pitch, rate, fresh)| {
            [pitch, rate].map(|column| {
                let said: Vec<f64> = fresh.iter().map(|&row| column[row]).collect();
                1.0 / noise_of(&said).powi(2)
            })
        })
    }

    pub(super) fn told(&self, row: usize, weights: [f64; 2]) -> Told {
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
    pub(super) fn scatter(&self) -> Scatter {
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
}

/// Every row of a bench log as a law sees it.
pub(in crate::refine) fn moments(log: &Log) -> Option<Vec<MotionSample>> {
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
    let moment = |row: usize| MotionSample {
        time_s: record.time_s[row],
        dt_s: record.dt_s,
        motor_angle_rad: record.angles[0][row],
        motor_speed_rad_s: speeds[row],
        motor_accel_rad_s2: accel(row),
        torque_nm: record.efforts[0][row],
        torque_sum_nm: record.efforts[0][row],
        ..MotionSample::default()
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
