//! Plans and times in words.

use crate::plan::EffectList;

/// A plan as Markdown, for the recording's panel.
pub fn plan_markdown(plan: &EffectList) -> String {
    let mut out = format!("# {}\n\n{}\n\n", plan.scene, sizes(plan));
    out += "| effect | solved | why |\n|---|---|---|\n";
    for e in &plan.effects {
        out += &format!("| {} | {} | {} |\n", e.name, if e.solved { "yes" } else { "no" }, e.why);
    }
    out += &format!("\n**Stages of a step:** {}\n", plan.stages.join(", "));
    if !plan.warnings.is_empty() {
        out += "\n## Warnings\n\n";
        for w in &plan.warnings {
            out += &format!("- {w}\n");
        }
    }
    out
}

/// A plan for the terminal.
pub fn plan_text(plan: &EffectList) -> String {
    let mut out = format!("{}: {}\n\n", plan.scene, sizes(plan));
    let mut row = |mark: &str, name: &str, cost: &str, why: &str| {
        out += &format!("  {mark:<3} {name:<30} {cost:<26} {why}\n");
    };
    for e in plan.effects.iter().filter(|e| e.solved) {
        let mut cost = Vec::new();
        if e.unknowns > 0 {
            cost.push(format!("{} unknowns", e.unknowns));
        }
        if e.particle_bytes > 0 {
            cost.push(format!("{} B a particle", e.particle_bytes));
        }
        if !e.stages.is_empty() {
            cost.push(format!("stage: {}", e.stages.join(", ")));
        }
        row("+", e.name, &cost.join(", "), &e.why);
    }
    for e in plan.effects.iter().filter(|e| !e.solved) {
        row("-", e.name, "left out", &e.why);
    }
    out += &format!("\nparticle columns: {}\n", plan.particle_columns.join(", "));
    out += &format!("stages of a step: {}\n", plan.stages.join(", "));
    for w in &plan.warnings {
        out += &format!("\nwarning: {w}\n");
    }
    out
}

fn sizes(plan: &EffectList) -> String {
    let [nx, ny] = plan.cells;
    let [lx, ly] = plan.smallest_cell;
    let [hx, hy] = plan.largest_cell;
    let cells = if (hx - lx).abs() + (hy - ly).abs() < 1e-9 * (hx + hy) {
        format!("{hx:.4} x {hy:.4} m")
    } else {
        format!("{lx:.4} x {ly:.4} to {hx:.4} x {hy:.4} m")
    };
    format!(
        "{nx} x {ny} cells ({cells}), {} velocity and rotation unknowns, {} of pressure, \
         {} particles per cell",
        plan.unknowns, plan.pressure_unknowns, plan.particles_per_cell
    )
}

/// Seconds as people write them.
pub fn duration(seconds: f64) -> String {
    if seconds < 1.0 {
        format!("{:.0} ms", seconds * 1e3)
    } else if seconds < 100.0 {
        format!("{seconds:.1} s")
    } else if seconds < 6000.0 {
        format!("{:.0} min {:02.0} s", (seconds / 60.0).floor(), seconds % 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}
