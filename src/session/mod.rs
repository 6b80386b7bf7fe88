//! This module drives runs for all commands that compute: options, guard, output, interrupts,
//! timing and the end of a run.
//!
//! [`Session`] is a run with all its output files. [`Drive`] is the guarded run in a session; the
//! explorer uses it too. [`march`] takes steps without a guard, for measurements.

mod drive;
mod end;
mod error;
mod files;
mod interrupts;
mod options;
mod past;
mod timing;

pub use drive::{Drive, snapshot_alone, thinned, warnings};
pub use end::Ended;
pub use error::SessionError;
pub use files::{Budget, Session};
pub use interrupts::{
    Interrupted, handle_file_size_limit, progress_bar, tell, wait_for_interrupt, watch_interrupts,
};
pub use options::{Options, Recording, Safety};
pub use timing::{Took, march, thread_seconds, timed};
