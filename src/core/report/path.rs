//! Coordinates and paths of SVG, to a tenth of a pixel and as short as they can be.

use std::fmt;

/// A coordinate to a tenth of a pixel, as short as it can be.
pub(super) struct Px(pub(super) f64);

impl fmt::Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_tenths(f, tenths(self.0))
    }
}

fn tenths(value: f64) -> i64 {
    libm::round(value * 10.0) as i64
}

fn write_tenths(out: &mut impl fmt::Write, tenths: i64) -> fmt::Result {
    let sign = if tenths < 0 { "-" } else { "" };
    let (whole, rest) = (tenths.unsigned_abs() / 10, tenths.unsigned_abs() % 10);
    match (whole, rest) {
        (_, 0) => write!(out, "{sign}{whole}"),
        (0, _) => write!(out, "{sign}.{rest}"),
        _ => write!(out, "{sign}{whole}.{rest}"),
    }
}

/// Each value held up to the next point.
pub(super) fn stairs(points: impl Iterator<Item = [f64; 2]>) -> impl Iterator<Item = [f64; 2]> {
    let mut held = None;
    points.flat_map(move |[x, y]| {
        let corner = held.replace(y).filter(|held: &f64| held.is_finite()).map(|held| [x, held]);
        corner.into_iter().chain([[x, y]])
    })
}

/// Lines with relative coordinates; rounded first, so that no error adds up.
pub(super) fn polyline(pieces: &[Vec<[f64; 2]>]) -> String {
    let mut path = String::new();
    for piece in pieces {
        let places: Vec<[i64; 2]> = piece.iter().map(|point| point.map(tenths)).collect();
        push_point(&mut path, 'M', places[0]);
        let mut last = places[0];
        for place in places.iter().skip(1) {
            if *place != last {
                push_point(&mut path, 'l', [place[0] - last[0], place[1] - last[1]]);
                last = *place;
            }
        }
        // A piece at one place would be invisible.
        if places.iter().all(|place| *place == places[0]) {
            path.push_str("h0");
        }
    }
    path
}

/// A stroke of no length with round ends is a dot.
pub(super) fn dots(points: &[[f64; 2]]) -> String {
    let mut path = String::new();
    for point in points {
        push_point(&mut path, 'M', point.map(tenths));
        path.push_str("h0");
    }
    path
}

fn push_point(path: &mut String, command: char, [x, y]: [i64; 2]) {
    path.push(command);
    write_tenths(path, x).expect("a string takes all");
    if y >= 0 {
        path.push(' ');
    }
    write_tenths(path, y).expect("a string takes all");
}
