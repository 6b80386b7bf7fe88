//! Writes views and containers of a layout.

use super::super::{Paths, RecordError, colour_bar};
use super::*;
use crate::frame::{Plot, Rect, RunInfo};
use crate::record::colour::PAPER;
use rerun::RecordingStream;
use rerun::components::Color;
use rerun::datatypes::{Range1D, Range2D};
use rerun::external::re_sdk_types::blueprint::{archetypes, components};

/// Distance of the eye from the middle of a round flow, over the size of the flow.
const EYE_DISTANCE: f32 = 1.5;
/// Height of the eye above the middle, over its distance.
const EYE_HEIGHT: f32 = 0.35;

/// A view or container that was written.
#[derive(Clone)]
pub(super) struct Node {
    pub(super) path: String,
    pub(super) bytes: [u8; 16],
}

pub(super) struct Writer<'a> {
    pub(super) rec: &'a RecordingStream,
    pub(super) count: u64,
}

pub(super) fn range(low: f32, high: f32) -> Range1D {
    Range1D([f64::from(low), f64::from(high)])
}

/// The text with its first letter in upper case.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

impl Writer<'_> {
    pub(super) fn flow(&mut self, info: &RunInfo, paths: &Paths) -> Result<Node, RecordError> {
        let title = match &info.particle_quantity {
            Some(quantity) => format!("Flow: {}", quantity.title()),
            None => "Flow".to_owned(),
        };
        self.space(&title, paths, &FLOW, colour_bar::seen(info.domain, colour_bar::Room::Large))
    }

    /// The view of a round flow in three dimensions, into the wedge that is left open.
    pub(super) fn round(&mut self, info: &RunInfo, paths: &Paths) -> Result<Node, RecordError> {
        let node = self.view("3D", "Round", &paths.at("round").to_string(), &["+ $origin/**"])?;
        self.on_paper(&node)?;
        let [radius, height] = info.domain.size();
        let middle = 0.5 * (info.domain.min[1] + info.domain.max[1]);
        let far = EYE_DISTANCE * height.max(2.0 * radius);
        let side = far * std::f32::consts::FRAC_1_SQRT_2;
        self.property(
            &node,
            "EyeControls3D",
            &archetypes::EyeControls3D::new()
                .with_position([side, middle + EYE_HEIGHT * far, side])
                .with_look_target([0.0, middle, 0.0]),
        )?;
        Ok(node)
    }

    pub(super) fn fields(
        &mut self,
        info: &RunInfo,
        paths: &Paths,
    ) -> Result<Vec<Node>, RecordError> {
        let seen = colour_bar::seen(info.domain, colour_bar::Room::Small);
        info.fields
            .iter()
            .map(|field| {
                let contents = field_contents(paths, &field.name);
                let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
                self.space(&capital(&field.title()), paths, &contents, seen)
            })
            .collect()
    }

    pub(super) fn plots(
        &mut self,
        info: &RunInfo,
        paths: &Paths,
    ) -> Result<Option<Node>, RecordError> {
        let mut views = info
            .plots
            .iter()
            .filter(|plot| !plot.series.is_empty())
            .map(|plot| self.plot(plot, paths))
            .collect::<Result<Vec<_>, _>>()?;
        if views.len() > PLOTS_AT_ONCE {
            let rest = views.split_off(PLOTS_AT_ONCE - 1);
            views.push(self.tabs(&rest)?);
        }
        if views.is_empty() {
            return Ok(None);
        }
        self.stack(components::ContainerKind::Vertical, &views, &[]).map(Some)
    }

    /// A view of a rectangle of space.
    pub(super) fn space(
        &mut self,
        name: &str,
        paths: &Paths,
        contents: &[&str],
        seen: Rect,
    ) -> Result<Node, RecordError> {
        let node = self.view("2D", name, &paths.root.to_string(), contents)?;
        // The world is drawn mirrored so that y points up: see the module documentation of
        // `rerun_log`.
        self.property(
            &node,
            "VisualBounds2D",
            &archetypes::VisualBounds2D::new(components::VisualBounds2D(Range2D {
                x_range: range(seen.min[0], seen.max[0]),
                y_range: range(-seen.max[1], -seen.min[1]),
            })),
        )?;
        self.on_paper(&node)?;
        Ok(node)
    }

    /// Gives a view the background of all pictures.
    fn on_paper(&self, view: &Node) -> Result<(), RecordError> {
        let [r, g, b] = PAPER;
        let plain = archetypes::Background::new(components::BackgroundKind::SolidColor);
        self.property(view, "Background", &plain.with_color(Color::from_rgb(r, g, b)))
    }

    pub(super) fn plot(&mut self, plot: &Plot, paths: &Paths) -> Result<Node, RecordError> {
        let contents: Vec<String> = plot
            .series
            .iter()
            .map(|series| format!("+ {}", paths.curve(&series.path, plot.log10)))
            .collect();
        let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
        let origin = paths.root.to_string();
        self.curves(&plot.title, &origin, &contents, components::Corner2D::LeftTop)
    }

    pub(super) fn curves(
        &mut self,
        title: &str,
        origin: &str,
        contents: &[&str],
        legend: components::Corner2D,
    ) -> Result<Node, RecordError> {
        let node = self.view("TimeSeries", title, origin, contents)?;
        self.property(&node, "PlotLegend", &archetypes::PlotLegend::new().with_corner(legend))?;
        Ok(node)
    }

    pub(super) fn text(
        &mut self,
        name: &str,
        origin: &rerun::EntityPath,
    ) -> Result<Node, RecordError> {
        self.view("TextDocument", name, &origin.to_string(), &["+ $origin"])
    }

    pub(super) fn log(&mut self, origin: &rerun::EntityPath) -> Result<Node, RecordError> {
        self.view("TextLog", "Log", &origin.to_string(), &["+ $origin/**"])
    }

    pub(super) fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &str,
        contents: &[&str],
    ) -> Result<Node, RecordError> {
        let node = self.node("view");
        self.rec.log(
            node.path.as_str(),
            &archetypes::ViewBlueprint::new(class)
                .with_display_name(name)
                .with_space_origin(origin),
        )?;
        self.property(
            &node,
            "ViewContents",
            &archetypes::ViewContents::new(contents.iter().copied()),
        )?;
        Ok(node)
    }

    pub(super) fn property(
        &self,
        view: &Node,
        name: &str,
        property: &dyn rerun::AsComponents,
    ) -> Result<(), RecordError> {
        Ok(self.rec.log(format!("{}/{name}", view.path), property)?)
    }

    pub(super) fn tabs(&mut self, children: &[Node]) -> Result<Node, RecordError> {
        let node = self.node("container");
        let paths = children.iter().map(|child| child.path.as_str());
        let mut tabs = archetypes::ContainerBlueprint::new(components::ContainerKind::Tabs)
            .with_contents(paths);
        if let Some(first) = children.first() {
            tabs = tabs.with_active_tab(first.path.as_str());
        }
        self.rec.log(node.path.as_str(), &tabs)?;
        Ok(node)
    }

    pub(super) fn stack(
        &mut self,
        kind: components::ContainerKind,
        children: &[Node],
        shares: &[f32],
    ) -> Result<Node, RecordError> {
        let node = self.node("container");
        let paths = children.iter().map(|child| child.path.as_str());
        let mut stack = archetypes::ContainerBlueprint::new(kind).with_contents(paths);
        if !shares.is_empty() {
            stack = match kind {
                components::ContainerKind::Vertical => stack.with_row_shares(shares.to_vec()),
                _ => stack.with_col_shares(shares.to_vec()),
            };
        }
        self.rec.log(node.path.as_str(), &stack)?;
        Ok(node)
    }

    /// The next identifier: a valid UUID of version 8 (application-defined).
    pub(super) fn node(&mut self, kind: &str) -> Node {
        self.count += 1;
        let mut bytes = [0; 16];
        bytes[..6].copy_from_slice(b"grains");
        bytes[6] = 0x80;
        bytes[8..].copy_from_slice(&self.count.to_be_bytes());
        bytes[8] |= 0x80;
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let path = format!(
            "{kind}/{}-{}-{}-{}-{}",
            &hex[..8],
            &hex[8..12],
            &hex[12..16],
            &hex[16..20],
            &hex[20..]
        );
        Node { path, bytes }
    }
}
