//! tshark as an independent reader of CAN frames written here, and of what CANopen has in them.

use std::collections::BTreeMap;
use std::process::Command;

use profile_cia402::drive::ErrorCode;
use profile_cia402::wire::emcy::{Emcy, ErrorRegister};
use profile_cia402::wire::error_control::Heartbeat;
use profile_cia402::wire::lss::{LssMode, LssRequest, Part};
use profile_cia402::wire::nmt::{Nmt, NmtCommand, NmtState};
use profile_cia402::wire::sdo::{Abort, SdoRequest, SdoResponse, Segment, Transfer};
use profile_cia402::wire::sync::Sync;
use profile_cia402::wire::time::TimeOfDay;
use profile_cia402::wire::{AbortCode, Bytes, Mux, NodeId};
use profile_generic::can::{Frame, Id};

use super::writer::Writer;
use crate::sys::clock::KernelTime;

const FIELDS: [&str; 29] = [
    "frame.interface_name",
    "frame.time_epoch",
    "frame.protocols",
    "can.id",
    "can.len",
    "can.flags.xtd",
    "can.flags.rtr",
    "canopen.function_code",
    "canopen.node_id",
    "canopen.nmt_ctrl.cd",
    "canopen.nmt_ctrl.node_id",
    "canopen.nmt_guard.state",
    "canopen.sync.counter",
    "canopen.em.err_code",
    "canopen.em.err_reg",
    "canopen.em.err_field",
    "canopen.sdo.ccs",
    "canopen.sdo.scs",
    "canopen.sdo.main_idx",
    "canopen.sdo.sub_idx",
    "canopen.sdo.abort_code",
    "canopen.sdo.toggle",
    "canopen.lss.cs",
    "canopen.lss.switch.mode",
    "canopen.lss.addr.serial",
    "canopen.time_stamp_ms",
    "canopen.time_stamp_days",
    "canopen.pdo.data.bytes",
    "_ws.malformed",
];

/// Dissects frames written to a file on bus 1; `None` when tshark is not installed.
fn dissect(name: &str, frames: &[Frame]) -> Option<Vec<BTreeMap<&'static str, String>>> {
    let path = std::env::temp_dir().join(format!("axisbridge-tshark-{name}-{}.pcapng", std::process::id()));
    let file = std::fs::File::create(&path).unwrap();
    let mut writer = Writer::new(file, ["north", "none", "none"], &["can0"]).unwrap();
    for (frame, time) in frames.iter().zip(1_800_000_000_000_000_123..) {
        writer.can_frame(0, KernelTime(time), frame, None).unwrap();
    }
    assert!(writer.can_frame(1, KernelTime(0), &frames[0], None).is_err(), "there is one bus");
    writer.finish().unwrap();
    let mut command = Command::new("tshark");
    command.args(["-n", "-d", "can.subdissector,canopen", "-r"]).arg(&path).args(["-T", "fields"]);
    for field in FIELDS {
        command.args(["-e", field]);
    }
    let lines = super::tshark_tests::columns(&mut command);
    std::fs::remove_file(&path).unwrap();
    Some(lines?.into_iter().map(|line| FIELDS.into_iter().zip(line).collect()).collect())
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(Id::Standard(id), data).unwrap()
}

#[test]
fn frames_of_every_kind_are_read() {
    let frames = [
        frame(0x181, &[0x27, 6, 0]),
        Frame::new(Id::Extended(0x1234_5678), &[1; 8]).unwrap(),
        Frame::remote(Id::Standard(0x701), 1).unwrap(),
        Frame::fd(Id::Standard(0x182), &[5; 12], true).unwrap(),
    ];
    let Some(lines) = dissect("can", &frames) else { return };
    let column = |name: &str| lines.iter().map(|line| line[name].as_str()).collect::<Vec<_>>();
    assert_eq!(column("frame.interface_name"), ["can bus 1"; 4]);
    assert_eq!(column("frame.time_epoch")[..2], ["1800000000.000000123", "1800000000.000000124"]);
    assert_eq!(column("can.len"), ["3", "8", "1", "12"]);
    let id = |line: &BTreeMap<_, String>| line["can.id"].parse().unwrap_or_else(|_| hex(&line["can.id"]));
    assert_eq!(lines.iter().map(id).collect::<Vec<u32>>(), [0x181, 0x1234_5678, 0x701, 0x182]);
    let is_set = |name: &str| {
        lines.iter().map(|line| ["1", "True"].contains(&line[name].as_str())).collect::<Vec<_>>()
    };
    assert_eq!(is_set("can.flags.xtd"), [false, true, false, false]);
    assert_eq!(is_set("can.flags.rtr"), [false, false, true, false]);
    assert_eq!(column("_ws.malformed"), [""; 4]);
}

fn hex(text: &str) -> u32 {
    u32::from_str_radix(text.trim_start_matches("0x"), 16).unwrap_or_else(|_| panic!("`{text}` is a number"))
}

/// A frame and the fields that tell what is in it.
fn case(id: u16, data: &[u8], fields: &[(&'static str, u32)]) -> (Frame, Vec<(&'static str, u32)>) {
    (frame(id, data), fields.to_vec())
}

#[test]
fn what_canopen_says_in_them_is_what_was_meant() {
    let node = NodeId::new(5).unwrap();
    let position = Mux::new(0x6064, 0);
    let record = Mux::new(0x1018, 4);
    let segment = Segment { toggle: true, data: Bytes::new(&[1, 2, 3]).unwrap(), last: true };
    let emcy = Emcy {
        code: ErrorCode(0x8611),
        register: ErrorRegister::from_bits_retain(0x21),
        vendor: [1, 2, 3, 4, 5],
    };
    let abort = Abort { mux: record, code: AbortCode::NO_SUB_INDEX };
    let cases = [
        case(
            0x000,
            &Nmt { command: NmtCommand::START, node: Some(node) }.emit(),
            &[("canopen.nmt_ctrl.cd", 1), ("canopen.nmt_ctrl.node_id", 5)],
        ),
        case(
            0x000,
            &Nmt { command: NmtCommand::RESET_COMMUNICATION, node: None }.emit(),
            &[("canopen.nmt_ctrl.cd", 0x82), ("canopen.nmt_ctrl.node_id", 0)],
        ),
        case(0x080, &Sync { counter: Some(7) }.emit(), &[("canopen.sync.counter", 7)]),
        case(
            0x085,
            &emcy.emit(),
            &[("canopen.node_id", 5), ("canopen.em.err_code", 0x8611), ("canopen.em.err_reg", 0x21)],
        ),
        case(
            0x100,
            &TimeOfDay { milliseconds: 86_399_999, days: 15_666 }.emit(),
            &[("canopen.time_stamp_ms", 86_399_999), ("canopen.time_stamp_days", 15_666)],
        ),
        case(0x705, &Heartbeat::new(NmtState::OPERATIONAL).emit(), &[("canopen.nmt_guard.state", 5)]),
        case(0x705, &Heartbeat::new(NmtState::BOOT_UP).emit(), &[("canopen.nmt_guard.state", 0)]),
        case(
            0x605,
            &SdoRequest::Upload(position).emit(),
            &[("canopen.sdo.ccs", 2), ("canopen.sdo.main_idx", 0x6064), ("canopen.sdo.sub_idx", 0)],
        ),
        case(
            0x585,
            &SdoResponse::Upload(position, Transfer::expedited(&[1, 2, 3, 4]).unwrap()).emit(),
            &[("canopen.sdo.scs", 2), ("canopen.sdo.main_idx", 0x6064), ("canopen.node_id", 5)],
        ),
        case(
            0x605,
            &SdoRequest::Download(record, Transfer::Segmented { size: Some(10) }).emit(),
            &[("canopen.sdo.ccs", 1), ("canopen.sdo.main_idx", 0x1018), ("canopen.sdo.sub_idx", 4)],
        ),
        case(
            0x605,
            &SdoRequest::DownloadSegment(segment).emit(),
            &[("canopen.sdo.ccs", 0), ("canopen.sdo.toggle", 1)],
        ),
        case(
            0x585,
            &SdoResponse::Abort(abort).emit(),
            &[
                ("canopen.sdo.scs", 4),
                ("canopen.sdo.abort_code", 0x0609_0011),
                ("canopen.sdo.main_idx", 0x1018),
            ],
        ),
        case(
            0x605,
            &SdoRequest::BlockUpload { mux: record, crc: true, block_size: 127, switch_threshold: 0 }.emit(),
            // tshark 4.0 names no fields of a request for a block upload.
            &[],
        ),
        case(
            0x7E5,
            &LssRequest::SwitchGlobal(LssMode::CONFIGURATION).emit(),
            &[("canopen.lss.cs", 4), ("canopen.lss.switch.mode", 1)],
        ),
        case(
            0x7E5,
            &LssRequest::SwitchSelective(Part::Serial, 0x1234_5678).emit(),
            &[("canopen.lss.cs", 0x43), ("canopen.lss.addr.serial", 0x1234_5678)],
        ),
        case(0x185, &[0x27, 0x06, 1, 2, 3, 4], &[("canopen.node_id", 5)]),
    ];
    let frames: Vec<Frame> = cases.iter().map(|(frame, _)| *frame).collect();
    let Some(lines) = dissect("canopen", &frames) else { return };
    assert_eq!(lines.len(), cases.len());
    for ((frame, fields), line) in cases.iter().zip(&lines) {
        assert_eq!(line["_ws.malformed"], "", "{frame}");
        assert!(line["frame.protocols"].ends_with("canopen"), "{frame}: {}", line["frame.protocols"]);
        for (name, expected) in fields {
            let shown = line[name].as_str();
            let value = match shown {
                "True" => 1,
                "False" => 0,
                _ if shown.starts_with("0x") => hex(shown),
                _ => shown.parse().unwrap_or_else(|_| panic!("{frame}: {name} is `{shown}`")),
            };
            assert_eq!(value, *expected, "{frame}: {name}");
        }
    }
    let plain = |text: &str| text.replace(':', "");
    assert_eq!(plain(&lines[3]["canopen.em.err_field"]), "0102030405");
    assert_eq!(plain(&lines[15]["canopen.pdo.data.bytes"]), "270601020304");
}
