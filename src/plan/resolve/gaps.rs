//! This module finds gaps beside solids of any shape that the mesh is too coarse for.

use super::walls::Walls;
use crate::plan::{Units, Warning};
use crate::space::mesh::Mesh;
use crate::space::outline::{Outline, Point};

/// Width of a gap, in cells, below which the flow through it is uncertain. For wider ones the test
/// `openings_between_polygons_are_open` bounds its error.
const NARROW: f64 = 1.0;

/// Distance, relative to the domain, up to which solids touch.
const TOUCHING: f64 = 1e-9;

/// Gaps between solids at rest, and between them and the sides of the domain, that are narrower than a
/// cell. Solids that touch or overlap have none. Coordinates are relative to `origin`.
pub(super) fn narrow(
    walls: &Walls,
    (domain, origin): ([[f64; 2]; 2], Point),
    mesh: &Mesh,
    units: &Units,
) -> Vec<Warning> {
    let solids: Vec<_> = walls.at_rest().collect();
    let touching = TOUCHING * domain.iter().map(|[a, b]| b - a).fold(0.0, f64::max);
    let inside = |p: Point| (0..2).all(|c| p[c] >= domain[c][0] && p[c] <= domain[c][1]);
    let mut out = vec![];
    let mut add = |a: &str, b: &str, found: Option<(f64, Point)>| {
        let Some((width, at)) = found.filter(|(width, at)| *width > touching && inside(*at)) else {
            return;
        };
        let [hx, hy] = mesh.cell_size(mesh.locate(at.map(|v| v / units.length)));
        let cell = hx.max(hy) * units.length;
        if width < NARROW * cell {
            let (between, at) = ([a.to_owned(), b.to_owned()], [0, 1].map(|c| origin[c] + at[c]));
            out.push(Warning::NarrowGap { between, at, width, cell });
        }
    };
    for (k, a) in solids.iter().enumerate() {
        for b in &solids[k + 1..] {
            add(&a.name, &b.name, gap(&a.outline, &b.outline));
        }
        for (c, sides) in [["left", "right"], ["bottom", "top"]].into_iter().enumerate() {
            let periodic = [&mesh.x, &mesh.y][c].periodic();
            for (end, side) in sides.into_iter().enumerate().filter(|_| !periodic) {
                add(&a.name, side, from_side(&a.outline, c, end, domain[c][end]));
            }
        }
    }
    out
}

/// Width and place of the gap between two outlines; `None` if they overlap.
fn gap(a: &Outline, b: &Outline) -> Option<(f64, Point)> {
    let nearest = |a: &Outline, b: &Outline| match a {
        Outline::Circle { centre, radius } => Some((b.distance(*centre) - radius, *centre)),
        Outline::Polygon(corners) => {
            let all = corners.iter().map(|&p| (b.distance(p), p));
            all.min_by(|a, b| a.0.total_cmp(&b.0))
        }
    };
    let both = [nearest(a, b)?, nearest(b, a)?];
    both.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(width, _)| *width > 0.0)
}

/// Width and place of the gap between an outline and the lower (0) or upper (1) side of the domain in a
/// direction.
fn from_side(outline: &Outline, c: usize, end: usize, side: f64) -> Option<(f64, Point)> {
    let away = |p: Point| if end == 0 { p[c] - side } else { side - p[c] };
    let line = outline.line();
    line.into_iter().map(|p| (away(p), p)).min_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_the_shortest_distances() {
        let square =
            |x: f64| Outline::polygon(vec![[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]]);
        let circle = Outline::Circle { centre: [3.0, 0.5], radius: 0.75 };
        assert_eq!(gap(&square(0.0), &square(1.25)).map(|g| g.0), Some(0.25));
        assert_eq!(gap(&square(0.0), &circle).map(|g| g.0), Some(1.25));
        assert_eq!(gap(&square(0.0), &square(0.5)), None);
        assert_eq!(from_side(&square(0.5), 0, 0, 0.0).map(|g| g.0), Some(0.5));
        assert_eq!(from_side(&circle, 1, 1, 2.0).map(|g| g.0), Some(0.75));
    }
}
