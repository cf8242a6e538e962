//! Faults of an emulated robot and their times.

use std::str::FromStr;
use std::time::Duration;

use crate::link::MotorErrors;
use crate::model::Motor;

/// Duration of a push that is given on the command line, s.
const PUSH_S: f64 = 0.1;

/// Something that happens to the robot or its wires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A motor loses its supply: no torque, no reply.
    MotorVanishes(Motor),
    /// It has its supply again; as after every power-up it is on.
    MotorReturns(Motor),
    /// A motor has cause to report these errors and gives no torque; none takes the causes away, and the errors
    /// stay until they are cleared.
    MotorErrors(Motor, MotorErrors),
    /// A motor warms up or cools down to a temperature, °C, by 20 °C a second.
    MotorTemperature(Motor, f64),
    /// Voltage of the supply, V.
    Voltage(f64),
    /// The IMU sends nothing.
    ImuSilent,
    /// The IMU sends the same plausible reading again and again.
    ImuFrozen,
    /// The IMU's angles do not change any more; its rates and accelerations do.
    ImuAngleFrozen,
    /// The IMU's rates are 0; its angles and accelerations are right.
    ImuRateZero,
    /// The IMU's pitch is off by an angle, rad.
    ImuAngleOff(f64),
    /// The IMU works again.
    ImuReturns,
    /// A motor answers with the same encoder reading and speed 0, and gives torque.
    EncoderFrozen(Motor),
    /// Its encoder works again.
    EncoderReturns(Motor),
    /// A motor gives the opposite of the torque that is commanded, from now on or not any more.
    TorqueReversed(Motor),
    /// Each motor gives the torque that is commanded of the other, from now on or not any more.
    TorquesSwapped,
    /// Another controller sends a motor this command once, with its other bytes 0.
    Commanded(Motor, u8),
    /// Somebody holds the robot where it is, in place of the hand that lets it go.
    Held,
    /// It is let go.
    Released,
    /// The bus is off: no frame gets through, and motors keep their last torque.
    BusOff,
    /// The bus works again.
    BusOn,
    /// Somebody pushes the body at its centre of mass, forward positive.
    Push {
        /// Force, N.
        force_n: f64,
        /// Duration, s.
        duration_s: f64,
    },
}

/// A fault with its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedFault {
    /// When, since the start.
    pub at: Duration,
    /// Fault.
    pub fault: Fault,
}

/// A fault that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown fault `{text}`: give FAULT@SECONDS with one of {{left|right}}-vanishes, -returns, -errors=BITS, \
     -temperature=C, -encoder-frozen, -encoder-returns, -torque-reversed, -commanded=BYTE, or voltage=V, imu-silent, \
     imu-frozen, imu-angle-frozen, imu-rate-zero, imu-angle-off=RAD, imu-returns, torques-swapped, held, released, \
     bus-off, bus-on, push=N"
)]
pub struct FaultError {
    text: String,
}

impl FromStr for TimedFault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let read = || {
            let (fault, seconds) = text.split_once('@')?;
            let at = Duration::try_from_secs_f64(seconds.parse().ok()?).ok()?;
            Some(Self { at, fault: fault_of(fault)? })
        };
        read().ok_or_else(|| FaultError { text: text.to_owned() })
    }
}

fn fault_of(text: &str) -> Option<Fault> {
    let (name, value) = text.split_once('=').map_or((text, None), |(name, value)| (name, Some(value)));
    let number = || value?.parse().ok().filter(|number: &f64| number.is_finite());
    let given = |name: &str| -> Option<Fault> {
        Some(match name {
            "voltage" => Fault::Voltage(number()?),
            "imu-angle-off" => Fault::ImuAngleOff(number()?),
            "push" => Fault::Push { force_n: number()?, duration_s: PUSH_S },
            _ => {
                let (motor, what) = motor_of(name)?;
                match what {
                    "errors" => Fault::MotorErrors(motor, MotorErrors(u32::from(value?.parse::<u8>().ok()?))),
                    "temperature" => Fault::MotorTemperature(motor, number()?),
                    "commanded" => Fault::Commanded(motor, value?.parse().ok()?),
                    _ => return None,
                }
            }
        })
    };
    let alone = |name: &str| -> Option<Fault> {
        Some(match name {
            "imu-silent" => Fault::ImuSilent,
            "imu-frozen" => Fault::ImuFrozen,
            "imu-angle-frozen" => Fault::ImuAngleFrozen,
            "imu-rate-zero" => Fault::ImuRateZero,
            "imu-returns" => Fault::ImuReturns,
            "torques-swapped" => Fault::TorquesSwapped,
            "held" => Fault::Held,
            "released" => Fault::Released,
            "bus-off" => Fault::BusOff,
            "bus-on" => Fault::BusOn,
            _ => match motor_of(name)? {
                (motor, "vanishes") => Fault::MotorVanishes(motor),
                (motor, "returns") => Fault::MotorReturns(motor),
                (motor, "encoder-frozen") => Fault::EncoderFrozen(motor),
                (motor, "encoder-returns") => Fault::EncoderReturns(motor),
                (motor, "torque-reversed") => Fault::TorqueReversed(motor),
                _ => return None,
            },
        })
    };
    if value.is_some() { given(name) } else { alone(name) }
}

fn motor_of(name: &str) -> Option<(Motor, &str)> {
    let (side, what) = name.split_once('-')?;
    let motor = match side {
        "left" => Motor::Left,
        "right" => Motor::Right,
        _ => return None,
    };
    Some((motor, what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_with_their_time() {
        for (text, seconds, fault) in [
            ("left-vanishes@10", 10.0, Fault::MotorVanishes(Motor::Left)),
            ("right-returns@12.5", 12.5, Fault::MotorReturns(Motor::Right)),
            ("right-errors=9@0", 0.0, Fault::MotorErrors(Motor::Right, MotorErrors(9))),
            ("left-temperature=95@1", 1.0, Fault::MotorTemperature(Motor::Left, 95.0)),
            ("voltage=18.5@3", 3.0, Fault::Voltage(18.5)),
            ("imu-frozen@3", 3.0, Fault::ImuFrozen),
            ("imu-angle-off=-0.2@3", 3.0, Fault::ImuAngleOff(-0.2)),
            ("left-encoder-frozen@3", 3.0, Fault::EncoderFrozen(Motor::Left)),
            ("right-commanded=129@3", 3.0, Fault::Commanded(Motor::Right, 0x81)),
            ("bus-off@3", 3.0, Fault::BusOff),
            ("push=-30@3", 3.0, Fault::Push { force_n: -30.0, duration_s: 0.1 }),
        ] {
            assert_eq!(text.parse(), Ok(TimedFault { at: Duration::from_secs_f64(seconds), fault }));
        }
    }

    #[test]
    fn what_is_no_fault_is_refused_with_the_list() {
        for text in [
            "",
            "left-vanishes",
            "left-vanishes@",
            "left-vanishes@-1",
            "left-vanishes@nan",
            "left-vanishes=3@1",
            "up-vanishes@1",
            "left-errors=256@1",
            "left-errors@1",
            "voltage=inf@1",
            "imu-silent@1e300",
            "left-@1",
        ] {
            let refused = text.parse::<TimedFault>().unwrap_err().to_string();
            assert!(refused.contains(&format!("`{text}`")) && refused.contains("imu-frozen"), "{refused}");
        }
    }
}
