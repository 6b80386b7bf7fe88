//! This module holds the regular grids on which fields are drawn, and computes isolines on them.

use crate::frame::{GridField, Isoline, extent};
use crate::plan::Plan;
use crate::space::mesh::{Axis, Mesh};
use crate::space::shape::Shape;

/// A regular grid of points over the domain, in the plan's units.
pub(super) struct Raster {
    /// Lower left corner.
    pub(super) origin: [f64; 2],
    /// Distance of neighbouring points, by direction.
    pub(super) step: [f64; 2],
    /// Number of columns and rows.
    pub(super) n: [usize; 2],
}

impl Raster {
    /// A grid with about `along_longer` points along the longer side of the domain.
    pub(super) fn new(plan: &Plan, along_longer: f64) -> Self {
        let (x, y) = (&plan.mesh.x, &plan.mesh.y);
        let step = x.length().max(y.length()) / along_longer;
        let n = [x.length() / step, y.length() / step].map(|v| (v.round() as usize).max(2));
        Raster {
            origin: [x.start(), y.start()],
            step: [x.length() / n[0] as f64, y.length() / n[1] as f64],
            n,
        }
    }

    /// Position of point `k`; points are numbered row by row.
    pub(super) fn centre(&self, k: usize) -> [f64; 2] {
        let (i, j) = (k % self.n[0], k / self.n[0]);
        [
            self.origin[0] + (i as f64 + 0.5) * self.step[0],
            self.origin[1] + (j as f64 + 0.5) * self.step[1],
        ]
    }

    /// Index of the point nearest to a position.
    pub(super) fn index(&self, p: [f64; 2]) -> usize {
        let at = |c: usize| (((p[c] - self.origin[c]) / self.step[c]) as usize).min(self.n[c] - 1);
        at(1) * self.n[0] + at(0)
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.n[0] * self.n[1]
    }

    /// Positions of the columns and rows in the mesh.
    pub(super) fn stand(&self, mesh: &Mesh) -> [Vec<Stand>; 2] {
        let stand = |axis: &Axis, x: f64| {
            let cell = axis.locate(x);
            let r = axis.span(cell).reference(x);
            let n = Shape::line(r);
            Stand { cell, r, n }
        };
        let column = |i: usize| stand(&mesh.x, self.centre(i)[0]);
        let row = |j: usize| stand(&mesh.y, self.centre(j * self.n[0])[1]);
        [(0..self.n[0]).map(column).collect(), (0..self.n[1]).map(row).collect()]
    }
}

/// Position of a column or row of a raster in the mesh.
#[derive(Clone, Copy)]
pub(super) struct Stand {
    /// Index of the cell along the axis.
    pub(super) cell: usize,
    /// Reference coordinate in the cell.
    pub(super) r: f64,
    /// Shape functions at `r`.
    pub(super) n: [f64; 3],
}

/// Smallest and largest finite value; `[0, 1]` if they are equal or there is none.
pub(super) fn range(values: &[f32]) -> [f32; 2] {
    extent(values).filter(|[low, high]| low < high).unwrap_or([0.0, 1.0])
}

/// The smallest range that is symmetric about zero and contains a range.
pub(super) fn symmetric([low, high]: [f32; 2]) -> [f32; 2] {
    let m = low.abs().max(high.abs());
    [-m, m]
}

/// Values on a coarse raster, with bilinear interpolation between its points.
pub(super) struct Coarse {
    pub(super) raster: Raster,
    pub(super) values: Vec<f64>,
}

impl Coarse {
    /// Interpolated values at the points of another raster.
    pub(super) fn sample(&self, fine: &Raster) -> Vec<f32> {
        let r = &self.raster;
        (0..fine.len())
            .map(|k| {
                let p = fine.centre(k);
                let place = |c: usize| {
                    let t =
                        ((p[c] - r.origin[c]) / r.step[c] - 0.5).clamp(0.0, (r.n[c] - 1) as f64);
                    let i = (t as usize).min(r.n[c].saturating_sub(2));
                    (i, t - i as f64)
                };
                let ((i, s), (j, t)) = (place(0), place(1));
                let at = |i: usize, j: usize| self.values[j * r.n[0] + i];
                let low = at(i, j) * (1.0 - s) + at(i + 1, j) * s;
                let high = at(i, j + 1) * (1.0 - s) + at(i + 1, j + 1) * s;
                (low * (1.0 - t) + high * t) as f32
            })
            .collect()
    }
}

/// Isoline of a field at a level, interpolated between its points (marching squares).
pub(super) fn isoline(f: &GridField, level: f32) -> Isoline {
    let point = |i: usize, j: usize| {
        [f.origin[0] + (i as f32 + 0.5) * f.cell[0], f.origin[1] + (j as f32 + 0.5) * f.cell[1]]
    };
    let value = |i: usize, j: usize| f.values[j * f.nx + i];
    let mut strips = Vec::new();
    for j in 0..f.ny - 1 {
        for i in 0..f.nx - 1 {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let mut cuts: Vec<[f32; 2]> = Vec::with_capacity(4);
            for e in 0..4 {
                // Both squares at an edge use the same order of its ends, so that the cut is equal
                // to the last bit and the segments can be joined.
                let ends = (corners[e], corners[(e + 1) % 4]);
                let ((ai, aj), (bi, bj)) = if ends.0 < ends.1 { ends } else { (ends.1, ends.0) };
                let (a, b) = (value(ai, aj) - level, value(bi, bj) - level);
                if (a < 0.0) != (b < 0.0) && a.is_finite() && b.is_finite() {
                    let t = a / (a - b);
                    let (p, q) = (point(ai, aj), point(bi, bj));
                    cuts.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
                }
            }
            strips.extend(cuts.chunks_exact(2).map(|c| vec![c[0], c[1]]));
        }
    }
    Isoline { field: f.name.clone(), level, strips: joined(strips) }
}

/// Joins segments that share an end into polylines.
pub(super) fn joined(segments: Vec<Vec<[f32; 2]>>) -> Vec<Vec<[f32; 2]>> {
    use std::collections::HashMap;
    let key = |p: [f32; 2]| (p[0].to_bits(), p[1].to_bits());
    let mut at: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
    for (k, s) in segments.iter().enumerate() {
        at.entry(key(s[0])).or_default().push(k);
        at.entry(key(s[1])).or_default().push(k);
    }
    let mut used = vec![false; segments.len()];
    let mut out = Vec::new();
    for start in 0..segments.len() {
        if used[start] {
            continue;
        }
        used[start] = true;
        let mut line = segments[start].clone();
        for _ in 0..2 {
            loop {
                let end = line[line.len() - 1];
                let next = at[&key(end)].iter().copied().find(|&k| !used[k]);
                let Some(k) = next else { break };
                used[k] = true;
                let s = &segments[k];
                line.push(if s[0] == end { s[1] } else { s[0] });
            }
            line.reverse();
        }
        out.push(line);
    }
    out
}
