//! Tests that fluids at rest stay at rest for any particle placement and any level inside the
//! cells.

use crate::{preset, scene};

/// Values of `accuracy.placement`.
const PLACEMENTS: [&str; 3] = ["regular", "jittered", "random"];
/// `rho g a^2 / eta` of these scenes, m/s.
const SCALE: f64 = 100.0;

#[test]
fn a_level_inside_a_cell_does_not_move() {
    for placement in PLACEMENTS {
        let placement = format!("accuracy.placement={placement}");
        for level in ["level=0.51", "level=0.52", "level=0.5137", "level=0.50001"] {
            for cells in ["accuracy.cells=8", "accuracy.cells=32"] {
                let mut run = preset("hydrostatic", &[&placement, level, cells]);
                run.step().unwrap();
                let speed = run.row().max_speed / SCALE;
                assert!(speed < 1e-12, "{placement}, {level}, {cells}: {speed:e}");
            }
        }
    }
}

#[test]
fn a_level_between_sides_does_not_move_at_any_contrast() {
    for placement in PLACEMENTS {
        let placement = format!("accuracy.placement={placement}");
        for contrast in ["contrast=1", "contrast=1e3", "contrast=1e6"] {
            for level in ["level=0.52", "level=0.5137", "level=0.50001"] {
                let sets = [&placement, level, contrast, "accuracy.quadrature=sides"];
                let mut run = preset("hydrostatic", &sets);
                for _ in 0..5 {
                    run.step().unwrap();
                }
                let speed = run.row().max_speed / SCALE;
                assert!(speed < 1e-8, "{placement}, {level}, {contrast}: {speed:e}");
            }
        }
    }
}

/// Largest initial speed in a unit box, in units of [`SCALE`].
fn speed(gravity: &str, cells: u32, placement: &str, rest: &str) -> f64 {
    let text = format!(
        "schema = 1\nname = \"rest\"\ngravity = {gravity}\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = {cells}\nplacement = \"{placement}\"\n[time]\nend = 1\n{rest}"
    );
    scene(&text, &[]).row().max_speed / SCALE
}

#[test]
fn stratified_fluids_hardly_move() {
    // A linear density is fitted exactly for any placement. Other densities leave the error of the
    // quadratic fit, which falls at third order or faster.
    for (density, at_32) in
        [("1000*(1-y)", 1e-12), ("1000*exp(-3*y)", 1e-7), ("500*(1-tanh((y-0.5)/0.2))", 1e-6)]
    {
        for viscosity in ["100", "100*exp(-6.9*y)"] {
            for placement in PLACEMENTS {
                let material = format!(
                    "[materials.a]\ndensity = \"{density}\"\nshear_viscosity = \"{viscosity}\"\n\
                     [[regions]]\nmaterial = \"a\"\n"
                );
                let [coarse, fine] = [16, 32].map(|n| speed("[0, -10]", n, placement, &material));
                println!("{density}, {viscosity}, {placement}: {coarse:e} {fine:e}");
                assert!(fine < at_32, "{density}, {viscosity}, {placement}: {fine:e}");
                let order = (coarse / fine).log2();
                assert!(
                    fine < 1e-12 || order > 2.0,
                    "{density}, {viscosity}, {placement}: {order}"
                );
            }
        }
    }
}

#[test]
fn the_speed_of_oblique_levels_and_strata_converges() {
    // With gravity at an angle to the mesh, the linear pressure of a cell cannot represent the kink
    // and the curvature of the hydrostatic pressure. Particles do not add to this error.
    let level = "[materials.a]\ndensity = 1000\nshear_viscosity = 100\n\
                 [materials.b]\nshear_viscosity = 100\nbackground = true\n\
                 [[regions]]\nmaterial = \"a\"\nshape.where = \"0.6*(x-0.5) - 0.8*(y-0.5137) > 0\"\n";
    let strata = "[materials.a]\ndensity = \"1000*exp(2*(0.6*x-0.8*y))\"\nshear_viscosity = 100\n\
                  [[regions]]\nmaterial = \"a\"\n";
    for (rest, order) in [(level, 1.8), (strata, 2.7)] {
        let speeds = |placement: &str| [16, 64].map(|n| speed("[6, -8]", n, placement, rest));
        let regular = speeds("regular");
        let jittered = speeds("jittered");
        println!("{regular:?} {jittered:?}");
        for [coarse, fine] in [regular, jittered] {
            assert!(0.5 * (coarse / fine).log2() > order, "{coarse:e} {fine:e}");
        }
        assert!((jittered[1] / regular[1] - 1.0).abs() < 0.05, "{regular:?} {jittered:?}");
    }
}

/// Volume of the particles of the second material, as a share of the total.
fn volume(region: &str, placement: &str) -> f64 {
    let text = format!(
        "schema = 1\nname = \"part\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\ncells = 8\n\
         placement = \"{placement}\"\n[time]\nend = 1\n[materials.a]\nshear_viscosity = 1\n\
         [materials.b]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"a\"\n\
         [[regions]]\nmaterial = \"b\"\n{region}\n"
    );
    let run = scene(&text, &[]);
    let total: f64 = run.particles().volume.iter().sum();
    run.particles().volume_of(1) / total
}

#[test]
fn particle_volumes_equal_the_areas_of_regions() {
    use std::f64::consts::PI;
    for (region, area, tolerance) in [
        ("shape.rectangle = { x = [0.111, 0.733], y = [0.3, 0.377] }", 0.622 * 0.077, 1e-12),
        // Thinner and smaller than the particle spacing.
        ("shape.rectangle = { x = [0.2, 0.9], y = [0.51, 0.5101] }", 0.7e-4, 1e-12),
        ("shape.rectangle = { x = [0.51, 0.5101], y = [0.2, 0.9] }", 0.7e-4, 1e-12),
        ("shape.circle = { centre = [0.47, 0.53], radius = 0.003 }", PI * 9e-6, 0.02 * PI * 9e-6),
        ("shape.circle = { centre = [0.47, 0.53], radius = 0.3 }", PI * 0.09, 1e-4 * PI * 0.09),
        ("shape.where = \"y < 0.4 + 1e-4*sin(pi*x)*pi/2\"", 0.4 + 1e-4, 1e-8),
        ("shape.where = \"x < 0.4 + 1e-4*sin(pi*y)*pi/2\"", 0.4 + 1e-4, 1e-8),
        ("shape.where = \"y < 0.375 + 1e-5*(1+sin(pi*x)*pi/2)\"", 0.375 + 2e-5, 1e-9),
    ] {
        for placement in PLACEMENTS {
            let found = volume(region, placement);
            assert!((found - area).abs() < tolerance, "{region}, {placement}: {found} {area}");
        }
    }
}
