//! The pages of the window.

/// A page; also the key of its tile in the layout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Tab {
    /// Weights, gains and the live robot.
    #[default]
    Tune,
    /// Friction from a measured log.
    Friction,
    /// Effects that the model lacks, from measured logs.
    Refine,
    /// The paper's experiments on the simulated robot.
    Experiments,
    /// A real robot: connection, health, arming, recording.
    Robot,
    /// The ledger of all runs.
    Runs,
    /// All messages since the start.
    Log,
}

impl Tab {
    /// All, in the order in which they are offered; the first nine have the keys 1 to 9.
    pub const ALL: [Self; 7] =
        [Self::Tune, Self::Friction, Self::Refine, Self::Experiments, Self::Robot, Self::Runs, Self::Log];

    /// Name for people.
    pub fn title(self) -> &'static str {
        match self {
            Self::Tune => "Tune",
            Self::Friction => "Friction",
            Self::Refine => "Refine",
            Self::Experiments => "Experiments",
            Self::Robot => "Robot",
            Self::Runs => "Runs",
            Self::Log => "Log",
        }
    }

    /// Describes the page.
    pub fn help(self) -> &'static str {
        match self {
            Self::Tune => "Weights, gains and the live robot",
            Self::Friction => "Friction from a measured log",
            Self::Refine => "Effects that the model lacks, from measured logs",
            Self::Experiments => "LQR and FLQR side by side in simulation",
            Self::Robot => "Connection, health, arming and recording of a robot",
            Self::Runs => "All runs: overlay and comparison",
            Self::Log => "All messages since the start",
        }
    }

    /// Name for scripts and files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Tune => "tune",
            Self::Friction => "friction",
            Self::Refine => "refine",
            Self::Experiments => "experiments",
            Self::Robot => "robot",
            Self::Runs => "runs",
            Self::Log => "log",
        }
    }

    /// The page that a file or a script names.
    pub fn from_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tab| tab.key() == key)
    }

    /// Width below which a tile scrolls its page sideways.
    pub(crate) fn least_width(self) -> f32 {
        match self {
            Self::Tune | Self::Friction | Self::Refine | Self::Experiments | Self::Robot | Self::Runs => {
                400.0
            }
            Self::Log => 240.0,
        }
    }
}
