//! What a decoder has learnt from the frames before: phase, open data blocks, and the telegram layout.

use std::collections::BTreeMap;

use super::super::attribute::Attribute;
use super::super::connection::ConnectionSetup;
use super::super::cp0::SLAVES_MAX;
use super::super::header::{Kind, Phase, TELEGRAMS_MAX};
use super::super::idn::Idn;
use super::super::layout::{ConnectionLayout, DeviceLayout, Layout, Offset};
use super::super::slot::SvcSlot;
use super::super::svc::{Element, LIST_HEAD_LEN, SVC_LEN, SvcControl, SvcStatus};
use super::super::telegram::PhaseTracker;
use crate::generated::idns::connection;

/// Longest element that is collected, bytes with list head; what is longer cannot be part of a layout.
const COLLECT_MAX: usize = 256;
/// Attributes kept; more would only be for show.
const ATTRIBUTES_MAX: usize = 4096;
/// Transfers kept until they are taken.
const TRANSFERS_MAX: usize = 256;
/// Connections kept for one slave: the range of x in S-0-1050.x that real slaves use.
const CONNECTIONS_MAX: usize = 64;

/// What a decoder may ask the caller about an IDN.
pub trait Names {
    /// Name of the parameter.
    fn name(&self, idn: Idn) -> Option<&str>;

    /// Length of the operation data in bytes, if it is fixed.
    fn length(&self, idn: Idn) -> Option<usize> {
        let _ = idn;
        None
    }
}

/// A [`Names`] that knows nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoNames;

impl Names for NoNames {
    fn name(&self, _: Idn) -> Option<&str> {
        None
    }
}

/// The service channel of one slave, as far as it was seen.
#[derive(Debug, Clone, Default)]
pub(super) struct Channel {
    /// The data block that is open.
    pub(super) open: Option<Idn>,
    /// Control word of the last step.
    pub(super) control: Option<SvcControl>,
    /// Parts of the current element sent by the master, list head included.
    written: Vec<u8>,
    /// Parts of the current element given by the slave.
    read: Vec<u8>,
    /// Number of the step within its element, from 0.
    pub(super) part: usize,
    /// The answer to the current step has been taken.
    answered: bool,
}

/// One connection as the master has set it up.
#[derive(Debug, Clone, Default)]
struct Connection {
    setup: ConnectionSetup,
    assignment: Option<u16>,
    len: Option<u16>,
    idns: Vec<Idn>,
}

/// Everything a decoder carries from frame to frame.
pub struct DecodeContext<'n> {
    pub(super) names: &'n dyn Names,
    pub(super) tracker: PhaseTracker,
    channels: BTreeMap<u16, Channel>,
    connections: BTreeMap<(u16, u8), Connection>,
    attributes: BTreeMap<Idn, Attribute>,
    layout: Layout,
    addresses: BTreeMap<u16, u16>,
    transfers: Vec<Transfer>,
}

/// Operation data that a slave has given, or that were written to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transfer {
    /// Topology address of the slave.
    pub topology: u16,
    /// The parameter.
    pub idn: Idn,
    /// The data; a list with its head.
    pub data: Vec<u8>,
}

impl Default for DecodeContext<'_> {
    fn default() -> Self {
        DecodeContext::new(&NoNames)
    }
}

impl<'n> DecodeContext<'n> {
    /// A context that has seen nothing yet.
    pub fn new(names: &'n dyn Names) -> Self {
        DecodeContext {
            names,
            tracker: PhaseTracker::default(),
            channels: BTreeMap::new(),
            connections: BTreeMap::new(),
            attributes: BTreeMap::new(),
            layout: Layout::unknown(),
            addresses: BTreeMap::new(),
            transfers: Vec::new(),
        }
    }

    /// The layout of CP3 and CP4 learnt so far.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The IDNs in a connection of a slave, in order: S-0-1050.x.6.
    pub fn connection_idns(&self, address: u16, index: u8) -> &[Idn] {
        self.connections.get(&(address, index)).map_or(&[], |connection| &connection.idns)
    }

    /// The SERCOS address of a slave, if CP0 was among the frames that were followed.
    pub fn address(&self, topology: u16) -> Option<u16> {
        self.addresses.get(&topology).copied()
    }

    /// Takes the operation data that service channels have carried to the end since the last call.
    pub fn take_transfers(&mut self) -> Vec<Transfer> {
        std::mem::take(&mut self.transfers)
    }

    pub(super) fn note_address(&mut self, topology: u16, address: Option<u16>) {
        if usize::from(topology) <= SLAVES_MAX
            && let Some(address) = address
        {
            self.addresses.insert(topology, address);
        }
    }

    /// Takes in the service channels of a telegram of CP3 or CP4, behind its header.
    pub(super) fn follow_channels(&mut self, kind: Kind, number: u8, data: &[u8]) {
        for device in 0..self.layout.devices.len() {
            let DeviceLayout { address, svc_mdt, svc_at, .. } = self.layout.devices[device];
            let place = match kind {
                Kind::Mdt => svc_mdt,
                Kind::At => svc_at,
            };
            let bytes = place.filter(|at| at.telegram == number).and_then(|at| data.get(at.range(SVC_LEN)));
            if let Some(Ok(slot)) = bytes.map(SvcSlot::parse) {
                self.take_slot(kind, address, slot);
            }
        }
    }

    /// Takes in a slot. Returns whether it is a new step, or answers one for the first time; `None` where it is empty.
    pub(super) fn take_slot(&mut self, kind: Kind, address: u16, slot: SvcSlot) -> Option<bool> {
        match kind {
            // An AT as it leaves the master has nothing in it.
            Kind::At if slot == SvcSlot::default() => None,
            Kind::Mdt => Some(self.master_slot(address, slot)),
            Kind::At => Some(self.slave_slot(address, slot)),
        }
    }

    /// Keeps operation data that have come to their end. What is longer than can be collected is not whole, and not kept.
    fn transfer(&mut self, address: u16, idn: Idn, mut data: Vec<u8>) {
        if data.len() >= COLLECT_MAX {
            return;
        }
        if let Some(length) = self.length(idn) {
            data.truncate(length);
        }
        if self.transfers.len() < TRANSFERS_MAX {
            self.transfers.push(Transfer { topology: address, idn, data });
        }
    }

    /// The attribute of an IDN, if some slave has shown it.
    pub(super) fn attribute(&self, idn: Idn) -> Option<Attribute> {
        self.attributes.get(&idn).copied()
    }

    /// Whether an IDN is a procedure command: one of the communication profile, or shown to be one.
    pub(super) fn is_command(&self, idn: Idn) -> bool {
        let known = [Idn::CP3_CHECK, Idn::CP4_CHECK, Idn::RESET_C1D, Idn::DELAY_MEASURING];
        known.contains(&idn) || self.attribute(idn).is_some_and(Attribute::is_command)
    }

    pub(super) fn channel(&self, address: u16) -> Option<&Channel> {
        self.channels.get(&address)
    }

    /// Takes note of what the frame's phase means: from CP0 on everything begins anew.
    pub(super) fn enter(&mut self, phase: Phase) {
        if phase == Phase::CP0 && !self.channels.is_empty() {
            self.channels.clear();
            self.connections.clear();
            self.layout = Layout::unknown();
        }
    }

    /// Takes in a slot of an MDT. Returns whether it is a new step.
    pub(super) fn master_slot(&mut self, address: u16, slot: SvcSlot) -> bool {
        if usize::from(address) > SLAVES_MAX {
            return false;
        }
        let control = SvcControl(slot.word);
        let channel = self.channels.entry(address).or_default();
        let new = channel.control.is_none_or(|last| last.mhs() != control.mhs());
        if !new {
            return false;
        }
        let same_element = channel.control.is_some_and(|last| {
            last.element() == control.element() && last.write() == control.write() && !last.last()
        });
        channel.part = if same_element { channel.part + 1 } else { 0 };
        if !same_element {
            channel.written.clear();
            channel.read.clear();
        }
        channel.control = Some(control);
        channel.answered = false;
        match control.element() {
            Element::Close => channel.open = None,
            Element::Idn if control.write() => channel.open = Some(Idn(slot.info)),
            Element::Data if control.write() => {
                if channel.written.len() < COLLECT_MAX {
                    channel.written.extend_from_slice(&slot.info.to_le_bytes());
                }
                if control.last()
                    && let Some(idn) = channel.open
                {
                    let written = std::mem::take(&mut channel.written);
                    self.learn(address, idn, &written);
                    self.transfer(address, idn, written);
                }
            }
            _ => {}
        }
        true
    }

    /// Takes in a slot of an AT. Returns whether it answers a step for the first time.
    pub(super) fn slave_slot(&mut self, address: u16, slot: SvcSlot) -> bool {
        let status = SvcStatus::from_bits_retain(slot.word);
        let Some(channel) = self.channels.get_mut(&address) else { return false };
        let Some(control) = channel.control else { return false };
        if channel.answered || !is_answer(status, control) {
            return false;
        }
        channel.answered = true;
        if status.contains(SvcStatus::ERROR) || control.write() {
            return true;
        }
        let Some(idn) = channel.open else { return true };
        if control.element() == Element::Data {
            if channel.read.len() < COLLECT_MAX {
                channel.read.extend_from_slice(&slot.info.to_le_bytes());
            }
            if control.last() {
                let read = std::mem::take(&mut channel.read);
                self.transfer(address, idn, read);
            }
        }
        self.learn_read(address, idn, control.element(), slot.info);
        true
    }

    /// Takes over what a slave has answered to a read of an element.
    fn learn_read(&mut self, address: u16, idn: Idn, element: Element, info: u32) {
        match element {
            Element::Attribute if self.attributes.len() < ATTRIBUTES_MAX => {
                self.attributes.insert(idn, Attribute(info));
            }
            Element::Data if idn.block() == Idn::CONNECTION_BLOCK && idn.element() == connection::LENGTH => {
                let len = low_word(info);
                self.connection(address, idn.instance(), |connection| connection.len = Some(len));
            }
            _ => {}
        }
    }

    /// Takes over a parameter which the master has written completely.
    fn learn(&mut self, address: u16, idn: Idn, data: &[u8]) {
        let word = data.first_chunk::<2>().map(|bytes| u16::from_le_bytes(*bytes)).unwrap_or_default();
        let place = Some(Offset::from_parameter(word));
        match idn {
            Idn::MDT_LENGTHS => self.layout.mdt_len = lengths(data),
            Idn::AT_LENGTHS => self.layout.at_len = lengths(data),
            Idn::CONTROL_OFFSET => self.device(address).device_control = place,
            Idn::STATUS_OFFSET => self.device(address).device_status = place,
            Idn::SVC_MDT_OFFSET => self.device(address).svc_mdt = place,
            Idn::SVC_AT_OFFSET => self.device(address).svc_at = place,
            Idn::COMMUNICATION_CONTROL => self.layout.extended = word & 1 << 2 != 0,
            _ if idn.block() == Idn::CONNECTION_BLOCK && !idn.is_product() => {
                let element = idn.element();
                self.connection(address, idn.instance(), |connection| match element {
                    connection::SETUP => connection.setup = ConnectionSetup::from_bits_retain(word),
                    connection::ASSIGNMENT => connection.assignment = Some(word),
                    connection::LIST => connection.idns = idns(data),
                    _ => {}
                });
            }
            _ => {}
        }
    }

    fn device(&mut self, address: u16) -> &mut DeviceLayout {
        let devices = &mut self.layout.devices;
        let index = match devices.iter().position(|device| device.address == address) {
            Some(index) => index,
            None => {
                devices.push(DeviceLayout { address, ..DeviceLayout::default() });
                devices.len() - 1
            }
        };
        &mut devices[index]
    }

    /// Changes a connection and then brings the layout up to date.
    fn connection(&mut self, address: u16, index: u8, change: impl FnOnce(&mut Connection)) {
        if usize::from(index) >= CONNECTIONS_MAX {
            return;
        }
        change(self.connections.entry((address, index)).or_default());
        let places =
            self.connections.range((address, 0)..=(address, u8::MAX)).filter_map(|(key, connection)| {
                let (kind, at) = Offset::from_assignment(connection.assignment?);
                let len = connection.len.filter(|&len| len >= 2)?;
                let active = connection.setup.contains(ConnectionSetup::ACTIVE);
                active.then_some(ConnectionLayout { index: key.1, kind, at, len })
            });
        let places: Vec<_> = places.collect();
        self.device(address).connections = places;
    }

    /// Length of a parameter's data in bytes, from its attribute or from the caller.
    pub(super) fn length(&self, idn: Idn) -> Option<usize> {
        match (idn, idn.block(), idn.element()) {
            (Idn::DRIVE_CONTROL | Idn::DRIVE_STATUS, ..) => Some(2),
            (_, Idn::CONNECTION_BLOCK, 1 | 2 | 3 | 4 | 5 | 8 | 11 | 12) => Some(2),
            _ => self
                .attribute(idn)
                .filter(|attribute| !attribute.is_list())
                .map(|attribute| usize::from(attribute.item_length().bytes()))
                .or_else(|| self.names.length(idn)),
        }
    }

    /// Whether the parts of telegrams of `kind` can be distinguished at all.
    pub(super) fn knows(&self, kind: Kind) -> bool {
        match kind {
            Kind::Mdt => self.layout.mdt_len[0] != 0,
            Kind::At => self.layout.at_len[0] != 0,
        }
    }
}

/// Whether a slave has answered the step that the master has ordered last.
fn is_answer(status: SvcStatus, control: SvcControl) -> bool {
    status.contains(SvcStatus::VALID)
        && !status.contains(SvcStatus::BUSY)
        && status.contains(SvcStatus::AHS) == control.mhs()
}

pub(super) fn low_word(info: u32) -> u16 {
    let [low, high, _, _] = info.to_le_bytes();
    u16::from_le_bytes([low, high])
}

/// The data of a list without its head, cut to the length in the head.
fn items(data: &[u8]) -> &[u8] {
    let Some((head, rest)) = data.split_at_checked(LIST_HEAD_LEN) else { return &[] };
    let len = usize::from(u16::from_le_bytes([head[0], head[1]]));
    &rest[..len.min(rest.len())]
}

fn lengths(data: &[u8]) -> [u16; TELEGRAMS_MAX] {
    let mut lengths = [0; TELEGRAMS_MAX];
    for (length, bytes) in lengths.iter_mut().zip(items(data).chunks_exact(2)) {
        *length = u16::from_le_bytes([bytes[0], bytes[1]]);
    }
    lengths
}

fn idns(data: &[u8]) -> Vec<Idn> {
    items(data).chunks_exact(4).map(|b| Idn(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect()
}
