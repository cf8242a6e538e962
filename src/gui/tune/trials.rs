//! Disturbances: the torque that they will ask for, against the motors' limit, and what the simulated robot does.

use std::ops::ControlFlow;
use std::sync::Arc;

use egui::{Grid, ProgressBar, RichText, Ui};
use flqr_core::control::BalanceController;
use flqr_core::lqr::{Disturbance, sampled_response};
use flqr_core::model::RobotModel;
use flqr_core::simulate::{Recovery, largest_pitch, recovery};

use super::verdict::Verdict;
use crate::context::ViewContext;
use crate::design::Designed;
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::plot::{Unit, UnitChoice, degrees};
use crate::quantity::angle;
use crate::widgets::{error_ui, hint_ui, mono, number_ui, section_ui, shown, warning_ui};

/// The peak is looked for over this time, s.
const PEAK_S: f64 = 3.0;
/// Fraction of the limit up to which noise, friction and a second push have room.
const ROOMY: f64 = 0.8;

/// Labels of a kind of disturbance.
struct Kind {
    name: &'static str,
    unit: Unit,
    /// In SI.
    largest: f64,
    help: &'static str,
}

const KINDS: [Kind; 3] = [
    Kind {
        name: "kick",
        unit: Unit::Plain("N s"),
        largest: 1e4,
        help: "Impulse at the body's centre of mass (force × duration)",
    },
    Kind { name: "lean", unit: Unit::Angle, largest: 0.79, help: "Initial pitch" },
    Kind { name: "step", unit: Unit::Plain("m"), largest: 1e4, help: "Step of the position setpoint" },
];

/// Response of the simulated robot with noise, friction and limits.
#[derive(Clone, Debug)]
struct Simulated {
    recoveries: [Option<Recovery>; 3],
    largest_pitch_rad: Option<f64>,
}

/// Inputs of a simulation.
#[derive(Clone, Debug, PartialEq)]
struct Question {
    robot: RobotModel,
    controller: BalanceController,
    trials: [Disturbance; 3],
}

/// Peak torques of the active design and of the other one, N m.
#[derive(Clone, Copy)]
struct Peaks {
    trials: [Disturbance; 3],
    designs: [Option<Designed>; 2],
    peaks_nm: [[f64; 3]; 2],
}

/// Disturbances to try, and what is known of them.
pub(super) struct Trials {
    trials: [Disturbance; 3],
    /// Which one the predicted responses show.
    shown: usize,
    asked: Option<Question>,
    job: Option<Job<(), Option<Simulated>>>,
    answer: Option<Simulated>,
    peaks: Option<Peaks>,
}

impl Default for Trials {
    fn default() -> Self {
        Self {
            trials: [
                Disturbance::Kick(1.0),
                Disturbance::Pitch(5.0_f64.to_radians()),
                Disturbance::Step(0.1),
            ],
            shown: 2,
            asked: None,
            job: None,
            answer: None,
            peaks: None,
        }
    }
}

impl Trials {
    /// The disturbance whose response is shown.
    pub(super) fn shown(&self) -> Disturbance {
        self.trials[self.shown]
    }

    /// Chooses it.
    pub(super) fn choice_ui(&mut self, ui: &mut Ui) {
        let choices: Vec<_> =
            KINDS.iter().enumerate().map(|(index, kind)| (index, kind.name, kind.help)).collect();
        ui.scope(|ui| crate::widgets::choice_ui(ui, &mut self.shown, &choices));
    }

    /// Description.
    pub(super) fn shown_text(&self, degrees: bool) -> String {
        match self.shown() {
            Disturbance::Kick(size) => format!("after a kick of {} N s", shown(size, 3)),
            Disturbance::Pitch(size) => format!("released at {}", angle(size, degrees)),
            Disturbance::Step(size) => format!("after a step of {} m", shown(size, 3)),
        }
    }

    /// Peak torques for the shown disturbance, of the active design and of the other one, N m.
    pub(super) fn shown_peaks_nm(&mut self, context: &ViewContext<'_>) -> [f64; 2] {
        let shown = self.shown;
        self.peaks_nm(context).map(|peaks| peaks[shown])
    }

    fn peaks_nm(&mut self, context: &ViewContext<'_>) -> [[f64; 3]; 2] {
        let designs = [context.designer.in_force, context.designer.reference];
        if let Some(known) = &self.peaks
            && (known.trials, known.designs) == (self.trials, designs)
        {
            return known.peaks_nm;
        }
        let peaks_nm = designs.map(|designed| {
            self.trials.map(|trial| designed.map_or(f64::NAN, |designed| peak_nm(&designed, trial)))
        });
        self.peaks = Some(Peaks { trials: self.trials, designs, peaks_nm });
        peaks_nm
    }

    pub(super) fn ui(&mut self, context: &ViewContext<'_>, ui: &mut Ui) {
        self.follow(context, ui);
        let Some(robot) = context.session.robot() else { return };
        let limit_nm = robot.limits.torque_nm;
        section_ui(ui, "Effort", |ui| {
            let text = limit_nm
                .map_or("no torque limit".to_owned(), |limit| format!("limit {} N m", shown(limit, 3)));
            hint_ui(ui, text).on_hover_text(
                "Peak torque of one motor for each disturbance, compared with the torque limit; linear, including delay, without friction",
            );
        });
        let [peaks, _] = self.peaks_nm(context);
        Grid::new("trials").num_columns(5).min_col_width(14.0).spacing([6.0, 3.0]).show(ui, |ui| {
            for (index, kind) in KINDS.iter().enumerate() {
                let verdict = self.verdict(index, peaks[index], limit_nm);
                verdict.mark_ui(ui, kind.name);
                self.trial_ui(index, kind, ui);
                peak_ui(ui, peaks[index], limit_nm, verdict);
                ui.end_row();
            }
        });
        if limit_nm.is_none() {
            hint_ui(ui, "Enable “torque limit” of the robot to include the motor limit.");
        }
        self.sentences_ui(ui, &peaks, limit_nm);
        self.largest_ui(ui);
    }

    fn trial_ui(&mut self, index: usize, kind: &Kind, ui: &mut Ui) {
        let text = RichText::new(kind.name);
        let choice = ui.selectable_label(self.shown == index, text);
        if choice.accessible_name(format!("show {}", kind.name)).on_hover_text(kind.help).clicked() {
            self.shown = index;
        }
        let (unit, scale) = kind.unit.shown(UnitChoice::of(ui.ctx()));
        let mut size = self.trials[index].size() * scale;
        let before = size;
        number_ui(ui, &mut size, &format!("{} size", kind.name), 44.0).on_hover_text(kind.help);
        ui.label(RichText::new(unit).small());
        if size != before {
            let size_si = (size / scale).clamp(-kind.largest, kind.largest);
            self.trials[index] = self.trials[index].of_size(size_si);
        }
    }

    /// By the linear peak at first; what the simulated robot did counts for more, once it is known.
    fn verdict(&self, index: usize, peak_nm: f64, limit_nm: Option<f64>) -> Verdict {
        let share = peak_nm / limit_nm.unwrap_or(f64::INFINITY);
        let falls =
            self.answer.as_ref().and_then(|answer| answer.recoveries[index]).is_some_and(|r| !r.upright);
        if falls || !share.is_finite() {
            return Verdict::Bad;
        }
        match self.answer {
            None => Verdict::of(1.0 / share, 1.0 / ROOMY, 1.0),
            Some(_) if share > ROOMY => Verdict::Tight,
            Some(_) => Verdict::Good,
        }
    }

    fn sentences_ui(&self, ui: &mut Ui, peaks: &[f64; 3], limit_nm: Option<f64>) {
        let Some(answer) = &self.answer else { return };
        for (index, kind) in KINDS.iter().enumerate() {
            let Some(found) = answer.recoveries[index] else { continue };
            let beyond = limit_nm.is_some_and(|limit| peaks[index] > limit);
            if !found.upright {
                let why = if beyond { "the motors saturate" } else { "it does not recover" };
                error_ui(ui, format!("{}: the simulated robot falls, {why}.", kind.name));
            } else if beyond {
                let time = shown(1e3 * found.at_limit_s, 2);
                warning_ui(ui, format!("{}: saturated for {time} ms, but recovers.", kind.name));
            }
        }
    }

    fn largest_ui(&self, ui: &mut Ui) {
        let text = match (&self.answer, &self.job) {
            (Some(Simulated { largest_pitch_rad: Some(pitch), .. }), _) => {
                format!("Recovers from an initial tilt of up to {}.", angle(*pitch, degrees(ui.ctx())))
            }
            (Some(_), _) => "The simulation rejected these values.".to_owned(),
            (None, Some(_)) => "Simulating…".to_owned(),
            (None, None) => return,
        };
        hint_ui(ui, text).on_hover_text(
            "Largest initial pitch from which the simulated robot recovers, with friction, noise, delay and limits",
        );
    }

    /// Asks the simulated robot anew when something has changed and no pointer holds it; the latest wins.
    fn follow(&mut self, context: &ViewContext<'_>, ui: &Ui) {
        if let Some(job) = &mut self.job {
            match job.poll().1 {
                Outcome::Running => {}
                Outcome::Done(answer) => (self.answer, self.job) = (answer, None),
                Outcome::Broken => self.job = None,
            }
        }
        let question =
            context.session.robot().zip(context.designer.in_force).and_then(|(robot, designed)| {
                let controller = context.session.balance_controller(designed.design.gain)?;
                Some(Question { robot: robot.clone(), controller, trials: self.trials })
            });
        if self.asked == question {
            return;
        }
        // Of another design: no longer true.
        (self.answer, self.job, self.asked) = (None, None, None);
        let Some(question) = question.filter(|_| !ui.input(|input| input.pointer.any_down())) else { return };
        self.asked = Some(question.clone());
        let ctx = ui.ctx().clone();
        let waker: Waker = Arc::new(move || ctx.request_repaint());
        self.job = Job::start("trials", &waker, move |reporter| simulated(&question, reporter)).ok();
    }

    /// As `--state-out` writes it.
    pub(super) fn snapshot(&self) -> serde_json::Value {
        let recoveries = self.answer.as_ref().map(|answer| answer.recoveries.map(|r| r.map(|r| r.upright)));
        serde_json::json!({
            "peak_torque_nm": self.peaks.map(|known| known.peaks_nm[0]),
            "upright": recoveries,
            "largest_pitch_rad": self.answer.as_ref().and_then(|answer| answer.largest_pitch_rad),
        })
    }
}

/// Fraction of the limit as a bar, with the number on it.
fn peak_ui(ui: &mut Ui, peak_nm: f64, limit_nm: Option<f64>, verdict: Verdict) {
    let text = format!("{} N m", shown(peak_nm, 3));
    let Some(limit) = limit_nm else {
        ui.label(mono(text));
        return;
    };
    let share = peak_nm / limit;
    let color = verdict.color(ui).gamma_multiply(0.45);
    let bar = ProgressBar::new(share.clamp(0.0, 1.0) as f32)
        .desired_width(ui.available_width().clamp(90.0, 150.0))
        .desired_height(18.0)
        .corner_radius(3.0)
        .fill(color)
        .text(mono(format!("{text}  {:.0} %", 100.0 * share)).size(11.5));
    ui.add(bar).on_hover_text("Peak torque of one motor, and fraction of the limit");
}

fn peak_nm(designed: &Designed, trial: Disturbance) -> f64 {
    let model = designed.parameters.linear_model();
    let initial = trial.state(&designed.parameters);
    let response = sampled_response(&model, &designed.design.gain, &designed.timing, &initial, PEAK_S);
    if response.states.is_empty() { f64::NAN } else { response.peak_torque_nm() }
}

/// All trials and the largest pitch; `None` if it was cancelled.
fn simulated(question: &Question, reporter: &Reporter<()>) -> Option<Simulated> {
    let Question { robot, controller, trials } = question;
    let mut watch =
        || if reporter.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let mut recoveries = [None; 3];
    for (found, trial) in recoveries.iter_mut().zip(trials) {
        *found = recovery(robot, controller, *trial, &mut watch).unwrap_or_default();
    }
    let largest_pitch_rad = largest_pitch(robot, controller, &mut watch).unwrap_or_default();
    (!reporter.is_cancelled()).then_some(Simulated { recoveries, largest_pitch_rad })
}
