//! The capture unit of the drive: registration inputs, marker, home switch, watch position.

use super::plant::mark_below;
use crate::capture::{
    CaptureEdge, CaptureRequest, CaptureResult, CaptureSource, CaptureStatus, CaptureWindow,
};
use crate::quantity::Position;
use crate::time::{DurationNs, SystemTime};
use arrayvec::ArrayVec;

/// One capture for each source and edge.
const SLOTS: usize = 12;

/// Results that wait to be taken; beyond that the oldest is lost.
const MAX_RESULTS: usize = 16;

/// A stretch of motion within one sub-step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) from: Position,
    pub(super) to: Position,
    pub(super) begin: SystemTime,
    pub(super) length: DurationNs,
}

impl Stretch {
    /// Whether the stretch passes the mark, and if so in which direction. Standing on a mark is not passing
    /// it; the side from the mark upward belongs to the mark.
    const fn passes(&self, mark: i64) -> Option<CaptureEdge> {
        match (self.from.0 >= mark, self.to.0 >= mark) {
            (false, true) => Some(CaptureEdge::Positive),
            (true, false) => Some(CaptureEdge::Negative),
            _ => None,
        }
    }

    /// Whether the stretch passes `mark` first and `place` after it.
    const fn passes_before(&self, mark: i64, place: i64) -> bool {
        if self.from.0 < self.to.0 {
            self.from.0 < mark && mark < place && place <= self.to.0
        } else {
            self.from.0 >= mark && mark > place && place >= self.to.0
        }
    }

    /// When the stretch is at the place.
    fn time_at(&self, place: i64) -> SystemTime {
        let whole = i128::from(self.to.0) - i128::from(self.from.0);
        if whole == 0 {
            return self.begin;
        }
        let part = (i128::from(place) - i128::from(self.from.0)) * i128::from(self.length.0) / whole;
        self.begin + DurationNs(i64::try_from(part).unwrap_or(self.length.0))
    }
}

/// The armed captures and their results.
#[derive(Clone, Debug)]
pub(super) struct Captures {
    armed: [Option<CaptureRequest>; SLOTS],
    /// Where the home switch was passed; the next marker beyond counts for
    /// [`CaptureSource::HomeSwitchMarker`] with this edge.
    awaiting_marker: [Option<Position>; 2],
    results: ArrayVec<CaptureResult, MAX_RESULTS>,
    marker_distance: Position,
    /// Where the home switch is active; both ends belong to it.
    home_switch: Option<CaptureWindow>,
}

fn slot(source: CaptureSource, edge: CaptureEdge) -> usize {
    let source = CaptureSource::ALL.iter().position(|known| *known == source).unwrap_or(0);
    2 * source + usize::from(edge == CaptureEdge::Negative)
}

impl Captures {
    /// `marker_distance` is above zero.
    pub(super) fn new(marker_distance: Position) -> Self {
        Self {
            armed: [None; SLOTS],
            awaiting_marker: [None; 2],
            results: ArrayVec::new(),
            marker_distance,
            home_switch: None,
        }
    }

    pub(super) fn set_marker_distance(&mut self, distance: Position) {
        self.marker_distance = distance;
    }

    pub(super) fn set_home_switch(&mut self, window: Option<CaptureWindow>) {
        self.home_switch = window;
    }

    pub(super) fn home_switch_at(&self, position: Position) -> bool {
        self.home_switch.is_some_and(|window| window.contains(position))
    }

    /// Arms or disarms. A capture that is disarmed gives a result that says so.
    pub(super) fn request(&mut self, request: CaptureRequest, at: SystemTime) {
        let slot = slot(request.source, request.edge);
        let before = core::mem::replace(&mut self.armed[slot], request.arm.then_some(request));
        if request.source == CaptureSource::HomeSwitchMarker {
            self.awaiting_marker[usize::from(request.edge == CaptureEdge::Negative)] = None;
        }
        if let (Some(before), false) = (before, request.arm) {
            self.give(&before, CaptureStatus::Disarmed, Position::ZERO, at);
        }
    }

    /// Takes the oldest result.
    pub(super) fn poll(&mut self) -> Option<CaptureResult> {
        (!self.results.is_empty()).then(|| self.results.remove(0))
    }

    /// An input changed.
    pub(super) fn on_input(
        &mut self,
        source: CaptureSource,
        active: bool,
        position: Position,
        at: SystemTime,
    ) {
        let edge = if active { CaptureEdge::Positive } else { CaptureEdge::Negative };
        self.trigger(source, edge, position, at);
    }

    /// The axis moved.
    pub(super) fn on_motion(&mut self, stretch: &Stretch) {
        if stretch.from == stretch.to {
            return;
        }
        self.watch(stretch);
        self.pass_home_switch(stretch);
        self.pass_marker(stretch);
    }

    fn watch(&mut self, stretch: &Stretch) {
        for edge in [CaptureEdge::Positive, CaptureEdge::Negative] {
            let armed = self.armed[slot(CaptureSource::WatchPosition, edge)];
            let Some(mark) = armed.map(|request| request.watch_position) else { continue };
            if stretch.passes(mark.0) == Some(edge) {
                self.trigger(CaptureSource::WatchPosition, edge, mark, stretch.time_at(mark.0));
            }
        }
    }

    fn pass_home_switch(&mut self, stretch: &Stretch) {
        let Some(window) = self.home_switch else { return };
        let forward = stretch.to > stretch.from;
        // Upward the switch closes at its lower end and opens just beyond its upper one; downward the other
        // way.
        let (first, second) = (window.from.0, window.to.0.saturating_add(1));
        let ends = if forward { [first, second] } else { [second, first] };
        for mark in ends {
            let Some(direction) = stretch.passes(mark) else { continue };
            let closes = (mark == first) == (direction == CaptureEdge::Positive);
            let edge = if closes { CaptureEdge::Positive } else { CaptureEdge::Negative };
            let place = Position(if mark == first { first } else { window.to.0 });
            let at = stretch.time_at(place.0);
            self.trigger(CaptureSource::HomeSwitch, edge, place, at);
            if self.armed[slot(CaptureSource::HomeSwitchMarker, edge)].is_some() {
                self.awaiting_marker[usize::from(edge == CaptureEdge::Negative)] = Some(place);
            }
        }
    }

    /// A sub-step passes one marker at most, or several of which the last is taken: no drive tells them
    /// apart.
    fn pass_marker(&mut self, stretch: &Stretch) {
        let mark = mark_below(stretch.from.max(stretch.to), self.marker_distance);
        let Some(direction) = stretch.passes(mark) else { return };
        let at = stretch.time_at(mark);
        self.trigger(CaptureSource::Marker, direction, Position(mark), at);
        for edge in [CaptureEdge::Positive, CaptureEdge::Negative] {
            let awaiting = &mut self.awaiting_marker[usize::from(edge == CaptureEdge::Negative)];
            // One sub-step may pass a marker first and the switch after it.
            if awaiting.take_if(|place| !stretch.passes_before(mark, place.0)).is_some() {
                self.trigger(CaptureSource::HomeSwitchMarker, edge, Position(mark), at);
            }
        }
    }

    fn trigger(&mut self, source: CaptureSource, edge: CaptureEdge, position: Position, at: SystemTime) {
        let slot = slot(source, edge);
        let Some(request) = self.armed[slot] else { return };
        if request.window.is_some_and(|window| !window.contains(position)) {
            return;
        }
        if !request.auto_rearm {
            self.armed[slot] = None;
        }
        self.give(&request, CaptureStatus::Captured, position, at);
    }

    fn give(&mut self, request: &CaptureRequest, status: CaptureStatus, position: Position, at: SystemTime) {
        if self.results.is_full() {
            self.results.remove(0);
        }
        let CaptureRequest { id, source, edge, .. } = *request;
        self.results.push(CaptureResult { id, source, edge, status, position, at });
    }
}
