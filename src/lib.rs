//! This crate computes the flow of grains with microstructure: an implicit Material Point Method
//! for fluids with an internal length (Cosserat) and an orientation (director).
//!
//! The binary `grainscope` is a thin layer over this library. The modules:
//!
//! - [`scene`] reads a scene from TOML. [`plan`] decides what will be solved, and why.
//! - [`sim`] runs a plan: [`sim::start`] gives a [`sim::Run`], which takes steps and returns
//!   results in SI units. [`sim::guard`] examines every step.
//! - [`laws`] holds the constitutive laws as pure functions; [`frame`] holds what is shown of a run.
//! - [`threads`] keeps a computation on one thread, or shares it out.
//! - [`commands`] is the command line.
//!
//! The rest is private: how a step is computed (`space`, `composition`, `solve`, `motion`), how runs are
//! driven, recorded, read back and compared (`session`, `record`, `results`, `compare`, `export`,
//! `sweep`, `explorer`, `web`), and what is measured (`cases`, `verify`, `stress`, `cost`).
//!
//! ```
//! use grainscope::{plan, scene, sim};
//! use std::sync::Arc;
//!
//! // A preset, coarser, without internal length: no rotation is solved.
//! let source = scene::presets::find("silo")?
//!     .with_sets(&["accuracy.cells=4".into(), "alpha=0".into()])?;
//! let plan = plan::resolve(&scene::parse(&source)?).map_err(|e| e.with_source(&source))?;
//! assert!(!plan.effects.rotation);
//!
//! let mut run = sim::start(Arc::new(plan))?;
//! let before = run.row().gauges[0].volume;
//! run.step()?;
//! let row = run.row();
//! assert!(row.gauges[0].volume > before);
//! assert!(row.power_error < 1e-8);
//! let [_, v, _] = run.velocity_at([0.0, 3.0]);
//! assert!(v < 0.0, "the grains fall through the slit");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(missing_docs)]

pub(crate) mod cases;
pub mod commands;
pub(crate) mod compare;
pub(crate) mod composition;
pub(crate) mod cost;
pub(crate) mod explorer;
pub(crate) mod export;
pub mod frame;
pub mod internals;
pub mod laws;
pub(crate) mod light;
mod motion;
pub mod plan;
pub(crate) mod record;
pub(crate) mod results;
pub mod scene;
pub(crate) mod session;
pub mod sim;
pub(crate) mod simd;
pub(crate) mod solve;
pub(crate) mod space;
pub(crate) mod stress;
pub(crate) mod sweep;
pub(crate) mod testing;
pub mod threads;
pub(crate) mod verify;
pub(crate) mod web;
pub(crate) mod words;
