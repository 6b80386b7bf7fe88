//! Element matrices of all cells, computed again only where something changed.

use super::element::{
    CellBlocks, Centre, LOCAL, Matrix, Nodal, PointShape, condense, mirror, pair,
};
use super::quadrature::Quadrature;
use super::terms::pressure::Divergence;
use super::terms::rotation::RotationModes;
use super::terms::viscous::{add_cut_stiffness, add_stiffness};
use super::terms::{FaceTerm, Terms};
use crate::composition::Content;
use crate::space::constraints::Constraints;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use crate::space::shape::{CENTRE, NODES, SIDE_NODES};
use crate::threads;

/// Penalty `r` of the augmented Lagrangian in units of the cell's viscosity.
const PENALTY: f64 = 1e6;

/// Cells that are worth a task of their own.
const GRAIN: usize = 16;

/// What the corrections need of a cell besides its blocks.
#[derive(Clone, Copy)]
pub struct CellMatrix<const D: usize> {
    pub centre: Centre<D>,
    /// Of the matrix without the penalty.
    pub diagonal: Nodal<D>,
    /// `W = (C + Mp / (r eta))^-1`
    pub penalty: [f64; 3],
}

/// The matrices of all cells.
pub struct Matrices<const D: usize> {
    pub cells: Vec<CellMatrix<D>>,
    /// Of the skeleton, centres condensed and all terms added: what is factored.
    pub blocks: Vec<CellBlocks<D>>,
    /// Of cells whose coupling exceeds their shear viscosity.
    pub rotation: Vec<Option<Box<RotationModes>>>,
    built_from: Vec<Content>,
    /// Those that were computed at the last update.
    fresh: Vec<Fresh<D>>,
}

struct Fresh<const D: usize> {
    cell: usize,
    matrix: CellMatrix<D>,
    blocks: CellBlocks<D>,
    rotation: Option<Box<RotationModes>>,
}

/// What matrices are made from.
#[derive(Clone, Copy)]
pub struct Ingredients<'a, const D: usize> {
    pub mesh: &'a Mesh,
    pub incidence: &'a Incidence,
    pub constraints: &'a Constraints<D>,
    pub quadrature: &'a Quadrature,
    pub terms: &'a Terms,
}

impl<const D: usize> CellMatrix<D> {
    const ZERO: Self = CellMatrix {
        centre: Centre { inverse: [[0.0; D]; D], coupling: [[[0.0; D]; D]; 8] },
        diagonal: [[0.0; D]; NODES],
        penalty: [0.0; 3],
    };
}

impl<const D: usize> Matrices<D> {
    const NO_BLOCKS: CellBlocks<D> = [[[0.0; D]; D]; 36];

    pub fn new(cells: usize) -> Self {
        Matrices {
            cells: vec![CellMatrix::ZERO; cells],
            blocks: vec![Self::NO_BLOCKS; cells],
            rotation: (0..cells).map(|_| None).collect(),
            built_from: vec![Content::Unknown; cells],
            fresh: vec![],
        }
    }

    /// Computes the matrices of cells whose content changed, and calls `changed` for those that
    /// are not, bit for bit, what they were.
    pub fn update(&mut self, from: Ingredients<D>, mut changed: impl FnMut(usize)) {
        self.fresh.clear();
        // Terms of faces come on top of what the content says.
        let faces = || from.terms.on_faces().flat_map(|t| t.faces());
        faces().for_each(|face| self.built_from[face.cell] = Content::Unknown);
        for (cell, built_from) in self.built_from.iter_mut().enumerate() {
            let content = from.quadrature.content(cell);
            let known = content != Content::Mixed && content == *built_from;
            if content != Content::Solid && !known {
                let blocks = Self::NO_BLOCKS;
                let matrix = CellMatrix::ZERO;
                let rotation = self.rotation[cell].take();
                self.fresh.push(Fresh { cell, matrix, blocks, rotation });
                *built_from = content;
            }
        }
        threads::for_each(&mut self.fresh, GRAIN, |_, fresh| fresh.build(from));
        faces().for_each(|face| self.built_from[face.cell] = Content::Unknown);
        for term in from.terms.on_faces() {
            for (index, face) in term.faces().iter().enumerate() {
                if let Ok(k) = self.fresh.binary_search_by_key(&face.cell, |f| f.cell) {
                    self.fresh[k].add_face(from, term, index);
                }
            }
        }
        for fresh in &mut self.fresh {
            self.cells[fresh.cell] = fresh.matrix;
            self.rotation[fresh.cell] = fresh.rotation.take();
            let before = &mut self.blocks[fresh.cell];
            let bits = |b: &CellBlocks<D>, k: usize| b[k].map(|row| row.map(f64::to_bits));
            if (0..before.len()).any(|k| bits(before, k) != bits(&fresh.blocks, k)) {
                *before = fresh.blocks;
                changed(fresh.cell);
            }
        }
    }
}

impl<const D: usize> Fresh<D> {
    fn build(&mut self, from: Ingredients<D>) {
        let Ingredients { mesh, incidence, constraints, quadrature, terms } = from;
        let cell = self.cell;
        let measure = mesh.cell_measure(cell);
        let size = measure.size;
        let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
        let cut = quadrature.cut(cell);
        // What a stiff rotation adds to the viscosity of a flow on the scale of the cell.
        let (mut turning, thickness) = (0.0, size[0].min(size[1]));
        quadrature.for_points(cell, |p, shape| {
            let law = p.law.without_excess();
            let law = cut.map_or(law, |cut| law.with_viscosity_scaled(cut.rest));
            add_stiffness::<D>(
                &mut k,
                &PointShape::new(shape, size),
                &law,
                measure.of_point(p.weight),
            );
            turning += p.weight * p.law.turning_viscosity(thickness);
        });
        if let Some(cut) = cut {
            add_cut_stiffness(&mut k, cut);
        }
        // In the room of those before.
        let before = self.rotation.take();
        if D == 3
            && let Some(modes) = RotationModes::new(quadrature, cell, measure)
        {
            modes.add_stiffness(&mut k);
            let mut rotation = before.unwrap_or_default();
            *rotation = modes;
            self.rotation = Some(rotation);
        }
        for term in terms.on_cells().into_iter().filter(|t| t.acts_on(cell)) {
            for i in 0..2 * NODES {
                for j in 0..NODES * (i / NODES + 1) {
                    let (nodes, components) = ([i % NODES, j % NODES], [i / NODES, j / NODES]);
                    k[i][j] += term.entry(cell, nodes, components);
                }
            }
        }
        let mass = measure.pressure_mass();
        let viscosity = quadrature.mean_viscosity[cell] + if D == 3 { turning } else { 0.0 };
        let compliance = 1.0 / (PENALTY * viscosity) + quadrature.compliance[cell];
        self.matrix.penalty = mass.map(|m| 1.0 / (m * compliance));
        for a in 0..NODES {
            for c in 0..D {
                self.matrix.diagonal[a][c] = k[NODES * c + a][NODES * c + a];
            }
        }
        Divergence::new(measure).add_penalty(&self.matrix.penalty, &mut k);
        mirror::<D>(&mut k);
        for (a, node) in incidence.nodes[cell].into_iter().enumerate() {
            for c in 0..D {
                if constraints.is_fixed(node, c) {
                    let i = NODES * c + a;
                    k[i].fill(0.0);
                    k.iter_mut().for_each(|row| row[i] = 0.0);
                }
            }
        }
        (self.blocks, self.matrix.centre) = condense(&k);
    }

    /// Adds the term of a face, whose nodes the skeleton has all.
    fn add_face(&mut self, from: Ingredients<D>, term: &dyn FaceTerm, index: usize) {
        let face = term.faces()[index];
        let nodes = &from.incidence.nodes[face.cell];
        for (k, &a) in SIDE_NODES[face.side].iter().enumerate() {
            for c in 0..2 {
                self.matrix.diagonal[a][c] += term.entry(index, [k, k], [c, c]);
            }
            for (l, &b) in SIDE_NODES[face.side].iter().enumerate().take(k + 1) {
                // Local nodes without the centre.
                let [i, j] = [a, b].map(|n| n - usize::from(n > CENTRE));
                let block = &mut self.blocks[pair(i, j)];
                for r in 0..2 {
                    for c in 0..2 {
                        let fixed = [(a, r), (b, c)].map(|(n, c)| (nodes[n], c));
                        if !fixed.iter().any(|&(n, c)| from.constraints.is_fixed(n, c)) {
                            block[r][c] += term.entry(index, [k, l], [r, c]);
                        }
                    }
                }
            }
        }
    }
}
