//! This module adds changes of material values and gravity to the plan of a run in progress.

use super::{Plan, PlannedChange, When, resolve};
use crate::scene::{Change, Quantity, SceneError};
use indexmap::IndexMap;

impl Plan {
    /// The plan with an additional change of keys that takes effect with the solution of step
    /// `step`; the first `applied` planned changes have already taken effect. A run of this plan
    /// that has not reached that step may continue with the new plan. A run of the new plan from
    /// its start gives the same result.
    pub fn with_change(
        &self,
        applied: usize,
        step: u64,
        set: &IndexMap<String, Quantity>,
    ) -> Result<Plan, SceneError> {
        let mut scene = self.scene.clone();
        let waiting = self.changes.get(applied).is_some_and(|c| c.when == When::Step(step));
        match scene.schedule.get_mut(applied) {
            Some(entry) if waiting => {
                entry.set.extend(set.iter().map(|(k, v)| (k.clone(), v.clone())));
            }
            _ => scene
                .schedule
                .insert(applied, Change { time: None, step: Some(step), set: set.clone() }),
        }
        let plan = resolve(&scene)?;
        let label = |c: &PlannedChange| (c.when, c.label.clone());
        let past = plan.changes.iter().take(applied).map(label);
        if self.shares_its_beginning_with(&plan)
            && past.eq(self.changes.iter().take(applied).map(label))
        {
            return Ok(plan);
        }
        Err(SceneError::new(
            "the change would affect the beginning of the run",
            "start a new run for such a change",
        ))
    }
}
