//! Accuracy of the refinement over the cases of the independent generator, as a table.
//!
//! `cargo bench -p flqr-core --bench undeclared -- [family…] [--first ROUND] [--rounds N] [--noise FACTOR] [--seconds
//! LENGTH] [--alone] [--verbose]`; families: clean, tolerance, single, quarter, pairs, outside, the same of a motor
//! on a bench behind `bench-` (`bench` for all of those), the id of an effect, or the generator's name of one. Rounds
//! 0 to 29 are for work on the method; figures are distinguished from later ones. `--seconds` makes logs of that
//! length without another log next to them, so that the last third is held out; `--alone` assesses one case at a
//! time, which is what its time is to be measured with.

#![expect(clippy::print_stdout, clippy::disallowed_methods, reason = "a table for people, with its time")]
#[path = "../tests/undeclared/generator/mod.rs"]
mod generator;

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::time::Instant;

use flqr_core::model::Model;
use flqr_core::record::Log;
use flqr_core::refine::{Options, Refinement, Verdict, refine};
use generator::bench_cases::{self, BenchCase, Flaw};
use generator::fault::Fault;
use generator::robot_run::Recording;
use generator::{Case, Conditions, cases};

/// Clean robots of a round, and as many within the tolerances.
const CLEAN: u64 = 8;

/// Length of a log.
const SECONDS: f64 = 40.0;

/// A case with its truth.
struct Trial {
    name: String,
    /// What it has, for people.
    faults: String,
    model: String,
    ids: Vec<&'static str>,
    /// Id, key and true value.
    sizes: Vec<(&'static str, &'static str, f64)>,
    /// The log, or the held-out one, with a factor on its noise, of so many seconds.
    record: Box<dyn Fn(bool, f64, f64) -> Option<Recording> + Send + Sync>,
}

impl From<Case> for Trial {
    fn from(case: Case) -> Self {
        let weight_n = (case.declared.mass + 2.0 * case.declared.wheel) * case.declared.gravity;
        let size = |fault: &Fault| {
            let (key, value) = fault.truth(weight_n)?;
            Some((fault.id()?, key, value))
        };
        Self {
            name: case.name.clone(),
            faults: format!("{:?}", case.faults),
            model: case.declared.model_file(),
            ids: case.faults.iter().filter_map(|fault| fault.id()).collect(),
            sizes: case.faults.iter().filter_map(size).collect(),
            record: Box::new(move |held_out, noise, seconds| {
                case.record(held_out, Conditions { noise, seconds, ..Conditions::default() })
            }),
        }
    }
}

impl From<BenchCase> for Trial {
    fn from(case: BenchCase) -> Self {
        let size = |flaw: &Flaw| {
            let (key, value) = flaw.truth(&case.declared)?;
            Some((flaw.id()?, key, value))
        };
        Self {
            name: case.name.clone(),
            faults: format!("{:?}", case.flaws),
            model: case.model_file(),
            ids: case.ids(),
            sizes: case.flaws.iter().filter_map(size).collect(),
            record: Box::new(move |held_out, noise, seconds| Some(case.record(held_out, seconds, noise))),
        }
    }
}

struct Outcome {
    line: String,
    seconds: f64,
    named: Vec<&'static str>,
    first_right: bool,
    all_right: bool,
    unexplained: bool,
    ratio: f64,
    /// Of each size that is known: whether it is in its interval, by what share it is off, and the interval's half
    /// width.
    sizes: Vec<(bool, f64, f64)>,
}

/// What the command line asks for.
struct Wanted {
    families: Vec<String>,
    first: u64,
    rounds: u64,
    noise: f64,
    seconds: Option<f64>,
    threads: NonZeroUsize,
    verbose: bool,
}

impl Wanted {
    fn new() -> Self {
        let mut wanted = Self {
            families: Vec::new(),
            first: 0,
            rounds: 2,
            noise: 1.0,
            seconds: None,
            threads: NonZeroUsize::new(2).expect("two"),
            verbose: false,
        };
        let mut words = std::env::args().skip(1);
        while let Some(word) = words.next() {
            let mut number = || words.next().and_then(|n| n.parse::<f64>().ok()).expect("a number");
            match word.as_str() {
                "--first" => wanted.first = number() as u64,
                "--rounds" => wanted.rounds = number() as u64,
                "--noise" => wanted.noise = number(),
                "--seconds" => wanted.seconds = Some(number()),
                "--alone" => wanted.threads = NonZeroUsize::MIN,
                "--verbose" => wanted.verbose = true,
                "--bench" => {}
                _ => wanted.families.push(word),
            }
        }
        wanted
    }

    /// Cases of the rounds that are requested; every round has seeds of its own.
    fn cases(&self) -> Vec<(&'static str, Trial)> {
        let mut list = Vec::new();
        let mut add = |family: &'static str, case: Trial| {
            let rig = family.split_once('-').map(|(rig, _)| rig);
            let wanted = |w: &String| {
                w == family
                    || *w == case.name
                    || Some(w.as_str()) == rig
                    || case.faults[1..].starts_with(w.as_str())
            };
            if self.families.is_empty() || self.families.iter().any(wanted) {
                list.push((family, case));
            }
        };
        for round in self.first..self.first + self.rounds {
            for seed in CLEAN * round..CLEAN * (round + 1) {
                add("clean", cases::clean(seed, 0.0).into());
                add("tolerance", cases::clean(1000 + seed, 1.0).into());
                add("bench-clean", BenchCase::clean(seed, 0.0).into());
                add("bench-tolerance", BenchCase::clean(1000 + seed, 0.01).into());
            }
            for kind in 0..cases::SINGLES {
                add("single", cases::one(kind, 1.0, 100 + 100 * round + kind as u64).into());
                add("quarter", cases::one(kind, 0.25, 2100 + 100 * round + kind as u64).into());
            }
            for (pair, seed) in cases::PAIRS.iter().zip(4000 + 100 * round..) {
                add("pairs", cases::two(*pair, seed).into());
            }
            for (kind, seed) in (0..cases::OUTSIDE).zip(5000 + 100 * round..) {
                add("outside", cases::unknown(kind, seed).into());
            }
            let seeds = 100 * round..;
            for (kind, seed) in (0..bench_cases::SINGLES).zip(seeds.clone()) {
                add("bench-single", BenchCase::with(&[kind], 1.0, 2000 + seed).into());
                add("bench-quarter", BenchCase::with(&[kind], 0.25, 30_000 + seed).into());
            }
            for (pair, seed) in bench_cases::PAIRS.iter().zip(seeds.clone()) {
                add("bench-pairs", BenchCase::with(pair, 1.0, 60_000 + seed).into());
            }
            for (kind, seed) in (0..bench_cases::OUTSIDE).zip(seeds) {
                add("bench-outside", BenchCase::unknown(kind, 90_000 + seed).into());
            }
        }
        list
    }
}

fn judge(family: &'static str, case: &Trial, wanted: &Wanted) -> Option<Outcome> {
    let seconds = wanted.seconds.unwrap_or(SECONDS);
    let log = |held_out| {
        let recording = (case.record)(held_out, wanted.noise, seconds)?;
        Some(Log::from_columns(case.name.clone(), recording))
    };
    let training = log(false)?;
    let held_out = if wanted.seconds.is_none() { vec![log(true)?] } else { Vec::new() };
    let model = Model::from_toml(&case.model, "declared").expect("the generator writes models");
    let start = Instant::now();
    let found =
        refine(&model, &[training], &held_out, &Options::default(), &mut |_| ControlFlow::Continue(()))
            .expect("a whole log");
    let seconds = start.elapsed().as_secs_f64();
    let ids = &case.ids;
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
    let sizes: Vec<(bool, f64, f64)> =
        case.sizes.iter().filter_map(|&(id, key, truth)| size(&found, id, (key, truth))).collect();
    let line =
        format!("{mark} {family:9} {:28} {}\n      -> {}", case.name, case.faults, told(&found, ratio))
            + &format!(" {sizes:.2?}");
    Some(Outcome { line, seconds, named, first_right, all_right, unexplained, ratio, sizes })
}

fn size(found: &Refinement, id: &str, (key, truth): (&str, f64)) -> Option<(bool, f64, f64)> {
    let found = found.effects.iter().find(|found| found.effect.id() == id)?;
    let place = found.effect.parameters().iter().position(|(name, _)| name == key)?;
    let [low, high] = found.ci95[place]?;
    let off = found.effect.parameters()[place].1 / truth - 1.0;
    Some(((low..=high).contains(&truth), off, 0.5 * (high - low) / truth.abs()))
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
        .map(|c| {
            format!("{} {} {:.2}% z{:.1} {}", c.kind.id, c.detail, c.gain_percent, c.z, c.outcome.name())
        })
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
    let outcomes = flqr_core::parallel::map(&list, wanted.threads, |(family, case)| {
        let outcome = judge(family, case, &wanted);
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
    let sizes: Vec<(bool, f64, f64)> =
        outcomes.iter().flatten().flat_map(|outcome| outcome.sizes.clone()).collect();
    let inside = sizes.iter().filter(|(inside, ..)| *inside).count();
    println!("{inside} of {} intervals hold the true size", sizes.len());
    println!("family           runs  first right  all right  unexplained  named  error/floor  s");
    for (family, [runs, first, all, unexplained, named, seconds]) in table {
        let list = ratios.get_mut(family).expect("as many");
        list.sort_by(f64::total_cmp);
        println!(
            "{family:15} {runs:5} {:11.1}% {:9.1}% {:11.1}% {:5.1}% {:12.2} {:.2}",
            100.0 * first / runs,
            100.0 * all / runs,
            100.0 * unexplained / runs,
            100.0 * named / runs,
            list[list.len() / 2],
            seconds / runs
        );
    }
}
