//! One axis as CIP Motion sees it: the controller's set-points, actions and tests in generic terms, and what the drive reports in
//! those of the motion device.
//!
//! ```text
//! AxisCommandImage --CipProgram--> Wish, SetPoints, test, reset --> AxisChannel
//! DriveImage      <--CipProgram--- feedback, faults, progress  <--- AxisChannel
//! ```

use profile_cip::device::drive_link::{
    AbortCause, AbortOrder, AxisCommandImage, Command, DriveAction, DriveImage, HookupTest, SetPoints,
    TestOrder, TestReport, Withheld,
};
use profile_cip::wire::motion::codes::{AxisStatus, TestStatus};
use profile_cip::wire::motion::test_service::{HookupTestData, hookup_status};
use profile_generic::fault::{Fault, FaultCause};
use profile_generic::hookup;
use profile_generic::inhibit::Inhibits;
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::OperatingMode;
use profile_generic::sequence::SequenceStep;
use profile_generic::state::DriveState;
use profile_generic::time::{MonotonicTime, SystemTime};

use crate::engine::axis::{AxisChannel, Intent, Loss, NorthPoints, Target, Wish};
use crate::mapping::{CipFault, CipProgram, CipTrackers, DriveProgram, Told};

/// What CIP Motion keeps of an axis from cycle to cycle.
#[derive(Debug)]
pub struct CipAxis {
    program: CipProgram,
    /// Counts the programs that were taken.
    scaling_id: u32,
    trackers: CipTrackers,
    /// The status that the controller was given last.
    reported: Told,
    /// The Control Modes that the drive has, by their numbers, for this number of its programs.
    control_modes: Option<(u64, Option<u16>)>,
    action_id: u32,
    /// Whether the DC bus was charged when the drive showed it last.
    bus_up: bool,
    /// How the device wants the axis stopped for a fault.
    abort: Option<AbortOrder>,
}

impl CipAxis {
    /// An axis of this scaling.
    #[must_use]
    pub fn new(program: CipProgram) -> Self {
        Self {
            trackers: program.trackers(),
            program,
            scaling_id: 0,
            reported: Told::default(),
            control_modes: None,
            action_id: 0,
            bus_up: false,
            abort: None,
        }
    }

    /// The program of the CIP side.
    #[must_use]
    pub fn program(&self) -> &CipProgram {
        &self.program
    }

    /// Counts the programs that were taken.
    #[must_use]
    pub fn scaling_id(&self) -> u32 {
        self.scaling_id
    }

    /// Takes another scaling of the controller; `false`, and nothing done, while the torque may be on.
    pub fn set_program(&mut self, axis: &mut AxisChannel, program: CipProgram) -> bool {
        if axis.may_have_torque() {
            return false;
        }
        axis.set_count(program.count());
        self.trackers = program.trackers();
        self.reported = Told::default();
        self.program = program;
        self.control_modes = None;
        self.scaling_id = self.scaling_id.wrapping_add(1);
        true
    }

    // ---- from the controller -----------------------------------------------------------------------------------

    /// Hands on what the motion device says about this axis; to be called in every cycle after [`AxisChannel::from_drive`].
    /// `target` is the instant at which its set-points shall be reached, where controller and device share a clock.
    pub fn command(
        &mut self,
        axis: &mut AxisChannel,
        (now, system): (MonotonicTime, SystemTime),
        image: &AxisCommandImage,
        target: Option<MonotonicTime>,
    ) {
        // Before the action: a lost command stops the axis as its configuration says, whatever the device asks for then.
        let loss = match image.command {
            Command::Withheld(why) => lost(why),
            Command::Follow(_) => None,
        };
        if let Some(loss) = loss {
            axis.lose_command(now, system, loss);
        }
        axis.take_test(now, image.test.map(test_order));
        // Before the action: a stop that is ordered in a particular way is under way when the action asks for any.
        self.take_abort(axis, (now, system), image.abort, loss);
        if image.action_id != self.action_id {
            self.action_id = image.action_id;
            let request = self.program.drive_request(image.action);
            axis.take_wish(now, system, Wish { intent: intent(image.action), request });
        }
        axis.retry_wish(now, system);
        axis.want_reset(now, system, image.reset_id);
        match image.command {
            Command::Follow(set_points) => self.follow(axis, (now, system), &set_points, target),
            Command::Withheld(_) => axis.end_set_points(),
        }
    }

    /// The motion device orders a stop for what it has found itself, or a harder one than before. `loss` is why the command is lost.
    fn take_abort(
        &mut self,
        axis: &mut AxisChannel,
        (now, system): (MonotonicTime, SystemTime),
        order: Option<AbortOrder>,
        loss: Option<Loss>,
    ) {
        let by_controller = |order: &AbortOrder| order.cause == AbortCause::Controller;
        if order.as_ref().is_some_and(by_controller) && !self.abort.as_ref().is_some_and(by_controller) {
            // The controller has cancelled a reset that waits for the end of the stop, if there is one.
            axis.drop_waiting_reset();
        }
        let new = order.filter(|order| self.abort.is_none_or(|known| known.action != order.action));
        self.abort = order;
        let Some(order) = new.filter(|_| axis.may_have_torque()) else { return };
        let cause = match order.cause {
            AbortCause::Controller => FaultCause::CONTROLLER_ABORT,
            AbortCause::IllegalMode => FaultCause::ILLEGAL_MODE,
            AbortCause::DriveLost => FaultCause::SOUTH_SILENCE,
            // It has stopped for that already, as it is configured for a lost command, unless it was about to stop.
            AbortCause::Node if axis.state() == DriveState::FaultReaction => return,
            AbortCause::Node => {
                axis.note_loss(loss);
                FaultCause::COMMAND_LOST
            }
        };
        let fault = Fault::new(cause, system).with_reaction(self.program.reaction(order.action));
        axis.take_fault(now, system, fault);
    }

    /// Hands on set-points that shall be reached at `target` on the local clock; without a shared clock they are placed by the
    /// controller's update clock as its arrivals show it.
    fn follow(
        &mut self,
        axis: &mut AxisChannel,
        (now, system): (MonotonicTime, SystemTime),
        points: &SetPoints,
        target: Option<MonotonicTime>,
    ) {
        if axis.has_taken(points.sequence) {
            return;
        }
        let Some(mode) = self.program.mode(points.control_mode.0) else {
            axis.refuse_set_points(now, system, points.sequence, FaultCause::ILLEGAL_MODE);
            return;
        };
        let mut command = *axis.command();
        command.select(mode.into());
        if axis.begins(command.selection()) {
            // Where the drive is now is where the controller counts from: turns made without position commands do not
            // show in a command that wraps.
            self.trackers = self.program.trackers();
            let counts = self.program.counts(axis.feedback().position.get()).value;
            self.trackers.start(counts, points.position_reference);
        }
        let converted =
            self.program.decode(&points.values, points.position_reference, &mut self.trackers, &mut command);
        let trims = self.program.decode_trims(&points.trims, &mut command);
        let target = match target {
            Some(at) => {
                let update = TargetUpdate::ALL.get(usize::from(points.target.0)).copied();
                Target::At(at, update.unwrap_or_default())
            }
            None => Target::Paced(points.paced_at),
        };
        let points = NorthPoints {
            command,
            sequence: points.sequence,
            target,
            saturated: converted.saturated + trims.saturated,
            unusable: converted.not_finite + trims.not_finite + trims.unmapped,
            is_counted: points.values.unwind_count.is_some() && mode == OperatingMode::Position,
        };
        axis.take_set_points(now, system, points);
    }

    // ---- to the controller -------------------------------------------------------------------------------------

    /// Writes what the motion device has to know of the drive over what it had before.
    pub fn fill(&mut self, axis: &AxisChannel, image: &mut DriveImage) {
        image.clear();
        image.online = axis.is_heard();
        image.action_id = self.action_id;
        image.reset_id = axis.reset_id();
        image.test = axis.test_report().map(test_report);
        image.scaling_id = self.scaling_id;
        image.control_modes = self.control_modes(axis);
        let mut feedback = *axis.feedback();
        // The controller is about to end it, or has a fault that says why it cannot be ended.
        feedback.inhibits.remove(Inhibits::CONFIGURATION_INCOMPLETE);
        self.program.drive_image(&feedback, axis.fault_set(), &mut self.reported, image);
        self.bus_up = self.is_bus_up(axis, image);
        image.axis_status.set(AxisStatus::DC_BUS_UP, self.bus_up);
        let step = axis.sequence_step();
        image.start_complete &= step == SequenceStep::Running;
        image.tracking &= step == SequenceStep::Running;
        image.stop_complete = match step {
            SequenceStep::Holding => true,
            // A fault that ends in a hold has stopped the axis as well: the state is Major Faulted whatever becomes of the
            // torque (CIP Volume 9, 5-2.3.16.1.1).
            SequenceStep::Off => image.stop_complete || axis.holds(),
            // Nobody will see its end; the drive is heard again before the axis can be switched on.
            _ if axis.is_unseen() => image.stop_complete,
            _ => false,
        };
        if let Some(program) = axis.south() {
            let captures = program.captures();
            let key = (axis.programs(), || captures.kinds());
            image.events = self.reported.checkable(&self.program, key, &feedback);
            image.events_checking = self.program.events().captured(axis.checked_captures());
        }
    }

    /// Whether the DC bus is charged. A drive that has no bit for it shows nothing of it while it is faulted or shut down: what it showed
    /// last counts.
    fn is_bus_up(&self, axis: &AxisChannel, image: &DriveImage) -> bool {
        let shows = image.axis_status.contains(AxisStatus::DC_BUS_UP);
        match axis.state() {
            DriveState::Faulted | DriveState::Shutdown => {
                let has_bit = axis.south().is_some_and(DriveProgram::has_power_bit);
                shows || !has_bit && self.bus_up
            }
            _ => image.bus_up,
        }
    }

    /// The Control Modes whose operating mode the drive has, by their numbers.
    fn control_modes(&mut self, axis: &AxisChannel) -> Option<u16> {
        let programs = axis.programs();
        if let Some((known, modes)) = self.control_modes
            && known == programs
        {
            return modes;
        }
        let modes = axis.south().map(|south| {
            let has = |number: &u8| self.program.mode(*number).is_some_and(|mode| south.has_mode(mode));
            (0..16).filter(has).map(|number| 1 << number).sum()
        });
        self.control_modes = Some((programs, modes));
        modes
    }

    /// The fault, where the controller knows it as one of the communications node: its code, and since when. Commands that the node
    /// withheld are no fault beside that of the node: it may be over already when the axis shows that it has stopped.
    #[must_use]
    pub fn node_fault(&self, axis: &AxisChannel) -> Option<(u8, SystemTime)> {
        let fault = axis.fault()?;
        if axis.loss().is_some_and(|loss| BY_NODE.into_iter().any(|why| lost(why) == Some(loss))) {
            return None;
        }
        match self.program.fault(fault.cause) {
            Some(CipFault::Node(code)) => Some((code, fault.at)),
            _ => None,
        }
    }
}

/// Why the node withholds set-points. Its own fault says it.
const BY_NODE: [Withheld; 2] = [Withheld::NodeFault, Withheld::ConnectionLost];

/// Why set-points that are withheld are a lost command; `None` while the axis is not meant to have any.
const fn lost(why: Withheld) -> Option<Loss> {
    match why {
        Withheld::Stale => Some(Loss::Withheld("Stale")),
        Withheld::ConnectionLost => Some(Loss::Withheld("ConnectionLost")),
        Withheld::NodeFault => Some(Loss::Withheld("NodeFault")),
        Withheld::NotConnected | Withheld::NotRunning | Withheld::LocalControl | Withheld::NoSetPoint => None,
    }
}

/// What an action of the device means to the axis.
const fn intent(action: DriveAction) -> Intent {
    match action {
        DriveAction::None | DriveAction::PowerUp => Intent::Standby,
        DriveAction::Enable => Intent::Enable,
        DriveAction::Test => Intent::Test,
        DriveAction::Disable => Intent::Disable,
        DriveAction::Shutdown => Intent::Shutdown,
        DriveAction::Abort => Intent::Abort,
    }
}

fn test_order(order: TestOrder) -> hookup::TestOrder {
    let test = match order.test {
        HookupTest::MotorFeedback => hookup::Test::MotorFeedback,
        HookupTest::Feedback => hookup::Test::Feedback,
    };
    hookup::TestOrder { id: order.id, test, distance: order.distance, time: order.time }
}

fn test_report(report: hookup::TestReport) -> TestReport {
    let status = match report.result {
        hookup::TestResult::Successful => TestStatus::SUCCESSFUL,
        hookup::TestResult::NoFeedback => hookup_status::NO_FEEDBACK_1,
        hookup::TestResult::TimedOut => TestStatus::TIMED_OUT,
        hookup::TestResult::Faulted => TestStatus::FAULTED,
    };
    let feedback_1_direction = u8::from(report.negative);
    let data = HookupTestData { status, feedback_1_direction, ..HookupTestData::default() };
    TestReport { id: report.id, data }
}
