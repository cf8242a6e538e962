//! Both runs in the background, and what came of the last two.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use flqr_core::model::{Model, Rig};
use flqr_core::simulate::Summary;

use super::run::{End, Recorded, Settings, Variant, command_line, run};
use super::signals::{Signal, signals};
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::runs::Run;

/// Settings and results of the last two runs.
#[derive(Debug)]
pub(super) struct Comparison {
    pub(super) settings: Settings,
    pub(super) model: Model,
    /// The file that held this very model when the runs began.
    pub(super) model_path: Option<PathBuf>,
    /// Without and with friction compensation; a refused run is a sentence.
    pub(super) runs: [Result<Box<Recorded>, String>; 2],
    /// Differs from that of any other comparison.
    pub(super) generation: u64,
    /// The rows of the runs in the ledger, once they have them.
    pub(super) rows: OnceLock<Vec<(Variant, Run)>>,
}

impl Comparison {
    /// The runs that were made.
    pub(super) fn recorded(&self) -> impl Iterator<Item = (Variant, &Recorded)> {
        Variant::ALL
            .into_iter()
            .zip(&self.runs)
            .filter_map(|(variant, run)| run.as_ref().ok().map(|recorded| (variant, &**recorded)))
    }

    /// Time of the last sample of both, s.
    pub(super) fn end_s(&self) -> f64 {
        self.recorded().map(|(_, run)| run.end_s()).fold(0.0, f64::max)
    }
}

impl Comparison {
    /// Start of the core's statistics, s.
    pub(super) fn statistics_from_s(&self) -> f64 {
        self.recorded().map(|(_, run)| run.statistics_from_s()).fold(0.0, f64::max)
    }

    /// Plotted signals.
    pub(super) fn signals(&self, degrees: bool) -> Vec<Signal> {
        let shafts = if matches!(self.model.rig, Rig::Axis(_)) { 1 } else { 2 };
        signals(self.settings.scenario.on_ground(), shafts, degrees)
    }

    /// Refusals and falls, each with the name of its controller.
    pub(super) fn failures(&self) -> Vec<(&'static str, String)> {
        let failure = |(variant, run): (Variant, &Result<Box<Recorded>, String>)| {
            let sentence = match run {
                Err(problem) => format!("{problem}."),
                Ok(run) => run.failure()?,
            };
            Some((variant.title(self.settings.scenario), sentence))
        };
        Variant::ALL.into_iter().zip(&self.runs).filter_map(failure).collect()
    }

    /// Warnings before the runs, each once with its controllers.
    pub(super) fn warnings(&self) -> Vec<(String, String)> {
        let mut all: Vec<(String, String)> = Vec::new();
        for (variant, run) in self.recorded() {
            let title = variant.title(self.settings.scenario);
            for warning in run.warnings() {
                match all.iter_mut().find(|(_, known)| known == warning) {
                    Some((titles, _)) => *titles = format!("{titles}, {title}"),
                    None => all.push((title.to_owned(), warning.clone())),
                }
            }
        }
        all
    }

    /// The command that makes a run again.
    pub(super) fn command_line(&self, variant: Variant) -> String {
        command_line(&self.settings, variant, self.model_path.as_deref())
    }

    /// The core's statistics of both runs over a range; `None` if a run has no sample in it.
    pub(super) fn statistics_between(&self, range_s: [f64; 2]) -> [Option<Vec<Summary>>; 2] {
        [0, 1].map(|index| self.runs[index].as_ref().ok()?.statistics_between(range_s))
    }
}

/// Both jobs; neither result is shown before both are there.
struct Running {
    settings: Settings,
    model: Model,
    model_path: Option<PathBuf>,
    jobs: [Job<f64, End>; 2],
    shares: [f64; 2],
    ended: [Option<End>; 2],
}

/// Starts, watches and ends runs.
#[derive(Default)]
pub(super) struct Runs {
    running: Option<Running>,
    comparison: Option<Arc<Comparison>>,
    generation: u64,
}

impl Runs {
    pub(super) fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Shares done, where runs are under way.
    pub(super) fn shares(&self) -> Option<[f64; 2]> {
        self.running.as_ref().map(|running| running.shares)
    }

    pub(super) fn comparison(&self) -> Option<&Arc<Comparison>> {
        self.comparison.as_ref()
    }

    /// Starts both runs; the results of before stay until the new ones are there.
    pub(super) fn start(
        &mut self,
        settings: &Settings,
        model: Model,
        model_path: Option<PathBuf>,
        waker: &Waker,
    ) -> std::io::Result<()> {
        let job = |variant: Variant| {
            let (settings, model) = (settings.clone(), model.clone());
            let work = move |reporter: &Reporter<f64>| {
                run(&settings, variant, &model, &mut |share| reporter.progress(share))
            };
            Job::start("experiment", waker, work)
        };
        let jobs = [job(Variant::Plain)?, job(Variant::Compensated)?];
        let settings = settings.clone();
        self.running =
            Some(Running { settings, model, model_path, jobs, shares: [0.0; 2], ended: [None, None] });
        Ok(())
    }

    pub(super) fn cancel(&self) {
        if let Some(running) = &self.running {
            running.jobs.iter().for_each(Job::cancel);
        }
    }

    /// Takes in what the jobs have brought; a sentence when both have ended.
    pub(super) fn drain(&mut self) -> Option<String> {
        let running = self.running.as_mut()?;
        for index in 0..2 {
            running.drain(index);
        }
        if running.ended.iter().any(Option::is_none) {
            return None;
        }
        let Running { settings, model, model_path, ended, .. } = self.running.take()?;
        let ended = ended.map(|end| end.expect("both have just been found"));
        if ended.iter().any(|end| matches!(end, End::Cancelled)) {
            return Some(match self.comparison {
                Some(_) => "Cancelled. The previous results are still shown.".to_owned(),
                None => "Cancelled without a result.".to_owned(),
            });
        }
        let runs = ended.map(|end| match end {
            End::Complete(recorded) => Ok(recorded),
            End::Refused(problem) => Err(problem),
            End::Cancelled => unreachable!("a cancelled run ends both"),
        });
        self.generation += 1;
        let rows = OnceLock::new();
        let comparison = Comparison { settings, model, model_path, runs, generation: self.generation, rows };
        let message = summary(&comparison);
        self.comparison = Some(Arc::new(comparison));
        Some(message)
    }
}

impl Running {
    fn drain(&mut self, index: usize) {
        if self.ended[index].is_some() {
            return;
        }
        let (shares, outcome) = self.jobs[index].poll();
        if let Some(share) = shares.last() {
            self.shares[index] = *share;
        }
        self.ended[index] = match outcome {
            Outcome::Running => None,
            Outcome::Done(end) => Some(end),
            Outcome::Broken => Some(End::Refused("The run failed: this is an internal error".to_owned())),
        };
        if self.ended[index].is_some() {
            self.shares[index] = 1.0;
        }
    }
}

fn summary(comparison: &Comparison) -> String {
    let scenario = comparison.settings.scenario;
    let refused = |(variant, run): (Variant, &Result<Box<Recorded>, String>)| {
        run.as_ref().err().map(|problem| format!("{}: {problem}.", variant.title(scenario)))
    };
    let refused: Vec<String> = Variant::ALL.into_iter().zip(&comparison.runs).filter_map(refused).collect();
    if !refused.is_empty() {
        return refused.join(" ");
    }
    let failures: Vec<String> =
        comparison.failures().iter().map(|(name, sentence)| format!("{name} {sentence}")).collect();
    if failures.is_empty() {
        format!("{}: both runs are done.", scenario.title())
    } else {
        format!("{}: {}", scenario.title(), failures.join(" "))
    }
}
