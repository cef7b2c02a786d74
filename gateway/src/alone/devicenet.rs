//! The explicit connection of one drive on DeviceNet.
//!
//! The MAC ID of the gateway is checked as at any start, which takes two seconds. In that time the network is listened to: a drive that
//! another master polls, or has allocated, is left alone. Only the explicit connection is allocated, and given back at the end: there
//! is no poll connection, by which alone the drive can be commanded.

use profile_cip::devicenet::access::AccessState;
use profile_cip::devicenet::master::Master;
use profile_cip::devicenet::master::config::{ConfigError, MasterConfig};
use profile_cip::devicenet::master::event::{Event, LossReason, Ticket};
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::SupervisorState;
use profile_cip::wire::motion::codes::AxisStateCode;
use profile_generic::time::MonotonicTime;

use super::can_wire::{CanWire, FRAMES_PER_STEP};
use super::{Line, Stage};
use crate::config::DevicenetKind;
use crate::engine::bus::devicenet::direct::DirectAccess;
use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun, Target};
use crate::engine::port::CanPort;
use crate::mapping::devicenet::{motion, speed};

/// Axis State of the Motion Device Axis Object.
const AXIS_STATE: u16 = 650;

/// State of the Control Supervisor.
const SUPERVISOR_STATE: u16 = 6;

/// The network, and the drive on it.
pub struct DevicenetLine {
    master: Master,
    wire: CanWire,
    mac: MacId,
    /// The state of the drive.
    state: Target,
    is_motion: bool,
    stage: Stage,
    /// The access that is in progress, with its buffer.
    asked: Option<(Ticket, DirectAccess, Vec<u8>)>,
    ended: Option<DirectResult>,
}

impl DevicenetLine {
    /// The drive of this kind with this MAC ID; `config` has it as its only slave, without I/O connections.
    ///
    /// # Errors
    /// A value of the configuration is out of its range.
    pub fn new(
        config: MasterConfig,
        port: Box<dyn CanPort>,
        mac: MacId,
        kind: &DevicenetKind,
    ) -> Result<Self, ConfigError> {
        let is_motion = matches!(kind, DevicenetKind::Motion { .. });
        let (class, attribute) = match is_motion {
            true => (motion::CLASS, AXIS_STATE),
            false => (speed::CLASS_SUPERVISOR, SUPERVISOR_STATE),
        };
        Ok(Self {
            master: Master::new(config)?,
            wire: CanWire::new(port),
            mac,
            state: Target::Attribute { class, instance: 1, attribute },
            is_motion,
            stage: Stage::Starting,
            asked: None,
            ended: None,
        })
    }

    fn note(&mut self, event: Event) -> Result<(), String> {
        match event {
            Event::Exchanging(_) if self.stage == Stage::Starting => self.stage = Stage::Ready,
            Event::Explicit { ticket, outcome } => {
                if let Some((_, access, mut data)) = self.asked.take_if(|(asked, ..)| *asked == ticket) {
                    let result = access.result(&outcome, &mut data).map(|()| None);
                    self.ended = Some(DirectResult { result, data });
                }
            }
            Event::Lost { reason: LossReason::AnotherMaster, .. } => {
                return Err(format!(
                    "another master has the drive with MAC ID {}: it is left alone",
                    self.mac
                ));
            }
            Event::OtherMaster { .. } => {
                return Err(format!("{event}; the drive is left alone"));
            }
            Event::Lost { reason, .. } => {
                return Err(format!("the drive with MAC ID {}: {reason}", self.mac));
            }
            Event::DuplicateMac { .. } | Event::SlaveDuplicate { .. } | Event::BusOff => {
                return Err(event.to_string());
            }
            Event::Exchanging(_) | Event::Online | Event::Released { .. } | Event::Refused(_) => {}
        }
        Ok(())
    }
}

impl Line for DevicenetLine {
    fn step(&mut self, now: MonotonicTime) -> Result<Stage, String> {
        let Self { master, wire, .. } = self;
        if master.access() == AccessState::Off {
            master.start(now);
        }
        for _ in 0..FRAMES_PER_STEP {
            let Some(frame) = wire.receive(now)? else { break };
            // A refused frame is counted by the master and changes nothing.
            let _ = master.handle_frame(now, &frame);
        }
        wire.send(now, || master.poll(now))?;
        let is_ending = self.stage == Stage::Ending;
        while let Some(event) = self.master.poll_event() {
            match self.note(event) {
                // Nothing that happens on the way down keeps the drive.
                Err(_) if is_ending => {}
                noted => noted?,
            }
        }
        if is_ending && self.master.is_drained() && self.wire.is_drained() {
            self.stage = Stage::Ended;
        }
        Ok(self.stage.clone())
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        // Nothing else can be done while the queue is full.
        self.wire.wake_at().or_else(|| self.master.wake_at())
    }

    fn begin(&mut self, _now: MonotonicTime, task: DirectTask) -> Result<(), NotBegun> {
        let DirectTask { target, write, data } = task;
        let Target::Attribute { class, instance, attribute } = target else {
            return Err((DirectFailure::OtherBus, data));
        };
        let access = DirectAccess { class, instance, attribute, write };
        let ticket = access.request(&data).and_then(|request| self.master.submit(self.mac, request).ok());
        let Some(ticket) = ticket else { return Err((DirectFailure::Unsent, data)) };
        self.asked = Some((ticket, access, data));
        Ok(())
    }

    fn take(&mut self) -> Option<DirectResult> {
        self.ended.take()
    }

    fn torque_reports(&self) -> &[Target] {
        std::slice::from_ref(&self.state)
    }

    fn has_torque(&self, report: &[u8]) -> bool {
        let [code] = *report else { return true };
        if self.is_motion {
            return !matches!(
                AxisStateCode(code),
                AxisStateCode::INITIALIZING
                    | AxisStateCode::PRE_CHARGE
                    | AxisStateCode::STOPPED
                    | AxisStateCode::MAJOR_FAULTED
                    | AxisStateCode::START_INHIBITED
                    | AxisStateCode::SHUTDOWN
            );
        }
        !matches!(
            SupervisorState(code),
            SupervisorState::STARTUP
                | SupervisorState::NOT_READY
                | SupervisorState::READY
                | SupervisorState::FAULTED
        )
    }

    fn end(&mut self, now: MonotonicTime) {
        self.stage = Stage::Ending;
        self.master.stop(now);
    }
}
