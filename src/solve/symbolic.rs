//! What a mesh alone decides, kept for the next run on it: the explorer starts runs again and again on
//! the same mesh, and a sweep of cases shares one too.

use super::multifrontal::tree::Tree;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use std::sync::{Arc, Mutex, PoisonError};

/// Meshes that are remembered.
const KEPT: usize = 4;
/// Larger ones are not: what they decide takes hundreds of bytes a cell.
const MOST_CELLS: usize = 1 << 16;

/// Which nodes cells have, and in which order unknowns are eliminated.
#[derive(Clone)]
pub struct Symbolic {
    pub tree: Arc<Tree>,
    pub incidence: Arc<Incidence>,
}

/// The latest first.
static KNOWN: Mutex<Vec<(Arc<Mesh>, Symbolic)>> = Mutex::new(Vec::new());

impl Symbolic {
    pub fn new(mesh: &Mesh) -> Self {
        Symbolic { tree: Arc::new(Tree::new(mesh)), incidence: Arc::new(Incidence::new(mesh)) }
    }

    /// That of an equal mesh, if one is remembered.
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
