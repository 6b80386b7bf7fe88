//! This module defines segments along a coordinate direction, which represent walls, sides of
//! blocks and gauges, and gauges in any direction.

use super::mesh::{Axis, Mesh};

/// A segment along a coordinate direction; its owner defines the unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Direction of the normal: 0 for x (vertical segment), 1 for y (horizontal segment).
    pub normal: usize,
    /// Coordinate of the segment along the normal.
    pub at: f64,
    /// Coordinate of the lower or left end.
    pub from: f64,
    /// Coordinate of the upper or right end.
    pub to: f64,
}

impl Segment {
    /// The point on the line of the segment whose other coordinate is `along`.
    pub fn point(&self, along: f64) -> [f64; 2] {
        if self.normal == 0 { [self.at, along] } else { [along, self.at] }
    }

    /// Unit vector along the normal.
    pub fn unit_normal(&self) -> [f64; 2] {
        if self.normal == 0 { [1.0, 0.0] } else { [0.0, 1.0] }
    }

    /// The two end points, in ascending order.
    pub fn ends(&self) -> [[f64; 2]; 2] {
        [self.point(self.from), self.point(self.to)]
    }

    /// The mesh lines that the segment requires, as (direction of the normal, coordinate): one
    /// along the segment and one through each end.
    pub fn lines(&self) -> [(usize, f64); 3] {
        [(self.normal, self.at), (1 - self.normal, self.from), (1 - self.normal, self.to)]
    }

    /// The segment with all coordinates multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Segment {
        let [at, from, to] = [self.at, self.from, self.to].map(|v| v * factor);
        Segment { normal: self.normal, at, from, to }
    }

    /// The segment moved to the nearest mesh lines; `length` is the unit of length of the mesh in
    /// the units of the segment.
    pub fn on_mesh(&self, mesh: &Mesh, length: f64) -> Segment {
        let (across, along) = mesh.axes(self.normal);
        let on = |axis: &Axis, v: f64| axis.lines()[axis.nearest_line(v / length)];
        Segment {
            normal: self.normal,
            at: on(across, self.at),
            from: on(along, self.from),
            to: on(along, self.to),
        }
    }

    /// Mesh nodes on the segment, in ascending order; the segment must lie on mesh lines.
    pub fn nodes<'a>(&self, mesh: &'a Mesh) -> impl Iterator<Item = usize> + use<'a> {
        let (across, along) = mesh.axes(self.normal);
        let normal = self.normal;
        // The segment may lie or end on the line where a periodic axis is joined.
        let wrap = |axis: &Axis, n: usize| if axis.periodic() { n % axis.nodes() } else { n };
        let line = wrap(across, 2 * across.nearest_line(self.at));
        let [from, to] = [self.from, self.to].map(|v| 2 * along.nearest_line(v));
        (from..=to).map(move |k| {
            let k = wrap(along, k);
            if normal == 0 { mesh.node(line, k) } else { mesh.node(k, line) }
        })
    }

    /// Cells on one side of the segment, which lies on mesh lines inside the mesh: those above or to
    /// the right of it, or the others.
    pub fn cells_beside<'a>(
        &self,
        mesh: &'a Mesh,
        above: bool,
    ) -> impl Iterator<Item = usize> + use<'a> {
        let (across, along) = mesh.axes(self.normal);
        let normal = self.normal;
        let line = across.nearest_line(self.at);
        let cell = if above { line } else { line.saturating_sub(1) };
        let [from, to] = [self.from, self.to].map(|v| along.nearest_line(v));
        (from..to).map(move |k| mesh.cell_across(normal, cell, k))
    }

    /// Cells along the segment, which lies on a side of the mesh and ends on mesh lines, with their
    /// indices along the side.
    pub fn cells_at_side<'a>(
        &self,
        mesh: &'a Mesh,
        side: usize,
    ) -> impl Iterator<Item = (usize, usize)> + use<'a> {
        let (across, along) = mesh.axes(self.normal);
        let normal = self.normal;
        let line = if side.is_multiple_of(2) { 0 } else { across.cells() - 1 };
        let [from, to] = [self.from, self.to].map(|v| along.nearest_line(v));
        (from..to).map(move |k| (k, mesh.cell_across(normal, line, k)))
    }

    /// Cells that are not solid on both sides of the segment, which lies on mesh lines, with the side of
    /// the cell (left, right, bottom, top) that is on it.
    pub fn free_faces<'a>(&self, mesh: &'a Mesh) -> impl Iterator<Item = (usize, usize)> + use<'a> {
        let (across, along) = mesh.axes(self.normal);
        let normal = self.normal;
        let line = across.nearest_line(self.at);
        let count = across.cells();
        let wrapped = |axis: &Axis, k: usize| if axis.periodic() { Some(k % count) } else { None };
        let above = if line < count { Some(line) } else { wrapped(across, line) };
        let below = if line > 0 { Some(line - 1) } else { wrapped(across, count - 1) };
        let [from, to] = [self.from, self.to].map(|v| along.nearest_line(v));
        let both = [(above, 2 * normal), (below, 2 * normal + 1)];
        both.into_iter()
            .filter_map(|(cell, side)| Some((cell?, side)))
            .flat_map(move |(cell, side)| {
                (from..to).map(move |k| (mesh.cell_across(normal, cell, k), side))
            })
            .filter(|&(cell, _)| !mesh.solid[cell])
    }
}

/// A line that a gauge measures across; its owner defines the unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// Along a coordinate direction.
    Aligned(Segment),
    /// From a point to another.
    Slanted([[f64; 2]; 2]),
}

impl Line {
    /// The two end points.
    pub fn ends(&self) -> [[f64; 2]; 2] {
        match self {
            Line::Aligned(segment) => segment.ends(),
            Line::Slanted(ends) => *ends,
        }
    }

    /// The mesh lines that the line requires; see [`Segment::lines`].
    pub fn mesh_lines(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let lines = match self {
            Line::Aligned(segment) => Some(segment.lines()),
            Line::Slanted(_) => None,
        };
        lines.into_iter().flatten()
    }

    /// The line with all coordinates multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Line {
        match self {
            Line::Aligned(segment) => Line::Aligned(segment.scaled(factor)),
            Line::Slanted(ends) => Line::Slanted(ends.map(|p| p.map(|v| v * factor))),
        }
    }

    /// The line in the units of a mesh, whose unit of length is `length`; a line along a coordinate
    /// direction is moved to the nearest mesh lines.
    pub fn on_mesh(&self, mesh: &Mesh, length: f64) -> Line {
        match self {
            Line::Aligned(segment) => Line::Aligned(segment.on_mesh(mesh, length)),
            Line::Slanted(ends) => Line::Slanted(ends.map(|p| p.map(|v| v / length))),
        }
    }

    /// Unit normal: along the positive coordinate direction, or to the left of the way from the first to
    /// the second end.
    pub fn normal(&self) -> [f64; 2] {
        match self {
            Line::Aligned(segment) => segment.unit_normal(),
            Line::Slanted([a, b]) => {
                let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
                let length = dx.hypot(dy);
                [-dy / length, dx / length]
            }
        }
    }

    /// The direction in which a straight path crosses the line: +1 along its normal, -1 against it, 0 if
    /// it does not cross.
    pub fn crossed_by(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let (before, after) = (self.is_ahead(from), self.is_ahead(to));
        if before == after || !self.reaches(from, to) {
            return 0.0;
        }
        if after { 1.0 } else { -1.0 }
    }

    /// Height of a point above the infinite line, along the normal; not a length for slanted lines.
    fn height([p, q]: [[f64; 2]; 2], x: [f64; 2]) -> f64 {
        (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0])
    }

    /// Whether a point is on the side of the infinite line to which the normal points, or on it.
    pub fn is_ahead(&self, x: [f64; 2]) -> bool {
        match self {
            Line::Aligned(s) => x[s.normal] >= s.at,
            Line::Slanted(ends) => Line::height(*ends, x) >= 0.0,
        }
    }

    /// Whether a path that crosses the infinite line does so between the ends.
    fn reaches(&self, from: [f64; 2], to: [f64; 2]) -> bool {
        match self {
            Line::Aligned(s) => {
                let (a, b) = (from[s.normal], to[s.normal]);
                let t = (s.at - a) / (b - a);
                let along = from[1 - s.normal] + t * (to[1 - s.normal] - from[1 - s.normal]);
                along >= s.from && along <= s.to
            }
            Line::Slanted(ends) => {
                let [p, q] = *ends;
                let (a, b) = (Line::height(*ends, from), Line::height(*ends, to));
                let t = a / (a - b);
                let d = [0, 1].map(|c| q[c] - p[c]);
                let along = |c: usize| d[c] * (from[c] + t * (to[c] - from[c]) - p[c]);
                let share = (along(0) + along(1)) / (d[0] * d[0] + d[1] * d[1]);
                (0.0..=1.0).contains(&share)
            }
        }
    }

    /// Shares of the way along a slanted line at which it enters or leaves cells of a mesh, ascending from
    /// 0 to 1.
    fn cuts([p, q]: [[f64; 2]; 2], mesh: &Mesh) -> Vec<f64> {
        let mut cuts = vec![0.0, 1.0];
        for (c, axis) in [&mesh.x, &mesh.y].into_iter().enumerate() {
            let shares = axis.lines().iter().map(|line| (line - p[c]) / (q[c] - p[c]));
            cuts.extend(shares.filter(|t| *t > 0.0 && *t < 1.0));
        }
        cuts.sort_by(f64::total_cmp);
        cuts
    }

    /// Points of a slanted line, `samples` in each cell, with the length that each represents.
    pub fn samples(ends: [[f64; 2]; 2], mesh: &Mesh, samples: usize) -> Vec<([f64; 2], f64)> {
        let [p, q] = ends;
        let length = (q[0] - p[0]).hypot(q[1] - p[1]);
        let cuts = Line::cuts(ends, mesh);
        let pieces = cuts.windows(2).flat_map(|piece| {
            let (from, step) = (piece[0], (piece[1] - piece[0]) / samples as f64);
            (0..samples).map(move |k| (from + (k as f64 + 0.5) * step, step))
        });
        pieces.map(|(t, step)| ([0, 1].map(|c| p[c] + t * (q[c] - p[c])), step * length)).collect()
    }
}
