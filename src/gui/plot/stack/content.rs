//! Contents of an export of a stack.

use super::{Panel, Stack, cache, indexed};
use crate::plot::export::{Figure, FigureKind};
use crate::plot::figure;

impl Stack {
    /// Export of the visible range.
    pub(super) fn figure(&mut self, shown: &[&Panel<'_>], kind: FigureKind) -> Figure {
        let (range, units) = (self.view.range(), self.units);
        match kind {
            FigureKind::Png => Figure::Picture { sources: self.sources.clone() },
            FigureKind::Csv => {
                let caches = &mut self.caches;
                let curves =
                    shown.iter().flat_map(|panel| panel.curves.iter().map(move |curve| (panel, curve)));
                let curves = curves.map(|(panel, curve)| {
                    let data =
                        cache(caches, panel, curve).indexed(curve.data, [1.0, curve.gap], curve.generation);
                    (curve.key.to_string(), data.snapshot(data.inside(range)))
                });
                Figure::Log { x_key: self.x[1], curves: curves.collect(), sources: self.sources.clone() }
            }
            FigureKind::Svg => {
                let mut drawn = Vec::new();
                for panel in shown {
                    let curves = panel.curves.iter().map(|curve| {
                        let visible =
                            indexed(&mut self.caches, panel, curve, units).visible(range, figure::COLUMNS);
                        (panel.curve_name(curve), visible.pieces)
                    });
                    let curves = curves.collect();
                    drawn.push(figure::panel(&panel.name, panel.shown_unit(units), curves, &panel.limits));
                }
                let chart = figure::chart(self.name, self.x[0], range, drawn, &self.sources);
                Figure::Chart(Box::new(chart), self.export.size())
            }
        }
    }
}
