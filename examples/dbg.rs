use grainscope::{plan, scene, sim};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let src = if args[1].ends_with(".toml") { scene::load(std::path::Path::new(&args[1])).unwrap() } else { scene::presets::find(&args[1]).unwrap() }.with_sets(&args[3..]).map_err(|e| e.lines()).unwrap();
    let sc = scene::parse(&src).map_err(|e| e.lines()).unwrap();
    let plan = plan::resolve(&sc).map_err(|e| e.with_source(&src).lines()).unwrap();
    eprintln!("cells {:?} units {:?}", (plan.mesh.x.cells(), plan.mesh.y.cells()), plan.units);
    let steps: usize = args[2].parse().unwrap();
    let mut run = sim::start(std::sync::Arc::new(plan)).map_err(|e| e.to_string()).unwrap();
    for k in 0..=steps {
        let r = run.row();
        if k < 5 || k % 50 == 0 || k == steps || run.is_finished() {
            println!("{} t={:.3e} dt={:.2e} {} it={} pe={:.1e} div={:.1e} vol={:.3} n={} g={:?} drift={:?} wall={:.3} sec={:?} E={:.4} split={} merge={} held={}",
                r.step, r.time, r.dt, r.dt_limiter.name(), r.iterations, r.power_error, r.divergence_error, r.volume_error, r.particles, r.gauges.iter().map(|g| (g.volume, g.rate/1e4)).collect::<Vec<_>>(), r.drift, r.wall, r.seconds.list().map(|x| (x.1*1e3).round()), 0.0, r.splits, r.merges, r.held);
        }
        if run.is_finished() { break; }
        if k < steps { run.step().map_err(|e| e.to_string()).unwrap(); }
    }
}
