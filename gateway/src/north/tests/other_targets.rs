//! Faults that were found in other targets and need sockets to show. The others are in the adapter's own tests.

use profile_cip::wire::encapsulation::EncapsulationStatus;
use tokio::io::AsyncWriteExt;

use super::*;

fn session_handle(packet: &[u8]) -> [u8; 4] {
    packet[4..8].try_into().unwrap()
}

/// A request as this client sends it, under somebody else's session handle.
fn under(mut packet: Vec<u8>, handle: [u8; 4]) -> Vec<u8> {
    packet[4..8].copy_from_slice(&handle);
    packet
}

#[tokio::test]
async fn session_handle_used_from_another_socket() {
    let (server, _device) = bind(91);
    let handle = spawn(server).unwrap();
    let mut owner = Client::register(handle.address()).await;
    let stolen = session_handle(&owner.packet(Command::SEND_RR_DATA, &[]));
    let mut thief = Client::connect(handle.address()).await;
    let get = client::unconnected(&client::message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    for registered in [false, true] {
        if registered {
            thief.register_session().await;
        }
        for command in [Command::SEND_RR_DATA, Command::SEND_UNIT_DATA] {
            let request = under(client::packet(command, 0, &get), stolen);
            let (header, data) = thief.exchange(&request).await;
            assert_eq!((header.status, data.len()), (EncapsulationStatus::INVALID_SESSION_HANDLE, 0));
        }
    }
    assert_eq!(owner.get(PATH_IDENTITY, 1).await, [0x34, 0x12]);
    assert_eq!(handle.stop().await.adapter.handles_invalid, 4);
}

#[tokio::test]
async fn unregister_session_of_another_session() {
    let (server, _device) = bind(92);
    let handle = spawn(server).unwrap();
    let mut owner = Client::register(handle.address()).await;
    let stolen = session_handle(&owner.packet(Command::SEND_RR_DATA, &[]));
    let mut thief = Client::register(handle.address()).await;
    let request = under(client::packet(Command::UNREGISTER_SESSION, 0, &[]), stolen);
    assert_eq!(thief.exchange(&request).await.0.status, EncapsulationStatus::INVALID_SESSION_HANDLE);
    assert_eq!(owner.get(PATH_IDENTITY, 1).await, [0x34, 0x12]);
    assert_eq!(thief.get(PATH_IDENTITY, 1).await, [0x34, 0x12]);
    handle.stop().await;
}

#[tokio::test]
async fn eleven_list_services_in_one_datagram() {
    let (server, _device) = bind(93);
    let handle = spawn(server).unwrap();
    let socket = UdpSocket::bind((Ipv4Addr::new(127, 0, 0, 193), 0)).await.unwrap();
    let one = client::packet(Command::LIST_SERVICES, 0, &[]);
    socket.send_to(&one.repeat(11), handle.address()).await.unwrap();
    // One that is whole comes behind it, so that the answer to it shows that there was none before.
    let identity = client::packet(Command::LIST_IDENTITY, 0, &[]);
    socket.send_to(&identity, handle.address()).await.unwrap();
    let mut answer = [0; 300];
    let (len, _) = tokio::time::timeout(LIMIT, socket.recv_from(&mut answer)).await.unwrap().unwrap();
    assert_eq!(client::parse(&answer[..len]).0.command, Command::LIST_IDENTITY);
    let statistics = handle.stop().await;
    assert_eq!((statistics.datagrams, statistics.adapter.datagrams_dropped), (2, 1));
}

/// The cycle thread shares nothing with the server but two queues that never wait: here the server does not run at all,
/// which is the worst a client could bring it to, and the cycle finds its end of the queues as ever.
#[test]
fn a_client_that_stalls_after_four_bytes_cannot_reach_the_cycle() {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let (server, mut end) = runtime.block_on(async { bind(94) });
    let address = server.local_address();
    let (_stop, stopped) = tokio::sync::watch::channel(false);
    let running = runtime.block_on(async { server.start().unwrap() });
    let mut running = Box::pin(running.run(stopped));
    let _stalled = runtime.block_on(async {
        let mut stalled = Client::connect(address).await;
        stalled.stream.write_all(&[0x65, 0, 4, 0]).await.unwrap();
        // As far as the server gets with that, and no further: nobody polls it from here on.
        let still_runs = tokio::time::timeout(Duration::from_millis(5), &mut running).await;
        assert!(still_runs.is_err());
        stalled
    });
    for cycle in 0..100_000_u64 {
        assert_eq!(end.request(), None);
        let lost = MotionReply::ConnectionLost { o_to_t_id: 1, silent_us: cycle };
        // The queue holds what fits and hands back the rest at once.
        assert_eq!(end.reply(lost.clone()).is_ok(), cycle < QUEUE_LEN as u64);
    }
}
