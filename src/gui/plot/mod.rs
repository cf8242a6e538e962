//! Plots over a shared horizontal range: decimated, following or held, with exact statistics.

mod axes;
mod column;
mod cursors;
mod decimate;
mod draw_cache;
mod end_to_end;
mod export;
mod figure;
mod marks;
mod pyramid;
mod readout;
mod response;
mod spectra;
mod stack;
#[cfg(test)]
mod tests;
mod unit;
mod view;

pub(crate) use axes::{Axes, Y_AXIS_WIDTH};
pub use column::{CHUNK, TimeColumn, ValueColumn};
pub use decimate::{Curve, Data, DecimationCache, RangeStatistics, Visible, decimate};
pub(crate) use end_to_end::one_after_another;
pub use export::{FigureFile, FigureKind};
pub use marks::{Marks, Moved};
pub use stack::{Panel, PanelCurve, Stack, Wishes};
pub use unit::{Unit, UnitChoice};
pub(crate) use unit::{degrees, set_degrees};
pub use view::TimeView;
