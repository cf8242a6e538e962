mod driving;
mod rig;
mod stopping;
