//! grainscope
pub mod cases;
pub mod commands;
pub mod frame;
pub mod laws;
pub mod motion;
pub mod plan;
pub mod record;
pub mod scene;
pub mod sim;
pub mod solve;
pub mod space;
