//! This module sizes the discs as which particles are drawn.

use crate::space::mesh::Mesh;
use std::f64::consts::PI;

/// Radius at which a particle of a volume at a point is drawn: that of a disc of its section `V/(2 pi r)`. Around
/// an axis it is at most that of a ball of its volume, because the section grows without bound towards the axis.
pub(super) fn drawn_radius(mesh: &Mesh, volume: f64, at: [f64; 2]) -> f64 {
    let disc = (mesh.section(volume, at) / PI).sqrt();
    if mesh.measure().is_ring() { disc.min((0.75 * volume / PI).cbrt()) } else { disc }
}

/// A radius (m) in steps of 9 %, so that recordings compress well.
pub(super) fn stepped(radius: f64) -> f32 {
    const STEPS: f64 = 8.0;
    ((radius.log2() * STEPS).round() / STEPS).exp2() as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::measure::Measure;
    use crate::space::mesh::Axis;

    #[test]
    fn discs_at_the_axis_are_no_larger_than_balls() {
        let axis = || Axis::new(vec![0.0, 0.5, 1.0], false);
        let plane = Mesh::new(axis(), axis());
        let ring = Mesh::new(axis(), axis()).with_measure(Measure::RING);
        let volume = 1e-3;
        let [disc, ball] = [(volume / PI).sqrt(), (0.75 * volume / PI).cbrt()];
        assert!((drawn_radius(&plane, volume, [1e-9, 0.5]) - disc).abs() < 1e-12);
        assert!((drawn_radius(&ring, volume, [1e-9, 0.5]) - ball).abs() < 1e-12);
        let section = volume / (2.0 * PI * 0.9);
        assert!((drawn_radius(&ring, volume, [0.9, 0.5]) - (section / PI).sqrt()).abs() < 1e-12);
    }
}
