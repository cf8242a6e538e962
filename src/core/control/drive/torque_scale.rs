//! Whether the motors do what they are requested.
//!
//! Sources disagree on the steps of the current command by a factor of 1.986, and the two windings' torque constants
//! differ by 2.53. Quiet balancing cannot tell: torques are then as small as the friction, which holds the motors most
//! of the time. So soon after arming both motors get the same nudge on top of what the controller asks for, one way for
//! 40 ms and back for 40 ms, and the encoders tell how far it went:
//! q̄(t) = q₀ + q̇₀ t + ½ c t² + f ∬ b ΣT, where b is the model's response to a torque, c the gravity and friction of
//! those 80 ms, and f the factor that is looked for. What the controller requested meanwhile is part of ΣT. An unknown
//! payload changes b little, because mass and inertia grow together in numerator and denominator.
//!
//! A wrong factor has other causes than the scale, which are named: the torque acts later than the model says (the
//! nudge fits when it is shifted), the robot is held (neither wheels nor body move), and wheels that are to be in the
//! air are on the ground (the body pitches against the nudge, or the wheels do not turn).

use std::ops::RangeInclusive;

use super::regression::least_squares;
use super::stage::StopReason;
use crate::model::{RobotModel, TICK_S};
use crate::record::Readings;

/// Time from arming to the nudge, s: on the ground, for the robot to be let go and to settle; in the air, for the
/// motors to be on.
const START_GROUND_S: f64 = 1.0;
const START_AIR_S: f64 = 0.25;
/// Each way of the nudge, s, and the change of the motors' speed that it aims at, rad/s.
const HALF_S: f64 = 0.04;
const SPEED_RAD_S: f64 = 0.6;
/// Least torque of the nudge, several times the friction of such motors, N m; and greatest fraction of the limit.
const LEAST_NM: f64 = 0.5;
const GREATEST_SHARE: f64 = 0.5;
/// Factors that are let pass, and deviations that the estimate has to lie outside.
const ALLOWED: RangeInclusive<f64> = 0.7..=1.45;
const DEVIATIONS: f64 = 3.0;
/// Standard deviation above which a nudge says nothing, as where ticks came late; nudges of a balancing robot at most,
/// and the time between two, s.
const LARGEST_DEVIATION: f64 = 0.1;
const NUDGES: u32 = 3;
const NEXT_S: f64 = 1.0;
/// Time between two ticks, and age of the motors' reading, beyond which this computer or the bus stood still and a
/// nudge may lie, s; it takes so many of those to say that the motors do something else.
pub(super) const LATE_S: f64 = 0.003;
pub(super) const STALE_S: f64 = 0.01;
const AGREEING: u32 = 2;
/// Delays beyond the model's that are tried, ticks, and the largest residual compared with that without, squared, of
/// one that explains the nudge.
const DELAYS: std::ops::RangeInclusive<usize> = 5..=40;
const EXPLAINED: f64 = 0.5;
/// Factors below which wheels do not turn, and above which the body pitches as that of a robot on the ground.
const HELD: f64 = 0.2;
const PITCHES: f64 = 0.3;

/// The nudge, and what came of it.
#[derive(Clone, Debug)]
pub(super) struct TorqueScale {
    /// Acceleration of both motors under 1 N m in all, rad/s².
    response: f64,
    /// Acceleration of the body's pitch under the same on the ground, rad/s².
    pitch_response: f64,
    balancing: bool,
    start_s: f64,
    nudge_nm: f64,
    rows: Vec<Row>,
    speed: f64,
    way: f64,
    last_s: f64,
    nudges_left: u32,
    /// Nudges with late ticks that have yet to say that the motors do something else, before it is believed.
    doubts_left: u32,
    /// Whether anything was late in this nudge.
    is_late: bool,
}

/// Time since the nudge began, s, mean motor angle, rad, pitch rate, rad/s, and integral of the response to the torques
/// once and twice.
#[derive(Clone, Copy, Debug)]
struct Row {
    since_s: f64,
    angle_rad: f64,
    pitch_rate_rad_s: f64,
    speed: f64,
    way: f64,
}

/// What has come of the nudges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// The motors do what they are requested, as far as payload and friction let see.
    Right,
    /// They surely do not, for this reason.
    Wrong(StopReason),
    /// None of the nudges could be read.
    Unclear,
}

impl TorqueScale {
    pub(super) fn new(robot: &RobotModel, balancing: bool, torque_limit_nm: f64) -> Self {
        let b = robot.parameters.linear_model().b;
        let response = if balancing {
            b[(1, 0)] / robot.parameters.wheel_radius_m - b[(3, 0)]
        } else {
            0.5 / robot.parameters.wheel_inertia_kg_m2
        };
        let nudge_nm = (SPEED_RAD_S / (2.0 * response * HALF_S)).max(LEAST_NM);
        Self {
            response,
            pitch_response: b[(3, 0)],
            balancing,
            start_s: if balancing { START_GROUND_S } else { START_AIR_S },
            nudge_nm: nudge_nm.min(GREATEST_SHARE * torque_limit_nm),
            rows: Vec::with_capacity(128),
            speed: 0.0,
            way: 0.0,
            last_s: 0.0,
            nudges_left: if balancing { NUDGES } else { 1 },
            doubts_left: if balancing { AGREEING } else { 1 },
            is_late: false,
        }
    }

    /// Time since arming at which nothing is added any more, s.
    pub(super) fn end_s(&self) -> f64 {
        self.start_s + 2.0 * HALF_S
    }

    /// What is added to both torques at a time since arming, N m.
    pub(super) fn nudge_nm(&self, time_s: f64) -> f64 {
        let since = time_s - self.start_s;
        if self.nudges_left == 0 {
            0.0
        } else if (0.0..HALF_S).contains(&since) {
            self.nudge_nm
        } else if (HALF_S..2.0 * HALF_S).contains(&since) {
            -self.nudge_nm
        } else {
            0.0
        }
    }

    /// Takes the readings of a tick, how old the motors' are, and the torques that acted since the last; the verdict,
    /// once.
    pub(super) fn step(
        &mut self,
        time_s: f64,
        (readings, age_s): (&Readings, f64),
        acted_nm: [f64; 2],
    ) -> Option<Verdict> {
        let since = time_s - self.start_s;
        let passed_s = if self.rows.is_empty() { TICK_S } else { time_s - self.last_s };
        self.last_s = time_s;
        if self.nudges_left == 0 || since < 0.0 {
            return None;
        }
        let change = self.response * (acted_nm[0] + acted_nm[1]) * passed_s;
        self.way += (self.speed + 0.5 * change) * passed_s;
        self.speed += change;
        let angle = f64::midpoint(readings.motor_angle_rad[0], readings.motor_angle_rad[1]);
        self.is_late |= passed_s > LATE_S || age_s > STALE_S;
        let Self { speed, way, .. } = *self;
        let pitch_rate_rad_s = readings.pitch_rate_rad_s;
        self.rows.push(Row { since_s: since, angle_rad: angle, pitch_rate_rad_s, speed, way });
        if since > 2.0 * HALF_S { self.judge() } else { None }
    }

    fn judge(&mut self) -> Option<Verdict> {
        let found = self.estimate(0).filter(|found| found.deviation < LARGEST_DEVIATION);
        self.nudges_left -= 1;
        if let Some(Estimate { factor, deviation, .. }) = found {
            let margin = DEVIATIONS * deviation;
            let wrong = factor + margin < *ALLOWED.start() || factor - margin > *ALLOWED.end();
            if wrong {
                self.doubts_left = if self.is_late { self.doubts_left - 1 } else { 0 };
            }
            if !wrong || self.doubts_left == 0 {
                self.nudges_left = 0;
                return Some(if wrong { Verdict::Wrong(self.cause(factor)) } else { Verdict::Right });
            }
        }
        self.rows.clear();
        (self.speed, self.way) = (0.0, 0.0);
        self.is_late = false;
        self.start_s += NEXT_S;
        (self.nudges_left == 0).then_some(Verdict::Unclear)
    }

    /// Why the factor is wrong.
    fn cause(&self, factor: f64) -> StopReason {
        let pitches = self.pitch_factor().is_some_and(|factor| factor.abs() > PITCHES);
        let turns = factor.abs() > HELD;
        if !self.balancing && factor < *ALLOWED.start() && (pitches || !turns) {
            return StopReason::WheelsOnGround { factor };
        }
        if let Some(delay_s) = self.delay_s() {
            return StopReason::TorqueDelay { delay_s };
        }
        if self.balancing && !turns && !pitches {
            return StopReason::Held;
        }
        StopReason::TorqueScale { factor }
    }

    /// The delay beyond the model's with which the nudge is that of motors that do what they are commanded.
    fn delay_s(&self) -> Option<f64> {
        let residual = self.estimate(0)?.residual;
        let delayed = DELAYS.filter_map(|ticks| Some((ticks, self.estimate(ticks)?)));
        let (ticks, best) = delayed.min_by(|(_, a), (_, b)| a.residual.total_cmp(&b.residual))?;
        let explains = best.residual < EXPLAINED * residual && ALLOWED.contains(&best.factor);
        explains.then_some(ticks as f64 * TICK_S)
    }

    /// Least squares over the nudge, with torques that act so many ticks later.
    fn estimate(&self, delay_ticks: usize) -> Option<Estimate> {
        let first = self.rows.first()?.angle_rad;
        let rows = self.rows.iter().enumerate().map(|(index, row)| {
            let way = index.checked_sub(delay_ticks).map_or(0.0, |earlier| self.rows[earlier].way);
            ([way, 1.0, row.since_s, row.since_s * row.since_s], row.angle_rad - first)
        });
        let fit = least_squares(rows)?;
        Some(Estimate { factor: fit.value[0], deviation: fit.deviation[0], residual: fit.residual })
    }

    /// How much of the pitch rate that the nudge gives a robot on the ground the body has shown.
    fn pitch_factor(&self) -> Option<f64> {
        let share = self.pitch_response / self.response;
        let rows = self.rows.iter().map(|row| ([share * row.speed, 1.0, row.since_s], row.pitch_rate_rad_s));
        Some(least_squares(rows)?.value[0])
    }
}

#[derive(Clone, Copy, Debug)]
struct Estimate {
    factor: f64,
    deviation: f64,
    residual: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::presets;

    /// Verdict, and when, of motors that do `factors` of what each nudge asks for, with ticks left out in `hole`.
    fn verdict(factors: [f64; 3], hole: [f64; 2]) -> Option<(f64, Verdict)> {
        let model = presets::paper();
        let mut scale = TorqueScale::new(model.robot().unwrap(), true, 2.42);
        let (mut angle, mut speed, mut acted) = (0.0, 0.0, [0.0; 2]);
        for tick in 0..4000 {
            let time_s = f64::from(tick) * TICK_S;
            let factor = factors[((time_s - 0.5) as usize).min(2)];
            speed += scale.response * factor * (acted[0] + acted[1]) * TICK_S;
            angle += speed * TICK_S;
            if (hole[0]..hole[1]).contains(&time_s) {
                continue;
            }
            let readings = Readings { motor_angle_rad: [angle; 2], ..Readings::default() };
            if let Some(verdict) = scale.step(time_s, (&readings, 0.0), acted) {
                return Some((time_s, verdict));
            }
            acted = [scale.nudge_nm(time_s); 2];
        }
        None
    }

    #[test]
    fn a_nudge_with_late_ticks_is_not_believed_alone() {
        let wrong = |found: Option<(f64, Verdict)>| match found {
            Some((time_s, Verdict::Wrong(StopReason::TorqueScale { .. }))) => time_s,
            other => panic!("{other:?}"),
        };
        let (none, hole) = ([9.0, 9.0], [1.02, 1.032]);
        assert!(wrong(verdict([0.5; 3], none)) < 1.1);
        let late = wrong(verdict([0.5; 3], hole));
        assert!(late > 1.9 && late < 2.2, "{late}");
        let healed = verdict([0.5, 1.0, 1.0], hole);
        assert!(matches!(healed, Some((time_s, Verdict::Right)) if time_s > 1.9), "{healed:?}");
    }
}
