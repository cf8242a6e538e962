//! A question to the logs on a worker thread, and the last answers with what they were made of.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use flqr_core::model::{Model, Motor};
use flqr_core::model_file::presets;
use flqr_core::record::{Log, LogKind};
use flqr_core::refine::{
    self, Demonstration, DemonstrationError, Options, RefineError, Refinement, Residual, Truth, Verdict,
};

use super::sources::Input;
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::load::LoadedLog;
use crate::messages::{Said, Severity};
use crate::runs::Sources;
use crate::shell_word::quoted;

/// Kinds of searches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Question {
    /// Residual from the logs.
    Residual,
    /// Missing effects.
    Refine,
    /// Missing effects of a simulated robot, recorded first.
    Demo,
}

impl Question {
    /// As in the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Residual => "residual",
            Self::Refine => "refine",
            Self::Demo => "demo",
        }
    }
}

/// Typed settings besides the logs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Settings {
    /// Motor of a robot that a bench log belongs to.
    pub(super) motor: Motor,
    /// Parameters that are free, separated by commas.
    pub(super) estimate: String,
    pub(super) seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { motor: Motor::Left, estimate: String::new(), seed: 1 }
    }
}

impl Settings {
    fn names(&self) -> Vec<String> {
        self.estimate.split([',', ' ']).filter(|name| !name.is_empty()).map(str::to_owned).collect()
    }

    fn options(&self) -> Options {
        Options { motor: self.motor, estimate: self.names(), seed: self.seed, ..Options::default() }
    }
}

/// Inputs of a result.
#[derive(Clone, PartialEq)]
pub(super) struct Made {
    pub(super) model: Model,
    pub(super) inputs: Vec<Input>,
    pub(super) settings: Settings,
}

impl Made {
    /// The refined model without the effects that are not ticked.
    pub(super) fn refined_with(&self, found: &Refinement, ticks: &[bool]) -> Model {
        let whole_machine = self.inputs.iter().any(|input| input.log.serves(LogKind::Robot));
        let motor = (!whole_machine).then_some(self.settings.motor);
        let left_out = found.effects.iter().zip(ticks).filter(|(_, tick)| !**tick);
        left_out.fold(found.model.clone(), |model, (found, _)| refine::without(model, &found.effect, motor))
    }

    /// The command that gives the same answer; `model` is the file that holds this very model.
    pub(super) fn command_line(&self, question: Question, model: Option<&Path>) -> String {
        if self.inputs.iter().any(|input| input.made) {
            return format!("flqr demo --seed {}", self.settings.seed);
        }
        let file = |path: &Path| quoted(&path.display().to_string());
        let mut line = format!("flqr {} {}", question.name(), model.map_or("MODEL.toml".into(), file));
        for input in self.inputs.iter().filter(|input| !input.held_out || question == Question::Residual) {
            line += &format!(" {}", file(&input.path));
        }
        for input in self.inputs.iter().filter(|input| input.held_out && question == Question::Refine) {
            line += &format!(" --heldout {}", file(&input.path));
        }
        let mut maps: Vec<String> = Vec::new();
        for mapping in self.inputs.iter().flat_map(|input| &input.map) {
            let word = quoted(&mapping.to_string());
            if !maps.contains(&word) {
                line += &format!(" --map {word}");
                maps.push(word);
            }
        }
        let names = self.settings.names();
        if !names.is_empty() {
            line += &format!(" --estimate {}", quoted(&names.join(",")));
        }
        if self.settings.motor == Motor::Right {
            line += " --motor right";
        }
        format!("{line} --seed {}", self.settings.seed)
    }
}

/// An answer and what it was made of.
pub(super) struct Answered<T> {
    pub(super) made: Made,
    /// The file that held the model when the question was put.
    pub(super) model_path: Option<PathBuf>,
    pub(super) answer: T,
    pub(super) sources: Sources,
    /// Differs from that of any other answer.
    pub(super) generation: u64,
}

enum Answer {
    Residual(Box<Residual>),
    Refined(Box<Refinement>),
    Shown(Box<Demonstration>),
}

enum End {
    Answered(Answer, Sources),
    Cancelled,
    Refused(String),
}

struct Running {
    question: Question,
    made: Made,
    model_path: Option<PathBuf>,
    job: Job<f64, End>,
    share: f64,
}

/// Outcome of a search.
pub(super) struct Drained {
    pub(super) question: Question,
    /// A sentence about it.
    pub(super) said: Said,
    /// True if there is another answer.
    pub(super) answered: bool,
    /// Recorded data, if any.
    pub(super) records: Option<Vec<LoadedLog>>,
}

/// Puts questions, watches and ends them.
#[derive(Default)]
pub(super) struct Run {
    running: Option<Running>,
    pub(super) residual: Option<Answered<Box<Residual>>>,
    pub(super) refined: Option<Answered<Box<Refinement>>>,
    /// Hidden effect of the last demo.
    pub(super) truth: Option<Truth>,
    pub(super) problem: Option<String>,
    generation: u64,
}

impl Run {
    /// The question that is being answered, and how much of the work is done.
    pub(super) fn running(&self) -> Option<(Question, f64)> {
        self.running.as_ref().map(|running| (running.question, running.share))
    }

    /// Starts; the answers of before stay until there is another one.
    pub(super) fn start(
        &mut self,
        question: Question,
        made: Made,
        model_path: Option<PathBuf>,
        waker: &Waker,
    ) -> Result<(), String> {
        let work = {
            let made = made.clone();
            move |reporter: &Reporter<f64>| answer(question, &made, &mut |share| reporter.progress(share))
        };
        let job = Job::start("refine", waker, work).map_err(|e| format!("Cannot start the search: {e}."))?;
        self.problem = None;
        self.running = Some(Running { question, made, model_path, job, share: 0.0 });
        Ok(())
    }

    pub(super) fn cancel(&self) {
        if let Some(running) = &self.running {
            running.job.cancel();
        }
    }

    /// The question that has just ended.
    pub(super) fn drain(&mut self) -> Option<Drained> {
        let running = self.running.as_mut()?;
        let (shares, outcome) = running.job.poll();
        running.share = shares.last().copied().unwrap_or(running.share);
        let end = match outcome {
            Outcome::Running => return None,
            Outcome::Done(end) => end,
            Outcome::Broken => End::Refused("The search failed: this is an internal error".to_owned()),
        };
        let Running { question, made, model_path, .. } = self.running.take()?;
        self.generation += 1;
        let generation = self.generation;
        let answered = matches!(end, End::Answered(..));
        let mut records = None;
        let severity = if matches!(end, End::Refused(_)) { Severity::Error } else { Severity::Note };
        let text = match end {
            End::Cancelled => "Cancelled. The previous results are still shown.".to_owned(),
            End::Refused(problem) => {
                self.problem = Some(problem.clone());
                format!("{problem}.")
            }
            End::Answered(Answer::Residual(answer), sources) => {
                self.residual = Some(Answered { made, model_path, answer, sources, generation });
                "Residual computed.".to_owned()
            }
            End::Answered(Answer::Refined(answer), sources) => {
                let text = format!("{}.", verdict_text(&answer));
                self.truth = None;
                self.refined = Some(Answered { made, model_path, answer, sources, generation });
                text
            }
            End::Answered(Answer::Shown(shown), sources) => {
                let Demonstration { found, truth, logs } = *shown;
                let text = format!("{}.", verdict_text(&found));
                let logs: Vec<LoadedLog> = logs.into_iter().map(LoadedLog::made).collect();
                let made = Made { inputs: logs.iter().map(Input::made).collect(), ..made };
                self.truth = Some(truth);
                let answer = Box::new(found);
                self.refined = Some(Answered { made, model_path, answer, sources, generation });
                records = Some(logs);
                text
            }
        };
        Some(Drained { question, said: (severity, text), answered, records })
    }
}

fn answer(question: Question, made: &Made, watch: &mut dyn FnMut(f64) -> ControlFlow<()>) -> End {
    let mut cancelled = false;
    let mut watch = |share: f64| {
        let flow = watch(share);
        cancelled |= flow.is_break();
        flow
    };
    let answer = try_answer(question, made, &mut watch);
    match answer {
        Ok(answer) => {
            let sources = match &answer {
                Answer::Shown(shown) => Sources::new(Some(&made.model), &shown.logs),
                Answer::Residual(_) | Answer::Refined(_) => {
                    Sources::new(Some(&made.model), made.inputs.iter().map(|input| &*input.log))
                }
            };
            End::Answered(answer, sources)
        }
        Err(_) if cancelled => End::Cancelled,
        Err(problem) => End::Refused(problem),
    }
}

fn try_answer(
    question: Question,
    made: &Made,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Answer, String> {
    let logs = |held_out: bool| -> Vec<Log> {
        let of_part = made.inputs.iter().filter(|input| input.held_out == held_out);
        of_part.map(|input| (*input.log).clone()).collect()
    };
    let said = |problem: RefineError| problem.to_string();
    let options = made.settings.options();
    Ok(match question {
        Question::Residual => {
            let logs = [logs(false), logs(true)].concat();
            Answer::Residual(Box::new(refine::residual(&made.model, &logs, &options, watch).map_err(said)?))
        }
        Question::Refine => {
            let found = refine::refine(&made.model, &logs(false), &logs(true), &options, watch);
            Answer::Refined(Box::new(found.map_err(said)?))
        }
        Question::Demo => {
            let shown = refine::demonstrate(made.settings.seed, watch);
            Answer::Shown(Box::new(shown.map_err(|problem: DemonstrationError| problem.to_string())?))
        }
    })
}

/// Returns whether a model is the one that a demonstration takes.
pub(super) fn is_of_demo(model: &Model) -> bool {
    static PAPER: LazyLock<Model> = LazyLock::new(presets::paper);
    *model == *PAPER
}

/// The answer as a sentence without its full stop.
pub(super) fn verdict_text(found: &Refinement) -> String {
    match found.verdict {
        Verdict::ModelAdequate => {
            "Model adequate: no effect of the library explains the logs better".to_owned()
        }
        Verdict::EffectsFound => {
            let ids: Vec<&str> = found.effects.iter().map(|found| found.effect.id()).collect();
            format!("Effects found: {}", ids.join(", "))
        }
        Verdict::UnexplainedResidual => {
            "Unexplained residual: the model lacks something that no effect of the library explains"
                .to_owned()
        }
        Verdict::DataUnfit => "Log not suitable for identification, for the reasons below".to_owned(),
    }
}
