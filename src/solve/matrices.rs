//! This module computes the element matrices of all cells, again only for cells that changed.

use super::element::{
    CellBlocks, Centre, LOCAL, Matrix, Nodal, PointShape, condense, embed, mirror, pair,
};
use super::loose::{Loose, stiffness};
use super::quadrature::Quadrature;
use super::terms::pressure::Divergence;
use super::terms::rotation::RotationModes;
use super::terms::stress::add_stiffness;
use super::terms::viscous::add_cut_stiffness;
use super::terms::{FaceTerm, Terms};
use crate::composition::Content;
use crate::space::constraints::Constraints;
use crate::space::embedding::CellMap;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use crate::space::shape::{CENTRE, NODES, SIDE_NODES};
use crate::threads;

/// Penalty `r` of the augmented Lagrangian in units of the viscosity of the cell.
const PENALTY: f64 = 1e6;

/// The same for cells whose viscosity depends on the flow: their iteration reduces the divergence
/// further in each step, and a smaller penalty leaves more digits for thin fluid next to them. Also for
/// cells that a material fills in part: of a sliver, a larger penalty leaves fewer digits.
const FLOWING_PENALTY: f64 = 1e4;

/// Largest number of cells per task.
const GRAIN: usize = 16;

/// Data of a cell that the corrections need besides its blocks.
#[derive(Clone, Copy)]
pub struct CellMatrix<const D: usize> {
    /// Data that recover the condensed centre node.
    pub centre: Centre<D>,
    /// Diagonal of the element matrix without the penalty.
    pub diagonal: Nodal<D>,
    /// `W = (C + Mp / (r eta))^-1`, for the pressures `1, xi, eta`; zero for those that are given.
    pub penalty: [f64; 3],
}

/// The matrices of all cells.
pub struct Matrices<const D: usize> {
    /// Data of each cell for the corrections.
    pub cells: Vec<CellMatrix<D>>,
    /// Blocks of each cell on the skeleton, with the centre condensed and all terms added; these
    /// are factored.
    pub blocks: Vec<CellBlocks<D>>,
    /// Projected coupling of the cells whose coupling viscosity exceeds the shear viscosity.
    pub rotation: Vec<Option<Box<RotationModes>>>,
    /// Content that the matrix of each cell was computed for.
    built_from: Vec<Content>,
    /// [`Terms::stamp`] that the matrices were computed with.
    stamp: u64,
    /// Matrices computed in the last update, in ascending order of the cells.
    fresh: Vec<Fresh<D>>,
}

/// A newly computed matrix of a cell.
struct Fresh<const D: usize> {
    cell: usize,
    matrix: CellMatrix<D>,
    blocks: CellBlocks<D>,
    rotation: Option<Box<RotationModes>>,
}

/// Inputs of the element matrices.
#[derive(Clone, Copy)]
pub struct Ingredients<'a, const D: usize> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Incidence of cells and nodes.
    pub incidence: &'a Incidence,
    /// Boundary conditions.
    pub constraints: &'a Constraints<D>,
    /// Integration points with their laws.
    pub quadrature: &'a Quadrature,
    /// Terms that only some scenes have.
    pub terms: &'a Terms,
    /// Cells that may change their volume.
    pub loose: &'a Loose,
}

impl<'a, const D: usize> Ingredients<'a, D> {
    /// Terms on faces, of the scene and of walls along which material slips.
    fn terms_on_faces(&self) -> impl Iterator<Item = &'a dyn FaceTerm> + use<'a, D> {
        self.terms.on_faces().chain([self.quadrature.slip() as &dyn FaceTerm])
    }

    /// Map from the unknowns of a cell to its velocities, if they differ.
    fn map(&self, cell: usize) -> Option<&'a CellMap> {
        self.constraints.embedding()?.of_cell(cell)
    }

    /// Adds the terms on the faces of a cell to the matrix of its velocities, in the blocks of
    /// components on and below the diagonal.
    fn add_faces(&self, cell: usize, k: &mut Matrix) {
        for term in self.terms_on_faces() {
            let faces = term.faces();
            let first = faces.partition_point(|face| face.cell < cell);
            let own = faces[first..].iter().take_while(|face| face.cell == cell);
            for (index, face) in (first..).zip(own) {
                let nodes = SIDE_NODES[face.side];
                for (i, &a) in nodes.iter().enumerate() {
                    for (j, &b) in nodes.iter().enumerate() {
                        for [c, d] in [[0, 0], [1, 0], [1, 1]] {
                            k[NODES * c + a][NODES * d + b] += term.entry(index, [i, j], [c, d]);
                        }
                    }
                }
            }
        }
    }
}

impl<const D: usize> CellMatrix<D> {
    const ZERO: Self = CellMatrix {
        centre: Centre { inverse: [[0.0; D]; D], coupling: [[[0.0; D]; D]; 8] },
        diagonal: [[0.0; D]; NODES],
        penalty: [0.0; 3],
    };

    fn set_diagonal(&mut self, k: &Matrix) {
        for a in 0..NODES {
            for c in 0..D {
                self.diagonal[a][c] = k[NODES * c + a][NODES * c + a];
            }
        }
    }
}

impl<const D: usize> Matrices<D> {
    const NO_BLOCKS: CellBlocks<D> = [[[0.0; D]; D]; 36];

    /// Creates zero matrices for a number of cells; the first update computes all of them.
    pub fn new(cells: usize) -> Self {
        Matrices {
            cells: vec![CellMatrix::ZERO; cells],
            blocks: vec![Self::NO_BLOCKS; cells],
            rotation: (0..cells).map(|_| None).collect(),
            built_from: vec![Content::Unknown; cells],
            stamp: 0,
            fresh: vec![],
        }
    }

    /// Computes the matrices of the cells whose content changed, and calls `changed` for each cell
    /// whose blocks differ in any bit from the previous ones.
    pub fn update(&mut self, from: Ingredients<D>, mut changed: impl FnMut(usize)) {
        self.fresh.clear();
        if self.stamp != from.terms.stamp() {
            self.stamp = from.terms.stamp();
            self.built_from.fill(Content::Unknown);
        }
        // Terms on faces are not part of the content: cells with such a term are always computed.
        let faces = || from.terms_on_faces().flat_map(|t| t.faces());
        let outlines = from.quadrature.slip_outlines();
        faces().for_each(|face| self.built_from[face.cell] = Content::Unknown);
        outlines.cells().iter().for_each(|&cell| self.built_from[cell] = Content::Unknown);
        for (cell, built_from) in self.built_from.iter_mut().enumerate() {
            let content = from.quadrature.content(cell);
            if content == Content::Empty && *built_from != Content::Empty {
                *built_from = content;
                self.blocks[cell] = Self::NO_BLOCKS;
                changed(cell);
            }
            // The penalty of a cell with a solid in it depends on its neighbours.
            let alone = from.mesh.part(cell).is_none() && !from.loose.contains(cell);
            let known = content.is_constant() && content == *built_from && alone;
            if !matches!(content, Content::Solid | Content::Empty) && !known {
                let blocks = Self::NO_BLOCKS;
                let matrix = CellMatrix::ZERO;
                let rotation = self.rotation[cell].take();
                self.fresh.push(Fresh { cell, matrix, blocks, rotation });
                *built_from = content;
            }
        }
        threads::for_each(&mut self.fresh, GRAIN, |_, fresh| fresh.build(from));
        faces().for_each(|face| self.built_from[face.cell] = Content::Unknown);
        for term in from.terms_on_faces() {
            for (index, face) in term.faces().iter().enumerate() {
                if from.map(face.cell).is_some() {
                    continue;
                }
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
    /// Computes the matrix of the cell, without the terms on faces unless it has a map: those act on
    /// velocities, not on its unknowns.
    fn build(&mut self, from: Ingredients<D>) {
        let Ingredients { mesh, incidence, constraints, quadrature, terms, loose } = from;
        let cell = self.cell;
        let measure = mesh.cell_measure(cell);
        let size = measure.size;
        let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
        let cut = quadrature.cut(cell);
        // Viscosity that a stiff rotation adds to a flow that varies over the size of the cell.
        let (mut turning, thickness) = (0.0, size[0].min(size[1]));
        quadrature.for_points(cell, |p, shape| {
            let law = p.law.without_excess();
            let law = cut.map_or(law, |cut| law.with_viscosity_scaled(cut.rest));
            add_stiffness::<D>(
                &mut k,
                &PointShape::new(shape, measure, p.r[0]),
                &law,
                measure.of_share(p.weight),
            );
            turning += p.weight * p.law.turning_viscosity(thickness);
        });
        if let Some(cut) = cut {
            add_cut_stiffness(&mut k, cut);
        }
        for (softening, q) in quadrature.softening(cell) {
            softening.add_stiffness::<D>(q, &mut k, measure);
        }
        // Reuse the memory of the previous modes.
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
            for i in 0..term.components().min(D) * NODES {
                for j in 0..NODES * (i / NODES + 1) {
                    let (nodes, components) = ([i % NODES, j % NODES], [i / NODES, j / NODES]);
                    k[i][j] += term.entry(cell, nodes, components);
                }
            }
        }
        quadrature.slip_outlines().add_stiffness(cell, &mut k);
        let divergence = Divergence::new(mesh, quadrature, cell);
        let mass = divergence.mass(measure);
        let viscosity = stiffness(mesh, quadrature, cell)
            + if D == 3 { turning } else { 0.0 }
            + terms.inertia.resistance(cell, measure.volume(), size[0].max(size[1]));
        let soft = quadrature.flows(cell) || divergence.is_of_filled_part();
        let penalty = if soft { FLOWING_PENALTY } else { PENALTY };
        let compliance = 1.0 / (penalty * viscosity)
            + quadrature.compliance[cell]
            + loose.compliance(mesh, quadrature, cell);
        self.matrix.penalty = mass.map(|m| 1.0 / (m * compliance));
        for (penalty, unknown) in self.matrix.penalty.iter_mut().zip(divergence.unknown()) {
            if !unknown {
                *penalty = 0.0;
            }
        }
        let map = from.map(cell);
        if let Some(map) = map {
            from.add_faces(cell, &mut k);
            // Where all velocities are given, no pressure can change their divergence.
            let free =
                |a: usize| (0..2).any(|c| !constraints.is_fixed(incidence.nodes[cell][a], c));
            if !(0..NODES).any(free) {
                self.matrix.penalty = [0.0; 3];
            }
            let mut free = k;
            mirror::<D>(&mut free);
            embed::<D>(&mut free, map);
            self.matrix.set_diagonal(&free);
        } else {
            self.matrix.set_diagonal(&k);
        }
        divergence.add_penalty(&self.matrix.penalty, &mut k);
        mirror::<D>(&mut k);
        if let Some(map) = map {
            embed::<D>(&mut k, map);
            (0..2 * NODES).for_each(|i| k[i][i] *= 1.0 + loose.guard());
        }
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

    /// Adds a term on a face; all nodes of a face are on the skeleton.
    fn add_face(&mut self, from: Ingredients<D>, term: &dyn FaceTerm, index: usize) {
        let face = term.faces()[index];
        let nodes = &from.incidence.nodes[face.cell];
        for (k, &a) in SIDE_NODES[face.side].iter().enumerate() {
            for c in 0..2 {
                self.matrix.diagonal[a][c] += term.entry(index, [k, k], [c, c]);
            }
            for (l, &b) in SIDE_NODES[face.side].iter().enumerate().take(k + 1) {
                // Indices among the local nodes without the centre.
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
