//! Margins against other implementations, simulation and the theorem on LQR's margins.

use nalgebra::{Matrix2x4, RowVector4, SMatrix, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::lqr::margins::Analysis;
use crate::lqr::{Margins, SampledLoop, design, margins};
use crate::model::{LinearModel, RobotParameters, Weights};

const TICK_S: f64 = 0.001;

fn robot([body, wheel, wheel_inertia, radius, height, inertia]: [f64; 6]) -> RobotParameters {
    RobotParameters {
        body_mass_kg: body,
        wheel_mass_kg: wheel,
        wheel_inertia_kg_m2: wheel_inertia,
        wheel_radius_m: radius,
        com_height_m: height,
        body_inertia_kg_m2: inertia,
        gravity_m_s2: 9.81,
    }
}

/// A robot with its gain.
struct Subject {
    model: LinearModel,
    gain: Matrix2x4<f64>,
    wheel_radius_m: f64,
}

impl Subject {
    fn new(parameters: [f64; 6], q: [f64; 4], r: f64) -> Self {
        let parameters = robot(parameters);
        let model = parameters.linear_model();
        let gain = design(&model, &Weights::diagonal(q, [r; 2])).unwrap().gain;
        Self { model, gain, wheel_radius_m: parameters.wheel_radius_m }
    }

    fn timing(&self, delay_ticks: f64, imu_ticks: f64, latency_ticks: f64) -> SampledLoop {
        SampledLoop {
            tick_s: TICK_S,
            delay_s: delay_ticks * TICK_S,
            imu_period_s: imu_ticks * TICK_S,
            imu_latency_s: latency_ticks * TICK_S,
            wheel_radius_m: self.wheel_radius_m,
        }
    }

    fn margins(&self, timing: &SampledLoop) -> Margins {
        margins(&self.model, &self.gain, timing)
    }

    /// Spectral radius with a factor in the loop.
    fn radius(&self, timing: &SampledLoop, factor: f64) -> f64 {
        Analysis::new(&self.model, &self.gain, timing).system(0.0).spectral_radius(factor).unwrap()
    }
}

fn heavy() -> Subject {
    Subject::new([12.5, 1.25, 0.0025, 0.063, 0.12, 0.10], [1.0, 0.01, 0.01, 0.001], 1.25)
}

fn light() -> Subject {
    Subject::new([3.2, 0.3, 4e-4, 0.05, 0.1, 0.016], [10.0, 1.0, 1.0, 0.1], 20.0)
}

fn tall() -> Subject {
    Subject::new([18.0, 1.8, 0.01, 0.1, 0.45, 0.6], [10.0, 1.0, 1.0, 0.1], 1.0)
}

/// Ticks of delay, IMU period and latency; gain margins and delay margin.
type Reference = ([f64; 3], [f64; 3]);

/// With scipy 1.17: the tick-by-tick transition matrix of plant (scipy.linalg.expm), command queue and past
/// pitch samples multiplied up over one IMU period, and brentq on its spectral radius
/// (numpy.linalg.eigvals) over the factor and over the extra delay. The gain from scipy.linalg.solve_continuous_are.
#[test]
fn margins_agree_with_scipys_eigenvalues() {
    let cases: [(Subject, &[Reference]); 3] = [
        (
            heavy(),
            &[
                ([4.0, 10.0, 0.0], [7.4315049975054635, 0.4947193784408949, 0.04319407937558516]),
                ([4.0, 5.0, 0.0], [9.47497626464409, 0.49585224513842624, 0.046594570215001074]),
                ([4.0, 10.0, 3.0], [4.4577290342917815, 0.4934148827305641, 0.03907073521837924]),
                ([2.5, 1.0, 0.0], [24.02234527465907, 0.49665844626501743, 0.050820860391640396]),
                ([0.0, 1.0, 0.0], [90.93907651068824, 0.49649147781032676, 0.05332086039162842]),
                ([8.7, 20.0, 25.0], [f64::NAN; 3]),
            ],
        ),
        (
            light(),
            &[
                ([4.0, 10.0, 0.0], [4.334453983903324, 0.4533304394678054, 0.02946721130194434]),
                ([4.0, 5.0, 0.0], [6.167866304692172, 0.4559261641344518, 0.033715882956486774]),
                ([4.0, 10.0, 3.0], [2.647285839232825, 0.4503472800595114, 0.02421504934297504]),
                ([2.5, 1.0, 0.0], [17.70150897474186, 0.4576668117791397, 0.03864338961374651]),
                ([0.0, 1.0, 0.0], [67.14582294337139, 0.4571416065361392, 0.041143389613746514]),
                ([8.7, 20.0, 25.0], [f64::NAN; 3]),
            ],
        ),
        (
            tall(),
            &[
                ([4.0, 10.0, 0.0], [7.51326237466949, 0.47763295227969527, 0.056561805696529674]),
                ([4.0, 10.0, 3.0], [4.582503281390426, 0.47565904750798466, 0.05122477294094405]),
                ([4.0, 1.0, 0.0], [20.033729705336853, 0.48068504967923786, 0.06439060222259503]),
                ([8.7, 20.0, 25.0], [f64::NAN; 3]),
            ],
        ),
    ];
    for (subject, references) in cases {
        for ([delay, imu, latency], expected) in references {
            let found = subject.margins(&subject.timing(*delay, *imu, *latency));
            assert_eq!(found.stable, !expected[0].is_nan());
            let found = [found.gain_up, found.gain_down, found.delay_s];
            let close = |(found, expected): (f64, &f64)| (found / expected - 1.0).abs() < 1e-10;
            if !expected[0].is_nan() {
                assert!(found.into_iter().zip(expected).all(close), "{found:?} for {expected:?}");
            } else {
                assert_eq!(found, [1.0, 1.0, 0.0]);
            }
        }
    }
}

/// Delay of 4 ticks and no hold: frequency and phase where |L| = 1 on python-control 0.10.2's state space of
/// plant and queue, `control.stability_margins(control.ss(A, B, K, 0, 0.001))`, polished by brentq on
/// |K (zI − Φ)⁻¹Γ z⁻⁴| = 1.
#[test]
fn phase_margin_without_hold_is_python_controls() {
    for (subject, crossover_rad_s, phase_rad) in [
        (heavy(), 19.469256464907897, 0.9602328872479465),
        (light(), 27.050819652021897, 1.0047410582310246),
        (tall(), 15.36447552186728, 0.9893228364351345),
    ] {
        let found = subject.margins(&subject.timing(4.0, 1.0, 0.0));
        assert!((found.crossover_rad_s / crossover_rad_s - 1.0).abs() < 1e-10, "{found:?}");
        assert!((found.phase_rad / phase_rad - 1.0).abs() < 1e-10, "{found:?}");
    }
}

/// Any loop: stable up to the margins, unstable behind them, by eigenvalues that share no code with the search.
#[test]
fn loops_are_stable_between_their_gain_margins_and_not_beyond() {
    let mut generator = ChaCha8Rng::seed_from_u64(7);
    let mut stable = 0;
    for case in 0..300 {
        let mut draw = |low: f64, high: f64| 10_f64.powf(generator.random_range(low..=high));
        let (mass, height) = (draw(0.0, 1.5), draw(-1.5, 0.0));
        let parameters =
            [mass, 0.1 * mass, 1e-4 * mass, draw(-1.5, -0.8), height, 0.4 * mass * height * height];
        let subject =
            Subject::new(parameters, [0; 4].map(|_| draw(-2.0, 2.0)), draw(-1.0, 2.0) / (mass * height));
        let imu = [1.0, 2.0, 5.0, 10.0, 20.0][case % 5];
        let timing = subject.timing(draw(-1.0, 1.2), imu, [0.0, 3.0, 11.0][case % 3]);
        let found = subject.margins(&timing);
        assert_eq!(found.stable, subject.radius(&timing, 1.0) < 1.0);
        if !found.stable {
            continue;
        }
        stable += 1;
        let about = format!("case {case}: {timing:?} {found:?}");
        let radius_beyond = |factor: f64| subject.radius(&timing, factor);
        assert!(radius_beyond(found.gain_down * 0.999) > 1.0, "{about}");
        let highest = if found.gain_up.is_finite() { found.gain_up } else { 1e4 };
        if found.gain_up.is_finite() {
            assert!(radius_beyond(found.gain_up * 1.001) > 1.0, "{about}");
        }
        for step in 0..=20 {
            let share = f64::from(step) / 40.0;
            let factor = (found.gain_down * 1.001).powf(1.0 - share) * (highest * 0.999).powf(share);
            assert!(radius_beyond(factor) < 1.0, "{about} at {factor}");
        }
        assert!(found.delay_s.is_finite(), "{about}");
        let later = |extra: f64| SampledLoop { delay_s: timing.delay_s + extra, ..timing };
        for share in [0.2, 0.5, 0.8, 0.999] {
            assert!(subject.radius(&later(share * found.delay_s), 1.0) < 1.0, "{about} at {share}");
        }
        assert!(subject.radius(&later(1.001 * found.delay_s), 1.0) > 1.0, "{about}");
    }
    assert!(stable > 100, "{stable} loops say little");
}

/// The plant in steps of a tenth of a tick, the torque in a queue of such steps, the IMU held.
fn simulated_growth(subject: &Subject, timing: &SampledLoop) -> f64 {
    const PARTS: usize = 10;
    let b = subject.model.b.column(0);
    let mut generator = SMatrix::<f64, 5, 5>::zeros();
    generator.fixed_view_mut::<4, 4>(0, 0).copy_from(&subject.model.a);
    generator.fixed_view_mut::<4, 1>(0, 4).copy_from(&b);
    let part = (generator * (TICK_S / PARTS as f64)).exp();
    let delay = (timing.delay_s / TICK_S * PARTS as f64).round() as usize;
    let imu_ticks = (timing.imu_period_s / TICK_S).round() as usize;
    let gain: RowVector4<f64> = subject.gain.row(0) + subject.gain.row(1);
    let mut state = nalgebra::Vector5::new(0.0, 0.0, 1.0, 0.0, 0.0);
    let mut commands = vec![0.0; delay + 1];
    let (mut held, mut sizes) = ([0.0; 2], [0.0_f64; 2]);
    let ticks = 20_000;
    for step in 0..ticks * PARTS {
        if step.is_multiple_of(PARTS) {
            if step.is_multiple_of(PARTS * imu_ticks) {
                held = [state[2], state[3]];
            }
            let radius = subject.wheel_radius_m;
            let [angle, speed] = [state[0] / radius - state[2], state[1] / radius - state[3]];
            let measured =
                Vector4::new(radius * (angle + held[0]), radius * (speed + held[1]), held[0], held[1]);
            commands.push(-(gain * measured)[0]);
        } else {
            commands.push(*commands.last().unwrap());
        }
        state[4] = commands[commands.len() - 1 - delay];
        state = part * state;
        let half = usize::from(step >= ticks * PARTS / 2);
        sizes[half] = sizes[half].max(if step < ticks { 0.0 } else { state[2].abs() });
    }
    sizes[1] / sizes[0]
}

#[test]
fn simulation_dies_out_inside_of_the_delay_margin_and_grows_outside() {
    for subject in [heavy(), light(), tall()] {
        let timing = subject.timing(4.0, 10.0, 0.0);
        let margin = subject.margins(&timing).delay_s;
        let growth = |extra: f64| {
            simulated_growth(&subject, &SampledLoop { delay_s: timing.delay_s + extra, ..timing })
        };
        let (inside, outside) = (growth(margin - 3e-4), growth(margin + 3e-4));
        assert!(inside < 0.9 && outside > 1.1, "{inside} {outside}");
    }
}

/// Kalman's inequality (Safonov, Athans, IEEE TAC 22, 1977): half the gain, any more gain and 60° are borne by
/// every LQR in continuous time.
#[test]
fn lqrs_guarantees_hold_as_the_tick_goes_to_0() {
    let mut generator = ChaCha8Rng::seed_from_u64(5);
    let mut draw = |low: f64, high: f64| 10_f64.powf(generator.random_range(low..=high));
    for _ in 0..50 {
        let subject = Subject::new(
            [12.5, 1.25, 0.0025, 0.063, draw(-1.3, -0.3), 0.10],
            [0; 4].map(|_| draw(-2.0, 2.0)),
            draw(-1.0, 2.0),
        );
        let tick_s = 1e-6;
        let timing = SampledLoop { tick_s, imu_period_s: tick_s, ..subject.timing(0.0, 0.0, 0.0) };
        let found = subject.margins(&timing);
        assert!(found.stable && found.gain_down <= 0.5 && found.gain_up > 100.0, "{found:?}");
        assert!(found.phase_rad > 59.9_f64.to_radians(), "{found:?}");
    }
}

#[test]
fn long_delays_cost_no_more_than_short_ones_and_mean_the_same() {
    let subject = Subject::new([18.0, 1.8, 0.01, 0.1, 4.0, 60.0], [1e-4, 1e-4, 1e-4, 1e-4], 1.0);
    let short = subject.margins(&subject.timing(10.0, 10.0, 0.0));
    let long = subject.margins(&subject.timing(100.0, 10.0, 0.0));
    assert!(long.stable && (short.delay_s - long.delay_s - 0.09).abs() < 1e-9, "{short:?} {long:?}");
    assert!(!subject.margins(&subject.timing(11.0 + 1e3 * short.delay_s, 10.0, 0.0)).stable);
}

#[test]
fn nonsense_is_unstable_and_no_panic() {
    let subject = heavy();
    let good = subject.timing(4.0, 10.0, 0.0);
    for bad in [
        SampledLoop { tick_s: 0.0, ..good },
        SampledLoop { tick_s: f64::NAN, ..good },
        SampledLoop { delay_s: -1.0, ..good },
        SampledLoop { delay_s: f64::INFINITY, ..good },
        SampledLoop { imu_period_s: f64::NAN, ..good },
        SampledLoop { wheel_radius_m: f64::NAN, ..good },
        SampledLoop { delay_s: 1e300, ..good },
        SampledLoop { imu_latency_s: 1e300, ..good },
    ] {
        assert!(!subject.margins(&bad).stable, "{bad:?}");
    }
    let broken = Matrix2x4::from_element(f64::NAN);
    assert!(!margins(&subject.model, &broken, &good).stable);
    assert!(!margins(&subject.model, &Matrix2x4::zeros(), &good).stable);
}
