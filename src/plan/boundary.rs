//! This module turns the boundary conditions of a scene into constraints.

use super::resolve::values::{Result, edge, finite_range};
use super::resolve::walls::Walls;
use super::{Matter, Units};
use crate::scene::{BoundaryKind, Field, FieldFn, Scene, SceneError, Scope, WallKind};
use crate::space::constraints::Constraints;
use crate::space::mesh::Mesh;
use crate::space::segment::Segment;
use crate::space::shape::side_normal;

/// Boundary conditions at a side of the domain, as functions of SI coordinates.
#[derive(Clone, Debug, Default)]
pub struct Side {
    /// Whether the side is joined to the opposite side.
    pub periodic: bool,
    /// Prescribed velocity along x and y, m/s.
    pub velocity: [Option<FieldFn>; 2],
    /// Prescribed traction along x and y, Pa.
    pub traction: [Option<FieldFn>; 2],
    /// Prescribed Cosserat rotation rate, 1/s.
    pub rotation: Option<FieldFn>,
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
}

/// All boundary conditions.
#[derive(Clone, Debug, Default)]
pub struct BoundaryPlan {
    /// Sides of the domain: left, right, bottom, top.
    pub sides: [Side; 4],
    /// Walls and sides of blocks.
    pub walls: Vec<WallLine>,
    /// Directions (x, y) in which no boundary condition prevents a rigid translation.
    pub free_translation: [bool; 2],
    /// Whether the pressure is determined only up to a constant.
    pub closed: bool,
}

/// Names of the sides, in the order of [`BoundaryPlan::sides`].
pub const SIDES: [&str; 4] = ["left", "right", "bottom", "top"];

/// Mesh nodes on a side.
fn side_nodes(mesh: &Mesh, side: usize) -> Vec<usize> {
    let (ni, nj) = (mesh.x.nodes(), mesh.y.nodes());
    match side {
        0 => (0..nj).map(|j| mesh.node(0, j)).collect(),
        1 => (0..nj).map(|j| mesh.node(ni - 1, j)).collect(),
        2 => (0..ni).map(|i| mesh.node(i, 0)).collect(),
        _ => (0..ni).map(|i| mesh.node(i, nj - 1)).collect(),
    }
}

impl BoundaryPlan {
    /// Prescribed nodal values. Where boundaries meet, normal velocities take precedence over
    /// tangential ones.
    pub fn constraints<const D: usize>(&self, mesh: &Mesh, units: &Units) -> Constraints<D> {
        let mut out = Constraints::new(mesh);
        for pass in 0..2 {
            for (s, side) in self.sides.iter().enumerate().filter(|(_, s)| !s.periodic) {
                let c = if pass == 0 { side_normal(s) } else { 1 - side_normal(s) };
                if let Some(f) = &side.velocity[c] {
                    for node in side_nodes(mesh, s) {
                        out.fix(node, c, self.at_node(mesh, units, f, node) / units.velocity());
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
            for (s, side) in self.sides.iter().enumerate() {
                if let Some(f) = &side.rotation {
                    for node in side_nodes(mesh, s) {
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
        out
    }

    fn at_node(&self, mesh: &Mesh, units: &Units, f: &FieldFn, node: usize) -> f64 {
        let [x, y] = mesh.node_position(node);
        f.at(x * units.length, y * units.length)
    }

    /// Net outflow due to the prescribed normal velocities of the sides, and the integral of their
    /// magnitudes.
    pub fn net_outflow<const D: usize>(&self, mesh: &Mesh, given: &Constraints<D>) -> (f64, f64) {
        const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
        let (mut net, mut total) = (0.0, 0.0);
        for (s, side) in self.sides.iter().enumerate().filter(|(_, s)| !s.periodic) {
            let normal = side_normal(s);
            if side.velocity[normal].is_none() {
                continue;
            }
            let sign = if s % 2 == 0 { -1.0 } else { 1.0 };
            let (_, axis) = mesh.axes(normal);
            let nodes = side_nodes(mesh, s);
            for k in 0..axis.cells() {
                for (a, weight) in SIMPSON.iter().enumerate() {
                    let node = nodes[axis.cell_node(k, a)];
                    let v = given.fixed_value(node, normal).unwrap_or(0.0);
                    net += sign * weight * axis.size(k) * v;
                    total += weight * axis.size(k) * v.abs();
                }
            }
        }
        (net, total)
    }
}

/// Boundary conditions at the four sides of the domain.
pub(super) fn sides(scene: &Scene, scope: &Scope, domain: [[f64; 2]; 2]) -> Result<[Side; 4]> {
    let mut out: [Side; 4] = Default::default();
    for (s, side) in scene.boundaries.sides().into_iter().enumerate() {
        let name = format!("boundaries.{}", SIDES[s]);
        let normal = side_normal(s);
        let velocity = [&side.velocity_x, &side.velocity_y];
        let traction = [&side.traction_x, &side.traction_y];
        if side.kind == BoundaryKind::Periodic {
            if let Some(f) =
                velocity.into_iter().chain(traction).chain([&side.rotation]).flatten().next()
            {
                return Err(SceneError::at(
                    f,
                    format!("{name} is periodic and prescribes a value"),
                    "a periodic side has no boundary: remove the value or the kind",
                ));
            }
            out[s].periodic = true;
            continue;
        }
        let compile = |f: &Field| -> Result<FieldFn> {
            let compiled = f.compile(scope)?;
            finite_range(f, &compiled, edge(domain, s), &name)?;
            Ok(compiled)
        };
        for c in 0..2 {
            let held = match side.kind {
                BoundaryKind::NoSlip => true,
                BoundaryKind::FreeSlip => c == normal,
                BoundaryKind::Open | BoundaryKind::Periodic => false,
            };
            let letter = ["x", "y"][c];
            out[s].velocity[c] = match (velocity[c], traction[c]) {
                (Some(v), None) => Some(compile(v)?),
                (None, Some(_)) => None,
                (Some(v), Some(_)) => {
                    return Err(SceneError::at(
                        v,
                        format!("{name} gives both velocity_{letter} and traction_{letter}"),
                        "give one of them",
                    ));
                }
                (None, None) => held.then_some(FieldFn::Constant(0.0)),
            };
            out[s].traction[c] = traction[c].as_ref().map(compile).transpose()?;
        }
        out[s].rotation = side.rotation.as_ref().map(compile).transpose()?;
    }
    Ok(out)
}

/// Boundary conditions of sides, walls and blocks on the mesh.
pub(super) fn boundary(
    sides: [Side; 4],
    walls: &Walls,
    mesh: &Mesh,
    units: &Units,
    state: &Matter,
) -> Result<BoundaryPlan> {
    let mut lines = Vec::new();
    let mut add = |segment: Segment, kind: WallKind, rotation| {
        let segment = segment.on_mesh(mesh, units.length);
        lines.push(WallLine { segment, no_slip: kind == WallKind::NoSlip, rotation });
    };
    for w in &walls.walls {
        add(w.segment, w.kind, w.rotation);
    }
    for (range, kind) in &walls.blocks {
        for normal in 0..2 {
            let [from, to] = range[1 - normal];
            for at in range[normal] {
                add(Segment { normal, at, from, to }, *kind, None);
            }
        }
    }
    let held = |c: usize| {
        sides.iter().any(|s| s.velocity[c].is_some())
            || lines.iter().any(|w| w.segment.normal == c || w.no_slip)
    };
    let free_translation = [!held(0), !held(1)];
    let compressible = state.materials.iter().any(|m| m.law.compliance > 0.0);
    let closed = !compressible
        && sides
            .iter()
            .enumerate()
            .all(|(s, b)| b.periodic || b.velocity[side_normal(s)].is_some());
    let plan = BoundaryPlan { sides, walls: lines, free_translation, closed };
    if closed {
        let (net, total) = plan.net_outflow(mesh, &plan.constraints::<2>(mesh, units));
        if net.abs() > 1e-9 * total {
            return Err(SceneError::of_key(
                "boundaries",
                format!(
                    "the given normal velocities let {:.3e} m2/s of incompressible fluid flow out",
                    net * units.area_rate()
                ),
                "make them balance, open a side (kind = \"open\"), or give a bulk_viscosity",
            ));
        }
    }
    Ok(plan)
}
