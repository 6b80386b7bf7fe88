//! This module resolves outlines of any shape: polygons and circles of blocks and regions, and walls
//! with a thickness.

use super::values::{Result, point, positive};
use crate::scene::{Quantity, SceneError, Scope};
use crate::space::outline::{Outline, Point, crossing_edges};

/// Area of a polygon, relative to the square of its extent, below which it has no area.
const FLAT: f64 = 1e-12;

/// A polygon. Coordinates are in m, relative to the origin of the scope.
pub(super) fn polygon(corners: &[[Quantity; 2]], what: &str, scope: &Scope) -> Result<Outline> {
    let Some(first) = corners.first().filter(|_| corners.len() >= 3) else {
        let error = format!("{what}: a polygon of {} corners", corners.len());
        let remedy = "give three corners or more, each as [x, y]";
        return Err(match corners.first() {
            Some(corner) => SceneError::at(&corner[0], error, remedy),
            None => SceneError::of_key(what, error, remedy),
        });
    };
    let points: Vec<Point> =
        corners.iter().map(|corner| point(corner, scope)).collect::<Result<_>>()?;
    for (k, p) in points.iter().enumerate() {
        let next = (k + 1) % points.len();
        if points[next] == *p {
            return Err(SceneError::at(
                &corners[next][0],
                format!("{what}: corners {k} and {next} are the same point ({}, {})", p[0], p[1]),
                "remove one of them; the last corner is joined to the first by itself",
            ));
        }
    }
    if let Some([a, b]) = crossing_edges(&points) {
        let edge = |k: usize| {
            let [from, to] = [points[k], points[(k + 1) % points.len()]];
            format!("({}, {}) to ({}, {})", from[0], from[1], to[0], to[1])
        };
        return Err(SceneError::at(
            &corners[b][0],
            format!("{what}: the polygon crosses itself: its edge {} meets {}", edge(b), edge(a)),
            "list the corners in the order of the outline, or make two polygons of it",
        ));
    }
    let outline = Outline::polygon(points);
    let [x, y] = outline.extent();
    if outline.area() <= FLAT * (x[1] - x[0]).max(y[1] - y[0]).powi(2) {
        return Err(SceneError::at(
            &first[0],
            format!("{what}: the polygon has no area"),
            "its corners must not lie on one line",
        ));
    }
    Ok(outline)
}

/// A circle.
pub(super) fn circle(
    centre: &[Quantity; 2],
    radius: &Quantity,
    what: &str,
    scope: &Scope,
) -> Result<Outline> {
    let centre = point(centre, scope)?;
    Ok(Outline::Circle { centre, radius: positive(radius, scope, &format!("{what}: radius"))? })
}

/// The rectangle around a segment.
pub(super) fn around(from: Point, to: Point, thickness: f64) -> Outline {
    let along = [to[0] - from[0], to[1] - from[1]];
    let half = 0.5 * thickness / along[0].hypot(along[1]);
    let side = [-along[1] * half, along[0] * half];
    let corner = |p: Point, s: f64| [p[0] + s * side[0], p[1] + s * side[1]];
    Outline::polygon(vec![corner(from, 1.0), corner(from, -1.0), corner(to, -1.0), corner(to, 1.0)])
}

/// Refuses an outline that does not touch the domain.
pub(super) fn touches(
    outline: &Outline,
    domain: [[f64; 2]; 2],
    place: &Quantity,
    what: &str,
) -> Result<()> {
    let extent = outline.extent();
    for c in 0..2 {
        let ([low, high], [from, to]) = (extent[c], domain[c]);
        if high <= from || low >= to {
            return Err(SceneError::at(
                place,
                format!("{what} lies outside the domain: {} = {low} to {high}", ["x", "y"][c]),
                format!("the domain is {from} to {to}: move it"),
            ));
        }
    }
    Ok(())
}
