//! The ground floor: constitutive laws as pure functions of small matrices.
//!
//! Nothing here knows a mesh, a particle or time. Strains are ordered
//! `(gamma_xx, gamma_yy, gamma_xy, gamma_yx)`; `L` is the velocity gradient `L_ij = u_i,j`;
//! rotations are positive counter-clockwise. Source: F. Dufour, H. Muehlhaus, L. Moresi,
//! "Texture alignment in simple shear", equations (1)-(20).

pub mod cosserat;
pub mod director;
pub mod granular;
pub mod layered;
pub mod point;
