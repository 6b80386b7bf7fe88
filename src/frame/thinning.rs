//! This module chooses some of many points such that they are spread like all of them.

/// Bits of a coordinate along the Z-order curve.
const BITS: u32 = 16;

/// Indices of `most` of the points, in ascending order; all if there are no more.
///
/// The points are taken at equal distances along a Z-order curve, which visits neighbours one after the
/// other (G. M. Morton 1966). Particles are stored column by column of a cell: every second one of them
/// would be every second column.
pub fn evenly(points: &[[f32; 2]], most: usize) -> Vec<usize> {
    let count = points.len();
    if count <= most {
        return (0..count).collect();
    }
    let end = |c: usize, start: f32, pick: fn(f32, f32) -> f32| {
        points.iter().map(|p| p[c]).filter(|v| v.is_finite()).fold(start, pick)
    };
    let low = [0, 1].map(|c| end(c, f32::INFINITY, f32::min));
    let high = [0, 1].map(|c| end(c, f32::NEG_INFINITY, f32::max));
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let steps = ((1u32 << BITS) - 1) as f32;
    let key = |p: [f32; 2]| {
        // A value that is not finite, or a size of zero, gives step 0.
        let [x, y] = [0, 1].map(|c| ((p[c] - low[c]) / size * steps) as u32);
        spread(x) | spread(y) << 1
    };
    let mut curve: Vec<(u32, usize)> =
        points.iter().enumerate().map(|(k, &p)| (key(p), k)).collect();
    curve.sort_unstable();
    let mut kept: Vec<usize> = (0..most).map(|k| curve[k * count / most].1).collect();
    kept.sort_unstable();
    kept
}

/// The bits of a number, with a zero bit above each.
fn spread(v: u32) -> u32 {
    let v = (v | v << 8) & 0x00ff_00ff;
    let v = (v | v << 4) & 0x0f0f_0f0f;
    let v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread() {
        assert_eq!(spread(0b1011), 0b100_0101);
        assert_eq!(spread(0xffff), 0x5555_5555);
    }

    #[test]
    fn no_column_is_lost() {
        // Columns of particles, in the order of the columns within each of 8 by 8 cells.
        let mut points = vec![];
        for cell in 0..64 {
            for k in 0..16 {
                let [i, j] = [4 * (cell % 8) + k % 4, 4 * (cell / 8) + k / 4];
                points.push([i as f32, 0.25 * j as f32]);
            }
        }
        for most in [512, 900, 341] {
            let kept = evenly(&points, most);
            assert_eq!(kept.len(), most);
            assert!(kept.windows(2).all(|w| w[0] < w[1]));
            for i in 0..32 {
                let of_column = kept.iter().filter(|&&k| points[k][0] == i as f32).count();
                let share = of_column as f64 / (32 * most / 1024) as f64;
                assert!((0.6..1.5).contains(&share), "{most} {i} {of_column}");
            }
        }
        assert_eq!(evenly(&points, 2000).len(), points.len());
        assert_eq!(evenly(&[[f32::NAN, 1.0], [0.0, 0.0], [0.0, 0.0]], 2).len(), 2);
    }
}
