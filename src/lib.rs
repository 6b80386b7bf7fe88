//! grainscope
pub mod frame;
pub mod laws;
pub mod motion;
pub mod plan;
pub mod scene;
pub mod sim;
pub mod solve;
pub mod space;
