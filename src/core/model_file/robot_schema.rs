//! The tables of a robot's model file as TOML has them, and their checks.

use nalgebra::{Matrix2, Matrix4};
use serde::{Deserialize, Serialize};

use super::effects_schema;
use super::effects_schema::EffectTable;
use super::refusal::Refusal;
use super::tolerance::ToleranceTable;
use crate::friction::{Compensation, Stribeck, StribeckParameters};
use crate::model::{
    Actuation, Chassis, HeightNode, Legs, LinkSettings, MachineKind, MotorLimits, OverHeight,
    RobotParameters, STANDARD_GRAVITY_M_S2, SafetyLimits, SensorSettings, Surroundings, Weights, YawHold,
};
use crate::model::{Model, Rig, RobotModel};

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotFile {
    name: String,
    robot: RobotTable,
    #[serde(default, skip_serializing_if = "is_default")]
    chassis: Chassis,
    #[serde(default)]
    friction: MotorFrictionTable,
    lqr: Option<LqrTable>,
    compensation: Option<Compensation>,
    yaw_hold: Option<YawHold>,
    #[serde(default, skip_serializing_if = "is_default")]
    limits: MotorLimits,
    #[serde(default, skip_serializing_if = "is_default")]
    actuation: Actuation,
    #[serde(default, skip_serializing_if = "is_default")]
    sensors: SensorSettings,
    #[serde(default, skip_serializing_if = "is_default")]
    surroundings: Surroundings,
    #[serde(default, skip_serializing_if = "is_default")]
    link: LinkSettings,
    #[serde(default, skip_serializing_if = "is_default")]
    safety: SafetyLimits,
    #[serde(default, skip_serializing_if = "ToleranceTable::is_default")]
    tolerance: ToleranceTable,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effects: Vec<EffectTable>,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// `[robot]`: [`RobotParameters`], with tables over leg height where they change with it.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct RobotTable {
    body_mass_kg: f64,
    wheel_mass_kg: f64,
    wheel_inertia_kg_m2: f64,
    wheel_radius_m: f64,
    leg_height_m: Option<f64>,
    #[serde(default = "standard_gravity")]
    gravity_m_s2: f64,
    // TOML wants plain values in front of tables.
    com_height_m: ComHeight,
    body_inertia_kg_m2: BodyInertia,
}

fn standard_gravity() -> f64 {
    STANDARD_GRAVITY_M_S2
}

#[derive(Deserialize, Serialize)]
#[serde(untagged, expecting = "expected a number, or a table with the lists leg_height_m and com_height_m")]
enum ComHeight {
    Fixed(f64),
    OverLegHeight(ComHeightTable),
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct ComHeightTable {
    leg_height_m: Vec<f64>,
    com_height_m: Vec<f64>,
}

#[derive(Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a table with the lists leg_height_m and body_inertia_kg_m2"
)]
enum BodyInertia {
    Fixed(f64),
    OverLegHeight(BodyInertiaTable),
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct BodyInertiaTable {
    leg_height_m: Vec<f64>,
    body_inertia_kg_m2: Vec<f64>,
}

impl RobotTable {
    fn into_parameters(self) -> Result<(RobotParameters, Option<Legs>), Refusal> {
        // A quantity that changes with the height is 1 in the parameters until the height is known.
        let height = match &self.com_height_m {
            ComHeight::Fixed(value) => Ok(*value),
            ComHeight::OverLegHeight(table) => {
                Err(over_height("com_height_m", &table.leg_height_m, &table.com_height_m)?)
            }
        };
        let inertia = match &self.body_inertia_kg_m2 {
            BodyInertia::Fixed(value) => Ok(*value),
            BodyInertia::OverLegHeight(table) => {
                Err(over_height("body_inertia_kg_m2", &table.leg_height_m, &table.body_inertia_kg_m2)?)
            }
        };
        let parameters = RobotParameters {
            body_mass_kg: self.body_mass_kg,
            wheel_mass_kg: self.wheel_mass_kg,
            wheel_inertia_kg_m2: self.wheel_inertia_kg_m2,
            wheel_radius_m: self.wheel_radius_m,
            com_height_m: height.as_ref().map_or(1.0, |height| *height),
            body_inertia_kg_m2: inertia.as_ref().map_or(1.0, |inertia| *inertia),
            gravity_m_s2: self.gravity_m_s2,
        };
        parameters.validate().map_err(Refusal::parameter(&["robot"]))?;
        let refused = |key, problem: &str| Err(Refusal::new(&["robot", key], problem));
        match (height, inertia, self.leg_height_m) {
            (Err(com_height_m), inertia, Some(leg_height_m)) => {
                let legs = Legs { leg_height_m, com_height_m, body_inertia_kg_m2: inertia.err() };
                let parameters =
                    legs.at(leg_height_m, &parameters).map_err(Refusal::parameter(&["robot"]))?;
                Ok((parameters, Some(legs)))
            }
            (Err(_), _, None) => {
                refused("com_height_m", "a table over leg_height_m needs the present leg_height_m: add it")
            }
            (Ok(_), Err(_), _) => refused(
                "body_inertia_kg_m2",
                "body_inertia_kg_m2 is a table over leg_height_m but com_height_m is not: make both tables or neither",
            ),
            (Ok(_), Ok(_), Some(_)) => refused(
                "leg_height_m",
                "leg_height_m has no effect while com_height_m is one number: give com_height_m as a table over leg_height_m",
            ),
            (Ok(_), Ok(_), None) => Ok((parameters, None)),
        }
    }

    fn from_parameters(parameters: &RobotParameters, legs: Option<&Legs>) -> Self {
        let heights = |table: &OverHeight| table.nodes().iter().map(|node| node.leg_height_m).collect();
        let values = |table: &OverHeight| table.nodes().iter().map(|node| node.value).collect();
        let com_height = |table: &OverHeight| {
            ComHeight::OverLegHeight(ComHeightTable {
                leg_height_m: heights(table),
                com_height_m: values(table),
            })
        };
        let inertia = |table: &OverHeight| {
            BodyInertia::OverLegHeight(BodyInertiaTable {
                leg_height_m: heights(table),
                body_inertia_kg_m2: values(table),
            })
        };
        Self {
            body_mass_kg: parameters.body_mass_kg,
            wheel_mass_kg: parameters.wheel_mass_kg,
            wheel_inertia_kg_m2: parameters.wheel_inertia_kg_m2,
            wheel_radius_m: parameters.wheel_radius_m,
            leg_height_m: legs.map(|legs| legs.leg_height_m),
            gravity_m_s2: parameters.gravity_m_s2,
            com_height_m: legs
                .map_or(ComHeight::Fixed(parameters.com_height_m), |legs| com_height(&legs.com_height_m)),
            body_inertia_kg_m2: legs
                .and_then(|legs| legs.body_inertia_kg_m2.as_ref())
                .map_or(BodyInertia::Fixed(parameters.body_inertia_kg_m2), inertia),
        }
    }
}

fn over_height(name: &'static str, heights: &[f64], values: &[f64]) -> Result<OverHeight, Refusal> {
    let refused = |problem| Refusal::new(&["robot", name], problem);
    if heights.len() != values.len() {
        let problem = format!(
            "leg_height_m has {} values and {name} {}: give one for each height",
            heights.len(),
            values.len()
        );
        return Err(refused(problem));
    }
    let node = |(&leg_height_m, &value)| HeightNode { leg_height_m, value };
    let nodes = heights.iter().zip(values).map(node).collect();
    OverHeight::new(name, nodes).map_err(|error| refused(error.to_string()))
}

#[derive(Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct MotorFrictionTable {
    left: Option<StribeckParameters>,
    right: Option<StribeckParameters>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct LqrTable {
    q_diagonal: Option<[f64; 4]>,
    r_diagonal: Option<[f64; 2]>,
    q: Option<[[f64; 4]; 4]>,
    r: Option<[[f64; 2]; 2]>,
}

impl RobotFile {
    pub(super) fn into_model(self) -> Result<Model, Refusal> {
        let (parameters, legs) = self.robot.into_parameters()?;
        let curve = |parameters: Option<StribeckParameters>, table: &[&'static str]| {
            parameters.map(Stribeck::new).transpose().map_err(Refusal::parameter(table))
        };
        let mut robot = RobotModel {
            parameters,
            legs,
            chassis: self.chassis,
            friction: [
                curve(self.friction.left, &["friction", "left"])?,
                curve(self.friction.right, &["friction", "right"])?,
            ],
            weights: self.lqr.map(LqrTable::into_weights).transpose()?,
            compensation: self.compensation,
            yaw_hold: self.yaw_hold,
            limits: self.limits,
            actuation: self.actuation,
            sensors: self.sensors,
            surroundings: self.surroundings,
            link: self.link,
            safety: self.safety,
            effects: Vec::new(),
        };
        for (table, checked) in [
            ("chassis", robot.chassis.validate()),
            ("compensation", robot.compensation.map_or(Ok(()), |compensation| compensation.validate())),
            ("yaw_hold", robot.yaw_hold.map_or(Ok(()), |hold| hold.validate())),
            ("limits", robot.limits.validate()),
            ("actuation", robot.actuation.validate()),
            ("sensors", robot.sensors.validate()),
            ("surroundings", robot.surroundings.validate()),
            ("link", robot.link.validate()),
            ("safety", robot.safety.validate()),
        ] {
            checked.map_err(Refusal::parameter(&[table]))?;
        }
        effects_schema::read_into_robot(self.effects, &mut robot)?;
        let tolerance = self.tolerance.read(MachineKind::Robot)?;
        Ok(Model { name: self.name, rig: Rig::Robot(Box::new(robot)), tolerance })
    }

    pub(super) fn from_model(model: &Model, robot: &RobotModel) -> Self {
        let [left, right] = robot.friction.map(|curve| curve.map(|curve| *curve.parameters()));
        Self {
            name: model.name.clone(),
            robot: RobotTable::from_parameters(&robot.parameters, robot.legs.as_ref()),
            chassis: robot.chassis,
            friction: MotorFrictionTable { left, right },
            lqr: robot.weights.as_ref().map(LqrTable::from_weights),
            compensation: robot.compensation,
            yaw_hold: robot.yaw_hold,
            limits: robot.limits,
            actuation: robot.actuation,
            sensors: robot.sensors,
            surroundings: robot.surroundings.clone(),
            link: robot.link,
            safety: robot.safety,
            tolerance: ToleranceTable::Written(model.tolerance.clone()),
            effects: effects_schema::written(&robot.effects),
        }
    }
}

impl LqrTable {
    fn into_weights(self) -> Result<Weights, Refusal> {
        let q = match (self.q_diagonal, self.q) {
            (Some(diagonal), None) => Matrix4::from_diagonal(&diagonal.into()),
            (None, Some(rows)) => Matrix4::from_fn(|i, j| rows[i][j]),
            (Some(_), Some(_)) => return Err(Refusal::both("q_diagonal", "q")),
            (None, None) => return Err(Refusal::neither("q_diagonal", "q")),
        };
        let r = match (self.r_diagonal, self.r) {
            (Some(diagonal), None) => Matrix2::from_diagonal(&diagonal.into()),
            (None, Some(rows)) => Matrix2::from_fn(|i, j| rows[i][j]),
            (Some(_), Some(_)) => return Err(Refusal::both("r_diagonal", "r")),
            (None, None) => return Err(Refusal::neither("r_diagonal", "r")),
        };
        Ok(Weights { q, r })
    }

    fn from_weights(weights: &Weights) -> Self {
        if weights.is_diagonal() {
            Self {
                q_diagonal: Some(weights.q.diagonal().into()),
                r_diagonal: Some(weights.r.diagonal().into()),
                q: None,
                r: None,
            }
        } else {
            let q = std::array::from_fn(|i| std::array::from_fn(|j| weights.q[(i, j)]));
            let r = std::array::from_fn(|i| std::array::from_fn(|j| weights.r[(i, j)]));
            Self { q_diagonal: None, r_diagonal: None, q: Some(q), r: Some(r) }
        }
    }
}

impl Refusal {
    fn both(diagonal: &'static str, full: &'static str) -> Self {
        Self::new(&["lqr", full], format!("{diagonal} and {full} both give the same weights: remove one"))
    }

    fn neither(diagonal: &'static str, full: &'static str) -> Self {
        Self::new(&["lqr"], format!("[lqr] needs {diagonal}, or the full matrix {full}: add one"))
    }
}
