//! What the recording shows of a state: particles, dye, strokes, fields and level lines, in SI.

use super::simulation::Simulation;
use crate::frame::{Arrows, GridField, Isoline, ParticleScalar, ParticleSnapshot, Picture};
use crate::laws::director;
use crate::plan::Plan;
use crate::scene::{ColourBy, FieldName};
use crate::space::flow::{gradient, interpolate};
use crate::space::mesh::{Axis, Mesh};
use crate::space::particles::Particles;
use crate::space::shape::Shape;
use crate::threads;

/// Samples of a field that are worth a task of their own.
const SAMPLE_GRAIN: usize = 2048;

/// Samples of a field along the longer side of the domain.
const FIELD_SAMPLES: f64 = 240.0;
/// Arrows along the longer side of the domain.
const ARROWS: f64 = 28.0;
/// Levels of mean |n_x| that are drawn, the first one being near the random mean 2/pi.
const ALIGNMENT_LEVELS: [f32; 6] = [0.6, 0.5, 0.4, 0.3, 0.2, 0.1];

/// A regular grid of points over the domain, in the plan's units.
struct Raster {
    origin: [f64; 2],
    step: [f64; 2],
    n: [usize; 2],
}

impl Raster {
    fn new(plan: &Plan, along_longer: f64) -> Self {
        let (x, y) = (&plan.mesh.x, &plan.mesh.y);
        let step = x.length().max(y.length()) / along_longer;
        let n = [x.length() / step, y.length() / step].map(|v| (v.round() as usize).max(2));
        Raster {
            origin: [x.start(), y.start()],
            step: [x.length() / n[0] as f64, y.length() / n[1] as f64],
            n,
        }
    }

    fn centre(&self, k: usize) -> [f64; 2] {
        let (i, j) = (k % self.n[0], k / self.n[0]);
        [
            self.origin[0] + (i as f64 + 0.5) * self.step[0],
            self.origin[1] + (j as f64 + 0.5) * self.step[1],
        ]
    }

    fn index(&self, p: [f64; 2]) -> usize {
        let at = |c: usize| (((p[c] - self.origin[c]) / self.step[c]) as usize).min(self.n[c] - 1);
        at(1) * self.n[0] + at(0)
    }

    fn len(&self) -> usize {
        self.n[0] * self.n[1]
    }

    /// Where its columns and rows stand in the mesh.
    fn stand(&self, mesh: &Mesh) -> [Vec<Stand>; 2] {
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

/// A column or row of a raster: its cells, where in them it is, and the shape functions there.
#[derive(Clone, Copy)]
struct Stand {
    cell: usize,
    r: f64,
    n: [f64; 3],
}

/// Smallest and largest finite value; `[0, 1]` if there is none.
fn range(values: &[f32]) -> [f32; 2] {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) =
        (finite().fold(f32::INFINITY, f32::min), finite().fold(f32::NEG_INFINITY, f32::max));
    if low < high { [low, high] } else { [0.0, 1.0] }
}

fn symmetric([low, high]: [f32; 2]) -> [f32; 2] {
    let m = low.abs().max(high.abs());
    [-m, m]
}

/// Every how many particles one is drawn.
pub fn thinning(plan: &Plan, drawn: usize) -> usize {
    drawn.div_ceil(plan.picture.max_particles.max(1)).max(1)
}

/// Particles that are drawn: all but the background's.
pub fn drawn(plan: &Plan, particles: &Particles) -> Vec<usize> {
    let background = plan.background();
    (0..particles.len()).filter(|&p| Some(particles.material[p]) != background).collect()
}

impl<const D: usize> Simulation<D> {
    pub(super) fn draw(&self) -> Picture {
        let plan = &self.plan;
        let fields: Vec<GridField> =
            plan.picture.fields.iter().filter_map(|&f| self.field(f)).collect();
        let isolines = fields
            .iter()
            .filter(|f| f.name == "alignment")
            .flat_map(|f| ALIGNMENT_LEVELS.iter().map(|&level| isoline(f, level)))
            .collect();
        Picture {
            particles: self.draw_particles(),
            dye_lines: self.dye.as_ref().map_or(vec![], |d| {
                let si = |p: &[f64; 2]| plan.si(*p).map(|c| c as f32);
                d.wrapped(&plan.mesh).iter().map(|l| l.iter().map(si).collect()).collect()
            }),
            glyphs: self.glyphs(),
            arrows: fields.iter().any(|f| f.name == "speed").then(|| self.arrows()),
            fields,
            isolines,
        }
    }

    fn draw_particles(&self) -> ParticleSnapshot {
        let plan = &self.plan;
        let all = drawn(plan, &self.particles);
        let every = thinning(plan, all.len());
        let shown: Vec<usize> = all.into_iter().step_by(every).collect();
        let marked = plan.state.materials.len() as u16;
        let class = |&p: &usize| match &self.particles.mark {
            Some(m) if m[p] => marked,
            _ => u16::from(self.particles.material[p]),
        };
        ParticleSnapshot {
            positions: shown
                .iter()
                .map(|&p| plan.si(self.particles.position[p]).map(|c| c as f32))
                .collect(),
            class: shown.iter().map(class).collect(),
            scalar: self.particle_scalar(&shown),
        }
    }

    fn particle_scalar(&self, shown: &[usize]) -> Option<ParticleScalar> {
        let u = &self.plan.units;
        let mesh = &self.plan.mesh;
        let colour_by = self.plan.picture.colour_by;
        let value = |p: usize| -> f64 {
            let x = self.particles.position[p];
            let cell = mesh.locate(x);
            let r = mesh.to_reference(cell, x);
            let nodal = self.flow.of_cell(mesh, cell);
            match colour_by {
                ColourBy::Material => 0.0,
                ColourBy::Speed => {
                    let v = interpolate(&nodal, &Shape::values(r));
                    v[0].hypot(v[1]) * u.velocity()
                }
                ColourBy::Rotation if D == 3 => {
                    interpolate(&nodal, &Shape::values(r))[D - 1] * u.rate()
                }
                ColourBy::Rotation => f64::NAN,
                ColourBy::Pressure => self.flow.pressure_at(mesh, x) * u.stress(),
                ColourBy::StrainRate => {
                    let l =
                        gradient(&nodal.map(|v| [v[0], v[1]]), &Shape::at(r), mesh.cell_size(cell));
                    let d = (l + l.transpose()) * 0.5;
                    (2.0 * d.norm_squared()).sqrt() * u.rate()
                }
                ColourBy::Viscosity => {
                    let m = &self.matter.materials[self.particles.material[p] as usize];
                    let eta = match &self.particles.viscosity {
                        Some(v) if m.carries_viscosity => v[p],
                        _ => m.viscosity,
                    };
                    eta * u.viscosity
                }
                ColourBy::Alignment => {
                    self.particles.director.as_ref().map_or(f64::NAN, |d| d[p][0].abs())
                }
            }
        };
        if colour_by == ColourBy::Material {
            return None;
        }
        let mut values = vec![0.0; shown.len()];
        threads::for_each(&mut values, SAMPLE_GRAIN, |k, v| *v = value(shown[k]) as f32);
        let range = match colour_by {
            ColourBy::Alignment => [0.0, 1.0],
            ColourBy::Rotation => symmetric(range(&values)),
            _ => range(&values),
        };
        Some(ParticleScalar { range, values })
    }

    /// A field on the raster; `None` if this run does not have it.
    fn field(&self, name: FieldName) -> Option<GridField> {
        let plan = &self.plan;
        let mesh = &plan.mesh;
        let raster = Raster::new(plan, FIELD_SAMPLES);
        let (title, values): (&str, Vec<f32>) = match name {
            FieldName::Rotation if D != 3 => return None,
            FieldName::Alignment => ("alignment", self.alignment()?.sample(&raster)),
            FieldName::Speed | FieldName::Rotation | FieldName::Pressure => {
                let [columns, rows] = raster.stand(mesh);
                let value = |k: usize| {
                    let (x, y) = (&columns[k % raster.n[0]], &rows[k / raster.n[0]]);
                    let cell = mesh.cell(x.cell, y.cell);
                    if mesh.solid[cell] {
                        return f32::NAN;
                    }
                    let nodes = mesh.cell_nodes(cell);
                    let velocity = |c: usize| -> f64 {
                        let row = |b: usize| -> f64 {
                            (0..3).map(|a| x.n[a] * self.flow.velocity[nodes[3 * b + a]][c]).sum()
                        };
                        (0..3).map(|b| y.n[b] * row(b)).sum()
                    };
                    (match name {
                        FieldName::Pressure => {
                            let [p, by_xi, by_eta] = self.flow.pressure[cell];
                            (p + by_xi * x.r + by_eta * y.r) * plan.units.stress()
                        }
                        FieldName::Speed => velocity(0).hypot(velocity(1)) * plan.units.velocity(),
                        _ if !self.rotates(cell) => f64::NAN,
                        _ => velocity(D - 1) * plan.units.rate(),
                    }) as f32
                };
                let title = match name {
                    FieldName::Speed => "speed",
                    FieldName::Rotation => "rotation",
                    _ => "pressure",
                };
                let mut values = vec![0.0; raster.len()];
                threads::for_each(&mut values, SAMPLE_GRAIN, |k, v| *v = value(k));
                (title, values)
            }
        };
        let range = match name {
            FieldName::Alignment => [0.0, 0.7],
            FieldName::Speed => [0.0, range(&values)[1]],
            FieldName::Rotation => symmetric(range(&values)),
            FieldName::Pressure => range(&values),
        };
        Some(GridField {
            name: title.into(),
            origin: plan.si(raster.origin).map(|c| c as f32),
            cell: plan.si(raster.step).map(|c| c as f32),
            nx: raster.n[0],
            ny: raster.n[1],
            values,
            range,
        })
    }

    /// A Cosserat material fills some of a cell.
    fn rotates(&self, cell: usize) -> bool {
        (0..self.matter.materials.len()).any(|m| {
            self.matter.materials[m].law.rotation.is_some()
                && self.quadrature.composition().fraction(cell, m) > 0.0
        })
    }

    /// Mean |n_x| on a coarse raster.
    fn alignment(&self) -> Option<Coarse> {
        let directors = self.particles.director.as_ref()?;
        let plan = &self.plan;
        let cells = plan.mesh.x.cells().max(plan.mesh.y.cells()) as f64;
        let raster = Raster::new(plan, (0.5 * cells).clamp(8.0, 40.0));
        let mut sum = vec![[0.0; 2]; raster.len()];
        for (p, n) in directors.iter().enumerate() {
            let m = &self.matter.materials[self.particles.material[p] as usize];
            if m.law.is_layered() {
                let s = &mut sum[raster.index(self.particles.position[p])];
                s[0] += self.particles.volume[p];
                s[1] += self.particles.volume[p] * n[0].abs();
            }
        }
        let values = sum.iter().map(|s| if s[0] > 0.0 { s[1] / s[0] } else { f64::NAN }).collect();
        Some(Coarse { raster, values })
    }

    /// Velocities on a coarse raster; the fastest is as long as the raster is wide.
    fn arrows(&self) -> Arrows {
        let plan = &self.plan;
        let raster = Raster::new(plan, ARROWS);
        let mesh = &plan.mesh;
        let fluid = |k: &usize| !mesh.solid[mesh.locate(raster.centre(*k))];
        let points: Vec<usize> = (0..raster.len()).filter(fluid).collect();
        let velocities: Vec<[f64; 2]> = points
            .iter()
            .map(|&k| {
                let v = self.flow.at(mesh, raster.centre(k));
                [v[0], v[1]]
            })
            .collect();
        let fastest = velocities.iter().map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
        let scale = if fastest > 0.0 { raster.step[0].min(raster.step[1]) / fastest } else { 0.0 };
        let si = |p: [f64; 2]| plan.si(p).map(|c| c as f32);
        Arrows {
            field: "speed".into(),
            origins: points.iter().map(|&k| si(raster.centre(k))).collect(),
            vectors: velocities.iter().map(|v| si([scale * v[0], scale * v[1]])).collect(),
        }
    }

    /// Strokes along the layers' normals, evenly spaced.
    fn glyphs(&self) -> Vec<[[f32; 2]; 2]> {
        let Some(directors) = &self.particles.director else { return vec![] };
        let plan = &self.plan;
        let longer = plan.mesh.x.length().max(plan.mesh.y.length());
        let count = f64::from(plan.picture.glyphs) * longer / plan.mesh.x.length();
        if count < 1.0 {
            return vec![];
        }
        let raster = Raster::new(plan, count);
        let mut tensor = vec![[0.0; 3]; raster.len()];
        for (p, n) in directors.iter().enumerate() {
            let m = &self.matter.materials[self.particles.material[p] as usize];
            if m.law.is_layered() {
                let t = &mut tensor[raster.index(self.particles.position[p])];
                t[0] += n[0] * n[0];
                t[1] += n[1] * n[1];
                t[2] += n[0] * n[1];
            }
        }
        let half = 0.4 * raster.step[0].min(raster.step[1]);
        (0..raster.len())
            .filter(|&k| tensor[k][0] + tensor[k][1] > 0.0)
            .map(|k| {
                let [xx, yy, xy] = tensor[k];
                let n = director::axis(xx, yy, xy);
                let [x, y] = raster.centre(k);
                [-half, half].map(|s| plan.si([x + s * n.x, y + s * n.y]).map(|c| c as f32))
            })
            .collect()
    }
}

/// Means on a coarse raster, read by bilinear interpolation between its centres.
struct Coarse {
    raster: Raster,
    values: Vec<f64>,
}

impl Coarse {
    fn sample(&self, fine: &Raster) -> Vec<f32> {
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

/// Lines of one level through the centres of a field's cells (marching squares).
fn isoline(f: &GridField, level: f32) -> Isoline {
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
                // In one order for both cells at the edge: the cut is the same to the last bit, and
                // segments join.
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
fn joined(segments: Vec<Vec<[f32; 2]>>) -> Vec<Vec<[f32; 2]>> {
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
