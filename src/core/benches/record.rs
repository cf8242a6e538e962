//! Loading a log, next to a loop over the records of the csv crate that does nothing but parse the numbers; and the
//! text of a recording.

use std::fmt::Write;
use std::ops::ControlFlow;
use std::time::Duration;

use flqr_core::link::{Direction, Frame, FrameId, StampedFrame};
use flqr_core::record::recording::{self, Row};
use flqr_core::record::{ColumnMap, ReadOptions, Sample, read_log};

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

/// The text of one second of a robot on a full bus: 8000 frames and 1000 rows.
#[divan::bench]
fn record_one_second(bencher: divan::Bencher) {
    let frame = Frame::full(FrameId::Standard(0x141), [0xA1, 0x23, 0x36, 1, 0xE1, 0xFE, 0, 0xC0]);
    let start = Duration::from_secs(1_700_000_000);
    bencher.bench(|| {
        let (mut rows, mut frames) = (String::new(), String::new());
        for number in 0..8000_u32 {
            let time = Duration::from_micros(u64::from(number) * 125);
            let stamped = StampedFrame { time, direction: Direction::Received, frame };
            recording::push_frame(&mut frames, start, "can0", &stamped);
            if number.is_multiple_of(8) {
                recording::push_row(&mut rows, &row(time.as_secs_f64()));
            }
        }
        (rows, frames)
    });
}

fn row(time_s: f64) -> Row {
    let value = |column: f64| (time_s * column).sin();
    Row::from(Sample {
        time_s,
        x_m: value(1.0),
        x_dot_m_s: value(2.0),
        pitch_rad: value(3.0),
        pitch_rate_rad_s: value(4.0),
        motor_angle_left_rad: value(5.0),
        motor_angle_right_rad: value(6.0),
        motor_speed_left_rad_s: value(7.0),
        motor_speed_right_rad_s: value(8.0),
        torque_left_nm: value(9.0),
        torque_right_nm: value(10.0),
    })
}
