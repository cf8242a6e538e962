//! Plotted signals of a run, in the order of its columns.

use crate::history::Channel;
use crate::plot::Unit;
use crate::quantity::Quantity;

/// A signal of the runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal {
    /// Name in JSON, with the core's unit.
    pub(super) key: &'static str,
    pub(super) quantity: Quantity,
    /// Unit of its values.
    pub(super) unit: Unit,
    /// True if the target speed belongs into its plot.
    pub(super) has_target: bool,
}

/// The signals of a run on the ground, or in the air of one shaft or two.
pub(super) fn signals(on_ground: bool, shafts: usize, degrees: bool) -> Vec<Signal> {
    if on_ground {
        let keys = ["x_m", "x_dot_m_s", "pitch_rad"];
        let signal = |(key, channel)| {
            let unit = if channel == Channel::Pitch {
                Unit::Angle
            } else {
                Unit::Plain(Quantity::of(channel, false).unit)
            };
            Signal { key, quantity: Quantity::of(channel, degrees), unit, has_target: false }
        };
        return keys.into_iter().zip(Channel::STATE).map(signal).collect();
    }
    let speed = |key, name| Signal {
        key,
        quantity: Quantity::shaft_speed(name, degrees),
        unit: Unit::AngularSpeed,
        has_target: true,
    };
    let torque = |key, name| Signal {
        key,
        quantity: Quantity::plain(name, "N m", 0.01),
        unit: Unit::Torque(None),
        has_target: false,
    };
    if shafts == 1 {
        return vec![speed("motor_speed_rad_s", "speed"), torque("torque_nm", "torque")];
    }
    vec![
        speed("motor_speed_left_rad_s", "left speed"),
        torque("torque_left_nm", "left torque"),
        speed("motor_speed_right_rad_s", "right speed"),
        torque("torque_right_nm", "right torque"),
    ]
}
