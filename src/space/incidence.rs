//! This module lists the nodes of each cell and the cells of each node. Contributions of cells to
//! their nodes are summed node by node, always in the order of the cells.

use super::mesh::Mesh;
use super::shape::NODES;
use crate::threads;

/// Largest number of nodes per task.
const GRAIN: usize = 2048;

/// Incidence of cells and nodes of a mesh.
pub struct Incidence {
    /// The nine nodes of every cell, stored because computing them takes divisions.
    pub nodes: Vec<[usize; NODES]>,
    /// Index of the first entry of each node.
    start: Vec<u32>,
    /// Entries `NODES cell + local node`, sorted by node, then by cell.
    entries: Vec<u32>,
}

impl Incidence {
    /// Finds the nodes of all cells and the cells of all nodes; solid cells are not among the
    /// latter.
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

    /// Cells of a node, each with the local number of the node in the cell.
    pub fn of_node(&self, node: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let range = self.start[node] as usize..self.start[node + 1] as usize;
        self.entries[range].iter().map(|&e| (e as usize / NODES, e as usize % NODES))
    }

    /// Adds the contributions `of(cell, local node)` of its cells to each node of `total`.
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
