//! Core of flqr: models, control, simulation, identification and protocols, without a user interface.
//!
//! # Quick start
//! Loads a model, designs its controller, records a robot on a slope that the model does not contain, and finds the
//! slope from the recording:
//!
//! ```
//! use std::ops::ControlFlow::Continue;
//!
//! use flqr_core::model::Motor;
//! use flqr_core::refine::{Options, refine};
//! use flqr_core::simulate::{ControllerChoice, Experiment, Scenario, run};
//! use flqr_core::{lqr, model_file::presets};
//!
//! let model = presets::paper(); // or Model::from_toml(&text, "robot.toml")
//! let robot = model.robot().ok_or("not a robot")?;
//! let design = lqr::design(&robot.parameters.linear_model(), &robot.weights.ok_or("no weights")?)?;
//! println!("K = {}poles = {:?}", design.gain, design.poles);
//!
//! let flqr = Experiment::new(Scenario::Multisine, ControllerChoice::Flqr);
//! let on_slope = Experiment { gain: Some(design.gain), slope_rad: 0.02, seconds: 10.0, ..flqr };
//! let log = run(&on_slope, &model, &model, &mut |_| Continue(()))?.log(Motor::Left);
//!
//! let options = Options { seed: 1, ..Options::default() };
//! let refined = refine(&model, &[log], &[], &options, &mut |_| Continue(()))?;
//! let [slope] = &refined.effects[..] else { return Err("expected one effect".into()) };
//! assert_eq!(slope.effect.id(), "ground_slope");
//! println!("{}", refined.model.to_toml());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | [`model`] | robots and single axes: parameters, dynamics, settings of hardware and safety |
//! | [`model_file`] | model files (TOML) and the built-in presets |
//! | [`lqr`] | Riccati equation, LQR design, margins and response of the sampled loop |
//! | [`friction`] | Stribeck curve and friction feedforward |
//! | [`effects`] | library of effects that a declared model may lack |
//! | [`control`] | controllers as pure steps from measurements to motor torques |
//! | [`simulate`] | plant with stiction, sensors, scenarios |
//! | [`excitation`] | multisines, speed sweeps and paths for identification |
//! | [`record`] | logs: schema, reading, writing, data health |
//! | [`signal`] | filters and quantiles |
//! | [`identify`] | friction, inertia and mass from logs |
//! | [`refine`] | residual of a model, missing effects, refined model |
//! | [`export`] | controllers as C header, JSON, YAML or CSV |
//! | [`link`] | protocols of motors, IMU and adapters, without input or output |
//! | [`emulator`] | simulated robot with the protocols of the hardware |
//! | [`device`] | sockets, ports, threads and clocks |
//! | [`report`] | reports as HTML and as text |
//! | [`reproduce`] | experiments of the paper, compared with the published results |
//! | [`parallel`] | parallel map whose result does not depend on the number of threads |
//! | [`message`] | messages that quote contents of files |
//!
//! # Invariants
//! - Quantities are in SI units and radians. Names end in their unit.
//! - Outside of [`device`], the core prints nothing, reads no clock and opens no file or port. Time and randomness are
//!   arguments; readers take `BufRead`, writers `Write`. Only [`device`] and [`parallel`] start threads.
//! - The same inputs and seed give the same bytes of output.
//! - The core does not depend on the window.

pub mod control;
pub mod device;
pub mod effects;
pub mod emulator;
pub mod excitation;
pub mod export;
pub mod friction;
pub mod identify;
pub mod link;
pub mod lqr;
pub mod message;
pub mod model;
pub mod model_file;
pub mod parallel;
mod parameter;
pub mod record;
pub mod refine;
pub mod report;
pub mod reproduce;
pub mod signal;
pub mod simulate;
mod unit_slip;

#[cfg(test)]
extern crate self as flqr_core;
#[cfg(test)]
#[path = "tests/shared/mod.rs"]
mod shared;

pub use parameter::ParameterError;
