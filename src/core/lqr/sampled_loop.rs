//! The loop when sampled: plant between ticks, transport delay, held IMU.
//!
//! Command u[n] is computed at tick n and acts, held for one tick, from `delay_s` later on. With
//! x = r (q + θ) the feedback K X splits into a part that the encoders give at every tick,
//! e = K₁ r q + K₂ r q̇, and a part of pitch and pitch rate, w = (K₃ + r K₁) θ + (K₄ + r K₂) θ̇, which is sampled
//! at every N-th tick and held: u = −(e + held w).
//!
//! Broken at the plant's input the loop has, at z = e^{iωT}, the fast part E(z), the pitch part W(z) and the
//! hold's moving average H(z) = (1 + z⁻¹ + … + z^{1−N})/N. Sampling every N-th tick also folds the
//! frequencies z_m = z e^{2πim/N} onto each other, so that a factor κ in the loop puts a closed-loop pole at z
//! where
//!
//! 1 + κ (E + H W)(z) + (1 + κ E(z)) Σ_{m=1}^{N−1} κ H W(z_m) / (1 + κ E(z_m)) = 0.
//!
//! The first two terms are the baseband: what is left if the hold were the filter H alone. The sum, a few per
//! cent at the crossover of a robot with a 100 Hz IMU, makes it exact.

use nalgebra::{Complex, Matrix4, RowVector4, Vector4};

use super::poles::eigenvalues;
use super::square::SquareN;

/// Terms of the exponential's series for matrices of norm ½ at most.
const SERIES_TERMS: usize = 14;
/// Halvings of the time after which the norm is not below ½ for any robot.
const MOST_HALVINGS: i32 = 60;

/// Single-input loop, both motors as one; times in ticks where nothing else is said.
#[derive(Clone, Debug)]
pub(super) struct SampledSystem {
    tick_s: f64,
    /// N ≥ 1.
    imu_period: usize,
    imu_latency: usize,
    /// Whole ticks of delay.
    delay: usize,
    /// (Φ − I)/T, the plant over one tick.
    plant: Matrix4<f64>,
    /// Over T: effect of u[n − delay] and of u[n − delay − 1] on the tick from n on.
    input: [Vector4<f64>; 2],
    /// e = encoders · X.
    encoders: RowVector4<f64>,
    /// w = pitch · X.
    pitch: RowVector4<f64>,
    /// det(δ − plant), highest power first, δ = (z − 1)/T.
    denominator: [f64; 5],
    /// Numerators of e and of w for both inputs.
    numerators: [[[f64; 4]; 2]; 2],
}

/// Continuous plant and the feedback that [`SampledSystem`] samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContinuousLoop {
    pub(super) a: Matrix4<f64>,
    pub(super) b: Vector4<f64>,
    pub(super) gain: RowVector4<f64>,
    pub(super) wheel_radius_m: f64,
}

impl SampledSystem {
    pub(super) fn new(
        continuous: &ContinuousLoop,
        tick_s: f64,
        delay_s: f64,
        imu_period: usize,
        imu_latency: usize,
    ) -> Self {
        let ticks = delay_s / tick_s;
        // A delay of 4 ms is 4 ticks, whatever its last bit.
        let whole = (ticks + 1e-9).floor();
        let late_s = (ticks - whole).max(0.0) * tick_s;
        let late = Step::new(&continuous.a, &continuous.b, late_s);
        let rest = Step::new(&continuous.a, &continuous.b, tick_s - late_s);
        let plant = (rest.change * late.change + rest.change + late.change) / tick_s;
        let input = [rest.input / tick_s, (rest.change * late.input + late.input) / tick_s];
        let [x, x_dot, pitch, pitch_rate] = [0, 1, 2, 3].map(|state| continuous.gain[state]);
        let radius = continuous.wheel_radius_m;
        let mut system = Self {
            tick_s,
            imu_period,
            imu_latency,
            delay: whole as usize,
            plant,
            input,
            encoders: RowVector4::new(x, x_dot, -radius * x, -radius * x_dot),
            pitch: RowVector4::new(0.0, 0.0, pitch + radius * x, pitch_rate + radius * x_dot),
            denominator: [0.0; 5],
            numerators: [[[0.0; 4]; 2]; 2],
        };
        system.expand_polynomials();
        system
    }

    /// Faddeev and LeVerrier: (δ − A)⁻¹ = Σ δ^{3−k} M_k / det(δ − A).
    fn expand_polynomials(&mut self) {
        let mut coefficient = Matrix4::identity();
        self.denominator[0] = 1.0;
        for k in 0..4 {
            for (row, output) in [self.encoders, self.pitch].into_iter().enumerate() {
                for (column, input) in self.input.iter().enumerate() {
                    self.numerators[row][column][k] = (output * coefficient * input)[0];
                }
            }
            let next = self.plant * coefficient;
            self.denominator[k + 1] = -next.trace() / (k + 1) as f64;
            coefficient = next + Matrix4::identity() * self.denominator[k + 1];
        }
    }

    /// E and W at z = e^{i angle}.
    fn parts(&self, angle: f64) -> [Complex<f64>; 2] {
        let (sin, cos) = angle.sin_cos();
        let half = (0.5 * angle).sin();
        // z − 1 without its cancellation at low frequencies
        let delta = Complex::new(-2.0 * half * half, sin) / self.tick_s;
        let backward = Complex::new(cos, -sin);
        let horner = |coefficients: &[f64]| {
            coefficients.iter().fold(Complex::default(), |sum: Complex<f64>, c| sum * delta + c)
        };
        let delayed = backward_power(angle, self.delay) / horner(&self.denominator);
        self.numerators.map(|[now, before]| (horner(&now) + horner(&before) * backward) * delayed)
    }

    /// H, with the IMU's latency.
    fn held(&self, angle: f64) -> Complex<f64> {
        let half = 0.5 * angle;
        let period = self.imu_period as f64;
        let average = if half.sin() == 0.0 { 1.0 } else { (period * half).sin() / (period * half.sin()) };
        Complex::from_polar(average, -(period - 1.0) * half - self.imu_latency as f64 * angle)
    }

    fn angle(&self, frequency_rad_s: f64) -> f64 {
        frequency_rad_s * self.tick_s
    }

    /// E + H W: the loop broken at the plant's input, without what sampling the IMU folds onto it.
    pub(super) fn baseband(&self, frequency_rad_s: f64) -> Complex<f64> {
        let angle = self.angle(frequency_rad_s);
        let [fast, pitch] = self.parts(angle);
        fast + self.held(angle) * pitch
    }

    /// Zero where the loop with the factor `factor` has a pole at this frequency on the border of stability.
    pub(super) fn characteristic(&self, frequency_rad_s: f64, factor: Complex<f64>) -> Complex<f64> {
        let angle = self.angle(frequency_rad_s);
        let [fast, pitch] = self.parts(angle);
        let fast_closed = 1.0 + factor * fast;
        let folded = (1..self.imu_period).fold(Complex::default(), |sum: Complex<f64>, image| {
            let angle = angle + std::f64::consts::TAU * image as f64 / self.imu_period as f64;
            let [fast, pitch] = self.parts(angle);
            sum + factor * self.held(angle) * pitch / (1.0 + factor * fast)
        });
        fast_closed + factor * self.held(angle) * pitch + fast_closed * folded
    }

    /// Value at half the IMU's rate, where it is real: zero where the factor puts a pole at −1 over one IMU
    /// period.
    pub(super) fn characteristic_at_half_rate(&self, factor: f64) -> f64 {
        let frequency_rad_s = 0.5 * self.imu_rate_rad_s();
        let factor = Complex::from(factor);
        let [fast, _] = self.parts(self.angle(frequency_rad_s));
        (self.characteristic(frequency_rad_s, factor) / (1.0 + factor * fast)).re
    }

    /// Frequencies this far apart are one to the IMU.
    pub(super) fn imu_rate_rad_s(&self) -> f64 {
        std::f64::consts::TAU / (self.imu_period as f64 * self.tick_s)
    }

    /// Ticks from one IMU sample to the next.
    pub(super) fn imu_period(&self) -> usize {
        self.imu_period
    }

    /// Age of an IMU sample when it arrives, ticks.
    pub(super) fn imu_latency(&self) -> usize {
        self.imu_latency
    }

    /// Whole ticks from a command to its acting.
    pub(super) fn delay(&self) -> usize {
        self.delay
    }

    /// The plant a tick later, where `now` is the command of a whole delay ago and `before` the one of a tick
    /// earlier, which acts on while the delay's fraction lasts.
    pub(super) fn next(&self, x: &Vector4<f64>, now: f64, before: f64) -> Vector4<f64> {
        x + (self.plant * x + self.input[0] * now + self.input[1] * before) * self.tick_s
    }

    /// Largest modulus of the eigenvalues of one IMU period, with `factor` in the loop: below 1 where the loop
    /// is stable. `None` where a number is not finite.
    pub(super) fn spectral_radius(&self, factor: f64) -> Option<f64> {
        Some(self.poles(factor)?.iter().fold(0.0, |largest: f64, pole| largest.max(pole.norm())))
    }

    /// Eigenvalues of one IMU period, with `factor` in the loop. `None` where a number is not finite.
    pub(super) fn poles(&self, factor: f64) -> Option<Vec<Complex<f64>>> {
        let size = self.states();
        let mut columns = Vec::with_capacity(size);
        for column in 0..size {
            let mut state = vec![0.0; size];
            state[column] = 1.0;
            self.run_imu_period(&mut state, factor);
            columns.push(state);
        }
        let mut poles = vec![Complex::default(); size];
        eigenvalues(SquareN::from_fn(size, |row, column| columns[column][row]), &mut poles)?;
        Some(poles)
    }

    /// The plant's four, the commands under way, newest first, and the pitch samples not in use any more or yet.
    fn states(&self) -> usize {
        4 + self.delay + 1 + self.imu_latency.div_ceil(self.imu_period)
    }

    /// Moves `state` on from just before an IMU sample to just before the next.
    pub(super) fn run_imu_period(&self, state: &mut [f64], factor: f64) {
        let (plant, rest) = state.split_at_mut(4);
        let (under_way, samples) = rest.split_at_mut(self.delay + 1);
        let mut x = Vector4::from_column_slice(plant);
        let newest = (self.pitch * x)[0];
        for tick in 0..self.imu_period {
            let held = match self.imu_latency.saturating_sub(tick).div_ceil(self.imu_period) {
                0 => newest,
                age => samples[age - 1],
            };
            let command = -factor * ((self.encoders * x)[0] + held);
            let before = under_way[self.delay];
            under_way.rotate_right(1);
            under_way[0] = command;
            let now = under_way[self.delay];
            x = self.next(&x, now, before);
        }
        plant.copy_from_slice(x.as_slice());
        if let Some(oldest) = samples.last_mut() {
            *oldest = newest;
            samples.rotate_right(1);
        }
    }
}

/// z⁻ᵏ
fn backward_power(angle: f64, power: usize) -> Complex<f64> {
    Complex::from_polar(1.0, -angle * power as f64)
}

/// A plant over some time: X grows by change · X + input · u.
struct Step {
    change: Matrix4<f64>,
    input: Vector4<f64>,
}

impl Step {
    /// e^{At} − 1 and ∫₀ᵗ e^{As} b ds by their series over a part of the time, then by doubling.
    fn new(a: &Matrix4<f64>, b: &Vector4<f64>, time_s: f64) -> Self {
        let norm = a.abs().row_sum().max() * time_s;
        let halvings =
            if norm > 0.5 { (2.0 * norm).log2().ceil().min(MOST_HALVINGS as f64) as i32 } else { 0 };
        let part_s = time_s * 0.5_f64.powi(halvings);
        let (mut power, mut kick) = (a * part_s, b * part_s);
        let mut step = Self { change: power, input: kick };
        for term in 2..=SERIES_TERMS {
            let scale = part_s / term as f64;
            (power, kick) = (a * power * scale, a * kick * scale);
            step.change += power;
            step.input += kick;
        }
        for _ in 0..halvings {
            step.input = step.change * step.input + step.input * 2.0;
            step.change = step.change * step.change + step.change * 2.0;
        }
        step
    }
}
