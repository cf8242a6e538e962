//! The six parameters as the searches see them, in the order of the paper's x = [f_c, f_s, v_s, ξ, f_v, f_p].

use crate::friction::StribeckParameters;

/// One candidate; units N m, N m, rad/s, none, N m s/rad, N m.
pub(super) type Point = [f64; 6];

pub(super) const COULOMB: usize = 0;
pub(super) const STATIC: usize = 1;
pub(super) const SPEED: usize = 2;
pub(super) const EXPONENT: usize = 3;
pub(super) const VISCOUS: usize = 4;
pub(super) const OFFSET: usize = 5;

/// Keys of the model file, in the order of [`Point`].
pub(super) const KEYS: [&str; 6] =
    ["coulomb_nm", "static_nm", "stribeck_speed_rad_s", "stribeck_exponent", "viscous_nm_s_rad", "offset_nm"];

pub(super) fn named(point: &Point) -> StribeckParameters {
    StribeckParameters {
        coulomb_nm: point[COULOMB],
        static_nm: point[STATIC],
        stribeck_speed_rad_s: point[SPEED],
        stribeck_exponent: point[EXPONENT],
        viscous_nm_s_rad: point[VISCOUS],
        offset_nm: point[OFFSET],
    }
}
