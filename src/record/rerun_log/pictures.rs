//! Writes what changes from frame to frame: curves, particles, fields, dye and isolines.

use super::*;
use crate::frame::{GridField, Isoline, ParticleSnapshot, Scalar, Snapshot};
use crate::record::colour::ColourScale;
use crate::record::number::short;
use rerun::archetypes;
use rerun::components::{Color, MagnificationFilter, Radius};
use rerun::{EntityPath, EntityPathPart};
use std::collections::HashMap;

pub(super) fn length(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

pub(super) fn expect_length(what: &str, found: usize, expected: usize) -> Result<(), RecordError> {
    if found == expected {
        Ok(())
    } else {
        Err(RecordError::Length { what: what.to_owned(), found, expected })
    }
}

/// Colour of a value.
pub(super) fn on_scale(scale: ColourScale, value: f32) -> Color {
    let [r, g, b, a] = scale.color(value);
    Color::from_unmultiplied_rgba(r, g, b, a)
}

/// What changed in the look of the particles since the last picture. No colours: those of the classes.
#[derive(Default)]
pub(super) struct Look {
    pub(super) classes: Option<Vec<u16>>,
    pub(super) radii: Option<Vec<Radius>>,
    pub(super) colours: Option<Vec<Color>>,
}

/// Points of two or three dimensions, which are different types, with a [`Look`].
macro_rules! with_look {
    ($points:expr, $look:expr) => {{
        let mut points = $points;
        if let Some(classes) = &$look.classes {
            points = points.with_class_ids(classes.iter().copied());
        }
        if let Some(radii) = &$look.radii {
            points = points.with_radii(radii.iter().copied());
        }
        if let Some(colours) = &$look.colours {
            points = points.with_colors(colours.iter().copied());
        }
        points
    }};
}
pub(super) use with_look;

impl RerunLog {
    pub(super) fn scalar(&self, scalar: &Scalar) -> Result<(), RecordError> {
        self.rec.log(self.paths.at(&scalar.path), &archetypes::Scalars::single(scalar.value))?;
        if self.logarithms.contains(&scalar.path) {
            let exponent = scalar.value.abs().log10();
            if exponent.is_finite() {
                self.rec.log(
                    self.paths.curve(&scalar.path, true),
                    &archetypes::Scalars::single(exponent),
                )?;
            }
        }
        Ok(())
    }

    pub(super) fn snapshot(&mut self, snapshot: &Snapshot) -> Result<(), RecordError> {
        let look = self.particles(&snapshot.particles)?;
        if self.round {
            self.round_picture(snapshot, &look)?;
        }
        self.rec.log(
            self.paths.at("world/dye"),
            &archetypes::LineStrips2D::new(snapshot.dye_lines.iter().map(Vec::as_slice))
                .with_colors([rgb(DYE)])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(depth::DYE),
        )?;
        self.rec.log(
            self.paths.at("world/directors"),
            &archetypes::LineStrips2D::new(snapshot.glyphs.iter().map(<[_; 2]>::as_slice))
                .with_colors([rgb(GLYPH)])
                .with_radii([Radius::new_ui_points(1.2)])
                .with_draw_order(depth::GLYPHS),
        )?;
        for surface in &snapshot.stresses {
            self.stresses(surface)?;
        }
        if !snapshot.moving.is_empty() {
            self.rec.log(
                self.paths.at("world/moving"),
                &archetypes::LineStrips2D::new(snapshot.moving.iter().map(Vec::as_slice))
                    .with_colors([rgb(WALL)])
                    .with_radii([Radius::new_ui_points(2.5)])
                    .with_draw_order(depth::WALLS),
            )?;
        }
        for field in &snapshot.fields {
            self.field(field)?;
            self.values(field)?;
        }
        if let Some(arrows) = &snapshot.arrows {
            expect_length("arrows", arrows.vectors.len(), arrows.origins.len())?;
            self.rec.log(
                self.paths.field(&arrows.field).join(&"arrows".into()),
                &archetypes::Arrows2D::from_vectors(arrows.vectors.iter().copied())
                    .with_origins(arrows.origins.iter().copied())
                    .with_colors([rgb(ARROW)])
                    .with_radii([Radius::new_ui_points(0.8)])
                    .with_draw_order(depth::GLYPHS),
            )?;
        }
        self.lines(&snapshot.isolines)
    }

    pub(super) fn particles(&mut self, particles: &ParticleSnapshot) -> Result<Look, RecordError> {
        let look = self.look(particles)?;
        let places = particles.positions.iter().copied();
        let points = archetypes::Points2D::update_fields().with_positions(places);
        self.rec.log(self.paths.at("world/particles"), &with_look!(points, look))?;
        Ok(look)
    }

    /// What changed in the look of the particles since the last picture; records the colour bar.
    fn look(&mut self, particles: &ParticleSnapshot) -> Result<Look, RecordError> {
        let count = particles.positions.len();
        expect_length("particle classes", particles.class.len(), count)?;
        let mut look = Look::default();
        if self.classes != particles.class {
            self.classes.clone_from(&particles.class);
            look.classes = Some(particles.class.clone());
        }
        // Old recordings have no radii of their own.
        let usual = [self.particle_radius];
        let radii = if particles.radii.is_empty() { &usual[..] } else { &particles.radii };
        if self.radii != radii {
            self.radii = radii.to_vec();
            look.radii = Some(radii.iter().map(|&r| Radius::new_scene_units(r)).collect());
        }
        if let Some(scalar) = &particles.scalar {
            expect_length("particle values", scalar.values.len(), count)?;
            let signed = self.particle_quantity.as_ref().is_some_and(|q| q.signed);
            let scale = ColourScale::new(scalar.range, signed);
            look.colours = Some(scalar.values.iter().map(|&v| on_scale(scale, v)).collect());
            self.scale_bar(&self.paths.at("world/scale"), scale)?;
            self.colored = true;
        } else if self.colored {
            look.colours = Some(vec![]);
            self.colored = false;
        }
        Ok(look)
    }

    pub(super) fn field(&mut self, field: &GridField) -> Result<(), RecordError> {
        expect_length(&format!("field {}", field.name), field.values.len(), field.nx * field.ny)?;
        let signed = self.quantities.get(&field.name).is_some_and(|quantity| quantity.signed);
        let scale = ColourScale::new(field.range, signed);
        let path = self.paths.field(&field.name);
        let [x, y] = field.origin;
        let [dx, dy] = field.cell;
        self.rec.log(
            path.join(&"image".into()),
            &[
                &archetypes::Transform3D::from_translation_scale([x, y, 0.0], [dx, dy, 1.0])
                    as &dyn rerun::AsComponents,
                &archetypes::Image::from_rgba32(
                    scale.image(&field.values),
                    [length(field.nx), length(field.ny)],
                )
                .with_magnification_filter(MagnificationFilter::Linear)
                .with_draw_order(depth::FIELD),
            ],
        )?;
        self.scale_bar(&path, scale)
    }

    /// Records the values of a field, which its colours do not give exactly. No view shows them.
    pub(super) fn values(&self, field: &GridField) -> Result<(), RecordError> {
        let coarse = field.on(field.rect(), field.nx.div_ceil(2), field.ny.div_ceil(2));
        let shape = vec![coarse.ny as u64, coarse.nx as u64];
        let buffer = rerun::datatypes::TensorBuffer::F32(coarse.values.into());
        let tensor = rerun::datatypes::TensorData::new(shape, buffer).with_dim_names(["y", "x"]);
        self.rec.log(
            self.paths.field(&field.name).join(&"values".into()),
            &archetypes::Tensor::new(tensor),
        )?;
        Ok(())
    }

    /// Draws a colour bar with numbers; it is drawn again when its ends change.
    pub(super) fn scale_bar(
        &mut self,
        path: &EntityPath,
        scale: ColourScale,
    ) -> Result<(), RecordError> {
        let last = self.scales.insert(path.clone(), scale);
        if last == Some(scale) {
            return Ok(());
        }
        let place = colour_bar::place(self.domain);
        let [width, height] = place.size();
        let [low, high] = scale.ends();
        if last.is_none() {
            const STEPS: u32 = 128;
            let ramp = (0..STEPS).map(|i| i as f32 / (STEPS - 1) as f32);
            let ramp: Vec<f32> = ramp.collect();
            let colors = if scale.is_signed() {
                ColourScale::new([-1.0, 1.0], true)
                    .image(&ramp.iter().map(|x| 2.0 * x - 1.0).collect::<Vec<_>>())
            } else {
                ColourScale::new([0.0, 1.0], false).image(&ramp)
            };
            self.rec.log_static(
                path.join(&"bar".into()),
                &[
                    &archetypes::Transform3D::from_translation_scale(
                        [place.min[0], place.min[1], 0.0],
                        [width / STEPS as f32, height, 1.0],
                    ) as &dyn rerun::AsComponents,
                    &archetypes::Image::from_rgba32(colors, [STEPS, 1])
                        .with_draw_order(depth::LEGEND),
                ],
            )?;
        }
        let middle = 0.5 * (low + high);
        let at = |share: f32| [place.min[0] + share * width, place.min[1]];
        self.rec.log(
            path.join(&"ticks".into()),
            &archetypes::Points2D::new([at(0.0), at(0.5), at(1.0)])
                .with_labels([low, middle, high].map(|value| short(f64::from(value))))
                .with_show_labels(true)
                .with_colors([rgb(INK)])
                .with_radii([Radius::new_ui_points(2.0)])
                .with_draw_order(depth::LEGEND),
        )?;
        Ok(())
    }

    pub(super) fn lines(&mut self, isolines: &[Isoline]) -> Result<(), RecordError> {
        let mut groups: HashMap<EntityPath, Vec<&Isoline>> = HashMap::new();
        for line in isolines {
            let path = if self.quantities.contains_key(&line.field) {
                self.paths.field(&line.field).join(&"isolines".into())
            } else {
                let part = EntityPathPart::new(line.field.clone());
                self.paths.at("world/isolines").join(&EntityPath::new(vec![part]))
            };
            groups.entry(path).or_default().push(line);
        }
        for gone in self.isolines.iter().filter(|path| !groups.contains_key(path)) {
            self.rec.log(gone.clone(), &archetypes::Clear::flat())?;
        }
        for (path, lines) in &groups {
            let strips = lines.iter().flat_map(|line| {
                // One label per level, on its longest strip.
                let longest = (line.strips.iter().enumerate())
                    .max_by_key(|(_, strip)| strip.len())
                    .map(|(i, _)| i);
                line.strips.iter().enumerate().map(move |(i, strip)| {
                    let label = if Some(i) == longest {
                        short(f64::from(line.level))
                    } else {
                        String::new()
                    };
                    (strip.as_slice(), label)
                })
            });
            let (strips, labels): (Vec<_>, Vec<_>) = strips.unzip();
            self.rec.log(
                path.clone(),
                &archetypes::LineStrips2D::new(strips)
                    .with_labels(labels)
                    .with_show_labels(true)
                    .with_colors([rgb(LINE)])
                    .with_radii([Radius::new_ui_points(0.8)])
                    .with_draw_order(depth::ISOLINES),
            )?;
        }
        self.isolines = groups.into_keys().collect();
        Ok(())
    }
}
