//! A chart as SVG. Text is at its real size, so a chart is drawn anew for each width.
//!
//! From top to bottom: the legend, in as many rows as it needs and so never over the data; each panel with its axis
//! title above it; the shared horizontal axis.

use std::fmt;

use super::chart::{Chart, Mark, Panel, Series, extent};
use super::inline_style::InlineStyle;
use super::map::{Map, along};
use super::markup::{Attribute, Markup};
use super::path::{Px, dots, polyline, stairs};
use super::thin;
use super::ticks::Tick;

/// Width for pages and screens, px.
pub(super) const WIDE: f64 = 880.0;
/// Width for telephones, px.
pub(super) const NARROW: f64 = 420.0;
/// InlineStyle of all charts; colours that people with any colour vision distinguish, on white and on dark.
pub(super) const STYLE: &str = include_str!("chart.css");

/// Widths and heights of pictures, px.
const SMALLEST: f64 = 200.0;
const LARGEST: f64 = 10_000.0;
/// Room at the left and right of a picture that stands alone, px; a page has its own.
pub(super) const MARGIN: f64 = 10.0;
/// A panel is at least this high, px.
const LEAST_PANEL: f64 = 40.0;
pub(super) const LINE_HEIGHT: f64 = 18.0;
/// Width of a character, px; generous, so that texts keep clear of each other in most fonts.
pub(super) const CHARACTER: f64 = 7.2;
pub(super) const RIGHT: f64 = 22.0;
const SWATCH: f64 = 26.0;
/// Least distance of horizontal grid lines, px.
const Y_SPACING: f64 = 28.0;
/// Colours, dashes and tints that the style has.
const COLOURS: usize = 6;
const DASHES: usize = 3;
const TINTS: usize = 3;

/// A separate file, of a width and a height; NaN for the usual ones.
pub(super) fn picture(chart: &Chart, [width, height]: [f64; 2]) -> String {
    let mut markup = Markup::with_looks(InlineStyle::of_sheet(STYLE));
    let width = if width.is_finite() { width.clamp(SMALLEST, LARGEST) } else { WIDE };
    let mut layout = Layout::new(chart, width - 2.0 * MARGIN);
    if height.is_finite() {
        layout.stretch(chart, height.min(LARGEST));
    }
    draw_layout(chart, &layout, "wide", "chart", true, &mut markup);
    markup.into_string()
}

/// The chart, `width` px wide, of class `name`, in a document that has the style. `id` is unique in it.
pub(super) fn draw(chart: &Chart, width: f64, name: &str, id: &str, markup: &mut Markup) {
    draw_layout(chart, &Layout::new(chart, width), name, id, false, markup);
}

fn draw_layout(chart: &Chart, layout: &Layout, name: &str, id: &str, alone: bool, markup: &mut Markup) {
    let width = if alone { layout.width + 2.0 * MARGIN } else { layout.width };
    let [title, description] = ["title", "text"].map(|part| format!("{id}-{part}"));
    let names = format!("{title} {description}");
    let [wide, high] = [Px(width), Px(layout.height)];
    let (view, class) = (format!("0 0 {wide} {high}"), format!("chart {name}"));
    let mut attributes: Vec<Attribute<'_>> = vec![
        ("xmlns", &"http://www.w3.org/2000/svg"),
        ("class", &class),
        ("viewBox", &view),
        ("role", &"img"),
        ("aria-labelledby", &names),
    ];
    if alone {
        attributes.extend([("width", &wide as &dyn fmt::Display), ("height", &high)]);
    }
    markup.element("svg", &attributes, |markup| {
        markup.text_element("title", &[("id", &title)], &chart.title);
        markup.text_element("desc", &[("id", &description)], &chart.description);
        if alone {
            markup.leaf("rect", &[("width", &wide), ("height", &high), ("fill", &"#ffffff")]);
            let moved = format!("translate({})", Px(MARGIN));
            markup.element("g", &[("transform", &moved)], |markup| content(chart, layout, id, markup));
        } else {
            content(chart, layout, id, markup);
        }
    });
}

fn content(chart: &Chart, layout: &Layout, id: &str, markup: &mut Markup) {
    layout.legend(markup);
    for (number, (panel, place)) in chart.panels.iter().zip(&layout.panels).enumerate() {
        layout.panel(panel, place, &format!("{id}-frame-{number}"), markup);
    }
    layout.x_axis(chart, markup);
}

struct Layout {
    width: f64,
    height: f64,
    left: f64,
    x: Map,
    panels: Vec<Place>,
    legend: Vec<Vec<Entry>>,
    series: Vec<String>,
    limits: Vec<String>,
    bands: Vec<String>,
}

/// Position of a panel's axis title and plot.
struct Place {
    title_top: f64,
    title: Vec<String>,
    top: f64,
    height: f64,
    y: Map,
}

/// One name in the legend with the class and the form of its sample.
#[derive(Clone)]
struct Entry {
    name: String,
    class: String,
    form: Form,
}

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Line,
    Dot,
    Area,
}

/// Names without repetition, in order.
fn names<'a>(all: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in all {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

fn index(names: &[String], name: &str, classes: usize) -> usize {
    names.iter().position(|other| other == name).unwrap_or(0) % classes
}

fn text_width(text: &str) -> f64 {
    CHARACTER * text.chars().count() as f64
}

/// Lines of at most `width` px, broken between words.
fn wrapped(text: &str, width: f64) -> Vec<String> {
    super::text::wrap(text, (width / CHARACTER).max(8.0) as usize)
}

fn class(series: &Series, index: usize) -> String {
    let form = match series.mark {
        Mark::Line | Mark::Step => "line",
        Mark::Dashed => "line dashed",
        Mark::Scatter => "dots",
        Mark::Area => "area",
    };
    format!("{form} s{index}")
}

impl Layout {
    fn new(chart: &Chart, width: f64) -> Self {
        let series = names(chart.panels.iter().flat_map(|panel| &panel.series).map(|series| &series.name));
        let limits = names(chart.panels.iter().flat_map(|panel| &panel.limits).map(|limit| &limit.name));
        let bands = names(chart.panels.iter().flat_map(|panel| &panel.bands).map(|band| &band.name));
        let x = Map::new(&chart.x, x_values(chart), 0.0, [0.0, 1.0]);
        let mut layout = Self {
            width,
            height: 0.0,
            left: 0.0,
            x,
            panels: Vec::new(),
            legend: Vec::new(),
            series,
            limits,
            bands,
        };
        let entries = layout.entries(chart);
        layout.legend = if entries.len() > 1 { rows(entries, width) } else { Vec::new() };
        layout.place_panels(chart);
        layout.fit_labels();
        layout
    }

    fn fit_labels(&mut self) {
        let labels = self.panels.iter().flat_map(|place| place.y.ticks(Y_SPACING));
        let widest = labels.map(|tick| text_width(&tick.label)).fold(0.0, f64::max);
        self.left = widest + 12.0;
        self.x.to = [self.left, self.width - RIGHT];
    }

    fn place_panels(&mut self, chart: &Chart) {
        let plot_height = match (chart.panels.len(), self.width < 600.0) {
            (1, false) => 300.0,
            (1, true) => 230.0,
            (_, false) => 170.0,
            (_, true) => 140.0,
        };
        self.place_panels_of(chart, plot_height);
    }

    /// Lets the panels take what is left of a height.
    fn stretch(&mut self, chart: &Chart, height: f64) {
        let Some(first) = self.panels.first() else { return };
        let more = (height - self.height) / self.panels.len() as f64;
        let plot_height = (first.height + more).max(LEAST_PANEL);
        self.place_panels_of(chart, plot_height);
        self.fit_labels();
    }

    fn place_panels_of(&mut self, chart: &Chart, plot_height: f64) {
        self.panels.clear();
        let legend = LINE_HEIGHT * self.legend.len() as f64;
        let mut top = if legend > 0.0 { legend + 10.0 } else { 4.0 };
        for panel in &chart.panels {
            let title = wrapped(&panel.y.label(), self.width);
            let plot_top = top + LINE_HEIGHT * title.len() as f64 + 6.0;
            let y = Map::new(&panel.y, y_values(panel), 0.05, [plot_top + plot_height, plot_top]);
            self.panels.push(Place { title_top: top, title, top: plot_top, height: plot_height, y });
            top = plot_top + plot_height + 10.0;
        }
        let x_title = wrapped(&chart.x.label(), self.width - 80.0);
        self.height = top - 10.0 + 24.0 + LINE_HEIGHT * x_title.len() as f64 + 4.0;
    }

    fn entries(&self, chart: &Chart) -> Vec<Entry> {
        let all = || chart.panels.iter().flat_map(|panel| &panel.series);
        let series = self.series.iter().enumerate().filter_map(|(number, name)| {
            let own = || all().filter(|series| series.name == *name);
            let series = own().find(|series| series.mark != Mark::Area).or_else(|| own().next())?;
            let form = match series.mark {
                Mark::Scatter => Form::Dot,
                Mark::Area => Form::Area,
                _ => Form::Line,
            };
            Some(Entry { name: name.clone(), class: class(series, number % COLOURS), form })
        });
        let limits = self.limits.iter().enumerate().map(|(number, name)| Entry {
            name: name.clone(),
            class: format!("limit l{}", number % DASHES),
            form: Form::Line,
        });
        let bands = self.bands.iter().enumerate().map(|(number, name)| Entry {
            name: name.clone(),
            class: format!("band b{}", number % TINTS),
            form: Form::Area,
        });
        series.chain(limits).chain(bands).collect()
    }

    fn legend(&self, markup: &mut Markup) {
        for (row, entries) in self.legend.iter().enumerate() {
            let middle = 4.0 + LINE_HEIGHT * (row as f64 + 0.5);
            let mut x = 0.0;
            for entry in entries {
                entry.draw(x, middle, markup);
                x += entry.width();
            }
        }
    }

    fn panel(&self, panel: &Panel, place: &Place, clip: &str, markup: &mut Markup) {
        for (number, line) in place.title.iter().enumerate() {
            let y = place.title_top + LINE_HEIGHT * number as f64 + 14.0;
            markup.text_element("text", &[("class", &"axis"), ("x", &0), ("y", &Px(y))], line);
        }
        let y_ticks = place.y.ticks(Y_SPACING);
        for tick in &y_ticks {
            let at = [("x", Px(self.left - 7.0)), ("y", Px(place.y.at(tick.value) + 4.5))];
            markup.text_element("text", &[("class", &"ty"), ("x", &at[0].1), ("y", &at[1].1)], &tick.label);
        }
        let plot_width = self.width - RIGHT - self.left;
        let frame = [Px(self.left), Px(place.top), Px(plot_width), Px(place.height)];
        // Nothing is drawn beyond the frame. A picture within the picture would do it too, but not every program
        // draws one.
        let size: [(&str, &dyn fmt::Display); 4] =
            [("x", &frame[0]), ("y", &frame[1]), ("width", &frame[2]), ("height", &frame[3])];
        markup.element("clipPath", &[("id", &clip)], |markup| markup.leaf("rect", &size));
        markup.element("g", &[("clip-path", &format!("url(#{clip})"))], |markup| {
            self.bands(panel, place, markup);
            self.grid(place, &y_ticks, markup);
            for series in &panel.series {
                self.series(series, place, markup);
            }
            for limit in panel.limits.iter().filter(|limit| limit.y.is_finite()) {
                let class = format!("limit l{}", index(&self.limits, &limit.name, DASHES));
                let path = format!("M{} {}H{}", frame[0], Px(place.y.at(limit.y)), Px(self.width - RIGHT));
                markup.leaf("path", &[("class", &class), ("d", &path)]);
            }
        });
        if y_values(panel).is_none() {
            let at = [Px(self.left + 0.5 * plot_width), Px(place.top + 0.5 * place.height)];
            markup.text_element("text", &[("class", &"tx"), ("x", &at[0]), ("y", &at[1])], "no data");
        }
        let bottom = place.top + place.height;
        let frame = format!("M{} {}V{}H{}", frame[0], frame[1], Px(bottom), Px(self.width - RIGHT));
        markup.leaf("path", &[("class", &"frame"), ("d", &frame)]);
    }

    fn grid(&self, place: &Place, y_ticks: &[Tick], markup: &mut Markup) {
        let (left, right) = (Px(self.left), Px(self.width - RIGHT));
        let mut path = String::new();
        for tick in y_ticks {
            path += &format!("M{left} {}H{right}", Px(place.y.at(tick.value)));
        }
        for tick in self.x_ticks() {
            path += &format!("M{} {}v{}", Px(self.x.at(tick.value)), Px(place.top), Px(place.height));
        }
        markup.leaf("path", &[("class", &"grid"), ("d", &path)]);
    }

    fn bands(&self, panel: &Panel, place: &Place, markup: &mut Markup) {
        for band in &panel.bands {
            let span = |map: &Map, range: Option<[f64; 2]>| {
                let [from, to] = range.map_or(map.to, |range| range.map(|value| map.at(value)));
                [from.min(to), from.max(to)]
            };
            let ([left, right], [top, bottom]) = (span(&self.x, band.x), span(&place.y, band.y));
            if [left, right, top, bottom].iter().all(|edge| edge.is_finite()) {
                let class = format!("band b{}", index(&self.bands, &band.name, TINTS));
                rectangle(&class, [left, top, right - left, bottom - top], markup);
            }
        }
    }

    fn series(&self, series: &Series, place: &Place, markup: &mut Markup) {
        let class = class(series, index(&self.series, &series.name, COLOURS));
        let points = series.points.iter().map(|[x, y]| [self.x.at(*x), place.y.at(*y)]);
        let path = match series.mark {
            Mark::Line | Mark::Dashed => polyline(&thin::line(points, 1.0)),
            Mark::Step => polyline(&thin::line(stairs(points), 1.0)),
            Mark::Scatter => dots(&thin::cloud(points, 2.0)),
            Mark::Area => polyline(&thin::line(points, 1.0)) + "Z",
        };
        markup.leaf("path", &[("class", &class), ("d", &path)]);
    }

    fn x_ticks(&self) -> Vec<Tick> {
        let spacing = if self.width < 600.0 { 60.0 } else { 80.0 };
        self.x.ticks(spacing)
    }

    fn x_axis(&self, chart: &Chart, markup: &mut Markup) {
        let Some(last) = self.panels.last() else { return };
        let bottom = last.top + last.height;
        for tick in self.x_ticks() {
            let at = [Px(self.x.at(tick.value)), Px(bottom + 18.0)];
            markup.text_element("text", &[("class", &"tx"), ("x", &at[0]), ("y", &at[1])], &tick.label);
        }
        let middle = 0.5 * (self.left + self.width - RIGHT);
        for (number, line) in wrapped(&chart.x.label(), self.width - 80.0).iter().enumerate() {
            let at = [Px(middle), Px(bottom + 24.0 + LINE_HEIGHT * (number as f64 + 0.75))];
            markup.text_element("text", &[("class", &"axis tx"), ("x", &at[0]), ("y", &at[1])], line);
        }
    }
}

impl Entry {
    fn width(&self) -> f64 {
        SWATCH + text_width(&self.name) + 18.0
    }

    fn draw(&self, x: f64, middle: f64, markup: &mut Markup) {
        match self.form {
            Form::Line => {
                let path = format!("M{} {}h20", Px(x), Px(middle));
                markup.leaf("path", &[("class", &self.class), ("d", &path)]);
            }
            Form::Dot => {
                let path = dots(&[[x + 6.0, middle], [x + 14.0, middle]]);
                markup.leaf("path", &[("class", &self.class), ("d", &path)]);
            }
            Form::Area => rectangle(&self.class, [x, middle - 6.0, 20.0, 12.0], markup),
        }
        markup.text_element("text", &[("x", &Px(x + SWATCH)), ("y", &Px(middle + 4.5))], &self.name);
    }
}

fn rectangle(class: &str, [x, y, width, height]: [f64; 4], markup: &mut Markup) {
    markup.leaf(
        "rect",
        &[("class", &class), ("x", &Px(x)), ("y", &Px(y)), ("width", &Px(width)), ("height", &Px(height))],
    );
}

/// Entries in rows that are not wider than the picture.
fn rows(entries: Vec<Entry>, width: f64) -> Vec<Vec<Entry>> {
    let mut rows: Vec<Vec<Entry>> = Vec::new();
    let mut used = f64::INFINITY;
    for entry in entries {
        if used + entry.width() > width {
            rows.push(Vec::new());
            used = 0.0;
        }
        used += entry.width();
        rows.last_mut().expect("the first entry opens a row").push(entry);
    }
    rows
}

fn x_values(chart: &Chart) -> Option<[f64; 2]> {
    let points = chart.panels.iter().flat_map(|panel| &panel.series).flat_map(|series| &series.points);
    let shown = |value: &f64| along(chart.x.scale, *value).is_finite();
    extent(points.map(|point| point[0]).filter(shown))
}

fn y_values(panel: &Panel) -> Option<[f64; 2]> {
    let points = panel.series.iter().flat_map(|series| &series.points).map(|point| point[1]);
    let limits = panel.limits.iter().map(|limit| limit.y);
    let bands = panel.bands.iter().filter_map(|band| band.y).flatten();
    let shown = |value: &f64| along(panel.y.scale, *value).is_finite();
    extent(points.chain(limits).chain(bands).filter(shown))
}
