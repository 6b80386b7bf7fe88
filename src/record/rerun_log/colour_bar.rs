//! This module computes the margins around the domain and the positions of the legends in them.

use crate::frame::Rect;

/// Margin around the domain, relative to its larger side.
const MARGIN: f32 = 0.03;

/// Space below the domain for a colour bar and its numbers. The numbers have the same size on
/// screen in every view, so small views need more space.
#[derive(Clone, Copy)]
pub(super) enum Room {
    /// Space for a view that fills most of the height of the screen.
    Large,
    /// Space for a view of about a third of the height of the screen.
    Small,
}

impl Room {
    fn foot(self) -> f32 {
        match self {
            Self::Large => 0.12,
            Self::Small => 0.2,
        }
    }
}

/// Reference length for the legends (m): the larger side, reduced for long flat domains. Their
/// views are as wide as others, so their legends need as much space on screen.
fn reach(domain: Rect) -> f32 {
    let [width, height] = domain.size();
    height.max(0.6 * width)
}

/// The rectangle that a view of the domain shows (m).
pub(super) fn seen(domain: Rect, room: Room) -> Rect {
    let reach = reach(domain);
    let margin = MARGIN * reach;
    Rect {
        min: [domain.min[0] - margin, domain.min[1] - room.foot() * reach],
        max: [domain.max[0] + margin, domain.max[1] + margin],
    }
}

/// The rectangle of a colour bar, below the domain (m).
pub(super) fn place(domain: Rect) -> Rect {
    let reach = reach(domain);
    Rect {
        min: [domain.min[0], domain.min[1] - 0.065 * reach],
        max: [domain.max[0], domain.min[1] - 0.04 * reach],
    }
}

/// The positions of the material names, in a row below the domain (m).
pub(super) fn row(domain: Rect, count: usize) -> impl Iterator<Item = [f32; 2]> + Clone {
    let reach = reach(domain);
    let [width, _] = domain.size();
    (0..count).map(move |i| {
        let share = (i as f32 + 0.5) / count as f32;
        [domain.min[0] + share * width, domain.min[1] - 0.05 * reach]
    })
}
