//! Invalid scenes are refused with exit code 3, the location or key of the error, and a remedy.

use super::*;

/// A closed box of sand with two walls in it.
const BOX: &str = r#"schema = 1
name = "box"
gravity = [0, -10]

[domain]
x = [0, 2]
y = [0, 1]

[accuracy]
cells = 4
particles_per_cell = 4

[time]
end = 1
max_step = 0.1

[materials.sand]
density = 1
shear_viscosity = 100

[[regions]]
material = "sand"
shape.rectangle.x = [0, 2]
shape.rectangle.y = [0, 1]

[boundaries]
left.kind = "free_slip"
right.kind = "free_slip"
bottom.kind = "free_slip"
top.kind = "free_slip"

[[walls]]
name = "left_wall"
from = [0.5, 0.25]
to = [0.5, 0.75]

[[walls]]
name = "right_wall"
from = [1.5, 0.25]
to = [1.5, 0.75]
"#;

/// An invalid scene: text of the box, its replacement, the text at the reported location ("" if the
/// message names the key instead), and parts of the message.
type Fault<'a> = (&'a str, &'a str, &'a str, &'a [&'a str]);

const FAULTS: &[Fault] = &[
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[blocks]]\nname = \"stone\"\nshape.polygon = [[0.6, 0.3], [1, 0.6], [1, 0.3], [0.6, 0.6]]\n[[walls]]\nname = \"left_wall\"",
        "1, 0.3",
        &["block `stone`: the polygon crosses itself", "order of the outline"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[blocks]]\nname = \"stone\"\nshape.polygon = [[0.6, 0.3], [1, 0.6]]\n[[walls]]\nname = \"left_wall\"",
        "0.6, 0.3",
        &["a polygon of 2 corners", "three corners or more"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[blocks]]\nname = \"stone\"\nshape.polygon = [[0.6, 0.3], [1, 0.3], [1, 0.3], [0.6, 0.6]]\n[[walls]]\nname = \"left_wall\"",
        "",
        &["corners 1 and 2 are the same point", "remove one"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[blocks]]\nname = \"stone\"\nshape.circle = { centre = [4, 0.5], radius = 0.1 }\n[[walls]]\nname = \"left_wall\"",
        "4, 0.5",
        &["block `stone` lies outside the domain", "move it"],
    ),
    (
        "to = [0.5, 0.75]",
        "to = [0.7, 0.75]",
        "0.7",
        &["wall `left_wall` is slanted", "thickness = 0.05"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[gauges]]\nname = \"force\"\non = \"left_wal\"\n[[walls]]\nname = \"left_wall\"",
        "\"left_wal\"",
        &["there is no side, wall or block `left_wal`", "did you mean `left_wall`?"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[gauges]]\nname = \"force\"\non = \"left_wall\"\nmaterial = \"sand\"\n[[walls]]\nname = \"left_wall\"",
        "",
        &["gauge `force` has both `on` and `material`", "remove one of the two"],
    ),
    (
        "shear_viscosity = 100",
        "shear_viscosity = -5",
        "-5",
        &["`sand`: shear_viscosity is -5", "must be above zero"],
    ),
    (
        "shear_viscosity = 100",
        "shear_viscosity = nan",
        "nan",
        &["materials.sand.shear_viscosity", "NaN is not finite", "a finite number"],
    ),
    (
        "shear_viscosity = 100",
        "shear_viscosity = 100\ncoupling_viscosity = 5\ninternal_length = 0.1\n\
         layer_internal_length = 0.33",
        "0.33",
        &["material `sand` has layer_internal_length but no layers", "give layer_viscosity"],
    ),
    (
        "shear_viscosity = 100",
        "shear_viscosity = 100\nlayer_viscosity = 50\nlayer_internal_length = 0.33",
        "0.33",
        &["material `sand` has layer_internal_length but no internal_length", "it may be 0"],
    ),
    ("density = 1", "density = -1", "-1\n", &["`sand`: density is -1", "zero or more"]),
    (
        "shear_viscosity = 100",
        "",
        "",
        &["material `sand` has no viscosity", "give shear_viscosity"],
    ),
    (
        "shape.rectangle.x = [0, 2]",
        "shape.rectangle.x = [-5, 2]",
        "-5",
        &["regions[0]: material `sand` reaches outside the domain", "the domain is 0 to 2"],
    ),
    (
        "to = [0.5, 0.75]",
        "to = [0.6, 0.75]",
        "0.6",
        &["wall `left_wall` is slanted", "follow mesh lines"],
    ),
    (
        "from = [1.5, 0.25]\nto = [1.5, 0.75]",
        "from = [0.55, 0.25]\nto = [0.55, 0.75]",
        "",
        &[
            "left_wall",
            "right_wall",
            "closer than a cell",
            "raise accuracy.cells to at least 20, or move one of the two: to the same x, or 2.500e-1 m",
        ],
    ),
    (
        "to = [0.5, 0.75]",
        "to = [0.5, 1.75]",
        "0.5, 1.75",
        &["wall `left_wall` reaches (0.5, 1.75), outside the domain", "y = 0 to 1"],
    ),
    (
        "shear_viscosity = 100",
        "viscosity = 100",
        "viscosity",
        &["unknown key `viscosity`", "did you mean `shear_viscosity`, `bulk_viscosity`"],
    ),
    ("density = 1", "dnsity = 1", "dnsity", &["unknown key `dnsity`", "did you mean `density`?"]),
    (
        "density = 1",
        "density = true",
        "true",
        &["materials.sand.density", "boolean `true`", "expected a number or an expression"],
    ),
    ("density = 1", "density = \"2 * rho\"", "rho\"", &["unknown name `rho`", "known names are"]),
    (
        "material = \"sand\"",
        "material = \"snad\"",
        "",
        &["regions[0]", "the material `snad`, which does not exist", "did you mean `sand`?"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left.kind = \"periodic\"",
        "",
        &["only one of boundaries.left and boundaries.right is periodic", "on both"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left.kind = \"slippery\"",
        "\"slippery\"",
        &["unknown choice `slippery`", "`no_slip`"],
    ),
    (
        "shear_viscosity = 100",
        "shear_viscosity = 100\nlayer_viscosity = 5",
        "",
        &["regions[0]: the layered material `sand` has no directors", "director = \"random\""],
    ),
    (
        "bottom.kind = \"free_slip\"\ntop.kind = \"free_slip\"",
        "bottom.kind = \"periodic\"\ntop.kind = \"periodic\"",
        "-10",
        &["nothing holds the scene along y, and a net force acts there", "velocity_y"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { velocity_x = 0.25, traction_x = 1 }",
        "0.25, traction",
        &["boundaries.left gives both velocity_x and traction_x", "give one of them"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { velocity_x = 0.25 }",
        "",
        &["normal velocities let", "open a side"],
    ),
    (
        "bottom.kind = \"free_slip\"",
        "bottom.parts = [{ from = 0.5, to = 2.5, kind = \"outflow\" }]",
        "2.5, kind",
        &["boundaries.bottom.parts[0].to is 2.5, outside the side", "x = 0 to 2"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left.parts = [{ from = 0.75, to = 0.25, kind = \"open\" }]",
        "0.25, kind",
        &["boundaries.left.parts[0] has no length: from 0.75 to 0.25", "above `from`"],
    ),
    (
        "bottom.kind = \"free_slip\"",
        "bottom.parts = [{ from = 1, to = 2, kind = \"open\" }, { from = 0.5, to = 1.5, kind = \"outflow\" }]",
        "1, to = 2",
        &[
            "boundaries.bottom.parts[0] begins at 1, inside boundaries.bottom.parts[1], which reaches \
             from 0.5 to 1.5",
            "must not overlap",
        ],
    ),
    (
        "bottom.kind = \"free_slip\"",
        "bottom.parts = [{ from = 0.5, to = 1, kind = \"periodic\" }]",
        "\"periodic\" }",
        &["boundaries.bottom.parts[0] is periodic, but only whole sides can be", "outflow"],
    ),
    (
        "left.kind = \"free_slip\"\nright.kind = \"free_slip\"",
        "left = { kind = \"periodic\", parts = [{ from = 0, to = 0.5, kind = \"open\" }] }\n\
         right.kind = \"periodic\"",
        "[{ from = 0, to",
        &["boundaries.left is periodic and has parts", "remove the parts"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { velocity_x = 0.25, inflow = \"sadn\" }",
        "",
        &["boundaries.left names the material `sadn`", "did you mean `sand`?"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { kind = \"no_slip\", inflow = \"sand\" }",
        "",
        &["boundaries.left lets nothing in: its velocity_x is zero", "give velocity_x = <m/s>"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { velocity_x = \"-1 - y\", inflow = \"sand\" }",
        "",
        &["boundaries.left lets nothing in", "points outwards", "change the sign of velocity_x"],
    ),
    (
        "[boundaries]\nleft.kind = \"free_slip\"\nright.kind = \"free_slip\"",
        "[materials.mud]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"mud\"\n\
         shape.circle = { centre = [1, 0.5], radius = 0.3 }\n[boundaries]\n\
         left.velocity_x = 0.25\nright.kind = \"open\"",
        "0.25",
        &["enters through boundaries.left, but it is not known which", "materials: sand, mud"],
    ),
    (
        "[boundaries]\nleft.kind = \"free_slip\"",
        "[materials.mud]\nshear_viscosity = 1\nlayer_viscosity = 0.5\n[boundaries]\n\
         left = { kind = \"open\", inflow = \"mud\" }",
        "",
        &["boundaries.left lets in the layered material `mud` without", "inflow_director = {"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[sources]]\nname = \"spout\"\nmaterial = \"sand\"\nfrom = [0.75, 0.5]\nto = [1.25, 0.5]\nspeed = 1\n[[walls]]\nname = \"left_wall\"",
        "",
        &["source `spout` pushes incompressible fluid into a closed domain", "open a side"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[sources]]\nname = \"spout\"\nmaterial = \"sand\"\nfrom = [0.75, 1]\nto = [1.25, 0.95]\nspeed = 1\n[[walls]]\nname = \"left_wall\"",
        "1.25",
        &["source `spout` is slanted"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[sources]]\nname = \"spout\"\nmaterial = \"sand\"\nfrom = [0.75, 0.875]\nto = [1.25, 0.875]\nspeed = 1\n[[walls]]\nname = \"left_wall\"",
        "0.875]\nto",
        &[
            "less than a cell between its mouth and the top side",
            "[[boundaries.top.parts]] with velocity_y and inflow",
        ],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[sources]]\nname = \"spout\"\nmaterial = \"sand\"\nfrom = [0.75, 0.5]\nto = [1.25, 0.5]\nspeed = 0.0\n[[walls]]\nname = \"left_wall\"",
        "0.0",
        &["source `spout`: speed is 0", "above zero"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[sources]]\nname = \"spout\"\nmaterial = \"sand\"\nfrom = [0.75, 0.5]\nto = [1.25, 0.5]\nspeed = 1\ndirection = \"left\"\n[[walls]]\nname = \"left_wall\"",
        "",
        &["source `spout`: its direction runs along its mouth", "`up` or `down`"],
    ),
    (
        "[[walls]]\nname = \"left_wall\"",
        "[[sources]]\nname = \"spout\"\nmaterial = \"sand\"\nfrom = [0.75, 0.5]\nto = [1.25, 0.5]\nspeed = 1\nfrom_time = 3\nto_time = 2.5\n[[walls]]\nname = \"left_wall\"",
        "2.5",
        &["source `spout` ends at 2.5 s, before it begins at 3 s"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { kind = \"no_slip\", slip_length = 0.015 }",
        "0.015",
        &["boundaries.left gives both kind and slip_length", "give one of them"],
    ),
    (
        "name = \"left_wall\"",
        "name = \"left_wall\"\nkind = \"free_slip\"\nslip_length = 0.015",
        "0.015",
        &["wall `left_wall` gives both kind and slip_length", "give one of them"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { slip_length = 0.015, wall_friction = 0.35 }",
        "0.35",
        &["boundaries.left gives both slip_length and wall_friction", "give one of them"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left.wall_friction = 0.5",
        "",
        &["a wall has friction, but nothing determines the pressure on it", "[pressure_reference]"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left.slip_length = -0.5",
        "-0.5",
        &["boundaries.left: slip_length is -0.5", "above zero"],
    ),
    (
        "left.kind = \"free_slip\"",
        "left = { slip_length = 0.5, traction_y = 3.5 }",
        "3.5",
        &["boundaries.left gives both a law of the wall and traction_y", "the wall determines"],
    ),
    (
        "bottom.kind = \"free_slip\"",
        "bottom.parts = [{ from = 0.5, to = 1 }]",
        "",
        &["key `kind` is missing", "boundaries.bottom.parts"],
    ),
    (
        "bottom.kind = \"free_slip\"",
        "bottom.parts = [{ from = 0.5, to = 1, kind = \"open\", velocity_x = 1, traction_x = 1 }]",
        "1, traction_x",
        &["boundaries.bottom.parts[0] gives both velocity_x and traction_x", "give one of them"],
    ),
    (
        "bottom.kind = \"free_slip\"",
        "bottom.parts = [{ from = 0.51, to = 1, kind = \"open\" }]",
        "",
        &["boundaries.bottom.parts[0]", "left_wall", "closer than a cell", "raise accuracy.cells"],
    ),
    ("cells = 4", "cells = 0", "", &["accuracy.cells is 0", "give 1 or more"]),
    ("cells = 4", "cells = -4", "-4", &["accuracy.cells", "a whole number, 0 or more"]),
    ("cells = 4", "cells = 100000", "", &["cells along x", "lower accuracy.cells"]),
    (
        "particles_per_cell = 4",
        "particles_per_cell = 5",
        "",
        &["accuracy.particles_per_cell is 5", "a square number"],
    ),
    ("end = 1", "end = 0", "0\nmax_step", &["time.end is 0", "above zero"]),
    ("x = [0, 2]", "x = [2, 0]", "0]\ny", &["domain.x is empty: [2, 0]", "above the first"]),
    ("schema = 1", "schema = 7", "7", &["schema 7 is not known", "`schema = 1`"]),
    ("[domain]", "[domain", "", &["not TOML", "check the TOML syntax"]),
];

/// Faults of [`grains::COLUMN`].
const FAULTS_OF_GRAINS: &[Fault] = &[
    (
        "largest_viscosity = 1e3",
        "shear_viscosity = 5",
        "\"mu\", dyn",
        &["material `sand` has both friction and shear_viscosity", "give one of the two"],
    ),
    (
        "largest_viscosity = 1e3",
        "coupling_viscosity = 5",
        "5\n\n[materials.air]",
        &["material `sand` has both coupling_viscosity and a flow curve", "give coupling_ratio"],
    ),
    (
        "shear_viscosity = 1e-3",
        "shear_viscosity = 1e-3\ncohesion = 2",
        "2\nbackground",
        &["material `air` has cohesion but no friction", "give friction = {"],
    ),
    (
        "shear_viscosity = 1e-3",
        "shear_viscosity = 1e-3\nlargest_viscosity = 7",
        "7\nbackground",
        &["has largest_viscosity but no friction or yield_stress", "or yield_stress = <Pa>"],
    ),
    (
        "largest_viscosity = 1e3",
        "largest_viscosity = 1e3\nsmallest_viscosity = 2e3",
        "2e3",
        &["`sand`: smallest_viscosity 2000 is above largest_viscosity 1000", "between the two"],
    ),
    (
        "background = true",
        "background = true\nyield_stress = 1",
        "",
        &["the background `air` has a flow curve", "a constant viscosity"],
    ),
    (
        "inertia = true",
        "initial_velocity = { x = 1 }",
        "",
        &["initial_velocity is given, but a flow without inertia", "`inertia = true`"],
    ),
    (
        "[boundaries]",
        "[pressure_reference]\nat = [1.5, 1]\n\n[boundaries]",
        "1.5, 1]",
        &["pressure_reference is given, but the boundaries determine", "remove it"],
    ),
    (
        "particles_per_cell = 9",
        "particles_per_cell = 9\nnonlinear_tolerance = 0.5",
        "",
        &["accuracy.nonlinear_tolerance is 0.5"],
    ),
    (
        "static = \"mu\"",
        "static = 0.7",
        "0.6, inertial",
        &["friction.dynamic 0.6 is below friction.static 0.7", "a falling law is not solved"],
    ),
];

/// `[file:line:column]` of a piece of text.
fn place(text: &str, piece: &str) -> String {
    let at = text.find(piece).unwrap_or_else(|| panic!("no {piece:?} in {text}"));
    let before = &text[..at];
    let column = 1 + before.chars().rev().take_while(|&c| c != '\n').count();
    format!("[box.toml:{}:{column}]", 1 + before.matches('\n').count())
}

#[test]
fn the_box_is_valid_and_at_rest() {
    let here = TempFolder::new();
    here.write("box.toml", BOX);
    here.grainscope(&["check", "box.toml"]).exits(0).prints(&["box.toml: ok (box)"]);
    let run = ["run", "box.toml", "--no-recording", "--json"];
    let summary = here.grainscope(&run).exits(0).json();
    assert!(summary["max_speed"].as_f64() < Some(1e-9), "{summary}");
}

#[test]
fn errors_have_a_location_and_a_remedy() {
    let here = TempFolder::new();
    let grains = FAULTS_OF_GRAINS.iter().map(|fault| (grains::COLUMN, fault));
    let all = FAULTS.iter().map(|fault| (BOX, fault)).chain(grains);
    for (scene, (from, to, at, complaints)) in all {
        assert!(scene.contains(from), "{from}");
        let text = scene.replacen(from, to, 1);
        here.write("box.toml", &text);
        for command in ["check", "plan", "run"] {
            let said = here.grainscope(&[command, "box.toml"]).exits(3).complains(complaints);
            assert!(said.out.is_empty(), "{}", said.out);
            let said = said.complains(&["help: "]);
            if !at.is_empty() {
                said.complains(&[&place(&text, at)]);
            }
        }
    }
    assert!(!here.has("runs"), "a refused scene created a folder");
}

/// Nothing determines the pressure of grains that fill a closed box.
#[test]
fn a_closed_box_of_grains_needs_a_pressure() {
    let here = TempFolder::new();
    let friction = "friction = { static = 0.3, grain_diameter = 0.01 }";
    let text = BOX.replacen("shear_viscosity = 100", friction, 1);
    here.write("box.toml", &text);
    let complaints = [
        "`sand` has friction, but nothing determines its pressure: the domain is closed",
        "help: give [pressure_reference] with at = [x, y]",
    ];
    here.grainscope(&["check", "box.toml"]).exits(3).complains(&complaints);
    let point = "[pressure_reference]\nat = [1, 1]\nvalue = 2\n\n[boundaries]";
    here.write("box.toml", text.replacen("[boundaries]", point, 1));
    here.grainscope(&["check", "box.toml"]).exits(0);
    here.write("box.toml", text.replacen("[boundaries]", &point.replace("[1, 1]", "[1, 3]"), 1));
    let complaints = ["the point of pressure_reference lies outside the material"];
    here.grainscope(&["check", "box.toml"]).exits(3).complains(&complaints);
}

#[test]
fn files_that_are_not_scenes_are_refused() {
    let here = TempFolder::new();
    here.write("empty.toml", "");
    let garbage: Vec<u8> =
        (0..10_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    here.write("garbage.toml", garbage);
    here.write("short.toml", b"\x00\x01\x02[[[=\n\x1b[2J");
    here.write("latin.toml", b"name = \"\xe9\"");
    std::fs::create_dir(here.path("folder.toml")).expect("a folder");
    for (file, complaint) in [
        ("empty.toml", "is empty"),
        ("garbage.toml", "larger than 1 MiB"),
        ("short.toml", "not TOML"),
        ("latin.toml", "is not UTF-8 text"),
        ("folder.toml", "is a directory"),
        ("none.toml", "there is no such file"),
        ("no/such/folder/none.toml", "there is no such file"),
    ] {
        for command in ["check", "plan", "run"] {
            let said = here.grainscope(&[command, file]).exits(3);
            let said = said.complains(&[file, complaint, "help: "]);
            assert!(!said.err.contains('\u{1b}'), "{file}: control characters");
        }
    }
    assert!(!here.has("runs"));
}

#[test]
fn invalid_set_assignments_are_refused() {
    let here = TempFolder::new();
    for (set, complaints) in [
        ("alpa=1", ["--set alpa=1: there is no parameter `alpa`", "did you mean `alpha`?"]),
        ("alpha", ["--set alpha: there is no `=`", "write name=value"]),
        ("alpha=", ["no value after `=`", "write name=value"]),
        ("alpha=-1", ["parameter `alpha` is -1, outside its range", "0 to 100"]),
        ("alpha=1/0", ["not finite", "division by zero"]),
        ("materials.grain.density=1", ["no `grain` in materials", "did you mean `grains`?"]),
        ("walls[9].kind=no_slip", ["there is no `walls[9]`", "it has 4 elements"]),
    ] {
        here.grainscope(&["check", "silo", "--set", set]).exits(3).complains(&complaints);
    }
}

/// Every refusal of a scene names the `--set` argument of the value, or the line of the key or of the
/// table that lacks it.
#[test]
fn refusals_name_an_argument_or_a_line() {
    let here = TempFolder::new();
    let text = preset_files().into_iter().find(|p| p.0 == "silo").expect("there").1;
    here.write("s.toml", &text);
    let named = |set: &str| {
        let said = here.grainscope(&["check", "s.toml", "--set", set]).exits(3);
        if flat(&said.err).contains(&format!("--set {set}: ")) {
            assert!(!said.err.contains("s.toml:"), "{set}: {}", said.err);
            return;
        }
        assert!(flat(&said.err).contains("s.toml:"), "{set}: {}", said.err);
        let line = said.err.split("s.toml:").nth(1).and_then(|rest| rest.split(':').next());
        let line = line.and_then(|l| l.parse::<usize>().ok());
        assert!(line.is_some(), "{set}: {}", said.err);
    };
    for set in [
        "accuracy.cells=0",
        "accuracy.cells=100000",
        "accuracy.particles_per_cell=17",
        "accuracy.particles_per_cell=4294967295",
        "accuracy.tolerance=1",
        "accuracy.stabilisation=7",
        "accuracy.max_corrections=0",
        "accuracy.max_corrections=4294967295",
        "time.courant=1e9",
        "time.tolerance=0",
        "time.strain=0",
        "time.end=0",
        "recording.frames=4294967295",
        "recording.glyphs=4294967295",
        "mesh.growth=5",
        "dye.grid.spacing=1e-9",
        "domain.length_scale=1e-6",
        "materials.grains.colour=red",
        "name=a/b",
        "gauges[0].material=sand",
        "regions[0].material=sand",
        "boundaries.left.kind=periodic",
    ] {
        named(set);
    }
}

/// Limits of the process are part of the check of the memory, and a file that may not grow is an
/// error of its write.
#[cfg(target_os = "linux")]
#[test]
fn limits_of_the_process_are_told() {
    let here = TempFolder::new();
    let limited = |limit: &str, run: &str| {
        let program = env!("CARGO_BIN_EXE_grainscope");
        let line = format!("ulimit {limit}; exec {program} {run}");
        let mut command = Command::new("bash");
        command.args(["-c", &line]).current_dir(here.path(".")).env("NO_COLOR", "1");
        Said::new(&[run], command.output().expect("bash"))
    };
    let large = "run silo --set accuracy.cells=64 --steps 1 --no-recording --out large";
    limited("-v 3000000", large).exits(1).complains(&["need about", "has", "left"]);
    assert!(!here.has("large"));
    let small = "run couette_cosserat --set accuracy.cells=8 --steps 400 --out small";
    limited("-f 64", small).exits(1).complains(&["File too large"]);
}
