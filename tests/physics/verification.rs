//! Runs the quick version of `grainscope verify`, and compares results with docs/verification.md.

use grainscope::internals::{SUBJECTS, VerifyEffort as Effort, verify as run};

/// Checks that all checks of a subject pass.
fn check(name: &str) {
    let report = run(&[name], Effort::Quick, |_| {}).unwrap_or_else(|e| panic!("{e}"));
    assert!(report.checks() > 0, "{name} checks nothing");
    let failures: Vec<_> = report
        .failures()
        .map(|c| format!("{}: {}, must be {}", c.what, c.value, c.bound))
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn elements() {
    check("elements");
}
#[test]
fn smooth() {
    check("smooth");
}
#[test]
fn cut_cells() {
    check("cut-cells");
}
#[test]
fn free_surfaces() {
    check("free-surfaces");
}
#[test]
fn transport() {
    check("transport");
}
#[test]
fn rest() {
    check("rest");
}
#[test]
fn rayleigh_taylor() {
    check("rayleigh-taylor");
}
#[test]
fn corners() {
    check("corners");
}
#[test]
fn layers() {
    check("layers");
}
#[test]
fn texture() {
    check("texture");
}
#[test]
fn flow_curves() {
    check("flow-curves");
}
#[test]
fn inertia() {
    check("inertia");
}
#[test]
fn slits() {
    check("slits");
}
#[test]
fn solids() {
    check("solids");
}
#[test]
fn axisymmetric() {
    check("axisymmetric");
}

#[test]
fn every_subject_is_tested() {
    let text = include_str!("verification.rs");
    for (name, _) in SUBJECTS {
        assert!(text.contains(&format!("check(\"{name}\")")), "{name}");
    }
}

/// Table rows that the quick version also computes must be in the page.
#[test]
fn the_page_agrees_with_the_program() {
    let page = include_str!("../../docs/verification.md");
    let report =
        run(&["elements", "layers"], Effort::Quick, |_| {}).unwrap_or_else(|e| panic!("{e}"));
    for section in &report.sections {
        assert!(page.contains(&format!("## {}", section.title)), "{}", section.title);
        for row in section.tables.iter().flat_map(|t| &t.rows) {
            let line = format!("| {} |", row.join(" | "));
            assert!(
                page.contains(&line),
                "docs/verification.md lacks {line}; run `grainscope verify --write docs`"
            );
        }
    }
}
