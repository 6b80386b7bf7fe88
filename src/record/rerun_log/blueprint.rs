//! This module defines the layout that a viewer opens with.
//!
//! Rerun's own builder has no setters for visual bounds, legends or backgrounds, and uses random
//! identifiers. So the few archetypes of a layout are logged here one by one, with identifiers that
//! count up: the same run always gives the same layout.

mod writer;

use rerun::RecordingStream;
use rerun::datatypes::Uuid;
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::{archetypes, components};
use writer::{Node, Writer, capital};

use super::{APPLICATION, Paths, RecordError, SIM_TIME, WALL_TIME, colour_bar};
use crate::frame::{Rect, RunInfo};

/// Ratio of width to height above which the fields are below the flow instead of beside it.
const WIDE: f32 = 1.3;

/// Number of plots shown at once; the others share tabs.
const PLOTS_AT_ONCE: usize = 4;

/// Content of a view of the flow.
const FLOW: [&str; 2] = ["+ $origin/world/**", "- $origin/world/fields/**"];

/// Content of a view of a field.
fn field_contents(paths: &Paths, name: &str) -> [String; 5] {
    [
        format!("+ {}/**", paths.field(name)),
        "+ $origin/world".to_owned(),
        "+ $origin/world/walls".to_owned(),
        "+ $origin/world/moving".to_owned(),
        "+ $origin/world/gauges".to_owned(),
    ]
}

/// The bounding rectangle of the domains of all runs (m).
pub(super) fn bounds(infos: &[&RunInfo]) -> Rect {
    let domains = infos.iter().map(|info| info.domain);
    domains.reduce(Rect::around).unwrap_or_default()
}

/// Sends the layout of a run.
pub(super) fn send(
    rec: &RecordingStream,
    info: &RunInfo,
    paths: &Paths,
) -> Result<(), RecordError> {
    lay_out(rec, &info.recording_id, SIM_TIME, 0, |writer| writer.run(info, paths))
}

/// Sends the layout of runs side by side on the timeline of computing time.
pub(super) fn send_race(rec: &RecordingStream, infos: &[RunInfo]) -> Result<(), RecordError> {
    let id = infos.first().map_or("race", |info| info.recording_id.as_str());
    lay_out(rec, id, WALL_TIME, 0, |writer| writer.race(infos))
}

/// Sends the layout of runs side by side on one time cursor: the flows without plots.
pub(super) fn send_stage(rec: &RecordingStream, infos: &[&RunInfo]) -> Result<(), RecordError> {
    let id = infos.last().map_or("stage", |info| info.recording_id.as_str());
    // Successive layouts in one viewer must not share identifiers: the viewer would confuse views
    // with the same identifier.
    let first = id.bytes().fold(0_u64, |all, b| all.wrapping_mul(31).wrapping_add(u64::from(b)));
    lay_out(rec, id, SIM_TIME, first << 16, |writer| writer.stage(infos))
}

/// Sends the layout of a comparison: runs above; differences, curves and texts below.
pub(super) fn send_comparison(
    rec: &RecordingStream,
    id: &str,
    infos: &[&RunInfo],
    differences: &[(&RunInfo, Paths)],
    texts: &[(&str, rerun::EntityPath)],
) -> Result<(), RecordError> {
    lay_out(rec, id, SIM_TIME, 0, |writer| writer.comparison(infos, differences, texts))
}

fn lay_out(
    rec: &RecordingStream,
    id: &str,
    timeline: &str,
    first: u64,
    write: impl FnOnce(&mut Writer) -> Result<Node, RecordError>,
) -> Result<(), RecordError> {
    let (layout, storage) = rerun::RecordingStreamBuilder::new(APPLICATION)
        .recording_id(format!("{id}-layout"))
        .blueprint()
        .enabled(true)
        .memory()?;
    layout.set_log_time_enabled(false);
    layout.set_log_tick_enabled(false);
    layout.set_time_sequence("blueprint", 0);

    let mut writer = Writer { rec: &layout, count: first };
    let root = write(&mut writer)?;
    layout.log(
        "viewport",
        &archetypes::ViewportBlueprint::new()
            .with_root_container(Uuid { bytes: root.bytes })
            .with_auto_layout(false)
            .with_auto_views(false),
    )?;
    for panel in ["blueprint_panel", "selection_panel"] {
        layout.log(
            panel,
            &archetypes::PanelBlueprint::new().with_state(components::PanelState::Collapsed),
        )?;
    }
    layout.log(
        "time_panel",
        &archetypes::TimePanelBlueprint::new()
            .with_state(components::PanelState::Collapsed)
            .with_timeline(timeline)
            .with_play_state(components::PlayState::Following),
    )?;

    let Some(id) = layout.store_info().map(|store| store.store_id) else {
        return Ok(());
    };
    rec.send_blueprint(storage.take(), BlueprintActivationCommand::make_active(id));
    // The storage holds the stream, which holds the storage: without this, neither would be freed.
    layout.disconnect();
    Ok(())
}

impl Writer<'_> {
    fn run(&mut self, info: &RunInfo, paths: &Paths) -> Result<Node, RecordError> {
        let flow = self.flow(info, paths)?;
        let mut reading = vec![flow];
        if info.round {
            reading.insert(0, self.round(info, paths)?);
        }
        reading.push(self.text("Plan", &paths.at("plan"))?);
        reading.push(self.text("Scene", &paths.at("scene"))?);
        reading.push(self.log(&paths.at("log"))?);
        let flow = self.tabs(&reading)?;

        let fields = self.fields(info, paths)?;
        let plots = self.plots(info, paths)?;
        let [width, height] = info.domain.size();
        if width > WIDE * height {
            let mut left = vec![flow];
            let mut shares = vec![3.0];
            if !fields.is_empty() {
                left.push(self.stack(components::ContainerKind::Horizontal, &fields, &[])?);
                shares.push(2.0);
            }
            let left = self.stack(components::ContainerKind::Vertical, &left, &shares)?;
            match plots {
                None => Ok(left),
                Some(plots) => {
                    self.stack(components::ContainerKind::Horizontal, &[left, plots], &[2.0, 1.0])
                }
            }
        } else {
            let mut columns = vec![flow];
            let mut shares = vec![5.0];
            if !fields.is_empty() {
                columns.push(self.stack(components::ContainerKind::Vertical, &fields, &[])?);
                shares.push(3.0);
            }
            if let Some(plots) = plots {
                columns.push(plots);
                shares.push(4.0);
            }
            self.stack(components::ContainerKind::Horizontal, &columns, &shares)
        }
    }

    /// The flow with its fields in tabs beside it. Several runs are side by side, with the fields
    /// below.
    fn stage(&mut self, infos: &[&RunInfo]) -> Result<Node, RecordError> {
        let alone = infos.len() == 1;
        let mut lanes = vec![];
        for info in infos {
            let paths = Paths::new(&info.name);
            let [width, height] = info.domain.size();
            let flow = if alone { self.flow(info, &paths)? } else { self.lane(info, &paths)? };
            let mut fields = self.fields(info, &paths)?;
            if info.round {
                fields.insert(0, self.round(info, &paths)?);
            }
            if alone {
                fields.push(self.text("Plan", &paths.at("plan"))?);
                fields.push(self.text("Scene", &paths.at("scene"))?);
                fields.push(self.log(&paths.at("log"))?);
            }
            let mut parts = vec![flow];
            if !fields.is_empty() {
                parts.push(self.tabs(&fields)?);
            }
            let kind = if alone && width < WIDE * height {
                components::ContainerKind::Horizontal
            } else {
                components::ContainerKind::Vertical
            };
            let shares = if parts.len() == 2 { vec![1.0, 1.0] } else { vec![] };
            lanes.push(self.stack(kind, &parts, &shares)?);
        }
        self.stack(components::ContainerKind::Horizontal, &lanes, &[])
    }

    /// The flow of one of several runs, titled with its name.
    fn lane(&mut self, info: &RunInfo, paths: &Paths) -> Result<Node, RecordError> {
        self.space(&info.name, paths, &FLOW, colour_bar::seen(info.domain, colour_bar::Room::Large))
    }

    /// A column for each run, with their first plot below.
    fn race(&mut self, infos: &[RunInfo]) -> Result<Node, RecordError> {
        let mut lanes = vec![];
        let mut contents = vec![];
        for info in infos {
            let paths = Paths::new(&info.name);
            let mut lane = vec![self.lane(info, &paths)?];
            lane.extend(self.fields(info, &paths)?.into_iter().take(1));
            lanes.push(self.stack(components::ContainerKind::Vertical, &lane, &[])?);
            let series = info.plots.iter().take(1).flat_map(|plot| &plot.series);
            contents.extend(series.map(|s| format!("+ {}", paths.curve(&s.path, false))));
        }
        let lanes = self.stack(components::ContainerKind::Horizontal, &lanes, &[])?;
        let Some(plot) = infos.first().and_then(|info| info.plots.first()) else {
            return Ok(lanes);
        };
        let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
        let view = self.curves(&plot.title, "/", &contents, components::Corner2D::RightBottom)?;
        self.stack(components::ContainerKind::Vertical, &[lanes, view], &[3.0, 1.0])
    }

    fn comparison(
        &mut self,
        infos: &[&RunInfo],
        differences: &[(&RunInfo, Paths)],
        texts: &[(&str, rerun::EntityPath)],
    ) -> Result<Node, RecordError> {
        let domain = bounds(infos);
        let mut above = vec![self.lanes("Flow", infos, domain, &FLOW)?];
        let mut names: Vec<&str> = vec![];
        for field in infos.iter().flat_map(|info| &info.fields) {
            if !names.contains(&field.name.as_str()) {
                names.push(&field.name);
                above.push(self.field_lanes(&field.name, infos, domain)?);
            }
        }
        let above = self.tabs(&above)?;

        let mut below = vec![];
        let mut shares = vec![];
        let mut views = vec![];
        for (info, paths) in differences {
            let seen = colour_bar::seen(info.domain, colour_bar::Room::Small);
            for field in &info.fields {
                let title = format!("{}: {}", info.name, field.title());
                let contents = field_contents(paths, &field.name);
                let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
                views.push(self.space(&title, paths, &contents, seen)?);
            }
        }
        if !views.is_empty() {
            below.push(self.tabs(&views)?);
            shares.push(2.0);
        }
        let mut plots = self.overlaid(infos)?;
        if !plots.is_empty() {
            let rest = plots.split_off(1);
            if !rest.is_empty() {
                plots.push(self.tabs(&rest)?);
            }
            below.push(self.stack(components::ContainerKind::Horizontal, &plots, &[])?);
            shares.push(4.0);
        }
        let texts: Vec<Node> =
            texts.iter().map(|(title, path)| self.text(title, path)).collect::<Result<_, _>>()?;
        if !texts.is_empty() {
            below.push(self.tabs(&texts)?);
            shares.push(2.5);
        }
        let below = self.stack(components::ContainerKind::Horizontal, &below, &shares)?;
        self.stack(components::ContainerKind::Vertical, &[above, below], &[3.0, 2.0])
    }

    /// A view of each run, all with the same bounds.
    fn lanes(
        &mut self,
        title: &str,
        infos: &[&RunInfo],
        domain: Rect,
        contents: &[&str],
    ) -> Result<Node, RecordError> {
        let seen = colour_bar::seen(domain, colour_bar::Room::Large);
        let views = infos
            .iter()
            .map(|info| self.space(&info.name, &Paths::new(&info.name), contents, seen))
            .collect::<Result<Vec<_>, _>>()?;
        self.row(title, &views, domain)
    }

    fn field_lanes(
        &mut self,
        name: &str,
        infos: &[&RunInfo],
        domain: Rect,
    ) -> Result<Node, RecordError> {
        let seen = colour_bar::seen(domain, colour_bar::Room::Large);
        let mut views = vec![];
        let mut title = capital(name);
        for info in infos {
            let Some(field) = info.fields.iter().find(|field| field.name == name) else { continue };
            title = capital(&field.title());
            let paths = Paths::new(&info.name);
            let contents = field_contents(&paths, name);
            let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
            views.push(self.space(&info.name, &paths, &contents, seen)?);
        }
        self.row(&title, &views, domain)
    }

    /// Views of one kind side by side; views of flat domains one below the other.
    fn row(&mut self, title: &str, views: &[Node], domain: Rect) -> Result<Node, RecordError> {
        let [width, height] = domain.size();
        let kind = if width > WIDE * height && views.len() < 4 {
            components::ContainerKind::Vertical
        } else {
            components::ContainerKind::Horizontal
        };
        let row = self.stack(kind, views, &[])?;
        self.rec.log(
            row.path.as_str(),
            &archetypes::ContainerBlueprint::update_fields().with_display_name(title),
        )?;
        Ok(row)
    }

    /// A plot for each curve, containing that curve of all runs.
    fn overlaid(&mut self, infos: &[&RunInfo]) -> Result<Vec<Node>, RecordError> {
        let mut plots: Vec<(String, String, Vec<String>)> = vec![];
        for info in infos {
            let paths = Paths::new(&info.name);
            for plot in &info.plots {
                for series in &plot.series {
                    let title = match plot.series.len() {
                        1 => plot.title.clone(),
                        _ => format!("{}: {}", plot.title, series.name),
                    };
                    let own = format!("+ {}", paths.curve(&series.path, plot.log10));
                    match plots.iter_mut().find(|(t, p, _)| *t == title && *p == series.path) {
                        Some((_, _, contents)) => contents.push(own),
                        None => plots.push((title, series.path.clone(), vec![own])),
                    }
                }
            }
        }
        plots
            .iter()
            .map(|(title, _, contents)| {
                let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
                // Growing curves leave space at the bottom, decaying ones at the top.
                let corner = if title.contains("volume") {
                    components::Corner2D::RightBottom
                } else {
                    components::Corner2D::RightTop
                };
                self.curves(title, "/", &contents, corner)
            })
            .collect()
    }
}
