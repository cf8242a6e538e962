//! Speed of the friction fit on the paper's problem.

use divan::{Bencher, black_box};
use flqr_core::friction::{Stribeck, StribeckParameters};
use flqr_core::identify::{FrictionPair, Pso, PsoSettings, SearchBox};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

fn main() {
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
