//! This module determines the nodes of the materials of interest: all materials except the
//! background. Their motion determines the time step; the background, which fills the space around
//! them, and grains that came loose only divide the transport of a step into parts.

use crate::composition::Composition;
use crate::space::mesh::Mesh;
use crate::space::shape::CENTRE;

/// Smallest share of the materials of interest in a cell that counts.
const SHARE: f64 = 0.5;

/// Centre nodes of the cells in which the materials of interest predominate. Other nodes of these
/// cells may move with the background.
#[derive(Default)]
pub(super) struct Interest {
    nodes: Vec<bool>,
}

impl Interest {
    /// Determines the nodes; those of the cells into which materials of interest enter count too. If
    /// no cell counts (all materials of interest are smaller than a cell, or there are none), all
    /// nodes count.
    pub(super) fn update(
        &mut self,
        mesh: &Mesh,
        of: &Composition,
        background: Option<u8>,
        entering: impl Iterator<Item = usize>,
    ) {
        self.nodes.clear();
        let Some(background) = background else { return self.nodes.resize(mesh.nodes(), true) };
        self.nodes.resize(mesh.nodes(), false);
        let counts = |&cell: &usize| {
            !mesh.solid[cell] && of.fraction(cell, usize::from(background)) <= 1.0 - SHARE
        };
        for cell in (0..mesh.cells()).filter(counts) {
            self.nodes[mesh.cell_nodes(cell)[CENTRE]] = true;
        }
        for node in entering.flat_map(|cell| mesh.cell_nodes(cell)) {
            self.nodes[node] = true;
        }
        if !self.nodes.contains(&true) {
            self.nodes.fill(true);
        }
    }

    /// Whether a node belongs to the materials of interest.
    pub(super) fn contains(&self, node: usize) -> bool {
        self.nodes[node]
    }
}
