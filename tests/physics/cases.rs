//! scratch
use grainscope::cases::*;

fn show(case: &Case, cells: &[u32], sets: &[&str]) {
    for &n in cells {
        match case.errors(n, sets) {
            Ok(e) => {
                println!("{} {sets:?} {n}: u {:.3e} p {:.3e}", case.name, e.velocity, e.pressure)
            }
            Err(e) => println!("{} {n}: {e}", case.name),
        }
    }
}
#[test]
fn scratch() {
    let r = &["accuracy.placement=random"];
    for (d, s) in [(Drive::BodyForce, &[][..]), (Drive::Density, r)] {
        let c = solcx(SolCx { contrast: 1e6, jump: 0.5 }, d).unwrap();
        show(&c, &[16, 32, 64], s);
        let c = solkz(1e6, 3, d).unwrap();
        show(&c, &[16, 32, 64], s);
        for n in [16, 32, 64] {
            let e = c.errors_without_particles(n).unwrap();
            println!("without {n}: u {:.3e} p {:.3e}", e.velocity, e.pressure);
        }
    }
    show(
        &solcx(SolCx { contrast: 1e6, jump: 0.5 }, Drive::BodyForce).unwrap(),
        &[17, 33, 65],
        &["accuracy.placement=jittered"],
    );
    for rule in ["accuracy.quadrature=mixture", "accuracy.quadrature=particles"] {
        for c in [1e3, 1e6, 1e-3] {
            println!("contrast {c}");
            show(&solvi(c).unwrap(), &[16, 32, 64], &[rule]);
        }
        show(&inclined_shear(Inclined { degrees: 30.0, contrast: 1e3 }), &[16, 32, 64], &[rule]);
        show(
            &inclined_pure_shear(Inclined { degrees: 30.0, contrast: 1e3 }),
            &[16, 32, 64],
            &[rule],
        );
    }
    let w = Wave { x: 1, y: 2 };
    show(&layered_cell(w, 10.0), &[16, 32], &[]);
    for pairs in [1, 2, 4, 8] {
        show(&layer_stack(w, pairs, 10.0).unwrap(), &[64], &[]);
    }
    for n in [16, 32] {
        println!("vortex {:?}", steady_vortex_without_particles().errors(n, &[]));
        println!("vortex {:?}", steady_vortex().errors(n, &[]));
        println!("vortex end {:?}", steady_vortex().errors_at_end(n, &[]));
    }
}
