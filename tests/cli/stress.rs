//! Tests of `grainscope stress`.

use super::*;

#[test]
fn the_quick_battery_passes() {
    let here = TempFolder::new();
    let said = here.grainscope(&["stress", "--quick", "--json"]).exits(0);
    let found = said.json();
    let outcomes = found["outcomes"].as_array().expect("outcomes");
    assert!(outcomes.len() > 30 && found["criteria"]["divergence"].is_f64());
    for o in outcomes {
        assert!(o["verdict"].get("fail").is_none(), "{o}");
        assert!(o["checks"].as_array().is_some_and(|c| c.len() > 8), "{o}");
    }
    assert!(!here.has("stress-failures"));
}

#[test]
fn filters_select_trials_and_a_table_is_printed() {
    let here = TempFolder::new();
    let said = here.grainscope(&["stress", "CLOSED box", "--keep", "kept"]).exits(0);
    assert_eq!(said.out.trim().lines().count(), 3, "{}", said.out);
    assert!(said.out.contains("| boundaries and meshes | closed box, no load | 0 | pass |"));
    assert!(said.err.contains("1/1 boundaries and meshes: closed box, no load: pass"));
    here.grainscope(&["stress", "no such trial"]).exits(2).complains(&["no such trial"]);
    assert!(!here.has("kept"));
}
