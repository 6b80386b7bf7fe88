//! This module finds the faces between cells that carry no wall, and the cells on both sides.

use super::mesh::Mesh;
use super::walls::Enclosure;

/// The neighbours of each cell across faces without walls, up to four per cell.
#[derive(Clone, Debug)]
pub struct Neighbours(Vec<Vec<u32>>);

impl Neighbours {
    /// Finds the neighbours of all cells.
    pub fn new(mesh: &Mesh, enclosure: &Enclosure) -> Self {
        let mut lists = vec![Vec::new(); mesh.cells()];
        for face in open_faces(mesh, enclosure) {
            let [a, b] = face.cells;
            lists[a as usize].push(b);
            lists[b as usize].push(a);
        }
        Neighbours(lists)
    }

    /// Neighbours of a cell.
    pub fn of(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        self.0[cell].iter().map(|&n| n as usize)
    }
}

/// A face without a wall.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// The cell to the left or below, and the other cell.
    pub cells: [u32; 2],
    /// Direction of the normal: 0 for x (vertical face), 1 for y (horizontal face).
    pub normal: usize,
}

/// All faces between cells that carry no wall.
pub fn open_faces(mesh: &Mesh, enclosure: &Enclosure) -> Vec<Face> {
    let mut faces = Vec::new();
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let (i, j) = mesh.cell_ij(cell);
        for normal in 0..2 {
            let (axis, _) = mesh.axes(normal);
            let [k, along] = if normal == 0 { [i, j] } else { [j, i] };
            let Some(next) = axis.after(k) else { continue };
            let other = mesh.cell_across(normal, next, along);
            let at = [axis.lines()[k + 1], axis.lines()[next]];
            let middle = mesh.cell_centre(cell)[1 - normal];
            let walled = enclosure.obstacles.iter().any(|o| {
                o.normal == normal && at.contains(&o.at) && middle > o.from && middle < o.to
            });
            if !walled && !mesh.solid[other] {
                faces.push(Face { cells: [cell as u32, other as u32], normal });
            }
        }
    }
    faces
}

/// The cells that are joined to a cell, itself first: `onwards` gives those joined to a cell directly. They are
/// marked in `seen`; cells that are marked already are left out.
pub fn joined<I: Iterator<Item = usize>>(
    first: usize,
    seen: &mut [bool],
    onwards: impl Fn(usize) -> I,
) -> Vec<usize> {
    let (mut list, mut next) = (vec![first], 0);
    seen[first] = true;
    while let Some(&cell) = list.get(next) {
        next += 1;
        for other in onwards(cell) {
            if !seen[other] {
                seen[other] = true;
                list.push(other);
            }
        }
    }
    list
}
