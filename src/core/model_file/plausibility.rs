//! Values of a model that look like a slip of the unit.

use std::fmt;
use std::ops::RangeInclusive;

use super::Entry;
use crate::model::{Model, PARAMETERS};
use crate::unit_slip::{
    self, CENTIMETRES, DEGREES, DEGREES_PER_SECOND, GRAM_SQUARE_CENTIMETRES, KILOGRAM_SQUARE_CENTIMETRES,
    KILOGRAM_SQUARE_MILLIMETRES, MICROSECONDS, MILLIMETRES, MILLINEWTON_METRES, MILLISECONDS, RPM, UnitSlip,
};

/// A value of a model file that no real machine is likely to have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelWarning {
    /// Tables and key with points between them, as in `robot.com_height_m`.
    pub key: String,
    /// Reason why it is implausible, with the unit probably meant.
    pub text: String,
}

impl fmt::Display for ModelWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.key, self.text)
    }
}

/// Key, unit, plausible range and likely units of one kind of number, in the tables that begin with a word.
type Row = (&'static str, &'static str, &'static str, RangeInclusive<f64>, &'static [UnitSlip]);

const LENGTH: &[UnitSlip] = &[MILLIMETRES, CENTIMETRES];
const INERTIA: &[UnitSlip] =
    &[KILOGRAM_SQUARE_CENTIMETRES, KILOGRAM_SQUARE_MILLIMETRES, GRAM_SQUARE_CENTIMETRES];
const TORQUE: &[UnitSlip] = &[MILLINEWTON_METRES];
const TIME: &[UnitSlip] = &[MILLISECONDS, MICROSECONDS];

/// Numbers that are not among the [`PARAMETERS`], as plausible as those.
const ROWS: [Row; 16] = [
    ("robot", "leg_height_m", "m", 0.01..=2.0, LENGTH),
    ("chassis", "track_width_m", "m", 0.03..=3.0, LENGTH),
    ("chassis", "yaw_inertia_kg_m2", "kg m²", 1e-7..=100.0, INERTIA),
    ("compensation", "smoothing_speed_rad_s", "rad/s", 1e-5..=10.0, &[DEGREES_PER_SECOND, RPM]),
    ("limits", "torque_nm", "N m", 0.005..=200.0, TORQUE),
    ("limits", "torque_slew_nm_s", "N m/s", 0.1..=1e6, &[]),
    ("limits", "rated_speed_rad_s", "rad/s", 1.0..=300.0, &[RPM, DEGREES_PER_SECOND]),
    ("limits", "no_load_speed_rad_s", "rad/s", 1.0..=400.0, &[RPM, DEGREES_PER_SECOND]),
    ("actuation", "delay_s", "s", 0.0..=0.1, TIME),
    ("actuation", "torque_noise_nm", "N m", 0.0..=5.0, TORQUE),
    ("actuation", "torque_step_nm", "N m", 0.0..=1.0, TORQUE),
    ("sensors", "imu_latency_s", "s", 0.0..=0.1, TIME),
    ("sensors", "pitch_noise_rad", "rad", 0.0..=0.05, &[DEGREES]),
    ("sensors", "pitch_rate_noise_rad_s", "rad/s", 0.0..=1.0, &[DEGREES_PER_SECOND]),
    ("surroundings", "slope_rad", "rad", -0.7..=0.7, &[DEGREES]),
    ("link", "torque_constant_nm_a", "N m/A", 0.003..=20.0, &[]),
];

/// Static friction below Coulomb friction, which no bearing has.
const STATIC_AND_COULOMB: [(&str, &str, &str); 2] =
    [("static_nm", "coulomb_nm", "N m"), ("static_n", "coulomb_n", "N")];

impl Model {
    /// Lists the values that look like a slip of the unit or of the key, in the order of the keys.
    pub fn warnings(&self) -> Vec<ModelWarning> {
        let entries = self.entries();
        let number = |key: &str| match entries.get(key) {
            Some(Entry::Number(value)) => Some(*value),
            _ => None,
        };
        let mut warnings = Vec::new();
        for (key, entry) in &entries {
            let Entry::Number(value) = *entry else { continue };
            let text = implausible(key, value).or_else(|| {
                let (table, last) = key.rsplit_once('.')?;
                let (_, coulomb, unit) = STATIC_AND_COULOMB.into_iter().find(|(name, ..)| *name == last)?;
                let sliding = number(&format!("{table}.{coulomb}")).filter(|sliding| value < *sliding)?;
                Some(format!(
                    "{} {unit} is below {coulomb} = {} {unit}: breakaway needs at least the torque that sustains \
                     motion; check whether the two are exchanged",
                    unit_slip::digits(value),
                    unit_slip::digits(sliding)
                ))
            });
            warnings.extend(text.map(|text| ModelWarning { key: key.clone(), text }));
        }
        warnings
    }
}

/// Checks the plausibility of the value of a key such as `robot.com_height_m.com_height_m[2]`.
fn implausible(key: &str, value: f64) -> Option<String> {
    let table = key.split('.').next()?;
    let name = key.rsplit('.').next()?.split('[').next()?;
    let parameter = PARAMETERS.iter().find(|row| row.table == table && row.key == name);
    let of_parameter = parameter.map(|row| (row.unit, &row.plausible, row.slips));
    let other = || ROWS.iter().find(|row| row.0 == table && row.1 == name);
    let (unit, range, slips) = of_parameter.or_else(|| other().map(|row| (row.2, &row.3, row.4)))?;
    if range.contains(&value) {
        return None;
    }
    let hint = unit_slip::hint(value, unit, range, slips);
    Some(hint.unwrap_or_else(|| {
        let bound = if value > *range.end() { range.end() } else { range.start() };
        let side = if value > *range.end() { "above" } else { "below" };
        let [value, bound] = [value, *bound].map(unit_slip::digits);
        format!("{value} {unit} is {side} {bound} {unit}, which is unlikely: check the value and its unit")
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::presets;

    #[test]
    fn presets_have_no_warnings() {
        for (name, text) in presets::ALL {
            assert_eq!(Model::from_toml(text, name).unwrap().warnings(), [], "{name}");
        }
    }

    const ROBOT: &str = "name = \"robot\"\n[robot]\nbody_mass_kg = 13.0\nwheel_mass_kg = 1.0\n\
        wheel_inertia_kg_m2 = 0.005\nwheel_radius_m = 0.085\ncom_height_m = 0.2\nbody_inertia_kg_m2 = 0.25\n\
        [friction.left]\ncoulomb_nm = 0.03\nstatic_nm = 0.07\nviscous_nm_s_rad = 0.0005\n\
        stribeck_speed_rad_s = 1.6\nstribeck_exponent = 0.23\noffset_nm = 0.0\n\
        [limits]\nno_load_speed_rad_s = 75.0\n[sensors]\npitch_noise_rad = 0.0017\n";

    #[test]
    fn a_slip_is_named_with_its_key_and_the_unit_that_was_meant() {
        for (old, new, key, part) in [
            (
                "com_height_m = 0.2",
                "com_height_m = 200.0",
                "robot.com_height_m",
                "millimetres: 200 mm is 0.2 m",
            ),
            ("radius_m = 0.085", "radius_m = 85.0", "robot.wheel_radius_m", "millimetres: 85 mm is 0.085 m"),
            ("radius_m = 0.085", "radius_m = 8.5", "robot.wheel_radius_m", "centimetres: 8.5 cm is 0.085 m"),
            (
                "body_mass_kg = 13.0",
                "body_mass_kg = 13000.0",
                "robot.body_mass_kg",
                "grams: 13000 g is 13 kg",
            ),
            (
                "inertia_kg_m2 = 0.25",
                "inertia_kg_m2 = 2500.0",
                "robot.body_inertia_kg_m2",
                "2500 kg cm² is 0.25 kg m²",
            ),
            (
                "static_nm = 0.07",
                "static_nm = 0.02",
                "friction.left.static_nm",
                "below coulomb_nm = 0.03 N m",
            ),
            ("static_nm = 0.07", "static_nm = 70.0", "friction.left.static_nm", "70 mN m is 0.07 N m"),
            (
                "speed_rad_s = 75.0",
                "speed_rad_s = 716.0",
                "limits.no_load_speed_rad_s",
                "716 rpm is 75 rad/s",
            ),
            (
                "noise_rad = 0.0017",
                "noise_rad = 0.1",
                "sensors.pitch_noise_rad",
                "degrees: 0.1° is 0.00175 rad",
            ),
            (
                "body_mass_kg = 13.0",
                "body_mass_kg = 1e9",
                "robot.body_mass_kg",
                "is above 300 kg, which is unlikely",
            ),
        ] {
            let text = ROBOT.replacen(old, new, 1);
            assert_ne!(text, ROBOT, "{old}");
            let warnings = Model::from_toml(&text, "m.toml").unwrap().warnings();
            let [only] = &warnings[..] else { panic!("{new}: {warnings:?}") };
            assert!(only.key == key && only.text.contains(part), "{only} ({part})");
        }
        assert_eq!(Model::from_toml(ROBOT, "m.toml").unwrap().warnings(), []);
    }

    #[test]
    fn every_node_of_a_table_over_the_height_is_looked_at() {
        let (name, paper) = presets::ALL[0];
        let text = paper.replacen("com_height_m = [0.16, 0.25]", "com_height_m = [160.0, 250.0]", 1);
        let warnings = Model::from_toml(&text, name).unwrap().warnings();
        let keys: Vec<_> = warnings.iter().map(|warning| warning.key.as_str()).collect();
        assert_eq!(keys, ["robot.com_height_m.com_height_m[1]", "robot.com_height_m.com_height_m[2]"]);
    }
}
