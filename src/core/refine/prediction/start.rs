//! One prediction: from a state of the log on, the machine let go under the recorded torques.

use super::moving::Moving;
use super::record::{Record, Scatter, Told};
use super::{HORIZONS_S, Rows};
use crate::simulate::{BenchPlant, FALL_PITCH_RAD, Forcing, Noise};

/// Longest step of the integration, s.
const STEP_S: f64 = 5e-4;

/// Error, motion and noise of each variable at each horizon, of one start.
pub(super) type Ends = Vec<Vec<[f64; 3]>>;

/// A state to start from, and the states that it led to.
pub(super) struct Start {
    dt_s: f64,
    time_s: f64,
    told: Told,
    /// Rows ahead, and what the log says there.
    ends: Vec<(usize, Told)>,
    efforts: Vec<Vec<f64>>,
}

impl Start {
    pub(super) fn errors(&self, moving: &Moving, scatter: &Scatter, seed: u64, stream: u64) -> Ends {
        let mut noise = Noise::new(seed, stream);
        let told = &self.told;
        let off = Told {
            angle: told.angle.map(|angle| angle + noise.normal(scatter.angle)),
            speed: told.speed.map(|speed| speed + noise.normal(scatter.speed)),
            pitch: told.pitch + noise.normal(scatter.pitch),
            rate: told.rate + noise.normal(scatter.rate),
        };
        let [free, disturbed] = [told, &off].map(|told| self.run(moving, told));
        let truth = self.ends.iter().map(|(_, end)| moving.variables(end));
        let start = moving.variables(told);
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

/// The machine shown all of the log, and stopped at each `every`th start.
pub(super) fn starts_of(
    record: &Record,
    mut moving: Moving,
    rows: Rows,
    every: usize,
) -> Vec<(Moving, Start)> {
    let weights = record.weights();
    let all = record.starts(rows);
    let chosen: Vec<usize> = all.into_iter().step_by(every).collect();
    let Some(&last) = chosen.last() else { return Vec::new() };
    let mut found = Vec::with_capacity(chosen.len());
    for row in 0..=last {
        if chosen.binary_search(&row).is_ok() {
            let told = record.told(row, weights);
            let ends = HORIZONS_S.map(|h| (record.ahead(h), record.told(row + record.ahead(h), weights)));
            let most = record.ahead(HORIZONS_S[HORIZONS_S.len() - 1]);
            let efforts = record.efforts.iter().map(|column| column[row..row + most].to_vec()).collect();
            // The IMU's rows around it may be outside of what was looked at for gaps.
            if told.is_finite() && ends.iter().all(|(_, end)| end.is_finite()) {
                let (dt_s, time_s) = (record.dt_s, record.time_s[row]);
                let start = Start { dt_s, time_s, told, ends: ends.to_vec(), efforts };
                found.push((moving.clone(), start));
            }
        }
        // A memory keeps what it has been shown.
        if record.is_whole(row) && record.is_whole((row + 1).min(record.time_s.len() - 1)) {
            moving.show(record, row);
        }
    }
    found
}
