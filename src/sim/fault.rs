//! This module holds the faults that a state may have, and their positions.

/// A fault of a state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A value is not finite, or its square is not.
    #[error("{field} is {value:e}, {}, {place}", excess(*.value))]
    NonFinite {
        /// Name of the quantity.
        field: &'static str,
        /// The value.
        value: f64,
        /// Position of the value.
        place: Place,
    },
    /// A value that must be positive is not.
    #[error("{field} is {value:e} and must be above zero, {place}")]
    NotPositive {
        /// Name of the quantity.
        field: &'static str,
        /// The value.
        value: f64,
        /// Position of the value.
        place: Place,
    },
    /// A particle is outside the domain or inside of a solid.
    #[error("a particle is outside the domain or inside of a solid, {place}")]
    Outside {
        /// The particle.
        place: Place,
    },
    /// The power of the loads differs from the dissipation.
    #[error(
        "the power of the loads and the dissipation differ by {error:.1e} of the larger one, \
         more than {limit:.1e}"
    )]
    Power {
        /// Relative difference.
        error: f64,
        /// Largest valid difference.
        limit: f64,
    },
    /// The projected area of a material has changed too much.
    #[error(
        "the area of `{material}` relative to its volume has changed by {drift:.1e} since the \
         start, more than {limit:.1e}"
    )]
    Drift {
        /// Name of the material.
        material: String,
        /// Relative change since the start.
        drift: f64,
        /// Largest valid change.
        limit: f64,
    },
    /// The total volume of the particles is not conserved.
    #[error("the total volume of the particles changed by a relative {change:.1e} in one step")]
    Volume {
        /// Relative change in the step.
        change: f64,
    },
}

/// Position of a fault, in SI coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// At a particle.
    Particle {
        /// Index of the particle.
        index: usize,
        /// Index of its cell.
        cell: usize,
        /// Coordinate x, m.
        x: f64,
        /// Coordinate y, m.
        y: f64,
    },
    /// At a node.
    Node {
        /// Index of a cell at the node.
        cell: usize,
        /// Coordinate x, m.
        x: f64,
        /// Coordinate y, m.
        y: f64,
    },
    /// In a cell.
    Cell {
        /// Index of the cell.
        cell: usize,
        /// Coordinate x of the centre, m.
        x: f64,
        /// Coordinate y of the centre, m.
        y: f64,
    },
    /// In a value of the whole scene.
    Scene,
}

impl Fault {
    /// Whether a value is not finite, or its square is not.
    pub fn is_non_finite(&self) -> bool {
        matches!(self, Fault::NonFinite { .. })
    }

    /// Whether the state is only inaccurate, so that the run can continue from it.
    pub fn is_tolerable(&self) -> bool {
        matches!(self, Fault::Power { .. } | Fault::Drift { .. } | Fault::Volume { .. })
    }

    /// Likely cause of the fault, and what the user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Fault::NonFinite { .. } => {
                "likely cause: an expression or a scheduled change that has no finite value there, \
                 or a contrast beyond double precision; correct the expression, or \
                 lower the contrast"
            }
            Fault::NotPositive { .. } | Fault::Volume { .. } => {
                "likely cause: a time step too long for a material whose volume or viscosity \
                 follows the flow; lower time.courant, or raise accuracy.particles_per_cell"
            }
            Fault::Outside { .. } => {
                "likely cause: a step much longer than a cell near a wall; lower time.courant"
            }
            Fault::Power { .. } => {
                "likely cause: a contrast that is too large for the solver; lower \
                 accuracy.tolerance, raise accuracy.max_corrections, or lower the contrast"
            }
            Fault::Drift { .. } => {
                "likely cause: too few cells across that material; raise accuracy.cells, or lower \
                 time.courant"
            }
        }
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Particle { index, cell, x, y } => {
                write!(f, "at particle {index} in cell {cell}, ({x:.4e}, {y:.4e})")
            }
            Place::Node { cell, x, y } => {
                write!(f, "at a node of cell {cell}, ({x:.4e}, {y:.4e})")
            }
            Place::Cell { cell, x, y } => write!(f, "in cell {cell}, ({x:.4e}, {y:.4e})"),
            Place::Scene => write!(f, "in the scene as a whole"),
        }
    }
}

/// Describes why a value is invalid.
fn excess(value: f64) -> &'static str {
    if value.is_finite() { "whose square is not finite" } else { "which is not finite" }
}
