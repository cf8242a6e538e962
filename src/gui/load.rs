//! Loading logs on worker threads, for every page that takes one.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use flqr_core::record::{
    self, ColumnMap, HealthFinding, Log, LogKind, ReadOptions, data_health, read_log, row_time_s,
};

use crate::job::{Job, Outcome, Reporter, Waker};
use crate::messages::{Said, Severity};
use crate::runs::Sources;
use crate::widgets::shown;

/// A log in memory with what the page says about it.
pub(crate) struct LoadedLog {
    pub(crate) log: Arc<Log>,
    pub(crate) path: PathBuf,
    /// Kind of log, or the reason why it cannot be fitted.
    pub(crate) kind: Result<LogKind, String>,
    pub(crate) health: Vec<HealthFinding>,
    /// Horizontal axis of the preview: time where it is usable, else row numbers.
    pub(crate) axis: Axis,
    /// Rows a second, where there is a time.
    pub(crate) rate_hz: Option<f64>,
    /// Hash of its columns, as in the ledger.
    pub(crate) sources: Sources,
    /// Distinguishes logs, for the plot's cache.
    pub(crate) generation: u64,
}

/// Horizontal values for the preview.
pub(crate) struct Axis {
    /// Numbers of the rows, where the log has no time that can be an axis.
    rows: Option<Vec<f64>>,
    pub(crate) label: &'static str,
    /// A larger step is a gap.
    pub(crate) gap: f64,
}

/// Progress of loading.
#[derive(Clone, Copy)]
pub(crate) struct LoadProgress {
    pub(crate) bytes: u64,
    pub(crate) total_bytes: u64,
    pub(crate) rows: u64,
}

type LoadResult = Result<Box<LoadedLog>, String>;

/// The log in memory and the one that is being loaded.
#[derive(Default)]
pub(crate) struct Loader {
    job: Option<Job<LoadProgress, LoadResult>>,
    pub(crate) progress: Option<LoadProgress>,
    pub(crate) problem: Option<String>,
    log: Option<Box<LoadedLog>>,
    generation: u64,
    started: Option<Instant>,
    /// Loading time of the last log.
    took: Option<Duration>,
}

impl Loader {
    pub(crate) fn log(&self) -> Option<&LoadedLog> {
        self.log.as_deref()
    }

    /// Holds a log that no file has.
    pub(crate) fn holding(log: LoadedLog) -> Self {
        Self { log: Some(Box::new(log)), ..Self::default() }
    }

    pub(crate) fn is_running(&self) -> bool {
        self.job.is_some()
    }

    pub(crate) fn start(&mut self, path: &Path, map: ColumnMap, waker: &Waker) -> Result<(), String> {
        self.generation += 1;
        let (path, generation) = (path.to_owned(), self.generation);
        let job = Job::start("load-log", waker, move |reporter| load(&path, &map, generation, reporter))
            .map_err(|error| format!("Cannot start loading the log: {error}."))?;
        self.job = Some(job);
        self.started = Some(Instant::now());
        self.progress = None;
        self.problem = None;
        Ok(())
    }

    pub(crate) fn cancel(&self) {
        if let Some(job) = &self.job {
            job.cancel();
        }
    }

    /// The log of before stays until another one is complete.
    /// `place` is where the health of a log is seen.
    pub(crate) fn drain(&mut self, place: &str) -> Option<Said> {
        let (progress, outcome) = self.job.as_mut()?.poll();
        self.progress = progress.last().copied().or(self.progress);
        let result = match outcome {
            Outcome::Running => return None,
            Outcome::Done(result) => result,
            Outcome::Broken => Err("Loading failed: this is an internal error.".to_owned()),
        };
        self.job = None;
        self.took = self.started.map(|started| started.elapsed());
        self.progress = None;
        Some(match result {
            Ok(loaded) => {
                let said = loaded.sentence(place);
                self.log = Some(loaded);
                said
            }
            Err(problem) => {
                self.problem = Some(problem.clone());
                (Severity::Error, problem)
            }
        })
    }

    pub(crate) fn snapshot(&self) -> serde_json::Value {
        serde_json::json!({
            "loading": self.is_running(),
            "problem": self.problem,
            "path": self.log().map(|loaded| loaded.path.display().to_string()),
            "rows": self.log().map(|loaded| loaded.log.rows()),
            "seconds": self.took.map(|took| took.as_secs_f64()),
            "kind": self.log().and_then(|loaded| loaded.kind.as_ref().ok()),
            "health": self.log().map(|loaded| &loaded.health),
        })
    }
}

/// Reads a log as every page does. May take its time.
pub(crate) fn load(
    path: &Path,
    map: &ColumnMap,
    generation: u64,
    reporter: &Reporter<LoadProgress>,
) -> LoadResult {
    let source = path.display().to_string();
    let unopened = |error: std::io::Error| format!("{source} could not be opened: {error}; check the path");
    let file = File::open(path).map_err(unopened)?;
    let metadata = file.metadata().map_err(unopened)?;
    if metadata.is_dir() {
        return Err(format!("{source} is a folder; choose the CSV file in it"));
    }
    let total_bytes = metadata.len();
    let mut watch = |progress: flqr_core::record::ReadProgress| {
        let rows = progress.rows as u64;
        reporter.progress(LoadProgress { bytes: progress.bytes, total_bytes, rows })
    };
    let reader = BufReader::with_capacity(1 << 16, file);
    let log =
        read_log(reader, &source, &ReadOptions::new(map), &mut watch).map_err(|error| error.to_string())?;
    if let Some(why) = no_log(&log) {
        return Err(format!(
            "{source} is not a log: {why}; choose a CSV file with a header line and rows of numbers"
        ));
    }
    Ok(Box::new(LoadedLog::new(log, path, generation)))
}

/// Reason why a file is not a log. A table of unknown columns is one: a column map can name them.
fn no_log(log: &Log) -> Option<String> {
    let Err(missing) = log.kind() else { return None };
    let (rows, dropped) = (log.rows(), log.dropped_rows);
    let cells = log.columns.iter().flat_map(|column| &column.values);
    let (count, numbers) =
        cells.fold((0, 0), |(count, numbers), value| (count + 1, numbers + usize::from(value.is_finite())));
    match () {
        () if rows == 0 => Some("it has no row of numbers".to_owned()),
        () if dropped > rows => {
            Some(format!("{dropped} of its {} lines are not rows of numbers", rows + dropped))
        }
        () if 2 * numbers < count => Some(format!("{numbers} of its {count} cells are numbers")),
        () if log.columns.len() < 2 => Some(missing.to_string()),
        () => None,
    }
}

impl LoadedLog {
    fn new(log: Log, path: &Path, generation: u64) -> Self {
        Self {
            kind: log.kind().map_err(|error| error.to_string()),
            axis: axis(&log),
            rate_hz: rate_hz(&log),
            health: data_health(&log),
            sources: Sources::new(None, [&log]),
            log: Arc::new(log),
            path: path.to_owned(),
            generation,
        }
    }

    /// Horizontal values for the preview, as many as rows.
    pub(crate) fn axis_values(&self) -> &[f64] {
        self.axis.rows.as_deref().or_else(|| self.log.column("time_s")).unwrap_or_default()
    }

    /// That it is loaded, and how much is wrong with it.
    fn sentence(&self, place: &str) -> Said {
        let (rows, path) = (self.log.rows(), self.path.display());
        let count = self.health.iter().filter(|finding| finding.severity > record::Severity::Info).count();
        if count == 0 {
            return (Severity::Note, format!("{rows} rows loaded from {path}."));
        }
        let findings = if count == 1 { "finding" } else { "findings" };
        let text =
            format!("{rows} rows loaded from {path} with {count} data-health {findings}, see {place}.");
        (Severity::Warning, text)
    }

    /// Kind and size, in a line.
    pub(crate) fn summary(&self) -> String {
        let kind = match &self.kind {
            Ok(LogKind::Bench) => "bench log of one motor",
            Ok(LogKind::LinearAxis) => "log of a linear axis",
            Ok(LogKind::Robot) => "robot log",
            Ok(LogKind::FrictionPairs) => "friction pairs",
            Err(_) => "unknown kind",
        };
        let rate = self.rate_hz.map(|rate| format!(", {} Hz", shown(rate, 4))).unwrap_or_default();
        format!("{kind}: {} rows, {} columns{rate}", self.log.rows(), self.log.columns.len())
    }

    /// A log that was made in this program.
    pub(crate) fn made(log: Log) -> Self {
        let path = PathBuf::from(&log.source);
        Self::new(log, &path, 0)
    }
}

fn axis(log: &Log) -> Axis {
    let usable = |time: &&[f64]| {
        time.iter().all(|value| value.is_finite()) && time.windows(2).all(|pair| pair[0] <= pair[1])
    };
    match log.column("time_s").filter(usable) {
        Some(time) => Axis { rows: None, label: "time [s]", gap: 10.0 * row_time_s(time).unwrap_or(1.0) },
        None => {
            let rows = (0..log.rows()).map(|row| row as f64).collect();
            Axis { rows: Some(rows), label: "row", gap: f64::INFINITY }
        }
    }
}

fn rate_hz(log: &Log) -> Option<f64> {
    row_time_s(log.column("time_s")?).map(f64::recip)
}
