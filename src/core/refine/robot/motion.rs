//! What a robot's log says of its motion, row by row: the IMU's held readings are filled with the motion that the
//! model makes of the torques in between.

use crate::effects::{Action, MotionSample as Moment};
use crate::friction::Stribeck;
use crate::model::{Accelerations, Coefficients, RobotModel};
use crate::record::Log;

use super::kernel::Kernel;
use super::smooth;

/// Half the window of the speed that is taken from the encoders, s.
const SPEED_HALF_S: f64 = 0.012;

/// Columns of a log at even times.
#[derive(Clone, Debug)]
pub(super) struct Readings {
    pub(super) dt_s: f64,
    pub(super) time_s: Vec<f64>,
    pub(super) x_m: Vec<f64>,
    pub(super) pitch_rad: Vec<f64>,
    pub(super) rate_rad_s: Vec<f64>,
    pub(super) angle_rad: [Vec<f64>; 2],
    pub(super) torque_nm: [Vec<f64>; 2],
    /// Rows at which the IMU spoke.
    pub(super) fresh: Vec<usize>,
}

/// Names of the columns that are read.
pub(super) const COLUMNS: [&str; 8] = [
    "time_s",
    "x_m",
    "pitch_rad",
    "pitch_rate_rad_s",
    "motor_angle_left_rad",
    "motor_angle_right_rad",
    "torque_left_nm",
    "torque_right_nm",
];

impl Readings {
    /// Of a log that has the columns; rows at uneven times are brought to even ones.
    pub(super) fn new(log: &Log) -> Option<Self> {
        let columns: Vec<&[f64]> = COLUMNS.iter().map(|name| log.column(name)).collect::<Option<_>>()?;
        let time = columns[0];
        if time.len() < 3 {
            return None;
        }
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        let dt_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let rows = ((time[time.len() - 1] - time[0]) / dt_s).round() as usize + 1;
        let even = rows == time.len()
            && time.iter().enumerate().all(|(i, t)| (t - time[0] - i as f64 * dt_s).abs() < 0.1 * dt_s);
        let brought = |column: &[f64], held: bool| -> Vec<f64> {
            if even { column.to_vec() } else { at_even_times(time, column, dt_s, rows, held) }
        };
        let time_s: Vec<f64> = (0..rows).map(|i| time[0] + i as f64 * dt_s).collect();
        let (pitch_rad, rate_rad_s) = (brought(columns[2], true), brought(columns[3], true));
        let fresh = fresh_rows(&pitch_rad, &rate_rad_s);
        Some(Self {
            dt_s,
            time_s,
            x_m: brought(columns[1], false),
            pitch_rad,
            rate_rad_s,
            angle_rad: [brought(columns[4], false), brought(columns[5], false)],
            torque_nm: [brought(columns[6], true), brought(columns[7], true)],
            fresh,
        })
    }

    pub(super) fn rows(&self) -> usize {
        self.time_s.len()
    }

    /// No rows, with room for some.
    pub(super) fn emptied(&self, rows: usize) -> Self {
        let column = || Vec::with_capacity(rows);
        Self {
            dt_s: self.dt_s,
            time_s: column(),
            x_m: column(),
            pitch_rad: column(),
            rate_rad_s: column(),
            angle_rad: [column(), column()],
            torque_nm: [column(), column()],
            fresh: Vec::new(),
        }
    }

    /// With what the model declares between controller and shaft, and in the IMU, taken account of: torques as they act,
    /// readings without their offsets.
    pub(super) fn acting(self, robot: &RobotModel) -> Self {
        self.delayed(robot.actuation.delay_s).without_offsets(robot)
    }

    /// Torques that act later than they are logged.
    fn delayed(mut self, delay_s: f64) -> Self {
        let places = (delay_s / self.dt_s).min(self.rows() as f64);
        let (whole, share) = (places.floor() as usize, places.fract());
        for torque in &mut self.torque_nm {
            let at = |row: usize, back: usize| torque[row.saturating_sub(back)];
            *torque = (0..torque.len())
                .map(|row| (1.0 - share) * at(row, whole) + share * at(row, whole + 1))
                .collect();
        }
        self
    }

    /// Readings of the IMU as they would be without the offsets that the model declares.
    pub(super) fn without_offsets(mut self, robot: &RobotModel) -> Self {
        let sensors = &robot.sensors;
        self.pitch_rad.iter_mut().for_each(|pitch| *pitch -= sensors.imu_mount_angle_rad);
        self.rate_rad_s.iter_mut().for_each(|rate| *rate -= sensors.gyro_bias_rad_s);
        self
    }
}

pub(in crate::refine) fn at_even_times(
    time: &[f64],
    column: &[f64],
    dt_s: f64,
    rows: usize,
    held: bool,
) -> Vec<f64> {
    let mut before = 0;
    let at = |i: usize| {
        let t = time[0] + i as f64 * dt_s;
        while before + 2 < time.len() && time[before + 1] <= t + 1e-9 {
            before += 1;
        }
        let share = ((t - time[before]) / (time[before + 1] - time[before])).clamp(0.0, 1.0);
        if held { column[before] } else { column[before] + share * (column[before + 1] - column[before]) }
    };
    (0..rows).map(at).collect()
}

/// Rows at which a held reading is new: where it changes, and in its rhythm where it happens to stay.
pub(in crate::refine) fn fresh_rows(pitch: &[f64], rate: &[f64]) -> Vec<usize> {
    let changes: Vec<usize> = std::iter::once(0)
        .chain((1..pitch.len()).filter(|&i| pitch[i] != pitch[i - 1] || rate[i] != rate[i - 1]))
        .collect();
    let mut gaps: Vec<usize> = changes.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if gaps.is_empty() {
        return changes;
    }
    let middle = gaps.len() / 2;
    let rhythm = (*gaps.select_nth_unstable(middle).1).max(1);
    let mut fresh = Vec::with_capacity(changes.len());
    for pair in changes.windows(2) {
        fresh.push(pair[0]);
        let mut next = pair[0] + rhythm;
        while 2 * (pair[1] - next.min(pair[1])) > rhythm {
            fresh.push(next);
            next += rhythm;
        }
    }
    fresh.extend(changes.last());
    fresh
}

/// Extra loads of effects: torque on both shafts together, force at the axle, torque on the body.
#[derive(Clone, Debug)]
pub(super) struct Loads {
    pub(super) shafts_nm: Vec<f64>,
    pub(super) axle_n: Vec<f64>,
    pub(super) body_nm: Vec<f64>,
}

/// A motion, ready for laws and kernel.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    /// Of the left and the right motor, with torques at the time of the row (the mean of the one that ends and the one
    /// that begins there).
    pub(super) moments: [Vec<Moment>; 2],
    /// The same with torques as asked from each row on.
    pub(super) asked: [Vec<Moment>; 2],
    /// r1 and r2 at the rows that the kernel leaves, N and N m.
    pub(super) residual: [Vec<f64>; 2],
    /// T of both motors at those rows, N m.
    pub(super) torque_nm: Vec<f64>,
    pub(super) shafts: Shafts,
}

/// Value at each row between the knots of a line, whose places may be fractions of a row.
fn line(rows: usize, places: &[f64], values: &[f64]) -> Vec<f64> {
    let mut knot = 0;
    let at = |row: usize| {
        let place = row as f64;
        while knot + 2 < places.len() && places[knot + 1] <= place {
            knot += 1;
        }
        if places.len() < 2 {
            return values[0];
        }
        let share = (place - places[knot]) / (places[knot + 1] - places[knot]);
        let share = share.clamp(0.0, 1.0);
        values[knot] + share * (values[knot + 1] - values[knot])
    };
    (0..rows).map(at).collect()
}

fn value_at(column: &[f64], place: f64) -> f64 {
    let place = place.max(0.0);
    let row = (place as usize).min(column.len() - 2);
    let share = place - row as f64;
    column[row] + share * (column[row + 1] - column[row])
}

/// Slope of a line through the values around each row, weighted by a bump.
fn slope(column: &[f64], dt_s: f64) -> Vec<f64> {
    let half = ((SPEED_HALF_S / dt_s).round() as isize).max(1);
    let weights: Vec<f64> = (-half..=half)
        .map(|i| {
            let u = i as f64 / (half + 1) as f64;
            (1.0 - u * u).powi(2) * i as f64
        })
        .collect();
    let scale: f64 = weights.iter().zip(-half..=half).map(|(w, i)| w * i as f64).sum::<f64>() * dt_s;
    let last = column.len() as isize - 1;
    let inside = |row: isize| {
        let window = &column[(row - half) as usize..=(row + half) as usize];
        window.iter().zip(&weights).map(|(v, w)| v * w).sum::<f64>() / scale
    };
    let middle = |row: isize| inside(row.clamp(half, (last - half).max(half)));
    if last < 2 * half { vec![0.0; column.len()] } else { (0..=last).map(middle).collect() }
}

fn centred(column: &[f64]) -> Vec<f64> {
    let first = column.first().copied();
    let pairs = column.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    first.into_iter().chain(pairs).collect()
}

/// What encoders and torques alone say, row by row.
#[derive(Clone, Debug)]
pub(super) struct Shafts {
    /// Mean angle of the motors, rad.
    turned: Vec<f64>,
    /// Of the left and the right motor, rad/s.
    speeds: [Vec<f64>; 2],
    /// Friction of both motors, N m.
    rubbing: Vec<f64>,
    /// Torque of both motors from each row on, and at its own time, N m.
    both: Vec<f64>,
    torque: Vec<f64>,
}

impl Shafts {
    fn new(readings: &Readings, robot: &RobotModel) -> Self {
        let rows = readings.rows();
        let sum = |columns: &[Vec<f64>; 2], row: usize| columns[0][row] + columns[1][row];
        let turned = (0..rows).map(|row| 0.5 * sum(&readings.angle_rad, row)).collect();
        let speeds = [0, 1].map(|motor: usize| slope(&readings.angle_rad[motor], readings.dt_s));
        let friction = |motor: usize, row: usize| {
            robot.friction[motor].map_or(0.0, |curve: Stribeck| curve.torque_nm(speeds[motor][row]))
        };
        let rubbing = (0..rows).map(|row| friction(0, row) + friction(1, row)).collect();
        let both: Vec<f64> = (0..rows).map(|row| sum(&readings.torque_nm, row)).collect();
        Self { turned, rubbing, torque: centred(&both), both, speeds }
    }
}

/// The way of the robot through a log, row by row.
struct Way<'a> {
    readings: &'a Readings,
    shafts: &'a Shafts,
    robot: &'a RobotModel,
    loads: Option<&'a Loads>,
    pitch: Vec<f64>,
    rate: Vec<f64>,
}

impl<'a> Way<'a> {
    fn new(
        readings: &'a Readings,
        shafts: &'a Shafts,
        robot: &'a RobotModel,
        loads: Option<&'a Loads>,
        imu_delay_s: f64,
    ) -> Self {
        let (rows, dt) = (readings.rows(), readings.dt_s);
        let imu_delay_s = imu_delay_s + robot.sensors.imu_latency_s;
        let places: Vec<f64> =
            readings.fresh.iter().map(|&row| (row as f64 - imu_delay_s / dt).max(0.0)).collect();
        let said = |column: &[f64]| -> Vec<f64> { readings.fresh.iter().map(|&row| column[row]).collect() };
        let (said_pitch, said_rate) = (said(&readings.pitch_rad), said(&readings.rate_rad_s));
        let pitch = line(rows, &places, &said_pitch);
        let rate = line(rows, &places, &said_rate);
        let mut way = Self { readings, shafts, robot, loads, pitch, rate };
        let coefficients = robot.parameters.coefficients();
        let errors = |free: &[f64], said: &[f64]| -> Vec<f64> {
            places.iter().zip(said).map(|(&place, said)| said - value_at(free, place)).collect()
        };
        // The model's motion between two readings, bent by lines.
        let bent = |free: &[f64], errors: &[f64]| -> Vec<f64> {
            free.iter().zip(line(rows, &places, errors)).map(|(free, error)| free + error).collect()
        };
        for _ in 0..2 {
            let (mut free_rate, mut sum) = (Vec::with_capacity(rows), 0.0);
            for row in 0..rows {
                free_rate.push(sum);
                let sincos = libm::sincos(way.pitch[row]);
                let accel = way.accelerations(&coefficients, sincos, shafts.both[row], row);
                sum += dt * accel.pitch_accel_rad_s2;
            }
            way.rate = bent(&free_rate, &errors(&free_rate, &said_rate));
            let (mut free_pitch, mut sum) = (Vec::with_capacity(rows), 0.0);
            for row in 0..rows {
                free_pitch.push(sum);
                let next = way.rate[(row + 1).min(rows - 1)];
                sum += 0.5 * dt * (way.rate[row] + next);
            }
            // The integral of the rate drifts slowly, and readings of the pitch have independent noise.
            way.pitch = bent(&free_pitch, &smooth::random_walk(&errors(&free_pitch, &said_pitch)));
        }
        way
    }

    /// Of the model at a row, for a torque of both motors.
    fn accelerations(
        &self,
        coefficients: &Coefficients,
        sincos: (f64, f64),
        torque_nm: f64,
        row: usize,
    ) -> Accelerations {
        let load = |l: &Loads| (l.shafts_nm[row], l.axle_n[row], l.body_nm[row]);
        let (shafts, axle, body) = self.loads.map_or((0.0, 0.0, 0.0), load);
        let shaft = torque_nm - self.shafts.rubbing[row] + shafts;
        let radius = self.robot.parameters.wheel_radius_m;
        coefficients.accelerations(sincos, self.rate[row], shaft + radius * axle, body - shaft)
    }

    /// sin and cos of the pitch.
    fn sincos(&self) -> [Vec<f64>; 2] {
        let (sin, cos) = self.pitch.iter().map(|&pitch| libm::sincos(pitch)).unzip();
        [sin, cos]
    }

    /// r1 and r2: r1 = d²/dt² [a x + M l sin θ] − S/r and r2 = (J + M l²) θ̈ + M l cos θ ẍ − M g l sin θ + S.
    fn residual(&self, kernel: &Kernel, [sin, cos]: &[Vec<f64>; 2]) -> [Vec<f64>; 2] {
        let rows = self.readings.rows();
        let p = &self.robot.parameters;
        let (coefficients, radius) = (p.coefficients(), p.wheel_radius_m);
        let lever = p.body_mass_kg * p.com_height_m;
        let shaft: Vec<f64> =
            (0..rows).map(|row| self.shafts.torque[row] - self.shafts.rubbing[row]).collect();
        let swing: Vec<f64> = (0..rows).map(|row| cos[row] * self.rate[row]).collect();
        let turning = kernel.apply(&self.rate, 1);
        let rolling = kernel.apply(&self.shafts.turned, 2);
        let (swing, shaft) = (kernel.apply(&swing, 1), kernel.apply(&shaft, 0));
        let (cos, sin) = (kernel.apply(cos, 0), kernel.apply(sin, 0));
        let x_accel: Vec<f64> = rolling.iter().zip(&turning).map(|(q, turn)| radius * (q + turn)).collect();
        let mass = coefficients.c1 / radius;
        let translation =
            (0..shaft.len()).map(|i| mass * x_accel[i] + lever * swing[i] - shaft[i] / radius).collect();
        let pitching = (0..shaft.len())
            .map(|i| {
                coefficients.c3 * turning[i] + lever * cos[i] * x_accel[i] - coefficients.c4 * sin[i]
                    + shaft[i]
            })
            .collect();
        [translation, pitching]
    }

    /// Every row of the left and the right motor, with torques at the time of the row.
    fn moments(&self, [sin, cos]: &[Vec<f64>; 2]) -> [Vec<Moment>; 2] {
        let (rows, dt_s) = (self.readings.rows(), self.readings.dt_s);
        let p = &self.robot.parameters;
        let (coefficients, radius) = (p.coefficients(), p.wheel_radius_m);
        let way: Vec<f64> = (0..rows).map(|i| radius * (self.shafts.turned[i] + self.pitch[i])).collect();
        let start = (0..rows).map(|i| self.readings.x_m[i] - way[i]).sum::<f64>() / rows as f64;
        let torque_nm = self.readings.torque_nm.each_ref().map(|torque| centred(torque));
        let mut moments = [0, 1].map(|_| Vec::with_capacity(rows));
        for row in 0..rows {
            let accel = self.accelerations(&coefficients, (sin[row], cos[row]), self.shafts.torque[row], row);
            for (motor, moments) in moments.iter_mut().enumerate() {
                moments.push(Moment {
                    time_s: self.readings.time_s[row],
                    dt_s,
                    motor_angle_rad: self.readings.angle_rad[motor][row],
                    motor_speed_rad_s: self.shafts.speeds[motor][row],
                    motor_accel_rad_s2: accel.x_ddot_m_s2 / radius - accel.pitch_accel_rad_s2,
                    torque_nm: torque_nm[motor][row],
                    torque_sum_nm: self.shafts.torque[row],
                    x_m: way[row] + start,
                    x_dot_m_s: radius
                        * (0.5 * (self.shafts.speeds[0][row] + self.shafts.speeds[1][row]) + self.rate[row]),
                    x_accel_m_s2: accel.x_ddot_m_s2,
                    pitch_rad: self.pitch[row],
                    pitch_rate_rad_s: self.rate[row],
                    pitch_accel_rad_s2: accel.pitch_accel_rad_s2,
                });
            }
        }
        moments
    }

    /// The same with torques as asked from each row on.
    fn asked(&self, moments: &[Vec<Moment>; 2]) -> [Vec<Moment>; 2] {
        [0, 1].map(|motor: usize| {
            let raw = |(row, moment): (usize, &Moment)| Moment {
                torque_nm: self.readings.torque_nm[motor][row],
                torque_sum_nm: self.shafts.both[row],
                ..*moment
            };
            moments[motor].iter().enumerate().map(raw).collect()
        })
    }
}

impl Motion {
    /// The motion of `robot`, with the loads of effects beside it.
    pub(super) fn new(
        readings: &Readings,
        robot: &RobotModel,
        kernel: &Kernel,
        loads: Option<&Loads>,
    ) -> Self {
        let shafts = Shafts::new(readings, robot);
        let way = Way::new(readings, &shafts, robot, loads, 0.0);
        let sincos = way.sincos();
        let moments = way.moments(&sincos);
        Self {
            asked: way.asked(&moments),
            residual: way.residual(kernel, &sincos),
            torque_nm: kernel.apply(&shafts.torque, 0),
            moments,
            shafts,
        }
    }
}

/// r1 and r2 of a robot whose IMU speaks `imu_delay_s` later than declared.
pub(super) fn late_residual(
    readings: &Readings,
    shafts: &Shafts,
    robot: &RobotModel,
    kernel: &Kernel,
    imu_delay_s: f64,
) -> [Vec<f64>; 2] {
    let way = Way::new(readings, shafts, robot, None, imu_delay_s);
    way.residual(kernel, &way.sincos())
}

/// r1 and r2 of a motor's action.
pub(super) fn of_action(action: &Action, direction: f64, radius_m: f64) -> [f64; 2] {
    let motor = action.on_motor_nm(direction);
    [motor / radius_m + action.axle_n, action.body_nm - motor]
}
