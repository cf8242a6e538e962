//! Topics and message types of an MCAP file.

use std::collections::{BTreeMap, BTreeSet};

use super::protobuf::{File, Kind, MessageType, descriptor_set};
use crate::link::jy901::{Packet, Reading};
use crate::record::schema;

/// A message type as a channel names it.
pub(super) struct Schema {
    pub(super) name: String,
    pub(super) descriptors: Vec<u8>,
}

/// Numbers under their names.
pub(super) fn numbers(name: &str, fields: &[String]) -> Schema {
    let fields: Vec<(&str, Kind)> = fields.iter().map(|field| (field.as_str(), Kind::Double)).collect();
    plain(name, &fields)
}

/// A CAN frame.
pub(super) fn frame() -> Schema {
    let flags = ["extended", "remote", "error", "sent"].map(|name| (name, Kind::Bool));
    let [extended, remote, error, sent] = flags;
    plain(
        "Frame",
        &[("id", Kind::Uint), extended, remote, error, sent, ("length", Kind::Uint), ("data", Kind::Bytes)],
    )
}

fn plain(name: &str, fields: &[(&str, Kind)]) -> Schema {
    let message = MessageType { name, fields, values: None };
    let file = File { name: "flqr.proto", package: "flqr", imports: &[], message };
    Schema { name: format!("flqr.{name}"), descriptors: descriptor_set(&[file]) }
}

/// Foxglove's own message for lines of text, which its Log panel shows.
pub(super) fn log() -> Schema {
    const TIMESTAMP: &str = "google/protobuf/timestamp.proto";
    let seconds = [("seconds", Kind::Int64), ("nanos", Kind::Int32)];
    let timestamp = File {
        name: TIMESTAMP,
        package: "google.protobuf",
        imports: &[],
        message: MessageType { name: "Timestamp", fields: &seconds, values: None },
    };
    let fields = [
        ("timestamp", Kind::Message(".google.protobuf.Timestamp")),
        ("level", Kind::Enum(".foxglove.Log.Level")),
        ("message", Kind::Text),
        ("name", Kind::Text),
        ("file", Kind::Text),
        ("line", Kind::Fixed32),
    ];
    let levels = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let message = MessageType { name: "Log", fields: &fields, values: Some(("Level", &levels)) };
    let log = File { name: "foxglove/Log.proto", package: "foxglove", imports: &[TIMESTAMP], message };
    Schema { name: "foxglove.Log".to_owned(), descriptors: descriptor_set(&[timestamp, log]) }
}

/// Topic and field of a log's column; columns of no robot log go to the topic `rest`.
pub(super) fn of_column<'a>(column: &'a str, rest: &'a str) -> (&'a str, &'a str) {
    schema::topic(column).unwrap_or((rest, column))
}

/// Name of the message type of a topic, such as `MotorsLeft`.
pub(super) fn type_name(topic: &str) -> String {
    let words = topic.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(|word| word[..1].to_ascii_uppercase() + &word[1..]).collect()
}

/// Names of columns as names of fields: letters, digits and underscores, each once.
pub(super) fn field_names<'a>(columns: impl Iterator<Item = &'a str>) -> Vec<String> {
    let (mut names, mut taken) = (Vec::new(), BTreeSet::new());
    let mut repeated: BTreeMap<String, usize> = BTreeMap::new();
    for column in columns {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut name: String = column.chars().map(plain).collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
            name.insert_str(0, "column_");
        }
        if taken.contains(&name) {
            // Counted, so that many columns of one name do not take the longer the more there are.
            let count = repeated.entry(name.clone()).or_insert(1);
            name = loop {
                *count += 1;
                let numbered = format!("{name}_{count}");
                if !taken.contains(&numbered) {
                    break numbered;
                }
            };
        }
        taken.insert(name.clone());
        names.push(name);
    }
    names
}

/// Topic, fields and values of a packet of the IMU; none of packets that are not measurements.
pub(super) fn of_packet(packet: &Packet) -> Option<(&'static str, &'static [&'static str], [f64; 4])> {
    let with = |[x, y, z]: [f64; 3], last| [x, y, z, last];
    Some(match packet.reading() {
        Reading::Acceleration { acceleration_g, temperature_c } => (
            "/imu/acceleration",
            &["x_g", "y_g", "z_g", "temperature_c"],
            with(acceleration_g, temperature_c),
        ),
        Reading::Rate { rate_rad_s, temperature_c } => (
            "/imu/rate",
            &["x_rad_s", "y_rad_s", "z_rad_s", "temperature_c"],
            with(rate_rad_s, temperature_c),
        ),
        // The last word is the firmware's version.
        Reading::Angle { angle_rad, .. } => {
            ("/imu/angle", &["roll_rad", "pitch_rad", "yaw_rad"], with(angle_rad, f64::NAN))
        }
        Reading::MagneticField { field, temperature_c } => (
            "/imu/magnetic_field",
            &["x", "y", "z", "temperature_c"],
            with(field.map(f64::from), temperature_c),
        ),
        Reading::Quaternion(quaternion) => ("/imu/quaternion", &["w", "x", "y", "z"], quaternion),
        Reading::Time { .. } | Reading::Registers(_) | Reading::Words { .. } => return None,
    })
}
