//! Loading a log, beside a loop over the records of the csv crate that does nothing but parse the numbers.

use std::fmt::Write;
use std::ops::ControlFlow;

use flqr_core::record::{ColumnMap, ReadOptions, read_log};

fn main() {
    divan::main();
}

/// A robot log of about 20 MB: eleven columns, 200 000 rows.
fn log() -> String {
    let mut text =
        "time_s,x_m,x_dot_m_s,pitch_rad,pitch_rate_rad_s,motor_angle_left_rad,motor_angle_right_rad,\
                    motor_speed_left_rad_s,motor_speed_right_rad_s,torque_left_nm,torque_right_nm\n"
            .to_owned();
    for row in 0..200_000 {
        let time = f64::from(row) * 1e-3;
        write!(text, "{time:.3}").expect("a string takes text");
        for column in 1..11 {
            let value = (time * f64::from(column)).sin();
            write!(text, ",{value:.6}").expect("a string takes text");
        }
        text.push('\n');
    }
    text
}

#[divan::bench(sample_count = 5)]
fn read_log_20_mb(bencher: divan::Bencher) {
    let text = log();
    let map = ColumnMap::default();
    bencher.counter(divan::counter::BytesCount::new(text.len())).bench(|| {
        read_log(text.as_bytes(), "log.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()))
    });
}

#[divan::bench(sample_count = 5)]
fn csv_crate_20_mb(bencher: divan::Bencher) {
    let text = log();
    bencher.counter(divan::counter::BytesCount::new(text.len())).bench(|| {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let mut record = csv::ByteRecord::new();
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); 11];
        while reader.read_byte_record(&mut record).expect("the text is well formed") {
            for (column, cell) in columns.iter_mut().zip(&record) {
                let cell = std::str::from_utf8(cell).expect("the text is ASCII");
                column.push(cell.parse().expect("the cell is a number"));
            }
        }
        columns
    });
}
