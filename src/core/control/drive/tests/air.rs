//! Experiments with the wheels in the air, and on top of the balance.

use std::ops::ControlFlow;

use super::rig::{Rig, controller, paper};
use crate::control::{
    ControllerKind,
    drive::{Drive, DriveSettings, Excitation, StopReason},
};
use crate::identify::{FitOptions, fit};
use crate::model::{Model, Motor};
use crate::record::{BenchSample, Log};

fn in_air(excitation: Excitation, scale: f64, seconds: f64) -> (Rig, Option<StopReason>) {
    let robot = paper();
    let control = controller(&robot, ControllerKind::Lqr);
    let drive = Drive::new(&robot, control, excitation, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&robot, drive, true, true, 1);
    rig.torque_scale = scale;
    rig.arm();
    let stop = rig.run(seconds).map(|(_, reason)| reason);
    (rig, stop)
}

fn bench_log(rig: &Rig, motor: Motor) -> Log {
    let rows: Vec<[f64; 5]> = rig
        .outputs
        .iter()
        .filter_map(|(_, output)| output.bench)
        .map(|sample| sample.to_row(motor))
        .collect();
    let columns = BenchSample::COLUMNS.into_iter().enumerate();
    Log::from_columns("bench", columns.map(|(i, name)| (name, rows.iter().map(|row| row[i]).collect())))
}

/// Friction of the model as the fit finds it in what the drive has recorded: torque over the speeds of the sweep.
#[test]
fn a_sweep_records_bench_logs_from_which_the_friction_is_fitted() {
    let (rig, stop) = in_air(Excitation::SpeedSweep { seconds: 40.0 }, 1.0, 50.0);
    assert_eq!(stop, Some(StopReason::Done));
    for motor in Motor::BOTH {
        let log = bench_log(&rig, motor);
        let watch = &mut |_: &_| ControlFlow::Continue(());
        let report = fit(&[log], None, motor, &FitOptions::default(), watch).unwrap();
        let found = report.stribeck().unwrap();
        let curve = crate::friction::Stribeck::new(found).unwrap();
        let exact = paper().friction[motor as usize].unwrap();
        for speed in [0.2, 0.5, 1.0, 3.0, 10.0, 40.0, -0.5, -3.0, -40.0] {
            let (found, exact) = (curve.torque_nm(speed), exact.torque_nm(speed));
            assert!((found - exact).abs() < 0.004, "{motor}: {found} for {exact} at {speed}");
        }
    }
}

#[test]
fn a_multisine_records_bench_logs_from_which_the_inertia_is_fitted() {
    let (rig, stop) = in_air(Excitation::Multisine { seconds: 20.0 }, 1.0, 30.0);
    assert_eq!(stop, Some(StopReason::Done));
    let robot = paper();
    let model = Model {
        name: "robot".to_owned(),
        rig: crate::model::Rig::Robot(Box::new(robot.clone())),
        tolerance: Default::default(),
    };
    for motor in Motor::BOTH {
        let options = FitOptions { estimate: vec!["inertia_kg_m2".to_owned()], ..FitOptions::default() };
        let watch = &mut |_: &_| ControlFlow::Continue(());
        let report = fit(&[bench_log(&rig, motor)], Some(&model), motor, &options, watch).unwrap();
        let found = report.parameters["inertia_kg_m2"].value;
        let exact = robot.parameters.wheel_inertia_kg_m2;
        assert!((found / exact - 1.0).abs() < 0.1, "{motor}: {found} for {exact}");
    }
}

#[test]
fn a_wrong_torque_scale_stops_the_sweep() {
    for scale in [1.986, 1.0 / 1.986, 2.53, 1.0 / 2.53] {
        let (rig, stop) = in_air(Excitation::SpeedSweep { seconds: 40.0 }, scale, 50.0);
        let Some(StopReason::TorqueScale { factor }) = stop else { panic!("{scale}: {stop:?}") };
        assert!((factor / scale - 1.0).abs() < 0.3 && rig.tick < 4100 + 8000, "{factor} for {scale}");
    }
}

/// The multisine stands on top of the balance: what is requested differs from the controller's own torque by it.
#[test]
fn a_multisine_on_top_of_the_balance_moves_the_motors_apart() {
    let robot = paper();
    let control = controller(&robot, ControllerKind::Lqr);
    let drive = Drive::new(&robot, control, Excitation::BalanceMultisine, DriveSettings::default()).unwrap();
    let mut rig = Rig::new(&robot, drive, false, true, 1);
    rig.arm();
    assert_eq!(rig.run(20.0), None);
    let apart = |from: u64, to: u64| {
        let within = rig.outputs.iter().filter(|(time, _)| (from..to).contains(&(time.as_millis() as u64)));
        let differences =
            within.filter_map(|(_, output)| output.sample).map(|s| s.torque_left_nm - s.torque_right_nm);
        let (count, squares) = differences.fold((0.0, 0.0), |(n, sum), d| (n + 1.0, sum + d * d));
        f64::sqrt(squares / count)
    };
    let (quiet, excited) = (apart(4200, 7000), apart(8000, 24_000));
    assert!(excited > 0.05 && excited > 2.0 * quiet, "{excited} after {quiet}");
}
