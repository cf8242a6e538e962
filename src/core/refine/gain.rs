//! By how much an effect lowers the error on rows that took no part in the estimates, and how sure that is.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Most blocks of neighbouring rows, and fewest rows of a block and blocks of an interval.
const BLOCKS: usize = 40;
const LEAST_ROWS: usize = 25;
const LEAST_BLOCKS: usize = 6;
/// Times that the blocks are drawn anew, the same every time.
const DRAWS: usize = 2000;
const SEED: u64 = 95;

/// Share by which a residual's root mean square is lower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gain {
    /// On all held-out rows.
    pub(super) share: f64,
    /// 95 % interval by drawing blocks of these rows anew, as an effect may act in a few places alone; `None` if they
    /// are too few.
    pub(super) ci95: Option<[f64; 2]>,
}

impl Gain {
    /// Of residuals without and with the effect, on the held-out rows; `None` if there are none.
    pub(super) fn new(without: &[f64], with: &[f64], held_out: &[bool]) -> Option<Self> {
        let held = without.iter().zip(with).zip(held_out).filter(|(_, held)| **held);
        let squares: Vec<[f64; 2]> = held.map(|((a, b), _)| [a * a, b * b]).collect();
        let sum = |rows: &[[f64; 2]]| rows.iter().fold([0.0; 2], |[a, b], row| [a + row[0], b + row[1]]);
        let share = |[without, with]: [f64; 2]| 1.0 - (with / without).sqrt();
        let all = sum(&squares);
        if all[0] <= 0.0 || !all[0].is_finite() {
            return None;
        }
        let blocks = BLOCKS.min(squares.len() / LEAST_ROWS);
        if blocks < LEAST_BLOCKS {
            return Some(Self { share: share(all), ci95: None });
        }
        let edge = |n: usize| n * squares.len() / blocks;
        let sums: Vec<[f64; 2]> = (0..blocks).map(|n| sum(&squares[edge(n)..edge(n + 1)])).collect();
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let mut draw = || {
            let drawn: Vec<[f64; 2]> =
                (0..blocks).map(|_| sums[(random.next_u64() % blocks as u64) as usize]).collect();
            share(sum(&drawn))
        };
        let mut shares: Vec<f64> = (0..DRAWS).map(|_| draw()).filter(|share| share.is_finite()).collect();
        shares.sort_by(f64::total_cmp);
        let at = |part: f64| shares.get((part * shares.len() as f64) as usize).copied().unwrap_or(f64::NAN);
        Some(Self { share: share(all), ci95: Some([at(0.025), at(0.975)]) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of the error, everywhere: a gain of a half without doubt. In one place alone: it may be chance.
    #[test]
    fn a_gain_in_one_place_alone_is_not_sure() {
        let rows = 1200;
        let without = vec![2.0; rows];
        let held: Vec<bool> = (0..rows).map(|row| row >= 200).collect();
        let everywhere = Gain::new(&without, &vec![1.0; rows], &held).unwrap();
        assert!((everywhere.share - 0.5).abs() < 1e-12 && (everywhere.ci95.unwrap()[0] - 0.5).abs() < 1e-9);
        let once: Vec<f64> = (0..rows).map(|row| if (600..650).contains(&row) { 0.5 } else { 2.0 }).collect();
        let once = Gain::new(&without, &once, &held).unwrap();
        let [low, high] = once.ci95.unwrap();
        assert!(once.share > 0.02 && low <= 0.0 && high > once.share, "{once:?}");
        let few = Gain::new(&without[..100], &[1.0; 100], &[true; 100]).unwrap();
        assert!((few.share - 0.5).abs() < 1e-12 && few.ci95.is_none(), "{few:?}");
        assert_eq!(Gain::new(&without, &without, &vec![false; rows]), None);
    }
}
