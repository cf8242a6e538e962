use super::*;
use crate::record::{LogKind, is_written_log, write_log};

fn read(text: impl AsRef<[u8]>, map: &[&str]) -> Result<Log, LogError> {
    let entries = map.iter().map(|entry| entry.parse().unwrap()).collect();
    let map = ColumnMap::new(entries).unwrap();
    read_log(text.as_ref(), "run.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()))
}

const PLAIN: &str = "time_s,motor_angle_rad,torque_nm\n0,0.5,1\n0.001,0.6,-2\n";

#[test]
fn dialects_of_one_log_read_alike() {
    let plain = read(PLAIN, &[]).unwrap();
    assert_eq!(plain.kind(), Ok(LogKind::Bench));
    assert_eq!(plain.column("torque_nm"), Some(&[1.0, -2.0][..]));
    for text in [
        PLAIN.replace('\n', "\r\n"),
        format!("\u{feff}{PLAIN}"),
        format!("\u{feff}# a comment, with \"one quote\n\n{PLAIN}\n  # end\n"),
        PLAIN.replace(',', ";"),
        PLAIN.replace(',', "\t"),
        PLAIN.replace(',', " , "),
        PLAIN.replace("time_s", "\"time_s\"").replace("0.6", "\"0.6\""),
        PLAIN.replace("-2\n", "-2"),
        PLAIN.replace("0.6", "+6e-1").replace("0.5", ".5"),
        // Some recorders end every row with a comma.
        PLAIN.replace("1\n", "1,\n"),
    ] {
        let log = read(&text, &[]).unwrap();
        assert_eq!((&log.columns, log.problem_count), (&plain.columns, 0), "{text:?}");
    }
}

#[test]
fn columns_in_any_order_beside_unknown_ones() {
    let log = read("note,torque_nm,time_s,,motor_angle_rad\nidle,1,0,7,2\n\"a,b\",3,1,,4\n", &[]).unwrap();
    assert_eq!(log.kind(), Ok(LogKind::Bench));
    assert_eq!(log.column("motor_angle_rad"), Some(&[2.0, 4.0][..]));
    assert!(log.column("note").unwrap().iter().all(|value| value.is_nan()));
    assert_eq!((log.column("").unwrap()[0], log.problem_count, log.dropped_rows), (7.0, 0, 0));
}

#[test]
fn kinds_are_recognised() {
    use crate::record::schema;
    for (columns, kind) in [
        (schema::BENCH.join(","), LogKind::Bench),
        (schema::LINEAR_AXIS.join(","), LogKind::LinearAxis),
        (schema::ROBOT.join(","), LogKind::Robot),
        (schema::FRICTION_PAIRS.join(","), LogKind::FrictionPairs),
        (schema::BENCH.join(",") + ",speed_rad_s", LogKind::Bench),
        (schema::ROBOT.join(",") + ",motor_angle_rad,torque_nm", LogKind::Robot),
    ] {
        let cells = columns.split(',').count();
        let row = vec!["1"; cells].join(",");
        let log = read(format!("{columns}\n{row}\n"), &[]).unwrap();
        assert_eq!(log.kind(), Ok(kind), "{columns}");
        assert!(log.serves(kind));
    }
    let half = read("speed_rad_s,torque\n1,2\n", &[]).unwrap().kind().unwrap_err().to_string();
    assert_eq!(
        half,
        "run.csv: a file of friction pairs needs `torque_nm`, but the file has `speed_rad_s`, `torque`: map its column with --map torque_nm=torque"
    );
    // Samples of a motion are not pairs.
    let motion = read("time_s,speed_rad_s,torque_nm,angle_rad\n0,1,2,3\n", &[]).unwrap();
    assert_eq!(
        motion.kind().unwrap_err().to_string(),
        "run.csv: a bench log needs `motor_angle_rad`, but the file has `time_s`, `speed_rad_s`, `torque_nm`, \
         `angle_rad`: map its column with --map motor_angle_rad=angle_rad"
    );
}

#[test]
fn the_suggested_map_takes_measured_columns_for_all_that_miss() {
    for (header, expected) in [
        ("time_s,angle_goal_rad,angle_rad,torque_nm", "--map motor_angle_rad=angle_rad"),
        ("time_s,angle_rad,angle_goal_rad,torque_nm", "--map motor_angle_rad=angle_rad"),
        ("time_s,motor_angle_ref_rad,q_rad,torque_nm", "--map motor_angle_rad=q_rad"),
        ("time_s,angle_goal_rad,torque_nm", "--map motor_angle_rad=angle_goal_rad"),
        ("time_s,angle_goal_rad,angle_rad,tau_nm", "--map motor_angle_rad=angle_rad --map torque_nm=tau_nm"),
        ("time_s,angle_rad,current_a", "--map motor_angle_rad=angle_rad --map torque_nm=COLUMN"),
        ("time_s,wheel_speed_rad_s,torque_nm", "--map motor_angle_rad=COLUMN"),
        (
            "time_s,x_m,pitch_rad,pitch_rate,torque_left,torque_right",
            "--map pitch_rate_rad_s=pitch_rate --map torque_left_nm=torque_left --map torque_right_nm=torque_right",
        ),
    ] {
        let row = vec!["1"; header.split(',').count()].join(",");
        let message = read(format!("{header}\n{row}\n"), &[]).unwrap().kind().unwrap_err().to_string();
        assert!(message.ends_with(expected), "{header}: {message}");
    }
}

#[test]
fn a_map_reads_the_columns_of_the_file() {
    let text = "time_s,angle,torque_nm,current_a\n0,10,1,5\n1,20,2,6\n";
    let map = ["motor_angle_rad=angle*0.1", "torque_nm=torque_nm*6"];
    let log = read(text, &map).unwrap();
    assert_eq!(log.column("torque_nm"), Some(&[6.0, 12.0][..]));
    assert_eq!(log.column("motor_angle_rad"), Some(&[1.0, 2.0][..]));
    assert_eq!(log.column("angle"), Some(&[10.0, 20.0][..]));
    assert_eq!(log.columns.iter().filter(|column| column.name == "torque_nm").count(), 1);
    // Another column in place of an own one, and two of ours from one of theirs.
    let log = read(text, &["torque_nm=current_a", "motor_angle_rad=current_a*2"]).unwrap();
    assert_eq!(log.column("torque_nm"), Some(&[5.0, 6.0][..]));
    assert_eq!(log.column("motor_angle_rad"), Some(&[10.0, 12.0][..]));
    // The time may be mapped too, and a bad cell is told by the file's name for it.
    let log = read(
        "t_ms,angle,torque_nm\n0,1,2\nx,1,2\n1,1,2\n2,1,2\n",
        &["time_s=t_ms*0.001", "motor_angle_rad=angle"],
    );
    let log = log.unwrap();
    assert_eq!(log.column("time_s"), Some(&[0.0, 0.001, 0.002][..]));
    assert_eq!(
        log.problems[0].to_string(),
        "line 3, column `t_ms`: `x` is not a number, the row was skipped"
    );
}

/// Required columns stay finite whatever the factor.
#[test]
fn a_factor_that_overflows_a_value_drops_the_row() {
    let text = "time_s,motor_angle_rad,torque_nm,current_a,celsius\n\
                0,1,2,1,1\n1,1,2,1e25,1\n2,1,2,1,1e25\n3,1,2,1,1\n4,1,2,1,1\n";
    let log = read(text, &["torque_nm=current_a*1e10", "motor_temperature_c=celsius*1e10"]).unwrap();
    assert_eq!(log.column("torque_nm"), Some(&[1e10; 4][..]));
    let temperature = log.column("motor_temperature_c").unwrap();
    assert!(temperature[1].is_nan() && temperature[0] == 1e10, "{temperature:?}");
    assert_eq!((log.dropped_rows, log.problem_count), (1, 2));
    assert_eq!(
        log.problems[0].to_string(),
        "line 3, column `current_a`: 1e25 times 1e10 is too large for a measurement, the row was skipped"
    );
    assert!(log.problems[1].to_string().ends_with("the value is left out"), "{}", log.problems[1]);
}

/// Isolated damage: the log is read, the damage is listed.
#[test]
fn isolated_damage_becomes_a_problem_with_line_and_column() {
    let good = |count: u32, from: u32| -> String {
        (from..from + count).map(|row| format!("0.{row:03},0.5,1,20\n")).collect()
    };
    let (header, before) = ("# made\ntime_s,motor_angle_rad,torque_nm,motor_temperature_c\n", good(10, 0));
    for (damaged, dropped, expected) in [
        (
            "0.010,abc,1,20",
            1,
            "line 13, column `motor_angle_rad`: `abc` is not a number, the row was skipped",
        ),
        ("0.010,,1,20", 1, "line 13, column `motor_angle_rad`: the cell is empty, the row was skipped"),
        (
            "0.010,0.5,NaN,20",
            1,
            "line 13, column `torque_nm`: `NaN` is not a finite number, the row was skipped",
        ),
        (
            "0.010,0.5,-inf,20",
            1,
            "line 13, column `torque_nm`: `-inf` is not a finite number, the row was skipped",
        ),
        (
            "0.010,0.5,1e999,20",
            1,
            "line 13, column `torque_nm`: `1e999` is not a finite number, the row was skipped",
        ),
        (
            "0.010,0.5,\"1,5\",20",
            1,
            "line 13, column `torque_nm`: `1,5` has a decimal comma instead of a point, the row was skipped",
        ),
        (
            "0.010,0.5,\u{0}\u{1},20",
            1,
            "line 13, column `torque_nm`: `\u{0}\u{1}` is not a number, the row was skipped",
        ),
        ("0.010,0.5", 1, "line 13: the row has 2 cells, but the header has 4; it was skipped"),
        ("0.010,0.5,1,20,7", 1, "line 13: the row has 5 cells, but the header has 4; it was skipped"),
        (
            "time_s,motor_angle_rad,torque_nm,motor_temperature_c",
            1,
            "line 13, column `time_s`: `time_s` is not a number, the row was skipped",
        ),
        (
            "0.004,0.5,1,20",
            1,
            "line 13, column `time_s`: 0.004 s is not between the times around it; the row was skipped",
        ),
        (
            "0.009,0.5,1,20",
            1,
            "line 12, column `time_s`: 0.009 s is not between the times around it; the row was skipped",
        ),
        (
            "99,0.5,1,20",
            1,
            "line 13, column `time_s`: 99 s is not between the times around it; the row was skipped",
        ),
        (
            "0.010,0.5,1,hot",
            0,
            "line 13, column `motor_temperature_c`: `hot` is not a number, the value is left out",
        ),
        (
            "0.010,0.5,1,inf",
            0,
            "line 13, column `motor_temperature_c`: `inf` is not a finite number, the value is left out",
        ),
    ] {
        let log = read(format!("{header}{before}{damaged}\n{}", good(10, 11)), &[]).unwrap();
        assert_eq!(log.problems.iter().map(ToString::to_string).next().as_deref(), Some(expected));
        assert_eq!((log.dropped_rows, log.rows()), (dropped, 21 - dropped), "{damaged}");
        assert!(log.column("torque_nm").unwrap().iter().all(|value| value.is_finite()), "{damaged}");
    }
    let late = read(format!("{header}{before}0.004,0.5,1,20\n{}", good(10, 11)), &[]).unwrap();
    assert_eq!((late.line(9), late.line(10), late.line(19)), (Some(12), Some(14), Some(23)));
    // A slow sensor leaves cells empty between its values: no problem.
    let log = read(format!("{header}{before}0.010,0.5,1,\n0.011,0.5,1,nan\n"), &[]).unwrap();
    assert_eq!((log.problem_count, log.rows()), (0, 12));
}

#[test]
fn files_that_are_no_logs_are_refused_with_place_and_mend() {
    let rows = |row: &str, count: usize| format!("time_s,motor_angle_rad,torque_nm\n{}", row.repeat(count));
    let restart: String = (0..20).map(|row| format!("{},1,2\n", row % 10)).collect();
    for (text, expected) in [
        (
            String::new(),
            "run.csv is empty: a log needs a header line such as time_s,motor_angle_rad,torque_nm",
        ),
        ("\n# only a comment\n\n".into(), "run.csv is empty: "),
        ("time_s,torque_nm\n".into(), "run.csv:1: there is a header but no row of numbers below it"),
        ("# c\n\ntime_s,torque_nm".into(), "run.csv:3: there is a header but no row"),
        ("0,1,2\n1,2,3\n".into(), "run.csv:1: the first row contains numbers instead of column names"),
        (
            "\u{1f}\u{8b}\u{8}zipped\rinside".into(),
            "run.csv:1 is not CSV text (it has bytes of a binary or compressed",
        ),
        (
            "time_s,a\r0,1\r".into(),
            "run.csv:1 is not CSV text (its lines end in bare carriage returns): export",
        ),
        (
            "time_s,torque_nm,torque_nm\n0,1,2\n".into(),
            "run.csv:1: two columns are named `torque_nm`: rename one",
        ),
        (
            rows("0.1,x,2\n", 9),
            "run.csv: 9 of 9 rows cannot be used, the first at line 2, column `motor_angle_rad`: `x`",
        ),
        (rows("0.1,2\n", 9), "run.csv: 9 of 9 rows cannot be used, the first at line 2: the row has 2 cells"),
        (
            rows("0.1,x,2\n", 2),
            "run.csv: 2 of 2 rows cannot be used, the first at line 2, column `motor_angle_rad`: `x` is not a number, the \
             row was skipped; `motor_angle_rad` at lines 2, 3 in total: correct them, or record the log again",
        ),
        (
            rows("0.5,1,2\n", 9),
            "run.csv:3: column `time_s` goes from 0.5 s to 0.5 s; 8 rows in total do not increase in time: write the time with more digits, or keep one row for each time",
        ),
        (
            format!("time_s,motor_angle_rad,torque_nm\n{restart}"),
            "run.csv:12: column `time_s` goes from 9 s to 0 s; 10 rows in total do not increase in time: split the file where the time restarts",
        ),
        (
            "time_s;motor_angle_rad;torque_nm\n0,1;0,5;1,2\n".into(),
            "`0,1` has a decimal comma instead of a point",
        ),
        (
            format!("a,b\n\"{}", "x".repeat(1 << 20)),
            "run.csv:2: this row is longer than 1048576 bytes: look for an unclosed quote",
        ),
    ] {
        let message = read(&text, &[]).unwrap_err().to_string();
        let shown: String = text.chars().take(60).collect();
        assert!(message.contains(expected), "{shown:?}: {message}");
    }
    let utf16: Vec<u8> = "\u{feff}time_s,a\n0,1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(read(utf16, &[]).unwrap_err().to_string().contains("UTF-16"));
    let message = read(PLAIN, &["torque_nm=current"]).unwrap_err().to_string();
    assert_eq!(
        message,
        "run.csv: the column map `torque_nm=current` reads `current`, but the file has `time_s`, \
         `motor_angle_rad`, `torque_nm`: correct the name"
    );
}

/// A log of many rows, with a comment before every hundredth.
fn long(rows: u32) -> String {
    let row = |row: u32| format!("{}{}.5,{row},1\n", if row.is_multiple_of(100) { "#\n" } else { "" }, row);
    "time_s,motor_angle_rad,torque_nm\n".to_owned() + &(0..rows).map(row).collect::<String>()
}

#[test]
fn lines_are_counted_across_comments_and_quoted_breaks() {
    let text = long(1000).replace("777,1\n", "777,\"1\n\"\n").replace("\n878.5", "\noops");
    let log = read(text, &[]).unwrap();
    // Header, 878 rows, 9 comments and one break inside a cell stand above it.
    assert_eq!(log.problems[0].line, 1 + 878 + 9 + 1 + 1);
    assert_eq!((log.rows(), log.column("torque_nm").unwrap()[777]), (999, 1.0));
    for (row, line) in [(0, 3), (777, 787), (778, 789), (877, 889), (878, 891), (998, 1012)] {
        assert_eq!(log.line(row), Some(line), "{row}");
    }
    assert_eq!(log.line(999), None);
}

#[test]
fn reading_reports_progress_and_can_be_cancelled() {
    let text = long(40_000);
    let map = ColumnMap::default();
    let mut seen = Vec::new();
    let log = read_log(text.as_bytes(), "long.csv", &ReadOptions::new(&map), &mut |progress| {
        seen.push(progress);
        ControlFlow::Continue(())
    });
    assert_eq!(log.unwrap().rows(), 40_000);
    assert!(
        seen.windows(2).all(|pair| pair[0].bytes < pair[1].bytes && pair[1].bytes - pair[0].bytes < 70_000)
    );
    assert_eq!(seen.last(), Some(&ReadProgress { bytes: text.len() as u64, rows: 40_000 }));
    let cancelled =
        read_log(text.as_bytes(), "long.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Break(()));
    let message = cancelled.unwrap_err().to_string();
    assert!(message.starts_with("long.csv: reading was cancelled at line "), "{message}");
}

#[test]
fn the_limit_of_memory_is_named() {
    let map = ColumnMap::default();
    let options = ReadOptions { max_values: 30, ..ReadOptions::new(&map) };
    let text = long(11);
    let result = read_log(text.as_bytes(), "big.csv", &options, &mut |_| ControlFlow::Continue(()));
    assert_eq!(
        result.unwrap_err().to_string(),
        "big.csv:13: the log has more than 30 numbers (0 MiB): split the file, or remove unused columns and rows"
    );
}

#[test]
fn a_reader_that_fails_is_reported() {
    struct Broken;
    impl std::io::Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("cable pulled"))
        }
    }
    let reader = std::io::BufReader::new(std::io::Read::chain(PLAIN.as_bytes(), Broken));
    let map = ColumnMap::default();
    let result = read_log(reader, "usb.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()));
    let message = result.unwrap_err().to_string();
    assert_eq!(
        message,
        "usb.csv: reading stopped after line 3 (cable pulled): check the disk or copy the file again"
    );
}

#[test]
#[expect(clippy::disallowed_methods, reason = "only the system can say that it is a folder")]
fn a_folder_is_called_a_folder() {
    // Some systems refuse to open a folder at all.
    let Ok(folder) = std::fs::File::open(env!("CARGO_MANIFEST_DIR")) else { return };
    let map = ColumnMap::default();
    let reader = std::io::BufReader::new(folder);
    let result = read_log(reader, "runs", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()));
    assert_eq!(result.unwrap_err().to_string(), "runs is a folder: give the CSV file in it");
}

#[test]
fn written_logs_read_back_to_the_same_numbers() {
    let values = vec![0.1 + 0.2, -1.0 / 3.0, 1e-300, 5e-324, 1e30, -0.0, 123456.0, f64::NAN, 1e21];
    let time: Vec<f64> = (0..values.len()).map(|row| row as f64 * 0.001).collect();
    let log = Log::from_columns(
        "run.csv",
        [("time_s", time), ("x_m", values.clone()), ("odd \"name\", m", values)],
    );
    let mut text = Vec::new();
    write_log(&log, &mut text).unwrap();
    let ending = [text[text.len() - 2], text[text.len() - 1]];
    assert!(is_written_log(&text, ending));
    let measured = String::from_utf8(text.clone()).unwrap().replace('\r', "");
    assert!(!is_written_log(measured.as_bytes(), *b"0\n"), "the same log from elsewhere");
    assert!(!is_written_log(measured.replace('\n', "\r\n").as_bytes(), *b"\r\n"), "one of Windows");
    let back = read(&text, &[]).unwrap();
    for (wrote, read) in log.columns.iter().zip(&back.columns) {
        assert_eq!(wrote.name, read.name);
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&wrote.values), bits(&read.values));
    }
    assert!(String::from_utf8(text).unwrap().contains("\n0.001,-0.3333333333333333,-0.3333333333333333\n"));
}

/// Flipped bits and cut files: an error or a log, never a panic, and required columns stay finite.
#[test]
fn damaged_bytes_never_panic() {
    use rand::{Rng, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let clean = long(40).into_bytes();
    for _ in 0..2000 {
        let mut text = clean.clone();
        for _ in 0..1 + random.next_u32() % 6 {
            let at = random.next_u32() as usize % text.len();
            text[at] ^= 1 << (random.next_u32() % 8);
        }
        text.truncate(random.next_u32() as usize % (text.len() * 2));
        if let Ok(log) = read(&text, &[])
            && log.serves(LogKind::Bench)
        {
            let required = LogKind::Bench.required().iter().filter_map(|name| log.column(name));
            assert!(required.flatten().all(|value| value.is_finite()));
            crate::record::data_health(&log);
        }
    }
}
