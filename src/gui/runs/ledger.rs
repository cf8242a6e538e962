//! All rows: their numbers, the curves that memory has room for, what is taken out and put back, and the session's
//! file.

use std::sync::Arc;

use serde::Deserialize;

use super::run::{Run, Series};

/// Values of all series that are kept; those of older runs go first.
const MOST_VALUES: usize = 16_000_000;

/// The largest number of a row that a file may have: what comes after it, for longer than anybody runs things, is still
/// read exactly by whatever reads the file as JSON.
const LARGEST_NUMBER: u64 = (1 << 53) - (1 << 32);

/// All rows; a part of the session's file. A copy shares them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ledger {
    /// The number given last.
    last: u64,
    rows: Vec<Arc<Run>>,
    /// Deleted rows, newest last; not saved.
    deleted: Vec<Vec<Run>>,
    /// The number given last when this window showed it first: runs after it are this window's. No file keeps it.
    opened_at: Option<u64>,
}

impl PartialEq for Ledger {
    fn eq(&self, other: &Self) -> bool {
        let same = |(row, other): (&Arc<Run>, &Arc<Run>)| Arc::ptr_eq(row, other) || row == other;
        self.last == other.last
            && self.rows.len() == other.rows.len()
            && self.rows.iter().zip(&other.rows).all(same)
    }
}

impl Ledger {
    /// Adds a row and gives it its number.
    pub(crate) fn add(&mut self, run: Run, unix_s: u64) -> u64 {
        self.last += 1;
        self.rows.push(Arc::new(Run { number: self.last, unix_s, ..run }));
        self.forget_old_series(self.last);
        self.last
    }

    /// Keeps the curves of `wanted`, however long, and those of the newest others that fit next to them.
    fn forget_old_series(&mut self, wanted: u64) {
        let size = |run: &Run| run.series.as_ref().map_or(0, |series| series.size());
        let mut kept = self.row(wanted).map_or(0, size);
        for run in self.rows.iter_mut().rev().filter(|run| run.number != wanted) {
            kept += size(run);
            if kept > MOST_VALUES && run.series.is_some() {
                Arc::make_mut(run).series = None;
            }
        }
    }

    /// Oldest first.
    pub(crate) fn rows(&self) -> &[Arc<Run>] {
        &self.rows
    }

    pub(crate) fn row(&self, number: u64) -> Option<&Run> {
        self.rows.iter().map(|run| &**run).find(|run| run.number == number)
    }

    pub(super) fn row_mut(&mut self, number: u64) -> Option<&mut Run> {
        self.rows.iter_mut().find(|run| run.number == number).map(Arc::make_mut)
    }

    /// The last two rows of one kind among those that are `wanted`, the older one first.
    pub(super) fn last_alike(&self, wanted: impl Fn(&Run) -> bool) -> Option<[u64; 2]> {
        let rows: Vec<&Run> = self.rows.iter().rev().map(|run| &**run).filter(|run| wanted(run)).collect();
        rows.iter().enumerate().find_map(|(index, new)| {
            let old = rows[index + 1..].iter().find(|old| old.kind == new.kind)?;
            Some([old.number, new.number])
        })
    }

    /// Contents in the session file.
    pub(crate) fn to_value(&self) -> serde_json::Value {
        let rows: Vec<&Run> = self.rows.iter().map(|run| &**run).collect();
        serde_json::json!({ "last": self.last, "rows": rows })
    }

    /// Reads what a session's file has kept, and a sentence about rows that cannot be read: they are left out.
    ///
    /// # Errors
    /// It is no ledger.
    pub(crate) fn from_value(value: &serde_json::Value) -> Result<(Self, Option<String>), String> {
        let kept = value.get("rows").and_then(serde_json::Value::as_array).ok_or("“runs” cannot be read")?;
        let read = kept.iter().filter_map(|row| Run::deserialize(row).ok());
        let mut rows: Vec<Run> = read.collect();
        rows.sort_by_key(|row| row.number);
        rows.dedup_by_key(|row| row.number);
        let missing = kept.len() - rows.len();
        let mut problem = (missing > 0).then(|| format!("“runs” has {missing} unreadable rows"));
        let last =
            value.get("last").and_then(serde_json::Value::as_u64).filter(|last| *last <= LARGEST_NUMBER);
        if rows.last().is_some_and(|row| row.number > LARGEST_NUMBER) {
            (1..).zip(&mut rows).for_each(|(number, row)| row.number = number);
            problem = Some("“runs” has invalid numbers: its rows were renumbered".to_owned());
        }
        let last = rows.last().map_or(0, |row| row.number).max(last.unwrap_or(0));
        let rows = rows.into_iter().map(Arc::new).collect();
        Ok((Self { last, rows, deleted: Vec::new(), opened_at: None }, problem))
    }

    /// Returns whether a row is the same run as one of `other`, whatever has been noted on it since.
    pub(super) fn has(&self, row: &Run) -> bool {
        self.row(row.number).is_some_and(|here| {
            (here.unix_s, &here.sources, &here.title) == (row.unix_s, &row.sources, &row.title)
        })
    }

    /// Number of rows that `other` does not have.
    pub(crate) fn missing_in(&self, other: &Self) -> usize {
        self.rows.iter().filter(|row| !other.has(row)).count()
    }

    /// Curves of a row that has been read again.
    pub(super) fn set_series(&mut self, number: u64, series: Series) {
        if let Some(run) = self.row_mut(number) {
            run.series = Some(Arc::new(series));
            self.forget_old_series(number);
        }
    }

    /// Rows that are in `before` too keep their curves.
    pub(super) fn take_series(&mut self, before: &Self) {
        for row in &mut self.rows {
            let here = before.row(row.number).filter(|_| before.has(row));
            if let Some(series) = here.and_then(|here| here.series.clone()) {
                Arc::make_mut(row).series = Some(series);
            }
        }
    }

    /// Is shown in place of `before`: what was run since both were opened comes along, whichever is undone, and no
    /// number is given again.
    pub(super) fn follow(&mut self, before: &mut Self) {
        let start = *before.opened_at.get_or_insert(0);
        self.last = self.last.max(before.last);
        let since = start.max(*self.opened_at.get_or_insert(self.last));
        let is_new = |row: &&Arc<Run>| row.number > since && self.row(row.number).is_none();
        let new: Vec<_> = before.rows.iter().filter(is_new).cloned().collect();
        self.rows.extend(new);
        self.rows.sort_by_key(|row| row.number);
    }

    /// Puts the rows of a file before its own, which get new numbers; gives how many those are.
    pub(super) fn begin_with(&mut self, earlier: Self) -> usize {
        let own = std::mem::replace(self, earlier);
        for row in &own.rows {
            self.last += 1;
            self.rows.push(Arc::new(Run { number: self.last, ..(**row).clone() }));
        }
        self.opened_at = Some(0);
        own.rows.len()
    }

    /// Takes rows out; gives the numbers of those that were there.
    pub(super) fn delete(&mut self, numbers: &[u64]) -> Vec<u64> {
        let is_meant = |row: &mut Arc<Run>| numbers.contains(&row.number);
        let deleted: Vec<Run> = self.rows.extract_if(.., is_meant).map(Arc::unwrap_or_clone).collect();
        let taken: Vec<u64> = deleted.iter().map(|row| row.number).collect();
        if !deleted.is_empty() {
            self.deleted.push(deleted);
        }
        taken
    }

    /// Puts what was taken out last back to where its numbers belong; gives these.
    pub(super) fn undo_delete(&mut self) -> Option<Vec<u64>> {
        let back = self.deleted.pop()?;
        let numbers: Vec<u64> = back.iter().map(|row| row.number).collect();
        self.rows.extend(back.into_iter().map(Arc::new));
        self.rows.sort_by_key(|row| row.number);
        self.forget_old_series(numbers.last().copied().unwrap_or(0));
        Some(numbers)
    }

    pub(super) fn has_deleted(&self) -> bool {
        !self.deleted.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use flqr_core::model_file::presets;

    use super::super::run::Value;
    use super::super::run::tests::run;
    use super::*;

    #[test]
    fn rows_have_numbers_that_are_never_given_twice_and_come_back_in_their_place() {
        let mut ledger = Ledger::default();
        for expected in 1..=3 {
            assert_eq!(ledger.add(run(0, &presets::paper()), 7), expected);
        }
        assert_eq!(ledger.delete(&[3, 9]), [3]);
        assert_eq!(ledger.delete(&[1, 2]), [1, 2]);
        assert!(ledger.delete(&[9]).is_empty());
        assert_eq!(ledger.add(run(0, &presets::paper()), 8), 4);
        assert_eq!(ledger.undo_delete().unwrap(), [1, 2]);
        assert_eq!(ledger.rows().iter().map(|run| run.number).collect::<Vec<_>>(), [1, 2, 4]);
        assert_eq!(ledger.undo_delete().unwrap(), [3]);
        assert_eq!(ledger.undo_delete(), None);
    }

    #[test]
    fn requested_curves_are_kept_and_others_make_room() {
        let mut ledger = Ledger::default();
        let long = |values: usize| Series { time_s: vec![0.0; values], channels: Vec::new() };
        for _ in 0..3 {
            ledger.add(run(0, &presets::paper()), 7);
        }
        let drawn =
            |ledger: &Ledger| ledger.rows().iter().map(|run| run.series.is_some()).collect::<Vec<_>>();
        ledger.set_series(1, long(10));
        ledger.set_series(3, long(20));
        assert_eq!(drawn(&ledger), [true, false, true]);
        ledger.set_series(1, long(MOST_VALUES + 1));
        assert_eq!(drawn(&ledger), [true, false, false]);
        ledger.set_series(2, long(30));
        assert_eq!(drawn(&ledger), [false, true, false]);
    }

    #[test]
    fn what_was_run_since_a_ledger_was_opened_outlives_its_undo_and_redo() {
        let numbers = |ledger: &Ledger| ledger.rows().iter().map(|run| run.number).collect::<Vec<_>>();
        let mut first = Ledger::default();
        for _ in 0..3 {
            first.add(run(0, &presets::paper()), 7);
        }
        let mut second = Ledger::default();
        second.add(run(0, &presets::paper()), 9);
        let value = second.to_value();
        let (mut second, _) = Ledger::from_value(&value).unwrap();
        second.follow(&mut first);
        assert_eq!(numbers(&second), [1], "opening replaces");
        assert_eq!(second.add(run(0, &presets::paper()), 10), 4, "3 was given in this window");
        let mut back = first.clone();
        back.follow(&mut second);
        assert_eq!(numbers(&back), [1, 2, 3, 4], "undo");
        assert_eq!(back.add(run(0, &presets::paper()), 11), 5);
        second.follow(&mut back);
        assert_eq!(numbers(&second), [1, 4, 5], "redo");
        let mut third = Ledger::default();
        third.follow(&mut second);
        assert_eq!(third.add(run(0, &presets::paper()), 12), 6);
        second.follow(&mut third);
        back.follow(&mut second);
        assert_eq!(numbers(&back), [1, 2, 3, 4, 5, 6], "two undone");
        assert_eq!(back.row(4).unwrap().unix_s, 10);
    }

    #[test]
    fn rows_of_a_file_that_was_read_late_come_before_those_of_now() {
        let mut earlier = Ledger::default();
        for _ in 0..2 {
            earlier.add(run(0, &presets::paper()), 7);
        }
        let mut now = Ledger::default();
        now.add(run(0, &presets::paper()), 8);
        assert_eq!(now.begin_with(earlier), 1);
        let rows: Vec<_> = now.rows().iter().map(|run| (run.number, run.unix_s)).collect();
        assert_eq!(rows, [(1, 7), (2, 7), (3, 8)]);
    }

    #[test]
    fn a_ledger_survives_its_file_without_the_series() {
        let mut ledger = Ledger::default();
        let series = Some(Arc::new(Series { time_s: vec![0.0], channels: Vec::new() }));
        ledger.add(Run { series, seed: Some(3), ..run(0, &presets::paper()) }, 1_700_000_000);
        let no_number = run(0, &presets::paper()).with("result.rmse", Value::Number(f64::NAN));
        ledger.add(no_number, 1_700_000_001);
        ledger.add(run(0, &presets::paper()), 1_700_000_002);
        assert_eq!(ledger.delete(&[3]), [3]);
        let value: serde_json::Value = serde_json::from_str(&ledger.to_value().to_string()).unwrap();
        let (mut read, problem) = Ledger::from_value(&value).unwrap();
        assert_eq!(problem, None);
        assert_eq!(*read.rows()[0], Run { series: None, ..(*ledger.rows()[0]).clone() });
        assert_eq!(read.rows()[1], ledger.rows()[1]);
        assert_eq!(value["rows"][0]["made_with"]["robot.body_mass_kg"], 13.0);
        assert_eq!(read.add(run(0, &presets::paper()), 8), 4, "3 was given");
        read.take_series(&ledger);
        assert!(read.rows()[0].series.is_some(), "rows that were here keep their curves");
        assert_eq!((read.missing_in(&ledger), ledger.missing_in(&read)), (1, 0));
    }

    #[test]
    fn a_row_that_cannot_be_read_is_said_and_the_others_are_used() {
        let mut ledger = Ledger::default();
        for _ in 0..3 {
            ledger.add(run(0, &presets::paper()), 7);
        }
        let mut value = ledger.to_value();
        value["rows"][1]["kind"] = "dance".into();
        value["last"] = "many".into();
        let (mut read, problem) = Ledger::from_value(&value).unwrap();
        assert_eq!(problem.as_deref(), Some("“runs” has 1 unreadable rows"));
        assert_eq!(read.rows().iter().map(|run| run.number).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(read.add(run(0, &presets::paper()), 8), 4);
        for no_ledger in [serde_json::json!([]), serde_json::json!({ "rows": 3 })] {
            assert!(Ledger::from_value(&no_ledger).is_err());
        }
    }

    #[test]
    fn no_number_of_a_file_is_so_large_that_runs_after_it_are_lost() {
        let mut ledger = Ledger::default();
        for _ in 0..2 {
            ledger.add(run(0, &presets::paper()), 7);
        }
        let end = 1_u64 << 53;
        for (last, numbers, read_as) in [
            (u64::MAX, [1, 2], [1, 2]),
            (end, [1, 2], [1, 2]),
            (0, [5, u64::MAX], [1, 2]),
            (end, [end, end - 1], [1, 2]),
            (end, [9, end], [1, 2]),
            (3, [9, end + 1], [1, 2]),
            (3, [9, LARGEST_NUMBER], [9, LARGEST_NUMBER]),
        ] {
            let mut value = ledger.to_value();
            value["last"] = last.into();
            for (row, number) in numbers.into_iter().enumerate() {
                value["rows"][row]["number"] = number.into();
            }
            let (mut read, problem) = Ledger::from_value(&value).unwrap();
            let found: Vec<u64> = read.rows().iter().map(|row| row.number).collect();
            assert_eq!(
                (&found[..], problem.is_some()),
                (&read_as[..], numbers != read_as),
                "{last} {numbers:?}"
            );
            let next = read.add(run(0, &presets::paper()), 8);
            assert!(next > found[1] && next < end, "{last} {numbers:?}: {next}");
            let (again, _) = Ledger::from_value(&read.to_value()).unwrap();
            assert_eq!(again.rows().len(), 3, "{last} {numbers:?}");
        }
    }
}
