//! This module chooses among candidates so that mirror images are treated alike.

use super::mesh::Mesh;

/// Differences below this are rounding errors; it applies to reference coordinates and to relative
/// differences of costs.
pub(super) const SAME: f64 = 1e-9;

/// Squared distance from the centre of the domain; it is equal for mirror images.
pub(super) fn from_middle(mesh: &Mesh, p: [f64; 2]) -> f64 {
    let x = p[0] - 0.5 * (mesh.x.start() + mesh.x.end());
    let y = p[1] - 0.5 * (mesh.y.start() + mesh.y.end());
    x * x + y * y
}

/// The choice of least cost among `(cost, from_middle, choice)`; of equal costs, the choice nearest
/// to the centre of the domain.
pub(super) fn cheapest<T>(choices: impl Iterator<Item = (f64, f64, T)>) -> Option<T> {
    let better = |a: &(f64, f64, T), b: &(f64, f64, T)| {
        let slack = SAME * b.0.abs();
        a.0 < b.0 - slack || (a.0 <= b.0 + slack && a.1 < b.1)
    };
    choices.reduce(|best, next| if better(&next, &best) { next } else { best }).map(|c| c.2)
}
