use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use profile_cip::wire::ConnectionTriad;
use profile_sercos::port::Port;

use super::*;
use crate::capture::reader::Reader;
use crate::capture::recorder::Recorder;

/// A recording of two devices and two axes in 2 MB.
pub(crate) fn recording(directory: Option<PathBuf>) -> Arc<Recording> {
    let device =
        |name: &str, last| ContactDevice { name: name.to_owned(), address: Ipv4Addr::new(192, 0, 2, last) };
    Recording::new(Plan {
        span: DurationNs::from_secs(10),
        memory: 2_000_000,
        interfaces: Interfaces { can: vec!["can0, CANopen".to_owned()], ..Interfaces::default() },
        devices: vec![device("front", 1), device("back", 2)],
        axes: vec![("turntable".to_owned(), 0), ("slide".to_owned(), 1)],
        attributes: AttributeNames::default(),
        buses: vec!["SERCOS".to_owned(), "CAN bus 1".to_owned()],
        directory,
    })
}

/// Times of the frames of a file, in seconds.
fn times(file: &[u8]) -> Vec<u64> {
    let mut reader = Reader::new(file).unwrap();
    let mut times = Vec::new();
    while let Some(frame) = reader.next_frame().unwrap() {
        times.push(frame.at.unwrap().0 / 1_000_000_000);
    }
    times
}

const SECOND: u64 = 1_000_000_000;

#[test]
fn last_seconds_count_from_the_newest_frame_and_are_bounded() {
    let recording = recording(None);
    let mut sink = recording.sink();
    for second in 0..30 {
        sink.frame(KernelTime(second * SECOND), Side::South(Port::One), &[7; 60]);
    }
    assert_eq!(times(&recording.take(DurationNs::from_secs(2)).unwrap()), [27, 28, 29]);
    assert_eq!(times(&recording.take(DurationNs::from_secs(600)).unwrap()).len(), 11);
}

#[test]
fn one_file_is_made_at_a_time() {
    let recording = recording(None);
    let making = recording.begin().unwrap();
    assert!(matches!(recording.take(DurationNs::from_secs(1)), Err(TakeError::Busy)));
    drop(making);
    assert!(recording.take(DurationNs::from_secs(1)).is_ok());
    assert!(matches!(recording.take_contact(5), Err(TakeError::NoContact(5))));
}

#[test]
fn frames_come_from_the_taps_and_no_file_is_needed() {
    let recording = recording(None);
    let (recorder, mut taps) = Recorder::start_with(None, Some(recording.sink()), DEPTH, 1).unwrap();
    let peer = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 10), 50_000);
    let device = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 44_818);
    taps[0].frame(KernelTime(SECOND), Side::South(Port::Two), &[1; 60]);
    taps[0].datagram(KernelTime(2 * SECOND), peer, device, 0, &[2; 30]);
    let id = profile_generic::can::Id::Standard(0x181);
    let frame = profile_generic::can::Frame::new(id, &[1, 2]).unwrap();
    taps[0].can_frame(KernelTime(3 * SECOND), 0, &frame);
    taps[0].opened(KernelTime(4 * SECOND), peer, device);
    drop(taps);
    recorder.finish().unwrap();
    // The handshake of a stream is three frames.
    let file = recording.take(DurationNs::from_secs(10)).unwrap();
    assert_eq!(times(&file), [1, 2, 3, 4, 4, 4]);
}

#[test]
fn queues_of_a_large_gateway_are_shorter() {
    // A bus with one device, one bus with four, and 64 devices on nine buses.
    assert_eq!([3, 9, 137].map(depth), [256, 113, 64]);
}

#[test]
fn events_that_nobody_takes_are_bounded() {
    let recording = recording(None);
    let triad = ConnectionTriad { connection_serial: 1, originator_vendor: 1, originator_serial: 2 };
    for _ in 0..2 * INBOX_MAX {
        recording.note_event(0, &Event::MotionClosed { triad });
    }
    assert_eq!(lock(&recording.inbox).len(), INBOX_MAX);
    recording.sink().round(0);
    assert!(lock(&recording.inbox).is_empty());
}

#[test]
fn recording_of_a_fault_is_a_file_that_reads() {
    let folder = std::env::temp_dir().join(format!("axisbridge-recording-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let recording = recording(Some(folder.clone()));
    let now = realtime_now();
    recording.sink().frame(now, Side::South(Port::One), &[7; 60]);
    let fault = profile_generic::fault::Fault::new(
        profile_generic::fault::FaultCause::OVER_CURRENT,
        profile_generic::time::SystemTime(5),
    );
    recording.note(&Notice::Fault { axis: 0, fault, loss: None, trip: None, jump: None });
    assert!(!recording.is_unsaved(), "a second of frames comes first");
    while !recording.is_unsaved() {
        std::thread::sleep(Duration::from_millis(20));
    }
    recording.save();
    let files: Vec<_> = std::fs::read_dir(folder.join("recordings")).unwrap().flatten().collect();
    let [file] = &files[..] else { panic!("{files:?}") };
    assert!(file.file_name().to_string_lossy().ends_with("Z-turntable.pcapng"), "{file:?}");
    assert_eq!(times(&std::fs::read(file.path()).unwrap()).len(), 1);
    assert!(!recording.is_unsaved());
    std::fs::remove_dir_all(&folder).unwrap();
}
