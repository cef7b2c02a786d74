//! A SERCOS line in CP2, for the service channel of one drive.
//!
//! No connection is set up and CP3 is never entered. In CP2 a drive takes parameters that it protects in operation.

use profile_generic::time::MonotonicTime;
use profile_sercos::master::Master;
use profile_sercos::master::config::{AddressPolicy, ConfigError, MasterConfig};
use profile_sercos::master::event::{Event, Output, SlaveId, Ticket};
use profile_sercos::master::station::Presence;
use profile_sercos::wire::header::Phase;

use super::{Line, Stage};
use crate::engine::bus::sercos::direct;
use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun};
use crate::engine::port::{EthernetPort, FRAME_MAX};

/// Frames taken in one step at most.
const FRAMES_PER_STEP: usize = 32;

/// The line, and the drive on it.
pub struct SercosLine {
    master: Master,
    port: Box<dyn EthernetPort>,
    address: u16,
    slave: Option<SlaveId>,
    stage: Stage,
    asked: Option<Ticket>,
    ended: Option<DirectResult>,
}

impl SercosLine {
    /// The drive with this SERCOS address, with this master; its slaves and what to do about addresses do not matter.
    ///
    /// # Errors
    /// A value of the configuration is out of its range.
    pub fn new(config: MasterConfig, port: Box<dyn EthernetPort>, address: u16) -> Result<Self, ConfigError> {
        // Addresses are left as they are.
        let config = MasterConfig { slaves: Vec::new(), addresses: AddressPolicy::Refuse, ..config };
        let mut master = Master::new(config)?;
        master.set_target_phase(Phase::CP2);
        Ok(Self { master, port, address, slave: None, stage: Stage::Starting, asked: None, ended: None })
    }

    fn note(&mut self, event: Event) -> Result<(), String> {
        match event {
            Event::AwaitingApplication { phase } if phase == Phase::CP2 && self.stage == Stage::Starting => {
                // One that was lost since the scan is not waited for.
                let active = || self.master.slaves().filter(|slave| slave.presence == Presence::Active);
                self.slave = active().find(|slave| slave.address == self.address).map(|slave| slave.id);
                if self.slave.is_none() {
                    let there = active().map(|slave| slave.address.to_string());
                    let there = there.collect::<Vec<_>>().join(", ");
                    return Err(format!(
                        "no drive has the SERCOS address {}: those on the line have {there}",
                        self.address
                    ));
                }
                self.stage = Stage::Ready;
            }
            Event::Svc { ticket, outcome } if self.asked == Some(ticket) => {
                self.asked = None;
                self.ended = Some(direct::result(outcome));
            }
            Event::SlaveLost { slave, .. } if self.slave != Some(slave) => {}
            Event::SlaveLost { .. }
            | Event::OtherMaster(_)
            | Event::NoSlaves
            | Event::ScanUnstable
            | Event::TooManySlaves { .. }
            | Event::SwitchFailed { .. }
            | Event::StepFailed { .. }
            | Event::DoubleAddress { .. }
            | Event::AddressConflict { .. }
            | Event::AllSlavesLost => return Err(event.to_string()),
            Event::Stopped => self.stage = Stage::Ended,
            _ => {}
        }
        Ok(())
    }
}

impl Line for SercosLine {
    fn step(&mut self, now: MonotonicTime) -> Result<Stage, String> {
        let mut buffer = [0; FRAME_MAX];
        for _ in 0..FRAMES_PER_STEP {
            let Some((port, length)) = self.port.receive(&mut buffer) else { break };
            // A refused frame is counted by the master and changes nothing.
            let _ = self.master.handle_frame(now, port, &buffer[..length]);
        }
        while let Some(Output::Transmit { port, frame }) = self.master.poll(now) {
            // A frame that cannot be sent is one that was lost on the way.
            let _ = self.port.send(now, port, frame);
        }
        let is_ending = self.stage == Stage::Ending;
        while let Some(event) = self.master.poll_event() {
            match self.note(event) {
                // Nothing that happens on the way down keeps the line up.
                Err(_) if is_ending => {}
                noted => noted?,
            }
        }
        Ok(self.stage.clone())
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        self.master.wake_at()
    }

    fn begin(&mut self, _now: MonotonicTime, task: DirectTask) -> Result<(), NotBegun> {
        let request = direct::request(task)?;
        let Some(slave) = self.slave else {
            return Err((DirectFailure::NoDrive, direct::buffer(request.data)));
        };
        match self.master.svc_submit(slave, request) {
            Ok(ticket) => {
                self.asked = Some(ticket);
                Ok(())
            }
            Err((_, request)) => Err((DirectFailure::Unsent, direct::buffer(request.data))),
        }
    }

    fn take(&mut self) -> Option<DirectResult> {
        self.ended.take()
    }

    fn end(&mut self, _now: MonotonicTime) {
        self.stage = if self.master.phase().is_some() { Stage::Ending } else { Stage::Ended };
        self.master.stop();
    }
}
