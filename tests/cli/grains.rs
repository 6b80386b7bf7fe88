//! Grains with friction, materials with a yield stress, and inertia.

use super::*;

/// A small column of grains that collapses.
pub const COLUMN: &str = r#"schema = 1
name = "column"
inertia = true
gravity = [0, -1]

[parameters.mu]
default = 0.32
min = 0
max = 1
label = "friction at rest"

[domain]
x = [0, 3]
y = [0, 1.25]
length_scale = 1

[accuracy]
cells = 8
particles_per_cell = 9

[time]
end = 0.5

[recording]
frames = 2
colour_by = "yielded"
fields = ["speed", "pressure", "inertial_number", "yielded"]

[materials.sand]
density = 1
friction = { static = "mu", dynamic = 0.6, inertial_number = 0.4, grain_diameter = "1/30" }
largest_viscosity = 1e3

[materials.air]
density = 1e-3
shear_viscosity = 1e-3
background = true

[[regions]]
material = "sand"
shape.rectangle = { x = [0, 1], y = [0, 1] }

[boundaries]
bottom.kind = "no_slip"
top.kind = "open"
"#;

/// The flow down an incline is steady, so it needs no step; its discharge is that of Bagnold's profile.
#[test]
fn a_steady_flow_takes_no_step() {
    let here = TempFolder::new();
    let sets = ["--set", "time.steady=true"];
    here.grainscope(&[&["run", "incline", "--out", "r", "--json"], &sets[..]].concat()).exits(0);
    let summary = here.read("r/summary.json");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("a summary");
    assert_eq!(summary["steps"], 0);
    let rate = summary["gauges"]["discharge"]["rate"].as_f64().expect("a rate");
    assert!((rate / 0.691765 - 1.0).abs() < 0.005, "{rate}");
    let plan = here.grainscope(&[&["plan", "incline"], &sets[..]].concat()).exits(0);
    assert!(!plan.out.contains("advection"), "{}", plan.out);
}

#[test]
fn times_are_needed_unless_the_flow_is_steady() {
    let here = TempFolder::new();
    let column = COLUMN.replace("end = 0.5", "steady = true");
    here.write("inertia.toml", &column);
    let refused = here.grainscope(&["check", "inertia.toml"]).exits(3);
    assert!(refused.err.contains("steady") && refused.err.contains("inertia"));
    here.write("still.toml", column.replace("inertia = true\n", ""));
    here.grainscope(&["check", "still.toml"]).exits(0);
    here.write("endless.toml", COLUMN.replace("end = 0.5", ""));
    let refused = here.grainscope(&["check", "endless.toml"]).exits(3);
    assert!(refused.err.contains("time.end is missing"), "{}", refused.err);
}

#[test]
fn fields_of_grains_are_recorded_and_exported() {
    let here = TempFolder::new();
    here.write("column.toml", COLUMN);
    here.grainscope(&["run", "column.toml", "--out", "r"]).exits(0);
    let table = here.read("r/series.csv");
    let header = table.lines().next().expect("a header");
    assert!(header.contains(",ill_posed_share,"), "{header}");
    let summary = here.json("r/summary.json");
    let share = summary["ill_posed_share"].as_f64().expect("a share");
    assert!((0.0..=1.0).contains(&share), "{share}");
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("inertial numbers at which the law of friction"), "{warnings}");
    here.grainscope(&["export", "r", "--format", "csv", "--out", "frames"]).exits(0);
    let names: Vec<String> = std::fs::read_dir(here.path("frames"))
        .expect("a folder")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with("fields"))
        .collect();
    let last = names.iter().max().expect("a frame");
    let fields = Table::read(&here.read(&format!("frames/{last}")));
    let known = |name: &str| -> Vec<f64> {
        fields.numbers(name).into_iter().filter(|v| v.is_finite()).collect()
    };
    let (yielded, numbers) = (known("yielded"), known("inertial_number"));
    // Grains fill more than a fifth of the domain, and the field has no value elsewhere.
    let all = fields.numbers("yielded").len();
    assert!(yielded.len() * 5 > all && yielded.len() * 2 < all, "{} {all}", yielded.len());
    // Exported samples are interpolated between those of the field.
    let whole = yielded.iter().filter(|v| [0.0, 1.0].contains(v)).count();
    assert!(yielded.iter().all(|v| (0.0..=1.0).contains(v)));
    assert!(whole * 10 > yielded.len() * 9 && yielded.contains(&1.0), "{whole}");
    assert_eq!(numbers.len(), yielded.len());
    assert!(numbers.iter().all(|&i| (0.0..=4.01).contains(&i)));
    for field in ["yielded", "inertial_number"] {
        here.grainscope(&["film", "r", "-o", "a.png", "--field", field]).exits(0);
    }
}

#[test]
fn fields_without_such_a_material_are_left_out() {
    let here = TempFolder::new();
    let fields = r#"recording.fields=["speed","inertial_number","yielded"]"#;
    let run = ["run", "couette_cosserat", "--set", fields, "--steps", "1", "--out", "r"];
    here.grainscope(&[&run[..], &["--set", "accuracy.cells=4"]].concat()).exits(0);
    assert!(!here.read("r/series.csv").contains("ill_posed_share"));
    assert!(here.json("r/summary.json").get("ill_posed_share").is_none());
    let complaint = "no field `yielded` was recorded; expected one of: material, speed";
    let film = ["film", "r", "-o", "a.png", "--field", "yielded"];
    here.grainscope(&film).exits(2).complains(&[complaint]);
}

#[test]
fn the_plan_states_flow_curves_pressure_and_inertia() {
    let here = TempFolder::new();
    here.write("column.toml", COLUMN);
    let text = ["plan", "column.toml", "--no-measure"];
    here.grainscope(&text).exits(0).prints(&[
        "+ flow curves",
        "sand: friction, well posed without an internal length for I = 0.0136 to 1.81, viscosity \
         0.001 to 1000 Pa s",
        "- the zero of the pressure",
        "the boundaries determine the pressure",
        "+ inertia",
        "inertia of the rotation   left out",
        "iterations of the flow curves, momentum",
    ]);
    let closed = COLUMN.replace("top.kind = \"open\"\n", "");
    here.write(
        "closed.toml",
        closed.replace("dynamic = 0.6, ", "").replace("inertia = true\n", ""),
    );
    let list = here.grainscope(&["plan", "closed.toml", "--no-measure", "--json"]).exits(0).json();
    let effect = |name: &str| {
        let effects = list["effects"].as_array().expect("a list");
        let found = effects.iter().find(|e| e["name"] == name).expect("an effect");
        (found["solved"].as_bool(), found["why"].to_string())
    };
    let (solved, why) = effect("flow curves");
    assert!(solved == Some(true) && why.contains("for I = none"), "{why}");
    let (solved, why) = effect("the zero of the pressure");
    assert!(solved == Some(true) && why.contains("the highest background, 0 Pa at ("), "{why}");
    assert_eq!(effect("inertia"), (Some(false), "\"creeping flow\"".into()));
}

#[test]
fn friction_can_be_scheduled() {
    let here = TempFolder::new();
    let change = "\n[[schedule]]\ntime = 0.2\nset = { \"materials.sand.friction.static\" = 0.5 }\n\
                  \n[[schedule]]\ntime = 0.3\nset = { \"materials.sand.friction.grain_diameter\" = 0.01, \
                  mu = 0.4 }\n";
    here.write("plain.toml", COLUMN);
    here.write("column.toml", format!("{COLUMN}{change}"));
    for name in ["plain", "column"] {
        let run = ["run", &format!("{name}.toml"), "--no-recording", "--json", "--out", name];
        here.grainscope(&run).exits(0);
    }
    let speed = |run: &str| here.json(&format!("{run}/summary.json"))["max_speed"].as_f64();
    assert!(speed("column") < speed("plain"), "{:?} {:?}", speed("column"), speed("plain"));
    let wrong = change.replace("friction.static", "friction.statics");
    here.write("wrong.toml", format!("{COLUMN}{wrong}"));
    let complaint = "`materials.sand.friction.statics` cannot be scheduled";
    here.grainscope(&["check", "wrong.toml"]).exits(3).complains(&[complaint]);
}

#[test]
fn a_run_of_grains_goes_on_to_the_last_bit() {
    let here = TempFolder::new();
    here.write("column.toml", COLUMN);
    let run = |out: &str, steps: &str| {
        let run = ["run", "column.toml", "--no-recording", "--out", out, "--steps", steps];
        here.grainscope(&run).exits(0);
    };
    run("whole", "6");
    run("parts", "3");
    here.grainscope(&["resume", "parts", "--steps", "6"]).exits(0);
    let table = |run: &str| Table::read(&here.read(&format!("{run}/series.csv")));
    assert_eq!(table("whole").without("wall"), table("parts").without("wall"));
    let summary = |run: &str| here.json(&format!("{run}/summary.json"));
    assert_eq!(summary("whole")["state_hash"], summary("parts")["state_hash"]);
    // The largest share of a run is part of the warning.
    assert_eq!(summary("whole")["warnings"], summary("parts")["warnings"]);
}
