//! This module computes the nested dissection of a mesh: a binary tree of rectangles of cells, and
//! the nodes that each rectangle eliminates.
//!
//! A rectangle is halved across its longer side until few cells are left (nested dissection; George
//! 1973). The *front* of a rectangle is its part of the factorisation. It eliminates its *own*
//! nodes, those that no cell outside the rectangle touches and no smaller rectangle has eliminated.
//! The result is a dense matrix on its *rim*, the nodes that it shares with the rest of the mesh
//! (Duff and Reid 1983). The nodes at the centres of cells are condensed before and are not part of
//! the tree; nodes that only solid cells touch are not part of it either.

use super::super::element::SKELETON_NODES;
use crate::space::mesh::Mesh;

/// Largest side, in cells, of a rectangle that is not halved.
const LEAF_CELLS: usize = 2;

/// Position of a node that is not eliminated.
pub const NO_POSITION: u32 = u32::MAX;

/// Fronts in postorder: the subtree of front `f` is `f + 1 - fronts[f].subtree ..= f`.
#[derive(Debug)]
pub struct Tree {
    /// The fronts.
    pub fronts: Vec<Front>,
    /// Parent of each front; `None` for the root.
    pub parent: Vec<Option<usize>>,
    /// Mesh node of each position of the elimination order.
    pub node: Vec<u32>,
    /// Position of each mesh node, or `NO_POSITION`.
    pub position: Vec<u32>,
}

/// Elimination step of one rectangle. The rows of its matrix are its own nodes, then its rim.
#[derive(Debug)]
pub struct Front {
    /// Position of the first own node; the other own nodes follow it.
    pub first: u32,
    /// Number of own nodes.
    pub own: u32,
    /// Positions of the nodes on the rim, ascending.
    pub rim: Vec<u32>,
    /// Matrices that the front is assembled from.
    pub source: Source,
    /// Number of fronts of the subtree, including this one.
    pub subtree: u32,
    /// Number of cells of the longer side.
    pub side: u32,
}

/// Matrices that a front is assembled from.
#[derive(Debug)]
pub enum Source {
    /// Element matrices of cells.
    Cells(Vec<LeafCell>),
    /// Updates of two children, each with the positions of its rim among this front's nodes.
    Children([Vec<Run>; 2]),
}

/// A cell and the positions of its eight skeleton nodes in the front.
#[derive(Debug)]
pub struct LeafCell {
    /// Index of the cell.
    pub cell: u32,
    /// Index of each node in the front.
    pub nodes: [u16; 8],
}

/// Nodes `child..child + len` of a child's rim are nodes `parent..parent + len` of the front.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// First node in the child's rim.
    pub child: u32,
    /// First node in the front.
    pub parent: u32,
    /// Number of nodes.
    pub len: u32,
}

impl Front {
    /// Number of nodes of the front.
    pub fn nodes(&self) -> usize {
        self.own as usize + self.rim.len()
    }

    /// Index in the front of the node with this position.
    fn index_of(&self, position: u32) -> u32 {
        if position < self.first + self.own {
            position - self.first
        } else {
            self.own + self.rim.partition_point(|&p| p < position) as u32
        }
    }
}

impl Tree {
    /// Computes the dissection of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let mut build = Build {
            mesh,
            incidences: incidences(mesh),
            tree: Tree {
                fronts: vec![],
                parent: vec![],
                node: vec![],
                position: vec![NO_POSITION; mesh.nodes()],
            },
        };
        let whole = Rectangle { i: [0, mesh.x.cells()], j: [0, mesh.y.cells()] };
        build.dissect(whole);
        let mut tree = build.tree;
        tree.number_rims(mesh);
        tree.parent = vec![None; tree.fronts.len()];
        for f in 0..tree.fronts.len() {
            if let Source::Children(_) = tree.fronts[f].source {
                tree.children(f).into_iter().for_each(|child| tree.parent[child] = Some(f));
            }
        }
        tree
    }

    /// Number of nodes that are eliminated.
    pub fn len(&self) -> usize {
        self.node.len()
    }

    /// Whether no node is eliminated.
    pub fn is_empty(&self) -> bool {
        self.node.is_empty()
    }

    /// The two children of a front that is not a leaf.
    pub fn children(&self, front: usize) -> [usize; 2] {
        let right = front - 1;
        [right - self.fronts[right].subtree as usize, right]
    }

    /// First front of a subtree.
    pub fn first_of(&self, front: usize) -> usize {
        front + 1 - self.fronts[front].subtree as usize
    }

    /// Replaces mesh nodes by positions in the rims; the positions are known only when the tree is
    /// complete.
    fn number_rims(&mut self, mesh: &Mesh) {
        for front in &mut self.fronts {
            front.rim.iter_mut().for_each(|n| *n = self.position[*n as usize]);
            front.rim.sort_unstable();
        }
        for f in 0..self.fronts.len() {
            match &self.fronts[f].source {
                Source::Cells(_) => self.locate_cells(mesh, f),
                Source::Children(_) => {
                    let runs = self.children(f).map(|child| self.runs(child, f));
                    self.fronts[f].source = Source::Children(runs);
                }
            }
        }
    }

    /// Finds the positions of the nodes of the cells of a leaf.
    fn locate_cells(&mut self, mesh: &Mesh, f: usize) {
        let (front, position) = (&self.fronts[f], &self.position);
        let locate = |c: &LeafCell| {
            let nodes = mesh.cell_nodes(c.cell as usize);
            let index = |a: usize| front.index_of(position[nodes[a]]) as u16;
            LeafCell { cell: c.cell, nodes: SKELETON_NODES.map(index) }
        };
        if let Source::Cells(cells) = &front.source {
            self.fronts[f].source = Source::Cells(cells.iter().map(locate).collect());
        }
    }

    /// Runs of nodes of a child's rim in its parent.
    fn runs(&self, child: usize, parent: usize) -> Vec<Run> {
        let front = &self.fronts[parent];
        let mut runs: Vec<Run> = Vec::new();
        for (k, &position) in self.fronts[child].rim.iter().enumerate() {
            let (child, parent) = (k as u32, front.index_of(position));
            match runs.last_mut() {
                Some(r) if r.parent + r.len == parent => r.len += 1,
                _ => runs.push(Run { child, parent, len: 1 }),
            }
        }
        runs
    }
}

/// A rectangle of cells: ranges of columns and rows, ends excluded.
#[derive(Clone, Copy)]
struct Rectangle {
    i: [usize; 2],
    j: [usize; 2],
}

impl Rectangle {
    /// The two halves of the rectangle; `None` if it is a leaf.
    fn halves(self) -> Option<[Rectangle; 2]> {
        let half = |[a, b]: [usize; 2]| {
            // The middle is a multiple of the leaf's size from the start, so only the other end has
            // odd leaves.
            let middle = a + (b - a).div_ceil(2).next_multiple_of(LEAF_CELLS);
            [[a, middle], [middle, b]]
        };
        let (wide, high) = (self.i[1] - self.i[0], self.j[1] - self.j[0]);
        if wide.max(high) <= LEAF_CELLS {
            None
        } else if wide >= high {
            Some(half(self.i).map(|i| Rectangle { i, ..self }))
        } else {
            Some(half(self.j).map(|j| Rectangle { j, ..self }))
        }
    }
}

/// A node that cells outside the rectangle may touch, and the number of times that cells inside
/// touch it.
type Open = (u32, u32);

struct Build<'a> {
    mesh: &'a Mesh,
    /// Number of times that cells touch each node.
    incidences: Vec<u32>,
    tree: Tree,
}

impl Build<'_> {
    /// Appends the fronts of a rectangle; returns the nodes on its rim, or `None` if all its cells
    /// are solid.
    fn dissect(&mut self, r: Rectangle) -> Option<Vec<Open>> {
        let start = self.tree.fronts.len();
        let (open, source) = match r.halves() {
            None => self.leaf(r)?,
            Some(halves) => match halves.map(|half| self.dissect(half)) {
                [Some(a), Some(b)] => (merge(a, b), Source::Children([vec![], vec![]])),
                [one, other] => return one.or(other),
            },
        };
        let (own, rim): (Vec<Open>, Vec<Open>) =
            open.into_iter().partition(|&(n, count)| count == self.incidences[n as usize]);
        let first = self.tree.node.len() as u32;
        for &(n, _) in &own {
            self.tree.position[n as usize] = self.tree.node.len() as u32;
            self.tree.node.push(n);
        }
        self.tree.fronts.push(Front {
            first,
            own: own.len() as u32,
            rim: rim.iter().map(|&(n, _)| n).collect(),
            source,
            subtree: (self.tree.fronts.len() + 1 - start) as u32,
            side: (r.i[1] - r.i[0]).max(r.j[1] - r.j[0]) as u32,
        });
        Some(rim)
    }

    /// Nodes and cells of a leaf; `None` if all its cells are solid.
    fn leaf(&self, r: Rectangle) -> Option<(Vec<Open>, Source)> {
        let mesh = self.mesh;
        let all = (r.j[0]..r.j[1]).flat_map(|j| (r.i[0]..r.i[1]).map(move |i| mesh.cell(i, j)));
        let cells: Vec<usize> = all.filter(|&c| !mesh.solid[c]).collect();
        if cells.is_empty() {
            return None;
        }
        let touched = cells.iter().flat_map(|&c| skeleton_nodes(mesh, c)).map(|n| (n, 1));
        let nodes = merge(touched.collect(), vec![]);
        let cells = cells.iter().map(|&c| LeafCell { cell: c as u32, nodes: [0; 8] }).collect();
        Some((nodes, Source::Cells(cells)))
    }
}

fn skeleton_nodes(mesh: &Mesh, cell: usize) -> [u32; 8] {
    let nodes = mesh.cell_nodes(cell);
    SKELETON_NODES.map(|a| nodes[a] as u32)
}

/// Number of times that cells touch each node.
fn incidences(mesh: &Mesh) -> Vec<u32> {
    let mut count = vec![0; mesh.nodes()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        skeleton_nodes(mesh, cell).into_iter().for_each(|n| count[n as usize] += 1);
    }
    count
}

/// Merges two lists by node and adds the counts.
fn merge(mut a: Vec<Open>, b: Vec<Open>) -> Vec<Open> {
    a.extend(b);
    a.sort_unstable();
    a.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::mesh::Axis;

    fn uniform(n: usize, periodic: bool) -> Axis {
        Axis::new((0..=n).map(|i| i as f64).collect(), periodic)
    }

    fn trees() -> impl Iterator<Item = (Mesh, Tree)> {
        let sizes = [(1, 1, false, false), (5, 3, false, false), (8, 9, true, false)];
        sizes.into_iter().chain([(4, 6, true, true), (13, 2, false, true)]).map(
            |(nx, ny, px, py)| {
                let mut mesh = Mesh::new(uniform(nx, px), uniform(ny, py));
                if nx > 4 {
                    (0..4).for_each(|c| mesh.solid[c] = true);
                }
                let tree = Tree::new(&mesh);
                (mesh, tree)
            },
        )
    }

    #[test]
    fn every_node_of_the_skeleton_is_eliminated_once() {
        for (mesh, tree) in trees() {
            let mut touched: Vec<u32> = (0..mesh.cells())
                .filter(|&c| !mesh.solid[c])
                .flat_map(|c| skeleton_nodes(&mesh, c))
                .collect();
            touched.sort_unstable();
            touched.dedup();
            let mut eliminated = tree.node.clone();
            eliminated.sort_unstable();
            assert_eq!(touched, eliminated);
        }
    }

    #[test]
    fn a_rim_is_eliminated_later_and_has_its_place_in_the_parent() {
        for (mesh, tree) in trees() {
            assert_eq!(tree.first_of(tree.fronts.len() - 1), 0);
            for (f, front) in tree.fronts.iter().enumerate() {
                let end = front.first + front.own;
                assert!(front.rim.iter().all(|&p| p >= end && p != NO_POSITION));
                let at = |k: u32| match k.checked_sub(front.own) {
                    None => front.first + k,
                    Some(k) => front.rim[k as usize],
                };
                match &front.source {
                    Source::Cells(cells) => {
                        for c in cells {
                            let nodes = skeleton_nodes(&mesh, c.cell as usize);
                            let known = nodes.map(|n| tree.position[n as usize]);
                            assert_eq!(c.nodes.map(|k| at(u32::from(k))), known);
                        }
                    }
                    Source::Children(runs) => {
                        for (child, runs) in tree.children(f).into_iter().zip(runs) {
                            let found: Vec<u32> = runs
                                .iter()
                                .flat_map(|r| (r.parent..r.parent + r.len).map(at))
                                .collect();
                            assert_eq!(found, tree.fronts[child].rim);
                        }
                    }
                }
            }
            let root = &tree.fronts[tree.fronts.len() - 1];
            assert!(root.rim.is_empty());
        }
    }
}
