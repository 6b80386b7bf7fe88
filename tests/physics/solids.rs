//! Solids of any shape: exact flows beside walls across the mesh, and runs in which nothing enters a
//! solid or is lost.

use crate::scene;
use grainscope::internals::{
    ARRAY_DRAG, LowerWall, SlantedChannel, array_drag, slanted_channel, slipping_circle, wedge,
};
use grainscope::sim::Run;

#[test]
fn a_channel_across_the_mesh_is_exact() {
    for degrees in [7.0, 30.0, 41.0] {
        let channel = SlantedChannel { degrees, width: 0.25, lower: LowerWall::NoSlip };
        let e = slanted_channel(channel).errors(32, &[]).unwrap();
        assert!(e.velocity < 5e-4, "{degrees}: {e:?}");
    }
}

#[test]
fn walls_that_slip_hold_the_normal_velocity_only() {
    for degrees in [12.0, 30.0] {
        let channel = SlantedChannel { degrees, width: 0.25, lower: LowerWall::FreeSlip };
        let e = slanted_channel(channel).errors(32, &[]).unwrap();
        assert!(e.velocity < 5e-3, "{degrees}: {e:?}");
    }
}

/// Velocity errors of a case at 16 and 64 cells, and their order.
fn order(case: &grainscope::internals::Case) -> [f64; 3] {
    let [a, b] = [16, 64].map(|n| case.errors(n, &[]).unwrap().velocity);
    [a, b, (a / b).log2() / 2.0]
}

#[test]
fn slip_lengths_hold_along_slanted_walls() {
    for (degrees, b) in [(30.0, 0.1), (30.0, 0.01), (12.0, 0.1), (41.0, 0.5)] {
        let lower = LowerWall::Slip(b);
        let case = slanted_channel(SlantedChannel { degrees, width: 0.25, lower });
        let [coarse, fine, order] = order(&case);
        assert!(order > 2.0 && fine < 1e-3, "{degrees}, {b}: {coarse:.2e} {fine:.2e} {order:.2}");
    }
}

#[test]
fn slip_lengths_hold_along_circles() {
    for b in [0.01, 0.1, 1.0] {
        // The outline is straight in an eighth of a cell, and the errors of single meshes scatter.
        let [a, b] = [16, 128].map(|n| slipping_circle(b).errors(n, &[]).unwrap().velocity);
        assert!(a < 3e-2 && b < 2e-3 && (a / b).log2() / 3.0 > 1.4, "{a:.2e} {b:.2e}");
    }
}

#[test]
fn slanted_walls_with_friction_slide_at_their_strength() {
    // Wall friction 0.08, less than the 0.125 at which the lower wall sticks.
    for degrees in [12.0, 30.0] {
        let lower = LowerWall::Friction(0.4, 0.2);
        let case = slanted_channel(SlantedChannel { degrees, width: 0.25, lower });
        let [coarse, fine] = [16, 64]
            .map(|n| case.errors(n, &["accuracy.nonlinear_tolerance=1e-6"]).unwrap().velocity);
        assert!(fine < 1e-3, "{degrees}: {coarse:.2e} {fine:.2e}");
    }
}

#[test]
fn converging_flow_is_of_second_order() {
    for degrees in [20.0, 30.0] {
        let case = wedge(degrees);
        let [a, b] = [16, 64].map(|n| case.errors(n, &[]).unwrap().velocity);
        assert!((a / b).log2() / 2.0 > 2.0 && b < 1e-3, "{degrees}: {a:.2e} {b:.2e}");
    }
}

#[test]
fn cylinders_have_the_published_drag() {
    for (fraction, published) in ARRAY_DRAG {
        let drag = array_drag(fraction, 32).unwrap();
        assert!((drag / published - 1.0).abs() < 1e-3, "{fraction}: {drag}");
    }
}

fn hopper(extra: &str) -> Box<dyn Run> {
    let text = format!(
        "schema = 1\nname = \"hopper\"\ngravity = [0, -10]\n[domain]\nx = [-1, 1]\ny = [0, 2]\n\
         [accuracy]\ncells = 8\n[time]\nend = 10\n[materials.mud]\nshear_viscosity = 100\n\
         density = 1000\n[materials.air]\nshear_viscosity = 0.1\ndensity = 1\nbackground = true\n\
         [[regions]]\nmaterial = \"mud\"\nshape.rectangle = {{ x = [-1, 1], y = [0, 1.5] }}\n\
         [boundaries]\nleft.kind = \"no_slip\"\nright.kind = \"no_slip\"\ntop.kind = \"open\"\n\
         [[blocks]]\nname = \"hl\"\nkind = \"no_slip\"\n\
         shape.polygon = [[-1, 1.2], [-0.3, 0.3], [-0.3, 0], [-1, 0]]\n\
         [[blocks]]\nname = \"hr\"\nkind = \"no_slip\"\n\
         shape.polygon = [[1, 1.2], [0.3, 0.3], [0.3, 0], [1, 0]]\n{extra}"
    );
    scene(&text, &[])
}

/// Volume that is not solid, m2.
const FREE: f64 = 4.0 - 2.0 * (0.7 * 0.3 + 0.5 * 0.7 * 0.9);

#[test]
fn a_hopper_loses_nothing_and_stays_symmetric() {
    let mut run = hopper(
        "[[boundaries.bottom.parts]]\nfrom = -0.3\nto = 0.3\nkind = \"outflow\"\n\
         [[gauges]]\nname = \"out\"\nfrom = [-0.3, 0]\nto = [0.3, 0]\ndirection = \"down\"\n\
         material = \"mud\"\n",
    );
    let volume = |run: &dyn Run| {
        let unit = run.plan().units.length.powi(2);
        run.particles().volume.iter().sum::<f64>() * unit
    };
    // The outline is straight in an eighth of a cell.
    assert!((volume(run.as_ref()) / FREE - 1.0).abs() < 1e-3, "{}", volume(run.as_ref()));
    for step in 0..60 {
        run.step().unwrap();
        if step == 3 {
            // Rounding errors grow, and decide later which of two particles is split.
            let [left, right] = [-0.1, 0.1].map(|x| run.velocity_at([x, 0.4]));
            let largest = left[1].abs();
            assert!((left[1] - right[1]).abs() < 1e-6 * largest, "{left:?} {right:?}");
            assert!((left[0] + right[0]).abs() < 1e-6 * largest, "{left:?} {right:?}");
        }
        for &p in &run.particles().position {
            let [x, y] = run.plan().si(p);
            let wall = if y < 0.3 { 0.3 } else { 0.3 + (y - 0.3) * 0.7 / 0.9 };
            assert!(x.abs() <= wall.min(1.0) + 1e-12, "{x} {y}");
        }
    }
    let row = run.row();
    assert!(row.gauges[0].volume > 0.1, "{}", row.gauges[0].volume);
    // With rectangular steps instead of slopes it is 0.3.
    assert!(row.volume_error < 0.45, "{}", row.volume_error);
}

#[test]
fn a_level_in_a_closed_hopper_rests() {
    let mut run = hopper("[boundaries.bottom]\nkind = \"no_slip\"\n");
    for _ in 0..3 {
        run.step().unwrap();
    }
    // Speed of a layer of the height of a cell that runs down.
    let scale = 1000.0 * 10.0 * 0.125 * 0.125 / 100.0;
    let fastest = [[-0.5, 1.0], [0.0, 0.2], [0.0, 1.0], [-0.4, 0.5], [0.7, 1.1]]
        .map(|p| run.velocity_at(p))
        .map(|u| u[0].hypot(u[1]))
        .into_iter()
        .fold(0.0, f64::max);
    assert!(fastest < 1e-6 * scale, "{fastest} {scale}");
}

#[test]
fn the_forces_on_all_walls_are_the_loads() {
    let names = ["hl", "hr", "floor", "stone", "right", "left", "bottom", "top"];
    let gauges: String =
        names.iter().map(|n| format!("[[gauges]]\nname = \"f_{n}\"\non = \"{n}\"\n")).collect();
    let mut run = hopper(&format!(
        "[boundaries.bottom]\nkind = \"no_slip\"\n[[walls]]\nname = \"floor\"\nfrom = [0, 0.25]\n\
         to = [0.25, 0.25]\n[[blocks]]\nname = \"stone\"\nkind = \"free_slip\"\n\
         shape.circle = {{ centre = [0.1, 0.9], radius = 0.17 }}\n{gauges}"
    ));
    run.step().unwrap();
    let mass: f64 = {
        let (p, unit) = (run.particles(), run.plan().units.length.powi(2));
        let of = |k: usize| if p.material[k] == 0 { 1000.0 } else { 1.0 };
        (0..p.len()).map(|k| of(k) * p.volume[k] * unit).sum()
    };
    let sum = run.row().forces.iter().fold([0.0; 2], |[x, y], f| [x + f.x, y + f.y]);
    // The weight is that of the shares in the cells, which the volumes of particles approach.
    assert!((sum[1] / (-10.0 * mass) - 1.0).abs() < 1e-3, "{sum:?} {mass}");
    assert!(sum[0].abs() < 1e-6 * mass, "{sum:?}");
}

#[test]
fn the_gauge_of_a_wall_with_friction_records_its_strength() {
    for degrees in [12.0, 30.0] {
        let lower = LowerWall::Friction(0.4, 0.2);
        let case = slanted_channel(SlantedChannel { degrees, width: 0.25, lower });
        let text = format!("{}[[gauges]]\nname = \"f\"\non = \"lower\"\n", case.scene.text());
        let run = scene(&text, &["accuracy.cells=48", "accuracy.nonlinear_tolerance=1e-4"]);
        let (s, c) = f64::to_radians(degrees).sin_cos();
        let f = run.row().forces[0];
        let (normal, along) = (s * f.x - c * f.y, c * f.x + s * f.y);
        // The wall is 1/cos long; its ends share their cells with the sides.
        assert!((along / (0.08 / c) - 1.0).abs() < 0.04, "{degrees}: {along}");
        assert!((normal / (0.2 / c) - 1.0).abs() < 0.03, "{degrees}: {normal}");
    }
}

#[test]
fn stresses_along_slanted_walls_are_those_of_the_flow() {
    let gauges =
        "[[gauges]]\nname = \"low\"\non = \"lower\"\n[[gauges]]\nname = \"up\"\non = \"upper\"\n";
    let channel = SlantedChannel { degrees: 30.0, width: 0.25, lower: LowerWall::NoSlip };
    let text = format!("{}{gauges}", slanted_channel(channel).scene.text());
    let run = scene(&text, &["accuracy.cells=32"]);
    for (surface, exact) in run.snapshot().stresses.iter().zip([-0.125, 0.125]) {
        assert!(surface.points.len() > 30, "{}", surface.points.len());
        assert!(surface.points.windows(2).all(|p| p[0].along < p[1].along));
        let inner = surface.points.iter().filter(|p| (p.at[0] - 0.5).abs() < 0.4);
        for p in inner {
            assert!((p.shear / exact - 1.0).abs() < 0.02, "{}: {p:?}", surface.name);
            assert!(p.pressing.abs() < 0.02, "{}: {p:?}", surface.name);
        }
    }
}

#[test]
fn the_normal_stress_of_a_fluid_at_rest_is_its_weight() {
    let mut run = hopper(
        "[boundaries.bottom]\nkind = \"no_slip\"\n[[gauges]]\nname = \"slope\"\non = \"hl\"\n\
         [[gauges]]\nname = \"side\"\non = \"left\"\n[[gauges]]\nname = \"floor\"\non = \"bottom\"\n",
    );
    run.step().unwrap();
    let surfaces = run.snapshot().stresses;
    assert_eq!(surfaces.len(), 3);
    for p in surfaces.iter().flat_map(|s| &s.points).filter(|p| p.at[1] < 1.3) {
        let exact = 1e4 * (1.5 - p.at[1]) + 10.0 * 0.5;
        assert!((p.pressing - exact).abs() < 1e-3 * 1.5e4, "{p:?} {exact}");
        assert!(p.shear.abs() < 1.0, "{p:?}");
    }
}

#[test]
fn rotation_on_a_polygon_along_mesh_lines_is_that_on_a_rectangle() {
    let scene_of = |shape: &str| {
        format!(
            "schema = 1\nname = \"step\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\ncells = 8\n[mesh]\n\
             grading = []\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 1\ncoupling_viscosity = 2\n\
             internal_length = 0.1\n[[regions]]\nmaterial = \"fluid\"\n[boundaries]\nleft.kind = \"periodic\"\n\
             right.kind = \"periodic\"\nbottom.kind = \"no_slip\"\ntop = {{ kind = \"no_slip\", velocity_x = 1 }}\n\
             [[blocks]]\nname = \"step\"\nkind = \"no_slip\"\nrotation = 0.3\n{shape}\n"
        )
    };
    let plain = crate::scene(&scene_of("x = [0.25, 0.5]\ny = [0.25, 0.5]"), &[]);
    let polygon = "shape.polygon = [[0.25, 0.25], [0.5, 0.25], [0.5, 0.5], [0.25, 0.5]]";
    let solid = crate::scene(&scene_of(polygon), &[]);
    for k in 0..100 {
        let p = [(f64::from(k % 10) + 0.5) / 10.0, (f64::from(k / 10) + 0.5) / 10.0];
        let (a, b) = (plain.velocity_at(p), solid.velocity_at(p));
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-8), "{p:?} {a:?} {b:?}");
    }
    let [_, _, on_block] = plain.velocity_at([0.25, 0.3]);
    assert!((on_block - 0.3).abs() < 1e-9, "{on_block}");
}

/// Openings between polygons, across the mesh and few cells wide, let through what they should.
#[test]
fn openings_between_polygons_are_open() {
    let flux = |width: f64, cells: u32| {
        let (low, rise) = (0.49, 0.15);
        let high = low + width / 16.0;
        let text = format!(
            "schema = 1\nname = \"opening\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\n\
             cells = {cells}\n[mesh]\ngrading = []\n[time]\nend = 1\n[boundaries]\n\
             left = {{ kind = \"open\", traction_x = 1 }}\nright.kind = \"open\"\n\
             bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n[materials.mud]\n\
             shear_viscosity = 1\n[[regions]]\nmaterial = \"mud\"\nshape = \"everywhere\"\n\
             [[gauges]]\nname = \"flux\"\nfrom = [0.9, 0]\nto = [0.9, 1]\ndirection = \"right\"\n\
             material = \"mud\"\n[[blocks]]\nname = \"low\"\nkind = \"no_slip\"\nshape.polygon = \
             [[0.3, -1], [0.7, -1], [0.7, {}], [0.3, {low}]]\n[[blocks]]\nname = \"high\"\n\
             kind = \"no_slip\"\nshape.polygon = [[0.3, {high}], [0.7, {}], [0.7, 2], [0.3, 2]]\n",
            low + rise,
            high + rise,
        );
        scene(&text, &[]).row().gauges[0].rate
    };
    for (width, most) in [(3.0, 0.03), (2.0, 0.03), (1.3, 0.15)] {
        let error = flux(width, 16) / flux(width, 128) - 1.0;
        assert!(error.abs() < most, "{width} cells: {error}");
    }
}
