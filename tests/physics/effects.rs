//! Effects that a scene does not use change nothing: a scene with an effect switched off gives the
//! same bits as a scene that does not mention it.

use crate::{preset, scene};
use grainscope::sim::Run;

/// Results of three steps as bits: hash of the state, and diagnostics.
fn bits(mut run: Box<dyn Run>) -> (String, Vec<u64>) {
    for _ in 0..3 {
        run.step().unwrap();
    }
    let r = run.row();
    let mut numbers = vec![r.time, r.dt, r.power_in, r.dissipation, r.max_speed, r.rms_speed];
    numbers.extend([r.divergence_error, r.volume_error, r.potential_energy, r.work]);
    numbers.extend(run.velocity_at([0.1, 0.2]));
    numbers.push(run.pressure_at([0.1, 0.2]));
    (run.state_hash(), numbers.into_iter().map(f64::to_bits).collect())
}

/// A box of one fluid under a moving lid; `more` is added at the top level.
fn lid(more: &str) -> Box<dyn Run> {
    let text = format!(
        "schema = 1\nname = \"lid\"\n{more}\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = 8\n[time]\nend = 10\n\
         [[regions]]\nmaterial = \"fluid\"\n\
         [boundaries]\nleft.kind = \"no_slip\"\nright.kind = \"no_slip\"\n\
         bottom.kind = \"no_slip\"\ntop = {{ kind = \"no_slip\", velocity_x = \"x*(1-x)\" }}\n"
    );
    scene(&text, &[])
}

const FLUID: &str = "materials.fluid = { shear_viscosity = 2, density = 3 }";

#[test]
fn an_effect_switched_off_changes_nothing() {
    let plain = bits(lid(FLUID));
    for (effect, more) in [
        ("rotation: no internal length", "coupling_viscosity = 5, internal_length = 0"),
        ("rotation: no coupling", "coupling_viscosity = 0, internal_length = 0.1"),
        ("rotation: no couple viscosity", "coupling_viscosity = 5, couple_viscosity = 0"),
        ("directors: layer viscosity equal to the viscosity", "layer_viscosity = 2"),
        (
            "bending: both internal lengths zero",
            "coupling_viscosity = 5, internal_length = 0, layer_viscosity = 2, \
             layer_internal_length = 0",
        ),
    ] {
        let fluid = format!("materials.fluid = {{ shear_viscosity = 2, density = 3, {more} }}");
        assert_eq!(bits(lid(&fluid)), plain, "{effect}");
    }
    for (effect, more) in [
        ("gravity", "gravity = [0, 0]"),
        ("acceleration", "acceleration = { x = 0, y = 0 }"),
        ("body force", "body_force = { x = 0, y = 0, couple = 0 }"),
        ("dye", "dye = { lines = [], marks = [] }"),
        ("gauges", "gauges = []"),
        ("walls and blocks", "walls = []\nblocks = []"),
        ("an unused background", "materials.air = { shear_viscosity = 7, background = true }"),
        ("a material without a region", "materials.none = { shear_viscosity = 1e9, density = 9 }"),
        (
            "a material with rotation and layers without a region",
            "materials.none = { shear_viscosity = 1, coupling_viscosity = 1, internal_length = 1, \
             layer_viscosity = 0.1 }",
        ),
        ("schedule", "schedule = []"),
    ] {
        assert_eq!(bits(lid(&format!("{more}\n{FLUID}"))), plain, "{effect}");
    }
}

/// A preset without some of its lines.
fn stripped(text: &str, lines: &[&str], sets: &[&str]) -> Box<dyn Run> {
    let mut text = text.to_string();
    for line in lines {
        assert!(text.contains(line), "{line}");
        text = text.replace(line, "");
    }
    scene(&text, sets)
}

#[test]
fn presets_with_an_effect_switched_off_equal_presets_without_it() {
    const COARSE: &str = "accuracy.cells=3";
    let silo = include_str!("../../presets/silo.toml");
    let never = stripped(
        silo,
        &["coupling_viscosity = \"coupling * 1000\"\n", "internal_length = \"alpha * aperture\"\n"],
        &[COARSE],
    );
    assert_eq!(bits(preset("silo", &[COARSE, "alpha=0"])), bits(never), "silo without rotation");
    // Effects that only observe do not change the flow.
    let (state, _) = bits(preset("silo", &[COARSE]));
    let dye = &silo[silo.find("[dye.grid]").unwrap()..silo.find("[interest]").unwrap()];
    let (undyed, _) = bits(stripped(silo, &[dye], &[COARSE]));
    assert_eq!(undyed, state, "dye");

    const FEW: &str = "accuracy.cells=8";
    let never = stripped(
        include_str!("../../presets/shear_alignment.toml"),
        &[
            "layer_viscosity = \"eta_s\"\n",
            "director = \"random\"\n",
            "[interest]\nquantity = \"alignment\"\nfloor = 1e-3\n",
            "fields = [\"alignment\", \"rotation\", \"speed\"]\n",
        ],
        &[FEW],
    );
    let off =
        ["eta_s=1000", "interest.quantity=\"rms_speed\"", "recording.fields=[\"speed\"]", FEW];
    assert_eq!(bits(preset("shear_alignment", &off)), bits(never), "isotropic shear");
}
