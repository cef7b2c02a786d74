//! The C-to-D updates of the motion device: checked as a whole, judged by order and age, then distributed. Clauses
//! 2-1.2, 6-2.7.1 and 7-1.

use profile_generic::time::{MonotonicTime, SystemTime};

use super::clock::Clock;
use super::engine::{Echo, Engine, INSTANCES_MAX, SEQUENCE_LEN};
use super::io_connection::{Age, Mode, Packet, Update};
use super::{fixed, service};
use crate::device::attribute::id;
use crate::device::axis::UpdateTimes;
use crate::wire::motion::codes::{MotionService, NodeAlarm, NodeControl, NodeFault};
use crate::wire::motion::fixed::FixedCommand;
use crate::wire::motion::{CommandFrame, CommandHeader, CommandInstance, Format, run_idle};
use crate::wire::status::GeneralStatus;

/// An update whose form is right.
enum Checked<'p> {
    Variable(CommandFrame<'p>),
    Fixed(FixedCommand),
}

impl Checked<'_> {
    fn header(&self) -> CommandHeader {
        match self {
            Self::Variable(frame) => *frame.header(),
            Self::Fixed(command) => command.header(),
        }
    }

    /// Whether every instance is one of so many axes or the class, and whether every value is a number; in one pass, because
    /// reading an instance is what takes the time.
    fn is_known_and_finite(&self, axes: usize) -> (bool, bool) {
        match self {
            Self::Variable(frame) => frame.instances().fold((true, true), |(known, finite), instance| {
                let values = instance.cyclic.is_none_or(|block| block.values.is_finite());
                let data = instance.events.as_ref().and_then(|events| events.extended);
                let number = values && data.is_none_or(|data| data.is_finite());
                (known && usize::from(instance.number) <= axes, finite && number)
            }),
            Self::Fixed(command) => (true, command.values.is_finite()),
        }
    }
}

/// How an update with data goes on.
pub(super) enum Verdict {
    /// Applied as the newest command.
    Fresh(UpdateTimes),
    /// Its services and acknowledgements count, its commands do not.
    CommandsRefused,
}

impl Engine {
    /// [`MotionDevice::handle_io_arrived`](super::device::MotionDevice::handle_io_arrived).
    pub fn handle_packet(
        &mut self,
        now: MonotonicTime,
        arrival: MonotonicTime,
        system_time: Option<SystemTime>,
        packet: &[u8],
    ) -> bool {
        let Some(connection) = &mut self.connection else {
            self.statistics.counters.unconnected += 1;
            return false;
        };
        if packet.len() > usize::from(connection.parameters.o_to_t_size) {
            self.statistics.counters.oversize += 1;
            self.node.raise(NodeFault::DATA_FORMAT);
            return false;
        }
        let Some((sequence, update)) = packet.split_first_chunk::<SEQUENCE_LEN>() else {
            self.statistics.counters.malformed += 1;
            self.node.raise(NodeFault::DATA_FORMAT);
            return false;
        };
        let sequence = u16::from_le_bytes(*sequence);
        let taken = match connection.packet(sequence) {
            Packet::Old => {
                self.statistics.counters.out_of_order += 1;
                false
            }
            Packet::Refresh => {
                self.statistics.counters.refreshes += 1;
                connection.heard(Some(sequence), now);
                true
            }
            Packet::New => self.check(update).is_some_and(|(run, checked)| {
                self.handle_update((now, arrival), system_time, Some(sequence), run, &checked);
                true
            }),
        };
        self.step(system_time);
        taken
    }

    /// Takes a C-to-D update of a network that puts no sequence count in front of it, as DeviceNet does not: the 16
    /// octets of the fixed format, or an update of the variable one. The Update ID alone tells what is new.
    pub fn handle_unsequenced(&mut self, now: MonotonicTime, system_time: Option<SystemTime>, update: &[u8]) {
        let Some(connection) = &self.connection else {
            self.statistics.counters.unconnected += 1;
            return;
        };
        if update.len() + SEQUENCE_LEN > usize::from(connection.parameters.o_to_t_size) {
            self.statistics.counters.oversize += 1;
            self.node.raise(NodeFault::DATA_FORMAT);
        } else if let Some((run, checked)) = self.check(update) {
            self.handle_update((now, now), system_time, None, run, &checked);
        }
        self.step(system_time);
    }

    /// Checks the form of a whole update, and says whether it runs. A wrong one is counted and raises node fault 4; nothing else changes.
    ///
    /// The other format is a wrong form as well: the format of a connection does not change (clause 6-2.7.1.1).
    fn check<'p>(&mut self, update: &'p [u8]) -> Option<(bool, Checked<'p>)> {
        let revision = self.connection.as_ref()?.parameters.format_revision;
        let parsed = run_idle::split(revision, update).and_then(|(run, update)| {
            let checked = match self.config.format {
                Format::Variable => CommandFrame::parse_as(update, revision).map(Checked::Variable),
                Format::Fixed => FixedCommand::parse(update).map(Checked::Fixed),
            };
            checked.map(|checked| (run, checked))
        });
        let (run, checked) = match parsed {
            Ok(checked) => checked,
            Err(error) => {
                self.statistics.malformed(error);
                self.node.raise(NodeFault::DATA_FORMAT);
                return None;
            }
        };
        match checked.is_known_and_finite(self.instances.axis_count()) {
            (false, _) => self.statistics.counters.unknown_instance += 1,
            (true, false) => self.statistics.counters.not_finite += 1,
            (true, true) => return Some((run, checked)),
        }
        self.node.raise(NodeFault::DATA_FORMAT);
        None
    }

    /// Judges a checked update that has arrived at the second of two instants, and distributes it. Without a sequence count the
    /// Update ID alone tells what is new.
    fn handle_update(
        &mut self,
        (now, arrival): (MonotonicTime, MonotonicTime),
        system_time: Option<SystemTime>,
        sequence: Option<u16>,
        run: bool,
        checked: &Checked<'_>,
    ) {
        let mut header = checked.header();
        // An originator that is idle says that its data mean nothing, whatever they are.
        if !run {
            header.node_control -= NodeControl::DATA_VALID;
        }
        let Some(connection) = &mut self.connection else { return };
        let before = connection.node_control();
        if !header.node_control.contains(NodeControl::DATA_VALID) {
            connection.heard(sequence, now);
            connection.invalid();
            connection.header = Some(header);
            connection.answer(header.update_id, now);
            self.statistics.counters.not_valid += 1;
            self.echo.clear();
            self.node_control(before, header.node_control, now);
            return;
        }
        let lost = match connection.update(header.update_id) {
            Update::Repeated => {
                connection.heard(sequence, now);
                self.statistics.counters.repeated += 1;
                return;
            }
            Update::Old => {
                self.statistics.counters.out_of_order += 1;
                return;
            }
            Update::New(lost) => lost,
        };
        connection.heard(sequence, now);
        connection.header = Some(header);
        // What is judged is when it came, not when somebody looked at it (class attribute 33).
        let arrived = system_time.map(|system| system - now.since(arrival));
        connection.received_at = arrived.map_or(0, |t| t.0);
        let paced_at = connection.stamps.arrive(arrival, lost);
        self.node_control(before, header.node_control, now);
        self.statistics.lost(lost);
        if u64::from(lost) > self.instances.high_limit() {
            self.node.raise(NodeFault::CONNECTION_UPDATE);
        }
        let verdict = self.judge(now, (arrival, paced_at), system_time.zip(arrived), &header);
        match checked {
            Checked::Variable(frame) => self.apply(now, (system_time, arrived), frame, &verdict),
            Checked::Fixed(command) => {
                self.echo.clear();
                self.echo.push(Echo { number: 1, cyclic: true, lists: None });
                let context = self.context(system_time);
                // Without remote control the device acts on nothing that the controller sends.
                if let Some(slot) = self.instances.slots.first_mut().filter(|_| context.remote) {
                    fixed::apply(&mut slot.axis, now, &context, command, &verdict);
                }
            }
        }
        let fresh = matches!(verdict, Verdict::Fresh(_));
        self.statistics.counters.applied += u64::from(fresh);
        if let Some(connection) = &mut self.connection {
            connection.answer(header.update_id, now);
            connection.accepted(header.update_id, now, fresh);
        }
    }

    /// Node Control bits that act on the node itself.
    fn node_control(&mut self, before: NodeControl, after: NodeControl, now: MonotonicTime) {
        let reset = NodeControl::FAULT_RESET;
        if after.contains(reset) && !before.contains(reset) {
            self.node.reset();
        }
        if !after.contains(NodeControl::SYNC_CONTROL)
            && let Some(connection) = &mut self.connection
        {
            connection.schedule.desynchronize();
            // Nobody compares the clocks any more.
            self.node.skew(false, now);
        }
    }

    /// Judges the age of an update and moves between asynchronous and synchronous operation. `system` is the system time of now, and
    /// that of the arrival.
    fn judge(
        &mut self,
        now: MonotonicTime,
        (arrival, paced_at): (MonotonicTime, MonotonicTime),
        system: Option<(SystemTime, SystemTime)>,
        header: &CommandHeader,
    ) -> Verdict {
        let instances = &mut self.instances;
        let (low, high, threshold) =
            (instances.low_limit(), instances.high_limit(), instances.step_threshold());
        let Some(connection) = &mut self.connection else { return Verdict::CommandsRefused };
        let period = connection.period();
        if let Some(controller) = header.time_offset {
            instances.publish_class(&[(id::CONTROLLER_TIME_OFFSET, controller.cast_unsigned())]);
        }
        if header.time_stamp.is_some() {
            self.clock.update(instances.class_value(id::CONTROLLER_TIME_OFFSET), threshold, period);
        }
        let synchronous =
            self.config.supports_sync && header.node_control.contains(NodeControl::SYNC_CONTROL);
        if !synchronous {
            connection.stamps.forget();
            self.node.fresh_update();
            return Verdict::Fresh(UpdateTimes { time_stamp: None, period, paced_at });
        }
        let (Some(received), Some((SystemTime(system_time), SystemTime(arrived)))) =
            (header.time_stamp, system)
        else {
            self.statistics.counters.untimed += 1;
            return Verdict::CommandsRefused;
        };
        let time_stamp = self.clock.compensate(received);
        let age = connection.stamps.age(time_stamp, arrived, low, high);
        let skewed = Clock::is_skewed(time_stamp, period, arrived);
        if connection.schedule.mode == Mode::Asynchronous {
            connection.stamps.forget();
            self.node.fresh_update();
            self.node.skew(skewed, now);
            if !skewed && self.clock.is_synchronized() {
                let start = time_stamp.saturating_add(period.saturating_mul(2));
                connection.schedule.synchronize(header.update_id, start.saturating_sub(system_time), now);
            }
            // Until the clocks are proven the device goes on asynchronously, without trust in the time stamp.
            return Verdict::Fresh(UpdateTimes { time_stamp: None, period, paced_at });
        }
        if !connection.stamps.follows(self.clock.to_local(time_stamp), header.update_id, arrival) {
            // A clock was set and the offsets do not say so, or do not yet: the update counts as one that did not come.
            self.statistics.counters.stamp_jumps += 1;
            return Verdict::CommandsRefused;
        }
        let cycle = SystemTime(time_stamp).since(SystemTime(system_time)).as_nanos();
        let ahead = SystemTime(time_stamp).since(SystemTime(arrived)).as_nanos();
        if matches!(age, Age::OnTime | Age::Late) {
            self.node.fresh_update();
        }
        match age {
            // Served at its time, but one of the clocks is wrong: no update arrives before the start of its own period. What is
            // below the step threshold says nothing: the update may have come while this call was under way.
            Age::OnTime if ahead > threshold => self.node.post(NodeAlarm::CLOCK_SKEW, now),
            Age::OnTime => {}
            Age::Late | Age::Alarming => {
                self.statistics.late();
                if age == Age::Alarming {
                    self.node.post(NodeAlarm::CONNECTION_UPDATE, now);
                }
            }
            Age::TooLate => {
                self.statistics.late();
                self.statistics.counters.too_late += 1;
                self.node.raise(NodeFault::CONNECTION_UPDATE);
                return Verdict::CommandsRefused;
            }
            Age::Ahead => {
                self.statistics.counters.ahead_of_time += 1;
                self.node.post(NodeAlarm::CLOCK_SKEW, now);
                return Verdict::CommandsRefused;
            }
        }
        connection.schedule.align(cycle, now);
        connection.stamped_at = Some(time_stamp);
        Verdict::Fresh(UpdateTimes { time_stamp: Some(time_stamp), period, paced_at })
    }

    /// Distributes a checked update to class and axes. The system times are those of now and of its arrival.
    fn apply(
        &mut self,
        now: MonotonicTime,
        (system_time, arrived): (Option<SystemTime>, Option<SystemTime>),
        frame: &CommandFrame<'_>,
        verdict: &Verdict,
    ) {
        let received = frame.header().last_received_id;
        self.statistics.acknowledge(received);
        self.clock.acknowledge(received);
        self.echo.clear();
        let context = self.context(system_time);
        let mut asked = [false; INSTANCES_MAX];
        for instance in frame.instances() {
            let number = usize::from(instance.number);
            asked[number] = true;
            let mut echo = Echo { number: instance.number, cyclic: false, lists: None };
            if let Some((slot, table)) = self.instances.axis(number) {
                slot.axis.acknowledge(received);
                echo.cyclic = instance.cyclic.is_some();
                // Without remote control the device acts on nothing in the cyclic and service channels.
                if context.remote {
                    echo.lists = slot.apply(table, &instance, verdict, now, &context);
                }
            }
            if context.remote {
                self.handle_service(&instance, arrived, verdict);
            }
            self.echo.push(echo);
        }
        // An instance that the update does not mention has no request standing.
        for (number, _) in asked.iter().enumerate().filter(|(_, asked)| !**asked) {
            if let Some(channel) = self.instances.channel(number) {
                channel.handle(None);
            }
        }
    }

    /// Hands a request to its channel. A test moves the axis, so one in an update whose commands are refused is refused too;
    /// the other services command nothing.
    fn handle_service(
        &mut self,
        instance: &CommandInstance<'_>,
        arrived: Option<SystemTime>,
        verdict: &Verdict,
    ) {
        let number = usize::from(instance.number);
        let Some(channel) = self.instances.channel(number) else { return };
        if channel.handle(instance.service.as_ref())
            && let Some(request) = &instance.service
        {
            let refused = matches!(verdict, Verdict::CommandsRefused);
            if refused && request.service == MotionService::RUN_HOOKUP_TEST {
                channel.answer(GeneralStatus::DEVICE_STATE_CONFLICT, &[]);
                return;
            }
            service::execute(self, number, request, arrived);
        }
    }
}
