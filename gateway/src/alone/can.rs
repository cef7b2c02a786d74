//! SDO to one CANopen device.
//!
//! Nothing but SDO is sent: no command of NMT, no SYNC, no heartbeat. A bus on which another master sends is left alone.

use profile_cia402::drive::index::{AXIS_OFFSET, STATUSWORD};
use profile_cia402::drive::states::State;
use profile_cia402::drive::statusword::Statusword;
use profile_cia402::master::foreign::LISTEN;
use profile_cia402::sdo::client::{Client, ClientConfig};
use profile_cia402::wire::{Function, NodeId, cob_id};
use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::can_wire::{CanWire, FRAMES_PER_STEP};
use super::{Line, Stage};
use crate::engine::bus::can::direct;
use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun, Target};
use crate::engine::port::CanPort;
use crate::mapping::Object;

/// Longest time for an answer.
const PATIENCE: DurationNs = DurationNs::from_millis(500);

/// The bus, and the device on it.
pub struct CanLine {
    wire: CanWire,
    node: NodeId,
    client: Client,
    /// The statusword of each axis.
    statuswords: Vec<Target>,
    stage: Stage,
    /// Nothing is sent before then.
    listens_until: Option<MonotonicTime>,
}

impl CanLine {
    /// The device with this node-id and these axes, from 0.
    #[must_use]
    pub fn new(port: Box<dyn CanPort>, node: NodeId, axes: impl IntoIterator<Item = u16>) -> Self {
        let client = Client::new(ClientConfig { timeout: PATIENCE, ..ClientConfig::default() });
        let statusword = |axis| Target::Object(Object { index: STATUSWORD + axis * AXIS_OFFSET, sub: 0 });
        Self {
            wire: CanWire::new(port),
            node,
            client,
            statuswords: axes.into_iter().map(statusword).collect(),
            stage: Stage::Starting,
            listens_until: None,
        }
    }

    fn take_frame(&mut self, now: MonotonicTime, frame: &Frame) -> Result<(), String> {
        match Function::of(frame.id()) {
            Some(Function::Sync | Function::Nmt | Function::Rpdo(..)) => Err(format!(
                "another master is on this bus: it sends {}; nothing is sent any more",
                frame.id()
            )),
            Some(Function::SdoResponse(node)) if node == self.node => {
                // What is no answer leaves the time-out running.
                let _ = self.client.handle(now, frame.data());
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

impl Line for CanLine {
    fn step(&mut self, now: MonotonicTime) -> Result<Stage, String> {
        for _ in 0..FRAMES_PER_STEP {
            let Some(frame) = self.wire.receive(now)? else { break };
            self.take_frame(now, &frame)?;
        }
        let listens_until = *self.listens_until.get_or_insert(now + LISTEN);
        if self.stage == Stage::Starting && now >= listens_until {
            self.stage = Stage::Ready;
        }
        if self.stage == Stage::Ready {
            let Self { wire, client, node, .. } = self;
            wire.send(now, || Frame::new(cob_id::sdo_request(*node), &client.poll(now)?).ok())?;
        }
        Ok(self.stage.clone())
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        match self.stage {
            Stage::Starting => self.listens_until,
            // Nothing else can be done while the queue is full.
            _ => self.wire.wake_at().or_else(|| self.client.wake_at()),
        }
    }

    fn begin(&mut self, now: MonotonicTime, task: DirectTask) -> Result<(), NotBegun> {
        let request = direct::request(task)?;
        let started = self.client.start(now, request);
        started.map_err(|request| (DirectFailure::Unsent, direct::buffer(request.data)))
    }

    fn take(&mut self) -> Option<DirectResult> {
        self.client.take_outcome().map(direct::result)
    }

    fn torque_reports(&self) -> &[Target] {
        &self.statuswords
    }

    fn has_torque(&self, report: &[u8]) -> bool {
        let state = report
            .try_into()
            .ok()
            .and_then(|word| Statusword::from_bits_retain(u16::from_le_bytes(word)).state());
        state.is_none_or(State::has_torque)
    }

    fn end(&mut self, _now: MonotonicTime) {
        // Each access was waited for: there is nothing to take back.
        self.stage = Stage::Ended;
    }
}
