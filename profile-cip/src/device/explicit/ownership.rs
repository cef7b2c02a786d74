//! What clients may ask of the device while a controller owns it.
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
//! | Motion Device Axis Object | decided in the motion device |
//!
//! While nobody owns the device, anybody may set what can be set.

use core::net::Ipv4Addr;

use super::node::Node;
use crate::device::objects::class::{CLASS_CONNECTION_MANAGER, CLASS_MOTION_DEVICE_AXIS};
use crate::device::objects::file::{CLASS_FILE, INITIATE_UPLOAD, UPLOAD_TRANSFER};
use crate::wire::status::Service;

/// Whether a service of this class changes nothing that is not its requester's own. What is not known to be harmless
/// counts as a change.
fn is_harmless(class: u16, service: Service) -> bool {
    match (class, service) {
        (_, Service::GET_ATTRIBUTES_ALL | Service::GET_ATTRIBUTE_LIST | Service::GET_ATTRIBUTE_SINGLE) => {
            true
        }
        (
            CLASS_CONNECTION_MANAGER,
            Service::FORWARD_OPEN
            | Service::LARGE_FORWARD_OPEN
            | Service::FORWARD_CLOSE
            | Service::GET_CONNECTION_DATA
            | Service::SEARCH_CONNECTION_DATA,
        ) => true,
        (CLASS_FILE, INITIATE_UPLOAD | UPLOAD_TRANSFER) => true,
        (class, _) => class == CLASS_MOTION_DEVICE_AXIS,
    }
}

impl Node {
    /// Whether a request of this client is to be refused because another one owns the device.
    pub fn is_foreign(&self, client: Ipv4Addr, class: u16, service: Service) -> bool {
        let owner = self.connections.motion.parameters().map(|open| open.originator);
        owner.is_some_and(|owner| owner != client) && !is_harmless(class, service)
    }
}
