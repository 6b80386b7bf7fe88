//! Faces without walls, and which cells touch across them.

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

/// A face without walls, from the left or lower cell to the other.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    pub cells: [u32; 2],
    /// 0: the face is vertical; 1: horizontal.
    pub normal: usize,
    /// Coordinate of the face along its normal, as its two cells see it: they differ at the seam
    /// of a periodic axis.
    pub at: [f64; 2],
    /// Of its middle, along itself.
    pub middle: f64,
}

/// All faces without walls.
pub fn open_faces(mesh: &Mesh, enclosure: &Enclosure) -> Vec<Face> {
    let mut faces = Vec::new();
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let (i, j) = mesh.cell_ij(cell);
        for normal in 0..2 {
            let (axis, k) = if normal == 0 { (&mesh.x, i) } else { (&mesh.y, j) };
            let next = if k + 1 < axis.cells() {
                k + 1
            } else if axis.periodic() {
                0
            } else {
                continue;
            };
            let other = if normal == 0 { mesh.cell(next, j) } else { mesh.cell(i, next) };
            let at = [axis.lines()[k + 1], axis.lines()[next]];
            let middle = mesh.cell_centre(cell)[1 - normal];
            let walled = enclosure.obstacles.iter().any(|o| {
                o.normal == normal && at.contains(&o.at) && middle > o.from && middle < o.to
            });
            if !walled && !mesh.solid[other] {
                faces.push(Face { cells: [cell as u32, other as u32], normal, at, middle });
            }
        }
    }
    faces
}
