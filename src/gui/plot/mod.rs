//! Plots over a shared horizontal range: decimated, following or held, with exact statistics.

mod decimate;
mod view;

pub use decimate::{Curve, DecimationCache, RangeStatistics, Visible, decimate};
pub use view::{TimePlot, TimeView};
pub(crate) use view::tick;
