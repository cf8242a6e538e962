//! The refined model without some of what was found.

use crate::effects::{Declared, Role};
use crate::model::{AxisParameters, Effect, MachineKind, Model, Motor, Rig};

/// The refined model without an effect that was found: taken from its list, or, where its declared numbers hold it,
/// taken from those. `motor` is the one that a bench log belongs to; none for logs of the whole machine.
pub fn without(mut refined: Model, effect: &Effect, motor: Option<Motor>) -> Model {
    let machine = machine(&refined);
    let same = |other: &Effect| other.kind() == effect.kind() && other.parameters() == effect.parameters();
    let listed = match &mut refined.rig {
        Rig::Robot(robot) => &mut robot.effects,
        Rig::Axis(axis) => &mut axis.effects,
    };
    if let Some(place) = listed.iter().position(same) {
        listed.remove(place);
        return refined;
    }
    let own = motor.filter(|_| effect.kind().per_motor() && machine == MachineKind::Robot).or(effect.motor());
    let roles = effect.kind().parameters.iter().map(|parameter| parameter.role).cycle();
    let turned =
        effect.parameters().iter().zip(roles).map(|((key, value), role)| {
            (key.as_str(), if role == Role::Amplitude { -value } else { *value })
        });
    if let Ok(turned) = Effect::new(effect.id(), machine, own, turned) {
        turned.declare_in(match &mut refined.rig {
            Rig::Robot(robot) => Declared::Robot(robot),
            Rig::Axis(axis) => Declared::Axis(axis),
        });
    }
    refined
}

fn machine(model: &Model) -> MachineKind {
    match &model.rig {
        Rig::Robot(_) => MachineKind::Robot,
        Rig::Axis(axis) => match axis.parameters {
            AxisParameters::Rotary { .. } => MachineKind::Rotary,
            AxisParameters::Linear { .. } => MachineKind::Linear,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAFT: &str = "name = \"shaft\"\n[axis]\nkind = \"rotary\"\ninertia_kg_m2 = 0.005\n[friction]\n\
                         coulomb_nm = 0.03\nviscous_nm_s_rad = 0.0005\n";

    /// Puts an effect into a model as a refinement does.
    fn with(mut model: Model, effect: &Effect) -> Model {
        if let Rig::Axis(axis) = &mut model.rig
            && !effect.declare_in(Declared::Axis(axis))
        {
            axis.effects.push(effect.clone());
        }
        model
    }

    #[test]
    fn what_is_left_out_leaves_the_model_as_it_was() {
        let declared = Model::from_toml(SHAFT, "shaft.toml").unwrap();
        let effects: [(&str, &[(&str, f64)]); 3] = [
            ("cogging", &[("order_1", 14.0), ("sin_1_nm", 0.01), ("cos_1_nm", 0.0)]),
            ("coulomb_error", &[("coulomb_nm", 0.0078125)]),
            ("viscous_error", &[("viscous_nm_s_rad", -0.000_122_070_312_5)]),
        ];
        for (id, parameters) in effects {
            let effect = Effect::new(id, MachineKind::Rotary, None, parameters.iter().copied()).unwrap();
            let refined = with(declared.clone(), &effect);
            assert_ne!(refined, declared, "{id}");
            let back = without(refined, &effect, None);
            let numbers = |model: &Model| match &model.rig {
                Rig::Axis(axis) => match axis.parameters {
                    AxisParameters::Rotary { friction, .. } => friction.map(|curve| *curve.parameters()),
                    AxisParameters::Linear { .. } => None,
                },
                Rig::Robot(_) => None,
            };
            let (back_to, was) = (numbers(&back).unwrap(), numbers(&declared).unwrap());
            assert!((back_to.coulomb_nm - was.coulomb_nm).abs() < 1e-15, "{id}");
            assert!((back_to.viscous_nm_s_rad - was.viscous_nm_s_rad).abs() < 1e-15, "{id}");
            assert!(matches!(&back.rig, Rig::Axis(axis) if axis.effects.is_empty()), "{id}");
        }
    }
}
