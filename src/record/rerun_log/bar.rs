//! Room around the domain, and where legends stand in it.

use crate::frame::Rect;

/// Margin around the domain, relative to its larger side.
const MARGIN: f32 = 0.03;

/// Room below the domain for a colour bar and its numbers. The numbers have
/// the same size on screen in every view, so small views need more of it.
#[derive(Clone, Copy)]
pub(super) enum Room {
    /// The view is most of the screen high.
    Large,
    /// The view is about a third of the screen high.
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

/// The larger side, damped for long flat domains: their views are as wide as
/// others, so their legends need as much room on screen.
fn reach(domain: Rect) -> f32 {
    let [width, height] = domain.size();
    height.max(0.6 * width)
}

/// What a view of the domain shows.
pub(super) fn seen(domain: Rect, room: Room) -> Rect {
    let reach = reach(domain);
    let margin = MARGIN * reach;
    Rect {
        min: [domain.min[0] - margin, domain.min[1] - room.foot() * reach],
        max: [domain.max[0] + margin, domain.max[1] + margin],
    }
}

/// Where a colour bar stands: below the domain.
pub(super) fn place(domain: Rect) -> Rect {
    let reach = reach(domain);
    Rect {
        min: [domain.min[0], domain.min[1] - 0.065 * reach],
        max: [domain.max[0], domain.min[1] - 0.04 * reach],
    }
}

/// Where the names of materials stand: in a row below the domain.
pub(super) fn row(domain: Rect, count: usize) -> impl Iterator<Item = [f32; 2]> + Clone {
    let reach = reach(domain);
    let [width, _] = domain.size();
    (0..count).map(move |i| {
        let share = (i as f32 + 0.5) / count as f32;
        [domain.min[0] + share * width, domain.min[1] - 0.05 * reach]
    })
}
