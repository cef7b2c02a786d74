//! CIP Motion <-> generic: events and what brings them.

use arrayvec::ArrayVec;
use profile_cip::wire::motion::codes::{EventChecking, EventType};
use profile_generic::capture::{CaptureKind, CaptureSet, CaptureStatus};
use profile_generic::image::{AxisFeedback, Signal};
use profile_generic::program::Conversion;

use super::cip_scaling::CipScaling;
use super::cip_tables::{CipUnit, has_direction};

/// Event types of the standard.
const EVENTS_MAX: usize = 17;

/// What brings an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EventTrigger {
    /// A capture of the drive.
    Capture(CaptureKind),
    /// The device, from the values of a signal.
    Signal(Signal),
}

#[derive(Debug, Clone, Copy)]
pub(super) struct EventRule {
    pub event: u8,
    /// Bit of Event Checking Control.
    pub checking: u32,
    pub trigger: EventTrigger,
}

/// The rows of the tables.
#[derive(Debug, Clone, Default)]
pub(super) struct EventTables {
    pub rules: Vec<EventRule>,
    pub status: Vec<(CaptureStatus, u8)>,
    pub units: Vec<(Signal, CipUnit)>,
}

/// The events of one axis.
#[derive(Debug, Clone, Default)]
pub struct EventProgram {
    rules: ArrayVec<EventRule, EVENTS_MAX>,
    status: ArrayVec<(CaptureStatus, u8), { CaptureStatus::ALL.len() }>,
    torque: Option<Conversion>,
}

impl EventProgram {
    /// `None` when a ratio of the scaling does not fit.
    pub(super) fn compile(tables: &EventTables, scaling: &CipScaling) -> Option<Self> {
        let torque = tables.units.iter().find(|(signal, _)| *signal == Signal::TorqueActual);
        let torque = match torque {
            Some((signal, unit)) => {
                let to_generic = scaling.convert(*unit, has_direction(signal.quantity()))?;
                Some(Conversion::new(to_generic.inverse()?))
            }
            None => None,
        };
        Some(Self {
            rules: tables.rules.iter().take(EVENTS_MAX).copied().collect(),
            status: tables.status.iter().take(CaptureStatus::ALL.len()).copied().collect(),
            torque,
        })
    }

    /// The events that can be checked for on an axis whose drive captures this and whose feedback has these signals.
    pub fn checkable(&self, captures: CaptureSet, feedback: &AxisFeedback) -> EventChecking {
        self.bits(|trigger| match trigger {
            EventTrigger::Capture(kind) => captures.contains(kind),
            EventTrigger::Signal(signal) => feedback.get(signal).is_some(),
        })
    }

    /// The events among those that the drive captures whose captures are in the set.
    pub fn captured(&self, captures: CaptureSet) -> EventChecking {
        if captures.is_empty() {
            return EventChecking::empty();
        }
        self.bits(|trigger| matches!(trigger, EventTrigger::Capture(kind) if captures.contains(kind)))
    }

    fn bits(&self, counts: impl Fn(EventTrigger) -> bool) -> EventChecking {
        let rules = self.rules.iter().filter(|rule| counts(rule.trigger));
        EventChecking::from_bits_retain(rules.fold(0, |bits, rule| bits | rule.checking))
    }

    /// The captures that events need.
    pub fn captures(&self, events: EventChecking) -> CaptureSet {
        if events.is_empty() {
            return CaptureSet::EMPTY;
        }
        let wanted = self.rules.iter().filter(|rule| events.bits() & rule.checking != 0);
        wanted
            .filter_map(|rule| match rule.trigger {
                EventTrigger::Capture(kind) => Some(kind),
                EventTrigger::Signal(_) => None,
            })
            .collect()
    }

    /// The event that a capture brings; `None` for one that no row names.
    pub fn event(&self, kind: CaptureKind) -> Option<EventType> {
        let rule = self.rules.iter().find(|rule| rule.trigger == EventTrigger::Capture(kind))?;
        Some(EventType(rule.event))
    }

    /// Event Status of a capture that ended in this way; `None` when nothing is to be told.
    pub fn status(&self, status: CaptureStatus) -> Option<u8> {
        self.status.iter().find(|(known, _)| *known == status).map(|(_, code)| *code)
    }

    /// The actual torque in the unit of the torque threshold.
    pub fn torque(&self, feedback: &AxisFeedback) -> Option<f32> {
        let torque = feedback.get(Signal::TorqueActual)?;
        self.torque.map(|conversion| conversion.convert_to_f32(torque).0.value)
    }
}
