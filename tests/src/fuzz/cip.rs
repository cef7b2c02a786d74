//! EtherNet/IP encapsulation and CIP messages.

use profile_cip::wire::attributes::AttributeIds;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket};
use profile_cip::wire::encapsulation::{Header, Packet};
use profile_cip::wire::epath::{Encoding, Segment, emit_path, path_len, segments};
use profile_cip::wire::forward_close::{ForwardClose, ForwardCloseReply};
use profile_cip::wire::forward_open::{ConnectionFailure, ForwardOpen, ForwardOpenReply};
use profile_cip::wire::list_identity::IdentityItem;
use profile_cip::wire::list_services::ServicesItem;
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::multiple_service::{self, MultipleService};
use profile_cip::wire::register_session::RegisterSession;
use profile_cip::wire::sockaddr::SockaddrInfo;
use profile_cip::wire::unconnected_send::UnconnectedSend;

use super::{assert_printed, printed_again, same_again};

/// Encapsulation packets with their items, and class 1 datagrams.
pub fn encapsulation(data: &[u8]) {
    same_again!(Header, data);
    printed_again!(Packet, data);
    if let Ok(packet) = Packet::parse(data) {
        items(packet.data);
    }
    items(data);
    printed_again!(Class1Datagram, data);
    printed_again!(RegisterSession, data);
}

fn items(data: &[u8]) {
    printed_again!(CommonPacket, data);
    same_again!(EncapsulatedPacket, data);
    if let Ok(packet) = EncapsulatedPacket::parse(data) {
        for item in &packet.packet.items {
            printed_again!(IdentityItem, item.data);
            printed_again!(ServicesItem, item.data);
            same_again!(SockaddrInfo, item.data);
            message(item.data);
        }
    }
}

/// Requests and replies of the message router, and what the Connection Manager takes.
pub fn message(data: &[u8]) {
    printed_again!(Request, data);
    printed_again!(Reply, data);
    if let Ok(request) = Request::parse(data) {
        body(request.data);
        path(request.path);
    }
    body(data);
    path(data);
}

fn body(data: &[u8]) {
    for large in [false, true] {
        if let Ok(open) = ForwardOpen::parse(data, large) {
            let mut bytes = vec![0xA5; open.buffer_len()];
            assert_eq!(open.emit(&mut bytes), Ok(bytes.len()), "{open:?}");
            assert_eq!(ForwardOpen::parse(&bytes, large), Ok(open));
            assert_printed(&open.to_string(), data.len());
            path(open.path);
        }
    }
    printed_again!(ForwardClose, data);
    same_again!(ForwardCloseReply, data);
    same_again!(ForwardOpenReply, data);
    same_again!(ConnectionFailure, data);
    printed_again!(UnconnectedSend, data);
    if let Ok(packet) = MultipleService::parse(data) {
        let messages: Vec<_> = packet.iter().collect();
        assert_eq!(messages.len(), usize::from(packet.len()));
        let mut bytes = vec![0xA5; multiple_service::buffer_len(&messages)];
        // Services that share octets may not fit offsets of 16 bits any more once each has its own.
        if multiple_service::emit(&messages, &mut bytes).is_ok() {
            let again = MultipleService::parse(&bytes).expect("what was emitted");
            assert!(again.iter().eq(messages));
        }
    }
    if let Ok(ids) = AttributeIds::parse(data) {
        let ids: Vec<_> = ids.iter().collect();
        let mut bytes = vec![0xA5; 2 + 2 * ids.len()];
        assert_eq!(AttributeIds::emit(&ids, &mut bytes), Ok(bytes.len()));
        assert!(AttributeIds::parse(&bytes).expect("what was emitted").iter().eq(ids));
    }
}

fn path(data: &[u8]) {
    for encoding in [Encoding::Padded, Encoding::Packed] {
        let path: Vec<Segment<'_>> = segments(data, encoding).map_while(Result::ok).collect();
        let mut bytes = vec![0xA5; path_len(&path, encoding)];
        assert_eq!(emit_path(&path, encoding, &mut bytes), Ok(bytes.len()), "{path:?}");
        let again: Result<Vec<_>, _> = segments(&bytes, encoding).collect();
        assert_eq!(again.as_ref(), Ok(&path), "{encoding:?}");
        let text: String = path.iter().map(ToString::to_string).collect();
        assert_printed(&text, data.len());
    }
}
