//! Use of a fit in a model.

use flqr_core::friction::{Stribeck, StribeckParameters};
use flqr_core::identify::FitReport;
use flqr_core::model::{AxisParameters, Rig};

use crate::command::Target;

/// The result of a fit as a model takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fitted {
    /// A shaft, in N m and rad/s.
    Rotary {
        /// Friction on the shaft.
        curve: Stribeck,
        /// Inertia, where the fit has one, kg m².
        inertia_kg_m2: Option<f64>,
        /// Load, where the fit has one, N m.
        gravity_torque_nm: Option<f64>,
    },
    /// A carriage; the fields of the curve hold N and m/s.
    Linear {
        /// Friction of the carriage.
        curve: Stribeck,
        /// Mass, where the fit has one, kg.
        mass_kg: Option<f64>,
    },
}

/// Keys of a report in the order Coulomb, viscous, offset, static, Stribeck speed.
type Keys = [&'static str; 5];

const ROTARY: Keys = ["coulomb_nm", "viscous_nm_s_rad", "offset_nm", "static_nm", "stribeck_speed_rad_s"];
const LINEAR: Keys = ["coulomb_n", "viscous_n_s_m", "offset_n", "static_n", "stribeck_speed_m_s"];

impl Fitted {
    /// The result of a fit; a missing Stribeck part means plain Coulomb friction, as in a model file.
    ///
    /// # Errors
    /// A sentence where the fit has no curve, or values that no axis has.
    pub(super) fn of(report: &FitReport) -> Result<Self, String> {
        let value = |key| report.parameters.get(key).map(|estimate| estimate.value);
        Ok(if LINEAR.iter().any(|key| report.parameters.contains_key(key)) {
            Self::Linear { curve: curve(report, LINEAR)?, mass_kg: above_0("mass_kg", value("mass_kg"))? }
        } else {
            Self::Rotary {
                curve: curve(report, ROTARY)?,
                inertia_kg_m2: above_0("inertia_kg_m2", value("inertia_kg_m2"))?,
                gravity_torque_nm: value("gravity_torque_nm"),
            }
        })
    }

    /// Returns whether a model can have this.
    ///
    /// # Errors
    /// A sentence where the units are of the other kind of axis.
    pub(crate) fn check(&self, rig: &Rig) -> Result<(), String> {
        let model_is_linear =
            matches!(rig, Rig::Axis(axis) if matches!(axis.parameters, AxisParameters::Linear { .. }));
        let problem = match (self, model_is_linear) {
            (Self::Linear { .. }, true) | (Self::Rotary { .. }, false) => return Ok(()),
            (Self::Linear { .. }, false) => {
                "This fit is of a linear axis (N, m/s), but the model uses N m and rad/s. Open the model of a linear axis."
            }
            (Self::Rotary { .. }, true) => {
                "This fit is of a motor (N m, rad/s), but the model is a linear axis. Open the model of a robot or a motor."
            }
        };
        Err(problem.to_owned())
    }

    /// Puts the result into a model, of a robot into the motors of `target`; says what was done.
    ///
    /// # Errors
    /// As of [`Fitted::check`]; the model is as before.
    pub(crate) fn put_into(self, rig: &mut Rig, target: Target) -> Result<&'static str, String> {
        self.check(rig)?;
        match (self, rig) {
            (Self::Rotary { curve, .. } | Self::Linear { curve, .. }, Rig::Robot(robot)) => {
                if target != Target::Right {
                    robot.friction[0] = Some(curve);
                }
                if target != Target::Left {
                    robot.friction[1] = Some(curve);
                }
                return Ok(match target {
                    Target::Left => "The fitted friction is used for the left motor.",
                    Target::Right => "The fitted friction is used for the right motor.",
                    Target::Both => "The fitted friction is used for both motors.",
                });
            }
            (fitted, Rig::Axis(axis)) => {
                fitted.put_into_axis(&mut axis.parameters);
                // Those of the friction of before.
                axis.fitted_speed_range = None;
            }
        }
        Ok("The fitted values are used for the axis.")
    }

    fn put_into_axis(self, axis: &mut AxisParameters) {
        match (self, axis) {
            (Self::Linear { curve, mass_kg: fitted }, AxisParameters::Linear { mass_kg, friction }) => {
                *friction = Some(curve);
                *mass_kg = fitted.unwrap_or(*mass_kg);
            }
            (
                Self::Rotary { curve, inertia_kg_m2: fitted, gravity_torque_nm: load },
                AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction },
            ) => {
                *friction = Some(curve);
                *inertia_kg_m2 = fitted.unwrap_or(*inertia_kg_m2);
                *gravity_torque_nm = load.unwrap_or(*gravity_torque_nm);
            }
            // `check` has refused these.
            (Self::Linear { .. }, AxisParameters::Rotary { .. })
            | (Self::Rotary { .. }, AxisParameters::Linear { .. }) => {}
        }
    }
}

fn curve(report: &FitReport, keys: Keys) -> Result<Stribeck, String> {
    let value = |key| report.parameters.get(key).map(|estimate| estimate.value);
    let [coulomb, viscous, offset, sticking, speed] = keys.map(value);
    let (Some(coulomb_nm), Some(viscous_nm_s_rad)) = (coulomb, viscous) else {
        return Err(
            "This fit has no Coulomb and viscous friction. Estimate them to use it in the model.".to_owned()
        );
    };
    let parameters = StribeckParameters {
        coulomb_nm,
        viscous_nm_s_rad,
        offset_nm: offset.unwrap_or(0.0),
        static_nm: sticking.unwrap_or(coulomb_nm),
        stribeck_speed_rad_s: speed.unwrap_or(1.0),
        stribeck_exponent: value("stribeck_exponent").unwrap_or(1.0),
    };
    Stribeck::new(parameters).map_err(|problem| {
        let key = ROTARY.iter().position(|&key| key == problem.name).map_or(problem.name, |i| keys[i]);
        format!("The fitted {key} must be {} to be used in the model.", problem.allowed)
    })
}

fn above_0(key: &str, value: Option<f64>) -> Result<Option<f64>, String> {
    match value {
        Some(value) if !(value.is_finite() && value > 0.0) => {
            Err(format!("The fitted {key} must be a finite number above 0 to be used in the model."))
        }
        other => Ok(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flqr_core::model::{AxisModel, Model};

    /// The speeds that the friction of before came from are not those of the fit.
    #[test]
    fn a_fitted_curve_does_not_keep_the_speeds_of_another() {
        let text = "name = \"shaft\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.005\n[friction]\n\
                    coulomb_nm = 0.03\nviscous_nm_s_rad = 0.0005\ntold_from_rad_s = [0.1, 10.5]\n";
        let mut model = Model::from_toml(text, "shaft.toml").unwrap();
        let told_from = |model: &Model| match &model.rig {
            Rig::Axis(AxisModel { fitted_speed_range, .. }) => *fitted_speed_range,
            Rig::Robot(_) => panic!("an axis was read"),
        };
        assert_eq!(told_from(&model), Some([0.1, 10.5]));
        let parameters = StribeckParameters {
            coulomb_nm: 0.04,
            static_nm: 0.04,
            viscous_nm_s_rad: 0.001,
            stribeck_speed_rad_s: 1.0,
            stribeck_exponent: 1.0,
            offset_nm: 0.0,
        };
        let curve = Stribeck::new(parameters).unwrap();
        let fitted = Fitted::Rotary { curve, inertia_kg_m2: None, gravity_torque_nm: None };
        fitted.put_into(&mut model.rig, Target::Both).unwrap();
        assert_eq!(told_from(&model), None);
        assert!(!model.to_toml().contains("told_from"));
    }
}
