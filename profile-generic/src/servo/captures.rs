//! The capture unit of the drive: registration inputs, marker, home switch, watch position.

use super::marks::{Marks, Stretch};
use crate::capture::{
    CaptureEdge, CaptureKind, CaptureRequest, CaptureResult, CaptureSource, CaptureStatus, CaptureWindow,
};
use crate::quantity::Position;
use crate::time::MonotonicTime;
use arrayvec::ArrayVec;

/// Results that wait to be taken; beyond that the oldest is lost.
const MAX_RESULTS: usize = 16;

/// Edges in one sub-step: two of each input.
const MAX_EDGES: usize = 8;

/// The captures that a marker ends, with the edge of the marker.
const AFTER_SWITCH: [(CaptureSource, CaptureEdge); 2] = [
    (CaptureSource::HomeSwitchMarkerPositive, CaptureEdge::Positive),
    (CaptureSource::HomeSwitchMarkerNegative, CaptureEdge::Negative),
];

/// The armed captures and their results.
#[derive(Clone, Debug)]
pub(super) struct Captures {
    armed: [Option<CaptureRequest>; CaptureKind::COUNT],
    /// The home switch was passed: the next marker counts for the captures of [`AFTER_SWITCH`].
    awaiting_marker: [bool; CaptureKind::COUNT],
    results: ArrayVec<CaptureResult, MAX_RESULTS>,
    markers: Marks,
    /// Where the home switch is active; both ends belong to it.
    home_switch: Option<CaptureWindow>,
    /// Where the registration inputs are active.
    registration: [Option<Marks>; 2],
}

const fn marks_of(window: CaptureWindow) -> Marks {
    let length = window.to.0.saturating_sub(window.from.0).saturating_add(1);
    Marks { from: window.from, length: Position(length), every: None }
}

impl Captures {
    pub(super) fn new(markers: Marks) -> Self {
        Self {
            armed: [None; CaptureKind::COUNT],
            awaiting_marker: [false; CaptureKind::COUNT],
            results: ArrayVec::new(),
            markers,
            home_switch: None,
            registration: [None; 2],
        }
    }

    pub(super) fn set_markers(&mut self, markers: Marks) {
        self.markers = markers;
    }

    pub(super) fn set_home_switch(&mut self, window: Option<CaptureWindow>) {
        self.home_switch = window;
    }

    pub(super) fn set_marks(&mut self, number: usize, marks: Option<Marks>) {
        if let Some(held) = number.checked_sub(1).and_then(|at| self.registration.get_mut(at)) {
            *held = marks;
        }
    }

    pub(super) fn home_switch_at(&self, position: Position) -> bool {
        self.home_switch.is_some_and(|window| window.contains(position))
    }

    pub(super) fn is_marked(&self, number: usize, position: Position) -> bool {
        let marks = number.checked_sub(1).and_then(|at| *self.registration.get(at)?);
        marks.is_some_and(|marks| marks.contains(position))
    }

    /// Arms or disarms. A capture that is disarmed gives a result that says so.
    pub(super) fn request(&mut self, request: CaptureRequest, at: MonotonicTime) {
        let slot = CaptureKind::new(request.source, request.edge).index();
        let before = core::mem::replace(&mut self.armed[slot], request.arm.then_some(request));
        self.awaiting_marker[slot] = false;
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
        at: MonotonicTime,
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
        let inputs = [
            (CaptureSource::HomeSwitch, self.home_switch.map(marks_of)),
            (CaptureSource::Marker, Some(self.markers)),
            (CaptureSource::Registration1, self.registration[0]),
            (CaptureSource::Registration2, self.registration[1]),
        ];
        let mut edges = ArrayVec::<_, MAX_EDGES>::new();
        for (source, marks) in inputs {
            let passages = marks.iter().flat_map(|marks| marks.passages(stretch));
            edges.extend(passages.map(|passage| (passage, source)));
        }
        edges.sort_unstable_by_key(|(passage, _)| passage.way);
        for (passage, source) in edges {
            self.trigger(source, passage.edge, passage.place, passage.at);
            match source {
                CaptureSource::HomeSwitch => self.await_marker(passage.edge),
                CaptureSource::Marker => self.pass_marker(passage.edge, passage.place, passage.at),
                _ => {}
            }
        }
    }

    fn watch(&mut self, stretch: &Stretch) {
        for edge in CaptureEdge::ALL {
            let armed = self.armed[CaptureKind::new(CaptureSource::WatchPosition, *edge).index()];
            let Some(mark) = armed.map(|request| request.watch_position) else { continue };
            if stretch.passes(mark.0) == Some(*edge) {
                self.trigger(CaptureSource::WatchPosition, *edge, mark, stretch.time_at(mark.0));
            }
        }
    }

    fn await_marker(&mut self, edge: CaptureEdge) {
        for (source, _) in AFTER_SWITCH {
            let slot = CaptureKind::new(source, edge).index();
            self.awaiting_marker[slot] |= self.armed[slot].is_some();
        }
    }

    fn pass_marker(&mut self, marker: CaptureEdge, place: Position, at: MonotonicTime) {
        for (source, wanted) in AFTER_SWITCH {
            for edge in CaptureEdge::ALL {
                let slot = CaptureKind::new(source, *edge).index();
                if wanted == marker && core::mem::take(&mut self.awaiting_marker[slot]) {
                    self.trigger(source, *edge, place, at);
                }
            }
        }
    }

    fn trigger(&mut self, source: CaptureSource, edge: CaptureEdge, position: Position, at: MonotonicTime) {
        let slot = CaptureKind::new(source, edge).index();
        let Some(request) = self.armed[slot] else { return };
        if request.window.is_some_and(|window| !window.contains(position)) {
            return;
        }
        if !request.auto_rearm {
            self.armed[slot] = None;
        }
        self.give(&request, CaptureStatus::Captured, position, at);
    }

    fn give(
        &mut self,
        request: &CaptureRequest,
        status: CaptureStatus,
        position: Position,
        at: MonotonicTime,
    ) {
        if self.results.is_full() {
            self.results.remove(0);
        }
        let CaptureRequest { id, source, edge, .. } = *request;
        self.results.push(CaptureResult { id, source, edge, status, position, at });
    }
}
