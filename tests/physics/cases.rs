//! scratch
use grainscope::cases::*;
#[test]
fn scratch() {
    for n in [16, 32] {
        let e = steady_vortex_without_particles().errors(n, &[]).unwrap();
        println!("{n} exact {:.2e} {:.2e}", e.velocity, e.pressure);
        for placement in ["random", "jittered", "regular"] {
            for end in ["1e-4", "0.02", "0.1", "0.3"] {
                let end = format!("time.end={end}");
                let pl = format!("accuracy.placement={placement}");
                let e = steady_vortex().errors_at_end(n, &[&end, &pl]).unwrap();
                println!("{n} {pl} {end} {:.2e} {:.2e}", e.velocity, e.pressure);
            }
        }
    }
}
