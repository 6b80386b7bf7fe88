//! This module formats plans and durations as text.

use crate::plan::EffectList;
use crate::words::count;

/// Formats a plan as Markdown, for the panel of the recording.
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

/// Formats a plan for the terminal.
pub fn plan_text(plan: &EffectList) -> String {
    let mut out = format!("{}: {}\n\n", plan.scene, sizes(plan));
    let measured = plan.step.is_some();
    let mut row = |mark: &str, name: &str, share: &str, cost: &str, why: &str| {
        let share = if measured { format!("{share:>8}  ") } else { String::new() };
        out += &format!("  {mark} {name:<26}{share}{cost:<41} {why}\n");
    };
    if measured {
        row(" ", "", "share", "adds", "why");
    }
    for e in plan.effects.iter().filter(|e| e.solved) {
        let mut cost = Vec::new();
        if e.unknowns > 0 {
            cost.push(count(e.unknowns, "unknown"));
        }
        if e.particle_bytes > 0 {
            cost.push(format!("{} B a particle", e.particle_bytes));
        }
        if !e.stages.is_empty() {
            cost.push(format!("stage: {}", e.stages.join(", ")));
        }
        row("+", e.name, &share(e.share), &cost.join(", "), &e.why);
    }
    for e in plan.effects.iter().filter(|e| !e.solved) {
        row("-", e.name, "", "left out", &e.why);
    }
    if let Some(step) = &plan.step {
        let total: f64 = step.phases.iter().map(|p| p.1).sum();
        let phases = step.phases.iter().filter(|p| p.1 >= 0.001 * total);
        let words: Vec<_> =
            phases.map(|(name, s)| format!("{name} {:.1} %", 100.0 * s / total)).collect();
        out += &format!(
            "\nprocessor time of a step: {} (median of {}): {}\n\
             share: 1 - (time of a step without the effect)/(time of a step with it); for gravity, \
             dye\nand cut cells, the share of their own stages\n",
            duration(step.seconds),
            count(step.steps, "step"),
            words.join(", ")
        );
    }
    out += &format!("\nparticle columns: {}\n", plan.particle_columns.join(", "));
    out += &format!("stages of a step: {}\n", plan.stages.join(", "));
    for w in &plan.warnings {
        out += &format!("\nwarning: {w}\n");
    }
    out
}

/// Formats a measured share of the time of a step.
fn share(share: Option<f64>) -> String {
    match share {
        None => "-".into(),
        Some(s) if s < 0.001 => "< 0.1 %".into(),
        Some(s) => format!("{:.1} %", 100.0 * s),
    }
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
         {} per cell",
        plan.unknowns,
        plan.pressure_unknowns,
        count(plan.particles_per_cell, "particle")
    )
}

/// Formats a duration in seconds as ms, s, min or h.
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

/// A text for a page or an XML file, outside of tags or in the value of an attribute.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
