//! What moves with the flow: particles with their history, dye lines, and gauges that count.

pub mod advect;
pub mod carrier;
pub mod current;
pub mod gauges;
pub mod tracers;
