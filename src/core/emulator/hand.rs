//! The hand that holds the robot when nothing drives it.

use std::f64::consts::{PI, TAU};

use crate::model::State;

/// Amplitude, rad, and period, ticks, of rocking by hand, which shows the signs of the sensors.
const ROCKED_RAD: f64 = 0.1;
const ROCKING_TICKS: f64 = 4000.0;
/// From the last torque until the hand takes the robot, ticks.
pub(super) const PATIENCE_TICKS: u64 = 1000;
/// From there until the robot is back on its stand, ticks.
const CARRYING_TICKS: u64 = 1000;

/// Position of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Held upright on its stand and rocked slowly, wheels on the ground at x = 0 or in the air.
    Stand,
    /// On its own.
    Free,
    /// On the ground, where it fell.
    Lying,
    /// On its way back to the stand; its wheels do not turn.
    Carried,
}

/// Action of the hand.
#[derive(Clone, Copy, Debug)]
pub(super) enum Hand {
    Rocks { since: u64 },
    Off,
    Holds { state: State },
    LetsLie { pitch_rad: f64 },
    Carries { since: u64, from_pitch_rad: f64 },
}

impl Hand {
    pub(super) fn place(&self) -> Place {
        match self {
            Self::Rocks { .. } | Self::Holds { .. } => Place::Stand,
            Self::Off => Place::Free,
            Self::LetsLie { .. } => Place::Lying,
            Self::Carries { .. } => Place::Carried,
        }
    }

    /// Returns whether it holds the robot still and does not let go.
    pub(super) fn holds(&self) -> bool {
        matches!(self, Self::Holds { .. })
    }

    /// Returns the pose in which the robot is held at a tick; `None` if it is free.
    pub(super) fn state(&self, tick: u64, wheel_radius_m: f64) -> Option<State> {
        match *self {
            Self::Off => None,
            Self::Holds { state } => Some(state),
            Self::Rocks { since } => {
                let (sin, cos) = libm::sincos(TAU * (tick - since) as f64 / ROCKING_TICKS);
                Some(State {
                    pitch_rad: ROCKED_RAD * sin,
                    pitch_rate_rad_s: ROCKED_RAD * cos * TAU / (1e-3 * ROCKING_TICKS),
                    ..State::default()
                })
            }
            Self::LetsLie { pitch_rad } => Some(State { pitch_rad, ..State::default() }),
            Self::Carries { since, from_pitch_rad } => {
                let (sin, cos) = libm::sincos(PI * (tick - since) as f64 / CARRYING_TICKS as f64);
                let pitch_rad = 0.5 * from_pitch_rad * (1.0 + cos);
                let pitch_rate_rad_s = -0.5 * from_pitch_rad * sin * PI / (1e-3 * CARRYING_TICKS as f64);
                // The motor angles x/r − pitch do not change.
                let (x_m, x_dot_m_s) = (wheel_radius_m * pitch_rad, wheel_radius_m * pitch_rate_rad_s);
                Some(State { x_m, x_dot_m_s, pitch_rad, pitch_rate_rad_s })
            }
        }
    }

    /// Sets the robot down once it has been carried home.
    pub(super) fn set_down(&mut self, tick: u64) {
        if let Self::Carries { since, .. } = *self
            && tick - since >= CARRYING_TICKS
        {
            *self = Self::Rocks { since: tick };
        }
    }
}
