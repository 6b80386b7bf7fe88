//! Collects and compares the cases of a sweep.

use super::super::{Failure, compare as comparison, print};
use super::*;
use crate::compare;
use crate::light::reel::Detail;
use crate::light::report as page;
use crate::record::rerun_log::Sink;
use crate::results::Member;
use crate::sweep::collect::Collection;
use crate::sweep::{Case, List, State, Store};
use std::path::PathBuf;

/// Writes tables, plots and, on request, a recording side by side of the named cases, or of those
/// of the first seed.
pub(super) fn collect(
    store: &Store,
    list: &List,
    side_by_side: Option<&[String]>,
    report: bool,
) -> Result<(), Failure> {
    let found = Collection::new(store, list)?;
    let mut files = found.write_tables(store.root())?;
    for stem in found.plot(store.root(), &list.spec.plots)? {
        let mut name = stem.into_os_string();
        name.push(".svg, .png");
        files.push(name.into());
    }
    let mut text = found.terminal();
    text += &format!("\ndone: {} of {}\n", found.done(), count(list.cases.len(), "case"));
    if side_by_side.is_some() || report {
        let cases = match side_by_side {
            Some(named) if !named.is_empty() => chosen(list, named)?,
            _ => of_first_seed(store, list),
        };
        if side_by_side.is_some() && cases.len() > 1 {
            files.push(beside(store, &cases)?);
        }
        if report && !cases.is_empty() {
            let path = store.root().join("report.html");
            page::write(&members(store, &cases)?, Detail::default(), &path)?;
            files.push(path);
        }
    }
    for file in files {
        text += &format!("wrote {}\n", file.display());
    }
    print(&text)
}

/// Finds cases by number or id.
pub(super) fn chosen<'a>(list: &'a List, named: &[String]) -> Result<Vec<&'a Case>, Failure> {
    Ok(named.iter().map(|name| list.case(name)).collect::<Result<_, _>>()?)
}

/// Finished cases of the first seed, at most [`MOST_SIDE_BY_SIDE`].
pub(super) fn of_first_seed<'a>(store: &Store, list: &'a List) -> Vec<&'a Case> {
    let first = list.cases.first().and_then(|c| c.seed);
    let done = list.cases.iter().filter(|c| c.seed == first && store.state(&c.id) == State::Done);
    done.take(MOST_SIDE_BY_SIDE).collect()
}

/// Reads the runs of cases, which are named by their parameters.
fn members(store: &Store, cases: &[&Case]) -> Result<Vec<Member>, Failure> {
    let folders: Vec<PathBuf> = cases.iter().map(|c| store.done(&c.id)).collect();
    let mut members = crate::results::open_each(&folders)?;
    for (member, case) in members.iter_mut().zip(cases) {
        member.rename(&case.label());
    }
    Ok(members)
}

/// Writes one recording and plots of some cases, compared with the first of them.
pub(super) fn beside(store: &Store, cases: &[&Case]) -> Result<PathBuf, Failure> {
    let members = members(store, cases)?;
    let path = store.root().join("side_by_side.rrd");
    let found = compare::compare(&members, &[])?;
    comparison::write(found, &members, &path, &[Sink::Save(path.clone())])?;
    Ok(path)
}
