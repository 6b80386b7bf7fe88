//! This module makes the snapshot of a state for the recording: particles, dye lines, director
//! glyphs, fields, arrows and isolines, in SI units.

mod discs;
mod raster;
mod stresses;

use super::initial::Unfilled;
use super::simulation::Simulation;
use super::yielding::Local;
use crate::frame::thinning::evenly;
use crate::frame::{Arrows, GridField, ParticleScalar, ParticleSnapshot, Ring, Snapshot};
use crate::laws::director;
use crate::motion::tracers::DyeLines;
use crate::plan::Plan;
use crate::scene::{ColourBy, FieldName};
use crate::space::flow::{gradient, interpolate};
use crate::space::outline::Outline;
use crate::space::particles::Particles;
use crate::space::shape::Shape;
use crate::threads;
use discs::{drawn_radius, stepped};
use raster::{Coarse, Raster, isoline, range, symmetric};

/// Number of field samples in a parallel task.
const SAMPLE_GRAIN: usize = 2048;

/// Number of field samples along the longer side of the domain.
const FIELD_SAMPLES: f64 = 240.0;
/// Number of arrows along the longer side of the domain.
const ARROWS: f64 = 28.0;
/// Number of rings of rotation along the longer side of the domain.
const RINGS: f64 = 12.0;
/// Levels of mean |n_x| that are drawn; the first is near 2/pi, the mean of random directors.
const ALIGNMENT_LEVELS: [f32; 6] = [0.6, 0.5, 0.4, 0.3, 0.2, 0.1];

/// Indices of the particles to draw: all except those of the background material.
pub fn drawn(plan: &Plan, particles: &Particles) -> Vec<usize> {
    let background = plan.background();
    (0..particles.len()).filter(|&p| Some(particles.material[p]) != background).collect()
}

/// The picture of the initial state, without its flow: particles and dye lines.
///
/// # Errors
/// A point of the domain lies in no region, and there is no background material.
pub fn initial(plan: &Plan) -> Result<Snapshot, Unfilled> {
    let (all, _) = super::initial::particles(plan)?;
    let dye = plan.tracers.as_ref().map(DyeLines::new);
    Ok(Snapshot {
        particles: particles(plan, &all).0,
        dye_lines: dye.map_or(vec![], |d| dye_lines(plan, &d)),
        moving: moving(plan),
        ..Snapshot::default()
    })
}

/// Outlines of the solids that move.
fn moving(plan: &Plan) -> Vec<Vec<[f32; 2]>> {
    let moves = |name: &str| plan.moving.iter().any(|m| m.name == name);
    let solids = plan.mesh.parts().into_iter().flat_map(|parts| &parts.solids);
    let line = |outline: &Outline| -> Vec<[f32; 2]> {
        outline.line().into_iter().map(|p| plan.si(p).map(|c| c as f32)).collect()
    };
    solids.filter(|s| moves(&s.name)).map(|s| line(&s.outline)).collect()
}

/// The particles to draw, without a quantity, and their indices.
fn particles(plan: &Plan, all: &Particles) -> (ParticleSnapshot, Vec<usize>) {
    let position = |&p: &usize| plan.si(all.position[p]).map(|c| c as f32);
    let shown = drawn(plan, all);
    let places: Vec<[f32; 2]> = shown.iter().map(position).collect();
    let kept = evenly(&places, plan.content.max_particles);
    let each = shown.len() as f64 / kept.len().max(1) as f64;
    let shown: Vec<usize> = kept.into_iter().map(|k| shown[k]).collect();
    let marked = plan.state.materials.len() as u16;
    let class = |&p: &usize| match &all.mark {
        Some(m) if m[p] => marked,
        _ => u16::from(all.material[p]),
    };
    let radius = |p: usize| drawn_radius(&plan.mesh, all.volume[p] * each, all.position[p]);
    let picture = ParticleSnapshot {
        positions: shown.iter().map(position).collect(),
        class: shown.iter().map(class).collect(),
        radii: shown.iter().map(|&p| stepped(radius(p) * plan.units.length)).collect(),
        scalar: None,
    };
    (picture, shown)
}

/// Dye lines as polylines (m).
fn dye_lines(plan: &Plan, dye: &DyeLines) -> Vec<Vec<[f32; 2]>> {
    let si = |p: &[f64; 2]| plan.si(*p).map(|c| c as f32);
    dye.wrapped(&plan.mesh).iter().map(|l| l.iter().map(si).collect()).collect()
}

/// Ends of the colour scale of inertial numbers.
fn inertial_range(plan: &Plan) -> [f32; 2] {
    [0.0, plan.halfway_inertial_number().unwrap_or(1.0) as f32]
}

/// Inertial number of grains; NaN elsewhere.
fn inertial_number(local: Option<Local>) -> f64 {
    local.and_then(|l| l.inertial_number).unwrap_or(f64::NAN)
}

/// 1 where a material with a flow curve yields, 0 where it does not; NaN elsewhere.
fn yielded(local: Option<Local>) -> f64 {
    local.map_or(f64::NAN, |l| f64::from(u8::from(l.yields)))
}

impl<const D: usize> Simulation<D> {
    pub(super) fn draw(&self) -> Snapshot {
        let plan = &self.plan;
        let fields: Vec<GridField> =
            plan.content.fields.iter().filter_map(|&f| self.field(f)).collect();
        let isolines = fields
            .iter()
            .filter(|f| f.name == "alignment")
            .flat_map(|f| ALIGNMENT_LEVELS.iter().map(|&level| isoline(f, level)))
            .collect();
        Snapshot {
            particles: self.draw_particles(),
            dye_lines: self.dye.as_ref().map_or(vec![], |d| dye_lines(plan, d)),
            glyphs: self.glyphs(),
            arrows: fields.iter().any(|f| f.name == "speed").then(|| self.arrows()),
            fields,
            isolines,
            stresses: self.stresses(),
            moving: moving(plan),
            rings: self.rings(),
        }
    }

    /// The rotation of Cosserat materials on circles about the axis, at the points of a coarse raster.
    fn rings(&self) -> Vec<Ring> {
        let plan = &self.plan;
        if D != 3 || !plan.scene.domain.geometry.is_round() {
            return vec![];
        }
        let raster = Raster::new(plan, RINGS);
        let mesh = &plan.mesh;
        let ring = |k: usize| {
            let x = raster.centre(k);
            let rotation = self.flow.at(mesh, x)[D - 1] * plan.units.rate();
            (!mesh.is_solid_at(x) && self.rotates(mesh.locate(x)))
                .then(|| Ring { at: plan.si(x).map(|c| c as f32), rotation: rotation as f32 })
        };
        (0..raster.len()).filter_map(ring).collect()
    }

    fn draw_particles(&self) -> ParticleSnapshot {
        let (mut picture, shown) = particles(&self.plan, &self.particles);
        picture.scalar = self.particle_scalar(&shown);
        picture
    }

    fn particle_scalar(&self, shown: &[usize]) -> Option<ParticleScalar> {
        let u = &self.plan.units;
        let mesh = &self.plan.mesh;
        let colour_by = self.plan.content.colour_by;
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
                    let hoop = mesh.whole_measure(cell).per_radius(r[0])
                        * interpolate(&nodal, &Shape::values(r))[0];
                    (2.0 * (d.norm_squared() + hoop * hoop)).sqrt() * u.rate()
                }
                ColourBy::Viscosity => {
                    let m = &self.matter.materials[self.particles.material[p] as usize];
                    let eta = match (self.local(p, cell, r), &self.particles.viscosity) {
                        (Some(local), _) => local.viscosity,
                        (None, Some(v)) if m.carries_viscosity => v[p],
                        (None, _) => m.viscosity,
                    };
                    eta * u.viscosity
                }
                ColourBy::Alignment => {
                    self.particles.director.as_ref().map_or(f64::NAN, |d| d[p][0].abs())
                }
                ColourBy::InertialNumber => inertial_number(self.local(p, cell, r)),
                ColourBy::Yielded => yielded(self.local(p, cell, r)),
            }
        };
        if colour_by == ColourBy::Material {
            return None;
        }
        let mut values = vec![0.0; shown.len()];
        threads::for_each(&mut values, SAMPLE_GRAIN, |k, v| *v = value(shown[k]) as f32);
        let range = match colour_by {
            ColourBy::Alignment | ColourBy::Yielded => [0.0, 1.0],
            ColourBy::InertialNumber => inertial_range(&self.plan),
            ColourBy::Rotation => symmetric(range(&values)),
            _ => range(&values),
        };
        Some(ParticleScalar { range, values })
    }

    /// A field on a raster; `None` if this run does not have the field.
    fn field(&self, name: FieldName) -> Option<GridField> {
        let plan = &self.plan;
        let mesh = &plan.mesh;
        let raster = Raster::new(plan, FIELD_SAMPLES);
        let (title, values): (&str, Vec<f32>) = match name {
            FieldName::Rotation if D != 3 => return None,
            FieldName::InertialNumber if !plan.has_friction() => return None,
            FieldName::InertialNumber => {
                ("inertial_number", self.sample_locals(&raster, inertial_number))
            }
            FieldName::Yielded if !plan.effects.flow_curves => return None,
            FieldName::Yielded => ("yielded", self.sample_locals(&raster, yielded)),
            FieldName::Alignment => ("alignment", self.alignment()?.sample(&raster)),
            FieldName::Speed | FieldName::Rotation | FieldName::Pressure => {
                let [columns, rows] = raster.stand(mesh);
                let value = |k: usize| {
                    let (x, y) = (&columns[k % raster.n[0]], &rows[k / raster.n[0]]);
                    let cell = mesh.cell(x.cell, y.cell);
                    let nothing = self.is_void_at(cell, [x.r, y.r]);
                    if nothing || mesh.is_solid_in(cell, raster.centre(k)) {
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
                            self.flow.pressure_in(mesh, cell, [x.r, y.r]) * plan.units.stress()
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
            FieldName::InertialNumber => inertial_range(plan),
            FieldName::Yielded => [0.0, 1.0],
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

    /// Values of materials with a flow curve at the points of a raster.
    fn sample_locals(&self, raster: &Raster, value: fn(Option<Local>) -> f64) -> Vec<f32> {
        let mesh = &self.plan.mesh;
        let [columns, rows] = raster.stand(mesh);
        let mut values = vec![0.0; raster.len()];
        threads::for_each(&mut values, SAMPLE_GRAIN, |k, v| {
            let (x, y) = (&columns[k % raster.n[0]], &rows[k / raster.n[0]]);
            let cell = mesh.cell(x.cell, y.cell);
            let nothing = self.is_void_at(cell, [x.r, y.r]);
            let local = if nothing || mesh.is_solid_in(cell, raster.centre(k)) {
                None
            } else {
                self.local_at(cell, [x.r, y.r])
            };
            *v = value(local) as f32;
        });
        values
    }

    /// Whether a cell contains a Cosserat material.
    fn rotates(&self, cell: usize) -> bool {
        (0..self.matter.materials.len()).any(|m| {
            self.matter.materials[m].law.rotation.is_some()
                && self.quadrature.composition().fraction(cell, m) > 0.0
        })
    }

    /// Mean |n_x| on a coarse raster; `None` without directors.
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

    /// Velocity arrows on a coarse raster; the longest is as long as the raster spacing.
    fn arrows(&self) -> Arrows {
        let plan = &self.plan;
        let raster = Raster::new(plan, ARROWS);
        let mesh = &plan.mesh;
        let fluid = |k: &usize| {
            let at = raster.centre(*k);
            let cell = mesh.locate(at);
            !mesh.is_solid_at(at) && !self.is_void_at(cell, mesh.to_reference(cell, at))
        };
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

    /// Evenly spaced line segments along the normals of the layers.
    fn glyphs(&self) -> Vec<[[f32; 2]; 2]> {
        let Some(directors) = &self.particles.director else { return vec![] };
        let plan = &self.plan;
        let longer = plan.mesh.x.length().max(plan.mesh.y.length());
        let count = f64::from(plan.content.glyphs) * longer / plan.mesh.x.length();
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
