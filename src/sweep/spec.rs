//! This module defines sweep files: a scene, its varied parameters and the plots of the results.

use super::{Sample, SweepError};
use crate::scene::{SceneError, closest, is_folder_name};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the format of sweep files.
const SCHEMA: u32 = 1;

/// Built-in sweeps: name and text.
const PRESETS: [(&str, &str); 5] = [
    ("fig3", include_str!("../../presets/sweeps/fig3.toml")),
    ("discharge", include_str!("../../presets/sweeps/discharge.toml")),
    ("texture", include_str!("../../presets/sweeps/texture.toml")),
    ("opening", include_str!("../../presets/sweeps/opening.toml")),
    ("cost_of_size", include_str!("../../presets/sweeps/cost_of_size.toml")),
];

/// A sweep, from a file or the command line.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Version of the format.
    #[serde(default)]
    pub schema: u32,
    /// Name of the sweep.
    pub name: String,
    /// Description of the sweep.
    #[serde(default)]
    pub description: String,
    /// Preset name or path of the scene.
    pub scene: String,
    /// Settings of all cases, in the form of `--set`.
    #[serde(default)]
    pub set: Vec<String>,
    /// Varied parameters, in the form of `--vary`.
    #[serde(default)]
    pub vary: Vec<String>,
    /// Sampling of ranges, in the form of `--sample`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample: Option<String>,
    /// Number of seeds per case, as given by `--repeat-seeds`.
    #[serde(default = "one")]
    pub repeat_seeds: u32,
    /// Whether cases write recordings.
    #[serde(default = "yes")]
    pub recordings: bool,
    /// Whether the cases of the first seed are combined in one side-by-side recording at the end.
    #[serde(default)]
    pub side_by_side: bool,
    /// Changes that make the sweep coarse and short.
    #[serde(default)]
    pub quick: Quick,
    /// Plots of the results.
    #[serde(default)]
    pub plots: Vec<PlotSpec>,
}

/// Changes made by `--quick`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quick {
    /// Additional settings, in the form of `--set`.
    #[serde(default)]
    pub set: Vec<String>,
    /// Varied parameters that replace the others; unused if empty.
    #[serde(default)]
    pub vary: Vec<String>,
    /// Number of seeds per case, if it differs.
    #[serde(default)]
    pub repeat_seeds: Option<u32>,
}

/// A plot of a quantity against a parameter, with a curve for each combination of the other
/// parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotSpec {
    /// Title; a default if empty.
    #[serde(default)]
    pub title: String,
    /// Column of the table on the horizontal axis.
    pub x: String,
    /// Column of the table on the vertical axis.
    pub y: String,
    /// Whether the horizontal axis is logarithmic.
    #[serde(default)]
    pub log_x: bool,
    /// Whether the vertical axis is logarithmic.
    #[serde(default)]
    pub log_y: bool,
}

fn one() -> u32 {
    1
}

fn yes() -> bool {
    true
}

impl Spec {
    /// The sweep with the changes of `--quick`.
    pub fn quick(mut self) -> Spec {
        self.set.append(&mut self.quick.set);
        if !self.quick.vary.is_empty() {
            self.vary = std::mem::take(&mut self.quick.vary);
        }
        self.repeat_seeds = self.quick.repeat_seeds.unwrap_or(self.repeat_seeds);
        self
    }

    /// Sampling of ranges; `None` if it is not set.
    pub fn sampling(&self) -> Result<Option<Sample>, SweepError> {
        let read = |text: &String| {
            text.parse().map_err(|e| SweepError::Usage(format!("--sample {text}: {e}")))
        };
        self.sample.as_ref().map(read).transpose()
    }
}

/// Names and descriptions of the built-in sweeps.
pub fn preset_list() -> Vec<(&'static str, String)> {
    let described =
        |(name, text): (&'static str, &str)| Some((name, read(name, text).ok()?.description));
    PRESETS.into_iter().filter_map(described).collect()
}

/// The text of a built-in sweep.
pub fn preset_source(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|preset| preset.0 == name).map(|preset| preset.1)
}

/// Reads a sweep by preset name or path; `None` if the name is neither, and so possibly a scene.
pub fn read_file(name: &str) -> Result<Option<Spec>, SweepError> {
    if let Some(text) = preset_source(name) {
        return read(name, text).map(Some);
    }
    let path = Path::new(name);
    if path.extension().is_none_or(|e| e != "toml") || !path.is_file() {
        return Ok(None);
    }
    // The reader of scenes reports files that are not text or not TOML.
    let Ok(text) = std::fs::read_to_string(path) else { return Ok(None) };
    let is_sweep = toml::from_str::<toml::Table>(&text).is_ok_and(|t| t.contains_key("vary"));
    is_sweep.then(|| read(name, &text)).transpose()
}

fn read(name: &str, text: &str) -> Result<Spec, SweepError> {
    let broken = |message: String, help: &str| {
        SweepError::Scene(SceneError::new(format!("the sweep {name}: {message}"), help))
    };
    let spec: Spec = toml::from_str(text).map_err(|e| {
        let help = "`grainscope sweep presets fig3` shows a valid example";
        broken(e.to_string().trim_end().to_owned(), help)
    })?;
    if !spec.name.is_empty() && !is_folder_name(&spec.name) {
        let help = "it names a folder: use 1 to 100 letters, digits, `_` and `-`";
        return Err(broken(format!("its name is {:?}", spec.name), help));
    }
    if spec.schema != SCHEMA {
        let help = format!("write schema = {SCHEMA}");
        return Err(broken(format!("schema {} is not known", spec.schema), &help));
    }
    Ok(spec)
}

/// The built-in sweep with the most similar name, for error messages.
pub fn similar(name: &str) -> Option<&'static str> {
    closest(name, PRESETS.iter().map(|p| p.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::presets;
    use crate::sweep::List;

    #[test]
    fn presets_make_lists_of_cases() {
        for (name, text) in PRESETS {
            let spec = read(name, text).expect(name);
            assert_eq!(spec.name, name);
            assert!(!spec.description.is_empty() && !spec.plots.is_empty(), "{name}");
            let source = presets::find(&spec.scene).expect(name);
            let whole = List::new(&source, &spec).expect(name);
            let quick = List::new(&source, &spec.clone().quick()).expect(name);
            assert!(quick.cases.len() >= 2 && quick.cases.len() <= whole.cases.len(), "{name}");
        }
    }

    #[test]
    fn a_broken_file_says_where() {
        let said = read("s", "schema = 1\nname = \"s\"\nscen = \"silo\"").expect_err("a typo");
        assert!(said.to_string().contains("unknown field `scen`"), "{said}");
        assert!(read("s", "schema = 2\nname = \"s\"\nscene = \"silo\"").is_err());
    }
}
