//! Plots below each other over one time axis, with all their tools: a page hands over what there is to plot, and gets
//! cursors, readings, statistics, spectra, a second axis, units, limits and exports by one call.

mod content;
mod phrases;
mod rows;
mod tools;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use egui::{Color32, Key, Modifiers, Rect, Ui};

use super::cursors::{Cursors, steps};
use super::decimate::{Data, DecimationCache, Indexed};
use super::export::{Export, FigureFile, FigureKind};
use super::marks::{Marks, Moved};
use super::spectra::Spectra;
use super::unit::{Unit, UnitChoice, degrees};
use super::view::TimeView;
use crate::command::{Command, Commands, FilePurpose};

/// One plot: what it shows, and of which quantity.
pub struct Panel<'a> {
    /// Name of the quantity; differs from that of any other plot of the stack.
    pub name: Cow<'a, str>,
    /// Its unit.
    pub unit: Unit,
    /// The vertical range is at least this long, in the core's unit.
    pub min_span: f64,
    /// True if it is shown until the user chooses.
    pub shown: bool,
    /// Curves, the later ones drawn over the earlier ones.
    pub curves: Vec<PanelCurve<'a>>,
    /// Limits, drawn at both signs: name and size in the core's unit.
    pub limits: Vec<(&'static str, f64)>,
}

/// One curve of a plot.
pub struct PanelCurve<'a> {
    /// Name where a plot has several; may be empty.
    pub name: Cow<'a, str>,
    /// Column in an exported log, with the core's unit; differs from that of any other curve of the stack.
    pub key: Cow<'a, str>,
    /// Colour of the line.
    pub color: Color32,
    /// Its data, in the core's unit.
    pub data: Data<'a>,
    /// Changes whenever the data do.
    pub generation: u64,
    /// A larger step in time is drawn as a gap.
    pub gap: f64,
}

impl Panel<'_> {
    /// Shown unit and factor.
    pub(super) fn shown_unit(&self, units: UnitChoice) -> (&'static str, f64) {
        self.unit.shown(units)
    }

    /// Name of a curve for people.
    pub(super) fn curve_name(&self, curve: &PanelCurve<'_>) -> String {
        if curve.name.is_empty() { self.name.to_string() } else { format!("{} {}", self.name, curve.name) }
    }
}

/// Requests of a stack to its page.
#[derive(Debug, Default, PartialEq)]
#[must_use]
pub struct Wishes {
    /// Ask for a path with a dialog.
    pub dialog: Option<FigureFile>,
    /// Say this, or complain of it.
    pub said: Option<Result<String, String>>,
    /// User actions on marks.
    pub moved: Moved,
    /// Displacement of a curve by a drag, where [`Stack::drag_moves_curve`] is set.
    pub shift: f64,
}

impl Wishes {
    /// Passes on what the page cannot do itself; what the user did to marks.
    pub(crate) fn send(self, commands: &Commands) -> Moved {
        if let Some(file) = self.dialog {
            commands.send(Command::ShowDialog(FilePurpose::SaveFigure(file)));
        }
        match self.said {
            Some(Ok(text)) => commands.send(Command::Say(text)),
            Some(Err(problem)) => commands.send(Command::Complain(problem)),
            None => {}
        }
        self.moved
    }
}

/// State of a stack of plots.
pub struct Stack {
    /// Name of the stack: of its files, and apart from all other stacks.
    name: &'static str,
    /// The visible range.
    pub view: TimeView,
    /// The units that are shown; degrees are all of the window's.
    units: UnitChoice,
    /// True if there is a newest sample to follow.
    is_live: bool,
    /// Label of the horizontal axis, and the column of it in an exported log.
    pub x: [&'static str; 2],
    /// Sources of the curves, one line each, included in every export.
    pub sources: Vec<String>,
    /// True if a drag is for a curve, and not for the visible range.
    pub drag_moves_curve: bool,
    cursors: Option<Cursors>,
    spectra: Option<Spectra>,
    /// Of plots by name: the curve at their right axis, by its key.
    second: BTreeMap<String, String>,
    /// Plots that the user has shown or hidden.
    chosen: BTreeMap<String, bool>,
    caches: BTreeMap<String, DecimationCache>,
    export: Export,
    readout_height: f32,
    page: Rect,
    limits: [f64; 2],
    /// The plot that had the keyboard last.
    focus: Option<egui::Id>,
}

/// Common data of the plots of a stack while they are drawn.
struct Around<'m, 'p> {
    marks: Option<&'m mut Marks>,
    all: &'p [Panel<'p>],
    wishes: Wishes,
    dialog: Option<FigureKind>,
}

impl Stack {
    /// A stack called `name` over time, `span` seconds long.
    pub fn new(name: &'static str, span: f64) -> Self {
        Self {
            name,
            view: TimeView::following(span),
            units: UnitChoice::default(),
            is_live: false,
            x: ["time [s]", "time_s"],
            sources: Vec::new(),
            drag_moves_curve: false,
            cursors: None,
            spectra: None,
            second: BTreeMap::new(),
            chosen: BTreeMap::new(),
            caches: BTreeMap::new(),
            export: Export::default(),
            readout_height: 0.0,
            page: Rect::NOTHING,
            limits: [0.0, 1.0],
            focus: None,
        }
    }

    /// A stack that follows the newest sample.
    pub fn live(name: &'static str, span: f64) -> Self {
        Self { is_live: true, ..Self::new(name, span) }
    }

    /// Returns whether the arrow keys belong to the cursors.
    pub fn has_cursors(&self) -> bool {
        self.cursors.is_some() && self.spectra.is_none()
    }

    /// Takes note of the range of the data; call it once a frame, before the plots.
    pub fn update(&mut self, limits: [f64; 2]) {
        self.limits = limits;
        if self.is_live || !self.view.follow {
            self.view.update(limits);
        } else {
            self.view.show_all(limits);
        }
    }

    /// Shows all of the data and holds it.
    pub fn show_all(&mut self, limits: [f64; 2]) {
        self.limits = limits;
        self.view.show_all(limits);
    }

    /// State of the stack for scripts.
    pub fn snapshot(&self) -> serde_json::Value {
        serde_json::json!({
            "range": self.view.range(),
            "follow": self.view.follow,
            "cursors": self.cursors.map(|cursors| cursors.at),
            "spectrum": self.spectra.is_some(),
            "degrees": self.units.degrees,
            "amperes": self.units.amperes,
            "second_axis": self.second,
        })
    }

    fn is_shown(&self, panel: &Panel<'_>) -> bool {
        self.chosen.get(&*panel.name).copied().unwrap_or(panel.shown)
    }

    /// The plots over the available room.
    pub fn show(&mut self, ui: &mut Ui, panels: &[Panel<'_>]) -> Wishes {
        self.show_marked(ui, panels, None)
    }

    /// Same with marks of the page, which are drawn below the cursors of the stack.
    pub fn show_marked(&mut self, ui: &mut Ui, panels: &[Panel<'_>], marks: Option<&mut Marks>) -> Wishes {
        self.units.degrees = degrees(ui.ctx());
        let asked = self.export.ui(ui, self.name);
        let said = self.export.drain();
        let mut around =
            Around { marks, all: panels, wishes: Wishes { said, ..Wishes::default() }, dialog: asked.dialog };
        self.forget_others(panels);
        let shown: Vec<&Panel<'_>> = panels.iter().filter(|panel| self.is_shown(panel)).collect();
        self.keys(ui, &shown);
        let top = ui.next_widget_position();
        if shown.is_empty() {
            ui.weak("No signal is selected. See Signals.");
        } else if self.spectra.is_some() {
            self.spectra_ui(ui, &shown);
        } else {
            self.time_ui(ui, &shown, &mut around);
        }
        let right = ui.max_rect().right();
        self.page = Rect::from_min_max(top, egui::pos2(right, ui.next_widget_position().y));
        let Around { mut wishes, dialog, .. } = around;
        wishes.dialog = dialog.map(|kind| FigureFile { stack: self.name, kind });
        if let Some(target) = asked.save {
            let figure = self.figure(&shown, target.0);
            self.export.start(ui.ctx(), target, figure, self.page);
        }
        wishes
    }

    /// Returns whether an export may be requested, and [`Stack::sources`] is of use.
    pub fn exports(&self) -> bool {
        self.export.open
    }

    /// Curves that are gone leave nothing in memory.
    fn forget_others(&mut self, panels: &[Panel<'_>]) {
        if self.caches.len() > panels.iter().map(|panel| panel.curves.len()).sum() {
            let keys =
                panels.iter().flat_map(|panel| panel.curves.iter().map(|curve| cache_key(panel, curve)));
            let keys: BTreeSet<String> = keys.collect();
            self.caches.retain(|key, _| keys.contains(key));
        }
    }

    /// End follows the newest sample; the arrows move a cursor.
    fn keys(&mut self, ui: &Ui, shown: &[&Panel<'_>]) {
        let focused = ui.memory(|memory| memory.focused());
        if focused.is_some() && focused != self.focus {
            return;
        }
        if self.is_live && ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, Key::End)) > 0 {
            self.view.follow = true;
        }
        if !self.has_cursors() {
            return;
        }
        let steps = steps(ui);
        let first = shown.first().and_then(|panel| panel.curves.first().map(|curve| (panel, curve)));
        if let (Some(mut cursors), Some((panel, curve))) = (self.cursors, first) {
            let units = self.units;
            cursors.follow_samples(&indexed(&mut self.caches, panel, curve, units), steps);
            self.cursors = Some(cursors);
        }
    }
}

fn plot_id(stack: &str, panel: &Panel<'_>) -> String {
    format!("{stack}/{}", panel.name)
}

fn cache_key(panel: &Panel<'_>, curve: &PanelCurve<'_>) -> String {
    format!("{}/{}", panel.name, curve.key)
}

fn cache<'c>(
    caches: &'c mut BTreeMap<String, DecimationCache>,
    panel: &Panel<'_>,
    curve: &PanelCurve<'_>,
) -> &'c mut DecimationCache {
    caches.entry(cache_key(panel, curve)).or_default()
}

/// A curve with its pyramids, in the shown unit.
fn indexed<'c>(
    caches: &'c mut BTreeMap<String, DecimationCache>,
    panel: &Panel<'_>,
    curve: &'c PanelCurve<'_>,
    units: UnitChoice,
) -> Indexed<'c> {
    let look = [panel.shown_unit(units).1, curve.gap];
    cache(caches, panel, curve).indexed(curve.data, look, curve.generation)
}
