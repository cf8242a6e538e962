//! The window of flqr: tune the balance controller of a simulated robot, fit friction from a measured log, find what the
//! model lacks, compare LQR and FLQR in the paper's experiments, watch and drive a real robot.
//!
//! # Architecture
//! - One owner: [`App`] holds the session document, the design, the histories and the jobs.
//! - Views get a read context for the frame and send `Command`s; `App::logic` applies them at one place. A
//!   pass that sent commands is discarded and drawn again, so what the user sees never lags its input.
//! - Anything that can wait (files, dialogs, fits, the running robot) is on a named thread behind a
//!   bounded channel. Workers wake the window; an idle window draws nothing.
//! - The window holds no number that the core could not recompute.

mod app;
mod column_map;
mod command;
pub mod command_line;
mod commands;
mod context;
mod design;
mod dialog;
mod document;
mod experiments;
mod frames;
mod friction;
mod health_card;
mod help;
mod history;
mod job;
mod layout;
mod live;
mod load;
mod log_slider;
mod memory;
mod messages;
mod pages;
mod panes;
mod picture;
pub mod plot;
mod quantity;
mod recent;
mod refine;
pub mod robot;
mod runs;
mod save_form;
mod session;
mod shell_word;
mod state_out;
mod theme;
mod tour;
mod tune;
mod widgets;
mod window;
mod write_file;

pub use app::App;
pub use document::default_folder as default_state_folder;
pub use memory::keep_freed_memory;
pub use pages::Tab;
pub use state_out::is_opening_of_state;
pub use window::{WindowError, WindowOptions, run};
