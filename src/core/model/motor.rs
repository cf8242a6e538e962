//! The two wheel motors.

use std::fmt;

/// One motor of a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Motor {
    /// Seen in driving direction.
    #[default]
    Left,
    /// Seen in driving direction.
    Right,
}

impl Motor {
    /// Both, in the order of every pair.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];
}

impl fmt::Display for Motor {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}
