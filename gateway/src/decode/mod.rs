//! Prints a recording as an indented tree, frame by frame: EtherNet/IP with CIP and CIP Motion, SERCOS III, CANopen and DeviceNet.
//!
//! A frame is understood with what came before it: TCP streams are put together, class-1 data are known by
//! the Forward_Open that opened their connection, SERCOS telegrams by the layout that the master wrote over
//! the service channel, CANopen PDOs by the mapping that it wrote by SDO, I/O messages of DeviceNet by the sizes of their
//! connections. So every frame is read, also those that are not printed; none is kept.

mod canopen;
mod connections;
mod devicenet;
pub(crate) mod dialogue;
mod ethernet_ip;
mod explicit;
pub(crate) mod packet;
pub mod record;
mod stream;
mod text;

use std::io::{self, Read, Write};
use std::net::Ipv4Addr;

use profile_sercos::wire::describe::{DecodeContext, Names, describe, follow};
use thiserror::Error;

use crate::capture::Side;
use crate::capture::can::{self, LINK_TYPE_CAN, Record};
use crate::capture::can_bus::{CanBuses, CanProtocol};
use crate::capture::reader::{Frame, LINK_TYPE_ETHERNET, ReadError, Reader};
use crate::sys::clock::KernelTime;
use crate::translate::fact::number_of;

use canopen::Canopen;
use devicenet::Devicenet;
use ethernet_ip::EtherNetIp;
use packet::{Packet, is_io};
use record::DecodeRecord;
use text::Text;

/// SERCOS buses, and CAN buses, distinguished by the interface they were recorded on; frames of further ones share the last
/// place.
const BUSES_MAX: usize = 8;

/// One of the protocols that can be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// EtherNet/IP, CIP, CIP Motion.
    EtherNetIp,
    /// SERCOS III.
    Sercos,
    /// CAN, and CANopen or DeviceNet on it.
    Can,
    /// Everything else; one line reports what it is.
    Other,
}

/// What to print.
#[derive(Debug, Clone)]
pub struct Options {
    /// Number of the first frame to print, from 1.
    pub first: u64,
    /// Number of the last frame to print; reading ends there.
    pub last: u64,
    /// Print only this protocol.
    pub only: Option<Protocol>,
    /// Print no more lines than this.
    pub lines_max: u64,
    /// In which form.
    pub format: Format,
    /// What is known of its CAN buses; one that nothing is known of is read as CANopen, and the tree says so.
    pub can: CanBuses,
}

impl Default for Options {
    /// Everything.
    fn default() -> Self {
        let (format, can) = (Format::Text, CanBuses::default());
        Self { first: 1, last: u64::MAX, only: None, lines_max: u64::MAX, format, can }
    }
}

/// The form in which frames are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// One JSON document.
    Json,
    /// One JSON object a line.
    Ndjson,
}

/// What was read and printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Frames read.
    pub frames: u64,
    /// Frames printed.
    pub printed: u64,
    /// Whether printing ended because of [`Options::lines_max`].
    pub cut: bool,
}

/// Why decoding ended.
#[derive(Debug, Error)]
pub enum DecodeError {
    /// The recording cannot be read on.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The text cannot be written.
    #[error("cannot write: {0}")]
    Write(#[source] io::Error),
}

/// Reads a recording to its end, or the last frame asked for, and prints it.
///
/// `names` gives the names and lengths of SERCOS parameters.
///
/// # Errors
/// [`DecodeError`]; what came before has been printed.
pub fn decode<R: Read>(
    mut reader: Reader<R>,
    options: &Options,
    names: &dyn Names,
    out: &mut dyn Write,
) -> Result<Summary, DecodeError> {
    let mut decoder = Decoder { can: options.can.clone(), ..Decoder::new(names) };
    let mut summary = Summary::default();
    if options.format == Format::Json {
        write!(out, "{{\"schema\":{},\"frames\":[", record::SCHEMA).map_err(DecodeError::Write)?;
    }
    let read = frames(&mut reader, options, &mut decoder, out, &mut summary);
    if options.format == Format::Json {
        writeln!(out, "]}}").map_err(DecodeError::Write)?;
    }
    read.map(|()| summary)
}

/// Prints frame after frame.
fn frames<R: Read>(
    reader: &mut Reader<R>,
    options: &Options,
    decoder: &mut Decoder<'_>,
    out: &mut dyn Write,
    summary: &mut Summary,
) -> Result<(), DecodeError> {
    let mut lines_left = options.lines_max;
    while let Some(frame) = reader.next_frame()? {
        if frame.number > options.last {
            break;
        }
        summary.frames = frame.number;
        let protocol = decoder.frame(&frame);
        let wanted = options.only.is_none_or(|only| only == protocol);
        if frame.number < options.first || !wanted {
            continue;
        }
        if lines_left == 0 {
            summary.cut = true;
            break;
        }
        summary.printed += 1;
        if options.format != Format::Text {
            let separator = if options.format == Format::Json && summary.printed > 1 { ",\n" } else { "" };
            let record = DecodeRecord::new(&frame, decoder.since(&frame), protocol, decoder.text.as_str());
            let line = serde_json::to_string(&record).map_err(|error| DecodeError::Write(error.into()))?;
            let end = if options.format == Format::Ndjson { "\n" } else { "" };
            write!(out, "{separator}{line}{end}").map_err(DecodeError::Write)?;
            continue;
        }
        for line in decoder.text.as_str().lines() {
            if lines_left == 0 {
                summary.cut = true;
                break;
            }
            writeln!(out, "{line}").map_err(DecodeError::Write)?;
            lines_left -= 1;
        }
    }
    Ok(())
}

/// What is known of a CAN bus.
enum CanBus {
    Canopen(Canopen),
    Devicenet(Devicenet),
}

impl CanBus {
    fn new(protocol: CanProtocol) -> Self {
        match protocol {
            CanProtocol::Canopen => Self::Canopen(Canopen::default()),
            CanProtocol::Devicenet => Self::Devicenet(Devicenet::default()),
        }
    }
}

/// What is known of a recording so far.
pub(crate) struct Decoder<'n> {
    names: &'n dyn Names,
    /// By interface; `None` for the ports of this box.
    buses: Vec<(Option<u32>, DecodeContext<'n>)>,
    can: CanBuses,
    /// By interface.
    can_buses: Vec<(u32, CanBus)>,
    /// The section whose interfaces they are.
    section: u64,
    ethernet_ip: EtherNetIp,
    start: Option<KernelTime>,
    text: Text,
}

impl<'n> Decoder<'n> {
    pub(crate) fn new(names: &'n dyn Names) -> Self {
        Self {
            names,
            buses: Vec::new(),
            can: CanBuses::default(),
            can_buses: Vec::new(),
            section: 0,
            ethernet_ip: EtherNetIp::default(),
            start: None,
            text: Text::default(),
        }
    }

    /// The connection whose data a datagram has: the address of its target, and whether it is one of CIP Motion. `None`
    /// when the recording has not shown how it was opened.
    pub(crate) fn connection(&self, id: u32, from: Ipv4Addr, to: Ipv4Addr) -> Option<(Ipv4Addr, bool)> {
        self.ethernet_ip.connection(id, from, to)
    }

    /// Takes in an Ethernet frame without printing it: connections that are opened, and what SERCOS service channels carry.
    pub(crate) fn follow(&mut self, frame: &Frame<'_>, packet: &Packet<'_>) {
        match packet {
            Packet::Sercos => follow(frame.data, self.bus(frame)),
            // Cyclic data change nothing of what is known.
            Packet::Udp { from, to, .. } if is_io(*from, *to) => {}
            Packet::Udp { from, to, payload } => {
                self.text.clear();
                self.ethernet_ip.datagram(*from, *to, payload, &mut self.text);
            }
            Packet::Tcp(segment) => {
                self.text.clear();
                self.ethernet_ip.segment(segment, &mut self.text);
            }
            Packet::CutUdp { .. } | Packet::Other(_) => {}
        }
    }

    /// Reads a frame and leaves its tree in `self.text`.
    pub(crate) fn frame(&mut self, frame: &Frame<'_>) -> Protocol {
        self.text.clear();
        self.heading(frame);
        if frame.link_type == LINK_TYPE_CAN {
            self.can(frame);
            return Protocol::Can;
        }
        if frame.link_type != LINK_TYPE_ETHERNET {
            self.text.append(format_args!("link type {} is neither Ethernet nor CAN", frame.link_type));
            return Protocol::Other;
        }
        let protocol = match packet::parse(frame.data) {
            Packet::Sercos => {
                self.text.append(format_args!("SERCOS III"));
                self.comment(frame);
                let tree = describe(frame.data, self.bus(frame));
                self.text.block(1, &tree);
                Protocol::Sercos
            }
            Packet::Udp { from, to, payload } => {
                self.text.append(format_args!("UDP {from} -> {to}"));
                self.comment(frame);
                self.ethernet_ip.datagram(from, to, payload, &mut self.text)
            }
            Packet::Tcp(segment) => {
                self.text.append(format_args!("TCP {} -> {}", segment.from, segment.to));
                self.comment(frame);
                self.ethernet_ip.segment(&segment, &mut self.text)
            }
            Packet::Other(what) | Packet::CutUdp { what, .. } => {
                self.text.append(format_args!("{what}"));
                self.comment(frame);
                Protocol::Other
            }
        };
        if let Some(cut) = frame.cut() {
            self.text.line(1, format_args!("{cut}"));
        }
        protocol
    }

    fn can(&mut self, frame: &Frame<'_>) {
        let record = can::parse(frame.data);
        match &record {
            Ok(record) => self.text.append(format_args!("CAN {record}")),
            Err(error) => self.text.append(format_args!("CAN, not readable: {error}")),
        }
        self.comment(frame);
        let Ok(Record::Frame(content)) = record else { return };
        self.enter(frame);
        let known = self.can_buses.iter().position(|(interface, _)| *interface == frame.interface);
        let index = known.unwrap_or_else(|| {
            let protocol = self.can.find(frame).map(|bus| bus.protocol);
            if protocol.is_none() {
                self.text.line(1, format_args!("nothing tells what runs on this bus: read as CANopen"));
            }
            if self.can_buses.len() < BUSES_MAX {
                self.can_buses.push((frame.interface, CanBus::new(protocol.unwrap_or(CanProtocol::Canopen))));
            }
            self.can_buses.len() - 1
        });
        match &mut self.can_buses[index].1 {
            CanBus::Canopen(bus) => bus.frame(&content, &mut self.text),
            CanBus::Devicenet(bus) => bus.frame(&content, &mut self.text),
        }
    }

    /// Forgets the interfaces of the section before: their numbers begin anew.
    fn enter(&mut self, frame: &Frame<'_>) {
        if std::mem::replace(&mut self.section, frame.section) != frame.section {
            self.buses.retain(|(interface, _)| interface.is_none());
            self.can_buses.clear();
        }
    }

    /// Seconds since the first frame.
    fn since(&self, frame: &Frame<'_>) -> Option<f64> {
        let since = i128::from(frame.at?.0) - i128::from(self.start?.0);
        Some(number_of(i64::try_from(since).unwrap_or(i64::MAX)) / 1e9)
    }

    fn heading(&mut self, frame: &Frame<'_>) {
        self.text.line(0, format_args!("frame {}", frame.number));
        if let Some(at) = frame.at {
            let start = self.start.get_or_insert(at).0;
            let since = at.0.abs_diff(start);
            let sign = if at.0 < start { "-" } else { "" };
            let (seconds, rest) = (since / 1_000_000_000, since % 1_000_000_000);
            self.text.append(format_args!("at {sign}{seconds}.{rest:09} s"));
        }
        if let Some(name) = frame.interface_name {
            self.text.append(format_args!("on {}", name.escape_debug()));
        }
        self.text.append(format_args!("{} bytes:", frame.original_len));
    }

    fn comment(&mut self, frame: &Frame<'_>) {
        if let Some(comment) = frame.comment {
            self.text.line(1, format_args!("comment: {}", comment.escape_debug()));
        }
    }

    /// What is known of the bus of a frame. The two ports of this box are on the same one; each interface of another
    /// recorder is taken for a bus of its own.
    pub(crate) fn bus(&mut self, frame: &Frame<'_>) -> &mut DecodeContext<'n> {
        self.enter(frame);
        let own = frame.interface_name.and_then(Side::of_name).is_some();
        let bus = (!own).then_some(frame.interface);
        let known = self.buses.iter().position(|(other, _)| *other == bus);
        let index = known.unwrap_or_else(|| {
            if self.buses.len() < BUSES_MAX {
                self.buses.push((bus, DecodeContext::new(self.names)));
            }
            self.buses.len() - 1
        });
        &mut self.buses[index].1
    }
}

#[cfg(test)]
pub(crate) mod tests;
