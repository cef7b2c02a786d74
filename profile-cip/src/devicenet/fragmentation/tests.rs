use proptest::prelude::*;

use super::super::wire::fragment::FragmentKind::{Acknowledge, First, Last, Middle};
use super::*;

const OK: AcknowledgeStatus = AcknowledgeStatus::SUCCESS;

fn at(seconds: u64) -> MonotonicTime {
    MonotonicTime(seconds * 1_000_000_000)
}

fn fragment(kind: FragmentKind, count: u8) -> Fragment {
    Fragment { kind, count }
}

/// Carries a message from a sender to a receiver; `lost` says which acknowledges are lost, by their number.
fn carry(body: &[u8], lost: impl Fn(usize) -> bool) -> Result<(Vec<u8>, Vec<Fragment>), FragmentError> {
    let (mut sender, mut receiver) = (ExplicitSender::default(), ExplicitReceiver::default());
    let (mut now, mut seen, mut complete, mut number) = (at(0), Vec::new(), 0, 0);
    sender.start(body);
    while sender.is_active() {
        if let Some(part) = sender.poll(now) {
            assert!(part.data.len() <= FRAGMENT_MAX);
            seen.push(part.fragment);
            let received = receiver.handle(part.fragment, &part.data);
            assert_eq!(received.error, None);
            complete += usize::from(received.complete);
            let (count, status) = received.acknowledge.expect("every fragment is acknowledged");
            if !lost(number) {
                sender.handle(count, status)?;
            }
            number += 1;
        } else {
            now = sender.wake_at().expect("an acknowledge is missing");
            sender.handle_time(now)?;
        }
    }
    assert_eq!(complete, 1, "once and no more");
    Ok((receiver.body().to_vec(), seen))
}

#[test]
fn the_exchange_of_a_manual() {
    // Rockwell 1760-UM003A, 4-12: request 80 00 32 C2 05 00 05 00, acknowledge C0 00, 80 81 00 .., acknowledge C1 00.
    let body = [0x32, 0xC2, 0x05, 0x00, 0x05, 0x00, 0x00, 0x00, 0x00, 0x00];
    let mut sender = ExplicitSender::default();
    sender.start(&body);
    let first = sender.poll(at(0)).unwrap();
    assert_eq!((first.fragment.byte(), &first.data[..]), (0x00, &body[..6]));
    assert_eq!(sender.poll(at(0)), None, "not before the acknowledge");
    assert_eq!(sender.handle(0, OK), Ok(false));
    let last = sender.poll(at(0)).unwrap();
    assert_eq!((last.fragment.byte(), &last.data[..]), (0x81, &body[6..]));
    assert_eq!(sender.handle(1, OK), Ok(true));
    assert!(!sender.is_active());
}

#[test]
fn counts_go_on_past_63() {
    let body: Vec<u8> = (0..EXPLICIT_MAX).map(|byte| byte.to_le_bytes()[0]).collect();
    let (got, seen) = carry(&body, |_| false).unwrap();
    assert_eq!(got, body);
    assert_eq!(seen.len(), 86);
    assert_eq!((seen[0], seen[1]), (fragment(First, 0), fragment(Middle, 1)));
    assert_eq!((seen[63], seen[64]), (fragment(Middle, 63), fragment(Middle, 0)));
    assert_eq!(seen[85], fragment(Last, 21));
}

#[test]
fn a_lost_acknowledge_is_repeated_and_the_message_comes_once() {
    for lost in 0..4 {
        let (got, seen) = carry(&[7; 20], |number| number == lost).unwrap();
        assert_eq!((got, seen.len()), (vec![7; 20], 5), "acknowledge {lost}");
        assert_eq!(seen[lost], seen[lost + 1]);
    }
    // Each time: the fragment twice, then the end.
    assert_eq!(carry(&[7; 20], |_| true), Err(FragmentError::NoAcknowledge { count: 0 }));
    assert_eq!(carry(&[7; 20], |number| number > 1), Err(FragmentError::NoAcknowledge { count: 2 }));
}

#[test]
fn a_sender_gives_up_after_two_seconds_and_not_before() {
    let mut sender = ExplicitSender::default();
    assert_eq!(sender.wake_at(), None);
    sender.start(&[0; 9]);
    assert!(sender.poll(at(5)).is_some());
    assert_eq!(sender.wake_at(), Some(at(6)));
    assert_eq!((sender.handle_time(MonotonicTime(at(6).0 - 1)), sender.poll(at(6))), (Ok(()), None));
    assert_eq!(sender.handle_time(at(6)), Ok(()));
    assert_eq!(sender.poll(at(6)).map(|part| part.fragment), Some(fragment(First, 0)), "once more");
    assert_eq!(sender.handle_time(at(7)), Err(FragmentError::NoAcknowledge { count: 0 }));
    assert!(!sender.is_active());
    assert_eq!(sender.poll(at(8)), None);
}

#[test]
fn a_sender_ends_the_message_on_a_wrong_acknowledge() {
    let begun = || {
        let mut sender = ExplicitSender::default();
        sender.start(&[0; 20]);
        sender.poll(at(0)).unwrap();
        sender.handle(0, OK).unwrap();
        sender.poll(at(0)).unwrap();
        sender
    };
    let cases = [
        (5, OK, Err(FragmentError::Count { expected: 1, found: 5 })),
        (1, AcknowledgeStatus::TOO_MUCH_DATA, Err(FragmentError::Refused)),
        (1, AcknowledgeStatus(9), Err(FragmentError::Status(9))),
        // The acknowledge of the fragment before, because that was sent twice.
        (0, OK, Ok(false)),
        (1, OK, Ok(false)),
    ];
    for (count, status, outcome) in cases {
        let mut sender = begun();
        assert_eq!(sender.handle(count, status), outcome, "{count} {status}");
        assert_eq!(sender.is_active(), outcome.is_ok());
    }
    let mut sender = begun();
    sender.handle(1, OK).unwrap();
    assert_eq!(sender.handle(2, OK), Err(FragmentError::Unasked { found: 2 }), "not sent yet");
    assert!(sender.is_active(), "and nothing is lost by it");
    sender.abandon();
    assert_eq!(sender.handle(2, OK), Err(FragmentError::Unasked { found: 2 }));
}

#[test]
fn a_receiver_drops_what_is_out_of_order() {
    let mut receiver = ExplicitReceiver::default();
    let mut take = |kind, count| {
        let received = receiver.handle(fragment(kind, count), &[count; 3]);
        (received.acknowledge.map(|(count, _)| count), received.complete, received.error)
    };
    let none = |found| (None, false, Some(FragmentError::NoBeginning { found }));
    assert_eq!(take(Middle, 1), none(1));
    assert_eq!(take(Last, 0), none(0));
    assert_eq!(take(First, 2), (None, false, Some(FragmentError::Count { expected: 0, found: 2 })));
    assert_eq!(take(First, 0), (Some(0), false, None));
    assert_eq!(take(Middle, 2), (None, false, Some(FragmentError::Count { expected: 1, found: 2 })));
    assert_eq!(take(Middle, 1), none(1), "the message is gone");
    assert_eq!(take(First, 0), (Some(0), false, None));
    assert_eq!(take(First, 0), (Some(0), false, None), "starts anew");
    assert_eq!(take(Middle, 1), (Some(1), false, None));
    assert_eq!(take(Middle, 1), (Some(1), false, None), "the acknowledge was lost");
    assert_eq!(take(Last, 2), (Some(2), true, None));
    assert_eq!(take(Last, 2), (Some(2), false, None), "the acknowledge was lost");
    assert_eq!(take(Middle, 3), none(3));
    assert_eq!(receiver.body(), [0, 0, 0, 1, 1, 1, 2, 2, 2]);
}

#[test]
fn a_receiver_says_what_it_has_no_room_for() {
    let mut receiver = ExplicitReceiver::default();
    let mut count = 0;
    let mut kind = First;
    for _ in 0..EXPLICIT_MAX / 6 {
        assert_eq!(receiver.handle(fragment(kind, count), &[1; 6]).error, None);
        (kind, count) = (Middle, Fragment::next(count));
    }
    let received = receiver.handle(fragment(Middle, count), &[1; 6]);
    assert_eq!(received.acknowledge, Some((count, AcknowledgeStatus::TOO_MUCH_DATA)));
    assert_eq!(received.error, Some(FragmentError::TooLong { max: EXPLICIT_MAX }));
    let after = receiver.handle(fragment(Last, Fragment::next(count)), &[1; 6]);
    assert!(after.error.is_some() && !after.complete);
}

#[test]
fn io_messages_of_manuals() {
    // ICP DAS I-7242D, 7.2.11: ten bytes.
    let data = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10];
    let frames: Vec<Vec<u8>> = IoFrames::new(10, &data).map(|frame| frame.to_vec()).collect();
    assert_eq!(frames, [vec![0x00, 1, 2, 3, 4, 5, 6, 7], vec![0x81, 8, 9, 10]]);
    let frames: Vec<usize> = IoFrames::new(16, &[0; 16]).map(|frame| frame.len()).collect();
    assert_eq!(frames, [8, 8, 3], "the fixed CIP Motion connection");
    let one: Vec<Vec<u8>> = IoFrames::new(16, &data[..7]).map(|frame| frame.to_vec()).collect();
    assert_eq!(one, [vec![0x3F, 1, 2, 3, 4, 5, 6, 7]]);
    let plain: Vec<Vec<u8>> = IoFrames::new(8, &data[..8]).map(|frame| frame.to_vec()).collect();
    assert_eq!(plain, [data[..8].to_vec()]);
    for size in [0, 8, 16] {
        assert_eq!(IoFrames::new(size, &[]).map(|frame| frame.len()).collect::<Vec<_>>(), [0]);
    }
}

#[test]
fn io_fragments_out_of_order_are_dropped() {
    let mut receiver = IoReceiver::default();
    let mut take = |kind, count: u8, len: usize| {
        let mut frame = vec![fragment(kind, count).byte()];
        frame.extend(vec![count; len]);
        receiver.handle(16, &frame)
    };
    let none = |found| Err(FragmentError::NoBeginning { found });
    assert_eq!(take(Middle, 1, 7), none(1));
    assert_eq!(take(First, 1, 7), Err(FragmentError::Count { expected: 0, found: 1 }));
    assert_eq!(take(First, 0, 7), Ok(false));
    assert_eq!(take(Last, 2, 2), Err(FragmentError::Count { expected: 1, found: 2 }));
    assert_eq!(take(Middle, 1, 7), none(1), "the message is gone");
    assert_eq!(take(First, 0, 7), Ok(false));
    assert_eq!(take(First, 0, 7), Ok(false), "starts anew");
    assert_eq!(take(Middle, 1, 7), Ok(false));
    assert_eq!(take(Acknowledge, 1, 1), Err(FragmentError::Unasked { found: 1 }));
    assert_eq!(take(Last, 2, 2), none(2));
    for kind in [First, Middle] {
        assert_eq!(take(kind, u8::from(kind == Middle), 7), Ok(false));
    }
    assert_eq!(take(Last, 2, 3), Err(FragmentError::TooLong { max: 16 }), "17 bytes on a connection of 16");
    assert_eq!(take(First, ONLY, 5), Ok(true));
    assert_eq!(receiver.data(), [ONLY; 5]);
    assert_eq!(receiver.handle(16, &[]), Ok(true));
    assert_eq!(receiver.data(), []);
    assert_eq!(receiver.handle(4, &[0; 5]), Err(FragmentError::TooLong { max: 4 }));
    assert_eq!(receiver.handle(8, &[0x81, 2]), Ok(true), "no fragmentation byte up to 8 bytes");
    assert_eq!(receiver.data(), [0x81, 2]);
}

proptest! {
    #[test]
    fn explicit_messages_arrive_whole(body in prop::collection::vec(any::<u8>(), 8..EXPLICIT_MAX), lost in prop::collection::vec(any::<bool>(), 200)) {
        // Never two lost ones in a row: the sender gives up then.
        let lose = |number: usize| number % 2 == 1 && lost.get(number).copied().unwrap_or(false);
        prop_assert_eq!(carry(&body, lose).unwrap().0, body);
    }

    #[test]
    fn io_messages_arrive_whole(data in prop::collection::vec(any::<u8>(), 0..=IO_MAX)) {
        let mut receiver = IoReceiver::default();
        let frames: Vec<_> = IoFrames::new(IO_MAX, &data).collect();
        let outcomes: Vec<_> = frames.iter().map(|frame| receiver.handle(IO_MAX, frame)).collect();
        prop_assert_eq!(outcomes.iter().filter(|outcome| **outcome == Ok(true)).count(), 1);
        prop_assert_eq!(outcomes.last(), Some(&Ok(true)));
        prop_assert_eq!(receiver.data(), &data[..]);
    }

    #[test]
    fn any_frames_are_borne(size in 0_usize..80, frames in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=8), 0..40)) {
        let (mut io, mut explicit) = (IoReceiver::default(), ExplicitReceiver::default());
        let mut sender = ExplicitSender::default();
        sender.start(&[0; 40]);
        for frame in frames {
            let _ = io.handle(size, &frame);
            prop_assert!(io.data().len() <= IO_MAX);
            if let Some((byte, data)) = frame.split_first() {
                explicit.handle(Fragment::parse(*byte), data);
                let _ = sender.handle(*byte & 0x3F, AcknowledgeStatus(data.len().to_le_bytes()[0]));
                sender.poll(at(0));
            }
        }
    }
}
