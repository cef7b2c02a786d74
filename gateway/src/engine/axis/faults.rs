//! What is wrong with the axis: everything that is there, the fault that has stopped it, and what that is about.

use arrayvec::ArrayVec;
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::fault_set::{ActiveFault, FAULT_SET_MAX, FaultSet, Origin};
use profile_generic::time::SystemTime;

use super::{Loss, PositionJump, Reactions, Trip};

/// The faults of one axis.
#[derive(Debug)]
pub(super) struct Faults {
    /// The fault that has stopped the axis: the first one, until a reset.
    first: Option<Fault>,
    /// Everything that is wrong now.
    set: FaultSet,
    reactions: Reactions,
    /// The reaction to a lost command.
    pub command_loss: Reaction,
    loss: Option<Loss>,
    tripped: Option<Trip>,
    /// The jump that the fault of this instant is about.
    jump: Option<(SystemTime, PositionJump)>,
    count: u32,
}

/// Faults that only say what the controller did or failed to do.
fn caused_by_controller(cause: FaultCause) -> bool {
    matches!(cause, FaultCause::CONTROLLER_ABORT | FaultCause::COMMAND_LOST | FaultCause::CONNECTION_CLOSED)
}

impl Faults {
    /// None, of an axis with this reaction to a lost command.
    pub fn new(command_loss: Reaction) -> Self {
        Self {
            first: None,
            set: FaultSet::new(),
            reactions: Reactions::default(),
            command_loss,
            loss: None,
            tripped: None,
            jump: None,
            count: 0,
        }
    }

    /// The fault that has stopped the axis.
    pub fn first(&self) -> Option<Fault> {
        self.first
    }

    pub fn set(&self) -> &FaultSet {
        &self.set
    }

    /// Faults that have stopped the axis so far.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Takes other reactions; `false` when they are the same.
    pub fn configure(&mut self, reactions: &Reactions) -> bool {
        let changes = self.reactions != *reactions;
        self.reactions = *reactions;
        changes
    }

    /// The fault with the reaction that follows from it.
    pub fn decided(&self, fault: Fault, origin: Origin) -> Fault {
        fault.with_reaction(self.reactions.decide(&ActiveFault { fault, origin }))
    }

    /// Everything that is there, with the reactions that follow from it.
    pub fn all_decided(&self) -> ArrayVec<Fault, FAULT_SET_MAX> {
        self.set.iter().map(|active| self.decided(active.fault, active.origin)).collect()
    }

    /// Something is wrong; `false` when it is known. What only says what the controller did is not kept.
    pub fn raise(&mut self, fault: Fault, origin: Origin) -> bool {
        let kept = origin != Origin::Event || !caused_by_controller(fault.cause);
        kept && self.set.raise(fault, origin)
    }

    /// A cause of this origin is over.
    pub fn end(&mut self, cause: FaultCause, origin: Origin) {
        self.set.clear(cause, origin);
    }

    /// All of an origin is over but what `keep` names.
    pub fn end_all(&mut self, origin: Origin, keep: impl Fn(FaultCause) -> bool) {
        self.set.clear_all(origin, keep);
    }

    /// The axis stops for a fault. What the drive has is worth more to know than that the controller had stopped it.
    pub fn stop_for(&mut self, fault: Fault) {
        if self.knows_nothing_better() && (self.first.is_none() || !caused_by_controller(fault.cause)) {
            self.first = Some(fault);
            self.count = self.count.saturating_add(1);
        }
    }

    /// Whether nothing has stopped the axis but the controller.
    pub fn knows_nothing_better(&self) -> bool {
        self.first.is_none_or(|known| caused_by_controller(known.cause))
    }

    /// The cause of an undiagnosed fault of the drive is known; it came when the drive first showed it.
    pub fn refine(&mut self, fault: Fault) {
        if let Some(known) = self.first.as_mut().filter(|known| known.cause == FaultCause::DRIVE_SPECIFIC) {
            *known = Fault { at: known.at, ..fault };
        }
    }

    /// A reset: what has happened is over. A drive that is not there is no event: it is `silent` still, and that is the fault.
    pub fn reset(&mut self, silent: bool) {
        self.set.clear_all(Origin::Event, |cause| silent && cause == FaultCause::SOUTH_SILENCE);
        let silence = self.set.iter().find(|active| active.origin == Origin::Event);
        self.first = silence.map(|active| self.decided(active.fault, active.origin));
    }

    /// What the fault that has just come is about: why the command was lost.
    pub fn note_loss(&mut self, loss: Option<Loss>) {
        self.loss = loss;
    }

    /// The same: the limit that a set-point has exceeded, when that is the fault of this instant.
    pub fn note_trip(&mut self, cause: FaultCause, at: SystemTime, trip: Trip) {
        if self.first.is_some_and(|fault| fault.cause == cause && fault.at == at) {
            self.tripped = Some(trip);
        }
    }

    /// The same: a jump of the actual position.
    pub fn note_jump(&mut self, at: SystemTime, jump: PositionJump) {
        self.jump = Some((at, jump));
    }

    fn is_about(&self, causes: &[FaultCause]) -> bool {
        self.first.is_some_and(|fault| causes.contains(&fault.cause))
    }

    /// Why the command was lost, when that is the fault.
    pub fn loss(&self) -> Option<Loss> {
        self.loss.filter(|_| self.is_about(&[FaultCause::COMMAND_LOST]))
    }

    /// The limit that a set-point has exceeded, when that is the fault.
    pub fn tripped(&self) -> Option<Trip> {
        let limits = [
            FaultCause::POSITION_COMMAND_LIMIT,
            FaultCause::VELOCITY_COMMAND_LIMIT,
            FaultCause::ACCELERATION_COMMAND_LIMIT,
        ];
        self.tripped.filter(|_| self.is_about(&limits))
    }

    /// The jump of the actual position, when that is the fault.
    pub fn jump(&self) -> Option<PositionJump> {
        let (at, jump) = self.jump?;
        let same = self.first.is_some_and(|fault| fault.at == at);
        (same && self.is_about(&[FaultCause::FEEDBACK_DATA_LOSS])).then_some(jump)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(cause: FaultCause, at: u64) -> Fault {
        Fault::new(cause, SystemTime(at))
    }

    fn first(faults: &Faults) -> Option<(FaultCause, u64)> {
        faults.first().map(|fault| (fault.cause, fault.at.0))
    }

    #[test]
    fn the_first_fault_stays_unless_the_controller_alone_had_stopped_the_axis() {
        let mut faults = Faults::new(Reaction::HoldPosition);
        faults.stop_for(fault(FaultCause::COMMAND_LOST, 1));
        faults.stop_for(fault(FaultCause::CONTROLLER_ABORT, 2));
        assert_eq!((first(&faults), faults.count()), (Some((FaultCause::COMMAND_LOST, 1)), 1));
        faults.stop_for(fault(FaultCause::OVER_CURRENT, 3));
        faults.stop_for(fault(FaultCause::OVER_VOLTAGE, 4));
        assert_eq!((first(&faults), faults.count()), (Some((FaultCause::OVER_CURRENT, 3)), 2));
        assert!(!faults.knows_nothing_better());
    }

    #[test]
    fn a_diagnosis_names_an_undiagnosed_fault_and_no_other() {
        let mut faults = Faults::new(Reaction::HoldPosition);
        faults.stop_for(fault(FaultCause::DRIVE_SPECIFIC, 1));
        faults.refine(fault(FaultCause::OVER_VOLTAGE, 5));
        assert_eq!(
            first(&faults),
            Some((FaultCause::OVER_VOLTAGE, 1)),
            "it came when the drive first showed it"
        );
        faults.refine(fault(FaultCause::OVER_CURRENT, 6));
        assert_eq!(first(&faults), Some((FaultCause::OVER_VOLTAGE, 1)));
    }

    #[test]
    fn a_reset_ends_events_and_keeps_what_the_drive_shows_and_its_silence() {
        let mut faults = Faults::new(Reaction::HoldPosition);
        assert!(faults.raise(fault(FaultCause::SOUTH_SILENCE, 1), Origin::Event));
        assert!(faults.raise(fault(FaultCause::CONFIGURATION, 1), Origin::Event));
        assert!(faults.raise(fault(FaultCause::OVER_VOLTAGE, 1), Origin::Drive));
        assert!(
            !faults.raise(fault(FaultCause::COMMAND_LOST, 1), Origin::Event),
            "only the controller's doing"
        );
        let causes =
            |faults: &Faults| faults.set().iter().map(|active| active.fault.cause).collect::<Vec<_>>();
        faults.stop_for(fault(FaultCause::CONFIGURATION, 1));
        faults.reset(true);
        assert_eq!(causes(&faults), [FaultCause::SOUTH_SILENCE, FaultCause::OVER_VOLTAGE]);
        assert_eq!(first(&faults), Some((FaultCause::SOUTH_SILENCE, 1)));
        faults.reset(false);
        assert_eq!((causes(&faults), first(&faults)), (vec![FaultCause::OVER_VOLTAGE], None));
    }

    #[test]
    fn what_a_fault_is_about_is_told_with_that_fault_alone() {
        let trip = Trip {
            quantity: profile_generic::quantity::Quantity::Velocity,
            value: 7,
            limit: 5,
            late: profile_generic::time::DurationNs::ZERO,
        };
        let mut faults = Faults::new(Reaction::HoldPosition);
        faults.stop_for(fault(FaultCause::VELOCITY_COMMAND_LIMIT, 3));
        faults.note_trip(FaultCause::VELOCITY_COMMAND_LIMIT, SystemTime(4), trip);
        assert_eq!(faults.tripped(), None, "of a later one, which is not the first");
        faults.note_trip(FaultCause::VELOCITY_COMMAND_LIMIT, SystemTime(3), trip);
        assert_eq!((faults.tripped(), faults.loss()), (Some(trip), None));
        faults.reset(false);
        assert_eq!(faults.tripped(), None);
        faults.stop_for(fault(FaultCause::COMMAND_LOST, 5));
        faults.note_loss(Some(Loss::End));
        assert_eq!((faults.loss(), faults.tripped()), (Some(Loss::End), None));
    }

    #[test]
    fn reactions_are_others_only_when_they_differ() {
        let mut faults = Faults::new(Reaction::HoldPosition);
        assert!(!faults.configure(&Reactions::default()));
        let mut reactions = Reactions::default();
        reactions.set(FaultCause::HOMING, Reaction::Alarm);
        assert!(faults.configure(&reactions));
        assert!(!faults.configure(&reactions));
        faults.raise(fault(FaultCause::HOMING, 1), Origin::Watch);
        let decided: Vec<_> = faults.all_decided().iter().map(|fault| fault.reaction).collect();
        assert_eq!(decided, [Reaction::Alarm]);
    }
}
