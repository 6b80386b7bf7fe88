//! What may be wrong with a state, and where.

/// Something that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    #[error("{field} is {value:e}, {}, {place}", excess(*.value))]
    NonFinite { field: &'static str, value: f64, place: Place },
    #[error("{field} is {value:e}, which must be above zero, {place}")]
    NotPositive { field: &'static str, value: f64, place: Place },
    #[error("a particle is outside the domain, {place}")]
    Outside { place: Place },
    #[error(
        "the powers of loads and of dissipation differ by {error:.1e} of the larger, \
         more than {limit:.1e}"
    )]
    Power { error: f64, limit: f64 },
    #[error(
        "the area of `{material}` differs from its volume by {drift:.1e} more than at the start, \
         beyond {limit:.1e}"
    )]
    Drift { material: String, drift: f64, limit: f64 },
    #[error("the volume of all particles changed by {change:.1e} of itself in one step")]
    Volume { change: f64 },
}

/// Where something is wrong; SI coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    Particle {
        index: usize,
        cell: usize,
        x: f64,
        y: f64,
    },
    Node {
        cell: usize,
        x: f64,
        y: f64,
    },
    Cell {
        cell: usize,
        x: f64,
        y: f64,
    },
    /// A number of the whole scene.
    Scene,
}

impl Fault {
    pub fn is_non_finite(&self) -> bool {
        matches!(self, Fault::NonFinite { .. })
    }

    /// The state is inaccurate, but one that steps can go on from.
    pub fn is_tolerable(&self) -> bool {
        matches!(self, Fault::Power { .. } | Fault::Drift { .. } | Fault::Volume { .. })
    }

    /// Likely cause, and what the user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Fault::NonFinite { .. } => {
                "likely cause: an expression or a scheduled change that has no finite value there, \
                 or a contrast beyond what double precision carries; correct the expression, or \
                 lower the contrast"
            }
            Fault::NotPositive { .. } | Fault::Volume { .. } => {
                "likely cause: a step too long for a material whose volume or viscosity follows \
                 the flow; lower time.courant, or raise accuracy.particles_per_cell"
            }
            Fault::Outside { .. } => {
                "likely cause: a step much longer than a cell near a wall; lower time.courant"
            }
            Fault::Power { .. } => {
                "likely cause: a contrast beyond what the solver balances; lower \
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

fn excess(value: f64) -> &'static str {
    if value.is_finite() { "whose square is not finite" } else { "which is not finite" }
}
