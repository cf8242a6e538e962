//! The LQR design that follows the session: derived, never synchronised.

use std::time::{Duration, Instant};

use flqr_core::lqr::{DesignError, LqrDesign, Margins, SampledLoop, Weights, design, margins};
use flqr_core::robot::{LinearModel, RobotParameters};

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

/// The design in force, the last problem, and the design to compare with.
#[derive(Default)]
pub(crate) struct Designer {
    tried: Option<(RobotParameters, Weights, SampledLoop)>,
    /// The last design that worked; it stays in force while `problem` is set.
    pub(crate) in_force: Option<Designed>,
    /// Why the present weights and parameters give no design.
    pub(crate) problem: Option<String>,
    /// Duration of the last solve, s.
    pub(crate) solve_s: f64,
    /// Design A of the comparison.
    pub(crate) reference: Option<Designed>,
    /// Whether the user pinned A; otherwise it is the design at the start of the last drag.
    pub(crate) reference_is_kept: bool,
    /// Number of designs so far.
    pub(crate) count: u64,
}

impl Designer {
    /// Solves anew when the input differs from the last one; says whether the gains in force changed.
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
        self.solve(input)
    }

    fn solve(&mut self, (parameters, weights, timing): (RobotParameters, Weights, SampledLoop)) -> bool {
        self.count += 1;
        let model = parameters.linear_model();
        let (result, solve_s) = timed(&model, &weights);
        self.solve_s = solve_s;
        match result {
            Ok(design) => {
                self.problem = None;
                let margins = margins(&model, &design.gain, &timing);
                self.in_force = Some(Designed { parameters, weights, design, timing, margins });
                true
            }
            Err(error) => {
                self.problem = Some(error.to_string());
                false
            }
        }
    }

    /// Takes the design in force as A unless the user pinned another.
    pub(crate) fn note_drag_start(&mut self) {
        if !self.reference_is_kept {
            self.reference = self.in_force;
        }
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
