//! The object classes of the device: what the Message Router lists and the electronic data sheet names.

use super::class::{CLASS_CONNECTION_MANAGER, CLASS_MESSAGE_ROUTER, CLASS_MOTION_DEVICE_AXIS};
use super::connection_manager::Statistics;
use super::ethernet_link::{CLASS_ETHERNET_LINK, EthernetLink};
use super::file::{CLASS_FILE, File};
use super::identity::{CLASS_IDENTITY, Identity};
use super::object::Object;
use super::qos::{CLASS_QOS, Qos};
use super::router::MessageRouter;
use super::tcp_ip::{CLASS_TCP_IP, TcpIp};
use super::time_sync::{CLASS_TIME_SYNC, TimeSync};

/// A class of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ObjectClass {
    /// Class code.
    pub class: u16,
    /// Its name.
    pub name: &'static str,
    /// Revision (class attribute 1).
    pub revision: u16,
    /// Number of the one instance; `None` for the Motion Device Axis Object, which has one for each axis.
    pub instance: Option<u16>,
}

const fn of<T: Object>(class: u16, name: &'static str) -> ObjectClass {
    ObjectClass { class, name, revision: T::REVISION, instance: Some(T::INSTANCE) }
}

/// Every class, by its code. The File object is there only with something to serve.
pub const OBJECT_CLASSES: [ObjectClass; 9] = [
    of::<Identity<'_>>(CLASS_IDENTITY, "Identity Object"),
    of::<MessageRouter>(CLASS_MESSAGE_ROUTER, "Message Router"),
    of::<Statistics<'_>>(CLASS_CONNECTION_MANAGER, "Connection Manager Object"),
    of::<File<'_>>(CLASS_FILE, "File Object"),
    ObjectClass {
        class: CLASS_MOTION_DEVICE_AXIS,
        name: "Motion Device Axis Object",
        revision: crate::device::attribute::OBJECT_REVISION,
        instance: None,
    },
    of::<TimeSync<'_>>(CLASS_TIME_SYNC, "Time Sync Object"),
    of::<Qos<'_>>(CLASS_QOS, "QoS Object"),
    of::<TcpIp<'_>>(CLASS_TCP_IP, "TCP/IP Interface Object"),
    of::<EthernetLink<'_>>(CLASS_ETHERNET_LINK, "Ethernet Link Object"),
];
