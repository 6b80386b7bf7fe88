//! Patch tests: the elements reproduce solutions in their space up to rounding, for any particles.

use crate::scene;

/// Largest error of a velocity.
const TOLERANCE: f64 = 1e-10;

/// A scene with two materials of one law in cut cells, random particles and a graded mesh.
fn patch(boundaries: &str, extra: &str) -> String {
    format!(
        "schema = 1\nname = \"patch\"\n[domain]\nx = [0, 1.3]\ny = [-0.2, 0.7]\n\
         [mesh]\ngrading = [{{ towards = {{ x = 0.4 }}, factor = 5 }}, {{ towards = {{ y = 0.1 }}, factor = 3 }}]\n\
         [accuracy]\ncells = 5\nplacement = \"random\"\nparticles_per_cell = 9\nseed = 7\n[time]\nsteady = true\n\
         {extra}\
         [[regions]]\nmaterial = \"a\"\n[[regions]]\nmaterial = \"b\"\n\
         shape.circle = {{ centre = [0.6, 0.2], radius = 0.31 }}\n{boundaries}"
    )
}

const COSSERAT: &str = "[materials.a]\nshear_viscosity = 2.5\ncoupling_viscosity = 1.5\ninternal_length = 0.4\n\
                        [materials.b]\nshear_viscosity = 2.5\ncoupling_viscosity = 1.5\ninternal_length = 0.4\n";
const CLASSICAL: &str =
    "[materials.a]\nshear_viscosity = 2.5\n[materials.b]\nshear_viscosity = 2.5\n";
const COMPRESSIBLE: &str = "[materials.a]\nshear_viscosity = 2.5\nbulk_viscosity = 4\n\
                            [materials.b]\nshear_viscosity = 2.5\nbulk_viscosity = 4\n";

/// Checks the linear velocity `L x`, prescribed on all sides, with the rotation equal to the spin.
fn linear(l: [[f64; 2]; 2], materials: &str) {
    let side = format!(
        "velocity_x = \"{:?}*x + {:?}*y\", velocity_y = \"{:?}*x + {:?}*y\"",
        l[0][0], l[0][1], l[1][0], l[1][1]
    );
    let boundaries = ["left", "right", "bottom", "top"]
        .map(|s| format!("[boundaries]\n{s} = {{ {side} }}\n").replace("[boundaries]\n", ""))
        .concat();
    let text = patch(&format!("[boundaries]\n{boundaries}"), materials);
    let run = scene(&text, &[]);
    let spin = 0.5 * (l[1][0] - l[0][1]);
    let cosserat = run.plan().effects.rotation;
    for k in 0..60 {
        let p =
            [0.013 + 1.28 * ((k as f64 * 0.618) % 1.0), -0.19 + 0.88 * ((k as f64 * 0.37) % 1.0)];
        let [u, v, w] = run.velocity_at(p);
        assert!((u - l[0][0] * p[0] - l[0][1] * p[1]).abs() < TOLERANCE, "{p:?}: {u}");
        assert!((v - l[1][0] * p[0] - l[1][1] * p[1]).abs() < TOLERANCE, "{p:?}: {v}");
        if cosserat {
            assert!((w - spin).abs() < TOLERANCE, "{p:?}: {w}");
        }
    }
    if l[0][0] + l[1][1] == 0.0 {
        assert!((run.pressure_at([0.5, 0.3])).abs() < 1e-9);
    }
}

#[test]
fn linear_velocity_with_the_rotation_of_the_spin() {
    for l in [[[0.3, 1.1], [-0.4, -0.3]], [[0.0, -2.0], [2.0, 0.0]], [[0.0, 1.0], [0.0, 0.0]]] {
        linear(l, COSSERAT);
        linear(l, CLASSICAL);
    }
}

#[test]
fn uniform_compression_of_a_compressible_fluid() {
    linear([[-0.3, 0.2], [0.1, -0.5]], COMPRESSIBLE);
}

#[test]
fn a_constant_density_causes_no_flow() {
    let materials = "gravity = [3, -10]\n[materials.a]\nshear_viscosity = 2.5\ndensity = 7\n\
                     [materials.b]\nshear_viscosity = 2e4\ndensity = 7\n";
    let text = patch("", "");
    // Gravity is a top-level key, so it must precede the tables.
    let text = text.replacen("name = \"patch\"\n", "name = \"patch\"\ngravity = [3, -10]\n", 1);
    let text = text.replace(
        "[[regions]]\nmaterial = \"a\"",
        &format!(
            "{}[[regions]]\nmaterial = \"a\"",
            materials.replacen("gravity = [3, -10]\n", "", 1)
        ),
    );
    let run = scene(&text, &[]);
    let speed = run.row().max_speed;
    assert!(speed < 1e-12 * 7.0 * 10.0 / 2.5, "{speed}");
}

#[test]
fn given_tractions_of_a_uniform_stress() {
    // u = (y, 0): sigma_xy = eta. Velocity is given on the left side, traction on the others.
    let boundaries = "[boundaries]\nleft = { velocity_x = \"y\", velocity_y = 0 }\n\
        right = { kind = \"open\", traction_y = 2.5 }\n\
        bottom = { kind = \"open\", traction_x = -2.5 }\ntop = { kind = \"open\", traction_x = 2.5 }\n";
    let run = scene(&patch(boundaries, CLASSICAL), &[]);
    for p in [[0.1, 0.1], [0.7, 0.33], [1.29, -0.19]] {
        let [u, v, _] = run.velocity_at(p);
        assert!((u - p[1]).abs() < TOLERANCE && v.abs() < TOLERANCE, "{p:?} {u} {v}");
    }
}
