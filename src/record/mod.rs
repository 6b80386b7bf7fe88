//! This module writes the output of a run: recordings, checkpoints, tables, summaries and plots.

pub mod checkpoint;
pub mod colour;
pub mod figure_page;
pub mod folder;
pub mod info;
pub mod logger;
pub mod number;
pub mod plots;
pub mod replace;
pub mod rerun_log;
pub mod run_plots;
pub mod series;
pub mod summary;
pub mod text;
