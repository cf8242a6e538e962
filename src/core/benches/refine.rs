//! Speed of least squares with selection: 60 s at 1 kHz, 15 columns, of which 5 are nuisances.

use divan::{Bencher, black_box};
use flqr_core::refine::select::{Blocks, Member};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

const ROWS: usize = 60_000;
const COLUMNS: usize = 15;
const NUISANCES: usize = 5;

fn main() {
    divan::main();
}

/// Columns, a target of the first seven, and blocks of 5 s.
fn problem() -> (Vec<Vec<f64>>, Vec<f64>, Vec<usize>) {
    let mut random = ChaCha8Rng::seed_from_u64(60);
    let mut uniform = || random.next_u64() as f64 / u64::MAX as f64 - 0.5;
    let columns: Vec<Vec<f64>> = (0..COLUMNS).map(|_| (0..ROWS).map(|_| uniform()).collect()).collect();
    let target =
        (0..ROWS).map(|row| columns[..7].iter().map(|column| column[row]).sum::<f64>() + uniform()).collect();
    (columns, target, (0..ROWS).map(|row| row / 5000).collect())
}

/// The pass over the rows, and two effects chosen by the error of left-out blocks.
#[divan::bench]
fn least_squares_with_selection(bencher: Bencher) {
    let (columns, target, block) = problem();
    let views: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    bencher.bench_local(|| {
        let blocks = Blocks::new(black_box(&views), &target, &block);
        let mut members: Vec<Member> = (0..NUISANCES).map(Member::free).collect();
        for _ in 0..2 {
            let fit = |column: usize| {
                let with: Vec<Member> = members.iter().copied().chain([Member::free(column)]).collect();
                blocks.fit(&with, 1.0).map_or(f64::INFINITY, |values| blocks.left(&with, &values))
            };
            let rest =
                (NUISANCES..COLUMNS).filter(|&column| members.iter().all(|member| member.column != column));
            let best = rest.map(|column| (fit(column), column)).min_by(|a, b| a.0.total_cmp(&b.0));
            members.extend(best.map(|(_, column)| Member::free(column)));
        }
        blocks.judge(&members, 1.0)
    });
}
