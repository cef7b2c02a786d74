//! The Ethernet port of the bench: simulated drives on SERCOS III, of which it replaces what they say and hears what they are told.
//!
//! The drives underneath keep the bus in CP4 and answer the service channel. They get the telegrams without the word that would
//! switch them on, so that no command of a list moves or trips them.

use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;
use profile_sercos::wire::connection::{CONNECTION_CONTROL_LEN, ConnectionControl};
use profile_sercos::wire::header::{HEADER_LEN, Header, Kind, Phase};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::layout::{Layout, Offset};
use profile_sercos::wire::svc::{Element, MdtSvc, SVC_LEN};

use super::Peer;
use crate::config::{Config, Sercos};
use crate::engine::bus::sercos::{COMMAND_CONNECTION, FEEDBACK_CONNECTION};
use crate::engine::port::{EthernetPort, FRAME_MAX};
use crate::mapping::Item;
use crate::simulate::drives::InProcessDrives;

/// Bytes of the master control word, the first value of every telegram to a drive.
const CONTROL_LEN: usize = 2;

/// A drive on the bus.
#[derive(Debug)]
struct Drive {
    axis: usize,
    /// Place among the simulated drives.
    slave: usize,
    /// Connection to it and from it: where they begin, and their bytes with C-CON.
    command: Option<(Offset, usize)>,
    feedback: Option<(Offset, usize)>,
    svc: Option<Offset>,
    channel: Channel,
}

/// The service channel to a drive, as far as it is needed to hear what is written.
#[derive(Debug, Default)]
struct Channel {
    mhs: Option<bool>,
    idn: Option<Idn>,
    data: Vec<u8>,
}

impl Channel {
    /// Takes the six bytes of a telegram; what has been written to the end with it.
    fn hear(&mut self, bytes: &[u8]) -> Option<(Idn, Vec<u8>)> {
        let MdtSvc { control, info } = MdtSvc::parse(bytes).ok()?;
        if self.mhs.replace(control.mhs()) == Some(control.mhs()) {
            return None;
        }
        match control.element() {
            Element::Idn if control.write() => {
                (self.idn, self.data) = (Some(Idn(info)), Vec::new());
                None
            }
            Element::Data if control.write() => {
                self.data.extend(info.to_le_bytes());
                control
                    .last()
                    .then(|| std::mem::take(&mut self.data))
                    .and_then(|data| Some((self.idn?, data)))
            }
            _ => None,
        }
    }
}

/// The port.
#[derive(Debug)]
pub(super) struct Tap {
    drives: InProcessDrives,
    known: Vec<Drive>,
    /// Names of the drives, in the order of the simulated ones.
    names: Vec<String>,
    /// Operation data that a drive holds in place of its own, by its place.
    held: Vec<(usize, Idn, i64)>,
    /// Peers of the axes of the box, by their numbers.
    pub peers: Vec<Peer>,
}

impl Tap {
    pub fn new(config: &Config, sercos: &Sercos, axes: usize) -> Self {
        Self {
            drives: InProcessDrives::of(config, sercos, None),
            known: Vec::new(),
            names: sercos.drives.iter().map(|drive| drive.name.clone()).collect(),
            held: Vec::new(),
            peers: (0..axes).map(|_| Peer::default()).collect(),
        }
    }

    /// The bus is in CP4: where each axis has its drive, by its place among them and its topology address.
    pub fn learn(&mut self, layout: &Layout, drives: impl Iterator<Item = (usize, usize, u16)>) {
        self.known.clear();
        for (axis, slave, topology) in drives {
            let Some(device) = layout.devices.iter().find(|device| device.address == topology) else {
                continue;
            };
            let of = |index, kind| {
                let found =
                    device.connections.iter().find(|place| (place.index, place.kind) == (index, kind));
                found.map(|place| (place.at, usize::from(place.len)))
            };
            self.known.push(Drive {
                axis,
                slave,
                command: of(COMMAND_CONNECTION, Kind::Mdt),
                feedback: of(FEEDBACK_CONNECTION, Kind::At),
                svc: device.svc_mdt,
                channel: Channel::default(),
            });
        }
    }

    /// The drives are commissioned. From now on their motors do not matter: what the drives send is replaced.
    pub fn pause_drives(&mut self) {
        let slaves = self.drives.network_mut().slaves_mut();
        slaves.iter_mut().for_each(|slave| slave.application_mut().set_paused(true));
    }

    /// The drive of an axis holds this in place of its own operation data.
    pub fn hold(&mut self, axis: usize, idn: Idn, value: i64) {
        let Some(slave) = self.known.iter().find(|drive| drive.axis == axis).map(|drive| drive.slave) else {
            return;
        };
        self.hold_at(slave, idn, value);
    }

    /// The same before it is known which axis has the drive, until [`Self::release`].
    pub fn commission_with(&mut self, drive: &str, idn: Idn, bytes: &[u8]) {
        if let Some(slave) = self.names.iter().position(|name| name == drive) {
            let mut value = [0; 8];
            value.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
            self.hold_at(slave, idn, i64::from_le_bytes(value));
        }
    }

    fn hold_at(&mut self, slave: usize, idn: Idn, value: i64) {
        self.held.retain(|(known, of, _)| (*known, *of) != (slave, idn));
        self.held.push((slave, idn, value));
    }

    /// The operation data that the drive of an axis holds; `None` of a drive without the parameter.
    pub fn kept(&mut self, axis: usize, idn: Idn) -> Option<i64> {
        let slave = self.known.iter().find(|drive| drive.axis == axis)?.slave;
        let store = self.drives.network_mut().slaves().get(slave)?.store();
        store.find(idn).map(|handle| store.number(handle))
    }

    /// Drives hold what they have themselves.
    pub fn release(&mut self) {
        self.held.clear();
    }
}

/// The telegram that a frame is, in CP4.
fn telegram(frame: &[u8]) -> Option<(Kind, u8)> {
    let header = Header::parse(frame).ok()?;
    (header.phase.phase() == Phase::CP4).then(|| (header.telegram.kind(), header.telegram.number()))
}

/// The bytes of a part of a telegram.
fn part(frame: &mut [u8], place: Option<(Offset, usize)>, number: u8) -> Option<&mut [u8]> {
    let (at, len) = place.filter(|(at, _)| at.telegram == number)?;
    frame.get_mut(HEADER_LEN..)?.get_mut(at.range(len))
}

impl EthernetPort for Tap {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        let (port, len) = self.drives.receive(buffer)?;
        if let Some(frame) = buffer.get_mut(..len)
            && let Some((Kind::At, number)) = telegram(frame)
        {
            for drive in &self.known {
                let Some(bytes) = part(frame, drive.feedback, number) else { continue };
                let values = bytes.get_mut(CONNECTION_CONTROL_LEN..).unwrap_or_default();
                self.peers[drive.axis].show(values);
            }
        }
        Some((port, len))
    }

    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        let mut buffer = [0; FRAME_MAX];
        let Some(copy) = buffer.get_mut(..frame.len()) else { return false };
        copy.copy_from_slice(frame);
        if let Some((Kind::Mdt, number)) = telegram(copy) {
            for drive in &mut self.known {
                let peer = &mut self.peers[drive.axis];
                if let Some(bytes) = part(copy, drive.svc.map(|at| (at, SVC_LEN)), number)
                    && let Some((idn, data)) = drive.channel.hear(bytes)
                {
                    peer.written.push((Item::Idn(idn), data));
                }
                let Some(bytes) = part(copy, drive.command, number) else { continue };
                let (control, values) = bytes.split_at_mut(CONNECTION_CONTROL_LEN.min(bytes.len()));
                let control = control.first_chunk().map_or(0, |word| u16::from_le_bytes(*word));
                if ConnectionControl::from_bits_retain(control).contains(ConnectionControl::READY) {
                    peer.hear(now, values);
                }
                values.iter_mut().take(CONTROL_LEN).for_each(|byte| *byte = 0);
            }
        }
        // A drive works out many of its values in every cycle.
        for (slave, idn, value) in &self.held {
            if let Some(slave) = self.drives.network_mut().slaves_mut().get_mut(*slave) {
                slave.preset(*idn, *value);
            }
        }
        self.drives.send(now, port, copy)
    }
}
