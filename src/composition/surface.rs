//! This module finds where the void of a cell lies that a material fills nearly, from the cells around it.
//!
//! The centroid of the particles of a cell tells where its void is only if the void is not small: at a
//! share `s` the direction is uncertain by `1/s` times the error of the centroid. A level surface at 0.98 of
//! a cell then tilted, and the tilt grew in every step. The heights of the columns of cells around it (or
//! of the rows, if the surface is steep) are as exact as the volumes.

use super::fill::Fill;
use crate::space::mesh::Mesh;

/// Filled shares between which the centroid of the void changes from that of the particles to that of the
/// cells around.
const NEARLY_FULL: [f64; 2] = [0.6, 0.85];

/// The void of a cell that a material fills in part.
#[derive(Clone, Copy, Debug)]
pub struct VoidPart {
    /// The material that stands for it.
    pub material: usize,
    /// Its share of the cell.
    pub share: f64,
    /// Its centroid after the cells around, and the part of that in the centroid that counts.
    pub around: Option<([f64; 2], f64)>,
}

impl VoidPart {
    /// The void of a cell; `None` if the cell is full or empty.
    pub fn of(mesh: &Mesh, fill: &Fill, cell: usize) -> Option<VoidPart> {
        fill.is_partial(cell).then(|| VoidPart {
            material: fill.void(),
            share: 1.0 - fill.of(cell),
            around: void_centroid(mesh, fill, cell),
        })
    }
}

/// Centroid (reference coordinates) of the void of a cell after the cells around it, and its part in the
/// centroid that counts; `None` if that of the particles counts alone.
fn void_centroid(mesh: &Mesh, fill: &Fill, cell: usize) -> Option<([f64; 2], f64)> {
    let share = fill.of(cell);
    let [from, to] = NEARLY_FULL;
    let part = ((share - from) / (to - from)).clamp(0.0, 1.0);
    if part == 0.0 {
        return None;
    }
    let slopes = [0, 1].map(|normal| slope(mesh, fill, cell, normal));
    // The surface is flatter across the direction in which the shares change most.
    let up = usize::from(slopes[1].change.abs() >= slopes[0].change.abs());
    let Slope { change, across } = slopes[up];
    if change == 0.0 {
        return None;
    }
    // Normal of the surface towards the void.
    let mut normal = [0.0; 2];
    normal[up] = -change.signum();
    normal[1 - up] = -across;
    Some((centroid(1.0 - share, normal), part))
}

/// How the shares change along an axis, and the slope of the heights along it across it.
#[derive(Clone, Copy)]
struct Slope {
    /// Filled share of the next cells along the axis less that of the previous ones.
    change: f64,
    /// Change of the height along the axis per length across it, in reference coordinates.
    across: f64,
}

fn slope(mesh: &Mesh, fill: &Fill, cell: usize, axis: usize) -> Slope {
    // Sides of a cell: left, right, bottom, top.
    let go = |cell: usize, axis: usize, up: usize| {
        mesh.beyond(cell, 2 * axis + up).filter(|&next| !mesh.solid[next])
    };
    let size = |cell: usize| mesh.cell_size(cell)[axis];
    // Height of a line of three cells, in sizes of the cell, and the change along it.
    let line = |middle: usize| {
        let ends = [0, 1].map(|up| go(middle, axis, up));
        let of = |c: usize| fill.of(c) * size(c) / size(cell);
        let height = of(middle) + ends.into_iter().flatten().map(of).sum::<f64>();
        let [low, high] = ends.map(|end| end.map_or(fill.of(middle), |c| fill.of(c)));
        (height, high - low)
    };
    let lines = [0, 1].map(|side| go(cell, 1 - axis, side));
    let own = line(cell);
    let [before, after] = lines.map(|c| c.map_or(own, line));
    let place = |c: Option<usize>| mesh.cell_centre(c.unwrap_or(cell))[1 - axis];
    let axis_across = mesh.axes(1 - axis).0;
    let apart = axis_across.nearest_image(place(lines[1]) - place(lines[0])).abs();
    let per_size = mesh.cell_size(cell)[1 - axis] / apart.max(f64::MIN_POSITIVE);
    let across = if apart > 0.0 { (after.0 - before.0) * per_size } else { 0.0 };
    Slope { change: before.1 + own.1 + after.1, across }
}

/// Centroid of the part of a cell with the share `s`, at most a half, that a line with the normal `n` cuts
/// off on the side that the normal points to.
fn centroid(s: f64, n: [f64; 2]) -> [f64; 2] {
    // Coordinates from the corner in that direction, with y along the larger component.
    let y_axis = usize::from(n[1].abs() >= n[0].abs());
    let m = n[1 - y_axis].abs() / n[y_axis].abs();
    let area = 4.0 * s;
    let (x, y) = if area >= 2.0 * m {
        let (a, b) = (0.5 * area + m, 0.5 * area - m);
        let x = 2.0 / 3.0 * (a + 2.0 * b) / (a + b);
        (x, (a * a + a * b + b * b) / (3.0 * (a + b)))
    } else {
        let c = (2.0 * area * m).sqrt();
        (c / (3.0 * m), c / 3.0)
    };
    let mut out = [0.0; 2];
    let towards = |n: f64| if n < 0.0 { -1.0 } else { 1.0 };
    out[y_axis] = towards(n[y_axis]) * (1.0 - y);
    out[1 - y_axis] = towards(n[1 - y_axis]) * (1.0 - x);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::composition::straight::StraightCut;

    #[test]
    fn the_centroid_gives_the_line_with_its_normal_again() {
        for (s, n) in
            [(0.02, [0.0, 1.0]), (0.1, [0.3, 1.0]), (0.3, [-1.0, 0.2]), (0.05, [1.0, -0.9])]
        {
            let cut = StraightCut::new(s, centroid(s, n)).unwrap();
            assert_eq!(cut.trust, 1.0);
            let [_, x, y] = cut.line;
            // The part is on the negative side of the line.
            let turned = (x * n[1] - y * n[0]).abs() / x.hypot(y) / n[0].hypot(n[1]);
            assert!(turned < 1e-12 && x * n[0] + y * n[1] < 0.0, "{s} {n:?}: {:?}", cut.line);
        }
    }
}
