//! This module compares the multifrontal factorisation with faer's, for positive definite element
//! matrices.

use super::faer_llt::FaerLlt;
use super::{Outcome, least, on_threads};
use grainscope::internals::Multifrontal;
use grainscope::internals::Tree;
use grainscope::internals::{Axis, Mesh};
use grainscope::internals::{CellBlocks, SKELETON_NODES, node_pair as pair};
use rand::{Rng, SeedableRng};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

/// Number of repetitions of each measurement.
const TIMES: usize = 9;

/// Writes the section of the solver for meshes of `n x n` cells.
pub fn report(page: &mut String, sizes: &[usize]) -> Outcome<()> {
    writeln!(
        page,
        "## The solver against faer's supernodal LLT\n\n\
         Meshes of n x n cells, d unknowns per node, one thread. *All*: every cell is factored; \
         *changed*: only a ring of cells, like those of an interface, is factored again. Times in \
         milliseconds, with the speed-up over faer. The last columns are the speed-up of two \
         threads over one.\n\n\
         | n, d | faer factor | all | changed (cells) | faer solve | solve | all, 2 threads | \
         solve, 2 threads |\n|---|---|---|---|---|---|---|---|"
    )?;
    for &n in sizes {
        row::<2>(page, n)?;
        row::<3>(page, n)?;
    }
    writeln!(page)?;
    Ok(())
}

/// Measures one mesh and writes its row.
fn row<const D: usize>(page: &mut String, n: usize) -> Outcome<()> {
    let mesh = mesh(n);
    let tree = Arc::new(Tree::new(&mesh));
    let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
    let kinds: Vec<CellBlocks<D>> = (0..64).map(|_| positive::<D>(&mut rng)).collect();
    let cells: Vec<CellBlocks<D>> = (0..mesh.cells()).map(|c| kinds[c % 64]).collect();
    let ring: Vec<usize> = (0..mesh.cells()).filter(|&c| on_ring(&mesh, c)).collect();
    let mut own = Multifrontal::<D>::new(tree.clone(), mesh.cells());
    let mut x = vec![1.0; own.unknowns()];
    let mut times = [[0.0; 3]; 2];
    for (threads, times) in [1, 2].into_iter().zip(&mut times) {
        *times = on_threads(threads, || -> Result<[f64; 3], String> {
            let mut outcome = Ok(());
            let mut factor = |own: &mut Multifrontal<D>| {
                if let Err(e) = own.factorize(&cells) {
                    outcome = Err(e.to_string());
                }
            };
            let all = least(TIMES, || {
                own.forget();
                factor(&mut own);
            });
            let changed = least(TIMES, || {
                ring.iter().for_each(|&c| own.touch(c));
                factor(&mut own);
            });
            let solve = least(TIMES, || {
                x.fill(1.0);
                own.solve(&mut x);
            });
            outcome.map(|()| [all, changed, solve])
        })??;
    }
    let mut faer = FaerLlt::new(&assembled(&mesh, &tree, &cells))?;
    let mut outcome = Ok(());
    let factor = least(TIMES, || {
        if let Err(e) = faer.factorize() {
            outcome = Err(e);
        }
    });
    outcome?;
    let mut y = vec![1.0; x.len()];
    let mut outcome = Ok(());
    let solve = least(TIMES, || {
        y.fill(1.0);
        if let Err(e) = faer.solve(&mut y) {
            outcome = Err(e);
        }
    });
    outcome?;
    let scale = y.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    let off = x.iter().zip(&y).fold(0.0, |a: f64, (x, y)| a.max((x - y).abs()));
    if off > 1e-9 * scale {
        return Err(format!("the two solutions differ by {off:.1e} of {scale:.1e}").into());
    }
    let [[all, changed, own_solve], [all_2, _, solve_2]] = times;
    let ms = |s: f64| 1e3 * s;
    writeln!(
        page,
        "| {n}, {D} | {:.1} | {:.1}, {:.2}x | {:.1}, {:.2}x ({:.1} %) | {:.1} | {:.1}, {:.2}x | \
         {:.2}x | {:.2}x |",
        ms(factor),
        ms(all),
        factor / all,
        ms(changed),
        factor / changed,
        100.0 * ring.len() as f64 / mesh.cells() as f64,
        ms(solve),
        ms(own_solve),
        solve / own_solve,
        all / all_2,
        own_solve / solve_2
    )?;
    eprintln!("solver {n}, {D} measured");
    Ok(())
}

/// A uniform mesh of `n x n` cells on the unit square.
fn mesh(n: usize) -> Mesh {
    let axis = || Axis::new((0..=n).map(|i| i as f64 / n as f64).collect(), false);
    Mesh::new(axis(), axis())
}

/// Whether a circle of radius 0.3 passes through the cell, approximately.
fn on_ring(mesh: &Mesh, cell: usize) -> bool {
    let [x, y] = mesh.cell_centre(cell);
    let [h, _] = mesh.cell_size(cell);
    ((x - 0.5).hypot(y - 0.4) - 0.3).abs() < 0.55 * h
}

/// The element matrix `G G' + I` for a random `G`.
fn positive<const D: usize>(rng: &mut impl Rng) -> CellBlocks<D> {
    let n = 8 * D;
    let g: Vec<f64> = (0..n * n).map(|_| rng.random_range(-0.5..0.5)).collect();
    let entry = |i: usize, j: usize| {
        let product: f64 = (0..n).map(|m| g[i * n + m] * g[j * n + m]).sum();
        product + f64::from(i == j)
    };
    let mut out = [[[0.0; D]; D]; 36];
    for k in 0..8 {
        for l in 0..=k {
            for r in 0..D {
                for c in 0..D {
                    out[pair(k, l)][r][c] = entry(D * k + r, D * l + c);
                }
            }
        }
    }
    out
}

/// The assembled matrix: entries on and below the diagonal, one map of rows per column.
fn assembled<const D: usize>(
    mesh: &Mesh,
    tree: &Tree,
    cells: &[CellBlocks<D>],
) -> Vec<BTreeMap<usize, f64>> {
    let mut columns = vec![BTreeMap::new(); D * tree.len()];
    for (cell, blocks) in cells.iter().enumerate() {
        let nodes = mesh.cell_nodes(cell);
        let at = SKELETON_NODES.map(|a| D * tree.position[nodes[a]] as usize);
        for k in 0..8 {
            for l in 0..=k {
                for r in 0..D {
                    for c in (0..D).filter(|&c| k != l || c <= r) {
                        let (i, j) = (at[k] + r, at[l] + c);
                        *columns[i.min(j)].entry(i.max(j)).or_insert(0.0) +=
                            blocks[pair(k, l)][r][c];
                    }
                }
            }
        }
    }
    columns
}
