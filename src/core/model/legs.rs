//! Legs that raise and lower the body: centre of mass and inertia over their height.

use super::RobotParameters;
use crate::parameter::{ParameterError, finite, positive, within};

/// A quantity over leg height, linear between its nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct OverHeight {
    nodes: Vec<HeightNode>,
}

/// One row of such a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightNode {
    /// Height of the legs, m.
    pub leg_height_m: f64,
    /// The quantity at that height, in its own unit.
    pub value: f64,
}

/// Reason why a table over leg height is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HeightTableError {
    /// A table needs two rows to say anything about the heights between them.
    #[error("a table over leg_height_m needs at least two heights, but has {rows}: add one")]
    TooShort {
        /// Rows that were given.
        rows: usize,
    },
    /// Heights that do not rise.
    #[error("leg_height_m must increase from row to row, but {next} follows {before}: sort the rows")]
    NotRising {
        /// A height.
        before: f64,
        /// The one behind it.
        next: f64,
    },
    /// A height or a value out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

impl OverHeight {
    /// Checks a table of a quantity that is above zero; `name` is its key, for messages.
    pub fn new(name: &'static str, nodes: Vec<HeightNode>) -> Result<Self, HeightTableError> {
        for node in &nodes {
            finite("leg_height_m", node.leg_height_m)?;
            positive(name, node.value)?;
        }
        if nodes.len() < 2 {
            return Err(HeightTableError::TooShort { rows: nodes.len() });
        }
        if let Some(pair) = nodes.windows(2).find(|pair| pair[1].leg_height_m <= pair[0].leg_height_m) {
            let [before, next] = [0, 1].map(|row| pair[row].leg_height_m);
            return Err(HeightTableError::NotRising { before, next });
        }
        Ok(Self { nodes })
    }

    /// The rows, lowest height first.
    pub fn nodes(&self) -> &[HeightNode] {
        &self.nodes
    }

    /// Lowest and highest height, m.
    pub fn range_m(&self) -> std::ops::RangeInclusive<f64> {
        let height = |node: Option<&HeightNode>| node.map_or(f64::NAN, |node| node.leg_height_m);
        height(self.nodes.first())..=height(self.nodes.last())
    }

    /// Multiplies every value by a factor above zero.
    pub(crate) fn scale(&mut self, factor: f64) {
        for node in &mut self.nodes {
            node.value *= factor;
        }
    }

    /// The quantity at a height; that of the nearest end outside of the table.
    pub fn at(&self, leg_height_m: f64) -> f64 {
        let above = self.nodes.partition_point(|node| node.leg_height_m < leg_height_m);
        let upper = &self.nodes[above.clamp(1, self.nodes.len() - 1)];
        let lower = &self.nodes[above.clamp(1, self.nodes.len() - 1) - 1];
        let share = (leg_height_m - lower.leg_height_m) / (upper.leg_height_m - lower.leg_height_m);
        lower.value + share.clamp(0.0, 1.0) * (upper.value - lower.value)
    }
}

/// Legs of variable height.
#[derive(Clone, Debug, PartialEq)]
pub struct Legs {
    /// The height that the robot's parameters are for, m.
    pub leg_height_m: f64,
    /// l: axle to the body's centre of mass, m.
    pub com_height_m: OverHeight,
    /// J: body about its centre of mass, kg m²; constant where there is no table.
    pub body_inertia_kg_m2: Option<OverHeight>,
}

impl Legs {
    /// The parameters with the legs at a height.
    ///
    /// # Errors
    /// A height outside of the table.
    pub fn at(
        &self,
        leg_height_m: f64,
        parameters: &RobotParameters,
    ) -> Result<RobotParameters, ParameterError> {
        let allowed = "within the heights of the table of com_height_m";
        within("leg_height_m", leg_height_m, self.com_height_m.range_m(), allowed)?;
        let inertia = self.body_inertia_kg_m2.as_ref().map(|table| table.at(leg_height_m));
        Ok(RobotParameters {
            com_height_m: self.com_height_m.at(leg_height_m),
            body_inertia_kg_m2: inertia.unwrap_or(parameters.body_inertia_kg_m2),
            ..*parameters
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &[(f64, f64)]) -> Result<OverHeight, HeightTableError> {
        let node = |&(leg_height_m, value)| HeightNode { leg_height_m, value };
        OverHeight::new("com_height_m", rows.iter().map(node).collect())
    }

    #[test]
    fn between_rows_the_quantity_is_linear_and_beyond_them_it_is_that_of_the_end() {
        let table = table(&[(0.32, 0.10), (0.36, 0.12), (0.42, 0.18)]).unwrap();
        for (height, expected) in
            [(0.1, 0.10), (0.32, 0.10), (0.34, 0.11), (0.36, 0.12), (0.39, 0.15), (0.42, 0.18), (2.0, 0.18)]
        {
            assert!((table.at(height) - expected).abs() < 1e-15, "{height}: {}", table.at(height));
        }
    }

    #[test]
    fn tables_that_say_nothing_are_refused() {
        for (rows, part) in [
            (&[][..], "at least two heights, but has 0"),
            (&[(0.3, 0.1)], "but has 1"),
            (&[(0.4, 0.1), (0.3, 0.2)], "0.3 follows 0.4"),
            (&[(0.3, 0.1), (0.3, 0.2)], "0.3 follows 0.3"),
            (&[(0.3, -0.1), (0.4, 0.2)], "com_height_m = -0.1 is out of range"),
            (&[(f64::NAN, 0.1), (0.4, 0.2)], "leg_height_m = NaN is out of range"),
        ] {
            let problem = table(rows).unwrap_err().to_string();
            assert!(problem.contains(part), "{problem}");
        }
    }
}
