//! This module checks the state after every step before it is used or written.
//!
//! A step that fails or leads to an invalid state is undone: the run returns to the last valid
//! state and, with the default policy, repeats the step with a shorter length. If that fails too,
//! the run ends at its last valid state, which can be inspected, saved and resumed.

use super::state::State;
use super::{Fault, Run, SimError};
use crate::solve::report::SolveError;

/// What to do when a step fails.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// End the run at its last valid state.
    Stop,
    /// Repeat the step a few times with a shorter time step; then end the run.
    #[default]
    CutStep,
    /// As `CutStep`, but continue with a note if the state is inaccurate rather than impossible.
    Continue,
}

/// Largest number of times that a step is halved, which gives 1/16 of its length.
const MOST_CUTS: u32 = 4;

/// Largest relative change of the total particle volume in a step, by splits, merges and advection.
const VOLUME: f64 = 1e-9;

/// Takes the steps of a run and keeps its last valid state.
pub struct Guard {
    policy: Policy,
    good: State,
}

impl Guard {
    /// A guard of a run that is at a valid state.
    pub fn new(policy: Policy, run: &dyn Run) -> Guard {
        Guard { policy, good: run.state() }
    }

    /// Checks the initial state.
    ///
    /// # Errors
    /// The state has a fault that is not tolerable.
    pub fn begin(&self, run: &dyn Run) -> Result<(), SimError> {
        let (step, time) = (run.row().step, run.row().time);
        match run.examine() {
            Err(fault) if !fault.is_tolerable() => Err(SimError::Fault { step, time, fault }),
            _ => Ok(()),
        }
    }

    /// The last valid state.
    pub fn good(&self) -> &State {
        &self.good
    }

    /// Takes a step and returns notes about faults and repetitions.
    ///
    /// # Errors
    /// The step failed and could not be repaired. The run is then at its last valid state.
    pub fn step(&mut self, run: &mut dyn Run) -> Result<Vec<String>, SimError> {
        let mut notes = Vec::new();
        let mut cuts = 0;
        let outcome = loop {
            let before = Volume::of(run);
            let error = match attempt(run, before) {
                Ok(()) => break Ok(()),
                Err(SimError::Fault { step, fault, .. })
                    if self.policy == Policy::Continue && fault.is_tolerable() =>
                {
                    notes.push(format!("step {step}: {fault}; the run continues"));
                    break Ok(());
                }
                Err(error) => error,
            };
            let shorter = 0.5 * run.attempted_step();
            if run.restore(&self.good).is_err() || self.policy == Policy::Stop {
                break Err(error);
            }
            if cuts == MOST_CUTS {
                break Err(SimError::Cut { cuts, source: Box::new(error) });
            }
            cuts += 1;
            notes.push(format!("{error}; repeated with half the time step, {shorter:.3e} s"));
            run.limit_step(Some(shorter));
        };
        run.limit_step(None);
        outcome?;
        run.save(&mut self.good);
        Ok(notes)
    }
}

/// The conserved volume of a state.
#[derive(Clone, Copy)]
struct Volume {
    /// Total volume of the particles, plus what has left the domain, minus what has entered it, in
    /// the plan's units.
    volume: f64,
    /// Total volume of the particles.
    inside: f64,
}

impl Volume {
    fn of(run: &dyn Run) -> Volume {
        let (inside, count) = (run.particles().volume.iter().sum(), run.count());
        Volume { volume: inside + count.volume_out - count.volume_in, inside }
    }

    /// Checks that the volume is conserved, unless the scene is compressible.
    fn check(self, run: &dyn Run) -> Result<(), Fault> {
        let (now, plan) = (Volume::of(run), run.plan());
        let change = (now.volume - self.volume).abs() / self.inside;
        if !plan.effects.volume_change && change > VOLUME {
            return Err(Fault::Volume { change });
        }
        Ok(())
    }
}

/// Takes a step and checks the new state.
fn attempt(run: &mut dyn Run, before: Volume) -> Result<(), SimError> {
    match run.step() {
        Ok(()) => {}
        // The fault of the state tells where the value is.
        Err(SimError::Solve { step, time, source: source @ SolveError::NonFinite { .. } }) => {
            return Err(match run.examine() {
                Err(fault) if fault.is_non_finite() => SimError::Fault { step, time, fault },
                _ => SimError::Solve { step, time, source },
            });
        }
        Err(error) => return Err(error),
    }
    let (step, time) = (run.row().step, run.row().time);
    let examined = run.examine().and_then(|()| before.check(run));
    examined.map_err(|fault| SimError::Fault { step, time, fault })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame;
    use crate::plan::{Plan, Warning};
    use crate::sim::row::Row;
    use crate::sim::state::StateError;
    use crate::solve::multifrontal::Effort;
    use crate::space::count::Count;
    use crate::space::particles::Particles;
    use crate::{plan, scene, sim};
    use std::sync::Arc;

    /// Kind of failure of steps that are too long.
    #[derive(Clone, Copy, PartialEq)]
    enum Wrong {
        Failing,
        NonFinite,
        Inaccurate,
    }

    /// A run whose third step fails if it is too long.
    struct Fragile {
        run: Box<dyn Run>,
        wrong: Wrong,
        /// Largest valid step over `usual`.
        share: f64,
        /// Length of the first attempt of the third step, s.
        usual: f64,
    }

    impl Fragile {
        fn new(wrong: Wrong, share: f64) -> Fragile {
            let source = scene::presets::find("silo").expect("listed");
            let source = source.with_sets(&["accuracy.cells=2".into()]).expect("valid");
            let plan = plan::resolve(&scene::parse(&source).expect("valid")).expect("valid");
            let run = sim::start(Arc::new(plan)).expect("solved");
            Fragile { run, wrong, share, usual: 0.0 }
        }

        fn goes_wrong(&self) -> bool {
            self.run.row().step == 3 && self.run.attempted_step() > self.share * self.usual
        }
    }

    impl Run for Fragile {
        fn step(&mut self) -> Result<(), SimError> {
            self.run.step()?;
            if self.run.row().step == 3 && self.usual == 0.0 {
                self.usual = self.run.attempted_step();
            }
            if self.wrong == Wrong::Failing && self.goes_wrong() {
                return Err(SimError::Step { step: 3, time: 0.0, dt: 0.0 });
            }
            Ok(())
        }
        fn examine(&self) -> Result<(), Fault> {
            let place = crate::sim::Place::Scene;
            match self.wrong {
                Wrong::NonFinite if self.goes_wrong() => {
                    Err(Fault::NonFinite { field: "the speed", value: f64::NAN, place })
                }
                Wrong::Inaccurate if self.goes_wrong() => {
                    Err(Fault::Power { error: 0.5, limit: 0.1 })
                }
                _ => self.run.examine(),
            }
        }
        fn is_finished(&self) -> bool {
            self.run.is_finished()
        }
        fn row(&self) -> &Row {
            self.run.row()
        }
        fn plan(&self) -> &Plan {
            self.run.plan()
        }
        fn particles(&self) -> &Particles {
            self.run.particles()
        }
        fn velocity_at(&self, p: [f64; 2]) -> [f64; 3] {
            self.run.velocity_at(p)
        }
        fn pressure_at(&self, p: [f64; 2]) -> f64 {
            self.run.pressure_at(p)
        }
        fn snapshot(&self) -> frame::Snapshot {
            self.run.snapshot()
        }
        fn state_hash(&self) -> String {
            self.run.state_hash()
        }
        fn unknowns(&self) -> [usize; 2] {
            self.run.unknowns()
        }
        fn count(&self) -> Count {
            self.run.count()
        }
        fn factor_effort(&self) -> Effort {
            self.run.factor_effort()
        }
        fn forget_factor(&mut self) {
            self.run.forget_factor();
        }
        fn warnings(&self) -> Vec<Warning> {
            self.run.warnings()
        }
        fn events(&self) -> &[String] {
            self.run.events()
        }
        fn changes_applied(&self) -> usize {
            self.run.changes_applied()
        }
        fn replan(&mut self, plan: Arc<Plan>) {
            self.run.replan(plan);
        }
        fn save(&self, state: &mut State) {
            self.run.save(state)
        }
        fn restore(&mut self, state: &State) -> Result<(), StateError> {
            self.run.restore(state)
        }
        fn limit_step(&mut self, longest: Option<f64>) {
            self.run.limit_step(longest);
        }
        fn attempted_step(&self) -> f64 {
            self.run.attempted_step()
        }
    }

    /// Takes two valid steps and the third, which fails.
    fn third(policy: Policy, run: &mut Fragile) -> Result<Vec<String>, SimError> {
        let mut guard = Guard::new(policy, run);
        for _ in 0..2 {
            assert!(guard.step(run).expect("a good step").is_empty());
        }
        guard.step(run)
    }

    #[test]
    fn a_step_that_fails_is_taken_again_shorter() {
        for wrong in [Wrong::Failing, Wrong::NonFinite, Wrong::Inaccurate] {
            let mut run = Fragile::new(wrong, 0.3);
            let notes = third(Policy::CutStep, &mut run).expect("saved");
            assert_eq!(notes.len(), 2, "{notes:?}");
            assert_eq!(run.row().step, 3);
            assert_eq!(run.row().dt_limiter, sim::clock::Limiter::Guard);
            assert!((run.attempted_step() / run.usual - 0.25).abs() < 1e-12);
            // The state is that of a run that takes the short step at once.
            let mut other = Fragile::new(wrong, 2.0);
            for _ in 0..2 {
                other.step().expect("a good step");
            }
            other.limit_step(Some(0.25 * run.usual));
            other.step().expect("a good step");
            assert_eq!(other.state_hash(), run.state_hash());
        }
    }

    #[test]
    fn what_never_works_ends_at_the_last_good_state() {
        for (policy, told) in [(Policy::Stop, 0), (Policy::CutStep, 4), (Policy::Continue, 4)] {
            let mut run = Fragile::new(Wrong::NonFinite, 0.0);
            let mut before = Fragile::new(Wrong::NonFinite, 2.0);
            before.step().and_then(|()| before.step()).expect("two good steps");
            let error = third(policy, &mut run).expect_err("no way on");
            assert!(error.is_non_finite(), "{error}");
            assert_eq!(error.to_string().contains("repeated"), told > 0, "{error}");
            assert_eq!((run.row().step, run.state_hash()), (2, before.state_hash()));
        }
    }

    #[test]
    fn what_is_tolerable_is_noted_and_gone_on_from_if_that_is_wished() {
        let mut run = Fragile::new(Wrong::Inaccurate, 0.0);
        let notes = third(Policy::Continue, &mut run).expect("tolerated");
        assert_eq!(run.row().step, 3);
        assert!(notes.len() == 1 && notes[0].contains("the run continues"), "{notes:?}");
        assert!(third(Policy::Stop, &mut Fragile::new(Wrong::Inaccurate, 0.0)).is_err());
    }
}
