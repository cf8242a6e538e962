//! What is tried: every kind of the library that can be in a robot, at shapes that its range of motion can show.

use crate::effects::{EffectKind, KINDS, MachineKind};

use super::trace::{Form, Pair, Trace};

/// How a shape parameter is refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// Not.
    Fixed,
    /// By a factor.
    Factor(f64),
    /// By a sum.
    Sum(f64),
}

/// One thing to try.
#[derive(Clone)]
pub(super) struct Candidate {
    pub(super) kind: &'static EffectKind,
    pub(super) form: Form,
    pub(super) shape: Vec<f64>,
    pub(super) steps: Vec<Step>,
    /// Columns at unit amplitude.
    pub(super) pairs: Vec<Pair>,
    /// The same, white.
    pub(super) white: Vec<Vec<f64>>,
}

impl Candidate {
    pub(super) fn new(
        trace: &Trace,
        kind: &'static EffectKind,
        form: Form,
        shape: Vec<f64>,
        steps: Vec<Step>,
    ) -> Self {
        let pairs = trace.columns(kind, form, &shape);
        Self { kind, form, shape, steps, pairs, white: Vec::new() }
    }

    /// Whether its amplitude is 1 and its size is in its shape.
    pub(super) fn is_fixed(&self) -> bool {
        self.form == Form::Late || self.kind.amplitudes().next().is_none()
    }

    /// Lowest and highest coefficient of each column.
    pub(super) fn bounds(&self) -> Vec<[f64; 2]> {
        const NEAR_ONE: [f64; 2] = [0.7, 1.4];
        if self.is_fixed() {
            return vec![NEAR_ONE; self.pairs.len()];
        }
        if self.form == Form::Driven {
            return vec![[0.0, f64::INFINITY]];
        }
        let physical = |key: &str, range: [f64; 2]| match (self.kind.id, key) {
            // What is against the motion, or pulls back.
            (
                "quadratic_drag"
                | "aero_drag"
                | "load_dependent_friction"
                | "rolling_resistance"
                | "wheel_slip",
                _,
            )
            | ("tether_spring", "stiffness_n_m")
            | ("structural_mode", _) => [0.0, range[1]],
            _ => range,
        };
        let ranges: Vec<[f64; 2]> = self
            .kind
            .amplitudes()
            .map(|parameter| physical(parameter.key(MachineKind::Robot), parameter.range(MachineKind::Robot)))
            .collect();
        self.pairs.iter().enumerate().map(|(i, _)| ranges[i % ranges.len()]).collect()
    }

    /// Whether more than one of the kind can be in a robot.
    pub(super) fn repeats(&self) -> bool {
        self.kind.series || matches!(self.kind.id, "terrain" | "external_push" | "structural_mode")
    }

    /// How much more evidence it needs: friction about rest, which the encoder does not resolve, is easily mimicked.
    pub(super) fn caution(&self) -> f64 {
        match self.kind.id {
            "low_speed_friction" | "presliding" | "backlash" | "torque_deadzone" => 1.6,
            "wheel_slip" | "external_push" => 4.0,
            // A mode of a few hertz of width fits what is left of any other effect.
            "structural_mode" => 12.0,
            "terrain" => 1.3,
            _ => 1.0,
        }
    }
}

/// Highest order whose waves pass the kernel for some of the time.
const BAND_HZ: f64 = 22.0;

/// Everything to try, apart from what depends on a moment.
pub(super) fn library(trace: &Trace) -> Vec<Candidate> {
    let speeds: Vec<f64> = trace.moments().map(|m| m.motor_speed_rad_s.abs()).collect();
    let typical = quantile(&speeds, 0.5).max(0.3);
    let most_order = ((std::f64::consts::TAU * BAND_HZ / typical) as usize).clamp(8, 60);
    let torques: Vec<f64> = trace.moments().map(|m| m.torque_nm.abs()).collect();
    let peak = torques.iter().fold(0.0_f64, |a, b| a.max(*b));
    let (low, high) =
        trace.moments().fold((f64::MAX, f64::MIN), |(low, high), m| (low.min(m.x_m), high.max(m.x_m)));
    let seconds = trace.moments().count() as f64 * trace.moments().next().map_or(1e-3, |m| m.dt_s);
    let mut found = Vec::new();
    let mut add = |kind: &'static EffectKind, form: Form, shape: Vec<f64>, steps: &[Step]| {
        found.push(Candidate::new(trace, kind, form, shape, steps.to_vec()));
    };
    use Step::{Factor, Fixed, Sum};
    for kind in KINDS.iter().copied().filter(|kind| kind.is_on(MachineKind::Robot)) {
        match kind.id {
            "cogging" => {
                (1..=most_order).for_each(|order| add(kind, Form::Law, vec![order as f64], &[Fixed]))
            }
            "torque_ripple" => {
                (1..=most_order.min(40)).for_each(|order| add(kind, Form::Law, vec![order as f64], &[Fixed]))
            }
            "position_dependent_friction" => {
                (1..=10).for_each(|order| add(kind, Form::Law, vec![f64::from(order)], &[Fixed]))
            }
            "low_speed_friction" => {
                for speed in [0.3, 0.7, 1.5] {
                    add(kind, Form::Law, vec![speed], &[Factor(1.5)]);
                }
            }
            "presliding" => {
                for way in [0.01, 0.03, 0.1, 0.2] {
                    add(kind, Form::Law, vec![way], &[Factor(1.6)]);
                }
            }
            "thermal_friction" => {
                for share in [0.1, 0.25, 0.6] {
                    add(kind, Form::Law, vec![share * seconds], &[Factor(1.5)]);
                }
            }
            "command_delay" | "actuator_lag" => {
                for ms in [1.0, 1.8, 3.2, 5.0, 7.5, 11.0, 16.0] {
                    add(kind, Form::Law, vec![ms * 1e-3], &[Factor(1.3)]);
                }
            }
            "torque_saturation" => {
                for share in [0.5, 0.6, 0.7, 0.8, 0.9] {
                    add(kind, Form::Law, vec![share * peak], &[Factor(1.08)]);
                }
            }
            "torque_deadzone" => {
                for width in [0.01, 0.02, 0.04, 0.08] {
                    add(kind, Form::Law, vec![width], &[Factor(1.4)]);
                }
            }
            "backlash" => {
                let rotor = 0.2 * trace.machine.parameters.wheel_inertia_kg_m2;
                for gap in [0.005, 0.02, 0.06] {
                    add(kind, Form::Law, vec![gap, rotor], &[Factor(1.6), Fixed]);
                }
            }
            "structural_mode" => {
                for i in 0..14 {
                    let hz = 2.5 * libm::pow(1.14, f64::from(i));
                    add(kind, Form::Law, vec![hz, 0.04], &[Factor(1.07), Factor(1.6)]);
                    add(kind, Form::Driven, vec![hz, 0.04], &[Factor(1.07), Factor(1.6)]);
                }
            }
            "slosh" => {
                let height = trace.machine.parameters.com_height_m;
                for i in 0..14 {
                    let hz = 0.5 * libm::pow(1.16, f64::from(i));
                    add(
                        kind,
                        Form::Law,
                        vec![hz, 0.05, height],
                        &[Factor(1.08), Factor(1.6), Sum(0.3 * height)],
                    );
                }
            }
            "aero_drag" => {
                add(kind, Form::Law, vec![0.0], &[Fixed]);
                add(kind, Form::Law, vec![trace.machine.parameters.com_height_m], &[Fixed]);
            }
            "wheel_slip" => {
                for time in [0.005, 0.02] {
                    add(kind, Form::Law, vec![time], &[Factor(1.6)]);
                }
            }
            "terrain" => {
                for width in [0.04, 0.1, 0.25] {
                    let count = ((high - low) / width).clamp(1.0, 40.0) as usize;
                    for i in 0..count {
                        let at = low + (high - low) * (i as f64 + 0.5) / count as f64;
                        add(kind, Form::Law, vec![at, width], &[Sum(0.3 * width), Factor(1.25)]);
                    }
                }
                let mut length = 2.5;
                while length > 0.1 {
                    add(kind, Form::Wave, vec![0.0, length], &[Fixed, Factor(1.03)]);
                    length /= 1.1;
                }
            }
            "external_push" | "gyro_bias" => {}
            "imu_delay" => {
                for ms in [1.5, 3.0, 5.0, 8.0, 12.0, 18.0] {
                    add(kind, Form::Late, vec![ms * 1e-3], &[Factor(1.2)]);
                }
            }
            "friction_asymmetry" | "viscous_asymmetry" => {
                add(kind, Form::Law, Vec::new(), &[]);
                add(kind, Form::Forward, Vec::new(), &[]);
            }
            _ => {
                let shapes: Vec<f64> = kind.shapes().filter_map(|shape| shape.default).collect();
                if shapes.len() == kind.shapes().count() {
                    add(kind, Form::Law, shapes, &[]);
                }
            }
        }
    }
    found
}

/// Value below which a share of the values are.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    if sorted.is_empty() {
        return 0.0;
    }
    let place = ((sorted.len() - 1) as f64 * share) as usize;
    *sorted.select_nth_unstable_by(place, f64::total_cmp).1
}
