//! This module finds differences between two plans other than values that may change during a run.

use super::material::Material;
use super::{Entering, Gauge, Matter, Plan, SlipFace, Source, Tracers};
use crate::space::parts::Parts;

impl Plan {
    /// Short description of a difference other than the values of materials and gravity, which
    /// alone may change during a run; `None` if there is no such difference.
    pub fn beyond_matter(&self, other: &Plan) -> Option<&'static str> {
        let checks: [(bool, &str); 14] = [
            (geometry(self) != geometry(other), "the mesh"),
            (self.effects != other.effects, "the set of solved effects"),
            (!same_history(&self.state, &other.state), "the kind of a material"),
            (self.initial != other.initial, "the values that particles carry"),
            (supports(self) != supports(other), "the boundaries"),
            (enters(self) != enters(other), "what enters"),
            (self.moving != other.moving, "the velocity of a block"),
            (
                slips(self) != slips(other) || self.boundary.solids != other.boundary.solids,
                "the slip at walls",
            ),
            (
                loads(self) != loads(other) || self.acceleration != other.acceleration,
                "the boundaries' values or the loads",
            ),
            (self.regions != other.regions, "the initial regions"),
            (lines(self) != lines(other) || self.forces != other.forces, "the gauges or the dye"),
            (self.method != other.method, "the accuracy"),
            (times(self) != times(other), "the times of the run"),
            (self.content != other.content, "the recording"),
        ];
        checks.into_iter().find_map(|(differs, what)| differs.then_some(what))
    }

    /// Whether runs of both plans are identical until the first scheduled change that only one of
    /// them has: both have the same units and step to the same instants.
    pub(super) fn shares_its_beginning_with(&self, other: &Plan) -> bool {
        self.units == other.units
            && self.clock.stops == other.clock.stops
            && self.beyond_matter(other).is_none()
            && self.state == other.state
    }
}

/// Open ranges of the sides (m), free translations and whether the domain is closed, without prescribed values.
fn supports(p: &Plan) -> ([Vec<[f64; 2]>; 4], [bool; 2], bool) {
    let si =
        |ranges: &Vec<[f64; 2]>| ranges.iter().map(|r| r.map(|v| v * p.units.length)).collect();
    (p.enclosure.open.each_ref().map(si), p.boundary.free_translation, p.boundary.closed)
}

/// What enters through the pieces of the sides, and the nozzles in SI units.
fn enters(p: &Plan) -> (Vec<Option<&Entering>>, Vec<Source>) {
    let u = &p.units;
    let sources = p.boundary.sources.iter().cloned().map(|s| Source {
        segment: s.segment.scaled(u.length),
        velocity: s.velocity * u.velocity(),
        times: s.times.map(|t| t * u.time),
        ..s
    });
    (p.boundary.pieces().map(|(_, piece)| piece.enters.as_ref()).collect(), sources.collect())
}

/// Faces along which material slips, with SI velocities of the walls.
fn slips(p: &Plan) -> Vec<SlipFace> {
    let speed = p.units.velocity();
    let list = p.boundary.slip_faces(&p.mesh, &p.units).into_iter();
    list.map(|f| SlipFace { wall: f.wall.map(|v| v * speed), ..f }).collect()
}

/// Gauges, dye lines and marks in SI units.
fn lines(p: &Plan) -> (Vec<Gauge>, Option<Tracers>, Vec<[f64; 5]>) {
    let l = p.units.length;
    let gauges = p.gauges.iter().cloned();
    let gauges = gauges.map(|g| Gauge { line: g.line.scaled(l), ..g });
    let dye = p.tracers.as_ref().map(|t| Tracers {
        lines: t.lines.iter().map(|s| s.iter().map(|p| p.map(|v| v * l)).collect()).collect(),
        spacing: t.spacing * l,
    });
    let marks = p.marks.iter();
    let marks = marks
        .map(|m| [m.from[0], m.from[1], m.to[0], m.to[1], m.half_width].map(|v| v * l))
        .collect();
    (gauges.collect(), dye, marks)
}

/// Frame times and end time (s), largest step (s), and the other limits of the step.
fn times(p: &Plan) -> (Vec<f64>, Option<f64>, [f64; 3]) {
    let t = p.units.time;
    let frames = p.clock.frames.iter().chain([&p.clock.end]).map(|v| v * t);
    (frames.collect(), p.clock.max_step.map(|v| v * t), p.clock.limits())
}

/// Mesh lines and walls, with the rotation on solids of any shape, in SI units; a scheduled change must not alter them.
fn geometry(p: &Plan) -> (Vec<f64>, Vec<[f64; 2]>) {
    let l = p.units.length;
    let lines = p.mesh.x.lines().iter().chain(p.mesh.y.lines()).map(|v| v * l).collect();
    let walls: Vec<[f64; 2]> = p
        .enclosure
        .obstacles
        .iter()
        .flat_map(|o| [[o.at * l, o.normal as f64], [o.from * l, o.to * l]])
        .collect();
    let outlines = p.mesh.parts().into_iter().flat_map(Parts::outlines);
    let outlines = outlines.flat_map(|o| o.line().into_iter().map(|p| p.map(|v| v * l)));
    let rate = p.units.rate();
    let solids = p.mesh.parts().into_iter().flat_map(|parts| &parts.solids);
    let rotations = solids.map(|s| s.rotation.map_or([0.0; 2], |w| [1.0, w * rate]));
    (lines, walls.into_iter().chain(outlines).chain(rotations).collect())
}

/// Whether the materials of both have the same particle columns and the same kind of law.
fn same_history(a: &Matter, b: &Matter) -> bool {
    let kind = |m: &Material| {
        (
            m.name.clone(),
            m.background,
            m.carries_viscosity,
            m.carries_density,
            std::mem::discriminant(&m.law.shear),
            m.law.rotation.is_some(),
            m.law.curve.map(|c| std::mem::discriminant(&c.strength)),
            m.law.compliance > 0.0,
        )
    };
    a.materials.iter().map(kind).eq(b.materials.iter().map(kind))
}

/// Prescribed nodal values and fixed loads in SI units.
fn loads(p: &Plan) -> Vec<f64> {
    let (mesh, units) = (&p.mesh, &p.units);
    let given = p.boundary.constraints::<3>(mesh, units);
    let load = p.fixed_loads::<3>();
    let force = units.stress() * units.length;
    let scale = [units.velocity(), units.velocity(), units.rate()];
    let mut out: Vec<f64> = load.iter().flatten().map(|f| f * force).collect();
    for node in 0..mesh.nodes() {
        out.extend((0..3).filter_map(|c| Some(given.fixed_value(node, c)? * scale[c])));
    }
    out
}
