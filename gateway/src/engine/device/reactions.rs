//! From the exception actions of the controller to the reactions of the axis.

use profile_cip::device::exception::{ExceptionAction, ExceptionActions};
use profile_cip::wire::motion::codes::FaultType;
use profile_generic::fault::{FaultCause, Reaction};

use crate::engine::axis::Reactions;
use crate::mapping::{CipFault, CipProgram};

/// What the controller wants done about each cause, by the action of the exception that it is reported as. A cause that is
/// none of an axis, or has no row, keeps the reaction of its fault.
pub(super) fn reactions(program: &CipProgram, actions: &ExceptionActions<'_>) -> Reactions {
    let mut reactions = Reactions::default();
    for (cause, _) in FaultCause::NAMED {
        if let Some(CipFault::Axis { fault_type, code, .. }) = program.fault(*cause) {
            reactions.set(
                *cause,
                match actions.configured(FaultType(fault_type), code) {
                    ExceptionAction::IGNORE => Reaction::Ignore,
                    // A minor fault is latched by the motion device; the axis goes on.
                    ExceptionAction::ALARM | ExceptionAction::MINOR_FAULT => Reaction::Alarm,
                    // The best stop that the fault leaves, so the mildest of all here.
                    _ => Reaction::HoldPosition,
                },
            );
        }
    }
    reactions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::{CipScaling, Mapping};
    use profile_generic::scaling::UnitKind;

    const MAJOR: u8 = ExceptionAction::MAJOR_FAULT.0;

    fn program(inverted: bool) -> CipProgram {
        let mapping = Mapping::embedded().expect("the shipped tables are sound");
        let scaling = CipScaling {
            kind: UnitKind::Rotary,
            nanounits_per_unit: 1_000_000_000,
            counts_per_unit: 1_000_000,
            unwind: None,
            inverted,
        };
        mapping.cip_program(&scaling).expect("exact")
    }

    fn of(program: &CipProgram, standard: &[u8], manufacturer: &[u8]) -> Reactions {
        reactions(program, &ExceptionActions::new(standard, manufacturer))
    }

    #[test]
    fn each_cause_gets_the_action_of_its_exception() {
        let program = program(false);
        let (mut standard, mut manufacturer) = ([MAJOR; 64], [MAJOR; 64]);
        standard[4] = ExceptionAction::IGNORE.0;
        standard[54] = ExceptionAction::ALARM.0;
        standard[62] = ExceptionAction::MINOR_FAULT.0;
        manufacturer[9] = ExceptionAction::MINOR_FAULT.0;
        let reactions = of(&program, &standard, &manufacturer);
        let rows = [
            (FaultCause::MOTOR_OVER_SPEED_USER_LIMIT, Some(Reaction::Ignore)),
            (FaultCause::EXCESSIVE_POSITION_ERROR, Some(Reaction::Alarm)),
            (FaultCause::CONTROLLER_ABORT, Some(Reaction::Alarm)),
            (FaultCause::HOMING, Some(Reaction::Alarm)),
            (FaultCause::OVER_VOLTAGE, Some(Reaction::HoldPosition)),
            // A fault of the absolute position is a minor one, and one of the start-up is major, whatever is set.
            (FaultCause::ABSOLUTE_POSITION_LOST, Some(Reaction::Alarm)),
            (FaultCause::MEMORY, Some(Reaction::HoldPosition)),
            // The node's, which are no exceptions of an axis.
            (FaultCause::COMMAND_LOST, None),
            (FaultCause::CONNECTION_CLOSED, None),
        ];
        for (cause, expected) in rows {
            assert_eq!(reactions.get(cause), expected, "{cause}");
        }
    }

    #[test]
    fn two_causes_that_share_an_exception_both_get_its_action() {
        let program = program(false);
        let shared = [FaultCause::MOTOR_OVER_CURRENT, FaultCause::MOTOR_SHORT_CIRCUIT];
        let faults = shared.map(|cause| program.fault(cause).expect("a row"));
        assert_eq!(faults[0], faults[1]);
        let CipFault::Axis { code, .. } = faults[0] else { panic!("{faults:?}") };
        let mut standard = [MAJOR; 64];
        standard[usize::from(code)] = ExceptionAction::ALARM.0;
        let alarm = of(&program, &standard, &[]);
        assert_eq!(shared.map(|cause| alarm.get(cause)), [Some(Reaction::Alarm); 2]);
        let major = of(&program, &[MAJOR; 64], &[]);
        assert_eq!(shared.map(|cause| major.get(cause)), [Some(Reaction::HoldPosition); 2]);
    }

    #[test]
    fn an_inverted_axis_has_its_ends_exchanged() {
        let ends = [FaultCause::HARDWARE_OVERTRAVEL_POSITIVE, FaultCause::HARDWARE_OVERTRAVEL_NEGATIVE];
        let Some(CipFault::Axis { code: positive, .. }) = program(false).fault(ends[0]) else {
            panic!("no row")
        };
        for inverted in [false, true] {
            let mut standard = [MAJOR; 64];
            standard[usize::from(positive)] = ExceptionAction::ALARM.0;
            let reactions = of(&program(inverted), &standard, &[]);
            let found = ends.map(|cause| reactions.get(cause) == Some(Reaction::Alarm));
            assert_eq!(found, [!inverted, inverted], "inverted: {inverted}");
        }
    }

    #[test]
    fn an_action_that_nobody_has_set_is_a_major_fault() {
        let reactions = of(&program(false), &[], &[]);
        assert_eq!(reactions.get(FaultCause::MOTOR_OVER_SPEED_USER_LIMIT), Some(Reaction::HoldPosition));
    }
}
