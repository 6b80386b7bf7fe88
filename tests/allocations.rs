//! Steps allocate no memory after the first ones.
//!
//! The allocations of a test's own thread are counted: `threads::alone` keeps all work of a step on
//! it. The counting allocator needs a program of its own.

use grainscope::plan::resolve;
use grainscope::scene::{SceneSource, parse, presets};
use grainscope::sim::guard::{Guard, Policy};
use grainscope::{sim, threads};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

/// The system allocator, with a count of its allocations.
struct Counting;

thread_local! {
    /// Allocations of this thread. Other threads are not counted: the test harness and the other
    /// test allocate meanwhile. The value is constant and has no destructor, so that an access
    /// does not allocate.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    ALLOCATIONS.set(ALLOCATIONS.get() + 1);
}

// SAFETY: all calls are passed on to the system allocator; the counter does not touch the memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Allocations of each of `steps` steps after the `first` ones. Steps are checked as by `run`.
fn allocations(source: SceneSource, sets: &[&str], first: usize, steps: usize) -> Vec<u64> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let source = source.with_sets(&sets).expect("valid");
    let plan = resolve(&parse(&source).expect("valid")).expect("valid");
    let mut run = sim::start(Arc::new(plan)).expect("solved");
    let mut guard = Guard::new(Policy::default(), run.as_ref());
    let mut counts = Vec::with_capacity(first + steps);
    for _ in 0..first + steps {
        let before = ALLOCATIONS.get();
        guard.step(run.as_mut()).expect("a step");
        counts.push(ALLOCATIONS.get() - before);
    }
    counts.split_off(first)
}

#[test]
fn steps_after_the_first_allocate_nothing() {
    threads::alone(|| {
        let shear = "schema = 1\nname = \"shear\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
            [accuracy]\ncells = 8\n[time]\nend = 1e9\n\
            [materials.fluid]\ndensity = 1\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n\
            [boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
            bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\ntop.velocity_x = 1\n";
        let rotation =
            ["materials.fluid.coupling_viscosity=3", "materials.fluid.internal_length=0.1"];
        for sets in [&[][..], &rotation] {
            let counts = allocations(SceneSource::new("shear.toml", shear), sets, 6, 20);
            assert!(counts.iter().all(|&n| n == 0), "{sets:?}: {counts:?}");
        }
        // Directors rotate; dye lines are stretched.
        for (name, cells) in [("shear_alignment", 6), ("couette_cosserat", 6)] {
            let source = presets::find(name).expect("listed");
            let counts = allocations(source, &[&format!("accuracy.cells={cells}")], 10, 20);
            assert!(counts.iter().all(|&n| n == 0), "{name}: {counts:?}");
        }
    });
}

/// Allocations occur when an interface enters new cells (at most a row of cells at a time), when
/// particles are split and merged, and when a solution takes more corrections than any before it.
#[test]
fn a_moving_interface_allocates_for_new_cells_only() {
    threads::alone(|| {
        let source = presets::find("silo").expect("listed");
        let counts = allocations(source, &["accuracy.cells=3"], 10, 30);
        println!("silo: {counts:?}");
        let mean = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
        assert!(mean < 100.0, "{counts:?}");
    });
}
