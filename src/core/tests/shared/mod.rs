//! Measured data and given examples in a folder next to the repository. Without the folder, tests that need it are skipped
//! and reported, and fail if `FLQR_REQUIRE_SHARED` is set.
//!
//! The unit tests of the core include this file too.

mod skip;

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
        skip::report_skipped(&format!("put {name} into the folder ../shared/data next to the checkout"));
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
