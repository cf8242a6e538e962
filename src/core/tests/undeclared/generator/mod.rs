//! Logs of robots and motors with effects that their models do not declare.
//!
//! Nothing here is shared with the engine: other integrator, other sticking, other sensors and controller.

mod body;
pub(crate) mod cases;
mod fault;
mod random;
mod robot_run;

pub(crate) use body::Body;
pub(crate) use cases::Case;
pub(crate) use fault::Fault;
pub(crate) use robot_run::{Conditions, Recording, run};

impl Case {
    /// The log of the case, of one seed more with another excitation for the held-out one.
    pub(crate) fn record(&self, held_out: bool, conditions: Conditions) -> Option<Recording> {
        run(&self.declared, &self.body, &self.faults, conditions, 1 + 2 * self.seed + u64::from(held_out))
    }
}

impl Body {
    /// The model file of this robot.
    pub(crate) fn to_toml(&self) -> String {
        let mut text = format!(
            "name = \"undeclared\"\n[robot]\nbody_mass_kg = {}\nwheel_mass_kg = {}\nwheel_inertia_kg_m2 = {}\nwheel_radius_m = {}\ncom_height_m = {}\nbody_inertia_kg_m2 = {}\ngravity_m_s2 = {}\n",
            self.mass, self.wheel, self.wheel_inertia, self.radius, self.height, self.inertia, self.gravity
        );
        for (side, motor) in ["left", "right"].iter().zip(&self.motors) {
            text += &format!(
                "[friction.{side}]\ncoulomb_nm = {}\nstatic_nm = {}\nviscous_nm_s_rad = {}\nstribeck_speed_rad_s = {}\nstribeck_exponent = {}\noffset_nm = {}\n",
                motor.coulomb, motor.standing, motor.viscous, motor.knee, motor.shape, motor.offset
            );
        }
        let (q, r) = self.cost;
        text + &format!("[lqr]\nq_diagonal = {q:?}\nr_diagonal = [{r:?}, {r:?}]\n")
    }
}
