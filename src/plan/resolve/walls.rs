//! This module resolves `[[walls]]` and `[[blocks]]` into obstacles along mesh lines, and finds the
//! edges (lips) of apertures.

use super::outlines;
use super::posed::rests;
use super::values::{Result, point, positive, ranges};
use crate::plan::{BoundaryPlan, Moving, Pose, Units};
use crate::scene::{Block, Quantity, Scene, SceneError, Scope, SolidShape, Wall, WallKind};
use crate::space::mesh::Mesh;
use crate::space::outline::Outline;
use crate::space::segment::{Line, Segment};
use crate::space::walls::Enclosure;

/// Walls and blocks in SI coordinates.
pub(in crate::plan) struct Walls {
    pub(in crate::plan) walls: Vec<SiWall>,
    /// Blocks along mesh lines.
    pub(in crate::plan) blocks: Vec<SiBlock>,
    /// Solids of any shape.
    pub(in crate::plan) solids: Vec<SiSolid>,
    /// Blocks that move, and where they are.
    pub(in crate::plan) moving: Vec<Moving>,
    pub(in crate::plan) poses: Vec<Pose>,
}

/// A block along mesh lines in SI coordinates.
pub(in crate::plan) struct SiBlock {
    /// Index among the blocks of the scene.
    pub(in crate::plan) index: usize,
    pub(in crate::plan) name: String,
    /// Ranges along x and y, m.
    pub(in crate::plan) range: [[f64; 2]; 2],
    pub(in crate::plan) kind: WallKind,
    /// Prescribed rotation rate, 1/s.
    pub(in crate::plan) rotation: Option<f64>,
}

/// A solid of any shape in SI coordinates.
pub(in crate::plan) struct SiSolid {
    /// Index among the walls or the blocks of the scene.
    pub(in crate::plan) index: usize,
    /// Whether it is a wall.
    pub(in crate::plan) wall: bool,
    pub(in crate::plan) name: String,
    pub(in crate::plan) outline: Outline,
    pub(in crate::plan) kind: WallKind,
    /// Velocity, m/s.
    pub(in crate::plan) velocity: [f64; 2],
    /// Prescribed rotation rate, 1/s.
    pub(in crate::plan) rotation: Option<f64>,
}

/// A wall in SI coordinates.
pub(in crate::plan) struct SiWall {
    /// Index among the walls of the scene.
    pub(in crate::plan) index: usize,
    pub(in crate::plan) name: String,
    pub(in crate::plan) segment: Segment,
    pub(in crate::plan) kind: WallKind,
    /// Prescribed rotation rate, 1/s.
    pub(in crate::plan) rotation: Option<f64>,
}

/// The segment between two points, or an error if it is not along a coordinate direction, has no
/// length or leaves the domain.
pub(in crate::plan) fn axis_segment(
    what: &str,
    from: &[Quantity; 2],
    to: &[Quantity; 2],
    scope: &Scope,
    domain: [[f64; 2]; 2],
) -> Result<Segment> {
    match line(what, from, to, scope, domain)? {
        Line::Aligned(segment) => Ok(segment),
        Line::Slanted([a, b]) => Err(SceneError::at(
            &to[0],
            format!("{what} is slanted: from ({}, {}) to ({}, {})", a[0], a[1], b[0], b[1]),
            "thin walls and nozzles follow mesh lines: make both x or both y equal, or give a wall a \
             thickness, as in thickness = 0.05",
        )),
    }
}

/// The line between two points, or an error if it has no length or leaves the domain.
pub(in crate::plan) fn line(
    what: &str,
    from: &[Quantity; 2],
    to: &[Quantity; 2],
    scope: &Scope,
    [x, y]: [[f64; 2]; 2],
) -> Result<Line> {
    let (a, b) = (point(from, scope)?, point(to, scope)?);
    let size = (x[1] - x[0]).max(y[1] - y[0]);
    let tiny = 1e-9 * size;
    for (p, q) in [(a, from), (b, to)] {
        if p[0] < x[0] - tiny || p[0] > x[1] + tiny || p[1] < y[0] - tiny || p[1] > y[1] + tiny {
            return Err(SceneError::at(
                &q[0],
                format!("{what} reaches ({}, {}), outside the domain", p[0], p[1]),
                format!("the domain is x = {} to {}, y = {} to {}", x[0], x[1], y[0], y[1]),
            ));
        }
    }
    let (dx, dy) = ((a[0] - b[0]).abs(), (a[1] - b[1]).abs());
    if dx > tiny && dy > tiny {
        return Ok(Line::Slanted([a, b]));
    }
    if dx <= tiny && dy <= tiny {
        return Err(SceneError::at(
            &to[0],
            format!("{what} has no length"),
            "`from` and `to` must differ in x or in y",
        ));
    }
    let normal = usize::from(dx > dy);
    let (s, t) = (a[1 - normal], b[1 - normal]);
    Ok(Line::Aligned(Segment { normal, at: a[normal], from: s.min(t), to: s.max(t) }))
}

impl Walls {
    pub(in crate::plan) fn new(
        scene: &Scene,
        scope: &Scope,
        domain: [[f64; 2]; 2],
        poses: Option<&[Pose]>,
    ) -> Result<Walls> {
        let mut errors = Vec::new();
        let mut walls = Vec::new();
        let mut solids = Vec::new();
        for (index, w) in scene.walls.iter().enumerate() {
            if let Some(thickness) = &w.thickness {
                match thick((index, w), thickness, scope, domain) {
                    Ok(solid) => solids.push(solid),
                    Err(e) => errors.push(e),
                }
                continue;
            }
            let rotation = rotation(&w.rotation, scope);
            match (
                axis_segment(&format!("wall `{}`", w.name), &w.from, &w.to, scope, domain),
                rotation,
            ) {
                (Ok(segment), Ok(rotation)) => {
                    walls.push(SiWall {
                        index,
                        name: w.name.clone(),
                        segment,
                        kind: w.kind.unwrap_or_default(),
                        rotation,
                    });
                }
                (Err(e), _) | (_, Err(e)) => errors.push(e),
            }
        }
        let mut blocks = Vec::new();
        let (mut moving, mut current) = (Vec::new(), Vec::new());
        for (index, b) in scene.blocks.iter().enumerate() {
            match motion(b, scope) {
                Ok(None) => {}
                Ok(Some(own)) => {
                    let known = poses.and_then(|poses| poses.get(moving.len()));
                    let pose = known.copied().unwrap_or_else(|| Pose::at_start(&own));
                    match outline_of(b, scope).and_then(|o| Ok((o, rotation(&b.rotation, scope)?)))
                    {
                        Ok((outline, rotation)) => solids.push(SiSolid {
                            index,
                            wall: false,
                            name: b.name.clone(),
                            outline: outline.moved(pose.displacement),
                            kind: b.kind.unwrap_or_default(),
                            velocity: pose.velocity,
                            rotation,
                        }),
                        Err(e) => errors.push(e),
                    }
                    moving.push(own);
                    current.push(pose);
                    continue;
                }
                Err(e) => {
                    errors.push(e);
                    continue;
                }
            }
            match resolved((index, b), scope, domain) {
                Ok(Resolved::Aligned(block)) => blocks.push(block),
                Ok(Resolved::Solid(solid)) => solids.push(solid),
                Err(e) => errors.push(e),
            }
        }
        SceneError::join(errors)?;
        Ok(Walls { walls, blocks, solids, moving, poses: current })
    }

    /// Solids of any shape that do not move.
    pub(super) fn at_rest(&self) -> impl Iterator<Item = &SiSolid> + Clone {
        let moves = |s: &SiSolid| self.moving.iter().any(|m| m.name == s.name);
        self.solids.iter().filter(move |s| !moves(s))
    }

    /// The lips of apertures: ends of walls that face each other across a gap. (Additional grading
    /// towards the upper ends of the silo's side walls takes 1.6 times the cells and changes the
    /// initial discharge by 1e-5.)
    pub(in crate::plan) fn lips(&self, domain: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
        let tips = self.tips(domain);
        tips.iter().filter(|t| tips.iter().any(|o| t.faces(o))).map(|t| t.at).collect()
    }

    /// Free ends of walls: they lie inside the domain and on no other wall.
    pub(in crate::plan) fn tips(&self, [x, y]: [[f64; 2]; 2]) -> Vec<Tip> {
        let mut tips = Vec::new();
        for (k, w) in self.walls.iter().enumerate() {
            for (p, up) in w.segment.ends().into_iter().zip([false, true]) {
                let tiny = 1e-9 * (x[1] - x[0]).max(y[1] - y[0]);
                let inside = p[0] > x[0] + tiny
                    && p[0] < x[1] - tiny
                    && p[1] > y[0] + tiny
                    && p[1] < y[1] - tiny;
                let on_other = self.walls.iter().enumerate().any(|(m, o)| {
                    let o = o.segment;
                    m != k
                        && (p[o.normal] - o.at).abs() <= tiny
                        && p[1 - o.normal] >= o.from - tiny
                        && p[1 - o.normal] <= o.to + tiny
                });
                if inside && !on_other {
                    tips.push(Tip { at: p, normal: w.segment.normal, up });
                }
            }
        }
        tips
    }

    /// The walls and blocks, and the open pieces of the sides, as limits of the motion of particles.
    pub(in crate::plan) fn enclosure(
        &self,
        boundary: &BoundaryPlan,
        mesh: &Mesh,
        units: &Units,
    ) -> Enclosure {
        let l = units.length;
        let mut obstacles: Vec<Segment> =
            self.walls.iter().map(|w| w.segment.on_mesh(mesh, l)).collect();
        for SiBlock { range, .. } in &self.blocks {
            for normal in 0..2 {
                for at in range[normal] {
                    let [from, to] = range[1 - normal].map(|v| v / l);
                    obstacles.push(Segment { normal, at: at / l, from, to });
                }
            }
        }
        let mut enclosure = Enclosure { obstacles, ..Enclosure::default() };
        for (s, piece) in boundary.pieces().filter(|(_, piece)| piece.open) {
            enclosure.open_side(mesh, s, [piece.segment.from, piece.segment.to]);
        }
        enclosure
    }
}

/// How a block moves, if it does.
fn motion(b: &Block, scope: &Scope) -> Result<Option<Moving>> {
    let Some([x, y]) = &b.velocity else { return Ok(None) };
    let velocity = [x.in_time(scope)?, y.in_time(scope)?];
    for (v, q) in velocity.iter().zip([x, y]) {
        if !v.at(0.0, 0.0).is_finite() {
            return Err(SceneError::at(
                q,
                format!("block `{}`: its velocity at t = 0 is {}", b.name, v.at(0.0, 0.0)),
                "give a velocity that is finite at all times of the run",
            ));
        }
    }
    Ok((!rests(&velocity)).then(|| Moving { name: b.name.clone(), velocity }))
}

/// Outline of a block that moves.
fn outline_of(b: &Block, scope: &Scope) -> Result<Outline> {
    let what = format!("block `{}`", b.name);
    let (x, y) = match (&b.x, &b.y, &b.shape) {
        (Some(x), Some(y), None) | (None, None, Some(SolidShape::Rectangle { x, y })) => (x, y),
        (None, None, Some(SolidShape::Polygon(corners))) => {
            return outlines::polygon(corners, &what, scope);
        }
        (None, None, Some(SolidShape::Circle { centre, radius })) => {
            return outlines::circle(centre, radius, &what, scope);
        }
        _ => return Err(without_shape(&what)),
    };
    let [[left, right], [low, high]] = ranges(x, y, scope)?;
    if left >= right || low >= high {
        let error = format!("{what} is empty");
        return Err(SceneError::at(&x[0], error, "give [low, high] with low below high"));
    }
    Ok(Outline::polygon(vec![[left, low], [right, low], [right, high], [left, high]]))
}

fn without_shape(what: &str) -> SceneError {
    SceneError::of_key(
        "blocks",
        format!("{what} needs either x and y or a shape"),
        "give x = [low, high] and y = [low, high], or shape.polygon, or shape.circle",
    )
}

/// A resolved block.
enum Resolved {
    Aligned(SiBlock),
    Solid(SiSolid),
}

fn resolved((index, b): (usize, &Block), scope: &Scope, domain: [[f64; 2]; 2]) -> Result<Resolved> {
    let what = format!("block `{}`", b.name);
    let (name, kind) = (b.name.clone(), b.kind.unwrap_or_default());
    let rotation = rotation(&b.rotation, scope)?;
    let solid = |outline, place: &Quantity| {
        outlines::touches(&outline, domain, place, &what)?;
        let (name, velocity) = (name.clone(), [0.0; 2]);
        Ok(Resolved::Solid(SiSolid { index, wall: false, name, outline, kind, velocity, rotation }))
    };
    let (x, y) = match (&b.x, &b.y, &b.shape) {
        (Some(x), Some(y), None) | (None, None, Some(SolidShape::Rectangle { x, y })) => (x, y),
        (None, None, Some(SolidShape::Polygon(corners))) => {
            let outline = outlines::polygon(corners, &what, scope)?;
            return solid(outline, &corners[0][0]);
        }
        (None, None, Some(SolidShape::Circle { centre, radius })) => {
            return solid(outlines::circle(centre, radius, &what, scope)?, &centre[0]);
        }
        _ => return Err(without_shape(&what)),
    };
    let range = ranges(x, y, scope)?;
    for (c, r) in range.into_iter().enumerate() {
        if r[0] >= r[1] || r[0] < domain[c][0] || r[1] > domain[c][1] {
            return Err(SceneError::at(
                if c == 0 { &x[0] } else { &y[0] },
                format!("{what} is empty or reaches outside the domain"),
                "give [low, high] inside the domain",
            ));
        }
    }
    Ok(Resolved::Aligned(SiBlock { index, name, range, kind, rotation }))
}

/// A wall with a thickness.
fn thick(
    (index, w): (usize, &Wall),
    thickness: &Quantity,
    scope: &Scope,
    domain: [[f64; 2]; 2],
) -> Result<SiSolid> {
    let what = format!("wall `{}`", w.name);
    let (from, to) = (point(&w.from, scope)?, point(&w.to, scope)?);
    if from == to {
        return Err(SceneError::at(
            &w.to[0],
            format!("{what} has no length"),
            "`from` and `to` must differ in x or in y",
        ));
    }
    let thickness = positive(thickness, scope, &format!("{what}: thickness"))?;
    let outline = outlines::around(from, to, thickness);
    outlines::touches(&outline, domain, &w.from[0], &what)?;
    Ok(SiSolid {
        index,
        wall: true,
        name: w.name.clone(),
        outline,
        kind: w.kind.unwrap_or_default(),
        velocity: [0.0; 2],
        rotation: rotation(&w.rotation, scope)?,
    })
}

/// The rotation rate on a wall or a block, if it is prescribed.
fn rotation(given: &Option<Quantity>, scope: &Scope) -> Result<Option<f64>> {
    given.as_ref().map(|q| q.eval(scope)).transpose()
}

/// A free end of a wall.
pub(in crate::plan) struct Tip {
    pub(in crate::plan) at: [f64; 2],
    /// Direction of the normal of its wall.
    normal: usize,
    /// Whether it is the upper or right end.
    up: bool,
}

impl Tip {
    /// Whether both ends lie on one line and their walls lie outside the gap between them.
    fn faces(&self, o: &Tip) -> bool {
        let (n, t) = (self.normal, 1 - self.normal);
        let distance = o.at[t] - self.at[t];
        n == o.normal
            && (o.at[n] - self.at[n]).abs() <= 1e-9 * distance.abs()
            && self.up != o.up
            && self.up == (distance > 0.0)
    }
}
