//! This module advects points through the velocity at the middle of the step, which is second order
//! in time.

use super::cell_velocity::{Points, TOGETHER};
pub use super::currents::CELL_GRAIN;
use super::currents::Currents;
use crate::laws::director;
use crate::simd::Simd;
use crate::space::kink::Kink;
use crate::space::mesh::{Axis, INSIDE, Mesh, Span};
use crate::space::shape::NODES;
use crate::space::stream::StreamFlow;
use crate::space::walls::{Enclosure, Landing};
use crate::threads;
use nalgebra::Matrix2;

/// Corrected velocity of every cell. The buffer is reused in the next step.
pub struct CellVelocities {
    cells: Currents,
    /// Part of the velocity of each cell that has a kink; empty if no velocity of the run has one.
    edges: Vec<Option<Edge>>,
    /// Velocity of each cell with a solid of any shape in it; empty without solids.
    streams: Vec<Option<StreamFlow>>,
    /// Whether no wall, side of the domain or periodic seam lies between the points of the 3 x 3
    /// cells around the cell.
    free: Vec<bool>,
    /// Cells whose velocity keeps its divergence, because a material fills them only in part; empty without
    /// a void.
    divergent: Vec<bool>,
}

impl CellVelocities {
    /// Zero velocities on a mesh. `kinked`: whether velocities may have kinks.
    pub fn new(mesh: &Mesh, enclosure: &Enclosure, kinked: bool) -> Self {
        let free = (0..mesh.cells()).map(|cell| is_free(mesh, enclosure, cell)).collect();
        let edges = if kinked { vec![None; mesh.cells()] } else { Vec::new() };
        let streams = vec![None; if mesh.parts().is_some() { mesh.cells() } else { 0 }];
        CellVelocities { cells: Currents::new(mesh), edges, streams, free, divergent: vec![] }
    }

    /// Keeps the divergence of the velocity in some cells.
    pub fn keep_divergence(&mut self, of: impl Fn(usize) -> bool) {
        self.divergent.clear();
        self.divergent.extend((0..self.free.len()).map(of));
    }
}

/// Part `b |d| j` of the velocity of a cell, see [`Kink`].
#[derive(Clone, Copy)]
struct Edge {
    kink: Kink,
    /// The factor `j`, along the line.
    jump: [f64; 2],
}

/// Kinks of the velocity, and their amplitudes for the nodal velocities of a cell.
pub type Kinks<'a> = dyn Fn(usize, &[[f64; 2]; NODES]) -> Option<(Kink, f64)> + Sync + 'a;

/// Whether a cell and its neighbours contain no wall, solid, side or seam.
fn is_free(mesh: &Mesh, enclosure: &Enclosure, cell: usize) -> bool {
    let (i, j) = mesh.cell_ij(cell);
    let amid = |k: usize, axis: &Axis| k > 0 && k + 1 < axis.cells();
    let solid = |c: usize| mesh.solid[c] || mesh.part(c).is_some();
    if !amid(i, &mesh.x) || !amid(j, &mesh.y) || mesh.block(cell).any(solid) {
        return false;
    }
    let extent = |k: usize, axis: &Axis| [axis.lines()[k - 1], axis.lines()[k + 2]];
    let block = [extent(i, &mesh.x), extent(j, &mesh.y)];
    let meets = |[low, high]: [f64; 2], from: f64, to: f64| from <= high && to >= low;
    !enclosure
        .obstacles
        .iter()
        .any(|w| meets(block[w.normal], w.at, w.at) && meets(block[1 - w.normal], w.from, w.to))
}

/// A velocity field frozen at the middle of a step, with the walls of the scene.
pub struct FrozenFlow<'a> {
    /// Mesh of the velocity field.
    pub mesh: &'a Mesh,
    /// Walls, and sides through which points leave.
    pub enclosure: &'a Enclosure,
    /// Length of the step, in the plan's units.
    pub dt: f64,
    /// Time of its start after that of the solids of the mesh.
    pub start: f64,
    /// Velocity of every cell at the middle of the step.
    velocities: &'a Currents,
    edges: &'a [Option<Edge>],
    streams: &'a [Option<StreamFlow>],
    free: &'a [bool],
    simd: Simd,
}

/// Displacement of a point in a step.
pub struct Displacement {
    /// Position at the end of the step, not wrapped around periodic sides.
    pub to: [f64; 2],
    /// Whether the point left the domain through an open side.
    pub left: bool,
    /// Whether a wall stopped the point.
    pub held: bool,
    /// Cell and reference coordinates of the point at the middle of the step.
    pub middle: (usize, [f64; 2]),
    /// Cell at the end of the step, if known.
    pub cell: Option<usize>,
}

/// The cell in which points start.
pub struct StartCell {
    cell: usize,
    /// Spans of the cell and its two neighbours, by direction; the neighbours' spans are set only
    /// if `free`.
    spans: [[Span; 3]; 2],
    /// Difference of the indices of neighbouring cells, by direction.
    stride: [usize; 2],
    /// See [`CellVelocities`].
    free: bool,
    /// Whether a solid of any shape is in the cell.
    cut: bool,
}

impl StartCell {
    fn reference(&self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| self.spans[c][1].reference(p[c]))
    }

    /// The cell among this one and its neighbours that certainly contains a point, with the
    /// reference coordinates of the point; `None` if there is none.
    fn near(&self, p: [f64; 2]) -> Option<(usize, [f64; 2])> {
        if self.cut {
            return None;
        }
        let (mut cell, mut r) = (self.cell, self.reference(p));
        for c in 0..2 {
            if r[c].abs() < INSIDE {
                continue;
            }
            if !self.free {
                return None;
            }
            let [below, _, above] = self.spans[c];
            let stride = self.stride[c];
            let (span, next) =
                if r[c] > 0.0 { (above, cell + stride) } else { (below, cell - stride) };
            r[c] = span.reference(p[c]);
            if r[c].abs() < INSIDE {
                cell = next;
            } else {
                return None;
            }
        }
        Some((cell, r))
    }
}

impl<'a> FrozenFlow<'a> {
    /// The frozen field of a step of length `dt`. `velocity`: nodal velocities at its middle;
    /// `kinks`: their kinks, which only velocities created with kinks have.
    pub fn new(
        mesh: &'a Mesh,
        enclosure: &'a Enclosure,
        velocities: &'a mut CellVelocities,
        velocity: &[[f64; 2]],
        kinks: &Kinks,
        dt: f64,
    ) -> Self {
        let CellVelocities { cells, edges, streams, free, divergent } = velocities;
        let of_nodes = |cell| mesh.cell_nodes(cell).map(|n| velocity[n]);
        threads::for_each(edges, CELL_GRAIN, |cell, edge| {
            *edge = kinks(cell, &of_nodes(cell))
                .map(|(kink, amplitude)| Edge { kink, jump: kink.along.map(|t| t * amplitude) });
        });
        threads::for_each(streams, CELL_GRAIN, |cell, stream| {
            let of = mesh.part(cell).and_then(|part| part.stream.as_ref());
            let thickness = |n: usize| mesh.thickness(mesh.node_position(n));
            *stream = of.map(|s| s.flow(&of_nodes(cell), &mesh.cell_nodes(cell).map(thickness)));
        });
        cells.update(mesh, divergent, |cell| {
            let mut nodal = of_nodes(cell);
            if let Some(Some(Edge { kink, jump })) = edges.get(cell) {
                for (u, psi) in nodal.iter_mut().zip(kink.biquadratic()) {
                    *u = [u[0] + psi * jump[0], u[1] + psi * jump[1]];
                }
            }
            // A solid that moves takes along what is in its cells.
            mesh.solid_velocity(cell).map_or(nodal, |velocity| [velocity; NODES])
        });
        let simd = Simd::used();
        FrozenFlow {
            mesh,
            enclosure,
            dt,
            start: 0.0,
            velocities: cells,
            edges,
            streams,
            free,
            simd,
        }
    }

    /// The start of the step and the time `dt` later, after the time of the solids.
    fn times(&self, dt: f64) -> [f64; 2] {
        [self.start, self.start + dt]
    }

    /// Part of the velocity of a cell that has a kink, if there is one.
    fn edge(&self, cell: usize) -> Option<&Edge> {
        self.edges.get(cell)?.as_ref()
    }

    /// Velocity at a cell and reference coordinates.
    fn velocity(&self, cell: usize, r: [f64; 2]) -> [f64; 2] {
        if let Some(u) = self.beside_solid(cell, r) {
            return u;
        }
        let u = self.velocities.at(cell, r);
        let Some(Edge { kink, jump }) = self.edge(cell) else { return u };
        let psi = kink.edge(r);
        [u[0] + psi * jump[0], u[1] + psi * jump[1]]
    }

    /// Velocity in a cell with a solid of any shape in it, if it has a streamfunction.
    fn beside_solid(&self, cell: usize, r: [f64; 2]) -> Option<[f64; 2]> {
        let flow = self.streams.get(cell)?.as_ref()?;
        let p = self.mesh.from_reference(cell, r);
        let (solid, d) = self.mesh.parts()?.nearest(p)?;
        let stream = self.mesh.part(cell)?.stream.as_ref()?;
        let wall = (d, solid.outline.normal(p));
        Some(stream.velocity(flow, p, wall, self.mesh.thickness(p)))
    }

    /// The start cell with an index.
    pub fn home(&self, cell: usize) -> StartCell {
        let (i, j) = self.mesh.cell_ij(cell);
        let free = self.free[cell];
        let spans = |axis: &Axis, k: usize| {
            let near = |k: usize| if free { axis.span(k) } else { Span::default() };
            [near(k.wrapping_sub(1)), axis.span(k), near(k + 1)]
        };
        StartCell {
            cell,
            spans: [spans(&self.mesh.x, i), spans(&self.mesh.y, j)],
            stride: [1, self.mesh.x.cells()],
            free,
            cut: self.mesh.part(cell).is_some(),
        }
    }

    /// Velocity at the point reached from `p` with velocity `u` after `dt`, and the cell and
    /// reference coordinates of that point. The path respects walls and periodic sides. If it
    /// leaves the domain, the start point is used.
    fn stage(
        &self,
        home: &StartCell,
        p: [f64; 2],
        u: [f64; 2],
        dt: f64,
    ) -> ([f64; 2], (usize, [f64; 2])) {
        let mesh = self.mesh;
        let goal = [p[0] + dt * u[0], p[1] + dt * u[1]];
        let (cell, r) = home.near(goal).unwrap_or_else(|| {
            let place = match self.enclosure.follow_during(mesh, [p, goal], self.times(dt)) {
                Landing::Free(q) | Landing::Held(q) => mesh.wrap(q),
                Landing::Left => p,
            };
            let cell = mesh.locate(place);
            (cell, mesh.to_reference(cell, place))
        });
        (self.velocity(cell, r), (cell, r))
    }

    /// Advects a point from `p` with the classical fourth-order Runge-Kutta method. The field is
    /// frozen at the middle of the step, so the order in time is that of the field. The high order
    /// in space preserves the distances between particles: a midpoint rule changes areas by
    /// `(dt |grad u|)^4 / 4` per step, this method by `(dt |grad u|)^6 / 72`.
    pub fn travel(&self, home: &StartCell, p: [f64; 2]) -> Displacement {
        let dt = self.dt;
        let k1 = self.velocity(home.cell, home.reference(p));
        let (k2, _) = self.stage(home, p, k1, 0.5 * dt);
        let (k3, middle) = self.stage(home, p, k2, 0.5 * dt);
        let (k4, _) = self.stage(home, p, k3, dt);
        let mean = |c: usize| (k1[c] + 2.0 * (k2[c] + k3[c]) + k4[c]) / 6.0;
        let goal = [p[0] + dt * mean(0), p[1] + dt * mean(1)];
        if let Some((cell, _)) = home.near(goal) {
            // A side may be crossed by rounding.
            let goal = self.mesh.nearest_inside(goal);
            return Displacement { to: goal, left: false, held: false, middle, cell: Some(cell) };
        }
        let (to, left, held) =
            match self.enclosure.follow_during(self.mesh, [p, goal], self.times(dt)) {
                Landing::Free(q) => (q, false, false),
                Landing::Held(q) => (q, false, true),
                Landing::Left => (goal, true, false),
            };
        Displacement { to, left, held, middle, cell: None }
    }

    /// Advects the points of one cell and calls `arrive` with the index and displacement of each.
    /// Points that stay inside the cell are traced together, the others one by one.
    pub fn travel_all(
        &self,
        cell: usize,
        from: &[[f64; 2]],
        mut arrive: impl FnMut(usize, Displacement),
    ) {
        if from.is_empty() {
            return;
        }
        let (home, dt) = (self.home(cell), self.dt);
        if self.edge(cell).is_some() || self.mesh.part(cell).is_some() {
            from.iter().enumerate().for_each(|(k, &p)| arrive(k, self.travel(&home, p)));
            return;
        }
        for (at, points) in from.chunks(TOGETHER).enumerate() {
            let mut r: Points = [[0.0; TOGETHER]; 2];
            for (k, p) in points.iter().enumerate() {
                [r[0][k], r[1][k]] = home.reference(*p);
            }
            let step = home.spans.map(|[_, own, _]| dt * own.per_length);
            let ways = self.velocities.trace(self.simd, cell, &r, step);
            for (k, &p) in points.iter().enumerate() {
                let displacement = if ways.inside[k] {
                    // A side may be crossed by rounding.
                    let to = [0, 1].map(|c| p[c] + dt * ways.velocity[c][k]);
                    let to = self.mesh.nearest_inside(to);
                    let middle = (cell, [ways.middle[0][k], ways.middle[1][k]]);
                    Displacement { to, left: false, held: false, middle, cell: Some(cell) }
                } else {
                    self.travel(&home, p)
                };
                arrive(TOGETHER * at + k, displacement);
            }
        }
    }

    /// Velocity gradient at a cell and reference coordinates, such as the middle of a displacement.
    pub fn gradient(&self, (cell, r): (usize, [f64; 2])) -> Matrix2<f64> {
        let size = self.mesh.cell_size(cell);
        let mut gradient = self.velocities.gradient(cell, r, size);
        if let Some(Edge { kink, jump }) = self.edge(cell) {
            let slopes = kink.slopes_of_edge(r);
            for i in 0..2 {
                for j in 0..2 {
                    gradient[(i, j)] += jump[i] * slopes[j] * 2.0 / size[j];
                }
            }
        }
        gradient
    }

    /// Rate `div u` at which the volume of a point grows.
    pub fn dilation(&self, at: (usize, [f64; 2]), gradient: &Matrix2<f64>) -> f64 {
        let per_radius = self.mesh.whole_measure(at.0).per_radius(at.1[0]);
        let mut rate = gradient.trace();
        if per_radius != 0.0 {
            rate += per_radius * self.velocity(at.0, at.1)[0];
        }
        rate
    }

    /// The director `n` after the step under the velocity gradient `l`.
    pub fn turn(&self, n: [f64; 2], l: &Matrix2<f64>) -> [f64; 2] {
        director::advance(&n.into(), l, self.dt).into()
    }
}
