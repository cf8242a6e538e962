//! Forward selection with swaps, of anything that can be fitted.

use crate::refine::error::RefineError;

/// Most effects that are named.
const MOST: usize = 6;
/// Most looks for another one.
const MOST_LOOKS: usize = 2 * MOST;

/// What picks are chosen for.
pub(super) trait Problem {
    type Pick: Clone;
    type Fit: Clone;

    /// None where the picks cannot be told apart.
    fn fit(&self, picks: &[Self::Pick]) -> Option<Self::Fit>;
    /// Error of a fit; less is better.
    fn score(&self, fit: &Self::Fit) -> f64;
    /// The most promising picks beside others, each with the fit of all.
    fn ranked(&self, picks: &[Self::Pick], now: &Self::Fit) -> Vec<(Self::Pick, Self::Fit)>;
    fn are_same(&self, a: &Self::Pick, b: &Self::Pick) -> bool;
    /// What a pick costs against a rival that does as well.
    fn handicap(&self, pick: &Self::Pick) -> f64;
    /// Gain below which nothing is named, and below which a pick is not.
    fn least(&self, score: f64) -> f64;
    fn least_of(&self, pick: &Self::Pick, score: f64) -> f64;
    /// Whether the last pick is worth its name.
    fn is_worth(&self, picks: &[Self::Pick], before: &Self::Fit, with: &Self::Fit) -> bool;
}

/// What was picked, and what was tried first, each alone.
pub(super) struct Selected<P: Problem + ?Sized> {
    pub(super) picks: Vec<P::Pick>,
    pub(super) tried: Vec<(P::Pick, P::Fit)>,
}

/// Adds picks until none is worth its name.
///
/// # Errors
/// The watcher, who is told the share of the work that is done, ended it.
pub(super) fn select<P: Problem + ?Sized>(
    problem: &P,
    mut picks: Vec<P::Pick>,
    watch: &mut dyn FnMut(f64) -> Result<(), RefineError>,
) -> Result<Selected<P>, RefineError> {
    let mut tried = Vec::new();
    let Some(mut now) = problem.fit(&[]) else { return Ok(Selected { picks, tried }) };
    // A swap may drop what was just added, and so on in a circle: looks are counted.
    for look in 0..MOST_LOOKS {
        watch(look as f64 / MOST_LOOKS as f64)?;
        if picks.len() >= MOST {
            break;
        }
        let ranked = problem.ranked(&picks, &now);
        if picks.is_empty() {
            tried.clone_from(&ranked);
        }
        let Some((pick, fit)) = first_of(problem, ranked) else { break };
        picks.push(pick);
        if !problem.is_worth(&picks, &now, &fit) {
            picks.pop();
            break;
        }
        now = fit;
        swap(problem, &mut picks, &mut now);
    }
    Ok(Selected { picks, tried })
}

/// Replaces picks where another does better, and drops those that others have made needless.
fn swap<P: Problem + ?Sized>(problem: &P, picks: &mut Vec<P::Pick>, now: &mut P::Fit) {
    for _ in 0..2 {
        let mut changed = false;
        let mut place = 0;
        while place < picks.len() && picks.len() > 1 {
            let mut others = picks.clone();
            let removed = others.remove(place);
            let Some(without) = problem.fit(&others) else { return };
            let score = problem.score(now);
            if problem.score(&without) - score < problem.least_of(&removed, score) {
                (*picks, *now) = (others, without);
                changed = true;
                continue;
            }
            if let Some((pick, fit)) = first_of(problem, problem.ranked(&others, &without))
                && problem.score(&fit) < score - 0.5 * problem.least(score)
                && !problem.are_same(&pick, &removed)
            {
                others.insert(place, pick);
                if let Some(fit) = problem.fit(&others) {
                    (*picks, *now) = (others, fit);
                    changed = true;
                }
            }
            place += 1;
        }
        if !changed {
            return;
        }
    }
}

/// The pick that lowers the score most; where others do as well, what needs less is preferred.
fn first_of<P: Problem + ?Sized>(problem: &P, ranked: Vec<(P::Pick, P::Fit)>) -> Option<(P::Pick, P::Fit)> {
    let price = |(pick, fit): &(P::Pick, P::Fit)| problem.score(fit) + problem.handicap(pick);
    ranked.into_iter().min_by(|a, b| price(a).total_cmp(&price(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of all sets of picks, and what stands first beside some of them.
    struct Table {
        scores: &'static [(&'static str, f64)],
        first: &'static [(&'static str, char)],
        least: fn(char) -> f64,
    }

    fn sorted(picks: &[char]) -> String {
        let mut picks = picks.to_vec();
        picks.sort_unstable();
        picks.into_iter().collect()
    }

    impl Problem for Table {
        type Pick = char;
        type Fit = f64;

        fn fit(&self, picks: &[char]) -> Option<f64> {
            self.scores.iter().find(|(set, _)| *set == sorted(picks)).map(|(_, score)| *score)
        }

        fn score(&self, fit: &f64) -> f64 {
            *fit
        }

        fn ranked(&self, picks: &[char], _: &f64) -> Vec<(char, f64)> {
            let first = self.first.iter().find(|(set, _)| *set == sorted(picks));
            let with = |pick: char| Some((pick, self.fit(&[picks, &[pick]].concat())?));
            first.and_then(|(_, pick)| with(*pick)).into_iter().collect()
        }

        fn are_same(&self, a: &char, b: &char) -> bool {
            a == b
        }

        fn handicap(&self, _: &char) -> f64 {
            0.0
        }

        fn least(&self, _: f64) -> f64 {
            22.0
        }

        fn least_of(&self, pick: &char, _: f64) -> f64 {
            (self.least)(*pick)
        }

        fn is_worth(&self, picks: &[char], before: &f64, with: &f64) -> bool {
            picks.last().is_some_and(|last| before - with > self.least_of(last, *before))
        }
    }

    fn selected(problem: &Table) -> (String, usize) {
        let mut looks = 0;
        let found = select(problem, Vec::new(), &mut |_| {
            looks += 1;
            if looks > 1000 { Err(RefineError::Cancelled) } else { Ok(()) }
        });
        (sorted(&found.map(|found| found.picks).unwrap_or_default()), looks)
    }

    /// b, then a beside it, for which c is swapped in, which makes a needless; b beside c makes c needless, which is asked
    /// for much more, and b is where it began.
    #[test]
    fn a_search_that_goes_round_in_a_circle_ends() {
        let circle = Table {
            scores: &[
                ("", 1200.0),
                ("a", 1000.0),
                ("b", 1000.0),
                ("c", 986.0),
                ("ab", 977.0),
                ("ac", 965.0),
                ("bc", 963.0),
            ],
            first: &[("", 'b'), ("b", 'a'), ("a", 'c'), ("c", 'b')],
            least: |pick| if pick == 'c' { 132.0 } else { 22.0 },
        };
        let (picks, looks) = selected(&circle);
        assert!(["b", "c"].contains(&picks.as_str()), "{picks}");
        assert_eq!(looks, MOST_LOOKS, "no look finds that nothing is worth adding");
    }

    #[test]
    fn a_search_ends_where_nothing_more_is_worth_its_name() {
        let plain = Table {
            scores: &[
                ("", 1200.0),
                ("a", 1000.0),
                ("ab", 900.0),
                ("b", 1100.0),
                ("abc", 890.0),
                ("bc", 1095.0),
                ("ac", 995.0),
            ],
            first: &[("", 'a'), ("a", 'b'), ("b", 'a'), ("ab", 'c')],
            least: |_| 22.0,
        };
        assert_eq!(selected(&plain), ("ab".to_owned(), 3));
    }
}
