//! Which cells touch across faces without walls.

use super::balance::open_faces;
use super::mesh::Mesh;
use super::walls::Enclosure;

/// The up to four open neighbours of each cell.
#[derive(Clone, Debug)]
pub struct Neighbours(Vec<Vec<u32>>);

impl Neighbours {
    pub fn new(mesh: &Mesh, enclosure: &Enclosure) -> Self {
        let mut lists = vec![Vec::new(); mesh.cells()];
        for face in open_faces(mesh, enclosure) {
            let [a, b] = face.cells;
            lists[a as usize].push(b);
            lists[b as usize].push(a);
        }
        Neighbours(lists)
    }

    pub fn of(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        self.0[cell].iter().map(|&n| n as usize)
    }
}
