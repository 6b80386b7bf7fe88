//! This module maps numbers and curves to colours that colour-blind readers can distinguish.

/// Red, green, blue and opacity, each 0 to 255.
pub type Rgba = [u8; 4];

/// Background colour of the flow and the fields. It is light so that dark walls stand out.
pub const PAPER: [u8; 3] = [245, 245, 242];

/// Colour of pixels without a value: that of the background, [`PAPER`].
///
/// Rerun draws images as opaque, and transparent pixels as black.
pub const NOTHING: Rgba = [PAPER[0], PAPER[1], PAPER[2], 255];

/// The palette of Okabe and Ito without its yellow, which has too little contrast on white.
pub const OKABE_ITO: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [0, 0, 0],
];

/// The colour of the gauge with this index: of its line, its name and its curves.
pub fn of_gauge(index: usize) -> [u8; 3] {
    // The first is vermilion, which stands out against grains.
    const ORDER: [usize; 6] = [1, 0, 2, 3, 5, 4];
    OKABE_ITO[ORDER[index % ORDER.len()]]
}

/// Every eighth entry of matplotlib's `viridis` (CC0), dark to bright.
const VIRIDIS: [[u8; 3]; 33] = [
    [68, 1, 84],
    [71, 13, 96],
    [72, 24, 106],
    [72, 35, 116],
    [71, 45, 123],
    [69, 55, 129],
    [66, 64, 134],
    [62, 73, 137],
    [59, 82, 139],
    [55, 91, 141],
    [51, 99, 141],
    [47, 107, 142],
    [44, 114, 142],
    [41, 122, 142],
    [38, 130, 142],
    [35, 137, 142],
    [33, 145, 140],
    [31, 152, 139],
    [31, 160, 136],
    [34, 167, 133],
    [40, 174, 128],
    [50, 182, 122],
    [63, 188, 115],
    [78, 195, 107],
    [94, 201, 98],
    [112, 207, 87],
    [132, 212, 75],
    [152, 216, 62],
    [173, 220, 48],
    [194, 223, 35],
    [216, 226, 25],
    [236, 229, 27],
    [253, 231, 37],
];

/// A diverging scale from blue over white to rust, interpolated in Oklab between seven anchors:
/// lightness falls evenly from the middle to both ends (0.98 to 0.30 and 0.32).
const BLUE_WHITE_RUST: [[u8; 3]; 17] = [
    [11, 42, 91],
    [23, 70, 124],
    [37, 100, 158],
    [64, 131, 187],
    [110, 163, 206],
    [154, 194, 224],
    [189, 216, 234],
    [218, 231, 241],
    [247, 247, 247],
    [247, 226, 212],
    [245, 205, 176],
    [240, 179, 139],
    [226, 143, 100],
    [211, 106, 58],
    [176, 74, 34],
    [135, 47, 21],
    [95, 21, 10],
];

/// Colour scale: maps values to colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    low: f32,
    high: f32,
    signed: bool,
}

impl ColourScale {
    /// A scale over `range`; if `signed`, a scale symmetric about zero that contains `range`.
    pub fn new(range: [f32; 2], signed: bool) -> Self {
        let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
        let [low, high] = range.map(finite);
        if signed {
            let reach = low.abs().max(high.abs());
            Self { low: -reach, high: reach, signed }
        } else {
            Self { low: low.min(high), high: low.max(high), signed }
        }
    }

    /// Values at the two ends of the scale.
    pub fn ends(&self) -> [f32; 2] {
        [self.low, self.high]
    }

    /// Whether the scale is symmetric about zero, with white at zero.
    pub fn is_signed(&self) -> bool {
        self.signed
    }

    /// Colour of one value. NaN gives [`NOTHING`]; values outside the range give the nearer end.
    pub fn color(&self, value: f32) -> Rgba {
        if value.is_nan() {
            return NOTHING;
        }
        let span = self.high - self.low;
        let place = if span > 0.0 {
            ((value - self.low) / span).clamp(0.0, 1.0)
        } else if self.signed {
            0.5
        } else {
            0.0
        };
        let [r, g, b] =
            if self.signed { lookup(&BLUE_WHITE_RUST, place) } else { lookup(&VIRIDIS, place) };
        [r, g, b, 255]
    }

    /// Colours of many values as the bytes of an RGBA image. They are quantised to 1024 steps,
    /// finer than 8 bits per channel can show.
    pub fn image(&self, values: &[f32]) -> Vec<u8> {
        const STEPS: f32 = 1023.0;
        let span = self.high - self.low;
        let palette: Vec<Rgba> = (0..=STEPS as usize)
            .map(|k| self.color(self.low + span * (k as f32 / STEPS)))
            .collect();
        let per_value = if span > 0.0 { STEPS / span } else { 0.0 };
        let mut image = vec![0; 4 * values.len()];
        for (texel, &v) in image.as_chunks_mut().0.iter_mut().zip(values) {
            // NaN has no place in the palette; values outside the range are clamped.
            let place = ((v - self.low) * per_value + 0.5).clamp(0.0, STEPS);
            *texel = if v.is_nan() { NOTHING } else { palette[place as usize] };
        }
        image
    }
}

/// Interpolates linearly in a table; `place` is in [0, 1].
fn lookup(table: &[[u8; 3]], place: f32) -> [u8; 3] {
    let x = place * (table.len() - 1) as f32;
    let i = (x as usize).min(table.len() - 2);
    let fraction = x - i as f32;
    let mix = |k: usize| {
        let (a, b) = (f32::from(table[i][k]), f32::from(table[i + 1][k]));
        (a + fraction * (b - a) + 0.5) as u8
    };
    [mix(0), mix(1), mix(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_middle_and_nan() {
        let plain = ColourScale::new([2.0, 4.0], false);
        assert_eq!(plain.color(2.0), [68, 1, 84, 255]);
        assert_eq!(plain.color(9.0), [253, 231, 37, 255]);
        assert_eq!(plain.color(f32::NAN), NOTHING);
        let signed = ColourScale::new([-1.0, 3.0], true);
        assert_eq!(signed.ends(), [-3.0, 3.0]);
        assert_eq!(signed.color(0.0), [247, 247, 247, 255]);
    }

    #[test]
    fn empty_and_infinite_ranges_have_a_colour() {
        for range in [[0.0, 0.0], [f32::NAN, 1.0], [f32::INFINITY, 0.0]] {
            for signed in [false, true] {
                assert_eq!(ColourScale::new(range, signed).color(0.5)[3], 255);
            }
        }
    }
}
