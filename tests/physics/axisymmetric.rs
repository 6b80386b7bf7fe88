//! Round flows: exact solutions, invariants, and their limit far from the axis.

use crate::{finish, preset, scene, volume};
use grainscope::plan::resolve;
use grainscope::scene::{SceneSource, parse};
use std::f64::consts::PI;

/// A scene of a round vessel; `rest` follows the domain.
fn vessel(x: &str, y: &str, cells: u32, rest: &str) -> String {
    format!(
        "schema = 1\nname = \"vessel\"\n[domain]\ngeometry = \"axisymmetric\"\nx = {x}\ny = {y}\n\
         length_scale = 1\n[accuracy]\ncells = {cells}\nplacement = \"random\"\n[time]\nend = 1\n{rest}"
    )
}

const FLUID: &str = "[materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n";

#[test]
fn uniform_extension_is_exact() {
    let grading =
        "[mesh]\ngrading = [{ towards.x = 0, factor = 6 }, { towards.y = 0.4, factor = 5 }]\n";
    let sides = "[boundaries]\nright = { velocity_x = -0.5, velocity_y = \"y\", inflow = \"fluid\" }\n\
                 bottom = { velocity_x = \"-x/2\", velocity_y = 0 }\n\
                 top = { velocity_x = \"-x/2\", velocity_y = 1 }\n";
    let text = vessel("[0, 1]", "[0, 1]", 6, &format!("{grading}{FLUID}{sides}"));
    let mut run = scene(&text, &["time.end=0.3"]);
    let total = PI;
    finish(run.as_mut(), |run| {
        for k in 0..100 {
            let [x, y] = [(f64::from(k % 10) + 0.3) / 10.0, (f64::from(k / 10) + 0.6) / 10.0];
            let u = run.velocity_at([x, y]);
            assert!((u[0] + 0.5 * x).abs() < 1e-11 && (u[1] - y).abs() < 1e-11, "{x} {y} {u:?}");
        }
        let row = run.row();
        let balance = volume(run, "fluid") - row.volume_in + row.volume_out - total;
        assert!(balance.abs() < 1e-12 * total, "{balance:e}");
    });
    // D:D = 3/2, so the power is 2 eta D:D V = 3 pi.
    assert!((run.row().dissipation - 3.0 * PI).abs() < 1e-9, "{}", run.row().dissipation);
}

#[test]
fn a_thread_resists_extension_with_three_viscosities() {
    // Trouton's ratio: the axial stress of a thread in thin air is 3 eta times the rate.
    let materials = "[materials.thread]\nshear_viscosity = 1\n[materials.air]\nshear_viscosity = 1e-6\n\
                     background = true\n[[regions]]\nmaterial = \"thread\"\n\
                     shape.rectangle = { x = [0, 0.5], y = [0, 1] }\n";
    let sides = "[boundaries]\nright = { kind = \"open\" }\nbottom = { velocity_y = 0 }\n\
                 top = { velocity_y = 1 }\n[[gauges]]\nname = \"pull\"\non = \"top\"\n";
    let run = scene(&vessel("[0, 1]", "[0, 1]", 8, &format!("{materials}{sides}")), &[]);
    let force = run.row().forces[0].y.abs() / (PI * 0.25);
    assert!((force / 3.0 - 1.0).abs() < 1e-5, "{force}");
}

#[test]
fn layers_along_a_pipe_shear_with_their_own_viscosity() {
    let materials = "[materials.fluid]\nshear_viscosity = 5\nlayer_viscosity = 0.5\n[[regions]]\n\
                     material = \"fluid\"\ndirector.angle_degrees = 0\n";
    let sides = "[body_force]\ny = 1\n[boundaries]\nright.kind = \"no_slip\"\n\
                 bottom.kind = \"periodic\"\ntop.kind = \"periodic\"\n";
    let run = scene(&vessel("[0, 1]", "[0, 0.5]", 8, &format!("{materials}{sides}")), &[]);
    for r in [0.0, 0.31, 0.77] {
        let v = run.velocity_at([r, 0.2])[1];
        assert!((v - (1.0 - r * r) / 2.0).abs() < 1e-9, "{r} {v}");
    }
}

#[test]
fn the_mean_stress_of_a_compressible_fluid_is_that_of_its_bulk_viscosity() {
    // u = -x/4, v = -y/2: all three rates but one are equal to that of the bulk, div u = -1.
    let materials = "[materials.fluid]\nshear_viscosity = 2\nbulk_viscosity = 7\n[[regions]]\n\
                     material = \"fluid\"\n";
    let sides = "[boundaries]\nright = { velocity_x = -0.25, velocity_y = \"-y/2\" }\n\
                 bottom = { velocity_x = \"-x/4\", velocity_y = 0 }\n\
                 top = { velocity_x = \"-x/4\", velocity_y = -0.5 }\n";
    let run = scene(&vessel("[0, 1]", "[0, 1]", 6, &format!("{materials}{sides}")), &[]);
    for p in [[0.1, 0.2], [0.6, 0.9]] {
        assert!((run.pressure_at(p) - 7.0).abs() < 1e-9, "{}", run.pressure_at(p));
    }
    // D' = diag(1/12, 1/12, -1/6): 2 eta D':D' + B (div u)^2 = 4/24 + 7 over the volume pi.
    let power = PI * (4.0 / 24.0 + 7.0);
    assert!((run.row().dissipation / power - 1.0).abs() < 1e-9, "{}", run.row().dissipation);
}

#[test]
fn far_from_the_axis_the_flow_is_plane() {
    let text = |radius: f64, geometry: &str| {
        format!(
            "schema = 1\nname = \"far\"\n[domain]\n{geometry}x = [{radius:?}, {:?}]\ny = [0, 1]\n\
             [accuracy]\ncells = 12\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 1\n\
             coupling_viscosity = 2\ninternal_length = 0.1\n[[regions]]\nmaterial = \"fluid\"\n\
             [body_force]\nx = \"sin(3*y)*(x - {radius:?})\"\ny = \"(x - {radius:?})^2 - y\"\n",
            radius + 1.0
        )
    };
    let plane = scene(&text(0.0, ""), &[]);
    let power = plane.row().dissipation;
    // The dissipation per length around the axis differs by the curvature.
    for radius in [10.0, 100.0, 1000.0] {
        let ring = scene(&text(radius, "geometry = \"axisymmetric\"\n"), &[]);
        let error = ring.row().dissipation / (2.0 * PI * (radius + 0.5)) / power - 1.0;
        assert!(error.abs() < 1.0 / radius, "{radius}: {error:e}");
    }
}

#[test]
fn a_level_rests_and_a_rigid_fall_is_rigid() {
    let materials = "[materials.heavy]\nshear_viscosity = 1\ndensity = 1000\n[materials.air]\n\
                     shear_viscosity = 0.001\nbackground = true\n[[regions]]\nmaterial = \"heavy\"\n\
                     shape.rectangle = { x = [0, 1], y = [0, 0.53] }\n[boundaries]\n\
                     right.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n";
    let text = vessel("[0, 1]", "[0, 1]", 9, materials)
        .replace("[domain]", "gravity = [0, -10]\n[domain]");
    let mut run = scene(&text, &["accuracy.placement=jittered", "time.end=0.2"]);
    finish(run.as_mut(), |run| {
        assert!(run.row().max_speed < 1e-8, "{:e}", run.row().max_speed);
    });
    let sides = "[boundaries]\nright = { velocity_x = 0, velocity_y = -1 }\n\
                 bottom = { velocity_y = -1 }\ntop = { velocity_y = -1, inflow = \"fluid\" }\n";
    let run = scene(&vessel("[0, 1]", "[0, 1]", 6, &format!("{FLUID}{sides}")), &[]);
    for p in [[0.0, 0.5], [0.3, 0.2], [0.9, 0.8]] {
        let u = run.velocity_at(p);
        assert!(u[0].abs() < 1e-13 && (u[1] + 1.0).abs() < 1e-13);
    }
}

#[test]
fn a_round_silo_loses_no_volume_and_little_energy() {
    let mut run =
        preset("round_silo", &["accuracy.cells=6", "time.end=1e-3", "recording.times=[]"]);
    let total = volume(run.as_ref(), "grains");
    assert!((total - PI * 4.0 * 4.0).abs() < 1e-11, "{total}");
    finish(run.as_mut(), |run| {
        assert!((volume(run, "grains") - total).abs() < 1e-12 * total);
    });
    assert!(run.row().energy_error.abs() < 0.01, "{}", run.row().energy_error);
    assert!(run.row().gauges[0].volume > 0.5);
}

#[test]
fn impossible_round_scenes_are_refused() {
    let error = |text: &str| {
        let source = SceneSource::new("test", text);
        let scene = parse(&source).unwrap_or_else(|e| panic!("{:?}", e.lines()));
        format!("{:?}", resolve(&scene).expect_err("refused").with_source(&source).lines())
    };
    for (more, message) in [
        ("[boundaries]\nleft.kind = \"no_slip\"\n", "the left side is the axis"),
        (
            "[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n",
            "cannot be periodic",
        ),
    ] {
        let said = error(&vessel("[0, 1]", "[0, 1]", 4, &format!("{FLUID}{more}")));
        assert!(said.contains(message), "{said}");
    }
    let said = error(&vessel("[-1, 1]", "[0, 1]", 4, FLUID));
    assert!(said.contains("distance from the axis"), "{said}");
    let tilted =
        vessel("[0, 1]", "[0, 1]", 4, FLUID).replace("[domain]", "gravity = [1, -1]\n[domain]");
    assert!(error(&tilted).contains("along the radius"), "{}", error(&tilted));
}
