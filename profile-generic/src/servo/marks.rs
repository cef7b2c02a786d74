//! Places that switch an input while the axis passes them: print marks, the marker of the encoder, the home switch.

use super::ServoParameters;
use crate::capture::CaptureEdge;
use crate::quantity::Position;
use crate::time::{DurationNs, MonotonicTime};
use arrayvec::ArrayVec;

/// Places at which an input is active.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Marks {
    /// Where it becomes active, going upward.
    pub from: Position,
    /// How far it stays active, above zero.
    pub length: Position,
    /// Distance to the next mark, above the length; `None` for a single one.
    pub every: Option<Position>,
}

/// An edge on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Passage {
    /// Distance from the beginning of the stretch: finer than the time.
    pub way: u64,
    pub at: MonotonicTime,
    pub edge: CaptureEdge,
    pub place: Position,
}

/// A stretch of motion within one sub-step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub from: Position,
    pub to: Position,
    pub begin: MonotonicTime,
    pub length: DurationNs,
}

impl Stretch {
    /// Whether the stretch passes the bound, and if so in which direction. Standing on a bound is not passing
    /// it; the side from the bound upward belongs to the bound.
    pub const fn passes(&self, bound: i64) -> Option<CaptureEdge> {
        match (self.from.0 >= bound, self.to.0 >= bound) {
            (false, true) => Some(CaptureEdge::Positive),
            (true, false) => Some(CaptureEdge::Negative),
            _ => None,
        }
    }

    /// When the stretch is at the place.
    pub fn time_at(&self, place: i64) -> MonotonicTime {
        let whole = i128::from(self.to.0) - i128::from(self.from.0);
        if whole == 0 {
            return self.begin;
        }
        let part = (i128::from(place) - i128::from(self.from.0)) * i128::from(self.length.0) / whole;
        self.begin + DurationNs(i64::try_from(part).unwrap_or(self.length.0))
    }
}

/// The markers of the encoder.
pub(super) const fn of_feedback(parameters: &ServoParameters) -> Marks {
    Marks { from: Position::ZERO, length: parameters.marker_width, every: Some(parameters.marker_distance) }
}

impl Marks {
    /// Whether the input is active at a position.
    pub(super) fn contains(&self, position: Position) -> bool {
        self.bound_below(self.from.0, position.0)
            .is_some_and(|begin| position.0.saturating_sub(begin) < self.length.0)
    }

    /// The bound at or below a position, of those that repeat from `first` on in both directions.
    fn bound_below(&self, first: i64, position: i64) -> Option<i64> {
        match self.every {
            Some(every) if every.0 > 0 => {
                Some(position.saturating_sub(position.saturating_sub(first).rem_euclid(every.0)))
            }
            _ => (position >= first).then_some(first),
        }
    }

    /// The edges on a stretch. Of several marks that one sub-step passes the highest is taken: no drive tells
    /// them apart.
    pub(super) fn passages(&self, stretch: &Stretch) -> ArrayVec<Passage, 2> {
        let highest = stretch.from.max(stretch.to).0;
        let bounds = [(self.from.0, false), (self.from.0.saturating_add(self.length.0), true)];
        let edge = |(first, is_end): (i64, bool)| {
            let bound = self.bound_below(first, highest)?;
            let direction = stretch.passes(bound)?;
            // Upward it closes at its lower end and opens beyond its upper one; downward the other way.
            let closes = is_end == (direction == CaptureEdge::Negative);
            Some(Passage {
                way: bound.abs_diff(stretch.from.0),
                at: stretch.time_at(bound),
                edge: if closes { CaptureEdge::Positive } else { CaptureEdge::Negative },
                place: Position(if is_end { bound.saturating_sub(1) } else { bound }),
            })
        };
        bounds.into_iter().filter_map(edge).collect()
    }
}
