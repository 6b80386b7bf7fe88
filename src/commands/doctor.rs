//! `grainscope doctor`.
use super::{Failure, print};
#[derive(clap::Args)]
pub struct Args {}
pub fn run(_: &Args) -> Result<(), Failure> {
    print("")
}
