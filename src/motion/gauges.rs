//! This module measures the transport of a material across a segment in two ways: it counts the
//! particles that cross, and it integrates the flux of the velocity field.

use crate::plan::Gauge;
use crate::space::flow::Flow;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::segment::Segment;
use crate::space::shape::Shape;

/// A gauge with the volume that has crossed it.
#[derive(Clone, Debug)]
pub struct Counter {
    /// The gauge.
    pub gauge: Gauge,
    /// Net volume per depth of the gauge's material that has crossed along its direction since the
    /// start, in the plan's units.
    pub volume: f64,
}

/// Number of flux samples along the edge of a cell.
const SAMPLES: usize = 8;
/// Width of the kernel that determines the material at a sample, in cells.
const KERNEL_WIDTH: f64 = 0.25;

impl Counter {
    /// A counter at zero.
    pub fn new(gauge: Gauge) -> Self {
        Counter { gauge, volume: 0.0 }
    }

    /// Counts a particle if its straight path (not wrapped) crosses the gauge.
    pub fn pass(&mut self, mesh: &Mesh, from: [f64; 2], to: [f64; 2], material: u8, volume: f64) {
        let Gauge { segment: s, sign, .. } = self.gauge;
        if material != self.gauge.material {
            return;
        }
        let (axis, _) = mesh.axes(s.normal);
        let period = if axis.periodic() { axis.length() } else { 0.0 };
        let images: &[f64] = if axis.periodic() { &[0.0, -1.0, 1.0] } else { &[0.0] };
        for image in images {
            let at = s.at + image * period;
            let (a, b) = (from[s.normal], to[s.normal]);
            if (a >= at) == (b >= at) {
                continue;
            }
            let t = (at - a) / (b - a);
            let along = from[1 - s.normal] + t * (to[1 - s.normal] - from[1 - s.normal]);
            if along >= s.from && along <= s.to {
                self.volume += if b >= at { sign * volume } else { -sign * volume };
            }
        }
    }

    /// Flux of the material along the gauge's direction, from the velocity field, in the plan's
    /// units. The fraction of the material at a sample is a kernel mean over the particles of the
    /// upstream cell.
    pub fn rate<const D: usize>(
        &self,
        mesh: &Mesh,
        flow: &Flow<D>,
        particles: &Particles,
        background: Option<u8>,
    ) -> f64 {
        let g = &self.gauge;
        let Segment { normal, at, from, to } = g.segment;
        let (across, along) = mesh.axes(normal);
        let line = across.nearest_line(at);
        let (first, last) = (along.nearest_line(from), along.nearest_line(to));
        let below =
            if line > 0 { Some(line - 1) } else { across.periodic().then(|| across.cells() - 1) };
        let above = (line < across.cells()).then_some(line);
        let mut flux = 0.0;
        for k in first..last {
            let [low, high] = [below, above].map(|m| m.map(|m| mesh.cell_across(normal, m, k)));
            let Some(owner) = high.or(low) else { continue };
            let edge = if high.is_some() { -1.0 } else { 1.0 };
            let nodal = flow.of_cell(mesh, owner);
            for s in 0..SAMPLES {
                let t = (2 * s + 1) as f64 / SAMPLES as f64 - 1.0;
                let r = if normal == 0 { [edge, t] } else { [t, edge] };
                let n = Shape::values(r);
                let u: f64 = (0..9).map(|a| n[a] * nodal[a][normal]).sum();
                let p = mesh.from_reference(owner, r);
                let upstream = if u > 0.0 { low } else { high }.unwrap_or(owner);
                let share = fraction(mesh, particles, upstream, p, g.material, background);
                flux += g.sign * share * u * mesh.face_area(owner, normal) / SAMPLES as f64;
            }
        }
        flux
    }
}

/// Volume fraction of a material near a point, from the particles of a cell.
fn fraction(
    mesh: &Mesh,
    particles: &Particles,
    cell: usize,
    p: [f64; 2],
    material: u8,
    background: Option<u8>,
) -> f64 {
    let range = particles.of_cell(cell);
    if range.is_empty() {
        return f64::from(background == Some(material));
    }
    let [hx, hy] = mesh.cell_size(cell);
    let (mut mine, mut all) = (0.0, 0.0);
    for q in range {
        let (dx, dy) = (particles.position[q][0] - p[0], particles.position[q][1] - p[1]);
        let r2 = (dx / hx).powi(2) + (dy / hy).powi(2);
        // The constant avoids a zero sum of weights if all particles are far from the point.
        let w = particles.volume[q] * ((-r2 / (KERNEL_WIDTH * KERNEL_WIDTH)).exp() + 1e-30);
        all += w;
        mine += if particles.material[q] == material { w } else { 0.0 };
    }
    mine / all
}
