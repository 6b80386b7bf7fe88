//! Writes what does not change during a run: walls, gauges, texts and the styles of curves.

use super::*;
use crate::frame::RunInfo;
use crate::record::colour::{OKABE_ITO, of_gauge};
use rerun::archetypes;
use rerun::components::Radius;

/// The colour of a curve, lightened where its contrast in the dark theme of the viewer is too low.
pub(super) fn on_dark(color: [u8; 3]) -> [u8; 3] {
    match color {
        [0, 0, 0] => [220, 220, 220],
        [0, 114, 178] => [64, 160, 224],
        other => other,
    }
}

/// Names and colours of the materials.
pub(super) fn classes(info: &RunInfo) -> archetypes::AnnotationContext {
    let classes = info.materials.iter().enumerate().map(|(i, material)| {
        let id = u16::try_from(i).unwrap_or(u16::MAX);
        (id, material.name.as_str(), rgb8(material.rgb))
    });
    archetypes::AnnotationContext::new(classes.map(rerun::ClassDescription::from))
}

impl RerunLog {
    /// Records walls, gauges, legends, and the transform that makes y point up.
    pub(super) fn world(&mut self, info: &RunInfo) -> Result<(), RecordError> {
        let world = self.paths.at("world");
        self.rec
            .log_static(world.clone(), &archetypes::Transform3D::from_scale([1.0, -1.0, 1.0]))?;
        self.rec.log_static(world, &classes(info))?;
        self.rec.log_static(
            self.paths.at("world/particles"),
            &archetypes::Points2D::update_fields()
                .with_show_labels(false)
                .with_draw_order(depth::PARTICLES),
        )?;
        let walls = info.walls.iter();
        self.rec.log_static(
            self.paths.at("world/walls"),
            &archetypes::LineStrips2D::new(walls.clone().map(|wall| wall.points.as_slice()))
                .with_labels(walls.map(|wall| wall.name.as_str()))
                .with_show_labels(false)
                .with_colors([rgb(WALL)])
                .with_radii([Radius::new_ui_points(2.5)])
                .with_draw_order(depth::WALLS),
        )?;
        if !info.gauges.is_empty() {
            let gauges = info.gauges.iter();
            self.rec.log_static(
                self.paths.at("world/gauges"),
                &archetypes::LineStrips2D::new(gauges.clone().map(|gauge| gauge.points.as_slice()))
                    .with_colors((0..info.gauges.len()).map(|k| rgb(of_gauge(k))))
                    .with_radii([Radius::new_ui_points(1.5)])
                    .with_draw_order(depth::GAUGES),
            )?;
        }
        // A single material needs no legend; with a particle quantity, a colour bar is in its place.
        // Names of gauges would cover the flow beside the gauges.
        let mut entries: Vec<(&str, [u8; 3])> = vec![];
        if info.particle_quantity.is_none() {
            let drawn: Vec<_> = info.materials.iter().filter(|material| material.drawn).collect();
            if drawn.len() > 1 {
                entries.extend(drawn.iter().map(|m| (m.name.as_str(), m.rgb)));
            }
            let gauges = info.gauges.iter().enumerate();
            entries.extend(gauges.map(|(k, gauge)| (gauge.name.as_str(), of_gauge(k))));
        }
        if !entries.is_empty() {
            let row = colour_bar::row(info.domain, entries.len());
            self.rec.log_static(
                self.paths.at("world/materials"),
                &archetypes::Points2D::new(row.clone())
                    .with_colors(entries.iter().map(|entry| rgb(entry.1)))
                    .with_radii([Radius::new_ui_points(7.0)])
                    .with_draw_order(depth::LEGEND),
            )?;
            self.names("world/materials/names", row.zip(entries.iter().map(|entry| entry.0)))?;
        }
        Ok(())
    }

    /// Writes names below points. They are separate entities because a label takes the colour of
    /// the labelled point, which may be hard to read.
    pub(super) fn names<'a>(
        &self,
        path: &str,
        named: impl Iterator<Item = ([f32; 2], &'a str)>,
    ) -> Result<(), RecordError> {
        let (points, names): (Vec<_>, Vec<_>) = named.unzip();
        self.rec.log_static(
            self.paths.at(path),
            &archetypes::Points2D::new(points)
                .with_labels(names)
                .with_show_labels(true)
                .with_colors([rgb(INK)])
                .with_radii([Radius::new_ui_points(0.0)])
                .with_draw_order(depth::LEGEND),
        )?;
        Ok(())
    }

    pub(super) fn texts(&self, info: &RunInfo) -> Result<(), RecordError> {
        // The fence must be longer than any fence inside the text.
        let mut fence = "```".to_owned();
        while info.scene_toml.contains(&fence) {
            fence.push('`');
        }
        let scene = format!("{fence}toml\n{}\n{fence}\n", info.scene_toml.trim_end());
        for (path, text) in [("scene", scene), ("plan", info.plan_markdown.clone())] {
            self.rec
                .log_static(self.paths.at(path), &archetypes::TextDocument::from_markdown(text))?;
        }
        Ok(())
    }

    /// Records the names and colours of the curves.
    pub(super) fn curves(&self, info: &RunInfo) -> Result<(), RecordError> {
        for plot in &info.plots {
            for (series, &color) in plot.series.iter().zip(OKABE_ITO.iter().cycle()) {
                let of = |name: &str| series.path.starts_with(&format!("gauges/{name}/"));
                let color = info.gauges.iter().position(|g| of(&g.name)).map_or(color, of_gauge);
                let name =
                    if plot.log10 { format!("log10 {}", series.name) } else { series.name.clone() };
                self.rec.log_static(
                    self.paths.curve(&series.path, plot.log10),
                    &archetypes::SeriesLines::new()
                        .with_names([name])
                        .with_colors([rgb(on_dark(color))])
                        .with_widths([1.75]),
                )?;
            }
        }
        Ok(())
    }

    /// Gives all curves of a run one colour, and `name` if given: the plot contains several runs.
    pub(super) fn one_color(
        &self,
        info: &RunInfo,
        name: Option<&str>,
        color: [u8; 3],
    ) -> Result<(), RecordError> {
        let mut style = archetypes::SeriesLines::update_fields()
            .with_colors([rgb(on_dark(color))])
            .with_widths([1.75]);
        if let Some(name) = name {
            style = style.with_names([name]);
        }
        for plot in &info.plots {
            for series in &plot.series {
                self.rec.log_static(self.paths.curve(&series.path, plot.log10), &style)?;
            }
        }
        Ok(())
    }
}
