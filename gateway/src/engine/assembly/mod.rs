//! The assembly side of the engine: a device whose axes any class 1 scanner moves through its assemblies.
//!
//! ```text
//! datagrams --Connections--> AxisOutput --Handshake--> PlcAxis --wishes, set-points--> AxisChannel
//!           <--------------- AxisInput  <------------------------- feedback, faults ---
//! ```
//!
//! The layout of the assemblies and the handshake are `profile_cip::assembly`. There is one owner of the output assembly, and
//! there may be others that only get the input assembly. While an owner is connected, the axes of the device are the
//! controller's, as with CIP Motion.
//!
//! This runs in the cycle: it does not allocate or wait.

mod axis;
mod connections;
mod parameters;

use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::assembly::layout::ASSEMBLY_LEN_MAX;
use profile_cip::assembly::{Assemblies, Link, Refusal, Scale};
use profile_cip::device::motion_link::{ExplicitReply, ExplicitRequest, MotionReply, MotionRequest};
use profile_cip::device::objects::ac_dc_drive::{self, VALUE_LEN};
use profile_cip::device::objects::assembly::is_data;
use profile_cip::device::visualization::{self, Indication, NetworkCondition};
use profile_cip::wire::status::GeneralStatus;
use profile_generic::time::{DurationNs, MonotonicTime};

use self::axis::{Around, PlcAxis};
use self::connections::{Connections, Counts};
use self::parameters::Parameters;
use super::axis::AxisChannel;
use super::bus::{Answer, Buses};
use super::north::{Exchange, North};
use super::notice::{Notice, axis_number};
use super::port::NorthPort;
use crate::north::DeviceEnd;

/// Explicit requests handled in one cycle.
const REQUESTS_PER_CYCLE: usize = parameters::REQUESTS_MAX;

/// An output assembly of which nothing counts.
const ZEROS: [u8; ASSEMBLY_LEN_MAX] = [0; ASSEMBLY_LEN_MAX];

/// An axis of a device with assemblies.
#[derive(Debug, Clone, Copy)]
pub struct AssemblyAxis {
    /// Number of the axis in the engine.
    pub axis: usize,
    /// Its instance in the device.
    pub instance: u16,
    /// Its counts.
    pub scale: Scale,
}

/// A device with assemblies.
#[derive(Debug)]
pub struct AssemblyChannel {
    number: u8,
    assemblies: Assemblies,
    link: DeviceEnd,
    connections: Connections,
    axes: Vec<PlcAxis>,
    /// The input assembly as it is now.
    input: Box<[u8]>,
    /// Whether system time can be trusted.
    synchronized: bool,
    /// A connection was lost, and no other has followed.
    lost: bool,
    parameters: Parameters,
}

impl AssemblyChannel {
    /// A device with its axes in the order of its assemblies.
    #[must_use]
    pub fn new(number: u8, assemblies: Assemblies, link: DeviceEnd, axes: &[AssemblyAxis]) -> Self {
        let input = vec![0; assemblies.input_len()].into_boxed_slice();
        Self {
            number,
            connections: Connections::new(&assemblies),
            assemblies,
            link,
            axes: axes.iter().map(PlcAxis::new).collect(),
            input,
            synchronized: false,
            lost: false,
            parameters: Parameters::default(),
        }
    }

    /// Its number in the gateway, from 0.
    #[must_use]
    pub fn number(&self) -> u8 {
        self.number
    }

    /// The engine's numbers of its axes, in the order of the assemblies.
    pub fn members(&self) -> impl Iterator<Item = usize> + '_ {
        self.axes.iter().map(|axis| axis.number)
    }

    /// The counts of its axes, in the same order.
    pub fn scales(&self) -> impl Iterator<Item = Scale> + '_ {
        self.axes.iter().map(|axis| axis.scale)
    }

    /// Address and interval of the owner, in microseconds, while there is one.
    #[must_use]
    pub fn owner(&self) -> Option<(Ipv4Addr, u32)> {
        self.connections.owner().map(|open| (open.originator, open.rpi_us))
    }

    /// What its connections have counted.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.connections.counts()
    }

    /// Sets whether system time can be trusted.
    pub fn set_synchronized(&mut self, synchronized: bool) {
        self.synchronized = synchronized;
    }

    /// The shortest interval of its connections.
    #[must_use]
    pub fn update_period(&self) -> Option<DurationNs> {
        self.connections.shortest_interval()
    }

    /// What the Network Status LED of the device shows.
    #[must_use]
    pub fn network_status(&self) -> Indication {
        let connected = self.is_connected() || self.link.explicit_connections() > 0;
        visualization::network_status(&NetworkCondition::listening(connected, self.lost))
    }

    /// Sets on each axis of the device whether a controller is connected.
    pub fn publish_connection(&self, axes: &mut [AxisChannel]) {
        let connected = self.connections.owner().is_some();
        self.axes.iter().for_each(|axis| axes[axis.number].set_controller(connected));
    }

    /// Whether any connection to the assemblies is open.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.connections.any()
    }

    /// Takes requests of the explicit side and what came on the connections. While the gateway is `in_use`, this device may not be
    /// started anew, whatever its own axes do.
    pub fn receive(&mut self, now: MonotonicTime, in_use: bool, port: &mut dyn NorthPort) {
        self.link.report_kept();
        for _ in 0..REQUESTS_PER_CYCLE {
            let Some(request) = self.link.request() else { break };
            let reply = match request {
                MotionRequest::Open(open) => {
                    let outcome = self.connections.open(now, open);
                    self.lost &= outcome.is_err();
                    MotionReply::Opened { token: open.token, outcome }
                }
                MotionRequest::Close(close) => {
                    self.connections.close(close.o_to_t_id);
                    MotionReply::Closed { token: close.token }
                }
                MotionRequest::Explicit(explicit)
                    if is_data(&explicit.path) || ac_dc_drive::place(&explicit.path).is_some() =>
                {
                    MotionReply::Explicit(self.data_of(&explicit))
                }
                MotionRequest::Explicit(explicit) => match self.parameters.push(explicit) {
                    Ok(()) => continue,
                    Err(token) => {
                        let status = GeneralStatus::RESOURCE_UNAVAILABLE.0;
                        MotionReply::Explicit(ExplicitReply::status(token, status))
                    }
                },
                MotionRequest::PrepareReset(token) => {
                    let granted = !in_use && !self.is_connected();
                    MotionReply::ResetPrepared { token, granted }
                }
            };
            // A full queue means that the explicit side has given up waiting.
            let _ = self.link.reply(reply);
        }
        self.connections.receive(now, port);
        while let Some((o_to_t_id, silent_us)) = self.connections.poll_lost(now) {
            self.lost = true;
            self.link.report_lost(o_to_t_id, silent_us);
        }
        self.connections.end_listen_only();
        while let Some(o_to_t_id) = self.connections.poll_ended() {
            self.link.report_lost(o_to_t_id, 0);
        }
    }

    /// The data of an assembly for an explicit request: of the input what is sent next, of the output what counts, which is nothing
    /// while no owner is in run. A value of the AC/DC Drive object is a part of them.
    fn data_of(&self, request: &ExplicitRequest) -> ExplicitReply {
        let is = |point: u16| request.path.instance == u32::from(point);
        let mut reply = ExplicitReply::status(request.token, GeneralStatus::SUCCESS.0);
        let output = || self.connections.output().unwrap_or(&ZEROS[..self.assemblies.output_len()]);
        let data: &[u8] = if let Some(place) = ac_dc_drive::place(&request.path) {
            let all: &[u8] = if place.output { output() } else { &self.input };
            all.get(place.offset..place.offset + VALUE_LEN).unwrap_or_default()
        } else if is(self.assemblies.input_point()) {
            &self.input
        } else if is(self.assemblies.output_point()) {
            output()
        } else {
            &[]
        };
        match reply.data.try_extend_from_slice(data) {
            Ok(()) => reply,
            Err(_) => ExplicitReply::status(request.token, GeneralStatus::REPLY_DATA_TOO_LARGE.0),
        }
    }

    /// Reads and writes parameters of the drives for explicit requests.
    pub(in crate::engine) fn parameters(&mut self, exchange: &mut Exchange<'_>, buses: &mut Buses) {
        let device = (self.number, self.axes.as_slice());
        self.parameters.exchange(device, exchange, buses, &mut self.link);
    }

    /// Takes the drive's answer to such an access.
    pub(in crate::engine) fn parameter_answered(&mut self, ticket: u32, answer: &Answer, axis: &AxisChannel) {
        self.parameters.answered(ticket, answer, axis);
    }

    /// Sends the input assembly on each connection on which it is due.
    pub fn transmit(&mut self, now: MonotonicTime, port: &mut dyn NorthPort) {
        self.connections.transmit(now, &self.input, port);
    }
}

impl North for AssemblyChannel {
    /// Hands each axis what the controller wants of it, and puts the input assembly together.
    fn exchange(&mut self, exchange: &mut Exchange<'_>) {
        let Exchange { now, time, ending, ref mut axes, ref mut notice, .. } = *exchange;
        let fresh = self.connections.take_fresh();
        let data = self.connections.output();
        let owner = self.connections.owner();
        let around = Around {
            now: (now, time.system_at(now)),
            time,
            synchronized: self.synchronized,
            link: if ending { Link::Lost } else { self.connections.link() },
            period: owner.map(|open| DurationNs::from_micros(i64::from(open.rpi_us))),
            paced_at: fresh,
        };
        for (place, member) in self.axes.iter_mut().enumerate() {
            let axis = &mut axes[member.number];
            let output = data.and_then(|data| self.assemblies.output_of(place, data, member.scale).ok());
            let output = output.unwrap_or_default();
            let shown = member.refusal();
            member.follow(&around, axis, &output);
            let (number, refusal) = (axis_number(member.number), member.refusal());
            if refusal != shown && refusal != Refusal::NONE {
                notice(Notice::OrderRefused { axis: number, refusal });
            }
            let values = member.input(&around, axis);
            // The length is that of the assembly.
            let _ = self.assemblies.put_input(place, &values, member.scale, &mut self.input);
        }
        if let Some((count, from, why)) = self.connections.strangers(now) {
            notice(Notice::Strangers { device: self.number, count, from, why });
        }
    }
}

/// Where a connection's data go.
type Destination = SocketAddrV4;
