//! Which nodes a cell has, and which cells a node: what each cell computes for its nodes is added
//! up node by node, always in the order of the cells.

use super::mesh::Mesh;
use super::shape::NODES;
use crate::threads;

/// Nodes that are worth a task of their own.
const GRAIN: usize = 2048;

/// Cells and nodes of a mesh.
pub struct Incidence {
    /// The nine nodes of every cell: finding them takes divisions.
    pub nodes: Vec<[usize; NODES]>,
    /// Where each node's entries start.
    start: Vec<u32>,
    /// `NODES cell + local node`, by node, cells ascending.
    entries: Vec<u32>,
}

impl Incidence {
    /// Solid cells have nodes, but nodes do not have them.
    pub fn new(mesh: &Mesh) -> Self {
        let nodes: Vec<[usize; NODES]> = (0..mesh.cells()).map(|c| mesh.cell_nodes(c)).collect();
        let used = || (0..mesh.cells()).filter(|&c| !mesh.solid[c]);
        let mut start = vec![0; mesh.nodes() + 1];
        used().flat_map(|c| nodes[c]).for_each(|n| start[n + 1] += 1);
        for n in 0..mesh.nodes() {
            start[n + 1] += start[n];
        }
        let mut next = start.clone();
        let mut entries = vec![0; start[mesh.nodes()] as usize];
        for cell in used() {
            for (a, &n) in nodes[cell].iter().enumerate() {
                entries[next[n] as usize] = (NODES * cell + a) as u32;
                next[n] += 1;
            }
        }
        Incidence { nodes, start, entries }
    }

    /// Cells of a node, and which of their nodes it is.
    pub fn of_node(&self, node: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let range = self.start[node] as usize..self.start[node + 1] as usize;
        self.entries[range].iter().map(|&e| (e as usize / NODES, e as usize % NODES))
    }

    /// Adds to each node what its cells have for it: `of(cell, local node)`.
    pub fn add_up<const D: usize>(
        &self,
        total: &mut [[f64; D]],
        of: impl Fn(usize, usize) -> [f64; D] + Sync,
    ) {
        threads::for_each(total, GRAIN, |node, total| {
            for (cell, a) in self.of_node(node) {
                let value = of(cell, a);
                (0..D).for_each(|c| total[c] += value[c]);
            }
        });
    }
}
