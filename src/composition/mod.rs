//! What is where: from particles to the materials of each cell, their shares, interfaces and
//! fitted fields. Nothing here knows a constitutive law.
//!
//! [`Composition`] says for every cell what it is made of; [`Gathered`] holds what the particles of
//! one mixed cell show, for [`solve::quadrature`](crate::solve::quadrature) to evaluate.

pub mod features;
mod gather;
pub mod interface;

pub use gather::{Gathered, SCRATCH};

use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::threads;

/// Cells that are worth a task of their own.
const GRAIN: usize = 32;

/// Settings of [`Composition::keep_volumes`]: gain, largest step, and least response.
const VOLUME_GAIN: f64 = 0.3;
const LARGEST_STEP: f64 = 0.05;
const LEAST_RESPONSE: f64 = 1e-4;

/// What a cell is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// One uniform material, named by its index and the version of the material table.
    Uniform {
        /// Index of the material.
        material: u8,
        /// Counts changes of the material table.
        version: u32,
    },
    /// Anything else: evaluated in every step.
    Mixed,
    /// A solid block.
    Solid,
    /// Not evaluated yet.
    Unknown,
}

/// What the composition must know of a material.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Its law and density are constants.
    pub uniform: bool,
    /// Its directors matter.
    pub directors: bool,
    /// Its particles carry a viscosity.
    pub viscosity: bool,
}

/// A cell that holds no particles though no background fills it.
#[derive(Debug, thiserror::Error)]
#[error("cell {cell} at ({x:.4e}, {y:.4e}) holds no particles and no background material fills it")]
pub struct EmptyCell {
    /// Index of the cell.
    pub cell: usize,
    /// Coordinates of its centre.
    pub x: f64,
    /// See `x`.
    pub y: f64,
}

/// The materials of all cells.
pub struct Composition {
    materials: usize,
    content: Vec<Content>,
    /// Share of each material in each cell.
    pub(crate) fractions: Vec<f64>,
    /// Factor on each material's volume in cut cells; see [`Composition::keep_volumes`].
    factors: Vec<f64>,
    /// Cells whose content may have changed in the last update.
    fresh: Vec<bool>,
    /// What the last update found in each cell; `None` in an empty one.
    found: Vec<Option<Content>>,
}

impl Composition {
    /// Nothing is known of any cell yet.
    pub fn new(cells: usize, materials: usize) -> Self {
        Composition {
            materials,
            content: vec![Content::Unknown; cells],
            fractions: vec![0.0; cells * materials],
            factors: vec![1.0; materials],
            fresh: vec![false; cells],
            found: vec![None; cells],
        }
    }

    /// What a cell is made of.
    pub fn content(&self, cell: usize) -> Content {
        self.content[cell]
    }

    /// Declares what a cell is made of.
    pub(crate) fn set_content(&mut self, cell: usize, content: Content) {
        self.content[cell] = content;
    }

    /// What every cell is made of.
    pub fn contents(&self) -> &[Content] {
        &self.content
    }

    /// Whether the content of a cell may have changed in the last update.
    pub fn is_fresh(&self, cell: usize) -> bool {
        self.fresh[cell]
    }

    /// Share of a material in a cell.
    pub fn fraction(&self, cell: usize, material: usize) -> f64 {
        self.fractions[cell * self.materials + material]
    }

    /// Factor on each material's volume in cut cells.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Goes back to the factors of an earlier state.
    pub fn set_factors(&mut self, factors: &[f64]) {
        self.factors.copy_from_slice(factors);
    }

    /// Area of a material as the solver sees it.
    pub fn projected_area(&self, mesh: &Mesh, material: usize) -> f64 {
        let share = |cell| [self.fraction(cell, material) * mesh.cell_volume(cell)];
        threads::sum(0..mesh.cells(), share)[0]
    }

    /// Finds out what every cell is made of. `particles` sorted; `moving`: a cell with particles
    /// counts as mixed.
    ///
    /// # Errors
    /// A cell that nothing fills.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        kinds: &[Kind],
        (background, version): (Option<usize>, u32),
        moving: bool,
    ) -> Result<(), EmptyCell> {
        threads::for_each(&mut self.found, GRAIN, |cell, found| {
            *found = if mesh.solid[cell] {
                Some(Content::Solid)
            } else {
                content(particles, cell, kinds, background, version)
            };
        });
        for cell in 0..mesh.cells() {
            let content = self.found[cell].ok_or_else(|| {
                let [x, y] = mesh.cell_centre(cell);
                EmptyCell { cell, x, y }
            })?;
            let mixed = moving && !particles.of_cell(cell).is_empty();
            let content = if mixed { Content::Mixed } else { content };
            let unchanged = content != Content::Mixed && content == self.content[cell];
            self.content[cell] = content;
            self.fresh[cell] = !unchanged;
        }
        Ok(())
    }

    /// Lets each material's projected area follow the volume of its particles, which is exact.
    ///
    /// In cut cells a material's share is that of its particles' volume times a factor of its
    /// own; the factors are adjusted a little each step,
    ///
    /// ```text
    /// d ln f_m = gain (V_m - P_m) / S_m,   P_m = sum A phi,   S_m = dP_m/d ln f_m = sum A phi (1 - phi)
    /// ```
    /// which shifts all of its rim by the same small distance (a hundredth of a cell on the
    /// silo). Without it the projected volume of the grains wanders by 0.3 %.
    pub(crate) fn keep_volumes(&mut self, mesh: &Mesh, particles: &Particles) {
        let [area] = threads::sum(0..mesh.cells(), |cell| {
            [if mesh.solid[cell] { 0.0 } else { mesh.cell_volume(cell) }]
        });
        let [volume] = threads::sum(0..particles.len(), |p| [particles.volume[p]]);
        let scale = area / volume;
        for m in 0..self.materials {
            let [projected, response] = threads::sum(0..mesh.cells(), |cell| {
                let (phi, area) = (self.fraction(cell, m), mesh.cell_volume(cell));
                // Nothing is in a solid one.
                [area * phi, area * phi * (1.0 - phi)]
            });
            // Without cut cells, or with next to none, there is no rim to shift.
            if response > LEAST_RESPONSE * area {
                let missing = (particles.volume_of(m) * scale - projected) / response;
                let step = (VOLUME_GAIN * missing).clamp(-LARGEST_STEP, LARGEST_STEP);
                self.factors[m] = (self.factors[m] * step.exp()).clamp(0.5, 2.0);
            }
        }
    }
}

/// What a cell is made of; `None` if nothing fills it.
fn content(
    particles: &Particles,
    cell: usize,
    kinds: &[Kind],
    background: Option<usize>,
    version: u32,
) -> Option<Content> {
    let range = particles.of_cell(cell);
    let first = match particles.material[range.clone()].first() {
        Some(&m) => m,
        None => background? as u8,
    };
    let single = particles.material[range].iter().all(|&m| m == first);
    Some(if single && kinds[first as usize].uniform {
        Content::Uniform { material: first, version }
    } else {
        Content::Mixed
    })
}
