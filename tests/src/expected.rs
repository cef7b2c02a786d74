//! What tshark must show for a frame of ours: our own reading of the frame as (field, offset, raw bytes).
//!
//! Judged are values and byte offsets. tshark's field of that name must stand at that offset with those bytes; were a
//! value emitted at the wrong place, the two readings would differ.

use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::frame::{ActualFrame, CommandFrame};

/// One expected field: tshark's filter name, offset in the Ethernet frame, raw bytes.
pub type Expected = (&'static str, usize, Vec<u8>);

/// Length of the Ethernet, IPv4 and UDP headers in our recordings.
const UDP_PAYLOAD: usize = 14 + 20 + 8;
/// Offset of the class 1 sequence count behind the payload's start: item count, address item, data item head.
const SEQUENCE_COUNT: usize = 2 + 4 + 8 + 4;

/// The fields of a class 1 CIP Motion datagram in a whole Ethernet frame; `None` when it is none.
///
/// # Panics
/// When the frame carries class 1 data that this crate's own parser refuses.
#[must_use]
pub fn cip_motion(frame: &[u8]) -> Option<Vec<Expected>> {
    let datagram = Class1Datagram::parse(frame.get(UDP_PAYLOAD..)?).ok()?;
    let base = UDP_PAYLOAD + SEQUENCE_COUNT;
    let mut fields: Vec<Expected> =
        vec![("cipm.class1seqnum", base, datagram.sequence_count.to_le_bytes().to_vec())];
    let update = base + 2;
    match datagram.data.first()? {
        6 => command(datagram.data, update, &mut fields),
        7 => actual(datagram.data, update, &mut fields),
        other => panic!("connection format {other} in a recording of ours"),
    }
    Some(fields)
}

fn command(data: &[u8], at: usize, fields: &mut Vec<Expected>) {
    let frame = CommandFrame::parse(data).expect("our own C-to-D update parses");
    let header = frame.header();
    fields.push(("cipm.format", at, vec![6]));
    fields.push(("cipm.revision", at + 1, vec![2]));
    fields.push(("cipm.updateid", at + 2, vec![header.update_id]));
    fields.push(("cipm.nodecontrol", at + 3, vec![header.node_control.bits()]));
    fields.push(("cipm.instancecount", at + 4, vec![header.instance_count]));
    fields.push(("cipm.lastupdate", at + 6, vec![header.last_received_id]));
    fields.push(("cipm.timedataset", at + 7, vec![header.time_data_set().bits()]));
    if let Some(stamp) = header.time_stamp {
        fields.push(("cipm.ctrltimestamp", at + 8, stamp.to_le_bytes().to_vec()));
    }
    let mut offset = at + header.buffer_len();
    for instance in frame.instances() {
        let block = offset + 8;
        if let Some(cyclic) = &instance.cyclic {
            fields.push(("cipm.ctrlmode", block, vec![cyclic.control_mode.0]));
            fields.push(("cipm.axisctrl", block + 2, vec![cyclic.axis_control.0]));
            fields.push(("cipm.csts", block + 3, vec![cyclic.control_status.bits()]));
            fields.push(("cipm.cmdset", block + 4, vec![cyclic.values.data_set().bits()]));
            fields.push(("cipm.actset", block + 5, vec![cyclic.actual_data_set.bits()]));
            fields.push(("cipm.stsset", block + 6, vec![cyclic.status_data_set.bits()]));
        }
        if let Some(service) = &instance.service {
            let service_at = offset + instance.buffer_len() - service.buffer_len();
            fields.push(("cipm.svc.tranid", service_at, vec![service.transaction_id]));
            fields.push(("cipm.svc.code", service_at + 1, vec![service.service.0]));
        }
        offset += instance.buffer_len();
    }
    assert_eq!(offset - at, data.len(), "a C-to-D update has no surplus bytes");
}

fn actual(data: &[u8], at: usize, fields: &mut Vec<Expected>) {
    let frame = ActualFrame::parse(data).expect("our own D-to-C update parses");
    let header = frame.header();
    fields.push(("cipm.format", at, vec![7]));
    fields.push(("cipm.revision", at + 1, vec![2]));
    fields.push(("cipm.updateid", at + 2, vec![header.update_id]));
    fields.push(("cipm.nodestatus", at + 3, vec![header.node_status.bits()]));
    fields.push(("cipm.instancecount", at + 4, vec![header.instance_count]));
    fields.push(("cipm.lastupdate", at + 6, vec![header.last_received_id]));
    fields.push(("cipm.timedataset", at + 7, vec![header.time_data_set().bits()]));
    if let Some(stamp) = header.time_stamp {
        fields.push(("cipm.devctimestamp", at + 8, stamp.to_le_bytes().to_vec()));
    }
    let mut offset = at + header.buffer_len();
    for instance in frame.instances() {
        let block = offset + 8;
        if let Some(cyclic) = &instance.cyclic {
            fields.push(("cipm.ctrlmode", block, vec![cyclic.control_mode.0]));
            fields.push(("cipm.axisresp", block + 2, vec![cyclic.axis_response.0]));
            fields.push(("cipm.respstat", block + 3, vec![cyclic.response_status]));
            fields.push(("cipm.actset", block + 5, vec![cyclic.actual.data_set().bits()]));
            fields.push(("cipm.stsset", block + 6, vec![cyclic.status.data_set().bits()]));
            fields.push(("cipm.axste", block + 7, vec![cyclic.axis_state.0]));
            if let Some((status, manufacturer)) = cyclic.status.axis_status {
                let before = usize::from(cyclic.status.fault.is_some()) * 12
                    + usize::from(cyclic.status.alarm.is_some()) * 12;
                let status_at = block + 8 + cyclic.actual.len() + before;
                fields.push(("cipm.axisstatus", status_at, status.bits().to_le_bytes().to_vec()));
                fields.push(("cipm.axisstatusmfg", status_at + 4, manufacturer.to_le_bytes().to_vec()));
            }
        }
        if let Some(service) = &instance.service {
            let service_at = offset + instance.buffer_len() - service.buffer_len();
            fields.push(("cipm.svc.tranid", service_at, vec![service.transaction_id]));
            fields.push(("cipm.svc.code", service_at + 1, vec![service.service.0]));
            fields.push(("cipm.svc.sts", service_at + 2, vec![service.general_status]));
        }
        offset += instance.buffer_len();
    }
    assert_eq!(offset - at, data.len(), "a D-to-C update has no surplus bytes");
}

/// Offsets in a SERCOS III telegram of CP1 and CP2: service channel slots, then device words.
const SERCOS_DATA: usize = 20;
const DEVICE_WORDS: usize = SERCOS_DATA + 128 * 6;

/// The fields of a SERCOS III telegram: its header, and in CP1 and CP2 the slots of the first two slaves.
#[must_use]
pub fn sercos(frame: &[u8]) -> Vec<Expected> {
    let mut fields: Vec<Expected> = vec![
        ("siii.type", 14, vec![frame[14]]),
        ("siii.telno", 14, vec![frame[14]]),
        ("siii.mst.phase", 15, vec![frame[15]]),
        ("siii.mst.cyclecnt", 15, vec![frame[15]]),
        ("siii.mst.crc32", 16, frame[16..20].to_vec()),
    ];
    let answer = frame[14] & 0x40 != 0;
    let slots = match (frame[15] & 0x8F, frame[14] & 0x0F) {
        (1 | 2, 0) => 1..3,
        _ => 0..0,
    };
    for slot in slots {
        let (svc, device) = (SERCOS_DATA + 6 * slot, DEVICE_WORDS + 4 * slot);
        let word = |at: usize| frame[at..at + 2].to_vec();
        let (control, info, device_word) = if answer {
            ("siii.mdt.svch.stat", "siii.at.svch.info", "siii.at.devstatus")
        } else {
            ("siii.mdt.svch.ctrl", "siii.mdt.svch.info", "siii.mdt.devcontrol")
        };
        fields.push((control, svc, word(svc)));
        fields.push((info, svc + 2, frame[svc + 2..svc + 6].to_vec()));
        fields.push((device_word, device, word(device)));
    }
    fields
}
