//! The experiments by name: what each is, what it is for and where its numbers come from.

use std::fmt;
use std::str::FromStr;

/// Longest run, s: an hour, 320 MB of samples.
pub(super) const MAX_SECONDS: f64 = 3600.0;

/// An experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scenario {
    /// Let go 0.05 rad off upright on level ground (section 4.4; the angle is assumed), to see whether the robot
    /// comes to rest or hunts: Table 5.
    Flat,
    /// Drives 1 m onto a bridge under its left wheel and stands there (Table 6). Paper: a photograph.
    /// Assumed: 0.04 m high, so that the body rolls by 0.1 rad, with ramps of 0.4 m, which the robot climbs at
    /// 0.23 m/s, and a deck of 0.6 m. The drive lasts from 2 to 10 s whatever the duration of the run.
    Bridge,
    /// As `Flat`, with a kick at 8.5 s (Table 7).
    Kick,
    /// Wheels in the air, from standstill to 5 rad/s under speed control (section 4.3; Figures 6, 7).
    SpeedTracking,
    /// Wheels in the air at 33 constant speeds from −50 to 50 rad/s, for the curve of friction (section 3.1;
    /// Table 4). See [`SpeedSweep`](crate::excitation::SpeedSweep).
    FrictionSweep,
    /// Out and back in laps of about 20 s at up to 0.4 m/s, a pace at which the pitch stays within 0.1 rad, to
    /// compare models with a robot that moves. The laps fill the run.
    Cruise,
    /// Stands upright from standstill: noise and friction only.
    Station,
    /// Torques of many frequencies, 0.3 to 4.7 Hz, on top of the controller's, other ones left and right: from
    /// where the balance answers them up to where masses and inertias alone do. With `pi` the wheels are in the
    /// air.
    Multisine,
}

/// A scenario's name that is not known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown scenario {name:?}: choose one of {}", Scenario::ALL.map(Scenario::name).join(", "))]
pub struct UnknownScenario {
    /// Requested value.
    pub name: String,
}

impl Scenario {
    /// Every scenario, the paper's balance experiments first.
    pub const ALL: [Self; 8] = [
        Self::Flat,
        Self::Bridge,
        Self::Kick,
        Self::SpeedTracking,
        Self::FrictionSweep,
        Self::Cruise,
        Self::Station,
        Self::Multisine,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Bridge => "bridge",
            Self::Kick => "kick",
            Self::SpeedTracking => "speed-tracking",
            Self::FrictionSweep => "friction-sweep",
            Self::Cruise => "cruise",
            Self::Station => "station",
            Self::Multisine => "multisine",
        }
    }

    /// Name for people.
    pub fn title(self) -> &'static str {
        match self {
            Self::Flat => "Flat ground",
            Self::Bridge => "Single-sided bridge",
            Self::Kick => "Kick",
            Self::SpeedTracking => "Speed tracking",
            Self::FrictionSweep => "Friction sweep",
            Self::Cruise => "Cruise",
            Self::Station => "Station keeping",
            Self::Multisine => "Multisine",
        }
    }

    /// What it is, in one sentence.
    pub fn description(self) -> &'static str {
        match self {
            Self::Flat => "Released at 0.05 rad on level ground: does the robot settle or limit-cycle?",
            Self::Bridge => {
                "Drives 1 m forward with the left wheel up a ramp onto a 0.04 m high deck, and stands there tilted sideways."
            }
            Self::Kick => "Stands on level ground and is kicked at 8.5 s.",
            Self::SpeedTracking => "Wheels in the air: from standstill to 5 rad/s with PI speed control.",
            Self::FrictionSweep => {
                "Wheels in the air: 33 constant speeds from −50 to 50 rad/s, for the friction curve."
            }
            Self::Cruise => "Drives out and back in smooth laps.",
            Self::Station => "Stands upright from standstill: noise and friction only.",
            Self::Multisine => {
                "Multisine torques added to the controller's, to identify masses and inertias."
            }
        }
    }

    /// Returns whether the robot stands on the ground; otherwise its wheels are in the air. A multisine under `pi` has
    /// them in the air as well.
    pub fn on_ground(self) -> bool {
        !matches!(self, Self::SpeedTracking | Self::FrictionSweep)
    }

    /// Duration where none is requested, s: a minute; two for the sweep, whose means over each speed are so
    /// much the better.
    pub fn default_seconds(self) -> f64 {
        if self == Self::FrictionSweep { 120.0 } else { 60.0 }
    }
}

impl fmt::Display for Scenario {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Scenario {
    type Err = UnknownScenario;

    fn from_str(name: &str) -> Result<Self, UnknownScenario> {
        let named = Self::ALL.into_iter().find(|scenario| scenario.name() == name);
        named.ok_or_else(|| UnknownScenario { name: name.to_owned() })
    }
}
