//! Plots over a shared horizontal range: decimated, following or held, with exact statistics.

mod axes;
mod decimate;
mod marks;
mod view;

pub(crate) use axes::Axes;
pub use decimate::{Curve, DecimationCache, RangeStatistics, Visible, decimate};
pub use marks::{Marks, Moved};
pub use view::{TimeCurve, TimePlot, TimeView};
