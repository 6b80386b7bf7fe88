//! This module solves for velocity, rotation and pressure. It holds the integration points, the
//! terms of the equations, the element matrices, the sparse factor and the corrections.

pub mod cells;
mod correction;
pub mod density;
pub mod element;
pub mod evaluate;
mod filled;
mod form;
pub mod laminate;
pub mod last_flow;
mod local_laws;
mod loose;
pub mod matrices;
pub mod multifrontal;
pub mod nonlinear;
mod occupied;
mod particle_points;
pub mod points;
mod problem;
pub mod quadrature;
pub mod report;
mod residual;
pub mod sides;
pub mod softening;
pub mod stokes;
pub mod symbolic;
pub mod terms;
mod wall_laws;
mod wall_stress;
