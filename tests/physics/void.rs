//! Materials with nothing around them: rest, forces, falls, cost, and the comparison with thin air.

use crate::{finish, scene};
use grainscope::sim::Run;
use grainscope::{plan, scene as scenes};

/// Mud below a surface in a closed box with rough walls.
const BOX: &str = r#"schema = 1
name = "box"
background = "void"
gravity = [0, -10]
[domain]
x = [0, 1]
y = [0, 1]
length_scale = 1
[accuracy]
cells = 8
[time]
end = 1
[materials.mud]
density = 1000
shear_viscosity = 100
[[regions]]
material = "mud"
shape.where = "y < 0.5"
[boundaries]
left.kind = "no_slip"
right.kind = "no_slip"
bottom.kind = "no_slip"
top.kind = "no_slip"
"#;

/// Speed at which the weight would move the mud of [`BOX`], m/s.
const NATURAL: f64 = 1000.0 * 10.0 / 100.0;

#[test]
fn a_level_surface_rests_at_any_height_with_its_pressure() {
    for height in [0.31, 0.5, 0.52, 0.6249, 0.7] {
        for inertia in [false, true] {
            let text = BOX.replace("y < 0.5", &format!("y < {height}"));
            let text = text.replace("[domain]", &format!("inertia = {inertia}\n[domain]"));
            let mut run = scene(&text, &["time.max_step=0.1"]);
            for _ in 0..4 {
                assert!(run.row().max_speed < 1e-10 * NATURAL, "{height}: {}", run.row().max_speed);
                for y in [0.05, 0.2, height - 0.01] {
                    let off = run.pressure_at([0.3, y]) - 1e4 * (height - y);
                    assert!(off.abs() < 1e-6 * 1e4, "{height}, {y}: {off}");
                }
                run.step().unwrap();
            }
        }
    }
}

#[test]
fn the_power_under_a_sloping_surface_is_that_of_a_mesh_that_follows_it() {
    // With the density, gravity, side and viscosity as units; see `verify free-surfaces`.
    for (slope, exact) in [(0.1, 3.9028e-5), (0.4, 6.3055e-4), (1.0, 3.3362e-3), (3.0, 3.9332e-3)] {
        for (cells, bound) in [(8, 0.06), (16, 0.025), (32, 0.012)] {
            let text = BOX.replace("y < 0.5", &format!("y < 0.5 + {slope}*(x - 0.5)"));
            let run = scene(&text, &[&format!("accuracy.cells={cells}")]);
            let power = run.row().power_in / (1e4 * 1e4 / 100.0);
            let error = power / exact - 1.0;
            assert!(error.abs() < bound, "slope {slope}, {cells} cells: {error}");
            assert!(run.row().power_error < 1e-10);
        }
    }
}

/// Mud that slumps over a floor with mud on it.
fn slump(around: &str) -> String {
    format!(
        "schema = 1\nname = \"slump\"\n{around}\ngravity = [0, -10]\n[domain]\nx = [0, 4]\ny = [0, 1.5]\n\
         length_scale = 1\n[accuracy]\ncells = 8\n[time]\nend = 2\n[materials.mud]\ndensity = 1000\n\
         shear_viscosity = 1000\n[materials.air]\nshear_viscosity = 0.001\nbackground = true\n[[regions]]\n\
         material = \"mud\"\nshape.rectangle = {{ x = [0, 1], y = [0, 1] }}\n[[regions]]\nmaterial = \
         \"mud\"\nshape.rectangle = {{ x = [0, 4], y = [0, 0.25] }}\n[boundaries]\nleft.kind = \
         \"no_slip\"\nright.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n"
    )
}

/// Energy lost by a run, and dissipated in it.
fn energies(run: &mut dyn Run) -> [f64; 2] {
    let first = run.row().potential_energy;
    finish(run, |_| ());
    [first - run.row().potential_energy, run.row().dissipated]
}

#[test]
fn a_slump_in_a_void_is_that_in_air_a_million_times_thinner_at_less_cost() {
    let (mut void, mut air) = (scene(&slump("background = \"void\""), &[]), scene(&slump(""), &[]));
    let efforts = [&void, &air].map(|run| run.factor_effort().all_flops);
    assert!(efforts[0] < 0.4 * efforts[1], "{efforts:?}");
    let unknowns = [&void, &air].map(|run| run.unknowns()[0] as f64);
    assert!(unknowns[0] < 0.5 * unknowns[1], "{unknowns:?}");
    // The mud fills 1.75 of 6 m2.
    let numbers = [&void, &air].map(|run| run.particles().len() as f64);
    assert!(numbers[0] < 0.3 * numbers[1], "{numbers:?}");
    let [lost, dissipated] = energies(void.as_mut());
    let [in_air, _] = energies(air.as_mut());
    assert!((lost / in_air - 1.0).abs() < 0.01, "{lost} {in_air}");
    assert!((lost - dissipated).abs() < 0.01 * lost, "{lost} {dissipated}");
}

#[test]
fn a_resumed_run_equals_the_uninterrupted_one() {
    for inertia in ["", "inertia = true\n"] {
        let text = slump(&format!("{inertia}background = \"void\""));
        let mut whole = scene(&text, &[]);
        (0..3).for_each(|_| whole.step().unwrap());
        let mut resumed = scene(&text, &[]);
        resumed.restore(&whole.state()).unwrap();
        for run in [&mut whole, &mut resumed] {
            (0..4).for_each(|_| run.step().unwrap());
        }
        assert_eq!(whole.state_hash(), resumed.state_hash());
        let at = [0.5, 0.3];
        assert_eq!(whole.velocity_at(at), resumed.velocity_at(at));
    }
}

#[test]
fn material_that_nothing_holds_falls_freely_with_inertia_and_is_refused_without() {
    let text = BOX
        .replace("where = \"y < 0.5\"", "circle = { centre = [0.5, 0.6], radius = 0.2 }")
        .replace("gravity", "inertia = true\ngravity");
    let mut run = scene(&text, &["time.end=0.2", "time.max_step=0.02", "gravity=[0, -5]"]);
    let height = |run: &dyn Run| {
        let (p, plan) = (run.particles(), run.plan());
        let moment = (0..p.len()).map(|k| p.volume[k] * plan.si(p.position[k])[1]);
        moment.sum::<f64>() / p.volume.iter().sum::<f64>()
    };
    let first = height(&*run);
    finish(run.as_mut(), |_| ());
    let fallen = first - height(&*run);
    assert!((fallen / (0.5 * 5.0 * 0.04) - 1.0).abs() < 0.01, "{fallen}");

    let creeping = text.replace("inertia = true\n", "");
    let source = scenes::SceneSource::new("box", creeping);
    let plan = plan::resolve(&scenes::parse(&source).unwrap()).unwrap();
    let Err(failed) = grainscope::sim::start(std::sync::Arc::new(plan)) else { panic!("no flow") };
    assert!(failed.to_string().contains("nothing holds the material near"), "{failed}");
    assert!(failed.remedy().contains("inertia = true"), "{}", failed.remedy());
}

#[test]
fn material_that_encloses_a_void_is_named() {
    assert!(scene(BOX, &[]).warnings().is_empty());
    let text = BOX.replace("y < 0.5", "y < 0.5 && sqrt((x - 0.5)^2 + (y - 0.25)^2) > 0.17");
    let run = scene(&text, &["accuracy.cells=12"]);
    let said: Vec<String> = run.warnings().iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|w| w.contains("encloses a void near (0.")), "{said:?}");
}

#[test]
fn what_a_void_does_not_combine_with_is_refused_with_its_line() {
    for (more, what) in [
        ("[pressure_reference]\nat = [0.5, 0.5]\nvalue = 0\n", "pressure_reference"),
        ("[body_force]\nx = 1\n", "body force"),
        (
            "[[blocks]]\nname = \"ball\"\nkind = \"no_slip\"\nshape.circle = { centre = [0.5, 0.2], radius = 0.1 }\n",
            "solids of any shape",
        ),
    ] {
        let source = scenes::SceneSource::new("box", format!("{BOX}{more}"));
        let refused = plan::resolve(&scenes::parse(&source).unwrap()).unwrap_err().to_string();
        assert!(refused.contains(what) && refused.contains("void"), "{refused}");
    }
}
