//! The tables of a single motor's or axis' model file as TOML has them, and their checks.

use serde::{Deserialize, Serialize};

use super::effects_schema;
use super::effects_schema::EffectTable;
use super::refusal::Refusal;
use super::tolerance::ToleranceTable;
use crate::friction::{Stribeck, StribeckParameters};
use crate::model::MachineKind;
use crate::model::{AxisModel, AxisParameters, Model, Rig};
use crate::parameter::{ParameterError, finite, positive};

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisFile {
    name: String,
    axis: AxisTable,
    friction: Option<AxisFrictionTable>,
    #[serde(default, skip_serializing_if = "ToleranceTable::is_default")]
    tolerance: ToleranceTable,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effects: Vec<EffectTable>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase", tag = "kind")]
enum AxisTable {
    Rotary {
        inertia_kg_m2: f64,
        #[serde(default)]
        gravity_torque_nm: f64,
    },
    Linear {
        mass_kg: f64,
    },
}

/// Friction keys of both kinds of axis; those of the other kind are refused.
#[derive(Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct AxisFrictionTable {
    coulomb_nm: Option<f64>,
    static_nm: Option<f64>,
    viscous_nm_s_rad: Option<f64>,
    stribeck_speed_rad_s: Option<f64>,
    offset_nm: Option<f64>,
    coulomb_n: Option<f64>,
    static_n: Option<f64>,
    viscous_n_s_m: Option<f64>,
    stribeck_speed_m_s: Option<f64>,
    offset_n: Option<f64>,
    stribeck_exponent: Option<f64>,
    /// Lowest and highest speed of the motion that the numbers come from.
    fitted_speed_range_rad_s: Option<[f64; 2]>,
    fitted_speed_range_m_s: Option<[f64; 2]>,
}

/// One kind's keys and values in the order Coulomb, viscous, offset, static, Stribeck speed.
type AxisKeys = [(&'static str, Option<f64>); 5];

impl AxisFrictionTable {
    fn rotary(&self) -> AxisKeys {
        [
            ("coulomb_nm", self.coulomb_nm),
            ("viscous_nm_s_rad", self.viscous_nm_s_rad),
            ("offset_nm", self.offset_nm),
            ("static_nm", self.static_nm),
            ("stribeck_speed_rad_s", self.stribeck_speed_rad_s),
        ]
    }

    fn linear(&self) -> AxisKeys {
        [
            ("coulomb_n", self.coulomb_n),
            ("viscous_n_s_m", self.viscous_n_s_m),
            ("offset_n", self.offset_n),
            ("static_n", self.static_n),
            ("stribeck_speed_m_s", self.stribeck_speed_m_s),
        ]
    }

    /// Speeds that the curve comes from, on one kind of axis.
    fn told_from(&self, linear: bool) -> Result<Option<[f64; 2]>, Refusal> {
        let keys = [
            ("fitted_speed_range_rad_s", self.fitted_speed_range_rad_s),
            ("fitted_speed_range_m_s", self.fitted_speed_range_m_s),
        ];
        let [(own, range), (other, wrong)] = if linear { [keys[1], keys[0]] } else { keys };
        if wrong.is_some() {
            let problem = format!("{other} has the unit of the other kind of axis: use {own}");
            return Err(Refusal::new(&["friction", other], problem));
        }
        match range {
            Some([low, high]) if !(0.0 <= low && low < high && high.is_finite()) => {
                let problem = format!("{own} must be the lowest and the highest speed, such as [0.5, 12.0]");
                Err(Refusal::new(&["friction", own], problem))
            }
            range => Ok(range),
        }
    }

    /// A missing Stribeck part means plain Coulomb friction: static level equal to the Coulomb level.
    fn curve(&self, own: AxisKeys, other: AxisKeys) -> Result<Stribeck, Refusal> {
        if let Some((key, _)) = other.iter().find(|(_, value)| value.is_some()) {
            let problem =
                format!("{key} has the unit of the other kind of axis: use {}", own.map(|k| k.0).join(", "));
            return Err(Refusal::new(&["friction", key], problem));
        }
        let needed = |(key, value): (&'static str, Option<f64>)| {
            value.ok_or_else(|| Refusal::new(&["friction"], format!("[friction] lacks {key}: add it")))
        };
        let coulomb_nm = needed(own[0])?;
        let parameters = StribeckParameters {
            coulomb_nm,
            viscous_nm_s_rad: needed(own[1])?,
            offset_nm: own[2].1.unwrap_or(0.0),
            static_nm: own[3].1.unwrap_or(coulomb_nm),
            stribeck_speed_rad_s: own[4].1.unwrap_or(1.0),
            stribeck_exponent: self.stribeck_exponent.unwrap_or(1.0),
        };
        Stribeck::new(parameters).map_err(|error| {
            let rotary = ["coulomb_nm", "viscous_nm_s_rad", "offset_nm", "static_nm", "stribeck_speed_rad_s"];
            let name = rotary.iter().position(|&key| key == error.name).map_or(error.name, |i| own[i].0);
            Refusal::parameter(&["friction"])(ParameterError { name, ..error })
        })
    }
}

impl AxisFile {
    pub(super) fn into_model(self) -> Result<Model, Refusal> {
        let friction = self.friction.as_ref();
        let (parameters, machine) = match self.axis {
            AxisTable::Rotary { inertia_kg_m2, gravity_torque_nm } => {
                positive("inertia_kg_m2", inertia_kg_m2).map_err(Refusal::parameter(&["axis"]))?;
                finite("gravity_torque_nm", gravity_torque_nm).map_err(Refusal::parameter(&["axis"]))?;
                let friction =
                    friction.map(|table| table.curve(table.rotary(), table.linear())).transpose()?;
                (AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction }, MachineKind::Rotary)
            }
            AxisTable::Linear { mass_kg } => {
                positive("mass_kg", mass_kg).map_err(Refusal::parameter(&["axis"]))?;
                let friction =
                    friction.map(|table| table.curve(table.linear(), table.rotary())).transpose()?;
                (AxisParameters::Linear { mass_kg, friction }, MachineKind::Linear)
            }
        };
        let mut axis = AxisModel::new(parameters);
        let linear = machine == MachineKind::Linear;
        axis.fitted_speed_range = friction.map(|table| table.told_from(linear)).transpose()?.flatten();
        effects_schema::read_into_axis(self.effects, machine, &mut axis)?;
        let tolerance = self.tolerance.read(machine)?;
        Ok(Model { name: self.name, rig: Rig::Axis(axis), tolerance })
    }

    pub(super) fn from_model(model: &Model, own: &AxisModel) -> Self {
        let (axis, friction) = match own.parameters {
            AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction } => {
                let table = friction.map(|curve| {
                    let p = curve.parameters();
                    AxisFrictionTable {
                        coulomb_nm: Some(p.coulomb_nm),
                        static_nm: Some(p.static_nm),
                        viscous_nm_s_rad: Some(p.viscous_nm_s_rad),
                        stribeck_speed_rad_s: Some(p.stribeck_speed_rad_s),
                        stribeck_exponent: Some(p.stribeck_exponent),
                        offset_nm: Some(p.offset_nm),
                        fitted_speed_range_rad_s: own.fitted_speed_range,
                        ..AxisFrictionTable::default()
                    }
                });
                (AxisTable::Rotary { inertia_kg_m2, gravity_torque_nm }, table)
            }
            AxisParameters::Linear { mass_kg, friction } => {
                let table = friction.map(|curve| {
                    let p = curve.parameters();
                    AxisFrictionTable {
                        coulomb_n: Some(p.coulomb_nm),
                        static_n: Some(p.static_nm),
                        viscous_n_s_m: Some(p.viscous_nm_s_rad),
                        stribeck_speed_m_s: Some(p.stribeck_speed_rad_s),
                        stribeck_exponent: Some(p.stribeck_exponent),
                        offset_n: Some(p.offset_nm),
                        fitted_speed_range_m_s: own.fitted_speed_range,
                        ..AxisFrictionTable::default()
                    }
                });
                (AxisTable::Linear { mass_kg }, table)
            }
        };
        Self {
            name: model.name.clone(),
            axis,
            friction,
            tolerance: ToleranceTable::Written(model.tolerance.clone()),
            effects: effects_schema::written(&own.effects),
        }
    }
}
