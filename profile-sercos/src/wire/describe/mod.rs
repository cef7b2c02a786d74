//! A frame as an indented tree for people.
//!
//! [`describe`] never fails: what cannot be read is said and shown as bytes. A [`DecodeContext`] carries what
//! the frames before have reported: the phase, the data block that is open at each slave, and the layout of CP3 and
//! CP4, which the master writes over the service channel in CP2.

mod context;

use core::fmt::{self, Write};

pub use context::{DecodeContext, Names, NoNames, Transfer};

use super::connection::ConnectionControl;
use super::cyclic::Part;
use super::data_status::DataStatus;
use super::device_control::DeviceControl;
use super::device_status::DeviceStatus;
use super::drive_words::{DriveControl, DriveStatus};
use super::header::{HEADER_LEN, Header, Kind, Phase};
use super::idn::Idn;
use super::layout::Layout;
use super::procedure::ProcedureControl;
use super::slot::SvcSlot;
use super::svc::{Element, ListHead, SvcControl, SvcStatus};
use super::svc_error::SvcError;
use super::telegram::{Body, Frame};
use super::{attribute::Attribute, cp0, cp12, cyclic};
use context::low_word;

/// The frame as text: one line for the header, indented lines for what it carries.
pub fn describe(frame: &[u8], context: &mut DecodeContext<'_>) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_frame(&mut text, frame, context);
    text
}

/// Takes in a frame without printing it: addresses of slaves, and what the service channels carry.
pub fn follow(frame: &[u8], context: &mut DecodeContext<'_>) {
    let Ok(header) = Header::parse(frame) else { return };
    let phase = context.tracker.layout_phase(&header);
    context.enter(phase);
    let kind = header.telegram.kind();
    if matches!(phase, Phase::CP3 | Phase::CP4) {
        context.follow_channels(kind, header.telegram.number(), &frame[HEADER_LEN..]);
        return;
    }
    match Frame::parse_body(header, frame, phase, &Layout::unknown()).map(|frame| frame.body) {
        Ok(Body::Cp0At(repr)) => {
            for (topology, field) in repr.slaves() {
                context.note_address(topology, field.address());
            }
        }
        Ok(Body::Cp12(repr)) if phase == Phase::CP2 => {
            for (address, slot) in repr.active(header.telegram.number()) {
                context.take_slot(kind, address, slot.svc);
            }
        }
        _ => {}
    }
}

fn write_frame(out: &mut String, frame: &[u8], context: &mut DecodeContext<'_>) -> fmt::Result {
    let header = match Header::parse_unchecked(frame) {
        Ok(header) => header,
        Err(error) => return writeln!(out, "no SERCOS frame: {error}"),
    };
    let crc = match Header::parse(frame) {
        Ok(_) => "CRC ok",
        Err(_) => "CRC BAD",
    };
    writeln!(out, "{header}, {} bytes, {crc}", frame.len())?;
    if crc != "CRC ok" {
        return writeln!(out, "  not read further: no station takes this frame");
    }
    let phase = context.tracker.layout_phase(&header);
    context.enter(phase);
    let kind = header.telegram.kind();
    let layout = if context.knows(kind) { context.layout().clone() } else { Layout::unknown() };
    match Frame::parse_body(header, frame, phase, &layout) {
        Ok(parsed) => {
            write_body(out, kind, header.telegram.number(), phase, &parsed.body, context)?;
            if parsed.trailer.is_empty() {
                Ok(())
            } else {
                writeln!(out, "  trailer {}", Hex(parsed.trailer))
            }
        }
        Err(error) => writeln!(out, "  not readable: {error}"),
    }
}

fn write_body(
    out: &mut String,
    kind: Kind,
    number: u8,
    phase: Phase,
    body: &Body<'_>,
    context: &mut DecodeContext<'_>,
) -> fmt::Result {
    match body {
        Body::Cp0Mdt(repr) => write_scan(out, repr),
        Body::Cp0At(repr) => write_addresses(out, repr),
        Body::Cp12(repr) => write_slots(out, kind, number, phase, repr, context),
        Body::Cyclic(repr) => write_cyclic(out, kind, repr, context),
    }
}

fn write_scan(out: &mut String, repr: &cp0::MdtRepr) -> fmt::Result {
    writeln!(out, "  communication version {}", repr.version)?;
    if repr.version.contains(cp0::CommunicationVersion::TIMES) {
        writeln!(out, "  t1 {} ns, t6 {} ns, t7 {} ns", repr.t1_ns, repr.t6_ns, repr.t7_ns)?;
    }
    Ok(())
}

fn write_addresses(out: &mut String, repr: &cp0::AtRepr) -> fmt::Result {
    let channel = if repr.counter.secondary() { ", S channel" } else { "" };
    writeln!(out, "  sequence counter {}{channel}", repr.counter.count())?;
    for (topology, field) in repr.slaves() {
        let acknowledged = if field.acknowledged() { ", acknowledges the version" } else { "" };
        let address = field.address().unwrap_or(0);
        writeln!(out, "  topology address {topology}: SERCOS address {address}{acknowledged}")?;
    }
    Ok(())
}

fn write_slots(
    out: &mut String,
    kind: Kind,
    number: u8,
    phase: Phase,
    repr: &cp12::Repr,
    context: &mut DecodeContext<'_>,
) -> fmt::Result {
    for (address, slot) in repr.active(number) {
        writeln!(out, "  slave {address}")?;
        if phase == Phase::CP2 {
            write_svc(out, kind, address, slot.svc, context)?;
        } else {
            writeln!(out, "    {}", RawSvc(kind, slot.svc))?;
        }
        write_device_word(out, kind, slot.device)?;
        if slot.reserved != 0 {
            writeln!(out, "    reserved {:#06x}", slot.reserved)?;
        }
    }
    Ok(())
}

// Flat: one arm per part of the telegram.
fn write_cyclic(
    out: &mut String,
    kind: Kind,
    repr: &cyclic::Repr<'_>,
    context: &mut DecodeContext<'_>,
) -> fmt::Result {
    if !context.knows(kind) {
        writeln!(out, "  layout unknown: CP2 is not in what came before")?;
    }
    for part in &repr.parts {
        match *part {
            Part::HotPlug(field) => writeln!(out, "  hot-plug {field}")?,
            Part::Extended(field) => writeln!(out, "  extended {field}")?,
            Part::Svc { address, slot } => {
                writeln!(out, "  slave {address}")?;
                write_svc(out, kind, address, slot, context)?;
            }
            Part::DeviceWord { address, word } => {
                writeln!(out, "  slave {address}")?;
                write_device_word(out, kind, word)?;
            }
            Part::Connection { address, index, control, data } => {
                let control = ConnectionControl::from_bits_retain(control);
                writeln!(out, "  slave {address} connection {index}: {control}")?;
                write_values(out, address, index, data, context)?;
            }
            Part::Gap(bytes) if bytes.iter().all(|&byte| byte == 0) => {}
            Part::Gap(bytes) => writeln!(out, "  {}", Hex(bytes))?,
        }
    }
    Ok(())
}

fn write_device_word(out: &mut String, kind: Kind, word: u16) -> fmt::Result {
    match kind {
        Kind::Mdt => writeln!(out, "    C-DEV {}", DeviceControl::from_bits_retain(word)),
        Kind::At => writeln!(out, "    S-DEV {}", DeviceStatus::from_bits_retain(word)),
    }
}

fn write_svc(
    out: &mut String,
    kind: Kind,
    address: u16,
    slot: SvcSlot,
    context: &mut DecodeContext<'_>,
) -> fmt::Result {
    let Some(new) = context.take_slot(kind, address, slot) else {
        return writeln!(out, "    S-SVC empty");
    };
    write!(out, "    {}", RawSvc(kind, slot))?;
    let channel = context.channel(address);
    let status = SvcStatus::from_bits_retain(slot.word);
    if kind == Kind::At && status.contains(SvcStatus::ERROR) {
        let code = low_word(slot.info);
        return writeln!(out, ": error {code:#06x} {}", SvcError(code));
    }
    let step = channel.and_then(|channel| Some((channel.control?, channel.open)));
    let (Some((control, open)), true) = (step, new) else { return writeln!(out) };
    match open {
        Some(idn) => write!(out, ": {}", Named(idn, context))?,
        None => write!(out, ": no data block")?,
    }
    let first = channel.is_some_and(|channel| channel.part == 0);
    write_info(out, kind, control, open, slot.info, first, context)?;
    writeln!(out)
}

/// What the INFO of a step means.
// Flat: one arm per element and direction.
fn write_info(
    out: &mut String,
    kind: Kind,
    control: SvcControl,
    open: Option<Idn>,
    info: u32,
    first: bool,
    context: &DecodeContext<'_>,
) -> fmt::Result {
    let command = open.is_some_and(|idn| context.is_command(idn));
    let carries = kind == Kind::At || control.write();
    match (control.element(), kind) {
        (Element::Close, _) => write!(out, ", close"),
        (Element::Idn, Kind::Mdt) => write!(out, ", open"),
        (Element::Idn, Kind::At) => {
            let status = DataStatus::from_bits_retain(low_word(info));
            let state =
                if command { format!("{}", status.command_state()) } else { validity(status).to_owned() };
            write!(out, ", opened, data status {:#06x} ({state})", status.bits())
        }
        (element, Kind::At) if control.write() => write!(out, ", {element} written"),
        (element, _) if !carries => write!(out, ", read {element}"),
        (Element::Attribute, _) => write!(out, ", attribute {info:#010x} ({})", Attribute(info)),
        (element, _) => {
            write!(out, ", {element} ")?;
            let text = matches!(element, Element::Name | Element::Unit);
            let attribute = open.and_then(|idn| context.attribute(idn));
            let list = text || attribute.map_or(!control.last(), |attribute| attribute.is_list());
            if list && first && !control.last() {
                write!(out, "{}", ListHead::from_info(info))
            } else if text {
                write!(out, "{:?}", String::from_utf8_lossy(&info.to_le_bytes()).trim_end_matches('\0'))
            } else if command && kind == Kind::Mdt {
                write_command(out, low_word(info))
            } else {
                let two = open.and_then(|idn| context.length(idn)) == Some(2);
                let value = if two { u32::from(low_word(info)) } else { info };
                write!(out, "{value:#x} ({value})")
            }
        }
    }
}

/// The control word of a procedure command.
fn write_command(out: &mut String, word: u16) -> fmt::Result {
    let meaning = match ProcedureControl::from_bits_retain(word) {
        ProcedureControl::EXECUTE => "set and start",
        ProcedureControl::INTERRUPT => "interrupt",
        ProcedureControl::CANCEL => "cancel",
        _ => "undefined",
    };
    write!(out, "{word:#06x} ({meaning})")
}

fn validity(status: DataStatus) -> &'static str {
    if status.is_valid() { "valid" } else { "invalid" }
}

/// The values of a connection by name, as far as their lengths are known; the rest as bytes.
fn write_values(
    out: &mut String,
    address: u16,
    index: u8,
    data: &[u8],
    context: &DecodeContext<'_>,
) -> fmt::Result {
    let mut rest = data;
    let idns = context.connection_idns(address, index);
    for (at, &idn) in idns.iter().enumerate() {
        let last = at + 1 == idns.len();
        let Some(len) = context.length(idn).or(last.then_some(rest.len())) else { break };
        let Some((bytes, after)) = rest.split_at_checked(len) else { break };
        rest = after;
        write!(out, "    {} = ", Named(idn, context))?;
        write_value(out, idn, bytes)?;
    }
    if rest.is_empty() { Ok(()) } else { writeln!(out, "    {}", Hex(rest)) }
}

fn write_value(out: &mut String, idn: Idn, bytes: &[u8]) -> fmt::Result {
    match (idn, bytes) {
        (Idn::DRIVE_CONTROL, &[low, high]) => {
            let word = DriveControl::from_bits_retain(u16::from_le_bytes([low, high]));
            let on = |bit, name: &'static str| if word.contains(bit) { name } else { "" };
            let words = [
                on(DriveControl::ON, " on"),
                on(DriveControl::ENABLE, " enable"),
                on(DriveControl::RESTART, " follow"),
            ];
            writeln!(out, "{:#06x}{}, mode {}", word.bits(), words.concat(), word.mode())
        }
        (Idn::DRIVE_STATUS, &[low, high]) => {
            let word = DriveStatus::from_bits_retain(u16::from_le_bytes([low, high]));
            writeln!(out, "{:#06x} {word}", word.bits())
        }
        (_, &[low, high]) => writeln!(out, "{}", i16::from_le_bytes([low, high])),
        (_, &[a, b, c, d]) => writeln!(out, "{}", i32::from_le_bytes([a, b, c, d])),
        _ => writeln!(out, "{}", Hex(bytes)),
    }
}

/// An IDN with its name, where the caller knows one.
struct Named<'a, 'n>(Idn, &'a DecodeContext<'n>);

impl fmt::Display for Named<'_, '_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)?;
        match self.1.names.name(self.0) {
            Some(name) => write!(f, " {name}"),
            None => Ok(()),
        }
    }
}

/// Control or status word of a slot and its INFO, without the step's meaning.
struct RawSvc(Kind, SvcSlot);

impl fmt::Display for RawSvc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SvcSlot { word, info } = self.1;
        match self.0 {
            Kind::Mdt => write!(f, "C-SVC {} INFO {info:#010x}", SvcControl(word)),
            Kind::At => {
                let status = SvcStatus::from_bits_retain(word);
                let flag = |bit, name: &'static str| if status.contains(bit) { name } else { "" };
                write!(
                    f,
                    "S-SVC AHS={}{}{}{} INFO {info:#010x}",
                    u8::from(status.contains(SvcStatus::AHS)),
                    flag(SvcStatus::VALID, " valid"),
                    flag(SvcStatus::BUSY, " busy"),
                    flag(SvcStatus::ERROR, " error"),
                )
            }
        }
    }
}

/// Bytes in hexadecimal.
struct Hex<'a>(&'a [u8]);

impl fmt::Display for Hex<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes:", self.0.len())?;
        self.0.iter().try_for_each(|byte| write!(f, " {byte:02x}"))
    }
}
