//! Contents of a chart; [`super::svg`] decides how.

/// Stacked panels over one horizontal axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Short title, shown as the caption.
    pub title: String,
    /// Alternative text, also used in the text report.
    pub description: String,
    /// The axis that all panels share.
    pub x: Axis,
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

/// One plot with a separate axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// The vertical axis.
    pub y: Axis,
    /// Curves and clouds, the later ones drawn over the earlier ones.
    pub series: Vec<Series>,
    /// Shaded rectangles behind the series.
    pub bands: Vec<Band>,
    /// Dashed horizontal lines.
    pub limits: Vec<Limit>,
}

/// An axis with its title.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the quantity.
    pub title: String,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Least and greatest value shown; `None` shows all data.
    pub range: Option<[f64; 2]>,
}

/// Scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long.
    #[default]
    Linear,
    /// Equal ratios are equally long; values that are not positive are gaps.
    Log,
}

/// One curve or cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; series of one name have one colour in all panels.
    pub name: String,
    /// Style of the points.
    pub mark: Mark,
    /// x and y; a value that is not finite is a gap.
    pub points: Vec<[f64; 2]>,
}

/// Style of the points of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Joined by straight lines.
    Line,
    /// Joined by straight lines, dashed: what is compared against.
    Dashed,
    /// Each value is held up to the next point.
    Step,
    /// Not joined.
    Scatter,
    /// The outline of a tinted area, along one side and back along the other; goes without a separate name in the
    /// legend where a curve has the same.
    Area,
}

/// A shaded rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Name in the legend.
    pub name: String,
    /// From and to on the horizontal axis; `None` is all of it.
    pub x: Option<[f64; 2]>,
    /// From and to on the vertical axis; `None` is all of it.
    pub y: Option<[f64; 2]>,
}

/// A dashed horizontal line.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Name in the legend.
    pub name: String,
    /// Position.
    pub y: f64,
}

impl Axis {
    /// A linear axis that shows all data.
    pub fn new(title: impl Into<String>, unit: &'static str) -> Self {
        Self { title: title.into(), unit, scale: Scale::Linear, range: None }
    }

    /// Title and unit as one text.
    pub fn label(&self) -> String {
        if self.unit.is_empty() { self.title.clone() } else { format!("{}, {}", self.title, self.unit) }
    }
}

impl Panel {
    /// A panel without bands and limits.
    pub fn new(y: Axis, series: Vec<Series>) -> Self {
        Self { y, series, bands: Vec::new(), limits: Vec::new() }
    }
}

impl Series {
    /// A series from points.
    pub fn new(name: impl Into<String>, mark: Mark, points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        Self { name: name.into(), mark, points: points.into_iter().collect() }
    }

    /// Least and greatest finite y, where there is any.
    pub fn range(&self) -> Option<[f64; 2]> {
        extent(self.points.iter().map(|point| point[1]))
    }
}

/// Least and greatest of the finite values, where there is any.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values.into_iter().filter(|value| value.is_finite()).fold(None, |extent, value| match extent {
        None => Some([value, value]),
        Some([low, high]) => Some([low.min(value), high.max(value)]),
    })
}
