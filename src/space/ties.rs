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

/// The choice of least cost among `(cost, choice)`; of equal costs, the choice nearest to the centre
/// of the domain. `from_middle` gives the distance of a choice from there.
pub(super) fn cheapest<T>(
    mut choices: impl Iterator<Item = (f64, T)>,
    from_middle: impl Fn(&T) -> f64,
) -> Option<T> {
    let (mut least, mut best) = choices.next()?;
    for (cost, choice) in choices {
        let slack = SAME * least.abs();
        let equal = || cost <= least + slack && from_middle(&choice) < from_middle(&best);
        if cost < least - slack || equal() {
            (least, best) = (cost, choice);
        }
    }
    Some(best)
}
