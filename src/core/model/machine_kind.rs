//! Kinds of machines that a model describes.

/// Kind of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineKind {
    /// A wheel-legged robot.
    Robot,
    /// A motor shaft on a bench.
    Rotary,
    /// A carriage.
    Linear,
}

impl MachineKind {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Robot, Self::Rotary, Self::Linear];
}
