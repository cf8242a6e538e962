//! The paper's numbers as printed, each with its place (Zhang et al., Sensors 2025, 25(4), 1056).

use crate::friction::StribeckParameters;
use crate::simulate::Summary;

/// Table 1, in-wheel motors (LKMTECH MF9025v2): rated torque, N m; rated speed, rpm; power, W.
pub(super) const TABLE_1: [f64; 3] = [2.42, 490.0, 170.0];

/// Table 2: M, c₁, c₂, ω_s, ω_e, α, velocity limit, T.
pub(super) const TABLE_2: [f64; 8] = [128.0, 1.6, 2.0, 0.9, 0.4, 0.6, 0.5, 500.0];

/// Table 3: lower and upper bounds of f_c, f_s, f_v, v_s, ξ, f_p.
pub(super) const TABLE_3: [[f64; 2]; 6] =
    [[0.01, 3.0], [0.01, 10.0], [0.01, 10.0], [0.0, 10.0], [0.0, 2.2], [-10.0, 10.0]];

/// Table 4: left and right motor.
pub(super) const TABLE_4: [StribeckParameters; 2] = [
    StribeckParameters {
        coulomb_nm: 0.0338,
        static_nm: 0.0761,
        viscous_nm_s_rad: 4.9e-4,
        stribeck_speed_rad_s: 1.612,
        stribeck_exponent: 0.2310,
        offset_nm: -0.0016,
    },
    StribeckParameters {
        coulomb_nm: 0.0406,
        static_nm: 0.0617,
        viscous_nm_s_rad: 4.3e-4,
        stribeck_speed_rad_s: 2.253,
        stribeck_exponent: 0.2772,
        offset_nm: 0.0014,
    },
];

/// Section 4.2: pairs of each motor; fastest speed, rad/s; "standard deviation of error" of both motors, whose
/// unit it does not print.
pub(super) const PAIRS: f64 = 260.0;
pub(super) const FASTEST_RAD_S: f64 = 50.0;
pub(super) const ERROR: [f64; 2] = [0.30, 0.59];
/// Section 3.1: segments of each constant speed.
pub(super) const SEGMENTS: f64 = 8.0;

/// Section 4.3: target, rad/s, and (kp, ki) of Figures 6 and 7.
pub(super) const SPEED_GAINS: [[f64; 2]; 3] = [[0.5, 0.05], [0.05, 0.05], [0.05, 0.01]];

/// LQR, then FLQR.
pub(super) type Both<T> = [T; 2];

/// Range, mean and what is headed variance, of x (m), ẋ (m/s) and pitch (printed in °, see contradiction 4).
pub(super) type BalanceTable = [Both<Summary>; 3];

const fn row(min: f64, max: f64, mean: f64, std: f64) -> Summary {
    Summary { min, max, mean, std }
}

/// Table 5: flat ground.
pub(super) const TABLE_5: BalanceTable = [
    [row(-0.07, 0.12, 0.0467, 0.0645), row(-0.02, 0.0, -0.0092, 0.0068)],
    [row(-0.2066, 0.1751, 0.0, 0.07), row(-0.0263, 0.0384, 0.0, 0.0093)],
    [row(-0.06, 0.01, -0.0188, 0.0144), row(-0.02, 0.0, -0.0147, 0.005)],
];

/// Table 6: single-sided bridge.
pub(super) const TABLE_6: BalanceTable = [
    [row(-0.12, 0.07, -0.0436, 0.0692), row(0.03, 0.05, 0.049, 0.003)],
    [row(-0.1797, 0.1907, -0.0080, 0.0759), row(-0.0207, 0.0324, 0.0, 0.0061)],
    [row(-0.05, 0.03, -0.0158, 0.0152), row(-0.03, -0.01, -0.0243, 0.005)],
];

/// From and to; equal where the table prints one value.
pub(super) type Range = [f64; 2];

/// Table 7, a kick at 8.5 s: steady and disturbed ranges of x, ẋ and pitch.
pub(super) struct KickRow {
    pub(super) steady: Both<Range>,
    pub(super) disturbed: Both<Range>,
}

pub(super) const TABLE_7: [KickRow; 3] = [
    KickRow { steady: [[-0.1, 0.04], [0.04, 0.04]], disturbed: [[-0.28, 0.11], [0.09, 0.11]] },
    KickRow { steady: [[-0.14, 0.15], [-0.024, 0.017]], disturbed: [[-0.29, 0.55], [-0.23, 0.17]] },
    KickRow { steady: [[-0.04, 0.03], [-0.03, -0.03]], disturbed: [[-0.09, 0.07], [-0.05, -0.02]] },
];

/// Abstract and section 5: "reduced by at least one order of magnitude".
pub(super) const CLAIMED_FACTOR: f64 = 10.0;
