//! Tests of commands that do not run a simulation.

use super::*;

#[test]
fn presets_are_listed_with_descriptions() {
    let here = TempFolder::new();
    let list = here.grainscope(&["presets"]).exits(0);
    let files = preset_files();
    assert_eq!(list.out.lines().count(), files.len());
    for (name, _) in files {
        let line = list.out.lines().find(|l| l.split_whitespace().next() == Some(&name));
        let words = line.unwrap_or_else(|| panic!("{name} is missing")).split_whitespace().count();
        assert!(words > 4, "{line:?} does not describe it");
    }
}

#[test]
fn a_preset_is_shown_as_it_is_written() {
    let here = TempFolder::new();
    for (name, text) in preset_files() {
        let shown = here.grainscope(&["presets", "show", &name]).exits(0);
        assert_eq!(shown.out.trim_end(), text.trim_end(), "{name}");
    }
    let remedy = ["no preset `sillo`", "did you mean `silo`?"];
    here.grainscope(&["presets", "show", "sillo"]).exits(3).complains(&remedy);
    here.grainscope(&["run", "sillo"]).exits(3).complains(&remedy);
}

#[test]
fn every_preset_is_valid_and_has_a_plan() {
    let here = TempFolder::new();
    for (name, _) in preset_files() {
        here.grainscope(&["check", &name]).exits(0).prints(&["ok"]);
        let plan = here.grainscope(&["plan", &name, "--json"]).exits(0).json();
        assert_eq!(plan["scene"], *name);
        assert!(plan["unknowns"].as_u64() > Some(100) && plan["pressure_unknowns"].is_u64());
        assert!(plan["cells"].as_array().is_some_and(|c| c.len() == 2));
        let effects = plan["effects"].as_array().expect("effects");
        for effect in effects {
            assert!(effect["solved"].is_boolean(), "{effect}");
            assert!(effect["why"].as_str().is_some_and(|why| !why.is_empty()), "{effect}");
        }
        let text = here.grainscope(&["plan", &name]).exits(0);
        let names = effects.iter().filter_map(|e| e["name"].as_str());
        text.prints(&names.collect::<Vec<_>>());
    }
}

#[test]
fn without_an_internal_length_no_rotation_is_planned() {
    let here = TempFolder::new();
    let plan = |alpha: &str| {
        let sets = ["--set", "accuracy.cells=3", "--set", alpha];
        here.grainscope(&[&["plan", "silo", "--json"], &sets[..]].concat()).exits(0).json()
    };
    let rotation = |plan: &Value| -> Value {
        let effects = plan["effects"].as_array().expect("effects");
        effects.iter().find(|e| e["name"] == "Cosserat rotation").expect("listed").clone()
    };
    let (with, without) = (plan("alpha=1/3"), plan("alpha=0"));
    assert_eq!(rotation(&with)["solved"], true);
    assert_eq!(rotation(&without)["solved"], false);
    assert_eq!(rotation(&without)["unknowns"], 0);
    let unknowns = |plan: &Value| plan["unknowns"].as_u64().expect("a number");
    assert_eq!(3 * unknowns(&without), 2 * unknowns(&with));
    let [all, lost] = [unknowns(&with), rotation(&with)["unknowns"].as_u64().expect("a number")];
    assert_eq!(all - lost, unknowns(&without));
}

#[test]
fn layers_stiffer_than_their_matrix_are_allowed_with_a_warning() {
    let here = TempFolder::new();
    let sets = ["--set", "materials.pencils.layer_viscosity=5000"];
    here.grainscope(&[&["check", "silo_pencils"], &sets[..]].concat()).exits(0).complains(&[
        "warning:",
        "`pencils`",
        "5.000 times shear_viscosity",
        "not swapped",
    ]);
}

#[test]
fn the_schema_is_json_and_names_every_key_of_the_presets() {
    let here = TempFolder::new();
    let schema = here.grainscope(&["schema"]).exits(0).json();
    let properties = schema["properties"].as_object().expect("properties");
    for (name, text) in preset_files() {
        let scene: toml::Table = toml::from_str(&text).expect("TOML");
        for key in scene.keys() {
            assert!(properties.contains_key(key), "{name}: {key}");
        }
    }
}

#[test]
fn completions_and_manual_list_the_commands() {
    let here = TempFolder::new();
    let commands = ["run", "plan", "check", "presets", "schema"];
    let bash = here.grainscope(&["completions", "bash"]).exits(0);
    bash.prints(&["_grainscope()", "complete -F _grainscope", "--no-recording"]).prints(&commands);
    let manual = here.grainscope(&["man"]).exits(0);
    manual.prints(&[".TH grainscope 1", ".SH SYNOPSIS"]).prints(&commands);
}

#[test]
fn help_lists_the_exit_codes() {
    let here = TempFolder::new();
    let help = here.grainscope(&["--help"]).exits(0);
    help.prints(&["Examples:", "Exit codes:", "130  interrupted"]);
    let version = here.grainscope(&["--version"]).exits(0);
    assert_eq!(version.out.trim(), concat!("grainscope ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn usage_errors_exit_with_2() {
    let here = TempFolder::new();
    here.grainscope(&[]).exits(2);
    for (arguments, complaint) in [
        (&["fly"] as &[_], "unrecognized subcommand 'fly'"),
        (&["run"], "<SCENE>"),
        (&["run", "silo", "--steps", "many"], "invalid value 'many'"),
        (&["run", "silo", "--port", "70000"], "70000"),
        (&["run", "silo", "--no-recording", "--save", "a.rrd"], "cannot be used with"),
        (&["run", "silo", "--until", "soon"], "give a time in seconds"),
        (&["run", "silo", "--until", "5"], "--set time.end=5"),
        (&["run", "silo", "--until=-1"], "--until -1"),
        (&["completions", "klingon"], "invalid value 'klingon'"),
    ] {
        here.grainscope(arguments).exits(2).complains(&[complaint]);
    }
    assert!(!here.has("runs"));
}

#[test]
fn a_closed_output_pipe_is_not_an_error() {
    let here = TempFolder::new();
    let mut child = here
        .command(&["schema"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("an end");
    Said::new(&["schema"], output).exits(0);
}

#[test]
fn the_page_of_columns_is_that_of_the_program() {
    let here = TempFolder::new();
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/columns.md");
    let said = here.grainscope(&["columns"]).exits(0);
    assert_eq!(said.out.trim(), std::fs::read_to_string(page).expect("a page").trim());
}
