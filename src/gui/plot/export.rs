//! Saving what a stack of plots shows: the visible samples as a log, the figure as SVG or PNG.

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;

use egui::{Context, Id, Rect, Ui};
use flqr_core::record::LogWriter;
use flqr_core::report::Chart;

use super::decimate::Snapshot;
use crate::job::Waker;
use crate::picture::Shot;
use crate::save_form::{FileKind, Layout, SaveForm, Target, Words, with_ending};
use crate::widgets::{entry_ui, parse};
use crate::write_file::{Content, Watch, bytes};

/// Format of a saved figure.
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
        (Self::Csv, "CSV", "Samples of the visible range as a CSV log"),
        (Self::Svg, "SVG", "The visible range, drawn at this size"),
        (Self::Png, "PNG", "The plots as shown on the screen"),
    ];

    fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

/// Figure to save: its stack and its format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FigureFile {
    /// Name of the stack.
    pub stack: &'static str,
    /// Format.
    pub kind: FigureKind,
}

impl FigureFile {
    /// Name that the file dialog suggests.
    pub(crate) fn suggestion(self) -> String {
        format!("{}.{}", self.stack, self.kind.extension())
    }

    /// Passes the result of a dialog to the stack, which saves when it is drawn next.
    pub(crate) fn answer(self, ctx: &Context, answer: Result<PathBuf, String>) {
        ctx.data_mut(|data| data.insert_temp(answer_id(self.stack), Answer(Some((self.kind, answer)))));
        ctx.request_repaint();
    }
}

/// Storage of the dialog result of a stack.
fn answer_id(stack: &'static str) -> Id {
    Id::unique(("figure file", stack))
}

/// Dialog result for a figure.
#[derive(Clone, Default)]
struct Answer(Option<(FigureKind, Result<PathBuf, String>)>);

/// Figure as data, ready to be written in its format.
pub(super) enum Figure {
    Log { x_key: &'static str, curves: Vec<(String, Snapshot)>, sources: Vec<String> },
    Chart(Box<Chart>, [f64; 2]),
    Picture { sources: Vec<String> },
}

const WORDS: Words<FigureKind> = Words {
    path: ["figure path", "The file extension selects the format: .csv, .svg or .png"],
    save: |kind| match kind {
        FigureKind::Csv => "Save data",
        FigureKind::Svg => "Save figure",
        FigureKind::Png => "Save picture",
    },
};

/// Form that saves a figure.
pub(super) struct Export {
    pub(super) open: bool,
    form: SaveForm<FigureKind>,
    size_px: [f64; 2],
}

impl Default for Export {
    fn default() -> Self {
        Self { open: false, form: SaveForm::default(), size_px: [900.0, 600.0] }
    }
}

/// Requests of the form.
#[derive(Default)]
pub(super) struct ExportRequest {
    pub(super) save: Option<Target<FigureKind>>,
    pub(super) dialog: Option<FigureKind>,
}

impl Export {
    /// Size of an SVG, px.
    pub(super) fn size(&self) -> [f64; 2] {
        self.size_px
    }

    /// Opens the form for a kind.
    pub(super) fn open_as(&mut self, kind: FigureKind) {
        (self.open, self.form.kind) = (true, kind);
    }

    pub(super) fn ui(&mut self, ui: &mut Ui, stack: &'static str) -> ExportRequest {
        let id = answer_id(stack);
        let answer = ui.ctx().data_mut(|data| data.remove_temp::<Answer>(id)).and_then(|answer| answer.0);
        let mut request = ExportRequest::default();
        if let Some((kind, answer)) = answer {
            self.open_as(kind);
            match answer {
                // The dialog has asked before replacing a file, though not about an ending added here.
                Ok(path) => {
                    let replace = with_ending(path.clone(), kind) == path;
                    request.save = Some((kind, path, replace));
                }
                Err(problem) => (self.form.focus_path, self.form.problem) = (true, Some(problem)),
            }
        }
        if self.open {
            let size = &mut self.size_px;
            let more = |ui: &mut Ui, kind| {
                if kind == FigureKind::Svg {
                    size_ui(ui, size);
                }
            };
            let form = self.form.ui(&WORDS, Layout::Row("Export the visible range as"), more, ui);
            request.save = request.save.or(form.save);
            request.dialog = form.dialog;
        }
        request
    }

    /// Starts writing; the form shows errors.
    pub(super) fn start(
        &mut self,
        ctx: &Context,
        (kind, path, replace): Target<FigureKind>,
        figure: Figure,
        part: Rect,
    ) {
        let target = (kind, self.form.begin(kind, path), replace);
        let wake = ctx.clone();
        let waker: Waker = Arc::new(move || wake.request_repaint());
        let content: Content = match figure {
            Figure::Picture { sources } => {
                let begun = self.form.write_picture(target, sources, Shot::ask(ctx, part), &waker);
                return self.form.problem = begun.err();
            }
            Figure::Chart(chart, size) => bytes(chart.to_svg_of(size)),
            Figure::Log { x_key, curves, sources } => {
                Box::new(move |file, watch| csv(x_key, &curves, &sources, file, watch))
            }
        };
        let begun = self.form.write(target, |path| Ok(vec![(path.to_owned(), content)]), None, &waker);
        self.form.problem = begun.err();
    }

    /// Returns a sentence when a file was written or could not be.
    pub(super) fn drain(&mut self) -> Option<Result<String, String>> {
        self.form.drain()
    }
}

fn size_ui(ui: &mut Ui, size_px: &mut [f64; 2]) {
    for (side, [name, times]) in size_px.iter_mut().zip([["figure width", "×"], ["figure height", "px"]]) {
        entry_ui(ui, side, name, |field| field.range(200.0..=10_000.0).speed(5.0).custom_parser(parse))
            .on_hover_text(format!("The {name}, px"));
        ui.label(times);
    }
}

/// Rows between two reports of progress.
const WATCH_ROWS: usize = 8192;

/// Writes one row for each time of any curve; the cell of a curve without a sample is empty.
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

/// Joins lines, because a comment ends with its line.
fn one_line(text: &str) -> String {
    text.split(['\n', '\r']).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use flqr_core::record::{ColumnMap, ReadOptions, read_log};

    use super::*;

    use super::super::decimate::{Data, DecimationCache};
    use crate::write_file::{Written, write_files};

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
        let content: Content = Box::new(move |file, watch| csv("time_s", &curve, &[], file, watch));
        let mut shares = Vec::new();
        let written = write_files(vec![(path.clone(), content)], false, &mut |share| {
            shares.push(share);
            if share < 0.5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        assert!(matches!(written, Ok(Written::Cancelled)) && !path.exists());
        assert_eq!(shares, [1.0 / 3.0, 2.0 / 3.0]);
    }
}
