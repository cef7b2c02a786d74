//! Explicit requests without their sockets: attributes of an axis out of the motion device, Identity out of the adapter.

use std::hint::black_box;
use std::net::{Ipv4Addr, SocketAddrV4};

use arrayvec::ArrayVec;
use axisbridge::mapping::Mapping;
use axisbridge_tests::rig::{Rig, Settings};
use criterion::Criterion;
use profile_cip::device::AxisConfig;
use profile_cip::device::adapter::SessionSlot;
use profile_cip::device::attribute::{Access, AttributeDefinition, DataType, Scope};
use profile_cip::device::axis_state::ControlKind;
use profile_cip::device::motion_device::{DeviceConfig, MotionDevice};
use profile_cip::device::motion_link::{
    ExplicitReply, ExplicitRequest, MotionReply, MotionRequest, ObjectPath, Token,
};
use profile_cip::wire::motion::Format;
use profile_cip::wire::motion::codes::MotionService;
use profile_cip::wire::status::Service;
use profile_generic::time::MonotonicTime;

const NOW: MonotonicTime = MonotonicTime(1);
/// Class code of the Motion Device Axis Object.
const CLASS: u16 = 0x42;
/// Axis Faults.
const ATTRIBUTE: u16 = 657;
/// Ten attributes of an axis that every axis has: state, status, exceptions, faults, alarms and inhibits.
const LIST: [u16; 10] = [650, 651, 653, 655, 657, 659, 661, 674, 676, 677];
const CLIENT: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 50_000);

/// A device with two axes and all attributes of the standard that are numbers.
pub struct Attributes {
    device: MotionDevice,
    single: MotionRequest,
    list: MotionRequest,
}

impl Attributes {
    /// The device, with both requests ready to be sent.
    #[must_use]
    pub fn new() -> Self {
        let mapping = Mapping::embedded().expect("sound tables");
        let rows = mapping.dictionaries.cip.attributes().iter().filter(|row| row.length.is_none());
        let attributes = rows.filter_map(|row| {
            let data_type = DataType::from_name(row.data_type.name())?;
            Some(AttributeDefinition::new(Scope::Instance, row.id, data_type, Access::Set, &row.name))
        });
        let axis = AxisConfig { kind: ControlKind::Active, control_modes: 0b110, ..AxisConfig::default() };
        let config = DeviceConfig {
            format: Format::Variable,
            axes: vec![axis, axis],
            attributes: attributes.collect(),
            power_structure_class_id: 1,
            supports_sync: true,
            sync_threshold: None,
            transmission_processing_ns: 100_000,
        };
        let device = MotionDevice::new(config).expect("a sound configuration");
        let request = |service, attribute, data: &[u8]| {
            MotionRequest::Explicit(ExplicitRequest {
                token: Token(1),
                originator: *CLIENT.ip(),
                service,
                path: ObjectPath { class: CLASS, instance: 1, attribute, ..ObjectPath::default() },
                data: data.iter().copied().collect(),
            })
        };
        let mut list: ArrayVec<u8, 64> = ArrayVec::new();
        list.extend([10, 0, 0, 0]);
        for id in LIST {
            let size = attribute_size(&mapping, id);
            list.extend(id.to_le_bytes());
            list.extend([0, size]);
        }
        let single = request(Service::GET_ATTRIBUTE_SINGLE.0, Some(ATTRIBUTE), &[]);
        let list = request(MotionService::GET_AXIS_ATTRIBUTES_LIST.0, None, &list);
        Self { device, single, list }
    }

    /// One attribute; gives the octets of its value.
    pub fn single(&mut self) -> usize {
        let request = black_box(&self.single).clone();
        self.ask(request).data.len()
    }

    /// Ten attributes; gives the octets of the answer.
    pub fn list(&mut self) -> usize {
        let request = black_box(&self.list).clone();
        self.ask(request).data.len()
    }

    fn ask(&mut self, request: MotionRequest) -> ExplicitReply {
        self.device.request(NOW, None, request);
        match self.device.poll_reply() {
            Some(MotionReply::Explicit(reply)) => {
                assert_eq!(reply.general_status, 0);
                reply
            }
            other => panic!("an answer, not {other:?}"),
        }
    }
}

/// Octets of an attribute.
fn attribute_size(mapping: &Mapping, id: u16) -> u8 {
    let row = mapping.dictionaries.cip.attribute_by_id(id).expect("an attribute of the standard");
    DataType::from_name(row.data_type.name()).expect("a number").size()
}

/// The adapter of the rig with one session.
pub struct Session {
    rig: Rig,
    slot: SessionSlot,
    request: Vec<u8>,
    answer: [u8; 512],
}

impl Session {
    /// Registers a session.
    #[must_use]
    pub fn new() -> Self {
        let mut rig = Rig::new(Settings::default());
        let adapter = &mut rig.adapter;
        let slot = adapter.open(NOW, CLIENT).expect("a free session");
        let mut register = [0; 28];
        (register[0], register[2], register[24]) = (0x65, 4, 1);
        adapter.handle_stream(NOW, slot, &register);
        let mut answer = [0; 512];
        assert_eq!(adapter.poll_transmit(NOW, slot, &mut answer), register.len());
        // SendRRData: header, interface and time-out, no address, Get_Attribute_Single of Identity's vendor.
        let mut request = vec![0x6F, 0, 24, 0];
        request.extend_from_slice(&answer[4..8]);
        request.extend([0; 16]);
        request.extend([0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0xB2, 0, 8, 0]);
        request.extend([0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 1]);
        Self { rig, slot, request, answer }
    }

    /// One request and its answer; gives the octets of the answer.
    pub fn identity(&mut self) -> usize {
        let Self { rig, slot, request, answer } = self;
        let adapter = &mut rig.adapter;
        let taken = adapter.handle_stream(NOW, *slot, black_box(request));
        assert_eq!(taken, request.len());
        adapter.poll_transmit(NOW, *slot, answer)
    }
}

/// Octets of the answer about the vendor: encapsulation header, interface and items, reply, value.
pub const IDENTITY_ANSWER_LEN: usize = 24 + 16 + 4 + 2;

/// Benches of this module.
pub fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("explicit");
    let mut attributes = Attributes::new();
    assert_eq!((attributes.single(), attributes.list() > 4 + 10 * 8), (8, true));
    group.bench_function("axis_attribute", |bencher| bencher.iter(|| black_box(attributes.single())));
    group.bench_function("ten_axis_attributes", |bencher| bencher.iter(|| black_box(attributes.list())));
    let mut session = Session::new();
    assert_eq!(session.identity(), IDENTITY_ANSWER_LEN);
    group.bench_function("identity_through_the_adapter", |bencher| {
        bencher.iter(|| black_box(session.identity()));
    });
    group.finish();
}
