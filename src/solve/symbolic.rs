//! This module keeps the data that depend on the mesh alone, for the next run on the same mesh. The
//! explorer starts many runs on the same mesh, and the cases of a sweep share one too.

use super::multifrontal::tree::Tree;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use std::sync::{Arc, Mutex, PoisonError};

/// Largest number of meshes whose data are kept.
const KEPT: usize = 4;
/// Largest mesh, in cells, whose data are kept: they take hundreds of bytes per cell.
const MOST_CELLS: usize = 1 << 16;

/// Nodes of the cells, and the order in which unknowns are eliminated.
#[derive(Clone)]
pub struct Symbolic {
    /// Elimination tree of the multifrontal factorisation.
    pub tree: Arc<Tree>,
    /// Incidence of cells and nodes.
    pub incidence: Arc<Incidence>,
}

/// Meshes with their data, the most recently used first.
static KNOWN: Mutex<Vec<(Arc<Mesh>, Symbolic)>> = Mutex::new(Vec::new());

impl Symbolic {
    /// Computes the data of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        Symbolic { tree: Arc::new(Tree::new(mesh)), incidence: Arc::new(Incidence::new(mesh)) }
    }

    /// Returns the data kept for an equal mesh, or computes them.
    pub fn of(mesh: &Arc<Mesh>) -> Self {
        let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let remember = |mesh: Arc<Mesh>, symbolic: Symbolic| {
            let mut known = known();
            known.retain(|known| *known.0 != *mesh);
            known.insert(0, (mesh, symbolic));
            known.truncate(KEPT);
        };
        let found = known().iter().find(|known| *known.0 == **mesh).cloned();
        if let Some((mesh, symbolic)) = found {
            remember(mesh, symbolic.clone());
            return symbolic;
        }
        let symbolic = Symbolic::new(mesh);
        if mesh.cells() <= MOST_CELLS {
            remember(mesh.clone(), symbolic.clone());
        }
        symbolic
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::mesh::Axis;

    fn mesh(cells: usize) -> Arc<Mesh> {
        let axis = |n: usize| Axis::new((0..=n).map(|k| k as f64).collect(), false);
        Arc::new(Mesh::new(axis(cells), axis(7)))
    }

    #[test]
    fn equal_meshes_share_what_they_decide_and_others_do_not() {
        let first = Symbolic::of(&mesh(5));
        assert!(Arc::ptr_eq(&first.tree, &Symbolic::of(&mesh(5)).tree));
        let mut solid = (*mesh(5)).clone();
        solid.solid[3] = true;
        assert!(!Arc::ptr_eq(&first.tree, &Symbolic::of(&Arc::new(solid)).tree));
        assert!(!Arc::ptr_eq(&first.tree, &Symbolic::of(&mesh(6)).tree));
    }
}
