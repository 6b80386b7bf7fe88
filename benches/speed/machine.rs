//! This module measures the rates of the machine on one thread.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use std::fmt;
use std::hint::black_box;

/// Number of rows and columns of the matrices of the product, which exceed the second-level cache.
const SIZE: usize = 768;
/// Number of entries of the arrays that are read and copied: 256 MB.
const LONG: usize = 32 << 20;

/// Rates of the machine on one thread.
pub struct Machine {
    /// Rate of a dense matrix product, operations per second.
    pub product: f64,
    /// Rate of reading, bytes per second.
    pub read: f64,
    /// Rate of copying, bytes read and written per second.
    pub copy: f64,
}

impl Machine {
    /// Measures the rates.
    pub fn measure() -> Self {
        let (a, b) = (vec![1.0; SIZE * SIZE], vec![0.5; SIZE * SIZE]);
        let mut c = vec![0.0; SIZE * SIZE];
        let product = super::least(12, || {
            matmul(
                MatMut::from_column_major_slice_mut(&mut c, SIZE, SIZE),
                Accum::Replace,
                MatRef::from_column_major_slice(&a, SIZE, SIZE),
                MatRef::from_column_major_slice(&b, SIZE, SIZE),
                1.0,
                Par::Seq,
            );
        });
        let long = vec![1.0; LONG];
        let mut other = vec![0.0; LONG];
        let read = super::least(6, || {
            let (parts, _) = long.as_chunks::<32>();
            let mut sum = [0.0; 32];
            for part in parts {
                (0..32).for_each(|k| sum[k] += part[k]);
            }
            black_box(sum);
        });
        let copy = super::least(6, || {
            other.copy_from_slice(&long);
            black_box(&mut other);
        });
        Machine {
            product: 2.0 * (SIZE * SIZE * SIZE) as f64 / product,
            read: 8.0 * LONG as f64 / read,
            copy: 16.0 * LONG as f64 / copy,
        }
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(
            f,
            "One thread of this machine: dense products {:.1} GFlop/s, reading {:.1} GB/s, \
             copying {:.1} GB/s (read and written).",
            1e-9 * self.product,
            1e-9 * self.read,
            1e-9 * self.copy
        )
    }
}
