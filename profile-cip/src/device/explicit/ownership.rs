//! What clients may ask of the device: those that are no controllers by its configuration at any time, all others while a
//! controller owns it.
//!
//! The owner is the address whose Forward_Open opened the motion connection. From its request on until the connection has
//! ended, requests from any other address may only read: the attributes of the network (inactivity time-out, code points),
//! Reset and cleared counters reach the controller as much as the attributes of an axis do. Other requests get general
//! status 0x0F, privilege violation, before their data are looked at, as [`crate::device::motion::owner`] does for the axes.
//!
//! | object | services that anybody may use |
//! |---|---|
//! | every object | Get_Attributes_All, Get_Attribute_List, Get_Attribute_Single |
//! | Connection Manager | Forward_Open, Forward_Close: refused for connections of others; Get_Connection_Data and Search_Connection_Data, without the connection IDs of others |
//! | File | Initiate_Upload, Upload_Transfer: the data sheet, which is read only |
//! | Motion Device Axis Object | what only reads; while it is owned this is decided in the motion device |
//!
//! While nobody owns the device, every controller may set what can be set: the hosts that are listed as such, or anybody
//! without a list ([`crate::device::config::AdapterConfig::controllers`]). Other hosts open no connection that owns.

use core::net::Ipv4Addr;

use super::node::Node;
use crate::device::connection::refusal::Refusal;
use crate::device::motion::owner as motion_owner;
use crate::device::objects::class::{CLASS_CONNECTION_MANAGER, CLASS_MOTION_DEVICE_AXIS};
use crate::device::objects::file::{CLASS_FILE, INITIATE_UPLOAD, UPLOAD_TRANSFER};
use crate::wire::status::{GeneralStatus, Service};

/// Whether a service of this class changes nothing that is not its requester's own. What is not known to be harmless
/// counts as a change.
fn is_harmless(class: u16, service: Service) -> bool {
    matches!(
        (class, service),
        (_, Service::GET_ATTRIBUTES_ALL | Service::GET_ATTRIBUTE_LIST | Service::GET_ATTRIBUTE_SINGLE)
            | (
                CLASS_CONNECTION_MANAGER,
                Service::FORWARD_OPEN
                    | Service::LARGE_FORWARD_OPEN
                    | Service::FORWARD_CLOSE
                    | Service::GET_CONNECTION_DATA
                    | Service::SEARCH_CONNECTION_DATA
            )
            | (CLASS_FILE, INITIATE_UPLOAD | UPLOAD_TRANSFER)
    )
}

impl Node {
    /// Whether a request of this client is to be refused because it is no controller, or because another one owns the device.
    pub fn is_foreign(&self, client: Ipv4Addr, class: u16, service: Service) -> bool {
        if !self.config.controllers.has_v4(client) {
            let reads = class == CLASS_MOTION_DEVICE_AXIS && motion_owner::reads(service.0);
            return !reads && !is_harmless(class, service);
        }
        let owner = self.connections.motion.parameters().map(|open| open.originator);
        let is_decided_here = class != CLASS_MOTION_DEVICE_AXIS && !is_harmless(class, service);
        owner.is_some_and(|owner| owner != client) && is_decided_here
    }

    /// Whether streams are kept for this host: it is listed as a controller, or owns the device, or did so last.
    pub fn is_controller(&self, host: Ipv4Addr) -> bool {
        let controllers = &self.config.controllers;
        (controllers.are_listed() && controllers.has_v4(host)) || self.last_owner == Some(host)
    }

    /// Fails for a client that must not own the device.
    pub fn check_controller(&self, client: Ipv4Addr) -> Result<(), Refusal> {
        let refusal = || Refusal::general(GeneralStatus::PRIVILEGE_VIOLATION);
        self.config.controllers.has_v4(client).then_some(()).ok_or_else(refusal)
    }
}
