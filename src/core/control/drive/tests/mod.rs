mod air;
mod checking;
mod driving;
mod listening;
mod rig;
mod stopping;
