//! This module contains the preset scenes of the program.

use super::error::{SceneError, suggestion};
use super::load::parse;
use super::source::SceneSource;

/// Names and TOML texts of the presets.
const PRESETS: [(&str, &str); 28] = [
    ("silo", include_str!("../../presets/silo.toml")),
    ("shear_alignment", include_str!("../../presets/shear_alignment.toml")),
    ("couette_cosserat", include_str!("../../presets/couette_cosserat.toml")),
    ("poiseuille_cosserat", include_str!("../../presets/poiseuille_cosserat.toml")),
    ("rayleigh_taylor", include_str!("../../presets/rayleigh_taylor.toml")),
    ("silo_pencils", include_str!("../../presets/silo_pencils.toml")),
    ("hydrostatic", include_str!("../../presets/hydrostatic.toml")),
    ("solcx", include_str!("../../presets/solcx.toml")),
    ("solvi", include_str!("../../presets/solvi.toml")),
    ("layer_stack", include_str!("../../presets/layer_stack.toml")),
    ("hourglass", include_str!("../../presets/hourglass.toml")),
    ("clepsydra", include_str!("../../presets/clepsydra.toml")),
    ("column_collapse", include_str!("../../presets/column_collapse.toml")),
    ("heap", include_str!("../../presets/heap.toml")),
    ("incline", include_str!("../../presets/incline.toml")),
    ("bingham_slump", include_str!("../../presets/bingham_slump.toml")),
    ("pour", include_str!("../../presets/pour.toml")),
    ("hopper", include_str!("../../presets/hopper.toml")),
    ("funnel_stones", include_str!("../../presets/funnel_stones.toml")),
    ("flow_past_cylinder", include_str!("../../presets/flow_past_cylinder.toml")),
    ("piston", include_str!("../../presets/piston.toml")),
    ("gate", include_str!("../../presets/gate.toml")),
    ("round_silo", include_str!("../../presets/round_silo.toml")),
    ("round_hourglass", include_str!("../../presets/round_hourglass.toml")),
    ("pipe_cosserat", include_str!("../../presets/pipe_cosserat.toml")),
    ("sampson", include_str!("../../presets/sampson.toml")),
    ("falling_drop", include_str!("../../presets/falling_drop.toml")),
    ("squeeze", include_str!("../../presets/squeeze.toml")),
];

/// Names and one-line descriptions of the presets, in display order.
pub fn list() -> Vec<(&'static str, String)> {
    let description = |name, text| {
        parse(&SceneSource::new(name, text)).map(|scene| scene.description).unwrap_or_default()
    };
    PRESETS.iter().map(|&(name, text)| (name, description(name, text))).collect()
}

/// The preset with the given name; the error suggests a similar name.
pub fn find(name: &str) -> Result<SceneSource, SceneError> {
    match PRESETS.iter().find(|preset| preset.0 == name) {
        Some((name, text)) => Ok(SceneSource::new(*name, *text)),
        None => {
            let names: Vec<_> = PRESETS.iter().map(|preset| preset.0).collect();
            let help = suggestion(name, "presets are", &names);
            Err(SceneError::new(format!("there is no preset `{name}`"), help))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scope, json_schema, to_toml};

    #[test]
    fn all_presets_are_valid_and_described() {
        for (name, description) in list() {
            assert!(!description.is_empty(), "{name}");
            let scene = parse(&find(name).expect("listed")).expect(name);
            assert_eq!(scene.name, name);
            Scope::new(&scene).expect(name);
            let again = parse(&SceneSource::new(name, to_toml(&scene))).expect(name);
            assert_eq!(to_toml(&again), to_toml(&scene));
        }
        assert!(json_schema().contains("\"schema\""));
    }

    #[test]
    fn suggests_presets() {
        let error = find("silos").expect_err("not a preset");
        assert!(error.one_line().contains("did you mean `silo`?"), "{}", error.one_line());
    }

    #[test]
    fn silo_values() {
        let scene = parse(&find("silo").expect("listed")).expect("valid");
        let scope = Scope::new(&scene).expect("valid");
        let grains = &scene.materials["grains"];
        let length = grains.internal_length.as_ref().expect("given").eval(&scope).expect("valid");
        assert!((length - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(scene.domain.x[0].eval(&scope).expect("valid"), -3.0);
        assert_eq!(scene.walls.len(), 4);
    }
}
