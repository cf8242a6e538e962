//! Tolerances of the declared numbers.

use super::MachineKind;
use crate::parameter::{ParameterError, within};

/// Fractions of themselves by which declared numbers may be off; what a file does not name has its group's default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerances {
    /// Key and share, sorted by the key.
    pub(crate) named: Vec<(&'static str, f64)>,
}

/// Numbers of one kind.
struct Group {
    key: &'static str,
    share: f64,
    members: &'static [(&'static str, &'static [MachineKind])],
}

const ROBOT: &[MachineKind] = &[MachineKind::Robot];

const ROTARY: &[MachineKind] = &[MachineKind::Rotary];

const LINEAR: &[MachineKind] = &[MachineKind::Linear];

const TURNING: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary];

const ALL: &[MachineKind] = &[MachineKind::Robot, MachineKind::Rotary, MachineKind::Linear];

const MASSES: Group = Group {
    key: "masses",
    share: 0.02,
    members: &[("body_mass_kg", ROBOT), ("wheel_mass_kg", ROBOT), ("mass_kg", LINEAR)],
};

const LENGTHS: Group =
    Group { key: "lengths", share: 0.01, members: &[("wheel_radius_m", ROBOT), ("com_height_m", ROBOT)] };

const INERTIAS: Group = Group {
    key: "inertias",
    share: 0.05,
    members: &[("wheel_inertia_kg_m2", ROBOT), ("body_inertia_kg_m2", ROBOT), ("inertia_kg_m2", ROTARY)],
};

const FRICTION: Group = Group {
    key: "friction",
    share: 0.1,
    members: &[
        ("coulomb_nm", TURNING),
        ("static_nm", TURNING),
        ("viscous_nm_s_rad", TURNING),
        ("stribeck_speed_rad_s", TURNING),
        ("offset_nm", TURNING),
        ("coulomb_n", LINEAR),
        ("static_n", LINEAR),
        ("viscous_n_s_m", LINEAR),
        ("stribeck_speed_m_s", LINEAR),
        ("offset_n", LINEAR),
        ("stribeck_exponent", ALL),
    ],
};

const GROUPS: [Group; 4] = [MASSES, LENGTHS, INERTIAS, FRICTION];

/// A mass on a lever: known as well as both together.
const GRAVITY: &str = "gravity_torque_nm";

impl Tolerances {
    /// By which fraction of itself the number with this key of the model file may be off; 0 where it has no tolerance.
    /// The group names `masses`, `lengths`, `inertias` and `friction` are keys too.
    pub fn share_of(&self, key: &str) -> f64 {
        if let Some((_, share)) = self.named.iter().find(|(name, _)| *name == key) {
            return *share;
        }
        if key == GRAVITY {
            return self.share_of(MASSES.key) + self.share_of(LENGTHS.key);
        }
        if let Some(group) = GROUPS.iter().find(|group| group.key == key) {
            return group.share;
        }
        let group = GROUPS.iter().find(|group| group.members.iter().any(|(member, _)| *member == key));
        group.map_or(0.0, |group| self.share_of(group.key))
    }

    /// Says how well a number, or a group of them, is known.
    ///
    /// # Errors
    /// A share below 0 or above 1, or a key that no model has.
    pub fn set(&mut self, key: &str, share: f64) -> Result<(), ParameterError> {
        let Some(key) = tolerance_keys(ALL).find(|name| *name == key) else {
            let allowed = "left out, because no parameter of a model file has this name";
            return Err(ParameterError { name: "tolerance", value: share, allowed: allowed.into() });
        };
        within(key, share, 0.0..=1.0, "a fraction from 0 to 1")?;
        match self.named.binary_search_by_key(&key, |(name, _)| *name) {
            Ok(place) => self.named[place].1 = share,
            Err(place) => self.named.insert(place, (key, share)),
        }
        Ok(())
    }
}

/// All keys that machines of some kinds may have.
pub(crate) fn tolerance_keys(kinds: &[MachineKind]) -> impl Iterator<Item = &'static str> {
    let has = |on: &[MachineKind]| on.iter().any(|kind| kinds.contains(kind));
    let mut found = Vec::new();
    for group in &GROUPS {
        let members: Vec<_> =
            group.members.iter().filter(|(_, on)| has(on)).map(|(member, _)| *member).collect();
        if !members.is_empty() {
            found.push(group.key);
            found.extend(members);
        }
    }
    if has(ROTARY) {
        found.push(GRAVITY);
    }
    found.into_iter()
}
