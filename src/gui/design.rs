//! The LQR design that follows the session: derived, never synchronised.

use std::time::Instant;

use flqr_core::lqr::{LqrDesign, Weights, design};
use flqr_core::model_file::RobotModel;
use flqr_core::robot::RobotParameters;

use crate::session::Session;

/// A design together with what it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Designed {
    pub(crate) parameters: RobotParameters,
    pub(crate) weights: Weights,
    pub(crate) design: LqrDesign,
}

/// The design in force, the last problem, and the design to compare with.
#[derive(Default)]
pub(crate) struct Designer {
    tried: Option<(RobotParameters, Weights)>,
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
        let Some(&RobotModel { parameters, .. }) = session.robot() else {
            *self = Self::default();
            return false;
        };
        let input = (parameters, session.weights());
        if self.tried == Some(input) {
            return false;
        }
        self.tried = Some(input);
        self.solve(parameters, input.1)
    }

    fn solve(&mut self, parameters: RobotParameters, weights: Weights) -> bool {
        self.count += 1;
        let model = parameters.linear_model();
        let start = Instant::now();
        let result = design(&model, &weights);
        self.solve_s = start.elapsed().as_secs_f64();
        match result {
            Ok(design) => {
                self.problem = None;
                self.in_force = Some(Designed { parameters, weights, design });
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
