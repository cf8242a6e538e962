//! Min/max thinning: at most two points for each run through a column of the picture, so that neither size nor
//! looks depend on how much data is behind a curve.

/// Points in picture units as pieces of a line, a gap wherever a coordinate is not finite. Neighbours that fall
/// into one column (`column` wide) become their lowest and highest, in the order in which they came; the ends of
/// a piece are kept. The points may run back.
pub(super) fn line(points: impl IntoIterator<Item = [f64; 2]>, column: f64) -> Vec<Vec<[f64; 2]>> {
    let mut pieces = Vec::new();
    let mut piece = Piece::default();
    for point in points {
        if point.iter().all(|coordinate| coordinate.is_finite()) {
            piece.push(point, column);
        } else {
            pieces.extend(std::mem::take(&mut piece).finish());
        }
    }
    pieces.extend(piece.finish());
    pieces
}

/// One point for each square of the picture (`side` wide) that holds any; in the order in which they came.
pub(super) fn cloud(points: impl IntoIterator<Item = [f64; 2]>, side: f64) -> Vec<[f64; 2]> {
    let mut taken = std::collections::BTreeSet::new();
    let square = |point: &[f64; 2]| point.map(|coordinate| libm::floor(coordinate / side) as i64);
    let finite = points.into_iter().filter(|point| point.iter().all(|coordinate| coordinate.is_finite()));
    finite.filter(|point| taken.insert(square(point))).collect()
}

#[derive(Default)]
struct Piece {
    done: Vec<[f64; 2]>,
    run: Option<Run>,
}

/// Neighbours in one column: the lowest and the highest with their places in the order.
struct Run {
    column: i64,
    count: usize,
    low: (usize, [f64; 2]),
    high: (usize, [f64; 2]),
    last: [f64; 2],
}

impl Piece {
    fn push(&mut self, point: [f64; 2], column: f64) {
        let index = libm::floor(point[0] / column) as i64;
        match &mut self.run {
            Some(run) if run.column == index => run.add(point),
            _ => {
                self.end_run();
                if self.done.is_empty() {
                    self.done.push(point);
                }
                self.run =
                    Some(Run { column: index, count: 0, low: (0, point), high: (0, point), last: point });
            }
        }
    }

    fn end_run(&mut self) {
        let Some(run) = self.run.take() else { return };
        let (early, late) = if run.low.0 <= run.high.0 { (run.low, run.high) } else { (run.high, run.low) };
        self.add(early.1);
        self.add(late.1);
    }

    fn add(&mut self, point: [f64; 2]) {
        if self.done.last() != Some(&point) {
            self.done.push(point);
        }
    }

    fn finish(mut self) -> Option<Vec<[f64; 2]>> {
        let last = self.run.as_ref().map(|run| run.last);
        self.end_run();
        if let Some(last) = last {
            self.add(last);
        }
        (!self.done.is_empty()).then_some(self.done)
    }
}

impl Run {
    fn add(&mut self, point: [f64; 2]) {
        self.count += 1;
        if point[1] < self.low.1[1] {
            self.low = (self.count, point);
        }
        if point[1] > self.high.1[1] {
            self.high = (self.count, point);
        }
        self.last = point;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::extent;

    #[test]
    fn extremes_and_ends_survive_and_few_points_remain() {
        let value = |i: usize| match i {
            12_345 => 9.0,
            40_000 => -7.0,
            _ => libm::sin(i as f64 * 0.01),
        };
        let points = (0..60_000).map(|i| [i as f64 * 800.0 / 60_000.0, value(i)]);
        let thinned = line(points.clone(), 1.0);
        assert_eq!(thinned.len(), 1);
        assert!(thinned[0].len() <= 1602, "{}", thinned[0].len());
        assert_eq!(extent(thinned[0].iter().map(|point| point[1])), Some([-7.0, 9.0]));
        assert_eq!(thinned[0].first(), points.clone().next().as_ref());
        assert_eq!(thinned[0].last(), points.clone().next_back().as_ref());
        // Each column keeps its own extremes.
        for column in 0..800 {
            let of = |points: &mut dyn Iterator<Item = [f64; 2]>| {
                extent(points.filter(|point| point[0].floor() as i32 == column).map(|point| point[1]))
            };
            assert_eq!(of(&mut thinned[0].iter().copied()), of(&mut points.clone()), "column {column}");
        }
    }

    #[test]
    fn gaps_split_and_curves_may_run_back() {
        let points = [[0.0, 1.0], [0.1, f64::NAN], [5.0, 2.0], [4.0, 3.0], [5.0, 4.0]];
        assert_eq!(line(points, 1.0), [vec![[0.0, 1.0]], vec![[5.0, 2.0], [4.0, 3.0], [5.0, 4.0]]]);
        assert!(line([[f64::INFINITY, 0.0]], 1.0).is_empty());
    }

    #[test]
    fn a_cloud_keeps_its_outliers() {
        let crowd = (0..60_000).map(|i| [(i % 100) as f64 * 0.1, (i % 37) as f64 * 0.1]);
        let thinned = cloud(crowd.chain([[500.0, 300.0]]), 2.0);
        assert!(thinned.len() <= 5 * 2 + 1, "{}", thinned.len());
        assert!(thinned.contains(&[500.0, 300.0]));
    }
}
