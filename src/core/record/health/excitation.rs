//! Excitation of a log.

use super::{Findings, finite, range};
use crate::record::{Log, LogKind};

/// Reports on the excitation of a complete log.
pub(super) fn check(log: &Log, kind: LogKind, findings: &mut Findings) {
    match kind {
        LogKind::Bench => directions(log, "motor_angle_rad", findings),
        LogKind::LinearAxis => directions(log, "position_m", findings),
        LogKind::FrictionPairs => pairs(log, findings),
        LogKind::Robot => {}
    }
}

/// Reversal of the motion of an axis: the smaller of the two distances relative to the larger.
fn directions(log: &Log, position: &str, findings: &mut Findings) {
    let Some(values) = log.column(position) else { return };
    let (mut forth, mut back) = (0.0, 0.0);
    for pair in values.windows(2) {
        let change = pair[1] - pair[0];
        if change > 0.0 {
            forth += change;
        } else if change < 0.0 {
            back -= change;
        }
    }
    if f64::min(forth, back) < 0.02 * f64::max(forth, back) {
        findings.info(
            position,
            "the motion has one direction only: Coulomb friction and offset cannot be separated",
        );
    }
}

fn pairs(log: &Log, findings: &mut Findings) {
    let (Some(speeds), Some(torques)) = (log.column("speed_rad_s"), log.column("torque_nm")) else { return };
    if speeds.len() < 8 {
        let problem =
            format!("{} pairs are too few for the six parameters of a Stribeck curve", speeds.len());
        findings.warn("speed_rad_s", problem, "measure at eight speeds or more, in both directions");
    }
    if let Some([low, high]) = range(speeds)
        && low * high > 0.0
    {
        findings.info(
            "speed_rad_s",
            "the speeds have one sign only: Coulomb friction and offset cannot be separated",
        );
    }
    let power: f64 = speeds.iter().zip(torques).map(|(v, t)| v * t).filter(|p| p.is_finite()).sum();
    if power < 0.0 && finite(torques).count() > 0 {
        findings.warn(
            "torque_nm",
            "most torques have the opposite sign of the speed, which is impossible for a motor at constant speed",
            "change the sign with --map torque_nm=torque_nm*-1",
        );
    }
}
