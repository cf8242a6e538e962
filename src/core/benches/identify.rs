//! Speed of the friction fit on the paper's problem: 128 particles, 500 iterations, 260 pairs.
//!
//! `peer_swarm` is the same search by argmin, with its own update rule. The RMSE of both is on standard error.

use argmin::core::{CostFunction, Executor};
use argmin::solver::particleswarm::ParticleSwarm;
use divan::{Bencher, black_box};
use flqr_core::friction::{Stribeck, StribeckParameters};
use flqr_core::identify::{FitOptions, FrictionPair, Pso, PsoSettings, SearchBox, fit_pairs, polish_pairs};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

#[expect(clippy::print_stderr, reason = "the errors reached belong beside the times")]
fn main() {
    let pairs = pairs();
    let range = SearchBox::from_pairs(&pairs);
    let best = polish_pairs(&pairs, &range).map_or(f64::NAN, |(_, rmse)| rmse);
    let ours =
        Pso::new(&pairs, range, PsoSettings::default(), 1).last().map_or(f64::NAN, |p| p.best_error_nm);
    eprintln!("RMSE / optimum: swarm {:.6}, peer {:.6}", ours / best, argmin_swarm(&pairs, &range) / best);
    divan::main();
}

/// 260 even speeds from −50 to 50 rad/s through the paper's left motor (Table 4), 0.002 N m of noise.
fn pairs() -> Vec<FrictionPair> {
    let curve = Stribeck::new(StribeckParameters {
        coulomb_nm: 0.0338,
        static_nm: 0.0761,
        viscous_nm_s_rad: 4.9e-4,
        stribeck_speed_rad_s: 1.612,
        stribeck_exponent: 0.2310,
        offset_nm: -0.0016,
    })
    .expect("Table 4 is valid");
    let mut random = ChaCha8Rng::seed_from_u64(2025);
    let mut uniform = || random.next_u64() as f64 / u64::MAX as f64;
    (0..260)
        .map(|i| -50.0 + 100.0 * f64::from(i) / 259.0)
        .map(|speed_rad_s| {
            let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            FrictionPair { speed_rad_s, torque_nm: curve.torque_nm(speed_rad_s) + 0.002 * noise }
        })
        .collect()
}

#[divan::bench(sample_count = 30)]
fn swarm(bencher: Bencher) {
    let pairs = pairs();
    let range = SearchBox::from_pairs(&pairs);
    bencher.bench(|| Pso::new(black_box(&pairs), range, PsoSettings::default(), 1).last());
}

#[divan::bench]
fn polish_alone(bencher: Bencher) {
    let pairs = pairs();
    let range = SearchBox::from_pairs(&pairs);
    bencher.bench(|| polish_pairs(black_box(&pairs), &range));
}

#[divan::bench(sample_count = 30)]
fn fit_with_intervals(bencher: Bencher) {
    let pairs = pairs();
    let go_on = &mut |_: &_| std::ops::ControlFlow::Continue(());
    bencher.bench_local(|| fit_pairs(black_box(&pairs), "made up", &FitOptions::default(), go_on));
}

#[divan::bench(sample_count = 10)]
fn peer_swarm(bencher: Bencher) {
    let pairs = pairs();
    let range = SearchBox::from_pairs(&pairs);
    bencher.bench(|| argmin_swarm(black_box(&pairs), &range));
}

struct MeanSquare<'a>(&'a [FrictionPair]);

impl CostFunction for MeanSquare<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, p: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let square = |pair: &FrictionPair| {
            let q = pair.speed_rad_s;
            let fading = (-(q.abs() / p[2]).powf(p[3])).exp();
            ((p[0] + (p[1] - p[0]) * fading) * q.signum() + p[4] * q + p[5] - pair.torque_nm).powi(2)
        };
        Ok(self.0.iter().map(square).sum::<f64>() / self.0.len() as f64)
    }
}

/// RMSE that argmin's swarm reaches, N m.
fn argmin_swarm(pairs: &[FrictionPair], range: &SearchBox) -> f64 {
    let solver = ParticleSwarm::new((range.lower.to_vec(), range.upper.to_vec()), 128);
    let result = Executor::new(MeanSquare(pairs), solver).configure(|state| state.max_iters(500)).run();
    result.expect("the cost never fails").state().get_best_cost().sqrt()
}
