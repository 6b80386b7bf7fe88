//! This module makes the linear relation between the velocity of a node beside a solid and the unknowns of
//! the nodes of its cell; see [`embedding`](super::embedding).

use super::outline::Point;
use super::shape::NODES;

/// Distance, in cells, below which the unknown of a corner is not computed from its velocity.
pub(super) const NEAR: f64 = 1e-6;

/// Smallest component of the direction of a wall from which the velocity along it is computed.
const OBLIQUE: f64 = 0.3;

/// Corners beside each node of a cell that is not a corner.
pub(super) const BESIDE: [&[usize]; NODES] =
    [&[], &[0, 2], &[], &[0, 6], &[0, 2, 6, 8], &[2, 8], &[], &[6, 8], &[]];

/// Matrix of a linear map of two components.
pub(super) type Map = [[f64; 2]; 2];

/// A node with relations: its velocity is the sum of `map q_k` over the unknowns of some nodes `k`, and
/// of the velocity of the solid.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) node: u32,
    pub(super) terms: Vec<(u32, Map)>,
    /// Velocity where all unknowns are zero: that of the solid, or its normal part.
    pub(super) offset: Point,
    /// Components of its own unknown that no term depends on.
    pub(super) idle: [bool; 2],
    /// Prescribed values of its own unknown.
    pub(super) given: [Option<f64>; 2],
}

/// What is known of a node before its relations.
pub(super) struct Site {
    /// Distance from the nearest solid, in cells.
    pub(super) distance: f64,
    pub(super) normal: Point,
    /// Velocity of the solid.
    pub(super) velocity: Point,
    pub(super) no_slip: bool,
    /// Corners beside it, for nodes that are not corners.
    pub(super) beside: Vec<usize>,
    /// Whether a solid is lost between the nodes of its cell.
    pub(super) at_rest: bool,
}

impl Site {
    /// Whether its solid moves.
    pub(super) fn moves(&self) -> bool {
        self.velocity != [0.0; 2]
    }
}

impl Node {
    /// Gives the node velocities that other conditions prescribe through sides and blocks: where a moving
    /// solid comes close to them, nothing flows through them. The unknown of a corner is free then, for the
    /// other nodes of its cells: the slope of the velocity in the gap does not hold for the rest of a cell.
    pub(super) fn hold(&mut self, given: [Option<f64>; 2]) {
        for (c, u) in given.into_iter().enumerate().filter_map(|(c, u)| Some((c, u?))) {
            self.offset[c] = u;
            self.terms.iter_mut().for_each(|(_, map)| map[c] = [0.0; 2]);
            self.given[c] = None;
        }
    }

    /// The unknown of the node for its velocity.
    pub(super) fn unknown(&self, u: [f64; 2]) -> [f64; 2] {
        let own = self.terms.iter().find(|(k, _)| *k == self.node);
        let Some((_, m)) = own else { return [0.0; 2] };
        // The columns of the map are orthogonal.
        [0, 1].map(|c| {
            let square = m[0][c] * m[0][c] + m[1][c] * m[1][c];
            match (self.idle[c], self.given[c]) {
                (true, _) => 0.0,
                (_, Some(q)) => q,
                _ if square <= NEAR * NEAR => 0.0,
                _ => (m[0][c] * u[0] + m[1][c] * u[1]) / square,
            }
        })
    }
}

/// The relation of a node.
pub(super) fn relation(
    node: usize,
    site: &Site,
    sites: &[Option<Site>],
    given: [Option<f64>; 2],
) -> Node {
    let own = node as u32;
    let offset = site.velocity;
    let mut out = Node { node: own, terms: vec![], offset, idle: [true; 2], given: [None; 2] };
    let (d, n) = (site.distance, site.normal);
    if site.at_rest {
        return out;
    }
    let along = [-n[1], n[0]];
    let across = n[0] * offset[0] + n[1] * offset[1];
    if !site.no_slip {
        out.offset = [n[0] * across, n[1] * across];
    }
    let held = (0..2).find(|&c| given[c].is_some());
    if site.beside.is_empty() {
        out.idle = [false; 2];
        if site.no_slip {
            out.terms.push((own, [[d, 0.0], [0.0, d]]));
            let value = |c: usize, u: f64| if d.abs() > NEAR { (u - offset[c]) / d } else { 0.0 };
            out.given = [0, 1].map(|c| given[c].map(|u| value(c, u)));
        } else if let (Some(c), true) = (held, given.iter().flatten().all(|&u| u == 0.0)) {
            // The component that a side of the domain leaves free is normal to the wall in part, or along
            // a wall that lies on the side.
            let along_side = n[1 - c].abs() < NEAR;
            let (d, offset) = if along_side { (1.0, 0.0) } else { (d, offset[1 - c]) };
            let mut map = [[0.0; 2]; 2];
            map[1 - c][1 - c] = d;
            out.terms.push((own, map));
            out.idle[c] = true;
            out.offset = [0.0; 2];
            out.offset[1 - c] = offset;
            let value = |u: f64| if d.abs() > NEAR { (u - offset) / d } else { u };
            out.given[1 - c] = given[1 - c].map(value);
        } else {
            out.terms.push((own, [[along[0], n[0] * d], [along[1], n[1] * d]]));
            if held.is_some() {
                let normal = |(u, v)| u * n[0] + v * n[1] - across;
                let normal = given[0].zip(given[1]).map_or(0.0, normal);
                let amplitude = if d.abs() > NEAR { normal / d } else { 0.0 };
                out.given = [Some(tangential(given, along)), Some(amplitude)];
            }
        }
        return out;
    }
    let share = d / site.beside.len() as f64;
    for &corner in &site.beside {
        let Some(at) = &sites[corner] else { continue };
        let m = at.normal;
        let map = match (site.no_slip, at.no_slip) {
            (true, true) => [[share, 0.0], [0.0, share]],
            // Of a corner that slips, only the normal component is known to vanish.
            (true, false) => [[0.0, share * m[0]], [0.0, share * m[1]]],
            (false, true) => [0, 1].map(|c| [share * n[c] * n[0], share * n[c] * n[1]]),
            (false, false) => {
                let cosine = n[0] * m[0] + n[1] * m[1];
                [[0.0, share * n[0] * cosine], [0.0, share * n[1] * cosine]]
            }
        };
        out.terms.push((corner as u32, map));
    }
    if !site.no_slip {
        out.terms.push((own, [[along[0], 0.0], [along[1], 0.0]]));
        out.idle[0] = false;
        let held = (0..2).any(|c| given[c].is_some() && along[c].abs() > NEAR);
        out.given[0] = held.then(|| tangential(given, along));
    }
    out
}

/// Velocity along a wall of which some components are given.
fn tangential(given: [Option<f64>; 2], along: Point) -> f64 {
    match given {
        [Some(u), Some(v)] => u * along[0] + v * along[1],
        [Some(u), None] if along[0].abs() > OBLIQUE => u / along[0],
        [None, Some(v)] if along[1].abs() > OBLIQUE => v / along[1],
        _ => 0.0,
    }
}
