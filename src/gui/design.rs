//! The LQR design that follows the session: derived, never synchronised.

use std::time::{Duration, Instant};

use flqr_core::lqr::{DesignError, LqrDesign, Margins, SampledLoop, design, margins};
use flqr_core::model::{LinearModel, RobotParameters, Weights};

use crate::session::Session;

/// A design is timed this often,
const REPETITIONS: usize = 5;
/// but only once if it takes longer than this.
const QUICK: Duration = Duration::from_micros(200);

/// A design together with what it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Designed {
    pub(crate) parameters: RobotParameters,
    pub(crate) weights: Weights,
    pub(crate) design: LqrDesign,
    /// When the robot measures and acts,
    pub(crate) timing: SampledLoop,
    /// and what the design bears of that.
    pub(crate) margins: Margins,
}

/// The two designs that are compared. One is active and edited, the other waits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Slot {
    /// At the start, the design of the loaded model.
    A,
    #[default]
    B,
}

impl Slot {
    pub(crate) fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
        }
    }
}

/// State of the two designs, for undo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Comparison {
    /// Of the other design.
    pub(crate) weights: Option<Weights>,
    /// Which of the two is active.
    pub(crate) active: Slot,
}

/// The active design, the last problem, and the design to compare with.
#[derive(Default)]
pub(crate) struct Designer {
    tried: Option<(RobotParameters, Weights, SampledLoop)>,
    /// The last design that worked; it stays active while `problem` is set.
    pub(crate) in_force: Option<Designed>,
    /// Reason why the current weights and parameters give no design.
    pub(crate) problem: Option<String>,
    /// Duration of the last solve, s.
    pub(crate) solve_s: f64,
    /// The other design, for the same robot.
    pub(crate) reference: Option<Designed>,
    /// Which of the two is active.
    pub(crate) active: Slot,
    /// Number of designs so far.
    pub(crate) count: u64,
}

impl Designer {
    /// Solves anew when the input differs from the last one; returns whether the active gains changed.
    pub(crate) fn update(&mut self, session: &Session) -> bool {
        let Some(robot) = session.robot() else {
            *self = Self::default();
            return false;
        };
        let input = (robot.parameters, session.weights(), SampledLoop::of(robot));
        if self.tried == Some(input) {
            return false;
        }
        self.tried = Some(input);
        let changed = self.solve(input);
        self.follow_robot(input.0, input.2);
        changed
    }

    pub(crate) fn comparison(&self) -> Comparison {
        Comparison { weights: self.reference.map(|reference| reference.weights), active: self.active }
    }

    /// Takes over the comparison of the two designs; the active one stays.
    pub(crate) fn compare(&mut self, comparison: Comparison) {
        self.active = comparison.active;
        if let (Some(in_force), Some(weights)) = (self.in_force, comparison.weights) {
            self.reference =
                Designed::solve(in_force.parameters, weights, in_force.timing).or(self.reference);
        }
    }

    /// The other design is one for the robot of now; at the start both are the same.
    fn follow_robot(&mut self, parameters: RobotParameters, timing: SampledLoop) {
        let Some(reference) = self.reference else {
            self.reference = self.in_force;
            return;
        };
        if (reference.parameters, reference.timing) != (parameters, timing) {
            self.reference = Designed::solve(parameters, reference.weights, timing).or(self.reference);
        }
    }

    fn solve(&mut self, (parameters, weights, timing): (RobotParameters, Weights, SampledLoop)) -> bool {
        self.count += 1;
        let model = parameters.linear_model();
        let (result, solve_s) = timed(&model, &weights);
        self.solve_s = solve_s;
        match result {
            Ok(design) => {
                self.problem = None;
                self.in_force = Some(Designed::new(parameters, weights, timing, design));
                true
            }
            Err(error) => {
                self.problem = Some(error.to_string());
                false
            }
        }
    }

    /// The other design, if it differs from the active one.
    pub(crate) fn different(&self) -> Option<Designed> {
        let in_force = self.in_force?;
        self.reference.filter(|reference| reference.design != in_force.design)
    }

    /// Copies the active design to the other one.
    pub(crate) fn keep(&mut self) {
        self.reference = self.in_force;
    }

    /// Changes places; gives the weights that come into force.
    pub(crate) fn swap(&mut self) -> Option<Weights> {
        let (reference, in_force) = (self.reference?, self.in_force?);
        self.reference = Some(in_force);
        self.active = self.active.other();
        Some(reference.weights)
    }
}

impl Designed {
    fn solve(parameters: RobotParameters, weights: Weights, timing: SampledLoop) -> Option<Self> {
        let design = design(&parameters.linear_model(), &weights).ok()?;
        Some(Self::new(parameters, weights, timing, design))
    }

    fn new(parameters: RobotParameters, weights: Weights, timing: SampledLoop, design: LqrDesign) -> Self {
        let margins = margins(&parameters.linear_model(), &design.gain, &timing);
        Self { parameters, weights, design, timing, margins }
    }
}

/// The design and its duration, s. The first call after a pause finds cold caches, so a quick one is repeated
/// and the shortest counts.
fn timed(model: &LinearModel, weights: &Weights) -> (Result<LqrDesign, DesignError>, f64) {
    let once = || {
        let start = Instant::now();
        (design(model, weights), start.elapsed())
    };
    let (result, first) = once();
    let again = if first > QUICK { 0 } else { REPETITIONS - 1 };
    let shortest = (0..again).map(|_| once().1).fold(first, Duration::min);
    (result, shortest.as_secs_f64())
}
