//! One explicit message on its way through the device: unwrapped, split, run, put together and sent back.
//!
//! A message, or one service out of a Multiple_Service_Packet, may be for the motion device. The rest then
//! waits in the session's [`Transaction`] and goes on when the answer comes.

use core::net::SocketAddrV4;
use profile_generic::time::MonotonicTime;

use super::adapter::{Adapter, DEVICE_TIMEOUT, SessionSlot, UNCONNECTED_REPLY_MAX, packet_bytes};
use super::node::{Await, Node, Origin, Step};
use super::session::{Multiple, Opened, ReplyTo, Transaction};
use crate::device::objects::class::{CLASS_CONNECTION_MANAGER, CLASS_MESSAGE_ROUTER};
use crate::device::objects::object::{Answer, data_status};
use crate::device::objects::router;
use crate::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus, IO_PORT, Packet};
use crate::wire::message_router::Request;
use crate::wire::multiple_service::{self, MultipleService};
use crate::wire::sockaddr::{SOCKADDR_LEN, SockaddrInfo};
use crate::wire::status::{ConnectionStatus, GeneralStatus, Service};
use crate::wire::unconnected_send::UnconnectedSend;

impl Adapter {
    pub(crate) fn reply_max(&self, slot: SessionSlot, reply_to: ReplyTo) -> usize {
        match reply_to {
            ReplyTo::Unconnected { .. } => UNCONNECTED_REPLY_MAX,
            ReplyTo::Connected { o_to_t_id, .. } => {
                let connection = self
                    .node
                    .connections
                    .explicit
                    .iter()
                    .find(|one| one.session == slot && one.o_to_t_id == o_to_t_id);
                connection.map_or(0, |one| usize::from(one.t_to_o_size.saturating_sub(2)))
            }
        }
    }

    fn origin(
        &self,
        now: MonotonicTime,
        slot: SessionSlot,
        reply_to: ReplyTo,
        t_to_o_socket: Option<SocketAddrV4>,
    ) -> Option<Origin> {
        let peer = self.session(slot)?.peer;
        Some(Origin { now, session: slot, peer, t_to_o_socket, reply_max: self.reply_max(slot, reply_to) })
    }

    /// Starts one message: unwraps an Unconnected_Send, splits a Multiple_Service_Packet, runs anything else.
    pub(crate) fn begin(
        &mut self,
        now: MonotonicTime,
        slot: SessionSlot,
        reply_to: ReplyTo,
        t_to_o_socket: Option<SocketAddrV4>,
        message: &[u8],
    ) {
        let Some(origin) = self.origin(now, slot, reply_to, t_to_o_socket) else { return };
        let message = match unwrap(&self.node, message) {
            Ok(message) => message,
            Err(answer) => {
                self.node.counters.requests_refused += 1;
                let reply = answer.into_reply(Service::UNCONNECTED_SEND, origin.reply_max);
                return self.reply(slot, reply_to, &reply, Opened::default());
            }
        };
        match split(&self.node, message) {
            None => match self.node.execute(&origin, message) {
                Step::Done(reply) => self.reply(slot, reply_to, &reply, Opened::default()),
                Step::Await(awaited) => self.wait(&origin, reply_to, awaited, None, Opened::default()),
            },
            Some(Ok(multiple)) => self.run(&origin, reply_to, multiple, Opened::default()),
            Some(Err(status)) => {
                self.node.counters.requests_refused += 1;
                let answer = Answer::status(status);
                let reply = answer.into_reply(Service::MULTIPLE_SERVICE_PACKET, origin.reply_max);
                self.reply(slot, reply_to, &reply, Opened::default());
            }
        }
    }

    /// Runs the services of a packet one after the other, up to the end or to one for the motion device.
    ///
    /// A packet whose replies outgrow the reply ends there; services already run stay run.
    fn run(&mut self, origin: &Origin, reply_to: ReplyTo, mut multiple: Multiple, opened: Opened) {
        loop {
            let size: usize = multiple.replies.iter().map(|reply| reply.len() + 2).sum();
            let parsed = MultipleService::parse(&multiple.data).ok();
            let next = parsed.and_then(|packet| packet.get(multiple.next));
            let Some(message) = next.filter(|_| size <= origin.reply_max) else { break };
            let step = self.node.execute(origin, message);
            multiple.next += 1;
            match step {
                Step::Done(reply) => multiple.push(reply),
                Step::Await(awaited) => {
                    return self.wait(origin, reply_to, awaited, Some(multiple), opened);
                }
            }
        }
        let reply = multiple.into_answer().into_reply(Service::MULTIPLE_SERVICE_PACKET, origin.reply_max);
        self.reply(origin.session, reply_to, &reply, opened);
    }

    fn wait(
        &mut self,
        origin: &Origin,
        reply_to: ReplyTo,
        awaited: Await,
        multiple: Option<Multiple>,
        opened: Opened,
    ) {
        let t_to_o_socket = origin.t_to_o_socket;
        let deadline = origin.now + DEVICE_TIMEOUT;
        if let Some(session) = self.session_mut(origin.session) {
            session.transaction =
                Some(Transaction { reply_to, awaited, deadline, t_to_o_socket, multiple, opened });
        }
    }

    /// Goes on with a request once its part at the motion device is done.
    pub(crate) fn resume(
        &mut self,
        now: MonotonicTime,
        slot: SessionSlot,
        transaction: Transaction,
        reply: Vec<u8>,
        opened: Opened,
    ) {
        let Transaction { reply_to, t_to_o_socket, multiple, .. } = transaction;
        let opened = transaction.opened.and(opened);
        let Some(origin) = self.origin(now, slot, reply_to, t_to_o_socket) else { return };
        match multiple {
            None => self.reply(slot, reply_to, &reply, opened),
            Some(mut multiple) => {
                multiple.push(reply);
                self.run(&origin, reply_to, multiple, opened);
            }
        }
    }

    /// Sends a reply the way its request came.
    pub(crate) fn reply(&mut self, slot: SessionSlot, reply_to: ReplyTo, reply: &[u8], opened: Opened) {
        let Some(session_handle) = self.session(slot).and_then(|session| session.handle) else { return };
        let interface = &self.node.config.interface;
        let mut socket = [0; SOCKADDR_LEN];
        let address = SocketAddrV4::new(interface.address, interface.io_port);
        let other_port = interface.io_port != IO_PORT && SockaddrInfo { address }.emit(&mut socket).is_ok();
        let mut group = [0; SOCKADDR_LEN];
        let to_group = opened.group.is_some_and(|address| SockaddrInfo { address }.emit(&mut group).is_ok());
        let (id, mut message);
        let (command, sender_context, mut packet) = match reply_to {
            ReplyTo::Unconnected { sender_context } => {
                let mut packet = CommonPacket::new(&[
                    Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
                    Item { item_type: ItemType::UNCONNECTED_DATA, data: reply },
                ]);
                if opened.io && other_port {
                    packet.items.push(Item { item_type: ItemType::SOCKADDR_O_TO_T, data: &socket });
                }
                (Command::SEND_RR_DATA, sender_context, packet)
            }
            ReplyTo::Connected { sender_context, o_to_t_id, sequence } => {
                let Some(connection) = self.node.connections.explicit_mut(slot, o_to_t_id) else {
                    // It was closed or timed out while its request was under way.
                    return;
                };
                if connection.last_reply.is_empty() {
                    connection.last_reply.extend_from_slice(reply);
                }
                id = connection.t_to_o_id.to_le_bytes();
                message = sequence.to_le_bytes().to_vec();
                message.extend(reply);
                let packet = CommonPacket::new(&[
                    Item { item_type: ItemType::CONNECTED_ADDRESS, data: &id },
                    Item { item_type: ItemType::CONNECTED_DATA, data: &message },
                ]);
                (Command::SEND_UNIT_DATA, sender_context, packet)
            }
        };
        if to_group {
            packet.items.push(Item { item_type: ItemType::SOCKADDR_T_TO_O, data: &group });
        }
        let body = EncapsulatedPacket { interface_handle: 0, timeout_s: 0, packet };
        let mut data = vec![0; body.buffer_len()];
        let status = match body.emit(&mut data) {
            Ok(_) => EncapsulationStatus::SUCCESS,
            Err(_) => EncapsulationStatus::INSUFFICIENT_MEMORY,
        };
        let reply = packet_bytes(&Packet {
            command,
            session_handle,
            status,
            sender_context,
            options: 0,
            data: &data,
        });
        self.send(slot, &reply);
    }
}

impl Multiple {
    fn push(&mut self, reply: Vec<u8>) {
        self.failed |= reply.get(2) != Some(&GeneralStatus::SUCCESS.0);
        self.replies.push(reply);
    }

    fn into_answer(self) -> Answer {
        let replies: Vec<&[u8]> = self.replies.iter().map(Vec::as_slice).collect();
        let mut data = vec![0; multiple_service::buffer_len(&replies)];
        if multiple_service::emit(&replies, &mut data).is_err() {
            return Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE);
        }
        let status = if self.failed { GeneralStatus::EMBEDDED_SERVICE_ERROR } else { GeneralStatus::SUCCESS };
        Answer { status, data, ..Answer::default() }
    }
}

/// The message inside an Unconnected_Send, or the message itself. This device has no port to send anything
/// on, so the route must be empty.
fn unwrap<'a>(node: &Node, message: &'a [u8]) -> Result<&'a [u8], Answer> {
    let Ok(request) = Request::parse(message) else { return Ok(message) };
    if request.service != Service::UNCONNECTED_SEND {
        return Ok(message);
    }
    match router::resolve(request.path, &node.config.identity) {
        Ok(path) if path.class == CLASS_CONNECTION_MANAGER && path.instance == 1 => {}
        // Another object may use this code for a service of its own.
        _ => return Ok(message),
    }
    let send = UnconnectedSend::parse(request.data).map_err(|error| Answer::status(data_status(error)))?;
    if send.route.is_empty() {
        return Ok(send.message);
    }
    let remaining = u8::try_from(send.route.len() / 2).unwrap_or(u8::MAX);
    Err(Answer::connection(ConnectionStatus::PORT_NOT_AVAILABLE, vec![remaining]))
}

/// The services of a Multiple_Service_Packet, or `None` for any other message.
fn split(node: &Node, message: &[u8]) -> Option<Result<Multiple, GeneralStatus>> {
    let request = Request::parse(message).ok()?;
    if request.service != Service::MULTIPLE_SERVICE_PACKET {
        return None;
    }
    let path = router::resolve(request.path, &node.config.identity).ok()?;
    if path.class != CLASS_MESSAGE_ROUTER || path.instance != 1 {
        return None;
    }
    Some(match MultipleService::parse(request.data) {
        Ok(_) => Ok(Multiple { data: request.data.to_vec(), next: 0, replies: Vec::new(), failed: false }),
        Err(error) => Err(data_status(error)),
    })
}
