//! This module finds the exact solution of a scene that is a preset with known solution.

use super::{Case, Drive};
use super::{Exact, Fluid, SolCx, couette, poiseuille, solcx, solvi};
use crate::scene::{Scene, Scope, parse, presets, to_toml};

/// The scene as TOML without its numerics, its output and the values of its parameters. Two scenes
/// with equal text pose the same problem.
fn problem(scene: &Scene, preset: &Scene) -> String {
    let mut s = scene.clone();
    s.accuracy = preset.accuracy.clone();
    s.mesh = preset.mesh.clone();
    s.time = preset.time.clone();
    s.recording = preset.recording.clone();
    s.interest = preset.interest.clone();
    s.dye = preset.dye.clone();
    s.description = preset.description.clone();
    s.parameters.values_mut().for_each(|p| p.value = None);
    to_toml(&s)
}

/// The exact solution of a scene if it is a preset with known solution, for any numerics and
/// parameters (`solvi` with its radius of 0.2 only). The solutions of `solcx` and `solvi` hold only
/// at the start.
pub fn exact_of(scene: &Scene) -> Option<Exact> {
    let source = presets::find(&scene.name).ok()?;
    let preset = parse(&source).ok()?;
    if problem(scene, &preset) != problem(&preset, &preset) {
        return None;
    }
    let scope = Scope::new(scene).ok()?;
    let get = |name: &str| scope.get(name);
    let fluid = || {
        let fluid = Fluid {
            shear: 1.0,
            coupling: get("coupling")?,
            internal_length: get("internal_length")?,
        };
        // If either is zero, the fluid is not a Cosserat fluid, and the formulas divide by zero.
        (fluid.coupling > 0.0 && fluid.internal_length > 0.0).then_some(fluid)
    };
    let case: Case = match scene.name.as_str() {
        "solcx" => {
            let c = SolCx { contrast: get("contrast")?, jump: get("jump")? };
            solcx(c, Drive::BodyForce).ok()?
        }
        "solvi" if get("radius")? == 0.2 => solvi(get("contrast")?).ok()?,
        "couette_cosserat" => couette(fluid()?, 1.0),
        "poiseuille_cosserat" => poiseuille(fluid()?, 1.0),
        _ => return None,
    };
    Some(case.exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact(name: &str, sets: &[&str]) -> Option<Exact> {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        let source = presets::find(name).and_then(|s| s.with_sets(&sets)).expect("valid");
        exact_of(&parse(&source).expect("valid"))
    }

    #[test]
    fn presets_with_exact_solutions_are_known() {
        for name in ["solcx", "solvi", "couette_cosserat", "poiseuille_cosserat"] {
            assert!(exact(name, &["accuracy.cells=8", "time.end=0.1"]).is_some(), "{name}");
        }
        assert!(exact("silo", &[]).is_none());
    }

    #[test]
    fn other_problems_under_the_same_name_are_not() {
        assert!(exact("solcx", &["materials.left.shear_viscosity=2"]).is_none());
        assert!(exact("couette_cosserat", &["internal_length=0"]).is_none());
        let at = |r: &str| exact("couette_cosserat", &[r]).expect("exact").velocity;
        let [a, b] = ["internal_length=0.3", "internal_length=0.1"].map(|r| at(r)(0.0, 0.5)[0]);
        assert!((a - 0.5 / 1.3876).abs() < 1e-4 && b > a, "{a} {b}");
    }
}
