//! Several files of a recording, merged by time into one MCAP file.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};
use std::ops::ControlFlow;
use std::time::Duration;

use serde::Serialize;

use super::topics;
use super::writer::McapWriter;
use crate::link::StampedFrame;
use crate::record::recording::{FrameLog, IMU_INTERFACE, imu_packet};
use crate::record::{ColumnMap, LogError, LogItem, LogRows};

/// A file to convert.
pub struct Input<'a, R> {
    /// Its name in messages.
    pub source: &'a str,
    /// Topic of columns that are not those of a robot log, such as `/bench`.
    pub topic: &'a str,
    /// Its text: a log (CSV) or raw frames (candump).
    pub reader: R,
}

/// Outcome of a conversion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Conversion {
    /// Number of messages on each topic.
    pub topics: BTreeMap<String, u32>,
    /// Rows and frames that were left out because they are damaged.
    pub dropped: u64,
    /// The first damage of each file, and where frames run back in time.
    pub problems: Vec<String>,
}

/// Reason why files could not be converted.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// One of the files cannot be read.
    #[error(transparent)]
    Read(#[from] LogError),
    /// Two files have the same columns.
    #[error("{first} and {second} both have `{topic}`: convert them separately")]
    SameTopic {
        /// The topic.
        topic: String,
        /// One file.
        first: String,
        /// The other file.
        second: String,
    },
    /// The caller said stop.
    #[error("the conversion was cancelled")]
    Cancelled,
    /// The output cannot be written.
    #[error("cannot write: {0}")]
    Write(#[from] io::Error),
}

/// Merges files of a recording into one MCAP file. `watch` is called now and then with the number of bytes read.
///
/// # Errors
/// [`ConvertError`].
pub fn convert<R: BufRead>(
    inputs: Vec<Input<'_, R>>,
    map: &ColumnMap,
    out: impl Write,
    watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
) -> Result<Conversion, ConvertError> {
    let mut tracks = inputs.into_iter().map(|input| Track::new(input, map)).collect::<Result<Vec<_>, _>>()?;
    refuse_same_topics(&tracks)?;
    let mut writer = McapWriter::new(out)?;
    for written in 0_u64.. {
        let bytes = || tracks.iter().map(Track::bytes).sum();
        if written.is_multiple_of(1 << 14) && watch(bytes()).is_break() {
            return Err(ConvertError::Cancelled);
        }
        // The first of equals, so that the order is always the same.
        let next = tracks.iter_mut().filter(|track| track.head.is_some()).min_by_key(|track| track.time());
        let Some(track) = next else { break };
        track.write(&mut writer)?;
        track.advance()?;
    }
    let dropped = tracks.iter().map(Track::dropped).sum();
    let problems = tracks.iter().flat_map(Track::problems).collect();
    Ok(Conversion { topics: writer.finish()?, dropped, problems })
}

/// One of the files, at the place to which it has been read.
struct Track<'a, R> {
    source: &'a str,
    reader: Reader<'a, R>,
    head: Option<(Duration, Head)>,
    /// Values of the row at the head.
    row: Vec<f64>,
    /// Time zero.
    start: Duration,
    topics: Vec<Topic>,
}

enum Reader<'a, R> {
    Log(Box<LogRows<'a, R>>),
    Frames(Box<FrameLog<'a, R>>),
}

enum Head {
    Row,
    Event(String),
    Frame(String, StampedFrame),
}

/// A topic of a log: its fields, and the columns they are from.
struct Topic {
    name: String,
    fields: Vec<String>,
    columns: Vec<usize>,
}

impl<'a, R: BufRead> Track<'a, R> {
    fn new(input: Input<'a, R>, map: &ColumnMap) -> Result<Self, LogError> {
        let Input { source, topic, mut reader } = input;
        // A reader that fails now will fail again below.
        let is_frames = reader.fill_buf().is_ok_and(|text| text.trim_ascii_start().starts_with(b"("));
        let mut track = Self {
            source,
            reader: if is_frames {
                Reader::Frames(Box::new(FrameLog::new(reader, source)))
            } else {
                Reader::Log(Box::new(LogRows::new(reader, source, map)?))
            },
            head: None,
            row: Vec::new(),
            start: Duration::ZERO,
            topics: Vec::new(),
        };
        if let Reader::Log(rows) = &track.reader {
            track.start = rows.start().unwrap_or_default();
            track.topics = topics_of(rows, topic);
        }
        track.advance()?;
        track.start_at_zero();
        Ok(track)
    }

    /// A log may begin before its own zero; an MCAP file cannot.
    fn start_at_zero(&mut self) {
        if let (Reader::Log(rows), Some((time, Head::Row))) = (&self.reader, &mut self.head) {
            let first_s = self.row[rows.time_column()];
            if self.start.is_zero() && first_s < 0.0 {
                self.start = seconds(-first_s);
                *time = Duration::ZERO;
            }
        }
    }

    fn advance(&mut self) -> Result<(), LogError> {
        self.head = match &mut self.reader {
            Reader::Frames(frames) => frames
                .next_frame()?
                .map(|(interface, frame)| (frame.time, Head::Frame(interface.to_owned(), frame))),
            Reader::Log(rows) => {
                let time = rows.time_column();
                match rows.next_item()? {
                    None => None,
                    Some(LogItem::Event(time, text)) => {
                        Some((self.start.saturating_add(time), Head::Event(text)))
                    }
                    Some(LogItem::Row(values)) => {
                        self.row.clear();
                        self.row.extend_from_slice(values);
                        Some((after(self.start, values[time]), Head::Row))
                    }
                }
            }
        };
        Ok(())
    }

    fn time(&self) -> Duration {
        self.head.as_ref().map_or(Duration::MAX, |(time, _)| *time)
    }

    fn write(&self, writer: &mut McapWriter<impl Write>) -> io::Result<()> {
        let Some((time, head)) = &self.head else { return Ok(()) };
        match head {
            Head::Event(text) => writer.event(*time, text),
            Head::Frame(interface, frame) if interface == IMU_INTERFACE => {
                imu_packet(&frame.frame).map_or(Ok(()), |packet| writer.packet(*time, &packet))
            }
            Head::Frame(interface, frame) => writer.frame(*time, interface, frame),
            Head::Row => self.topics.iter().try_for_each(|topic| {
                let values = topic.columns.iter().map(|&column| self.row[column]);
                writer.numbers(*time, &topic.name, &topic.fields, values)
            }),
        }
    }

    fn bytes(&self) -> u64 {
        match &self.reader {
            Reader::Log(rows) => rows.bytes(),
            Reader::Frames(frames) => frames.bytes(),
        }
    }

    fn dropped(&self) -> u64 {
        match &self.reader {
            Reader::Log(rows) => rows.dropped(),
            Reader::Frames(frames) => frames.damaged(),
        }
    }

    fn problems(&self) -> impl Iterator<Item = String> {
        let (damage, time) = match &self.reader {
            Reader::Log(rows) => (rows.problems().0.first(), None),
            Reader::Frames(frames) => (frames.first_problem(), frames.time_problem()),
        };
        damage.into_iter().chain(time).map(|problem| format!("{}: {problem}", self.source))
    }
}

/// The columns of a log but its time, by topic, in the order of their first column.
fn topics_of<R: BufRead>(rows: &LogRows<R>, rest: &str) -> Vec<Topic> {
    let mut found: Vec<(&str, Vec<&str>, Vec<usize>)> = Vec::new();
    for (index, column) in rows.columns().enumerate().filter(|(_, column)| *column != "time_s") {
        let (name, field) = topics::of_column(column, rest);
        let topic = match found.iter().position(|topic| topic.0 == name) {
            Some(topic) => topic,
            None => {
                found.push((name, Vec::new(), Vec::new()));
                found.len() - 1
            }
        };
        found[topic].1.push(field);
        found[topic].2.push(index);
    }
    let topic = |(name, fields, columns): (&str, Vec<&str>, Vec<usize>)| {
        let fields = topics::field_names(fields.into_iter());
        Topic { name: name.to_owned(), fields, columns }
    };
    found.into_iter().map(topic).collect()
}

fn refuse_same_topics<R>(tracks: &[Track<R>]) -> Result<(), ConvertError> {
    let mut seen: BTreeMap<&str, &str> = BTreeMap::new();
    for track in tracks {
        for topic in &track.topics {
            if let Some(first) = seen.insert(&topic.name, track.source) {
                let (first, second) = (first.to_owned(), track.source.to_owned());
                return Err(ConvertError::SameTopic { topic: topic.name.clone(), first, second });
            }
        }
    }
    Ok(())
}

/// A time of a log; what is before 1970 counts as its beginning.
fn after(start: Duration, time_s: f64) -> Duration {
    if time_s < 0.0 { start.saturating_sub(seconds(-time_s)) } else { start.saturating_add(seconds(time_s)) }
}

/// To the nanosecond; what no clock shows is the end of time.
fn seconds(time_s: f64) -> Duration {
    Duration::try_from_secs_f64(time_s).unwrap_or(Duration::from_nanos(u64::MAX))
}
