//! The two wheel motors on the bus: orders to frames, frames to events, forward positive.

use std::time::Duration;

use super::protocol::{MotorProtocol, Report, ShaftAngle, protocol};
use super::{Direction, Frame, MotorEvent, MotorOrder, MotorState, StampedFrame};
use crate::model::{LinkSettings, Motor};

/// Both wheel motors of one robot, behind the protocol of its `[link]` settings.
#[derive(Debug)]
pub struct Wheels {
    protocol: Box<dyn MotorProtocol>,
    /// 1 or −1: each motor's own sense as the robot drives forward.
    signs: [f64; 2],
    shafts: [Option<Shaft>; 2],
    /// Whether torques that this program sent are events too.
    tells_sent: bool,
}

/// Newest reading of a motor in its own sense.
#[derive(Clone, Copy, Debug)]
struct Shaft {
    time: Duration,
    speed_rad_s: f64,
    angle: ShaftAngle,
    counted: Counted,
}

/// Motion since the first reading.
#[derive(Clone, Copy, Debug)]
enum Counted {
    Steps(i64),
    Rad(f64),
}

impl Wheels {
    /// The motors of these settings, which are to be ones that [`LinkSettings::validate`] accepts.
    pub fn new(settings: &LinkSettings) -> Self {
        Self::with_protocol((protocol(settings.protocol).host)(settings), settings)
    }

    fn with_protocol(protocol: Box<dyn MotorProtocol>, settings: &LinkSettings) -> Self {
        let signs = settings.directions().map(|direction| direction.sign());
        Self { protocol, signs, shafts: [None; 2], tells_sent: false }
    }

    /// The motors of a recording: whoever commanded them, torques are events, the ones too that this program sent.
    pub fn telling_sent(self) -> Self {
        Self { tells_sent: true, ..self }
    }

    /// The frames of an order. A torque gives none as long as the protocol cannot express it; beyond the protocol's
    /// range it is clamped.
    pub fn frames(&mut self, order: &MotorOrder) -> impl Iterator<Item = Frame> + use<> {
        let order = match *order {
            MotorOrder::Torque([left, right]) => {
                MotorOrder::Torque([self.signs[0] * left, self.signs[1] * right])
            }
            other => other,
        };
        self.protocol.encode(&order).into_iter().flatten()
    }

    /// Events of a frame. Frames that this program sent are to be handed in too: they show which replies to expect,
    /// and are no events themselves.
    pub fn receive(&mut self, frame: &StampedFrame) -> impl Iterator<Item = MotorEvent> + use<> {
        let tells_commands = frame.direction == Direction::Received || self.tells_sent;
        let reports = self.protocol.decode(frame);
        let events =
            reports.map(|report| report.map(|report| self.event(report, frame.time, tells_commands)));
        events.into_iter().flatten().flatten().flatten()
    }

    /// Takes the time at which a frame, handed to [`Wheels::receive`] when it was ordered, was written to the bus.
    pub fn written(&mut self, frame: &StampedFrame) {
        self.protocol.written(frame);
    }

    fn event(&mut self, report: Report, time: Duration, tells_commands: bool) -> [Option<MotorEvent>; 2] {
        let event = match report {
            Report::Motion { motor, angle, speed_rad_s, current_a, temperature_c } => {
                let sign = self.signs[motor as usize];
                let (angle_rad, lost) = self.count(motor, angle, time, speed_rad_s);
                let state = MotorState {
                    time,
                    angle_rad: sign * angle_rad,
                    speed_rad_s: sign * speed_rad_s,
                    current_a: sign * current_a,
                    temperature_c,
                };
                let lost = lost.map(|silent| MotorEvent::TurnsLost { motor, time, silent });
                return [lost, Some(MotorEvent::State(motor, state))];
            }
            Report::Health(motor, health) => Some(MotorEvent::Health(motor, health)),
            Report::Switched { motor, on } => Some(MotorEvent::Switched { motor, time, on }),
            Report::Commanded { motor, command, current_a } => tells_commands.then(|| {
                let current_a = current_a.map(|current_a| self.signs[motor as usize] * current_a);
                MotorEvent::Commanded { motor, time, command, current_a }
            }),
        };
        [event, None]
    }

    /// Angle since the first reading, rad, and the silence before this reading if turns may be missing because of it.
    fn count(
        &mut self,
        motor: Motor,
        angle: ShaftAngle,
        time: Duration,
        speed_rad_s: f64,
    ) -> (f64, Option<Duration>) {
        let shaft = &mut self.shafts[motor as usize];
        let silent = shaft.map_or(Duration::ZERO, |last| time.saturating_sub(last.time));
        let lost = silent > self.protocol.longest_silence();
        let (counted, angle_rad, lost) = match angle {
            ShaftAngle::WithinTurn { steps, turn_steps, turn_rad } => {
                let elapsed_s = silent.as_secs_f64();
                let counted = match *shaft {
                    Some(Shaft { counted: Counted::Steps(counted), .. }) if lost => counted,
                    Some(Shaft {
                        counted: Counted::Steps(counted),
                        angle: ShaftAngle::WithinTurn { steps: before, .. },
                        speed_rad_s: last_rad_s,
                        ..
                    }) => {
                        let turns = (last_rad_s + speed_rad_s) / 2.0 * elapsed_s / turn_rad;
                        counted + steps_between([before, steps], turn_steps, turns)
                    }
                    _ => 0,
                };
                let angle_rad = counted as f64 * turn_rad / f64::from(turn_steps);
                (Counted::Steps(counted), angle_rad, lost.then_some(silent))
            }
            ShaftAngle::Continuous(rad) => {
                let counted = match *shaft {
                    Some(Shaft {
                        counted: Counted::Rad(counted),
                        angle: ShaftAngle::Continuous(before),
                        ..
                    }) => counted + (rad - before),
                    _ => 0.0,
                };
                (Counted::Rad(counted), counted, None)
            }
        };
        *shaft = Some(Shaft { time, speed_rad_s, angle, counted });
        (angle_rad, lost)
    }
}

/// Steps from one reading to the next: the encoder's, and the whole turns that come nearest to the mean speed.
fn steps_between([before, after]: [u32; 2], turn_steps: u32, turns: f64) -> i64 {
    let within = i64::from(after) - i64::from(before);
    within + i64::from(turn_steps) * (turns - within as f64 / f64::from(turn_steps)).round() as i64
}

#[cfg(test)]
mod tests;
