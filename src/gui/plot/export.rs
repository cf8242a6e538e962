//! Saving what a stack of plots shows: the visible samples as a log, the figure as SVG or PNG.

use std::io::{self, BufWriter, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Context, DragValue, Id, Key, ProgressBar, Rect, RichText, TextEdit, Ui};
use flqr_core::record::LogWriter;
use flqr_core::report::Chart;

use super::decimate::Snapshot;
use crate::job::{Job, Outcome, Reporter, Waker};
use crate::picture::Shot;
use crate::save_form::{FileKind, not_saved, with_ending};
use crate::widgets::{choice_ui, error_ui, warning_ui};
use crate::write_file::write_file_with;

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

impl FileKind for FigureKind {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (
            Self::Csv,
            "CSV",
            "The samples of the visible range, units in the header, as every command reads them",
        ),
        (Self::Svg, "SVG", "The visible range, drawn at the size that is given here"),
        (Self::Png, "PNG", "The plots as they are on the screen"),
    ];

    fn extension(self) -> &'static str {
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

/// What is to be written; `sources` say where the curves come from.
pub(super) enum Content {
    Log { x_key: &'static str, curves: Vec<(String, Snapshot)>, sources: Vec<String> },
    Chart(Box<Chart>, [f64; 2]),
    Picture { sources: Vec<String> },
}

enum Saved {
    Written,
    Exists,
    Cancelled,
}

/// Share of what is written, from 0 to 1.
type Share = f32;

/// Writes a figure.
type SaveJob = Job<Share, Result<Saved, String>>;

/// The form and what it has started.
#[derive(Default)]
pub(super) struct Export {
    pub(super) open: bool,
    pub(super) kind: FigureKind,
    path: String,
    focus_path: bool,
    size: Option<[f64; 2]>,
    shot: Option<(PathBuf, bool, Vec<String>, Shot)>,
    job: Option<(PathBuf, SaveJob)>,
    share: Share,
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
            Some((kind, Err(problem))) => {
                (self.open, self.kind, self.focus_path) = (true, kind, true);
                self.problem = Some(problem);
            }
            None => {}
        }
        if self.open {
            ui.horizontal_wrapped(|ui| self.form_ui(ui, &mut asked));
            self.progress_ui(ui);
            if let Some(problem) = &self.problem {
                error_ui(ui, problem);
            }
        }
        asked
    }

    /// Only what takes its time has progress.
    fn progress_ui(&self, ui: &mut Ui) {
        let Some((path, job)) = self.job.as_ref().filter(|_| self.share > 0.0) else { return };
        ui.horizontal(|ui| {
            if ui.button("Cancel export").on_hover_text("Stop writing; no file is left").clicked() {
                job.cancel();
            }
            let text = RichText::new(format!("{}, {:.0} %", path.display(), 100.0 * self.share)).small();
            ui.add(ProgressBar::new(self.share).text(text));
        });
    }

    fn form_ui(&mut self, ui: &mut Ui, asked: &mut Asked) {
        ui.label("Export the visible range as");
        ui.scope(|ui| choice_ui(ui, &mut self.kind, FigureKind::ALL));
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
        if std::mem::take(&mut self.focus_path) {
            field.request_focus();
        }
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
            Content::Picture { sources } => {
                self.shot = Some((path, replace, sources, Shot::ask(ui.ctx(), part)));
            }
            Content::Chart(chart, size) => {
                self.write(ui, path, replace, move |file, _| file.write_all(chart.to_svg_of(size).as_bytes()))
            }
            Content::Log { x_key, curves, sources } => {
                self.write(ui, path, replace, move |file, share| csv(x_key, &curves, &sources, file, share))
            }
        }
    }

    fn write(
        &mut self,
        ui: &Ui,
        path: PathBuf,
        replace: bool,
        content: impl FnOnce(&mut dyn Write, Watch<'_>) -> io::Result<()> + Send + 'static,
    ) {
        let ctx = ui.ctx().clone();
        let waker: Waker = Arc::new(move || ctx.request_repaint());
        let file = path.clone();
        let work = move |reporter: &Reporter<Share>| save(&file, replace, content, reporter);
        self.share = 0.0;
        match Job::start("save-figure", &waker, work) {
            Ok(job) => self.job = Some((path, job)),
            Err(error) => self.problem = Some(format!("No thread to write the figure: {error}.")),
        }
    }

    /// A sentence when something was written.
    pub(super) fn drain(&mut self, ui: &Ui) -> Option<String> {
        if let Some((path, replace, sources, shot)) = self.shot.take() {
            match shot.poll() {
                Some(Ok(picture)) => self.write(ui, path, replace, move |file, _| {
                    file.write_all(&picture.png(&sources).map_err(io::Error::other)?)
                }),
                Some(Err(problem)) => self.problem = Some(problem),
                None => self.shot = Some((path, replace, sources, shot)),
            }
        }
        let (path, mut job) = self.job.take()?;
        let (shares, outcome) = job.poll();
        self.share = shares.last().copied().unwrap_or(self.share);
        match outcome {
            Outcome::Running => self.job = Some((path, job)),
            Outcome::Done(Ok(Saved::Written)) => return Some(format!("Saved {}.", path.display())),
            Outcome::Done(Ok(Saved::Cancelled)) => {
                return Some(format!("Cancelled: {} was not written.", path.display()));
            }
            Outcome::Done(Ok(Saved::Exists)) => self.existing = Some(path),
            Outcome::Done(Err(problem)) => self.problem = Some(problem),
            Outcome::Broken => {
                self.problem = Some("Writing the figure failed: this is a defect of flqr.".to_owned());
            }
        }
        None
    }
}

fn save(
    path: &Path,
    replace: bool,
    content: impl FnOnce(&mut dyn Write, Watch<'_>) -> io::Result<()>,
    reporter: &Reporter<Share>,
) -> Result<Saved, String> {
    if !replace && path.symlink_metadata().is_ok() {
        return Ok(Saved::Exists);
    }
    let written = write_file_with(path, |file| {
        let mut file = BufWriter::with_capacity(1 << 16, file);
        content(&mut file, &mut |share| reporter.progress(share))?;
        file.flush()
    });
    match written {
        Ok(()) => Ok(Saved::Written),
        Err(_) if reporter.is_cancelled() => Ok(Saved::Cancelled),
        Err(error) => Err(not_saved(path, &error)),
    }
}

/// Is told the share that is written, and may break off.
type Watch<'w> = &'w mut dyn FnMut(Share) -> ControlFlow<()>;

/// Rows between two reports of progress.
const WATCH_ROWS: usize = 8192;

/// One row for each time of any curve; a cell is empty where a curve has no sample then.
fn csv(
    x_key: &str,
    curves: &[(String, Snapshot)],
    sources: &[String],
    file: &mut dyn Write,
    watch: Watch<'_>,
) -> io::Result<()> {
    for source in sources {
        writeln!(file, "# {}", one_line(source))?;
    }
    let names = std::iter::once(x_key).chain(curves.iter().map(|(key, _)| key.as_str()));
    let mut log = LogWriter::new(file, names)?;
    let total: usize = curves.iter().map(|(_, curve)| curve.len()).sum();
    let mut next = vec![0; curves.len()];
    let mut row = Vec::with_capacity(curves.len() + 1);
    for number in 1_usize.. {
        let waiting =
            |(curve, next): (&(String, Snapshot), &usize)| (*next < curve.1.len()).then(|| curve.1.x(*next));
        let times = curves.iter().zip(&next).filter_map(waiting);
        let Some(time) = times.reduce(f64::min) else { break };
        row.clear();
        row.push(time);
        for ((_, curve), next) in curves.iter().zip(&mut next) {
            let has_sample = *next < curve.len() && curve.x(*next) == time;
            row.push(if has_sample { curve.y(*next) } else { f64::NAN });
            *next += usize::from(has_sample);
        }
        log.push(row.iter().copied())?;
        if number.is_multiple_of(WATCH_ROWS) {
            let share = next.iter().sum::<usize>() as f32 / total as f32;
            if watch(share).is_break() {
                return Err(io::Error::other("cancelled"));
            }
        }
    }
    log.finish()
}

/// A comment ends with its line.
fn one_line(text: &str) -> String {
    text.split(['\n', '\r']).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use flqr_core::record::{ColumnMap, ReadOptions, read_log};

    use super::*;

    use super::super::decimate::{Data, DecimationCache};

    fn snapshot(x: &[f64], y: &[f64]) -> Snapshot {
        DecimationCache::default().indexed(Data::Fixed(x, y), [1.0, 1.0], 1).snapshot(0..x.len())
    }

    fn text(curves: &[(String, Snapshot)], sources: &[&str]) -> String {
        let sources: Vec<String> = sources.iter().map(|source| (*source).to_owned()).collect();
        let mut text = Vec::new();
        csv("time_s", curves, &sources, &mut text, &mut |_| ControlFlow::Continue(())).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn an_exported_range_reads_back_equal() {
        let x: Vec<f64> = (0..500).map(|row| f64::from(row) * 1e-3 + 0.1).collect();
        let y = |factor: f64| x.iter().map(|x| (factor * x).sin() / 3.0).collect::<Vec<_>>();
        let columns = [("pitch_rad", y(3.0)), ("x_m", y(0.7))];
        let curves = columns.each_ref().map(|(key, y)| ((*key).to_owned(), snapshot(&x, y)));
        let text = text(&curves, &["run 3: flat, FLQR\nand more"]);
        assert!(text.starts_with("# run 3: flat, FLQR and more\ntime_s,pitch_rad,x_m\n"), "{}", &text[..80]);
        let map = ColumnMap::default();
        let watch = &mut |_: flqr_core::record::ReadProgress| ControlFlow::Continue(());
        let log = read_log(text.as_bytes(), "figure.csv", &ReadOptions::new(&map), watch).unwrap();
        assert_eq!((log.column("time_s"), log.problem_count), (Some(x.as_slice()), 0));
        for (key, y) in &columns {
            assert_eq!(log.column(key), Some(y.as_slice()));
        }
    }

    #[test]
    fn curves_of_different_times_share_rows_where_they_can() {
        let curves = [
            ("a".to_owned(), snapshot(&[0.0, 1.0, 2.0], &[1.0, 2.0, 3.0])),
            ("b".to_owned(), snapshot(&[1.0, 1.5], &[7.0, 8.0])),
        ];
        assert_eq!(text(&curves, &[]), "time_s,a,b\n0,1,\n1,2,7\n1.5,,8\n2,3,\n");
    }

    #[test]
    fn a_cancelled_export_leaves_no_file() {
        let x: Vec<f64> = (0..3 * WATCH_ROWS).map(|row| row as f64).collect();
        let curve = [("a".to_owned(), snapshot(&x, &x))];
        let path = std::env::temp_dir().join(format!("flqr-cancelled-{}.csv", std::process::id()));
        let shares = Arc::new(std::sync::Mutex::new(Vec::new()));
        let seen = Arc::clone(&shares);
        let written = write_file_with(&path, |file| {
            csv("time_s", &curve, &[], file, &mut |share| {
                seen.lock().unwrap().push(share);
                if share < 0.5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            })
        });
        assert!(written.is_err() && !path.exists());
        assert_eq!(*shares.lock().unwrap(), [1.0 / 3.0, 2.0 / 3.0]);
    }
}
