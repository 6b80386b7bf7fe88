//! This module reads scene files: TOML texts that define what a run computes.
//!
//! [`types`] defines the format. A [`SceneSource`] is a text with a name, from a file ([`load()`])
//! or a preset ([`presets::find`]). [`SceneSource::with_sets`] edits the text, and [`parse`] reads
//! it into a [`Scene`]. Values are [`Quantity`]s and [`Field`]s, evaluated in the [`Scope`] of the
//! scene's parameters. Every error is a [`SceneError`] with file, line, column and remedy.

pub mod error;
pub mod expr;
mod headers;
pub mod keys;
mod load;
pub mod parameters;
pub mod presets;
pub mod quantity;
pub mod scope;
pub mod sets;
pub mod source;
pub mod types;

pub use error::{Place, SceneError, closest};
pub use headers::referred;
pub use load::{
    JSON_SCHEMA, SCHEMA, content_hash, is_folder_name, json_schema, load, parse, scene_hash,
    to_toml,
};
pub use quantity::{Field, FieldFn, Quantity};
pub use scope::Scope;
pub use source::SceneSource;
pub use types::*;
