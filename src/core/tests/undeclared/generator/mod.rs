//! Logs of robots and motors with effects that their models do not declare.
//!
//! Nothing here is shared with the engine: other integrator, other sticking, other sensors and controller.

pub(crate) mod bench_cases;
mod bench_run;
mod body;
pub(crate) mod cases;
pub(crate) mod fault;
mod random;
pub(crate) mod robot_run;

use body::{Body, TOLERANCES, Tolerances};
pub(crate) use cases::Case;
pub(crate) use robot_run::Conditions;
use robot_run::{Recording, run};

impl Case {
    /// The log of the case, of one seed more with another excitation for the held-out one. A robot that falls is driven
    /// more calmly.
    pub(crate) fn record(&self, held_out: bool, conditions: Conditions) -> Option<Recording> {
        let seed = 1 + 2 * self.seed + u64::from(held_out);
        [1.0, 0.8, 0.6].into_iter().find_map(|calm| {
            let conditions = Conditions { excitation: calm * conditions.excitation, ..conditions };
            run(&self.declared, &self.body, &self.faults, conditions, seed)
        })
    }
}

impl Body {
    /// The model file of this robot.
    pub(crate) fn model_file(&self) -> String {
        let mut text = format!(
            "name = \"undeclared\"\n[actuation]\ndelay_s = 0.0\n[robot]\nbody_mass_kg = {}\nwheel_mass_kg = {}\nwheel_inertia_kg_m2 = {}\nwheel_radius_m = {}\ncom_height_m = {}\nbody_inertia_kg_m2 = {}\ngravity_m_s2 = {}\n",
            self.mass, self.wheel, self.wheel_inertia, self.radius, self.height, self.inertia, self.gravity
        );
        for (side, motor) in ["left", "right"].iter().zip(&self.motors) {
            text += &format!(
                "[friction.{side}]\ncoulomb_nm = {}\nstatic_nm = {}\nviscous_nm_s_rad = {}\nstribeck_speed_rad_s = {}\nstribeck_exponent = {}\noffset_nm = {}\n",
                motor.coulomb, motor.standing, motor.viscous, motor.knee, motor.shape, motor.offset
            );
        }
        let Tolerances { masses, lengths, inertias, friction } = TOLERANCES;
        text += &format!(
            "[tolerance]\nmasses = {masses}\nlengths = {lengths}\ninertias = {inertias}\nfriction = {friction}\n"
        );
        let (q, r) = self.cost;
        text + &format!("[lqr]\nq_diagonal = {q:?}\nr_diagonal = [{r:?}, {r:?}]\n")
    }
}
