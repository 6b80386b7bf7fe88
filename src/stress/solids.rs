//! Defines the trials of solids of any shape: random polygons in heavy fluid that falls past them, at rest,
//! with corners on lines of the mesh, and moving past others.

use super::Trial;
use super::trials::trial;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

const GROUP: &str = "solids of any shape";

/// Number of halves of cells per side of the domain.
const HALVES: f64 = 24.0;

/// The kind of trials whose first polygon moves to and fro.
const MOVES: &str = "one that moves past another";

type Polygon = Vec<[f64; 2]>;

/// A polygon around a centre, with a random number of corners at random distances up to `radius`.
fn star(random: &mut Pcg64, centre: [f64; 2], radius: f64) -> Polygon {
    let corners = random.random_range(3..10);
    let corner = |k: usize, at: f64, share: f64| {
        let angle = TAU * (k as f64 + 0.8 * at) / corners as f64;
        let r = radius * share;
        [centre[0] + r * angle.cos(), centre[1] + r * angle.sin()]
    };
    (0..corners).map(|k| corner(k, random.random(), random.random_range(0.3..1.0))).collect()
}

/// A thin polygon of the given length and thickness at both ends, at a random angle.
fn thin(random: &mut Pcg64, length: f64, thickness: [f64; 2]) -> Polygon {
    let angle = TAU * random.random::<f64>();
    let ([t, n], at) = ([[angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]], [0.5, 0.45]);
    let corner = |along: f64, across: f64| {
        [0, 1].map(|c| at[c] + 0.5 * length * along * t[c] + 0.5 * across * n[c])
    };
    let [a, b] = thickness;
    if b == 0.0 {
        return vec![corner(-1.0, -a), corner(1.0, 0.0), corner(-1.0, a)];
    }
    vec![corner(-1.0, -a), corner(1.0, -b), corner(1.0, b), corner(-1.0, a)]
}

/// The polygons of a trial of the given kind.
fn polygons(kind: &str, random: &mut Pcg64) -> Vec<Polygon> {
    let centre = |random: &mut Pcg64| [0.5, 0.45].map(|c| c + random.random_range(-0.1..0.1));
    match kind {
        "a sliver" => {
            let thickness = 10f64.powf(random.random_range(-4.0..-2.0));
            vec![thin(random, 0.5, [thickness; 2])]
        }
        "a needle" => vec![thin(random, 0.5, [0.03, 0.0])],
        "smaller than a cell" => {
            let at = centre(random);
            vec![star(random, at, 0.025)]
        }
        "two that touch" => {
            let at = centre(random);
            let first = star(random, at, 0.2);
            let far = first.iter().copied().max_by(|a, b| a[0].total_cmp(&b[0])).unwrap_or(at);
            let second = [[0.0, 0.0], [0.12, -0.06], [0.15, 0.08]];
            vec![first, second.map(|d| [far[0] + d[0], far[1] + d[1]]).into()]
        }
        "one in another" => {
            let at = centre(random);
            vec![star(random, at, 0.25), star(random, at, 0.15)]
        }
        "corners on mesh lines" => {
            // Halves of cells, from the middle.
            let mut line = |middle: i32| f64::from(middle + random.random_range(-4..4)) / HALVES;
            let corners = [0, 1, 2].map(|_| [line(12), line(11)]);
            let area = |[a, b, c]: [[f64; 2]; 3]| {
                (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
            };
            if area(corners).abs() > 0.5 / (HALVES * HALVES) {
                return vec![corners.into()];
            }
            // The corners are on one line: a rectangle instead.
            let [x, y] = corners[0];
            let [right, high] = [x + 3.0 / HALVES, y + 1.0 / HALVES];
            vec![vec![[x, y], [right, y], [right, high], [x, high]]]
        }
        MOVES => {
            let at = centre(random);
            let first = star(random, at, 0.15);
            let far = first.iter().map(|p| p[0]).fold(0.0, f64::max);
            let gap = random.random_range(0.0..0.1);
            vec![first, star(random, [far + gap + 0.15, at[1]], 0.15)]
        }
        _ => {
            let at = centre(random);
            vec![star(random, at, 0.25)]
        }
    }
}

/// Adds the trials.
pub(super) fn trials(out: &mut Vec<Trial>) {
    let kinds = [
        ("a polygon", 12),
        ("a sliver", 8),
        ("a needle", 8),
        ("smaller than a cell", 8),
        ("two that touch", 6),
        ("one in another", 8),
        ("corners on mesh lines", 12),
        (MOVES, 12),
    ];
    for (kind, count) in kinds {
        for number in 1..=count {
            let mut random = Pcg64::seed_from_u64(number);
            let blocks: String = polygons(kind, &mut random)
                .iter()
                .enumerate()
                .map(|(k, polygon)| {
                    let slip = if number % 2 == 0 { "no_slip" } else { "free_slip" };
                    let moves = kind == MOVES && k == 0;
                    let velocity = if moves { "velocity = [0, \"0.3*cos(t)\"]\n" } else { "" };
                    format!(
                        "[[blocks]]\nname = \"solid_{k}\"\nkind = \"{slip}\"\nshape.polygon = \
                         {polygon:?}\n{velocity}"
                    )
                })
                .collect();
            let contrast = [1.0, 1e3, 1e6][number as usize % 3];
            // Blocks that overlap others change the volume that is left.
            let open = if kind == MOVES { "[boundaries]\ntop.kind = \"open\"\n" } else { "" };
            let text = format!(
                "schema = 1\nname = \"solids\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
                 [accuracy]\ncells = 12\nplacement = \"jittered\"\n[time]\nend = 1e9\n\
                 [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
                 [materials.thin]\nshear_viscosity = {:e}\nbackground = true\n[[regions]]\n\
                 material = \"heavy\"\nshape.where = \"y > 0.6\"\n{open}{blocks}",
                1.0 / contrast
            );
            let mut one = trial(GROUP, format!("{kind}, number {number}"), text, 30).drifting();
            one.quick = number <= 2;
            out.push(one);
        }
    }
}
