//! Where things are: mesh, shape functions, elimination order, boundary conditions, particles.

pub mod constraints;
pub mod fit;
pub mod flow;
pub mod incidence;
pub mod mesh;
pub mod neighbours;
pub mod particles;
pub mod population;
pub mod seeding;
pub mod shape;
pub mod walls;
