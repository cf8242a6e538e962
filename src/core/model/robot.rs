//! A robot with its motors, sensors, surroundings and the settings of its controller.

use super::{
    Actuation, Chassis, Effect, Legs, LinkSettings, MotorLimits, RobotParameters, SafetyLimits,
    SensorSettings, Surroundings, Weights, YawHold,
};
use crate::ParameterError;
use crate::friction::{Compensation, Stribeck};

/// A robot with its motors, sensors and surroundings, and the settings of its controller. Tables that a
/// file does not have are at their defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotModel {
    /// Masses, lengths and inertias, at the legs' present height.
    pub parameters: RobotParameters,
    /// Dependence on leg height, if given.
    pub legs: Option<Legs>,
    /// Both wheels apart, and the turning body.
    pub chassis: Chassis,
    /// Friction of the left and the right motor; `None` if the file has no table.
    pub friction: [Option<Stribeck>; 2],
    /// Weights of the cost, if the file has them.
    pub weights: Option<Weights>,
    /// Friction feedforward, if the file has it.
    pub compensation: Option<Compensation>,
    /// Heading control, if given.
    pub yaw_hold: Option<YawHold>,
    /// Motor limits.
    pub limits: MotorLimits,
    /// From asked torque to shaft.
    pub actuation: Actuation,
    /// Sensors.
    pub sensors: SensorSettings,
    /// External influences.
    pub surroundings: Surroundings,
    /// Wiring of motors and IMU.
    pub link: LinkSettings,
    /// When the driven robot is stopped.
    pub safety: SafetyLimits,
    /// Further effects; errors of the parameters above are corrected there instead.
    pub effects: Vec<Effect>,
}

impl RobotModel {
    /// A robot on level ground of which nothing but masses, lengths and inertias is known.
    pub fn new(parameters: RobotParameters) -> Self {
        Self {
            parameters,
            legs: None,
            chassis: Chassis::default(),
            friction: [None; 2],
            weights: None,
            compensation: None,
            yaw_hold: None,
            limits: MotorLimits::default(),
            actuation: Actuation::default(),
            sensors: SensorSettings::default(),
            surroundings: Surroundings::default(),
            link: LinkSettings::default(),
            safety: SafetyLimits::default(),
            effects: Vec::new(),
        }
    }

    /// Replaces the parameters. Tables over leg height are scaled so that they go through the new
    /// values at the present height.
    pub fn set_parameters(&mut self, parameters: RobotParameters) {
        if let Some(legs) = &mut self.legs {
            legs.com_height_m.scale(parameters.com_height_m / self.parameters.com_height_m);
            if let Some(inertia) = &mut legs.body_inertia_kg_m2 {
                inertia.scale(parameters.body_inertia_kg_m2 / self.parameters.body_inertia_kg_m2);
            }
        }
        self.parameters = parameters;
    }

    /// The robot with its legs at another height.
    ///
    /// # Errors
    /// A robot without a table over the legs' height, or a height outside of it.
    ///
    /// ```
    /// # let model = flqr_core::model_file::presets::paper();
    /// # let robot = model.robot().ok_or("no robot")?;
    /// let raised = robot.at_leg_height(0.4)?;
    /// assert!(raised.parameters.com_height_m > robot.at_leg_height(0.33)?.parameters.com_height_m);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn at_leg_height(&self, leg_height_m: f64) -> Result<Self, ParameterError> {
        let Some(legs) = &self.legs else {
            let allowed =
                "left out, because com_height_m of this model is a number and not a table over leg_height_m";
            return Err(ParameterError {
                name: "leg_height_m",
                value: leg_height_m,
                allowed: allowed.into(),
            });
        };
        let parameters = legs.at(leg_height_m, &self.parameters)?;
        Ok(Self { parameters, legs: Some(Legs { leg_height_m, ..legs.clone() }), ..self.clone() })
    }

    /// Refuses what no robot can have.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.parameters.validate()?;
        self.chassis.validate()?;
        self.yaw_hold.map_or(Ok(()), |hold| hold.validate())?;
        self.limits.validate()?;
        self.actuation.validate()?;
        self.sensors.validate()?;
        self.surroundings.validate()?;
        self.link.validate()?;
        self.safety.validate()
    }
}
