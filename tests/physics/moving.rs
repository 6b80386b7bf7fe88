//! Solids that move through the mesh: swept volumes, exact flows beside them, and runs in which nothing is
//! lost.

use crate::scene;
use grainscope::sim::Run;

/// A channel of 2 m x 1 m with a block in it.
fn channel(sides: &str, block: &str) -> String {
    format!(
        "schema = 1\nname = \"channel\"\n[domain]\nx = [0, 2]\ny = [0, 1]\n[accuracy]\ncells = 8\n\
         [time]\nend = 10\n[materials.fluid]\nshear_viscosity = 2\n[[regions]]\nmaterial = \"fluid\"\n\
         {sides}\n[[blocks]]\nname = \"block\"\n{block}\n"
    )
}

const CLOSED: &str = "[boundaries]\nright.kind = \"no_slip\"\nleft.kind = \"no_slip\"\n\
    bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n";

const OPEN: &str = "[boundaries]\nright.kind = \"outflow\"\nleft.kind = \"free_slip\"\n";

/// Outflow through the right side, m2/s, by Simpson's rule in each cell, which is exact.
fn outflow(run: &dyn Run) -> f64 {
    let n = 8;
    let at = |k: usize, t: f64| run.velocity_at([2.0, (k as f64 + t) / f64::from(n)])[0];
    let cell = |k: usize| (at(k, 1e-9) + 4.0 * at(k, 0.5) + at(k, 1.0 - 1e-9)) / 6.0;
    (0..n as usize).map(cell).sum::<f64>() / f64::from(n)
}

fn volume(run: &dyn Run) -> f64 {
    run.particles().volume.iter().sum::<f64>() * run.plan().units.length.powi(2)
}

/// Particles inside of a solid.
fn inside(run: &dyn Run) -> usize {
    let mesh = &run.plan().mesh;
    run.particles().position.iter().filter(|p| mesh.is_solid_at(**p)).count()
}

#[test]
fn a_piston_pushes_out_what_it_sweeps() {
    let piston =
        "shape.polygon = [[-2, -1], [0.33, -1], [0.33, 2], [-2, 2]]\nvelocity = [0.1, 0]\n";
    for kind in ["free_slip", "no_slip"] {
        let text = channel(OPEN, &format!("{piston}kind = \"{kind}\"\n"));
        let mut run = scene(&text, &["time.max_step=0.37"]);
        let first = volume(run.as_ref());
        for _ in 0..8 {
            let out = outflow(run.as_ref());
            assert!((out / 0.1 - 1.0).abs() < 1e-10, "{kind}: {out}");
            run.step().unwrap();
            assert_eq!(inside(run.as_ref()), 0);
            let row = run.row();
            assert!(row.power_error < 1e-8, "{kind}: {}", row.power_error);
            // What leaves with particles is what is swept, to the volume of some particles.
            let swept = 0.1 * row.time;
            let lost = first - volume(run.as_ref());
            assert!((lost - row.volume_out).abs() < 1e-9, "{lost} {}", row.volume_out);
            assert!((lost - swept).abs() < 0.02, "{kind}: {lost} {swept}");
        }
        assert!(run.row().time > 0.7, "{}", run.row().time);
    }
}

#[test]
fn a_gate_drags_the_fluid_beside_it() {
    // Plane Couette flow between a plate that rises through the open ends and a wall at rest.
    let sides = "[boundaries]\nright.kind = \"no_slip\"\nleft.kind = \"no_slip\"\nbottom.kind = \"outflow\"\n\
                 top.kind = \"outflow\"\n";
    let plate = "shape.polygon = [[-1, -9], [0.53, -9], [0.53, 9], [-1, 9]]\nvelocity = [0, 0.3]\n\
                 kind = \"no_slip\"\n[[gauges]]\nname = \"plate\"\non = \"block\"\n";
    let mut run = scene(&channel(sides, plate), &[]);
    for _ in 0..3 {
        for k in 0..20 {
            let x = 0.55 + 0.07 * f64::from(k);
            let exact = 0.3 * (2.0 - x) / (2.0 - 0.53);
            let [u, v, _] = run.velocity_at([x, 0.5]);
            assert!(u.abs() < 1e-9 && (v - exact).abs() < 1e-7, "{x}: {u} {v} {exact}");
        }
        // The force on the plate, and the power that it gives.
        let force = -2.0 * 0.3 / (2.0 - 0.53);
        let row = run.row();
        assert!((row.forces[0].y / force - 1.0).abs() < 1e-6, "{} {force}", row.forces[0].y);
        assert!((row.power_in / (-0.3 * force) - 1.0).abs() < 1e-6, "{}", row.power_in);
        assert!((row.dissipation / row.power_in - 1.0).abs() < 1e-8);
        run.step().unwrap();
    }
}

#[test]
fn a_stone_that_moves_through_fluid_displaces_none() {
    for kind in ["no_slip", "free_slip"] {
        let stone = format!(
            "shape.circle = {{ centre = [0.6, 0.5], radius = 0.22 }}\nkind = \"{kind}\"\n\
             velocity = [\"0.2*(t < 2)\", \"0.05*sin(3*t)\"]\n"
        );
        let mut run = scene(&channel(CLOSED, &stone), &["time.max_step=0.2"]);
        let first = volume(run.as_ref());
        let free = 2.0 - std::f64::consts::PI * 0.22f64.powi(2);
        assert!((first / free - 1.0).abs() < 1e-3);
        for _ in 0..20 {
            run.step().unwrap();
            assert_eq!(inside(run.as_ref()), 0);
            assert!((volume(run.as_ref()) / first - 1.0).abs() < 1e-12);
            let row = run.row();
            assert!(row.power_error < 1e-8, "{}", row.power_error);
            assert!(row.volume_error < 0.5, "{}", row.volume_error);
        }
        assert!(run.row().time > 1.9, "{}", run.row().time);
    }
}

#[test]
fn a_block_may_pass_mesh_lines_and_slide_along_walls() {
    let floor = "[[walls]]\nname = \"floor\"\nfrom = [1.25, 0.5]\nto = [2, 0.5]\n";
    let sides = format!("{CLOSED}{floor}");
    for kind in ["no_slip", "free_slip"] {
        // All its edges lie on mesh lines at the start; its top slides along the wall.
        let gate = format!(
            "shape.polygon = [[0.5, 0.25], [1, 0.25], [1, 0.5], [0.5, 0.5]]\nkind = \"{kind}\"\n\
             velocity = [0.125, 0]\n"
        );
        let mut run = scene(&channel(&sides, &gate), &["time.max_step=0.5"]);
        let first = volume(run.as_ref());
        assert!((first / (2.0 - 0.125) - 1.0).abs() < 1e-12, "{first}");
        while run.row().time < 2.0 {
            run.step().unwrap();
            assert_eq!(inside(run.as_ref()), 0);
            assert!((volume(run.as_ref()) / first - 1.0).abs() < 1e-12);
            assert!(run.row().divergence_error < 1e-9, "{}", run.row().divergence_error);
        }
    }
}

#[test]
fn blocks_pass_what_is_beside_them_in_gaps_narrower_than_a_cell() {
    let open = "[boundaries]\ntop.kind = \"open\"\nleft.kind = \"no_slip\"\nright.kind = \"no_slip\"\n\
                bottom.kind = \"no_slip\"\n";
    let cell = 1.0 / 8.0;
    for (share, kind) in [(0.2, "no_slip"), (0.5, "free_slip"), (0.8, "no_slip")] {
        let gap = share * cell;
        // A slope whose upper corner is on a side, a block beside that side, and a block on the ground.
        let low = 0.25 + gap;
        let moving = format!(
            "shape.polygon = [[0.3, {low}], [0.8, {low}], [0.8, 0.6], [0.3, 0.6]]\n\
             velocity = [\"0.4*(t < 2)\", \"0.1*(t > 2)\"]\nkind = \"{kind}\"\n\
             [[blocks]]\nname = \"ground\"\nkind = \"{kind}\"\n\
             shape.polygon = [[1, -1], [1.5, -1], [1.5, 0.25], [1, 0.25]]\n\
             [[blocks]]\nname = \"slope\"\nkind = \"{kind}\"\n\
             shape.polygon = [[-1, -1], [-1, 0.5], [0, 0.25], [0.25, 0], [0.25, -1]]\n\
             [[blocks]]\nname = \"lift\"\nkind = \"{kind}\"\nvelocity = [0, 0.1]\n\
             shape.polygon = [[{right}, 0.3], [{right}, 0.5], [1.6, 0.5], [1.6, 0.3]]",
            right = 2.0 - gap,
        );
        let mut run = scene(&channel(open, &moving), &["time.max_step=0.25", "mesh.grading=[]"]);
        let first = volume(run.as_ref());
        let cells = run.plan().mesh.cells();
        for _ in 0..14 {
            run.step().unwrap();
            assert_eq!(inside(run.as_ref()), 0, "{share} {kind}");
            assert_eq!(run.plan().mesh.cells(), cells);
            let row = run.row();
            assert!(row.power_error < 1e-6, "{share} {kind}: {}", row.power_error);
            let lost = first - volume(run.as_ref()) + row.volume_in - row.volume_out;
            assert!(lost.abs() < 1e-12, "{share} {kind}: {lost}");
        }
    }
}

#[test]
fn a_gate_holds_the_grains_until_it_opens() {
    let mut run = crate::preset("gate", &["accuracy.cells=4", "opens=0.05", "speed=2"]);
    let (mut leaked, mut steps) = (0.0, 0);
    crate::finish(run.as_mut(), |run| {
        assert_eq!(inside(run), 0);
        let row = run.row();
        assert!(row.max_speed < 10.0, "{} at {}", row.max_speed, row.time);
        if row.time <= 0.05 {
            // Grains creep into the gap, which is 0.4 cells wide, until the gate carries what is above it.
            // With 12 cells its share of that weight grows from 0.22 at the start to 0.94.
            leaked = row.gauges[0].volume;
            let share = row.forces[0].y / (-1500.0 * 9.81 * 0.2 * 0.1);
            let bounds = if row.time == 0.0 { 0.15..0.35 } else { 0.15..1.0 };
            assert!(bounds.contains(&share), "{share} at {}", row.time);
            assert!(row.time < 0.045 || share > 0.88, "{share} at {}", row.time);
            steps += 1;
        }
    });
    let row = run.row();
    assert!(steps > 1 && leaked < 1e-3, "{steps} {leaked}");
    assert!(row.gauges[0].volume > 0.03, "{}", row.gauges[0].volume);
    assert!(row.energy_error.abs() < 0.05, "{}", row.energy_error);
}

#[test]
fn a_run_with_a_block_that_moves_resumes_bit_for_bit() {
    let piston = "shape.polygon = [[-2, -1], [0.33, -1], [0.33, 2], [-2, 2]]\n\
                  velocity = [\"0.1*(1 + sin(t))\", 0]\n";
    let text = channel(OPEN, piston);
    let mut run = scene(&text, &[]);
    run.step().unwrap();
    run.step().unwrap();
    let state = run.state();
    run.step().unwrap();
    let mut other = scene(&text, &[]);
    other.restore(&state).unwrap();
    other.step().unwrap();
    assert_eq!(run.state_hash(), other.state_hash());
    assert_eq!(run.row().power_in.to_bits(), other.row().power_in.to_bits());
}

#[test]
fn a_block_that_closes_a_chamber_is_refused_when_it_does() {
    // The piston passes the mouth of the side channel at x = 1 and then closes the chamber behind it.
    let sides = "[boundaries]\nright.kind = \"free_slip\"\nleft.kind = \"free_slip\"\nbottom.kind = \
                 \"free_slip\"\ntop.kind = \"free_slip\"\n[[boundaries.top.parts]]\nfrom = 1\nto = 1.25\n\
                 kind = \"outflow\"\n";
    let piston =
        "shape.polygon = [[-2, -1], [0.83, -1], [0.83, 2], [-2, 2]]\nvelocity = [0.1, 0]\n";
    let mut run = scene(&channel(sides, piston), &["time.max_step=0.5"]);
    let error = loop {
        match run.step() {
            Ok(()) => assert!(run.row().time < 5.0),
            Err(error) => break error,
        }
    };
    let said = error.to_string();
    assert!(said.contains("encloses incompressible material"), "{said}");
    assert!(error.remedy().contains("stop the block"), "{}", error.remedy());
    // The mouth is closed when the piston has moved by 0.42 m.
    assert!((run.row().time - 4.2).abs() < 0.6, "{}", run.row().time);
}
