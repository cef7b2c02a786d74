//! Between the compiled tables and the CIP Motion device: its images.

use profile_cip::device::drive_link::{DriveAction, DriveCondition, DriveImage, ExceptionAction};
use profile_cip::wire::motion::codes::{AxisIoStatus, AxisStatus, EventChecking, FaultType};
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_generic::capture::CaptureSet;
use profile_generic::fault_set::{ActiveFault, FaultSet, Origin};
use profile_generic::image::{AxisFeedback, FeedbackSet, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::OperatingMode;
use profile_generic::state::{DriveState, Request};

use super::compile_cip::{CipConditions, CipFault, CipProgram, CipReport, CipValue};

/// What the device asks of a drive, with its name in the tables.
pub(super) const DRIVE_ACTIONS: [(&str, DriveAction); 7] = [
    ("none", DriveAction::None),
    ("power_up", DriveAction::PowerUp),
    ("enable", DriveAction::Enable),
    ("test", DriveAction::Test),
    ("disable", DriveAction::Disable),
    ("shutdown", DriveAction::Shutdown),
    ("abort", DriveAction::Abort),
];

/// Bits of the data sets that the device's images have a place for (Tables 6-2.19 and 6-2.21).
pub(super) mod bit {
    pub const POSITION: usize = 0;
    pub const VELOCITY: usize = 1;
    pub const ACCELERATION: usize = 2;
    pub const TORQUE: usize = 3;
    pub const UNWIND_COUNT: usize = 6;
    pub const DISPLACEMENT: usize = 7;
    /// Elements that belong to the position.
    pub const OF_POSITION: [usize; 2] = [UNWIND_COUNT, DISPLACEMENT];
}

/// All that the status of an axis in CIP follows from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shown {
    state: DriveState,
    mode: OperatingMode,
    status: StatusBits,
    inhibits: Inhibits,
}

/// The status of an axis in CIP.
#[derive(Debug, Clone, Copy)]
struct Said {
    conditions: CipConditions,
    axis_status: AxisStatus,
    io_status: AxisIoStatus,
    start_inhibits: (u16, u16),
}

/// What was said last of an axis: its drive seldom shows anything new. Another program begins with none.
#[derive(Debug, Clone, Copy, Default)]
pub struct Told {
    status: Option<(Shown, Said)>,
    /// The events that can be checked for: by the number of the axis's programs, and the signals that are there.
    events: Option<((u64, FeedbackSet), EventChecking)>,
}

impl Told {
    fn of(&mut self, program: &CipProgram, feedback: &AxisFeedback) -> Said {
        let AxisFeedback { state, mode, status, inhibits, .. } = *feedback;
        let shown = Shown { state, mode, status, inhibits };
        if let Some((known, said)) = self.status
            && known == shown
        {
            return said;
        }
        let said = Said {
            conditions: program.state(state).conditions,
            axis_status: AxisStatus::from_bits_retain(program.axis_status(feedback)),
            io_status: AxisIoStatus::from_bits_retain(program.io_status(feedback)),
            start_inhibits: program.start_inhibits(inhibits),
        };
        self.status = Some((shown, said));
        said
    }

    /// The events that can be checked for on an axis whose drive has these captures; they are asked for when the number
    /// of its programs is another one.
    pub fn checkable(
        &mut self,
        program: &CipProgram,
        (programs, captures): (u64, impl FnOnce() -> CaptureSet),
        feedback: &AxisFeedback,
    ) -> EventChecking {
        let key = (programs, feedback.present);
        if let Some((known, events)) = self.events
            && known == key
        {
            return events;
        }
        let events = program.events().checkable(captures(), feedback);
        self.events = Some((key, events));
        events
    }
}

/// The values that are there, by their bits in the Command Data Set.
pub(super) fn elements(values: &CommandValues) -> impl Iterator<Item = (usize, CipValue)> {
    let position = values.position.map(|position| match position {
        CommandPosition::Float(value) => CipValue::Lreal(value),
        CommandPosition::Integer(value) => CipValue::Dint(value),
    });
    let all = [
        (bit::POSITION, position),
        (bit::VELOCITY, values.velocity.map(CipValue::Real)),
        (bit::ACCELERATION, values.acceleration.map(CipValue::Real)),
        (bit::TORQUE, values.torque.map(CipValue::Real)),
        (bit::UNWIND_COUNT, values.unwind_count.map(CipValue::Dint)),
        (bit::DISPLACEMENT, values.position_displacement.map(CipValue::Dint)),
    ];
    all.into_iter().filter_map(|(bit, value)| Some((bit, value?)))
}

impl CipProgram {
    /// The request that an action of the device makes; `None` when it asks for nothing.
    pub fn drive_request(&self, action: DriveAction) -> Option<Request> {
        self.drive_actions.iter().find(|(known, _)| *known == action).and_then(|(_, request)| *request)
    }

    /// Puts what is known of an axis into the image for the device: actual values, conditions, status,
    /// inhibits and what is wrong. `online`, `action_id` and `reset_id` belong to the caller that runs the axis and stay
    /// as they are. `told` is kept from one image of this program to the next.
    pub fn drive_image(
        &self,
        feedback: &AxisFeedback,
        faults: &FaultSet,
        told: &mut Told,
        image: &mut DriveImage,
    ) -> CipReport {
        let mut report = CipReport::default();
        // Of a drive that is gone, the last position that it has reported.
        let reported = AxisFeedback { present: feedback.present | FeedbackSet::POSITION, ..*feedback };
        image.position = self.actual_counts(bit::POSITION, &reported, &mut report);
        let moves = feedback.present.contains(FeedbackSet::VELOCITY);
        image.position_rate = if moves { self.counts(feedback.velocity.get()).value } else { 0 };
        image.unwind = self.unwind();
        image.velocity = self.actual_real(bit::VELOCITY, feedback, &mut report);
        image.acceleration = self.actual_real(bit::ACCELERATION, feedback, &mut report);
        let said = told.of(self, feedback);
        image.bus_up = said.conditions.contains(CipConditions::BUS_UP);
        image.start_complete = said.conditions.contains(CipConditions::START_COMPLETE);
        image.stop_complete = said.conditions.contains(CipConditions::STOP_COMPLETE);
        image.power_enabled = feedback.status.contains(StatusBits::ENABLED);
        image.tracking = feedback.status.contains(StatusBits::TRACKING);
        image.axis_status = said.axis_status;
        image.io_status = if image.online { said.io_status } else { AxisIoStatus::empty() };
        (image.start_inhibits, image.start_inhibits_mfg) = said.start_inhibits;
        image.conditions.clear();
        for condition in faults.iter().filter_map(|active| self.condition(active)) {
            image.conditions.push(condition);
        }
        image.torque = self.events().torque(feedback);
        report
    }

    /// A fault as a condition of the axis; `None` for one of the communications node.
    fn condition(&self, active: &ActiveFault) -> Option<DriveCondition> {
        let fault = active.fault;
        let CipFault::Axis { fault_type, code, .. } = self.fault(fault.cause)? else { return None };
        // The best stop that is left also for a warning that the controller wants to be a major fault.
        let stop = fault.best_stop();
        let acted = matches!(active.origin, Origin::Drive | Origin::Event) && fault.reaction.stops();
        Some(DriveCondition {
            fault_type: FaultType(fault_type),
            code,
            // The vendor's code does not fit a byte; its low byte is what a controller can be shown.
            sub_code: fault.vendor_code.to_le_bytes()[0],
            detail: fault.vendor_code,
            action: self.fault_action(stop),
            least: if acted { ExceptionAction::MAJOR_FAULT } else { ExceptionAction::IGNORE },
            at: fault.at.0,
        })
    }
}
