//! This module computes the volumes and centroids of the materials of one cell.
//!
//! The centroid of all particles of a cell should be its centre. As particles slide past one
//! another it is not, until some cross a face. The centroids are shifted to compensate, those of
//! materials that move easily more than those of stiff ones,
//!
//! ```text
//! X_m - o w_m,   o = sum s_m X_m
//! w_m = b + (1 - b) (1/eta_m) / sum s_k/eta_k,   b = sum s_k eta_k/eta_max
//! ```
//! where `s_m` is the share and `X_m` the centroid of material `m`, and `eta_max` the largest
//! viscosity of the scene. With equal shifts, thin fluid that slides along the interface of a stiff
//! fluid seems to tilt it, and the tilt makes the thin fluid slide: at a contrast of 1e6, the speed
//! of a fluid at rest (rounding) doubled with every step. In cells nearly full of the stiff fluid,
//! `b` keeps the shifts nearly equal: there the slip of the thin fluid has little effect, and a
//! shift of the stiff fluid would affect all.
//!
//! Around an axis volumes are those of rings and centroids are weighted by them, so that of the cell has
//! `xi = t/3` with its tilt `t` ([`measure`](crate::space::measure)). The linear share
//!
//! ```text
//! chi_m = s_m [1 + 3 (X_m - t/3)(xi - t/3)/(1 - t^2/3) + 3 Y_m eta]
//! ```
//! has the volume and the centroid of the particles; its area and centroid in the plane of the mesh are
//! those that lines are found from.

use super::surface::VoidPart;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;

/// Volumes and centroids of the materials of a cell.
#[derive(Default)]
pub struct Centroids {
    parts: Vec<Part>,
    /// Tilt of the cell.
    tilt: f64,
}

/// One material in the cell.
#[derive(Clone, Default)]
struct Part {
    /// Volume of its particles; later its share of the cell.
    volume: f64,
    /// Sum of volume times reference coordinates; later the shifted centroid.
    moment: [f64; 2],
}

impl Centroids {
    /// Centroids of a number of materials, without particles.
    pub fn new(materials: usize) -> Self {
        Centroids { parts: vec![Part::default(); materials], tilt: 0.0 }
    }

    /// Allocates memory for a number of materials.
    pub fn prepare(&mut self, materials: usize) {
        self.parts.resize(materials, Part::default());
    }

    /// Sums the volumes and moments of the particles of a cell.
    pub fn gather(&mut self, mesh: &Mesh, cell: usize, particles: &Particles) {
        self.parts.fill(Part::default());
        self.tilt = mesh.whole_measure(cell).tilt();
        for p in particles.of_cell(cell) {
            let (volume, part) =
                (particles.volume[p], &mut self.parts[particles.material[p] as usize]);
            let r = mesh.to_reference(cell, particles.position[p]);
            part.volume += volume;
            for c in 0..2 {
                part.moment[c] += volume * r[c];
            }
        }
    }

    /// Adds a void: what the materials, whose volumes are multiplied by `factors`, leave free of the cell.
    pub fn add_void(&mut self, void: VoidPart, factors: &[f64]) {
        let (mut volume, mut moment) = (0.0, [0.0; 2]);
        for (part, factor) in self.parts.iter().zip(factors) {
            volume += part.volume * factor;
            (0..2).for_each(|c| moment[c] -= part.moment[c] * factor);
        }
        let volume = volume * void.share / (1.0 - void.share);
        if let Some((centroid, part)) = void.around {
            (0..2).for_each(|c| moment[c] += part * (volume * centroid[c] - moment[c]));
        }
        self.parts[void.material] = Part { volume, moment };
    }

    /// Computes the shares and the shifted centroids of the gathered particles. The volume of each
    /// material is multiplied by its factor; `viscosity` yields that of each material of the scene.
    pub fn finish(&mut self, factors: &[f64], viscosity: impl Iterator<Item = f64> + Clone) {
        let total: f64 = self.parts.iter().zip(factors).map(|(p, f)| p.volume * f).sum();
        let (mut offset, mut give, mut held) = ([0.0; 2], 0.0, 0.0);
        let stiffest = viscosity.clone().fold(0.0, f64::max);
        for ((part, factor), viscosity) in self.parts.iter_mut().zip(factors).zip(viscosity.clone())
        {
            if part.volume == 0.0 {
                continue;
            }
            part.moment = part.moment.map(|m| m / part.volume);
            let share = part.volume * factor / total;
            give += share * stiffest / viscosity;
            held += share * viscosity / stiffest;
            for c in 0..2 {
                offset[c] += share * part.moment[c];
            }
        }
        offset[0] -= self.tilt / 3.0;
        for ((part, factor), viscosity) in self.parts.iter_mut().zip(factors).zip(viscosity) {
            if part.volume == 0.0 {
                continue;
            }
            part.volume = part.volume * factor / total;
            let shifted = held + (1.0 - held) * stiffest / (viscosity * give);
            for c in 0..2 {
                part.moment[c] -= offset[c] * shifted;
            }
        }
    }

    /// Share of a material in the cell, after [`Centroids::finish`].
    pub fn share(&self, m: usize) -> f64 {
        self.parts[m].volume
    }

    /// Shifted centroid of a material of the cell, after [`Centroids::finish`].
    pub fn centroid(&self, m: usize) -> [f64; 2] {
        self.parts[m].moment
    }

    /// Slopes of the linear share of a material, relative to its share.
    fn slopes(&self, m: usize) -> [f64; 2] {
        let [x, y] = self.parts[m].moment;
        [3.0 * (x - self.tilt / 3.0) / self.lack(), 3.0 * y]
    }

    /// Three times the mean square of `xi - t/3`.
    fn lack(&self) -> f64 {
        1.0 - self.tilt * self.tilt / 3.0
    }

    /// Linear share of a material at reference coordinates, after [`Centroids::finish`].
    pub fn share_at(&self, m: usize, r: [f64; 2]) -> f64 {
        let [x, y] = self.slopes(m);
        self.share(m) * (1.0 + x * (r[0] - self.tilt / 3.0) + y * r[1])
    }

    /// Share and centroid of a material in the plane of the mesh, after [`Centroids::finish`].
    pub fn in_section(&self, m: usize) -> (f64, [f64; 2]) {
        let [x, y] = self.parts[m].moment;
        let x = (x - self.tilt / 3.0) / self.lack();
        let area = 1.0 - x * self.tilt;
        (self.share(m) * area, [x / area, y / area])
    }
}
