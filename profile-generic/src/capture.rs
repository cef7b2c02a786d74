//! Event capture: the position at which something happened (an optional application function).

use crate::code::named_enum;
use crate::quantity::Position;
use crate::time::MonotonicTime;

named_enum! {
    /// What triggers a capture.
    pub enum CaptureSource {
        /// The first registration (probe) input.
        Registration1 = "registration_1",
        /// The second registration (probe) input.
        Registration2 = "registration_2",
        /// The marker (index pulse) of the feedback device.
        Marker = "marker",
        /// The home switch input.
        HomeSwitch = "home_switch",
        /// The first rising edge of the marker after the edge of the home switch.
        HomeSwitchMarkerPositive = "home_switch_marker_positive",
        /// The first falling edge of the marker after the edge of the home switch.
        HomeSwitchMarkerNegative = "home_switch_marker_negative",
        /// The actual position passes the watch position.
        WatchPosition = "watch_position",
    }
}

named_enum! {
    /// Which edge triggers: of the input, or the direction in which a watch position is passed.
    #[derive(Default)]
    pub enum CaptureEdge {
        /// The input goes active; the watch position is passed forward.
        #[default]
        Positive = "positive",
        /// The input goes inactive; the watch position is passed backward.
        Negative = "negative",
    }
}

/// What is captured: a source with its edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CaptureKind {
    /// What triggers.
    pub source: CaptureSource,
    /// Which edge triggers; of the home switch where a marker follows it.
    pub edge: CaptureEdge,
}

impl CaptureKind {
    /// How many there are.
    pub const COUNT: usize = 2 * CaptureSource::ALL.len();

    /// A source with its edge.
    pub const fn new(source: CaptureSource, edge: CaptureEdge) -> Self {
        Self { source, edge }
    }

    /// Its number, from 0 to [`CaptureKind::COUNT`] less 1.
    pub const fn index(self) -> usize {
        let source = match self.source {
            CaptureSource::Registration1 => 0,
            CaptureSource::Registration2 => 1,
            CaptureSource::Marker => 2,
            CaptureSource::HomeSwitch => 3,
            CaptureSource::HomeSwitchMarkerPositive => 4,
            CaptureSource::HomeSwitchMarkerNegative => 5,
            CaptureSource::WatchPosition => 6,
        };
        let edge = match self.edge {
            CaptureEdge::Positive => 0,
            CaptureEdge::Negative => 1,
        };
        2 * source + edge
    }

    /// Every kind, by its number.
    pub fn all() -> impl Iterator<Item = Self> {
        let edges =
            |source: &'static CaptureSource| CaptureEdge::ALL.iter().map(|edge| Self::new(*source, *edge));
        CaptureSource::ALL.iter().flat_map(edges)
    }
}

/// Some kinds of captures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct CaptureSet(u32);

impl CaptureSet {
    /// None.
    pub const EMPTY: Self = Self(0);

    /// Whether there are none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the kind is among them.
    pub fn contains(self, kind: CaptureKind) -> bool {
        self.0 & 1 << kind.index() != 0
    }

    /// Those that are in both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Adds or removes a kind.
    pub fn set(&mut self, kind: CaptureKind, present: bool) {
        let bit = 1 << kind.index();
        self.0 = if present { self.0 | bit } else { self.0 & !bit };
    }
}

impl FromIterator<CaptureKind> for CaptureSet {
    fn from_iter<I: IntoIterator<Item = CaptureKind>>(kinds: I) -> Self {
        let mut set = Self::EMPTY;
        kinds.into_iter().for_each(|kind| set.set(kind, true));
        set
    }
}

/// A stretch of positions in which a trigger counts; both ends belong to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CaptureWindow {
    /// The lower end.
    pub from: Position,
    /// The upper end.
    pub to: Position,
}

impl CaptureWindow {
    /// Whether the position lies within the window.
    pub fn contains(self, position: Position) -> bool {
        self.from <= position && position <= self.to
    }
}

/// Arms or disarms a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CaptureRequest {
    /// Chosen by the requester, returned with the result.
    pub id: u8,
    /// Whether to arm or to disarm.
    pub arm: bool,
    /// What triggers.
    pub source: CaptureSource,
    /// Which edge triggers.
    pub edge: CaptureEdge,
    /// Whether the capture arms itself again after a trigger.
    pub auto_rearm: bool,
    /// Where a trigger counts; everywhere when `None`.
    pub window: Option<CaptureWindow>,
    /// The watch position; used with [`CaptureSource::WatchPosition`] only.
    pub watch_position: Position,
}

impl CaptureRequest {
    /// Arms a single capture without a window.
    pub const fn arm(id: u8, source: CaptureSource, edge: CaptureEdge) -> Self {
        Self { id, arm: true, source, edge, auto_rearm: false, window: None, watch_position: Position::ZERO }
    }

    /// Disarms a capture.
    pub const fn disarm(id: u8, source: CaptureSource, edge: CaptureEdge) -> Self {
        Self { id, arm: false, source, edge, auto_rearm: false, window: None, watch_position: Position::ZERO }
    }
}

named_enum! {
    /// How a capture ended.
    pub enum CaptureStatus {
        /// The trigger came.
        Captured = "captured",
        /// The capture was disarmed before a trigger came.
        Disarmed = "disarmed",
        /// The drive cannot capture this source or edge.
        NotSupported = "not_supported",
        /// The drive uses its capture unit for something else.
        Busy = "busy",
        /// The drive refused to arm, or its value could not be read.
        Failed = "failed",
        /// What happened first cannot be told: home switch and marker came too close to each other.
        Ambiguous = "ambiguous",
    }
}

/// What a capture brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CaptureResult {
    /// The identifier of the request.
    pub id: u8,
    /// What triggered.
    pub source: CaptureSource,
    /// Which edge triggered.
    pub edge: CaptureEdge,
    /// How it ended; position and time are meaningful for [`CaptureStatus::Captured`] only.
    pub status: CaptureStatus,
    /// The position at the trigger.
    pub position: Position,
    /// When it was triggered, on the local clock.
    pub at: MonotonicTime,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_belong_to_the_window() {
        let window = CaptureWindow { from: Position(-5), to: Position(5) };
        let inside = [-6, -5, 0, 5, 6].map(|position| window.contains(Position(position)));
        assert_eq!(inside, [false, true, true, true, false]);
    }

    #[test]
    fn kinds_are_numbered_without_a_gap() {
        let numbers: Vec<_> = CaptureKind::all().map(CaptureKind::index).collect();
        assert_eq!(numbers, (0..CaptureKind::COUNT).collect::<Vec<_>>());
        let mut set: CaptureSet = CaptureKind::all().collect();
        for kind in CaptureKind::all() {
            assert!(set.contains(kind));
            set.set(kind, false);
            assert!(!set.contains(kind));
        }
        assert!(set.is_empty());
    }

    #[test]
    fn sources_and_edges_have_names_that_lead_back() {
        for source in CaptureSource::ALL {
            assert_eq!(CaptureSource::parse(source.name()), Some(*source));
        }
        assert_eq!(CaptureEdge::parse("negative"), Some(CaptureEdge::Negative));
    }
}
