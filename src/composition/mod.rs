//! This module determines, from the particles, which materials each cell contains, with their
//! shares, interfaces and fitted fields. It does not use constitutive laws.
//!
//! [`Composition`] holds the content of every cell. [`Gathered`] holds the sums over the particles
//! of one mixed cell, which [`solve::quadrature`](crate::solve::quadrature) evaluates.

pub mod centroids;
pub mod features;
pub mod fill;
mod gather;
pub mod interface;
pub mod straight;
pub mod surface;

pub use gather::{Gathered, SCRATCH};

use crate::space::constraints::FixedSides;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::threads;
use fill::Fill;
use surface::VoidPart;

/// Largest number of cells per task.
const GRAIN: usize = 32;

/// Gain of [`Composition::keep_volumes`].
const VOLUME_GAIN: f64 = 0.3;
/// Largest change of the logarithm of a factor in one step.
const LARGEST_STEP: f64 = 0.05;
/// Smallest response `S_m`, as a fraction of the area of the mesh, for an adjustment.
const LEAST_RESPONSE: f64 = 1e-4;

/// Content of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// One uniform material, identified by its index and the version of the material table.
    Uniform {
        /// Index of the material.
        material: u8,
        /// Number of changes of the material table.
        version: u32,
    },
    /// One material whose law depends on the flow, but not on its particles; evaluated in every
    /// solution.
    Flowing {
        /// Index of the material.
        material: u8,
    },
    /// Any other content; evaluated in every step.
    Mixed,
    /// A solid block.
    Solid,
    /// Nothing: a void.
    Empty,
    /// Not evaluated yet.
    Unknown,
}

impl Content {
    /// Whether equal contents have equal laws at all times.
    pub fn is_constant(self) -> bool {
        !matches!(self, Content::Mixed | Content::Flowing { .. })
    }
}

/// Properties of a material that the composition needs.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Whether its law and density are constants.
    pub uniform: bool,
    /// Whether its law depends on the flow, and on nothing that particles carry.
    pub flowing: bool,
    /// Whether its law depends on directors.
    pub directors: bool,
    /// Whether its particles carry a viscosity.
    pub viscosity: bool,
}

/// A cell that has neither particles nor a background material.
#[derive(Debug, thiserror::Error)]
#[error("cell {cell} at ({x:.4e}, {y:.4e}) holds no particles and no background material fills it")]
pub struct EmptyCell {
    /// Index of the cell.
    pub cell: usize,
    /// Coordinate x of its centre.
    pub x: f64,
    /// Coordinate y of its centre.
    pub y: f64,
}

/// The materials of all cells.
pub struct Composition {
    materials: usize,
    /// Content of each cell.
    content: Vec<Content>,
    /// Volume fraction of each material in each cell; index `cell * materials + material`.
    pub(crate) fractions: Vec<f64>,
    /// Factor on each material's volume in cut cells; see [`Composition::keep_volumes`].
    factors: Vec<f64>,
    /// Whether the content of each cell may have changed in the last update.
    fresh: Vec<bool>,
    /// Content of each cell in the last update; `None` if nothing fills it and nothing may be empty.
    found: Vec<Option<Content>>,
    /// Filled shares of the cells, if a void is around the materials.
    fill: Option<Fill>,
}

impl Composition {
    /// Creates a composition of unknown content.
    pub fn new(cells: usize, materials: usize) -> Self {
        Composition {
            materials,
            content: vec![Content::Unknown; cells],
            fractions: vec![0.0; cells * materials],
            factors: vec![1.0; materials],
            fresh: vec![false; cells],
            found: vec![None; cells],
            fill: None,
        }
    }

    /// Lets a void be around the materials.
    pub fn leave_void(&mut self, fill: Fill) {
        self.fill = Some(fill);
    }

    /// Filled shares of the cells, if a void is around the materials.
    pub fn fill(&self) -> Option<&Fill> {
        self.fill.as_ref()
    }

    /// The void of a cell that is filled in part.
    pub fn void_in(&self, mesh: &Mesh, cell: usize) -> Option<VoidPart> {
        VoidPart::of(mesh, self.fill.as_ref()?, cell)
    }

    /// Content of a cell.
    pub fn content(&self, cell: usize) -> Content {
        self.content[cell]
    }

    /// Sets the content of a cell.
    pub(crate) fn set_content(&mut self, cell: usize, content: Content) {
        self.content[cell] = content;
    }

    /// Content of every cell.
    pub fn contents(&self) -> &[Content] {
        &self.content
    }

    /// Whether the content of a cell may have changed in the last update.
    pub fn is_fresh(&self, cell: usize) -> bool {
        self.fresh[cell]
    }

    /// Volume fraction of a material in a cell.
    pub fn fraction(&self, cell: usize, material: usize) -> f64 {
        self.fractions[cell * self.materials + material]
    }

    /// Factor on each material's volume in cut cells.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Restores the factors of an earlier state.
    pub fn set_factors(&mut self, factors: &[f64]) {
        self.factors.copy_from_slice(factors);
    }

    /// Volume of a material in the quadrature of the solver (an area in the plane, per unit depth).
    pub fn projected_area(&self, mesh: &Mesh, material: usize) -> f64 {
        let share = |cell| [self.fraction(cell, material) * mesh.cell_volume(cell)];
        threads::sum(0..mesh.cells(), share)[0]
    }

    /// Determines the content of every cell. `particles` must be sorted. With `moving`, every cell
    /// with particles counts as mixed.
    ///
    /// # Errors
    /// Returns [`EmptyCell`] if a cell has neither particles nor a background material.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        kinds: &[Kind],
        (background, version): (Option<usize>, u32),
        (moving, walls): (bool, &[FixedSides]),
    ) -> Result<(), EmptyCell> {
        if let Some(fill) = &mut self.fill {
            fill.update(mesh, particles, &self.factors, walls);
        }
        let fill = self.fill.as_ref();
        threads::for_each(&mut self.found, GRAIN, |cell, found| {
            *found = if mesh.solid[cell] {
                Some(Content::Solid)
            } else if fill.is_some_and(|fill| fill.of(cell) == 0.0) {
                Some(Content::Empty)
            } else if fill.is_some_and(|fill| fill.is_partial(cell)) {
                Some(Content::Mixed)
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
            let unchanged = content.is_constant() && content == self.content[cell];
            self.content[cell] = content;
            self.fresh[cell] = !unchanged;
        }
        Ok(())
    }

    /// Adjusts the factors so that the projected area of each material approaches the volume of its
    /// particles, which is exact.
    ///
    /// In cut cells the share of a material is that of the volume of its particles times a factor.
    /// The factors are adjusted a little in each step,
    ///
    /// ```text
    /// d ln f_m = gain (V_m - P_m) / S_m
    /// P_m = sum A phi,   S_m = dP_m/d ln f_m = sum A phi (1 - phi)
    /// ```
    /// which shifts the whole boundary of the material by the same small distance (a hundredth of a
    /// cell on the silo). Without this the projected volume of the grains drifts by 0.3 %.
    pub(crate) fn keep_volumes(&mut self, mesh: &Mesh, particles: &Particles) {
        let [area] = threads::sum(0..mesh.cells(), |cell| {
            [if mesh.solid[cell] { 0.0 } else { mesh.cell_volume(cell) }]
        });
        let [volume] = threads::sum(0..particles.len(), |p| [particles.volume[p]]);
        let void = self.fill.as_ref().map(Fill::void);
        let scale = if void.is_some() { 1.0 } else { area / volume };
        for m in (0..self.materials).filter(|&m| Some(m) != void) {
            let [projected, response] = threads::sum(0..mesh.cells(), |cell| {
                let (phi, area) = (self.fraction(cell, m), mesh.cell_volume(cell));
                // The fractions of a solid cell are zero.
                [area * phi, area * phi * (1.0 - phi)]
            });
            // Without cut cells, or with very few, there is no boundary to shift.
            if response > LEAST_RESPONSE * area {
                let missing = (particles.volume_of(m) * scale - projected) / response;
                let step = (VOLUME_GAIN * missing).clamp(-LARGEST_STEP, LARGEST_STEP);
                self.factors[m] = (self.factors[m] * step.exp()).clamp(0.5, 2.0);
            }
        }
    }
}

/// Content of a cell; `None` if it has neither particles nor a background material.
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
    } else if single && kinds[first as usize].flowing {
        Content::Flowing { material: first }
    } else {
        Content::Mixed
    })
}
