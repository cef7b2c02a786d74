//! Every block of the CIP Motion connection as tshark reads it: each data set, both directions, one to three instances.
//!
//! What is expected is laid out here by hand from the tables of Volume 9 clause 6-2, field after field, and does not
//! come from our own parser; the frames come from our writers. tshark must show each field at that offset with those
//! bytes. Where tshark 4.0 itself misreads (it skips no unwind count, no displacement, and counts events with four bits), the
//! case keeps to what it can read, and says so.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::PathBuf;

use arrayvec::ArrayVec;
use axisbridge::capture::Side;
use axisbridge::capture::synth::Synthesizer;
use axisbridge::capture::writer::Writer;
use axisbridge::sys::clock::KernelTime;
use axisbridge_tests::{peer, tshark};
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::actual::{
    ActualBlock, ActualPosition, ActualValues, AlarmRecord, FaultRecord, SafetyStatus, StatusValues,
};
use profile_cip::wire::motion::codes::{
    ActualDataSet, AlarmType, AxisControl, AxisIoStatus, AxisStateCode, AxisStatus, CommandTarget,
    ControlMode, ControlStatus, EventChecking, EventType, FaultType, FeedbackMode, MotionService, NodeAlarm,
    NodeControl, NodeFault, NodeStatus, StatusDataSet, TimeDataSet,
};
use profile_cip::wire::motion::event::{ActualEvents, CommandEvents, EventAck, EventNotification};
use profile_cip::wire::motion::frame::{ActualInstance, ActualWriter, CommandInstance, CommandWriter};
use profile_cip::wire::motion::header::{ActualHeader, CommandHeader, TimeDiagnostics, UpdateDiagnostics};
use profile_cip::wire::motion::read_write::{ReadBlock, WriteBlock};
use profile_cip::wire::motion::service::{ServiceRequest, ServiceResponse};
use profile_cip::wire::motion::{CommandBlock, CommandPosition, CommandValues};

const CONTROLLER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 2222);
const DEVICE: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 2), 2222);

/// Ethernet, IPv4 and UDP headers, the two items of a class 1 datagram, its sequence count.
const UPDATE_AT: usize = 14 + 20 + 8 + 18 + 2;

/// One frame and what it has to show.
struct Case {
    what: String,
    from_controller: bool,
    update: Vec<u8>,
    layout: Layout,
}

/// Fields in the order of the standard's tables; each advances the place by its length.
#[derive(Default)]
struct Layout {
    at: usize,
    fields: Vec<(&'static str, usize, Vec<u8>)>,
}

impl Layout {
    fn put(&mut self, name: &'static str, bytes: &[u8]) {
        self.fields.push((name, self.at, bytes.to_vec()));
        self.at += bytes.len();
    }

    /// A field of some bits of the next octet, which follows.
    fn bits(&mut self, name: &'static str, octet: u8) {
        self.fields.push((name, self.at, vec![octet]));
    }

    fn skip(&mut self, octets: usize) {
        self.at += octets;
    }
}

// ---- C-to-D ------------------------------------------------------------------------------------------------------

fn command_header(
    instances: u8,
    time_stamp: Option<u64>,
    time_offset: Option<i64>,
) -> (CommandHeader, Layout) {
    let header = CommandHeader {
        update_id: 0xA1,
        node_control: NodeControl::from_bits_retain(0x07),
        instance_count: instances,
        last_received_id: 0xB2,
        time_stamp,
        time_offset,
        diagnostics: TimeDataSet::empty(),
    };
    let mut layout = Layout::default();
    layout.put("cipm.format", &[6]);
    layout.put("cipm.revision", &[2]);
    layout.put("cipm.updateid", &[0xA1]);
    for bit in ["cipm.remote", "cipm.sync", "cipm.valid", "cipm.fltrst"] {
        layout.bits(bit, 7);
    }
    layout.put("cipm.nodecontrol", &[7]);
    layout.put("cipm.instancecount", &[instances]);
    layout.skip(1);
    layout.put("cipm.lastupdate", &[0xB2]);
    let set = u8::from(time_stamp.is_some()) | u8::from(time_offset.is_some()) << 1;
    layout.put("cipm.timedataset", &[set]);
    if let Some(stamp) = time_stamp {
        layout.put("cipm.ctrltimestamp", &stamp.to_le_bytes());
    }
    if let Some(offset) = time_offset {
        layout.put("cipm.ctrltimeoffser", &offset.to_le_bytes());
    }
    (header, layout)
}

/// Instance header: sizes in 32-bit words, the instance block with its header.
fn instance_header(layout: &mut Layout, number: u8, cyclic: usize, rw: usize, event: usize, service: usize) {
    let words = |octets: usize| u8::try_from(octets / 4).expect("short blocks");
    layout.put("cipm.var_devce.header.instance", &[number]);
    layout.skip(1);
    layout.put("cipm.var_devce.header.instance_block_size", &[words(8 + cyclic + rw + event + service)]);
    layout.put("cipm.var_devce.header.cyclic_block_size", &[words(cyclic + rw)]);
    layout.put("cipm.var_devce.header.cyclic_data_block_size", &[words(cyclic)]);
    layout.put("cipm.var_devce.header.cyclic_rw_block_size", &[words(rw)]);
    layout.put("cipm.var_devce.header.event_block_size", &[words(event)]);
    layout.put("cipm.var_devce.header.service_block_size", &[words(service)]);
}

/// A command block with the values whose bits stand in `set`; the position as DINT or LREAL.
fn command_block(set: u8, integer: bool, target: u8) -> (CommandBlock, usize) {
    let position =
        if integer { CommandPosition::Integer(-123_456_789) } else { CommandPosition::Float(-2.5e9) };
    let block = CommandBlock {
        control_mode: ControlMode::VELOCITY,
        feedback_mode: FeedbackMode(0x12),
        axis_control: AxisControl::ENABLE,
        control_status: ControlStatus::from_bits_retain(0x1D),
        actual_data_set: ActualDataSet::from_bits_retain(0x05),
        status_data_set: StatusDataSet::from_bits_retain(0x1F),
        target: CommandTarget(target),
        values: CommandValues {
            position: (set & 1 != 0).then_some(position),
            velocity: (set & 2 != 0).then_some(1.5),
            acceleration: (set & 4 != 0).then_some(-0.25),
            torque: (set & 8 != 0).then_some(99.5),
            ..CommandValues::default()
        },
    };
    let position = if integer { 4 } else { 8 };
    let octets = [position, 4, 4, 4].into_iter().enumerate().filter(|(bit, _)| set & 1 << bit != 0);
    (block, 8 + octets.map(|(_, octets)| octets).sum::<usize>())
}

fn command_layout(layout: &mut Layout, block: &CommandBlock, set: u8, integer: bool) {
    layout.put("cipm.ctrlmode", &[2]);
    layout.bits("cipm.feedback_mode", 0x12);
    layout.bits("cipm.feedback_data_type", 0x12);
    layout.put("cipm.feedback", &[0x12]);
    layout.put("cipm.axisctrl", &[1]);
    layout.bits("cipm.control_status.complete", 0x1D);
    layout.bits("cipm.control_status.bus_up", 0x1D);
    layout.bits("cipm.control_status.bus_unload", 0x1D);
    layout.bits("cipm.control_status.power_loss", 0x1D);
    layout.put("cipm.csts", &[0x1D]);
    layout.put("cipm.cmdset", &[set]);
    layout.put("cipm.actset", &[5]);
    layout.put("cipm.stsset", &[0x1F]);
    // The type counts only where there is a position.
    let control = block.target.0 | if set & 1 != 0 && integer { 4 } else { 0 };
    layout.bits("cipm.intrp", control);
    layout.bits("cipm.posdatatype", control);
    layout.put("cipm.cmdcontrol", &[control]);
    if set & 1 != 0 && integer {
        layout.put("cipm.posicmd", &(-123_456_789_i32).to_le_bytes());
    } else if set & 1 != 0 {
        layout.put("cipm.posfcmd", &(-2.5e9_f64).to_le_bytes());
    }
    for (bit, name, value) in
        [(2, "cipm.velcmd", 1.5_f32), (4, "cipm.accelcmd", -0.25), (8, "cipm.torquecmd", 99.5)]
    {
        if set & bit != 0 {
            layout.put(name, &value.to_le_bytes());
        }
    }
}

/// Every command data set that tshark reads, in both position types, with every Command Target Update.
fn command_data_sets(cases: &mut Vec<Case>) {
    for set in 0..16 {
        for integer in [false, true] {
            for target in 0..3 {
                let (header, mut layout) = command_header(1, Some(1_800_000_000_123_456_789), None);
                let (block, octets) = command_block(set, integer, target);
                instance_header(&mut layout, 1, octets, 0, 0, 0);
                command_layout(&mut layout, &block, set, integer);
                let instance =
                    CommandInstance { number: 1, cyclic: Some(block), ..CommandInstance::default() };
                let what = format!("command data set {set:#03x}, DINT {integer}, target {target}");
                push_command(cases, what, &header, &[instance], layout);
            }
        }
    }
}

fn push_command(
    cases: &mut Vec<Case>,
    what: String,
    header: &CommandHeader,
    instances: &[CommandInstance<'_>],
    layout: Layout,
) {
    let mut buffer = [0xA5; 1400];
    let mut writer = CommandWriter::new(&mut buffer, header).expect("the header fits");
    for instance in instances {
        writer.instance(instance).expect("the instance fits");
    }
    let len = writer.finish();
    assert_eq!(len, layout.at, "{what}: the layout covers the whole update");
    cases.push(Case { what, from_controller: true, update: buffer[..len].to_vec(), layout });
}

/// Write, event and service blocks of up to three instances, with every time data set.
fn command_blocks(cases: &mut Vec<Case>) {
    let stamps = [None, Some(7_u64)];
    let offsets = [None, Some(-9_i64)];
    for (stamp, offset) in stamps.into_iter().flat_map(|stamp| offsets.map(|offset| (stamp, offset))) {
        for count in 1..=3_u8 {
            let (header, mut layout) = command_header(count, stamp, offset);
            let mut instances = Vec::new();
            for number in 1..=count {
                let set = number; // 1, 2, 3: another data set in each
                let (block, octets) = command_block(set, true, 2);
                let acks = usize::from(number - 1);
                // Checking control, then two octets an acknowledgement, padded.
                let event = 4 + (2 * acks).next_multiple_of(4);
                instance_header(&mut layout, number, octets, 4 + 8, event, 4 + 12);
                command_layout(&mut layout, &block, set, true);
                layout.put("cipm.writeblk", &[0x21]);
                layout.skip(1);
                layout.put("cipm.readblk", &[0x32]);
                layout.skip(1);
                layout.put("cipm.writedata", b"writtenA");
                let checking = EventChecking::from_bits_retain(0x00A5_0F0F);
                let word = 0x00A5_0F0F | u32::try_from(acks).expect("few") << 28;
                layout.put("cipm.evntchkcontrol", &word.to_le_bytes());
                let mut events = CommandEvents { checking, ..CommandEvents::default() };
                for ack in 0..acks {
                    let ack = u8::try_from(ack).expect("few");
                    layout.put("cipm.evntack", &[0x70 + ack]);
                    layout.put("cipm.evnt.stat", &[ack]);
                    events.acks.push(EventAck { event_id: 0x70 + ack, status: ack });
                }
                layout.at = layout.at.next_multiple_of(4);
                layout.put("cipm.svc.tranid", &[0x40 + number]);
                layout.put("cipm.svc.code", &[0x4B]);
                layout.skip(2);
                // Get_Axis_Attributes_List: two attributes without dimensions.
                layout.put("cipm.getaxisattr.cnt", &[2, 0]);
                layout.skip(2);
                for (id, size) in [(650_u16, 1), (657, 8)] {
                    layout.put("cipm.getaxisattr.id", &id.to_le_bytes());
                    layout.put("cipm.getaxisattr.dimension", &[0]);
                    layout.put("cipm.getaxisattr.element_size", &[size]);
                }
                instances.push(CommandInstance {
                    number,
                    cyclic: Some(block),
                    write: Some(WriteBlock { write_block_id: 0x21, read_block_id: 0x32, data: b"writtenA" }),
                    events: Some(events),
                    service: Some(ServiceRequest {
                        transaction_id: 0x40 + number,
                        service: MotionService::GET_AXIS_ATTRIBUTES_LIST,
                        data: &[2, 0, 0, 0, 0x8A, 2, 0, 1, 0x91, 2, 0, 8],
                    }),
                });
            }
            let what = format!("C-to-D, {count} instances, time {stamp:?} {offset:?}");
            push_command(cases, what, &header, &instances, layout);
        }
    }
}

// ---- D-to-C ------------------------------------------------------------------------------------------------------

/// A header with every time value whose bit stands in `set`.
fn actual_header(instances: u8, set: u8) -> (ActualHeader, Layout) {
    let header = ActualHeader {
        update_id: 0x11,
        node_status: NodeStatus::from_bits_retain(0x0B),
        instance_count: instances,
        node_fault: NodeFault(4),
        node_alarm: NodeAlarm(2),
        last_received_id: 0x10,
        time_stamp: (set & 1 != 0).then_some(0x0102_0304_0506_0708),
        time_offset: (set & 2 != 0).then_some(-2),
        update_diagnostics: (set & 4 != 0).then_some(UpdateDiagnostics { lost_updates: 3, late_updates: 9 }),
        time_diagnostics: (set & 8 != 0)
            .then_some(TimeDiagnostics { received_at: 1_000_000_007, transmitted_at: 1_000_000_009 }),
    };
    let mut layout = Layout::default();
    layout.put("cipm.format", &[7]);
    layout.put("cipm.revision", &[2]);
    layout.put("cipm.updateid", &[0x11]);
    layout.bits("cipm.flt", 0x0B);
    layout.put("cipm.nodestatus", &[0x0B]);
    layout.put("cipm.instancecount", &[instances]);
    // Table 6-2.39: the fault in bits 7 to 4, the alarm below.
    layout.put("cipm.fltalarms", &[0x42]);
    layout.put("cipm.lastupdate", &[0x10]);
    layout.put("cipm.timedataset", &[set]);
    if set & 1 != 0 {
        layout.put("cipm.devctimestamp", &0x0102_0304_0506_0708_u64.to_le_bytes());
    }
    if set & 2 != 0 {
        layout.put("cipm.devctimeoffser", &(-2_i64).to_le_bytes());
    }
    if set & 4 != 0 {
        layout.put("cipm.lostupdates", &[3]);
        layout.put("cipm.lateupdates", &[9]);
        layout.skip(2);
    }
    if set & 8 != 0 {
        layout.put("cipm.rxtimestamp", &1_000_000_007_u64.to_le_bytes());
        layout.put("cipm.txtimestamp", &1_000_000_009_u64.to_le_bytes());
    }
    (header, layout)
}

/// An actual block with the values and records whose bits stand in the two sets.
fn actual_block(actual: u8, status: u8, lint: bool) -> (ActualBlock, usize) {
    let position =
        if lint { ActualPosition::Lint(-0x1234_5678_9ABC) } else { ActualPosition::Dint(-987_654_321) };
    let block = ActualBlock {
        control_mode: ControlMode::POSITION,
        feedback_mode: FeedbackMode(2),
        axis_response: AxisControl::FAULT_RESET,
        response_status: 0x10,
        axis_state: AxisStateCode(4),
        actual: ActualValues {
            position: (actual & 1 != 0).then_some(position),
            velocity: (actual & 2 != 0).then_some(-3.25),
            acceleration: (actual & 4 != 0).then_some(1e6),
            ..ActualValues::default()
        },
        status: StatusValues {
            fault: (status & 1 != 0).then_some(FaultRecord {
                fault_type: FaultType(3),
                code: 41,
                sub_code: 5,
                action: 0x22,
                time_stamp: 77,
            }),
            alarm: (status & 2 != 0).then_some(AlarmRecord {
                alarm_type: AlarmType(3),
                code: 17,
                sub_code: 6,
                state: 1,
                time_stamp: 78,
            }),
            axis_status: (status & 4 != 0)
                .then_some((AxisStatus::from_bits_retain(0x0155_AA55), 0x8000_0001)),
            io_status: (status & 8 != 0).then_some((AxisIoStatus::from_bits_retain(0x3FF), 2)),
            safety: (status & 16 != 0).then_some(SafetyStatus {
                status: 0xC0FF_EE00,
                manufacturer: 5,
                state: 4,
            }),
        },
    };
    let values = [if lint { 8 } else { 4 }, 4, 4];
    let records = [12, 12, 8, 8, 12];
    let sum = |set: u8, octets: &[usize]| {
        octets
            .iter()
            .enumerate()
            .filter(|(bit, _)| set & 1 << bit != 0)
            .map(|(_, octets)| octets)
            .sum::<usize>()
    };
    (block, 8 + sum(actual, &values) + sum(status, &records))
}

fn actual_layout(layout: &mut Layout, actual: u8, status: u8, lint: bool) {
    layout.put("cipm.ctrlmode", &[1]);
    // The block says itself whether its position is a LINT.
    let feedback = 2 | if lint && actual & 1 != 0 { 0x10 } else { 0 };
    layout.put("cipm.feedback", &[feedback]);
    layout.put("cipm.axisresp", &[6]);
    layout.put("cipm.respstat", &[0x10]);
    layout.skip(1);
    layout.put("cipm.actset", &[actual]);
    layout.put("cipm.stsset", &[status]);
    layout.put("cipm.axste", &[4]);
    if actual & 1 != 0 && lint {
        layout.put("cipm.actpos_64", &(-0x1234_5678_9ABC_i64).to_le_bytes());
    } else if actual & 1 != 0 {
        layout.put("cipm.actpos", &(-987_654_321_i32).to_le_bytes());
    }
    if actual & 2 != 0 {
        layout.put("cipm.actvel", &(-3.25_f32).to_le_bytes());
    }
    if actual & 4 != 0 {
        layout.put("cipm.actaccel", &1e6_f32.to_le_bytes());
    }
    if status & 1 != 0 {
        layout.put("cipm.flttype", &[3]);
        layout.put("cipm.fault.code", &[41]);
        layout.put("cipm.fltsubcode", &[5]);
        layout.put("cipm.fltaction", &[0x22]);
        layout.put("cipm.flttimestamp", &77_u64.to_le_bytes());
    }
    if status & 2 != 0 {
        layout.put("cipm.alarmtype", &[3]);
        layout.put("cipm.alarm.code", &[17]);
        layout.put("cipm.alarmsubcode", &[6]);
        layout.put("cipm.alarmstate", &[1]);
        layout.put("cipm.alarmtimestamp", &78_u64.to_le_bytes());
    }
    if status & 4 != 0 {
        layout.put("cipm.axisstatus", &0x0155_AA55_u32.to_le_bytes());
        layout.put("cipm.axisstatusmfg", &0x8000_0001_u32.to_le_bytes());
    }
    if status & 8 != 0 {
        layout.put("cipm.axisiostatus", &0x3FF_u32.to_le_bytes());
        layout.put("cipm.axisiostatusmfg", &2_u32.to_le_bytes());
    }
    if status & 16 != 0 {
        layout.put("cipm.safetystatus", &0xC0FF_EE00_u32.to_le_bytes());
        layout.put("cipm.safetystatusmfg", &5_u32.to_le_bytes());
        layout.put("cipm.safetystate", &[4]);
        layout.skip(3);
    }
}

/// Every actual data set that tshark reads with every status data set, positions as DINT and LINT.
fn actual_data_sets(cases: &mut Vec<Case>) {
    for actual in 0..8 {
        for status in 0..32 {
            for lint in [false, true] {
                let (header, mut layout) = actual_header(1, 1);
                let (block, octets) = actual_block(actual, status, lint);
                instance_header(&mut layout, 1, octets, 0, 0, 0);
                actual_layout(&mut layout, actual, status, lint);
                let instance = ActualInstance { number: 1, cyclic: Some(block), ..ActualInstance::default() };
                let what = format!("actual data set {actual}, status data set {status:#04x}, LINT {lint}");
                push_actual(cases, what, &header, &[instance], layout);
            }
        }
    }
}

fn push_actual(
    cases: &mut Vec<Case>,
    what: String,
    header: &ActualHeader,
    instances: &[ActualInstance<'_>],
    layout: Layout,
) {
    let mut buffer = [0xA5; 1400];
    let mut writer = ActualWriter::new(&mut buffer, header).expect("the header fits");
    for instance in instances {
        writer.instance(instance).expect("the instance fits");
    }
    let len = writer.finish();
    assert_eq!(len, layout.at, "{what}: the layout covers the whole update");
    cases.push(Case { what, from_controller: false, update: buffer[..len].to_vec(), layout });
}

/// Read, event and service blocks of up to three instances, with every time data set.
fn actual_blocks(cases: &mut Vec<Case>) {
    for set in 0..16_u8 {
        for count in 1..=3_u8 {
            let (header, mut layout) = actual_header(count, set);
            let mut instances = Vec::new();
            for number in 1..=count {
                let (block, octets) = actual_block(number, 1 << number, false);
                let events = usize::from(number) * 2;
                instance_header(&mut layout, number, octets, 4 + 4, 4 + 16 * events, 4 + 20);
                actual_layout(&mut layout, number, 1 << number, false);
                layout.put("cipm.writeblk", &[0x21]);
                layout.put("cipm.writests", &[0x09]);
                layout.put("cipm.readblk", &[0x32]);
                layout.put("cipm.readsts", &[0]);
                layout.put("cipm.readdata", b"read");
                let word = 0x0005_0F0F | u32::try_from(events).expect("few") << 28;
                layout.put("cipm.evntchkstatus", &word.to_le_bytes());
                let mut notifications = ArrayVec::new();
                for event in 0..u8::try_from(events).expect("few") {
                    layout.put("cipm.evntack", &[event + 1]);
                    layout.put("cipm.evnt.stat", &[0]);
                    layout.put("cipm.evnt.type", &[event]);
                    layout.skip(1);
                    let position = -1000 - i32::from(event);
                    layout.put("cipm.evntpos", &position.to_le_bytes());
                    layout.put("cipm.evntimestamp", &(500 + u64::from(event)).to_le_bytes());
                    notifications.push(EventNotification {
                        event_id: event + 1,
                        status: 0,
                        event_type: EventType(event),
                        position,
                        time_stamp: 500 + u64::from(event),
                    });
                }
                layout.put("cipm.svc.tranid", &[0x40 + number]);
                layout.put("cipm.svc.code", &[0x4B]);
                layout.put("cipm.svc.sts", &[0]);
                layout.put("cipm.svc.extstatus", &[0]);
                layout.put("cipm.getaxisattr.cnt", &[2, 0]);
                layout.skip(2);
                // A value of eight octets, and an attribute that is not there: dimension 0xFF, then the status.
                layout.put("cipm.getaxisattr.id", &657_u16.to_le_bytes());
                layout.put("cipm.getaxisattr.dimension", &[0]);
                layout.put("cipm.getaxisattr.element_size", &[8]);
                layout.put("cipm.attrdata", &[1, 2, 3, 4, 5, 6, 7, 8]);
                layout.put("cipm.getaxisattr.id", &9999_u16.to_le_bytes());
                layout.skip(1);
                layout.put("cipm.getaxisattr.sts", &[0x14]);
                instances.push(ActualInstance {
                    number,
                    cyclic: Some(block),
                    read: Some(ReadBlock {
                        write_block_id: 0x21,
                        write_status: 9,
                        read_block_id: 0x32,
                        read_status: 0,
                        data: b"read",
                    }),
                    events: Some(ActualEvents {
                        checking: EventChecking::from_bits_retain(0x0005_0F0F),
                        extended: None,
                        notifications,
                    }),
                    service: Some(ServiceResponse {
                        transaction_id: 0x40 + number,
                        service: MotionService::GET_AXIS_ATTRIBUTES_LIST,
                        general_status: 0,
                        extended_status: 0,
                        data: &[2, 0, 0, 0, 0x91, 2, 0, 8, 1, 2, 3, 4, 5, 6, 7, 8, 0x0F, 0x27, 0xFF, 0x14],
                    }),
                });
            }
            let what = format!("D-to-C, {count} instances, time data set {set:#x}");
            push_actual(cases, what, &header, &instances, layout);
        }
    }
}

// ---- the judge ---------------------------------------------------------------------------------------------------

fn record(cases: &[Case], name: &str) -> PathBuf {
    let mut writer =
        Writer::new(Vec::new(), ["192.0.2.2", "none", "not used"], &[]).expect("memory can be written");
    let mut synthesizer = Synthesizer::new();
    for (number, case) in (1_u16..).zip(cases) {
        let mut buffer = [0; 1472];
        let datagram = Class1Datagram {
            connection_id: if case.from_controller { 0x1000_0001 } else { 0x2000_0001 },
            encapsulation_sequence: u32::from(number),
            sequence_count: number,
            data: &case.update,
        };
        let len = datagram.emit(&mut buffer).expect("an update fits a datagram");
        let (from, to) = if case.from_controller { (CONTROLLER, DEVICE) } else { (DEVICE, CONTROLLER) };
        let mut frame = Vec::new();
        synthesizer
            .udp(from, to, 0, &buffer[..len], &mut |bytes| frame = bytes.to_vec())
            .expect("a datagram fits a frame");
        let at = KernelTime(1_800_000_000_000_000_000 + u64::from(number) * 1_000_000);
        writer.frame(Side::North, at, &frame, Some(&case.what)).expect("memory can be written");
    }
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, writer.finish().expect("memory can be written"))
        .expect("the scratch folder can be written");
    path
}

#[test]
fn tshark_reads_every_block_as_it_was_meant() {
    if !peer::tshark_or_skip("tshark_reads_every_block_as_it_was_meant") {
        return;
    }
    let mut cases = Vec::new();
    command_data_sets(&mut cases);
    command_blocks(&mut cases);
    actual_data_sets(&mut cases);
    actual_blocks(&mut cases);
    assert_eq!(cases.len(), 16 * 2 * 3 + 4 * 3 + 8 * 32 * 2 + 16 * 3);
    let file = record(&cases, "tshark-blocks.pcapng");
    // The Forward_Open is not in the file; tshark is told what the connection carries.
    let frames = tshark::dissect(&file, "cipm", &["-d", "cip.io,cipm"]);
    assert_eq!(frames.len(), cases.len(), "tshark takes every frame for CIP Motion");
    for (frame, case) in frames.iter().zip(&cases) {
        for (name, at, bytes) in &case.layout.fields {
            let (position, hex) = (UPDATE_AT + at, hexadecimal(bytes));
            let found = frame.all(name).any(|field| field.position == position && field.value == hex);
            let shown: Vec<_> = frame.all(name).map(|field| (field.position, &field.value)).collect();
            assert!(found, "{}: expected {name} = {hex} at {position}, tshark has {shown:?}", case.what);
        }
        assert!(frame.field("cipm.data").is_none(), "{}: surplus data", case.what);
        assert!(!frame.has("_ws.malformed"), "{}: malformed", case.what);
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
