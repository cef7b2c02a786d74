//! ListServices, ListIdentity and ListInterfaces, over TCP and UDP alike.

use core::net::SocketAddrV4;

use super::adapter::packet_bytes;
use super::node::Node;
use crate::wire::cpf::{CommonPacket, Item, ItemType};
use crate::wire::encapsulation::{Command, EncapsulationStatus, PROTOCOL_VERSION, Packet};
use crate::wire::list_identity::IdentityItem;
use crate::wire::list_services::{
    CAPABILITY_CIP_TCP, CAPABILITY_CLASS1_UDP, COMMUNICATIONS, SERVICES_ITEM_LEN, ServicesItem,
};
use crate::wire::sockaddr::SockaddrInfo;

/// The answer to a List command, or `None` for any other one. It is given at once: the delay a broadcast may
/// ask for is a maximum.
pub(crate) fn answer(node: &Node, packet: &Packet<'_>) -> Option<Vec<u8>> {
    let known =
        matches!(packet.command, Command::LIST_SERVICES | Command::LIST_IDENTITY | Command::LIST_INTERFACES);
    if !known {
        return None;
    }
    if !packet.data.is_empty() {
        let status = EncapsulationStatus::INVALID_LENGTH;
        return Some(packet_bytes(&Packet { status, data: &[], ..*packet }));
    }
    Some(match packet.command {
        Command::LIST_SERVICES => {
            let mut data = [0; SERVICES_ITEM_LEN];
            let capabilities = CAPABILITY_CIP_TCP | CAPABILITY_CLASS1_UDP;
            let item =
                ServicesItem { protocol_version: PROTOCOL_VERSION, capabilities, name: COMMUNICATIONS };
            let _ = item.emit(&mut data);
            with_items(packet, &[Item { item_type: ItemType::SERVICES, data: &data }])
        }
        Command::LIST_IDENTITY => {
            let identity = node.identity();
            let interface = &node.config.interface;
            let item = IdentityItem {
                protocol_version: PROTOCOL_VERSION,
                socket: SockaddrInfo {
                    address: SocketAddrV4::new(interface.address, interface.explicit_port),
                },
                vendor: identity.config.vendor,
                device_type: identity.config.device_type,
                product_code: identity.config.product_code,
                revision: (identity.config.major, identity.config.minor),
                status: identity.status(),
                serial_number: identity.config.serial_number,
                product_name: identity.config.product_name.as_bytes(),
                state: identity.state(),
            };
            let mut data = vec![0; item.buffer_len()];
            let _ = item.emit(&mut data);
            with_items(packet, &[Item { item_type: ItemType::IDENTITY, data: &data }])
        }
        // There is no interface but CIP, which is not listed.
        _ => with_items(packet, &[]),
    })
}

fn with_items(packet: &Packet<'_>, items: &[Item<'_>]) -> Vec<u8> {
    let list = CommonPacket::new(items);
    let mut data = vec![0; list.buffer_len()];
    let _ = list.emit(&mut data);
    packet_bytes(&Packet { data: &data, ..*packet })
}
