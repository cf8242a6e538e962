//! The headless core of flqr, one module for each station of the loop
//! model → controller → robot → recording → identified model → better controller.
//!
//! | module | station |
//! |---|---|
//! | [`robot`] | the wheel-legged robot's parameters and dynamics |
//! | [`lqr`] | Riccati equation and LQR design |
//! | [`friction`] | Stribeck curve and its feedforward |
//! | [`effects`] | what a declared model may lack |
//! | [`control`] | one pure step from measurements to motor torques |
//! | [`link`] | protocols of motors, IMU and adapters, without input or output |
//! | [`device`] | sockets, ports, threads and clocks |
//! | [`simulate`] | plant with sticking friction, sensors, scenarios |
//! | [`record`] | logs: schema, reading, writing, health |
//! | [`identify`] | friction and inertia from logs |
//! | [`refine`] | the residual of a model, the effects that it lacks, the model with them |
//! | [`report`] | what was found, as HTML and as text |
//! | [`reproduce`] | every experiment of the paper, ours beside theirs |
//! | [`export`] | a controller as C header, JSON, YAML or CSV |
//! | [`model_file`] | models on disk (TOML) |
//! | [`message`] | messages fit to be shown |
//!
//! # Invariants
//! - SI units and radians everywhere; a name carries its unit where it has one.
//! - No printing; no clock, no file, no port outside of [`device`], and no thread outside of it and of [`parallel`]:
//!   time and randomness are arguments, readers take `BufRead`, writers `Write`.
//! - Same inputs and seed, same bytes out.
//! - Nothing here knows the window.

pub mod control;
pub mod device;
pub mod effects;
pub mod export;
pub mod friction;
pub mod identify;
pub mod link;
pub mod lqr;
pub mod message;
pub mod model_file;
pub mod parallel;
mod parameter;
pub mod record;
pub mod refine;
pub mod report;
pub mod reproduce;
pub mod robot;
pub mod simulate;
mod unit_slip;

#[cfg(test)]
extern crate self as flqr_core;
#[cfg(test)]
#[path = "tests/shared/mod.rs"]
mod shared;

pub use parameter::ParameterError;
