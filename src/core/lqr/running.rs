//! The loop when sampled, short of its limits: its poles, and how it answers a disturbance.

use nalgebra::{Complex, Matrix2x4, Vector4};

use super::margins::{Analysis, SampledLoop};
use crate::model::{LinearModel, State};

/// Longest answer, so that a slip of the hand does not fill the memory.
const MOST_TICKS: f64 = 1e6;
/// Rounding threshold of a mode that has decayed within one IMU period.
const SMALLEST: f64 = 1e-9;
/// Size from which on an answer that grows is cut, in SI units.
const LARGEST: f64 = 1e9;

/// A closed-loop pole of the sampled loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledPole {
    /// Factor of its mode over one IMU period; inside of the unit circle where the mode dies out.
    pub z: Complex<f64>,
    /// Continuous-time equivalent, ln z / period, 1/s; its imaginary part is half the IMU's rate at most.
    pub s: Complex<f64>,
}

impl SampledPole {
    /// Damping of an oscillation: 1 of a real pole that dies out, below 0 of one that grows.
    pub fn damping(&self) -> f64 {
        damping(self.s)
    }
}

/// Damping of a pole, −Re s / |s|; 1 at 0.
///
/// ```
/// use nalgebra::Complex;
///
/// assert_eq!(flqr_core::lqr::damping(Complex::new(-3.0, 4.0)), 0.6);
/// ```
pub fn damping(s: Complex<f64>) -> f64 {
    if s.norm() > 0.0 { -s.re / s.norm() } else { 1.0 }
}

/// Poles of u = −K X as a robot runs it, slowest first: eigenvalues over one IMU period, conjugates next to each
/// other. Those of what is only passed on (commands under way, samples held) are among them, fast as they are,
/// apart from those at z = 0. Empty where [`margins`](super::margins()) would not analyse the loop, or where its
/// delay is above 64 ticks.
///
/// ```
/// # let model = flqr_core::model_file::presets::paper();
/// # let robot = model.robot().ok_or("no robot")?;
/// # let linear = robot.parameters.linear_model();
/// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
/// use flqr_core::lqr::{SampledLoop, sampled_poles};
///
/// let poles = sampled_poles(&linear, &gain, &SampledLoop::of(robot));
/// assert!(poles.iter().all(|pole| pole.z.norm() < 1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn sampled_poles(model: &LinearModel, gain: &Matrix2x4<f64>, timing: &SampledLoop) -> Vec<SampledPole> {
    if !timing.is_analysed() {
        return Vec::new();
    }
    let system = Analysis::new(model, gain, timing).system(0.0);
    let period_s = std::f64::consts::TAU / system.imu_rate_rad_s();
    let Some(mut poles) = system.poles(1.0) else { return Vec::new() };
    poles.retain(|z| z.norm() > SMALLEST);
    poles.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    poles.into_iter().map(|z| SampledPole { z, s: z.ln() / period_s }).collect()
}

/// Step-by-step response of the loop from a state.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledResponse {
    /// Time from one entry to the next, s.
    pub tick_s: f64,
    /// True state at every tick, the initial one first.
    pub states: Vec<State>,
    /// Torque commanded of the left and the right motor at every tick, N m; it acts a delay later.
    pub torque_nm: Vec<[f64; 2]>,
}

impl SampledResponse {
    /// Largest torque commanded of either motor, N m.
    pub fn peak_torque_nm(&self) -> f64 {
        self.torque_nm.iter().flatten().fold(0.0, |peak: f64, torque| peak.max(torque.abs()))
    }
}

/// Answer of u = −K X as a robot runs it, from `initial` on: exact for the linear loop with its delay, tick and
/// held IMU, without friction, noise and torque limit. Nothing is under way at the start and the IMU has seen
/// the initial state. Cut where it grows out of all bounds, and at a million ticks; empty where
/// [`sampled_poles`] is.
///
/// ```
/// # let model = flqr_core::model_file::presets::paper();
/// # let robot = model.robot().ok_or("no robot")?;
/// # let linear = robot.parameters.linear_model();
/// # let gain = flqr_core::lqr::design(&linear, &robot.weights.ok_or("no weights")?)?.gain;
/// use flqr_core::lqr::{SampledLoop, sampled_response};
/// use flqr_core::model::State;
///
/// let initial = State { pitch_rad: 0.05, ..State::default() };
/// let response = sampled_response(&linear, &gain, &SampledLoop::of(robot), &initial, 20.0);
/// assert!(response.states.last().is_some_and(|state| state.pitch_rad.abs() < 1e-3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn sampled_response(
    model: &LinearModel,
    gain: &Matrix2x4<f64>,
    timing: &SampledLoop,
    initial: &State,
    seconds: f64,
) -> SampledResponse {
    let mut response = SampledResponse { tick_s: timing.tick_s, states: Vec::new(), torque_nm: Vec::new() };
    let ticks = (seconds / timing.tick_s * (1.0 + 1e-12)).floor().min(MOST_TICKS - 1.0);
    if !timing.is_analysed() || seconds.is_nan() || ticks < 0.0 {
        return response;
    }
    let system = Analysis::new(model, gain, timing).system(0.0);
    let (period, latency) = (system.imu_period(), system.imu_latency());
    let mut x = initial.to_vector();
    let mut seen = vec![[x[2], x[3]]];
    let mut asked_sums: Vec<f64> = Vec::new();
    for tick in 0..=ticks as usize {
        if tick > 0 && tick % period == 0 {
            seen.push([x[2], x[3]]);
        }
        // The newest sample that has arrived; the first one was there at the start.
        let held = seen[tick.saturating_sub(latency) / period];
        let torques = gain * -measured(&x, held, timing.wheel_radius_m);
        response.states.push(State::from_vector(&x));
        response.torque_nm.push([torques[0], torques[1]]);
        asked_sums.push(torques.sum());
        let under_way = |age: usize| tick.checked_sub(age).map_or(0.0, |index| asked_sums[index]);
        x = system.next(&x, under_way(system.delay()), under_way(system.delay() + 1));
        if x.norm().is_nan() || x.norm() > LARGEST {
            break;
        }
    }
    response
}

/// State seen by the controller: x and ẋ from encoders and the held pitch.
fn measured(x: &Vector4<f64>, [pitch, rate]: [f64; 2], radius: f64) -> Vector4<f64> {
    Vector4::new(x[0] + radius * (pitch - x[2]), x[1] + radius * (rate - x[3]), pitch, rate)
}
