//! Whose datagrams the socket of the motion connection is to let through.

use std::sync::mpsc::{Receiver, channel};

use super::*;
use crate::sys::gate::Admitted;

/// The next change, or the test ends.
fn next(changes: &Receiver<Option<Admitted>>) -> Option<Admitted> {
    changes.recv_timeout(LIMIT).expect("a change")
}

/// The motion device's next request.
fn asked(end: &mut DeviceEnd) -> MotionRequest {
    let deadline = std::time::Instant::now() + LIMIT;
    loop {
        if let Some(request) = end.request() {
            return request;
        }
        assert!(std::time::Instant::now() < deadline, "nothing is asked");
        std::thread::sleep(Duration::from_micros(200));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn datagrams_pass_from_the_request_to_open_until_the_connection_has_ended() {
    let (server, mut end) = bind(84);
    let (changed, changes) = channel();
    let handle = spawn(server.on_admit(move |admitted| changed.send(admitted).unwrap())).unwrap();
    let mut client = Client::register(handle.address()).await;
    let local = *client.local().ip();

    // Taken, used from a port, lost.
    client.send_message(&motion_open(1)).await;
    let MotionRequest::Open(open) = asked(&mut end) else { panic!("a request to open") };
    let admitted = Admitted { address: local, port: None, connection_id: open.o_to_t_id };
    assert_eq!(changes.try_recv(), Ok(Some(admitted)), "before the motion device knows of it");
    end.reply(MotionReply::Opened { token: open.token, outcome: Ok(()) }).unwrap();
    assert_eq!(client.reply().await.outcome(), (0, 0));
    end.tell_owner_port(open.o_to_t_id, 2222);
    assert_eq!(next(&changes), Some(Admitted { port: Some(2222), ..admitted }));
    end.reply(MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_000 }).unwrap();
    assert_eq!(next(&changes), None);

    // Refused by the motion device.
    client.send_message(&motion_open(2)).await;
    let MotionRequest::Open(open) = asked(&mut end) else { panic!("a request to open") };
    let admitted = Admitted { connection_id: open.o_to_t_id, ..admitted };
    assert_eq!(next(&changes), Some(admitted), "the port of the connection before does not count");
    let outcome = Err(OpenRefusal { general_status: 0x10, extended_status: 0 });
    end.reply(MotionReply::Opened { token: open.token, outcome }).unwrap();
    assert_eq!(next(&changes), None);
    assert_eq!(client.reply().await.outcome().0, 0x10);

    // Closed by its originator.
    client.send_message(&motion_open(3)).await;
    let MotionRequest::Open(open) = asked(&mut end) else { panic!("a request to open") };
    assert_eq!(next(&changes), Some(Admitted { connection_id: open.o_to_t_id, ..admitted }));
    end.reply(MotionReply::Opened { token: open.token, outcome: Ok(()) }).unwrap();
    assert_eq!(client.reply().await.outcome(), (0, 0));
    client.send_message(&client::motion_close(3)).await;
    let MotionRequest::Close(close) = asked(&mut end) else { panic!("a request to close") };
    assert!(changes.try_recv().is_err(), "until the motion device has given it up");
    end.reply(MotionReply::Closed { token: close.token }).unwrap();
    assert_eq!(next(&changes), None);
    handle.stop().await;
}
