//! Moving the particles: position, director, volume.

use super::carrier::Carrier;
use super::gauges::Counter;
use crate::plan::EffectSet;
use crate::space::particles::Particles;
use crate::space::population::Count;

/// Moves all particles through a step. `particles` must be sorted; they are not afterwards.
/// `compliant[m]`: volumes of material `m` follow the flow, and its particles keep their mass.
pub fn advance(
    carrier: &Carrier,
    particles: &mut Particles,
    effects: &EffectSet,
    compliant: &[bool],
    gauges: &mut [Counter],
    count: &mut Count,
) {
    let mesh = carrier.mesh;
    let mut left = Vec::new();
    for cell in 0..mesh.cells() {
        let members = particles.of_cell(cell);
        if members.is_empty() {
            continue;
        }
        for p in members {
            let from = particles.position[p];
            let journey = carrier.travel(cell, from);
            count.held += u64::from(journey.held);
            let material = particles.material[p];
            let volume = particles.volume[p];
            if effects.directors || effects.volume_change {
                let l = carrier.gradient(journey.middle);
                if let Some(director) = &mut particles.director {
                    director[p] = carrier.turn(director[p], &l);
                }
                if compliant[material as usize] {
                    let stretch = (l.trace() * carrier.dt).exp();
                    particles.volume[p] *= stretch;
                    if let Some(density) = &mut particles.density {
                        density[p] /= stretch;
                    }
                }
            }
            for gauge in gauges.iter_mut() {
                gauge.pass(mesh, from, journey.to, material, volume);
            }
            if journey.left {
                left.push(p);
            } else {
                particles.position[p] = mesh.wrap(journey.to);
            }
        }
    }
    if !left.is_empty() {
        count.left += left.len() as u64;
        let mut gone = vec![false; particles.len()];
        left.iter().for_each(|&p| gone[p] = true);
        particles.remove(&gone);
    }
}
