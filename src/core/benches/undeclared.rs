//! Accuracy of the refinement over the cases of the independent generator, as a table.
//!
//! `cargo bench -p flqr-core --bench undeclared -- [family…] [--first ROUND] [--rounds N] [--noise FACTOR] [--verbose]`;
//! families: clean, tolerance, single, quarter, pairs, outside, or the id of an effect. Rounds 0 to 2 are those that the
//! method was tuned on; figures are told from round 10 on.

#![expect(clippy::print_stdout, clippy::disallowed_methods, reason = "a table for people, with its time")]
#[path = "../tests/undeclared/generator/mod.rs"]
mod generator;

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::time::Instant;

use flqr_core::model_file::Model;
use flqr_core::record::Log;
use flqr_core::refine::{Options, Refinement, Verdict, refine};
use generator::{Case, Conditions, cases};

/// Clean robots of a round, and as many within the tolerances.
const CLEAN: u64 = 8;

struct Outcome {
    line: String,
    seconds: f64,
    named: Vec<&'static str>,
    first_right: bool,
    all_right: bool,
    unexplained: bool,
    ratio: f64,
    /// Of each size that is known: whether it is in its interval, and by what share it is off.
    sizes: Vec<(bool, f64)>,
}

/// What the command line asks for.
struct Wanted {
    families: Vec<String>,
    first: u64,
    rounds: u64,
    noise: f64,
    verbose: bool,
}

impl Wanted {
    fn new() -> Self {
        let mut wanted = Self { families: Vec::new(), first: 0, rounds: 2, noise: 1.0, verbose: false };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut number = || words.next().and_then(|n| n.parse::<f64>().ok()).expect("a number");
            match word.as_str() {
                "--first" => wanted.first = number() as u64,
                "--rounds" => wanted.rounds = number() as u64,
                "--noise" => wanted.noise = number(),
                "--verbose" => wanted.verbose = true,
                "--bench" => {}
                _ => wanted.families.push(word),
            }
        }
        wanted
    }

    /// Cases of the rounds that are asked for; every round has seeds of its own.
    fn cases(&self) -> Vec<(&'static str, Case)> {
        let mut list = Vec::new();
        let mut add = |family: &'static str, case: Case| {
            if self.families.is_empty() || self.families.iter().any(|w| w == family || *w == case.name) {
                list.push((family, case));
            }
        };
        for round in self.first..self.first + self.rounds {
            for seed in CLEAN * round..CLEAN * (round + 1) {
                add("clean", cases::clean(seed, 0.0));
                add("tolerance", cases::clean(1000 + seed, 0.01));
            }
            for kind in 0..cases::SINGLES {
                add("single", cases::one(kind, 1.0, 100 + 100 * round + kind as u64));
                add("quarter", cases::one(kind, 0.25, 2100 + 100 * round + kind as u64));
            }
            for (pair, seed) in cases::PAIRS.iter().zip(4000 + 100 * round..) {
                add("pairs", cases::two(*pair, seed));
            }
            for (kind, seed) in (0..cases::OUTSIDE).zip(5000 + 100 * round..) {
                add("outside", cases::unknown(kind, seed));
            }
        }
        list
    }
}

fn log(case: &Case, held_out: bool, noise: f64) -> Option<Log> {
    let recording = case.record(held_out, Conditions { noise, ..Conditions::default() })?;
    Some(Log::from_columns(case.name.clone(), recording))
}

fn judge(family: &'static str, case: &Case, noise: f64) -> Option<Outcome> {
    let (training, held_out) = (log(case, false, noise)?, log(case, true, noise)?);
    let model =
        Model::from_toml(&case.declared.model_file(), "declared").expect("the generator writes models");
    let start = Instant::now();
    let found =
        refine(&model, &[training], &[held_out], &Options::default(), &mut |_| ControlFlow::Continue(()))
            .expect("a whole log");
    let seconds = start.elapsed().as_secs_f64();
    let ids: Vec<&'static str> = case.faults.iter().filter_map(|fault| fault.id()).collect();
    let is = |found: &flqr_core::refine::Found, id: &str| {
        found.effect.id() == id || found.ambiguous_with.iter().any(|kind| kind.id == id)
    };
    let named: Vec<&'static str> = found.effects.iter().map(|found| found.effect.id()).collect();
    let first_right = match found.effects.first() {
        Some(first) => ids.iter().any(|id| is(first, id)),
        None => ids.is_empty(),
    };
    let all_right = found.effects.len() == ids.len()
        && ids.iter().all(|id| found.effects.iter().any(|found| is(found, id)));
    let unexplained = !found.unexplained.description.is_empty();
    let errors = |i: usize| found.after.rmse.0[i].1.value / found.after.noise_floor.0[i].1.value;
    let ratio = if found.verdict == Verdict::DataUnfit { f64::NAN } else { errors(0) };
    let mark = if all_right && !unexplained {
        ' '
    } else if first_right {
        '!'
    } else {
        'X'
    };
    let weight_n = (case.declared.mass + 2.0 * case.declared.wheel) * case.declared.gravity;
    let sizes = case
        .faults
        .iter()
        .filter_map(|fault| size(&found, fault.id()?, fault.truth(weight_n)?))
        .collect::<Vec<_>>();
    let line =
        format!("{mark} {family:9} {:28} {:?}\n      -> {}", case.name, case.faults, told(&found, ratio))
            + &format!(" {sizes:.2?}");
    Some(Outcome { line, seconds, named, first_right, all_right, unexplained, ratio, sizes })
}

fn size(found: &Refinement, id: &str, (key, truth): (&str, f64)) -> Option<(bool, f64)> {
    let found = found.effects.iter().find(|found| found.effect.id() == id)?;
    let place = found.effect.parameters().iter().position(|(name, _)| name == key)?;
    let [low, high] = found.ci95[place]?;
    Some(((low..=high).contains(&truth), found.effect.parameters()[place].1 / truth - 1.0))
}

fn told(found: &Refinement, ratio: f64) -> String {
    let effect = |found: &flqr_core::refine::Found| {
        let others: Vec<&str> = found.ambiguous_with.iter().map(|kind| kind.id).collect();
        let values: Vec<String> =
            found.effect.parameters().iter().map(|(key, value)| format!("{key}={value:.4}")).collect();
        format!("{}({}) -{:.0}% {others:?}", found.effect.id(), values.join(" "), found.error_drop_percent)
    };
    let effects: Vec<String> = found.effects.iter().map(effect).collect();
    let errors: Vec<&str> = found
        .data_health
        .iter()
        .filter(|f| f.severity == flqr_core::record::Severity::Error)
        .map(|f| f.problem.as_str())
        .collect();
    let tried: Vec<String> = found
        .candidates
        .iter()
        .take(4)
        .map(|c| format!("{} {} {:.2}% z{:.1} {}", c.kind.id, c.detail, c.gain_percent, c.z, c.fate.name()))
        .collect();
    format!(
        "{:?} {} | x{ratio:.2} {} {:?} {errors:?}\n      tried {tried:?}\n     ",
        found.verdict,
        effects.join(" + "),
        found.unexplained.description,
        found.unexplained.depends_on
    )
}

fn main() {
    let wanted = Wanted::new();
    let list = wanted.cases();
    let threads = NonZeroUsize::new(2).expect("two");
    let outcomes = flqr_core::parallel::map(&list, threads, |(family, case)| {
        let outcome = judge(family, case, wanted.noise);
        if let Some(outcome) = &outcome
            && wanted.verbose
        {
            println!("{}", outcome.line);
        }
        outcome
    });
    let mut table: BTreeMap<&str, [f64; 6]> = BTreeMap::new();
    let mut ratios: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for ((family, _), outcome) in list.iter().zip(&outcomes) {
        let Some(outcome) = outcome else { continue };
        let row = table.entry(family).or_default();
        row[0] += 1.0;
        row[1] += f64::from(u8::from(outcome.first_right));
        row[2] += f64::from(u8::from(outcome.all_right));
        row[3] += f64::from(u8::from(outcome.unexplained));
        row[4] += f64::from(u8::from(!outcome.named.is_empty()));
        row[5] += outcome.seconds;
        ratios.entry(family).or_default().push(outcome.ratio);
    }
    let sizes: Vec<(bool, f64)> =
        outcomes.iter().flatten().flat_map(|outcome| outcome.sizes.clone()).collect();
    let inside = sizes.iter().filter(|(inside, _)| *inside).count();
    println!("{inside} of {} intervals hold the true size", sizes.len());
    println!("family      runs  first right  all right  unexplained  named  error/floor  s");
    for (family, [runs, first, all, unexplained, named, seconds]) in table {
        let list = ratios.get_mut(family).expect("as many");
        list.sort_by(f64::total_cmp);
        println!(
            "{family:10} {runs:5} {:11.1}% {:9.1}% {:11.1}% {:5.1}% {:12.2} {:.2}",
            100.0 * first / runs,
            100.0 * all / runs,
            100.0 * unexplained / runs,
            100.0 * named / runs,
            list[list.len() / 2],
            seconds / runs
        );
    }
}
