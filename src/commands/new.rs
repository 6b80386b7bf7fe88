//! This module implements `grainscope new`: a commented skeleton of a scene.

use super::{Failure, print};
use crate::scene::is_folder_name;
use std::io::Write;
use std::path::PathBuf;

/// Write a commented skeleton of a scene into the present folder: my_scene.toml, and its schema.
#[derive(clap::Args)]
pub struct Args {
    /// Name of the scene
    name: String,
}

const SKELETON: &str = include_str!("../../assets/skeleton.toml");
/// Name of the file with the schema, by which editors complete and check scenes.
const SCHEMA: &str = "grainscope.schema.json";

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let name = args.name.strip_suffix(".toml").unwrap_or(&args.name);
    if !is_folder_name(name) {
        return Err(Failure::Usage(format!(
            "`{name}` is not a name for a scene: use letters, digits, - and _, such as my_silo"
        )));
    }
    let path = PathBuf::from(format!("{name}.toml"));
    // An existing file is never overwritten, not even by a race.
    let text = SKELETON.replace("{name}", name).replace("{schema}", SCHEMA);
    let written = std::fs::File::create_new(&path).and_then(|mut f| f.write_all(text.as_bytes()));
    written.map_err(|e| match e.kind() {
        std::io::ErrorKind::AlreadyExists => Failure::Environment(format!(
            "{} exists already: it is left as it is; choose another name",
            path.display()
        )),
        _ => Failure::Environment(format!("{} cannot be written: {e}", path.display())),
    })?;
    let mut files = path.display().to_string();
    let schema = std::fs::File::create_new(SCHEMA);
    if let Ok(mut file) = schema
        && file.write_all(crate::scene::json_schema().as_bytes()).is_ok()
    {
        files += &format!(" and {SCHEMA}");
    }
    print(&format!(
        "wrote {files}\n  grainscope run {0}        computes it\n  grainscope explore {0}    edits \
         and runs it in a page\n  grainscope plan {0}       says what is solved, and why",
        path.display()
    ))
}
