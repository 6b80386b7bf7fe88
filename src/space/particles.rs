//! This module stores the particles as a structure of arrays sorted by cell. Columns that no effect
//! needs are absent.

use super::mesh::Mesh;
use crate::laws::director;
use crate::threads::{self, Divisible};

/// A column that exists only if an effect needs it.
pub type Column<T> = Option<Vec<T>>;

/// Particles (material points), with values in the plan's units.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    /// Positions.
    pub position: Vec<[f64; 2]>,
    /// Area that each particle represents.
    pub volume: Vec<f64>,
    /// Index of the material of each particle.
    pub material: Vec<u8>,
    /// Director (unit vector) of each particle; used for layered materials.
    pub director: Column<[f64; 2]>,
    /// Viscosity carried by each particle from an initial field.
    pub viscosity: Column<f64>,
    /// Density carried by each particle from an initial field.
    pub density: Column<f64>,
    /// Whether each particle was marked at the start (`dye.marks`).
    pub mark: Column<bool>,
    /// Index of the first particle of each cell, followed by the number of particles; valid after
    /// [`Particles::sort`].
    pub cell_start: Vec<u32>,
    pub(crate) sorting: Sorting,
}

/// Largest number of particles per task.
pub const GRAIN: usize = 4096;

/// Largest reference coordinate of particles that are moved within a cell.
const INSIDE: f64 = 0.999;

/// Cell number that marks a particle for removal.
pub const GONE: u32 = u32::MAX;

/// Buffers for sorting, kept between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sorting {
    cells: Vec<u32>,
    next: Vec<u32>,
    order: Vec<u32>,
    /// Particles that leave their cell, in their order.
    leaving: Vec<u32>,
    /// Those of them that are not removed, sorted by their new cell.
    arriving: Vec<u32>,
    pairs: Vec<[f64; 2]>,
    numbers: Vec<f64>,
    bytes: Vec<u8>,
    flags: Vec<bool>,
}

impl Sorting {
    /// Permutes a column into the new order.
    fn permute<T: Sortable>(&mut self, column: &mut Vec<T>) {
        let Some(&any) = column.first() else { return };
        let mut room = std::mem::take(T::room(self));
        room.resize(self.order.len(), any);
        let (order, from) = (&self.order, &*column);
        threads::for_each(&mut room, GRAIN, |k, value| *value = from[order[k] as usize]);
        std::mem::swap(column, &mut room);
        *T::room(self) = room;
    }
}

/// Part of the new order that belongs to some consecutive cells.
struct Places<'a> {
    /// Index of the first particle of each of these cells and of the next cell.
    start: &'a [u32],
    order: &'a mut [u32],
}

impl Divisible for Places<'_> {
    fn cut(self, at: usize) -> (Self, Self) {
        let places = (self.start[at] - self.start[0]) as usize;
        let (a, b) = self.order.split_at_mut(places);
        let (before, after) = (&self.start[..=at], &self.start[at..]);
        (Places { start: before, order: a }, Places { start: after, order: b })
    }
}

/// Types that a column can have.
trait Sortable: Copy + Send + Sync {
    fn room(sorting: &mut Sorting) -> &mut Vec<Self>;
}

macro_rules! sortable {
    ($($type:ty: $room:ident),*) => {$(
        impl Sortable for $type {
            fn room(sorting: &mut Sorting) -> &mut Vec<Self> {
                &mut sorting.$room
            }
        }
    )*};
}
sortable!([f64; 2]: pairs, f64: numbers, u8: bytes, bool: flags);

/// Runs a block for each optional column that exists.
macro_rules! for_columns {
    ($p:expr, |$c:ident| $body:expr) => {{
        let p = $p;
        {
            let $c = &mut p.position;
            $body
        }
        {
            let $c = &mut p.volume;
            $body
        }
        {
            let $c = &mut p.material;
            $body
        }
        if let Some($c) = &mut p.director {
            $body
        }
        if let Some($c) = &mut p.viscosity {
            $body
        }
        if let Some($c) = &mut p.density {
            $body
        }
        if let Some($c) = &mut p.mark {
            $body
        }
    }};
}

impl Particles {
    /// Largest `| |n| - 1 |` of the directors; zero without directors.
    pub fn director_error(&self) -> f64 {
        let directors = self.director.iter().flatten();
        directors.map(|n| (n[0].hypot(n[1]) - 1.0).abs()).fold(0.0, f64::max)
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }
    /// Whether there are no particles.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Indices of the particles of a cell; valid after [`Particles::sort`].
    pub fn of_cell(&self, cell: usize) -> std::ops::Range<usize> {
        self.cell_start[cell] as usize..self.cell_start[cell + 1] as usize
    }

    /// Moves particle `p` of a cell to a point, or to the point of the cell nearest to it, unless a solid is there.
    pub(super) fn move_inside(&mut self, mesh: &Mesh, cell: usize, (p, to): (usize, [f64; 2])) {
        let r = mesh.to_reference(cell, to);
        let to = mesh.from_reference(cell, r.map(|c| c.clamp(-INSIDE, INSIDE)));
        if mesh.part(cell).is_none() || !mesh.is_solid_at(to) {
            self.position[p] = to;
        }
    }

    /// Appends a copy of particle `p`.
    pub fn duplicate(&mut self, p: usize) {
        for_columns!(self, |c| {
            let v = c[p];
            c.push(v);
        });
    }

    /// Removes the last particle.
    pub fn pop(&mut self) {
        for_columns!(self, |c| {
            c.pop();
        });
    }

    /// Removes the particles for which `gone` is true; the others keep their order, and stay sorted.
    pub fn remove(&mut self, gone: &[bool]) {
        let mut kept = 0;
        for cell in 0..self.cell_start.len().saturating_sub(1) {
            let all = self.of_cell(cell);
            self.cell_start[cell] = kept;
            kept += gone[all].iter().filter(|&&gone| !gone).count() as u32;
        }
        if let Some(end) = self.cell_start.last_mut() {
            *end = kept;
        }
        for_columns!(self, |c| {
            let mut i = 0;
            c.retain(|_| {
                i += 1;
                !gone[i - 1]
            });
        });
    }

    /// Sorts by cell (stable counting sort) and fills `cell_start`.
    pub fn sort(&mut self, mesh: &Mesh) {
        let cells = &mut self.sorting.cells;
        cells.resize(self.position.len(), 0);
        let position = &self.position;
        threads::for_each(cells, GRAIN, |p, cell| *cell = mesh.locate(position[p]) as u32);
        self.sort_by_cells(mesh.cells());
    }

    /// Sorts particles of which the last ones were added to sorted ones, in the cells `added`. The order
    /// is the same as that of [`Particles::sort`].
    pub fn settle(&mut self, added: &[u32]) {
        let Particles { cell_start, sorting, .. } = self;
        let count = cell_start.len() - 1;
        sorting.cells.clear();
        for cell in 0..count {
            sorting.cells.resize(cell_start[cell + 1] as usize, cell as u32);
        }
        sorting.cells.extend_from_slice(added);
        self.sort_by_cells(count);
    }

    /// Sorts particles that were sorted before and then moved into `cells`, and removes those whose
    /// cell is [`GONE`]. The order is the same as that of [`Particles::sort`], but only the
    /// particles that changed their cell are sorted.
    pub fn regroup(&mut self, cells: &[u32]) {
        /// Largest number of cells per task.
        const CELL_GRAIN: usize = 512;
        let count = self.cell_start.len() - 1;
        let mut sorting = std::mem::take(&mut self.sorting);
        let mut start = std::mem::take(&mut sorting.cells);
        let Sorting { next, order, leaving, arriving, .. } = &mut sorting;
        leaving.clear();
        // Few particles leave, but their number differs from step to step.
        leaving.reserve(cells.len());
        arriving.reserve(cells.len());
        for cell in 0..count {
            let range = self.of_cell(cell);
            let away = cells[range.clone()].iter().zip(range).filter(|c| *c.0 != cell as u32);
            leaving.extend(away.map(|c| c.1 as u32));
        }
        if leaving.is_empty() {
            sorting.cells = start;
            self.sorting = sorting;
            return;
        }
        let to = |p: u32| Some(cells[p as usize]).filter(|&c| c != GONE).map(|c| c as usize);
        // Sort the arriving particles by cell: `next[c]` is the index of the first one of a cell,
        // and later the index after the last one.
        next.clear();
        next.resize(count + 1, 0);
        leaving.iter().filter_map(|&p| to(p)).for_each(|c| next[c + 1] += 1);
        // Index of the first particle of each cell: old number minus leaving plus arriving
        // particles.
        let old = &self.cell_start;
        start.clear();
        start.push(0);
        let (mut left, mut total) = (leaving.iter().peekable(), 0);
        for cell in 0..count {
            total += old[cell + 1] - old[cell] + next[cell + 1];
            while left.next_if(|&&p| p < old[cell + 1]).is_some() {
                total -= 1;
            }
            start.push(total);
            next[cell + 1] += next[cell];
        }
        arriving.resize(next[count] as usize, 0);
        for &p in &*leaving {
            if let Some(c) = to(p) {
                arriving[next[c] as usize] = p;
                next[c] += 1;
            }
        }
        order.resize(total as usize, 0);
        let places = Places { start: &start, order };
        threads::for_parts(places, 0..count, CELL_GRAIN, |part, places| {
            let mut at = places.order.iter_mut();
            let mut put = |p: u32| {
                if let Some(place) = at.next() {
                    *place = p;
                }
            };
            for cell in part {
                let begin = if cell == 0 { 0 } else { next[cell - 1] };
                let guests = &arriving[begin as usize..next[cell] as usize];
                // Particles from cells before this one come first.
                let before = guests.partition_point(|&p| p < old[cell]);
                guests[..before].iter().for_each(|&p| put(p));
                let own = old[cell]..old[cell + 1];
                own.filter(|&p| cells[p as usize] == cell as u32).for_each(&mut put);
                guests[before..].iter().for_each(|&p| put(p));
            }
        });
        sorting.cells = std::mem::replace(&mut self.cell_start, start);
        for_columns!(&mut *self, |c| sorting.permute(c));
        self.sorting = sorting;
    }

    fn sort_by_cells(&mut self, count: usize) {
        let Sorting { cells, next, order, .. } = &mut self.sorting;
        self.cell_start.clear();
        self.cell_start.resize(count + 1, 0);
        for &c in &*cells {
            self.cell_start[c as usize + 1] += 1;
        }
        for c in 0..count {
            self.cell_start[c + 1] += self.cell_start[c];
        }
        if cells.is_sorted() {
            return;
        }
        next.clone_from(&self.cell_start);
        order.resize(cells.len(), 0);
        for (p, &c) in cells.iter().enumerate() {
            order[next[c as usize] as usize] = p as u32;
            next[c as usize] += 1;
        }
        let mut sorting = std::mem::take(&mut self.sorting);
        for_columns!(&mut *self, |c| sorting.permute(c));
        self.sorting = sorting;
    }

    /// Total volume of the particles of a material.
    pub fn volume_of(&self, material: usize) -> f64 {
        let [total] = threads::sum(0..self.len(), |p| {
            [if usize::from(self.material[p]) == material { self.volume[p] } else { 0.0 }]
        });
        total
    }
}

impl Particles {
    /// Appends a particle of a material without carried values.
    pub fn push(&mut self, position: [f64; 2], volume: f64, material: u8) {
        self.position.push(position);
        self.volume.push(volume);
        self.material.push(material);
        if let Some(d) = &mut self.director {
            d.push([0.0, 1.0]);
        }
        if let Some(v) = &mut self.viscosity {
            v.push(0.0);
        }
        if let Some(d) = &mut self.density {
            d.push(0.0);
        }
        if let Some(m) = &mut self.mark {
            m.push(false);
        }
    }

    /// Merges particle `b` into particle `a` of a cell, which keeps its index; `b` is not removed.
    /// Volumes add up, position (unless it is inside of a solid) and carried values are means weighted by
    /// volume, and directors are averaged regardless of their sign.
    pub fn absorb(&mut self, mesh: &Mesh, cell: usize, (a, b): (usize, usize)) {
        let (va, vb) = (self.volume[a], self.volume[b]);
        let (fa, fb) = (va / (va + vb), vb / (va + vb));
        self.volume[a] = va + vb;
        self.position[a] =
            merged_position(mesh, cell, [(self.position[a], va), (self.position[b], vb)]);
        if let Some(d) = &mut self.director {
            let [p, q] = [d[a], d[b]];
            let product = |i: usize, j: usize| fa * p[i] * p[j] + fb * q[i] * q[j];
            let n = director::axis(product(0, 0), product(1, 1), product(0, 1));
            d[a] = [n.x, n.y];
        }
        for column in [&mut self.viscosity, &mut self.density].into_iter().flatten() {
            column[a] = fa * column[a] + fb * column[b];
        }
    }
}

/// Position of the particle that two particles of a cell, with these positions and volumes, become: their
/// centroid, or the position of the first one if that is inside of a solid.
pub(super) fn merged_position(
    mesh: &Mesh,
    cell: usize,
    [(a, va), (b, vb)]: [([f64; 2], f64); 2],
) -> [f64; 2] {
    let (fa, fb) = (va / (va + vb), vb / (va + vb));
    // By rounding, the mean of two points on a side of the domain may lie beyond it.
    let mean = [0, 1].map(|c| (fa * a[c] + fb * b[c]).clamp(a[c].min(b[c]), a[c].max(b[c])));
    if mesh.is_solid_in(cell, mean) { a } else { mean }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::*;

    #[test]
    fn regrouping_finds_the_order_of_sorting() {
        let lines: Vec<f64> = (0..=6).map(f64::from).collect();
        let mesh = Mesh::new(Axis::new(lines.clone(), false), Axis::new(lines, false));
        let number = |k: usize, s: f64| (s * (k as f64 + 1.0)).sin().abs();
        let mut particles = Particles {
            position: (0..400).map(|k| [6.0 * number(k, 12.9), 6.0 * number(k, 78.2)]).collect(),
            volume: (0..400).map(|k| k as f64).collect(),
            material: (0..400).map(|k| (k % 3) as u8).collect(),
            mark: Some((0..400).map(|k| k % 7 == 0).collect()),
            ..Particles::default()
        };
        particles.sort(&mesh);
        for step in 0..6 {
            // No, few and nearly all particles change their cell; some are removed.
            let reach = [0.0, 0.02, 0.3, 5.0, 0.3, 0.1][step];
            let gone: Vec<bool> =
                (0..particles.len()).map(|k| step > 2 && (k + step) % 29 == 0).collect();
            for (k, p) in particles.position.iter_mut().enumerate() {
                *p = [0, 1].map(|c| {
                    let way = reach * (number(k + 31 * step, 7.1 + c as f64) - 0.5);
                    (p[c] + way).clamp(0.0, 6.0)
                });
            }
            let cells: Vec<u32> = particles
                .position
                .iter()
                .zip(&gone)
                .map(|(p, &gone)| if gone { GONE } else { mesh.locate(*p) as u32 })
                .collect();
            let mut expected = particles.clone();
            expected.remove(&gone);
            expected.sort(&mesh);
            particles.regroup(&cells);
            assert_eq!(particles.cell_start, expected.cell_start);
            assert_eq!(particles.position, expected.position);
            assert_eq!(particles.volume, expected.volume);
            assert_eq!(particles.material, expected.material);
            assert_eq!(particles.mark, expected.mark);
        }
        assert!(particles.len() < 390);
    }
}
