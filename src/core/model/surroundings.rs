//! External influences on the robot.

use serde::{Deserialize, Serialize};

use crate::model::Ground;
use crate::parameter::{ParameterError, finite, not_negative, within};

/// Keys of the model file's `[surroundings]` table: level ground and nothing else where it is missing. The
/// controller's design knows nothing of them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Surroundings {
    /// Slope of the ground, upward in the direction of x, rad.
    pub slope_rad: f64,
    /// A cable that pulls the robot back.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tether: Option<Tether>,
    /// A load on the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub payload: Option<Payload>,
    /// Ground under the left and the right wheel, on top of the slope, where the experiment does not bring
    /// its own.
    #[serde(skip_serializing_if = "is_flat")]
    pub ground: [Ground; 2],
}

fn is_flat(ground: &[Ground; 2]) -> bool {
    ground.iter().all(Ground::is_flat)
}

/// A spring between the robot and a fixed point; it pulls and never pushes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tether {
    /// Stiffness, N/m.
    pub stiffness_n_m: f64,
    /// Anchor position in x, m.
    #[serde(default)]
    pub anchor_m: f64,
    /// Distance from the anchor within which it is slack, m.
    #[serde(default)]
    pub slack_m: f64,
    /// Height of its attachment: above the axle along the body, m.
    #[serde(default)]
    pub height_m: f64,
}

/// A point mass that is fixed to the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Payload {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Above the axle along the body, m.
    pub height_m: f64,
    /// In front of the line from axle to centre of mass, m.
    #[serde(default)]
    pub forward_m: f64,
}

impl Surroundings {
    /// Refuses slopes of more than 0.5 rad, masses and stiffnesses below zero, and lengths that are not
    /// finite, and grounds that no wheel can roll over.
    pub fn validate(&self) -> Result<(), ParameterError> {
        within("slope_rad", self.slope_rad, -0.5..=0.5, "from -0.5 to 0.5")?;
        if let Some(tether) = &self.tether {
            not_negative("stiffness_n_m", tether.stiffness_n_m)?;
            finite("anchor_m", tether.anchor_m)?;
            not_negative("slack_m", tether.slack_m)?;
            finite("height_m", tether.height_m)?;
        }
        if let Some(payload) = &self.payload {
            not_negative("mass_kg", payload.mass_kg)?;
            finite("height_m", payload.height_m)?;
            finite("forward_m", payload.forward_m)?;
        }
        self.ground.iter().try_for_each(Ground::validate)
    }
}
