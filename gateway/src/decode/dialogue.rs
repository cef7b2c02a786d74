//! What a controller asks of a device and how it is answered, frame by frame: the services, and the state that updates show.

use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::message_router::Reply;
use profile_cip::wire::motion::attribute_list::{GetItem, GetResponse, SetResponse};
use profile_cip::wire::motion::codes::{
    AxisStateCode, ConnectionFormat, MotionService, NodeStatus, SyncStatus,
};
use profile_cip::wire::motion::fixed::FixedActual;
use profile_cip::wire::motion::{
    ActualFrame, CommandFrame, FORMAT_REVISION, FORMAT_REVISION_RUN_IDLE, ServiceResponse, run_idle,
};
use profile_cip::wire::multiple_service::MultipleService;
use profile_cip::wire::status::{ConnectionStatus, GeneralStatus, Service};

use super::connections::CLASS_MOTION;
use super::ethernet_ip::{Answered, EtherNetIp};
use super::explicit::service_name;
use super::packet::{Packet, is_io};
use super::text::Text;

/// Something that a frame shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Shown {
    /// A service was answered.
    Answer {
        /// Its name, and the axis where it is about one.
        service: String,
        /// The attribute that it is about.
        attribute: Option<u16>,
        /// Whether it is a service of the Motion Device Axis Object other than Group_Sync.
        configures: bool,
        /// Status and reason of a refusal.
        refusal: Option<String>,
    },
    /// Group_Sync was answered: the device is synchronized.
    GroupSync,
    /// An update of the device says that it works synchronously.
    Synchronous,
    /// An update of the device says that an axis runs.
    Running,
}

/// Follows one controller and one device.
#[derive(Debug)]
pub(crate) struct Dialogue {
    ethernet_ip: EtherNetIp,
    text: Text,
}

impl Default for Dialogue {
    fn default() -> Self {
        Self { ethernet_ip: EtherNetIp::collecting(), text: Text::default() }
    }
}

impl Dialogue {
    /// Takes in a frame and reports what it shows.
    pub fn packet(&mut self, packet: &Packet<'_>, mut show: impl FnMut(Shown)) {
        match packet {
            Packet::Tcp(segment) => {
                self.text.clear();
                self.ethernet_ip.segment(segment, &mut self.text);
                self.ethernet_ip.take_replies().iter().for_each(|answered| explicit(answered, &mut show));
            }
            Packet::Udp { from, to, payload } if is_io(*from, *to) => {
                if let Ok(datagram) = Class1Datagram::parse(payload) {
                    update(datagram.data, &mut show);
                }
            }
            _ => {}
        }
    }
}

/// Whether cyclic data carry a service or its answer: such frames are few and say most.
pub(crate) fn carries_service(payload: &[u8]) -> bool {
    let Ok(datagram) = Class1Datagram::parse(payload) else { return false };
    let Some((revision, data)) = split(datagram.data) else { return false };
    match ConnectionFormat(data.first().copied().unwrap_or(0)) {
        ConnectionFormat::VARIABLE_ACTUAL => ActualFrame::parse_as(data, revision)
            .is_ok_and(|frame| frame.instances().any(|instance| instance.service.is_some())),
        ConnectionFormat::FIXED_COMMAND | ConnectionFormat::FIXED_ACTUAL => false,
        _ => CommandFrame::parse_as(data, revision)
            .is_ok_and(|frame| frame.instances().any(|instance| instance.service.is_some())),
    }
}

/// The update behind a run/idle header, if there is one, with the revision of its format.
fn split(data: &[u8]) -> Option<(u8, &[u8])> {
    if run_idle::revision_of(data) != FORMAT_REVISION_RUN_IDLE {
        return Some((FORMAT_REVISION, data));
    }
    let (_, update) = run_idle::split(FORMAT_REVISION_RUN_IDLE, data).ok()?;
    Some((FORMAT_REVISION_RUN_IDLE, update))
}

/// What an update of a device shows; one of a controller shows nothing.
fn update(data: &[u8], show: &mut impl FnMut(Shown)) {
    let Some((revision, data)) = split(data) else { return };
    match ConnectionFormat(data.first().copied().unwrap_or(0)) {
        ConnectionFormat::FIXED_ACTUAL => {
            if let Ok(actual) = FixedActual::parse(data) {
                state(actual.node_status, [actual.axis_state].into_iter(), show);
            }
        }
        ConnectionFormat::VARIABLE_ACTUAL => {
            let Ok(frame) = ActualFrame::parse_as(data, revision) else { return };
            for instance in frame.instances() {
                if let Some(response) = &instance.service {
                    // Instance 0 is the class.
                    motion(response, Some(instance.number).filter(|number| *number > 0), show);
                }
            }
            let states = frame.instances().filter_map(|instance| Some(instance.cyclic?.axis_state));
            state(frame.header().node_status, states, show);
        }
        _ => {}
    }
}

fn state(node: NodeStatus, mut axes: impl Iterator<Item = AxisStateCode>, show: &mut impl FnMut(Shown)) {
    if node.contains(NodeStatus::SYNC_MODE) {
        show(Shown::Synchronous);
    }
    if axes.any(|state| state == AxisStateCode::RUNNING) {
        show(Shown::Running);
    }
}

/// An explicit reply.
fn explicit(Answered { class, reply }: &Answered, show: &mut impl FnMut(Shown)) {
    let Ok(reply) = Reply::parse(reply) else { return };
    let motion_class = *class == Some(CLASS_MOTION);
    if motion_class && MotionService(reply.service.0).name().is_some() {
        let response = ServiceResponse {
            transaction_id: 0,
            service: MotionService(reply.service.0),
            general_status: reply.status.0,
            extended_status: 0,
            data: reply.data,
        };
        return motion(&response, None, show);
    }
    if reply.service == Service::MULTIPLE_SERVICE_PACKET
        && let Ok(services) = MultipleService::parse(reply.data)
    {
        for message in services.iter() {
            explicit(&Answered { class: None, reply: message.to_vec() }, show);
        }
        return;
    }
    let mut service = service_name(reply.service, *class);
    if let Some(class) = class {
        service.push_str(&format!(" of class {class:#04x}"));
    }
    let refusal = (reply.status != GeneralStatus::SUCCESS).then(|| {
        let mut text = reply.status.to_string();
        for word in &reply.extended {
            let name = ConnectionStatus(*word).name();
            let opens = [Service::FORWARD_OPEN, Service::LARGE_FORWARD_OPEN, Service::FORWARD_CLOSE];
            match name.filter(|_| opens.contains(&reply.service)) {
                Some(name) => text.push_str(&format!(", {word:#06x} ({name})")),
                None => text.push_str(&format!(", {word:#06x}")),
            }
        }
        text
    });
    show(Shown::Answer { service, attribute: None, configures: false, refusal });
}

/// An answer of the Motion Device Axis Object.
fn motion(response: &ServiceResponse<'_>, axis: Option<u8>, show: &mut impl FnMut(Shown)) {
    let status = GeneralStatus(response.general_status);
    let group_sync = response.service == MotionService::GROUP_SYNC;
    let of_axis = axis.map(|axis| format!(" of axis instance {axis}")).unwrap_or_default();
    let service = format!("{}{of_axis}", response.service);
    let mut answer = |attribute: Option<u16>, refusal: Option<String>| {
        show(Shown::Answer { service: service.clone(), attribute, configures: !group_sync, refusal });
    };
    if status != GeneralStatus::SUCCESS {
        answer(None, Some(status.to_string()));
        // Which of the attributes it is about stands in the items.
        if response.data.is_empty() {
            return;
        }
    } else if group_sync {
        let sync = SyncStatus(response.data.first().copied().unwrap_or(SyncStatus::SYNCHRONIZED.0));
        if sync != SyncStatus::SYNCHRONIZED {
            return answer(None, Some(format!("sync status {sync}")));
        }
        answer(None, None);
        return show(Shown::GroupSync);
    } else {
        answer(None, None);
    }
    let refused: Vec<(u16, u8)> = match response.service {
        MotionService::GET_AXIS_ATTRIBUTES_LIST => GetResponse::new(response.data)
            .into_iter()
            .flatten()
            .filter_map(|item| match item {
                Ok(GetItem::Error(id, status)) => Some((id, status)),
                _ => None,
            })
            .collect(),
        MotionService::SET_AXIS_ATTRIBUTES_LIST => SetResponse::new(response.data)
            .into_iter()
            .flatten()
            .filter_map(|item| item.ok().map(|item| (item.id, item.status)))
            .filter(|(_, status)| *status != GeneralStatus::SUCCESS.0)
            .collect(),
        _ => Vec::new(),
    };
    for (id, status) in refused {
        answer(Some(id), Some(GeneralStatus(status).to_string()));
    }
}
