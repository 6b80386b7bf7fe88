//! This module advects particles and dye lines with the flow, and measures outflow at gauges.

pub mod advect;
pub mod cell_velocity;
mod currents;
pub mod frozen_flow;
pub mod gauges;
pub mod inflow;
mod ring_velocity;
pub mod tracers;
