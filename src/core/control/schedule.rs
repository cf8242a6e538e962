//! Gains that follow leg height.

use nalgebra::Matrix2x4;

use crate::ParameterError;
use crate::lqr::{DesignError, design};
use crate::model::RobotModel;

/// LQR gains over leg height, linear between their nodes as the firmware's table will be.
#[derive(Clone, Debug, PartialEq)]
pub struct GainSchedule {
    nodes: Vec<ScheduleNode>,
}

/// The gain at one height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduleNode {
    /// Height of the legs, m.
    pub leg_height_m: f64,
    /// K at that height, 2×4, as [`LqrDesign::gain`](crate::lqr::LqrDesign::gain).
    pub gain: Matrix2x4<f64>,
}

/// Reason why there is no schedule.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ScheduleError {
    /// A robot of one height.
    #[error(
        "the robot has only one leg height: give com_height_m in [robot] as a table over leg_height_m for a schedule"
    )]
    NoLegs,
    /// A design needs weights.
    #[error("the model has no [lqr] table: add q_diagonal = [4 numbers] and r_diagonal = [2 numbers]")]
    NoWeights,
    /// Interpolation needs two ends.
    #[error("a schedule needs from 2 to 1000 heights, not {nodes}")]
    Nodes {
        /// Asked for.
        nodes: usize,
    },
    /// A height that the legs do not have.
    #[error(transparent)]
    Height(#[from] ParameterError),
    /// No gain at one of the heights.
    #[error("at a leg height of {leg_height_m} m: {problem}")]
    Design {
        /// Height, m.
        leg_height_m: f64,
        /// Problem.
        problem: DesignError,
    },
}

impl GainSchedule {
    /// Designs the gain at `nodes` heights, evenly spaced over the legs' range.
    ///
    /// # Errors
    /// A robot without legs or weights, fewer than 2 or more than 1000 nodes, a height without a design.
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// use flqr_core::control::GainSchedule;
    ///
    /// let schedule = GainSchedule::design(robot, 6)?;
    /// let [low, .., high] = schedule.nodes() else { return Err("too few nodes".into()) };
    /// assert_ne!(schedule.at(low.leg_height_m), schedule.at(high.leg_height_m));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn design(robot: &RobotModel, nodes: usize) -> Result<Self, ScheduleError> {
        let legs = robot.legs.as_ref().ok_or(ScheduleError::NoLegs)?;
        let weights = robot.weights.ok_or(ScheduleError::NoWeights)?;
        if !(2..=1000).contains(&nodes) {
            return Err(ScheduleError::Nodes { nodes });
        }
        let (lowest, highest) = legs.com_height_m.range_m().into_inner();
        let node = |index: usize| {
            let share = index as f64 / (nodes - 1) as f64;
            // Exact at both ends, which rounding must not put outside of the table.
            let leg_height_m = lowest * (1.0 - share) + highest * share;
            let raised = robot.at_leg_height(leg_height_m.clamp(lowest, highest))?;
            let gain = design(&raised.parameters.linear_model(), &weights)
                .map_err(|problem| ScheduleError::Design { leg_height_m, problem })?
                .gain;
            Ok(ScheduleNode { leg_height_m, gain })
        };
        Ok(Self { nodes: (0..nodes).map(node).collect::<Result<_, ScheduleError>>()? })
    }

    /// The nodes, lowest height first.
    pub fn nodes(&self) -> &[ScheduleNode] {
        &self.nodes
    }

    /// The gain at a height; that of the nearest end outside of the schedule.
    pub fn at(&self, leg_height_m: f64) -> Matrix2x4<f64> {
        let above = self.nodes.partition_point(|node| node.leg_height_m < leg_height_m);
        let above = above.clamp(1, self.nodes.len() - 1);
        let (lower, upper) = (&self.nodes[above - 1], &self.nodes[above]);
        let share = (leg_height_m - lower.leg_height_m) / (upper.leg_height_m - lower.leg_height_m);
        lower.gain + (upper.gain - lower.gain) * share.clamp(0.0, 1.0)
    }
}
