//! Saving what a stack of plots shows: the visible samples as a log, the figure as SVG or PNG.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Context, DragValue, Id, Key, Rect, TextEdit, Ui};
use flqr_core::record::{Log, write_log};
use flqr_core::report::Chart;

use crate::job::{Job, Outcome, Waker};
use crate::picture::Shot;
use crate::widgets::{choice_ui, error_ui, warning_ui};
use crate::write_file::write_file;

/// What is saved of a figure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FigureKind {
    /// The visible samples as a log.
    #[default]
    Csv,
    /// The figure, drawn anew from the data.
    Svg,
    /// The figure as it is on the screen.
    Png,
}

impl FigureKind {
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (
            Self::Csv,
            "CSV",
            "The samples of the visible range, units in the header, as every command reads them",
        ),
        (Self::Svg, "SVG", "The visible range, drawn at the size that is given here"),
        (Self::Png, "PNG", "The plots as they are on the screen"),
    ];

    /// Ending of the file.
    pub(crate) fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

/// A figure to be saved: of which stack, and as what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FigureFile {
    /// Name of the stack.
    pub stack: &'static str,
    /// What is saved of it.
    pub kind: FigureKind,
}

impl FigureFile {
    /// Name that a dialog offers.
    pub(crate) fn suggestion(self) -> String {
        format!("{}.{}", self.stack, self.kind.extension())
    }

    fn id(self) -> Id {
        Id::unique(("figure file", self.stack))
    }

    /// Hands the stack what a dialog brought; it saves when it is drawn next.
    pub(crate) fn answer(self, ctx: &Context, answer: Result<PathBuf, String>) {
        ctx.data_mut(|data| data.insert_temp(self.id(), Answer(Some((self.kind, answer)))));
        ctx.request_repaint();
    }
}

/// What a dialog brought for a figure.
#[derive(Clone, Default)]
struct Answer(Option<(FigureKind, Result<PathBuf, String>)>);

/// Samples of one curve.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Samples {
    pub(super) key: String,
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
}

/// What is to be written.
pub(super) enum Content {
    Log { x_key: &'static str, curves: Vec<Samples> },
    Chart(Box<Chart>, [f64; 2]),
    Picture,
}

enum Saved {
    Written,
    Exists,
}

/// Writes a figure.
type SaveJob = Job<(), Result<Saved, String>>;

/// The form and what it has started.
#[derive(Default)]
pub(super) struct Export {
    pub(super) open: bool,
    pub(super) kind: FigureKind,
    path: String,
    size: Option<[f64; 2]>,
    shot: Option<(PathBuf, bool, Shot)>,
    job: Option<(PathBuf, SaveJob)>,
    problem: Option<String>,
    /// What is there already and was not replaced.
    existing: Option<PathBuf>,
}

/// What the form asks for.
#[derive(Default)]
pub(super) struct Asked {
    /// Save to this path; replace what is there if true.
    pub(super) save: Option<(PathBuf, bool)>,
    pub(super) dialog: bool,
}

impl Export {
    /// Size of an SVG, px.
    pub(super) fn size(&self) -> [f64; 2] {
        self.size.unwrap_or([900.0, 600.0])
    }

    fn is_busy(&self) -> bool {
        self.shot.is_some() || self.job.is_some()
    }

    pub(super) fn ui(&mut self, ui: &mut Ui, stack: &'static str) -> Asked {
        let mut asked = Asked::default();
        let file = FigureFile { stack, kind: self.kind };
        let answer = ui.ctx().data_mut(|data| data.remove_temp::<Answer>(file.id()));
        match answer.and_then(|answer| answer.0) {
            Some((kind, Ok(path))) => {
                // The dialog has asked before replacing a file, though not about an ending added here.
                let full = with_ending(path.clone(), kind);
                let replace = full == path;
                (self.open, self.kind) = (true, kind);
                self.path = full.display().to_string();
                asked.save = Some((full, replace));
            }
            Some((_, Err(problem))) => self.problem = Some(problem),
            None => {}
        }
        if self.open {
            ui.horizontal_wrapped(|ui| self.form_ui(ui, &mut asked));
            if let Some(problem) = &self.problem {
                error_ui(ui, problem);
            }
        }
        asked
    }

    fn form_ui(&mut self, ui: &mut Ui, asked: &mut Asked) {
        ui.label("Export the visible range as");
        ui.scope(|ui| choice_ui(ui, &mut self.kind, &FigureKind::ALL));
        if self.kind == FigureKind::Svg {
            let mut size = self.size();
            for (side, name) in size.iter_mut().zip(["figure width", "figure height"]) {
                let field = DragValue::new(side).range(200.0..=10_000.0).speed(5.0).suffix(" px");
                ui.add(field).accessible_name(name);
            }
            self.size = Some(size);
        }
        let hint = format!("path, .{}", self.kind.extension());
        let field = TextEdit::singleline(&mut self.path).hint_text(hint).desired_width(220.0);
        let field = ui.add(field).accessible_name("figure path");
        let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if field.changed() {
            (self.problem, self.existing) = (None, None);
        }
        let ready = !self.path.trim().is_empty() && !self.is_busy();
        let save = ui.add_enabled(ready, egui::Button::new("Save figure"));
        let save = save.on_hover_text("Save to the path; an existing file is replaced after a question");
        if save.clicked() || (entered && ready) {
            let path = with_ending(self.path.trim().into(), self.kind);
            self.path = path.display().to_string();
            asked.save = Some((path, false));
        }
        if ui.button("Browse…").on_hover_text("Choose where to save the figure").clicked() {
            asked.dialog = true;
        }
        if let Some(path) = self.existing.clone() {
            warning_ui(ui, format!("{} exists.", path.display()));
            if ui.button("Replace it").on_hover_text("Replace what is there").clicked() {
                asked.save = Some((path, true));
            }
        }
    }

    /// Starts to write; a sentence if it cannot.
    pub(super) fn start(&mut self, ui: &Ui, (path, replace): (PathBuf, bool), content: Content, part: Rect) {
        if self.is_busy() {
            self.problem = Some("A figure is still being written: try again when that has ended.".to_owned());
            return;
        }
        (self.problem, self.existing) = (None, None);
        match content {
            Content::Picture => self.shot = Some((path, replace, Shot::ask(ui.ctx(), part))),
            Content::Chart(chart, size) => {
                self.write(ui, path, replace, move || Ok(chart.to_svg_of(size).into_bytes()));
            }
            Content::Log { x_key, curves } => self.write(ui, path, replace, move || csv(x_key, curves)),
        }
    }

    fn write(
        &mut self,
        ui: &Ui,
        path: PathBuf,
        replace: bool,
        content: impl FnOnce() -> Result<Vec<u8>, String> + Send + 'static,
    ) {
        let ctx = ui.ctx().clone();
        let waker: Waker = Arc::new(move || ctx.request_repaint());
        let file = path.clone();
        let work = move |_: &crate::job::Reporter<()>| save(&file, replace, content);
        match Job::start("save-figure", &waker, work) {
            Ok(job) => self.job = Some((path, job)),
            Err(error) => self.problem = Some(format!("No thread to write the figure: {error}.")),
        }
    }

    /// A sentence when something was written.
    pub(super) fn drain(&mut self, ui: &Ui) -> Option<String> {
        if let Some((path, replace, shot)) = self.shot.take() {
            match shot.poll() {
                Some(Ok(picture)) => self.write(ui, path, replace, move || picture.png()),
                Some(Err(problem)) => self.problem = Some(problem),
                None => self.shot = Some((path, replace, shot)),
            }
        }
        let (path, mut job) = self.job.take()?;
        match job.poll().1 {
            Outcome::Running => self.job = Some((path, job)),
            Outcome::Done(Ok(Saved::Written)) => return Some(format!("Saved {}.", path.display())),
            Outcome::Done(Ok(Saved::Exists)) => self.existing = Some(path),
            Outcome::Done(Err(problem)) => self.problem = Some(problem),
            Outcome::Broken => {
                self.problem = Some("Writing the figure failed: this is a defect of flqr.".to_owned());
            }
        }
        None
    }
}

fn with_ending(path: PathBuf, kind: FigureKind) -> PathBuf {
    let known =
        |ending: &std::ffi::OsStr| FigureKind::ALL.iter().any(|(kind, ..)| ending == kind.extension());
    if path.extension().is_some_and(known) {
        return path.with_extension(kind.extension());
    }
    let mut name = path.into_os_string();
    name.push(".");
    name.push(kind.extension());
    name.into()
}

fn save(
    path: &Path,
    replace: bool,
    content: impl FnOnce() -> Result<Vec<u8>, String>,
) -> Result<Saved, String> {
    if !replace && path.symlink_metadata().is_ok() {
        return Ok(Saved::Exists);
    }
    write_file(path, &content()?).map_err(|error| {
        format!(
            "{} could not be saved: {error}; check the folder, its permissions and the space on the disk",
            path.display()
        )
    })?;
    Ok(Saved::Written)
}

fn csv(x_key: &'static str, curves: Vec<Samples>) -> Result<Vec<u8>, String> {
    let mut text = Vec::new();
    let log = merged(x_key, curves);
    write_log(&log, &mut text).map_err(|error| format!("the log has no text: {error}"))?;
    Ok(text)
}

/// One row for each time of any curve; a cell is empty where a curve has no sample then.
fn merged(x_key: &'static str, curves: Vec<Samples>) -> Log {
    let first = curves.first().map(|curve| curve.x.clone()).unwrap_or_default();
    if curves.iter().all(|curve| curve.x == first) {
        let columns = curves.into_iter().map(|curve| (curve.key, curve.y));
        return Log::from_columns("", std::iter::once((x_key.to_owned(), first)).chain(columns));
    }
    let mut times: Vec<f64> = curves.iter().flat_map(|curve| curve.x.iter().copied()).collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    let column = |curve: &Samples| {
        let mut samples = curve.x.iter().zip(&curve.y).peekable();
        let value = |time: &f64| {
            let mut value = f64::NAN;
            while let Some((_, y)) = samples.next_if(|(x, _)| *x <= time) {
                value = *y;
            }
            value
        };
        times.iter().map(value).collect()
    };
    let columns: Vec<(String, Vec<f64>)> =
        curves.iter().map(|curve| (curve.key.clone(), column(curve))).collect();
    Log::from_columns("", std::iter::once((x_key.to_owned(), times.clone())).chain(columns))
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use flqr_core::record::{ColumnMap, ReadOptions, read_log};

    use super::*;

    #[test]
    fn an_exported_range_reads_back_equal() {
        let x: Vec<f64> = (0..500).map(|row| f64::from(row) * 1e-3 + 0.1).collect();
        let y = |factor: f64| x.iter().map(|x| (factor * x).sin() / 3.0).collect::<Vec<_>>();
        let curve = |key: &str, factor| Samples { key: key.to_owned(), x: x.clone(), y: y(factor) };
        let curves = vec![curve("pitch_rad", 3.0), curve("x_m", 0.7)];
        let text = csv("time_s", curves.clone()).unwrap();
        let map = ColumnMap::default();
        let watch = &mut |_: flqr_core::record::ReadProgress| ControlFlow::Continue(());
        let log = read_log(text.as_slice(), "figure.csv", &ReadOptions::new(&map), watch).unwrap();
        assert_eq!((log.column("time_s"), log.problem_count), (Some(x.as_slice()), 0));
        for curve in &curves {
            assert_eq!(log.column(&curve.key), Some(curve.y.as_slice()));
        }
    }

    #[test]
    fn curves_of_different_times_share_rows_where_they_can() {
        let samples =
            |key: &str, x: &[f64], y: &[f64]| Samples { key: key.to_owned(), x: x.to_vec(), y: y.to_vec() };
        let curves =
            vec![samples("a", &[0.0, 1.0, 2.0], &[1.0, 2.0, 3.0]), samples("b", &[1.0, 1.5], &[7.0, 8.0])];
        let text = String::from_utf8(csv("time_s", curves).unwrap()).unwrap();
        assert_eq!(text, "time_s,a,b\n0,1,\n1,2,7\n1.5,,8\n2,3,\n");
    }

    #[test]
    fn the_ending_is_that_of_what_is_saved() {
        for (name, kind, expected) in [
            ("a", FigureKind::Svg, "a.svg"),
            ("a.csv", FigureKind::Png, "a.png"),
            ("v1.2", FigureKind::Csv, "v1.2.csv"),
        ] {
            assert_eq!(with_ending(name.into(), kind), PathBuf::from(expected));
        }
    }
}
