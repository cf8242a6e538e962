use super::*;
use crate::model_file::presets;

fn bench(dt_s: f64, rows: usize, change: impl Fn(&mut Vec<f64>)) -> Log {
    let time: Vec<f64> = (0..rows).map(|row| row as f64 * dt_s).collect();
    let angle = time.iter().map(|t| libm::sin(*t)).collect();
    let mut torque: Vec<f64> = time.iter().map(|t| 0.01 * libm::cos(*t)).collect();
    change(&mut torque);
    Log::from_columns("made", [("time_s", time), ("motor_angle_rad", angle), ("torque_nm", torque)])
}

fn told(log: &Log) -> Vec<Prediction> {
    predictions(&presets::paper(), std::slice::from_ref(log), Rows::All, Motor::Left, 1)
}

#[test]
fn rows_slower_than_the_shortest_prediction_give_none() {
    assert_eq!(told(&bench(0.2, 400, |_| ())), []);
    assert_eq!(told(&bench(0.04, 1000, |_| ())).len(), 3);
}

#[test]
fn cells_without_a_number_are_gone_round() {
    let clean = told(&bench(1e-3, 8000, |_| ()));
    let holed = told(&bench(1e-3, 8000, |torque| torque[1000] = f64::NAN));
    assert_eq!(holed.len(), clean.len());
    for value in holed.iter().flat_map(|p| [&p.rmse, &p.motion, &p.noise_floor]) {
        assert!(value.value.is_finite(), "{holed:?}");
    }
    assert_eq!(told(&bench(1e-3, 8000, |torque| torque.fill(f64::NAN))), []);
}

/// The next reading of a slow IMU may be after the last row that a prediction can start from.
#[test]
fn no_start_is_moved_past_the_end_by_a_slow_imu() {
    for rows in (2500..2600).step_by(7) {
        let time: Vec<f64> = (0..rows).map(|row| f64::from(row) * 1e-3).collect();
        let of = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
        let held = |t: f64| (t * 10.0 + 1e-6).floor() / 10.0;
        let log = Log::from_columns(
            "made",
            [
                ("motor_angle_left_rad", of(&|t| t)),
                ("motor_angle_right_rad", of(&|t| t)),
                ("torque_left_nm", of(&|_| 0.0)),
                ("torque_right_nm", of(&|_| 0.0)),
                ("pitch_rad", of(&|t| 0.01 * libm::sin(held(t)))),
                ("pitch_rate_rad_s", of(&|t| 0.01 * libm::cos(held(t)))),
                ("time_s", time.clone()),
            ],
        );
        let record = Record::new(&log, true).unwrap();
        let starts = record.starts(Rows::All);
        assert!(starts.is_sorted_by(|a, b| a < b), "{starts:?}");
        let last = starts.last().unwrap() + record.ahead(1.0) + record.margin();
        assert!(last < rows as usize, "{starts:?}");
        assert_eq!(told(&log).len(), 9);
    }
}
