//! This module defines the fixed tensor-product mesh: two axes of mesh lines, the nodes of the
//! biquadratic element, and the cells.

use super::measure::{CellMeasure, FaceMeasure, Measure};
use super::parts::{Part, Parts, SharedParts};

/// Distance from a mesh line, in cell sizes, below which a point counts as on the line. When the
/// flow moves points along a line, rounding must not decide which of two cells contains them.
pub const ON_LINE: f64 = 1e-10;

/// Distance from the axis, in cell sizes, at which points on the axis are taken to be.
const ON_AXIS: f64 = 1e-6;

/// Largest reference coordinate at which a point is certainly inside the cell despite rounding.
pub const INSIDE: f64 = 1.0 - 1e-9;

/// Extent of a cell along one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// Coordinate of the centre.
    pub centre: f64,
    /// Reference coordinate per length: 2 divided by the cell size.
    pub per_length: f64,
}

impl Span {
    /// Reference coordinate of `x`; -1 to 1 inside the cell.
    pub fn reference(&self, x: f64) -> f64 {
        (x - self.centre) * self.per_length
    }
}

/// Mesh lines along one direction, in ascending order; on a periodic axis the last line is
/// identified with the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    lines: Vec<f64>,
    periodic: bool,
    spans: Vec<Span>,
    /// Cell at the start of each of the uniform bins over the axis.
    bins: Vec<u32>,
    bins_per_length: f64,
    largest: f64,
}

impl Axis {
    /// An axis with the given lines: at least two, strictly ascending.
    pub fn new(lines: Vec<f64>, periodic: bool) -> Self {
        debug_assert!(lines.len() >= 2 && lines.windows(2).all(|w| w[0] < w[1]));
        let length = lines[lines.len() - 1] - lines[0];
        let count = 4 * (lines.len() - 1);
        let bins_per_length = count as f64 / length;
        let mut bins = Vec::with_capacity(count + 1);
        let mut cell = 0;
        for b in 0..=count {
            let start = lines[0] + b as f64 / bins_per_length;
            while cell + 2 < lines.len() && lines[cell + 1] <= start {
                cell += 1;
            }
            bins.push(cell as u32);
        }
        let spans = lines
            .windows(2)
            .map(|w| Span { centre: 0.5 * (w[0] + w[1]), per_length: 2.0 / (w[1] - w[0]) })
            .collect();
        let largest = lines.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        Axis { lines, periodic, spans, bins, bins_per_length, largest }
    }

    /// Coordinates of the mesh lines.
    pub fn lines(&self) -> &[f64] {
        &self.lines
    }
    /// Whether the axis is periodic.
    pub fn periodic(&self) -> bool {
        self.periodic
    }
    /// Coordinate of the first mesh line.
    pub fn start(&self) -> f64 {
        self.lines[0]
    }
    /// Coordinate of the last mesh line.
    pub fn end(&self) -> f64 {
        self.lines[self.lines.len() - 1]
    }
    /// Length of the axis.
    pub fn length(&self) -> f64 {
        self.end() - self.start()
    }
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.lines.len() - 1
    }
    /// Number of nodes of the quadratic element: mesh lines and midpoints.
    pub fn nodes(&self) -> usize {
        2 * self.cells() + usize::from(!self.periodic)
    }
    /// Extent of a cell.
    pub fn span(&self, cell: usize) -> Span {
        self.spans[cell]
    }
    /// Size of a cell.
    pub fn size(&self, cell: usize) -> f64 {
        self.lines[cell + 1] - self.lines[cell]
    }
    /// Size of the largest cell.
    pub fn largest(&self) -> f64 {
        self.largest
    }
    /// Coordinate of a node.
    pub fn node_coordinate(&self, node: usize) -> f64 {
        if node.is_multiple_of(2) {
            self.lines[node / 2]
        } else {
            0.5 * (self.lines[node / 2] + self.lines[node / 2 + 1])
        }
    }
    /// Index of the local node `a` (0, 1, 2) of a cell.
    pub fn cell_node(&self, cell: usize, a: usize) -> usize {
        let node = 2 * cell + a;
        if self.periodic && node == 2 * self.cells() { 0 } else { node }
    }

    /// Cell that contains a coordinate. Coordinates outside the axis belong to the nearest cell;
    /// coordinates on a line (within `ON_LINE`) belong to the cell above it.
    pub fn locate(&self, x: f64) -> usize {
        let b = ((x - self.lines[0]) * self.bins_per_length) as usize;
        let mut cell = self.bins[b.min(self.bins.len() - 1)] as usize;
        while cell > 0 && x < self.lines[cell] {
            cell -= 1;
        }
        while cell + 2 < self.lines.len() && x >= self.lines[cell + 1] {
            cell += 1;
        }
        let on_next = self.lines[cell + 1] - x <= ON_LINE * self.size(cell);
        if on_next && cell + 2 < self.lines.len() { cell + 1 } else { cell }
    }

    /// The cell before a cell, perhaps across a periodic side.
    pub fn before(&self, cell: usize) -> Option<usize> {
        if cell > 0 { Some(cell - 1) } else { self.periodic.then(|| self.cells() - 1) }
    }

    /// The cell after a cell, perhaps across a periodic side.
    pub fn after(&self, cell: usize) -> Option<usize> {
        if cell + 1 < self.cells() { Some(cell + 1) } else { self.periodic.then_some(0) }
    }

    /// The coordinate nearest to `x` that is not beyond an end; `x` itself on a periodic axis.
    #[inline(always)]
    fn nearest_inside(&self, x: f64) -> f64 {
        if self.periodic { x } else { x.max(self.lines[0]).min(self.lines[self.lines.len() - 1]) }
    }

    /// Maps a coordinate into the range of a periodic axis; does nothing on other axes.
    pub fn wrap(&self, x: f64) -> f64 {
        let end = self.end() - ON_LINE * self.size(self.cells() - 1);
        if !self.periodic || (x >= self.start() && x < end) {
            return x;
        }
        let wrapped = self.start() + (x - self.start()).rem_euclid(self.length());
        if wrapped < end { wrapped } else { self.start() }
    }

    /// Index of the mesh line nearest to a coordinate.
    pub fn nearest_line(&self, x: f64) -> usize {
        let after = self.lines.partition_point(|&l| l < x).min(self.lines.len() - 1);
        if after > 0 && x - self.lines[after - 1] < self.lines[after] - x {
            after - 1
        } else {
            after
        }
    }

    /// The shortest distance between periodic images of two points whose coordinates differ by `d`;
    /// without periodicity it is `d`.
    pub fn nearest_image(&self, d: f64) -> f64 {
        let length = self.length();
        if !self.periodic {
            d
        } else if d > 0.5 * length {
            d - length
        } else if d < -0.5 * length {
            d + length
        } else {
            d
        }
    }
}

/// Tensor-product mesh of rectangles. Cell `(i, j)` has index `j nx + i`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Axis along x.
    pub x: Axis,
    /// Axis along y.
    pub y: Axis,
    /// Whether each cell is part of a solid block; such cells contain no material.
    pub solid: Vec<bool>,
    measure: Measure,
    /// Solids of any shape and the free parts of the cells that they cut; `None` without solids.
    pub(super) parts: SharedParts,
}

impl Mesh {
    /// A mesh without solid cells.
    pub fn new(x: Axis, y: Axis) -> Self {
        let solid = vec![false; x.cells() * y.cells()];
        Mesh { x, y, solid, measure: Measure::PLANE, parts: None }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.x.cells() * self.y.cells()
    }
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.x.nodes() * self.y.nodes()
    }
    /// Index of the cell in column `i` and row `j`.
    pub fn cell(&self, i: usize, j: usize) -> usize {
        j * self.x.cells() + i
    }
    /// The axis along the direction `normal` (0 for x, 1 for y), and the other axis.
    pub fn axes(&self, normal: usize) -> (&Axis, &Axis) {
        if normal == 0 { (&self.x, &self.y) } else { (&self.y, &self.x) }
    }
    /// Index of the cell with the position `across` along the direction `normal` and `along` in the
    /// other direction.
    pub fn cell_across(&self, normal: usize, across: usize, along: usize) -> usize {
        if normal == 0 { self.cell(across, along) } else { self.cell(along, across) }
    }
    /// Column and row of a cell.
    pub fn cell_ij(&self, cell: usize) -> (usize, usize) {
        (cell % self.x.cells(), cell / self.x.cells())
    }
    /// Index of the node in column `i` and row `j`.
    pub fn node(&self, i: usize, j: usize) -> usize {
        j * self.x.nodes() + i
    }
    /// Coordinates of a node.
    pub fn node_position(&self, node: usize) -> [f64; 2] {
        let (i, j) = (node % self.x.nodes(), node / self.x.nodes());
        [self.x.node_coordinate(i), self.y.node_coordinate(j)]
    }
    /// Indices of the nine nodes of a cell, row by row from below; the fifth is the centre.
    pub fn cell_nodes(&self, cell: usize) -> [usize; 9] {
        let (i, j) = self.cell_ij(cell);
        std::array::from_fn(|a| self.node(self.x.cell_node(i, a % 3), self.y.cell_node(j, a / 3)))
    }
    /// Size of a cell along x and y.
    pub fn cell_size(&self, cell: usize) -> [f64; 2] {
        let (i, j) = self.cell_ij(cell);
        [self.x.size(i), self.y.size(j)]
    }
    /// Measure of a cell, or of its part that solids leave free.
    pub fn cell_measure(&self, cell: usize) -> CellMeasure {
        let whole = self.whole_measure(cell);
        self.part(cell).map_or(whole, |part| whole.part(part.fraction))
    }
    /// Measure of a cell, with the solids in it.
    pub fn whole_measure(&self, cell: usize) -> CellMeasure {
        self.measure.of_cell(self.cell_size(cell), self.cell_centre(cell)[0])
    }
    /// Mass of the pressure basis by which divergences are weighted. That of a sliver beside a solid is
    /// that of a cell: what flows into it by rounding is little beside the volume of cells.
    pub fn divergence_mass(&self, cell: usize) -> [f64; 3] {
        self.whole_measure(cell).pressure_mass()
    }
    /// The solids of any shape, with the free parts of cells, if there are any.
    pub fn parts(&self) -> Option<&Parts> {
        self.parts.as_deref()
    }
    /// The parts, to be kept by others.
    pub fn shared_parts(&self) -> SharedParts {
        self.parts.clone()
    }
    /// The free part of a cell with a solid of any shape in it.
    #[inline(always)]
    pub fn part(&self, cell: usize) -> Option<&Part> {
        self.parts.as_deref()?.of(cell)
    }
    /// Velocity of the solid of any shape that fills a cell, if one does and one moves.
    pub fn solid_velocity(&self, cell: usize) -> Option<[f64; 2]> {
        let parts = self.parts().filter(|parts| self.solid[cell] && parts.move_on())?;
        let (solid, d) = parts.nearest(self.cell_centre(cell))?;
        (d < 0.0).then_some(solid.velocity)
    }
    /// Whether a point is in the domain, and not inside of a solid.
    pub fn holds(&self, p: [f64; 2]) -> bool {
        let within = |v: f64, axis: &Axis| v >= axis.start() && v <= axis.end();
        within(p[0], &self.x) && within(p[1], &self.y) && !self.is_solid_at(p)
    }
    /// Whether a point is inside of a solid.
    pub fn is_solid_at(&self, p: [f64; 2]) -> bool {
        self.is_solid_in(self.locate(p), p)
    }
    /// Whether a point of a cell is inside of a solid.
    pub fn is_solid_in(&self, cell: usize, p: [f64; 2]) -> bool {
        self.solid[cell]
            || self.part(cell).is_some() && self.parts().is_some_and(|parts| parts.is_solid(p))
    }
    /// Volume of a cell (its area in the plane, per unit depth), without solids in it.
    pub fn cell_volume(&self, cell: usize) -> f64 {
        self.cell_measure(cell).volume()
    }
    /// Measure of a side of a cell: 0 left, 1 right, 2 lower, 3 upper.
    pub fn face(&self, cell: usize, side: usize) -> FaceMeasure {
        self.whole_measure(cell).of_side(side)
    }
    /// Thickness at a point; on the axis, that very close to it.
    pub fn thickness(&self, p: [f64; 2]) -> f64 {
        self.measure.depth_at(p[0].max(self.x.start() + ON_AXIS * self.x.size(0)))
    }
    /// Area in the plane of the mesh of a volume around a point: the volume over the thickness.
    pub fn section(&self, volume: f64, p: [f64; 2]) -> f64 {
        volume / self.thickness(p)
    }
    /// Measure of integration.
    pub fn measure(&self) -> Measure {
        self.measure
    }
    /// The same mesh with another measure of integration.
    pub fn with_measure(self, measure: Measure) -> Self {
        Mesh { measure, ..self }
    }
    /// Coordinates of the centre of a cell.
    pub fn cell_centre(&self, cell: usize) -> [f64; 2] {
        let (i, j) = self.cell_ij(cell);
        [self.x.node_coordinate(2 * i + 1), self.y.node_coordinate(2 * j + 1)]
    }
    /// Cell that contains a point; see [`Axis::locate`].
    pub fn locate(&self, p: [f64; 2]) -> usize {
        self.cell(self.x.locate(p[0]), self.y.locate(p[1]))
    }
    /// Reference coordinates of a point relative to a cell, each -1 to 1 inside it.
    pub fn to_reference(&self, cell: usize, p: [f64; 2]) -> [f64; 2] {
        let [cx, cy] = self.cell_centre(cell);
        let [hx, hy] = self.cell_size(cell);
        [2.0 * (p[0] - cx) / hx, 2.0 * (p[1] - cy) / hy]
    }
    /// Reference coordinates, relative to a cell, of the nearest periodic image of a point.
    pub fn to_near_reference(&self, cell: usize, p: [f64; 2]) -> [f64; 2] {
        let centre = self.cell_centre(cell);
        let near = |axis: &Axis, at: f64, middle: f64| {
            let turns = if axis.periodic { ((at - middle) / axis.length()).round() } else { 0.0 };
            at - turns * axis.length()
        };
        self.to_reference(cell, [near(&self.x, p[0], centre[0]), near(&self.y, p[1], centre[1])])
    }
    /// Coordinates of the point with the given reference coordinates in a cell.
    pub fn from_reference(&self, cell: usize, r: [f64; 2]) -> [f64; 2] {
        let [cx, cy] = self.cell_centre(cell);
        let [hx, hy] = self.cell_size(cell);
        [cx + 0.5 * hx * r[0], cy + 0.5 * hy * r[1]]
    }
    /// Maps a point into the domain along periodic axes.
    pub fn wrap(&self, p: [f64; 2]) -> [f64; 2] {
        [self.x.wrap(p[0]), self.y.wrap(p[1])]
    }
    /// The point nearest to a point that is not beyond a side of the domain.
    #[inline(always)]
    pub fn nearest_inside(&self, p: [f64; 2]) -> [f64; 2] {
        [self.x.nearest_inside(p[0]), self.y.nearest_inside(p[1])]
    }

    /// The cell beyond a side of a cell (left, right, bottom, top); `None` beyond the domain.
    pub fn beyond(&self, cell: usize, side: usize) -> Option<usize> {
        let (i, j) = self.cell_ij(cell);
        match side {
            0 => Some(self.cell(self.x.before(i)?, j)),
            1 => Some(self.cell(self.x.after(i)?, j)),
            2 => Some(self.cell(i, self.y.before(j)?)),
            _ => Some(self.cell(i, self.y.after(j)?)),
        }
    }

    /// The cells that share a corner with a cell, including itself and periodic neighbours; at most
    /// nine.
    pub fn block(&self, cell: usize) -> impl Iterator<Item = usize> + use<'_> {
        let (i, j) = self.cell_ij(cell);
        let near = |axis: &Axis, k: usize| {
            // A periodic axis of one or two cells has no third cell.
            let below = axis.before(k).filter(|&b| b != k);
            let above = axis.after(k).filter(|&a| a != k && Some(a) != below);
            [below, Some(k), above]
        };
        let (x, y) = (near(&self.x, i), near(&self.y, j));
        y.into_iter()
            .flatten()
            .flat_map(move |j| x.into_iter().flatten().map(move |i| self.cell(i, j)))
    }
}
