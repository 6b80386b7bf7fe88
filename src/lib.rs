//! This crate computes the flow of grains with microstructure: an implicit Material Point Method
//! for fluids with an internal length (Cosserat) and an orientation (director).
//!
//! The binary `grainscope` is a thin layer over this library. The modules:
//!
//! - [`scene`] reads a scene from TOML. [`plan`] decides what will be solved, and why.
//! - [`sim`] runs a plan: [`sim::start`] gives a [`sim::Run`], which takes steps and returns
//!   results in SI units.
//! - [`space`], [`solve`] and [`motion`] are the parts of a step; [`laws`] holds the equations of
//!   the source as functions of small matrices.
//! - [`record`] writes recordings, tables and plots, and [`compare`] reads them back. [`cases`]
//!   holds scenes with exact solutions, [`verify`] measures their errors, and [`cost`] measures
//!   error and time of settings.
//! - [`sweep`] makes many runs of one scene; [`export`] converts recordings for other programs.
//! - [`explorer`] is an interactive run with a web page.
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

pub mod cases;
pub mod commands;
pub mod compare;
pub mod composition;
pub mod cost;
pub mod explorer;
pub mod export;
pub mod frame;
pub mod laws;
pub mod motion;
pub mod plan;
pub mod record;
pub mod results;
pub mod scene;
pub mod session;
pub mod sim;
pub mod simd;
pub mod solve;
pub mod space;
pub mod stress;
pub mod sweep;
#[doc(hidden)]
pub mod testing;
pub mod threads;
pub mod verify;
