//! Measured data and given examples, which lie beside the repository: tests read them where they are at hand, and fail
//! without them only where `FLQR_REQUIRE_SHARED` is set.
//!
//! The core's own tests take this file in too.

use std::fs::File;
use std::io::{BufReader, Read};
use std::ops::ControlFlow;

use flqr_core::record::{ColumnMap, Log, ReadOptions, read_log};

#[expect(clippy::disallowed_methods, reason = "the one place where tests of the core open a file")]
fn open(name: &str) -> Option<File> {
    let path = format!("{}/../../../shared/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let file = File::open(&path);
    if file.is_err() {
        assert!(std::env::var_os("FLQR_REQUIRE_SHARED").is_none(), "{path} is absent");
        println!("skipped: {path} is absent");
    }
    file.ok()
}

/// A text, or nothing where the data are absent.
pub(crate) fn shared_text(name: &str) -> Option<String> {
    let mut text = String::new();
    open(name)?.read_to_string(&mut text).unwrap();
    Some(text)
}

/// A log read through a map of its columns, or nothing where the data are absent.
pub(crate) fn shared_log(name: &str, map: &[&str]) -> Option<Log> {
    let reader = BufReader::new(open(name)?);
    let map = ColumnMap::new(map.iter().map(|entry| entry.parse().unwrap()).collect()).unwrap();
    Some(read_log(reader, name, &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(())).unwrap())
}
