//! Order of elimination: geometric nested dissection of the skeleton.
//!
//! The node at a cell's centre is condensed cell by cell; what remains, the *skeleton*, is
//! numbered so that mesh lines that halve the mesh come last (George 1973). The order is then
//! postordered along its elimination tree, as the supernodal factorisation needs.

use super::mesh::Mesh;

/// The skeleton's nodes in elimination order, and the pattern of the lower triangle.
#[derive(Debug)]
pub struct Skeleton {
    /// Position of each node of the mesh in the order; `u32::MAX` at cell centres.
    pub position: Vec<u32>,
    /// Mesh node of each position.
    pub node: Vec<u32>,
    /// Column pointers of the pattern below the diagonal (node by node).
    pub col_ptr: Vec<u32>,
    /// Row positions below the diagonal, ascending in each column.
    pub rows: Vec<u32>,
}

impl Skeleton {
    pub fn new(mesh: &Mesh) -> Self {
        let mut order = Vec::new();
        nested_dissection(mesh, &mut order);
        let (col_ptr, rows) = pattern(mesh, &order);
        let post = postorder(&elimination_tree(&col_ptr, &rows));
        let node: Vec<u32> = post.iter().map(|&p| order[p as usize]).collect();
        let (col_ptr, rows) = pattern(mesh, &node);
        Skeleton { position: positions(mesh, &node), node, col_ptr, rows }
    }

    pub fn len(&self) -> usize {
        self.node.len()
    }
    pub fn is_empty(&self) -> bool {
        self.node.is_empty()
    }
}

fn positions(mesh: &Mesh, order: &[u32]) -> Vec<u32> {
    let mut position = vec![u32::MAX; mesh.nodes()];
    for (p, &n) in order.iter().enumerate() {
        position[n as usize] = p as u32;
    }
    position
}

/// A rectangle of nodes, bounds included.
#[derive(Clone, Copy)]
struct Patch {
    i: [usize; 2],
    j: [usize; 2],
}

fn nested_dissection(mesh: &Mesh, order: &mut Vec<u32>) {
    let (ni, nj) = (mesh.x.nodes(), mesh.y.nodes());
    let mut whole = Patch { i: [0, ni - 1], j: [0, nj - 1] };
    let mut seams = Vec::new();
    if mesh.x.periodic() {
        seams.push(Patch { i: [0, 0], j: whole.j });
        whole.i[0] = 1;
    }
    if mesh.y.periodic() {
        seams.push(Patch { i: whole.i, j: [0, 0] });
        whole.j[0] = 1;
    }
    dissect(mesh, whole, order);
    for seam in seams.into_iter().rev() {
        list(mesh, seam, order);
    }
}

fn dissect(mesh: &Mesh, p: Patch, order: &mut Vec<u32>) {
    let (wide, high) = (p.i[1] - p.i[0], p.j[1] - p.j[0]);
    // A mesh line has an even index; both halves must keep at least one node.
    let middle = |[a, b]: [usize; 2]| {
        let m = (a + b) / 2;
        [m - m % 2, m + m % 2].into_iter().find(|&m| m > a && m < b)
    };
    if wide.max(high) <= 3 {
        return list(mesh, p, order);
    }
    let (line_i, line_j) = (middle(p.i), middle(p.j));
    match (line_i, line_j) {
        (Some(m), other) if wide >= high || other.is_none() => {
            dissect(mesh, Patch { i: [p.i[0], m - 1], ..p }, order);
            dissect(mesh, Patch { i: [m + 1, p.i[1]], ..p }, order);
            list(mesh, Patch { i: [m, m], ..p }, order);
        }
        (_, Some(m)) => {
            dissect(mesh, Patch { j: [p.j[0], m - 1], ..p }, order);
            dissect(mesh, Patch { j: [m + 1, p.j[1]], ..p }, order);
            list(mesh, Patch { j: [m, m], ..p }, order);
        }
        _ => list(mesh, p, order),
    }
}

fn list(mesh: &Mesh, p: Patch, order: &mut Vec<u32>) {
    for j in p.j[0]..=p.j[1] {
        for i in p.i[0]..=p.i[1] {
            if i % 2 == 0 || j % 2 == 0 {
                order.push(mesh.node(i, j) as u32);
            }
        }
    }
}

/// Lower triangle (diagonal left out) of the node graph in the given order.
fn pattern(mesh: &Mesh, order: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let position = positions(mesh, order);
    let mut below: Vec<Vec<u32>> = vec![Vec::new(); order.len()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let nodes = mesh.cell_nodes(cell).map(|n| position[n]);
        for &a in nodes.iter().filter(|&&a| a != u32::MAX) {
            for &b in nodes.iter().filter(|&&b| b != u32::MAX && b > a) {
                below[a as usize].push(b);
            }
        }
    }
    let mut col_ptr = Vec::with_capacity(order.len() + 1);
    let mut rows = Vec::new();
    col_ptr.push(0);
    for list in &mut below {
        list.sort_unstable();
        list.dedup();
        rows.extend_from_slice(list);
        col_ptr.push(rows.len() as u32);
    }
    (col_ptr, rows)
}

/// Parent of each column (Liu 1990), `u32::MAX` for roots.
fn elimination_tree(col_ptr: &[u32], rows: &[u32]) -> Vec<u32> {
    let n = col_ptr.len() - 1;
    // Rows of the upper triangle, column by column: transpose of the lower pattern.
    let mut upper: Vec<Vec<u32>> = vec![Vec::new(); n];
    for c in 0..n {
        for &r in &rows[col_ptr[c] as usize..col_ptr[c + 1] as usize] {
            upper[r as usize].push(c as u32);
        }
    }
    let mut parent = vec![u32::MAX; n];
    let mut ancestor = vec![u32::MAX; n];
    for k in 0..n as u32 {
        for &start in &upper[k as usize] {
            let mut i = start;
            while i != u32::MAX && i < k {
                let next = ancestor[i as usize];
                ancestor[i as usize] = k;
                if next == u32::MAX {
                    parent[i as usize] = k;
                }
                i = next;
            }
        }
    }
    parent
}

fn postorder(parent: &[u32]) -> Vec<u32> {
    let n = parent.len();
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut stack = Vec::new();
    for k in (0..n).rev() {
        match parent[k] {
            u32::MAX => stack.push((k as u32, false)),
            p => children[p as usize].push(k as u32),
        }
    }
    let mut order = Vec::with_capacity(n);
    while let Some((k, expanded)) = stack.pop() {
        if expanded {
            order.push(k);
        } else {
            stack.push((k, true));
            // Children were pushed in descending order: the smallest ends on top.
            stack.extend(children[k as usize].iter().map(|&c| (c, false)));
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::*;

    fn uniform(n: usize, periodic: bool) -> Axis {
        Axis::new((0..=n).map(|i| i as f64).collect(), periodic)
    }

    #[test]
    fn order_is_a_postordered_permutation_of_the_skeleton() {
        for (nx, ny, px, py) in
            [(1, 1, false, false), (5, 3, false, false), (8, 9, true, false), (4, 6, true, true)]
        {
            let mesh = Mesh::new(uniform(nx, px), uniform(ny, py));
            let s = Skeleton::new(&mesh);
            assert_eq!(s.len(), mesh.nodes() - mesh.cells());
            let mut seen = s.node.clone();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), s.len());
            let parent = elimination_tree(&s.col_ptr, &s.rows);
            let post = postorder(&parent);
            assert!(post.windows(2).all(|w| w[0] < w[1]), "{nx} x {ny} is not postordered");
        }
    }

    #[test]
    fn dissection_fills_less_than_line_order() {
        let mesh = Mesh::new(uniform(32, false), uniform(32, false));
        let s = Skeleton::new(&mesh);
        let fill = |col_ptr: &[u32], rows: &[u32]| -> usize {
            let n = col_ptr.len() - 1;
            let parent = elimination_tree(col_ptr, rows);
            let mut merged: Vec<Vec<u32>> = vec![Vec::new(); n];
            let mut total = 0;
            for c in 0..n {
                let mut list = std::mem::take(&mut merged[c]);
                list.extend_from_slice(&rows[col_ptr[c] as usize..col_ptr[c + 1] as usize]);
                list.sort_unstable();
                list.dedup();
                list.retain(|&r| r as usize > c);
                total += list.len();
                if parent[c] != u32::MAX {
                    merged[parent[c] as usize].extend(list);
                }
            }
            total
        };
        let lines: Vec<u32> =
            (0..mesh.nodes() as u32).filter(|&n| s.position[n as usize] != u32::MAX).collect();
        let (cp, r) = pattern(&mesh, &lines);
        assert!(2 * fill(&s.col_ptr, &s.rows) < fill(&cp, &r));
    }
}
