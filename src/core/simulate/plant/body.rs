//! Everything above the axle as one rigid body, its payload included.

use crate::model::{Payload, RobotParameters};

/// Body and payload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Body {
    pub(super) mass_kg: f64,
    /// From the axle to the common centre of mass, m.
    pub(super) com_distance_m: f64,
    /// Of that line in front of the body's own, rad: by how much the body leans back to balance.
    pub(super) com_angle_rad: f64,
    /// About the common centre of mass, kg m².
    pub(super) pitch_inertia_kg_m2: f64,
    pub(super) yaw_inertia_kg_m2: f64,
}

impl Body {
    pub(super) fn new(
        parameters: &RobotParameters,
        yaw_inertia_kg_m2: f64,
        payload: Option<Payload>,
    ) -> Self {
        let alone = Self {
            mass_kg: parameters.body_mass_kg,
            com_distance_m: parameters.com_height_m,
            com_angle_rad: 0.0,
            pitch_inertia_kg_m2: parameters.body_inertia_kg_m2,
            yaw_inertia_kg_m2,
        };
        payload.filter(|payload| payload.mass_kg > 0.0).map_or(alone, |payload| alone.with(&payload))
    }

    fn with(self, payload: &Payload) -> Self {
        let mass_kg = self.mass_kg + payload.mass_kg;
        let share = payload.mass_kg / mass_kg;
        let forward = share * payload.forward_m;
        let height = self.com_distance_m + share * (payload.height_m - self.com_distance_m);
        // Two point masses about their common centre: the reduced mass at their distance.
        let reduced = share * self.mass_kg;
        let (apart_forward, apart_up) = (payload.forward_m, payload.height_m - self.com_distance_m);
        Self {
            mass_kg,
            com_distance_m: libm::hypot(forward, height),
            com_angle_rad: libm::atan2(forward, height),
            pitch_inertia_kg_m2: self.pitch_inertia_kg_m2
                + reduced * (apart_forward * apart_forward + apart_up * apart_up),
            yaw_inertia_kg_m2: self.yaw_inertia_kg_m2 + reduced * apart_forward * apart_forward,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn payload_agrees_with_sums_over_both_masses() {
        let parameters = RobotParameters {
            body_mass_kg: 12.0,
            wheel_mass_kg: 1.2,
            wheel_inertia_kg_m2: 0.0025,
            wheel_radius_m: 0.065,
            com_height_m: 0.12,
            body_inertia_kg_m2: 0.10,
            gravity_m_s2: 9.81,
        };
        let payload = Payload { mass_kg: 2.0, height_m: 0.3, forward_m: -0.07 };
        let body = Body::new(&parameters, 0.15, Some(payload));
        let [forward, up] = [-0.07 * 2.0 / 14.0, (12.0 * 0.12 + 2.0 * 0.3) / 14.0];
        assert_eq!(body.mass_kg, 14.0);
        assert!((body.com_distance_m - f64::hypot(forward, up)).abs() < 1e-15);
        assert!((body.com_angle_rad - f64::atan(forward / up)).abs() < 1e-15);
        let about = |f: f64, u: f64| (f - forward).powi(2) + (u - up).powi(2);
        let pitch = 0.10 + 12.0 * about(0.0, 0.12) + 2.0 * about(-0.07, 0.3);
        assert!((body.pitch_inertia_kg_m2 - pitch).abs() < 1e-15);
        let yaw = 0.15 + 12.0 * forward.powi(2) + 2.0 * (-0.07 - forward).powi(2);
        assert!((body.yaw_inertia_kg_m2 - yaw).abs() < 1e-15);
    }
}
