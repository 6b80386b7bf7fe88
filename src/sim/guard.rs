//! Every step is examined before anybody sees its result.
//!
//! A step that fails, or leads to a state that cannot be, is undone: the run goes back to the last
//! good state and, by the default policy, tries again with a shorter step. What is given up after
//! that stands at its last good state, so that it can be looked at, saved and resumed.

use super::state::State;
use super::{Fault, Run, SimError};
use crate::solve::stokes::SolveError;

/// What to do about a step that fails.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// End the run at its last good state.
    Stop,
    /// Take the step again, shorter, a few times; then end the run.
    #[default]
    CutStep,
    /// As `CutStep`, but go on, with a note, where a state is inaccurate rather than impossible.
    Continue,
}

/// How often a step is halved: sixteen steps instead of one.
const MOST_CUTS: u32 = 4;

/// Particles split, merge and move, but their volumes add up to this share.
const VOLUME: f64 = 1e-9;

/// Takes the steps of a run.
pub struct Guard {
    policy: Policy,
    good: State,
}

impl Guard {
    /// Of a run that stands at a good state.
    pub fn new(policy: Policy, run: &dyn Run) -> Guard {
        Guard { policy, good: run.state() }
    }

    /// Examines the first instant.
    pub fn begin(&self, run: &dyn Run) -> Result<(), SimError> {
        let (step, time) = (run.row().step, run.row().time);
        match run.examine() {
            Err(fault) if !fault.is_tolerable() => Err(SimError::Fault { step, time, fault }),
            _ => Ok(()),
        }
    }

    /// The last state that was found good.
    pub fn good(&self) -> &State {
        &self.good
    }

    /// Takes a step; what there is to be noted about it. After an error the run stands at its last
    /// good state.
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
                    notes.push(format!("step {step}: {fault}; going on all the same"));
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
            notes.push(format!("{error}; taken again with half the step, {shorter:.3e} s"));
            run.limit_step(Some(shorter));
        };
        run.limit_step(None);
        outcome?;
        self.good = run.state();
        Ok(notes)
    }
}

/// What is conserved from one step to the next.
#[derive(Clone, Copy)]
struct Volume {
    volume: f64,
    left: u64,
}

impl Volume {
    fn of(run: &dyn Run) -> Volume {
        Volume { volume: run.particles().volume.iter().sum(), left: run.count().left }
    }

    /// Volumes follow the flow in compressible scenes, and particles may leave.
    fn check(self, run: &dyn Run) -> Result<(), Fault> {
        let now = Volume::of(run);
        let change = (now.volume / self.volume - 1.0).abs();
        if now.left == self.left && !run.plan().effects.volume_change && change > VOLUME {
            return Err(Fault::Volume { change });
        }
        Ok(())
    }
}

/// Takes a step and examines where it leads.
fn attempt(run: &mut dyn Run, before: Volume) -> Result<(), SimError> {
    match run.step() {
        Ok(()) => {}
        // Where, if the state tells.
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
