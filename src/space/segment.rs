//! This module defines segments along a coordinate direction, which represent walls, sides of
//! blocks and gauges.

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
