//! This module finds the corners of solids, which attract mesh lines.

use super::walls::Walls;
use crate::space::outline::Outline;

/// A corner of a solid that is in the domain and does not move.
pub(super) struct Corner {
    pub(super) at: [f64; 2],
    /// Whether the solid has less than half of the angles there, so that flow around it is singular.
    pub(super) salient: bool,
}

impl Walls {
    /// Corners of polygons that touch no other solid, and of blocks along mesh lines. Solids that move do not
    /// count, so that the mesh does not depend on where they are.
    pub(super) fn corners(&self, [x, y]: [[f64; 2]; 2]) -> Vec<Corner> {
        let mut out = Vec::new();
        let tiny = 1e-9 * (x[1] - x[0]).max(y[1] - y[0]);
        for (index, solid) in self.at_rest().enumerate() {
            let Outline::Polygon(corners) = &solid.outline else { continue };
            // Measured: lines through corners of two solids that touch each other can take three times the
            // corrections.
            let near = |of: &[[f64; 2]], o: &Outline| of.iter().any(|&p| o.distance(p) <= tiny);
            let touches = |o: &Outline| {
                let theirs = if let Outline::Polygon(theirs) = o { &theirs[..] } else { &[] };
                near(corners, o) || near(theirs, &solid.outline)
            };
            let mut others = self.at_rest().enumerate().filter(|(k, _)| *k != index);
            if others.any(|(_, o)| touches(&o.outline)) {
                continue;
            }
            let n = corners.len();
            out.extend((0..n).map(|k| {
                let [a, b, c] = [corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]];
                let turn = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
                Corner { at: b, salient: turn > 0.0 }
            }));
        }
        for block in &self.blocks {
            let [bx, by] = block.range;
            let all = bx.into_iter().flat_map(|x| by.map(|y| [x, y]));
            out.extend(all.map(|at| Corner { at, salient: true }));
        }
        let inside = |p: [f64; 2]| p[0] >= x[0] && p[0] <= x[1] && p[1] >= y[0] && p[1] <= y[1];
        out.retain(|corner| inside(corner.at));
        out
    }
}
