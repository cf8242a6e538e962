//! Hash of the inputs of a run.

use flqr_core::model::Model;
use flqr_core::record::Log;

/// Hash of a model's text and of logs' columns. Long logs take their time: made on the thread that reads them.
#[derive(Clone, Debug)]
pub(crate) struct Sources(String);

impl Sources {
    pub(crate) fn new<'a>(model: Option<&Model>, logs: impl IntoIterator<Item = &'a Log>) -> Self {
        let mut hash = Hash::new();
        if let Some(model) = model {
            hash.text(&model.to_toml());
        }
        logs.into_iter().for_each(|log| hash.log(log));
        Self(hash.hex())
    }

    pub(crate) fn hex(&self) -> &str {
        &self.0
    }
}

/// A 64-bit hash that is the same on all machines, and this program's own: it starts and multiplies as FNV-1a does, but
/// takes a word where that takes a byte, and folds the high half into the low one after each.
struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        // A word's high bits have to reach the low ones too.
        self.0 ^= self.0 >> 32;
    }

    fn text(&mut self, text: &str) {
        for byte in text.bytes() {
            self.word(byte.into());
        }
        self.word(0x100);
    }

    fn log(&mut self, log: &Log) {
        for column in &log.columns {
            self.text(&column.name);
            for value in &column.values {
                self.word(value.to_bits());
            }
        }
    }

    fn hex(&self) -> String {
        format!("{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use flqr_core::record::Column;

    use super::*;

    #[test]
    fn the_hash_knows_models_and_logs_apart_and_is_the_same_everywhere() {
        let log = |value: f64| {
            let mut log = Log::default();
            log.columns.push(Column { name: "time_s".to_owned(), values: vec![0.0, value] });
            log
        };
        let of = |value| Sources::new(None, [&log(value)]).0;
        assert_eq!(of(1.0), of(1.0));
        assert_ne!(of(1.0), of(1.0 + f64::EPSILON));
        assert_ne!(of(1.0), of(-1.0));
        // By another implementation; sessions and exported files hold such hashes, so that none may ever change.
        assert_eq!(of(1.0), "b7c01a24e3f70072");
        let mut text = Hash::new();
        text.text("m = 1 µm");
        assert_eq!(text.hex(), "0cc163d88e05338c");
        // FNV-1a's offset: nothing was hashed.
        assert_eq!(Sources::new(None, []).0, "cbf29ce484222325");
    }
}
