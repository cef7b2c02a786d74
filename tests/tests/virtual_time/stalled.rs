//! Clients of the explicit side that misbehave beside a machine in motion.

use std::cell::RefCell;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use axisbridge_tests::rig::motion::long_moves;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::device::adapter::{SESSIONS_KEPT, SESSIONS_MAX};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Everything that went over the bus, each frame with its time, and what the controller saw.
fn run(disturb: impl FnOnce(&mut Rig)) -> (Vec<(MonotonicTime, Vec<u8>)>, String, String) {
    let mut rig = Rig::ready(Settings::default());
    let (frames, clock) = (Rc::new(RefCell::new(Vec::new())), rig.clock());
    let log = Rc::clone(&frames);
    rig.tamper_frame = Some(Box::new(move |frame| {
        log.borrow_mut().push((clock.get(), frame.as_slice().to_vec()));
        true
    }));
    disturb(&mut rig);
    rig.connect(long_moves());
    let report = rig.run(DurationNs::from_secs(60));
    rig.tamper_frame = None;
    let frames = Rc::try_unwrap(frames).expect("nobody looks on any more").into_inner();
    (frames, rig.log(), format!("{report:?}"))
}

/// Another target's loop stood still until the rest of the packet came.
#[test]
fn clients_that_stall_after_four_bytes_delay_no_cycle() {
    let alone = run(|_| {});
    assert!(alone.0.len() > 1_000, "the bus ran: {} frames", alone.0.len());
    let disturbed = run(|rig| {
        // All streams there are for them: the first four bytes of a header, and no more.
        for client in 1..SESSIONS_MAX - SESSIONS_KEPT {
            let last = u8::try_from(client).expect("few clients");
            let peer = SocketAddrV4::new(Ipv4Addr::new(10, 0, 1, last), 40_000);
            let slot = rig.adapter.open(rig.now(), peer).expect("there is room");
            assert_eq!(rig.adapter.handle_stream(rig.now(), slot, &[0x65, 0, 4, 0]), 4);
        }
    });
    assert!(alone.1 == disturbed.1, "the controller sees the same:\n{}", disturbed.1);
    assert_eq!(alone.2, disturbed.2);
    let first = alone.0.iter().zip(&disturbed.0).position(|(one, other)| one != other);
    assert_eq!((first, alone.0.len()), (None, disturbed.0.len()), "every frame at its time with its bytes");
}
