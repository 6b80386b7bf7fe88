//! Solving for velocity, rotation and pressure: integration points, element matrices, the
//! sparse factor, corrections.

pub mod buoyancy;
pub mod element;
pub mod interface;
pub mod laminate;
pub mod matrices;
pub mod minority;
pub mod multifrontal;
pub mod quadrature;
pub mod spin;
pub mod stokes;
pub mod symbolic;
pub mod weight;
