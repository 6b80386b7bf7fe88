//! Particles: structure of arrays, kept sorted by cell. Columns that no effect needs are absent.

use super::mesh::Mesh;
use crate::threads;

/// A column that exists only when an effect calls for it.
pub type Column<T> = Option<Vec<T>>;

/// Material points.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    pub position: Vec<[f64; 2]>,
    /// Area each particle stands for.
    pub volume: Vec<f64>,
    /// Index into the plan's materials.
    pub material: Vec<u8>,
    /// Unit directors of layered materials.
    pub director: Column<[f64; 2]>,
    /// Viscosity carried from an initial field.
    pub viscosity: Column<f64>,
    /// Density carried from an initial field.
    pub density: Column<f64>,
    /// Marked by a dye line at the start.
    pub mark: Column<bool>,
    /// First particle of each cell, one more at the end; valid after [`Particles::sort`].
    pub cell_start: Vec<u32>,
    pub(crate) sorting: Sorting,
}

/// Particles that are worth a task of their own.
const GRAIN: usize = 4096;

/// Room that sorting takes, kept from one time to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sorting {
    cells: Vec<u32>,
    next: Vec<u32>,
    order: Vec<u32>,
    pairs: Vec<[f64; 2]>,
    numbers: Vec<f64>,
    bytes: Vec<u8>,
    flags: Vec<bool>,
}

impl Sorting {
    /// Brings a column into the new order.
    fn permute<T: Sortable>(&mut self, column: &mut Vec<T>) {
        let mut room = std::mem::take(T::room(self));
        room.clear();
        room.extend(self.order.iter().map(|&p| column[p as usize]));
        std::mem::swap(column, &mut room);
        *T::room(self) = room;
    }
}

/// What a column can hold.
trait Sortable: Copy {
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
    pub fn len(&self) -> usize {
        self.position.len()
    }
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Particles of a cell; valid after [`Particles::sort`].
    pub fn of_cell(&self, cell: usize) -> std::ops::Range<usize> {
        self.cell_start[cell] as usize..self.cell_start[cell + 1] as usize
    }

    /// Appends a copy of particle `p`.
    pub fn duplicate(&mut self, p: usize) {
        for_columns!(self, |c| {
            let v = c[p];
            c.push(v);
        });
    }

    /// Removes the particles for which `gone` is set, keeping the order of the others.
    pub fn remove(&mut self, gone: &[bool]) {
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

    /// The same for `count` cells where each particle's is known.
    pub fn sort_into(&mut self, count: usize, cells: impl Iterator<Item = u32>) {
        self.sorting.cells.clear();
        self.sorting.cells.extend(cells);
        self.sort_by_cells(count);
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

    /// Total volume of each of `materials` materials.
    pub fn volumes(&self, materials: usize) -> Vec<f64> {
        let mut total = vec![0.0; materials];
        for (m, v) in self.material.iter().zip(&self.volume) {
            total[*m as usize] += v;
        }
        total
    }
}
