//! scratch
use grainscope::cases::*;
#[test]
fn scratch() {
    for n in [16, 32] {
        for placement in ["random"] {
            for end in ["0.02", "0.1"] {
                let end = format!("time.end={end}");
                let pl = format!("accuracy.placement={placement}");
                let e =
                    steady_vortex().errors_at_end(n, &[&end, &pl, "recording.frames=1"]).unwrap();
                println!("{n} {pl} {end} {:.2e} {:.2e}", e.velocity, e.pressure);
            }
        }
    }
}
