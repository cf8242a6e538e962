//! Limits at which a driven robot is stopped.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::parameter::{ParameterError, positive};
use crate::unit_slip::{
    self, DEGREES, DEGREES_PER_SECOND, FAHRENHEIT, KELVIN, KILOMETRES_PER_HOUR, MILLIMETRES,
    MILLIMETRES_PER_SECOND, MILLISECONDS, MILLIVOLTS, RPM, UnitSlip,
};

/// Keys of the model file's `[safety]` table: a robot that exceeds one of these limits is stopped, with zero torque
/// and its motors off. Torque and its slew are limited by `[limits]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SafetyLimits {
    /// Largest pitch, rad. Default: 0.5.
    pub tilt_rad: f64,
    /// Largest speed on the ground, m/s. Default: 1.5.
    pub speed_m_s: f64,
    /// Largest distance from where the robot was armed, m. Default: 2.
    pub distance_m: f64,
    /// Largest speed of a motor with its wheel in the air, rad/s. Default: 60.
    pub motor_speed_rad_s: f64,
    /// Largest speed of a motor while the robot balances, rad/s. Default: 40.
    pub wheel_speed_rad_s: f64,
    /// Largest yaw rate while the robot balances, rad/s. Default: 3.
    pub yaw_rate_rad_s: f64,
    /// Longest time without a reading of the IMU, s. Default: 0.05.
    pub imu_timeout_s: f64,
    /// Longest time for which the IMU may repeat the same bytes, s. Default: 0.2.
    pub imu_frozen_s: f64,
    /// Longest time without a reply of a motor, s. Default: 0.02.
    pub motor_timeout_s: f64,
    /// Highest motor temperature, °C. Default: 80.
    pub temperature_c: f64,
    /// Lowest supply voltage, V. Default: 20.
    pub least_voltage_v: f64,
    /// Highest supply voltage, V. Default: 30.
    pub greatest_voltage_v: f64,
    /// Longest delay of a tick of the control loop, s. Default: 0.02.
    pub late_s: f64,
    /// Longest time from a query to its reply, s; exceeded by a quarter of the last 24 queries. Default: 0.01.
    pub round_trip_s: f64,
    /// Largest difference between the change of the pitch and the integrated pitch rate within about 1 s, rad; three
    /// tenths of it while one of the two does not change at all. Default: 0.1.
    pub pitch_mismatch_rad: f64,
    /// Largest difference between the pitch and the direction of gravity, averaged over 1 s, rad. Default: 0.15.
    pub gravity_mismatch_rad: f64,
    /// Largest difference between the change of a motor's angle and its integrated speed within about 1 s, rad.
    /// Default: 0.3.
    pub encoder_mismatch_rad: f64,
    /// Largest difference between the turn by the wheels and by the IMU's yaw rate within about 5 s, rad. Default: 0.2.
    pub yaw_mismatch_rad: f64,
    /// Largest change of a motor's speed that its torque must have caused and that its encoder does not show, rad/s.
    /// Default: 1.
    pub motion_mismatch_rad_s: f64,
    /// How the motors are stopped. Default: off.
    pub stop: StopAction,
    /// Permits limits with which a check never stops the robot. Default: false.
    pub allow_unsafe: bool,
}

/// Stop action.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopAction {
    /// Zero torque and motors off at once.
    #[default]
    Off,
    /// Zero torque until both motors turn slower than 1 rad/s, for 1 s at most, then motors off; a motor that is
    /// silent is switched off at once.
    ZeroThenOff,
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self {
            tilt_rad: 0.5,
            speed_m_s: 1.5,
            distance_m: 2.0,
            motor_speed_rad_s: 60.0,
            wheel_speed_rad_s: 40.0,
            yaw_rate_rad_s: 3.0,
            imu_timeout_s: 0.05,
            imu_frozen_s: 0.2,
            motor_timeout_s: 0.02,
            temperature_c: 80.0,
            least_voltage_v: 20.0,
            greatest_voltage_v: 30.0,
            late_s: 0.02,
            round_trip_s: 0.01,
            pitch_mismatch_rad: 0.1,
            gravity_mismatch_rad: 0.15,
            encoder_mismatch_rad: 0.3,
            yaw_mismatch_rad: 0.2,
            motion_mismatch_rad_s: 1.0,
            stop: StopAction::Off,
            allow_unsafe: false,
        }
    }
}

/// One limit: its key, its unit, the values with which its check can act, the units that it is mistaken for, and its
/// place. Beyond the bounds the check is switched off in effect.
struct Limit {
    key: &'static str,
    unit: &'static str,
    bounds: RangeInclusive<f64>,
    slips: &'static [UnitSlip],
    value: fn(&SafetyLimits) -> f64,
}

const fn limit(
    key: &'static str,
    unit: &'static str,
    bounds: RangeInclusive<f64>,
    slips: &'static [UnitSlip],
    value: fn(&SafetyLimits) -> f64,
) -> Limit {
    Limit { key, unit, bounds, slips, value }
}

/// Longest time-out, s: an unstable robot has fallen well before.
const TIMEOUT: RangeInclusive<f64> = 0.0..=1.0;

/// Every limit. A robot on the floor is at about 90°; wheels at 300 rad/s turn at 2865 rpm, more than any hub motor;
/// the windings of a motor do not survive 150 °C; below 5 V no drive works, and above 100 V none of this kind.
const LIMITS: [Limit; 19] = [
    limit("tilt_rad", "rad", 0.0..=1.57, &[DEGREES], |s| s.tilt_rad),
    limit("speed_m_s", "m/s", 0.0..=10.0, &[KILOMETRES_PER_HOUR, MILLIMETRES_PER_SECOND], |s| s.speed_m_s),
    limit("distance_m", "m", 0.0..=100.0, &[MILLIMETRES], |s| s.distance_m),
    limit("motor_speed_rad_s", "rad/s", 0.0..=300.0, &[RPM], |s| s.motor_speed_rad_s),
    limit("wheel_speed_rad_s", "rad/s", 0.0..=300.0, &[RPM], |s| s.wheel_speed_rad_s),
    limit("yaw_rate_rad_s", "rad/s", 0.0..=30.0, &[DEGREES_PER_SECOND], |s| s.yaw_rate_rad_s),
    limit("imu_timeout_s", "s", TIMEOUT, &[MILLISECONDS], |s| s.imu_timeout_s),
    limit("imu_frozen_s", "s", TIMEOUT, &[MILLISECONDS], |s| s.imu_frozen_s),
    limit("motor_timeout_s", "s", TIMEOUT, &[MILLISECONDS], |s| s.motor_timeout_s),
    limit("temperature_c", "°C", 0.0..=150.0, &[FAHRENHEIT, KELVIN], |s| s.temperature_c),
    limit("least_voltage_v", "V", 5.0..=100.0, &[MILLIVOLTS], |s| s.least_voltage_v),
    limit("greatest_voltage_v", "V", 5.0..=100.0, &[MILLIVOLTS], |s| s.greatest_voltage_v),
    limit("late_s", "s", TIMEOUT, &[MILLISECONDS], |s| s.late_s),
    limit("round_trip_s", "s", TIMEOUT, &[MILLISECONDS], |s| s.round_trip_s),
    limit("pitch_mismatch_rad", "rad", 0.0..=1.57, &[DEGREES], |s| s.pitch_mismatch_rad),
    limit("gravity_mismatch_rad", "rad", 0.0..=1.57, &[DEGREES], |s| s.gravity_mismatch_rad),
    limit("encoder_mismatch_rad", "rad", 0.0..=6.3, &[DEGREES], |s| s.encoder_mismatch_rad),
    limit("yaw_mismatch_rad", "rad", 0.0..=3.15, &[DEGREES], |s| s.yaw_mismatch_rad),
    limit("motion_mismatch_rad_s", "rad/s", 0.0..=100.0, &[RPM], |s| s.motion_mismatch_rad_s),
];

impl Limit {
    /// The bound that a value exceeds, in words, and the unit that it looks like.
    fn exceeded(&self, value: f64) -> Option<(String, String)> {
        let Self { unit, bounds, .. } = self;
        let bound = match value {
            _ if value > *bounds.end() => format!("at most {} {unit}", bounds.end()),
            _ if value < *bounds.start() => format!("at least {} {unit}", bounds.start()),
            _ => return None,
        };
        let usual = 0.1 * (self.value)(&SafetyLimits::default())..=*bounds.end();
        let hint = unit_slip::hint(value, unit, &usual, self.slips);
        Some((bound, hint.map_or(String::new(), |hint| format!(" ({hint})"))))
    }
}

impl SafetyLimits {
    /// Refuses limits that are not finite and above zero, limits with which a check never stops the robot unless
    /// `allow_unsafe` is set, and voltages that exclude each other.
    ///
    /// ```
    /// use flqr_core::model::SafetyLimits;
    ///
    /// let in_degrees = SafetyLimits { tilt_rad: 30.0, ..SafetyLimits::default() };
    /// assert!(in_degrees.validate().is_err_and(|error| error.to_string().contains("degrees")));
    /// ```
    pub fn validate(&self) -> Result<(), ParameterError> {
        for limit in &LIMITS {
            let (name, value) = (limit.key, (limit.value)(self));
            positive(name, value)?;
            if let Some((bound, hint)) = limit.exceeded(value).filter(|_| !self.allow_unsafe) {
                let allowed = format!(
                    "{bound}{hint}, or [safety] needs allow_unsafe = true, because values beyond that \
                     disable the check"
                );
                return Err(ParameterError { name, value, allowed: allowed.into() });
            }
        }
        if self.greatest_voltage_v <= self.least_voltage_v {
            let value = self.greatest_voltage_v;
            let allowed = "above least_voltage_v".into();
            return Err(ParameterError { name: "greatest_voltage_v", value, allowed });
        }
        Ok(())
    }

    /// Lists the limits with which a check never stops the robot, one sentence each; to be shown before arming.
    pub fn unsafe_limits(&self) -> Vec<String> {
        let sentence = |limit: &Limit| {
            let value = (limit.value)(self);
            let (bound, hint) = limit.exceeded(value)?;
            let (key, value) = (limit.key, unit_slip::digits(value));
            Some(format!(
                "{key} = {value} in [safety] disables this check because allow_unsafe is set: the check works \
                 with {bound}{hint}"
            ))
        };
        LIMITS.iter().filter_map(sentence).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    #[test]
    fn every_limit_of_the_table_is_bounded_and_its_default_is_safe() {
        let defaults = SafetyLimits::default();
        assert_eq!((defaults.validate(), defaults.unsafe_limits()), (Ok(()), Vec::new()));
        // One number for each key, in the order of the fields; allow_unsafe is none of them.
        let table = toml::Table::try_from(defaults).unwrap();
        let keys = table.iter().filter(|(_, value)| value.is_float()).map(|(key, _)| key.as_str());
        let mut known: Vec<_> = LIMITS.iter().map(|limit| limit.key).collect();
        known.sort_unstable();
        assert_eq!(keys.collect::<Vec<_>>(), known);
        for limit in &LIMITS {
            let default = table[limit.key].as_float().unwrap();
            assert_eq!((limit.value)(&defaults), default, "{}", limit.key);
            assert!(limit.exceeded(default).is_none(), "{}", limit.key);
            assert!(limit.exceeded(1e4 * default).is_some(), "{}", limit.key);
        }
    }

    /// The model file with these lines in `[safety]`.
    fn load(lines: &str) -> Result<SafetyLimits, String> {
        let (_, paper) = crate::model_file::presets::ALL[0];
        let model = Model::from_toml(&format!("{paper}\n[safety]\n{lines}\n"), "m.toml");
        model.map(|model| model.robot().unwrap().safety).map_err(|error| error.to_string())
    }

    #[test]
    fn a_limit_that_switches_a_check_off_is_refused_with_the_unit_that_it_looks_like() {
        for (line, part) in [
            (
                "tilt_rad = 30",
                "at most 1.57 rad (30 looks like degrees: 30° is 0.524 rad), or [safety] needs",
            ),
            ("tilt_rad = 1.6", "at most 1.57 rad, or [safety] needs allow_unsafe = true"),
            ("imu_timeout_s = 50", "at most 1 s (50 looks like milliseconds: 50 ms is 0.05 s)"),
            ("imu_frozen_s = 1.1", "at most 1 s"),
            ("motor_timeout_s = 20", "milliseconds: 20 ms is 0.02 s"),
            ("late_s = 20", "milliseconds: 20 ms is 0.02 s"),
            ("temperature_c = 353.15", "at most 150 °C (353 looks like kelvin: 353 K is 80 °C)"),
            ("temperature_c = 176", "degrees Fahrenheit: 176 °F is 80 °C"),
            ("speed_m_s = 1500", "millimetres per second: 1500 mm/s is 1.5 m/s"),
            ("distance_m = 2000", "millimetres: 2000 mm is 2 m"),
            ("motor_speed_rad_s = 573", "revolutions per minute: 573 rpm is 60 rad/s"),
            ("least_voltage_v = 0.001", "at least 5 V"),
            ("greatest_voltage_v = 30000", "millivolts: 30000 mV is 30 V"),
            ("tilt_rad = 1e300", "at most 1.57 rad, or"),
            ("tilt_rad = -0.5", "a finite number above 0"),
        ] {
            let error = load(line).unwrap_err();
            assert!(error.contains(part) && error.len() <= 500, "{error} ({part})");
            let allowed = load(&format!("{line}\nallow_unsafe = true"));
            let Ok(limits) = allowed else {
                assert!(line.contains('-'), "{line}: {allowed:?}");
                continue;
            };
            let listed = limits.unsafe_limits();
            let key = line.split(' ').next().unwrap();
            assert!(matches!(&listed[..], [only] if only.starts_with(key)), "{listed:?}");
        }
        assert!(load("tilt_rad = 30\nallow_unsafe = false").is_err());
        assert_eq!(load("allow_unsafe = true").unwrap().unsafe_limits(), Vec::<String>::new());
    }
}
