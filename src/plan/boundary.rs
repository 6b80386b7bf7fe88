//! This module turns the boundary conditions of a scene into constraints.

use super::resolve::slip::Slips;
use super::resolve::values::Result;
use super::resolve::walls::{SiBlock, Walls};
use super::slip::{Slip, WallLaw};
use super::sources::{Entering, Source};
use super::{Matter, Units};
use crate::scene::{FieldFn, SceneError, WallKind};
use crate::space::constraints::Constraints;
use crate::space::mesh::{Axis, Mesh};
use crate::space::parts::{Parts, Solid};
use crate::space::segment::Segment;
use crate::space::shape::{SIDE_NODES, side_normal};

/// Boundary conditions, as functions of SI coordinates.
#[derive(Clone, Debug, Default)]
pub struct Conditions {
    /// Prescribed velocity along x and y, m/s.
    pub velocity: [Option<FieldFn>; 2],
    /// Prescribed traction along x and y, Pa.
    pub traction: [Option<FieldFn>; 2],
    /// Prescribed Cosserat rotation rate, 1/s.
    pub rotation: Option<FieldFn>,
    /// How the side resists material that slides along it, if it does.
    pub slip: Option<Slip>,
}

impl Conditions {
    /// Whether a velocity other than zero is prescribed along `normal`.
    pub fn passes_through(&self, normal: usize) -> bool {
        self.velocity[normal].as_ref().is_some_and(|f| f.constant() != Some(0.0))
    }

    /// Whether a component of the velocity is prescribed as zero.
    fn stops(&self, c: usize) -> bool {
        self.velocity[c].as_ref().and_then(FieldFn::constant) == Some(0.0)
    }
}

/// A piece of a side with the same conditions everywhere: a part that the scene lists, or what lies
/// between parts.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Index in the scene's list of parts; `None` for the rest of the side.
    pub part: Option<usize>,
    /// Its extent. In a [`BoundaryPlan`] it is in the plan's units and ends on mesh lines.
    pub segment: Segment,
    /// Conditions that apply.
    pub conditions: Conditions,
    /// Whether particles leave through it.
    pub open: bool,
    /// What enters through it; `None` if it is not known, so that particles near it are split
    /// instead.
    pub enters: Option<Entering>,
}

/// A side of the domain.
#[derive(Clone, Debug, Default)]
pub struct Side {
    /// Whether the side is joined to the opposite side.
    pub periodic: bool,
    /// The pieces, in ascending order; they cover the side.
    pub pieces: Vec<Piece>,
}

impl Side {
    /// The pieces, those that constrain the flow most first. Where two pieces meet, the conditions
    /// of the first apply: those of walls before those of openings, and of walls at rest before
    /// those of moving walls.
    fn most_constraining_first(&self) -> Vec<&Piece> {
        let mut out: Vec<&Piece> = self.pieces.iter().collect();
        // The last criterion does not depend on the direction along the side.
        out.sort_by_key(|p| {
            let normal = p.segment.normal;
            let Conditions { velocity, .. } = &p.conditions;
            let free = velocity.iter().filter(|v| v.is_none()).count();
            (!p.conditions.stops(normal), !p.conditions.stops(1 - normal), free, p.part)
        });
        out
    }
}

/// A wall along mesh lines.
#[derive(Clone, Debug, PartialEq)]
pub struct WallLine {
    /// The segment, in the plan's units; it lies on mesh lines.
    pub segment: Segment,
    /// Whether the tangential velocity is zero too.
    pub no_slip: bool,
    /// Prescribed Cosserat rotation rate, 1/s (SI).
    pub rotation: Option<f64>,
    /// How it resists material that slides along it, if it does.
    pub slip: Option<WallLaw>,
}

/// All boundary conditions.
#[derive(Clone, Debug, Default)]
pub struct BoundaryPlan {
    /// Sides of the domain: left, right, bottom, top.
    pub sides: [Side; 4],
    /// Walls and sides of blocks.
    pub walls: Vec<WallLine>,
    /// Law of each solid of any shape along which material slips, in the order of the solids.
    pub solids: Vec<Option<WallLaw>>,
    /// Nozzles inside the domain; their sides are among `walls`.
    pub sources: Vec<Source>,
    /// Directions (x, y) in which no boundary condition prevents a rigid translation.
    pub free_translation: [bool; 2],
    /// Whether the pressure is determined only up to a constant.
    pub closed: bool,
    /// Share of the prescribed outflow that is corrected, so that it balances the inflow on the sides
    /// that solids cut.
    pub correction: f64,
}

/// Imbalance of the prescribed velocities, relative to their sum, that is corrected where solids cut the
/// sides.
const LARGEST_CORRECTION: f64 = 0.02;

/// Names of the sides, in the order of [`BoundaryPlan::sides`].
pub const SIDES: [&str; 4] = ["left", "right", "bottom", "top"];

/// Key of a piece in the scene, such as `boundaries.bottom.parts[0]`.
pub(super) fn place_of(side: usize, piece: &Piece) -> String {
    let part = piece.part.map_or(String::new(), |k| format!(".parts[{k}]"));
    format!("boundaries.{}{part}", SIDES[side])
}

/// Pieces of the sides that are not periodic, with the numbers of their sides.
pub(super) fn pieces(sides: &[Side; 4]) -> impl Iterator<Item = (usize, &Piece)> {
    let bounding = sides.iter().enumerate().filter(|(_, side)| !side.periodic);
    bounding.flat_map(|(s, side)| side.pieces.iter().map(move |piece| (s, piece)))
}

impl BoundaryPlan {
    /// Pieces of the sides that are not periodic, with the numbers of their sides.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, &Piece)> {
        pieces(&self.sides)
    }

    /// Prescribed nodal values while the sources are on that `is_on` selects. Which values are
    /// prescribed does not depend on it.
    pub fn constraints_with<const D: usize>(
        &self,
        mesh: &Mesh,
        units: &Units,
        is_on: impl Fn(&Source) -> bool,
    ) -> Constraints<D> {
        let mut out = Constraints::new(mesh);
        // The ends of a mouth belong to the mouth.
        for source in &self.sources {
            let normal = source.segment.normal;
            let value = if is_on(source) { source.velocity } else { 0.0 };
            source.segment.nodes(mesh).for_each(|node| out.fix(node, normal, value));
        }
        self.fix(mesh, units, out)
    }

    /// Prescribed nodal values while all sources are on.
    pub fn constraints<const D: usize>(&self, mesh: &Mesh, units: &Units) -> Constraints<D> {
        self.constraints_with(mesh, units, |_| true)
    }

    /// Adds the values that the sides, walls and blocks prescribe. Where boundaries meet, normal
    /// velocities take precedence over tangential ones.
    fn fix<const D: usize>(
        &self,
        mesh: &Mesh,
        units: &Units,
        mut out: Constraints<D>,
    ) -> Constraints<D> {
        let sides = self.sides.each_ref().map(Side::most_constraining_first);
        let pieces = || sides.iter().flatten();
        for pass in 0..2 {
            for (upper, piece) in sides
                .iter()
                .enumerate()
                .flat_map(|(s, pieces)| pieces.iter().map(move |piece| (s % 2 == 1, piece)))
            {
                let normal = piece.segment.normal;
                let c = if pass == 0 { normal } else { 1 - normal };
                if let Some(f) = &piece.conditions.velocity[c] {
                    for node in piece.segment.nodes(mesh) {
                        let at = |[x, y]: [f64; 2]| {
                            f.at(x * units.length, y * units.length) / units.velocity()
                        };
                        let v = mesh.continued(node, (normal, c), at);
                        let outwards = c == normal && (v > 0.0) == upper;
                        let factor = if outwards { 1.0 - self.correction } else { 1.0 };
                        out.fix(node, c, factor * v);
                    }
                }
            }
            for wall in &self.walls {
                if pass == 0 || wall.no_slip {
                    let normal = wall.segment.normal;
                    let c = if pass == 0 { normal } else { 1 - normal };
                    wall.segment.nodes(mesh).for_each(|node| out.fix(node, c, 0.0));
                }
            }
        }
        if D == 3 {
            for piece in pieces() {
                if let Some(f) = &piece.conditions.rotation {
                    for node in piece.segment.nodes(mesh) {
                        out.fix(node, 2, self.at_node(mesh, units, f, node) / units.rate());
                    }
                }
            }
            for wall in &self.walls {
                if let Some(w) = wall.rotation {
                    wall.segment.nodes(mesh).for_each(|node| out.fix(node, 2, w / units.rate()));
                }
            }
        }
        for c in 0..2 {
            if self.free_translation[c] {
                out.free_translation(mesh, c);
            }
        }
        if self.closed {
            out.close();
        }
        out.embed(mesh);
        out
    }

    fn at_node(&self, mesh: &Mesh, units: &Units, f: &FieldFn, node: usize) -> f64 {
        let [x, y] = mesh.node_position(node);
        f.at(x * units.length, y * units.length)
    }

    /// Net outflow due to the prescribed normal velocities of the sides, and the integral of their
    /// magnitudes.
    pub fn net_outflow<const D: usize>(&self, mesh: &Mesh, given: &Constraints<D>) -> (f64, f64) {
        const SIMPSON: [(f64, f64); 3] = [(-1.0, 1.0 / 6.0), (0.0, 4.0 / 6.0), (1.0, 1.0 / 6.0)];
        let (mut net, mut total) = (0.0, 0.0);
        for (s, piece) in self.pieces() {
            let normal = side_normal(s);
            if piece.conditions.velocity[normal].is_none() {
                continue;
            }
            let sign = if s % 2 == 0 { -1.0 } else { 1.0 };
            for (_, cell) in piece.segment.cells_at_side(mesh, s) {
                let (nodes, face) = (mesh.cell_nodes(cell), mesh.face(cell, s));
                for (a, (t, weight)) in SIDE_NODES[s].into_iter().zip(SIMPSON) {
                    let v = given.fixed_value(nodes[a], normal).unwrap_or(0.0);
                    net += sign * face.of_point(weight, t) * v;
                    total += face.of_point(weight, t) * v.abs();
                }
            }
        }
        if mesh.parts().is_some() {
            // Only the part of the sides that solids leave free counts; faces inside cancel.
            let mut velocity = vec![[0.0; D]; mesh.nodes()];
            given.impose(&mut velocity);
            total += mesh
                .parts()
                .into_iter()
                .flat_map(Parts::all)
                .map(|(_, p)| p.swept.abs())
                .sum::<f64>();
            net = (0..mesh.cells())
                .map(|cell| mesh.volume_rate(cell, |node| [velocity[node][0], velocity[node][1]]))
                .sum();
        }
        (net, total)
    }
}

/// Boundary conditions of sides, walls and blocks on the mesh. The segments of `sides` are in m.
pub(super) fn boundary(
    mut sides: [Side; 4],
    (walls, slips): (&Walls, &Slips),
    mesh: &Mesh,
    units: &Units,
    (state, inertia): (&Matter, bool),
    sources: Vec<Source>,
) -> Result<BoundaryPlan> {
    for piece in sides.iter_mut().flat_map(|side| &mut side.pieces) {
        piece.segment = piece.segment.on_mesh(mesh, units.length);
    }
    let mut lines = Vec::new();
    let mut add = |segment: Segment, kind: WallKind, rotation, slip| {
        let segment = segment.on_mesh(mesh, units.length);
        lines.push(WallLine { segment, no_slip: kind == WallKind::NoSlip, rotation, slip });
    };
    for w in &walls.walls {
        add(w.segment, w.kind, w.rotation, slips.walls[w.index]);
    }
    for SiBlock { range, kind, index, rotation, .. } in &walls.blocks {
        // Nozzles are blocks without slip.
        let slip = slips.blocks.get(*index).copied().flatten();
        for normal in 0..2 {
            let [from, to] = range[1 - normal];
            for at in range[normal] {
                add(Segment { normal, at, from, to }, *kind, *rotation, slip);
            }
        }
    }
    let solids: Vec<_> = walls.solids.iter().map(|s| slips.of(s)).collect();
    // Solids that move may be outside of the domain.
    let inside = |s: &Solid| {
        let [x, y] = s.outline.extent();
        let meets = |[low, high]: [f64; 2], axis: &Axis| low < axis.end() && high > axis.start();
        meets(x, &mesh.x) && meets(y, &mesh.y)
    };
    let in_mesh = || mesh.parts().into_iter().flat_map(|parts| &parts.solids).filter(|s| inside(s));
    let held = |c: usize| {
        let holds = |p: &Piece| {
            let slips = p.conditions.slip.is_some() && p.segment.normal != c;
            slips || p.conditions.velocity[c].is_some()
        };
        pieces(&sides).any(|(_, p)| holds(p))
            || lines.iter().any(|w| w.segment.normal == c || w.no_slip || w.slip.is_some())
            || in_mesh().any(|s| s.no_slip || s.outline.holds(c))
            || in_mesh().next().is_some() && solids.iter().any(Option::is_some)
    };
    // Inertia determines the velocity of a body that nothing holds.
    // No flow around an axis is a translation along the radius.
    let round = mesh.measure().is_ring();
    let free_translation = [0, 1].map(|c| !(held(c) || inertia || round && c == 0));
    let compressible = state.materials.iter().any(|m| m.law.compliance > 0.0);
    let closed = !compressible
        && pieces(&sides).all(|(s, p)| p.conditions.velocity[side_normal(s)].is_some());
    if let Some(source) = sources.first().filter(|_| closed) {
        return Err(SceneError::of_key(
            "sources[0]",
            format!("source `{}` pushes incompressible fluid into a closed domain", source.name),
            "open a side or a part of one (kind = \"open\" or \"outflow\"), or give a bulk_viscosity",
        ));
    }
    let mut plan = BoundaryPlan {
        sides,
        walls: lines,
        solids,
        sources,
        free_translation,
        closed,
        correction: 0.0,
    };
    if closed {
        let (mut net, total) = plan.net_outflow(mesh, &plan.constraints::<2>(mesh, units));
        if mesh.parts().is_some() && net != 0.0 && net.abs() < LARGEST_CORRECTION * total {
            // The outflow depends linearly on the correction.
            plan.correction = LARGEST_CORRECTION;
            let (less, _) = plan.net_outflow(mesh, &plan.constraints::<2>(mesh, units));
            // Without prescribed outflow there is nothing to correct.
            plan.correction = if less == net { 0.0 } else { plan.correction * net / (net - less) };
            (net, _) = plan.net_outflow(mesh, &plan.constraints::<2>(mesh, units));
        }
        if net.abs() > 1e-9 * total {
            let moves = mesh.parts().is_some_and(Parts::move_on);
            return Err(SceneError::of_key(
                "boundaries",
                format!(
                    "the given normal velocities{} let {:.3e} {} of incompressible fluid flow out",
                    if moves { " and the blocks that move" } else { "" },
                    net * units.volume_rate(),
                    if mesh.measure().is_ring() { "m3/s" } else { "m2/s" }
                ),
                "make them balance, open a side or a part of one (kind = \"outflow\"), or give a bulk_viscosity",
            ));
        }
    }
    Ok(plan)
}
