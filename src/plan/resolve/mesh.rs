//! This module resolves `[domain]`, `[mesh]` and `accuracy.cells` into the mesh.

use super::gauges::SiGauge;
use super::sources::SiSource;
use super::values::{Result, coordinate};
use super::walls::Walls;
use crate::plan::Units;
use crate::plan::boundary::{SIDES, Side, pieces, place_of};
use crate::plan::meshing::{Line, Refinement, Sizing};
use crate::scene::{BoundaryKind, Geometry, GradingTarget, Scene, SceneError, Scope, WallKind};
use crate::space::measure::Measure;
use crate::space::mesh::{Axis, Mesh};
use crate::space::parts::Solid;
use crate::space::segment::Segment;
use crate::space::shape::side_normal;

/// Largest number of cells along a side. More cells need more memory than usual machines have.
const MAX_CELLS: usize = 4096;
/// Largest total number of cells; each takes about 10 kB with its share of the factor.
const MAX_TOTAL_CELLS: usize = 1_000_000;

/// What mesh lines are laid along, in m.
pub(super) struct Lines<'a> {
    pub(super) walls: &'a Walls,
    pub(super) gauges: &'a [SiGauge],
    pub(super) sides: &'a [Side; 4],
    pub(super) sources: &'a [SiSource],
}

/// Makes the mesh: lines on all required coordinates, graded towards the edges of apertures.
pub(super) fn mesh(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    length: f64,
    &Lines { walls, gauges, sides, sources }: &Lines,
    units: &Units,
) -> Result<Mesh> {
    if scene.accuracy.cells == 0 {
        return Err(SceneError::of_key(
            "accuracy.cells",
            "accuracy.cells is 0",
            "give 1 or more cells per length_scale",
        ));
    }
    let size = length / f64::from(scene.accuracy.cells);
    let growth = scene.mesh.growth;
    if !(growth > 1.0 && growth <= 2.0) {
        return Err(SceneError::of_key(
            "mesh.growth",
            format!("mesh.growth is {growth}"),
            "neighbouring cells may differ by a ratio above 1, at most 2; 1.75 is usual",
        ));
    }
    let mut lines: [Vec<Line>; 2] = [vec![], vec![]];
    let mut demand = |c: usize, at: f64, owner: &str, explicit: bool| {
        lines[c].push(Line { at, owner: owner.into(), explicit });
    };
    for (c, range) in domain.into_iter().enumerate() {
        demand(c, range[0], SIDES[2 * c], false);
        demand(c, range[1], SIDES[2 * c + 1], false);
    }
    for w in &walls.walls {
        let owner = format!("wall `{}`", w.name);
        w.segment.lines().into_iter().for_each(|(c, v)| demand(c, v, &owner, false));
    }
    for b in &walls.blocks {
        for c in 0..2 {
            b.range[c].iter().for_each(|&v| demand(c, v, &format!("block `{}`", b.name), false));
        }
    }
    for s in sources {
        let owner = format!("source `{}`", s.name);
        s.block
            .iter()
            .enumerate()
            .for_each(|(c, r)| r.iter().for_each(|&v| demand(c, v, &owner, false)));
    }
    for g in gauges {
        let owner = format!("gauge `{}`", g.name);
        g.line.mesh_lines().for_each(|(c, v)| demand(c, v, &owner, false));
    }
    for (s, piece) in pieces(sides).filter(|(_, piece)| piece.part.is_some()) {
        let Segment { normal, from, to, .. } = piece.segment;
        [from, to].into_iter().for_each(|v| demand(1 - normal, v, &place_of(s, piece), false));
    }
    for (c, list) in [&scene.mesh.lines_x, &scene.mesh.lines_y].into_iter().enumerate() {
        for q in list {
            let v = coordinate(q, c, scope)?;
            if v < domain[c][0] || v > domain[c][1] {
                return Err(SceneError::at(
                    q,
                    format!("the mesh line at {v} is outside the domain"),
                    format!("choose {} to {}", domain[c][0], domain[c][1]),
                ));
            }
            demand(c, v, "mesh", true);
        }
    }
    let refinements = refinements(scene, scope, domain, (walls, sides))?;
    let periodic = periodic(scene)?;
    let mut axes = Vec::new();
    let corners = walls.corners(domain);
    for (c, mut demanded) in lines.into_iter().enumerate() {
        let sizing = Sizing { size, refinements: refinements[c].clone(), growth };
        // Corners of solids attract lines where there is room.
        let wished: Vec<f64> = corners.iter().map(|corner| corner.at[c]).collect();
        demanded.extend(sizing.granted(&demanded, &wished).into_iter().map(|at| Line {
            at,
            owner: "a corner of a block".into(),
            explicit: false,
        }));
        let estimate = (domain[c][1] - domain[c][0]) / size;
        if estimate > MAX_CELLS as f64 {
            return Err(SceneError::of_key(
                "accuracy.cells",
                format!("the mesh would have {estimate:.0} cells along {}", ["x", "y"][c]),
                format!("lower accuracy.cells; at most {MAX_CELLS} cells per side are allowed"),
            ));
        }
        let out = sizing.lines(demanded).map_err(|e| {
            let gap = e.second.at - e.first.at;
            SceneError::of_key(
                "accuracy.cells",
                format!(
                    "{} at {} = {:.6} and {} at {:.6} are closer than a cell ({:.3e} < {:.3e} m)",
                    e.first.owner,
                    ["x", "y"][c],
                    e.first.at,
                    e.second.owner,
                    e.second.at,
                    gap,
                    e.size
                ),
                format!(
                    "raise accuracy.cells to at least {:.0}, or move one of the two: to the same \
                     {}, or {:.3e} m or more from the other",
                    (f64::from(scene.accuracy.cells) * e.size / gap).ceil(),
                    ["x", "y"][c],
                    e.size
                ),
            )
        })?;
        if out.len() - 1 > MAX_CELLS {
            return Err(SceneError::of_key(
                "accuracy.cells",
                format!("the mesh would have {} cells along {}", out.len() - 1, ["x", "y"][c]),
                format!(
                    "lower accuracy.cells or the grading (mesh.grading = [] for none); at most {MAX_CELLS}"
                ),
            ));
        }
        // A periodic axis needs two cells, or a node would be its own neighbour.
        if periodic[c] && out.len() < 3 {
            return Err(SceneError::of_key(
                "accuracy.cells",
                format!("a periodic domain one cell wide along {}", ["x", "y"][c]),
                "raise accuracy.cells so that it has at least two",
            ));
        }
        axes.push(Axis::new(out.into_iter().map(|v| v / units.length).collect(), periodic[c]));
    }
    let y = axes.pop();
    let x = axes.pop();
    let (Some(x), Some(y)) = (x, y) else { unreachable!("two axes were made") };
    if x.cells() * y.cells() > MAX_TOTAL_CELLS {
        return Err(SceneError::of_key(
            "accuracy.cells",
            format!("the mesh would have {} x {} cells", x.cells(), y.cells()),
            format!(
                "lower accuracy.cells or the grading (mesh.grading = [] for none): at most \
                 {MAX_TOTAL_CELLS} cells fit into memory"
            ),
        ));
    }
    let mut mesh = Mesh::new(x, y).with_measure(match scene.domain.geometry {
        Geometry::Plane => Measure::PLANE,
        Geometry::Axisymmetric => Measure::RING,
    });
    for cell in 0..mesh.cells() {
        let [px, py] = mesh.cell_centre(cell).map(|v| v * units.length);
        let covers = |[x, y]: [[f64; 2]; 2]| px > x[0] && px < x[1] && py > y[0] && py < y[1];
        mesh.solid[cell] = walls.blocks.iter().any(|b| covers(b.range));
    }
    let solids = walls.solids.iter().map(|s| Solid {
        name: s.name.clone(),
        outline: s.outline.in_units(units.length),
        no_slip: s.kind == WallKind::NoSlip,
        velocity: s.velocity.map(|v| v / units.velocity()),
        rotation: s.rotation.map(|w| w / units.rate()),
    });
    let mesh = mesh.with_solids(solids.collect());
    if mesh.solid.iter().all(|&s| s) {
        return Err(SceneError::of_key(
            "blocks",
            "blocks fill the whole domain",
            "leave space for a material",
        ));
    }
    Ok(mesh)
}

/// Default factor by which cells are smaller at the edges (lips) of apertures.
///
/// The velocity there varies as the square root of the distance, so the error of the discharge is
/// proportional to the size of the cells at the lip. Initial discharge of the silo at 6 cells per
/// aperture, divided by its limit, for alpha = 0 and 1/3: 0.9817, 0.9773 uniform; 0.9975, 0.9968
/// with a factor of 8; 0.9985 (alpha = 0) with 16, where the particles of the surrounding cells are
/// larger than a cell at the lip, so that its filling is noisy. With 12 both are within 0.3 %.
const LIP_FACTOR: f64 = 12.0;

fn refinements(
    scene: &Scene,
    scope: &Scope,
    domain: [[f64; 2]; 2],
    (walls, sides): (&Walls, &[Side; 4]),
) -> Result<[Vec<Refinement>; 2]> {
    let mut out = [vec![], vec![]];
    let all_lips = || [walls.lips(domain), lips_of_openings(sides)].concat();
    let Some(grading) = &scene.mesh.grading else {
        for lip in all_lips() {
            for c in 0..2 {
                out[c].push(Refinement { at: lip[c], factor: LIP_FACTOR });
            }
        }
        return Ok(out);
    };
    for g in grading {
        let factor = g.factor.eval(scope)?;
        if !(1.0..=1000.0).contains(&factor) {
            return Err(SceneError::at(
                &g.factor,
                format!("grading factor is {factor}"),
                "cells become smaller by this factor: 1 to 1000",
            ));
        }
        match &g.towards {
            GradingTarget::Apertures => {
                let lips = all_lips();
                let ends = || walls.tips(domain).iter().map(|t| t.at).collect();
                for tip in if lips.is_empty() { ends() } else { lips } {
                    for c in 0..2 {
                        out[c].push(Refinement { at: tip[c], factor });
                    }
                }
            }
            GradingTarget::Corners => {
                for corner in walls.corners(domain).iter().filter(|corner| corner.salient) {
                    for c in 0..2 {
                        out[c].push(Refinement { at: corner.at[c], factor });
                    }
                }
            }
            GradingTarget::Walls => {
                for (s, side) in scene.boundaries.sides().into_iter().enumerate() {
                    if side.all_given().any(|given| {
                        given.kind() == BoundaryKind::NoSlip
                            || given.velocity[1 - side_normal(s)].is_some()
                            || given.rotation.is_some()
                    }) {
                        out[s / 2].push(Refinement { at: domain[s / 2][s % 2], factor });
                    }
                }
                for w in walls.walls.iter().filter(|w| w.kind == WallKind::NoSlip) {
                    out[w.segment.normal].push(Refinement { at: w.segment.at, factor });
                }
            }
            GradingTarget::X(q) => out[0].push(Refinement { at: coordinate(q, 0, scope)?, factor }),
            GradingTarget::Y(q) => out[1].push(Refinement { at: coordinate(q, 1, scope)?, factor }),
        }
    }
    Ok(out)
}

/// Lips of the openings in sides: points where an open piece meets one that is not open.
fn lips_of_openings(sides: &[Side; 4]) -> Vec<[f64; 2]> {
    let pairs = sides.iter().flat_map(|side| side.pieces.windows(2));
    pairs.filter(|p| p[0].open != p[1].open).map(|p| p[0].segment.ends()[1]).collect()
}

fn periodic(scene: &Scene) -> Result<[bool; 2]> {
    let b = &scene.boundaries;
    let mut out = [false; 2];
    for (c, (low, high)) in [(&b.left, &b.right), (&b.bottom, &b.top)].into_iter().enumerate() {
        let kinds = [low.kind, high.kind].map(|k| k == Some(BoundaryKind::Periodic));
        if kinds[0] != kinds[1] {
            return Err(SceneError::of_key(
                format!("boundaries.{}.kind", SIDES[2 * c + usize::from(kinds[1])]),
                format!(
                    "only one of boundaries.{} and boundaries.{} is periodic",
                    SIDES[2 * c],
                    SIDES[2 * c + 1]
                ),
                "periodic sides come in pairs: set kind = \"periodic\" on both",
            ));
        }
        out[c] = kinds[0];
    }
    Ok(out)
}
