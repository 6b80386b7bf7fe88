//! This module distributes work among threads so that no bit of any result depends on their number.
//!
//! Each task writes to its own part of the output, and sums are taken in an order that depends only
//! on their length. The threads are those of rayon's pool.

use std::cell::Cell;
use std::ops::Range;

thread_local! {
    static ALONE: Cell<bool> = const { Cell::new(false) };
}

/// Runs `f` and all work that it distributes on this thread alone. This is used to time one
/// processor, and where whole runs are already distributed among threads.
pub fn alone<T>(f: impl FnOnce() -> T) -> T {
    struct Restore(bool);
    impl Drop for Restore {
        fn drop(&mut self) {
            ALONE.set(self.0);
        }
    }
    let _restore = Restore(ALONE.replace(true));
    f()
}

fn is_alone() -> bool {
    ALONE.get() || rayon::current_num_threads() == 1
}

/// Runs two tasks and returns both results; the tasks run in parallel if `worth` is true.
pub fn both<A: Send, B: Send>(
    worth: bool,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if worth && !is_alone() { rayon::join(a, b) } else { (a(), b()) }
}

/// Calls `f` with the index of each item and the item. One task processes at most `grain` items.
pub fn for_each<T: Send>(items: &mut [T], grain: usize, f: impl Fn(usize, &mut T) + Sync) {
    fn part<T: Send>(
        items: &mut [T],
        at: usize,
        grain: usize,
        f: &(impl Fn(usize, &mut T) + Sync),
    ) {
        if items.len() <= grain {
            items.iter_mut().enumerate().for_each(|(k, item)| f(at + k, item));
            return;
        }
        let middle = items.len() / 2;
        let (a, b) = items.split_at_mut(middle);
        rayon::join(|| part(a, at, grain, f), || part(b, at + middle, grain, f));
    }
    let grain = if is_alone() { items.len() } else { grain.max(1) };
    part(items, 0, grain, &f);
}

/// Data that can be divided into two parts for parallel work.
pub trait Divisible: Sized + Send {
    /// The part before the index `at`, and the rest.
    fn cut(self, at: usize) -> (Self, Self);
}

/// Divides `data` into parts and calls `f` with the range of indices of each part and the part.
/// One task processes at most `grain` indices.
pub fn for_parts<P: Divisible>(
    data: P,
    range: Range<usize>,
    grain: usize,
    f: impl Fn(Range<usize>, P) + Sync,
) {
    fn part<P: Divisible>(
        data: P,
        range: Range<usize>,
        grain: usize,
        f: &(impl Fn(Range<usize>, P) + Sync),
    ) {
        if range.len() <= grain {
            return f(range, data);
        }
        let middle = range.start + range.len() / 2;
        let (a, b) = data.cut(range.len() / 2);
        rayon::join(
            || part(a, range.start..middle, grain, f),
            || part(b, middle..range.end, grain, f),
        );
    }
    let grain = if is_alone() { range.len() } else { grain.max(1) };
    part(data, range, grain, &f);
}

/// Sum of each of the `N` components of `f` over a range of indices, by pairwise summation.
pub fn sum<const N: usize>(range: Range<usize>, f: impl Fn(usize) -> [f64; N] + Sync) -> [f64; N] {
    /// Largest number of terms that are added one after the other.
    const GRAIN: usize = 512;
    fn plus<const N: usize>(mut a: [f64; N], b: [f64; N]) -> [f64; N] {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    }
    fn part<const N: usize>(
        range: Range<usize>,
        shared: bool,
        f: &(impl Fn(usize) -> [f64; N] + Sync),
    ) -> [f64; N] {
        if range.len() <= GRAIN {
            return range.fold([0.0; N], |sum, k| plus(sum, f(k)));
        }
        let middle = range.start + range.len() / 2;
        let halves = (range.start..middle, middle..range.end);
        let (a, b) = if shared {
            rayon::join(|| part(halves.0, true, f), || part(halves.1, true, f))
        } else {
            (part(halves.0, false, f), part(halves.1, false, f))
        };
        plus(a, b)
    }
    part(range, !is_alone(), &f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_items_are_the_same_on_any_number_of_threads() {
        let term = |k: usize| [(k as f64).sin(), 1.0 / (k as f64 + 1.0)];
        let expected = alone(|| sum(0..10_000, term));
        for threads in [1, 2, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (sums, items) = pool.install(|| {
                let mut items = vec![0.0; 5000];
                for_each(&mut items, 64, |k, x| *x = (k as f64).sqrt());
                (sum(0..10_000, term), items)
            });
            assert_eq!(sums, expected);
            assert!(items.iter().enumerate().all(|(k, &x)| x == (k as f64).sqrt()));
        }
    }
}
