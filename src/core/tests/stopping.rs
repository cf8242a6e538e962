//! A driven robot is stopped whatever the threads around its session do.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::disallowed_methods, reason = "these tests run sessions and look at files")]

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use flqr_core::control::drive::{CheckResult, DriveOrder, Excitation, Stage};
use flqr_core::control::{BalanceController, ControllerKind};
use flqr_core::device::{Session, SessionMode, SessionOptions, SessionOrder, Source, all_stopped, stop_all};
use flqr_core::lqr;
use flqr_core::model_file::presets;

/// A session that drives an emulated robot and is recorded.
fn driving(name: &Path) -> Session {
    let mut robot = presets::paper().robot().unwrap().clone();
    // The machine may be busy.
    (robot.safety.late_s, robot.safety.motor_timeout_s) = (1.0, 1.0);
    (robot.safety.imu_timeout_s, robot.safety.imu_frozen_s) = (1.0, 1.0);
    let gain = lqr::design(&robot.parameters.linear_model(), &robot.weights.unwrap()).unwrap().gain;
    let controller = Box::new(BalanceController::new(ControllerKind::Lqr, &robot, gain).unwrap());
    let options = SessionOptions {
        source: Source::Emulated,
        imu: None,
        dbc: None,
        robot,
        mode: SessionMode::Drive { controller, excitation: Excitation::Balance },
        record: Some(name.to_owned()),
        seed: 1,
        replay_speed: 1.0,
    };
    let mut session = Session::open(options, Arc::new(|| {})).unwrap();
    session.send(SessionOrder::Drive(DriveOrder::Check));
    loop {
        let Some(update) = session.wait(Duration::from_millis(100)) else { continue };
        let drive = update.status.drive.unwrap();
        match drive.stage {
            Stage::Driving => return session,
            Stage::Stopped(reason) => panic!("{reason}"),
            Stage::Listening | Stage::Checking => {
                let passed = |result| result == CheckResult::Passed;
                if !drive.checks.is_empty() && drive.checks.iter().all(|check| passed(check.result)) {
                    session.send(SessionOrder::Drive(DriveOrder::Arm));
                }
            }
        }
    }
}

/// Nobody takes an update or sends an order, as where the main thread hangs.
#[test]
fn a_request_to_all_stops_a_robot_whose_session_nobody_looks_after() {
    let name = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stopping");
    for ending in ["csv", "log"] {
        let _absent = fs::remove_file(name.with_extension(ending));
    }
    assert!(all_stopped(), "nothing is driven yet");
    let session = driving(&name);
    assert!(!all_stopped());
    stop_all();
    while !all_stopped() {
        std::thread::yield_now();
    }
    let ending = session.close().unwrap();
    let recording = ending.recording.unwrap();
    assert!(ending.motors_off && recording.problem.is_none() && recording.rows_lost == 0, "{recording:?}");
    let frames = fs::read_to_string(name.with_extension("log")).unwrap();
    assert_eq!(frames.lines().count() as u64, recording.frames);
    let sent: Vec<&str> = frames.lines().filter(|line| line.ends_with(" T")).collect();
    assert!(sent.iter().any(|frame| frame.contains("#88")), "the motors were on");
    let stop = &sent[sent.len() - 4..];
    let orders = ["#A100000000000000", "#A100000000000000", "#8000000000000000", "#8000000000000000"];
    assert!(stop.iter().zip(orders).all(|(frame, order)| frame.contains(order)), "{stop:?}");
    let times: Vec<&str> = frames.lines().map(|line| line.split_once(')').unwrap().0).collect();
    assert!(times.is_sorted(), "frames and packets of all threads are in the order of their times");
}
