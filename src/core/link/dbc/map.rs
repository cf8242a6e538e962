//! From frames to readings, through the chosen signals.

use std::time::Duration;

use super::{Choice, Dbc, Quantity, Signal};
use crate::link::{FrameId, ImuReading, MotorEvent, MotorState, StampedFrame};
use crate::model::Motor;

/// What a frame told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard {
    /// A motor's motion. Its current is the torque through the torque constant, and 0 without a signal of it; its
    /// temperature is not a number without one.
    Motor(MotorEvent),
    /// The body's pitch.
    Imu(ImuReading),
}

/// The chosen signals.
///
/// A position whose rate is not chosen is differentiated, a rate whose position is not chosen is added up; of
/// both, the newest values go together at each new position.
#[derive(Clone, Debug)]
pub struct SignalMap {
    sources: Vec<Source>,
    torque_constant_nm_a: f64,
    pitch: Motion,
    motors: [Axis; 2],
}

#[derive(Clone, Debug)]
struct Source {
    quantity: Quantity,
    id: FrameId,
    signal: Signal,
    factor: f64,
}

#[derive(Clone, Copy, Debug)]
struct Axis {
    motion: Motion,
    torque_nm: f64,
    temperature_c: f64,
}

/// A choice that the file does not bear out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChoiceError {
    /// No such signal.
    #[error("the file has no signal {signal} for {quantity}: choose one of its signals")]
    NoSuchSignal {
        /// What it was to be.
        quantity: Quantity,
        /// What was chosen.
        signal: String,
    },
    /// More than one.
    #[error("the messages {first} and {second} both have a signal {signal}: write {first}.{signal}")]
    Ambiguous {
        /// What was chosen.
        signal: String,
        /// One message.
        first: String,
        /// Another one.
        second: String,
    },
    /// A unit that does not tell the factor.
    #[error("the unit `{unit}` of {signal} does not determine its scale as {quantity}: add *FACTOR")]
    Unit {
        /// What it was to be.
        quantity: Quantity,
        /// What was chosen.
        signal: String,
        /// Its unit.
        unit: String,
    },
    /// Beyond the bytes of a classic frame.
    #[error("the signal {signal} is outside the 8 bytes of a classic CAN frame")]
    TooFar {
        /// What was chosen.
        signal: String,
    },
    /// The same quantity twice.
    #[error("{quantity} is given twice: keep one of the two")]
    Twice {
        /// Which.
        quantity: Quantity,
    },
}

impl SignalMap {
    /// The chosen signals of a file. Torques become currents by the torque constant, N m/A.
    ///
    /// # Errors
    /// [`ChoiceError`].
    pub fn new(dbc: &Dbc, choices: &[Choice], torque_constant_nm_a: f64) -> Result<Self, ChoiceError> {
        let mut sources: Vec<Source> = Vec::new();
        for choice in choices {
            if sources.iter().any(|source| source.quantity == choice.quantity) {
                return Err(ChoiceError::Twice { quantity: choice.quantity });
            }
            sources.push(source(dbc, choice)?);
        }
        let has = |quantity| sources.iter().any(|source| source.quantity == quantity);
        let axis = |motor| Axis {
            motion: Motion::new(has(Quantity::Angle(motor)), has(Quantity::Speed(motor))),
            torque_nm: 0.0,
            temperature_c: f64::NAN,
        };
        let pitch = Motion::new(has(Quantity::Pitch), has(Quantity::PitchRate));
        let motors = Motor::BOTH.map(axis);
        Ok(Self { sources, torque_constant_nm_a, pitch, motors })
    }

    /// Whether pitch or its rate is chosen.
    pub fn has_pitch(&self) -> bool {
        self.pitch.has.contains(&true)
    }

    /// Whether a motor's torque is chosen.
    pub fn has_torque(&self, motor: Motor) -> bool {
        self.sources.iter().any(|source| source.quantity == Quantity::Torque(motor))
    }

    /// A motor of which neither angle nor speed is chosen.
    pub fn missing_motor(&self) -> Option<Motor> {
        Motor::BOTH.into_iter().find(|motor| !self.motors[*motor as usize].motion.has.contains(&true))
    }

    /// What a frame tells; at most one reading of each motor and of the pitch. Values that are no finite number tell
    /// nothing.
    pub fn receive(&mut self, stamped: &StampedFrame) -> impl Iterator<Item = Heard> + use<> {
        let StampedFrame { time, frame, .. } = *stamped;
        let mut pitch = [None; 2];
        let mut motors = [[None; 2]; 2];
        for source in self.sources.iter().filter(|source| source.id == frame.id()) {
            let value = source.signal.value(&frame).map(|value| value * source.factor);
            // A float signal may be no number; added up, a single one would stay permanently.
            let Some(value) = value.filter(|value| value.is_finite()) else { continue };
            match source.quantity {
                Quantity::Pitch => pitch[0] = Some(value),
                Quantity::PitchRate => pitch[1] = Some(value),
                Quantity::Angle(motor) => motors[motor as usize][0] = Some(value),
                Quantity::Speed(motor) => motors[motor as usize][1] = Some(value),
                Quantity::Torque(motor) => self.motors[motor as usize].torque_nm = value,
                Quantity::Temperature(motor) => self.motors[motor as usize].temperature_c = value,
            }
        }
        let [left, right] = Motor::BOTH.map(|motor| self.motor(motor, time, motors[motor as usize]));
        let imu = self.pitch.hear(time, pitch).map(|[pitch_rad, pitch_rate_rad_s]| {
            let (tilt_rad, yaw_rate_rad_s, temperature_c) = (None, None, None);
            Heard::Imu(ImuReading {
                time,
                pitch_rad,
                pitch_rate_rad_s,
                tilt_rad,
                yaw_rate_rad_s,
                temperature_c,
            })
        });
        [left, right, imu].into_iter().flatten()
    }

    fn motor(&mut self, motor: Motor, time: Duration, values: [Option<f64>; 2]) -> Option<Heard> {
        let axis = &mut self.motors[motor as usize];
        let [angle_rad, speed_rad_s] = axis.motion.hear(time, values)?;
        let current_a = axis.torque_nm / self.torque_constant_nm_a;
        let state = MotorState { time, angle_rad, speed_rad_s, current_a, temperature_c: axis.temperature_c };
        Some(Heard::Motor(MotorEvent::State(motor, state)))
    }
}

fn source(dbc: &Dbc, choice: &Choice) -> Result<Source, ChoiceError> {
    let Choice { quantity, ref message, ref signal, factor } = *choice;
    let full = message.as_ref().map_or(signal.clone(), |message| format!("{message}.{signal}"));
    let mut found = dbc.signals().filter(|(in_message, known)| {
        known.name == *signal && message.as_ref().is_none_or(|message| *message == in_message.name)
    });
    let first = found.next();
    let (message, known) =
        first.ok_or_else(|| ChoiceError::NoSuchSignal { quantity, signal: full.clone() })?;
    if let Some((other, _)) = found.next() {
        let (first, second) = (message.name.clone(), other.name.clone());
        return Err(ChoiceError::Ambiguous { signal: signal.clone(), first, second });
    }
    if !known.fits() {
        return Err(ChoiceError::TooFar { signal: full });
    }
    let factor = factor.or_else(|| quantity.factor_from_unit(&known.unit));
    let factor =
        factor.ok_or_else(|| ChoiceError::Unit { quantity, signal: full, unit: known.unit.clone() })?;
    Ok(Source { quantity, id: message.id, signal: known.clone(), factor })
}

/// A position and its rate, of which one may have to be made from the other.
#[derive(Clone, Copy, Debug)]
struct Motion {
    has: [bool; 2],
    /// Newest position and rate.
    values: [Option<f64>; 2],
    time: Duration,
}

impl Motion {
    fn new(has_position: bool, has_rate: bool) -> Self {
        Self { has: [has_position, has_rate], values: [None; 2], time: Duration::ZERO }
    }

    /// Takes in what a frame has of the two; position and rate where they are new.
    fn hear(&mut self, time: Duration, [position, rate]: [Option<f64>; 2]) -> Option<[f64; 2]> {
        let elapsed_s = time.saturating_sub(self.time).as_secs_f64();
        let [last_position, last_rate] = self.values;
        let both = match self.has {
            [true, true] => {
                self.values[1] = rate.or(last_rate);
                Some([position?, self.values[1]?])
            }
            [true, false] => {
                let moved = position? - last_position.unwrap_or(position?);
                let rate = if elapsed_s > 0.0 { moved / elapsed_s } else { last_rate.unwrap_or(0.0) };
                Some([position?, rate])
            }
            [false, true] => {
                let mean = (last_rate.unwrap_or(rate?) + rate?) / 2.0;
                Some([last_position.map_or(0.0, |position| position + mean * elapsed_s), rate?])
            }
            [false, false] => None,
        }?;
        self.values = both.map(Some);
        self.time = time;
        Some(both)
    }
}
