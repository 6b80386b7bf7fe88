//! What moves with the flow: particles with their history, dye lines, and gauges that count.

pub mod advect;
pub mod cell_velocity;
pub mod frozen_flow;
pub mod gauges;
pub mod tracers;
