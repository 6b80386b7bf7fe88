//! This module holds the discretisation in space: mesh, shape functions, constraints, particles and
//! their resampling.

mod carried;
pub mod constraints;
pub mod count;
pub mod embedding;
pub mod fit;
pub mod flow;
mod free_rule;
pub mod incidence;
pub mod kink;
pub mod measure;
mod merging;
pub mod mesh;
pub mod neighbours;
pub mod outline;
pub mod outline_rule;
pub mod particles;
pub mod parts;
pub mod population;
pub mod refilling;
mod relation;
pub mod seeding;
pub mod segment;
pub mod shape;
pub mod solids;
pub mod stream;
mod stream_fit;
mod ties;
mod turning;
pub mod walls;
